// SPDX-License-Identifier: MIT
#include "SphereKernels.h"
#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "SphereKernels.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/** Grid points [from, to) of a chord about `centre`, counted from the first point at `offset`. */
template <class Real> struct Chord {
    int from, to;
    HWY_INLINE Chord(Real centre, Real half, Real offset, int extent) {
        // truncation is in line on every machine, ceil a call; both numbers are above -2
        const Real begin = std::max(Real(0), centre - half - offset), end = centre + half - offset;
        from = static_cast<int>(begin);
        from += (Real(from) < begin);
        to = std::min(extent, static_cast<int>(end + 2) - 1);
    }
};

/**
 * Calls work(row, z, weights) for vectors of points of the plane `dx` beyond the first one of a
 * sphere: row y of the grid, points from z on, wherever a weight may not be zero. Spreading and
 * gathering take the same weights from here.
 */
template <class D, class Work, class Real = hn::TFromD<D>>
HWY_INLINE void visitPlane(D d, const GridSpheres<Real>& g, int particle, int dx, Work work) {
    const SphereShape<Real>& shape = g.shapes[g.shape[particle]];
    const Real* HWY_RESTRICT coefficients =
        g.coefficients + size_t(g.shape[particle]) * (g.degree + 1);
    const Real* HWY_RESTRICT offset = g.offset + 3 * size_t(particle);
    const int* HWY_RESTRICT first = g.first + 3 * size_t(particle);
    const int lanes = static_cast<int>(hn::Lanes(d));
    const Real x = offset[0] + dx;
    // In units of t. Left of 1 after what the plane takes, and the row.
    const Real leftInPlane = 1 - shape.shift - shape.scale * g.plane * x * x;
    if (leftInPlane <= 0)
        return;
    const Real middle = g.skewY * x, line = shape.scale * g.line, point = shape.scale * g.point;
    const Chord<Real> rows(middle, std::sqrt(leftInPlane / line), offset[1], shape.extent[1]);
    int row = (first[1] + rows.from) % g.size[1];
    for (int dy = rows.from; dy < rows.to; dy++, row = (row + 1 == g.size[1] ? 0 : row + 1)) {
        const Real y = offset[1] + dy;
        const Real left = leftInPlane - line * (y - middle) * (y - middle);
        const Real centre = g.skewX * x + g.skewZ * y;
        int z = 0, end = shape.extent[2], hollow = end, filled = end;
        if (end > lanes) {
            const Chord<Real> chord(centre, std::sqrt(std::max(Real(0), left) / point), offset[2],
                                    end);
            z = chord.from;
            end = chord.to;
            // Where a large sphere is hollow: left - point dz^2 > 1 - least.
            const Real inside = left - (1 - shape.least);
            if (inside > 0) {
                const Chord<Real> inner(centre, std::sqrt(inside / point), offset[2], end);
                hollow = inner.from;
                filled = inner.to;
            }
        }
        for (; z < end; z += lanes) {
            if (z >= hollow && z < filled)
                z = filled;
            const auto dz = hn::Iota(d, offset[2] + z - centre);
            auto t = hn::NegMulAdd(hn::Mul(hn::Set(d, point), dz), dz, hn::Set(d, left));
            t = hn::Sub(hn::Set(d, Real(1)), t);
            const auto within =
                hn::And(hn::Lt(t, hn::Set(d, Real(1))), hn::Gt(t, hn::Set(d, shape.least)));
            t = hn::Min(t, hn::Set(d, Real(1))); // powers of it stay finite
            auto w = hn::Set(d, coefficients[0]);
            for (int power = 1; power <= g.degree; power++)
                w = hn::MulAdd(w, t, hn::Set(d, coefficients[power]));
            work(row, first[2] + z, hn::IfThenElseZero(within, w));
        }
    }
}

template <class Real>
void spreadPlaneAny(const GridSpheres<Real>& g, int x, Real* const planes[3]) {
    const hn::CappedTag<Real, SPHERE_LANES> d;
    const size_t rows = g.size[1];
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < rows * g.rowLength; i++)
            planes[c][i] = 0;
    for (int dx = 0; dx < g.widest; dx++) {
        const int column = (x - dx % g.size[0] + g.size[0]) % g.size[0];
        const int begin = g.columnStart[column * rows], end = g.columnStart[(column + 1) * rows];
        for (int particle = begin; particle < end; particle++) {
            if (dx >= g.shapes[g.shape[particle]].extent[0])
                continue;
            const Real* HWY_RESTRICT force = g.forces + 3 * size_t(particle);
            const auto fx = hn::Set(d, force[0]), fy = hn::Set(d, force[1]),
                       fz = hn::Set(d, force[2]);
            visitPlane(d, g, particle, dx, [&](int row, int z, auto w) HWY_ATTR {
                const size_t at = row * g.rowLength + z;
                hn::StoreU(hn::MulAdd(w, fx, hn::LoadU(d, planes[0] + at)), d, planes[0] + at);
                hn::StoreU(hn::MulAdd(w, fy, hn::LoadU(d, planes[1] + at)), d, planes[1] + at);
                hn::StoreU(hn::MulAdd(w, fz, hn::LoadU(d, planes[2] + at)), d, planes[2] + at);
            });
        }
    }
    for (int c = 0; c < 3; c++)
        for (size_t y = 0; y < rows; y++) {
            Real* row = planes[c] + y * g.rowLength;
            for (int z = g.size[2]; z < g.size[2] + g.padding; z++)
                row[z % g.size[2]] += row[z];
        }
}

template <class Real>
void gatherAny(const GridSpheres<Real>& g, int from, int to, const Real* const grids[3],
               Real* HWY_RESTRICT u) {
    const hn::CappedTag<Real, SPHERE_LANES> d;
    for (int particle = from; particle < to; particle++) {
        auto ux = hn::Zero(d), uy = hn::Zero(d), uz = hn::Zero(d);
        int x = g.first[3 * size_t(particle)];
        for (int dx = 0; dx < g.shapes[g.shape[particle]].extent[0]; dx++) {
            const size_t plane = x * g.planeLength;
            visitPlane(d, g, particle, dx, [&](int row, int z, auto w) HWY_ATTR {
                const size_t at = plane + row * g.rowLength + z;
                ux = hn::MulAdd(w, hn::LoadU(d, grids[0] + at), ux);
                uy = hn::MulAdd(w, hn::LoadU(d, grids[1] + at), uy);
                uz = hn::MulAdd(w, hn::LoadU(d, grids[2] + at), uz);
            });
            if (++x == g.size[0])
                x = 0;
        }
        Real* const out = u + 3 * size_t(particle);
        out[0] = hn::GetLane(hn::SumOfLanes(d, ux));
        out[1] = hn::GetLane(hn::SumOfLanes(d, uy));
        out[2] = hn::GetLane(hn::SumOfLanes(d, uz));
    }
}

// Dispatch tables hold functions, not templates: one name per precision.
SphereKernels<float> singleSphereKernels() {
    return {spreadPlaneAny<float>, gatherAny<float>};
}
SphereKernels<double> doubleSphereKernels() {
    return {spreadPlaneAny<double>, gatherAny<double>};
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace PSE {

HWY_EXPORT(singleSphereKernels);
HWY_EXPORT(doubleSphereKernels);

template <> SphereKernels<float> sphereKernels<float>() {
    return HWY_DYNAMIC_DISPATCH(singleSphereKernels)();
}
template <> SphereKernels<double> sphereKernels<double>() {
    return HWY_DYNAMIC_DISPATCH(doubleSphereKernels)();
}

} // namespace PSE
#endif
