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
 * made anew here as soon as a pair that is not on it might have come within the cut-off, whether or
 * not OpenMM has made one in between. Without a change of the box nothing happens.
 */
class NeighbourListKeeper {
public:
    explicit NeighbourListKeeper(OpenMM::CpuPlatform::PlatformData& data) : data(data) {}
    void follow(const std::vector<OpenMM::Vec3>& positions, const OpenMM::Vec3* boxVectors);

private:
    using Box = std::array<OpenMM::Vec3, 3>;
    bool stillServes(const std::vector<OpenMM::Vec3>& positions, const Box& box);
    void makeList(const std::vector<OpenMM::Vec3>& positions, const Box& box);

    OpenMM::CpuPlatform::PlatformData& data;
    bool boxSeen = false, boxMoved = false;
    Box lastBox, listBox;
    std::vector<OpenMM::Vec3> listPositions; ///< when the list was made here, in listBox
    double largestStrain = 0,
           largestWay = 0; ///< since then: of the box, and of particles beyond it
};

} // namespace PSE

#endif
