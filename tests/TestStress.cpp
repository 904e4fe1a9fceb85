// SPDX-License-Identifier: MIT
// Stress, and the boxes and flows behind it, against closed forms.

#include "numerics/Lattice.h"
#include "numerics/ShearFlow.h"
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
