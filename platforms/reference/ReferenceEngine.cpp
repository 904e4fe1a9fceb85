// SPDX-License-Identifier: MIT
#include "ReferenceEngine.h"
#include "LanczosSpace.h"
#include "numerics/Lanczos.h"
#include "numerics/SphericalBessel.h"
#include "openmm/OpenMMException.h"
#include <algorithm>
#include <cmath>

using namespace PSE::numerics;
using std::complex;

namespace PSE {

ReferenceEngine::ReferenceEngine(const Plan& plan, const Lattice& box, double viscosity,
                                 const std::vector<int>& indices, StageClock& clock)
    : plan(plan), box(box), viscosity(viscosity), selfMobility(1 / (6 * M_PI * viscosity * plan.a)),
      indices(indices), clock(clock) {
    if (plan.hasRealHalf())
        prepareRealHalf();
    listModes();
}

void ReferenceEngine::prepareRealHalf() {
    if (!plan.mixture) {
        table = makeRealTable(*plan.split, plan.realCutoff / plan.a, plan.tableError);
        realSelf.assign(indices.size(), table.self);
        return;
    }
    mixtureTable.reset(new MixtureTable(*plan.mixture, plan.tableError));
    const MixtureScales scaleOf(*plan.mixture);
    errorGrowth = scaleOf.errorGrowth();
    for (double a : plan.mixture->particleRadii()) {
        realSelf.push_back(mixtureTable->self(a));
        scales.push_back(scaleOf(a));
    }
}

void ReferenceEngine::setBox(const Lattice& moved) {
    clock.start();
    box = moved;
    listModes();
    clock.charge(MOVING_BOX);
}

void ReferenceEngine::listModes() {
    modes.clear();
    const Matrix3 waves = box.waveVectors();
    // Nyquist planes are dropped
    const int limit[3] = {(plan.grid[0] - 1) / 2, (plan.grid[1] - 1) / 2, (plan.grid[2] - 1) / 2};
    for (int n1 = -limit[0]; n1 <= limit[0]; n1++)
        for (int n2 = -limit[1]; n2 <= limit[1]; n2++)
            for (int n3 = 0; n3 <= limit[2]; n3++) {
                if (!isCanonicalMode(n1, n2, n3))
                    continue;
                const Vec3 k = waves * Vec3(n1, n2, n3);
                const double reduced = k.norm() * plan.a;
                const double weight = plan.mixture ? plan.mixture->envelope(reduced)
                                                   : plan.split->waveWeight(reduced);
                if (weight > 0)
                    modes.push_back({{n1, n2, n3},
                                     k.normalized(),
                                     reduced,
                                     weight / (viscosity * box.volume() * k.squaredNorm())});
            }
}

void ReferenceEngine::setPositions(const std::vector<Vec3>& x) {
    clock.start();
    positions.resize(x.size());
    for (size_t i = 0; i < x.size(); i++)
        positions[i] = box.wrapped(x[i]);
    pairs.clear();
    if (plan.sumImages)
        listImages();
    else if (plan.hasRealHalf())
        listNeighbours();
    preparePhases();
    clock.charge("neighbour list");
}

void ReferenceEngine::addPair(int i, int j, const Vec3& d) {
    const Vec3 reduced = d / plan.a;
    SmoothScalars s;
    if (realPair(i, j, reduced.norm(), s))
        pairs.push_back({i, j, reduced, s.F, s.C});
}

bool ReferenceEngine::realPair(int i, int j, double r, SmoothScalars& scalars) const {
    if (!plan.mixture) {
        if (r < table.rc)
            scalars = table(r);
        return r < table.rc;
    }
    const std::vector<double>& radii = plan.mixture->particleRadii();
    if (r >= plan.mixture->range(radii[i], radii[j]))
        return false;
    scalars = (*mixtureTable)(r, radii[i], radii[j]);
    return true;
}

/** All pairs, one by one: cheap beside the sums over modes, and evidently complete in any box. */
void ReferenceEngine::listNeighbours() {
    const int n = static_cast<int>(positions.size());
    for (int i = 0; i < n; i++)
        for (int j = i + 1; j < n; j++)
            addPair(i, j, box.minimumImage(positions[i] - positions[j]));
}

void ReferenceEngine::listImages() {
    const std::vector<Vec3> images = box.imagesWithin(plan.realCutoff);
    const int n = static_cast<int>(positions.size());
    for (int i = 0; i < n; i++)
        for (int j = i; j < n; j++)
            for (const Vec3& image : images)
                if (i != j || image != Vec3::Zero())
                    addPair(i, j, positions[i] - positions[j] + image);
}

void ReferenceEngine::preparePhases() {
    for (int d = 0; d < 3; d++) {
        const int reach = plan.grid[d] / 2;
        phases[d].resize(positions.size() * (2 * reach + 1));
        for (size_t i = 0; i < positions.size(); i++) {
            const double angle = 2 * M_PI * box.fractional(positions[i])[d];
            for (int n = -reach; n <= reach; n++)
                phases[d][i * (2 * reach + 1) + reach + n] = std::polar(1.0, n * angle);
        }
    }
}

complex<double> ReferenceEngine::phase(int particle, const Mode& mode) const {
    complex<double> product = 1;
    for (int d = 0; d < 3; d++) {
        const int reach = plan.grid[d] / 2;
        product *= phases[d][particle * (2 * reach + 1) + reach + mode.n[d]];
    }
    return product;
}

void ReferenceEngine::multiplyReal(const Vectors& v, Vectors& out) const {
    for (size_t i = 0; i < v.size(); i++)
        out[i] = realSelf[i] * v[i];
    for (const Pair& p : pairs) {
        out[p.i] += p.F * v[p.j] + p.C * p.d.dot(v[p.j]) * p.d;
        // An image of the particle itself is listed with its opposite: once is enough.
        if (p.i != p.j)
            out[p.j] += p.F * v[p.i] + p.C * p.d.dot(v[p.i]) * p.d;
    }
}

/** out = X v, the scaled M_R of a mixture, or M_R itself. */
void ReferenceEngine::multiplyScaled(const Vectors& v, Vectors& out) const {
    if (scales.empty()) {
        multiplyReal(v, out);
        return;
    }
    Vectors unscaled(v);
    for (size_t i = 0; i < v.size(); i++)
        unscaled[i] /= scales[i];
    multiplyReal(unscaled, out);
    for (size_t i = 0; i < v.size(); i++)
        out[i] /= scales[i];
}

void ReferenceEngine::addReal(const Vectors* forces, const Thermal* thermal, Vectors& u) {
    Vectors part(u.size());
    if (forces != NULL) {
        multiplyReal(*forces, part);
        for (size_t i = 0; i < u.size(); i++)
            u[i] += selfMobility * part[i];
    }
    if (thermal != NULL) {
        LanczosSpace space(u.size(),
                           [this](const Vectors& v, Vectors& out) { multiplyScaled(v, out); });
        Vectors& z = space.basis(0);
        for (size_t i = 0; i < u.size(); i++)
            particleNoise(thermal->real, indices[i], z[i].data());
        // Eigenvalues of the truncated M_R may lie below zero by the error of the truncation.
        const double negative = std::max(2 * plan.predictedError * errorGrowth, 1e-10);
        iterations = lanczosSquareRoot(
            space, part,
            LanczosTridiagonal(LANCZOS_TOLERANCE, negative, LanczosTridiagonal::EXACT_REAL_HALF),
            true);
        const double scale = std::sqrt(2 * thermal->kT * selfMobility / thermal->dt);
        for (size_t i = 0; i < u.size(); i++)
            u[i] += (scales.empty() ? scale : scale * scales[i]) * part[i];
    }
}

void ReferenceEngine::addWaves(const Vectors* forces, const Thermal* thermal, Vectors& u) const {
    const int n = static_cast<int>(u.size());
    std::vector<complex<double>> e(n);
    for (const Mode& mode : modes) {
        Eigen::Vector3cd wave = Eigen::Vector3cd::Zero();
        for (int i = 0; i < n; i++) {
            e[i] = phase(i, mode);
            if (plan.mixture) // a sphere feels the mean of the wave over its surface
                e[i] *= sinc(mode.k * plan.mixture->particleRadii()[i]);
            if (forces != NULL)
                wave += mode.B * std::conj(e[i]) * (*forces)[i];
        }
        if (thermal != NULL) {
            complex<double> z[3];
            modeNoise(thermal->wave, mode.n[0], mode.n[1], mode.n[2], z);
            wave += std::sqrt(2 * thermal->kT * mode.B / thermal->dt) *
                    Eigen::Vector3cd(z[0], z[1], z[2]);
        }
        wave -= mode.direction * (mode.direction.cast<complex<double>>().dot(wave));
        for (int i = 0; i < n; i++) // the mode and its conjugate
            u[i] += 2 * (e[i] * wave).real();
    }
}

void ReferenceEngine::computeVelocities(const Vectors* forces, const Thermal* thermal, Vectors& u) {
    u.assign(positions.size(), Vec3::Zero());
    clock.start();
    if (plan.hasRealHalf()) {
        addReal(forces, thermal, u);
        clock.charge("real space");
    }
    addWaves(forces, thermal, u);
    clock.charge("wave space");
}

} // namespace PSE
