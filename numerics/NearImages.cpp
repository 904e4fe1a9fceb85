// SPDX-License-Identifier: MIT
#include "numerics/NearImages.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

double imageSpacing(const Lattice& box) {
    return std::min({std::cbrt(box.volume()), box.length(0), box.length(1), box.length(2)});
}

double mobilityAmongImages(double spacing, double a, double b, SphereModel model) {
    constexpr double CUBIC = 2.8373; // of a simple cubic lattice of point forces
    // Where the sum is smallest for equal radii: beyond, spheres are upon their images, and it
    // would grow.
    constexpr double CLOSEST = 0.475, LEAST = 0.1;
    const double larger = std::max(a, b), L = std::max(spacing, larger / CLOSEST),
                 finite = 2 * M_PI / secondOrder(model) * (a * a + b * b) / (L * L * L);
    return std::max(LEAST / larger, 1 / larger - CUBIC / L + finite);
}

} // namespace PSE::numerics
