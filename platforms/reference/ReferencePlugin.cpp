// SPDX-License-Identifier: MIT
#include "HostStepKernel.h"
#include "Memory.h"
#include "ReferenceEngine.h"
#include "ReferenceFreeDraining.h"
#include "ReferenceUnbounded.h"
#include "openmm/KernelFactory.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/windowsExport.h"
#include <limits>

using namespace OpenMM;

namespace PSE {

namespace {

class ReferenceEngineFactory : public EngineFactory {
public:
    void adapt(numerics::PlanRequest& request) const override {
        request.singleFloor = std::numeric_limits<double>::infinity();
        request.directSums = true;
        request.overrides.lanczosTolerance = ReferenceEngine::LANCZOS_TOLERANCE;
    }
    std::unique_ptr<MobilityEngine> create(const numerics::Plan& plan, const numerics::Lattice& box,
                                           double viscosity, const std::vector<int>& indices,
                                           StageClock& clock) const override {
        // One mode of 48 bytes for every two grid points, one pair of 56 for two ordered ones.
        requireMemory(plan, box, indices.size(), {24, 28});
        return std::unique_ptr<MobilityEngine>(
            new ReferenceEngine(plan, box, viscosity, indices, clock));
    }
    std::unique_ptr<MobilityEngine> createFreeDraining(double viscosity,
                                                       const std::vector<double>& radii,
                                                       const std::vector<int>& indices,
                                                       StageClock& clock) const override {
        return std::unique_ptr<MobilityEngine>(
            new ReferenceFreeDraining(viscosity, radii, indices, clock));
    }
    void adapt(numerics::UnboundedRequest& request) const override {
        request.lanczosTolerance = ReferenceEngine::LANCZOS_TOLERANCE;
    }
    std::unique_ptr<MobilityEngine> createUnbounded(const numerics::UnboundedPlan& plan,
                                                    const std::vector<double>& radii,
                                                    double viscosity,
                                                    const std::vector<int>& indices,
                                                    StageClock& clock) const override {
        // positions, radii, noise and two velocities besides
        requireMemory(indices.size(), sizeof(numerics::Vec3), 5 * sizeof(numerics::Vec3));
        return std::unique_ptr<MobilityEngine>(
            new ReferenceUnbounded(plan, radii, viscosity, indices, clock));
    }
};

class ReferenceKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform,
                                 ContextImpl& context) const override {
        auto& data = *static_cast<ReferencePlatform::PlatformData*>(context.getPlatformData());
        return new HostStepKernel(name, platform, data,
                                  std::unique_ptr<EngineFactory>(new ReferenceEngineFactory()));
    }
};

} // namespace

} // namespace PSE

extern "C" OPENMM_EXPORT void registerPlatforms() {}

extern "C" OPENMM_EXPORT void registerKernelFactories() {
    // By name: the CPU platform is a ReferencePlatform too, and has a plugin of its own.
    for (int i = 0; i < Platform::getNumPlatforms(); i++)
        if (Platform::getPlatform(i).getName() == "Reference")
            Platform::getPlatform(i).registerKernelFactory(PSE::IntegratePSEStepKernel::Name(),
                                                           new PSE::ReferenceKernelFactory());
}
