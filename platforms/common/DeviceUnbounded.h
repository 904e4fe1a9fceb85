// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEUNBOUNDED_H_
#define OPENMMPSE_DEVICEUNBOUNDED_H_

#include "DeviceEngine.h"
#include "DeviceImages.h"
#include "numerics/UnboundedPlan.h"

namespace PSE {

/**
 * The unbounded fluid [T32], by sums over all pairs. Inside, mobilities are in units of
 * 1/(6 pi eta a), a the plan's radius.
 */
class DeviceUnbounded : public DeviceEngine {
public:
    /** @param radii  of the mobile particles (nm) */
    DeviceUnbounded(DevicePrograms& programs, int particles, const std::vector<int>& mobile,
                    const numerics::UnboundedPlan& plan, const std::vector<double>& radii,
                    double viscosity, StageClock& clock);
    void setPositions() override;
    void computeVelocities(bool forced, const Thermal* thermal) override;
    int lanczosIterations() const override { return lanczos.lastIterations(); }

private:
    template <class... Arguments> void withMatrix(DeviceKernel& kernel, Arguments&&... arguments);

    double drag, perRadius; ///< 6 pi eta a, 1/a
    DeviceLanczos lanczos;
    DeviceImages images;
    OpenMM::ComputeArray radius, centres, rests;
    DeviceKernel locateCentres, multiplyAll;
};

} // namespace PSE

#endif
