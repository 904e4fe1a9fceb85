// SPDX-License-Identifier: MIT
// The neighbour list of OpenMM's CPU platform in a box that moves: no pair within the cut-off is
// missing in any step, and few lists are made.

#include "NeighbourListKeeper.h"
#include "numerics/Lattice.h"
#include "openmm/cpu/CpuNeighborList.h"
#include <algorithm>
#include <gtest/gtest.h>
#include <random>
#include <set>
#include <stdexcept>
#include <tuple>
#include <vector>

using namespace OpenMM;
using PSE::NeighbourListKeeper;
using PSE::numerics::Lattice;

namespace {

constexpr int N = 300;
constexpr double CUTOFF = 2, PADDING = 0.5;

/** What OpenMM keeps for the Forces of a Context, particles in it, and a box. */
class Lists : public testing::Test {
protected:
    Lists() : threads(2), data(N, threads, false), box(Lattice::orthorhombic(12, 10, 11)) {
        data.isPeriodic = true;
        data.requestNeighborList(CUTOFF, PADDING, false, std::vector<std::set<int>>(N));
        std::uniform_real_distribution<double> uniform(-1, 2);
        for (int i = 0; i < N; i++)
            positions.emplace_back(12 * uniform(random), 10 * uniform(random),
                                   11 * uniform(random));
        setBox(box);
    }

    void setBox(const Lattice& next) {
        box = next;
        for (int d = 0; d < 3; d++)
            for (int c = 0; c < 3; c++)
                vectors[d][c] = box.vectors()(c, d);
    }

    /** A flow, and steps of a random walk; some particles stay, if asked for. */
    void move(double strain, double size, int stayOutOf = N) {
        std::normal_distribution<double> normal;
        for (int i = 0; i < N; i++) {
            if (i % stayOutOf != 0 && stayOutOf < N)
                continue;
            Vec3& x = positions[i];
            x += Vec3(strain * x[1], 0, 0) +
                 Vec3(normal(random), normal(random), normal(random)) * size;
        }
        setBox(box.sheared(strain));
    }

    /** As OpenMM begins an evaluation: forces are set to zero, and lists are its own affair. */
    void evaluate() {
        data.threadForce[0][3] = 0;
        missing = missingPairs();
        sawPadding = data.paddedCutoff - data.cutoff;
        evaluations++;
    }

    void step(NeighbourListKeeper& keeper, bool moves = false) {
        keeper.evaluate(positions, vectors, moves, [&] { evaluate(); });
    }

    /** An evaluation outside of a step, for which OpenMM makes a list of its own. */
    void evaluateElsewhere() {
        for (int i = 0; i < N; i++)
            for (int d = 0; d < 3; d++)
                data.posq[4 * i + d] = float(i % 7 + d);
        data.threadForce[0][3] = 0;
        data.neighborList->computeNeighborList(N, data.posq, data.exclusions, vectors, true, 0.5f,
                                               threads);
    }

    /** Whether pairs are on the list, by i*N + j with i > j. */
    std::vector<bool> listed() const {
        std::vector<bool> pairs(N * N, false);
        const CpuNeighborList& list = *data.neighborList;
        const auto& sorted = list.getSortedAtoms();
        for (int block = 0; block < list.getNumBlocks(); block++) {
            auto neighbours = list.getNeighborIterator(block);
            while (neighbours.next())
                for (int k = 0; k < list.getBlockSize(); k++) {
                    const size_t place = size_t(block) * list.getBlockSize() + k;
                    if (place < sorted.size() && !(neighbours.getExclusions() & (1 << k)))
                        pairs[std::max(sorted[place], neighbours.getNeighbor()) * N +
                              std::min(sorted[place], neighbours.getNeighbor())] = true;
                }
        }
        return pairs;
    }

    int missingPairs() const {
        const auto pairs = listed();
        int count = 0;
        for (int i = 0; i < N; i++)
            for (int j = 0; j < i; j++) {
                const Vec3 r = positions[i] - positions[j];
                const double distance =
                    box.minimumImage(PSE::numerics::Vec3(r[0], r[1], r[2])).norm();
                count += distance < CUTOFF && !pairs[i * N + j];
            }
        return count;
    }

    std::mt19937 random{5};
    ThreadPool threads;
    CpuPlatform::PlatformData data;
    std::vector<Vec3> positions;
    Lattice box;
    Vec3 vectors[3];
    int missing = 0, evaluations = 0;
    double sawPadding = 0;
};

} // namespace

TEST_F(Lists, NoPairIsMissingAndFewListsAreMade) {
    // slow and fast, with and without a random walk, past several flips
    for (const auto& [strain, size, most] :
         {std::tuple{1e-3, 0.01, 0.05}, {2e-2, 0.0, 0.2}, {2e-2, 0.02, 0.25}, {-0.1, 0.0, 0.9}}) {
        NeighbourListKeeper keeper(data);
        data.paddedCutoff = CUTOFF + PADDING;
        const int steps = 120;
        step(keeper); // here OpenMM has no list yet, and makes it
        for (int i = 0; i < steps; i++) {
            move(strain, size);
            step(keeper);
            ASSERT_EQ(missing, 0) << strain << " " << size << " " << i;
            ASSERT_GT(sawPadding, 1e20);
            ASSERT_EQ(data.paddedCutoff, data.cutoff);
        }
        EXPECT_LT(keeper.listsMade(), most * steps) << strain << " " << size;
        EXPECT_GT(keeper.listsMade(), 0);
    }
}

TEST_F(Lists, AStaleListWouldMissPairs) {
    // the same scene without a keeper: the test above can fail
    NeighbourListKeeper keeper(data);
    step(keeper);
    move(1e-3, 0);
    step(keeper);
    for (int i = 0; i < 60; i++)
        move(2e-2, 0);
    evaluate();
    EXPECT_GT(missing, 10);
}

TEST_F(Lists, ImagesThatComeNearerThoughNothingMoves) {
    NeighbourListKeeper keeper(data);
    step(keeper);
    for (int i = 0; i < 60; i++) {
        move(2e-2, 0, 50);
        step(keeper);
        ASSERT_EQ(missing, 0) << i;
    }
}

TEST_F(Lists, AListOfOpenMMIsNotTakenForOurs) {
    NeighbourListKeeper keeper(data);
    step(keeper);
    move(1e-4, 0);
    step(keeper);
    const long long before = keeper.listsMade();
    for (int i = 0; i < 3; i++) {
        evaluateElsewhere();
        move(1e-4, 0);
        step(keeper);
        EXPECT_EQ(missing, 0);
    }
    EXPECT_EQ(keeper.listsMade(), before + 3);
}

TEST_F(Lists, PositionsSetElsewhere) {
    NeighbourListKeeper keeper(data);
    step(keeper);
    move(1e-4, 0);
    step(keeper);
    std::shuffle(positions.begin(), positions.end(), random);
    keeper.follow(positions, vectors);
    evaluate();
    EXPECT_EQ(missing, 0);
}

TEST_F(Lists, NothingHappensInABoxThatStays) {
    NeighbourListKeeper keeper(data);
    for (int i = 0; i < 20; i++) {
        move(0, 0.3);
        step(keeper);
        EXPECT_DOUBLE_EQ(sawPadding, PADDING);
    }
    EXPECT_EQ(keeper.listsMade(), 0);
    EXPECT_EQ(evaluations, 20);
}

TEST_F(Lists, AnEvaluationThatFailsLeavesOpenMMItsTest) {
    NeighbourListKeeper keeper(data);
    step(keeper);
    move(1e-4, 0);
    const auto fail = [] { throw std::runtime_error("a Force failed"); };
    EXPECT_THROW(keeper.evaluate(positions, vectors, false, fail), std::runtime_error);
    EXPECT_EQ(data.paddedCutoff, data.cutoff);
    step(keeper);
    EXPECT_EQ(missing, 0);
}

TEST_F(Lists, ARestartBeginsWithAList) {
    NeighbourListKeeper keeper(data);
    step(keeper, true);
    EXPECT_EQ(missing, 0);
    const long long before = keeper.listsMade();
    EXPECT_EQ(before, 1);
    step(keeper);
    EXPECT_EQ(keeper.listsMade(), before);
    keeper.startAnew();
    step(keeper);
    EXPECT_EQ(keeper.listsMade(), before + 1);
}
