// SPDX-License-Identifier: MIT
#include "numerics/GridMetric.h"
#include "numerics/Vec3.h"

namespace PSE::numerics {

GridMetric::GridMetric(const Lattice& box, const std::array<int, 3>& grid, double unit) {
    Matrix3 steps = box.vectors() / unit;
    for (int d = 0; d < 3; d++) {
        steps.col(d) /= grid[d];
        pointsPerLength[d] = grid[d] * unit / box.width(d);
    }
    // r^2 = n G n, squares completed from z to x.
    const Matrix3 G = steps.transpose() * steps;
    point = G(2, 2);
    skewX = -G(0, 2) / point;
    skewZ = -G(1, 2) / point;
    line = G(1, 1) - point * skewZ * skewZ;
    const double mixed = G(0, 1) - point * skewX * skewZ;
    skewY = -mixed / line;
    plane = G(0, 0) - point * skewX * skewX - line * skewY * skewY;
}

} // namespace PSE::numerics
