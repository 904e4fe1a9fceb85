// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_PAIRKERNELS_H_
#define OPENMMPSE_PAIRKERNELS_H_

// Inner loops of the real-space half, compiled for every instruction set and chosen at run time.

#include <cstddef>
#include <cstdint>

namespace PSE {

/**
 * A coordinate as a fraction of the box vector. In single precision a 32-bit integer: differences
 * wrap around to the nearest image by themselves, and are exact to 2^-32 of the box. In double
 * precision a number in [0, 1).
 */
template <class Real> struct PairCoordinate;
template <> struct PairCoordinate<float> {
    using Type = int32_t;
    static constexpr double UNIT = 1 / 4294967296.0; ///< of the box vector
    static Type fromFraction(double s) {
        return static_cast<Type>(static_cast<uint32_t>(static_cast<int64_t>(s / UNIT)));
    }
};
template <> struct PairCoordinate<double> {
    using Type = double;
    static constexpr double UNIT = 1;
    static Type fromFraction(double s) { return s; }
};

/**
 * PAIR_LANES neighbours of one particle, one array per quantity; unused lanes have F = C = 0 and a
 * valid neighbour.
 */
constexpr int PAIR_LANES = 8;
template <class Real> struct PairBlock {
    int32_t offset[PAIR_LANES]; ///< three times the neighbour's place in the vectors
    Real F[PAIR_LANES], C[PAIR_LANES], dx[PAIR_LANES], dy[PAIR_LANES], dz[PAIR_LANES];
};

/**
 * Neighbours within range, as rows of a symmetric sparse matrix of 3x3 blocks F I + C d d^T, d in
 * radii.
 */
template <class Real> struct PairRows {
    Real self;                     ///< diagonal blocks
    const Real* selves;            ///< or [n] one for each row; NULL if all are alike
    const int32_t* start;          ///< [n] first PairBlock of a row, from `blocks`
    const int32_t* count;          ///< [n] PairBlocks of a row
    const PairBlock<Real>* blocks; ///< those of the rows asked for
};

/**
 * Real-space scalars by polynomials in t = 2 r^2/rc^2 - 1 (RealTable), highest power first; lengths
 * in radii.
 */
template <class Real> struct PairPolynomials {
    bool rpy; ///< with the branches of RPY; else the polynomials alone
    Real rc;
    int degreeF, degreeC;
    const Real *F, *C;
};

/** Where the particles are; the arrays can be read up to PAIR_LANES places beyond their ends. */
template <class Real> struct PairGeometry {
    const typename PairCoordinate<Real>::Type *x, *y, *z;
    /// ax, bx, by, cx, cy, cz in radii per unit of PairCoordinate
    Real box[6];
    Real whole[3];  ///< ax, bx, by in radii
    bool ambiguous; ///< the nearest fractions of a pair in range may be those of another image
    Real range;     ///< in radii, below half the smallest of ax, by, cz
};

/** Particles [begin, end) may be neighbours. */
struct PairRun {
    int begin, end;
};

/** Room for the neighbours of one particle: as many as candidates, and PAIR_LANES more. */
template <class Real> struct PairScratch {
    int32_t* found; ///< their places
    Real *dx, *dy, *dz;
};

template <class Real> struct PairKernels {
    /**
     * Write the row of particle i: those of the candidates whose nearest image lies within the
     * range, itself excepted, in their order. `row` has room for all of them.
     * @return the number of blocks
     */
    int (*fillRow)(const PairGeometry<Real>& geometry, const PairPolynomials<Real>& table, int i,
                   const PairRun* runs, int numRuns, const PairScratch<Real>& scratch,
                   PairBlock<Real>* row);
    /**
     * F and C of `count` blocks whose neighbours and displacements are set; lanes from `last` on in
     * the last one are unused.
     */
    void (*evaluateBlocks)(const PairPolynomials<Real>& table, int count, int last,
                           PairBlock<Real>* blocks);
    /**
     * out = s M_R v + t w for rows [from, to); all vectors are [n][3], and v has one more number
     * to read.
     * @return sum of v_i . out_i over these rows
     */
    double (*multiplyRows)(const PairRows<Real>& rows, int from, int to, const Real* v, Real s,
                           const Real* w, Real t, Real* out);
    /** out += s v for n numbers. */
    void (*addScaled)(int n, Real s, const Real* v, Real* out);
    /** Sum of v w over n numbers. */
    double (*dot)(int n, const Real* v, const Real* w);
};

/** The loops for the best instruction set of this machine. */
template <class Real> PairKernels<Real> pairKernels();

} // namespace PSE

#endif
