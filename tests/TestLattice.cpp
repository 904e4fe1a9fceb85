// SPDX-License-Identifier: MIT
// The periodic box against brute force over many images.

#include "numerics/Lattice.h"
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

/** All eight extremes of tilt that the reduced form allows, and ordinary, flat and large boxes
 * (nm). */
std::vector<Lattice> boxes() {
    std::vector<Lattice> all = {Lattice::orthorhombic(3, 3, 3), Lattice::orthorhombic(1, 8, 1),
                                Lattice(Vec3(2, 0, 0), Vec3(0.7, 3, 0), Vec3(-0.4, 1.1, 2.5)),
                                Lattice(Vec3(9, 0, 0), Vec3(-4.5, 1, 0), Vec3(4.5, -0.5, 0.8)),
                                Lattice(Vec3(1e4, 0, 0), Vec3(5e3, 1e4, 0), Vec3(-5e3, 5e3, 1e4))};
    for (double x : {-0.5, 0.5})
        for (double y : {-0.5, 0.5})
            for (double z : {-0.5, 0.5})
                all.push_back(Lattice(Vec3(2, 0, 0), Vec3(2 * x, 2, 0), Vec3(2 * y, 2 * z, 2)));
    return all;
}

/** A point with fractional coordinates spread over [-reach, reach]. */
Vec3 randomPoint(const Lattice& box, double reach, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-reach, reach);
    return box.vectors() * Vec3(uniform(random), uniform(random), uniform(random));
}

/** The shortest of d + R over (2 reach + 1)^3 lattice vectors R. */
Vec3 shortestByForce(const Lattice& box, const Vec3& d, int reach) {
    Vec3 best = d;
    for (int i = -reach; i <= reach; i++)
        for (int j = -reach; j <= reach; j++)
            for (int k = -reach; k <= reach; k++) {
                const Vec3 image = d + box.vectors() * Vec3(i, j, k);
                if (image.norm() < best.norm())
                    best = image;
            }
    return best;
}

bool isInteger(const Vec3& s, double tolerance) {
    return (s - Vec3(s.array().round())).cwiseAbs().maxCoeff() < tolerance;
}

std::string refusal(const Vec3& a, const Vec3& b, const Vec3& c) {
    try {
        Lattice box(a, b, c);
    } catch (const std::invalid_argument& e) {
        return e.what();
    }
    return "accepted";
}

} // namespace

TEST(Lattice, VolumeLengthAndWidthAreThoseOfTheVectors) {
    for (const Lattice& box : boxes()) {
        const Matrix3& v = box.vectors();
        EXPECT_NEAR(box.volume(), v.col(0).dot(v.col(1).cross(v.col(2))), 1e-14 * box.volume());
        for (int d = 0; d < 3; d++)
            EXPECT_DOUBLE_EQ(box.length(d), std::sqrt(v.col(d).dot(v.col(d))));
        EXPECT_EQ(box.smallestWidth(), std::min({v(0, 0), v(1, 1), v(2, 2)}));
    }
}

TEST(Lattice, NoLatticeVectorIsShorterThanTheSmallestWidth) {
    for (const Lattice& box : boxes())
        for (int i = -4; i <= 4; i++)
            for (int j = -4; j <= 4; j++)
                for (int k = -4; k <= 4; k++)
                    if (i != 0 || j != 0 || k != 0) {
                        const double norm = (box.vectors() * Vec3(i, j, k)).norm();
                        ASSERT_GE(norm, box.smallestWidth() * (1 - 1e-15));
                    }
}

TEST(Lattice, FractionalAndCartesianAreInverse) {
    std::mt19937 random(1);
    for (const Lattice& box : boxes())
        for (int i = 0; i < 100; i++) {
            const Vec3 x = randomPoint(box, 20, random);
            EXPECT_LT((box.cartesian(box.fractional(x)) - x).norm(),
                      1e-14 * (box.length(0) + x.norm()));
        }
}

TEST(Lattice, WaveVectorsAreTwoPiTimesTheReciprocalBasis) {
    for (const Lattice& box : boxes()) {
        const Matrix3 product = box.waveVectors().transpose() * box.vectors();
        EXPECT_LT((product - 2 * M_PI * Matrix3::Identity()).norm(), 1e-14);
        // Plane waves of integer n are periodic in the box, which is what the wave half needs.
        const Vec3 k = box.waveVectors() * Vec3(2, -1, 3);
        for (int d = 0; d < 3; d++)
            EXPECT_NEAR(std::cos(k.dot(box.vectors().col(d))), 1, 1e-13);
    }
}

TEST(Lattice, WrappedLiesInThePrimaryBoxAtALatticeVector) {
    std::mt19937 random(2);
    for (const Lattice& box : boxes())
        for (int i = 0; i < 300; i++) {
            const Vec3 x = randomPoint(box, 10, random), w = box.wrapped(x), s = box.fractional(w);
            EXPECT_TRUE(isInteger(box.fractional(x - w), 1e-13));
            EXPECT_GE(s.minCoeff(), -1e-15);
            EXPECT_LT(s.maxCoeff(), 1);
            EXPECT_LT((box.wrapped(w) - w).norm(), 1e-14 * box.length(0) + 1e-14 * box.length(2));
        }
}

TEST(Lattice, WrappedKeepsCornersAndTinyNegativeNumbersInside) {
    for (const Lattice& box : boxes()) {
        EXPECT_EQ(box.wrapped(Vec3::Zero()), Vec3(Vec3::Zero()));
        const Vec3 below(-1e-20, -1e-20, -1e-20); // floor gives -1, and -1e-20 + 1 rounds to 1
        EXPECT_LT(box.wrapped(below).norm(), 1e-19);
    }
    const Lattice cube = Lattice::orthorhombic(2, 2, 2);
    EXPECT_EQ(cube.wrapped(Vec3(2, -2, 4)), Vec3(Vec3::Zero()));
    EXPECT_EQ(cube.wrapped(Vec3(3, -0.5, 1)), Vec3(1, 1.5, 1));
}

TEST(Lattice, MinimumImageIsTheShortestBelowHalfTheSmallestWidth) {
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    std::uniform_int_distribution<int> shift(-2, 2);
    for (const Lattice& box : boxes())
        for (int i = 0; i < 200; i++) {
            Vec3 direction(normal(random), normal(random), normal(random));
            const double length = 0.499999 * box.smallestWidth() * std::cbrt(uniform(random));
            const Vec3 shortest = direction.normalized() * length;
            const Vec3 d =
                shortest + box.vectors() * Vec3(shift(random), shift(random), shift(random));
            ASSERT_LT((box.minimumImage(d) - shortest).norm(), 1e-13 * d.norm() + 1e-15);
            ASSERT_LT((shortestByForce(box, d, 2) - shortest).norm(), 1e-13 * d.norm() + 1e-15);
        }
}

TEST(Lattice, MinimumImageIsAnImageAtAnyDistance) {
    std::mt19937 random(4);
    for (const Lattice& box : boxes())
        for (int i = 0; i < 200; i++) {
            const Vec3 d = randomPoint(box, 3, random), image = box.minimumImage(d);
            ASSERT_TRUE(isInteger(box.fractional(d - image), 1e-12));
            for (int axis = 0; axis < 3; axis++)
                ASSERT_LE(std::fabs(image[axis]), 0.5 * box.vectors()(axis, axis) * (1 + 1e-12));
        }
}

TEST(Lattice, ImagesWithinMissesNone) {
    std::mt19937 random(5);
    for (const Lattice& box : boxes()) {
        if (box.length(0) > 100)
            continue;
        for (double range : {0.1, 0.5 * box.smallestWidth(), 1.7 * box.smallestWidth(), 3.1}) {
            const std::vector<Vec3> images = box.imagesWithin(range);
            const int reach = static_cast<int>(2 + 2 * range / box.smallestWidth()) + 2;
            for (int trial = 0; trial < 6; trial++) {
                const Vec3 d = box.wrapped(randomPoint(box, 1, random)) -
                               box.wrapped(randomPoint(box, 1, random));
                int found = 0, expected = 0;
                for (const Vec3& image : images)
                    found += ((d + image).norm() <= range);
                for (int i = -reach; i <= reach; i++)
                    for (int j = -reach; j <= reach; j++)
                        for (int k = -reach; k <= reach; k++)
                            expected += ((d + box.vectors() * Vec3(i, j, k)).norm() <= range);
                ASSERT_EQ(found, expected) << "range " << range;
            }
        }
    }
}

TEST(Lattice, ImagesWithinHoldsNoVectorTwiceAndIsSymmetric) {
    for (const Lattice& box : boxes()) {
        const std::vector<Vec3> images = box.imagesWithin(box.smallestWidth());
        int zeros = 0;
        for (size_t i = 0; i < images.size(); i++) {
            ASSERT_TRUE(isInteger(box.fractional(images[i]), 1e-12));
            zeros += (images[i].norm() == 0);
            bool mirrored = false;
            for (size_t j = 0; j < images.size(); j++) {
                ASSERT_TRUE(i == j || (images[i] - images[j]).norm() > 0.5 * box.smallestWidth());
                mirrored = mirrored || (images[i] + images[j]).norm() < 1e-12 * box.length(0);
            }
            ASSERT_TRUE(mirrored);
        }
        EXPECT_EQ(zeros, 1);
    }
}

TEST(Lattice, ExtremeCornersOfThePrimaryBoxFindTheirImages) {
    // Two particles in opposite corners are close neighbours through the boundary.
    for (const Lattice& box : boxes()) {
        const double gap = 1e-3 * box.smallestWidth();
        const Vec3 d = box.cartesian(Vec3(1, 1, 1)) - Vec3(gap, gap, gap) * 2;
        int found = 0;
        for (const Vec3& image : box.imagesWithin(0.01 * box.smallestWidth()))
            found += ((d + image).norm() <= 0.01 * box.smallestWidth());
        EXPECT_EQ(found, 1);
    }
}

TEST(Lattice, EqualityComparesTheVectors) {
    EXPECT_TRUE(Lattice::orthorhombic(1, 2, 3) ==
                Lattice(Vec3(1, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, 3)));
    EXPECT_TRUE(Lattice::orthorhombic(1, 2, 3) !=
                Lattice::orthorhombic(1, 2, std::nextafter(3.0, 4.0)));
    EXPECT_TRUE(Lattice::orthorhombic(1, 2, 3) !=
                Lattice(Vec3(1, 0, 0), Vec3(0.1, 2, 0), Vec3(0, 0, 3)));
}

/** b and c under the flow alone, less the flips, are those of the sheared box; both kinds occur. */
TEST(Lattice, FlipsAreWhatShearingTakesOff) {
    int none = 0, some = 0;
    for (const Lattice& box : boxes())
        for (double strain : {1e-3, -0.3, 0.5, 0.77, -1.6, 12.25}) {
            const std::array<int, 2> flips = box.flips(strain);
            Matrix3 flowed = box.vectors();
            flowed.row(0) += strain * flowed.row(1);
            for (int d = 1; d < 3; d++) {
                flowed.col(d) -= flips[d - 1] * flowed.col(0);
                (flips[d - 1] == 0 ? none : some)++;
            }
            flowed(0, 0) = box.vectors()(0, 0);
            EXPECT_LE((flowed - box.sheared(strain).vectors()).cwiseAbs().maxCoeff(),
                      1e-14 * (1 + std::fabs(strain)) * box.vectors().cwiseAbs().maxCoeff());
        }
    EXPECT_GT(none, 10);
    EXPECT_GT(some, 10);
}

TEST(Lattice, RefusesWhatIsNotAReducedFiniteBox) {
    const double nan = std::numeric_limits<double>::quiet_NaN(),
                 inf = std::numeric_limits<double>::infinity();
    const Vec3 a(2, 0, 0), b(0, 2, 0), c(0, 0, 2);
    EXPECT_EQ(refusal(a, b, c), "accepted");
    EXPECT_NE(refusal(Vec3(nan, 0, 0), b, c).find("finite"), std::string::npos);
    EXPECT_NE(refusal(a, Vec3(inf, 2, 0), c).find("finite"), std::string::npos);
    EXPECT_NE(refusal(a, b, Vec3(0, -inf, 2)).find("finite"), std::string::npos);
    for (const auto& bad : {Vec3(0, 0, 0), Vec3(-2, 0, 0), Vec3(2, 1e-9, 0), Vec3(2, 0, 1)})
        EXPECT_NE(refusal(bad, b, c).find("reduced form"), std::string::npos);
    for (const auto& bad : {Vec3(0, 0, 0), Vec3(0, -2, 0), Vec3(0, 2, 1e-9)})
        EXPECT_NE(refusal(a, bad, c).find("reduced form"), std::string::npos);
    for (const auto& bad : {Vec3(0, 0, 0), Vec3(0, 0, -2)})
        EXPECT_NE(refusal(a, b, bad).find("reduced form"), std::string::npos);
}
