// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_REFERENCEUNBOUNDED_H_
#define OPENMMPSE_REFERENCEUNBOUNDED_H_

#include "MobilityEngine.h"
#include "numerics/UnboundedPlan.h"

namespace PSE {

/**
 * The oracle of an unbounded fluid [T32]: double precision, a sum over all pairs that are evaluated
 * one by one, and Lanczos converged to 1e-12. Use it up to about 1000 particles.
 */
class ReferenceUnbounded : public MobilityEngine {
public:
    /** @param radii  of the mobile particles (nm) */
    ReferenceUnbounded(const numerics::UnboundedPlan& plan, const std::vector<double>& radii,
                       double viscosity, const std::vector<int>& indices, StageClock& clock);
    void setPositions(const std::vector<numerics::Vec3>& x) override;
    void computeVelocities(const std::vector<numerics::Vec3>* forces, const Thermal* thermal,
                           std::vector<numerics::Vec3>& u) override;
    int lanczosIterations() const override { return iterations; }

private:
    using Vectors = std::vector<numerics::Vec3>;
    /** out = M v, in units of 1/(6 pi eta a). */
    void multiply(const Vectors& v, Vectors& out) const;

    numerics::UnboundedPlan plan;
    double unit;               ///< 1/(6 pi eta a), a = plan.a
    std::vector<double> radii; ///< over a
    std::vector<int> indices;
    StageClock& clock;
    Vectors positions; ///< over a
    int iterations = 0;
};

} // namespace PSE

#endif
