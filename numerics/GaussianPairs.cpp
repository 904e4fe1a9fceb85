// SPDX-License-Identifier: MIT
#include "numerics/GaussianPairs.h"
#include "numerics/Chebyshev.h"
#include "numerics/ForceCoupling.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

namespace {

/// where neglected coefficients are below rounding
constexpr int HIGHEST_DEGREE = 80;
/// What P and Q do not fall below: their limits far away, 3/4 SPREAD^{1/2} and 3/4 SPREAD^{3/2}.
constexpr double LEAST_P = 0.41, LEAST_Q = 0.123;

} // namespace

GaussianPairs gaussianPairs(double error) {
    // Neither P nor Q depends on the radii.
    constexpr double D2 = 2;
    const auto at = [](double t, bool forC) {
        const double r = std::sqrt(D2 * (2 / (1 + t) - 1) / GaussianPairs::SPREAD),
                     s = std::sqrt((1 + t) / (2 * D2));
        const SmoothScalars pair = forceCouplingSmooth(r, 1, 1);
        return forC ? pair.C / (s * s * s) : pair.F / s;
    };
    const auto fit = [&](bool forC) {
        return fitPolynomial([&](double t) { return at(t, forC); },
                             error * (forC ? LEAST_Q : LEAST_P), 1, HIGHEST_DEGREE)
            .powers;
    };
    GaussianPairs pairs = {fit(false), fit(true)};
    const size_t terms = std::max(pairs.F.size(), pairs.C.size());
    pairs.F.resize(terms, 0.0);
    pairs.C.resize(terms, 0.0);
    return pairs;
}

} // namespace PSE::numerics
