// SPDX-License-Identifier: MIT
#include "CpuWindowSpread.h"
#include "numerics/Window.h"

using namespace PSE::numerics;

namespace PSE {

template <class Real>
CpuWindowSpread<Real>::CpuWindowSpread(const Plan& plan)
    : Base(plan.grid, paddedSupport(plan.windowSupport)), support(plan.windowSupport) {
    const std::vector<Polynomial> pieces =
        Window(support, plan.windowShape).polynomials(plan.windowError);
    windowDegree = pieces[0].degree();
    windowCoefficients.assign((windowDegree + 1) * padded, Real(0));
    for (int power = 0; power <= windowDegree; power++)
        for (int j = 0; j < support; j++)
            windowCoefficients[(windowDegree - power) * padded + j] = Real(pieces[j].powers[power]);
}

template <class Real> double CpuWindowSpread<Real>::bytesPerParticle(const Plan& plan) {
    return 3.0 * (paddedSupport(plan.windowSupport) + 1) * sizeof(Real) + 5 * sizeof(int);
}

template <class Real> void CpuWindowSpread<Real>::begin(int particles) {
    Base::begin(particles);
    weights.resize(3 * size_t(particles) * padded);
}

/**
 * Where the window of a particle at u begins, in grid units: ceil(u - P/2). Truncation is in line
 * on every machine, std::ceil a call.
 */
template <class Real> int CpuWindowSpread<Real>::windowStart(double u) const {
    const double shifted = u + 0.5 * support; // positive
    const int below = static_cast<int>(shifted);
    return below + (below < shifted) - support;
}

template <class Real>
void CpuWindowSpread<Real>::assign(const std::vector<Vec3>& fractions, int from, int to) {
    for (int i = from; i < to; i++)
        this->setColumn(i, wrapped(0, windowStart(fractions[i][0] * size[0])),
                        wrapped(1, windowStart(fractions[i][1] * size[1])));
}

template <class Real>
void CpuWindowSpread<Real>::place(const std::vector<Vec3>& fractions, int from, int to) {
    Real offsets[3 * Threads::BLOCK];
    for (int slot = from; slot < to; slot++) {
        // Along x and y what assign() found: the column and the window must not disagree.
        const Vec3& s = fractions[order[slot]];
        int* const mine = first.data() + 3 * size_t(slot);
        mine[0] = this->columnX(order[slot]);
        mine[1] = this->columnY(order[slot]);
        mine[2] = wrapped(2, windowStart(s[2] * size[2]));
        for (int d = 0; d < 3; d++) {
            const double u = s[d] * size[d];
            const int start = (mine[d] > u ? mine[d] - size[d] : mine[d]); // always below u
            offsets[3 * (slot - from) + d] = Real(2 * (start - u) + support - 1);
        }
    }
    loops.evaluateWindows({windowDegree, padded, windowCoefficients.data()}, offsets, to - from,
                          weights.data() + 3 * size_t(from) * padded);
}

template <class Real> GridParticles<Real> CpuWindowSpread<Real>::particles() const {
    return {support,      padded,         {size[0], size[1], size[2]},
            rowLength,    planeLength,    columnStart.data(),
            first.data(), weights.data(), sorted.data()};
}

template <class Real>
void CpuWindowSpread<Real>::spreadPlanes(int x, int, Real* const planes[3]) const {
    loops.spreadPlane(particles(), x, planes);
}

template <class Real>
void CpuWindowSpread<Real>::gather(const Real* const grids[3], int from, int to) {
    loops.gatherVelocities(particles(), from, to, grids, sorted.data());
}

template class CpuWindowSpread<float>;
template class CpuWindowSpread<double>;

} // namespace PSE
