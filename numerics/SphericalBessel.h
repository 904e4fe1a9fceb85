// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_SPHERICALBESSEL_H_
#define OPENMMPSE_NUMERICS_SPHERICALBESSEL_H_

#include <cmath>

namespace PSE::numerics {

/** sin(x)/x; error 1e-16. */
inline double sinc(double x) {
    return std::fabs(x) < 1e-4 ? 1 - x * x / 6 : std::sin(x) / x;
}

/**
 * j0(x), j1(x)/x and j2(x)/x^2 (spherical Bessel), by their series below x = 0.5 where the closed
 * forms cancel; error 1e-14.
 */
struct BesselRatios {
    double j0, j1x, j2x2;
};

inline BesselRatios besselRatios(double x) {
    const double x2 = x * x;
    if (x < 0.5)
        return {
            1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72 * (1 - x2 / 110)))),
            1.0 / 3 -
                x2 * (1.0 / 30 - x2 * (1.0 / 840 -
                                       x2 * (1.0 / 45360 - x2 * (1.0 / 3991680 - x2 / 518918400)))),
            1.0 / 15 - x2 * (1.0 / 210 - x2 * (1.0 / 7560 - x2 * (1.0 / 498960 - x2 / 51891840)))};
    const double j0 = std::sin(x) / x;
    const double j1x = (j0 - std::cos(x)) / x2;
    return {j0, j1x, (3 * j1x - j0) / x2};
}

} // namespace PSE::numerics

#endif
