// SPDX-License-Identifier: MIT
// Whole steps through the public API, beside openmm::BrownianIntegrator on the same System; and the
// main program.
#include "Bench.h"
#include <cstdio>
#include <cstdlib>
#include <fstream>

using namespace OpenMM;

namespace PSE::benchmarks {

namespace {

constexpr double MASS = 100;           ///< Da; of a sphere with this drag it changes nothing
constexpr double STEP_FRACTION = 1e-3; ///< dt D0/a^2
/// particle-steps before timing: contacts become those of the dynamics
constexpr int WARM_UP = 320000;

/** Repulsion of spheres that touch (WCA): epsilon = kT, sigma = 2a/2^(1/6), cut off at 2a. */
void addRepulsion(System& system) {
    std::ostringstream energy;
    energy.precision(17);
    energy << KT << "*(4*(s^12-s^6)+1); s=" << 2 * RADIUS / std::pow(2.0, 1.0 / 6) << "/r";
    auto* repulsion = new CustomNonbondedForce(energy.str());
    repulsion->setNonbondedMethod(CustomNonbondedForce::CutoffPeriodic);
    repulsion->setCutoffDistance(2 * RADIUS);
    for (int i = 0; i < system.getNumParticles(); i++)
        repulsion->addParticle();
    system.addForce(repulsion);
}

/** A constant force on one particle: the solvent has forces to carry, which cost nothing. */
void addPull(System& system) {
    auto* pull = new CustomExternalForce("-x");
    pull->addParticle(0);
    system.addForce(pull);
}

/** The most memory this process has held so far (bytes). */
double peakMemory() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
        if (line.compare(0, 6, "VmHWM:") == 0)
            return 1024 * std::stod(line.substr(6));
    return 0;
}

/** Counters: particle-steps per second; peak memory, of use if the process runs nothing else. */
void timeSteps(benchmark::State& state, const Arguments& arguments, System& system,
               Integrator& integrator) {
    Context context(system, integrator, Platform::getPlatformByName("CPU"),
                    {{"Threads", std::to_string(arguments.threads)}});
    context.setPositions(jitteredLattice(arguments.particles, arguments.phi, true));
    integrator.step(1 + WARM_UP / arguments.particles);
    for (auto _ : state)
        integrator.step(1);
    state.counters["PTPS"] =
        benchmark::Counter(arguments.particles, benchmark::Counter::kIsIterationInvariantRate);
    state.counters["peak bytes"] = peakMemory();
}

void brownian(benchmark::State& state) {
    const Arguments arguments(state);
    const auto system = cubicSystem(arguments.particles, arguments.length());
    for (int i = 0; i < arguments.particles; i++)
        system->setParticleMass(i, MASS);
    addRepulsion(*system);
    BrownianIntegrator integrator(TEMPERATURE, DRAG / MASS, diffusiveStep(STEP_FRACTION));
    timeSteps(state, arguments, *system, integrator);
}

template <PSEBrownianIntegrator::Split SPLIT, bool REPULSION>
void hydrodynamic(benchmark::State& state) {
    const Arguments arguments(state);
    const auto system = cubicSystem(arguments.particles, arguments.length());
    REPULSION ? addRepulsion(*system) : addPull(*system);
    try {
        const auto integrator = integratorFor(arguments, SPLIT);
        timeSteps(state, arguments, *system, *integrator);
    } catch (const OpenMMException& refusal) {
        state.SkipWithError(refusal.what());
    }
}

} // namespace

std::unique_ptr<PSEBrownianIntegrator> integratorFor(const Arguments& arguments,
                                                     PSEBrownianIntegrator::Split split) {
    auto integrator = std::make_unique<PSEBrownianIntegrator>(TEMPERATURE, VISCOSITY, RADIUS,
                                                              diffusiveStep(STEP_FRACTION));
    integrator->setErrorTolerance(arguments.tolerance);
    integrator->setFluidBoundary(PSEBrownianIntegrator::Periodic);
    integrator->setSplit(split);
    integrator->setRandomNumberSeed(1);
    return integrator;
}

void addSteps(const SceneList& scenes) {
    using Pse = PSEBrownianIntegrator;
    add("step/BrownianIntegrator", brownian, scenes);
    add("step/PSEBrownianIntegrator", hydrodynamic<Pse::AutomaticSplit, true>, scenes);
    // The hydrodynamic part: all of the step but Forces that are worth their time.
    add("fluid/Hasimoto", hydrodynamic<Pse::Hasimoto, false>, scenes);
    add("fluid/prolate", hydrodynamic<Pse::Prolate, false>, scenes);
}

} // namespace PSE::benchmarks

/** Take the arguments --scene=N,permille,digits,threads from the command line. */
static PSE::benchmarks::SceneList scenesFrom(int& argc, char** argv) {
    PSE::benchmarks::SceneList scenes;
    int kept = 1;
    for (int i = 1; i < argc; i++) {
        int n, permille, digits, threads;
        if (std::sscanf(argv[i], "--scene=%d,%d,%d,%d", &n, &permille, &digits, &threads) == 4)
            scenes.push_back({n, permille, digits, threads});
        else
            argv[kept++] = argv[i];
    }
    argc = kept;
    if (scenes.empty())
        scenes = {{16000, 100, 3, 1}, {16000, 100, 3, 2}, {16000, 100, 6, 2}};
    return scenes;
}

int main(int argc, char** argv) {
    const PSE::benchmarks::SceneList scenes = scenesFrom(argc, argv);
    const char* folders = std::getenv("OPENMM_PLUGIN_DIR");
    PSE::benchmarks::loadPlugins(folders == nullptr ? PSE_PLUGIN_FOLDERS : folders);
    PSE::benchmarks::addStages(scenes);
    PSE::benchmarks::addFfts(scenes);
    PSE::benchmarks::addSteps(scenes);
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv))
        return 2;
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
}
