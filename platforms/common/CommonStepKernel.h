// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_COMMONSTEPKERNEL_H_
#define OPENMMPSE_COMMONSTEPKERNEL_H_

// One step of Brownian dynamics for the platforms that keep positions and forces on a device: they
// share the kernels, written in OpenMM's Common compute dialect, and all code that launches them.

#include "DeviceEngine.h"
#include "DeviceFlow.h"
#include "DeviceUnbounded.h"
#include "Memory.h"
#include "StepKernel.h"
#include "openmm/common/ComputeContext.h"
#include <functional>
#include <optional>

namespace PSE {

class CommonStepKernel : public PlannedStepKernel {
public:
    /**
     * @param devices      how many the Context was asked to use
     * @param forgetLists  makes OpenMM find the neighbours of its Forces anew
     */
    CommonStepKernel(std::string name, const OpenMM::Platform& platform,
                     OpenMM::ComputeContext& context, int devices,
                     std::function<void()> forgetLists);
    ~CommonStepKernel() override;
    void initialize(OpenMM::ContextImpl& context, const PSEBrownianIntegrator& integrator,
                    const Scene& scene) override;
    void positionsChanged() override { positionsChecked = false; }
    void checkPositions(OpenMM::ContextImpl& context) override;
    void requireShear(OpenMM::ContextImpl& context) const override;
    void execute(OpenMM::ContextImpl& context, const PSEBrownianIntegrator& integrator) override;
    double computeKineticEnergy(OpenMM::ContextImpl& context) override;
    std::vector<OpenMM::Vec3> applyMobility(OpenMM::ContextImpl& context,
                                            const std::vector<OpenMM::Vec3>& forces) override;
    std::vector<OpenMM::Vec3> sampleBrownianDisplacements(OpenMM::ContextImpl& context,
                                                          const PSEBrownianIntegrator& integrator,
                                                          int count) override;

protected:
    void boxVectors(OpenMM::Vec3 box[3]) const override;
    void adapt(numerics::PlanRequest& request) const override;
    void useEngine(const numerics::Plan& plan, const numerics::Lattice& box) override;
    void adapt(numerics::UnboundedRequest& request) const override;
    void useUnbounded(const numerics::UnboundedPlan& plan) override;
    void setEngineBox(const numerics::Lattice& box) override;
    void useFreeDraining() override;
    int lanczosIterations() const override { return engine->lanczosIterations(); }
    std::string precisionName(const numerics::Plan&) const override { return precisionName(); }
    std::string precisionName(const numerics::UnboundedPlan&) const override {
        return precisionName();
    }
    double coordinateRounding() const override;
    bool boxCanTilt() const override { return device.getBoxIsTriclinic(); }

private:
    std::string precisionName() const;
    void requireRoom(const numerics::Plan& plan, const numerics::Lattice& box) const;
    MemoryUse memoryUse(const numerics::Plan& plan, const numerics::Lattice& box) const;
    bool measures() const;
    void followBoxOfLists();
    void flowAlong(double strain, double dt);
    double farthestFlow(double strain) const;
    void checkStep(OpenMM::ContextImpl& context, double dt, double strain) const;
    [[noreturn]] void refuseForce(OpenMM::ContextImpl& context) const;
    OfParticle firstBeyond(const std::vector<OfParticle>& all, double limit) const;
    [[noreturn]] void refuseVelocity() const;
    void refuseMove(OpenMM::ContextImpl& context, double dt, double strain, double limit) const;
    std::vector<OpenMM::Vec3> velocities(double scale) const;

    OpenMM::ComputeContext& device;
    int numDevices;
    std::function<void()> forgetLists;
    OpenMM::Vec3 boxOfLists[3]; ///< in which OpenMM's lists of neighbours are
    DevicePrograms programs;
    std::unique_ptr<DeviceEngine> engine;
    std::optional<DeviceFlow> flow; ///< none before the first step with a strain
    bool positionsChecked = false;
    long long stepCountSeen = -1; ///< of the Context, when its positions were fine
    double largestCoordinate = 0; ///< when positions were checked (nm)
    double travelled = 0;         ///< at most, since positions were checked (nm)
    double tolerance = 0;
    int stepsSinceStart = 0; ///< with this engine; some of them are measured
};

} // namespace PSE

#endif
