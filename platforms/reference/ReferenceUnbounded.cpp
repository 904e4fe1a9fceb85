// SPDX-License-Identifier: MIT
#include "ReferenceUnbounded.h"
#include "LanczosSpace.h"
#include "numerics/Lanczos.h"
#include <cmath>

using namespace PSE::numerics;

namespace PSE {

ReferenceUnbounded::ReferenceUnbounded(const UnboundedPlan& plan, const std::vector<double>& all,
                                       double viscosity, const std::vector<int>& indices,
                                       StageClock& clock)
    : plan(plan), unit(1 / (6 * M_PI * viscosity * plan.a)), indices(indices), clock(clock) {
    for (double radius : all)
        radii.push_back(radius / plan.a);
}

void ReferenceUnbounded::setPositions(const Vectors& x) {
    positions.resize(x.size());
    for (size_t i = 0; i < x.size(); i++)
        positions[i] = x[i] / plan.a;
}

void ReferenceUnbounded::multiply(const Vectors& v, Vectors& out) const {
    for (size_t i = 0; i < v.size(); i++)
        out[i] = v[i] / radii[i];
    for (size_t i = 0; i < v.size(); i++)
        for (size_t j = 0; j < i; j++) {
            const Vec3 d = positions[i] - positions[j];
            const double r = d.norm();
            const PairScalars m = totalScalars(plan.model, r, radii[i], radii[j]);
            // Coincident particles have no direction, and need none: F = G there.
            const Vec3 along = r > 0 ? Vec3(d / r) : Vec3(Vec3::Zero());
            out[i] += m.F * v[j] + (m.G - m.F) * along.dot(v[j]) * along;
            out[j] += m.F * v[i] + (m.G - m.F) * along.dot(v[i]) * along;
        }
}

void ReferenceUnbounded::computeVelocities(const Vectors* forces, const Thermal* thermal,
                                           Vectors& u) {
    clock.start();
    u.assign(positions.size(), Vec3::Zero());
    Vectors part(u.size());
    if (forces != NULL) {
        multiply(*forces, part);
        for (size_t i = 0; i < u.size(); i++)
            u[i] += unit * part[i];
        clock.charge("velocities");
    }
    if (thermal == NULL)
        return;
    LanczosSpace space(u.size(), [this](const Vectors& v, Vectors& out) { multiply(v, out); });
    Vectors& z = space.basis(0);
    for (size_t i = 0; i < u.size(); i++)
        particleNoise(thermal->real, indices[i], z[i].data());
    iterations = lanczosSquareRoot(space, part,
                                   LanczosTridiagonal(plan.lanczosTolerance, plan.negativeTolerance,
                                                      LanczosTridiagonal::WHOLE),
                                   true);
    const double scale = std::sqrt(2 * thermal->kT * unit / thermal->dt);
    for (size_t i = 0; i < u.size(); i++)
        u[i] += scale * part[i];
    clock.charge("noise (Lanczos)");
}

} // namespace PSE
