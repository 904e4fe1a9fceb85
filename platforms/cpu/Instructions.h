// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_INSTRUCTIONS_H_
#define OPENMMPSE_INSTRUCTIONS_H_

namespace PSE {

/** Name of the instruction set that the SIMD loops use on this processor, as Highway calls it. */
const char* instructionSet();

} // namespace PSE

#endif
