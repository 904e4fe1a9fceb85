// SPDX-License-Identifier: MIT
#include "DeviceSpheres.h"
#include "openmm/internal/ThreadPool.h"
#include <algorithm>
#include <atomic>

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

DeviceSpheres::DeviceSpheres(DevicePrograms& programs, const Plan& plan, int particles,
                             const std::vector<int>& mobile, DevicePlaces& places)
    : places(places) {
    ComputeContext& context = programs.context();
    const std::vector<double>& radii = plan.mixture->radii();
    std::vector<int> kind(particles, 0);
    for (size_t i = 0; i < mobile.size(); i++)
        kind[mobile[i]] = static_cast<int>(
            std::lower_bound(radii.begin(), radii.end(), plan.mixture->particleRadii()[i]) -
            radii.begin());
    kindOf.initialize<int>(context, particles, "pseKindOf");
    kindOf.upload(kind);
    uploadReals(distinct, context, radii, "pseRadii");
    kindAt.initialize<int>(context, places.count(), "pseKinds");
    radiusAt.initialize(context, places.count(), realSize(context), "pseRadiusAt");
    placeSpheres = DeviceKernel(context, programs.particles(true), "placeSpheres");
}

void DeviceSpheres::update() {
    placeSpheres(places.count(), places.count(), places.places(), kindOf, distinct, kindAt,
                 radiusAt);
}

void forEach(ComputeContext& context, int count, const std::function<void(int)>& work) {
    std::atomic<int> next(0);
    context.getThreadPool().execute([&](ThreadPool&, int) {
        for (int i = next++; i < count; i = next++)
            work(i);
    });
    context.getThreadPool().waitForThreads();
}

} // namespace PSE
