// SPDX-License-Identifier: MIT
#include "Memory.h"
#include "openmm/OpenMMException.h"
#include <sstream>
#include <unistd.h>

namespace PSE {

namespace {
constexpr double GIGABYTE = 1e9;
constexpr double USABLE = 0.8; ///< share of the memory that may be taken
} // namespace

Memory machineMemory() {
    return {sysconf(_SC_PHYS_PAGES) * double(sysconf(_SC_PAGESIZE)), "machine"};
}

void requireMemory(const numerics::Plan& plan, const numerics::Lattice& box, size_t particles,
                   const MemoryUse& use, const Memory& memory) {
    const double available = USABLE * memory.bytes;
    const double grid = use.perGridPoint * plan.gridPoints();
    const double range = plan.realCutoff;
    const double neighbours = numerics::meanNeighbours(plan, box, particles);
    const double pairs = use.perOrderedPair * particles * neighbours;
    const double rest = use.perParticle * particles;
    if (grid + pairs + rest <= available)
        return;
    std::ostringstream message;
    message << "PSEBrownianIntegrator: this scene needs " << grid / GIGABYTE
            << " GB of memory for a grid of " << plan.grid[0] << " x " << plan.grid[1] << " x "
            << plan.grid[2] << " points and " << pairs / GIGABYTE << " GB for the " << neighbours
            << " neighbours (images included) of each particle within " << range << " nm, and "
            << rest / GIGABYTE << " GB besides; " << available / GIGABYTE << " GB can be used ("
            << 100 * USABLE << " % of the " << memory.owner << "'s); ";
    if (grid > pairs)
        message << "loosen the tolerance, choose a smaller splitting parameter or a smaller box";
    else
        message << "use a larger box or fewer particles";
    throw OpenMM::OpenMMException(message.str());
}

void requireMemory(size_t particles, double perVector, double perParticle, const Memory& memory) {
    const double available = USABLE * memory.bytes;
    const double vectors = EXPECTED_KRYLOV_VECTORS * perVector * particles;
    const double rest = perParticle * particles;
    if (vectors + rest <= available)
        return;
    std::ostringstream message;
    message << "PSEBrownianIntegrator: an unbounded fluid of " << particles << " particles needs "
            << vectors / GIGABYTE << " GB of memory for " << EXPECTED_KRYLOV_VECTORS
            << " vectors of the Lanczos process and " << rest / GIGABYTE << " GB besides; "
            << available / GIGABYTE << " GB can be used (" << 100 * USABLE << " % of the "
            << memory.owner << "'s); use fewer particles";
    throw OpenMM::OpenMMException(message.str());
}

} // namespace PSE
