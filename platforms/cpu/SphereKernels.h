// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_SPHEREKERNELS_H_
#define OPENMMPSE_SPHEREKERNELS_H_

// Inner loops between unequal spheres and the grid, compiled for every instruction set and chosen
// at run time.

#include <cstddef>
#include <cstdint>

namespace PSE {

/// points that a row of the grid may be read and written beyond the last one of a sphere
constexpr int SPHERE_LANES = 8;

/** What all spheres of one radius share [T31]. */
template <class Real> struct SphereShape {
    /// weight = polynomial in t = scale r^2 + shift, r in radii of the Plan, for `least` < t < 1
    Real scale, shift, least;
    int extent[3]; ///< grid points touched along each axis, at most
    /// 0, or: rows are sums of products [T54], polynomials in t = rowScale d^2 - 1 < 1
    Real rowScale;
};

/** Of a sphere with such rows: the first one in each of its planes, and how many there are. */
struct SphereChords {
    int8_t first[SPHERE_LANES], count[SPHERE_LANES];
};

/// terms of such sums
constexpr int LEAST_ROW_TERMS = 3, MOST_ROW_TERMS = 5;

/** Unequal spheres on the grid, sorted by the column (x, y) of their first grid point. */
template <class Real> struct GridSpheres {
    int size[3]; ///< grid points M_d
    int padding; ///< points by which rows are longer than the grid: largest extent and SPHERE_LANES
    int widest;  ///< largest extent along x
    size_t rowLength, planeLength; ///< reals from one row to the next, from one plane to the next
    const int* columnStart;        ///< [M_x M_y + 1] first particle of each column (x, y)
    const int* first;              ///< [n][3] first grid point touched, in [0, M_d)
    const Real* offset;            ///< [n][3] from the sphere to that point, in grid points
    const int* shape;              ///< [n] index of its radius
    const SphereShape<Real>* shapes;
    int degree;
    const Real* coefficients; ///< [shapes][degree + 1], highest power first
    /**
     * The squared distance from the centre to grid point (x, y, z), in grid points from it, is
     * plane x^2 + line (y - skewY x)^2 + point (z - skewX x - skewZ y)^2.
     */
    Real plane, line, point, skewY, skewX, skewZ;
    const Real* forces; ///< [n][3]
    /// Of shapes with a rowScale, none where skewX or skewZ is not 0 or of more than SPHERE_LANES
    /// points along an axis, nor where places in a grid are no int32_t; both
    /// [shapes][rowDegree + 1][rowTerms].
    int rowTerms, rowDegree;
    const Real *across, *along;
    const SphereChords* chords; ///< [n]
    const Real* alongWeights;   ///< [n][rowTerms][SPHERE_LANES] `along` at the points of a row
};

template <class Real> struct SphereKernels {
    /** Set chords and alongWeights of spheres [from, to), where their shapes have them. */
    void (*weighRows)(const GridSpheres<Real>& spheres, int from, int to, SphereChords* chords,
                      Real* alongWeights);
    /**
     * Set `number` planes [y][z] of three grids to the forces of all spheres that touch the planes
     * from x on, SPHERE_LANES of them at most; row ends are folded back.
     */
    void (*spreadPlanes)(const GridSpheres<Real>& spheres, int x, int number,
                         Real* const planes[3]);
    /**
     * u[particle][3] for spheres [from, to) from the three grids, whose row ends repeat their
     * beginnings: the transpose of spreading.
     */
    void (*gatherVelocities)(const GridSpheres<Real>& spheres, int from, int to,
                             const Real* const grids[3], Real* u);
};

/** The loops for the best instruction set of this machine. */
template <class Real> SphereKernels<Real> sphereKernels();

} // namespace PSE

#endif
