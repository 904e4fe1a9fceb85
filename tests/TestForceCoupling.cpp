// SPDX-License-Identifier: MIT
// The force-coupling mobility: its pair scalars against quadrature, its two ways in a periodic
// fluid (waves alone, and the prolate split) against each other, exact values and explicit sums.

#include "PairOracle.h"
#include "numerics/AllWaves.h"
#include "numerics/GaussianPairs.h"
#include "numerics/Plan.h"
#include "numerics/ProlateSplit.h"
#include "numerics/RealTable.h"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using namespace PSE::numerics;

namespace {

const double RADII[][2] = {{1, 1}, {1, 0.1}, {0.3, 2}, {5, 5}};
/// of the square root of ai^2 + aj^2, near which the series and the closed form meet (1.18)
const double SHARES[] = {0, 1e-7, 1e-3, 0.1, 0.5, 1, 1.18, 1.19, 1.5, 2, 3, 5, 10};

constexpr SphereModel FCM = SphereModel::ForceCoupling;

struct Shape {
    double c, R;
};
/// what Plans use: tolerances 1e-1 to 1e-10, short and long ranges
const Shape SHAPES[] = {{3, 2.4}, {5, 2.4},  {6.3, 4}, {9, 3.5},
                        {12, 5},  {16, 4.2}, {22, 6},  {30, 9}};

const Lattice BOXES[] = {Lattice::orthorhombic(5, 5, 5),
                         Lattice(Vec3(6, 0, 0), Vec3(3, 6, 0), Vec3(-3, 3, 6)),
                         Lattice::orthorhombic(3, 12, 3)};

/** Where neither the tail of the envelopes nor that of their waves is above 1e-16. */
constexpr double FARTHEST = 7, LAST_WAVE = 11;

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

/** Loops over many pairs evaluate them without a branch: the polynomials against the closed form.
 */
TEST(ForceCoupling, PolynomialsOfManyPairsAreTheClosedForm) {
    const auto horner = [](const std::vector<double>& powers, double t) {
        double sum = 0;
        for (size_t n = powers.size(); n-- > 0;)
            sum = sum * t + powers[n];
        return sum;
    };
    for (double error : {1e-3, 5e-8, 1e-13}) {
        const GaussianPairs pairs = gaussianPairs(error);
        EXPECT_LE(pairs.F.size(), error < 1e-10 ? 50u : 20u);
        const double allowed = error + 1e-14; // and the closed form's own
        for (const auto& a : RADII)
            for (double share = 0; share < 1e4; share = 1.07 * share + 0.01) {
                const double D2 = a[0] * a[0] + a[1] * a[1], r = share * std::sqrt(D2),
                             s = 1 / std::sqrt(D2 + GaussianPairs::SPREAD * r * r),
                             t = 2 * D2 * s * s - 1;
                const SmoothScalars exact = forceCouplingSmooth(r, a[0], a[1]);
                EXPECT_NEAR(s * horner(pairs.F, t) / exact.F, 1, allowed) << error << " " << share;
                EXPECT_NEAR(s * s * s * horner(pairs.C, t) / exact.C, 1, allowed)
                    << error << " " << share;
            }
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

TEST(ForceCouplingSplit, PeriodicSelfMobilityIsTheExactSeries) {
    // The cubic term is 4 pi/V times the order k^2 of the weight, 1/pi for the Gaussian as 1/3 for
    // the shell; images feel each other's envelopes by exp(-pi L^2/4), which is 1e-12 at L = 6.
    for (double L : {6.0, 8.0, 20.0}) {
        const Matrix3 M =
            periodicTensor(AllWaves(), 0, LAST_WAVE, Lattice::orthorhombic(L, L, L), Vec3::Zero());
        // of the self mobility nothing is left for real space: the free sphere has 1
        const double exact = 1 - 2.8372974794806 / L + 4 / (L * L * L);
        EXPECT_LT((M - exact * Matrix3::Identity()).norm(), 1e-11) << L;
    }
}

TEST(ForceCouplingSplit, BothHalvesAreNonNegativeModeByMode) {
    // for every bandwidth and range, with zeros far beyond the limit of RPY
    int shapes = 0, beyond = 0;
    for (double c = ProlateSplit::SMALLEST_BANDWIDTH; c <= ProlateSplit::LARGEST_BANDWIDTH;
         c += 0.9)
        for (double R = ProlateSplit::SMALLEST_RANGE; R < 16; R *= 1.12) {
            const ProlateSplit split(c, R, FCM);
            if (!split.isPositive())
                continue;
            shapes++;
            beyond += (split.firstZero() > ProlateSplit::LARGEST_ZERO);
            for (int i = 0; i <= 1000; i++) {
                const double k = split.firstZero() * i / 1000, w = split.waveWeight(k);
                ASSERT_GE(w, 0);
                ASSERT_GE(std::exp(-k * k / M_PI) - w, -1e-13) << c << " " << R << " " << k;
            }
        }
    EXPECT_GT(shapes, 200);
    EXPECT_GT(beyond, 50);
}

TEST(ForceCouplingSplit, MatchesTheGaussianToFourthOrder) {
    for (const Shape& v : SHAPES) {
        const ProlateSplit split(v.c, v.R, FCM);
        const auto difference = [&](double k) {
            return (std::exp(-k * k / M_PI) - split.waveWeight(k)) / (k * k);
        };
        // of order k^2: it falls to a quarter where k is halved
        EXPECT_NEAR(difference(0.02) / difference(0.01), 4, 0.05) << v.c;
    }
}

TEST(ForceCouplingSplit, PeriodicMobilityIsThatOfWavesAlone) {
    for (const Lattice& box : BOXES)
        for (const Vec3& d : {Vec3(0, 0, 0), Vec3(1e-7, 0, 0), Vec3(0.3, -0.2, 0.4),
                              Vec3(1.2, 1.6, 0), Vec3(1.4, 2.3, -1.1)}) {
            const Matrix3 exact = periodicTensor(AllWaves(), 0, LAST_WAVE, box, d);
            for (const Shape& v : SHAPES) {
                const ProlateSplit split(v.c, v.R, FCM);
                // pairs beyond R as well: the tail of the envelopes
                const double difference =
                    (periodicTensor(split, split.maxDistance(), split.firstZero(), box, d) - exact)
                        .cwiseAbs()
                        .maxCoeff();
                EXPECT_LT(difference, 3 * split.waveTruncation(1e3, 0.3) + 1e-11) << v.c;
                if (v.c == 30) {
                    EXPECT_LT(difference, 3e-11);
                }
            }
        }
}

TEST(ForceCouplingSplit, RealHalfBeyondItsRangeIsTheTailOfTheEnvelopes) {
    for (const Shape& v : SHAPES) {
        const ProlateSplit split(v.c, v.R, FCM);
        for (double r = 1.0001 * v.R; r < FARTHEST; r *= 1.1) {
            // F = 3/(4 r) (1 + q) erf(x) - .., q = 2/(pi r^2), x^2 = pi r^2/4: what erf lacks of 1
            const double q = 2 / (M_PI * r * r), x = 0.5 * std::sqrt(M_PI) * r;
            const double edge = 2 / (M_PI * r) * std::exp(-x * x);
            const PairScalars real = split.realScalars(r);
            EXPECT_NEAR(real.F, -0.75 / r * ((1 + q) * std::erfc(x) + edge), 1e-15) << r;
            EXPECT_NEAR(real.G, -1.5 / r * ((1 - q) * std::erfc(x) - edge), 1e-15) << r;
        }
    }
}

TEST(ForceCouplingSplit, TailBeyondTheRangeIsCounted) {
    // by Simpson's rule, from the closed form of the tail
    const double phi = 0.2, density = 3 * phi / (4 * M_PI);
    for (double R : {2.4, 3.2, 4.1}) {
        const ProlateSplit split(9, R, FCM);
        double random = 0, coherent = 0;
        const int n = 2000;
        for (int i = 0; i <= n; i++) {
            const double r = R + (FARTHEST - R) * (i + 1e-9) / n,
                         w = (i == 0 || i == n ? 1 : (i % 2 == 1 ? 4 : 2)) * (FARTHEST - R) /
                             (3 * n);
            const SmoothScalars far = forceCouplingFarField(r);
            const PairScalars all = forceCouplingScalars(r, 1, 1);
            const double F = all.F - far.F, G = all.G - far.F - far.C * r * r;
            random += w * 4 * M_PI * r * r * (2 * F * F + G * G) / 3;
            coherent += w * 4 * M_PI * r * r * std::fabs(2 * F + G) / 3;
        }
        const double expected = std::sqrt(density * random + std::pow(density * coherent, 2));
        EXPECT_NEAR(split.realTruncation(R, phi) / expected, 1, 0.01) << R;
        // a range cut shorter drops more
        EXPECT_GT(split.realTruncation(0.9 * R, phi), split.realTruncation(R, phi));
    }
}

TEST(ForceCouplingSplit, RealHalfIsPositiveForOverlappingParticles) {
    std::mt19937 random(7);
    const int n = 40;
    std::uniform_real_distribution<double> uniform(0, 5); // volume fraction 1.3
    std::vector<Vec3> x(n);
    for (Vec3& p : x)
        p = Vec3(uniform(random), uniform(random), uniform(random));
    x[1] = x[0] + Vec3(0.01, 0, 0);
    for (const Shape& v : SHAPES) {
        const ProlateSplit split(v.c, v.R, FCM);
        Eigen::MatrixXd M(3 * n, 3 * n);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                const Vec3 d = x[i] - x[j];
                const bool near = d.norm() <= split.maxDistance();
                M.block<3, 3>(3 * i, 3 * j) =
                    near ? tensor(split.realScalars(d.norm()), d) : Matrix3(Matrix3::Zero());
            }
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(M, Eigen::EigenvaluesOnly);
        // What lies below zero is what the dropped waves weigh.
        EXPECT_GT(eigen.eigenvalues()[0], -split.waveTruncation(1e3, 1) - 1e-12) << v.c;
    }
}

TEST(AllWaves, DroppedWavesAreTheComplementaryErrorFunction) {
    // one particle alone: (2/3) 6 pi/(2 pi^2) Int exp(-k^2/pi) dk from K on is erfc(K/sqrt(pi))
    const AllWaves split;
    for (double K : {1.0, 2.5, 4.3, 6.0, 8.0})
        EXPECT_NEAR(split.waveTruncation(K, 0) / std::erfc(K / std::sqrt(M_PI)), 1, 1e-8) << K;
    EXPECT_EQ(split.waveTruncation(12, 0.3), 0);
    EXPECT_EQ(split.realTruncation(0, 0.3), 0);
    EXPECT_EQ(split.realSelf(), 0);
    // Outside a cube there is less than outside the sphere in it, and more than outside the one
    // around it.
    const double f = 4;
    EXPECT_LT(split.bandTruncation({f, f, f}, 0.3).total(), split.waveTruncation(f, 0.3));
    EXPECT_GT(split.bandTruncation({f, f, f}, 0.3).total(),
              split.waveTruncation(std::sqrt(3.0) * f, 0.3));
}

TEST(AllWaves, WhereNoWindowServesAGridTheOneThatErrsLeastIsTaken) {
    PlanRequest r = {Lattice::orthorhombic(75, 75, 75), 1000, 1.0, 1e-5, true, 1e-5, false, {}};
    r.model = SphereModel::ForceCoupling;
    r.split = SplitChoice::AllWaves;
    r.overrides.grid = {32, 32, 32}; // the widest windows magnify rounding by more than waves count
    EXPECT_LT(makePlan(r).predictedError, 1);
}

TEST(ForceCouplingTable, IsPolynomialsAlone) {
    for (const Shape& v : SHAPES) {
        const ProlateSplit split(v.c, v.R, FCM);
        for (double maxError : {1e-3, 1e-6, 2.5e-12}) {
            const RealTable table = makeRealTable(split, v.R, maxError);
            EXPECT_FALSE(table.rpy);
            EXPECT_EQ(table.self, table(0).F); // two particles at one place
            EXPECT_NEAR(table.self, split.realSelf(), maxError);
            double worst = 0;
            for (int i = 1; i <= 500; i++) {
                const double r = v.R * i / 500.0;
                const PairScalars exact = split.realScalars(r);
                const SmoothScalars s = table(r);
                worst = std::max(
                    {worst, std::fabs(s.F - exact.F), std::fabs(s.F + s.C * r * r - exact.G)});
            }
            EXPECT_LE(worst, 2 * maxError + 1e-13) << v.c; // one error from each polynomial
        }
    }
}

TEST(ForceCouplingTable, PowersServeHornersRule) {
    for (const Shape& v : SHAPES) {
        const ProlateSplit split(v.c, v.R, FCM);
        if (split.tableRange(true) < v.R)
            continue;
        const RealTable table = makeRealTable(split, v.R, 1e-6);
        double worst = 0;
        for (int i = 0; i <= 500; i++) {
            const float t = float(i / 250.0 - 1);
            float sum = 0;
            for (int n = table.F.degree(); n >= 0; n--)
                sum = sum * t + float(table.F.powers[n]);
            const double r = v.R * std::sqrt(0.5 * (1 + double(t)));
            worst = std::max(worst, std::fabs(-double(sum) - split.realScalars(r).F));
        }
        EXPECT_LE(worst, 1e-6 + 5e-7) << v.c;
    }
}
