// SPDX-License-Identifier: MIT
// The force-coupling mobility: its pair scalars against quadrature, and what must hold of them.

#include "PairOracle.h"
#include "numerics/ForceCoupling.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace PSE::numerics;

namespace {

const double RADII[][2] = {{1, 1}, {1, 0.1}, {0.3, 2}, {5, 5}};
/// of the square root of ai^2 + aj^2, near which the series and the closed form meet (1.18)
const double SHARES[] = {0, 1e-7, 1e-3, 0.1, 0.5, 1, 1.18, 1.19, 1.5, 2, 3, 5, 10};

SmoothScalars byQuadrature(double r, double ai, double aj) {
    const long double s2 = ((long double)ai * ai + (long double)aj * aj) / std::acos(-1.0L),
                      s = std::sqrt(s2);
    return scalarsByTrapezium([s2](long double k) { return std::exp(-k * k * s2 / 2); }, 10 * s,
                              10 / s, r);
}

} // namespace

TEST(ForceCoupling, ScalarsAreTheIntegralOverAllWaves) {
    for (const auto& a : RADII)
        for (double share : SHARES) {
            const double size = std::sqrt(a[0] * a[0] + a[1] * a[1]), r = share * size;
            const SmoothScalars exact = byQuadrature(r, a[0], a[1]),
                                s = forceCouplingSmooth(r, a[0], a[1]);
            EXPECT_NEAR(s.F * size, exact.F * size, 1e-14) << a[0] << " " << a[1] << " " << r;
            EXPECT_NEAR(s.C / exact.C, 1, 1e-13) << a[0] << " " << a[1] << " " << r;
            const PairScalars pair = forceCouplingScalars(r, a[0], a[1]);
            EXPECT_EQ(pair.F, s.F);
            EXPECT_NEAR(pair.G * size, (exact.F + r * r * exact.C) * size, 1e-14);
        }
}

TEST(ForceCoupling, SelfMobilityIsThatOfASphere) {
    for (double a : {0.01, 1.0, 7.0}) {
        EXPECT_NEAR(forceCouplingScalars(0, a, a).F * a, 1, 1e-15);
        EXPECT_EQ(forceCouplingScalars(0, a, a).F, forceCouplingScalars(0, a, a).G);
    }
    // one envelope whose variance is the mean of both
    EXPECT_NEAR(forceCouplingScalars(0, 1, 2).F, std::sqrt(2 / 5.0), 1e-15);
    EXPECT_EQ(forceCouplingScalars(0.7, 1, 2).G, forceCouplingScalars(0.7, 2, 1).G);
}

TEST(ForceCoupling, FarAwayItIsOseenAndTheFiniteSizeOfGaussians) {
    // 1 - k^2 s^2/2 in place of the envelope: F = 3/(4 r) (1 + s^2/r^2), G = 3/(2 r) (1 - s^2/r^2)
    for (double r : {20.0, 1e4, 1e9}) {
        const PairScalars s = forceCouplingScalars(r, 1, 1);
        const double q = 2 / (M_PI * r * r);
        EXPECT_NEAR(s.F * r / (0.75 * (1 + q)), 1, 1e-14);
        EXPECT_NEAR(s.G * r / (1.5 * (1 - q)), 1, 1e-14);
        // Rotne-Prager-Yamakawa's leading order, with 2/3 in place of 2/pi in the next
        EXPECT_NEAR(s.F, rpyScalars(r).F, (0.0301 / (r * r) + 1e-15) * s.F);
    }
}

TEST(ForceCoupling, IsFreeOfDivergence) {
    // as TestPairFunctions.Rpy.IsFreeOfDivergence: G' + 2 (G - F)/r = 0, across the switch at 1.67
    for (double r : {0.3, 1.0, 1.6, 1.667, 1.7, 3.0, 10.0}) {
        const double e = 1e-4, slope = (forceCouplingScalars(r + e, 1, 1).G -
                                        forceCouplingScalars(r - e, 1, 1).G) /
                                       (2 * e);
        EXPECT_NEAR(slope + 2 * r * forceCouplingSmooth(r, 1, 1).C, 0, 1e-8) << r;
    }
}
