// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NEIGHBOURLISTKEEPER_H_
#define OPENMMPSE_NEIGHBOURLISTKEEPER_H_

#include "openmm/Vec3.h"
#include "openmm/cpu/CpuPlatform.h"
#include <array>
#include <vector>

namespace PSE {

/**
 * Makes the neighbour list of OpenMM's CPU platform follow a box that moves. OpenMM makes its list
 * anew when particles have moved, and compares their unwrapped positions for it: images that come
 * nearer because the box has changed go unnoticed. From the first change of the box on, the list is
 * made anew here: whenever the box changes, and whenever a particle has moved by a quarter of the
 * list's margin since. A list of OpenMM's own in between, at positions within a quarter of the
 * margin too, is then good for all pairs: two particles move by four quarters at most against each
 * other. Without a change of the box nothing happens.
 */
class NeighbourListKeeper {
public:
    explicit NeighbourListKeeper(OpenMM::CpuPlatform::PlatformData& data) : data(data) {}
    void follow(const std::vector<OpenMM::Vec3>& positions, const OpenMM::Vec3* boxVectors);

private:
    using Box = std::array<OpenMM::Vec3, 3>;
    bool movedFar(const std::vector<OpenMM::Vec3>& positions) const;
    void makeList(const std::vector<OpenMM::Vec3>& positions, const Box& box);

    OpenMM::CpuPlatform::PlatformData& data;
    bool boxSeen = false, boxMoved = false;
    Box lastBox;
    std::vector<OpenMM::Vec3> lastPositions; ///< when the list was made here
};

} // namespace PSE

#endif
