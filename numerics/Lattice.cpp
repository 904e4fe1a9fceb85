// SPDX-License-Identifier: MIT
#include "numerics/Lattice.h"
#include <cmath>
#include <stdexcept>

namespace PSE::numerics {

Lattice::Lattice(const Vec3& a, const Vec3& b, const Vec3& c) {
    boxVectors.col(0) = a;
    boxVectors.col(1) = b;
    boxVectors.col(2) = c;
    if (!boxVectors.allFinite())
        throw std::invalid_argument("the periodic box vectors are not finite; set a finite box");
    if (boxVectors(0, 0) <= 0 || boxVectors(1, 1) <= 0 || boxVectors(2, 2) <= 0 ||
        boxVectors(1, 0) != 0 || boxVectors(2, 0) != 0 || boxVectors(2, 1) != 0)
        throw std::invalid_argument(
            "the periodic box vectors are not in reduced form (a = (ax, 0, 0), b = (bx, by, 0), "
            "c = (cx, cy, cz) with ax, by, cz > 0)");
    inverse = boxVectors.inverse();
    // Upper triangular, as the matrix is: keep its zeros exact.
    inverse(1, 0) = inverse(2, 0) = inverse(2, 1) = 0;
}

Lattice Lattice::orthorhombic(double x, double y, double z) {
    return Lattice(Vec3(x, 0, 0), Vec3(0, y, 0), Vec3(0, 0, z));
}

namespace {

/** Adds to column `from` what multiples of column d it takes for its entry d to be reduced. */
void reduce(Matrix3& v, int from, int d) {
    const Vec3 edge = v.col(d);
    double& x = v(d, from);
    if (std::fabs(x) > edge[d])
        v.col(from) -= edge * std::nearbyint(x / edge[d]);
    // compared as OpenMM compares, and exact: subtraction of numbers within a factor of two
    while (2 * x > edge[d])
        v.col(from) -= edge;
    while (2 * x < -edge[d])
        v.col(from) += edge;
}

} // namespace

Lattice Lattice::sheared(double strain) const {
    Matrix3 v = boxVectors;
    for (int d = 1; d < 3; d++) {
        v(0, d) += strain * v(1, d);
        reduce(v, d, 0);
    }
    return Lattice(v.col(0), v.col(1), v.col(2));
}

std::array<int, 2> Lattice::flips(double strain) const {
    const Matrix3 after = sheared(strain).vectors();
    std::array<int, 2> count;
    for (int d = 1; d < 3; d++) {
        const double taken = boxVectors(0, d) + strain * boxVectors(1, d) - after(0, d);
        count[d - 1] = static_cast<int>(std::nearbyint(taken / boxVectors(0, 0)));
    }
    return count;
}

Lattice Lattice::deformed(const Matrix3& map) const {
    Matrix3 v = map.triangularView<Eigen::Upper>() * boxVectors;
    v(1, 0) = v(2, 0) = v(2, 1) = 0;
    reduce(v, 2, 1);
    reduce(v, 2, 0);
    reduce(v, 1, 0);
    return Lattice(v.col(0), v.col(1), v.col(2));
}

Lattice Lattice::mostSheared() const {
    Matrix3 v = boxVectors;
    for (int d = 1; d < 3; d++)
        if (v(1, d) != 0)
            v(0, d) = 0.5 * v(0, 0);
    return Lattice(v.col(0), v.col(1), v.col(2));
}

Lattice Lattice::scaled(double factor) const {
    const Matrix3 v = factor * boxVectors;
    return Lattice(v.col(0), v.col(1), v.col(2));
}

double Lattice::smallestWidth() const {
    return boxVectors.diagonal().minCoeff();
}

Vec3 Lattice::wrappedFractional(const Vec3& x) const {
    Vec3 s = fractional(x);
    for (int d = 0; d < 3; d++) {
        s[d] -= std::floor(s[d]);
        if (s[d] >= 1) // a tiny negative number rounds up to 1
            s[d] = 0;
    }
    return s;
}

Vec3 Lattice::minimumImage(Vec3 d) const {
    for (int axis = 2; axis >= 0; axis--)
        d -= boxVectors.col(axis) * std::floor(d[axis] / boxVectors(axis, axis) + 0.5);
    return d;
}

double Lattice::imageCandidates(double range) const {
    double count = 1;
    for (int d = 0; d < 3; d++)
        count *= 2 * std::floor(range * inverse.row(d).norm() + 1) + 1;
    return count;
}

std::vector<Vec3> Lattice::imagesWithin(double range) const {
    // |d + R| <= range needs |R| <= range + |d|, and n_d = (R . reciprocal vector d) is bounded by
    // that length.
    const double reach =
        range + boxVectors.col(0).norm() + boxVectors.col(1).norm() + boxVectors.col(2).norm();
    int limit[3];
    // fractional differences are below 1, so images beyond this are out of range
    for (int d = 0; d < 3; d++)
        limit[d] = static_cast<int>(std::floor(range * inverse.row(d).norm() + 1));
    std::vector<Vec3> images;
    for (int i = -limit[0]; i <= limit[0]; i++)
        for (int j = -limit[1]; j <= limit[1]; j++)
            for (int k = -limit[2]; k <= limit[2]; k++) {
                const Vec3 image = boxVectors * Vec3(i, j, k);
                if (image.norm() <= reach)
                    images.push_back(image);
            }
    return images;
}

} // namespace PSE::numerics
