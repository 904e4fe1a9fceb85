// SPDX-License-Identifier: MIT
#include "numerics/PairApproach.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

void PairApproach::start(const std::vector<Vec3>& positions, const Lattice& box) {
    startPositions = positions;
    startBox = box;
}

double PairApproach::nearest(double range, const std::vector<Vec3>& positions, const Lattice& box) {
    const size_t count = positions.size();
    if (!startBox || startPositions.size() != count || count == 0)
        return 0;
    const Matrix3 map = box.vectors() * startBox->vectors().inverse();
    ways.resize(count);
    Vec3 mean = Vec3::Zero();
    for (size_t i = 0; i < count; i++) {
        ways[i].noalias() = positions[i] - map * startPositions[i];
        mean += ways[i];
    }
    mean /= double(count);
    if (!mean.allFinite())
        return 0;
    // the two longest: any pair has come nearer by their sum at most
    double longest = 0, second = 0;
    for (const Vec3& way : ways) {
        const double length2 = (way - mean).squaredNorm();
        if (length2 > longest) {
            second = longest;
            longest = length2;
        } else if (length2 > second)
            second = length2;
    }
    // the smallest factor by which the map changes a length
    const Eigen::SelfAdjointEigenSolver<Matrix3> stretches(map.transpose() * map,
                                                           Eigen::EigenvaluesOnly);
    const double smallest = std::sqrt(std::max(0.0, stretches.eigenvalues()[0]));
    return std::max(0.0, smallest * range - std::sqrt(longest) - std::sqrt(second));
}

} // namespace PSE::numerics
