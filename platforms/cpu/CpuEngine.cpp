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
      reorthogonalise(plan.precision == Precision::Double), indices(indices), box(box),
      threads(pool, isSmall(plan, indices.size())), clock(clock), realSpace(plan, box, threads),
      waveSpace(plan, box, threads) {}

template <class Real> void CpuEngine<Real>::setPositions(const std::vector<Vec3>& x) {
    clock.start();
    const int n = static_cast<int>(x.size());
    fractions.resize(n);
    threads.runBlocks(n, [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            fractions[i] = box.wrappedFractional(x[i]);
    });
    realSpace.setPositions(fractions);
    clock.charge("neighbours and pair coefficients");
    waveSpace.setPositions(fractions);
    clock.charge("window weights");
}

template <class Real>
void CpuEngine<Real>::computeVelocities(const std::vector<Vec3>* forces, const Thermal* thermal,
                                        std::vector<Vec3>& u) {
    const int n = static_cast<int>(indices.size());
    u.resize(n);
    const double thermalForce =
        (thermal == NULL ? 0 : std::sqrt(2 * thermal->kT * drag / thermal->dt));
    const double largest = (forces == NULL ? 0 : largestComponent(*forces));
    const double scale = std::max(largest, thermalForce); // force unit
    const bool forced = largest > 0;
    const Real noise = (scale > 0 ? Real(thermalForce / scale) : 0);
    velocities.assign(3 * size_t(n), Real(0));
    clock.start();
    if (forced) {
        scaledForces.resize(3 * size_t(n));
        threads.runBlocks(n, [&](int from, int to, int) {
            for (int i = from; i < to; i++)
                for (int c = 0; c < 3; c++)
                    scaledForces[3 * size_t(i) + c] = Real((*forces)[i][c] / scale);
        });
        addRealForced();
        clock.charge("real-space velocities");
    }
    if (noise > 0) {
        addRealThermal(*thermal, noise);
        clock.charge("real-space noise (Lanczos)");
    }
    if (scale > 0)
        waveSpace.addVelocities(forced ? scaledForces.data() : NULL, noise,
                                noise > 0 ? thermal->wave : NoiseKey{}, velocities.data(), clock);
    threads.runBlocks(n, [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            for (int c = 0; c < 3; c++)
                u[i][c] = double(velocities[3 * size_t(i) + c]) * (scale / drag);
    });
}

template <class Real>
double CpuEngine<Real>::largestComponent(const std::vector<Vec3>& forces) const {
    const int n = static_cast<int>(forces.size());
    std::vector<double> ofBlock(Threads::blocks(n), 0.0);
    threads.runBlocks(n, [&](int from, int to, int block) {
        for (int i = from; i < to; i++)
            ofBlock[block] = std::max(ofBlock[block], forces[i].cwiseAbs().maxCoeff());
    });
    return ofBlock.empty() ? 0 : *std::max_element(ofBlock.begin(), ofBlock.end());
}

/** velocities += s times a vector in the places of the real-space half. */
template <class Real> void CpuEngine<Real>::addFromPlaces(Real s, const Vector& v) {
    const std::vector<int>& order = realSpace.order();
    threads.runBlocks(static_cast<int>(order.size()), [&](int from, int to, int) {
        for (int place = from; place < to; place++)
            for (int c = 0; c < 3; c++)
                velocities[3 * size_t(order[place]) + c] += s * v[3 * size_t(place) + c];
    });
}

template <class Real> void CpuEngine<Real>::addRealForced() {
    const std::vector<int>& order = realSpace.order();
    Vector& inPlaces = realSpace.basis(0); // free for this use until Lanczos begins
    part.resize(scaledForces.size());
    threads.runBlocks(static_cast<int>(order.size()), [&](int from, int to, int) {
        for (int place = from; place < to; place++)
            for (int c = 0; c < 3; c++)
                inPlaces[3 * size_t(place) + c] = scaledForces[3 * size_t(order[place]) + c];
    });
    realSpace.multiplyAdd(inPlaces, 1, inPlaces, 0, part);
    addFromPlaces(1, part);
}

template <class Real> void CpuEngine<Real>::addRealThermal(const Thermal& thermal, Real noise) {
    const std::vector<int>& order = realSpace.order();
    Vector& z = realSpace.basis(0);
    part.resize(z.size());
    threads.runBlocks(static_cast<int>(order.size()), [&](int from, int to, int) {
        uint32_t particles[Threads::BLOCK]; // indices in the System
        for (int place = from; place < to; place++)
            particles[place - from] = static_cast<uint32_t>(indices[order[place]]);
        noiseLoops.particleNoise(thermal.real, particles, to - from, z.data() + 3 * size_t(from));
    });
    iterations =
        lanczosSquareRoot(realSpace, part, lanczosTolerance, negativeTolerance, reorthogonalise);
    addFromPlaces(noise, part);
}

template class CpuEngine<float>;
template class CpuEngine<double>;

} // namespace PSE
