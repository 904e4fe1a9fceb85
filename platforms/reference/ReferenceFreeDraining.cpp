// SPDX-License-Identifier: MIT
#include "ReferenceFreeDraining.h"
#include <algorithm>

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
    static_assert(sizeof(Vec3) == 3 * sizeof(double), "an array of them is one of numbers");
    const int n = static_cast<int>(mobility.size());
    if (thermal != NULL)
        particleNoise(thermal->real, indices.data(), n, reinterpret_cast<double(*)[3]>(u.data()));
    else
        std::fill(u.begin(), u.end(), Vec3::Zero());
    for (int i = 0; i < n; i++) {
        u[i] = unit * root[i] * u[i];
        if (forces != NULL)
            u[i] += mobility[i] * (*forces)[i];
    }
    clock.charge("free draining");
}

} // namespace PSE
