// SPDX-License-Identifier: MIT
// Stress against closed forms.

#include "numerics/Stress.h"
#include <cmath>
#include <gtest/gtest.h>

using namespace PSE::numerics;

namespace {

/** U = |r|^-n of one bond: dU/d(strain) = -n |r|^-n r r/|r|^2. */
struct PowerLaw {
    Vec3 r;
    int n;
    double energy(const Matrix3& map) const { return std::pow((map * r).norm(), -n); }
    Matrix3 derivative() const { return -n * std::pow(r.norm(), -n - 2) * r * r.transpose(); }
};

/** Of the entries, over the largest. */
double errorOf(const PowerLaw& law, double step) {
    const Matrix3 found = strainDerivative([&](const Matrix3& m) { return law.energy(m); }, step);
    return (found - law.derivative()).cwiseAbs().maxCoeff() /
           law.derivative().cwiseAbs().maxCoeff();
}

} // namespace

TEST(Stress, OfAPowerLawIsExactToTheFourthOrder) {
    const PowerLaw law = {Vec3(0.5, -0.7, 0.6), 12};
    const double step = strainStep(1e-15);
    EXPECT_GT(step, 1e-4);
    EXPECT_LT(step, 1e-3);
    EXPECT_LT(errorOf(law, step), 1e-10);
    EXPECT_NEAR(errorOf(law, 0.02) / errorOf(law, 0.01), 16, 1.5);
}

TEST(Stress, StepGrowsWithRounding) {
    EXPECT_NEAR(strainStep(1e-7) / strainStep(1e-12), 10, 1e-9);
    EXPECT_LT(strainStep(1e-7), 0.01);
    EXPECT_LT(errorOf({Vec3(0.5, -0.7, 0.6), 12}, strainStep(1e-7)), 2e-5);
}

TEST(Stress, IdealGasAndEinsteinsViscosity) {
    EXPECT_TRUE(idealStress(10, 2.5, 50).isApprox(-0.5 * Matrix3::Identity()));
    const double eta = 600, rate = 0.02, volume = 300, phi = 4 * M_PI / 3 * (1 + 8) / volume;
    const Matrix3 stress = singleSphereStress({1, 2}, eta, rate, volume);
    EXPECT_NEAR(stress(0, 1), 2.5 * phi * eta * rate, 1e-12 * stress(0, 1));
    EXPECT_EQ(stress(0, 1), stress(1, 0));
    EXPECT_EQ(stress.trace(), 0);
    EXPECT_TRUE(singleSphereStress({1, 2}, eta, 0, volume).isZero(0));
}
