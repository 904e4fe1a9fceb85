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
    if (!rpy)
        return {-F(t), r == 0 ? 0 : -C(t)};
    const PairScalars branches = rpyScalars(r);
    if (r == 0)
        return {branches.F - F(t), 0};
    return {branches.F - F(t), (branches.G - branches.F) / (r * r) - C(t)};
}

RealTable makeRealTable(const Split& split, double rc, double maxError) {
    const auto distance = [rc](double t) { return rc * std::sqrt(std::max(0.0, 0.5 * (1 + t))); };
    RealTable table;
    table.rc = rc;
    table.rpy = (split.model() == SphereModel::RotnePragerYamakawa);
    const auto smooth = [&](double t) {
        SmoothScalars part = split.waveScalars(distance(t));
        if (!table.rpy) {
            const SmoothScalars total = forceCouplingSmooth(distance(t), 1, 1);
            part = {part.F - total.F, part.C - total.C};
        }
        return part;
    };
    table.F = fitPolynomial([&](double t) { return smooth(t).F; }, maxError, 2, MAX_DEGREE);
    // From the table, not from the split: then two particles at one place have exactly no relative
    // mobility.
    table.self = table(0).F;
    table.C =
        fitPolynomial([&](double t) { return smooth(t).C; }, maxError / (rc * rc), 2, MAX_DEGREE);
    return table;
}

} // namespace PSE::numerics
