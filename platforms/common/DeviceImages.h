// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEIMAGES_H_
#define OPENMMPSE_DEVICEIMAGES_H_

#include "DeviceArrays.h"
#include "numerics/Lattice.h"
#include <vector>

namespace PSE {

/**
 * Where a Force has a cutoff, OpenMM's devices keep particles as images within the box, and by how
 * many box vectors each is away from the particle itself.
 */
class DeviceImages {
public:
    explicit DeviceImages(OpenMM::ComputeContext& context) : context(context) {}
    /**
     * To be called before shifts() are used.
     * @param box  its vectors of now as columns; rows that do not matter may be zero
     */
    void follow(const numerics::Matrix3& box);
    /** From each particle to its image (nm), by slot, as vectors of four mixed numbers. */
    OpenMM::ComputeArray& shifts() { return array; }

private:
    OpenMM::ComputeContext& context;
    std::vector<OpenMM::mm_int4> imagesSeen;
    numerics::Matrix3 boxSeen;
    OpenMM::ComputeArray array;
};

} // namespace PSE

#endif
