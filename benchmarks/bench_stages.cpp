// SPDX-License-Identifier: MIT
// The stages of a step on the CPU platform, through the classes that the plugin is made of. Stages
// that only the engine can run in order are counters of the whole: milliseconds each, by its clock.
#include "Bench.h"
#include "CpuEngine.h"
#include "numerics/Lanczos.h"
#include <algorithm>
#include <numeric>

using namespace PSE::numerics;

namespace PSE::benchmarks {

namespace {

constexpr double STEP_FRACTION = 1e-3; ///< dt D0/a^2 of the noise

std::vector<Vec3> positionsOf(const Arguments& arguments) {
    std::vector<Vec3> x;
    for (const OpenMM::Vec3& p : jitteredLattice(arguments.particles, arguments.phi, true))
        x.emplace_back(p[0], p[1], p[2]);
    return x;
}

template <class Number> std::vector<Number> randomNumbers(size_t count) {
    Uniform random(3);
    std::vector<Number> numbers(count);
    for (Number& number : numbers)
        number = Number(2 * random() - 1);
    return numbers;
}

NoiseKey key(Stream stream, uint64_t counter) {
    return {1, stream, counter};
}

/** The positions in fractions of the box. */
std::vector<Vec3> fractionsOf(const Arguments& arguments) {
    std::vector<Vec3> fractions = positionsOf(arguments);
    for (Vec3& x : fractions)
        x = arguments.box().wrappedFractional(x);
    return fractions;
}

/** The real half alone. */
template <class Real> struct RealHalf {
    explicit RealHalf(const Arguments& arguments)
        : plan(planFor(arguments)), fractions(fractionsOf(arguments)), pool(arguments.threads),
          threads(pool, false), half(plan, arguments.box(), threads), out(3 * fractions.size()) {
        const std::vector<Real> numbers = randomNumbers<Real>(3 * fractions.size() + 1);
        v.assign(numbers.begin(), numbers.end());
        half.setPositions(fractions);
    }
    Plan plan;
    std::vector<Vec3> fractions;
    OpenMM::ThreadPool pool;
    Threads threads;
    CpuRealSpace<Real> half;
    AlignedVector<Real> v, out;
};

/** Call work(Real()) with the precision that the Plan asks for. */
template <class Work> void inPrecision(const Arguments& arguments, Work work) {
    if (planFor(arguments).precision == Precision::Single)
        work(float());
    else
        work(double());
}

void neighbours(benchmark::State& state) {
    const Arguments arguments(state);
    inPrecision(arguments, [&](auto real) {
        RealHalf<decltype(real)> scene(arguments);
        for (auto _ : state)
            scene.half.setPositions(scene.fractions);
    });
}

void product(benchmark::State& state) {
    const Arguments arguments(state);
    inPrecision(arguments, [&](auto real) {
        RealHalf<decltype(real)> scene(arguments);
        for (auto _ : state)
            scene.half.multiplyAdd(scene.v, 1, scene.v, 0, scene.out);
    });
}

void squareRoot(benchmark::State& state) {
    const Arguments arguments(state);
    inPrecision(arguments, [&](auto real) {
        RealHalf<decltype(real)> scene(arguments);
        int iterations = 0;
        const double negative = std::max(2 * scene.plan.predictedError, 1e-10);
        scene.half.basis(0) = scene.v;
        for (auto _ : state)
            iterations = lanczosSquareRoot(scene.half, scene.out, scene.plan.lanczosTolerance,
                                           negative, scene.plan.precision == Precision::Double);
        state.counters["iterations"] = iterations;
    });
}

void windowWeights(benchmark::State& state) {
    const Arguments arguments(state);
    inPrecision(arguments, [&](auto real) {
        const std::vector<Vec3> fractions = fractionsOf(arguments);
        OpenMM::ThreadPool pool(arguments.threads);
        const Threads threads(pool, false);
        CpuWaveSpace<decltype(real)> half(planFor(arguments), arguments.box(), threads);
        for (auto _ : state)
            half.setPositions(fractions);
    });
}

/** Milliseconds of each stage by the engine's own clock, as counters. */
void reportStages(benchmark::State& state, const std::vector<StageTime>& before,
                  const std::vector<StageTime>& after) {
    for (const StageTime& stage : after) {
        double seconds = stage.seconds;
        for (const StageTime& earlier : before)
            if (earlier.stage == stage.stage)
                seconds -= earlier.seconds;
        state.counters[stage.stage] =
            benchmark::Counter(1e3 * seconds, benchmark::Counter::kAvgIterations);
    }
}

/** Everything that a step does besides the Forces. */
template <bool FORCED, bool THERMAL, bool MEASURED = false> void engine(benchmark::State& state) {
    const Arguments arguments(state);
    const Plan plan = planFor(arguments);
    const std::vector<Vec3> x = positionsOf(arguments);
    std::vector<Vec3> forces(x.size()), u;
    const std::vector<double> numbers = randomNumbers<double>(3 * x.size());
    for (size_t i = 0; i < x.size(); i++)
        forces[i] = Vec3(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
    std::vector<int> indices(x.size());
    std::iota(indices.begin(), indices.end(), 0);
    OpenMM::ThreadPool pool(arguments.threads);
    StageClock clock;
    const std::unique_ptr<MeasuredPlans> measured(MEASURED ? new MeasuredPlans : nullptr);
    inPrecision(arguments, [&](auto real) {
        CpuEngine<decltype(real)> fluid(plan, arguments.box(), VISCOSITY, indices, pool, clock);
        uint64_t counter = 0;
        const auto step = [&] {
            const Thermal thermal = {KT, diffusiveStep(STEP_FRACTION),
                                     key(Stream::StepReal, counter),
                                     key(Stream::StepWave, counter)};
            counter++;
            fluid.setPositions(x);
            fluid.computeVelocities(FORCED ? &forces : nullptr, THERMAL ? &thermal : nullptr, u);
        };
        step();
        const std::vector<StageTime> before = clock.times();
        for (auto _ : state)
            step();
        reportStages(state, before, clock.times());
    });
    state.counters["grid"] = std::cbrt(plan.gridPoints());
    state.counters["support"] = plan.windowSupport;
    state.counters["PTPS"] =
        benchmark::Counter(arguments.particles, benchmark::Counter::kIsIterationInvariantRate);
}

} // namespace

void addStages(const SceneList& scenes) {
    add("real half/neighbours and pair coefficients", neighbours, scenes);
    add("real half/one product", product, scenes);
    add("real half/Lanczos", squareRoot, scenes);
    add("wave half/window weights", windowWeights, scenes);
    add("engine/forced", engine<true, false>, scenes);
    add("engine/thermal", engine<false, true>, scenes);
    add("engine/both", engine<true, true>, scenes);
    add("engine/both, measured plans", engine<true, true, true>, scenes);
}

} // namespace PSE::benchmarks
