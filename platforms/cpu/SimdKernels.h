// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_SIMDKERNELS_H_
#define OPENMMPSE_SIMDKERNELS_H_

// The inner loops of the CPU platform, compiled for every instruction set that Highway knows and
// chosen at run time. They see plain arrays only. Real is float or double.

#include "numerics/Noise.h"
#include <complex>
#include <cstddef>
#include <cstdint>

namespace PSE {

/**
 * Window weights are padded with zeros to this many grid points, so that a row of them is whole
 * SIMD vectors.
 */
inline int paddedSupport(int support) {
    return support <= 4 ? 4 : (support <= 8 ? 8 : 16);
}

/** Particles on the grid, sorted by the cell of their first grid point. */
template <class Real> struct GridParticles {
    int support, padded; ///< P, paddedSupport(P)
    int size[3];         ///< grid points M_d
    /// reals from one row of the grid to the next; rows are padded by `padded` points
    size_t rowLength;
    /// [M_x M_y + 1] first particle of each column (x, y) of cells
    const int* columnStart;
    const int* first;    ///< [n][3] first grid point touched, in [0, M_d)
    const Real* weights; ///< [n][3][padded]
    const Real* forces;  ///< [n][3]
};

/** One polynomial per point of the window: coefficients[degree][padded], highest power first. */
template <class Real> struct WindowPolynomials {
    int degree, padded;
    const Real* coefficients;
};

/**
 * PAIR_LANES neighbours of one particle, one array per quantity; unused lanes hold zeros and a
 * valid neighbour.
 */
constexpr int PAIR_LANES = 8;
template <class Real> struct PairBlock {
    int32_t neighbour[PAIR_LANES];
    Real F[PAIR_LANES], C[PAIR_LANES], dx[PAIR_LANES], dy[PAIR_LANES], dz[PAIR_LANES];
};

/**
 * Neighbours within range, as rows of a symmetric sparse matrix of 3x3 blocks F I + C d d^T, d in
 * radii.
 */
template <class Real> struct PairRows {
    Real self;            ///< diagonal blocks
    const int64_t* start; ///< [n] first PairBlock of a row
    const int32_t* count; ///< [n] PairBlocks of a row
    const PairBlock<Real>* blocks;
};

/**
 * Real-space scalars by polynomials in t = 2 r^2/rc^2 - 1 (RealTable), highest power first; lengths
 * in radii.
 */
template <class Real> struct PairPolynomials {
    Real rc;
    int degreeF, degreeC;
    const Real *F, *C;
};

/** Positions in the primary box and the box in reduced form, in nm. */
struct PairGeometry {
    const double *x, *y, *z;
    double box[6]; ///< ax, bx, by, cx, cy, cz
    double range, radius;
};

/** What turns forces into velocities for one column block [x][z] of modes at fixed y. */
template <class Real> struct WaveRow {
    int size[3];         ///< grid points M_d
    int ny;              ///< signed wave index along y
    size_t blockLength;  ///< complex numbers from one row of the block to the next
    Real waveVectors[9]; ///< columns of k = waveVectors n, row-major, in 1/a
    /// [M_x][blockLength] wave factor over window^2, 0 for dropped modes
    const Real* factors;
    bool forced;
    Real noise; ///< amplitude of the thermal part, 0 for none
    numerics::NoiseKey key;
};

/** The inner loops for one instruction set. */
template <class Real> struct SimdKernels {
    /** weights[particle][axis][point] from t[particle][axis], for n particles. */
    void (*evaluateWindows)(const WindowPolynomials<Real>& window, const Real* t, int n,
                            Real* weights);
    /**
     * Set three planes [y][z] to the forces of all particles that touch the plane x; row ends are
     * folded back.
     */
    void (*spreadPlane)(const GridParticles<Real>& particles, int x, Real* const planes[3]);
    /**
     * u[particle][3] for particles [from, to) from the three grids, whose row ends repeat their
     * beginnings.
     */
    void (*gatherVelocities)(const GridParticles<Real>& particles, int from, int to,
                             const Real* const grids[3], Real* u);
    /**
     * Write the row of particle i: those of n candidate neighbours whose nearest image lies within
     * the range, in their order; `row` has room for (n + PAIR_LANES - 1)/PAIR_LANES blocks. Returns
     * the number of blocks.
     */
    int (*fillRow)(const PairGeometry& geometry, const PairPolynomials<Real>& table, int i,
                   const int32_t* candidates, int n, PairBlock<Real>* row);
    /**
     * F and C of `count` blocks whose neighbours and displacements are set; lanes from `last` on in
     * the last one are unused.
     */
    void (*evaluateBlocks)(const PairPolynomials<Real>& table, int count, int last,
                           PairBlock<Real>* blocks);
    /** out = M_R v for rows [from, to); v and out are [n][3]. */
    void (*multiplyRows)(const PairRows<Real>& rows, int from, int to, const Real* v, Real* out);
    /**
     * u = (I - kk)(D f + noise sqrt(D) z), in place, for three blocks [x][z] of complex numbers;
     * scratch: waveScratch() reals.
     */
    void (*scaleWaves)(const WaveRow<Real>& row, std::complex<Real>* const blocks[3],
                       Real* scratch);
};

/** The loops for the best instruction set of this machine. */
template <class Real> const SimdKernels<Real>& simdKernels();

/**
 * Reals of scratch that scaleWaves() needs: real and imaginary parts of three components, for a row
 * of modes.
 */
inline size_t waveScratch(size_t blockLength) {
    return 6 * blockLength;
}

} // namespace PSE

#endif
