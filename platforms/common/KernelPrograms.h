// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_KERNELPROGRAMS_H_
#define OPENMMPSE_KERNELPROGRAMS_H_

#include "openmm/common/ComputeContext.h"
#include <map>
#include <string>

namespace PSE {

/**
 * The only way in which this package compiles device code. The name tells programs apart in error
 * messages and dumps; `defines` become the preprocessor's.
 *
 * If the environment variable OPENMMPSE_KERNEL_DUMP names a folder, the program is also written
 * there, in a file of its own for every (name, precision, shape of box, defines): what runs on one
 * platform can then be compiled for another without its device (tests/nvrtc.py).
 */
OpenMM::ComputeProgram compileKernels(OpenMM::ComputeContext& context, const std::string& name,
                                      const std::string& source,
                                      const std::map<std::string, std::string>& defines);

} // namespace PSE

#endif
