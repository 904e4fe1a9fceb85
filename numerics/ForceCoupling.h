// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_FORCECOUPLING_H_
#define OPENMMPSE_NUMERICS_FORCECOUPLING_H_

#include "numerics/Rpy.h"
#include <cmath>

namespace PSE::numerics {

/** sigma^2 over a^2 of the Gaussian envelope of a sphere of radius a: the self mobility is then
 * 1/(6 pi eta a) [T41]. */
constexpr double ENVELOPE_VARIANCE = 1 / M_PI;

/** The product of the transforms of two Gaussian envelopes, exp(-k^2 (ai^2 + aj^2)/(2 pi)), is the
 * wave weight of their mobility [T41]; of equal ones with lengths in a exp(-k^2/pi). */
inline double forceCouplingWeight(double k) {
    return std::exp(-ENVELOPE_VARIANCE * k * k);
}

/**
 * Force-coupling mobility of two spheres with Gaussian envelopes in infinite fluid, F I + C r r^T,
 * for every distance [T41]. Both scalars are entire functions of r^2: by their series below r^2 =
 * ai^2 + aj^2, where the closed form cancels. Its units follow from that of a length: with lengths
 * in a, mobilities are in 1/(6 pi eta a). Relative error 1e-14 in F, and in C up to r = 1e4.
 *
 * @param r   distance of the centres, >= 0
 * @param ai  radius of one sphere, > 0; aj  that of the other
 */
inline SmoothScalars forceCouplingSmooth(double r, double ai, double aj) {
    constexpr int TERMS = 20; // the first one left out is 1e-17 of the sum at t = 1.1
    constexpr double SERIES = 1.1;
    // the pair feels one Gaussian whose variance is the sum of both
    const double s2 = ENVELOPE_VARIANCE * (ai * ai + aj * aj), s = std::sqrt(s2),
                 height = 1 / (s * std::sqrt(2 * M_PI)), t = r * r / (2 * s2);
    if (t < SERIES) {
        SmoothScalars sum = {0, 0};
        double power = 1; // (-t)^n/n!
        for (int n = 0; n < TERMS; n++) {
            const double odd = 2 * n + 1;
            sum.F += power * (odd + 1) / (odd * (odd + 2));
            sum.C += power / ((odd + 2) * (odd + 4));
            power *= -t / (n + 1);
        }
        return {3 * height * sum.F, 3 * height / s2 * sum.C};
    }
    const double q = s2 / (r * r), inside = std::erf(std::sqrt(t)),
                 edge = 2 * s2 / r * height * std::exp(-t), scale = 0.75 / r;
    return {scale * ((1 + q) * inside - edge), scale / (r * r) * ((1 - 3 * q) * inside + 3 * edge)};
}

/** The same as F (I - rr) + G rr, r the unit vector. */
inline PairScalars forceCouplingScalars(double r, double ai, double aj) {
    const SmoothScalars s = forceCouplingSmooth(r, ai, aj);
    return {s.F, s.F + s.C * r * r};
}

/**
 * The smooth scalars of two spheres of radius 1 without the tail of their envelopes, which decays
 * as exp(-pi r^2/4): what any weight 1 - k^2/pi + O(k^4) has in common with theirs far away [T42];
 * r > 0.
 */
inline SmoothScalars forceCouplingFarField(double r) {
    const double q = 2 * ENVELOPE_VARIANCE / (r * r);
    return {0.75 / r * (1 + q), 0.75 / (r * r * r) * (1 - 3 * q)};
}

} // namespace PSE::numerics

#endif
