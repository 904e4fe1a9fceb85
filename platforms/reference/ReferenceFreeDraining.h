// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_REFERENCEFREEDRAINING_H_
#define OPENMMPSE_REFERENCEFREEDRAINING_H_

#include "MobilityEngine.h"

namespace PSE {

/** No hydrodynamic interaction: M = 1/(6 pi eta a_i), each particle with its own radius [T2]. */
class ReferenceFreeDraining : public MobilityEngine {
public:
    ReferenceFreeDraining(double viscosity, const std::vector<double>& radii,
                          const std::vector<int>& indices, StageClock& clock);
    void setPositions(const std::vector<numerics::Vec3>&) override {}
    void computeVelocities(const std::vector<numerics::Vec3>* forces, const Thermal* thermal,
                           std::vector<numerics::Vec3>& u) override;
    int lanczosIterations() const override { return 0; }

private:
    std::vector<double> mobility, root; ///< 1/(6 pi eta a_i), and its square root
    std::vector<int> indices;
    StageClock& clock;
};

} // namespace PSE

#endif
