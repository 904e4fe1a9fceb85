// SPDX-License-Identifier: MIT
// From one tolerance to numbers: what a Plan promises, chooses and refuses.

#include "numerics/HasimotoSplit.h"
#include "numerics/NearImages.h"
#include "numerics/Plan.h"
#include "numerics/PlanCost.h"
#include "numerics/ProlateSplit.h"
#include "numerics/Window.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>
#include <vector>

using namespace PSE::numerics;

namespace {

const Lattice CUBE = Lattice::orthorhombic(20, 20, 20);

PlanRequest request(const Lattice& box, int n, double tolerance) {
    return {box, n, 1.0, tolerance, true, 1e-5, false, {}};
}

PlanRequest with(SplitChoice split, PlanRequest r) {
    r.split = split;
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

void expectMentions(const std::string& message, const std::vector<std::string>& words) {
    for (const std::string& word : words)
        EXPECT_NE(message.find(word), std::string::npos)
            << "'" << word << "' is not in: " << message;
}

double errorAtOnePlace(const Plan& plan, const PlanRequest& r, double spacing) {
    const double together =
        std::max(1.0 / r.numParticles, mobilityAmongImages(spacing, 1, 1, r.model));
    return waveError(*plan.split, r.box, plan.grid, plan.windowSupport, plan.windowShape, 0, 1e9,
                     together);
}

} // namespace

TEST(Plan, PredictedErrorKeepsTheToleranceForEveryXi) {
    for (double tolerance = 1e-1; tolerance > 0.9e-10; tolerance /= 10)
        for (double xi : {0.1, 0.2, 0.5, 1.0, 1.8}) {
            PlanRequest r = with(SplitChoice::Hasimoto, request(CUBE, 300, tolerance));
            r.overrides.xi = xi;
            const Plan plan = makePlan(r);
            ASSERT_LE(plan.predictedError, tolerance) << tolerance << " " << xi;
            ASSERT_GT(plan.predictedError, 0.1 * tolerance) << tolerance << " " << xi;
        }
}

TEST(Plan, PredictedErrorKeepsTheToleranceForEveryProlateRange) {
    int refused = 0;
    for (double tolerance = 1e-1; tolerance > 0.9e-10; tolerance /= 10)
        for (double range : {2.5, 4.0, 6.0, 9.5}) {
            PlanRequest r = with(SplitChoice::Prolate, request(CUBE, 300, tolerance));
            r.overrides.realCutoff = range;
            if (!refusal(r).empty()) {
                expectMentions(refusal(r), {"prolate range", "positive", "looser tolerance"});
                refused++;
                continue;
            }
            const Plan plan = makePlan(r);
            EXPECT_EQ(plan.split->name(), "Prolate");
            EXPECT_EQ(plan.realCutoff, range);
            EXPECT_EQ(plan.xi, 1 / range);
            EXPECT_LE(plan.predictedError, tolerance) << range;
            EXPECT_GT(plan.predictedError, 0.1 * tolerance) << range;
            EXPECT_EQ(plan.split->realTruncation(range, 0.3), 0);
        }
    EXPECT_GE(refused, 10); // the tightest tolerances need the widest range
    EXPECT_LE(refused, 22);
}

TEST(Plan, PredictedErrorKeepsTheToleranceInEveryScene) {
    const double tolerances[] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10};
    const int counts[] = {1, 30, 1000, 30000, 1000000};
    const double fractions[] = {1e-3, 0.03, 0.2, 0.5};
    for (int scene = 0; scene < 8; scene++) {
        const double tolerance = tolerances[scene], phi = fractions[(scene / 2) % 4];
        const int n = counts[scene % 5], shape = scene % 3;
        const double L = std::cbrt(4 * M_PI / 3 * n / phi);
        const double wide = (shape == 1 ? L : L / 2); // a cube, or 1:1:8
        const Lattice box =
            (shape == 0 ? Lattice(Vec3(L, 0, 0), Vec3(0.5 * L, L, 0), Vec3(-0.5 * L, 0.5 * L, L))
                        : Lattice::orthorhombic(wide, wide, L * L * L / (wide * wide)));
        const Plan plan = makePlan(request(box, n, tolerance));
        EXPECT_LE(plan.predictedError, tolerance)
            << "N " << n << " phi " << phi << " shape " << shape;
        EXPECT_GT(plan.predictedError, 0.1 * tolerance);
        const double share =
            plan.realCutoff / box.smallestWidth(); // near 1/2 a margin for rounding is allowed
        EXPECT_TRUE(plan.sumImages ? share > 0.49 : share < 0.5) << share;
        EXPECT_LE(plan.lanczosTolerance, tolerance);
        for (int d = 0; d < 3; d++) {
            EXPECT_GE(plan.grid[d], plan.windowSupport);
            EXPECT_EQ(plan.grid[d], nextFftSize(plan.grid[d]));
        }
        // Memory in proportion to the particles, with room for few particles and tight tolerances.
        const double digits = -std::log10(tolerance);
        EXPECT_LT(plan.gridPoints(), 4000 + (30 + 10 * digits * digits) * n)
            << "N " << n << " phi " << phi;
    }
}

TEST(Plan, WindowFollowsTheRule) {
    for (double tolerance : {1e-1, 1e-3, 1e-6, 1e-10}) {
        PlanRequest r = with(SplitChoice::Hasimoto, request(CUBE, 200, tolerance));
        r.overrides.xi = 0.5;
        const Plan plan = makePlan(r);
        const double error = 0.5 * tolerance; // of each half
        EXPECT_NEAR(plan.windowSupport, 2 - std::log10(error),
                    2.1); // digits + 2, one less where that is cheaper
        EXPECT_DOUBLE_EQ(plan.windowShape,
                         std::max(std::log(10 / error), 1.57 * plan.windowSupport));
        EXPECT_LT(plan.tableError, 0.1 * error);
        const double meanPhi = 200 * 4.0 / 3 * M_PI / CUBE.volume();
        EXPECT_LE(plan.split->realTruncation(plan.realCutoff, 0.3, meanPhi), error * (1 + 1e-9));
    }
}

TEST(Plan, GridFollowsTheLengthsOfTheBoxVectorsNotTheWidths) {
    const double L = 20;
    const Lattice tilted(Vec3(L, 0, 0), Vec3(0.5 * L, L, 0), Vec3(0.5 * L, 0.5 * L, L));
    for (double tolerance : {1e-2, 1e-5}) {
        PlanRequest r = with(SplitChoice::Hasimoto, request(tilted, 200, tolerance));
        r.overrides.xi = 0.6;
        const Plan plan = makePlan(r);
        const double nyquist = plan.split->waveCutoff(0.5 * tolerance, 0.3);
        for (int d = 0; d < 3; d++)
            EXPECT_GE(M_PI * plan.grid[d] / tilted.length(d), 0.999 * nyquist) << d;
        EXPECT_GT(plan.grid[2], plan.grid[0]); // all three widths are 20
        EXPECT_GE(plan.grid[1], plan.grid[0]); // sizes of the FFT are coarse
        // No kept mode is needlessly far out either.
        EXPECT_LT(M_PI * plan.grid[2] / tilted.length(2), 1.8 * nyquist);
    }
}

TEST(Plan, ProlateGridFollowsTheLengthsOfTheBoxVectors) {
    const double L = 20;
    const Lattice tilted(Vec3(L, 0, 0), Vec3(0.5 * L, L, 0), Vec3(0.5 * L, 0.5 * L, L));
    for (double tolerance : {1e-2, 1e-5}) {
        const Plan plan = makePlan(with(SplitChoice::Prolate, request(tilted, 200, tolerance)));
        const double unit = plan.bandwidth / plan.realCutoff; // about the Nyquist wave number
        for (int d = 0; d < 3; d++) {
            EXPECT_GT(M_PI * plan.grid[d] / tilted.length(d), 0.9 * unit) << d;
            EXPECT_LT(M_PI * plan.grid[d] / tilted.length(d), 1.8 * unit) << d;
        }
        EXPECT_GT(plan.grid[2], plan.grid[0]);
    }
}

TEST(Plan, OverridesAreRespectedExactly) {
    PlanRequest r = request(CUBE, 300, 1e-3);
    r.overrides.xi = 0.4321;
    r.overrides.realCutoff = 7.654;
    r.overrides.grid = {23, 31, 37};
    r.overrides.windowSupport = 6;
    r.overrides.windowShape = 12.34;
    r.overrides.lanczosTolerance = 0.0123;
    const Plan plan = makePlan(r);
    EXPECT_EQ(plan.xi, 0.4321);
    EXPECT_EQ(plan.realCutoff, 7.654);
    EXPECT_EQ(plan.grid, (std::array<int, 3>{23, 31, 37}));
    EXPECT_EQ(plan.windowSupport, 6);
    EXPECT_EQ(plan.windowShape, 12.34);
    EXPECT_EQ(plan.lanczosTolerance, 0.0123);
    EXPECT_EQ(plan.split->name(), "Hasimoto");
    EXPECT_NEAR(plan.split->waveWeight(1.3), HasimotoSplit(0.4321).waveWeight(1.3), 1e-15);
    const double wave = waveError(*plan.split, CUBE, plan.grid, 6, 12.34, 0.3),
                 real =
                     plan.split->realTruncation(7.654, 0.3, 300 * 4.0 / 3 * M_PI / CUBE.volume());
    EXPECT_GT(plan.predictedError,
              0.5 * std::hypot(wave, real)); // the Plan may know that pairs are not that far apart
    EXPECT_LT(plan.predictedError, 1.001 * std::hypot(wave, real));
}

TEST(Plan, FewSpheresKeepTheToleranceAtTheWorstPlace) {
    const Lattice narrow = Lattice::orthorhombic(9, 9, 9), wide = Lattice::orthorhombic(31, 31, 31),
                  tilted(Vec3(20, 0, 0), Vec3(10, 20, 0), Vec3(-10, 10, 20));
    for (const Lattice& box : {narrow, wide, tilted})
        for (int n : {1, 100})
            for (double tolerance : {1e-1, 1e-3, 1e-5, 1e-7})
                for (SplitChoice split :
                     {SplitChoice::Automatic, SplitChoice::Hasimoto, SplitChoice::AllWaves}) {
                    PlanRequest r = with(split, request(box, n, tolerance));
                    if (split == SplitChoice::AllWaves)
                        r.model = SphereModel::ForceCoupling;
                    const Plan plan = makePlan(r);
                    EXPECT_LE(errorAtOnePlace(plan, r, imageSpacing(box)), tolerance)
                        << n << " " << tolerance << " " << plan.splitName();
                    EXPECT_LE(plan.predictedError, tolerance) << n << " " << tolerance;
                    EXPECT_EQ(plan.precision,
                              tolerance < 0.9e-5 ? Precision::Double : Precision::Single)
                        << n << " " << tolerance;
                }
}

TEST(Plan, FewSpheresKeepTheToleranceAtTheWorstPlaceOfTheSmallestBox) {
    constexpr double L = 5, SHARE = 0.45; // of the tolerance, for the grid in a small box
    for (double tolerance : {1e-1, 1e-3, 1e-4})
        for (SphereModel model : {SphereModel::RotnePragerYamakawa, SphereModel::ForceCoupling}) {
            PlanRequest r = request(Lattice::orthorhombic(L, L, L), 10, tolerance);
            r.model = model;
            r.moving = true;
            r.shortest = 0.8;
            EXPECT_LE(errorAtOnePlace(makePlan(r), r, r.shortest * L), SHARE * tolerance)
                << tolerance;
        }
}

TEST(Plan, TheWorstPlaceCostsNoToleranceAndNoPrecision) {
    for (int n : {1, 50}) {
        PlanRequest r = request(CUBE, n, 1e-10);
        EXPECT_LE(makePlan(r).predictedError, 1e-10) << n;
        r.tolerance = 1e-5;
        r.singleOnly = true;
        EXPECT_EQ(makePlan(r).precision, Precision::Single) << n;
        // a grid for the mean over places, prescribed, is what the mean has to do for
        r = request(CUBE, 101, 1e-3);
        r.overrides.xi = 0.4;
        const Plan many = makePlan(r);
        r.numParticles = n;
        r.overrides.grid = many.grid;
        r.overrides.windowSupport = many.windowSupport;
        r.overrides.windowShape = many.windowShape;
        EXPECT_LE(makePlan(r).predictedError, 1e-3) << n;
    }
}

TEST(Plan, EachOverrideAloneLeavesTheRestAutomatic) {
    const Plan automatic = makePlan(request(CUBE, 100, 1e-3));
    PlanRequest r = request(CUBE, 100, 1e-3);
    r.overrides.xi = automatic.xi; // what was chosen, prescribed, gives the same Plan
    const Plan again = makePlan(r);
    EXPECT_EQ(again.grid, automatic.grid);
    EXPECT_NEAR(again.realCutoff, automatic.realCutoff, 1e-12);
    EXPECT_EQ(again.windowSupport, automatic.windowSupport);
    r.overrides.windowSupport = 8;
    EXPECT_EQ(makePlan(r).windowSupport, 8);
    r.overrides.windowSupport = 0;
    r.overrides.grid = {64, 64, 64};
    EXPECT_EQ(makePlan(r).grid, (std::array<int, 3>{64, 64, 64}));
}

TEST(Plan, WhatWasChosenReproducesAProlatePlan) {
    // Range and bandwidth, whatever the tolerance of the other Context.
    for (double radius : {1.0, 0.37})
        for (double tolerance : {1e-1, 1e-3, 1e-6}) {
            PlanRequest r = request(CUBE, 300, tolerance);
            r.radius = radius;
            const Plan first = makePlan(r);
            ASSERT_EQ(first.split->name(), "Prolate");
            r.split = SplitChoice::Prolate;
            r.overrides = {first.xi,
                           first.realCutoff,
                           first.bandwidth,
                           first.grid,
                           first.windowSupport,
                           first.windowShape,
                           first.lanczosTolerance};
            for (double other : {tolerance, 1e-2}) {
                r.tolerance = other;
                const Plan again = makePlan(r);
                EXPECT_EQ(again.xi, first.xi);
                EXPECT_EQ(again.realCutoff, first.realCutoff);
                EXPECT_EQ(again.bandwidth, first.bandwidth);
                EXPECT_EQ(again.grid, first.grid);
                EXPECT_EQ(again.windowSupport, first.windowSupport);
                EXPECT_EQ(again.windowShape, first.windowShape);
                for (double k = 0; k < 3; k += 0.01)
                    EXPECT_EQ(again.split->waveWeight(k), first.split->waveWeight(k));
                if (other == tolerance) {
                    EXPECT_EQ(again.predictedError, first.predictedError);
                    EXPECT_EQ(again.precision, first.precision);
                }
            }
        }
}

TEST(Plan, ProlateIsTheDefaultWhereItIsValid) {
    const Plan plan = makePlan(request(CUBE, 300, 1e-3));
    EXPECT_EQ(plan.split->name(), "Prolate");
    EXPECT_EQ(plan.splitReason, "default");
    EXPECT_FALSE(plan.sumImages);
    EXPECT_LE(plan.realCutoff, 10);
    EXPECT_EQ(plan.bandwidth * 64, std::round(plan.bandwidth * 64));
    const auto& split = dynamic_cast<const ProlateSplit&>(*plan.split);
    EXPECT_TRUE(split.isPositive());
    EXPECT_EQ(split.range(), plan.realCutoff);
    for (SplitChoice choice : {SplitChoice::Prolate, SplitChoice::Hasimoto}) {
        const Plan chosen = makePlan(with(choice, request(CUBE, 300, 1e-3)));
        EXPECT_EQ(chosen.split->name(), choice == SplitChoice::Prolate ? "Prolate" : "Hasimoto");
        EXPECT_EQ(chosen.splitReason, "as prescribed");
        EXPECT_EQ(chosen.bandwidth > 0, choice == SplitChoice::Prolate);
    }
    // A prescribed parameter is a range where that is one, and Hasimoto's xi where it is not.
    PlanRequest r = request(CUBE, 300, 1e-3);
    r.overrides.xi = 0.2;
    EXPECT_EQ(makePlan(r).split->name(), "Prolate");
    EXPECT_EQ(makePlan(r).realCutoff, 5);
    r.overrides.xi = 0.6;
    EXPECT_EQ(makePlan(r).split->name(), "Hasimoto");
    expectMentions(makePlan(r).splitReason, {"because", "1.66667 nm", "positive"});
    r.overrides.xi = 0;
    r.overrides.realCutoff = 6;
    EXPECT_EQ(makePlan(r).split->name(), "Prolate");
    EXPECT_EQ(makePlan(r).realCutoff, 6);
    r.overrides.xi = 0.5;
    EXPECT_EQ(makePlan(r).split->name(), "Hasimoto");
    expectMentions(makePlan(r).splitReason, {"0.5", "6 nm", "one prolate range"});
}

TEST(Plan, HasimotoWhereTheBoxIsTooSmall) {
    for (double L : {4.0, 6.4, 9.0}) {
        const PlanRequest r = request(Lattice::orthorhombic(L, L, L), 4, 1e-5);
        const Plan plan = makePlan(r);
        EXPECT_EQ(plan.split->name(), "Hasimoto");
        expectMentions(plan.splitReason, {"because", "range of at least", "smallest box width"});
        expectMentions(refusal(with(SplitChoice::Prolate, r)),
                       {"range of at least", "smallest box width", "larger box", "looser tolerance",
                        "setSplit(AutomaticSplit)", "Hasimoto"});
    }
    // The same box serves a looser tolerance.
    EXPECT_EQ(makePlan(request(Lattice::orthorhombic(9, 9, 9), 4, 1e-2)).split->name(), "Prolate");
}

TEST(Plan, HasimotoWhereTheModelFindsItCheaper) {
    // Very dense and tight: positivity wants a wider prolate range than the cost does.
    const double L = std::cbrt(4 * M_PI / 3 * 16000 / 0.4);
    const PlanRequest r = request(Lattice::orthorhombic(L, L, L), 16000, 1e-10);
    const Plan plan = makePlan(r), prolate = makePlan(with(SplitChoice::Prolate, r));
    EXPECT_EQ(plan.split->name(), "Hasimoto");
    expectMentions(plan.splitReason, {"because", "cost model", "cheaper"});
    EXPECT_LE(prolate.predictedError, 1e-10);
    const auto price = [](const Plan& p) {
        const double range = p.realCutoff;
        return CostModel::step(16000, p.gridPoints(), p.windowSupport,
                               16000 * 0.4 * range * range * range, 12);
    };
    EXPECT_LT(price(plan), 0.96 * price(prolate));
}

TEST(Plan, ProlateRefusalsNameTheValueAndTheRemedy) {
    PlanRequest r = with(SplitChoice::Prolate, request(CUBE, 300, 1e-3));
    r.overrides.xi = 0.5; // range 2
    expectMentions(refusal(r), {"2 nm", "below", "0.001", "smaller splitting parameter"});
    r.overrides.xi = 0.08; // range 12.5 in a box of 20
    expectMentions(refusal(r), {"12.5 nm", "0.499", "20 nm", "larger splitting parameter"});
    r.overrides.xi = 0.25;
    r.overrides.bandwidth = 14; // first zero at 3.6
    expectMentions(refusal(r), {"bandwidth of 14", "negative", "prolateBandwidth 0"});
    r.overrides.bandwidth = 3; // drops far too much
    expectMentions(refusal(r), {"bandwidth of 3", "larger", "0.001"});
    r.overrides.bandwidth = 9;
    r.overrides.windowSupport = 3;
    r.tolerance = 1e-2;
    EXPECT_EQ(refusal(r), "");
    r.overrides.bandwidth = 12;
    r.tolerance = 1e-4;
    r.overrides.windowSupport = 3;
    r.overrides.xi = 0.2;
    expectMentions(refusal(r), {"support 3", "0.0001", "larger support", "another split"});
    r = with(SplitChoice::Prolate, request(CUBE, 300, 1e-3));
    r.overrides.xi = 0.25;
    r.overrides.realCutoff = 4.1;
    expectMentions(refusal(r), {"0.25", "4.1 nm", "one prolate range"});
}

TEST(Plan, ProlateSavesGridPointsAtEqualRange) {
    // Hasimoto's smallest grid over xi against the prolate one, same range, by the least factor
    // expected of it [T22]. Grids are sizes of the FFT: a large box makes their rounding small (8 %
    // in points), and that much is granted.
    const double L = 100, margin = 0.92;
    const Lattice box = Lattice::orthorhombic(L, L, L);
    const int n = static_cast<int>(0.1 * L * L * L / (4 * M_PI / 3));
    struct Row {
        double tolerance, range, saved;
    };
    for (const Row& row : {Row{1e-3, 4, 1.6}, Row{1e-3, 5, 1.6}, Row{1e-4, 5, 2.4},
                           Row{1e-4, 6, 2.4}, Row{1e-6, 6, 2.4}, Row{1e-6, 8, 2.4}}) {
        PlanRequest r = with(SplitChoice::Prolate, request(box, n, row.tolerance));
        r.overrides.realCutoff = row.range;
        r.overrides.windowSupport = static_cast<int>(std::lround(2 - std::log10(row.tolerance)));
        const Plan prolate = makePlan(r);
        r.split = SplitChoice::Hasimoto;
        double fewest = std::numeric_limits<double>::infinity();
        for (double xi = 2.4 / row.range; xi < 5 / row.range; xi *= 1.05) {
            r.overrides.xi = xi;
            const Plan plan = makePlan(r);
            if (plan.predictedError <= row.tolerance)
                fewest = std::min(fewest, plan.gridPoints());
        }
        EXPECT_GE(fewest / prolate.gridPoints(), margin * row.saved)
            << row.tolerance << " " << row.range;
    }
}

TEST(Plan, LengthsScaleAndNothingElseMatters) {
    PlanRequest r = request(CUBE, 500, 1e-3);
    const Plan first = makePlan(r), second = makePlan(r);
    EXPECT_EQ(first.bandwidth, second.bandwidth);
    EXPECT_EQ(first.splitReason, second.splitReason);
    EXPECT_EQ(first.xi, second.xi);
    EXPECT_EQ(first.realCutoff, second.realCutoff);
    EXPECT_EQ(first.grid, second.grid);
    EXPECT_EQ(first.windowSupport, second.windowSupport);
    EXPECT_EQ(first.windowShape, second.windowShape);
    EXPECT_EQ(first.predictedError, second.predictedError);
    r.box = Lattice::orthorhombic(5, 5, 5);
    r.radius = 0.25;
    const Plan small = makePlan(r);
    EXPECT_EQ(small.grid, first.grid);
    EXPECT_NEAR(small.xi, 4 * first.xi, 1e-12);
    EXPECT_NEAR(small.realCutoff, first.realCutoff / 4, 1e-12);
    EXPECT_NEAR(small.predictedError / first.predictedError, 1, 1e-9);
}

TEST(Plan, PrecisionFollowsTheTolerance) {
    for (double tolerance : {1e-2, 1e-5, 0.99e-5, 1e-8}) {
        PlanRequest r = request(CUBE, 200, tolerance);
        r.overrides.xi = 0.6;
        EXPECT_EQ(makePlan(r).precision == Precision::Single, tolerance >= 1e-5);
        r.singleFloor = std::numeric_limits<double>::infinity();
        EXPECT_EQ(makePlan(r).precision, Precision::Double);
    }
}

TEST(Plan, SinglePrecisionAloneServesEveryBoxDownToItsFloor) {
    int inDouble = 0;
    for (double edge : {1.3, 2.2, 3.2, 5.0, 20.0})
        for (int n : {1, 30})
            for (double tolerance : {1e-1, 1e-3, 1e-5}) {
                PlanRequest r = request(Lattice::orthorhombic(edge, edge, edge), n, tolerance);
                inDouble += (makePlan(r).precision == Precision::Double);
                r.singleOnly = true;
                const Plan plan = makePlan(r);
                // thousands of neighbours, whose rounding is more than the tightest tolerance
                const bool crowded = edge < 2 && n > 1 && tolerance < 1e-4;
                EXPECT_EQ(plan.precision, crowded ? Precision::Double : Precision::Single)
                    << edge << " " << n << " " << tolerance;
                EXPECT_LE(plan.predictedError, tolerance);
                if (!crowded) {
                    EXPECT_LE(plan.realCutoff / plan.a, plan.split->tableRange(true));
                }
            }
    EXPECT_GT(inDouble, 0); // where there is a choice, double precision is the cheaper one
}

TEST(Plan, TinyAndHugeBoxesHavePlans) {
    EXPECT_TRUE(makePlan(request(Lattice::orthorhombic(1, 1, 1), 1, 1e-3)).sumImages);
    EXPECT_TRUE(makePlan(request(Lattice::orthorhombic(2.1, 2.1, 2.1), 1, 1e-8)).sumImages);
    for (double L : {1e3, 1e5}) {
        const Plan plan = makePlan(request(Lattice::orthorhombic(L, L, L), 2, 1e-3));
        EXPECT_LE(plan.predictedError, 1e-3);
        // two particles need few modes, however large the box
        EXPECT_LT(plan.gridPoints(), 5000);
    }
}

TEST(Plan, RefusalsNameTheValueAndTheRemedy) {
    PlanRequest r = request(CUBE, 100, 1e-3);
    r.overrides.xi = 30;
    expectMentions(refusal(r), {"30", "setSplittingParameter"});
    r.overrides.xi = 1e-7;
    expectMentions(refusal(r), {"1e-07", "setSplittingParameter"});
    r = request(Lattice::orthorhombic(20, 1e-4, 20), 100, 1e-3);
    expectMentions(refusal(r), {"0.0001", "box vector 1", "larger box"});
    r = request(CUBE, 100, 1e-3);
    r.overrides.grid = {32, 4, 32};
    r.overrides.windowSupport = 6;
    expectMentions(refusal(r), {"4", "6", "box vector 1", "setGridDimensions", "setWindowSupport"});
    r = request(CUBE, 100, 1e-3);
    r.overrides.windowSupport = 6;
    r.overrides.windowShape = 9;
    expectMentions(refusal(r), {"9", "9.42", "windowShape"});
    r = request(Lattice::orthorhombic(1e5, 1e5, 1e5), 100, 1e-3);
    r.overrides.xi = 2;
    expectMentions(refusal(r), {"32768", "splitting parameter", "smaller"});
}

TEST(Plan, RangesStayWithinWhatTablesFit) {
    // The tests of RealTable vouch for xi rc = 8 in double and 6 in single precision.
    for (double rc : {7.0, 9.0, 25.0}) {
        PlanRequest r = request(CUBE, 100, 1e-3);
        r.overrides.xi = 1;
        r.overrides.realCutoff = rc;
        const Plan plan = makePlan(r);
        EXPECT_LE(plan.xi * plan.realCutoff, 8.3);
        EXPECT_GE(plan.realCutoff, std::min(rc, 8.0));
        EXPECT_EQ(plan.precision, Precision::Double);
        EXPECT_LE(plan.predictedError, 1e-3);
    }
    for (double xi : {2.0, 3.0, 3.9}) {
        PlanRequest r = request(CUBE, 100, 1e-2);
        r.overrides.xi = xi;
        const std::string message = refusal(r);
        if (!message.empty()) {
            expectMentions(message, {"splitting parameter"});
            continue;
        }
        EXPECT_LE(makePlan(r).xi * makePlan(r).realCutoff, 8.3);
        EXPECT_LE(makePlan(r).predictedError, 1e-2);
    }
    PlanRequest r = request(CUBE, 100, 1e-3);
    r.overrides.xi = 20; // contact alone is at xi r = 40
    expectMentions(refusal(r), {"20", "splitting parameter"});
    r.overrides.xi = 1;
    r.overrides.realCutoff = 1.5; // the estimate counts pairs beyond contact only
    expectMentions(refusal(r), {"1.5", "cutoff"});
}

TEST(Plan, RefusesAWindowThatCannotReachTheTolerance) {
    PlanRequest r = request(CUBE, 100, 1e-8);
    r.overrides.xi = 0.5;
    r.overrides.windowSupport = 3;
    expectMentions(refusal(r), {"support 3", "1e-08", "larger support"});
    r.overrides.windowSupport = 0;
    r.overrides.windowShape = 1000; // exp(1000) overflows
    expectMentions(refusal(r), {"1000", "windowShape"});
}

TEST(Plan, NextFftSizeIsTheSmallestProductOfSmallPrimes) {
    std::vector<bool> smooth(40001, false);
    for (long a = 1; a <= 40000; a *= 2)
        for (long b = a; b <= 40000; b *= 3)
            for (long c = b; c <= 40000; c *= 5)
                for (long d = c; d <= 40000; d *= 7)
                    smooth[d] = true;
    int next = 0;
    for (int n = 36000; n >= 1; n--) {
        if (smooth[n])
            next = n;
        if (next > 0) {
            ASSERT_EQ(nextFftSize(n), next);
        }
    }
}

TEST(Plan, APrescribedGridServesWhatItCanAtTheTightestTolerance) {
    // Among the candidates are splitting parameters whose range is cut short: they must not refuse
    // for the others.
    for (SplitChoice split : {SplitChoice::Automatic, SplitChoice::Hasimoto}) {
        PlanRequest r = with(split, request(Lattice::orthorhombic(20, 20, 20), 100, 1e-10));
        r.overrides.grid = {128, 128, 128};
        const Plan plan = makePlan(r);
        EXPECT_LE(plan.predictedError, 1e-10);
        EXPECT_EQ(plan.grid, r.overrides.grid);
    }
}

TEST(Plan, WindowsThatMagnifyRoundingAskForDoublePrecision) {
    PlanRequest r =
        with(SplitChoice::Hasimoto, request(Lattice::orthorhombic(12, 12, 12), 60, 1e-3));
    r.overrides.xi = 1.2;
    r.overrides.grid = {23, 31, 37};
    const Plan usual = makePlan(r);
    r.overrides.windowSupport = 16; // its transform is tiny at the end of this grid's band
    const Plan wide = makePlan(r);
    const auto magnified = [&](const Plan& plan) {
        return magnification(*plan.split, r.box, plan.grid, plan.windowSupport, plan.windowShape,
                             0.3)
            .first;
    };
    EXPECT_LT(magnified(usual), 1e3);
    EXPECT_GT(magnified(wide), 1e4);
    EXPECT_EQ(wide.precision, Precision::Double);
    EXPECT_GE(wide.predictedError, 1e-16 * magnified(wide)); // told, where even that is not enough
}

TEST(Plan, ImageSumsThatLoseAccuracyAreRefusedWithTheRemedy) {
    PlanRequest r = with(SplitChoice::Hasimoto, request(CUBE, 300, 1e-10));
    r.overrides.xi = 0.05; // a range of more than four boxes
    try {
        makePlan(r);
        FAIL() << "no refusal";
    } catch (const std::invalid_argument& refusal) {
        for (const char* word : {"0.05", "range of 109", "80", "larger splitting parameter"})
            EXPECT_NE(std::string(refusal.what()).find(word), std::string::npos) << refusal.what();
    }
    r.overrides.xi = 0; // the automatic one serves
    EXPECT_LE(makePlan(r).predictedError, 1e-10);
}
