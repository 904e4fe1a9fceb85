// SPDX-License-Identifier: MIT
#include "numerics/UnboundedPlan.h"
#include <algorithm>

namespace PSE::numerics {

namespace {

/// of M f for forces of any kind, up to 10,000 particles
constexpr double SINGLE_ROUNDING = 1e-6, DOUBLE_ROUNDING = 1e-14;
/// Of the polynomials of force coupling, which pass their error on to M f.
constexpr double SINGLE_POLYNOMIALS = 5e-8, DOUBLE_POLYNOMIALS = 1e-13;
/// Of the tolerance; the rest is left to M itself, as in a periodic fluid.
constexpr double NOISE_SHARE = 0.5;
/// Of the rounding of M f: what an eigenvalue of zero may become in a Lanczos process.
constexpr double NEGATIVE_SHARE = 10;
constexpr double SMALLEST_NEGATIVE = 1e-10;

} // namespace

UnboundedPlan makeUnboundedPlan(const UnboundedRequest& request, const std::vector<double>& radii) {
    UnboundedPlan plan;
    const auto ends = std::minmax_element(radii.begin(), radii.end());
    plan.a = *ends.first;
    plan.equalRadii = (*ends.first == *ends.second);
    plan.model = request.model;
    const bool single = request.tolerance >= request.singleFloor;
    plan.precision = (single ? Precision::Single : Precision::Double);
    plan.lanczosTolerance =
        (request.lanczosTolerance > 0 ? request.lanczosTolerance : NOISE_SHARE * request.tolerance);
    plan.predictedError = (single ? SINGLE_ROUNDING : DOUBLE_ROUNDING);
    if (plan.model == SphereModel::ForceCoupling) {
        const double error = (single ? SINGLE_POLYNOMIALS : DOUBLE_POLYNOMIALS);
        plan.gaussian = gaussianPairs(error);
        plan.predictedError += error;
    }
    plan.negativeTolerance = std::max(NEGATIVE_SHARE * plan.predictedError, SMALLEST_NEGATIVE);
    return plan;
}

} // namespace PSE::numerics
