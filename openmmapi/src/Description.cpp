// SPDX-License-Identifier: MIT
#include "openmmpse/internal/Scene.h"
#include "openmmpse/internal/Units.h"
#include <cmath>
#include <iomanip>
#include <set>
#include <sstream>

using std::endl;

namespace PSE {

namespace {

/// rms displacement per step over a that is flagged
constexpr double LARGE_STEP = 0.3;

void describeFluid(std::ostream& out, const PSEBrownianIntegrator& integrator, double a) {
    const double kT = KT_PER_KELVIN * integrator.getTemperature(), eta = integrator.getViscosity(),
                 dt = integrator.getStepSize();
    const double d0 = kT / (6 * M_PI * eta * a); // nm^2/ps
    const double rms = std::sqrt(6 * d0 * dt) / a;
    out << "solvent: temperature " << integrator.getTemperature() << " K, viscosity " << eta
        << " Da/(nm ps) = " << eta * MPAS_PER_MD_VISCOSITY << " mPa s" << endl;
    out << "single particle: radius a = " << a << " nm, D0 = kT/(6 pi eta a) = " << 1000 * d0
        << " nm^2/ns = " << 1e-6 * d0 << " m^2/s" << endl;
    out << "step: dt = " << dt << " ps, dt D0/a^2 = " << dt * d0 / (a * a)
        << ", rms displacement per step " << rms << " a" << endl;
    if (rms > LARGE_STEP)
        out << "WARNING: the rms displacement per step of " << rms << " a exceeds " << LARGE_STEP
            << " a; use a smaller step size, or check the viscosity (water has 603 Da/(nm ps) = "
               "1.002 mPa s at 20 C)"
            << endl;
}

void describeGrid(std::ostream& out, const NumericalParameters& p) {
    if (p.realCutoff > 0)
        out << ", xi = " << p.xi << " /nm, real-space cutoff " << p.realCutoff << " nm";
    out << ", grid " << p.gridDimensions[0] << " x " << p.gridDimensions[1] << " x "
        << p.gridDimensions[2] << ", window support " << p.windowSupport;
}

void describeNumerics(std::ostream& out, const PSEBrownianIntegrator& integrator,
                      const NumericalParameters& p) {
    out << "numerics: tolerance " << integrator.getErrorTolerance() << ", predicted error "
        << p.predictedError;
    if (p.split != "none")
        describeGrid(out, p);
    else
        out << ", direct sums over all pairs";
    if (p.lanczosTolerance > 0)
        out << ", Lanczos tolerance " << p.lanczosTolerance;
    out << ", " << p.precision << " precision";
    if (!p.instructions.empty())
        out << ", " << p.instructions << " instructions";
    out << endl;
}

void describeSplit(std::ostream& out, const NumericalParameters& p) {
    const bool clause = p.splitReason.rfind("because", 0) == 0;
    out << "split: " << (p.realCutoff > 0 ? p.split + " split" : "none, all by waves (AllWaves)")
        << (clause ? ", " : " (") << p.splitReason << (clause ? "" : ")");
    if (p.prolateBandwidth > 0)
        out << ", range 1/xi = " << 1 / p.xi << " nm, bandwidth " << p.prolateBandwidth;
    out << endl;
}

void describeRadii(std::ostream& out, const Scene& scene, const NumericalParameters& p) {
    const std::set<double> distinct(scene.radii.begin(), scene.radii.end());
    if (distinct.size() < 2)
        return;
    out << "unequal radii: " << distinct.size() << " distinct, from " << *distinct.begin() << " to "
        << *distinct.rbegin() << " nm, because setParticleRadius was called";
    if (p.radiusFunctions > 0)
        out << "; pairs are interpolated by " << p.radiusFunctions << " functions of the radius";
    else if (p.realCutoff > 0)
        out << "; each is a class of its own";
    out << endl;
}

void describeShear(std::ostream& out, const Scene& scene, const PSEBrownianIntegrator& integrator,
                   double strain) {
    using Pse = PSEBrownianIntegrator;
    const double rate = integrator.getShearRate(), time = integrator.getShearTime();
    if (rate == 0)
        out << "shear flow: off, because the shear rate is 0";
    else {
        const bool oscillates = (integrator.getShearProtocol() == Pse::OscillatoryShear);
        out << "shear flow: on (";
        if (oscillates)
            out << "oscillatory with period " << time << " ps";
        else if (integrator.getShearProtocol() == Pse::StartUpShear)
            out << "from time " << time << " ps on";
        else
            out << "steady";
        out << (scene.periodicBox ? ", the box tilts with it" : ", no box") << "), because the "
            << (oscillates ? "largest " : "") << "shear rate of " << rate << " /ps is not 0";
    }
    if (rate != 0 || strain != 0)
        out << "; strain so far " << strain;
    out << endl;
    if (!scene.barostat.empty())
        out << "box: moves, because the System has a " << scene.barostat << endl;
}

void describeStages(std::ostream& out, const std::vector<StageTime>& stages) {
    double total = 0;
    for (const StageTime& stage : stages)
        total += stage.seconds;
    if (total <= 0) {
        out << "cost: no step taken yet" << endl;
        return;
    }
    out << "cost of the steps so far, without the Forces:" << std::fixed << std::setprecision(0);
    const char* separator = " ";
    for (const StageTime& stage : stages) {
        out << separator << stage.stage << " " << 100 * stage.seconds / total << " %";
        separator = ", ";
    }
    out << endl;
    out.unsetf(std::ios::fixed);
}

} // namespace

std::string describeScene(const Scene& scene, const PSEBrownianIntegrator& integrator,
                          const NumericalParameters& parameters,
                          const std::vector<StageTime>& stages, double strain) {
    std::ostringstream out;
    out << std::setprecision(4);
    const double a = scene.radii.empty() ? integrator.getRadius() : scene.radii[0];
    if (scene.hydrodynamics)
        out << "hydrodynamic interactions: on (" << scene.model
            << "), because the mobility model is not FreeDraining" << endl
            << "fluid: "
            << (scene.unbounded ? "unbounded, whatever the box of the Context, "
                                : "periodic in the box of the Context, ")
            << scene.boundaryReason << endl;
    else
        out << "hydrodynamic interactions: off, because the mobility model is FreeDraining: "
               "M = 1/(6 pi eta a)"
            << endl;
    if (integrator.getTemperature() > 0)
        out << "thermal noise: on (seed " << parameters.randomSeed
            << "), because the temperature of " << integrator.getTemperature() << " K is above 0"
            << endl;
    else
        out << "thermal noise: off, because the temperature is 0" << endl;
    describeShear(out, scene, integrator, strain);
    out << "particles: " << scene.mobile.size() << " mobile, " << scene.numMassless
        << " massless (they do not move and are transparent to the fluid)" << endl;
    describeRadii(out, scene, parameters);
    describeFluid(out, integrator, a);
    if (scene.hydrodynamics && !scene.mobile.empty()) {
        if (parameters.split != "none")
            describeSplit(out, parameters);
        describeNumerics(out, integrator, parameters);
    }
    describeStages(out, stages);
    return out.str();
}

} // namespace PSE
