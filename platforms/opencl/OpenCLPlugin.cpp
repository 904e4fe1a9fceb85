// SPDX-License-Identifier: MIT
#include "platforms/common/CommonStepKernel.h"
#include "openmm/opencl/OpenCLContext.h"
#include "openmm/opencl/OpenCLNonbondedUtilities.h"
#include "openmm/KernelFactory.h"
#include "openmm/opencl/OpenCLPlatform.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/windowsExport.h"

using namespace OpenMM;

namespace PSE {

namespace {

class OpenCLKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform,
                                 ContextImpl& context) const override {
        auto& data = *static_cast<OpenCLPlatform::PlatformData*>(context.getPlatformData());
        OpenCLContext& device = *data.contexts[0];
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
        if (Platform::getPlatform(i).getName() == "OpenCL")
            Platform::getPlatform(i).registerKernelFactory(PSE::IntegratePSEStepKernel::Name(),
                                                           new PSE::OpenCLKernelFactory());
}
