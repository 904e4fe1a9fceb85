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

/** An integer as wide as a Real. */
template <class Real> using Kind = std::conditional_t<sizeof(Real) == 4, int32_t, int64_t>;

/** One number out of MIXTURE_CLASSES for each lane. */
template <class D, class Indices, class Real = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> chosen(D d, const Real* HWY_RESTRICT numbers, Indices kinds) {
    if constexpr (hn::MaxLanes(D()) == MIXTURE_CLASSES)
        return hn::TableLookupLanes(hn::LoadU(d, numbers), hn::IndicesFromVec(d, kinds));
    else
        return hn::GatherIndex(d, numbers, kinds);
}

/** What pairs with lanes of spheres of these kinds need to know of them. */
template <class D> struct OtherSpheres { hn::Vec<D> radius, inverse, curvature, waveF, waveC; };

/** Each with its own polynomial out of a few. */
template <class D, class Real, class V = hn::Vec<D>>
HWY_INLINE OtherSpheres<D> ofClasses(D d, const MixturePairs<Real>& pairs,
                                     const MixtureRow<Real>& table,
                                     const Kind<Real>* HWY_RESTRICT of, V t) {
    const auto kinds = hn::LoadU(hn::RebindToSigned<D>(), of);
    auto F = chosen(d, table.F, kinds), C = chosen(d, table.C, kinds);
    for (int power = 1; power <= pairs.degree; power++) {
        F = hn::MulAdd(F, t, chosen(d, table.F + power * MIXTURE_CLASSES, kinds));
        C = hn::MulAdd(C, t, chosen(d, table.C + power * MIXTURE_CLASSES, kinds));
    }
    return {chosen(d, pairs.radius, kinds), chosen(d, pairs.inverse, kinds),
            chosen(d, pairs.curvature, kinds), F, C};
}

/** Each with weights of the basis functions. */
template <class D, class Real, class V = hn::Vec<D>>
HWY_INLINE OtherSpheres<D> ofBasis(D d, const MixturePairs<Real>& pairs,
                                   const MixtureRow<Real>& table, const Kind<Real>* HWY_RESTRICT of,
                                   V t) {
    constexpr int MOST = 64; // more than MixtureTable::MOST_BASIS
    Real weights[MOST * PAIR_LANES], radius[PAIR_LANES], inverse[PAIR_LANES], curvature[PAIR_LANES];
    const int lanes = static_cast<int>(hn::Lanes(d));
    for (int lane = 0; lane < lanes; lane++) {
        const Real* own = pairs.weights + size_t(of[lane]) * pairs.basis;
        radius[lane] = pairs.radius[of[lane]];
        inverse[lane] = pairs.inverse[of[lane]];
        curvature[lane] = pairs.curvature[of[lane]];
        for (int n = 0; n < pairs.basis; n++)
            weights[n * lanes + lane] = own[n];
    }
    const Real *HWY_RESTRICT rowF = table.F, *HWY_RESTRICT rowC = table.C;
    V F = hn::Zero(d), C = hn::Zero(d);
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
    return {hn::LoadU(d, radius), hn::LoadU(d, inverse), hn::LoadU(d, curvature), F, C};
}

/** Scaled F and C of one block of particle i; lanes from `used` on count for nothing. */
template <bool CLASSES, class Real>
HWY_INLINE void evaluateBlock(const MixturePairs<Real>& pairs, const MixtureRow<Real>& table, int i,
                              const int32_t* HWY_RESTRICT found, int used, PairBlock<Real>& p) {
    const hn::CappedTag<Real, PAIR_LANES> d;
    Kind<Real> kinds[PAIR_LANES];
    for (int k = 0; k < PAIR_LANES; k++)
        kinds[k] = pairs.kind[found[k]];
    const int own = pairs.kind[i];
    const auto ai = hn::Set(d, pairs.radius[own]), inverse = hn::Set(d, pairs.inverse[own]);
    const auto curvature = hn::Set(d, pairs.curvature[own]), scale = hn::Set(d, pairs.scale);
    for (int k = 0; k < PAIR_LANES; k += static_cast<int>(hn::Lanes(d))) {
        const auto dx = hn::LoadU(d, p.dx + k), dy = hn::LoadU(d, p.dy + k),
                   dz = hn::LoadU(d, p.dz + k);
        const auto r2 = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz)));
        const auto t = hn::MulSub(scale, r2, hn::Set(d, Real(1)));
        hn::Vec<decltype(d)> F, C;
        const auto safe2 = hn::Max(r2, hn::Set(d, Real(SMALLEST_R2<Real>)));
        const auto other = CLASSES ? ofClasses(d, pairs, table, kinds + k, t)
                                   : ofBasis(d, pairs, table, kinds + k, t);
        rpyOfUnequal(d, safe2, hn::Div(hn::Set(d, Real(1)), hn::Sqrt(safe2)), ai, other.radius,
                     hn::Mul(curvature, other.curvature), F, C);
        const int left = used - k; // in these lanes
        const auto inUse = hn::FirstN(d, left > 0 ? size_t(left) : 0);
        const auto both = hn::IfThenElseZero(inUse, hn::Mul(inverse, other.inverse));
        hn::StoreU(hn::IfThenElseZero(inUse, hn::Mul(both, hn::Sub(F, other.waveF))), d, p.F + k);
        hn::StoreU(hn::IfThenElseZero(inUse, hn::Mul(both, hn::Sub(C, other.waveC))), d, p.C + k);
    }
}

template <bool CLASSES, class Real>
void evaluateBlocksOf(const MixturePairs<Real>& pairs, const MixtureRow<Real>& table, int i,
                      int count, int last, PairBlock<Real>* blocks) {
    for (int b = 0; b < count; b++) {
        int32_t found[PAIR_LANES];
        for (int k = 0; k < PAIR_LANES; k++)
            found[k] = blocks[b].offset[k] / 3;
        evaluateBlock<CLASSES>(pairs, table, i, found, b == count - 1 ? last : PAIR_LANES,
                               blocks[b]);
    }
}

template <class Real>
void evaluateBlocksAny(const MixturePairs<Real>& pairs, const MixtureRow<Real>& table, int i,
                       int count, int last, PairBlock<Real>* blocks) {
    if (pairs.basis == 0)
        evaluateBlocksOf<true>(pairs, table, i, count, last, blocks);
    else
        evaluateBlocksOf<false>(pairs, table, i, count, last, blocks);
}

template <bool CLASSES, class Real>
int fillRowOf(const PairGeometry<Real>& geometry, const MixturePairs<Real>& pairs,
              const MixtureRow<Real>& table, int i, const PairRun* runs, int numRuns,
              const PairScratch<Real>& scratch, PairBlock<Real>* row) {
    const Real own = pairs.reach[i];
    return fillRowWith(
        geometry, i,
        [&](auto d, int j) HWY_ATTR {
            const auto range = hn::Add(hn::Set(d, own), hn::LoadU(d, pairs.reach + j));
            return hn::Mul(range, range);
        },
        [&](const int32_t* neighbours, int used, PairBlock<Real>& block)
            HWY_ATTR { evaluateBlock<CLASSES>(pairs, table, i, neighbours, used, block); },
        runs, numRuns, scratch, row);
}

template <class Real>
int fillRowAny(const PairGeometry<Real>& geometry, const MixturePairs<Real>& pairs,
               const MixtureRow<Real>& table, int i, const PairRun* runs, int numRuns,
               const PairScratch<Real>& scratch, PairBlock<Real>* row) {
    return pairs.basis == 0
               ? fillRowOf<true>(geometry, pairs, table, i, runs, numRuns, scratch, row)
               : fillRowOf<false>(geometry, pairs, table, i, runs, numRuns, scratch, row);
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
