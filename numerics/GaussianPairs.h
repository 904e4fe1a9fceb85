// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_GAUSSIANPAIRS_H_
#define OPENMMPSE_NUMERICS_GAUSSIANPAIRS_H_

#include <vector>

namespace PSE::numerics {

/**
 * The force-coupling tensor of two spheres as loops over many pairs evaluate it: by one inverse
 * root and two polynomials for every distance, without a branch or a transcendental function [T53].
 * With D^2 = ai^2 + aj^2 and s = (D^2 + SPREAD r^2)^{-1/2},
 *
 *     F = s P(t),   C = s^3 Q(t),   t = 2 D^2 s^2 - 1 in (-1, 1].
 */
struct GaussianPairs {
    static constexpr double SPREAD = 0.3;
    /// powers of t, lowest first, as many of both
    std::vector<double> F, C;
};

/**
 * @param error  of F and of C, relative, in exact arithmetic; >= 1e-14
 */
GaussianPairs gaussianPairs(double error);

} // namespace PSE::numerics

#endif
