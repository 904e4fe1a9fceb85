// SPDX-License-Identifier: MIT
// The loops over pairs that do not depend on what a pair is: included by each file of kernels, once
// for every instruction set.
#if defined(OPENMMPSE_PAIRLOOPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OPENMMPSE_PAIRLOOPS_INL_H_
#undef OPENMMPSE_PAIRLOOPS_INL_H_
#else
#define OPENMMPSE_PAIRLOOPS_INL_H_
#endif

#include "LaneNumbers-inl.h"
#include "PairKernels.h"
#include <hwy/highway.h>
#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/** Coordinates of particles that follow each other, as PairCoordinate has them. */
template <class D> HWY_INLINE auto loadCoordinates(D, const int32_t* HWY_RESTRICT x) {
    return hn::LoadU(hn::RebindToSigned<D>(), x);
}
template <class D> HWY_INLINE auto loadCoordinates(D d, const double* HWY_RESTRICT x) {
    return hn::LoadU(d, x);
}

/** Displacements to the nearest images of other particles, in radii. */
template <class D> class Displacement {
public:
    using Real = hn::TFromD<D>;
    using V = hn::Vec<D>;
    HWY_INLINE Displacement(D d, const PairGeometry<Real>& g, int i)
        : d(d), g(g), ownX(g.x[i]), ownY(g.y[i]), ownZ(g.z[i]) {}

    template <class Coordinate>
    HWY_INLINE void of(Coordinate x, Coordinate y, Coordinate z, V& dx, V& dy, V& dz) const {
        const V sx = difference(ownX, x), sy = difference(ownY, y), sz = difference(ownZ, z);
        dx = hn::MulAdd(constant(g.box[0]), sx,
                        hn::MulAdd(constant(g.box[1]), sy, hn::Mul(constant(g.box[3]), sz)));
        dy = hn::MulAdd(constant(g.box[2]), sy, hn::Mul(constant(g.box[4]), sz));
        dz = hn::Mul(constant(g.box[5]), sz);
        if (g.ambiguous) { // the nearest fractions are not always the nearest image there
            const V nb = hn::Round(hn::Mul(dy, constant(1 / g.whole[2])));
            dy = hn::NegMulAdd(nb, constant(g.whole[2]), dy);
            dx = hn::NegMulAdd(nb, constant(g.whole[1]), dx);
            const V na = hn::Round(hn::Mul(dx, constant(1 / g.whole[0])));
            dx = hn::NegMulAdd(na, constant(g.whole[0]), dx);
        }
    }

private:
    HWY_INLINE V constant(Real value) const { return hn::Set(d, value); }
    /** In units of PairCoordinate; integers wrap around by themselves. */
    template <class Integers> HWY_INLINE V difference(int32_t own, Integers other) const {
        const hn::RebindToSigned<D> di;
        return hn::ConvertTo(d, hn::Sub(hn::Set(di, own), other));
    }
    HWY_INLINE V difference(double own, V other) const {
        const V s = hn::Sub(hn::Set(d, own), other);
        return hn::Sub(s, hn::Round(s));
    }

    D d;
    const PairGeometry<Real> g; // a copy, in registers: what loops store cannot change it
    const typename PairCoordinate<Real>::Type ownX, ownY, ownZ;
};

/** Indices in numbers as wide as a Real: integers, or reals where those have 53 bits. */
template <class D>
using IndexTag = std::conditional_t<sizeof(hn::TFromD<D>) == 4, hn::RebindToSigned<D>, D>;

template <class DI> HWY_INLINE void storeIndices(DI d, hn::Vec<DI> indices, int32_t* to) {
    if constexpr (sizeof(hn::TFromD<DI>) == 4)
        hn::StoreU(indices, d, to);
    else {
        const hn::Rebind<int32_t, DI> narrow;
        hn::StoreU(hn::DemoteTo(narrow, indices), narrow, to);
    }
}

/** Append to `out` from its place n on those of the particles from j on that are in range. */
template <class D, class Mask, class Index>
HWY_INLINE void storeChosen(D d, Mask in, Index j, hn::Vec<D> dx, hn::Vec<D> dy, hn::Vec<D> dz,
                            const PairScratch<hn::TFromD<D>>& out, size_t n) {
    // One compression: many processors have none, and Highway's takes a long table then.
    const IndexTag<D> di;
    const hn::RebindToSigned<D> integers;
    const auto lanes = hn::Compress(hn::Iota(integers, 0), hn::RebindMask(integers, in));
    const auto order = hn::IndicesFromVec(d, lanes);
    if constexpr (sizeof(Index) == 4)
        storeIndices(di, hn::Add(lanes, hn::Set(di, j)), out.found + n);
    else
        storeIndices(di, hn::TableLookupLanes(lanesFrom(di, j), order), out.found + n);
    hn::StoreU(hn::TableLookupLanes(dx, order), d, out.dx + n);
    hn::StoreU(hn::TableLookupLanes(dy, order), d, out.dy + n);
    hn::StoreU(hn::TableLookupLanes(dz, order), d, out.dz + n);
}

/**
 * Vectors of candidates out of many short runs, searched in one loop: how many a run has is hard to
 * predict.
 */
struct VectorQueue {
    static constexpr int ROOM = 64, MOST = 4; ///< MOST: that a run adds at once
    int count = 0;
    int32_t begin[ROOM], end[ROOM];

    HWY_INLINE void add(int from, int to, int lanes) {
        for (int k = 0; k < MOST; k++) { // those too many are overwritten by the next
            begin[count + k] = from + k * lanes;
            end[count + k] = to;
        }
        const int needed = (to - from + lanes - 1) / lanes;
        count += needed < MOST ? needed : MOST;
    }
};

/**
 * Collect the neighbours of particle i among the candidates, without a branch for each of them,
 * and the displacements from them.
 * @param range2  range2(d, j): squared ranges of pairs of i with the particles from j on
 * @return how many there are
 */
template <class Real, class SquaredRange>
HWY_INLINE int findNeighbours(const PairGeometry<Real>& g, int i, SquaredRange range2,
                              const PairRun* runs, int numRuns, const PairScratch<Real>& out) {
    const hn::CappedTag<Real, PAIR_LANES> d;
    const IndexTag<decltype(d)> di;
    using Index = hn::TFromD<decltype(di)>;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const Displacement<decltype(d)> displacement(d, g, i);
    const auto self = hn::Set(di, Index(i));
    size_t n = 0;
    VectorQueue queue;
    const auto search = [&]() HWY_ATTR {
        for (int v = 0; v < queue.count; v++) {
            const int j = queue.begin[v];
            hn::Vec<decltype(d)> dx, dy, dz;
            displacement.of(loadCoordinates(d, g.x + j), loadCoordinates(d, g.y + j),
                            loadCoordinates(d, g.z + j), dx, dy, dz);
            const auto r2 = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz)));
            const auto index = lanesFrom(di, Index(j));
            const auto candidate =
                hn::And(hn::Lt(index, hn::Set(di, Index(queue.end[v]))), hn::Ne(index, self));
            const auto in = hn::And(hn::RebindMask(di, hn::Lt(r2, range2(d, j))), candidate);
            storeChosen(d, in, Index(j), dx, dy, dz, out, n);
            n += hn::CountTrue(di, in);
        }
        queue.count = 0;
    };
    for (int r = 0; r < numRuns; r++)
        for (int j = runs[r].begin; j < runs[r].end; j += VectorQueue::MOST * lanes) {
            queue.add(j, runs[r].end, lanes);
            if (queue.count > VectorQueue::ROOM - VectorQueue::MOST)
                search();
        }
    search();
    return static_cast<int>(n);
}

/**
 * The row of particle i: neighbours, displacements, and what `evaluate` makes of each block,
 * evaluate(neighbours, used, block).
 * @return the number of blocks
 */
template <class Real, class SquaredRange, class Evaluate>
HWY_INLINE int fillRowWith(const PairGeometry<Real>& geometry, int i, SquaredRange range2,
                           Evaluate evaluate, const PairRun* runs, int numRuns,
                           const PairScratch<Real>& scratch, PairBlock<Real>* row) {
    const hn::CappedTag<Real, PAIR_LANES> d;
    const hn::CappedTag<int32_t, PAIR_LANES> di;
    const int n = findNeighbours(geometry, i, range2, runs, numRuns, scratch);
    for (int k = n; k < n + PAIR_LANES; k++) { // lanes of the last block that no neighbour fills
        scratch.found[k] = i;
        scratch.dx[k] = scratch.dy[k] = scratch.dz[k] = 0;
    }
    const int blocks = (n + PAIR_LANES - 1) / PAIR_LANES;
    for (int b = 0; b < blocks; b++) {
        PairBlock<Real>& block = row[b];
        const int begin = b * PAIR_LANES;
        for (size_t k = 0; k < PAIR_LANES; k += hn::Lanes(di))
            hn::StoreU(hn::Mul(hn::LoadU(di, scratch.found + begin + k), hn::Set(di, 3)), di,
                       block.offset + k);
        for (size_t k = 0; k < PAIR_LANES; k += hn::Lanes(d)) {
            hn::StoreU(hn::LoadU(d, scratch.dx + begin + k), d, block.dx + k);
            hn::StoreU(hn::LoadU(d, scratch.dy + begin + k), d, block.dy + k);
            hn::StoreU(hn::LoadU(d, scratch.dz + begin + k), d, block.dz + k);
        }
        evaluate(scratch.found + begin, n - begin < PAIR_LANES ? n - begin : PAIR_LANES, block);
    }
    return blocks;
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#endif
