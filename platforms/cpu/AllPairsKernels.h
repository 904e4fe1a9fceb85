// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_ALLPAIRSKERNELS_H_
#define OPENMMPSE_ALLPAIRSKERNELS_H_

// Inner loops of an unbounded fluid, where every particle feels every other, compiled for every
// instruction set and chosen at run time [T32].

#include <cstddef>

namespace PSE {

/// Arrays are padded to a multiple of these: no vector of numbers is longer.
constexpr int ALL_PAIRS_LANES = 16;
/// Rows are taken by at most so many at once, of which the last may lie in the padding.
constexpr int ALL_PAIRS_ROWS = 4;

/**
 * Where the particles are, in units of the plan's radius. A coordinate is the sum of two numbers:
 * in single precision they hold 48 bits, so that the displacement of two particles errs by
 * rounding of itself alone wherever they are; in double precision the second ones are not read.
 * Places from `count` on may be anywhere.
 */
template <class Real> struct AllPairs {
    int count, stride; ///< stride: that of the arrays, a multiple of ALL_PAIRS_LANES
    const Real *x, *y, *z;
    const Real *restX, *restY, *restZ;
    const Real* radius; ///< not read if all are 1
    /// Of force coupling: [terms] each, GaussianPairs, an even number
    const Real *gaussianF = nullptr, *gaussianC = nullptr;
    int terms = 0;
};

/** What a pair of spheres is. */
enum class PairLaw {
    EqualSpheres,     ///< Rotne-Prager-Yamakawa, all radii 1
    UnequalSpheres,   ///< the same, any radii
    GaussianEnvelopes ///< force coupling, any radii
};

/**
 * Numbers of a record of rows [from, to), from a multiple of ALL_PAIRS_ROWS: F and C of all their
 * pairs, and more, as the loops run over whole vectors.
 */
inline size_t recordSize(int count, int from, int to) {
    size_t size = 0;
    for (int i = from; i < to; i += ALL_PAIRS_ROWS) {
        const int begin = i / ALL_PAIRS_LANES * ALL_PAIRS_LANES;
        size += 2 * ALL_PAIRS_ROWS *
                size_t((count - begin + ALL_PAIRS_LANES - 1) / ALL_PAIRS_LANES + 1) *
                ALL_PAIRS_LANES;
    }
    return size;
}

/** How products are made that come one after another at the same positions. */
template <class Real> struct AllPairsKernels {
    /**
     * Add what pairs (i, j), from <= i < to, i < j, make of v, to both: sums += M v.
     * from and to are multiples of ALL_PAIRS_ROWS, or to is count.
     * @param v       [3][stride], zero from place `count` on
     * @param sums    [3][stride], of which columns from `from` rounded down to ALL_PAIRS_LANES are
     * changed; what is added from place `count` on means nothing
     * @param record  [recordSize()], where one is kept
     */
    using AddRows = void (*)(const AllPairs<Real>& pairs, int from, int to, const Real* v,
                             Real* sums, Real* record);
    AddRows addRows;     ///< keeps nothing
    AddRows recordRows;  ///< the same, and keeps F and C of all pairs
    AddRows addRecorded; ///< the same from that record
    /// the same, displacements by the first numbers of coordinates alone
    AddRows addRecordedNear;
};

/** The loops for the best instruction set of this machine. */
template <class Real> AllPairsKernels<Real> allPairsKernels(PairLaw law);

} // namespace PSE

#endif
