// SPDX-License-Identifier: MIT
// The prolate split against quadrature, finite differences, and the other split.

#include "PairOracle.h"
#include "numerics/HasimotoSplit.h"
#include "numerics/ProlateSplit.h"
#include "numerics/Quadrature.h"
#include "numerics/RealTable.h"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using namespace PSE::numerics;

namespace {

struct Shape {
    double c, R;
};
/// what Plans use: tolerances 1e-1 to 1e-10, and the ends of what is valid
const Shape VALID[] = {{3, 2.4},  {3.5, 5},  {5, 2.4}, {6.3, 4},    {8.6, 3.3}, {9, 6.5},
                       {11.5, 5}, {14, 5.3}, {16, 6},  {16.7, 9.5}, {21, 8},    {30, 12}};

/** W(k), not clipped, from psi by quadrature: H0 = Int psi cos(kRx)/Int psi and -k H0'. */
class Unclipped {
public:
    Unclipped(const ProlateSplit& split, double kMax)
        : R(split.range()), s(split.matching()),
          rule(gaussLegendre(static_cast<int>(40 + 0.7 * kMax * split.range()), 0, 1)) {
        const ProlateFunction psi(split.bandwidth());
        double integral = 0;
        for (size_t i = 0; i < rule.nodes.size(); i++) {
            rule.weights[i] *= psi(rule.nodes[i]);
            integral += rule.weights[i];
        }
        for (double& weight : rule.weights)
            weight /= integral;
    }
    double operator()(double k) const {
        double sum = 0;
        for (size_t i = 0; i < rule.nodes.size(); i++) {
            const double phase = k * R * rule.nodes[i];
            sum += rule.weights[i] * (std::cos(phase) + s * phase * std::sin(phase));
        }
        return sum;
    }

private:
    double R, s;
    Quadrature rule;
};

/** A quadrature rule in pieces, for integrands of many oscillations. */
Quadrature composite(double from, double to, int pieces, int nodes) {
    Quadrature all;
    for (int i = 0; i < pieces; i++) {
        const double h = (to - from) / pieces;
        const Quadrature piece = gaussLegendre(nodes, from + i * h, from + (i + 1) * h);
        all.nodes.insert(all.nodes.end(), piece.nodes.begin(), piece.nodes.end());
        all.weights.insert(all.weights.end(), piece.weights.begin(), piece.weights.end());
    }
    return all;
}

double sincSquare(double k) {
    const double sinc = (k == 0 ? 1 : std::sin(k) / k);
    return sinc * sinc;
}

} // namespace

TEST(ProlateFunction, EigenvalueIsThatOfAnIndependentLibrary) {
    // scipy.special.pro_cv(0, 0, c), ten digits
    const double known[][2] = {{1, 0.3190000551},
                               {2, 1.1277340648},
                               {4, 3.1720674222},
                               {5, 4.1951288726},
                               {8, 7.2215789307}};
    for (const auto& k : known)
        EXPECT_NEAR(ProlateFunction(k[0]).eigenvalue(), k[1], 2e-10) << k[0];
}

TEST(ProlateFunction, ObeysItsEquationAndHasNoZero) {
    for (double c = 1; c <= 40; c += 3) {
        const ProlateFunction psi(c);
        EXPECT_NEAR(psi(0), 1, 1e-15);
        const double h = 2e-3;
        for (double x = 0; x <= 1.2; x += 0.05) {
            // fourth-order differences; psi varies over 1/c
            const double first =
                (psi(x - 2 * h) - 8 * psi(x - h) + 8 * psi(x + h) - psi(x + 2 * h)) / (12 * h);
            const double second = (-psi(x - 2 * h) + 16 * psi(x - h) - 30 * psi(x) +
                                   16 * psi(x + h) - psi(x + 2 * h)) /
                                  (12 * h * h);
            const double rest =
                (1 - x * x) * second - 2 * x * first + (psi.eigenvalue() - c * c * x * x) * psi(x);
            ASSERT_NEAR(rest, 0, 1e-10 * std::pow(c, 4) + 1e-8) << c << " " << x;
            if (x <= 1) {
                ASSERT_GT(psi(x), 0) << "the lowest solution has no zero inside";
            }
        }
    }
}

TEST(ProlateFunction, IsItsOwnTransform) {
    // Also outside [-1, 1], as far as the first zero of W may lie.
    for (double c : {3.0, 5.5, 9.0, 16.0, 24.0, 30.0}) {
        const ProlateFunction psi(c);
        const Quadrature rule = gaussLegendre(100, -1, 1);
        double integral = 0;
        for (size_t i = 0; i < rule.nodes.size(); i++)
            integral += rule.weights[i] * psi(rule.nodes[i]);
        EXPECT_NEAR(integral, psi.integral(), 1e-14);
        for (double x = 0; x <= 1 + 6 / (c * std::sqrt(c)); x += 0.1) {
            double transform = 0;
            for (size_t i = 0; i < rule.nodes.size(); i++)
                transform += rule.weights[i] * psi(rule.nodes[i]) * std::cos(c * x * rule.nodes[i]);
            EXPECT_NEAR(transform / integral, psi(x), 3e-14) << c << " " << x;
        }
    }
}

TEST(ProlateFunction, PowersAreTheSameFunction) {
    for (double c : {3.0, 9.0, 16.0, 24.0, 30.0}) {
        const ProlateFunction psi(c);
        const std::vector<double> powers = psi.series().powers();
        for (double x = 0; x <= 1; x += 0.01) {
            double sum = 0;
            for (size_t j = powers.size(); j-- > 0;)
                sum = sum * x * x + powers[j];
            ASSERT_NEAR(sum, psi(x), c <= 16 ? 1e-13 : (c <= 24 ? 1e-12 : 5e-12)) << c << " " << x;
        }
    }
}

TEST(ProlateSplit, WeightIsTheTransformOfTheProlateFunction) {
    for (const Shape& v : VALID) {
        const ProlateSplit split(v.c, v.R);
        const Unclipped W(split, 1.2 * split.firstZero());
        for (int i = 0; i <= 200; i++) {
            const double k = split.firstZero() * i / 200;
            ASSERT_NEAR(split.waveWeight(k), std::max(0.0, W(k)), 1e-13) << v.c << " " << k;
        }
        // the zero: its sign changes there, and nothing is kept beyond
        EXPECT_GT(W(split.firstZero() * (1 - 1e-6)), 0);
        EXPECT_LT(W(split.firstZero() * (1 + 1e-6)), 0);
        EXPECT_EQ(split.waveWeight(split.firstZero() * (1 + 1e-12)), 0);
    }
}

TEST(ProlateSplit, MatchesTheSphereToFourthOrder) {
    for (const Shape& v : VALID) {
        const ProlateSplit split(v.c, v.R);
        EXPECT_NEAR(split.waveWeight(0), 1, 1e-15);
        // second differences of H0 = psi(k R/c) give h2, and that gives s
        const ProlateFunction psi(v.c);
        const double h = 0.02 / std::sqrt(v.c);
        const double h2 = (16 * psi(h) - psi(2 * h) - 15) / (12 * h * h) * v.R * v.R / (v.c * v.c);
        EXPECT_NEAR(split.matching(), 0.5 * (1 - 1 / (3 * std::fabs(h2))), 1e-7) << v.c;
        // halving k divides what is left of W - 1 + k^2/3 by 16
        const auto rest = [&](double k) { return split.waveWeight(k) - 1 + k * k / 3; };
        const double k = 0.1 * std::sqrt(v.c) / v.R;
        EXPECT_NEAR(rest(k) / rest(k / 2), 16, 0.3) << v.c;
    }
}

TEST(ProlateSplit, BothHalvesAreNonNegativeModeByModeWhereValid) {
    int valid = 0;
    for (double c = ProlateSplit::SMALLEST_BANDWIDTH; c <= ProlateSplit::LARGEST_BANDWIDTH;
         c += 0.45)
        for (double R = ProlateSplit::SMALLEST_RANGE; R < 16; R *= 1.06) {
            const ProlateSplit split(c, R);
            if (!split.isPositive())
                continue;
            valid++;
            for (int i = 0; i <= 1000; i++) {
                const double k = split.firstZero() * i / 1000;
                ASSERT_GE(split.waveWeight(k), 0);
                ASSERT_GE(sincSquare(k) - split.waveWeight(k), -1e-13) << c << " " << R << " " << k;
            }
        }
    EXPECT_GT(valid, 500);
    // The limit on k0 is needed: beyond, near the zero of sinc at pi, the real half turns negative.
    double lowest = 0;
    const ProlateSplit beyond(16, 4.9);
    EXPECT_GT(beyond.firstZero(), ProlateSplit::LARGEST_ZERO);
    EXPECT_FALSE(beyond.isPositive());
    for (double k = 2.5; k < beyond.firstZero(); k += 0.001)
        lowest = std::min(lowest, sincSquare(k) - beyond.waveWeight(k));
    EXPECT_LT(lowest, -1e-5);
}

TEST(ProlateSplit, ClosedFormIsTheIntegralOfTheUnclippedWeight) {
    // (3/pi) Int W [..] dk converges by oscillation alone; an error function that ends at 12 q
    // makes it absolute, at a price of exp(-(R - r)^2 q^2/4). Beyond R it must give RPY.
    for (const Shape& v : {Shape{6.3, 4}, Shape{9, 5}, Shape{16, 6}}) {
        const ProlateSplit split(v.c, v.R);
        const double q = 120 / v.R, kMax = 12 * q;
        const Unclipped W(split, kMax);
        const Quadrature rule = composite(0, kMax, 300, 16);
        std::vector<double> weight;
        for (size_t i = 0; i < rule.nodes.size(); i++)
            weight.push_back(3 / M_PI * rule.weights[i] * W(rule.nodes[i]) * 0.5 *
                             std::erfc((rule.nodes[i] - 6 * q) / q));
        for (double share : {1e-9, 0.1, 0.35, 0.6, 0.85, 0.9, 1.1, 1.25}) {
            const double r = share * v.R;
            double F = 0, G = 0;
            for (size_t i = 0; i < rule.nodes.size(); i++) {
                const double x = rule.nodes[i] * r;
                const double j0 = (x < 1e-4 ? 1 - x * x / 6 : std::sin(x) / x),
                             j1x = (x < 1e-2 ? 1.0 / 3 - x * x / 30 + x * x * x * x / 840
                                             : (j0 - std::cos(x)) / (x * x));
                F += weight[i] * (j0 - j1x);
                G += weight[i] * 2 * j1x;
            }
            const SmoothScalars wave = split.waveScalars(r);
            EXPECT_NEAR(wave.F, F, 1e-11) << v.c << " " << share;
            EXPECT_NEAR(wave.F + wave.C * r * r, G, 1e-11) << v.c << " " << share;
            if (share > 1) {
                EXPECT_NEAR(F, rpyScalars(r).F, 1e-11);
                EXPECT_NEAR(G, rpyScalars(r).G, 1e-11);
            }
        }
    }
}

TEST(ProlateSplit, RealHalfIsZeroBeyondItsRange) {
    for (const Shape& v : VALID) {
        const ProlateSplit split(v.c, v.R);
        for (double r : {1.000001, 1.3, 4.0}) {
            EXPECT_NEAR(split.realScalars(r * v.R).F, 0, 1e-15);
            EXPECT_NEAR(split.realScalars(r * v.R).G, 0, 1e-15);
        }
        EXPECT_EQ(split.realTruncation(v.R, 0.3), 0);
        // At R itself G is continuous, and F jumps by about as much as the dropped waves weigh.
        EXPECT_NEAR(split.realScalars(v.R).G, 0, 1e-12) << v.c;
        EXPECT_LT(std::fabs(split.realScalars(v.R).F), 2 * split.waveTruncation(1e3, 0.3) + 1e-12);
    }
}

TEST(ProlateSplit, PeriodicMobilityIsThatOfHasimotosSplit) {
    const Lattice boxes[] = {Lattice::orthorhombic(5, 5, 5),
                             Lattice(Vec3(6, 0, 0), Vec3(3, 6, 0), Vec3(-3, 3, 6)),
                             Lattice::orthorhombic(3, 12, 3)};
    const double xi = 0.65;
    const HasimotoSplit other(xi);
    for (const Lattice& box : boxes)
        for (const Vec3& d : {Vec3(0, 0, 0), Vec3(1e-7, 0, 0), Vec3(0.3, -0.2, 0.4),
                              Vec3(1.2, 1.6, 0), Vec3(1.4, 2.3, -1.1)}) {
            const Matrix3 exact =
                periodicTensor(other, std::min(12.0, other.maxDistance()), 12.5 * xi, box, d);
            for (const Shape& v : {Shape{6.3, 4}, Shape{9, 4}, Shape{12, 5.5}, Shape{16, 6.5},
                                   Shape{22, 9}, Shape{30, 14}}) {
                const ProlateSplit split(v.c, v.R);
                const double difference =
                    (periodicTensor(split, v.R, split.firstZero(), box, d) - exact)
                        .cwiseAbs()
                        .maxCoeff();
                // what the dropped waves cost, and 1e-11 where they cost less
                EXPECT_LT(difference, 3 * split.waveTruncation(1e3, 0.3) + 1e-11) << v.c;
                if (v.c == 30) {
                    EXPECT_LT(difference, 3e-11);
                }
            }
        }
}

TEST(ProlateSplit, DroppedWavesAreTheIntegralsBeyondTheZero) {
    // Both by quadrature of W over 200 half periods; the rest of W^2/k^2 by its mean, and the
    // oscillating rest of W with an error function as above.
    for (const Shape& v : {Shape{3, 2.4}, Shape{3.5, 5}, Shape{5, 2.4}, Shape{6.3, 4},
                           Shape{8.6, 3.3}, Shape{12, 6}, Shape{16, 6}, Shape{21, 8}}) {
        const ProlateSplit split(v.c, v.R);
        const double k0 = split.firstZero(), last = k0 + 200 * M_PI / v.R, q = (last - k0) / 12;
        const Unclipped W(split, last);
        const Quadrature rule = composite(k0, last, 200, 12);
        double pairs = 0, self = 0, mean = 0;
        for (size_t i = 0; i < rule.nodes.size(); i++) {
            const double k = rule.nodes[i], w = W(k);
            pairs += rule.weights[i] * w * w / (k * k);
            self += rule.weights[i] * w * 0.5 * std::erfc((k - 0.5 * (k0 + last)) / q);
            if (i >= rule.nodes.size() / 2)
                mean += rule.weights[i] * w * w / (0.5 * (last - k0));
        }
        pairs += mean / last;
        // phi = 0: the self part alone; its factor is (2/3) (6 pi)/(2 pi^2)
        const double alone = split.waveTruncation(1e3, 0) / (2 / M_PI);
        EXPECT_NEAR(alone / std::fabs(self), 1, 1e-3) << v.c;
        const double phi = 0.2, density = 3 * phi / (4 * M_PI);
        const double both = std::sqrt(12 * density * pairs + std::pow(2 / M_PI * self, 2));
        EXPECT_NEAR(split.waveTruncation(1e3, phi) / both, 1, 0.02) << v.c;
        // and from below the zero
        const double low = 0.8 * k0;
        const Quadrature inside = composite(low, k0, 4, 20);
        for (size_t i = 0; i < inside.nodes.size(); i++) {
            const double k = inside.nodes[i], w = W(k);
            pairs += inside.weights[i] * w * w / (k * k);
            self += inside.weights[i] * w;
        }
        EXPECT_NEAR(split.waveTruncation(low, phi) /
                        std::sqrt(12 * density * pairs + std::pow(2 / M_PI * self, 2)),
                    1, 0.01)
            << v.c;
    }
}

TEST(ProlateSplit, TruncatedRealHalfIsCounted) {
    const ProlateSplit split(9, 5);
    for (double rc : {2.0, 3.0, 4.5}) {
        double random = 0, coherent = 0; // Simpson's rule
        const int n = 2000;
        for (int i = 0; i <= n; i++) {
            const double r = rc + (5 - rc) * i / n,
                         w = (i == 0 || i == n ? 1 : (i % 2 == 1 ? 4 : 2)) * (5 - rc) / (3 * n);
            const PairScalars s = split.realScalars(r);
            random += w * 4 * M_PI * r * r * (2 * s.F * s.F + s.G * s.G) / 3;
            coherent += w * 4 * M_PI * r * r * std::fabs(2 * s.F + s.G) / 3;
        }
        const double density = 3 * 0.2 / (4 * M_PI), alike = density * coherent;
        EXPECT_NEAR(split.realTruncation(rc, 0.2) / std::sqrt(density * random + alike * alike), 1,
                    0.01);
    }
}

TEST(ProlateSplit, RealHalfIsPositiveForOverlappingParticles) {
    // As for Hasimoto's split: the smallest eigenvalue of the real half of an overlapping gas.
    std::mt19937 random(7);
    const int n = 40;
    std::uniform_real_distribution<double> uniform(0, 5); // volume fraction 1.3
    std::vector<Vec3> x(n);
    for (Vec3& p : x)
        p = Vec3(uniform(random), uniform(random), uniform(random));
    x[1] = x[0] + Vec3(0.01, 0, 0);
    for (const Shape& v : VALID) {
        const ProlateSplit split(v.c, v.R);
        ASSERT_TRUE(split.isPositive()) << v.c;
        Eigen::MatrixXd M(3 * n, 3 * n);
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                M.block<3, 3>(3 * i, 3 * j) =
                    tensor(split.realScalars((x[i] - x[j]).norm()), x[i] - x[j]);
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(M, Eigen::EigenvaluesOnly);
        // What lies below zero is what the dropped waves weigh.
        EXPECT_GT(eigen.eigenvalues()[0], -split.waveTruncation(1e3, 1)) << v.c;
    }
}

/** Smallest eigenvalue of the periodic real half. */
double smallestEigenvalue(const Split& split, double range, const Lattice& box,
                          const std::vector<Vec3>& x) {
    const size_t n = x.size();
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            for (const Vec3& image : box.imagesWithin(range)) {
                const Vec3 d = x[i] - x[j] + image;
                if (d.norm() <= range)
                    M.block<3, 3>(3 * i, 3 * j) += tensor(split.realScalars(d.norm()), d);
            }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(M, Eigen::EigenvaluesOnly);
    return eigen.eigenvalues()[0];
}

TEST(ProlateSplit, SmallestEigenvalueIsThatOfHasimotosSplit) {
    // A suspension at volume fraction 0.2 and an overlapping gas at 1, both splits as Plans have
    // them at 1e-3 for one range: what limits Lanczos is the same.
    const ProlateSplit prolate(9.3, 4);
    const HasimotoSplit hasimoto(0.8);
    ASSERT_TRUE(prolate.isPositive());
    for (double phi : {0.2, 1.0}) {
        const int n = 60;
        const double L = std::cbrt(4 * M_PI / 3 * n / phi);
        const Lattice box = Lattice::orthorhombic(L, L, L);
        std::mt19937 random(8);
        std::uniform_real_distribution<double> uniform(0, L);
        std::vector<Vec3> x;
        while (x.size() < n) {
            const Vec3 trial(uniform(random), uniform(random), uniform(random));
            bool overlaps = false;
            for (const Vec3& p : x)
                overlaps = overlaps || box.minimumImage(p - trial).norm() < 2;
            if (phi > 0.5 || !overlaps)
                x.push_back(trial);
        }
        const double ours = smallestEigenvalue(prolate, 4, box, x),
                     theirs = smallestEigenvalue(hasimoto, 6, box, x);
        EXPECT_GT(theirs, phi > 0.5 ? 0.005 : 0.05);
        EXPECT_GT(ours / theirs, 0.7) << phi;
        EXPECT_LT(ours / theirs, 1.5) << phi;
    }
}

TEST(ProlateTable, FitsWithinTheErrorAskedForAtALowerDegree) {
    for (const Shape& v : VALID) {
        const ProlateSplit split(v.c, v.R);
        for (double maxError : {1e-2, 1e-4, 1e-6, 1e-9, 2.5e-12}) {
            const RealTable table = makeRealTable(split, v.R, maxError);
            EXPECT_NEAR(table.self, split.realSelf(), maxError);
            EXPECT_EQ(table.self, table(0).F);
            double worst = 0;
            for (int i = 0; i <= 700; i++) {
                const double r = v.R * i / 700.0, t = 2 * r * r / (v.R * v.R) - 1;
                const SmoothScalars wave = split.waveScalars(r);
                worst = std::max({worst, std::fabs(table.F(t) - wave.F),
                                  v.R * v.R * std::fabs(table.C(t) - wave.C)});
            }
            EXPECT_LE(worst, maxError) << v.c << " degree " << table.F.degree();
        }
    }
    // at one range and tolerance, both splits as a Plan would have them at 1e-4
    EXPECT_LT(makeRealTable(ProlateSplit(11.5, 5), 5, 1e-5).F.degree(),
              makeRealTable(HasimotoSplit(0.714), 5, 1e-5).F.degree());
}

/** Largest error of a polynomial by Horner's rule in powers of t, in the arithmetic of Real. */
template <class Real> double hornerError(const Polynomial& p, const ProlateSplit& split, bool F) {
    double worst = 0;
    for (int i = 0; i <= 500; i++) {
        const Real t = Real(i / 250.0 - 1);
        Real sum = Real(p.powers[p.degree()]);
        for (int n = p.degree() - 1; n >= 0; n--)
            sum = sum * t + Real(p.powers[n]);
        const SmoothScalars wave =
            split.waveScalars(split.range() * std::sqrt(0.5 * (1 + double(t))));
        const double scale = split.range() * split.range();
        worst =
            std::max(worst, std::fabs(F ? double(sum) - wave.F : scale * (double(sum) - wave.C)));
    }
    return worst;
}

TEST(ProlateTable, PowersServeHornersRule) {
    for (double c = 3; c <= 30; c += 1.5)
        for (double R : {2.4, 5.0, 12.0}) {
            const ProlateSplit split(c, R);
            if (split.matching() < ProlateSplit::SMALLEST_MATCHING)
                continue;
            EXPECT_EQ(split.tableRange(false), R);
            const RealTable fine = makeRealTable(split, R, 2.5e-12);
            EXPECT_LE(hornerError<double>(fine.F, split, true), 2.5e-12 + 1e-12) << c << " " << R;
            EXPECT_LE(hornerError<double>(fine.C, split, false), 2.5e-12 + 1e-12) << c << " " << R;
            if (split.tableRange(true) < R)
                continue;
            for (double maxError : {1e-3, 1e-5, 1e-6}) {
                const RealTable table = makeRealTable(split, R, maxError);
                EXPECT_LE(hornerError<float>(table.F, split, true), maxError + 5e-7) << c;
                EXPECT_LE(hornerError<float>(table.C, split, false), maxError + 5e-7) << c;
            }
        }
}
