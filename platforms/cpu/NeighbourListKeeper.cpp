// SPDX-License-Identifier: MIT
#include "NeighbourListKeeper.h"
#include "VectorConversion.h"
#include <algorithm>
#include <cmath>

using namespace PSE::numerics;
using OmmVec3 = OpenMM::Vec3;

namespace PSE {

namespace {

/// Padding, during a step: OpenMM compares squares of it with squares of displacements.
constexpr double ANY_DISTANCE = 1e30;
/// A list is dear: it shall serve so many steps at least, and a wider one is not worth its pairs
/// where it serves many.
constexpr int FEW_USES = 8, MANY_USES = 40;
constexpr double WIDER = 1.3, WIDEST = 3;
/// In units of the box: rounding of coordinates of the list, which are in single precision.
constexpr double ROUNDING = 1e-6;
/// In a slot of the thread's forces that no Force reads: every evaluation sets it to zero.
constexpr float MARK = 2.9e38f;
constexpr int MARKED_SLOT = 3;

} // namespace

bool NeighbourListKeeper::follows() const {
    // without a cut-off the list is one of all pairs
    return boxMoved && data.neighborList != NULL && data.cutoff > 0 && data.isPeriodic;
}

bool NeighbourListKeeper::isOurs() const {
    return !data.threadForce.empty() && data.threadForce[0][MARKED_SLOT] == MARK;
}

void NeighbourListKeeper::evaluate(const std::vector<OmmVec3>& positions, const OmmVec3* boxVectors,
                                   bool moves, const std::function<void()>& forces) {
    boxMoved |= moves;
    for (int d = 0; d < 3; d++)
        boxMoved |= boxSeen && boxVectors[d] != lastBox[d];
    boxSeen = true;
    std::copy(boxVectors, boxVectors + 3, lastBox);
    follow(positions, boxVectors);
    if (!follows() || !isOurs()) {
        forces();
        return;
    }
    uses++;
    data.paddedCutoff = data.cutoff + ANY_DISTANCE;
    try {
        forces();
    } catch (...) {
        data.paddedCutoff = data.cutoff;
        approach.forget();
        throw;
    }
    data.paddedCutoff = data.cutoff;
    data.threadForce[0][MARKED_SLOT] = MARK;
}

void NeighbourListKeeper::follow(const std::vector<OmmVec3>& positions, const OmmVec3* boxVectors) {
    if (!follows())
        return;
    if (openmmPadding == 0)
        openmmPadding = padding = data.paddedCutoff - data.cutoff;
    data.paddedCutoff = data.cutoff;
    const Lattice box(fromOpenMM(boxVectors[0]), fromOpenMM(boxVectors[1]),
                      fromOpenMM(boxVectors[2]));
    places.resize(positions.size());
    std::transform(positions.begin(), positions.end(), places.begin(), fromOpenMM);
    const double rounding = ROUNDING * box.vectors().diagonal().maxCoeff();
    if (isOurs()) {
        if (approach.nearest(range, places, box) >= data.cutoff + rounding)
            return;
        adaptPadding();
    }
    const double widest = std::max(openmmPadding, 0.5 * box.smallestWidth() - data.cutoff);
    range = data.cutoff + std::min(padding, widest);
    approach.forget();
    makeList(positions, boxVectors);
    if (isOurs())
        approach.start(places, box);
}

void NeighbourListKeeper::makeList(const std::vector<OmmVec3>& positions,
                                   const OmmVec3* boxVectors) {
    // in the primary box, in single precision: as the list wants them, and OpenMM will do it again
    data.threadForce[0][MARKED_SLOT] = 0;
    for (size_t i = 0; i < positions.size(); i++) {
        OmmVec3 x = positions[i];
        for (int d = 2; d >= 0; d--)
            x -= boxVectors[d] * std::floor(x[d] / boxVectors[d][d]);
        if (!fromOpenMM(x).allFinite())
            return; // OpenMM will say so
        for (int d = 0; d < 3; d++)
            data.posq[4 * i + d] = float(x[d]);
    }
    data.neighborList->computeNeighborList(static_cast<int>(positions.size()), data.posq,
                                           data.exclusions, boxVectors, true, float(range),
                                           data.threads);
    data.threadForce[0][MARKED_SLOT] = MARK;
    lists++;
    uses = 0;
}

void NeighbourListKeeper::adaptPadding() {
    if (uses == 0)
        return; // positions were set before any step could use it
    if (uses < FEW_USES)
        padding = std::min(padding * WIDER, openmmPadding * WIDEST);
    else if (uses > MANY_USES)
        padding = std::max(padding / WIDER, openmmPadding);
}

void NeighbourListKeeper::startAnew() {
    approach.forget();
    padding = openmmPadding;
    uses = FEW_USES; // says nothing about the padding
}

} // namespace PSE
