// SPDX-License-Identifier: MIT
#include "CpuEngine.h"
#include "numerics/Lanczos.h"
#include <algorithm>
#include <cmath>

using namespace PSE::numerics;

namespace PSE {

namespace {

/// particles and grid points below which waking threads costs more than they do
constexpr double SERIAL_WORK = 20000;

bool isSmall(const Plan& plan, size_t particles) {
    return 10.0 * particles + plan.gridPoints() < SERIAL_WORK;
}

} // namespace

template <class Real>
CpuEngine<Real>::CpuEngine(const Plan& plan, const Lattice& box, double viscosity,
                           const std::vector<int>& indices, OpenMM::ThreadPool& pool,
                           StageClock& clock)
    : drag(6 * M_PI * viscosity * plan.a), lanczosTolerance(plan.lanczosTolerance),
      // Eigenvalues of the truncated M_R may lie below zero by the error of the truncation.
      negativeTolerance(std::max(2 * plan.predictedError, 1e-10)),
      reorthogonalise(plan.precision == Precision::Double), indices(indices),
      threads(pool, isSmall(plan, indices.size())), clock(clock),
      realSpace(plan, box, threads, pool), waveSpace(plan, box, threads) {}

template <class Real> void CpuEngine<Real>::setPositions(const std::vector<Vec3>& x) {
    clock.start();
    realSpace.setPositions(x);
    clock.charge("neighbours and pair coefficients");
    waveSpace.setPositions(x);
    clock.charge("window weights");
}

template <class Real>
void CpuEngine<Real>::computeVelocities(const std::vector<Vec3>* forces, const Thermal* thermal,
                                        std::vector<Vec3>& u) {
    const int n = static_cast<int>(indices.size());
    u.assign(n, Vec3::Zero());
    double scale = 0; // force unit
    if (forces != NULL)
        for (const Vec3& f : *forces)
            scale = std::max(scale, f.cwiseAbs().maxCoeff());
    const bool forced = scale > 0;
    const double thermalForce =
        (thermal == NULL ? 0 : std::sqrt(2 * thermal->kT * drag / thermal->dt));
    scale = std::max(scale, thermalForce);
    if (scale == 0)
        return;
    velocities.assign(3 * n, Real(0));
    part.resize(3 * n);
    scaledForces.resize(3 * n);
    clock.start();
    if (forced) {
        for (int i = 0; i < n; i++)
            for (int c = 0; c < 3; c++)
                scaledForces[3 * i + c] = Real((*forces)[i][c] / scale);
        addRealForced(scaledForces, velocities);
        clock.charge("real-space velocities");
    }
    const Real noise = Real(thermalForce / scale);
    if (thermal != NULL) {
        addRealThermal(*thermal, noise, velocities);
        clock.charge("real-space noise (Lanczos)");
    }
    waveSpace.addVelocities(forced ? scaledForces.data() : NULL, noise,
                            thermal == NULL ? NoiseKey{} : thermal->wave, velocities.data(), clock);
    for (int i = 0; i < n; i++)
        for (int c = 0; c < 3; c++)
            u[i][c] = double(velocities[3 * i + c]) * (scale / drag);
}

template <class Real> void CpuEngine<Real>::addRealForced(const Vector& forces, Vector& u) {
    realSpace.multiply(forces, part);
    realSpace.addScaled(1, part, u);
}

template <class Real>
void CpuEngine<Real>::addRealThermal(const Thermal& thermal, Real noise, Vector& u) {
    z.resize(u.size());
    threads.runBlocks(static_cast<int>(indices.size()), [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            particleNoise(thermal.real, indices[i], z.data() + 3 * size_t(i));
    });
    iterations =
        lanczosSquareRoot(realSpace, z, part, lanczosTolerance, negativeTolerance, reorthogonalise);
    realSpace.addScaled(noise, part, u);
}

template class CpuEngine<float>;
template class CpuEngine<double>;

} // namespace PSE
