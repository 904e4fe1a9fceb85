// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_MIXTUREPAIRKERNELS_H_
#define OPENMMPSE_MIXTUREPAIRKERNELS_H_

// The inner loops of PairKernels.h that differ where radii do, compiled for every instruction set
// and chosen at run time.

#include "PairKernels.h"

namespace PSE {

/// distinct radii that each have a polynomial of their own, at most
constexpr int MIXTURE_CLASSES = 8;

/**
 * Radii of the particles at all places, and the wave part of their pairs (MixtureTable): sums over
 * basis functions n of c_n(aj) P_n(t), t = 2 r^2/rc^2 - 1, where P_n belongs to a row. Arrays by
 * place can be read up to PAIR_LANES places beyond their ends.
 */
template <class Real> struct MixturePairs {
    const Real* reach;     ///< [n], in radii of the Plan; a pair ends at the sum of reaches
    const int32_t* kind;   ///< [n] index of the distinct radius
    const Real* radius;    ///< [distinct radii, MIXTURE_CLASSES at least]
    const Real* inverse;   ///< the same, what F and C are multiplied by for either sphere [T55]
    const Real* curvature; ///< the same, 1/radius
    Real scale;            ///< 2/rc^2
    int degree;
    int basis;           ///< number of basis functions; 0: one for each distinct radius
    const Real* weights; ///< [distinct radii][basis] c_n
};

/**
 * Polynomials of one row, highest power first: [degree + 1][basis], or [degree +
 * 1][MIXTURE_CLASSES] with one for each distinct radius.
 */
template <class Real> struct MixtureRow { const Real *F, *C; };

template <class Real> struct MixturePairKernels {
    /** PairKernels::fillRow() for unequal radii. */
    int (*fillRow)(const PairGeometry<Real>& geometry, const MixturePairs<Real>& pairs,
                   const MixtureRow<Real>& table, int i, const PairRun* runs, int numRuns,
                   const PairScratch<Real>& scratch, PairBlock<Real>* row);
    /** PairKernels::evaluateBlocks() for the row of particle i. */
    void (*evaluateBlocks)(const MixturePairs<Real>& pairs, const MixtureRow<Real>& table, int i,
                           int count, int last, PairBlock<Real>* blocks);
    /** out = sum over m of weights[m] functions[m], vectors of `length` numbers. */
    void (*combine)(int count, const Real* weights, size_t length, const Real* functions,
                    Real* out);
};

/** The loops for the best instruction set of this machine. */
template <class Real> MixturePairKernels<Real> mixturePairKernels();

} // namespace PSE

#endif
