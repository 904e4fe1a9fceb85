// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_KERNELPROGRAMS_H_
#define OPENMMPSE_KERNELPROGRAMS_H_

#include "openmm/common/ComputeContext.h"
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace PSE {

/**
 * Numbers of a Plan that kernels know as macros. On GPUs they are compiled in, so that loops
 * unroll. Where the device is a processor, on which each compilation takes seconds, they are
 * entries of the argument `plan` instead: one program serves all Plans.
 */
using PlanConstants = std::vector<std::pair<std::string, int>>;

/**
 * The only way in which this package compiles device code. The name tells programs apart in error
 * messages and dumps; `defines` and `constants` become the preprocessor's.
 *
 * If the environment variable OPENMMPSE_KERNEL_DUMP names a folder, the program is also written
 * there, as a GPU would compile it, in a file of its own for every (name, precision, shape of box,
 * defines): what runs on one platform can then be compiled for another without its device
 * (tests/nvrtc.py).
 */
OpenMM::ComputeProgram compileKernels(OpenMM::ComputeContext& context, const std::string& name,
                                      const std::string& source,
                                      const std::map<std::string, std::string>& defines,
                                      const PlanConstants& constants = {});

} // namespace PSE

#endif
