// SPDX-License-Identifier: MIT
#include "platforms/common/CommonStepKernel.h"
#include "openmm/opencl/OpenCLContext.h"
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
        return new CommonStepKernel(name, platform, *data.contexts[0], int(data.contexts.size()));
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
