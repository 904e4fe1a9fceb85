// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_STRAINEDCONTEXT_H_
#define OPENMMPSE_STRAINEDCONTEXT_H_

#include "numerics/Lattice.h"
#include "openmm/internal/ContextImpl.h"
#include <string>

namespace PSE {

/**
 * Energies of a Context whose box and positions are strained. restore() brings the Context back to
 * what it was, to the bit: positions and the cells they are wrapped from, box, velocities, time,
 * generators of random numbers. The integrator has to see to its own share of checkpoints.
 */
class StrainedContext {
public:
    /** @param groups  force groups whose energy is asked for, as bits */
    StrainedContext(OpenMM::ContextImpl& context, const numerics::Lattice& box, int groups);
    /** In kJ/mol. @throws OpenMMException if a Force has none there */
    double energy(const numerics::Matrix3& map);
    void restore();
    /** Whether energies are sums of numbers in double precision. */
    bool isDouble() const;

private:
    OpenMM::ContextImpl& context;
    const numerics::Lattice box;
    const int groups;
    std::string saved;
    std::vector<OpenMM::Vec3> positions, moved;
};

} // namespace PSE

#endif
