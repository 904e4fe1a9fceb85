// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_GRIDKERNELS_H_
#define OPENMMPSE_GRIDKERNELS_H_

// Inner loops between particles and grid, compiled for every instruction set and chosen at run
// time.

#include <cstddef>

namespace PSE {

/** Weights per axis that kernels work on: the support P, rounded up to whole SIMD vectors. */
inline int paddedSupport(int support) {
    return support <= 4 ? 4 : (support <= 8 ? 8 : 16);
}

/** Particles on the grid, sorted by the column (x, y) of their first grid point. */
template <class Real> struct GridParticles {
    int support, padded; ///< P, paddedSupport(P)
    int size[3];         ///< grid points M_d
    /// reals from one row of a plane to the next (rows are padded by `padded` points), and from
    /// one plane of the grid to the next
    size_t rowLength, planeLength;
    /// [M_x M_y + 1] first particle of each column (x, y)
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

template <class Real> struct GridKernels {
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
};

/** The loops for the best instruction set of this machine. */
template <class Real> GridKernels<Real> gridKernels();

} // namespace PSE

#endif
