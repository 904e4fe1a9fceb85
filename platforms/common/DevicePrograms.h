// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEPROGRAMS_H_
#define OPENMMPSE_DEVICEPROGRAMS_H_

#include "KernelPrograms.h"
#include "openmm/common/ComputeArray.h"

namespace PSE {

using Defines = std::map<std::string, std::string>;

/** kernels/particles.cc, with what it builds upon. */
OpenMM::ComputeProgram particleProgram(OpenMM::ComputeContext& context);
/** kernels/realSpace.cc */
OpenMM::ComputeProgram realSpaceProgram(OpenMM::ComputeContext& context, const Defines& defines,
                                        const PlanConstants& constants);
/** kernels/waveSpace.cc */
OpenMM::ComputeProgram waveSpaceProgram(OpenMM::ComputeContext& context,
                                        const PlanConstants& constants);
/** The constants as kernels take them. */
void uploadConstants(OpenMM::ComputeArray& array, OpenMM::ComputeContext& context,
                     const PlanConstants& constants);

} // namespace PSE

#endif
