// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_PSEKERNELS_H_
#define OPENMMPSE_PSEKERNELS_H_

#include "openmmpse/PSEBrownianIntegrator.h"
#include "openmmpse/internal/Scene.h"
#include "openmm/KernelImpl.h"
#include "openmm/Platform.h"
#include "openmm/System.h"
#include "openmm/internal/ContextImpl.h"

namespace PSE {

/** What a platform must be able to do for PSEBrownianIntegrator. */
class IntegratePSEStepKernel : public OpenMM::KernelImpl {
public:
    static std::string Name() { return "IntegratePSEStep"; }
    IntegratePSEStepKernel(std::string name, const OpenMM::Platform& platform)
        : OpenMM::KernelImpl(name, platform) {}

    /**
     * Make the Plan and everything that depends on it. Throws if the scene cannot be simulated as
     * asked.
     */
    virtual void initialize(OpenMM::ContextImpl& context, const PSEBrownianIntegrator& integrator,
                            const Scene& scene) = 0;
    /**
     * Positions were set by something other than a step: by the Context (setPositions, a State, a
     * checkpoint, the minimizer) or by a Force (a barostat, which may change the box too). A
     * platform that keeps what it derived from the positions, or its check of them, makes it anew;
     * a change of the box alone is not told.
     */
    virtual void positionsChanged() {}
    /** Throw, naming the first non-finite position, before any Force sees it. */
    virtual void checkPositions(OpenMM::ContextImpl& context) = 0;
    /**
     * Advance the positions by one step; forces have been computed. Nothing is changed if it
     * throws.
     */
    virtual void execute(OpenMM::ContextImpl& context, const PSEBrownianIntegrator& integrator) = 0;
    virtual double computeKineticEnergy(OpenMM::ContextImpl& context) = 0;
    /** forces (kJ/(mol nm)) -> velocities (nm/ps) */
    virtual std::vector<OpenMM::Vec3> applyMobility(OpenMM::ContextImpl& context,
                                                    const std::vector<OpenMM::Vec3>& forces) = 0;
    virtual std::vector<OpenMM::Vec3>
    sampleBrownianDisplacements(OpenMM::ContextImpl& context,
                                const PSEBrownianIntegrator& integrator, int count) = 0;
    virtual NumericalParameters getNumericalParameters() const = 0;
    /** What each stage of the steps so far has cost; empty before the first step. */
    virtual std::vector<StageTime> getStageTimes() const = 0;
    virtual void createCheckpoint(std::ostream& stream) const = 0;
    virtual void loadCheckpoint(std::istream& stream) = 0;
    /**
     * Thermal steps taken and samples drawn so far: with the seed, all the state there is besides
     * the positions.
     */
    virtual void getCounters(unsigned long long& step, unsigned long long& sample) const = 0;
    virtual void setCounters(unsigned long long step, unsigned long long sample) = 0;
};

} // namespace PSE

#endif
