// SPDX-License-Identifier: MIT
// Boxes that move with a flow, and what follows them: lattices, wave factors, bounds for lists.

#include "numerics/HasimotoSplit.h"
#include "numerics/Lattice.h"
#include "numerics/PairApproach.h"
#include "numerics/Plan.h"
#include "numerics/RadialWindow.h"
#include "numerics/ShearFlow.h"
#include "numerics/WaveFactors.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

using namespace PSE::numerics;

namespace {

/** The same points: each vector of one is a whole combination of those of the other. */
void expectSameLattice(const Matrix3& a, const Matrix3& b) {
    const Matrix3 change = a.inverse() * b;
    EXPECT_LT((change - Matrix3(change.array().round())).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_NEAR(std::fabs(change.determinant()), 1, 1e-12);
}

void expectReduced(const Lattice& box) {
    const Matrix3& v = box.vectors();
    EXPECT_LE(2 * std::fabs(v(0, 1)), v(0, 0));
    EXPECT_LE(2 * std::fabs(v(0, 2)), v(0, 0));
    EXPECT_LE(2 * std::fabs(v(1, 2)), v(1, 1));
}

std::vector<Vec3> randomPoints(int count, const Lattice& box, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-1.5, 2.5); // some of them far outside
    std::vector<Vec3> points;
    for (int i = 0; i < count; i++)
        points.push_back(box.cartesian(Vec3(uniform(random), uniform(random), uniform(random))));
    return points;
}

/** By the nearest of 27 images. */
double distanceOf(const Vec3& a, const Vec3& b, const Lattice& box) {
    const Vec3 r = box.minimumImage(a - b);
    double nearest = r.norm();
    for (int i = -1; i <= 1; i++)
        for (int j = -1; j <= 1; j++)
            for (int k = -1; k <= 1; k++)
                nearest = std::min(nearest, (r + box.vectors() * Vec3(i, j, k)).norm());
    return nearest;
}

/** A Plan for a box that moves, for equal radii or for a mixture. */
Plan movingPlan(const Lattice& box, SplitChoice split, const std::vector<double>& radii = {},
                double tolerance = 1e-4) {
    PlanRequest request = {box.mostSheared(), 60, 1.0, tolerance, true, 1e-5, false, {}};
    request.split = split;
    request.radii = radii;
    request.moving = true;
    return makePlan(request);
}

} // namespace

TEST(ShearFlow, RateIsTheDerivativeOfTheStrain) {
    using Protocol = ShearFlow::Protocol;
    const double h = 1e-4;
    for (const ShearFlow& flow :
         {ShearFlow{Protocol::Steady, 0.3, 0}, ShearFlow{Protocol::Oscillatory, 0.3, 7},
          ShearFlow{Protocol::StartUp, 0.3, 2}})
        for (double t : {0.0, 1.0, 1.99, 2.01, 5.3})
            EXPECT_NEAR(flow.strain(t - h, 2 * h) / (2 * h), flow.rateAt(t), 1e-8) << t;
    EXPECT_EQ((ShearFlow{Protocol::StartUp, 0.3, 2}.rateAt(2)), 0.3);
}

TEST(ShearFlow, WhatHasNoStrainIsRefused) {
    using Protocol = ShearFlow::Protocol;
    for (Protocol protocol : {Protocol::Steady, Protocol::Oscillatory, Protocol::StartUp}) {
        const ShearFlow flow = {protocol, 0.3, 7};
        for (double t : {std::nan(""), HUGE_VAL}) {
            EXPECT_THROW(flow.strain(t, 1), std::invalid_argument);
            EXPECT_THROW(flow.rateAt(t), std::invalid_argument);
        }
    }
    EXPECT_EQ((ShearFlow{Protocol::Steady, 1e8, 0}.strain(0, 10)), 1e9);
    EXPECT_THROW((ShearFlow{Protocol::Steady, -2e8, 0}.strain(0, 10)), std::invalid_argument);
}

TEST(Lattice, DeformedIsTheImageOfTheLattice) {
    for (const Lattice& box :
         {Lattice::orthorhombic(3, 4, 5), Lattice(Vec3(4, 0, 0), Vec3(2, 3, 0), Vec3(-2, 1.5, 5)),
          Lattice(Vec3(4, 0, 0), Vec3(-2, 3, 0), Vec3(2, -1.5, 5))})
        for (double h : {-0.9, -1e-3, 0.0, 1e-3, 0.7})
            for (int row = 0; row < 3; row++)
                for (int column = row; column < 3; column++) {
                    Matrix3 map = Matrix3::Identity();
                    map(row, column) += h;
                    const Lattice now = box.deformed(map);
                    expectReduced(now);
                    expectSameLattice(now.vectors(), map * box.vectors());
                    if (row == 0 && column == 1) {
                        EXPECT_LT((now.vectors() - box.sheared(h).vectors()).norm(), 1e-14);
                    }
                }
}

TEST(Lattice, ShearedComesBackAfterAWholeStrain) {
    // ax/by is a power of two: every strain below is exact
    const Lattice box(Vec3(4, 0, 0), Vec3(0.5, 4, 0), Vec3(-1.25, 1, 5));
    Lattice now = box;
    for (int i = 1; i <= 64; i++) {
        now = now.sheared(0.0625);
        expectReduced(now);
        Matrix3 flow = Matrix3::Identity();
        flow(0, 1) = i * 0.0625;
        expectSameLattice(now.vectors(), flow * box.vectors());
        EXPECT_EQ(now.volume(), box.volume());
        if (i % 16 == 0) { // c_y/b_y = 1/4: b is back after each unit, c after four
            EXPECT_EQ(now.vectors().col(1), box.vectors().col(1));
        }
    }
    EXPECT_EQ(now, box);
    // at half tilt either sign will do, and the nearest stays
    EXPECT_EQ(Lattice::orthorhombic(4, 4, 4).sheared(0.5).vectors()(0, 1), 2);
    EXPECT_EQ(Lattice::orthorhombic(4, 4, 4).sheared(-0.5).vectors()(0, 1), -2);
    EXPECT_EQ(Lattice::orthorhombic(4, 4, 4).sheared(0.625).vectors()(0, 1), -1.5);
}

TEST(Lattice, NoStrainMakesVectorsLongerThanMostSheared) {
    for (const Lattice& box :
         {Lattice::orthorhombic(3, 4, 5), Lattice(Vec3(4, 0, 0), Vec3(0.3, 3, 0), Vec3(-1, 1.5, 5)),
          Lattice(Vec3(4, 0, 0), Vec3(0.3, 3, 0), Vec3(-1, 0, 5))}) {
        const Lattice most = box.mostSheared();
        double longest[3] = {};
        for (double strain = -2; strain <= 2; strain += 0.0078125)
            for (int d = 0; d < 3; d++) {
                const double length = box.sheared(strain).length(d);
                EXPECT_LE(length, most.length(d) * (1 + 1e-14));
                longest[d] = std::max(longest[d], length);
            }
        for (int d = 0; d < 3; d++) // and it is no longer than need be
            EXPECT_NEAR(longest[d], most.length(d), 0.01 * most.length(d));
        EXPECT_NEAR(most.volume(), box.volume(), 1e-12);
    }
}

TEST(Lattice, ScaledKeepsItsShape) {
    const Lattice box(Vec3(4, 0, 0), Vec3(0.3, 3, 0), Vec3(-1, 1.5, 5)), twice = box.scaled(2);
    EXPECT_EQ(twice.vectors(), 2 * box.vectors());
    EXPECT_EQ(twice.volume(), 8 * box.volume());
    EXPECT_EQ(twice.scaled(0.5), box);
}

// ---------------------------------------------------------------- wave factors

/** The weight with numbers of a platform. */
template <class Real> double evaluated(const WaveWeight& weight, double k2) {
    if (k2 >= weight.end2)
        return 0;
    const Real place = Real(k2) * weight.pieces / Real(weight.end2);
    const int piece = std::min(static_cast<int>(place), weight.pieces - 1);
    const Real t = 2 * (place - piece) - 1;
    Real w = 0;
    for (int row = 0; row <= weight.degree; row++)
        w = w * t + Real(weight.powers[row * weight.pieces + piece]);
    return std::max(Real(0), w);
}

TEST(WaveWeight, KeepsItsErrorWhereTheWindowIsSmall) {
    // the window's transform squared falls by ten decades, the share of the waves by six or
    // eighteen
    for (double decay : {0.14, 0.4})
        for (double allowed : {1e-3, 1e-7, 1e-12}) {
            const auto share = [&](double k) { return std::exp(-decay * k * k); };
            const auto gain = [](double k) { return std::exp(0.23 * k * k); };
            const bool single = allowed > 1e-6;
            const WaveWeight weight =
                fitWaveWeight(share, gain, 10, {allowed, single ? 1.2e-7 : 2.2e-16});
            EXPECT_LE(weight.degree, weight.pieces == 1 ? 32 : 8);
            double largest = 0;
            for (double k = 0; k < 10.5; k += 1e-3) {
                const double exact = k < 10 ? share(k) * gain(k) : 0,
                             found = single ? evaluated<float>(weight, k * k) : weight(k * k);
                largest = std::max(largest, std::fabs(found - exact) / gain(k));
            }
            EXPECT_LT(largest, 1.5 * allowed) << decay << " " << weight.pieces;
        }
}

TEST(WaveWeight, SaysIfNoPiecesAreEnough) {
    const auto jump = [](double k) { return k < 1.0 / 3 ? 1.0 : 0.5; };
    try {
        fitWaveWeight(jump, [](double) { return 1.0; }, 1, {1e-9, 1e-16});
        FAIL() << "nothing was refused";
    } catch (const std::invalid_argument& refusal) {
        const std::string text = refusal.what();
        EXPECT_NE(text.find("more than 4096 pieces"), std::string::npos) << text;
        EXPECT_NE(text.find("error of 1e-09; use"), std::string::npos) << text;
    }
}

/**
 * The largest difference of moving factors and exact ones over all modes of a box, in the share of
 * the waves, over the error that their polynomials may have.
 */
double errorOfFactors(const Plan& plan, const Lattice& box) {
    const WaveFactors exact(plan, box);
    const MovingWaveFactors moving(plan);
    const double scale = moving.scale(box);
    std::vector<RadialWindow> radial; // whose square is in the weight of a mixture
    if (plan.mixture)
        radial.emplace_back(plan.windowSupport, plan.windowShape, plan.windowSpacing);
    double largest = 0;
    for (int x = 0; x < plan.grid[0]; x++)
        for (int y = 0; y < plan.grid[1]; y++)
            for (int z = 0; z <= plan.grid[2] / 2; z++) {
                if (x == 0 && y == 0 && z == 0)
                    continue;
                const Vec3 n(exact.waveNumber(0, x), exact.waveNumber(1, y), z);
                const double k2 = (exact.waves() * n).squaredNorm();
                const double windows = moving.deconvolution[0][x] * moving.deconvolution[1][y] *
                                       moving.deconvolution[2][z];
                const double found = scale * moving.weight(k2) / k2 * windows;
                if (windows == 0 || (plan.mixture && std::sqrt(k2) > radial[0].band())) {
                    EXPECT_EQ(exact(x, y, z), 0);
                    EXPECT_EQ(found, 0);
                    continue;
                }
                double share = std::fabs(found - exact(x, y, z)) * k2 / windows / scale;
                if (plan.mixture)
                    share *=
                        std::pow(radial[0].transform(std::sqrt(k2)) / radial[0].transform(0), 2);
                largest = std::max(largest, share);
            }
    return largest / std::max(1e-13, 0.1 * plan.tableError);
}

TEST(MovingWaveFactors, AreTheExactOnesInEveryBox) {
    const Lattice box = Lattice::orthorhombic(17, 15, 19);
    std::vector<double> radii(60, 1.0);
    for (int i = 0; i < 60; i += 3)
        radii[i] = 1.5;
    for (SplitChoice split : {SplitChoice::Hasimoto, SplitChoice::Prolate})
        for (const std::vector<double>& sizes : {std::vector<double>(), radii})
            for (double tolerance : {1e-2, 1e-4, 4e-5, 9e-6, 1e-8}) {
                const Plan plan = movingPlan(box, split, sizes, tolerance);
                for (double strain : {0.0, 0.2, 0.5, -0.37}) {
                    EXPECT_LT(errorOfFactors(plan, box.sheared(strain)), 1.5) << tolerance;
                    EXPECT_LT(errorOfFactors(plan, box.sheared(strain).scaled(0.97)), 1.5)
                        << tolerance;
                }
            }
}

// ---------------------------------------------------------------- how near pairs may have come

/** The nearest of the pairs that were farther apart than a range, in two moments. */
double nearestNow(double range, const std::vector<Vec3>& then, const Lattice& boxThen,
                  const std::vector<Vec3>& now, const Lattice& box) {
    double nearest = std::numeric_limits<double>::max();
    for (size_t i = 0; i < then.size(); i++)
        for (size_t j = 0; j < i; j++)
            if (distanceOf(then[i], then[j], boxThen) > range)
                nearest = std::min(nearest, distanceOf(now[i], now[j], box));
    return nearest;
}

TEST(PairApproach, NoPairComesNearerThanItSays) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    const Lattice start(Vec3(8, 0, 0), Vec3(2, 9, 0), Vec3(-3, 4, 10));
    const double range = 3.5;
    for (double strain : {0.0, 0.05, -0.2})
        for (double size : {0.0, 0.02, 0.1}) {
            const std::vector<Vec3> then = randomPoints(200, start, random);
            const Lattice box = start.sheared(strain);
            std::vector<Vec3> now = then;
            for (Vec3& x : now)
                x += strain * x[1] * Vec3::UnitX() + Vec3(5, -70, 2) + // all together
                     size * Vec3(normal(random), normal(random), normal(random));
            PairApproach approach;
            EXPECT_EQ(approach.nearest(range, now, box), 0);
            approach.start(then, start);
            const double bound = approach.nearest(range, now, box);
            EXPECT_GT(bound, range * (0.999 - 0.6 * std::fabs(strain)) - 10 * size);
            EXPECT_LE(bound, nearestNow(range, then, start, now, box));
        }
}

TEST(PairApproach, IsAttainedByThePairThatApproachesFastest) {
    // along the axis of compression of a strain, and with the only displacements there are
    const double strain = 0.1, range = 3;
    const Lattice box = Lattice::orthorhombic(12, 12, 12);
    const double angle = 0.5 * std::atan2(2.0, -strain); // of the smallest singular value
    const Vec3 along(std::cos(angle), std::sin(angle), 0);
    double best = std::numeric_limits<double>::max();
    for (const Vec3& axis : {along, Vec3(-along[1], along[0], 0)}) {
        std::vector<Vec3> then = {Vec3::Zero(), range * axis, Vec3(5, 5, 5), Vec3(6, 6, 6)};
        std::vector<Vec3> now = then;
        for (Vec3& x : now)
            x[0] += strain * x[1];
        const Vec3 d = (now[1] - now[0]).normalized();
        now[0] += 0.2 * d;
        now[1] -= 0.2 * d;
        PairApproach approach;
        approach.start(then, box);
        const double bound = approach.nearest(range, now, box.sheared(strain));
        EXPECT_LE(bound, (now[1] - now[0]).norm() + 1e-12);
        best = std::min(best, (now[1] - now[0]).norm() - bound);
    }
    EXPECT_NEAR(best, 0, 1e-12);
}

TEST(PairApproach, KnowsWhatItCannotKnow) {
    const Lattice box = Lattice::orthorhombic(12, 12, 12);
    std::vector<Vec3> x = {Vec3(1, 2, 3), Vec3(5, 5, 5)};
    PairApproach approach;
    approach.start(x, box);
    EXPECT_DOUBLE_EQ(approach.nearest(3, x, box), 3);
    x[1][0] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(approach.nearest(3, x, box), 0);
    x.pop_back();
    EXPECT_EQ(approach.nearest(3, x, box), 0);
    // a flip is another description of the same images, and no bound is claimed across it
    approach.start(x, box.sheared(0.49));
    EXPECT_LT(approach.nearest(3, x, box.sheared(0.51)), 2.5);
}
