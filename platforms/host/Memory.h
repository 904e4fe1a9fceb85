// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_MEMORY_H_
#define OPENMMPSE_MEMORY_H_

#include "numerics/Plan.h"

namespace PSE {

/**
 * Refuse a Plan before anything is allocated for it.
 * @param bytesPerGridPoint  what the platform will allocate
 * @throws OpenMMException naming the memory needed, the memory of the machine and what to change
 */
void requireMemory(const numerics::Plan& plan, double bytesPerGridPoint);

} // namespace PSE

#endif
