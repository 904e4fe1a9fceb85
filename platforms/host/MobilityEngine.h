// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_MOBILITYENGINE_H_
#define OPENMMPSE_MOBILITYENGINE_H_

#include "StageClock.h"
#include "Thermal.h"
#include "numerics/Plan.h"
#include "numerics/UnboundedPlan.h"
#include "openmm/Vec3.h"
#include <functional>
#include <memory>
#include <vector>

namespace PSE {

/**
 * The mobility of the mobile particles on one platform. Vectors have one entry per mobile particle,
 * in units of OpenMM (nm, kJ/(mol nm), nm/ps).
 */
class MobilityEngine {
public:
    virtual ~MobilityEngine() = default;
    /**
     * Follow a box that moves, with a Plan made for it: no memory is asked for. The positions must
     * be set anew.
     */
    virtual void setBox(const numerics::Lattice&) {}
    /** Positions need not lie in the primary box. */
    virtual void setPositions(const std::vector<numerics::Vec3>& x) = 0;
    /**
     * u = M f + sqrt(2 kT/dt) M^{1/2} z at the positions set last.
     * @param forces   NULL: none
     * @param thermal  NULL: no noise
     */
    virtual void computeVelocities(const std::vector<numerics::Vec3>* forces,
                                   const Thermal* thermal, std::vector<numerics::Vec3>& u) = 0;
    /** Lanczos iterations of the last call with noise. */
    virtual int lanczosIterations() const = 0;
};

/** What a platform supplies: how to plan, and the engine for a Plan. */
class EngineFactory {
public:
    virtual ~EngineFactory() = default;
    /** Fill in what the platform knows of the request: its precision and its costs. */
    virtual void adapt(numerics::PlanRequest& request) const = 0;
    /**
     * Evaluate the Forces of a step at these positions in this box: what OpenMM keeps for them on
     * this platform shall fit. The flag tells that steps move the box.
     */
    virtual void evaluate(const std::vector<OpenMM::Vec3>&, const OpenMM::Vec3*, bool,
                          const std::function<void()>& forces) {
        forces();
    }
    /** Positions or box have been changed. */
    virtual void followBox(const std::vector<OpenMM::Vec3>&, const OpenMM::Vec3*) {}
    /** A restart begins here: what OpenMM keeps shall not depend on earlier steps. */
    virtual void startAnew() {}
    /** The instruction set of the loops; empty if there is no choice. */
    virtual std::string instructions() const { return ""; }
    /**
     * @param indices  particle index in the System of each mobile particle: noise belongs to the
     * particle
     * @throws OpenMMException naming the memory needed and available, if the Plan does not fit
     */
    virtual std::unique_ptr<MobilityEngine> create(const numerics::Plan& plan,
                                                   const numerics::Lattice& box, double viscosity,
                                                   const std::vector<int>& indices,
                                                   StageClock& clock) const = 0;
    /** The engine of particles that move each for itself, with these radii. */
    virtual std::unique_ptr<MobilityEngine> createFreeDraining(double viscosity,
                                                               const std::vector<double>& radii,
                                                               const std::vector<int>& indices,
                                                               StageClock& clock) const = 0;
    /** Fill in what the platform knows of the request: its precision. */
    virtual void adapt(numerics::UnboundedRequest& request) const = 0;
    /**
     * The fluid without a boundary.
     * @param radii    of the mobile particles (nm)
     */
    virtual std::unique_ptr<MobilityEngine>
    createUnbounded(const numerics::UnboundedPlan& plan, const std::vector<double>& radii,
                    double viscosity, const std::vector<int>& indices, StageClock& clock) const = 0;
};

} // namespace PSE

#endif
