// SPDX-License-Identifier: MIT
#include "FreeDrainingEngine.h"

using namespace PSE::numerics;

namespace PSE {

FreeDrainingEngine::FreeDrainingEngine(double viscosity, const std::vector<double>& radii,
                                       const std::vector<int>& indices, StageClock& clock)
    : indices(indices), clock(clock) {
    for (double radius : radii)
        mobility.push_back(1 / (6 * M_PI * viscosity * radius));
}

void FreeDrainingEngine::computeVelocities(const std::vector<Vec3>* forces, const Thermal* thermal,
                                           std::vector<Vec3>& u) {
    clock.start();
    u.assign(mobility.size(), Vec3::Zero());
    for (size_t i = 0; i < mobility.size(); i++) {
        if (forces != NULL)
            u[i] += mobility[i] * (*forces)[i];
        if (thermal != NULL) {
            Vec3 z;
            particleNoise(thermal->real, indices[i], z.data());
            u[i] += std::sqrt(2 * thermal->kT * mobility[i] / thermal->dt) * z;
        }
    }
    clock.charge("free draining");
}

} // namespace PSE
