// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_BENCHMARKS_BENCH_H_
#define OPENMMPSE_BENCHMARKS_BENCH_H_

// What the files of the program bench_stages share.

#include "Scenes.h"
#include "numerics/Lattice.h"
#include "numerics/Plan.h"
#include "openmm/internal/ThreadPool.h"
#include <benchmark/benchmark.h>
#include <fftw3.h>
#include <memory>

namespace PSE::benchmarks {

/** Arguments of each benchmark: particles, phi in 1/1000, digits of the tolerance, threads. */
using SceneList = std::vector<std::vector<int64_t>>;

/**
 * Register a benchmark for every scene. Its time is that on the wall, its CPU time that of all
 * threads of the process: the better measure of work where others use the machine, too.
 */
inline void add(const char* name, void (*function)(benchmark::State&), const SceneList& scenes) {
    auto* entry = benchmark::RegisterBenchmark(name, function);
    entry->ArgNames({"N", "permille", "digits", "threads"})->UseRealTime()->MeasureProcessCPUTime();
    entry->Unit(benchmark::kMillisecond);
    for (const std::vector<int64_t>& scene : scenes)
        entry->Args(scene);
}

void addStages(const SceneList& scenes);
void addFfts(const SceneList& scenes);
void addSteps(const SceneList& scenes);

/** The arguments of a benchmark, or what they lead to. */
struct Arguments {
    explicit Arguments(const benchmark::State& state)
        : particles(int(state.range(0))), threads(int(state.range(3))), phi(state.range(1) / 1e3),
          tolerance(std::pow(10.0, -double(state.range(2)))) {}
    int particles, threads;
    double phi, tolerance;
    double length() const { return boxLength(particles, phi); }
    numerics::Lattice box() const {
        return numerics::Lattice::orthorhombic(length(), length(), length());
    }
};

/** The Plan that the CPU platform makes of the arguments. */
inline numerics::Plan planFor(const Arguments& arguments) {
    constexpr double SINGLE_FLOOR = 1e-5;
    return numerics::makePlan({arguments.box(),
                               arguments.particles,
                               RADIUS,
                               arguments.tolerance,
                               true,
                               SINGLE_FLOOR,
                               false,
                               {}});
}

/** A fluid for the arguments, at a realistic step, for the public API. */
std::unique_ptr<PSEBrownianIntegrator> integratorFor(const Arguments& arguments,
                                                     PSEBrownianIntegrator::Split split);

/**
 * While one exists, our plans of the FFT library are made by measuring instead of by estimate. What
 * the library learns is forgotten at the end: later estimates would profit from it.
 */
class MeasuredPlans {
public:
    MeasuredPlans() { rigour = FFTW_MEASURE; }
    ~MeasuredPlans();
    MeasuredPlans(const MeasuredPlans&) = delete;
    MeasuredPlans& operator=(const MeasuredPlans&) = delete;
    static unsigned rigour;
};

} // namespace PSE::benchmarks

#endif
