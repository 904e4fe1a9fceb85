// SPDX-License-Identifier: MIT
// Spheres of unequal radii: the pair tensor, its split and its tables, against surface averages,
// other quadratures and lattice sums.

#include "numerics/Lattice.h"
#include "numerics/MixtureTable.h"
#include "numerics/Quadrature.h"
#include <Eigen/Eigenvalues>
#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

using namespace PSE::numerics;

namespace {

using EnvelopePointer = std::shared_ptr<const Envelope>;

EnvelopePointer prolate(double c, double R) {
    return std::make_shared<ProlateEnvelope>(c, R);
}

EnvelopePointer hasimoto(double xi, double R) {
    return std::make_shared<HasimotoEnvelope>(xi, R);
}

/**
 * The mobility of two shells in units of 1/(6 pi eta): the flow of one, uniform within it and a
 * Stokeslet with its source doublet outside, averaged over the surface of the other.
 */
PairScalars surfaceAverage(double r, double ai, double aj) {
    std::vector<double> ends = {std::fabs(r - ai), r + ai};
    if (aj > ends[0] && aj < ends[1])
        ends.insert(ends.begin() + 1, aj);
    double trace = 0, along = 0;
    for (size_t part = 0; part + 1 < ends.size(); part++) {
        const Quadrature rule = gaussLegendre(40, ends[part], ends[part + 1]);
        for (size_t q = 0; q < rule.nodes.size(); q++) {
            const double s = rule.nodes[q], share = rule.weights[q] * s / (2 * r * ai);
            const double cosine = (s * s + r * r - ai * ai) / (2 * r * s),
                         square = aj * aj / (s * s);
            const double F = s < aj ? 1 / aj : 0.75 / s * (1 + square / 3),
                         G = s < aj ? 1 / aj : 1.5 / s * (1 - square / 3);
            trace += share * (2 * F + G);
            along += share * (F + (G - F) * cosine * cosine);
        }
    }
    return {0.5 * (trace - along), along};
}

std::vector<double> logarithmic(double smallest, double largest, int n, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform;
    std::vector<double> radii = {smallest, largest};
    while (static_cast<int>(radii.size()) < n)
        radii.push_back(smallest * std::pow(largest / smallest, uniform(random)));
    return radii;
}

Matrix3 tensor(const SmoothScalars& s, const Vec3& d) {
    return s.F * Matrix3::Identity() + s.C * d * d.transpose();
}

/** Real part of a pair by quadrature. */
SmoothScalars realPart(const MixtureQuadrature& wave, double r, double ai, double aj) {
    const PairScalars rpy = rpyScalars(r, ai, aj);
    const SmoothScalars w = wave(r, ai, aj);
    return {rpy.F - w.F, (r > 0 ? (rpy.G - rpy.F) / (r * r) : 0) - w.C};
}

/** The periodic tensor of a pair (of one particle: d = 0) by the sums of its two halves. */
Matrix3 periodicTensor(const Mixture& mixture, const Lattice& box, const Vec3& d, double ai,
                       double aj) {
    Matrix3 sum = Matrix3::Zero();
    const double range = mixture.range(ai, aj), kMax = mixture.largestWaveNumber();
    const MixtureQuadrature wave(mixture, range);
    for (const Vec3& image : box.imagesWithin(range)) {
        const double r = (d + image).norm();
        if (r <= range)
            sum += tensor(realPart(wave, r, ai, aj), d + image);
    }
    int limit[3];
    for (int i = 0; i < 3; i++)
        limit[i] = static_cast<int>(kMax * box.length(i) / (2 * M_PI)) + 1;
    for (int i = -limit[0]; i <= limit[0]; i++)
        for (int j = -limit[1]; j <= limit[1]; j++)
            for (int l = -limit[2]; l <= limit[2]; l++) {
                const Vec3 k = box.waveVectors() * Vec3(i, j, l);
                const double k2 = k.squaredNorm();
                if (k2 > 0)
                    sum += 6 * M_PI / box.volume() * mixture.waveWeight(std::sqrt(k2), ai, aj) /
                           k2 * std::cos(k.dot(d)) * (Matrix3::Identity() - k * k.transpose() / k2);
            }
    return sum;
}

/** Dense real half of a mixture within its ranges. */
Eigen::MatrixXd denseRealHalf(const Mixture& mixture, const MixtureTable& table, const Lattice& box,
                              const std::vector<Vec3>& x) {
    const std::vector<double>& a = mixture.particleRadii();
    const int n = static_cast<int>(a.size());
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    const std::vector<Vec3> images = box.imagesWithin(mixture.largestRange());
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            for (const Vec3& image : images) {
                const Vec3 d = x[i] - x[j] + image;
                if (i == j && image == Vec3::Zero())
                    M.block<3, 3>(3 * i, 3 * i) += table.self(a[i]) * Matrix3::Identity();
                else if (d.norm() < mixture.range(a[i], a[j]))
                    M.block<3, 3>(3 * i, 3 * j) += tensor(table(d.norm(), a[i], a[j]), d);
            }
    return M;
}

} // namespace

TEST(UnequalRpy, IsTheAverageOfTheFlowOverBothSurfaces) {
    const double pairs[][2] = {{1, 1}, {1, 2}, {2, 1}, {1, 10}, {10, 1}, {0.3, 0.7}};
    for (const auto& pair : pairs) {
        const double ai = pair[0], aj = pair[1], sum = ai + aj, gap = std::fabs(ai - aj);
        // both branch points, from either side, and all regimes
        for (double r : {0.3 * gap + 0.01, 0.999 * gap + 1e-3, 1.001 * gap + 2e-3,
                         0.5 * (sum + gap), 0.999 * sum, 1.001 * sum, 3 * sum, 40 * sum}) {
            const PairScalars found = rpyScalars(r, ai, aj), exact = surfaceAverage(r, ai, aj);
            EXPECT_NEAR(found.F, exact.F, 1e-12) << r << " " << ai << " " << aj;
            EXPECT_NEAR(found.G, exact.G, 1e-12) << r << " " << ai << " " << aj;
        }
    }
}

TEST(UnequalRpy, IsContinuousWithItsSlopeAtBothBranchPoints) {
    constexpr double STEP = 1e-6;
    for (double ai : {0.2, 1.0, 3.0})
        for (double aj : {0.25, 1.0, 9.0})
            for (double r : {ai + aj, std::fabs(ai - aj)}) {
                if (r == 0)
                    continue;
                const PairScalars below = rpyScalars(r - STEP, ai, aj), at = rpyScalars(r, ai, aj),
                                  above = rpyScalars(r + STEP, ai, aj);
                EXPECT_NEAR(above.F - at.F, at.F - below.F, 1e-9) << r;
                EXPECT_NEAR(above.G - at.G, at.G - below.G, 1e-9) << r;
            }
}

TEST(UnequalRpy, IsThatOfEqualSpheresForEqualRadii) {
    for (double r : {0.0, 0.3, 1.99, 2.0, 2.01, 7.0}) {
        EXPECT_NEAR(rpyScalars(r, 1, 1).F, rpyScalars(r).F, 2e-15) << r;
        EXPECT_NEAR(rpyScalars(r, 1, 1).G, rpyScalars(r).G, 2e-15) << r;
    }
    EXPECT_DOUBLE_EQ(rpyScalars(2.7, 2, 5).F, rpyScalars(2.7, 5, 2).F);
    EXPECT_EQ(rpyScalars(1.0, 2, 5).F, 0.2); // nested: moves with the larger one
    EXPECT_EQ(rpyScalars(0.0, 2, 5).G, 0.2);
}

TEST(Envelope, LiesBetweenZeroAndOneAndIsFlatAtZero) {
    for (const EnvelopePointer& H : {prolate(3, 2), prolate(7, 4), prolate(12, 5), prolate(16.5, 9),
                                     prolate(24, 6), prolate(30, 12), hasimoto(0.5, 5)}) {
        const double end = H->largestWaveNumber();
        double before = 1;
        for (int i = 0; i <= 2000; i++) {
            const double value = (*H)(end * i / 2000);
            ASSERT_GE(value, 0) << H->name() << i;
            ASSERT_LE(value, before + 1e-13) << H->name() << i; // it falls all the way
            before = value;
        }
        EXPECT_EQ((*H)(end * 1.0001), 0);
        const double k = 0.02 * end, half = 0.01 * end; // 1 - H grows as k^4
        EXPECT_NEAR((1 - (*H)(k)) / (1 - (*H)(half)), 16, 0.3) << H->name();
    }
}

TEST(Mixture, RealHalfEndsAtTheSumOfReaches) {
    // What the cut at k0 leaves beyond is of the size of the envelope's ripples there.
    const Mixture mixture(prolate(16, 5), {0.5, 1, 4});
    const MixtureQuadrature wave(mixture, 30);
    const double ripple = std::sqrt(mixture.shape().squareBeyond(mixture.largestWaveNumber()));
    EXPECT_LT(ripple, 1e-4);
    double largest = 0;
    for (double ai : mixture.radii())
        for (double aj : mixture.radii())
            for (double further : {0.0, 0.3, 1.0, 5.0}) {
                const double r = mixture.range(ai, aj) + further;
                const SmoothScalars real = realPart(wave, r, ai, aj);
                largest =
                    std::max({largest, std::fabs(real.F), std::fabs(real.F + real.C * r * r)});
                EXPECT_LT(largest, 0.3 * ripple) << ai << " " << aj << " " << further;
            }
    EXPECT_GT(largest, 1e-3 * ripple);
    // Well inside it is not small.
    EXPECT_GT(std::fabs(realPart(wave, 2.0, 1, 1).F), 100 * ripple);
    EXPECT_EQ(mixture.reach(0.5) + mixture.reach(4), mixture.range(0.5, 4));
}

TEST(Mixture, PeriodicMobilityDoesNotDependOnTheEnvelope) {
    const std::vector<double> radii = {0.4, 1, 3.5};
    const Lattice tilted(Vec3(9, 0, 0), Vec3(4.5, 9, 0), Vec3(-4.5, 4.5, 9)),
        cube = Lattice::orthorhombic(6, 6, 6);
    const Mixture first(prolate(30, 9), radii), second(hasimoto(0.8, 6.9), radii);
    const Vec3 places[] = {Vec3(0, 0, 0), Vec3(0.5, -0.2, 0.3), Vec3(3, 2, -1)};
    for (const Lattice& box : {tilted, cube})
        for (double ai : radii)
            for (const Vec3& d : places) {
                const double aj = (ai == 1 ? 3.5 : ai);
                if (d == Vec3::Zero() && ai != aj)
                    continue;
                const Matrix3 difference =
                    periodicTensor(first, box, d, ai, aj) - periodicTensor(second, box, d, ai, aj);
                EXPECT_LT(difference.cwiseAbs().maxCoeff(), 2e-10)
                    << ai << " " << aj << " " << d.transpose();
            }
}

TEST(MixtureTable, ClassesAndInterpolationKeepTheError) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> uniform;
    struct Case {
        EnvelopePointer envelope;
        std::vector<double> radii;
        bool interpolated;
    };
    const Case cases[] = {{prolate(9, 5), {1, 2}, false},
                          {prolate(12, 5), {0.3, 1, 3}, false},
                          {hasimoto(0.6, 6), {1, 1.5, 2, 2.5, 3}, false},
                          {prolate(12, 5), logarithmic(0.5, 1.5, 50, 1), true},
                          {prolate(9, 5), logarithmic(1, 10, 60, 2), true},
                          {hasimoto(0.5, 8), logarithmic(0.2, 1, 20, 3), true}};
    for (const Case& test : cases)
        for (double error : {1e-3, 1e-5, 1e-8}) {
            const Mixture mixture(test.envelope, test.radii);
            const MixtureTable table(mixture, error);
            const MixtureQuadrature wave(mixture, table.rc());
            EXPECT_EQ(table.interpolates(), test.interpolated);
            double largest = 0;
            for (int sample = 0; sample < 150; sample++) {
                const double ai = test.radii[random() % test.radii.size()],
                             aj = test.radii[random() % test.radii.size()],
                             r = uniform(random) * mixture.range(ai, aj),
                             scale = std::max(ai, aj) / error;
                const SmoothScalars exact = wave(r, ai, aj), found = table.waveScalars(r, ai, aj);
                largest = std::max({largest, scale * std::fabs(found.F - exact.F),
                                    scale * r * r * std::fabs(found.C - exact.C)});
            }
            EXPECT_LT(largest, 1) << test.envelope->name() << " " << test.radii.size() << " "
                                  << error;
        }
}

TEST(MixtureTable, CoincidentEqualSpheresHaveNoRelativeMobility) {
    for (const std::vector<double>& radii : {std::vector<double>{1, 3}, logarithmic(1, 3, 20, 5)}) {
        const MixtureTable table(Mixture(prolate(9, 5), radii), 1e-4);
        for (double a : radii)
            EXPECT_NEAR(table.self(a) - table(0, a, a).F, 0, 1e-15) << a;
    }
}

/** [T55]: scales are roots of the diagonal; never much below the whole mobility. */
TEST(MixtureScales, AreRootsOfTheDiagonalAndLimited) {
    const std::vector<double> radii = {0.7, 1, 2, 40};
    const Mixture mixture(prolate(8, 4.5), radii);
    const MixtureScales scale(mixture);
    double growth = 0;
    for (double a : radii) {
        // F_W(0) = (2/pi) Int H sinc^2 dk by the midpoint rule
        const int n = 20000;
        const double dk = mixture.largestWaveNumber() / n;
        double wave = 0;
        for (int i = 0; i < n; i++)
            wave += 2 / M_PI * dk * mixture.waveWeight((i + 0.5) * dk, a, a);
        const double limit = MixtureScales::LEAST_SHARE / a;
        EXPECT_NEAR(scale(a) * scale(a), std::max(1 / a - wave, limit), 1e-7 / a) << a;
        EXPECT_EQ(a == 40, 1 / a - wave < limit);
        growth = std::max(growth, 1 / (a * scale(a) * scale(a)));
    }
    EXPECT_NEAR(scale.errorGrowth(), growth, 1e-12);
    EXPECT_NEAR(growth, 1 / MixtureScales::LEAST_SHARE, 1e-9);
}

TEST(MixtureTable, RadiiThatDifferTooMuchAreRefused) {
    try {
        MixtureTable table(Mixture(prolate(12, 5), logarithmic(1, 100, 20, 6)), 1e-6);
        FAIL() << "accepted";
    } catch (const std::invalid_argument& refusal) {
        const std::string message = refusal.what();
        for (const char* word : {"20 distinct radii", "ratio of 100", "looser tolerance"})
            EXPECT_NE(message.find(word), std::string::npos) << message;
    }
}

TEST(MixtureTable, RealHalfIsPositiveForNestedAndOverlappingSpheres) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform;
    const Lattice box(Vec3(9, 0, 0), Vec3(4.5, 9, 0), Vec3(-4.5, 4.5, 9));
    for (const std::vector<double>& radii :
         {std::vector<double>{1, 2}, std::vector<double>{0.5, 5}, logarithmic(0.5, 4, 12, 8)})
        for (const EnvelopePointer& envelope : {prolate(10, 5), hasimoto(0.6, 5.5)}) {
            std::vector<double> all;
            std::vector<Vec3> x;
            for (int i = 0; i < 40; i++) {
                all.push_back(radii[i % radii.size()]);
                x.push_back(box.cartesian(Vec3(uniform(random), uniform(random), uniform(random))));
            }
            x[1] = x[0]; // one inside the other, with one centre
            const Mixture mixture(envelope, all);
            const MixtureTable table(mixture, 1e-5);
            const Eigen::MatrixXd M = denseRealHalf(mixture, table, box, x);
            EXPECT_LT((M - M.transpose()).norm(), 1e-12);
            const double lowest =
                Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(M).eigenvalues()[0];
            // below zero by no more than what is cut off beyond the ranges
            EXPECT_GT(lowest, -1e-3) << envelope->name() << " " << radii.size();
        }
}
