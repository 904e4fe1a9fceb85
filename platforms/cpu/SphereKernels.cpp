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

/** Adds forces to three planes. Not lambdas here: those are not always in line. */
template <class D, class Real = hn::TFromD<D>> struct AddForces {
    D d;
    size_t rowLength;
    Real *HWY_RESTRICT x, *HWY_RESTRICT y, *HWY_RESTRICT z; ///< planes
    const Real* HWY_RESTRICT forces;
    int particle = 0; ///< of the sphere that is visited

    HWY_INLINE void operator()(size_t at, int sphere, hn::Vec<D> w) const {
        const Real* HWY_RESTRICT force = forces + 3 * size_t(sphere);
        hn::StoreU(hn::MulAdd(w, hn::Set(d, force[0]), hn::LoadU(d, x + at)), d, x + at);
        hn::StoreU(hn::MulAdd(w, hn::Set(d, force[1]), hn::LoadU(d, y + at)), d, y + at);
        hn::StoreU(hn::MulAdd(w, hn::Set(d, force[2]), hn::LoadU(d, z + at)), d, z + at);
    }
    HWY_INLINE void operator()(int row, int column, hn::Vec<D> w) const {
        (*this)(row * rowLength + column, particle, w);
    }
};

/** Sums up the velocity of a sphere from three grids. */
template <class D, class Real = hn::TFromD<D>> struct SumVelocities {
    D d;
    size_t rowLength;
    const Real *HWY_RESTRICT x, *HWY_RESTRICT y, *HWY_RESTRICT z; ///< grids
    hn::Vec<D> ux, uy, uz;
    size_t plane = 0; ///< where the one that is visited starts

    HWY_INLINE void operator()(size_t at, int, hn::Vec<D> w) {
        ux = hn::MulAdd(w, hn::LoadU(d, x + at), ux);
        uy = hn::MulAdd(w, hn::LoadU(d, y + at), uy);
        uz = hn::MulAdd(w, hn::LoadU(d, z + at), uz);
    }
    HWY_INLINE void operator()(int row, int column, hn::Vec<D> w) {
        (*this)(plane + row * rowLength + column, 0, w);
    }
};

/** The same where places are counted from the start of a plane. */
template <class D, class Real = hn::TFromD<D>> struct SumOfPlane {
    SumVelocities<D>& sum;

    HWY_INLINE void operator()(size_t at, hn::Vec<D> w) { sum(sum.plane + at, 0, w); }
};

/** `terms` polynomials of t at once; coefficients[degree + 1][terms], highest powers first. */
template <int TERMS, class D, class Real = hn::TFromD<D>>
HWY_INLINE void evaluateTerms(D d, const Real* HWY_RESTRICT coefficients, int degree, hn::Vec<D> t,
                              hn::Vec<D>* HWY_RESTRICT terms) {
    for (int j = 0; j < TERMS; j++)
        terms[j] = hn::Set(d, *coefficients++);
    for (int power = 1; power <= degree; power++)
        for (int j = 0; j < TERMS; j++)
            terms[j] = hn::MulAdd(terms[j], t, hn::Set(d, *coefficients++));
}

template <int TERMS, class Real>
void weighRowsOf(const GridSpheres<Real>& g, int from, int to, Real* alongWeights) {
    const hn::CappedTag<Real, SPHERE_LANES> d;
    const auto one = hn::Set(d, Real(1));
    for (int particle = from; particle < to; particle++) {
        const int kind = g.shape[particle];
        const Real scale = g.shapes[kind].rowScale;
        if (scale == 0)
            continue;
        Real* HWY_RESTRICT out = alongWeights + size_t(particle) * TERMS * SPHERE_LANES;
        const Real* HWY_RESTRICT along = g.along + size_t(kind) * TERMS * (g.rowDegree + 1);
        for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(d))) {
            const auto z = lanesFrom(d, g.offset[3 * size_t(particle) + 2] + k);
            const auto t = hn::MulSub(hn::Mul(hn::Set(d, scale * g.point), z), z, one);
            hn::Vec<decltype(d)> terms[TERMS];
            evaluateTerms<TERMS>(d, along, g.rowDegree, hn::Min(t, one), terms);
            for (int j = 0; j < TERMS; j++)
                hn::StoreU(hn::IfThenElseZero(hn::Lt(t, one), terms[j]), d,
                           out + j * SPHERE_LANES + k);
        }
    }
}

/** The rows that a sphere touches in one plane, and the factors of its terms there. */
template <int TERMS, class Real> struct RowsOfPlane {
    Real weights[TERMS][SPHERE_LANES]; ///< [term][row]
    int from, count;                   ///< rows
    int particle;

    HWY_INLINE void set(const GridSpheres<Real>& g, int sphere, int dx) {
        particle = sphere;
        from = count = 0;
        const hn::CappedTag<Real, SPHERE_LANES> d;
        const auto one = hn::Set(d, Real(1));
        const int kind = g.shape[particle];
        const Real scale = g.shapes[kind].rowScale;
        const Real* HWY_RESTRICT offset = g.offset + 3 * size_t(particle);
        const Real x = offset[0] + dx;
        const auto taken = hn::Set(d, scale * g.plane * x * x - 1);
        const Real* HWY_RESTRICT across = g.across + size_t(kind) * TERMS * (g.rowDegree + 1);
        for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(d))) {
            const auto y = lanesFrom(d, offset[1] + k);
            const auto t = hn::MulAdd(hn::Mul(hn::Set(d, scale * g.line), y), y, taken);
            const auto in = hn::Lt(t, one);
            const int inside = static_cast<int>(hn::CountTrue(d, in));
            if (inside == 0)
                continue;
            if (count == 0)
                from = k + static_cast<int>(hn::FindKnownFirstTrue(d, in));
            count += inside;
            hn::Vec<decltype(d)> terms[TERMS];
            evaluateTerms<TERMS>(d, across, g.rowDegree, hn::Min(t, one), terms);
            for (int j = 0; j < TERMS; j++)
                hn::StoreU(terms[j], d, weights[j] + k);
        }
    }
};

/** Calls work(at, weights) for rows of one plane; `at` is counted from its start. */
template <int TERMS, class D, class Work, class Real = hn::TFromD<D>>
HWY_INLINE void visitRows(D d, const GridSpheres<Real>& g, const RowsOfPlane<TERMS, Real>& rows,
                          Work& work) {
    const Real* HWY_RESTRICT along = g.alongWeights + size_t(rows.particle) * TERMS * SPHERE_LANES;
    // what would else be read again after every number that is written
    const int sizeY = g.size[1], firstY = g.first[3 * size_t(rows.particle) + 1] + rows.from,
              firstZ = g.first[3 * size_t(rows.particle) + 2], count = rows.count;
    const size_t rowLength = g.rowLength;
    for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(d))) {
        hn::Vec<D> terms[TERMS];
        for (int j = 0; j < TERMS; j++)
            terms[j] = hn::LoadU(d, along + j * SPHERE_LANES + k);
        int y = firstY;
        if (y >= sizeY)
            y %= sizeY;
        size_t at = y * rowLength + firstZ + k;
        const Real* HWY_RESTRICT weights = rows.weights[0] + rows.from;
        for (int row = 0; row < count; row++, weights++) {
            auto w = hn::Mul(hn::Set(d, weights[0]), terms[0]);
            for (int j = 1; j < TERMS; j++)
                w = hn::MulAdd(hn::Set(d, weights[j * SPHERE_LANES]), terms[j], w);
            work(at, w);
            at += rowLength;
            if (++y == sizeY) {
                at -= sizeY * rowLength;
                y = 0;
            }
        }
    }
}

/** Adds one force to rows of three planes. */
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
constexpr int ROW_BATCH = 8;

template <int TERMS, class Real>
void spreadPlaneOf(const GridSpheres<Real>& g, int x, Real* const planes[3]) {
    const hn::CappedTag<Real, SPHERE_LANES> d;
    const size_t rows = g.size[1];
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < rows * g.rowLength; i++)
            planes[c][i] = 0;
    RowQueue<Real> queue;
    AddForces<decltype(d)> add = {d, g.rowLength, planes[0], planes[1], planes[2], g.forces};
    RowsOfPlane<TERMS, Real> batch[ROW_BATCH];
    int batched = 0;
    const auto visitBatch = [&]() HWY_ATTR {
        for (int b = 0; b < batched; b++) {
            const AddForce<decltype(d)> addForce(d, planes,
                                                 g.forces + 3 * size_t(batch[b].particle));
            visitRows<TERMS>(d, g, batch[b], addForce);
        }
        batched = 0;
    };
    for (int dx = 0; dx < g.widest; dx++) {
        const int column = (x - dx % g.size[0] + g.size[0]) % g.size[0];
        const int begin = g.columnStart[column * rows], end = g.columnStart[(column + 1) * rows];
        for (int particle = begin; particle < end; particle++) {
            const SphereShape<Real>& shape = g.shapes[g.shape[particle]];
            if (dx >= shape.extent[0])
                continue;
            add.particle = particle;
            if (shape.rowScale > 0) {
                batch[batched++].set(g, particle, dx);
                if (batched == ROW_BATCH)
                    visitBatch();
            } else if (isNarrow(d, g, shape))
                queuePlane(d, g, particle, dx, 0, queue, add);
            else
                visitPlane(d, g, particle, dx, add);
        }
    }
    visitBatch();
    workOff(d, g, queue, add);
    for (int c = 0; c < 3; c++)
        for (size_t y = 0; y < rows; y++) {
            Real* row = planes[c] + y * g.rowLength;
            for (int z = g.size[2], to = 0; z < g.size[2] + g.padding; z++) {
                row[to] += row[z];
                if (++to == g.size[2])
                    to = 0;
            }
        }
}

/** Of a sphere whose rows are sums of products. */
template <int TERMS, class D, class Real = hn::TFromD<D>>
HWY_INLINE void gatherRows(D d, const GridSpheres<Real>& g, int particle,
                           SumVelocities<const D>& sum) {
    RowsOfPlane<TERMS, Real> batch[ROW_BATCH];
    const int extent = g.shapes[g.shape[particle]].extent[0];
    SumOfPlane<const D> inPlane = {sum};
    int x = g.first[3 * size_t(particle)];
    for (int from = 0; from < extent; from += ROW_BATCH) {
        const int planes = extent - from < ROW_BATCH ? extent - from : ROW_BATCH;
        for (int b = 0; b < planes; b++)
            batch[b].set(g, particle, from + b);
        for (int b = 0; b < planes; b++) {
            sum.plane = x * g.planeLength;
            visitRows<TERMS>(d, g, batch[b], inPlane);
            if (++x == g.size[0])
                x = 0;
        }
    }
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
    Real* weights;
    template <int TERMS> HWY_INLINE void run() const {
        weighRowsOf<TERMS>(spheres, from, to, weights);
    }
};
template <class Real> struct SpreadWork {
    const GridSpheres<Real>& spheres;
    int x;
    Real* const* planes;
    template <int TERMS> HWY_INLINE void run() const { spreadPlaneOf<TERMS>(spheres, x, planes); }
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
void weighRowsAny(const GridSpheres<Real>& g, int from, int to, Real* alongWeights) {
    forTerms(g.rowTerms, WeighWork<Real>{g, from, to, alongWeights});
}
template <class Real>
void spreadPlaneAny(const GridSpheres<Real>& g, int x, Real* const planes[3]) {
    forTerms(g.rowTerms, SpreadWork<Real>{g, x, planes});
}
template <class Real>
void gatherAny(const GridSpheres<Real>& g, int from, int to, const Real* const grids[3], Real* u) {
    forTerms(g.rowTerms, GatherWork<Real>{g, from, to, grids, u});
}

// Dispatch tables hold functions, not templates: one name per precision.
SphereKernels<float> singleSphereKernels() {
    return {weighRowsAny<float>, spreadPlaneAny<float>, gatherAny<float>};
}
SphereKernels<double> doubleSphereKernels() {
    return {weighRowsAny<double>, spreadPlaneAny<double>, gatherAny<double>};
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
