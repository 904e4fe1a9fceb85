// SPDX-License-Identifier: MIT
// What a growing step is, and that chance does not look like one [T63].

#include "numerics/StepGrowth.h"
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using namespace PSE::numerics;

namespace {

/** Steps that are made before one is a runaway; all of them if none is. */
int stepsBefore(StepGrowth& growth, const std::vector<double>& velocities) {
    int made = 0;
    for (double v : velocities) {
        if (growth.isRunaway(v, 1))
            return made;
        growth.add(v, 1);
        made++;
    }
    return made;
}

std::vector<double> geometric(double factor, int count) {
    std::vector<double> all;
    for (int i = 0; i < count; i++)
        all.push_back(0.3 * std::pow(factor, i));
    return all;
}

/** Of steps in a row each of which grows, by chance: (longest row, how often it was 4 or more). */
std::pair<int, int> rows(const std::vector<double>& velocities) {
    StepGrowth growth;
    int longest = 0, four = 0;
    for (double v : velocities) {
        growth.add(v, 1);
        longest = std::max(longest, growth.length());
        four += growth.length() >= 4;
    }
    return {longest, four};
}

} // namespace

TEST(StepGrowth, NamesAGrowthByItsLengthAndByWhatItIsInAll) {
    for (double factor : {1.06, 1.3, 1.9, 2.5, 10.0, 1e6}) {
        StepGrowth growth;
        const int byFactor = std::ceil(std::log(StepGrowth::IN_ALL) / std::log(factor) - 1e-9);
        EXPECT_EQ(stepsBefore(growth, geometric(factor, 400)),
                  std::max(byFactor, StepGrowth::STEPS))
            << factor;
        EXPECT_EQ(growth.start(), 0.3);
    }
    for (double factor : {0.5, 1.0, 1.04}) {
        StepGrowth growth;
        EXPECT_EQ(stepsBefore(growth, geometric(factor, 400)), 400) << factor;
    }
}

TEST(StepGrowth, EndsWithAStepThatGrowsNoFurtherOrHasAnotherSize) {
    const std::vector<double> growing = geometric(3, StepGrowth::STEPS);
    for (int pause = 0; pause < StepGrowth::STEPS; pause++) {
        std::vector<double> velocities = growing;
        velocities.insert(velocities.begin() + pause, pause > 0 ? growing[pause - 1] : 1.0);
        velocities.push_back(3 * velocities.back());
        StepGrowth growth;
        EXPECT_EQ(stepsBefore(growth, velocities) == int(velocities.size()), pause > 1) << pause;
    }
    StepGrowth growth;
    EXPECT_EQ(stepsBefore(growth, growing), StepGrowth::STEPS);
    EXPECT_TRUE(growth.isRunaway(1e9, 1));
    EXPECT_FALSE(growth.isRunaway(1e9, 0.5));
    growth.forget();
    EXPECT_FALSE(growth.isRunaway(1e9, 1));
    EXPECT_EQ(stepsBefore(growth, growing), StepGrowth::STEPS);
}

TEST(StepGrowth, DoesNotBeginAtRest) {
    StepGrowth growth;
    EXPECT_EQ(stepsBefore(growth, std::vector<double>(50, 0.0)), 50);
    EXPECT_FALSE(growth.isRunaway(1e9, 1));
    EXPECT_EQ(growth.length(), 0);
}

/** n + 1 independent numbers are in ascending order with probability 1/(n + 1)!, whatever their
 * law. */
TEST(StepGrowth, OfIndependentVelocitiesIsAsRareAsAscendingOrder) {
    const int samples = 1000000;
    std::mt19937_64 random(31);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    std::vector<double> noise(samples), kicks(samples);
    for (int i = 0; i < samples; i++) {
        noise[i] = std::fabs(normal(random));
        kicks[i] = std::pow(1 - uniform(random), -13.0 / 3); // of overlaps that repel by r^-12
    }
    // rows of four or more: 1e6/5! = 8333 of strictly ascending ones, of which LEAST leaves some;
    // correlated over a few steps, so that 6 times sqrt(5 times 8333) is beyond a false alarm of
    // 1e-6
    const double expected = samples / 120.0, margin = 6 * std::sqrt(5 * expected);
    EXPECT_LT(rows(noise).second, expected + margin);
    EXPECT_LT(rows(kicks).second, expected + margin);
    EXPECT_GT(rows(kicks).second, 0.8 * expected);
    // of ten: 1/11! per step, 0.025 in a million of them
    EXPECT_LT(rows(noise).first, StepGrowth::STEPS);
    EXPECT_LT(rows(kicks).first, StepGrowth::STEPS);
}
