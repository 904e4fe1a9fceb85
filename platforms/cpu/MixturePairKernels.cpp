// SPDX-License-Identifier: MIT
#include "MixturePairKernels.h"
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "MixturePairKernels.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>
#include "PairLoops-inl.h"
#include "RpyLoops-inl.h"

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/** What the lanes of a block need of the neighbours' radii. */
template <class Real> struct Neighbours {
    Real radius[PAIR_LANES];
    std::conditional_t<sizeof(Real) == 4, int32_t, int64_t> kind[PAIR_LANES];
    const Real* weights[PAIR_LANES];

    HWY_INLINE Neighbours(const MixturePairs<Real>& pairs, const int32_t* HWY_RESTRICT found) {
        for (int k = 0; k < PAIR_LANES; k++) {
            const int j = found[k];
            radius[k] = pairs.radius[j];
            kind[k] = pairs.kind[j];
            weights[k] = pairs.weights + size_t(kind[k]) * pairs.basis;
        }
    }
};

/** One number out of MIXTURE_CLASSES for each lane. */
template <class D, class Indices, class Real = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> chosen(D d, const Real* HWY_RESTRICT numbers, Indices kinds) {
    if constexpr (hn::MaxLanes(D()) == MIXTURE_CLASSES)
        return hn::TableLookupLanes(hn::LoadU(d, numbers), hn::IndicesFromVec(d, kinds));
    else
        return hn::GatherIndex(d, numbers, kinds);
}

/** The wave part in lanes from k on, each with its own polynomial out of a few. */
template <class D, class Real, class V = hn::Vec<D>>
HWY_INLINE void waveOfClasses(D d, const MixturePairs<Real>& pairs, const MixtureRow<Real>& table,
                              const Neighbours<Real>& near, int k, V t, V& F, V& C) {
    const auto kinds = hn::LoadU(hn::RebindToSigned<D>(), near.kind + k);
    F = chosen(d, table.F, kinds);
    C = chosen(d, table.C, kinds);
    for (int power = 1; power <= pairs.degree; power++) {
        F = hn::MulAdd(F, t, chosen(d, table.F + power * MIXTURE_CLASSES, kinds));
        C = hn::MulAdd(C, t, chosen(d, table.C + power * MIXTURE_CLASSES, kinds));
    }
}

/** The same with a weight for each basis function. */
template <class D, class Real, class V = hn::Vec<D>>
HWY_INLINE void waveOfBasis(D d, const MixturePairs<Real>& pairs, const MixtureRow<Real>& table,
                            const Neighbours<Real>& near, int k, V t, V& F, V& C) {
    constexpr int MOST = 64; // more than MixtureTable::MOST_BASIS
    Real weights[MOST * PAIR_LANES];
    const int lanes = static_cast<int>(hn::Lanes(d));
    for (int lane = 0; lane < lanes; lane++)
        for (int n = 0; n < pairs.basis; n++)
            weights[n * lanes + lane] = near.weights[k + lane][n];
    const Real *HWY_RESTRICT rowF = table.F, *HWY_RESTRICT rowC = table.C;
    F = C = hn::Zero(d);
    for (int power = 0; power <= pairs.degree; power++) {
        auto ownF = hn::Zero(d), ownC = hn::Zero(d);
        for (int n = 0; n < pairs.basis; n++) {
            const auto weight = hn::LoadU(d, weights + n * lanes);
            ownF = hn::MulAdd(weight, hn::Set(d, *rowF++), ownF);
            ownC = hn::MulAdd(weight, hn::Set(d, *rowC++), ownC);
        }
        F = hn::MulAdd(F, t, ownF);
        C = hn::MulAdd(C, t, ownC);
    }
}

/** F and C of one block of particle i; lanes from `used` on count for nothing. */
template <class Real>
HWY_INLINE void evaluateBlock(const MixturePairs<Real>& pairs, const MixtureRow<Real>& table, int i,
                              const Neighbours<Real>& near, int used, PairBlock<Real>& p) {
    const hn::CappedTag<Real, PAIR_LANES> d;
    const auto ai = hn::Set(d, pairs.radius[i]);
    const auto scale = hn::Set(d, Real(2 / (double(pairs.rc) * pairs.rc)));
    for (int k = 0; k < PAIR_LANES; k += static_cast<int>(hn::Lanes(d))) {
        const auto dx = hn::LoadU(d, p.dx + k), dy = hn::LoadU(d, p.dy + k),
                   dz = hn::LoadU(d, p.dz + k);
        const auto r2 = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz)));
        const auto t = hn::MulSub(scale, r2, hn::Set(d, Real(1)));
        hn::Vec<decltype(d)> F, C, waveF, waveC;
        const auto safe2 = hn::Max(r2, hn::Set(d, Real(SMALLEST_R2<Real>)));
        rpyOfUnequal(d, safe2, hn::Div(hn::Set(d, Real(1)), hn::Sqrt(safe2)), ai,
                     hn::LoadU(d, near.radius + k), F, C);
        if (pairs.basis == 0)
            waveOfClasses(d, pairs, table, near, k, t, waveF, waveC);
        else
            waveOfBasis(d, pairs, table, near, k, t, waveF, waveC);
        const int left = used - k; // in these lanes
        const auto inUse = hn::FirstN(d, left > 0 ? size_t(left) : 0);
        hn::StoreU(hn::IfThenElseZero(inUse, hn::Sub(F, waveF)), d, p.F + k);
        hn::StoreU(hn::IfThenElseZero(inUse, hn::Sub(C, waveC)), d, p.C + k);
    }
}

template <class Real>
void evaluateBlocksAny(const MixturePairs<Real>& pairs, const MixtureRow<Real>& table, int i,
                       int count, int last, PairBlock<Real>* blocks) {
    for (int b = 0; b < count; b++) {
        int32_t found[PAIR_LANES];
        for (int k = 0; k < PAIR_LANES; k++)
            found[k] = blocks[b].offset[k] / 3;
        evaluateBlock(pairs, table, i, Neighbours<Real>(pairs, found),
                      b == count - 1 ? last : PAIR_LANES, blocks[b]);
    }
}

template <class Real>
int fillRowAny(const PairGeometry<Real>& geometry, const MixturePairs<Real>& pairs,
               const MixtureRow<Real>& table, int i, const PairRun* runs, int numRuns,
               int32_t* found, PairBlock<Real>* row) {
    const Real own = pairs.reach[i];
    return fillRowWith(
        geometry, i,
        [&](auto d, int j) HWY_ATTR {
            const auto range = hn::Add(hn::Set(d, own), hn::LoadU(d, pairs.reach + j));
            return hn::Mul(range, range);
        },
        [&](const int32_t* neighbours, int used, PairBlock<Real>& block) HWY_ATTR {
            evaluateBlock(pairs, table, i, Neighbours<Real>(pairs, neighbours), used, block);
        },
        runs, numRuns, found, row);
}

template <class Real>
void combineAny(int count, const Real* HWY_RESTRICT weights, size_t length,
                const Real* HWY_RESTRICT functions, Real* HWY_RESTRICT out) {
    for (size_t i = 0; i < length; i++)
        out[i] = 0;
    for (int m = 0; m < count; m++)
        for (size_t i = 0; i < length; i++)
            out[i] += weights[m] * functions[m * length + i];
}

// Dispatch tables hold functions, not templates: one name per precision.
MixturePairKernels<float> singleMixturePairKernels() {
    return {fillRowAny<float>, evaluateBlocksAny<float>, combineAny<float>};
}
MixturePairKernels<double> doubleMixturePairKernels() {
    return {fillRowAny<double>, evaluateBlocksAny<double>, combineAny<double>};
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace PSE {

HWY_EXPORT(singleMixturePairKernels);
HWY_EXPORT(doubleMixturePairKernels);

template <> MixturePairKernels<float> mixturePairKernels<float>() {
    return HWY_DYNAMIC_DISPATCH(singleMixturePairKernels)();
}
template <> MixturePairKernels<double> mixturePairKernels<double>() {
    return HWY_DYNAMIC_DISPATCH(doubleMixturePairKernels)();
}

} // namespace PSE
#endif
