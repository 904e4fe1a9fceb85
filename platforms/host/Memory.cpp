// SPDX-License-Identifier: MIT
#include "Memory.h"
#include "openmm/OpenMMException.h"
#include <sstream>
#include <unistd.h>

namespace PSE {

namespace {
constexpr double GIGABYTE = 1e9;
constexpr double USABLE = 0.8; ///< share of the machine's memory that the grid may take
} // namespace

void requireMemory(const numerics::Plan& plan, double bytesPerGridPoint) {
    const double available = USABLE * sysconf(_SC_PHYS_PAGES) * double(sysconf(_SC_PAGESIZE));
    const double needed = bytesPerGridPoint * plan.gridPoints();
    if (needed <= available)
        return;
    std::ostringstream message;
    message << "PSEBrownianIntegrator: the grid of " << plan.grid[0] << " x " << plan.grid[1]
            << " x " << plan.grid[2] << " points needs " << needed / GIGABYTE << " GB of memory, "
            << available / GIGABYTE << " GB can be used (80 % of the "
            << "machine's); loosen the tolerance, choose a smaller splitting parameter or a "
               "smaller box";
    throw OpenMM::OpenMMException(message.str());
}

} // namespace PSE
