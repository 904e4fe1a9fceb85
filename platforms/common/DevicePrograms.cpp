// SPDX-License-Identifier: MIT
#include "DevicePrograms.h"
#include "DeviceKernel.h"
#include "KernelSources.h"

namespace PSE {

namespace {

/** One program of the texts that all share and its own. */
OpenMM::ComputeProgram compile(OpenMM::ComputeContext& context, const std::string& name,
                               const std::string& source, Defines defines,
                               const PlanConstants& constants = {}) {
    defines["GROUP_SIZE"] = std::to_string(GROUP_SIZE);
    return compileKernels(context, name,
                          KernelSources::noiseText + KernelSources::fractions +
                              KernelSources::reductions + source,
                          defines, constants);
}

} // namespace

OpenMM::ComputeProgram particleProgram(OpenMM::ComputeContext& context) {
    return compile(context, "particles", KernelSources::particles, {});
}

OpenMM::ComputeProgram realSpaceProgram(OpenMM::ComputeContext& context, const Defines& defines,
                                        const PlanConstants& constants) {
    return compile(context, "realSpace", KernelSources::realSpace, defines, constants);
}

OpenMM::ComputeProgram waveSpaceProgram(OpenMM::ComputeContext& context,
                                        const PlanConstants& constants) {
    return compile(context, "waveSpace", KernelSources::waveSpace, {}, constants);
}

void uploadConstants(OpenMM::ComputeArray& array, OpenMM::ComputeContext& context,
                     const PlanConstants& constants) {
    std::vector<int> values;
    for (const auto& constant : constants)
        values.push_back(constant.second);
    array.initialize<int>(context, values.size(), "psePlan");
    array.upload(values);
}

} // namespace PSE
