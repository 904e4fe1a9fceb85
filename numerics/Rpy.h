// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_RPY_H_
#define OPENMMPSE_NUMERICS_RPY_H_

#include <algorithm>

namespace PSE::numerics {

/**
 * The two scalars of an isotropic pair tensor F (I - rr) + G rr, r the unit vector between the
 * pair.
 */
struct PairScalars {
    double F, G;
};

/**
 * Scalars of an isotropic pair tensor written F I + C r r^T, r not normalised: C = (G - F)/r^2
 * stays finite at r = 0.
 */
struct SmoothScalars {
    double F, C;
};

/**
 * Coefficients of the Rotne-Prager-Yamakawa tensor [T3], for SIMD loops that evaluate many pairs:
 * F = F1/r + F3/r^3 and G likewise where the spheres are apart, F = 1 + F1 r where they overlap.
 */
struct RpyCoefficients {
    static constexpr double CONTACT = 2;
    static constexpr double APART_F1 = 0.75, APART_F3 = 0.5, APART_G1 = 1.5, APART_G3 = -1;
    static constexpr double OVERLAP_F1 = -9.0 / 32, OVERLAP_G1 = -3.0 / 16;
};

/**
 * Rotne-Prager-Yamakawa mobility of two equal spheres in infinite fluid, for every distance [T3].
 *
 * @param r  distance of the centres in units of the radius, >= 0 (at 0 the self mobility)
 * @return F and G in units of 1/(6 pi eta a)
 */
inline PairScalars rpyScalars(double r) {
    using c = RpyCoefficients;
    if (r < c::CONTACT)
        return {1 + c::OVERLAP_F1 * r, 1 + c::OVERLAP_G1 * r};
    const double s = 1 / r;
    return {s * (c::APART_F1 + c::APART_F3 * s * s), s * (c::APART_G1 + c::APART_G3 * s * s)};
}

/**
 * The same of two spheres of any radii, apart, overlapping, or one inside the other [T24]. Its
 * units follow from that of a length: with lengths in a, mobilities are in 1/(6 pi eta a).
 *
 * @param r   distance of the centres, >= 0
 * @param ai  radius of one sphere, > 0; aj  that of the other
 */
inline PairScalars rpyScalars(double r, double ai, double aj) {
    const double sum = ai + aj, difference2 = (ai - aj) * (ai - aj);
    if (r > sum) {
        const double s = 1 / r, squares = (ai * ai + aj * aj) * s * s;
        return {s * (0.75 + 0.25 * squares), s * (1.5 - 0.5 * squares)};
    }
    if (r * r <= difference2) {
        const double larger = 1 / std::max(ai, aj);
        return {larger, larger};
    }
    const double cube = 32 * r * r * r, skew = difference2 + 3 * r * r, gap = difference2 - r * r;
    const double F = 0.5 * sum - skew * skew / cube, along = 3 * gap * gap / cube;
    return {F / (ai * aj), (F + along) / (ai * aj)};
}

} // namespace PSE::numerics

#endif
