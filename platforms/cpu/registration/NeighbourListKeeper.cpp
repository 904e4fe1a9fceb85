// SPDX-License-Identifier: MIT
#include "NeighbourListKeeper.h"
#include <cmath>

using OpenMM::Vec3;

namespace PSE {

void NeighbourListKeeper::follow(const std::vector<Vec3>& positions, const Vec3* boxVectors) {
    const Box box = {boxVectors[0], boxVectors[1], boxVectors[2]};
    const bool changed = boxSeen && box != lastBox;
    boxSeen = true;
    lastBox = box;
    boxMoved |= changed;
    // without a cut-off the list is one of all pairs
    if (!boxMoved || data.neighborList == NULL || data.cutoff <= 0 || !data.isPeriodic)
        return;
    if (changed || movedFar(positions))
        makeList(positions, box);
}

bool NeighbourListKeeper::movedFar(const std::vector<Vec3>& positions) const {
    if (positions.size() != lastPositions.size())
        return true;
    const double quarter = 0.25 * (data.paddedCutoff - data.cutoff);
    for (size_t i = 0; i < positions.size(); i++) {
        const Vec3 way = positions[i] - lastPositions[i];
        if (way.dot(way) > quarter * quarter)
            return true;
    }
    return false;
}

void NeighbourListKeeper::makeList(const std::vector<Vec3>& positions, const Box& box) {
    // in the primary box, in single precision: as the list wants them, and OpenMM will do it again
    for (size_t i = 0; i < positions.size(); i++) {
        Vec3 x = positions[i];
        for (int d = 2; d >= 0; d--)
            x -= box[d] * std::floor(x[d] / box[d][d]);
        for (int d = 0; d < 3; d++)
            data.posq[4 * i + d] = float(x[d]);
    }
    data.neighborList->computeNeighborList(static_cast<int>(positions.size()), data.posq,
                                           data.exclusions, box.data(), true, data.paddedCutoff,
                                           data.threads);
    lastPositions = positions;
}

} // namespace PSE
