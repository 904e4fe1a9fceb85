// SPDX-License-Identifier: MIT
#include "numerics/RealTable.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

namespace {
constexpr int MAX_DEGREE = 48; ///< enough for 1e-13 up to xi rc = 7
}

SmoothScalars RealTable::operator()(double r) const {
    const double t = 2 * r * r / (rc * rc) - 1;
    const PairScalars rpy = rpyScalars(r);
    if (r == 0)
        return {rpy.F - F(t), 0};
    return {rpy.F - F(t), (rpy.G - rpy.F) / (r * r) - C(t)};
}

RealTable makeRealTable(const Split& split, double rc, double maxError) {
    const auto distance = [rc](double t) { return rc * std::sqrt(std::max(0.0, 0.5 * (1 + t))); };
    RealTable table;
    table.rc = rc;
    table.F = fitPolynomial([&](double t) { return split.waveScalars(distance(t)).F; }, maxError, 2,
                            MAX_DEGREE);
    // From the table, not from the split: then two particles at one place have exactly no relative
    // mobility.
    table.self = 1 - table.F(-1);
    table.C = fitPolynomial([&](double t) { return split.waveScalars(distance(t)).C; },
                            maxError / (rc * rc), 2, MAX_DEGREE);
    return table;
}

} // namespace PSE::numerics
