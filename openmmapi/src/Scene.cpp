// SPDX-License-Identifier: MIT
#include "openmmpse/internal/Scene.h"
#include "openmm/MonteCarloAnisotropicBarostat.h"
#include "openmm/MonteCarloBarostat.h"
#include "openmm/MonteCarloFlexibleBarostat.h"
#include "openmm/MonteCarloMembraneBarostat.h"
#include "openmm/OpenMMException.h"
#include <sstream>

using namespace OpenMM;
using std::string;

namespace PSE {

namespace {

[[noreturn]] void refuse(const string& message) {
    throw OpenMMException("PSEBrownianIntegrator: " + message);
}

const char* nameOfBarostat(const Force& force) {
    if (dynamic_cast<const MonteCarloBarostat*>(&force) != NULL)
        return "MonteCarloBarostat";
    if (dynamic_cast<const MonteCarloAnisotropicBarostat*>(&force) != NULL)
        return "MonteCarloAnisotropicBarostat";
    if (dynamic_cast<const MonteCarloMembraneBarostat*>(&force) != NULL)
        return "MonteCarloMembraneBarostat";
    if (dynamic_cast<const MonteCarloFlexibleBarostat*>(&force) != NULL)
        return "MonteCarloFlexibleBarostat";
    return NULL;
}

void checkSystem(const System& system, const PSEBrownianIntegrator& integrator) {
    if (system.getNumParticles() == 0)
        refuse("the System has no particles; add at least one with System.addParticle");
    if (system.getNumConstraints() > 0) {
        std::ostringstream message;
        message << "the System has " << system.getNumConstraints()
                << " constraints, and constrained dynamics with hydrodynamics "
                << "is not available; use stiff bonds instead (create the System with "
                   "constraints=None, rigidWater=False)";
        refuse(message.str());
    }
    for (const auto& own : integrator.getParticleRadii())
        if (own.first >= system.getNumParticles()) {
            std::ostringstream message;
            message << "setParticleRadius was called for particle " << own.first
                    << "; the System has particles 0 to " << system.getNumParticles() - 1;
            refuse(message.str());
        }
}

void chooseBoundary(const System& system, const PSEBrownianIntegrator& integrator, Scene& scene) {
    const auto boundary = integrator.getFluidBoundary();
    const bool automatic = (boundary == PSEBrownianIntegrator::Automatic);
    const bool periodicForce = system.usesPeriodicBoundaryConditions();
    scene.unbounded = (automatic ? !periodicForce : boundary == PSEBrownianIntegrator::Unbounded);
    if (!automatic)
        scene.boundaryReason = "as set by setFluidBoundary";
    else if (periodicForce)
        scene.boundaryReason = "because a Force uses periodic boundary conditions";
    else
        scene.boundaryReason = "because no Force uses periodic boundary conditions";
}

bool equalRadii(const Scene& scene) {
    for (double radius : scene.radii)
        if (radius != scene.radii[0])
            return false;
    return true;
}

/** What force coupling cannot do in a periodic fluid where Rotne-Prager-Yamakawa can. */
void checkForceCoupling(const Scene& scene) {
    for (size_t i = 0; i < scene.radii.size(); i++)
        if (scene.radii[i] != scene.radii[0]) {
            std::ostringstream message;
            message << "setParticleRadius: particle " << scene.mobile[i] << " has radius "
                    << scene.radii[i] << " nm, particle " << scene.mobile[0] << " has "
                    << scene.radii[0] << " nm, and unequal radii are not available with "
                    << "ForceCoupling in a periodic fluid; give all particles one radius, or use "
                       "setMobilityModel(RotnePragerYamakawa) or setFluidBoundary(Unbounded)";
            refuse(message.str());
        }
}

} // namespace

void requireShear(const Scene& scene) {
    if (!scene.barostat.empty())
        refuse("setShearRate: the System has a " + scene.barostat +
               ", and a box cannot be sheared and moved by a barostat at once; remove that Force, "
               "or set the shear rate to 0");
}

Scene makeScene(const System& system, const PSEBrownianIntegrator& integrator) {
    checkSystem(system, integrator);
    Scene scene;
    for (int i = 0; i < system.getNumForces(); i++)
        if (const char* name = nameOfBarostat(system.getForce(i)))
            scene.barostat = name;
    if (integrator.getShearRate() != 0)
        requireShear(scene);
    for (int i = 0; i < system.getNumParticles(); i++) {
        if (system.getParticleMass(i) == 0) {
            scene.numMassless++;
            continue;
        }
        scene.mobile.push_back(i);
        scene.radii.push_back(integrator.getParticleRadius(i));
    }
    const auto model = integrator.getMobilityModel();
    scene.hydrodynamics = (model != PSEBrownianIntegrator::FreeDraining);
    scene.forceCoupling = (model == PSEBrownianIntegrator::ForceCoupling);
    if (scene.hydrodynamics) {
        chooseBoundary(system, integrator, scene);
        if (scene.forceCoupling && !scene.unbounded)
            checkForceCoupling(scene);
        scene.model = string(scene.forceCoupling ? "force coupling by Gaussian envelopes, "
                                                 : "Rotne-Prager-Yamakawa, ") +
                      (equalRadii(scene) ? "equal radii" : "unequal radii");
    }
    scene.periodicBox =
        (scene.hydrodynamics && !scene.unbounded) || system.usesPeriodicBoundaryConditions();
    return scene;
}

} // namespace PSE
