// SPDX-License-Identifier: MIT
#include "SphereKernels.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "SphereKernels.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>
#include "LaneNumbers-inl.h"
#include "SphereRows-inl.h"

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

/** One plane of grid points of one sphere, all that its rows have in common; in units of t. */
template <class Real> struct SpherePlane {
    const SphereShape<Real>& shape;
    const Real* HWY_RESTRICT coefficients;
    int degree;
    Real x, left, middle, line, point; ///< `left` of 1 after what the plane takes

    HWY_INLINE SpherePlane(const GridSpheres<Real>& g, int particle, int dx)
        : shape(g.shapes[g.shape[particle]]),
          coefficients(g.coefficients + size_t(g.shape[particle]) * (g.degree + 1)),
          degree(g.degree), x(g.offset[3 * size_t(particle)] + dx),
          left(1 - shape.shift - shape.scale * g.plane * x * x), middle(g.skewY * x),
          line(shape.scale * g.line), point(shape.scale * g.point) {}
};

/** Weights of points from z0 on, counted from the middle of a row that takes `taken` of t. */
template <class D, class Real = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> weightsAt(D d, const SpherePlane<Real>& plane, Real taken, Real z0) {
    const auto one = hn::Set(d, Real(1)), dz = lanesFrom(d, z0);
    const auto t = hn::MulAdd(hn::Mul(hn::Set(d, plane.point), dz), dz, hn::Set(d, taken)),
               capped = hn::Min(t, one); // its powers stay finite
    auto w = hn::Set(d, plane.coefficients[0]);
    for (int power = 1; power <= plane.degree; power++)
        w = hn::MulAdd(w, capped, hn::Set(d, plane.coefficients[power]));
    return hn::IfThenElseZero(hn::And(hn::Lt(t, one), hn::Gt(t, hn::Set(d, plane.shape.least))), w);
}

/** Where a row lies in units of t: `left` of 1 after what plane and row take, and its middle. */
template <class Real> struct SphereRow { Real left, centre; };

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
        work(y, first + z, weightsAt(d, plane, 1 - row.left, offset + z - row.centre));
    }
}

/**
 * Calls work(row, z, weights) for vectors of points of the plane `dx` beyond the first one of a
 * sphere: row y of the grid, points from z on, wherever a weight may not be zero.
 */
template <class D, class Work, class Real = hn::TFromD<D>>
HWY_INLINE void visitPlane(D d, const GridSpheres<Real>& g, int particle, int dx, Work& work) {
    const SpherePlane<Real> plane(g, particle, dx);
    if (plane.left <= 0)
        return;
    const Real* HWY_RESTRICT offset = g.offset + 3 * size_t(particle);
    const int* HWY_RESTRICT first = g.first + 3 * size_t(particle);
    const Chord<Real> chord(plane.middle, std::sqrt(plane.left / plane.line), offset[1],
                            plane.shape.extent[1]);
    int row = (first[1] + chord.from) % g.size[1];
    for (int dy = chord.from; dy < chord.to; dy++) {
        const Real y = offset[1] + dy, fromMiddle = y - plane.middle;
        const SphereRow<Real> here = {plane.left - plane.line * fromMiddle * fromMiddle,
                                      g.skewX * plane.x + g.skewZ * y};
        visitRow(d, plane, here, offset[2], plane.shape.extent[2], row, first[2], work);
        row = (row + 1 == g.size[1] ? 0 : row + 1);
    }
}

/** Whether a row of the sphere is one vector, and none of its rows is met twice. */
template <class D, class Real = hn::TFromD<D>>
HWY_INLINE bool isNarrow(D d, const GridSpheres<Real>& g, const SphereShape<Real>& shape) {
    return shape.extent[2] <= static_cast<int>(hn::Lanes(d)) && shape.extent[1] <= g.size[1];
}

/**
 * Rows of narrow spheres, collected until there are enough of them to be evaluated together: chains
 * of dependent operations then overlap, whatever the number of rows of a sphere in a plane.
 */
template <class Real> struct RowQueue {
    static constexpr int ROOM = 64, MOST = ROOM - SPHERE_LANES; ///< MOST: room for one vector more
    /// at a time, as many as the registers of the machine hold
    static constexpr int TOGETHER = (HWY_TARGET <= HWY_AVX3 ? 8 : 4);
    int count = 0;
    // those behind the last one are evaluated, too: any numbers, but places that can be read
    Real taken[ROOM], z0[ROOM], point[ROOM], least[ROOM]; ///< see weightsAt()
    /// integers as wide as a Real
    using Index = std::conditional_t<sizeof(Real) == 4, int32_t, Real>;
    template <class D> using Tag = hn::Rebind<Index, D>;
    Index coefficients[ROOM] = {}; ///< where those of the sphere start
    Index plane[ROOM], at[ROOM];   ///< of the grid, and of the first point in it
    Index particle[ROOM];
};

/** Weights of N rows from the one at `from` on, as weightsAt(). */
template <int N, class D, class Real = hn::TFromD<D>>
HWY_INLINE void evaluateRows(D d, const GridSpheres<Real>& g, const RowQueue<Real>& queue, int from,
                             hn::Vec<D>* HWY_RESTRICT w) {
    const auto one = hn::Set(d, Real(1));
    const Real* coefficients[N];
    hn::Vec<D> t[N], capped[N];
    for (int n = 0; n < N; n++) {
        const auto dz = lanesFrom(d, queue.z0[from + n]);
        t[n] = hn::MulAdd(hn::Mul(hn::Set(d, queue.point[from + n]), dz), dz,
                          hn::Set(d, queue.taken[from + n]));
        capped[n] = hn::Min(t[n], one);
        coefficients[n] = g.coefficients + static_cast<size_t>(queue.coefficients[from + n]);
        w[n] = hn::Set(d, coefficients[n][0]);
    }
    for (int power = 1; power <= g.degree; power++)
        for (int n = 0; n < N; n++)
            w[n] = hn::MulAdd(w[n], capped[n], hn::Set(d, coefficients[n][power]));
    for (int n = 0; n < N; n++)
        w[n] = hn::IfThenElseZero(
            hn::And(hn::Lt(t[n], one), hn::Gt(t[n], hn::Set(d, queue.least[from + n]))), w[n]);
}

/** Calls work(at, particle, weights) for all rows in their order, and empties the queue. */
template <class D, class Work, class Real = hn::TFromD<D>>
HWY_INLINE void workOff(D d, const GridSpheres<Real>& g, RowQueue<Real>& queue, Work& work) {
    constexpr int N = RowQueue<Real>::TOGETHER;
    for (int from = 0; from < queue.count; from += N) { // those behind the last one in vain
        hn::Vec<D> w[N];
        evaluateRows<N>(d, g, queue, from, w);
        const int rest = queue.count - from;
        for (int n = 0; n < N; n++) {
            if (n == rest)
                break;
            work(static_cast<size_t>(queue.plane[from + n]) * g.planeLength +
                     static_cast<size_t>(queue.at[from + n]),
                 static_cast<int>(queue.particle[from + n]), w[n]);
        }
    }
    queue.count = 0;
}

/** Append the rows of a narrow sphere in its plane `dx`, which is `x` of the grid. */
template <class D, class Work, class Real = hn::TFromD<D>>
HWY_INLINE void queuePlane(D d, const GridSpheres<Real>& g, int particle, int dx, int x,
                           RowQueue<Real>& queue, Work& work) {
    const SpherePlane<Real> plane(g, particle, dx);
    const Real* HWY_RESTRICT offset = g.offset + 3 * size_t(particle);
    const int* HWY_RESTRICT first = g.first + 3 * size_t(particle);
    const typename RowQueue<Real>::template Tag<D> di;
    using Index = typename RowQueue<Real>::Index;
    const int lanes = static_cast<int>(hn::Lanes(d)), extent = plane.shape.extent[1];
    for (int dy = 0; dy < extent; dy += lanes) {
        if (queue.count > RowQueue<Real>::MOST)
            workOff(d, g, queue, work);
        const auto y = lanesFrom(d, offset[1] + dy),
                   fromMiddle = hn::Sub(y, hn::Set(d, plane.middle));
        const auto taken = hn::MulAdd(hn::Mul(hn::Set(d, plane.line), fromMiddle), fromMiddle,
                                      hn::Set(d, 1 - plane.left));
        const auto z0 =
            hn::NegMulAdd(hn::Set(d, g.skewZ), y, hn::Set(d, offset[2] - g.skewX * plane.x));
        const auto in =
            hn::And(hn::Lt(taken, hn::Set(d, Real(1))), hn::FirstN(d, size_t(extent - dy)));
        auto row = lanesFrom(di, Index(first[1] + dy));
        const auto size = hn::Set(di, Index(g.size[1]));
        row = hn::IfThenElse(hn::Lt(row, size), row, hn::Sub(row, size));
        const auto at =
            hn::Add(hn::Mul(row, hn::Set(di, Index(g.rowLength))), hn::Set(di, Index(first[2])));
        const int from = queue.count;
        hn::StoreU(hn::Compress(taken, in), d, queue.taken + from);
        hn::StoreU(hn::Compress(z0, in), d, queue.z0 + from);
        hn::StoreU(hn::Compress(at, hn::RebindMask(di, in)), di, queue.at + from);
        hn::StoreU(hn::Set(d, plane.point), d, queue.point + from);
        hn::StoreU(hn::Set(d, plane.shape.least), d, queue.least + from);
        hn::StoreU(hn::Set(di, Index(plane.coefficients - g.coefficients)), di,
                   queue.coefficients + from);
        hn::StoreU(hn::Set(di, Index(x)), di, queue.plane + from);
        hn::StoreU(hn::Set(di, Index(particle)), di, queue.particle + from);
        queue.count = from + static_cast<int>(hn::CountTrue(d, in));
    }
}

/** Adds forces to planes of three grids. Not lambdas here: those are not always in line. */
template <class D, class Real = hn::TFromD<D>> struct AddForces {
    D d;
    size_t rowLength;
    Real *HWY_RESTRICT x, *HWY_RESTRICT y, *HWY_RESTRICT z; ///< planes
    const Real* HWY_RESTRICT forces;
    int particle = 0; ///< of the sphere that is visited
    size_t plane = 0; ///< where the one that is visited starts

    HWY_INLINE void operator()(size_t at, int sphere, hn::Vec<D> w) const {
        const Real* HWY_RESTRICT force = forces + 3 * size_t(sphere);
        hn::StoreU(hn::MulAdd(w, hn::Set(d, force[0]), hn::LoadU(d, x + at)), d, x + at);
        hn::StoreU(hn::MulAdd(w, hn::Set(d, force[1]), hn::LoadU(d, y + at)), d, y + at);
        hn::StoreU(hn::MulAdd(w, hn::Set(d, force[2]), hn::LoadU(d, z + at)), d, z + at);
    }
    HWY_INLINE void operator()(int row, int column, hn::Vec<D> w) const {
        (*this)(plane + row * rowLength + column, particle, w);
    }
};

/** Sums up the velocity of a sphere from three grids. */
template <class D, class Real = hn::TFromD<D>> struct SumVelocities {
    D d;
    size_t rowLength;
    const Real *HWY_RESTRICT x, *HWY_RESTRICT y, *HWY_RESTRICT z; ///< grids
    hn::Vec<D> ux, uy, uz;
    size_t plane = 0; ///< where the one that is visited starts

    HWY_INLINE void operator()(size_t at, int, hn::Vec<D> w) { (*this)(at, w); }
    HWY_INLINE void operator()(size_t at, hn::Vec<D> w) {
        ux = hn::MulAdd(w, hn::LoadU(d, x + at), ux);
        uy = hn::MulAdd(w, hn::LoadU(d, y + at), uy);
        uz = hn::MulAdd(w, hn::LoadU(d, z + at), uz);
    }
    HWY_INLINE void operator()(int row, int column, hn::Vec<D> w) {
        (*this)(plane + row * rowLength + column, 0, w);
    }
};

/** Adds one force to rows of three grids. */
template <class D, class Real = hn::TFromD<D>> struct AddForce {
    D d;
    Real *HWY_RESTRICT x, *HWY_RESTRICT y, *HWY_RESTRICT z; ///< planes
    hn::Vec<D> forceX, forceY, forceZ;

    HWY_INLINE AddForce(D d, Real* const planes[3], const Real* force)
        : d(d), x(planes[0]), y(planes[1]), z(planes[2]), forceX(hn::Set(d, force[0])),
          forceY(hn::Set(d, force[1])), forceZ(hn::Set(d, force[2])) {}
    HWY_INLINE void operator()(size_t at, hn::Vec<D> w) const {
        hn::StoreU(hn::MulAdd(w, forceX, hn::LoadU(d, x + at)), d, x + at);
        hn::StoreU(hn::MulAdd(w, forceY, hn::LoadU(d, y + at)), d, y + at);
        hn::StoreU(hn::MulAdd(w, forceZ, hn::LoadU(d, z + at)), d, z + at);
    }
};

/// spheres whose rows are found before they are visited: latencies overlap
constexpr int ROW_BATCH = 4;

/** Planes of three grids: zeros before, and row ends folded back after. */
template <class Real>
void clearPlanes(const GridSpheres<Real>& g, int number, Real* const planes[3]) {
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < number * g.planeLength; i++)
            planes[c][i] = 0;
}
template <class Real>
void foldRowEnds(const GridSpheres<Real>& g, int number, Real* const planes[3]) {
    for (int c = 0; c < 3; c++)
        for (int p = 0; p < number; p++)
            for (int y = 0; y < g.size[1]; y++) {
                Real* const row = planes[c] + p * g.planeLength + y * g.rowLength;
                for (int z = g.size[2], to = 0; z < g.size[2] + g.padding; z++) {
                    row[to] += row[z];
                    if (++to == g.size[2])
                        to = 0;
                }
            }
}

template <int TERMS, class Real>
void spreadPlanesOf(const GridSpheres<Real>& g, int x, int number, Real* const planes[3]) {
    const hn::CappedTag<Real, SPHERE_LANES> d;
    clearPlanes(g, number, planes);
    RowQueue<Real> queue;
    AddForces<decltype(d)> add = {d, g.rowLength, planes[0], planes[1], planes[2], g.forces};
    SphereRows<TERMS, Real> batch[ROW_BATCH];
    int batched = 0;
    const auto visitBatch = [&]() HWY_ATTR {
        for (int b = 0; b < batched; b++) {
            const AddForce<decltype(d)> force(d, planes, g.forces + 3 * size_t(batch[b].particle));
            visitRows<TERMS>(d, g, batch[b], force, force);
        }
        batched = 0;
    };
    // `ahead`: from the first plane of a sphere to x
    for (int ahead = 1 - number; ahead < g.widest; ahead++) {
        const int column = ((x - ahead) % g.size[0] + g.size[0]) % g.size[0];
        const size_t rows = g.size[1];
        const int begin = g.columnStart[column * rows], end = g.columnStart[(column + 1) * rows];
        for (int particle = begin; particle < end; particle++) {
            const SphereShape<Real>& shape = g.shapes[g.shape[particle]];
            const int from = std::max(0, ahead), to = std::min(shape.extent[0], ahead + number);
            if (from >= to)
                continue;
            if (shape.rowScale > 0) {
                batch[batched++].find(g, particle, from, to, from - ahead);
                if (batched == ROW_BATCH)
                    visitBatch();
                continue;
            }
            add.particle = particle;
            for (int dx = from; dx < to; dx++) {
                add.plane = (dx - ahead) * g.planeLength;
                if (isNarrow(d, g, shape))
                    queuePlane(d, g, particle, dx, dx - ahead, queue, add);
                else
                    visitPlane(d, g, particle, dx, add);
            }
        }
    }
    visitBatch();
    workOff(d, g, queue, add);
    foldRowEnds(g, number, planes);
}

/** Of a sphere whose rows are sums of products. */
template <int TERMS, class D, class Real = hn::TFromD<D>>
HWY_INLINE void gatherRows(D d, const GridSpheres<Real>& g, int particle,
                           SumVelocities<const D>& sum) {
    SphereRows<TERMS, Real> rows;
    rows.find(g, particle, 0, g.shapes[g.shape[particle]].extent[0], g.first[3 * size_t(particle)]);
    SumVelocities<const D> other = sum; // two sums: one would wait for itself
    visitRows<TERMS>(d, g, rows, sum, other);
    sum.ux = hn::Add(sum.ux, other.ux);
    sum.uy = hn::Add(sum.uy, other.uy);
    sum.uz = hn::Add(sum.uz, other.uz);
}

template <int TERMS, class Real>
void gatherOf(const GridSpheres<Real>& g, int from, int to, const Real* const grids[3],
              Real* HWY_RESTRICT u) {
    const hn::CappedTag<Real, SPHERE_LANES> d;
    RowQueue<Real> queue;
    for (int particle = from; particle < to; particle++) {
        SumVelocities<decltype(d)> sum = {d,        g.rowLength, grids[0],    grids[1],
                                          grids[2], hn::Zero(d), hn::Zero(d), hn::Zero(d)};
        const SphereShape<Real>& shape = g.shapes[g.shape[particle]];
        const bool byRows = shape.rowScale > 0, narrow = isNarrow(d, g, shape);
        int x = g.first[3 * size_t(particle)];
        if (byRows)
            gatherRows<TERMS>(d, g, particle, sum);
        for (int dx = 0; dx < (byRows ? 0 : shape.extent[0]); dx++) {
            sum.plane = x * g.planeLength;
            if (narrow)
                queuePlane(d, g, particle, dx, x, queue, sum);
            else
                visitPlane(d, g, particle, dx, sum);
            if (++x == g.size[0])
                x = 0;
        }
        workOff(d, g, queue, sum);
        Real* const out = u + 3 * size_t(particle);
        out[0] = hn::GetLane(hn::SumOfLanes(d, sum.ux));
        out[1] = hn::GetLane(hn::SumOfLanes(d, sum.uy));
        out[2] = hn::GetLane(hn::SumOfLanes(d, sum.uz));
    }
}

/** Call work with the number of terms as a compile-time constant. */
template <class Work> HWY_INLINE void forTerms(int terms, Work work) {
    if (terms <= LEAST_ROW_TERMS)
        work.template run<LEAST_ROW_TERMS>();
    else if (terms == LEAST_ROW_TERMS + 1)
        work.template run<LEAST_ROW_TERMS + 1>();
    else
        work.template run<MOST_ROW_TERMS>();
}

template <class Real> struct WeighWork {
    const GridSpheres<Real>& spheres;
    int from, to;
    SphereChords* chords;
    Real* weights;
    template <int TERMS> HWY_INLINE void run() const {
        weighRowsOf<TERMS>(spheres, from, to, chords, weights);
    }
};
template <class Real> struct SpreadWork {
    const GridSpheres<Real>& spheres;
    int x, number;
    Real* const* planes;
    template <int TERMS> HWY_INLINE void run() const {
        spreadPlanesOf<TERMS>(spheres, x, number, planes);
    }
};
template <class Real> struct GatherWork {
    const GridSpheres<Real>& spheres;
    int from, to;
    const Real* const* grids;
    Real* u;
    template <int TERMS> HWY_INLINE void run() const {
        gatherOf<TERMS>(spheres, from, to, grids, u);
    }
};

template <class Real>
void weighRowsAny(const GridSpheres<Real>& g, int from, int to, SphereChords* chords,
                  Real* alongWeights) {
    forTerms(g.rowTerms, WeighWork<Real>{g, from, to, chords, alongWeights});
}
template <class Real>
void spreadPlanesAny(const GridSpheres<Real>& g, int x, int number, Real* const planes[3]) {
    forTerms(g.rowTerms, SpreadWork<Real>{g, x, number, planes});
}
template <class Real>
void gatherAny(const GridSpheres<Real>& g, int from, int to, const Real* const grids[3], Real* u) {
    forTerms(g.rowTerms, GatherWork<Real>{g, from, to, grids, u});
}

// Dispatch tables hold functions, not templates: one name per precision.
SphereKernels<float> singleSphereKernels() {
    return {weighRowsAny<float>, spreadPlanesAny<float>, gatherAny<float>};
}
SphereKernels<double> doubleSphereKernels() {
    return {weighRowsAny<double>, spreadPlanesAny<double>, gatherAny<double>};
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
