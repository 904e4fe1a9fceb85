// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_SIZEGROUPS_H_
#define OPENMMPSE_SIZEGROUPS_H_

#include "numerics/Plan.h"
#include <vector>

namespace PSE {

/**
 * The particles of a mixture in groups of like radii, at most a factor two within each: on a device
 * every group has cells and rows of neighbours of its own, so that a few large spheres do not make
 * the searches of many small ones as wide as theirs.
 */
struct SizeGroups {
    struct Group {
        double largest; ///< radius, in the Plan's unit
        double range;   ///< of its pairs (nm), for which its cells are made
        int count;      ///< particles
    };
    std::vector<Group> groups;
    std::vector<int> groupOf; ///< of each particle, in the order of the mixture

    explicit SizeGroups(const numerics::Plan& plan);
    int size() const { return static_cast<int>(groups.size()); }
    /** Mean number of neighbours of the largest particle of a group. */
    double neighbours(int group, const numerics::Plan& plan, const numerics::Lattice& box) const;
};

} // namespace PSE

#endif
