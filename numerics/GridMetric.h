// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_GRIDMETRIC_H_
#define OPENMMPSE_NUMERICS_GRIDMETRIC_H_

#include "numerics/Lattice.h"
#include <array>

namespace PSE::numerics {

/**
 * Distances on a grid in a box of any shape: what is (x, y, z) grid points away has
 *
 *     r^2 = plane x^2 + line (y - skewY x)^2 + point (z - skewX x - skewZ y)^2,
 *
 * squares alone, so that nothing cancels, and the points of a line along z within a sphere lie
 * about the one where the last square is zero.
 */
struct GridMetric {
    double plane, line, point;
    double skewY, skewX, skewZ;
    /// grid points along each axis that a ball of radius 1 reaches to on either side
    std::array<double, 3> pointsPerLength;

    /** @param unit  of r, in that of the box */
    GridMetric(const Lattice& box, const std::array<int, 3>& grid, double unit);
};

} // namespace PSE::numerics

#endif
