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

void checkSettings(const PSEBrownianIntegrator& integrator) {
    if (integrator.getMobilityModel() == PSEBrownianIntegrator::ForceCoupling)
        refuse("setMobilityModel(ForceCoupling): this mobility is not available; use "
               "RotnePragerYamakawa or FreeDraining");
}

void chooseBoundary(const System& system, const PSEBrownianIntegrator& integrator, Scene& scene) {
    const auto boundary = integrator.getFluidBoundary();
    const bool automatic = (boundary == PSEBrownianIntegrator::Automatic);
    const bool periodicForce = system.usesPeriodicBoundaryConditions();
    scene.unbounded = (automatic ? !periodicForce : boundary == PSEBrownianIntegrator::Unbounded);
    if (scene.unbounded &&
        integrator.getMobilityModel() == PSEBrownianIntegrator::ForceCoupling)
        refuse("setMobilityModel(ForceCoupling): this mobility is not available in an unbounded "
               "fluid; use RotnePragerYamakawa, or setFluidBoundary(Periodic)");
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

} // namespace

void requireShear(const Scene& scene) {
    if (!scene.barostat.empty())
        refuse("setShearRate: the System has a " + scene.barostat +
               ", and a box cannot be sheared and moved by a barostat at once; remove that Force, "
               "or set the shear rate to 0");
}

Scene makeScene(const System& system, const PSEBrownianIntegrator& integrator) {
    checkSystem(system, integrator);
    checkSettings(integrator);
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
    scene.hydrodynamics =
        (integrator.getMobilityModel() == PSEBrownianIntegrator::RotnePragerYamakawa);
    if (scene.hydrodynamics) {
        chooseBoundary(system, integrator, scene);
        scene.modelReason = string("Rotne-Prager-Yamakawa, ") +
                            (equalRadii(scene) ? "equal radii" : "unequal radii");
    } else
        scene.modelReason = "setMobilityModel(FreeDraining) was called";
    scene.periodicBox =
        (scene.hydrodynamics && !scene.unbounded) || system.usesPeriodicBoundaryConditions();
    return scene;
}

} // namespace PSE
