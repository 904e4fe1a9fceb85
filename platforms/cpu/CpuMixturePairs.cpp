// SPDX-License-Identifier: MIT
#include "CpuMixturePairs.h"
#include <algorithm>

using namespace PSE::numerics;

namespace PSE {

static_assert(MIXTURE_CLASSES >= MixtureTable::MOST_CLASSES, "each class has a lane");

template <class Real> CpuMixturePairs<Real>::CpuMixturePairs(const Plan& plan, int threads) {
    const Mixture& mixture = *plan.mixture;
    const std::vector<double>& radii = mixture.radii();
    const MixtureTable table(mixture, plan.tableError);
    const MixtureScales scales(mixture);
    growth = scales.errorGrowth();
    rc = table.rc();
    largestReach = mixture.reach(radii.back());
    degree = table.degree();
    for (double a : radii) {
        const double scale = scales(a);
        radiusOf.push_back(Real(a));
        reachOf.push_back(Real(mixture.reach(a)));
        selfOf.push_back(Real(table.self(a) / (scale * scale)));
        scaleOf.push_back(Real(scale));
        inverseOf.push_back(Real(1 / scale));
        curvatureOf.push_back(Real(1 / a));
    }
    for (std::vector<Real>* array : {&radiusOf, &inverseOf, &curvatureOf})
        array->resize(std::max(radii.size(), size_t(MIXTURE_CLASSES)));
    for (double a : mixture.particleRadii())
        kindOf.push_back(
            static_cast<int32_t>(std::lower_bound(radii.begin(), radii.end(), a) - radii.begin()));
    if (table.interpolates())
        makeBasis(table, radii);
    else
        makeClasses(table);
    rows.assign(threads, std::vector<Real>(size_t(2) * (degree + 1) * basis));
}

template <class Real> double CpuMixturePairs<Real>::bytesPerParticle() {
    return (6 + MixtureTable::MOST_BASIS) * sizeof(Real) + 2 * sizeof(int32_t);
}

/** Each radius has polynomials of its own with every other one. */
template <class Real> void CpuMixturePairs<Real>::makeClasses(const MixtureTable& table) {
    basis = 0;
    const int row = (degree + 1) * MIXTURE_CLASSES;
    functions.assign(size_t(2) * row * table.size(), Real(0));
    for (int m = 0; m < table.size(); m++)
        for (int n = 0; n < table.size(); n++)
            for (int power = 0; power <= degree; power++) {
                Real* const at =
                    functions.data() + size_t(2) * m * row + (degree - power) * MIXTURE_CLASSES + n;
                at[0] = Real(table.F(m, n).powers[power]);
                at[row] = Real(table.C(m, n).powers[power]);
            }
}

template <class Real>
void CpuMixturePairs<Real>::makeBasis(const MixtureTable& table, const std::vector<double>& radii) {
    basis = table.size();
    const int row = (degree + 1) * basis;
    functions.resize(size_t(2) * row * basis);
    for (int m = 0; m < basis; m++)
        for (int n = 0; n < basis; n++)
            for (int power = 0; power <= degree; power++) {
                Real* const at =
                    functions.data() + size_t(2) * m * row + (degree - power) * basis + n;
                at[0] = Real(table.F(m, n).powers[power]);
                at[row] = Real(table.C(m, n).powers[power]);
            }
    for (double a : radii)
        for (double c : table.weights(a))
            weights.push_back(Real(c));
}

template <class Real> void CpuMixturePairs<Real>::begin(int particles) {
    for (std::vector<Real>* array : {&reach, &self, &scale})
        array->resize(particles + PAIR_LANES);
    kind.resize(particles + PAIR_LANES);
}

template <class Real>
void CpuMixturePairs<Real>::place(const std::vector<int>& particleAt, int from, int to) {
    for (int place = from; place < to; place++) {
        const int32_t own = kindOf[particleAt[place]];
        kind[place] = own;
        reach[place] = reachOf[own];
        self[place] = selfOf[own];
        scale[place] = scaleOf[own];
    }
}

template <class Real> MixturePairs<Real> CpuMixturePairs<Real>::pairs() const {
    return {reach.data(),        kind.data(), radiusOf.data(), inverseOf.data(), curvatureOf.data(),
            Real(2 / (rc * rc)), degree,      basis,           weights.data()};
}

/** The polynomials of the pairs of place i: P_n = sum over m of c_m(ai) (polynomial m, n). */
template <class Real> MixtureRow<Real> CpuMixturePairs<Real>::rowOf(int thread, int i) {
    const size_t row = size_t(degree + 1) * (basis == 0 ? MIXTURE_CLASSES : basis);
    if (basis == 0) {
        const Real* const own = functions.data() + 2 * row * kind[i];
        return {own, own + row};
    }
    Real* const own = rows[thread].data();
    kernels.combine(basis, weights.data() + size_t(kind[i]) * basis, 2 * row, functions.data(),
                    own);
    return {own, own + row};
}

template <class Real>
int CpuMixturePairs<Real>::fillRow(int thread, const PairGeometry<Real>& geometry, int i,
                                   const PairRun* runs, int numRuns,
                                   const PairScratch<Real>& scratch, PairBlock<Real>* row) {
    return kernels.fillRow(geometry, pairs(), rowOf(thread, i), i, runs, numRuns, scratch, row);
}

template <class Real>
void CpuMixturePairs<Real>::evaluateRow(int thread, int i, int count, int last,
                                        PairBlock<Real>* row) {
    kernels.evaluateBlocks(pairs(), rowOf(thread, i), i, count, last, row);
}

template class CpuMixturePairs<float>;
template class CpuMixturePairs<double>;

} // namespace PSE
