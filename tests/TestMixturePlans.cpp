// SPDX-License-Identifier: MIT
// Unequal radii: from one tolerance to numbers, and the estimates behind them against errors
// measured by explicit sums.

#include "numerics/MixtureErrors.h"
#include "numerics/MixtureTable.h"
#include "numerics/NearImages.h"
#include "numerics/Plan.h"
#include <array>
#include <cmath>
#include <complex>
#include <gtest/gtest.h>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

using namespace PSE::numerics;

namespace {

std::vector<double> alternating(double small, double large, int n, int everyLarge) {
    std::vector<double> radii;
    for (int i = 0; i < n; i++)
        radii.push_back(i % everyLarge == 0 ? large : small);
    return radii;
}

std::vector<double> geometric(double smallest, double largest, int n) {
    std::vector<double> radii;
    for (int i = 0; i < n; i++)
        radii.push_back(smallest * std::pow(largest / smallest, i / (n - 1.0)));
    return radii;
}

PlanRequest request(const std::vector<double>& radii, double phi, double tolerance) {
    double volume = 0;
    for (double a : radii)
        volume += 4 * M_PI / 3 * a * a * a;
    const double L = std::cbrt(volume / phi);
    PlanRequest r = {Lattice::orthorhombic(L, L, L),
                     static_cast<int>(radii.size()),
                     radii[0],
                     tolerance,
                     true,
                     1e-5,
                     false,
                     {}};
    r.radii = radii;
    return r;
}

std::string refusal(const PlanRequest& r) {
    try {
        makePlan(r);
    } catch (const std::invalid_argument& e) {
        return e.what();
    }
    return "";
}

/** For each particle and canonical mode, what the grid makes of its plane wave, over the exact
 * phase's weight. */
class Prototype {
public:
    Prototype(const Mixture& mixture, const Lattice& box, const std::array<int, 3>& grid,
              const RadialWindow& window, const std::vector<Vec3>& x)
        : mixture(mixture), n(static_cast<int>(x.size())) {
        const int half[3] = {(grid[0] - 1) / 2, (grid[1] - 1) / 2, (grid[2] - 1) / 2};
        const double cell = box.volume() / (double(grid[0]) * grid[1] * grid[2]);
        std::vector<std::vector<std::pair<Vec3, double>>> touched(n);
        for (int i = 0; i < n; i++)
            for (int a = 0; a < grid[0]; a++)
                for (int b = 0; b < grid[1]; b++)
                    for (int c = 0; c < grid[2]; c++) {
                        const Vec3 point = box.cartesian(
                            Vec3(a / double(grid[0]), b / double(grid[1]), c / double(grid[2])));
                        const Vec3 d = box.minimumImage(point - x[i]);
                        const double w = window(d.norm(), mixture.particleRadii()[i]);
                        if (w != 0)
                            touched[i].push_back({x[i] + d, w * cell});
                    }
        gridded = exact = Eigen::MatrixXd::Zero(3 * n, 3 * n);
        for (int a = -half[0]; a <= half[0]; a++)
            for (int b = -half[1]; b <= half[1]; b++)
                for (int c = 0; c <= half[2]; c++)
                    if (c > 0 || b > 0 || (b == 0 && a > 0))
                        addMode(box.waveVectors() * Vec3(a, b, c), box, window, x, touched);
    }
    Eigen::MatrixXd error() const { return gridded - exact; }

private:
    using Phases = Eigen::VectorXcd;

    void addMode(const Vec3& k, const Lattice& box, const RadialWindow& window,
                 const std::vector<Vec3>& x,
                 const std::vector<std::vector<std::pair<Vec3, double>>>& touched) {
        const double norm = k.norm(),
                     B = 2 * 6 * M_PI * mixture.envelope(norm) / (box.volume() * norm * norm);
        if (B == 0)
            return;
        Phases spread = Phases::Zero(n), own(n);
        for (int i = 0; i < n; i++) {
            for (const auto& [point, weight] : touched[i])
                spread[i] += weight * std::polar(1.0, -k.dot(point));
            const double a = mixture.particleRadii()[i];
            own[i] = std::sin(norm * a) / (norm * a) * std::polar(1.0, -k.dot(x[i]));
        }
        spread /= window.transform(norm);
        add(gridded, spread, B, k / norm);
        add(exact, own, B, k / norm);
    }
    void add(Eigen::MatrixXd& M, const Phases& phases, double B, const Vec3& direction) {
        const Matrix3 transverse = Matrix3::Identity() - direction * direction.transpose();
        const Eigen::MatrixXd pairs = B * (phases.conjugate() * phases.transpose()).real();
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++)
                M.block<3, 3>(3 * i, 3 * j) += pairs(i, j) * transverse;
    }

    const Mixture& mixture;
    int n;
    Eigen::MatrixXd gridded, exact;
};

} // namespace

TEST(MixturePlans, PredictedErrorKeepsTheTolerance) {
    const std::vector<double> radii[] = {
        alternating(1, 2, 300, 2), alternating(0.5, 5, 1000, 20), geometric(1, 4, 200), {1, 3}};
    for (const auto& all : radii)
        for (double tolerance : {1e-2, 1e-4, 1e-7})
            for (SplitChoice split : {SplitChoice::Automatic, SplitChoice::Hasimoto}) {
                if (split == SplitChoice::Hasimoto && tolerance < 1e-4)
                    continue;
                PlanRequest r = request(all, 0.1, tolerance);
                r.split = split;
                const Plan plan = makePlan(r);
                ASSERT_TRUE(plan.mixture);
                EXPECT_FALSE(plan.split);
                EXPECT_EQ(plan.splitName(),
                          split == SplitChoice::Hasimoto ? "Hasimoto" : "Prolate");
                EXPECT_LE(plan.predictedError, tolerance) << all.size() << " " << tolerance;
                EXPECT_GT(plan.predictedError, 0.02 * tolerance) << all.size() << " " << tolerance;
                EXPECT_NEAR(plan.realCutoff, plan.a * plan.mixture->largestRange(),
                            1e-9 * plan.realCutoff);
                for (int d = 0; d < 3; d++)
                    EXPECT_EQ(plan.grid[d], nextFftSize(plan.grid[d]));
            }
}

TEST(MixturePlans, EqualRadiiHaveThePlanOfOneRadius) {
    PlanRequest r = request(std::vector<double>(200, 1.0), 0.1, 1e-3);
    const Plan each = makePlan(r);
    r.radii.clear();
    const Plan one = makePlan(r);
    EXPECT_FALSE(each.mixture);
    EXPECT_EQ(each.xi, one.xi);
    EXPECT_EQ(each.grid, one.grid);
    EXPECT_EQ(each.windowShape, one.windowShape);
    EXPECT_EQ(each.windowSpacing, 0);
}

TEST(MixturePlans, WhatWasChosenReproducesThePlan) {
    for (SplitChoice split : {SplitChoice::Prolate, SplitChoice::Hasimoto}) {
        PlanRequest r = request(geometric(0.5, 1.5, 60), 0.1, 1e-3);
        r.split = split;
        const Plan plan = makePlan(r);
        r.tolerance = 3e-3;
        r.overrides = {plan.xi,   plan.realCutoff,    plan.bandwidth,
                       plan.grid, plan.windowSupport, plan.windowShape,
                       0};
        const Plan again = makePlan(r);
        EXPECT_EQ(again.xi, plan.xi);
        EXPECT_EQ(again.realCutoff, plan.realCutoff);
        EXPECT_EQ(again.windowSpacing, plan.windowSpacing);
        for (double k : {0.1, 0.7, 1.3})
            EXPECT_EQ(again.mixture->envelope(k), plan.mixture->envelope(k)) << k;
        EXPECT_EQ(again.mixture->range(1, 1), plan.mixture->range(1, 1));
    }
}

TEST(MixtureTable, MagnificationDecidesThePrecision) {
    EXPECT_EQ(makePlan(request(geometric(1, 2, 100), 0.1, 1e-3)).precision, Precision::Single);
    const PlanRequest wide = request(geometric(1, 10, 200), 0.1, 1e-4);
    const Plan plan = makePlan(wide);
    const MixtureTable table(*plan.mixture, plan.tableError);
    EXPECT_EQ(plan.radiusFunctions, table.size());
    EXPECT_EQ(makePlan(request({1, 2, 2}, 0.1, 1e-3)).radiusFunctions, 0); // each its own
    EXPECT_EQ(plan.precision == Precision::Double, 6e-8 * table.magnification() > 1e-5);
    PlanRequest extreme = request({1, 1, 1, 100, 100, 100}, 0.05, 1e-6);
    EXPECT_EQ(refusal(extreme), ""); // with a range of the size of the larger ones
    extreme.overrides.xi = 0.5;
    const std::string message = refusal(extreme);
    for (const char* word : {"radii from 1 to 100 nm", "magnify rounding", "looser tolerance"})
        EXPECT_NE(message.find(word), std::string::npos) << message;
    extreme.directSums = true; // by Clenshaw's recurrence
    EXPECT_EQ(refusal(extreme), "");
}

// With the cheapest range, sizes 1:10 want double precision at 1e-3; a longer one serves.
TEST(MixturePlans, ARangeThatThePlatformCannotServeIsPassedOver) {
    for (double tolerance : {1e-2, 1e-3}) {
        PlanRequest r = request(alternating(0.25, 2.5, 120, 10), 0.25, tolerance);
        r.split = SplitChoice::Hasimoto;
        r.singleOnly = true;
        const Plan plan = makePlan(r);
        EXPECT_EQ(plan.precision, Precision::Single) << tolerance;
        EXPECT_LE(plan.predictedError, tolerance);
    }
}

TEST(MixturePlans, NeighboursAreCountedByTheRangesOfAllPairs) {
    const PlanRequest r = request(alternating(0.5, 5, 400, 20), 0.1, 1e-3);
    const Plan plan = makePlan(r);
    double pairs = 0;
    for (double ai : plan.mixture->particleRadii())
        for (double aj : plan.mixture->particleRadii())
            pairs += 4 * M_PI / 3 * std::pow(plan.a * plan.mixture->range(ai, aj), 3);
    EXPECT_NEAR(meanNeighbours(plan, r.box, 400), pairs / r.box.volume() / 400,
                1e-10 * pairs / r.box.volume() / 400);
    EXPECT_LT(meanNeighbours(plan, r.box, 400), 0.8 * meanNeighbours(r.box, 400, plan.realCutoff));
}

TEST(MixturePlans, TheRangeIsTheShortestThatTheGridBears) {
    std::vector<double> radii;
    for (int i = 0; i < 500; i++)
        radii.push_back(1 + 0.25 * (i % 5));
    PlanRequest r = request(radii, 0.2, 1e-3);
    for (double tolerance : {1e-3, 1e-4}) {
        r.tolerance = tolerance;
        r.overrides = {};
        const Plan plan = makePlan(r);
        EXPECT_GT(plan.predictedError, 0.8 * tolerance);
        // 4 % less, whatever the bandwidth
        const double range = 1 / plan.xi, shorter = 0.96 * range,
                     cutoff = plan.realCutoff - (range - shorter);
        for (double factor : {0.9, 0.95, 1.0}) {
            r.overrides = {
                1 / shorter,      cutoff, factor * plan.bandwidth, plan.grid, plan.windowSupport,
                plan.windowShape, 0};
            EXPECT_GT(makePlan(r).predictedError, tolerance) << factor;
        }
    }
}

TEST(MixtureErrors, AtOnePlaceTheErrorIsThatOfTheWorstPlace) {
    const Lattice box = Lattice::orthorhombic(9, 9, 9);
    const std::array<int, 3> grid = {8, 8, 8};
    struct Case {
        double large;
        int count, P;
    };
    for (const Case& test : {Case{2, 1, 3}, Case{2, 1, 4}, Case{2, 20, 3}, Case{1.2, 20, 4}}) {
        const double radii[] = {1, test.large};
        const int counts[] = {1, test.count};
        const Mixture mixture(std::make_shared<ProlateEnvelope>(8, 4), {1, test.large});
        const RadialWindow window(test.P, 2.05 * test.P, RadialWindow::spacing(box, grid));
        double measured = 0;
        for (double place : {0.0, 0.5}) {
            const Vec3 x = box.cartesian(Vec3::Constant((1 + place) / grid[0]));
            const Eigen::MatrixXd error = Prototype(mixture, box, grid, window, {x, x}).error();
            for (int j = 0; j < 2; j++) {
                // like forces on all of a kind; the others are elsewhere, or there
                const double like = 1 / (radii[j] * std::sqrt(counts[j]));
                double velocities = 0, wrong = 0;
                for (int i : {j, 1 - j}) {
                    const double mobility = mobilityAmongImages(9, radii[i], radii[j]);
                    velocities += counts[i] * mobility * mobility;
                    wrong += counts[i] * error.block<3, 1>(3 * i, 3 * j).squaredNorm();
                    measured = std::max(measured,
                                        std::sqrt(wrong) / std::max(like, std::sqrt(velocities)));
                }
            }
        }
        const auto predicted = [&](const std::vector<double>& spheres) {
            return MixtureErrors(Composition(spheres), box, 1e-9, 12, imageSpacing(box))
                .wave(mixture, grid, &window);
        };
        std::vector<double> all(test.count, test.large);
        all.push_back(1);
        EXPECT_LT(measured, 1.1 * predicted(all)) << test.large << " " << test.P;
        EXPECT_GT(measured, 0.2 * predicted(all)) << test.large << " " << test.P;
        EXPECT_LE(predicted({1}), predicted(all)) << test.large << " " << test.P;
    }
}

TEST(MixturePlans, AWiderWindowIsTakenWhereAShorterRangePaysForIt) {
    std::vector<double> radii;
    for (int i = 0; i < 500; i++)
        radii.push_back(1 + 0.25 * (i % 5));
    PlanRequest r = request(radii, 0.2, 1e-3);
    for (int points : {18, 20}) {
        r.overrides = {};
        r.overrides.grid = {points, points, points};
        const Plan plan = makePlan(r);
        EXPECT_EQ(plan.windowSupport, 5) << points;
        EXPECT_LE(plan.predictedError, r.tolerance) << points;
        r.overrides.windowSupport = 4; // serves, too
        const Plan narrow = makePlan(r);
        EXPECT_LE(narrow.predictedError, r.tolerance) << points;
        EXPECT_LT(plan.realCutoff, 0.98 * narrow.realCutoff) << points;
    }
}

TEST(MixtureErrors, WaveErrorBoundsTheMeasuredError) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> uniform;
    struct Case {
        double small, large, c, R, kN;
        int P;
    };
    const double L = 14;
    const Lattice cube = Lattice::orthorhombic(L, L, L),
                  tilted(Vec3(L, 0, 0), Vec3(0.5 * L, L, 0), Vec3(-0.5 * L, 0.5 * L, L));
    for (const Case& test :
         {Case{1, 2, 8, 4, 1.06, 4}, Case{1, 1.5, 11, 6, 1.06, 5}, Case{0.6, 2.4, 6, 4, 1.3, 3}})
        for (const Lattice& box : {cube, tilted}) {
            const std::vector<double> radii = alternating(test.small, test.large, 24, 3);
            std::vector<Vec3> x;
            for (size_t i = 0; i < radii.size(); i++)
                x.push_back(box.cartesian(Vec3(uniform(random), uniform(random), uniform(random))));
            const Mixture mixture(std::make_shared<ProlateEnvelope>(test.c, test.R), radii);
            std::array<int, 3> grid;
            for (int d = 0; d < 3; d++)
                grid[d] = 2 * static_cast<int>(
                                  0.5 * test.kN * test.c / test.R * box.length(d) / M_PI + 1);
            const RadialWindow window(test.P, 2.05 * test.P, RadialWindow::spacing(box, grid));
            const Eigen::MatrixXd error = Prototype(mixture, box, grid, window, x).error();
            double measured = 0; // of the worse kind, root mean square over its spheres
            for (double kind : {test.small, test.large}) {
                double squares = 0;
                int count = 0;
                for (size_t j = 0; j < radii.size(); j++)
                    if (radii[j] == kind) {
                        squares += error.middleCols(3 * j, 3).squaredNorm() / 3;
                        count++;
                    }
                measured = std::max(measured, kind * std::sqrt(squares / count));
            }
            const MixtureErrors errors(Composition(radii), box, 0, 12);
            // Modes beyond the cell are missing in both sums of the prototype.
            const double predicted = errors.wave(mixture, grid, &window),
                         outside = errors.wave(mixture, grid, NULL),
                         aliases = std::sqrt(predicted * predicted - outside * outside);
            EXPECT_LT(measured, 1.1 * predicted) << test.large << " " << aliases;
            EXPECT_GT(measured, 0.15 * aliases) << test.large;
        }
}
