// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEPLACES_H_
#define OPENMMPSE_DEVICEPLACES_H_

#include "DeviceArrays.h"
#include "SizeGroups.h"
#include "StepSummary.h"
#include "openmm/common/ComputeSort.h"
#include "numerics/Lattice.h"
#include <memory>
#include <vector>

namespace PSE {

/**
 * The mobile particles sorted by cells of the box, anew for every step: Brownian steps are so long
 * that a list of neighbours with a skin would hardly outlive one. Their places depend on positions
 * alone.
 */
class DevicePlaces {
public:
    /**
     * @param particles   in the System
     * @param mobile      indices of those that move
     * @param range       of the real-space half, for which cells are made (nm); 0 for no cells:
     * particles then stay in their own order
     * @param sizes       not NULL: particles are sorted by these groups first, each with cells of
     * its own
     */
    DevicePlaces(DevicePrograms& programs, int particles, const std::vector<int>& mobile,
                 const numerics::Lattice& box, double range, StepSummary& summary,
                 std::shared_ptr<const SizeGroups> sizes = nullptr);
    /** As if made for that box; no memory is asked for. */
    void setBox(const numerics::Lattice& box, double range);
    /** Follow the positions of the Context. */
    void update();

    int count() const { return numMobile; }
    const OpenMM::mm_int4& cells() const { return cellCount; }
    OpenMM::ComputeArray& places() { return placeArray; } ///< fractions, index in the System
    OpenMM::ComputeArray& slots() { return slotAt; }      ///< in OpenMM's arrays
    OpenMM::ComputeArray& cellStarts() { return cellStart; }
    const SizeGroups* sizes() const { return sizeGroups.get(); }
    /** Of each size group its cells, and the first of them. */
    OpenMM::ComputeArray& groupCells() { return cellsOfGroups; }
    /** Index in the System of the particle at each place. */
    std::vector<int> particles() const;

private:
    void prepareCells();
    void sortByCells();
    void keepOrder();

    OpenMM::ComputeContext& context;
    StepSummary& summary;
    int numParticles, numMobile;
    bool inCells;
    int numCells = 0; ///< of all groups
    std::vector<OpenMM::mm_int4> cellsInUse;
    numerics::Matrix3 inverseBox;
    std::shared_ptr<const SizeGroups> sizeGroups;
    OpenMM::mm_int4 cellCount = {1, 1, 1, 0};
    OpenMM::ComputeArray rankOf, particleAt, located, keys, slotOf;
    OpenMM::ComputeArray placeArray, slotAt, cellStart, groupOf, cellsOfGroups;
    OpenMM::ComputeSort sort;
    DeviceKernel locateParticles, placeParticles, findCells, findSlots, placeInOrder;
};

} // namespace PSE

#endif
