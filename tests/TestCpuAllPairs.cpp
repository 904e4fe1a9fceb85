// SPDX-License-Identifier: MIT
// Products with the mobility of an unbounded fluid at the same positions, from the record of pairs
// that the first one keeps: single against double precision [T32, T57].

#include "CpuAllPairs.h"
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <tuple>
#include <vector>

using namespace PSE;
using namespace PSE::numerics;

namespace {

constexpr double A = 0.5, LANCZOS_TOLERANCE = 5e-4;
/// of coordinates from their middle, in radii: 0.05 of that tolerance is the rounding of floats
constexpr double FARTHEST = 0.05 * LANCZOS_TOLERANCE * 16777216;
constexpr int PER_CLUSTER = 150;

UnboundedPlan planFor(double tolerance, SphereModel model, const std::vector<double>& radii) {
    UnboundedRequest request;
    request.tolerance = tolerance;
    request.lanczosTolerance = LANCZOS_TOLERANCE;
    request.model = model;
    return makeUnboundedPlan(request, radii);
}

/** Two clusters of spheres in contact and overlap, at either end of a cube's diagonal (nm). */
std::vector<Vec3> twoClusters(double halfEdge) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<Vec3> x;
    for (int i = 0; i < 2 * PER_CLUSTER; i++) {
        Vec3 place(normal(random), normal(random), normal(random));
        place *= 4 * A;
        const double end = i % 2 == 0 ? -1 : 1;
        x.push_back(place + Vec3::Constant(end * (halfEdge - 20 * A)));
    }
    // so that the extent is the asked one exactly
    x.front().setConstant(-halfEdge);
    x.back().setConstant(halfEdge);
    return x;
}

/** Second and later products with one vector, as the first rows of a Lanczos process need them. */
template <class Real>
std::vector<double> product(const UnboundedPlan& plan, const std::vector<double>& radii,
                            const std::vector<Vec3>& x, double& difference) {
    OpenMM::ThreadPool pool(2);
    const Threads threads(pool, false);
    CpuAllPairs<Real> pairs(plan, radii, threads);
    pairs.setPositions(x);
    pairs.expectMore(true);
    auto &v = pairs.basis(0), &first = pairs.basis(1), &second = pairs.basis(2);
    std::mt19937 random(2);
    std::normal_distribution<float> normal; // exact in either precision
    const int n = static_cast<int>(x.size());
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < n; i++)
            v[size_t(c) * pairs.stride() + i] = normal(random);
    pairs.multiplyAdd(v, 1, v, 0, first);
    pairs.multiplyAdd(v, 1, v, 0, second);
    std::vector<double> result;
    double changed = 0, square = 0;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < n; i++) {
            const size_t k = size_t(c) * pairs.stride() + i;
            changed += std::pow(double(second[k]) - double(first[k]), 2);
            square += std::pow(double(first[k]), 2);
            result.push_back(double(second[k]));
        }
    difference = std::sqrt(changed / square);
    return result;
}

double relativeError(const std::vector<double>& mine, const std::vector<double>& exact) {
    double error = 0, square = 0;
    for (size_t k = 0; k < exact.size(); k++) {
        error += std::pow(mine[k] - exact[k], 2);
        square += std::pow(exact[k], 2);
    }
    return std::sqrt(error / square);
}

using Law = std::tuple<SphereModel, bool>;

/** Of a model, and of equal radii or not. */
class Products : public testing::TestWithParam<Law> {
protected:
    double errorAt(double halfEdge, double& changed) const {
        std::vector<double> radii(2 * PER_CLUSTER, A);
        for (size_t i = 0; i < radii.size() && !std::get<1>(GetParam()); i += 3)
            radii[i] = 1.5 * A;
        const SphereModel model = std::get<0>(GetParam());
        const std::vector<Vec3> x = twoClusters(halfEdge);
        double none;
        const std::vector<double> mine =
            product<float>(planFor(1e-3, model, radii), radii, x, changed);
        const std::vector<double> exact =
            product<double>(planFor(1e-9, model, radii), radii, x, none);
        EXPECT_EQ(none, 0);
        return relativeError(mine, exact);
    }
};

TEST_P(Products, RoundCoordinatesWithinTheirShareOfTheTolerance) {
    double changed;
    EXPECT_LE(errorAt(0.999 * FARTHEST * A, changed), 0.05 * LANCZOS_TOLERANCE);
    EXPECT_GT(changed, 0); // they do round them
}

TEST_P(Products, RoundNothingBeyondIt) {
    double changed;
    EXPECT_LE(errorAt(1.001 * FARTHEST * A, changed), 1e-6);
    EXPECT_LE(changed, 1e-6);
    EXPECT_LE(errorAt(1e6 * A, changed), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Laws, Products,
                         testing::Combine(testing::Values(SphereModel::RotnePragerYamakawa,
                                                          SphereModel::ForceCoupling),
                                          testing::Bool()));

} // namespace
