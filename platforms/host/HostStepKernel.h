// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_HOSTSTEPKERNEL_H_
#define OPENMMPSE_HOSTSTEPKERNEL_H_

// One step of Brownian dynamics for the platforms that keep positions and forces in host memory, in
// double: Reference and CPU. They differ in their MobilityEngine only.

#include "MobilityEngine.h"
#include "StepKernel.h"
#include "openmm/reference/ReferencePlatform.h"

namespace PSE {

class HostStepKernel : public PlannedStepKernel {
public:
    HostStepKernel(std::string name, const OpenMM::Platform& platform,
                   OpenMM::ReferencePlatform::PlatformData& data,
                   std::unique_ptr<EngineFactory> factory);
    void positionsChanged() override {
        factory->followBox(*data.positions, data.periodicBoxVectors);
    }
    void checkPositions(OpenMM::ContextImpl& context) override;
    void computeForces(OpenMM::ContextImpl& context, int groups) override;
    StepState getStepState() const override;
    void setStepState(const StepState& state) override;
    void execute(OpenMM::ContextImpl& context, const PSEBrownianIntegrator& integrator) override;
    double computeKineticEnergy(OpenMM::ContextImpl& context) override;
    std::vector<OpenMM::Vec3> applyMobility(OpenMM::ContextImpl& context,
                                            const std::vector<OpenMM::Vec3>& forces) override;
    std::vector<OpenMM::Vec3> sampleBrownianDisplacements(OpenMM::ContextImpl& context,
                                                          const PSEBrownianIntegrator& integrator,
                                                          int count) override;

protected:
    void boxVectors(OpenMM::Vec3 box[3]) const override;
    void adapt(numerics::PlanRequest& request) const override { factory->adapt(request); }
    void useEngine(const numerics::Plan& plan, const numerics::Lattice& box) override;
    void adapt(numerics::UnboundedRequest& request) const override { factory->adapt(request); }
    void useUnbounded(const numerics::UnboundedPlan& plan) override;
    void setEngineBox(const numerics::Lattice& box) override { engine->setBox(box); }
    void useFreeDraining() override;
    int lanczosIterations() const override { return engine->lanczosIterations(); }
    std::string precisionName(const numerics::Plan& plan) const override;
    std::string precisionName(const numerics::UnboundedPlan& plan) const override;
    std::string instructions() const override { return factory->instructions(); }

private:
    /** Follow the box of the Context, and give the engine the current positions. */
    void followPositions();
    /** Add the flow of a strain to the step that positions and velocities are about to make. */
    void addFlow(double strain, double dt);
    /** @throws OpenMMException naming the first particle whose entry is not finite */
    void requireFinite(const std::vector<numerics::Vec3>& values,
                       const CheckedQuantity& quantity) const;
    /** The largest velocity component. Refuses, before anything moves, a step that is no good. */
    double checkedVelocities(OpenMM::ContextImpl& context, double dt) const;
    /** Refuse what there is in `positions`, by its first particle. @param next  after a step */
    void refusePlaces(const CheckedQuantity& quantity, bool next) const;
    /** The same, of where particles would be then. */
    void checkNextPositions() const;
    /** The entries of mobile particles. */
    void gather(const std::vector<OpenMM::Vec3>& all, std::vector<numerics::Vec3>& mobile) const;
    std::vector<OpenMM::Vec3> scattered(const std::vector<numerics::Vec3>& mobile,
                                        double scale) const;

    OpenMM::ReferencePlatform::PlatformData& data;
    std::unique_ptr<EngineFactory> factory;
    std::unique_ptr<MobilityEngine> engine;
    /// of mobile particles; kept between steps, because large arrays are dear to allocate
    std::vector<numerics::Vec3> forces, positions, velocities;
};

} // namespace PSE

#endif
