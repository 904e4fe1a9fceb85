// SPDX-License-Identifier: MIT
#include "CpuFreeDraining.h"

using namespace PSE::numerics;

namespace PSE {

namespace {
constexpr size_t SERIAL_PARTICLES = 2000; ///< below, waking threads costs more than they do
}

CpuFreeDraining::CpuFreeDraining(double viscosity, const std::vector<double>& radii,
                                 const std::vector<int>& indices, OpenMM::ThreadPool& pool,
                                 StageClock& clock)
    : particles(indices.begin(), indices.end()), threads(pool, indices.size() < SERIAL_PARTICLES),
      clock(clock) {
    for (double radius : radii) {
        mobility.push_back(1 / (6 * M_PI * viscosity * radius));
        root.push_back(std::sqrt(mobility.back()));
    }
}

void CpuFreeDraining::computeVelocities(const std::vector<Vec3>* forces, const Thermal* thermal,
                                        std::vector<Vec3>& u) {
    clock.start();
    u.resize(particles.size());
    const double unit = (thermal == NULL ? 0 : std::sqrt(2 * thermal->kT / thermal->dt));
    threads.runBlocks(static_cast<int>(particles.size()), [&](int from, int to, int) {
        double z[3 * Threads::BLOCK] = {};
        if (thermal != NULL)
            noiseLoops.particleNoise(thermal->real, particles.data() + from, to - from, z);
        for (int i = from; i < to; i++) {
            u[i] = unit * root[i] * Eigen::Map<const Vec3>(z + 3 * (i - from));
            if (forces != NULL)
                u[i] += mobility[i] * (*forces)[i];
        }
    });
    clock.charge("free draining");
}

} // namespace PSE
