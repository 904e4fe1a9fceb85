// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NEIGHBOURLISTKEEPER_H_
#define OPENMMPSE_NEIGHBOURLISTKEEPER_H_

#include "numerics/PairApproach.h"
#include "openmm/Vec3.h"
#include "openmm/cpu/CpuPlatform.h"
#include <functional>
#include <vector>

namespace PSE {

/**
 * Keeps the neighbour list of OpenMM's CPU platform in a box that moves. OpenMM makes its list anew
 * when particles have moved by half its padding, and compares unwrapped positions for it: images
 * that come nearer because the box has changed go unnoticed, and in a flow all particles move far,
 * though together. From the first change of the box on, or from the start where steps tilt it, the
 * list of a step is made here, when a pair that is not on it might have come within the cut-off
 * [T50], and OpenMM's own test is suspended by the padding that it sees: infinite during a step, so
 * that it never makes a list, and none outside of steps, so that it makes one for every other
 * evaluation. Without a change of the box nothing happens.
 */
class NeighbourListKeeper {
public:
    explicit NeighbourListKeeper(OpenMM::CpuPlatform::PlatformData& data) : data(data) {}
    /**
     * Evaluate the Forces of a step, with a list that fits.
     * @param boxVectors  three
     * @param moves       the box will move, if it has not yet: a restart has to know
     */
    void evaluate(const std::vector<OpenMM::Vec3>& positions, const OpenMM::Vec3* boxVectors,
                  bool moves, const std::function<void()>& forces);
    /**
     * Positions or box have changed: where nothing moves before the next evaluation, OpenMM makes
     * no list, whatever padding it sees.
     */
    void follow(const std::vector<OpenMM::Vec3>& positions, const OpenMM::Vec3* boxVectors);
    /** Make a list for the next step, as a new Context will that goes on from a checkpoint. */
    void startAnew();
    /** How many lists were made here. */
    long long listsMade() const { return lists; }

private:
    bool follows() const;
    /** Whether the list is the one made here last. */
    bool isOurs() const;
    void makeList(const std::vector<OpenMM::Vec3>& positions, const OpenMM::Vec3* boxVectors);
    /** To the number of steps that the last list has served. */
    void adaptPadding();

    OpenMM::CpuPlatform::PlatformData& data;
    numerics::PairApproach approach;
    std::vector<numerics::Vec3> places; ///< kept, because large arrays are dear to allocate
    OpenMM::Vec3 lastBox[3];            ///< of a step
    bool boxSeen = false, boxMoved = false;
    double openmmPadding = 0; ///< what Forces asked for (nm)
    double padding = 0;       ///< of the next list
    double range = 0;         ///< of the present one: cut-off and padding
    long long lists = 0;
    int uses = 0; ///< of the present list
};

} // namespace PSE

#endif
