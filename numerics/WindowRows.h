// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_WINDOWROWS_H_
#define OPENMMPSE_NUMERICS_WINDOWROWS_H_

#include "numerics/RadialWindow.h"
#include <vector>

namespace PSE::numerics {

/**
 * The window of one radius on rows of grid points [T54]: with d the distance of a row from the
 * centre of the sphere and z a point's place on it,
 *
 *     S_a(sqrt(d^2 + z^2)) = sum over j of across_j(d^2) along_j(z^2),
 *
 * polynomials in t = scale d^2 - 1 and scale z^2 - 1, in [-1, 1] up to reach(a); beyond, the window
 * is zero and they are not to be used. All have one degree.
 */
struct WindowRows {
    double scale;
    std::vector<Polynomial> across, along; ///< none: more than MOST_TERMS or MAX_DEGREE were needed
    static constexpr int MOST_TERMS = 5, MAX_DEGREE = 16;
    // where platforms use them
    static constexpr size_t MOST_SHAPES = 32;      ///< distinct radii: each takes milliseconds
    static constexpr int MOST_POINTS = 8;          ///< of a sphere along an axis
    static constexpr double SMALLEST_ERROR = 1e-6; ///< with less, rows take more terms than pay

    int terms() const { return static_cast<int>(along.size()); }
    int degree() const { return along.empty() ? 0 : along[0].degree(); }
    double operator()(double d, double z) const;
};

/**
 * With the fewest terms, then the lowest degree, whose error over the cylinder of length and radius
 * reach(a), root mean square and relative to the average over the sphere itself, is below maxError.
 * @param maxError  at least 1e-7: singular values are found as roots of eigenvalues
 */
WindowRows windowRows(const RadialWindow& window, double a, double maxError);

} // namespace PSE::numerics

#endif
