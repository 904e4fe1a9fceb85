// SPDX-License-Identifier: MIT
#include "CpuEngine.h"
#include "CpuFreeDraining.h"
#include "CpuUnbounded.h"
#include "HostStepKernel.h"
#include "Instructions.h"
#include "Memory.h"
#include "NeighbourListKeeper.h"
#include "openmm/KernelFactory.h"
#include "openmm/cpu/CpuPlatform.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/windowsExport.h"

using namespace OpenMM;

namespace PSE {

namespace {

/** Single precision adds 4e-7 to the error of the fluid: from this tolerance on it is hidden. */
constexpr double SINGLE_PRECISION_FLOOR = 1e-5;

class CpuEngineFactory : public EngineFactory {
public:
    explicit CpuEngineFactory(CpuPlatform::PlatformData& data) : pool(data.threads), lists(data) {}
    void followBox(const std::vector<Vec3>& positions, const Vec3* box) override {
        lists.follow(positions, box);
    }
    void evaluate(const std::vector<Vec3>& positions, const Vec3* box, bool moves,
                  const std::function<void()>& forces) override {
        lists.evaluate(positions, box, moves, forces);
    }
    void startAnew() override { lists.startAnew(); }
    std::string instructions() const override { return instructionSet(); }
    void adapt(numerics::PlanRequest& request) const override {
        request.singleFloor = SINGLE_PRECISION_FLOOR;
        request.directSums = false;
    }
    std::unique_ptr<MobilityEngine> create(const numerics::Plan& plan, const numerics::Lattice& box,
                                           double viscosity, const std::vector<int>& indices,
                                           StageClock& clock) const override {
        if (plan.precision == numerics::Precision::Single)
            return make<float>(plan, box, viscosity, indices, clock);
        return make<double>(plan, box, viscosity, indices, clock);
    }
    std::unique_ptr<MobilityEngine> createFreeDraining(double viscosity,
                                                       const std::vector<double>& radii,
                                                       const std::vector<int>& indices,
                                                       StageClock& clock) const override {
        return std::unique_ptr<MobilityEngine>(
            new CpuFreeDraining(viscosity, radii, indices, pool, clock));
    }
    void adapt(numerics::UnboundedRequest& request) const override {
        request.singleFloor = SINGLE_PRECISION_FLOOR;
    }
    std::unique_ptr<MobilityEngine> createUnbounded(const numerics::UnboundedPlan& plan,
                                                    const std::vector<double>& radii,
                                                    double viscosity,
                                                    const std::vector<int>& indices,
                                                    StageClock& clock) const override {
        if (plan.precision == numerics::Precision::Single)
            return makeUnbounded<float>(plan, radii, viscosity, indices, clock);
        return makeUnbounded<double>(plan, radii, viscosity, indices, clock);
    }

private:
    template <class Real>
    std::unique_ptr<MobilityEngine>
    makeUnbounded(const numerics::UnboundedPlan& plan, const std::vector<double>& radii,
                  double viscosity, const std::vector<int>& indices, StageClock& clock) const {
        requireMemory(indices.size(), 3 * sizeof(Real), CpuUnbounded<Real>::BYTES_PER_PARTICLE);
        return std::unique_ptr<MobilityEngine>(
            new CpuUnbounded<Real>(plan, radii, viscosity, indices, pool, clock));
    }
    template <class Real>
    std::unique_ptr<MobilityEngine> make(const numerics::Plan& plan, const numerics::Lattice& box,
                                         double viscosity, const std::vector<int>& indices,
                                         StageClock& clock) const {
        const double real = plan.hasRealHalf() ? CpuRealSpace<Real>::bytesPerParticle(plan) : 0;
        requireMemory(plan, box, indices.size(),
                      {CpuWaveSpace<Real>::bytesPerGridPoint(plan, box),
                       CpuRealSpace<Real>::BYTES_PER_PAIR,
                       real + CpuWaveSpace<Real>::bytesPerParticle(plan)});
        return std::unique_ptr<MobilityEngine>(
            new CpuEngine<Real>(plan, box, viscosity, indices, pool, clock));
    }
    ThreadPool& pool;
    NeighbourListKeeper lists;
};

class CpuKernelFactory : public KernelFactory {
public:
    KernelImpl* createKernelImpl(std::string name, const Platform& platform,
                                 ContextImpl& context) const override {
        auto& data = *static_cast<ReferencePlatform::PlatformData*>(context.getPlatformData());
        auto& cpuData = CpuPlatform::getPlatformData(context);
        return new HostStepKernel(name, platform, data,
                                  std::unique_ptr<EngineFactory>(new CpuEngineFactory(cpuData)));
    }
};

} // namespace

} // namespace PSE

extern "C" OPENMM_EXPORT void registerPlatforms() {}

extern "C" OPENMM_EXPORT void registerKernelFactories() {
    for (int i = 0; i < Platform::getNumPlatforms(); i++)
        if (Platform::getPlatform(i).getName() == "CPU")
            Platform::getPlatform(i).registerKernelFactory(PSE::IntegratePSEStepKernel::Name(),
                                                           new PSE::CpuKernelFactory());
}
