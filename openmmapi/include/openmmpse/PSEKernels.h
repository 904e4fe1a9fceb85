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

/** What the next step depends on, besides positions, box, time, seed and settings. */
struct StepState {
    unsigned long long step = 0, sample = 0; ///< thermal steps taken, samples drawn
    double strain = 0;                       ///< of all sheared steps so far
    /// What the Plan was made for: a box (zero vectors: no Plan), whether it moves, how much shorter
    /// it may become, as a factor, and whether there was noise
    OpenMM::Vec3 plannedBox[3];
    bool plannedToMove = false;
    double plannedShortest = 1;
    bool plannedThermal = true;
    /// The box of the last step: whether the next one is a small change of it counts from there
    OpenMM::Vec3 lastBox[3];
};

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
    /** The same, by the Context: a run ends here, and the next step begins another one. */
    virtual void positionsSet() { positionsChanged(); }
    /** Throw, naming the first non-finite position, before any Force sees it. */
    virtual void checkPositions(OpenMM::ContextImpl& context) = 0;
    /** Have the forces of a step computed. @param groups  force groups, as bits */
    virtual void computeForces(OpenMM::ContextImpl& context, int groups) {
        context.calcForcesAndEnergy(true, false, groups);
    }
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
    /**
     * The rows of the stress of the particles (kJ/(mol nm^3)); everything is left as it is, even if
     * it throws.
     * @param parts   what to add up: bits of PSEBrownianIntegrator::StressPart
     * @param groups  force groups, as bits
     */
    virtual std::vector<OpenMM::Vec3> computeStress(OpenMM::ContextImpl& context,
                                                    const PSEBrownianIntegrator& integrator,
                                                    int parts, int groups) = 0;
    virtual NumericalParameters getNumericalParameters() const = 0;
    /** What each stage of the steps so far has cost; empty before the first step. */
    virtual std::vector<StageTime> getStageTimes() const = 0;
    virtual void createCheckpoint(std::ostream& stream) const = 0;
    virtual void loadCheckpoint(std::istream& stream) = 0;
    virtual StepState getStepState() const = 0;
    /** StepState::strain alone. */
    virtual double getStrain() const = 0;
    /** Go on from there; the box of the Context is already the one that belongs to it. */
    virtual void setStepState(const StepState& state) = 0;
    /**
     * @throws OpenMMException naming what keeps this platform from shearing this Context, and the
     * remedy
     */
    virtual void requireShear(OpenMM::ContextImpl&) const {}
};

} // namespace PSE

#endif
