// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEPROGRAMS_H_
#define OPENMMPSE_DEVICEPROGRAMS_H_

#include "KernelPrograms.h"

namespace PSE {

using Defines = std::map<std::string, std::string>;

/** kernels/particles.cc, with what it builds upon. */
OpenMM::ComputeProgram particleProgram(OpenMM::ComputeContext& context);
/** kernels/realSpace.cc; `defines` are those of the Plan. */
OpenMM::ComputeProgram realSpaceProgram(OpenMM::ComputeContext& context, Defines defines);
/** kernels/waveSpace.cc; `defines` are those of the Plan. */
OpenMM::ComputeProgram waveSpaceProgram(OpenMM::ComputeContext& context, Defines defines);

} // namespace PSE

#endif
