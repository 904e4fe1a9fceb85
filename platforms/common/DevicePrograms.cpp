// SPDX-License-Identifier: MIT
#include "DevicePrograms.h"
#include "DeviceKernel.h"
#include "KernelSources.h"

namespace PSE {

namespace {

/** One program of the texts that all share and its own. */
OpenMM::ComputeProgram compile(OpenMM::ComputeContext& context, const std::string& name,
                               const std::string& source, Defines defines) {
    defines["GROUP_SIZE"] = std::to_string(GROUP_SIZE);
    return compileKernels(context, name,
                          KernelSources::noiseText + KernelSources::fractions +
                              KernelSources::reductions + source,
                          defines);
}

} // namespace

OpenMM::ComputeProgram particleProgram(OpenMM::ComputeContext& context) {
    return compile(context, "particles", KernelSources::particles, {});
}

OpenMM::ComputeProgram realSpaceProgram(OpenMM::ComputeContext& context, Defines defines) {
    return compile(context, "realSpace", KernelSources::realSpace, defines);
}

OpenMM::ComputeProgram waveSpaceProgram(OpenMM::ComputeContext& context, Defines defines) {
    return compile(context, "waveSpace", KernelSources::waveSpace, defines);
}

} // namespace PSE
