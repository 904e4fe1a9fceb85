// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_PAIRAPPROACH_H_
#define OPENMMPSE_NUMERICS_PAIRAPPROACH_H_

#include "numerics/Lattice.h"
#include <optional>

namespace PSE::numerics {

/**
 * How near pairs of particles, with all their images, may have come since some moment, in a box
 * that moves [T50]: for lists of pairs that are used longer than they are exact.
 */
class PairApproach {
public:
    /** That moment is now. Positions (nm) are not wrapped. */
    void start(const std::vector<Vec3>& positions, const Lattice& box);
    void forget() { startBox.reset(); }
    /**
     * A distance (nm) that no pair falls below that was farther apart than `range` then; 0 if there
     * was no such moment, or for another number of particles. Positions must not have been wrapped
     * since.
     */
    double nearest(double range, const std::vector<Vec3>& positions, const Lattice& box);

private:
    std::optional<Lattice> startBox;
    std::vector<Vec3> startPositions;
    std::vector<Vec3> ways; ///< what remains of the displacements without the change of the box
};

} // namespace PSE::numerics

#endif
