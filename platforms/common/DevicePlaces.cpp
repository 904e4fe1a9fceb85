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

/** Not many more than particles: an empty cell costs as much as a particle. */
int mostCells(int particles) {
    return 2 * particles + 1;
}

/**
 * Columns of cells about as wide as the range, at most mostCells() of them, and no first cell.
 */
mm_int4 cellsFor(const numerics::Lattice& box, double range, int particles) {
    int count[3];
    const int most = mostCells(particles);
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

/** What a float leaves of it. */
double restOf(double value) {
    const volatile float rounded =
        static_cast<float>(value); // GCC 12 makes zeros of pairs of these
    return value - rounded;
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
    std::vector<int> ranks(particles, -1);
    for (int i = 0; i < numMobile; i++)
        ranks[mobile[i]] = i;
    rankOf.initialize<int>(context, particles, "pseRankOf");
    rankOf.upload(ranks);
    located.initialize(context, particles, fraction4Size, "pseLocated");
    keys.initialize<uint64_t>(context, numMobile + 1, "pseKeys");
    prepareCells();
    setBox(box, range);
    // Positions may be clustered, so not the sort for uniform keys. The other one guesses the
    // distribution from a few keys, the first among them, and does not bear one far below its guess
    // (what it converts to unsigned is negative then): a first key of zero leaves nothing below.
    sort = context.createSort(new KeyTrait(), numMobile + 1, false);
    locateParticles = DeviceKernel(context, program, "locateParticles");
    placeParticles = DeviceKernel(context, program, "placeParticles");
    findCells = DeviceKernel(context, program, "findCells");
}

/** Room for the cells of every box. */
void DevicePlaces::prepareCells() {
    int most = 0;
    if (sizeGroups) {
        for (const SizeGroups::Group& group : sizeGroups->groups)
            most += mostCells(group.count);
        cellsOfGroups.initialize<mm_int4>(context, sizeGroups->size(), "pseGroupCells");
        groupOf.initialize<int>(context, numMobile, "pseGroupOf");
        groupOf.upload(sizeGroups->groupOf);
    } else
        most = mostCells(numMobile);
    cellStart.initialize<int>(context, most + 1, "pseCellStart");
}

void DevicePlaces::setBox(const numerics::Lattice& box, double range) {
    inverseBox = box.vectors().inverse();
    if (!sizeGroups) {
        cellCount = cellsFor(box, range, numMobile);
        numCells = cellCount.x * cellCount.y * cellCount.z;
        return;
    }
    std::vector<mm_int4> cells;
    numCells = 0;
    for (const SizeGroups::Group& group : sizeGroups->groups) {
        cells.push_back(cellsFor(box, group.range, group.count));
        cells.back().w = numCells;
        numCells += cells.back().x * cells.back().y * cells.back().z;
    }
    const auto equal = [](const mm_int4& a, const mm_int4& b) {
        return a.x == b.x && a.y == b.y && a.z == b.z && a.w == b.w;
    };
    if (std::equal(cells.begin(), cells.end(), cellsInUse.begin(), cellsInUse.end(), equal))
        return; // as in most steps of a box that moves: nothing to wait for
    cellsOfGroups.upload(cells);
    cellsInUse = cells;
}

void DevicePlaces::update() {
    if (inCells)
        sortByCells();
    else
        keepOrder();
}

void DevicePlaces::sortByCells() {
    const numerics::Matrix3& v = inverseBox;
    const Mixed4 inverseX = {v(0, 0), v(0, 1), v(0, 2), 0};
    const Mixed4 inverseYZ = {v(1, 1), v(1, 2), v(2, 2), 0};
    const Real4 restX = {restOf(v(0, 0)), restOf(v(0, 1)), restOf(v(0, 2)), 0};
    const Real4 restYZ = {restOf(v(1, 1)), restOf(v(1, 2)), restOf(v(2, 2)), 0};
    const auto locate = [&](auto&&... cells) {
        if (!mixedIsDouble(context))
            locateParticles(numParticles, numParticles, cells..., context.getPosq(),
                            context.getAtomIndexArray(), rankOf, inverseX, inverseYZ, located, keys,
                            slotOf, restX, restYZ);
        else if (context.getUseMixedPrecision())
            locateParticles(numParticles, numParticles, cells..., context.getPosq(),
                            context.getAtomIndexArray(), rankOf, inverseX, inverseYZ, located, keys,
                            slotOf, context.getPosqCorrection());
        else
            locateParticles(numParticles, numParticles, cells..., context.getPosq(),
                            context.getAtomIndexArray(), rankOf, inverseX, inverseYZ, located, keys,
                            slotOf);
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
