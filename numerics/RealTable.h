// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_REALTABLE_H_
#define OPENMMPSE_NUMERICS_REALTABLE_H_

#include "numerics/Chebyshev.h"
#include "numerics/Split.h"

namespace PSE::numerics {

/**
 * The real-space half as a platform evaluates it: RPY minus two polynomials in t = 2 r^2/rc^2 - 1
 * for the smooth wave part, M_R = (F_rpy - F(t)) I + ((G_rpy - F_rpy)/r^2 - C(t)) r r^T [T7]. With
 * force coupling, itself smooth, the polynomials are the wave part minus all of it, and nothing
 * takes the place of RPY [T42]. Reduced units of Split.h.
 */
struct RealTable {
    double rc;   ///< range in radii
    double self; ///< diagonal of M_R
    /// the errors of F and of rc^2 C are below the maxError asked for
    Polynomial F, C;
    bool rpy; ///< whether the branches of RPY are to be added

    /**
     * Real-space scalars, M_R = F I + C r r^T, at 0 <= r <= rc; C = 0 at r = 0, where r r^T
     * vanishes.
     */
    SmoothScalars operator()(double r) const;
};

/**
 * @param maxError  absolute error allowed in either scalar, in 1/(6 pi eta a); 1e-12 is the floor
 * of Hasimoto's quadrature
 */
RealTable makeRealTable(const Split& split, double rc, double maxError);

} // namespace PSE::numerics

#endif
