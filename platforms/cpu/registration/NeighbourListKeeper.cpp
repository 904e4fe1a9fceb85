// SPDX-License-Identifier: MIT
#include "NeighbourListKeeper.h"
#include <algorithm>
#include <cmath>

using OpenMM::Vec3;

namespace PSE {

void NeighbourListKeeper::follow(const std::vector<Vec3>& positions, const Vec3* boxVectors) {
    const Box box = {boxVectors[0], boxVectors[1], boxVectors[2]};
    boxMoved |= boxSeen && box != lastBox;
    boxSeen = true;
    lastBox = box;
    // without a cut-off the list is one of all pairs
    if (!boxMoved || data.neighborList == NULL || data.cutoff <= 0 || !data.isPeriodic)
        return;
    if (!stillServes(positions, box))
        makeList(positions, box);
}

/**
 * With A the map from the box of the list to this one and d_i = x_i - A x_i(list), the distance of
 * two particles that were farther apart than R = cut-off + margin in the list is at least
 * R/|A^-1| - 2 |d|; if OpenMM has made a list in between, with A', d', at least
 * (R - 2 |d'|)/|A' A^-1| - 2 |d|. The largest deviations since the list stand for all of them.
 */
bool NeighbourListKeeper::stillServes(const std::vector<Vec3>& positions, const Box& box) {
    if (positions.size() != listPositions.size())
        return false;
    // both boxes are triangular: the images of the unit vectors, one after the other
    Vec3 map[3];
    for (int d = 0; d < 3; d++) {
        map[d] = box[d];
        for (int c = 0; c < d; c++)
            map[d] -= map[c] * listBox[d][c];
        map[d] *= 1 / listBox[d][d];
    }
    double strain = 0, way = 0;
    for (int d = 0; d < 3; d++) {
        Vec3 change = map[d];
        change[d] -= 1;
        strain += change.dot(change);
    }
    for (size_t i = 0; i < positions.size(); i++) {
        const Vec3& x = listPositions[i];
        const Vec3 left = positions[i] - map[0] * x[0] - map[1] * x[1] - map[2] * x[2];
        way = std::max(way, left.dot(left));
    }
    largestStrain = std::max(largestStrain, std::sqrt(strain));
    largestWay = std::max(largestWay, std::sqrt(way));
    const double nearest =
        (data.paddedCutoff - 2 * largestWay) * (1 - largestStrain) / (1 + largestStrain) -
        2 * largestWay;
    return nearest >= data.cutoff;
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
    listPositions = positions;
    listBox = box;
    largestStrain = largestWay = 0;
}

} // namespace PSE
