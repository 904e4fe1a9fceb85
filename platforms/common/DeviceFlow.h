// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEFLOW_H_
#define OPENMMPSE_DEVICEFLOW_H_

#include "DeviceImages.h"
#include "DevicePrograms.h"

namespace PSE {

/**
 * Undisturbed shear flow on a device [T35]: particles that it carries, and the box that tilts with
 * it. The images that OpenMM keeps of particles lie in a tilting box, too.
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
    OpenMM::ComputeContext& context;
    DeviceImages images;
    DeviceKernel carryAlong;
};

} // namespace PSE

#endif
