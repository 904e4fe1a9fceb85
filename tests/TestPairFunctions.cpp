// SPDX-License-Identifier: MIT
// RPY, the split and its real-space table, against quadrature by another rule, closed forms and
// lattice sums.

#include "PairOracle.h"
#include "numerics/RealTable.h"
#include "numerics/HasimotoSplit.h"
#include <Eigen/Eigenvalues>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using namespace PSE::numerics;

namespace {

const double XIS[] = {0.05, 0.3, 0.5, 1, 2};
const double DISTANCES[] = {0, 0.1, 0.5, 1.9, 2, 2.1, 5, 10};

long double hasimotoWeight(long double k, long double xi) {
    const long double sinc = (k == 0 ? 1 : std::sin(k) / k), q = k * k / (4 * xi * xi);
    return sinc * sinc * (1 + q) * std::exp(-q);
}

/**
 * The wave scalars by the trapezium rule in extended precision. The integrands are even and entire,
 * and their transforms decay as a Gaussian beyond r + 2, so the rule converges faster than any
 * power: error about 1e-18.
 */
SmoothScalars waveReference(double xi, double r) {
    const long double x = xi;
    return scalarsByTrapezium([x](long double k) { return hasimotoWeight(k, x); }, 2 + 8 / x,
                              14 * x, r);
}

/**
 * The real-space scalars in closed form, (A2) and (A3) of Fiore et al., J. Chem. Phys. 146, 124116
 * (2017), with a = 1, in extended precision; r > 0.
 */
PairScalars closedForm(double xiDouble, double rDouble) {
    const long double x = xiDouble, r = rDouble, x2 = x * x, x3 = x2 * x, x4 = x2 * x2, r2 = r * r,
                      r3 = r2 * r, r4 = r2 * r2;
    const long double root = std::sqrt(std::acos(-1.0L));
    const long double lower = 4 + 4 * r + 9 * r2, upper = 4 - 4 * r + 9 * r2, m = 2 - r, p = 2 + r;
    const long double e0 = std::exp(-r2 * x2), em = std::exp(-m * m * x2),
                      ep = std::exp(-p * p * x2);
    const long double c0 = std::erfc(r * x), cm = std::erfc(-m * x), cp = std::erfc(p * x);
    const long double F = (r < 2 ? -m * m * lower / (32 * r3) : 0) +
                          (18 * r2 * x2 + 3) / (64 * root * r2 * x3) * e0 +
                          (2 * x2 * m * lower - 2 - 3 * r) / (128 * root * r3 * x3) * em +
                          (-2 * x2 * p * upper + 2 - 3 * r) / (128 * root * r3 * x3) * ep +
                          (3 - 36 * r4 * x4) / (128 * r3 * x4) * c0 +
                          (4 * x4 * m * m * lower - 3) / (256 * r3 * x4) * cm +
                          (4 * x4 * p * p * upper - 3) / (256 * r3 * x4) * cp;
    const long double G = (r < 2 ? m * m * m * (2 + 3 * r) / (16 * r3) : 0) +
                          (6 * r2 * x2 - 3) / (32 * root * r2 * x3) * e0 +
                          (-2 * x2 * m * m * (2 + 3 * r) + 2 + 3 * r) / (64 * root * r3 * x3) * em +
                          (2 * x2 * p * p * (2 - 3 * r) - 2 + 3 * r) / (64 * root * r3 * x3) * ep -
                          3 * (4 * r4 * x4 + 1) / (64 * r3 * x4) * c0 +
                          (3 - 4 * x4 * m * m * m * (2 + 3 * r)) / (128 * r3 * x4) * cm +
                          (3 - 4 * x4 * (2 - 3 * r) * p * p * p) / (128 * r3 * x4) * cp;
    return {double(F), double(G)};
}

/** The periodic pair tensor by its two lattice sums; error below 1e-13. */
Matrix3 periodicTensor(const HasimotoSplit& split, double xi, const Lattice& box, const Vec3& d) {
    return periodicTensor(split, std::min(2 + 6.5 / xi, split.maxDistance()), 12.5 * xi, box, d);
}

double maximum(double a, double b, double c) {
    return std::max(a, std::max(b, c));
}

} // namespace

TEST(Rpy, ValuesAtSpecialDistances) {
    EXPECT_EQ(rpyScalars(0.0).F, 1);
    EXPECT_EQ(rpyScalars(0.0).G, 1);
    EXPECT_DOUBLE_EQ(rpyScalars(0.5).F, 0.859375); // overlapping pair
    EXPECT_DOUBLE_EQ(rpyScalars(0.5).G, 0.90625);
    EXPECT_DOUBLE_EQ(rpyScalars(2.0).F, 0.4375); // touching pair
    EXPECT_DOUBLE_EQ(rpyScalars(2.0).G, 0.625);
    EXPECT_NEAR(rpyScalars(1e6).F, 0.75e-6, 1e-17); // Oseen far away
    EXPECT_NEAR(rpyScalars(1e6).G, 1.5e-6, 1e-17);
    EXPECT_NEAR(rpyScalars(2.5).F, 0.75 / 2.5 + 0.5 / 15.625, 1e-15);
    EXPECT_NEAR(rpyScalars(2.5).G, 1.5 / 2.5 - 1 / 15.625, 1e-15);
}

TEST(Rpy, ValueAndSlopeAreContinuousAtContact) {
    const double e = 1e-6;
    const PairScalars inside = rpyScalars(2 - e), at = rpyScalars(2.0), outside = rpyScalars(2 + e);
    EXPECT_NEAR((at.F - inside.F) / e, (outside.F - at.F) / e, 1e-5);
    EXPECT_NEAR((at.G - inside.G) / e, (outside.G - at.G) / e, 1e-5);
}

TEST(Rpy, IsFreeOfDivergence) {
    // div[F (I - rr) + G rr] = [G' + 2 (G - F)/r] r: no drift term is needed in the equation of
    // motion.
    for (double r : {0.3, 1.0, 1.9, 2.1, 3.0, 10.0}) {
        const double e = 1e-4;
        const double slope = (rpyScalars(r + e).G - rpyScalars(r - e).G) / (2 * e);
        EXPECT_NEAR(slope + 2 * (rpyScalars(r).G - rpyScalars(r).F) / r, 0, 1e-7);
    }
}

TEST(Split, WaveScalarsAgreeWithAnotherQuadrature) {
    for (double xi : XIS) {
        const HasimotoSplit split(xi);
        for (double r : DISTANCES) {
            if (r > split.maxDistance())
                continue;
            const SmoothScalars s = split.waveScalars(r), exact = waveReference(xi, r);
            EXPECT_NEAR(s.F, exact.F, 1e-12) << xi << " " << r;
            EXPECT_NEAR(s.C, exact.C, 1e-12) << xi << " " << r;
        }
    }
}

TEST(Split, WaveScalarsHoldAtTheLimitsOfThePlan) {
    for (double xi : {1e-6, 1e-3, 20.0}) {
        const HasimotoSplit split(xi);
        for (double share : {0.0, 1e-4, 0.01, 0.2, 0.5, 1.0}) {
            const double r = share * split.maxDistance(), scale = std::min(1.0, xi);
            const SmoothScalars s = split.waveScalars(r), exact = waveReference(xi, r);
            EXPECT_NEAR(s.F, exact.F, 1e-12 * scale) << xi << " " << r;
            EXPECT_NEAR(r * r * s.C, r * r * exact.C, 1e-12 * scale) << xi << " " << r;
        }
    }
}

TEST(Split, BesselSeriesAndClosedFormsMeet) {
    // The largest k r passes the switch at 0.5 for these r: no jump may show.
    const HasimotoSplit split(1);
    for (double r = 0.01; r < 0.2; r *= 1.05) {
        const SmoothScalars exact = waveReference(1, r), s = split.waveScalars(r);
        ASSERT_NEAR(s.F, exact.F, 1e-13);
        ASSERT_NEAR(s.C, exact.C, 1e-12);
    }
}

TEST(Split, RealScalarsAreTheClosedFormsWhereThoseDoNotCancel) {
    for (double xi : {0.3, 0.5, 1.0, 2.0}) {
        const HasimotoSplit split(xi);
        for (double r : {0.5, 1.0, 1.9, 1.9999, 2.0, 2.0001, 2.5, 4.0, 6.0, 10.0}) {
            if (r > split.maxDistance())
                continue;
            const PairScalars s = split.realScalars(r), exact = closedForm(xi, r);
            EXPECT_NEAR(s.F, exact.F, 1e-12) << xi << " " << r;
            EXPECT_NEAR(s.G, exact.G, 1e-12) << xi << " " << r;
        }
    }
}

TEST(Split, RealSelfIsTheClosedForm) {
    const double root = std::sqrt(M_PI);
    for (double xi : {1e-6, 0.05, 0.3, 0.5, 1.0, 2.0, 20.0}) {
        const HasimotoSplit split(xi);
        const double exact = (-std::expm1(-4 * xi * xi)) / (4 * root * xi) +
                             std::erfc(2 * xi); // (A4) of Fiore et al. 2017
        EXPECT_NEAR(split.realSelf(), exact, 1e-12) << xi;
        EXPECT_NEAR(split.realScalars(0).F, exact, 1e-12);
        EXPECT_NEAR(split.realScalars(0).G, exact, 1e-12);
    }
}

TEST(Split, RealScalarsDecayAsAGaussianBeyondContact) {
    for (double xi : {1e-3, 0.05, 0.5, 1.0, 2.0, 20.0}) {
        const HasimotoSplit split(xi);
        for (double y = 0; y <= 8; y += 0.05) {
            const PairScalars s = split.realScalars(std::min(2 + y / xi, split.maxDistance()));
            EXPECT_LT(std::fabs(s.F), std::exp(-y * y) + 1e-12) << xi << " " << y;
            EXPECT_LT(std::fabs(s.G), std::exp(-y * y) + 1e-12) << xi << " " << y;
        }
    }
}

TEST(Split, FullWaveWeightGivesBackRpy) {
    // With a narrow real half, RPY itself must follow from (3/pi) Int sinc^2 [..] dk. Of the real
    // half nothing is left beyond contact; in overlap the algebraic terms of (A2), (A3) are: F =
    // -3/(128 xi^4 r^3) = -G/2.
    const double xi = 20, tail = 3 / (128 * xi * xi * xi * xi);
    const HasimotoSplit split(xi);
    for (double r : {0.5, 1.0, 1.6}) {
        EXPECT_NEAR(split.realScalars(r).F, -tail / (r * r * r), 1e-12) << r;
        EXPECT_NEAR(split.realScalars(r).G, 2 * tail / (r * r * r), 1e-12) << r;
    }
    const HasimotoSplit wide(5);
    for (double r : {3.2, 3.4, 3.6}) {
        EXPECT_NEAR(wide.realScalars(r).F, 0, 1e-12) << r;
        EXPECT_NEAR(wide.realScalars(r).G, 0, 1e-12) << r;
    }
}

TEST(Split, BothHalvesAreNonNegativeModeByMode) {
    for (double xi : {1e-6, 0.05, 0.5, 2.0, 20.0}) {
        const HasimotoSplit split(xi);
        EXPECT_EQ(split.waveWeight(0), 1);
        for (int i = 0; i <= 20000; i++) {
            const double k = 15 * xi * i / 20000, sinc = (k == 0 ? 1 : std::sin(k) / k);
            ASSERT_GE(split.waveWeight(k), 0);
            ASSERT_GE(sinc * sinc - split.waveWeight(k), -1e-15)
                << xi << " " << k; // rounding of the difference
        }
    }
}

TEST(Split, RealHalfIsPositiveForOverlappingParticles) {
    std::mt19937 random(7);
    for (double xi : {0.3, 0.7, 1.5}) {
        const HasimotoSplit split(xi);
        const int n = 40;
        std::uniform_real_distribution<double> uniform(
            0, 5); // volume fraction 1.3: nearly all overlap
        std::vector<Vec3> x(n);
        for (Vec3& p : x)
            p = Vec3(uniform(random), uniform(random), uniform(random));
        x[1] = x[0] + Vec3(0.01, 0, 0);
        Eigen::MatrixXd M(3 * n, 3 * n);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                const double r = std::min((x[i] - x[j]).norm(), split.maxDistance());
                M.block<3, 3>(3 * i, 3 * j) = tensor(split.realScalars(r), x[i] - x[j]);
            }
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(M, Eigen::EigenvaluesOnly);
        EXPECT_GT(eigen.eigenvalues()[0], 0) << xi;
    }
}

TEST(Split, PeriodicSelfMobilityIsTheExactSeries) {
    for (double L : {2.2, 4.0, 10.0})
        for (double xi : {0.6, 1.1}) {
            const double exact = 1 - 2.8372974794806 / L + 4 * M_PI / 3 / (L * L * L);
            const Matrix3 M =
                periodicTensor(HasimotoSplit(xi), xi, Lattice::orthorhombic(L, L, L), Vec3::Zero());
            EXPECT_LT((M - exact * Matrix3::Identity()).norm(), 1e-11) << L << " " << xi;
        }
}

TEST(Split, PeriodicSelfMobilityOfCentredLatticesHasHasimotosConstants) {
    const double d = 3.5, s = std::sqrt(2.0), t = std::sqrt(6.0);
    const Lattice bcc(Vec3(d, 0, 0), Vec3(d / 3, 2 * s / 3 * d, 0),
                      Vec3(-d / 3, s / 3 * d, t / 3 * d));
    const Lattice fcc(Vec3(d, 0, 0), Vec3(0, d, 0), Vec3(d / 2, d / 2, s / 2 * d));
    for (double xi : {0.6, 1.0}) {
        const double phiB = 4 * M_PI / 3 / bcc.volume(), phiF = 4 * M_PI / 3 / fcc.volume();
        const Matrix3 B = periodicTensor(HasimotoSplit(xi), xi, bcc, Vec3::Zero());
        const Matrix3 F = periodicTensor(HasimotoSplit(xi), xi, fcc, Vec3::Zero());
        EXPECT_LT((B - (1 - 1.7918585114 * std::cbrt(phiB) + phiB) * Matrix3::Identity()).norm(),
                  1e-9);
        EXPECT_LT((F - (1 - 1.7917472304 * std::cbrt(phiF) + phiF) * Matrix3::Identity()).norm(),
                  1e-9);
    }
}

TEST(Split, PeriodicPairMobilityDoesNotDependOnXi) {
    const Lattice boxes[] = {Lattice::orthorhombic(5, 5, 5),
                             Lattice(Vec3(6, 0, 0), Vec3(3, 6, 0), Vec3(-3, 3, 6)),
                             Lattice::orthorhombic(3, 12, 3)};
    for (const Lattice& box : boxes)
        for (const Vec3& d :
             {Vec3(1e-7, 0, 0), Vec3(0.3, -0.2, 0.4), Vec3(1.2, 1.6, 0), Vec3(1.4, 2.3, -1.1)}) {
            const Matrix3 first = periodicTensor(HasimotoSplit(0.65), 0.65, box, d);
            const Matrix3 second = periodicTensor(HasimotoSplit(1.2), 1.2, box, d);
            EXPECT_LT((first - second).cwiseAbs().maxCoeff(), 1e-11);
        }
}

TEST(Split, RefusesNothingItCanDoAtTheEnds) {
    // Cut-offs exist for the loosest and the tightest error at the extremes of xi.
    for (double xi : {1e-6, 0.5, 20.0}) {
        const HasimotoSplit split(xi);
        for (double error : {0.05, 1e-3, 5e-11}) {
            const double rc = split.realCutoff(error, 0.3), kc = split.waveCutoff(error, 0.3);
            EXPECT_GE(rc, 2);
            EXPECT_LE(rc, split.maxDistance());
            EXPECT_LE(split.realTruncation(rc, 0.3), error);
            EXPECT_LE(split.waveTruncation(kc, 0.3), error);
            EXPECT_LT(kc, 13 * xi);
        }
    }
}

TEST(RealTable, FitsWithinTheErrorAskedFor) {
    const double cases[][2] = {{1e-3, 5000}, {0.1, 80}, {0.5, 4},    {0.5, 16},
                               {1, 8},       {2, 4},    {3.9, 2.05}, {1, 2}};
    for (const auto& c : cases) {
        const HasimotoSplit split(c[0]);
        const double rc = c[1];
        for (double maxError : {1e-2, 1e-4, 1e-6, 1e-9, 2.5e-12}) {
            const RealTable table = makeRealTable(split, rc, maxError);
            EXPECT_EQ(table.rc, rc);
            EXPECT_NEAR(table.self, split.realSelf(), maxError);
            // no relative mobility of two particles at one place
            EXPECT_EQ(table.self, table(0).F);
            double worst = 0;
            for (int i = 0; i <= 700; i++) {
                const double r = rc * i / 700.0, t = 2 * r * r / (rc * rc) - 1;
                const SmoothScalars wave = split.waveScalars(r);
                worst = maximum(worst, std::fabs(table.F(t) - wave.F),
                                rc * rc * std::fabs(table.C(t) - wave.C));
            }
            EXPECT_LE(worst, maxError + 1e-13) // and what rounding adds
                << "xi " << c[0] << " rc " << rc << " degree " << table.F.degree();
        }
    }
}

TEST(RealTable, ScalarsAreThoseOfTheSplit) {
    for (double xi : {0.3, 1.0}) {
        const HasimotoSplit split(xi);
        const double rc = 5 / xi;
        const RealTable table = makeRealTable(split, rc, 1e-11);
        for (double r : {1e-6, 0.1, 1.0, 1.99, 2.0, 2.01, 3.0, rc}) {
            const PairScalars exact = split.realScalars(r);
            const SmoothScalars s = table(r);
            EXPECT_NEAR(s.F, exact.F, 1e-11) << r;
            EXPECT_NEAR(s.F + s.C * r * r, exact.G, 2e-11) << r; // one error from each polynomial
        }
        EXPECT_EQ(table(0).C, 0);
        EXPECT_NEAR(table(0).F, split.realSelf(), 1e-11);
    }
}

/** Largest error of a polynomial by Horner's rule in powers of t, in the arithmetic of Real. */
template <class Real> double hornerError(const Polynomial& p, const Split& split, double rc) {
    double worst = 0;
    for (int i = 0; i <= 500; i++) {
        const Real t = Real(i / 250.0 - 1);
        Real sum = Real(p.powers[p.degree()]);
        for (int n = p.degree() - 1; n >= 0; n--)
            sum = sum * t + Real(p.powers[n]);
        const double r = rc * std::sqrt(0.5 * (1 + double(t)));
        worst = std::max(worst, std::fabs(double(sum) - split.waveScalars(r).F));
    }
    return worst;
}

TEST(RealTable, PowersServeHornersRule) {
    for (double xi : {0.1, 0.5, 1.0, 2.0}) {
        const HasimotoSplit split(xi);
        for (double maxError : {1e-3, 1e-5, 1e-6}) {
            for (double rc : {split.realCutoff(20 * maxError, 0.3), 6 / xi}) {
                const RealTable table = makeRealTable(split, rc, maxError);
                EXPECT_LE(hornerError<float>(table.F, split, rc), maxError + 5e-7)
                    << xi << " " << maxError << " " << xi * rc;
            }
        }
        // The last error belongs to tolerance 1e-10, the tightest there is.
        for (double maxError : {1e-3, 1e-8, 2.5e-12}) {
            for (double rc : {split.realCutoff(20 * maxError, 0.3), 8 / xi}) {
                const RealTable table = makeRealTable(split, rc, maxError);
                EXPECT_LE(hornerError<double>(table.F, split, rc), maxError + 1e-12)
                    << xi << " " << maxError << " " << xi * rc;
            }
        }
    }
}
