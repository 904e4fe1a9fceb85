// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_WINDOW_H_
#define OPENMMPSE_NUMERICS_WINDOW_H_

#include "numerics/Chebyshev.h"
#include <vector>

namespace PSE::numerics {

/**
 * Kaiser-Bessel window that spreads a particle onto P grid points along one axis [T9]:
 *
 *     W(x) = I0(beta sqrt(1 - z^2))/I0(beta),  z = 2x/P,  |x| <= P/2 (x in grid spacings)
 *
 * The three-dimensional window is the product over the axes of the box, in fractional coordinates.
 */
class Window {
public:
    /**
     * @param support  P, grid points touched per axis, >= 2
     * @param shape    beta; at least minShape(support), else the transform may have zeros inside
     * the Nyquist band
     */
    Window(int support, double shape) : P(support), beta(shape) {}
    static double minShape(int support) { return 1.57 * support; }

    int support() const { return P; }
    double shape() const { return beta; }
    /** W at a distance x in grid spacings. */
    double operator()(double x) const;
    /**
     * Fourier transform of the truncated window, Int W(x) exp(-i theta x) dx, closed form [T10].
     */
    double transform(double theta) const;
    /** Sum over the aliases p != 0 of [W^(theta + 2 pi p)/W^(theta)]^2, |theta| <= pi [T14]. */
    double aliasing(double theta) const;
    /**
     * One polynomial per grid point j in t in [-1, 1] with W at x_j = j + (t + 1 - P)/2: a particle
     * at u (in grid spacings) touches i0 + j with i0 = ceil(u - P/2), and t = 2 (i0 - u) + P - 1.
     * @param maxError  absolute error allowed, W(0) = 1
     */
    std::vector<Polynomial> polynomials(double maxError) const;

private:
    int P;
    double beta;
};

} // namespace PSE::numerics

#endif
