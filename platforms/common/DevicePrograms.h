// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEPROGRAMS_H_
#define OPENMMPSE_DEVICEPROGRAMS_H_

#include "KernelPrograms.h"
#include "openmm/common/ComputeArray.h"
#include "openmm/common/FFT3D.h"
#include <array>
#include <map>
#include <string>

namespace PSE {

using Defines = std::map<std::string, std::string>;

/**
 * What takes long to make and outlives a Plan: programs, and the transform of the last grid. A
 * change of the box then makes new arrays alone.
 */
class DevicePrograms {
public:
    explicit DevicePrograms(OpenMM::ComputeContext& context) : device(context) {}
    OpenMM::ComputeContext& context() const { return device; }

    /**
     * kernels/particles.cc, with what it builds upon.
     * @param groups  sorted also by size
     */
    OpenMM::ComputeProgram particles(bool groups = false);
    /** kernels/realSpace.cc; `defines` may have MIXTURE, for unequal spheres */
    OpenMM::ComputeProgram realSpace(const Defines& defines, const PlanConstants& constants);
    /** kernels/unbounded.cc */
    OpenMM::ComputeProgram unbounded(const Defines& defines);
    /** kernels/waves.cc with kernels/waveSpace.cc, or for unequal spheres with sphereSpread.cc */
    OpenMM::ComputeProgram waveSpace(const PlanConstants& constants);
    OpenMM::ComputeProgram sphereSpread(const PlanConstants& constants);
    /** From reals to half of their modes, and back. */
    OpenMM::FFT3D transform(const std::array<int, 3>& grid);
    /** To be called before programs, arrays and contexts end. */
    void clear();

private:
    OpenMM::ComputeProgram program(const std::string& name, const std::string& source,
                                   Defines defines, const PlanConstants& constants);

    OpenMM::ComputeContext& device;
    std::map<std::string, OpenMM::ComputeProgram> programs;
    std::array<int, 3> gridOfTransform = {0, 0, 0};
    OpenMM::FFT3D lastTransform;
};

/** The constants as kernels take them. */
void uploadConstants(OpenMM::ComputeArray& array, OpenMM::ComputeContext& context,
                     const PlanConstants& constants);

} // namespace PSE

#endif
