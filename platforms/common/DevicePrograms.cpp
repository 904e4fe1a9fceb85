// SPDX-License-Identifier: MIT
#include "DevicePrograms.h"
#include "DeviceKernel.h"
#include "KernelSources.h"

namespace PSE {

/** The texts that all share, and the program's own. */
OpenMM::ComputeProgram DevicePrograms::program(const std::string& name, const std::string& source,
                                               Defines defines, const PlanConstants& constants) {
    std::string key = name;
    for (const auto& [define, value] : defines)
        key += " " + define + "=" + value;
    if (!device.getIsCPU()) // else one program serves all constants
        for (const auto& [constant, value] : constants)
            key += " " + constant + "=" + std::to_string(value);
    OpenMM::ComputeProgram& made = programs[key];
    defines["GROUP_SIZE"] = std::to_string(GROUP_SIZE);
    if (!made)
        made = compileKernels(device, name,
                              KernelSources::noiseText + KernelSources::fractions +
                                  KernelSources::reductions + source,
                              defines, constants);
    return made;
}

OpenMM::ComputeProgram DevicePrograms::particles(bool groups) {
    return program("particles", KernelSources::particles,
                   groups ? Defines{{"SIZE_GROUPS", "1"}} : Defines{}, {});
}

OpenMM::ComputeProgram DevicePrograms::realSpace(const Defines& defines,
                                                 const PlanConstants& constants) {
    if (defines.count("MIXTURE") > 0)
        return program("sphereRows",
                       KernelSources::displacement + KernelSources::sphereRows +
                           KernelSources::realSpace + KernelSources::lanczos,
                       defines, constants);
    return program("realSpace",
                   KernelSources::displacement + KernelSources::realSpace + KernelSources::lanczos,
                   defines, constants);
}

OpenMM::ComputeProgram DevicePrograms::unbounded(const Defines& defines) {
    return program("unbounded", KernelSources::unbounded + KernelSources::lanczos, defines, {});
}

OpenMM::ComputeProgram DevicePrograms::waveSpace(const PlanConstants& constants) {
    return program("waveSpace", KernelSources::waves + KernelSources::waveSpace, {}, constants);
}

OpenMM::ComputeProgram DevicePrograms::sphereSpread(const PlanConstants& constants) {
    return program("sphereSpread", KernelSources::waves + KernelSources::sphereSpread, {},
                   constants);
}

OpenMM::FFT3D DevicePrograms::transform(const std::array<int, 3>& grid) {
    if (!lastTransform || gridOfTransform != grid) {
        lastTransform = device.createFFT(grid[0], grid[1], grid[2], true);
        gridOfTransform = grid;
    }
    return lastTransform;
}

void DevicePrograms::clear() {
    programs.clear();
    lastTransform.reset();
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
