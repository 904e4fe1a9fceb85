// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICESPHERES_H_
#define OPENMMPSE_DEVICESPHERES_H_

#include "DevicePlaces.h"
#include "DevicePrograms.h"
#include "numerics/Plan.h"
#include <functional>

namespace PSE {

/** What both halves need to know of unequal spheres, by place. */
class DeviceSpheres {
public:
    /** @param mobile  indices in the System, in the order of the Plan's mixture */
    DeviceSpheres(DevicePrograms& programs, const numerics::Plan& plan, int particles,
                  const std::vector<int>& mobile, DevicePlaces& places);
    /** Follow the places. */
    void update();
    /** Index among the mixture's distinct radii. */
    OpenMM::ComputeArray& kinds() { return kindAt; }
    OpenMM::ComputeArray& radii() { return radiusAt; } ///< in the Plan's unit

    static double bytesPerParticle(int realSize) { return 2.0 * sizeof(int) + 2 * realSize; }

private:
    DevicePlaces& places;
    OpenMM::ComputeArray kindOf, distinct, kindAt, radiusAt;
    DeviceKernel placeSpheres;
};

/** Call work(i) for all i < count, on all threads of the context's pool. */
void forEach(OpenMM::ComputeContext& context, int count, const std::function<void(int)>& work);

} // namespace PSE

#endif
