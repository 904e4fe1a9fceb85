// SPDX-License-Identifier: MIT
#include "CpuAllPairs.h"
#include <algorithm>
#include <cmath>
#include <limits>

using namespace PSE::numerics;

namespace PSE {

namespace {
constexpr double MOST_RECORDED = 64e6; ///< bytes: 4000 particles in single precision
/// Of the Lanczos tolerance: what rounded coordinates may err by [T57].
constexpr double ROUNDING_SHARE = 0.05;

PairLaw lawOf(const UnboundedPlan& plan) {
    if (plan.model == SphereModel::ForceCoupling)
        return PairLaw::GaussianEnvelopes;
    return plan.equalRadii ? PairLaw::EqualSpheres : PairLaw::UnequalSpheres;
}

} // namespace

template <class Real> int CpuAllPairs<Real>::slabsFor(int particles) {
    return std::clamp(particles / PARTICLES_PER_SLAB, 1, MOST_SLABS);
}

template <class Real>
CpuAllPairs<Real>::CpuAllPairs(const UnboundedPlan& plan, const std::vector<double>& radii,
                               const Threads& threads)
    : KrylovVectors<Real>(threads), a(plan.a),
      farthestNear(2 * ROUNDING_SHARE * plan.lanczosTolerance /
                   std::numeric_limits<Real>::epsilon()),
      count(static_cast<int>(radii.size())),
      padded((count + ALL_PAIRS_LANES - 1) / ALL_PAIRS_LANES * ALL_PAIRS_LANES),
      loops(allPairsKernels<Real>(lawOf(plan))),
      gaussianF(plan.gaussian.F.begin(), plan.gaussian.F.end()),
      gaussianC(plan.gaussian.C.begin(), plan.gaussian.C.end()), radius(padded, Real(1)),
      self(padded, Real(1)), sums(slabsFor(count), Vector(3 * size_t(padded))) {
    this->resize(padded);
    records.resize(sums.size());
    for (int i = 0; i < count; i++) {
        radius[i] = Real(radii[i] / a);
        self[i] = Real(a / radii[i]);
    }
    for (int c = 0; c < 3; c++) {
        places[c].assign(padded, Real(0));
        rests[c].assign(padded, Real(0));
    }
    if (gaussianF.size() % 2 != 0) {
        gaussianF.push_back(0);
        gaussianC.push_back(0);
    }
    divideRows();
    double bytes = 0;
    for (int slab = 0; slab < slabsFor(count); slab++)
        bytes += sizeof(Real) * double(recordSize(count, firstRow[slab], firstRow[slab + 1]));
    mayRecord = bytes <= MOST_RECORDED;
}

/** Slabs of about as many pairs each, starting at multiples of ALL_PAIRS_ROWS. */
template <class Real> void CpuAllPairs<Real>::divideRows() {
    const int slabs = static_cast<int>(sums.size());
    for (int slab = 0; slab < slabs; slab++) {
        const double before = count * (1 - std::sqrt(1 - double(slab) / slabs));
        const int row = static_cast<int>(before) / ALL_PAIRS_ROWS * ALL_PAIRS_ROWS;
        firstRow.push_back(row);
    }
    firstRow.push_back(count);
}

template <class Real> void CpuAllPairs<Real>::setPositions(const std::vector<Vec3>& x) {
    recorded = false;
    const double infinity = std::numeric_limits<double>::infinity();
    Vec3 least = Vec3::Constant(infinity), most = -least;
    for (const Vec3& place : x) {
        least = least.cwiseMin(place);
        most = most.cwiseMax(place);
    }
    const Vec3 middle = 0.5 * (least + most);
    isNear = (most - least).maxCoeff() / (2 * a) <= farthestNear;
    threads.runBlocks(count, [&](int from, int to, int) {
        for (int i = from; i < to; i++)
            for (int c = 0; c < 3; c++) {
                const double reduced = (x[i][c] - middle[c]) / a;
                places[c][i] = Real(reduced);
                rests[c][i] = Real(reduced - double(places[c][i]));
            }
    });
}

template <class Real>
double CpuAllPairs<Real>::multiplyAdd(const Vector& v, double s, const Vector& w, double t,
                                      Vector& out) const {
    const AllPairs<Real> pairs = {count,
                                  padded,
                                  places[0].data(),
                                  places[1].data(),
                                  places[2].data(),
                                  rests[0].data(),
                                  rests[1].data(),
                                  rests[2].data(),
                                  radius.data(),
                                  gaussianF.data(),
                                  gaussianC.data(),
                                  static_cast<int>(gaussianF.size())};
    const bool keeps = keepsRecord || recorded;
    const auto replay = isNear ? loops.addRecordedNear : loops.addRecorded;
    const auto loop = recorded ? replay : keeps ? loops.recordRows : loops.addRows;
    threads.run(static_cast<int>(sums.size()), [&](int slab, int) {
        Vector& mine = sums[slab];
        if (keeps && !recorded)
            records[slab].resize(recordSize(count, firstRow[slab], firstRow[slab + 1]));
        for (int c = 0; c < 3; c++)
            std::fill(mine.begin() + c * size_t(padded) + firstRow[slab],
                      mine.begin() + (c + 1) * size_t(padded), Real(0));
        loop(pairs, firstRow[slab], firstRow[slab + 1], v.data(), mine.data(),
             keeps ? records[slab].data() : nullptr);
    });
    recorded = keeps;
    return this->sumOverTasks([&](int from, int to, int) {
        return addSlabs(from, std::min(to, count), v, s, w, t, out);
    });
}

/** Of places [from, to): all slabs, and what is not a pair. @return v . out */
template <class Real>
double CpuAllPairs<Real>::addSlabs(int from, int to, const Vector& v, double s, const Vector& w,
                                   double t, Vector& out) const {
    double sum[Threads::BLOCK], product = 0;
    for (int c = 0; c < 3; c++) {
        const size_t offset = c * size_t(padded);
        std::fill(sum, sum + (to - from), 0.0);
        for (size_t slab = 0; slab < sums.size(); slab++) {
            const Real* const mine = sums[slab].data() + offset;
            for (int i = std::max(from, firstRow[slab]); i < to; i++)
                sum[i - from] += double(mine[i]);
        }
        for (int i = from; i < to; i++)
            out[offset + i] = Real(s * (double(self[i]) * double(v[offset + i]) + sum[i - from]) +
                                   t * double(w[offset + i]));
        product += kernels.dot(to - from, v.data() + offset + from, out.data() + offset + from);
    }
    return product;
}

template class CpuAllPairs<float>;
template class CpuAllPairs<double>;

} // namespace PSE
