// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEFLOW_H_
#define OPENMMPSE_DEVICEFLOW_H_

#include "DeviceArrays.h"
#include "DevicePrograms.h"
#include "numerics/Lattice.h"
#include <vector>

namespace PSE {

/**
 * Undisturbed shear flow on a device [T35]: particles that it carries, and the box that tilts with
 * it. OpenMM keeps one image of each particle there, and by how many box vectors it is away from
 * the particle itself: these images lie in a tilting box, too.
 */
class DeviceFlow {
public:
    explicit DeviceFlow(DevicePrograms& programs);
    /**
     * Carry particles that have made a step.
     * @param strain  of the step
     * @param dt      of the step (ps), which velocities shall account for
     * @param box     before the step
     */
    void carry(double strain, double dt, const numerics::Lattice& box);
    /** Tilt the box of the Context; no particle moves, whatever becomes of the box vectors. */
    void tilt(double strain, const numerics::Lattice& box);

private:
    void followImages(const numerics::Lattice& box);

    OpenMM::ComputeContext& context;
    std::vector<OpenMM::mm_int4> imagesSeen; ///< box vectors from each particle to its image
    OpenMM::ComputeArray lifts;
    DeviceKernel carryAlong;
};

} // namespace PSE

#endif
