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

/** Rows at a time whose weights are evaluated: as many chains of dependent operations. */
constexpr int ROWS = 4;

/** One plane of grid points of one sphere, all that its rows have in common; in units of t. */
template <class Real> struct SpherePlane {
    const SphereShape<Real>& shape;
    const Real* HWY_RESTRICT coefficients;
    int degree;
    Real x, left, middle, line, point; ///< `left` of 1 after what the plane takes
};

/** Where a row lies in units of t: `left` of 1 after what plane and row take, and its middle. */
template <class Real> struct SphereRow { Real left, centre; };

/** Weights of points from z0 on, counted from the centre of the sphere, in N rows. */
template <int N, class D, class Real = hn::TFromD<D>>
HWY_INLINE void evaluateWeights(D d, const SpherePlane<Real>& plane,
                                const SphereRow<Real>* HWY_RESTRICT rows, Real z0,
                                hn::Vec<D>* HWY_RESTRICT w) {
    const auto one = hn::Set(d, Real(1)), least = hn::Set(d, plane.shape.least),
               point = hn::Set(d, plane.point);
    hn::Vec<D> t[N];
    for (int n = 0; n < N; n++) {
        const auto dz = hn::Iota(d, z0 - rows[n].centre);
        t[n] = hn::MulAdd(hn::Mul(point, dz), dz, hn::Set(d, 1 - rows[n].left));
        w[n] = hn::Set(d, plane.coefficients[0]);
    }
    hn::Vec<D> capped[N];
    for (int n = 0; n < N; n++)
        capped[n] = hn::Min(t[n], one); // its powers stay finite
    for (int power = 1; power <= plane.degree; power++) {
        const auto c = hn::Set(d, plane.coefficients[power]);
        for (int n = 0; n < N; n++)
            w[n] = hn::MulAdd(w[n], capped[n], c);
    }
    for (int n = 0; n < N; n++)
        w[n] = hn::IfThenElseZero(hn::And(hn::Lt(t[n], one), hn::Gt(t[n], least)), w[n]);
}

/** All vectors of one row of a sphere that is wider than a vector. */
template <class D, class Work, class Real = hn::TFromD<D>>
HWY_INLINE void visitRow(D d, const SpherePlane<Real>& plane, const SphereRow<Real>& row,
                         Real offset, int extent, int y, int first, Work& work) {
    const int lanes = static_cast<int>(hn::Lanes(d));
    const Chord<Real> chord(row.centre, std::sqrt(std::max(Real(0), row.left) / plane.point),
                            offset, extent);
    int hollow = chord.to, filled = chord.to;
    // Where a large sphere is hollow: left - point dz^2 > 1 - least.
    const Real inside = row.left - (1 - plane.shape.least);
    if (inside > 0) {
        const Chord<Real> inner(row.centre, std::sqrt(inside / plane.point), offset, chord.to);
        hollow = inner.from;
        filled = inner.to;
    }
    for (int z = chord.from; z < chord.to; z += lanes) {
        if (z >= hollow && z < filled)
            z = filled;
        hn::Vec<D> w;
        evaluateWeights<1>(d, plane, &row, offset + z, &w);
        work(d, y, first + z, w);
    }
}

/**
 * Calls work(d, row, z, weights) for vectors of points of the plane `dx` beyond the first one of a
 * sphere: row y of the grid, points from z on, wherever a weight may not be zero. Spreading and
 * gathering take the same weights from here.
 */
template <class D, class Work, class Real = hn::TFromD<D>>
HWY_INLINE void visitPlane(D d, const GridSpheres<Real>& g, int particle, int dx, Work& work) {
    const SphereShape<Real>& shape = g.shapes[g.shape[particle]];
    const Real* HWY_RESTRICT offset = g.offset + 3 * size_t(particle);
    const int* HWY_RESTRICT first = g.first + 3 * size_t(particle);
    const Real x = offset[0] + dx, left = 1 - shape.shift - shape.scale * g.plane * x * x;
    if (left <= 0)
        return;
    const SpherePlane<Real> plane = {shape,
                                     g.coefficients + size_t(g.shape[particle]) * (g.degree + 1),
                                     g.degree,
                                     x,
                                     left,
                                     g.skewY * x,
                                     shape.scale * g.line,
                                     shape.scale * g.point};
    const Chord<Real> chord(plane.middle, std::sqrt(left / plane.line), offset[1], shape.extent[1]);
    const int extent = shape.extent[2];
    const auto rowAt = [&](int dy) HWY_ATTR {
        const Real y = offset[1] + dy, fromMiddle = y - plane.middle;
        return SphereRow<Real>{left - plane.line * fromMiddle * fromMiddle,
                               g.skewX * x + g.skewZ * y};
    };
    int dy = chord.from, row = (first[1] + dy) % g.size[1];
    const auto next = [&]() HWY_ATTR { row = (row + 1 == g.size[1] ? 0 : row + 1); };
    if (extent > static_cast<int>(hn::Lanes(d))) {
        for (; dy < chord.to; dy++, next())
            visitRow(d, plane, rowAt(dy), offset[2], extent, row, first[2], work);
        return;
    }
    for (; dy + ROWS <= chord.to; dy += ROWS) {
        const SphereRow<Real> rows[ROWS] = {rowAt(dy), rowAt(dy + 1), rowAt(dy + 2), rowAt(dy + 3)};
        hn::Vec<D> w[ROWS];
        evaluateWeights<ROWS>(d, plane, rows, offset[2], w);
        for (int n = 0; n < ROWS; n++, next())
            work(d, row, first[2], w[n]);
    }
    for (; dy < chord.to; dy++, next()) {
        const SphereRow<Real> only = rowAt(dy);
        hn::Vec<D> w;
        evaluateWeights<1>(d, plane, &only, offset[2], &w);
        work(d, row, first[2], w);
    }
}

/** Adds the forces of a sphere to three planes. Not a lambda: those are not always in line. */
template <class D, class Real = hn::TFromD<D>> struct AddForces {
    size_t rowLength;
    Real *HWY_RESTRICT x, *HWY_RESTRICT y, *HWY_RESTRICT z; ///< planes
    hn::Vec<D> fx, fy, fz;
    HWY_INLINE void operator()(D d, int row, int column, hn::Vec<D> w) const {
        const size_t at = row * rowLength + column;
        hn::StoreU(hn::MulAdd(w, fx, hn::LoadU(d, x + at)), d, x + at);
        hn::StoreU(hn::MulAdd(w, fy, hn::LoadU(d, y + at)), d, y + at);
        hn::StoreU(hn::MulAdd(w, fz, hn::LoadU(d, z + at)), d, z + at);
    }
};

/** Sums up the velocity of a sphere from three grids. */
template <class D, class Real = hn::TFromD<D>> struct SumVelocities {
    size_t rowLength;
    const Real *HWY_RESTRICT x, *HWY_RESTRICT y, *HWY_RESTRICT z; ///< planes
    hn::Vec<D> ux, uy, uz;
    HWY_INLINE void operator()(D d, int row, int column, hn::Vec<D> w) {
        const size_t at = row * rowLength + column;
        ux = hn::MulAdd(w, hn::LoadU(d, x + at), ux);
        uy = hn::MulAdd(w, hn::LoadU(d, y + at), uy);
        uz = hn::MulAdd(w, hn::LoadU(d, z + at), uz);
    }
};

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
            AddForces<decltype(d)> add = {g.rowLength,
                                          planes[0],
                                          planes[1],
                                          planes[2],
                                          hn::Set(d, force[0]),
                                          hn::Set(d, force[1]),
                                          hn::Set(d, force[2])};
            visitPlane(d, g, particle, dx, add);
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
        SumVelocities<decltype(d)> sum = {g.rowLength, nullptr,     nullptr,    nullptr,
                                          hn::Zero(d), hn::Zero(d), hn::Zero(d)};
        int x = g.first[3 * size_t(particle)];
        for (int dx = 0; dx < g.shapes[g.shape[particle]].extent[0]; dx++) {
            sum.x = grids[0] + x * g.planeLength;
            sum.y = grids[1] + x * g.planeLength;
            sum.z = grids[2] + x * g.planeLength;
            visitPlane(d, g, particle, dx, sum);
            if (++x == g.size[0])
                x = 0;
        }
        Real* const out = u + 3 * size_t(particle);
        out[0] = hn::GetLane(hn::SumOfLanes(d, sum.ux));
        out[1] = hn::GetLane(hn::SumOfLanes(d, sum.uy));
        out[2] = hn::GetLane(hn::SumOfLanes(d, sum.uz));
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
