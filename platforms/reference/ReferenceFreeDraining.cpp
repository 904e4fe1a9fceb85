// SPDX-License-Identifier: MIT
#include "ReferenceFreeDraining.h"

using namespace PSE::numerics;

namespace PSE {

ReferenceFreeDraining::ReferenceFreeDraining(double viscosity, const std::vector<double>& radii,
                                             const std::vector<int>& indices, StageClock& clock)
    : indices(indices), clock(clock) {
    for (double radius : radii) {
        mobility.push_back(1 / (6 * M_PI * viscosity * radius));
        root.push_back(std::sqrt(mobility.back()));
    }
}

void ReferenceFreeDraining::computeVelocities(const std::vector<Vec3>* forces,
                                              const Thermal* thermal, std::vector<Vec3>& u) {
    clock.start();
    u.resize(mobility.size());
    const double unit = (thermal == NULL ? 0 : std::sqrt(2 * thermal->kT / thermal->dt));
    for (size_t i = 0; i < mobility.size(); i++) {
        Vec3 z = Vec3::Zero();
        if (thermal != NULL)
            particleNoise(thermal->real, indices[i], z.data());
        u[i] = unit * root[i] * z;
        if (forces != NULL)
            u[i] += mobility[i] * (*forces)[i];
    }
    clock.charge("free draining");
}

} // namespace PSE
