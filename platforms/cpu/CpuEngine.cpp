// SPDX-License-Identifier: MIT
#include "CpuEngine.h"
#include "ParticleOrder.h"
#include "numerics/Lanczos.h"
#include <algorithm>
#include <cmath>

using namespace PSE::numerics;

namespace PSE {

namespace {

/// particles and grid points below which waking threads costs more than they do
constexpr double SERIAL_WORK = 15000;

bool isSmall(const Plan& plan, size_t particles) {
    return 10.0 * particles + plan.gridPoints() < SERIAL_WORK;
}

} // namespace

template <class Real>
CpuEngine<Real>::CpuEngine(const Plan& plan, const Lattice& box, double viscosity,
                           const std::vector<int>& indices, OpenMM::ThreadPool& pool,
                           StageClock& clock)
    : drag(6 * M_PI * viscosity * plan.a), lanczosTolerance(plan.lanczosTolerance),
      reorthogonalise(plan.precision == Precision::Double), indices(indices), box(box),
      threads(pool, isSmall(plan, indices.size())), clock(clock), waveSpace(plan, box, threads) {
    if (!plan.hasRealHalf())
        return;
    realSpace.emplace(plan, box, threads);
    // Eigenvalues of the truncated M_R may lie below zero by the error of the truncation.
    negativeTolerance = std::max(2 * plan.predictedError * realSpace->errorGrowth(), 1e-10);
}

template <class Real> void CpuEngine<Real>::setBox(const Lattice& moved) {
    clock.start();
    box = moved;
    if (realSpace)
        realSpace->setBox(moved);
    waveSpace.setBox(moved);
    clock.charge(MOVING_BOX);
}

template <class Real> void CpuEngine<Real>::setPositions(const std::vector<Vec3>& x) {
    clock.start();
    fractions.resize(x.size());
    const auto locate = [&](int from, int to) {
        for (int i = from; i < to; i++)
            fractions[i] = box.wrappedFractional(x[i]);
    };
    if (!realSpace) {
        placeParticles(threads, fractions, locate, waveSpace);
        clock.charge("sorting of particles and window weights");
        return;
    }
    placeParticles(threads, fractions, locate, *realSpace, waveSpace);
    clock.charge("sorting of particles and window weights");
    realSpace->findNeighbours(fractions);
    clock.charge("neighbours and pair coefficients");
}

template <class Real>
void CpuEngine<Real>::computeVelocities(const std::vector<Vec3>* forces, const Thermal* thermal,
                                        std::vector<Vec3>& u) {
    const ForceUnit scale(forces, thermal, drag);
    if (scale.unit == 0) {
        u.assign(indices.size(), Vec3::Zero());
        return;
    }
    u.resize(indices.size());
    clock.start();
    threads.keepAwake([&] { setVelocities(scale, forces, thermal, u); });
}

template <class Real>
void CpuEngine<Real>::setVelocities(const ForceUnit& scale, const std::vector<Vec3>* forces,
                                    const Thermal* thermal, std::vector<Vec3>& u) {
    const double unit = scale.unit;
    const bool forced = scale.forced;
    const Real noise = Real(scale.noise);
    if (forced && realSpace) {
        multiplyReal(*forces, unit);
        clock.charge("real-space velocities");
    } else if (forced)
        takeForces(*forces, unit);
    if (realSpace) {
        if (noise > 0)
            drawReal(*thermal);
        writeReal(forced, noise, unit / drag, u);
        clock.charge(noise > 0 ? "real-space noise (Lanczos)" : "real-space velocities");
    } else
        u.assign(indices.size(), Vec3::Zero());
    waveSpace.addVelocities(forced, noise, noise > 0 ? thermal->wave : NoiseKey{}, unit / drag, u,
                            clock);
}

/** The wave half alone takes its forces, in units of `unit`. */
template <class Real>
void CpuEngine<Real>::takeForces(const std::vector<Vec3>& forces, double unit) {
    threads.runBlocks(static_cast<int>(indices.size()),
                      [&](int from, int to, int) { waveSpace.takeForces(forces, unit, from, to); });
}

/** Both halves take their forces, in units of `unit`; realForced = X D^{1/2} f. */
template <class Real>
void CpuEngine<Real>::multiplyReal(const std::vector<Vec3>& forces, double unit) {
    const std::vector<int>& order = realSpace->order();
    const Real* const scales = realSpace->scales();
    Vector& inPlaces = realSpace->basis(0); // free for this use until Lanczos begins
    realForced.resize(inPlaces.size());
    threads.runBlocks(static_cast<int>(order.size()), [&](int from, int to, int) {
        for (int place = from; place < to; place++)
            for (int c = 0; c < 3; c++) {
                const Real force = Real(forces[order[place]][c] / unit);
                inPlaces[3 * size_t(place) + c] = (scales ? scales[place] * force : force);
            }
        waveSpace.takeForces(forces, unit, from, to);
    });
    realSpace->multiplyAdd(inPlaces, 1, inPlaces, 0, realForced);
}

/** realThermal = X^{1/2} z. */
template <class Real> void CpuEngine<Real>::drawReal(const Thermal& thermal) {
    const std::vector<int>& order = realSpace->order();
    Vector& z = realSpace->basis(0);
    realThermal.resize(z.size());
    threads.runBlocks(static_cast<int>(order.size()), [&](int from, int to, int) {
        uint32_t particles[Threads::BLOCK]; // indices in the System
        for (int place = from; place < to; place++)
            particles[place - from] = static_cast<uint32_t>(indices[order[place]]);
        noiseLoops.particleNoise(thermal.real, particles, to - from, z.data() + 3 * size_t(from));
    });
    iterations = lanczosSquareRoot(*realSpace, realThermal, lanczosTolerance, negativeTolerance,
                                   reorthogonalise);
}

/** u = unit D^{1/2} (realForced + noise realThermal), from places to particles. */
template <class Real>
void CpuEngine<Real>::writeReal(bool forced, Real noise, double unit, std::vector<Vec3>& u) const {
    const std::vector<int>& order = realSpace->order();
    const Real* const scales = realSpace->scales();
    threads.runBlocks(static_cast<int>(order.size()), [&](int from, int to, int) {
        for (int place = from; place < to; place++)
            for (int c = 0; c < 3; c++) {
                const double whole = (scales ? unit * double(scales[place]) : unit);
                const size_t i = 3 * size_t(place) + c;
                const Real forcedPart = (forced ? realForced[i] : 0),
                           thermalPart = (noise > 0 ? noise * realThermal[i] : 0);
                u[order[place]][c] = whole * double(forcedPart + thermalPart);
            }
    });
}

template class CpuEngine<float>;
template class CpuEngine<double>;

} // namespace PSE
