// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_RPY_H_
#define OPENMMPSE_NUMERICS_RPY_H_

namespace PSE::numerics {

/**
 * The two scalars of an isotropic pair tensor F (I - rr) + G rr, r the unit vector between the
 * pair.
 */
struct PairScalars {
    double F, G;
};

/**
 * Rotne-Prager-Yamakawa mobility of two equal spheres in infinite fluid, for every distance [T3].
 *
 * @param r  distance of the centres in units of the radius, >= 0 (at 0 the self mobility)
 * @return F and G in units of 1/(6 pi eta a)
 */
template <class Real> inline void rpyScalars(Real r, Real& F, Real& G) {
    // Both regimes, then a choice: loops over many r stay SIMD. At r = 0 the unused one is
    // infinite.
    const Real s = 1 / r;
    const Real apartF = s * (Real(0.75) + Real(0.5) * s * s), apartG = s * (Real(1.5) - s * s);
    const Real overlapF = 1 - Real(9.0 / 32) * r, overlapG = 1 - Real(3.0 / 16) * r;
    F = (r >= 2 ? apartF : overlapF);
    G = (r >= 2 ? apartG : overlapG);
}

inline PairScalars rpyScalars(double r) {
    PairScalars s;
    rpyScalars(r, s.F, s.G);
    return s;
}

} // namespace PSE::numerics

#endif
