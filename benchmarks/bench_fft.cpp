// SPDX-License-Identifier: MIT
// The six 3-D transforms that a step with forces and noise cannot do without: the measure of how
// much everything else costs.
#include "Bench.h"
#include "Fft.h"
#include "Threads.h"
#include <algorithm>
#include <array>

using namespace PSE;
using namespace PSE::benchmarks;

// The linker leads our calls of the planner here (--wrap): no source of the library knows of it.
#define PSE_WRAP_REAL_PLAN(name, PlanType, In, Out)                                                \
    extern "C" PlanType __real_##name(int, const int*, int, In*, const int*, int, int, Out*,       \
                                      const int*, int, int, unsigned);                             \
    extern "C" PlanType __wrap_##name(int rank, const int* n, int many, In* in,                    \
                                      const int* inEmbed, int inStride, int inDistance, Out* out,  \
                                      const int* outEmbed, int outStride, int outDistance,         \
                                      unsigned flags) {                                            \
        return __real_##name(rank, n, many, in, inEmbed, inStride, inDistance, out, outEmbed,      \
                             outStride, outDistance,                                               \
                             (flags & ~FFTW_ESTIMATE) | MeasuredPlans::rigour);                    \
    }
#define PSE_WRAP_COMPLEX_PLAN(name, PlanType, Complex)                                             \
    extern "C" PlanType __real_##name(int, const int*, int, Complex*, const int*, int, int,        \
                                      Complex*, const int*, int, int, int, unsigned);              \
    extern "C" PlanType __wrap_##name(int rank, const int* n, int many, Complex* in,               \
                                      const int* inEmbed, int inStride, int inDistance,            \
                                      Complex* out, const int* outEmbed, int outStride,            \
                                      int outDistance, int sign, unsigned flags) {                 \
        return __real_##name(rank, n, many, in, inEmbed, inStride, inDistance, out, outEmbed,      \
                             outStride, outDistance, sign,                                         \
                             (flags & ~FFTW_ESTIMATE) | MeasuredPlans::rigour);                    \
    }
PSE_WRAP_REAL_PLAN(fftwf_plan_many_dft_r2c, fftwf_plan, float, fftwf_complex)
PSE_WRAP_REAL_PLAN(fftwf_plan_many_dft_c2r, fftwf_plan, fftwf_complex, float)
PSE_WRAP_REAL_PLAN(fftw_plan_many_dft_r2c, fftw_plan, double, fftw_complex)
PSE_WRAP_REAL_PLAN(fftw_plan_many_dft_c2r, fftw_plan, fftw_complex, double)
PSE_WRAP_COMPLEX_PLAN(fftwf_plan_many_dft, fftwf_plan, fftwf_complex)
PSE_WRAP_COMPLEX_PLAN(fftw_plan_many_dft, fftw_plan, fftw_complex)

namespace PSE::benchmarks {

unsigned MeasuredPlans::rigour = FFTW_ESTIMATE;

MeasuredPlans::~MeasuredPlans() {
    rigour = FFTW_ESTIMATE;
    fftwf_forget_wisdom();
    fftw_forget_wisdom();
}

namespace {

using Grid = std::array<int, 3>;

template <class Real> void planThreads(int threads);
template <> void planThreads<float>(int threads) {
    fftwf_init_threads();
    fftwf_plan_with_nthreads(threads);
}
template <> void planThreads<double>(int threads) {
    fftw_init_threads();
    fftw_plan_with_nthreads(threads);
}

/**
 * Six grids of one size and their 3-D transforms to and fro, in place (out of place takes as long),
 * planned by measuring.
 */
template <class Real> class SixFfts {
public:
    using Library = FftLibrary<Real>;
    SixFfts(const Grid& size, int threadsOfLibrary) {
        const int row = 2 * (size[2] / 2 + 1);
        const int real[3] = {size[0], size[1], row}, complex[3] = {size[0], size[1], row / 2};
        const size_t points = size_t(size[0]) * size[1] * row;
        const MeasuredPlans measured;
        planThreads<Real>(threadsOfLibrary);
        for (FftArray<Real>& grid : grids)
            grid.resize(points);
        Real* const grid = grids[0].begin();
        auto* const waves = reinterpret_cast<typename Library::Complex*>(grid);
        forward = Library::planReal(3, size.data(), 1, grid, real, 1, 0, waves, complex, 1, 0,
                                    FFTW_MEASURE);
        backward = Library::planInverseReal(3, size.data(), 1, waves, complex, 1, 0, grid, real, 1,
                                            0, FFTW_MEASURE);
        for (FftArray<Real>& each : grids) // transforms of zeros stay finite
            std::fill_n(each.begin(), points, Real(0));
        planThreads<Real>(1);
    }
    ~SixFfts() {
        Library::destroy(forward);
        Library::destroy(backward);
    }
    void runForward(int i) {
        Real* grid = grids[i].begin();
        Library::executeReal(forward, grid, reinterpret_cast<typename Library::Complex*>(grid));
    }
    void runBackward(int i) {
        Real* grid = grids[i].begin();
        Library::executeInverseReal(backward, reinterpret_cast<typename Library::Complex*>(grid),
                                    grid);
    }

private:
    FftArray<Real> grids[6];
    typename Library::Plan forward, backward;
};

/** What Hasimoto's split leads to on the CPU platform: the grids whose transforms are timed. */
NumericalParameters parametersOf(const Arguments& arguments) {
    const auto system = cubicSystem(arguments.particles, arguments.length());
    const auto integrator = integratorFor(arguments, PSEBrownianIntegrator::Hasimoto);
    OpenMM::Context context(*system, *integrator, OpenMM::Platform::getPlatformByName("CPU"));
    return integrator->getNumericalParameters();
}

/**
 * One serial transform per thread of OpenMM. Six grids, each transformed once: with three, two
 * threads would wait for each other, and the measure would be too easy to meet.
 */
template <class Real> void onPool(benchmark::State& state, const Grid& grid, int threadCount) {
    OpenMM::ThreadPool pool(threadCount);
    const Threads threads(pool, false);
    SixFfts<Real> ffts(grid, 1);
    for (auto _ : state)
        threads.run(6, [&](int i, int) { i < 3 ? ffts.runForward(i) : ffts.runBackward(i); });
}

/** One transform after the other, each on all threads of the library. */
template <class Real> void onLibrary(benchmark::State& state, const Grid& grid, int threads) {
    SixFfts<Real> ffts(grid, threads);
    for (auto _ : state)
        for (int i = 0; i < 3; i++) {
            ffts.runForward(i);
            ffts.runBackward(i);
        }
}

template <bool POOL> void sixFfts(benchmark::State& state) {
    const Arguments arguments(state);
    const NumericalParameters used = parametersOf(arguments);
    const int* size = used.gridDimensions;
    const Grid grid = {size[0], size[1], size[2]};
    const bool single = (used.precision == "single");
    const auto run = POOL ? (single ? onPool<float> : onPool<double>)
                          : (single ? onLibrary<float> : onLibrary<double>);
    run(state, grid, arguments.threads);
}

} // namespace

void addFfts(const SceneList& scenes) {
    add("six FFTs/pool", sixFfts<true>, scenes);
    add("six FFTs/FFTW threads", sixFfts<false>, scenes);
}

} // namespace PSE::benchmarks
