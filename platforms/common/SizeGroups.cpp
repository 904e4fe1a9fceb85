// SPDX-License-Identifier: MIT
#include "SizeGroups.h"
#include <algorithm>
#include <cmath>
#include <map>

using namespace PSE::numerics;

namespace PSE {

namespace {
constexpr int MOST_GROUPS = 8; ///< the last one takes whatever is larger
/// a factor of two in size, with what rounding does to its powers
constexpr double OCTAVE = 2 * (1 + 1e-9);
} // namespace

SizeGroups::SizeGroups(const Plan& plan) {
    const std::vector<double>& radii = plan.mixture->particleRadii();
    const double smallest = plan.mixture->radii().front();
    const auto octaveOf = [&](double a) {
        return std::min(MOST_GROUPS - 1,
                        static_cast<int>(std::log(a / smallest) / std::log(OCTAVE)));
    };
    std::map<int, Group> octaves;
    for (double a : radii) {
        Group& group = octaves[octaveOf(a)]; // zeros at first
        group.largest = std::max(group.largest, a);
        group.count++;
    }
    std::map<int, int> numbers;
    for (auto& [octave, group] : octaves) {
        group.range = plan.a * plan.mixture->range(group.largest, group.largest);
        numbers[octave] = size();
        groups.push_back(group);
    }
    for (double a : radii)
        groupOf.push_back(numbers[octaveOf(a)]);
}

double SizeGroups::neighbours(int group, const Plan& plan, const Lattice& box) const {
    double sum = 0;
    for (const Group& other : groups)
        sum += meanNeighbours(box, other.count,
                              plan.a * plan.mixture->range(groups[group].largest, other.largest));
    return sum;
}

} // namespace PSE
