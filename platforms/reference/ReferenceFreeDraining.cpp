// SPDX-License-Identifier: MIT
#include "ReferenceFreeDraining.h"
#include <algorithm>

using namespace PSE::numerics;

namespace PSE {

namespace {
constexpr int BLOCK = 64; ///< particles whose noise stays in the nearest cache
}

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
    const int n = static_cast<int>(mobility.size());
    double z[BLOCK][3] = {};
    for (int from = 0; from < n; from += BLOCK) {
        const int count = std::min(BLOCK, n - from);
        if (thermal != NULL)
            particleNoise(thermal->real, indices.data() + from, count, z);
        for (int j = 0, i = from; j < count; j++, i++) {
            u[i] = unit * root[i] * Vec3(z[j]);
            if (forces != NULL)
                u[i] += mobility[i] * (*forces)[i];
        }
    }
    clock.charge("free draining");
}

} // namespace PSE
