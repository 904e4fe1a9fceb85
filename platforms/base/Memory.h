// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_MEMORY_H_
#define OPENMMPSE_MEMORY_H_

#include "numerics/Plan.h"
#include <cstddef>

namespace PSE {

/** What a platform allocates, in bytes. */
struct MemoryUse {
    double perGridPoint;
    double perOrderedPair; ///< per neighbour of a particle within the real-space range
    double perParticle = 0;
};

/** The memory that a Plan has to fit into. */
struct Memory {
    double bytes;
    const char* owner; ///< whose it is: "machine", or "device"
};
Memory machineMemory();

/**
 * Refuse a Plan before anything is allocated for it.
 * @throws OpenMMException naming the memory needed, the memory there is and what to change
 */
void requireMemory(const numerics::Plan& plan, const numerics::Lattice& box, size_t particles,
                   const MemoryUse& use, const Memory& memory = machineMemory());

/// Krylov vectors that an unbounded fluid must have room for; chains of 10,000 take 70.
constexpr int EXPECTED_KRYLOV_VECTORS = 100;

/**
 * The same of an unbounded fluid, which has neither a grid nor lists of neighbours: what it
 * allocates grows with the number of particles alone.
 * @param perVector  bytes of a Krylov vector per particle; perParticle: what there is besides
 */
void requireMemory(size_t particles, double perVector, double perParticle,
                   const Memory& memory = machineMemory());

} // namespace PSE

#endif
