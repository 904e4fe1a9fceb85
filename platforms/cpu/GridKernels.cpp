// SPDX-License-Identifier: MIT
#include "GridKernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "GridKernels.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>

// P = 0 stands for a support known only at run time. A row of PADDED points is one or a few
// vectors.
HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <int PADDED, class Real>
HWY_INLINE void evaluateWindowsPadded(const WindowPolynomials<Real>& window,
                                      const Real* HWY_RESTRICT t, int n,
                                      Real* HWY_RESTRICT weights) {
    const hn::CappedTag<Real, PADDED> d;
    for (int row = 0; row < 3 * n; row++)
        for (size_t j = 0; j < PADDED; j += hn::Lanes(d)) {
            const auto x = hn::Set(d, t[row]);
            auto w = hn::LoadU(d, window.coefficients + j);
            for (int power = 1; power <= window.degree; power++)
                w = hn::MulAdd(w, x, hn::LoadU(d, window.coefficients + power * PADDED + j));
            hn::StoreU(w, d, weights + row * size_t(PADDED) + j);
        }
}

template <class Real>
void evaluateWindowsAny(const WindowPolynomials<Real>& window, const Real* t, int n,
                        Real* weights) {
    if (window.padded == 4)
        evaluateWindowsPadded<4>(window, t, n, weights);
    else if (window.padded == 8)
        evaluateWindowsPadded<8>(window, t, n, weights);
    else
        evaluateWindowsPadded<16>(window, t, n, weights);
}

/** Add one particle to the plane that its window touches with weight dx. */
template <int P, int PADDED, class Real>
HWY_INLINE void spreadParticle(const GridParticles<Real>& p, int particle, int dx,
                               Real* const planes[3]) {
    const hn::CappedTag<Real, PADDED> d;
    const int support = (P > 0 ? P : p.support);
    const Real* HWY_RESTRICT weights = p.weights + size_t(particle) * 3 * PADDED;
    const Real* HWY_RESTRICT force = p.forces + 3 * size_t(particle);
    const int* first = p.first + 3 * size_t(particle);
    for (size_t j = 0; j < PADDED; j += hn::Lanes(d)) {
        const auto w = hn::Mul(hn::Set(d, weights[dx]), hn::LoadU(d, weights + 2 * PADDED + j));
        const auto fx = hn::Mul(hn::Set(d, force[0]), w), fy = hn::Mul(hn::Set(d, force[1]), w),
                   fz = hn::Mul(hn::Set(d, force[2]), w);
        int y = first[1];
        for (int dy = 0; dy < support; dy++) {
            const auto wy = hn::Set(d, weights[PADDED + dy]);
            const size_t offset = y * p.rowLength + first[2] + j;
            hn::StoreU(hn::MulAdd(wy, fx, hn::LoadU(d, planes[0] + offset)), d, planes[0] + offset);
            hn::StoreU(hn::MulAdd(wy, fy, hn::LoadU(d, planes[1] + offset)), d, planes[1] + offset);
            hn::StoreU(hn::MulAdd(wy, fz, hn::LoadU(d, planes[2] + offset)), d, planes[2] + offset);
            if (++y == p.size[1])
                y = 0;
        }
    }
}

template <int P, int PADDED, class Real>
HWY_INLINE void spreadPlaneOf(const GridParticles<Real>& p, int x, Real* const planes[3]) {
    const int support = (P > 0 ? P : p.support);
    const size_t rows = p.size[1];
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < rows * p.rowLength; i++)
            planes[c][i] = 0;
    for (int dx = 0; dx < support; dx++) {
        const int column = (x - dx + p.size[0]) % p.size[0];
        const int begin = p.columnStart[column * rows], end = p.columnStart[(column + 1) * rows];
        for (int particle = begin; particle < end; particle++)
            spreadParticle<P, PADDED>(p, particle, dx, planes);
    }
    for (int c = 0; c < 3; c++)
        for (size_t y = 0; y < rows; y++) {
            Real* row = planes[c] + y * p.rowLength;
            for (int z = p.size[2]; z < p.size[2] + PADDED - 1; z++)
                row[z % p.size[2]] += row[z];
        }
}

template <int P, int PADDED, class Real>
HWY_INLINE void gatherOf(const GridParticles<Real>& p, int from, int to, const Real* const grids[3],
                         Real* HWY_RESTRICT u) {
    const hn::CappedTag<Real, PADDED> d;
    const int support = (P > 0 ? P : p.support);
    for (int particle = from; particle < to; particle++) {
        const Real* HWY_RESTRICT weights = p.weights + size_t(particle) * 3 * PADDED;
        const int* first = p.first + 3 * size_t(particle);
        Real* const out = u + 3 * size_t(particle);
        for (size_t j = 0; j < PADDED; j += hn::Lanes(d)) {
            auto ux = hn::Zero(d), uy = hn::Zero(d), uz = hn::Zero(d);
            int x = first[0];
            for (int dx = 0; dx < support; dx++) {
                const auto wx = hn::Set(d, weights[dx]);
                const size_t plane = x * p.planeLength + first[2] + j;
                int y = first[1];
                for (int dy = 0; dy < support; dy++) {
                    const auto w = hn::Mul(wx, hn::Set(d, weights[PADDED + dy]));
                    const size_t offset = plane + y * p.rowLength;
                    ux = hn::MulAdd(w, hn::LoadU(d, grids[0] + offset), ux);
                    uy = hn::MulAdd(w, hn::LoadU(d, grids[1] + offset), uy);
                    uz = hn::MulAdd(w, hn::LoadU(d, grids[2] + offset), uz);
                    if (++y == p.size[1])
                        y = 0;
                }
                if (++x == p.size[0])
                    x = 0;
            }
            const auto wz = hn::LoadU(d, weights + 2 * PADDED + j);
            const Real sum[3] = {hn::GetLane(hn::SumOfLanes(d, hn::Mul(wz, ux))),
                                 hn::GetLane(hn::SumOfLanes(d, hn::Mul(wz, uy))),
                                 hn::GetLane(hn::SumOfLanes(d, hn::Mul(wz, uz)))};
            for (int c = 0; c < 3; c++)
                out[c] = (j == 0 ? 0 : out[c]) + sum[c];
        }
    }
}

/** Call work with the support and its padding as compile-time constants. */
template <class Work> HWY_INLINE void forSupport(int support, Work work) {
    switch (support) {
    case 3:
        return work.template run<3, 4>();
    case 4:
        return work.template run<4, 4>();
    case 5:
        return work.template run<5, 8>();
    case 6:
        return work.template run<6, 8>();
    case 7:
        return work.template run<7, 8>();
    case 8:
        return work.template run<8, 8>();
    default:
        return work.template run<0, 16>();
    }
}

template <class Real> struct SpreadWork {
    const GridParticles<Real>& particles;
    int x;
    Real* const* planes;
    template <int P, int PADDED> HWY_INLINE void run() const {
        spreadPlaneOf<P, PADDED>(particles, x, planes);
    }
};

template <class Real> struct GatherWork {
    const GridParticles<Real>& particles;
    int from, to;
    const Real* const* grids;
    Real* u;
    template <int P, int PADDED> HWY_INLINE void run() const {
        gatherOf<P, PADDED>(particles, from, to, grids, u);
    }
};

template <class Real>
void spreadPlaneAny(const GridParticles<Real>& p, int x, Real* const planes[3]) {
    forSupport(p.support, SpreadWork<Real>{p, x, planes});
}

template <class Real>
void gatherAny(const GridParticles<Real>& p, int from, int to, const Real* const grids[3],
               Real* u) {
    forSupport(p.support, GatherWork<Real>{p, from, to, grids, u});
}

// Dispatch tables hold functions, not templates: one name per precision.
GridKernels<float> singleGridKernels() {
    return {evaluateWindowsAny<float>, spreadPlaneAny<float>, gatherAny<float>};
}
GridKernels<double> doubleGridKernels() {
    return {evaluateWindowsAny<double>, spreadPlaneAny<double>, gatherAny<double>};
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace PSE {

HWY_EXPORT(singleGridKernels);
HWY_EXPORT(doubleGridKernels);

template <> GridKernels<float> gridKernels<float>() {
    return HWY_DYNAMIC_DISPATCH(singleGridKernels)();
}
template <> GridKernels<double> gridKernels<double>() {
    return HWY_DYNAMIC_DISPATCH(doubleGridKernels)();
}

} // namespace PSE
#endif
