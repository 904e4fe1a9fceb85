// SPDX-License-Identifier: MIT
// Steps whose instructions callgrind counts; benchmarks/instruction_counts.py runs this program.
// One thread, fixed seeds, one instruction set: the counts are the same from run to run.
#include "Scenes.h"
#include <cstdio>
#include <cstdlib>
#include <fftw3.h>
#include <gnu/libc-version.h>
#include <hwy/highway.h>
#include <iostream>
#include <valgrind/callgrind.h>

using namespace OpenMM;
using namespace PSE::benchmarks;
using PSE::PSEBrownianIntegrator;

namespace {

constexpr int STEPS = 5;
/// dt D0/a^2 so small that rounding elsewhere leads no trajectory astray
constexpr double SHORT_STEP = 1e-6;
constexpr double BOX_OF_CHAIN = 60; ///< nm: thin, as for a molecule in its solvent
constexpr double STRAIN = 0.02;     ///< per step: none of those counted flips the box

/** What a case has besides equal spheres in a still periodic fluid. */
enum class Effect { None, FiveRadii, Shear, Unbounded, ForceCoupling, FreeDraining };

/** What is simulated. */
struct Case {
    const char* name;
    int particles;
    double phi; ///< volume fraction of a suspension; 0: a compact chain
    double tolerance;
    bool thermal;
    Effect effect = Effect::None;
};

constexpr Case CASES[] = {
    {"suspension 1e-3 with noise", 1000, 0.1, 1e-3, true},
    {"suspension 1e-3 without noise", 1000, 0.1, 1e-3, false},
    {"suspension 1e-6 with noise", 500, 0.1, 1e-6, true},
    {"suspension 1e-6 without noise", 500, 0.1, 1e-6, false},
    {"chain 1e-3 with noise", 200, 0, 1e-3, true},
    {"five radii 1e-3 with noise", 1000, 0.1, 1e-3, true, Effect::FiveRadii},
    {"sheared 1e-3 with noise", 1000, 0.1, 1e-3, true, Effect::Shear},
    {"sheared 1e-3 without noise", 1000, 0.1, 1e-3, false, Effect::Shear},
    {"unbounded chain 1e-3 with noise", 200, 0, 1e-3, true, Effect::Unbounded},
    {"force coupling 1e-3 with noise", 1000, 0.1, 1e-3, true, Effect::ForceCoupling},
    {"free draining", 1000, 0.1, 1e-3, true, Effect::FreeDraining},
};

/** Constant forces that cost next to nothing: what is counted is the fluid. */
void addConstantForces(System& system, int n) {
    auto* pull = new CustomExternalForce("-(fx*x+fy*y+fz*z)");
    for (const char* name : {"fx", "fy", "fz"})
        pull->addPerParticleParameter(name);
    Uniform random(2);
    for (int i = 0; i < n; i++) {
        const Vec3 f = random.vector(1);
        pull->addParticle(i, {f[0], f[1], f[2]});
    }
    system.addForce(pull);
}

void addBonds(System& system, int n) {
    auto* bonds = new HarmonicBondForce();
    for (int i = 1; i < n; i++)
        bonds->addBond(i - 1, i, 2 * RADIUS, 100);
    bonds->setUsesPeriodicBoundaryConditions(true);
    system.addForce(bonds);
}

void addEffect(PSEBrownianIntegrator& integrator, const Case& scene) {
    integrator.setFluidBoundary(PSEBrownianIntegrator::Periodic);
    if (scene.effect == Effect::Unbounded)
        integrator.setFluidBoundary(PSEBrownianIntegrator::Unbounded);
    if (scene.effect == Effect::FiveRadii)
        for (int i = 0; i < scene.particles; i++) // 1:2, the mean is that of the other cases
            integrator.setParticleRadius(i, RADIUS * (4 + i % 5) / 6);
    if (scene.effect == Effect::Shear)
        integrator.setShearRate(STRAIN / integrator.getStepSize());
    if (scene.effect == Effect::ForceCoupling)
        integrator.setMobilityModel(PSEBrownianIntegrator::ForceCoupling);
    if (scene.effect == Effect::FreeDraining)
        integrator.setMobilityModel(PSEBrownianIntegrator::FreeDraining);
}

/** Counted: STEPS steps. */
void run(const Case& scene) {
    const bool chain = (scene.phi == 0);
    const int n = scene.particles;
    const double length = (chain ? BOX_OF_CHAIN : boxLength(n, scene.phi));
    const std::unique_ptr<System> system = cubicSystem(n, length);
    if (chain)
        addBonds(*system, n);
    else
        addConstantForces(*system, n);
    PSEBrownianIntegrator integrator(scene.thermal ? TEMPERATURE : 0, VISCOSITY, RADIUS,
                                     diffusiveStep(SHORT_STEP));
    integrator.setErrorTolerance(scene.tolerance);
    addEffect(integrator, scene);
    integrator.setRandomNumberSeed(1);
    Context context(*system, integrator, Platform::getPlatformByName("CPU"), {{"Threads", "1"}});
    const std::vector<Vec3> positions = (chain ? compactChain(n) : jitteredLattice(n, scene.phi, true));
    context.setPositions(positions);
    integrator.step(1); // allocates what later steps use again
    CALLGRIND_START_INSTRUMENTATION;
    integrator.step(STEPS);
    CALLGRIND_STOP_INSTRUMENTATION;
}

/** What counts depend on besides our sources, as one line of JSON. */
void printEnvironment() {
    // Better targets than AVX2 have been disabled: the best of the rest is the one in use.
    const int64_t best = hwy::SupportedTargets() & -hwy::SupportedTargets();
    std::printf("{\"target\": \"%s\", \"OpenMM\": \"%s\", \"FFTW\": \"%s\", \"Highway\": "
                "\"%d.%d.%d\", \"compiler\": \"%s\", \"libc\": \"%s\"}\n",
                hwy::TargetName(best), Platform::getOpenMMVersion().c_str(), fftwf_version,
                HWY_MAJOR, HWY_MINOR, HWY_PATCH, __VERSION__, gnu_get_libc_version());
}

} // namespace

int main(int argc, char** argv) {
#if HWY_ARCH_X86
    hwy::DisableTargets(HWY_AVX2 - 1); // all that are better: the same on every machine
#endif
    const std::string wish = (argc == 2 ? argv[1] : "");
    try {
        if (wish == "--environment") {
            printEnvironment();
            return 0;
        }
        if (wish == "--list") {
            for (const Case& scene : CASES)
                std::printf("%s\n", scene.name);
            return 0;
        }
        for (const Case& scene : CASES)
            if (wish == scene.name) {
                const char* folders = std::getenv("OPENMM_PLUGIN_DIR");
                loadPlugins(folders == nullptr ? PSE_PLUGIN_FOLDERS : folders);
                run(scene);
                return 0;
            }
        std::cerr << "usage: counted_steps --environment | --list | NAME OF A CASE\n";
    } catch (const std::exception& error) {
        std::cerr << "counted_steps: " << error.what() << "\n";
    }
    return 2;
}
