// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_STEPKERNEL_H_
#define OPENMMPSE_STEPKERNEL_H_

// What every platform does alike, wherever its data live: the Plan and its renewal, the keys of the
// noise, checkpoints, and the words of refusals.

#include "StageClock.h"
#include "Thermal.h"
#include "VectorConversion.h"
#include "numerics/Plan.h"
#include "numerics/StepGrowth.h"
#include "numerics/UnboundedPlan.h"
#include "openmmpse/PSEKernels.h"
#include <memory>
#include <optional>

namespace PSE {

/** What is checked for being finite, in the words of its refusal. */
struct CheckedQuantity {
    const char *what, *unit, *remedy;
};
constexpr CheckedQuantity POSITION = {"the position", "nm", "set finite positions"};
constexpr CheckedQuantity FORCE = {
    "the force", "kJ/(mol nm)", "check the Forces at these positions, or use a smaller step size"};
constexpr CheckedQuantity GIVEN_FORCE = {"the given force", "kJ/(mol nm)", "give finite forces"};
constexpr CheckedQuantity VELOCITY = {"the velocity", "nm/ps",
                                      "its force is too large; use a smaller step size"};
constexpr CheckedQuantity NEXT_POSITION = {"the next position", "nm", "use a smaller step size"};

/** @param particle  index in the System. @throws OpenMMException always */
[[noreturn]] void refuseNotFinite(const CheckedQuantity& quantity, int particle,
                                  const numerics::Vec3& value);
/** A step kernel with a Plan. A platform derives from it and says where its data are. */
class PlannedStepKernel : public IntegratePSEStepKernel {
public:
    using IntegratePSEStepKernel::IntegratePSEStepKernel;
    void initialize(OpenMM::ContextImpl& context, const PSEBrownianIntegrator& integrator,
                    const Scene& scene) override;
    void positionsSet() override;
    NumericalParameters getNumericalParameters() const override;
    std::vector<StageTime> getStageTimes() const override { return clock.times(); }
    void createCheckpoint(std::ostream& stream) const override;
    void loadCheckpoint(std::istream& stream) override;
    StepState getStepState() const override;
    double getStrain() const override { return strain; }
    void setStepState(const StepState& state) override;
    std::vector<OpenMM::Vec3> computeStress(OpenMM::ContextImpl& context,
                                            const PSEBrownianIntegrator& integrator, int parts,
                                            int groups) override;

protected:
    /** The box of the Context, now. */
    virtual void boxVectors(OpenMM::Vec3 box[3]) const = 0;
    /** Fill in what the platform knows of the request: its precision and its costs. */
    virtual void adapt(numerics::PlanRequest& request) const = 0;
    /**
     * Make whatever the Plan needs, in place of what there was; if it throws, the old one stays.
     * @throws OpenMMException naming the memory needed and available, if the Plan does not fit
     */
    virtual void useEngine(const numerics::Plan& plan, const numerics::Lattice& box) = 0;
    /** Fill in what the platform knows of the request: its precision. */
    virtual void adapt(numerics::UnboundedRequest& request) const = 0;
    /** A fluid without a boundary, and without a box. */
    virtual void useUnbounded(const numerics::UnboundedPlan& plan) = 0;
    /** The engine shall follow a box that moves, with the Plan it has. */
    virtual void setEngineBox(const numerics::Lattice& box) = 0;
    /** Each particle moves for itself: no hydrodynamics, or no mobile particle; no Plan. */
    virtual void useFreeDraining() = 0;
    /** Of the last thermal step. */
    virtual int lanczosIterations() const = 0;
    /** As getNumericalParameters() tells it; without a Plan, it has no split. */
    virtual std::string precisionName(const numerics::Plan& plan) const = 0;
    virtual std::string precisionName(const numerics::UnboundedPlan& plan) const = 0;
    /** The instruction set of loops on the host; empty if there is no choice. */
    virtual std::string instructions() const { return ""; }
    /** Whether Forces can be computed in a box that is not rectangular. */
    virtual bool boxCanTilt() const { return true; }
    /** Relative rounding of a coordinate of the Context. */
    virtual double coordinateRounding() const { return 1.1e-16; }

    /**
     * The engine follows the box of the Context: with the Plan it has, if that was made for a box
     * that moves and still serves this one, else with a new Plan; on failure the old ones stay.
     */
    void followBox();
    const numerics::Plan& plan() const { return currentPlan; }
    /** Whether steps tilt the box. */
    bool isSheared() const;
    /** The strain of a step from a time of the Context on (ps); 0 without shear. */
    double strainOf(double time, double dt) const;
    /** The box of the Context after a strain. */
    numerics::Lattice shearedBox(double strain) const { return currentBox().sheared(strain); }
    /** The noise of the next step, or of the next sample. */
    Thermal thermal(const PSEBrownianIntegrator& integrator, bool sample) const;
    /**
     * Largest coordinate (nm) that still tells a place in the box, or the distance to a neighbour
     * in an unbounded fluid.
     * @throws OpenMMException naming a box that is not one, before positions are blamed for it
     */
    double farthestPosition() const;
    /**
     * Refuse a position beyond farthestPosition().
     * @param next  whether it is that after the step, which is not made
     * @throws OpenMMException always
     */
    [[noreturn]] void refuseFarAway(int particle, const numerics::Vec3& position,
                                    bool next = false) const;
    /** An index in the System and three numbers. */
    using OfParticle = std::pair<int, numerics::Vec3>;
    /**
     * Whether a step may be one of a growth that explicit steps make where they are too long for
     * the forces [T63].
     * @param velocity  the largest component (nm/ps) of all particles, without the flow
     */
    bool mayBlowUp(double velocity, double dt) const;
    /**
     * Refuse that step if it is one.
     * @param velocities  of mobile particles (nm/ps), without the flow
     */
    void refuseBlowUp(OpenMM::ContextImpl& context, const std::vector<OfParticle>& velocities,
                      double dt) const;

    Scene scene;
    std::vector<double> masses; ///< of all particles
    double viscosity = 0;
    StageClock clock;
    uint64_t steps = 0, samples = 0; ///< thermal steps taken, samples drawn
    double strain = 0;               ///< so far
    numerics::StepGrowth growth;     ///< of the largest velocity, from step to step

private:
    /** A Plan and what it was made for. */
    struct Prepared {
        numerics::PlanRequest request;
        numerics::Plan plan;
    };
    numerics::Lattice currentBox() const;
    /** Displacement in a step (nm) beyond which forces of the next say nothing of the last ones. */
    double longestStep() const;
    /** (1/V) dU/d(strain) [T47]. */
    numerics::Matrix3 interparticleStress(OpenMM::ContextImpl& context, int groups);
    /**
     * What the next step will use instead of the present Plan, since the box may have changed;
     * nothing if that serves, or if none can be made: the step will tell.
     */
    std::optional<Prepared> upcoming() const;
    /** What must be planned for before a step in that box; nothing if the present Plan serves. */
    std::optional<Prepared> prepareFor(const numerics::Lattice& box) const;
    Prepared prepared(const numerics::PlanRequest& request) const;
    /** What the state was planned for. */
    numerics::PlanRequest requestOf(const StepState& state) const;
    void use(const Prepared& next, const numerics::Lattice& box);
    void nowIn(const numerics::Lattice& box);
    void planUnbounded(const PSEBrownianIntegrator& integrator);
    NumericalParameters parametersOf(const numerics::Plan& plan) const;
    /** Everything that must agree for a checkpoint to continue exactly, in words. */
    std::string signature(const numerics::Plan& plan) const;

    const PSEBrownianIntegrator* settings = NULL;
    /// what the Plan was made for; NULL without hydrodynamics or mobile particles, and in an
    /// unbounded fluid
    std::unique_ptr<numerics::PlanRequest> request;
    std::optional<numerics::Lattice> engineBox;
    /// that of the last step, also of one before a restart, which the engine has not seen
    std::optional<numerics::Lattice> lastBox;
    numerics::Plan currentPlan = {};
    std::unique_ptr<numerics::UnboundedPlan> unboundedPlan; ///< NULL in any other scene
    int seed = 0;
    bool straining = false; ///< checkpoints are for the Context alone: nothing here changes
};

} // namespace PSE

#endif
