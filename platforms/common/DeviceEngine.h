// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEENGINE_H_
#define OPENMMPSE_DEVICEENGINE_H_

#include "DeviceClock.h"
#include "DevicePlaces.h"
#include "DeviceRealSpace.h"
#include "DeviceWaveSpace.h"
#include "StepSummary.h"
#include "Thermal.h"
#include "numerics/Vec3.h"
#include <memory>
#include <optional>
#include <utility>

namespace PSE {

/**
 * The mobility of the mobile particles on a device. Vectors stay there, by place; what reaches the
 * host in a step is a StepSummary.
 */
class DeviceEngine {
public:
    /** @param unit  of velocities (nm/ps) */
    DeviceEngine(DevicePrograms& programs, int particles, const std::vector<int>& mobile,
                 const numerics::Lattice& box, double range, double unit, int summaryRows,
                 StageClock& clock, std::shared_ptr<const SizeGroups> sizes = nullptr);
    virtual ~DeviceEngine() = default;

    /**
     * Follow a box that moves, with a Plan made for it. The positions must be set anew.
     */
    virtual void setBox(const numerics::Lattice&) {}
    /** Follow the positions of the Context. */
    virtual void setPositions() = 0;
    /** The forces of the Context. */
    void takeForces();
    /** Forces by particle of the System (kJ/(mol nm)), four reals each, over a scale. */
    void takeForces(const std::vector<double>& given);
    /**
     * u = M f + sqrt(2 kT/dt) M^{1/2} z at the positions and with the forces set last.
     * @param thermal  NULL: no noise
     */
    virtual void computeVelocities(bool forced, const Thermal* thermal) = 0;
    virtual int lanczosIterations() const = 0;

    /** Largest component of the Context's forces; 2^31 stands for what the device cannot hold. */
    double largestForce() const { return summary.maximum(StepSummary::Force); }
    /** Largest component of what computeVelocities() made (nm/ps), without real-space noise. */
    double largestVelocity() const { return unit * summary.maximum(StepSummary::Velocity); }
    /** Advance positions by dt u, and set velocities. */
    void move(double dt);
    /** Index in the System and velocity (nm/ps), in no particular order. */
    std::vector<std::pair<int, numerics::Vec3>> velocities() const;
    DeviceClock& clock() { return stages; }

protected:
    void checkVelocities();

    OpenMM::ComputeContext& context;
    int numParticles;
    double unit;
    StepSummary summary;
    DevicePlaces places;
    DeviceClock stages;
    OpenMM::ComputeArray forces, u;

private:
    GrowingArray given;
    DeviceKernel takeForcesKernel, takeGivenForces, checkKernel, moveParticles;
};

/** Each particle for itself [T2]. */
class DeviceFreeDraining : public DeviceEngine {
public:
    /** @param radii  of the mobile particles (nm) */
    DeviceFreeDraining(DevicePrograms& programs, int particles, const std::vector<int>& mobile,
                       const std::vector<double>& radii, double viscosity, StageClock& clock);
    void setPositions() override;
    void computeVelocities(bool forced, const Thermal* thermal) override;
    int lanczosIterations() const override { return 0; }

private:
    OpenMM::ComputeArray mobility;
    DeviceKernel drainFreely;
};

/** The periodic fluid. Inside, mobilities are in units of 1/(6 pi eta a). */
class DevicePeriodicEngine : public DeviceEngine {
public:
    DevicePeriodicEngine(DevicePrograms& programs, int particles, const std::vector<int>& mobile,
                         const numerics::Plan& plan, const numerics::Lattice& box, double viscosity,
                         StageClock& clock);
    void setBox(const numerics::Lattice& box) override;
    void setPositions() override;
    void computeVelocities(bool forced, const Thermal* thermal) override;
    int lanczosIterations() const override {
        return realSpace ? realSpace->squareRoot().lastIterations() : 0;
    }

private:
    void launch(bool forced, const Thermal* thermal, double noise);

    const numerics::Plan plan;
    double drag;                              ///< 6 pi eta a
    std::unique_ptr<DeviceSpheres> spheres;   ///< of a mixture, else NULL
    std::optional<DeviceRealSpace> realSpace; ///< none where waves are all there is
    DeviceWaveSpace waveSpace;
};

} // namespace PSE

#endif
