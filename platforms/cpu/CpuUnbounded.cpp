// SPDX-License-Identifier: MIT
#include "CpuUnbounded.h"
#include "numerics/Lanczos.h"
#include <cmath>

using namespace PSE::numerics;

namespace PSE {

namespace {
/// particles below which waking threads costs more than they do
constexpr size_t FEW_PARTICLES = 200;
} // namespace

template <class Real>
CpuUnbounded<Real>::CpuUnbounded(const UnboundedPlan& plan, const std::vector<double>& radii,
                                 double viscosity, const std::vector<int>& indices,
                                 OpenMM::ThreadPool& pool, StageClock& clock)
    : plan(plan), drag(6 * M_PI * viscosity * plan.a), indices(indices),
      threads(pool, indices.size() < FEW_PARTICLES), clock(clock), pairs(plan, radii, threads) {
    forced.assign(3 * size_t(pairs.stride()), Real(0));
    random = forced;
}

template <class Real> void CpuUnbounded<Real>::setPositions(const std::vector<Vec3>& x) {
    pairs.setPositions(x);
}

template <class Real>
void CpuUnbounded<Real>::computeVelocities(const std::vector<Vec3>* forces, const Thermal* thermal,
                                           std::vector<Vec3>& u) {
    const ForceUnit scale(forces, thermal, drag);
    u.assign(indices.size(), Vec3::Zero());
    if (scale.unit == 0)
        return;
    clock.start();
    threads.keepAwake([&] { addVelocities(scale, forces, thermal, u); });
}

template <class Real>
void CpuUnbounded<Real>::addVelocities(const ForceUnit& scale, const std::vector<Vec3>* forces,
                                       const Thermal* thermal, std::vector<Vec3>& u) {
    pairs.expectMore(scale.noise > 0);
    if (scale.forced) {
        multiply(*forces, scale.unit);
        clock.charge("velocities");
    }
    if (scale.noise > 0)
        drawNoise(*thermal);
    threads.runBlocks(static_cast<int>(u.size()), [&](int from, int to, int) {
        for (int c = 0; c < 3; c++)
            for (int i = from; i < to; i++) {
                const size_t k = size_t(c) * pairs.stride() + i;
                u[i][c] = scale.unit / drag *
                          ((scale.forced ? double(forced[k]) : 0) +
                           (scale.noise > 0 ? scale.noise * double(random[k]) : 0));
            }
    });
    clock.charge(scale.noise > 0 ? "noise (Lanczos)" : "velocities");
}

/** forced = M f, forces in units of `unit`. */
template <class Real>
void CpuUnbounded<Real>::multiply(const std::vector<Vec3>& forces, double unit) {
    Vector& f = pairs.basis(0); // free for this use until Lanczos begins
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < forces.size(); i++)
            f[size_t(c) * pairs.stride() + i] = Real(forces[i][c] / unit);
    pairs.multiplyAdd(f, 1, f, 0, forced);
}

/** random = M^{1/2} z */
template <class Real> void CpuUnbounded<Real>::drawNoise(const Thermal& thermal) {
    Vector& z = pairs.basis(0);
    drawn.resize(3 * indices.size());
    threads.runBlocks(static_cast<int>(indices.size()), [&](int from, int to, int) {
        uint32_t particles[Threads::BLOCK] = {};
        for (int i = from; i < to; i++)
            particles[i - from] = static_cast<uint32_t>(indices[i]);
        noiseLoops.particleNoise(thermal.real, particles, to - from,
                                 drawn.data() + 3 * size_t(from));
        for (int i = from; i < to; i++)
            for (int c = 0; c < 3; c++)
                z[size_t(c) * pairs.stride() + i] = drawn[3 * size_t(i) + c];
    });
    iterations = lanczosSquareRoot(pairs, random,
                                   LanczosTridiagonal(plan.lanczosTolerance, plan.negativeTolerance,
                                                      LanczosTridiagonal::WHOLE),
                                   true);
}

template class CpuUnbounded<float>;
template class CpuUnbounded<double>;

} // namespace PSE
