// SPDX-License-Identifier: MIT
#include "PairKernels.h"
#include "numerics/Rpy.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "PairKernels.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>
#include "PairLoops-inl.h"

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/** Horner's rule, coefficients with the highest power first. */
template <class D>
HWY_INLINE hn::Vec<D> polynomial(D d, const hn::TFromD<D>* coefficients, int degree, hn::Vec<D> t) {
    auto sum = hn::Set(d, coefficients[0]);
    for (int power = 1; power <= degree; power++)
        sum = hn::MulAdd(sum, t, hn::Set(d, coefficients[power]));
    return sum;
}

constexpr double SMALLEST_R2 = 1e-30; ///< in radii

/** F and C of RPY at r^2. */
template <class D> struct RpyBranches {
    hn::Vec<D> F, C;
    HWY_INLINE RpyBranches(D d, hn::Vec<D> r2) {
        using Rpy = numerics::RpyCoefficients;
        const auto constant = [&](double value) { return hn::Set(d, hn::TFromD<D>(value)); };
        const auto one = constant(1), zero = hn::Zero(d);
        const auto r = hn::Sqrt(r2), s = hn::Div(one, r), s2 = hn::Mul(s, s);
        // Both regimes, then a choice. At r = 0 the one that is not chosen is infinite, and C
        // counts for nothing; so it does wherever 1/r^2 could overflow.
        const auto overlap = hn::Lt(r, constant(Rpy::CONTACT));
        F = hn::IfThenElse(
            overlap, hn::MulAdd(constant(Rpy::OVERLAP_F1), r, one),
            hn::Mul(s, hn::MulAdd(constant(Rpy::APART_F3), s2, constant(Rpy::APART_F1))));
        const auto G = hn::IfThenElse(
            overlap, hn::MulAdd(constant(Rpy::OVERLAP_G1), r, one),
            hn::Mul(s, hn::MulAdd(constant(Rpy::APART_G3), s2, constant(Rpy::APART_G1))));
        C = hn::IfThenElse(hn::Gt(r2, constant(SMALLEST_R2)), hn::Mul(hn::Sub(G, F), s2), zero);
    }
};
/** Nothing beside the polynomials. */
template <class D> struct NoBranches {
    hn::Vec<D> F, C;
    HWY_INLINE NoBranches(D d, hn::Vec<D>) : F(hn::Zero(d)), C(hn::Zero(d)) {}
};

/** F and C of one block from its displacements; lanes from `used` on count for nothing. */
template <template <class> class Branches, class Real>
HWY_INLINE void evaluateBlock(const PairPolynomials<Real>& table, int used, PairBlock<Real>& p) {
    const hn::CappedTag<Real, PAIR_LANES> d;
    const auto constant = [&](double value) { return hn::Set(d, Real(value)); };
    const auto one = constant(1);
    for (int k = 0; k < PAIR_LANES; k += static_cast<int>(hn::Lanes(d))) {
        const auto dx = hn::LoadU(d, p.dx + k), dy = hn::LoadU(d, p.dy + k),
                   dz = hn::LoadU(d, p.dz + k);
        const auto r2 = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz)));
        const auto t = hn::MulSub(constant(2 / (double(table.rc) * table.rc)), r2, one);
        const auto waveF = polynomial(d, table.F, table.degreeF, t),
                   waveC = polynomial(d, table.C, table.degreeC, t);
        const Branches<decltype(d)> whole(d, r2);
        const int left = used - k; // in these lanes
        const auto inUse = hn::FirstN(d, left > 0 ? size_t(left) : 0);
        hn::StoreU(hn::IfThenElseZero(inUse, hn::Sub(whole.F, waveF)), d, p.F + k);
        hn::StoreU(hn::IfThenElseZero(inUse, hn::Sub(whole.C, waveC)), d, p.C + k);
    }
}

template <class Real>
void evaluateBlocksAny(const PairPolynomials<Real>& table, int count, int last,
                       PairBlock<Real>* blocks) {
    for (int b = 0; b < count; b++) {
        const int used = (b == count - 1 ? last : PAIR_LANES);
        if (table.rpy)
            evaluateBlock<RpyBranches>(table, used, blocks[b]);
        else
            evaluateBlock<NoBranches>(table, used, blocks[b]);
    }
}

template <template <class> class Branches, class Real>
int fillRowOf(const PairGeometry<Real>& geometry, const PairPolynomials<Real>& table, int i,
              const PairRun* runs, int numRuns, const PairScratch<Real>& scratch,
              PairBlock<Real>* row) {
    const Real range2 = geometry.range * geometry.range;
    return fillRowWith(
        geometry, i, [&](auto d, int) HWY_ATTR { return hn::Set(d, range2); },
        [&](const int32_t*, int used, PairBlock<Real>& block)
            HWY_ATTR { evaluateBlock<Branches>(table, used, block); },
        runs, numRuns, scratch, row);
}

template <class Real>
int fillRowAny(const PairGeometry<Real>& geometry, const PairPolynomials<Real>& table, int i,
               const PairRun* runs, int numRuns, const PairScratch<Real>& scratch,
               PairBlock<Real>* row) {
    return table.rpy ? fillRowOf<RpyBranches>(geometry, table, i, runs, numRuns, scratch, row)
                     : fillRowOf<NoBranches>(geometry, table, i, runs, numRuns, scratch, row);
}

/** Sum of v w, accumulated in double. */
template <class Real> double dotAny(int n, const Real* HWY_RESTRICT v, const Real* HWY_RESTRICT w) {
    const hn::ScalableTag<double> dd;
    const hn::Rebind<Real, decltype(dd)> d;
    const int lanes = static_cast<int>(hn::Lanes(dd));
    auto sum0 = hn::Zero(dd), sum1 = hn::Zero(dd);
    const auto load = [&](const Real* p) {
        if constexpr (sizeof(Real) == 4)
            return hn::PromoteTo(dd, hn::LoadU(d, p));
        else
            return hn::LoadU(dd, p);
    };
    int i = 0;
    for (; i + 2 * lanes <= n; i += 2 * lanes) {
        sum0 = hn::MulAdd(load(v + i), load(w + i), sum0);
        sum1 = hn::MulAdd(load(v + i + lanes), load(w + i + lanes), sum1);
    }
    double total = hn::GetLane(hn::SumOfLanes(dd, hn::Add(sum0, sum1)));
    for (; i < n; i++)
        total += double(v[i]) * double(w[i]);
    return total;
}

template <class Real>
void addScaledAny(int n, Real s, const Real* HWY_RESTRICT v, Real* HWY_RESTRICT out) {
    for (int i = 0; i < n; i++)
        out[i] += s * v[i];
}

#if HWY_TARGET == HWY_SCALAR
/** Three numbers of one neighbour. */
template <class D, class Real = hn::TFromD<D>>
HWY_INLINE void loadNeighbours(D d, const Real* HWY_RESTRICT v, const int32_t* HWY_RESTRICT offsets,
                               hn::Vec<D>& x, hn::Vec<D>& y, hn::Vec<D>& z) {
    x = hn::Set(d, v[*offsets]);
    y = hn::Set(d, v[*offsets + 1]);
    z = hn::Set(d, v[*offsets + 2]);
}
#else
/** A vector of one or two blocks of 128 bits, each from an address of its own. */
template <class D, class Real = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> loadBlocks(D d, const Real* low, const Real* high) {
    if constexpr (hn::MaxLanes(D()) * sizeof(Real) == 16) {
        (void)high;
        return hn::LoadU(d, low);
    } else {
        const hn::Half<D> half;
        return hn::Combine(d, hn::LoadU(half, high), hn::LoadU(half, low));
    }
}

/**
 * Three numbers of each neighbour, one vector per component: by loads of whole blocks and
 * transposition, which beats gather instructions. One number beyond the last is read.
 */
template <class D>
HWY_INLINE void loadNeighbours(D d, const float* HWY_RESTRICT v,
                               const int32_t* HWY_RESTRICT offsets, hn::Vec<D>& x, hn::Vec<D>& y,
                               hn::Vec<D>& z) {
    const hn::Repartition<uint64_t, D> pairs;
    const int high = (hn::MaxLanes(D()) == 4 ? 0 : 4);
    const auto block = [&](int k) { return loadBlocks(d, v + offsets[k], v + offsets[high + k]); };
    const auto v0 = block(0), v1 = block(1), v2 = block(2), v3 = block(3);
    const auto low01 = hn::BitCast(pairs, hn::InterleaveLower(d, v0, v1)),
               low23 = hn::BitCast(pairs, hn::InterleaveLower(d, v2, v3)),
               high01 = hn::BitCast(pairs, hn::InterleaveUpper(d, v0, v1)),
               high23 = hn::BitCast(pairs, hn::InterleaveUpper(d, v2, v3));
    x = hn::BitCast(d, hn::InterleaveLower(pairs, low01, low23));
    y = hn::BitCast(d, hn::InterleaveUpper(pairs, low01, low23));
    z = hn::BitCast(d, hn::InterleaveLower(pairs, high01, high23));
}
template <class D>
HWY_INLINE void loadNeighbours(D d, const double* HWY_RESTRICT v,
                               const int32_t* HWY_RESTRICT offsets, hn::Vec<D>& x, hn::Vec<D>& y,
                               hn::Vec<D>& z) {
    const int high = (hn::MaxLanes(D()) == 2 ? 0 : 2);
    const auto block = [&](int k, int c) {
        return loadBlocks(d, v + offsets[k] + c, v + offsets[high + k] + c);
    };
    const auto xy0 = block(0, 0), xy1 = block(1, 0), z0 = block(0, 2), z1 = block(1, 2);
    x = hn::InterleaveLower(d, xy0, xy1);
    y = hn::InterleaveUpper(d, xy0, xy1);
    z = hn::InterleaveLower(d, z0, z1);
}
#endif

template <class Real>
double multiplyRowsAny(const PairRows<Real>& rows, int from, int to, const Real* HWY_RESTRICT v,
                       Real s, const Real* HWY_RESTRICT w, Real t, Real* HWY_RESTRICT out) {
    const hn::CappedTag<Real, 32 / sizeof(Real)> d; // two blocks of 128 bits at most
    const int lanes = static_cast<int>(hn::Lanes(d));
    for (int i = from; i < to; i++) {
        auto x = hn::Zero(d), y = hn::Zero(d), z = hn::Zero(d);
        const PairBlock<Real>* block = rows.blocks + rows.start[i];
        for (int b = 0; b < rows.count[i]; b++, block++)
            for (int k = 0; k < PAIR_LANES; k += lanes) {
                hn::Vec<decltype(d)> vx, vy, vz;
                loadNeighbours(d, v, block->offset + k, vx, vy, vz);
                const auto dx = hn::LoadU(d, block->dx + k), dy = hn::LoadU(d, block->dy + k),
                           dz = hn::LoadU(d, block->dz + k), F = hn::LoadU(d, block->F + k);
                const auto along = hn::Mul(hn::LoadU(d, block->C + k),
                                           hn::MulAdd(dx, vx, hn::MulAdd(dy, vy, hn::Mul(dz, vz))));
                x = hn::MulAdd(along, dx, hn::MulAdd(F, vx, x));
                y = hn::MulAdd(along, dy, hn::MulAdd(F, vy, y));
                z = hn::MulAdd(along, dz, hn::MulAdd(F, vz, z));
            }
        const size_t own = 3 * size_t(i);
        const Real self = (rows.selves == nullptr ? rows.self : rows.selves[i]);
        const Real sum[3] = {hn::GetLane(hn::SumOfLanes(d, x)), hn::GetLane(hn::SumOfLanes(d, y)),
                             hn::GetLane(hn::SumOfLanes(d, z))};
        for (int c = 0; c < 3; c++)
            out[own + c] = s * (self * v[own + c] + sum[c]) + t * w[own + c];
    }
    return dotAny(3 * (to - from), v + 3 * size_t(from), out + 3 * size_t(from));
}

template <class Real> PairKernels<Real> allPairKernels() {
    return {fillRowAny<Real>, evaluateBlocksAny<Real>, multiplyRowsAny<Real>, addScaledAny<Real>,
            dotAny<Real>};
}

// Dispatch tables hold functions, not templates: one name per precision.
PairKernels<float> singlePairKernels() {
    return allPairKernels<float>();
}
PairKernels<double> doublePairKernels() {
    return allPairKernels<double>();
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace PSE {

HWY_EXPORT(singlePairKernels);
HWY_EXPORT(doublePairKernels);

template <> PairKernels<float> pairKernels<float>() {
    return HWY_DYNAMIC_DISPATCH(singlePairKernels)();
}
template <> PairKernels<double> pairKernels<double>() {
    return HWY_DYNAMIC_DISPATCH(doublePairKernels)();
}

} // namespace PSE
#endif
