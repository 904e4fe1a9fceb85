// SPDX-License-Identifier: MIT
#include "DevicePlaces.h"
#include "DevicePrograms.h"
#include <cstdint>

using namespace OpenMM;

namespace PSE {

namespace {

/// Cells along the last box vector per range: thin ones, because the cells of a run follow each
/// other in memory and only its ends are searched in vain.
constexpr int CELLS_PER_RANGE = 4;

/** Numbers of 64 bits: the cell, then the particle, so that no two are equal. */
class KeyTrait : public ComputeSortImpl::SortTrait {
    int getDataSize() const override { return sizeof(uint64_t); }
    int getKeySize() const override { return sizeof(uint64_t); }
    const char* getDataType() const override { return "mm_ulong"; }
    const char* getKeyType() const override { return "mm_ulong"; }
    const char* getMinKey() const override { return "0"; }
    const char* getMaxKey() const override { return "0xFFFFFFFFFFFFFFFF"; }
    const char* getMaxValue() const override { return "0xFFFFFFFFFFFFFFFF"; }
    const char* getSortKey() const override { return "value"; }
};

/**
 * Columns of cells about as wide as the range; not many more cells than particles, and no first
 * cell.
 */
mm_int4 cellsFor(const numerics::Lattice& box, double range, int particles) {
    int count[3];
    const int most = 2 * particles + 1;
    for (int d = 0; d < 3; d++) {
        const double cells = (d < 2 ? 1 : CELLS_PER_RANGE) * box.width(d) / range;
        count[d] = std::max(1, static_cast<int>(std::min(cells, double(most))));
    }
    while (count[0] > most / count[1])
        for (int d = 0; d < 2; d++)
            count[d] = (count[d] + 1) / 2;
    count[2] = std::min(count[2], std::max(1, most / (count[0] * count[1])));
    return mm_int4(count[0], count[1], count[2], 0);
}

} // namespace

DevicePlaces::DevicePlaces(DevicePrograms& programs, int particles, const std::vector<int>& mobile,
                           const numerics::Lattice& box, double range, StepSummary& summary,
                           std::shared_ptr<const SizeGroups> sizes)
    : context(programs.context()), summary(summary), numParticles(particles),
      numMobile(static_cast<int>(mobile.size())), inCells(range > 0), sizeGroups(std::move(sizes)) {
    const int fraction4Size = 4 * (realIsDouble(context) ? sizeof(uint64_t) : sizeof(uint32_t));
    placeArray.initialize(context, std::max(1, numMobile), fraction4Size, "psePlaces");
    slotAt.initialize<int>(context, std::max(1, numMobile), "pseSlotAt");
    slotOf.initialize<int>(context, std::max(1, particles), "pseSlotOf");
    const ComputeProgram program = programs.particles(sizeGroups != nullptr);
    if (!inCells) {
        particleAt.initialize<int>(context, std::max(1, numMobile), "pseParticleAt");
        if (numMobile > 0)
            particleAt.upload(mobile);
        findSlots = DeviceKernel(context, program, "findSlots");
        placeInOrder = DeviceKernel(context, program, "placeInOrder");
        return;
    }
    chooseCells(box, range);
    std::vector<int> ranks(particles, -1);
    for (int i = 0; i < numMobile; i++)
        ranks[mobile[i]] = i;
    rankOf.initialize<int>(context, particles, "pseRankOf");
    rankOf.upload(ranks);
    located.initialize(context, particles, fraction4Size, "pseLocated");
    keys.initialize<uint64_t>(context, numMobile + 1, "pseKeys");
    cellStart.initialize<int>(context, numCells + 1, "pseCellStart");
    const numerics::Matrix3 inverse = box.vectors().inverse();
    uploadMixed(
        inverseBox, context,
        {inverse(0, 0), inverse(0, 1), inverse(1, 1), inverse(0, 2), inverse(1, 2), inverse(2, 2)},
        "pseInverseBox");
    // Positions may be clustered, so not the sort for uniform keys. The other one guesses the
    // distribution from a few keys, the first among them, and does not bear one far below its guess
    // (what it converts to unsigned is negative then): a first key of zero leaves nothing below.
    sort = context.createSort(new KeyTrait(), numMobile + 1, false);
    locateParticles = DeviceKernel(context, program, "locateParticles");
    placeParticles = DeviceKernel(context, program, "placeParticles");
    findCells = DeviceKernel(context, program, "findCells");
}

void DevicePlaces::chooseCells(const numerics::Lattice& box, double range) {
    if (!sizeGroups) {
        cellCount = cellsFor(box, range, numMobile);
        numCells = cellCount.x * cellCount.y * cellCount.z;
        return;
    }
    std::vector<mm_int4> cells;
    for (const SizeGroups::Group& group : sizeGroups->groups) {
        cells.push_back(cellsFor(box, group.range, group.count));
        cells.back().w = numCells;
        numCells += cells.back().x * cells.back().y * cells.back().z;
    }
    cellsOfGroups.initialize<mm_int4>(context, cells.size(), "pseGroupCells");
    cellsOfGroups.upload(cells);
    groupOf.initialize<int>(context, numMobile, "pseGroupOf");
    groupOf.upload(sizeGroups->groupOf);
}

void DevicePlaces::update() {
    if (inCells)
        sortByCells();
    else
        keepOrder();
}

void DevicePlaces::sortByCells() {
    const auto locate = [this](auto&&... cells) {
        if (context.getUseMixedPrecision())
            locateParticles(numParticles, numParticles, cells..., context.getPosq(),
                            context.getAtomIndexArray(), rankOf, inverseBox, located, keys, slotOf,
                            context.getPosqCorrection());
        else
            locateParticles(numParticles, numParticles, cells..., context.getPosq(),
                            context.getAtomIndexArray(), rankOf, inverseBox, located, keys, slotOf);
    };
    if (sizeGroups)
        locate(groupOf, cellsOfGroups);
    else
        locate(cellCount);
    sort->sort(keys);
    placeParticles(numMobile, numMobile, keys, slotOf, located, placeArray, slotAt,
                   summary.maxima());
    findCells(numCells + 1, numMobile, numCells, keys, cellStart);
}

void DevicePlaces::keepOrder() {
    findSlots(numParticles, numParticles, context.getAtomIndexArray(), slotOf);
    placeInOrder(numMobile, numMobile, particleAt, slotOf, placeArray, slotAt);
}

std::vector<int> DevicePlaces::particles() const {
    std::vector<int> result(numMobile);
    const auto take = [&](auto coordinates) { // four for each place
        placeArray.download(coordinates.data());
        for (int place = 0; place < numMobile; place++)
            result[place] = static_cast<int>(coordinates[4 * place + 3]);
    };
    if (placeArray.getElementSize() == 4 * sizeof(uint64_t))
        take(std::vector<uint64_t>(4 * placeArray.getSize()));
    else
        take(std::vector<uint32_t>(4 * placeArray.getSize()));
    return result;
}

} // namespace PSE
