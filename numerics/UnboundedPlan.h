// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_UNBOUNDEDPLAN_H_
#define OPENMMPSE_NUMERICS_UNBOUNDEDPLAN_H_

// The numbers behind one tolerance where the fluid has no boundary [T32]: sums over all pairs have
// neither a cut-off nor a grid, so that little is left to choose.

#include "numerics/GaussianPairs.h"
#include "numerics/Plan.h"
#include "numerics/SphereModel.h"
#include <limits>
#include <vector>

namespace PSE::numerics {

/** What the numbers depend on. */
struct UnboundedRequest {
    double tolerance;        ///< allowed relative error of M f
    double lanczosTolerance; ///< as prescribed; 0: automatic
    /// smallest tolerance the platform's single precision serves; infinite: always double
    double singleFloor = std::numeric_limits<double>::infinity();
    SphereModel model = SphereModel::RotnePragerYamakawa;
};

/** Everything that a platform needs to know about the numerics of an unbounded fluid. */
struct UnboundedPlan {
    /// smallest radius (nm): the unit of lengths, and of mobilities 1/(6 pi eta a)
    double a;
    bool equalRadii;
    SphereModel model;
    GaussianPairs gaussian; ///< of force coupling: how loops over pairs evaluate it
    Precision precision;
    double lanczosTolerance;  ///< relative error of the noise
    double predictedError;    ///< of M f: rounding, and that of `gaussian`
    double negativeTolerance; ///< eigenvalues above minus this of the largest count as zero
};

/**
 * @param radii  of the particles that feel the fluid (nm), at least one
 */
UnboundedPlan makeUnboundedPlan(const UnboundedRequest& request, const std::vector<double>& radii);

} // namespace PSE::numerics

#endif
