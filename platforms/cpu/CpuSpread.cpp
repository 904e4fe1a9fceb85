// SPDX-License-Identifier: MIT
#include "CpuSpread.h"
#include "ParticleOrder.h"

using namespace PSE::numerics;

namespace PSE {

template <class Real> void CpuSpread<Real>::begin(int particles) {
    columnOf.resize(particles);
    first.resize(3 * size_t(particles));
    sorted.resize(3 * size_t(particles));
}

template <class Real> void CpuSpread<Real>::sort() {
    sortByKey(columnOf, size[0] * size[1], columnStart, order);
}

template <class Real>
void CpuSpread<Real>::takeForces(const std::vector<Vec3>& forces, double unit, int from, int to) {
    for (int slot = from; slot < to; slot++)
        for (int c = 0; c < 3; c++)
            sorted[3 * size_t(slot) + c] = Real(forces[order[slot]][c] / unit);
}

template <class Real>
void CpuSpread<Real>::addGathered(const Real* const grids[3], double unit, int from, int to,
                                  std::vector<Vec3>& u) {
    gather(grids, from, to);
    for (int slot = from; slot < to; slot++)
        for (int c = 0; c < 3; c++)
            u[order[slot]][c] += unit * double(sorted[3 * size_t(slot) + c]);
}

template class CpuSpread<float>;
template class CpuSpread<double>;

} // namespace PSE
