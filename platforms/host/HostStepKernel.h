// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_HOSTSTEPKERNEL_H_
#define OPENMMPSE_HOSTSTEPKERNEL_H_

// One step of Brownian dynamics for the platforms that keep positions and forces in host memory, in
// double: Reference and CPU. They differ in their MobilityEngine only.

#include "MobilityEngine.h"
#include "openmmpse/PSEKernels.h"
#include "openmm/reference/ReferencePlatform.h"

namespace PSE {

class HostStepKernel : public IntegratePSEStepKernel {
public:
    HostStepKernel(std::string name, const OpenMM::Platform& platform,
                   OpenMM::ReferencePlatform::PlatformData& data,
                   std::unique_ptr<EngineFactory> factory);
    void initialize(OpenMM::ContextImpl& context, const PSEBrownianIntegrator& integrator,
                    const Scene& scene) override;
    void checkPositions(OpenMM::ContextImpl& context) override;
    void execute(OpenMM::ContextImpl& context, const PSEBrownianIntegrator& integrator) override;
    double computeKineticEnergy(OpenMM::ContextImpl& context) override;
    std::vector<OpenMM::Vec3> applyMobility(OpenMM::ContextImpl& context,
                                            const std::vector<OpenMM::Vec3>& forces) override;
    std::vector<OpenMM::Vec3> sampleBrownianDisplacements(OpenMM::ContextImpl& context,
                                                          const PSEBrownianIntegrator& integrator,
                                                          int count) override;
    NumericalParameters getNumericalParameters() const override;
    std::vector<StageTime> getStageTimes() const override { return clock.times(); }
    void createCheckpoint(std::ostream& stream) const override;
    void loadCheckpoint(std::istream& stream) override;
    void getCounters(unsigned long long& step, unsigned long long& sample) const override;
    void setCounters(unsigned long long step, unsigned long long sample) override;

private:
    numerics::Lattice currentBox() const;
    /** Make Plan and engine for a box; on failure the old ones stay. */
    void plan(const numerics::Lattice& box);
    /** Follow the box of the Context, and give the engine the current positions. */
    void followPositions();
    Thermal thermal(const PSEBrownianIntegrator& integrator, bool sample) const;
    /** @throws OpenMMException naming the first particle whose entry is not finite */
    void requireFinite(const std::vector<numerics::Vec3>& values, const char* what,
                       const char* unit, const char* remedy) const;
    /** The entries of mobile particles. */
    void gather(const std::vector<OpenMM::Vec3>& all, std::vector<numerics::Vec3>& mobile) const;
    std::vector<OpenMM::Vec3> scattered(const std::vector<numerics::Vec3>& mobile,
                                        double scale) const;
    numerics::Plan planFor(const numerics::Lattice& box) const;
    NumericalParameters parametersOf(const numerics::Plan& plan) const;
    /** Everything that must agree for a checkpoint to continue exactly, in words. */
    std::string signature(const numerics::Plan& plan) const;

    OpenMM::ReferencePlatform::PlatformData& data;
    std::unique_ptr<EngineFactory> factory;
    Scene scene;
    std::vector<double> masses;
    double viscosity = 0;
    /// NULL without hydrodynamics or mobile particles
    std::unique_ptr<numerics::PlanRequest> request;
    numerics::Plan currentPlan = {};
    std::unique_ptr<MobilityEngine> engine;
    StageClock clock;
    int seed = 0;
    uint64_t steps = 0, samples = 0;
    /// of mobile particles; kept between steps, because large arrays are dear to allocate
    std::vector<numerics::Vec3> forces, positions, velocities;
};

} // namespace PSE

#endif
