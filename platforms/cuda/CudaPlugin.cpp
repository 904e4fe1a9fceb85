// SPDX-License-Identifier: MIT
#include "platforms/common/CommonStepKernel.h"
#include "openmm/cuda/CudaContext.h"
#include "openmm/cuda/CudaNonbondedUtilities.h"
#include "openmm/KernelFactory.h"
#include "openmm/cuda/CudaPlatform.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/windowsExport.h"

using namespace OpenMM;

namespace PSE {

namespace {

class CudaKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform,
                                 ContextImpl& context) const override {
        auto& data = *static_cast<CudaPlatform::PlatformData*>(context.getPlatformData());
        CudaContext& device = *data.contexts[0];
        // said once more, what is listed by whom; OpenMM then lists it anew
        const auto forgetLists = [&device] {
            device.getNonbondedUtilities().setAtomBlockRange(0, 1);
        };
        return new CommonStepKernel(name, platform, device, int(data.contexts.size()), forgetLists);
    }
};

} // namespace

} // namespace PSE

extern "C" OPENMM_EXPORT void registerPlatforms() {}

extern "C" OPENMM_EXPORT void registerKernelFactories() {
    for (int i = 0; i < Platform::getNumPlatforms(); i++)
        if (Platform::getPlatform(i).getName() == "CUDA")
            Platform::getPlatform(i).registerKernelFactory(PSE::IntegratePSEStepKernel::Name(),
                                                           new PSE::CudaKernelFactory());
}
