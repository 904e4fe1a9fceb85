// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_RADIALWINDOW_H_
#define OPENMMPSE_NUMERICS_RADIALWINDOW_H_

#include "numerics/Chebyshev.h"
#include "numerics/Lattice.h"
#include <array>

namespace PSE::numerics {

/**
 * What a loop over grid points needs to know of the kernel of one radius [T31]: a polynomial in
 * t = scale r^2 + shift, which is in [-1, 1] where the kernel is not zero.
 */
struct SphereKernel {
    double scale, shift;
    double inner; ///< the kernel is zero closer to the centre than this, 0 for none
    double reach; ///< and beyond this
    Polynomial polynomial;

    double operator()(double r) const;
};

/**
 * Spreads spheres of any radius onto one grid [T30]: the Kaiser-Bessel shape as a function of the
 * Cartesian distance,
 *
 *     w(r) = I0(beta sqrt(1 - (r/rho)^2))/I0(beta),  r <= rho = P h/2
 *
 * averaged over the surface of the sphere. Its transform is that of w times sinc(k a), exactly, so
 * what the grid makes of it does not depend on the radius. Lengths in any one unit.
 */
class RadialWindow {
public:
    /**
     * @param support  P, > 0
     * @param shape    beta, >= 1.57 P
     * @param spacing  h, of the grid
     */
    RadialWindow(double support, double shape, double spacing);
    /** The largest spacing of grid points along a box vector. */
    static double spacing(const Lattice& box, const std::array<int, 3>& grid);

    /** w itself, at r >= 0. */
    double operator()(double r) const;
    /** Its mean over the sphere of radius a > 0 about a point at the distance r; error 1e-13. */
    double operator()(double r, double a) const;
    /**
     * Three-dimensional Fourier transform of w, Int w exp(-i k x) d^3x, closed form; error 1e-14 of
     * that at k = 0.
     */
    double transform(double k) const;
    /**
     * Up to this wave number the transform is positive and falls no lower than beta^2 exp(-beta)/2
     * of its peak; no mode beyond is kept.
     */
    double band() const { return beta / rho; }
    double radius() const { return rho; }
    double reach(double a) const { return a + rho; }
    /**
     * The shell average for one radius as a polynomial, of the lowest degree (at most
     * MAX_DEGREE) whose error over the ball of radius reach(a), root mean square, is below maxError
     * times the root mean square of the average itself.
     */
    SphereKernel kernel(double a, double maxError) const;
    static constexpr int MAX_DEGREE = 24;

private:
    double moment(double s) const;

    double rho, beta, peak;
    Polynomial moments; ///< of moment(), in t = 2 s^2/rho^2 - 1
};

} // namespace PSE::numerics

#endif
