// SPDX-License-Identifier: MIT
#include "AllPairsKernels.h"
#include "numerics/GaussianPairs.h"
#include "numerics/Rpy.h"
#include <type_traits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "AllPairsKernels.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>
#include "RpyLoops-inl.h"

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/** 1/sqrt(r2); in single precision to 3e-7 by one step of Newton's from the hardware's estimate. */
template <class D> HWY_INLINE hn::Vec<D> inverseRoot(D d, hn::Vec<D> r2) {
    using Real = hn::TFromD<D>;
#if HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128 && HWY_ARCH_X86
    if constexpr (sizeof(Real) == 4) {
        const auto s = hn::ApproximateReciprocalSqrt(r2);
        const auto half = hn::Mul(hn::Set(d, Real(-0.5)), r2);
        return hn::Mul(s, hn::MulAdd(hn::Mul(half, s), s, hn::Set(d, Real(1.5))));
    }
#endif
    return hn::Div(hn::Set(d, Real(1)), hn::Sqrt(r2));
}

/**
 * F and C = (G - F)/r^2 of the Rotne-Prager-Yamakawa tensor of spheres of radius 1, by selection
 * [T3].
 */
struct EqualSpheres {
    template <class D, class Real = hn::TFromD<D>>
    HWY_INLINE void operator()(D d, const AllPairs<Real>&, int, int, hn::Vec<D> r2, hn::Vec<D>& F,
                               hn::Vec<D>& C) const {
        using c = numerics::RpyCoefficients;
        const auto constant = [&](double value) { return hn::Set(d, Real(value)); };
        r2 = hn::Max(r2, constant(SMALLEST_R2<Real>));
        const auto s = inverseRoot(d, r2), s2 = hn::Mul(s, s);
        const auto overlap = hn::Lt(r2, constant(c::CONTACT * c::CONTACT));
        const auto apartF =
            hn::Mul(s, hn::MulAdd(constant(c::APART_F3), s2, constant(c::APART_F1)));
        const auto apartC = hn::Mul(s2, hn::MulAdd(constant(c::APART_G3 - c::APART_F3), s2,
                                                   constant(c::APART_G1 - c::APART_F1)));
        const auto overlapF = hn::MulAdd(constant(c::OVERLAP_F1), hn::Mul(r2, s), constant(1));
        F = hn::IfThenElse(overlap, overlapF, apartF);
        C = hn::Mul(s, hn::IfThenElse(overlap, constant(c::OVERLAP_G1 - c::OVERLAP_F1), apartC));
    }
};

/** The same of spheres of any radii, apart, overlapping, or one inside the other [T24]. */
struct UnequalSpheres {
    template <class D, class Real = hn::TFromD<D>>
    HWY_INLINE void operator()(D d, const AllPairs<Real>& p, int i, int j, hn::Vec<D> r2,
                               hn::Vec<D>& F, hn::Vec<D>& C) const {
        r2 = hn::Max(r2, hn::Set(d, Real(SMALLEST_R2<Real>)));
        const auto own = hn::Set(d, p.radius[i]), other = hn::LoadU(d, p.radius + j);
        const auto inverse = hn::Div(hn::Set(d, Real(1)), hn::Mul(own, other));
        rpyOfUnequal(d, r2, inverseRoot(d, r2), own, other, inverse, F, C);
    }
};

/** The force-coupling tensor of spheres of any radii, by the polynomials of GaussianPairs [T53]. */
struct GaussianEnvelopes {
    template <class D, class Real = hn::TFromD<D>>
    HWY_INLINE void operator()(D d, const AllPairs<Real>& p, int i, int j, hn::Vec<D> r2,
                               hn::Vec<D>& F, hn::Vec<D>& C) const {
        const auto own = hn::Set(d, p.radius[i]), other = hn::LoadU(d, p.radius + j);
        const auto squares = hn::MulAdd(own, own, hn::Mul(other, other));
        const auto spread = hn::Set(d, Real(numerics::GaussianPairs::SPREAD));
        const auto s = inverseRoot(d, hn::MulAdd(spread, r2, squares)), s2 = hn::Mul(s, s);
        const auto t = hn::MulSub(hn::Add(squares, squares), s2, hn::Set(d, Real(1)));
        // even and odd powers apart: four short chains of dependent operations instead of two
        const auto t2 = hn::Mul(t, t);
        const auto term = [&](const Real* all, int n) { return hn::Set(d, all[n]); };
        int n = p.terms - 2;
        auto evenF = term(p.gaussianF, n), oddF = term(p.gaussianF, n + 1),
             evenC = term(p.gaussianC, n), oddC = term(p.gaussianC, n + 1);
        for (n -= 2; n >= 0; n -= 2) {
            evenF = hn::MulAdd(evenF, t2, term(p.gaussianF, n));
            oddF = hn::MulAdd(oddF, t2, term(p.gaussianF, n + 1));
            evenC = hn::MulAdd(evenC, t2, term(p.gaussianC, n));
            oddC = hn::MulAdd(oddC, t2, term(p.gaussianC, n + 1));
        }
        F = hn::Mul(s, hn::MulAdd(oddF, t, evenF));
        C = hn::Mul(hn::Mul(s, s2), hn::MulAdd(oddC, t, evenC));
    }
};

/**
 * Where F and C come from: from the law alone, or with a record of them for later, or from that
 * record; then perhaps with displacements by the first numbers of coordinates alone.
 */
enum class Scalars { Evaluated, Recorded, Replayed, ReplayedNear };

/** What the loop over columns needs to know of its row. */
template <class Real> struct Row {
    Row(const AllPairs<Real>& p, int i, const Real* v)
        : i(i), x(p.x[i]), y(p.y[i]), z(p.z[i]), vx(v[i]), vy(v[p.stride + i]),
          vz(v[2 * size_t(p.stride) + i]) {
        if (sizeof(Real) == 4) {
            restX = p.restX[i];
            restY = p.restY[i];
            restZ = p.restZ[i];
        }
    }
    int i;
    Real x, y, z, restX = 0, restY = 0, restZ = 0, vx, vy, vz;
};

/** Difference of two coordinates, high parts first: they cancel without an error. */
template <bool RESTS, class D, class Real = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> displacement(D d, Real own, Real ownRest, const Real* HWY_RESTRICT other,
                                   const Real* HWY_RESTRICT otherRest) {
    const auto whole = hn::Sub(hn::Set(d, own), hn::LoadU(d, other));
    if constexpr (!RESTS)
        return whole;
    else
        return hn::Add(whole, hn::Sub(hn::Set(d, ownRest), hn::LoadU(d, otherRest)));
}

/**
 * Both sides of the pairs of a row with the columns from j on.
 * @param v  of the columns; u: sums of the row; w: of the columns
 * @tparam DIAGONAL  only columns beyond the row
 */
template <bool DIAGONAL, Scalars SCALARS, class D, class Law, class V = hn::Vec<D>,
          class Real = hn::TFromD<D>>
HWY_INLINE void addPairs(D d, const Law& law, const AllPairs<Real>& p, const Row<Real>& row, int j,
                         V vx, V vy, V vz, V& ux, V& uy, V& uz, V& wx, V& wy, V& wz,
                         Real* HWY_RESTRICT record) {
    constexpr bool RESTS = sizeof(Real) == 4 && SCALARS != Scalars::ReplayedNear;
    const V dx = displacement<RESTS>(d, row.x, row.restX, p.x + j, p.restX + j),
            dy = displacement<RESTS>(d, row.y, row.restY, p.y + j, p.restY + j),
            dz = displacement<RESTS>(d, row.z, row.restZ, p.z + j, p.restZ + j);
    V F, C;
    if constexpr (SCALARS == Scalars::Replayed || SCALARS == Scalars::ReplayedNear) {
        F = hn::LoadU(d, record);
        C = hn::LoadU(d, record + hn::Lanes(d));
    } else {
        law(d, p, row.i, j, hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz))), F, C);
        if constexpr (DIAGONAL) {
            const int skipped = row.i + 1 - j; // lanes up to the row itself
            const auto out = hn::FirstN(d, skipped > 0 ? size_t(skipped) : 0);
            F = hn::IfThenZeroElse(out, F);
            C = hn::IfThenZeroElse(out, C);
        }
        if constexpr (SCALARS == Scalars::Recorded) {
            hn::StoreU(F, d, record);
            hn::StoreU(C, d, record + hn::Lanes(d));
        }
    }
    const V ownX = hn::Set(d, row.vx), ownY = hn::Set(d, row.vy), ownZ = hn::Set(d, row.vz);
    const V forRow = hn::Mul(C, hn::MulAdd(dx, vx, hn::MulAdd(dy, vy, hn::Mul(dz, vz))));
    const V forColumn = hn::Mul(C, hn::MulAdd(dx, ownX, hn::MulAdd(dy, ownY, hn::Mul(dz, ownZ))));
    ux = hn::MulAdd(forRow, dx, hn::MulAdd(F, vx, ux));
    uy = hn::MulAdd(forRow, dy, hn::MulAdd(F, vy, uy));
    uz = hn::MulAdd(forRow, dz, hn::MulAdd(F, vz, uz));
    wx = hn::MulAdd(forColumn, dx, hn::MulAdd(F, ownX, wx));
    wy = hn::MulAdd(forColumn, dy, hn::MulAdd(F, ownY, wy));
    wz = hn::MulAdd(forColumn, dz, hn::MulAdd(F, ownZ, wz));
}

/**
 * Rows at once: what is loaded and stored of a column serves all. Four need 32 registers; with 16
 * even two have their own sums and places in memory, and one is faster.
 */
constexpr int ROWS = (HWY_TARGET <= HWY_AVX3 || !HWY_ARCH_X86 ? 4 : 1);
static_assert(ALL_PAIRS_ROWS % ROWS == 0);
/// Bytes of columns at a time: with the rows they stay in the nearest cache.
constexpr int TILE_BYTES = 2048;

/** Rows i to i + ROWS - 1 with the columns of [begin, end) beyond them. @return end of the record
 */
template <class Law, Scalars SCALARS, class D, class Real = hn::TFromD<D>>
HWY_INLINE Real* addRowsOfTile(D d, const AllPairs<Real>& p, int i, int begin, int end,
                               const Real* HWY_RESTRICT v, Real* HWY_RESTRICT sums,
                               Real* HWY_RESTRICT record) {
    using V = hn::Vec<D>;
    const int lanes = static_cast<int>(hn::Lanes(d));
    const size_t y = p.stride, z = 2 * size_t(p.stride);
    const Law law;
    const auto rowAt = [&](int n) { return Row<Real>(p, n < ROWS ? i + n : i, v); };
    const Row<Real> row1 = rowAt(0), row2 = rowAt(1), row3 = rowAt(2), row4 = rowAt(3);
    V u1x = hn::Zero(d), u1y = u1x, u1z = u1x, u2x = u1x, u2y = u1x, u2z = u1x, u3x = u1x,
      u3y = u1x, u3z = u1x, u4x = u1x, u4y = u1x, u4z = u1x;
    const auto column = [&](auto diagonal, int j) HWY_ATTR {
        constexpr bool DIAGONAL = decltype(diagonal)::value;
        const V vx = hn::LoadU(d, v + j), vy = hn::LoadU(d, v + y + j),
                vz = hn::LoadU(d, v + z + j);
        V wx = hn::LoadU(d, sums + j), wy = hn::LoadU(d, sums + y + j),
          wz = hn::LoadU(d, sums + z + j);
        addPairs<DIAGONAL, SCALARS>(d, law, p, row1, j, vx, vy, vz, u1x, u1y, u1z, wx, wy, wz,
                                    record);
        if constexpr (ROWS == 4) {
            addPairs<DIAGONAL, SCALARS>(d, law, p, row2, j, vx, vy, vz, u2x, u2y, u2z, wx, wy, wz,
                                        record + 2 * lanes);
            addPairs<DIAGONAL, SCALARS>(d, law, p, row3, j, vx, vy, vz, u3x, u3y, u3z, wx, wy, wz,
                                        record + 4 * lanes);
            addPairs<DIAGONAL, SCALARS>(d, law, p, row4, j, vx, vy, vz, u4x, u4y, u4z, wx, wy, wz,
                                        record + 6 * lanes);
        }
        if (SCALARS != Scalars::Evaluated)
            record += 2 * ROWS * lanes;
        hn::StoreU(wx, d, sums + j);
        hn::StoreU(wy, d, sums + y + j);
        hn::StoreU(wz, d, sums + z + j);
    };
    int j = begin;
    for (; j < end && j < i + ROWS; j += lanes)
        column(std::true_type(), j);
    for (; j < end; j += lanes)
        column(std::false_type(), j);
    const auto add = [&](int row, V ux, V uy, V uz) HWY_ATTR {
        sums[row] += hn::GetLane(hn::SumOfLanes(d, ux));
        sums[y + row] += hn::GetLane(hn::SumOfLanes(d, uy));
        sums[z + row] += hn::GetLane(hn::SumOfLanes(d, uz));
    };
    add(i, u1x, u1y, u1z);
    if constexpr (ROWS == 4) {
        add(i + 1, u2x, u2y, u2z);
        add(i + 2, u3x, u3y, u3z);
        add(i + 3, u4x, u4y, u4z);
    }
    return record;
}

template <class Law, Scalars SCALARS, class Real>
void addRowsAny(const AllPairs<Real>& given, int from, int to, const Real* HWY_RESTRICT v,
                Real* HWY_RESTRICT sums, Real* HWY_RESTRICT record) {
    const hn::CappedTag<Real, ALL_PAIRS_LANES> d;
    const int lanes = static_cast<int>(hn::Lanes(d)), tile = TILE_BYTES / sizeof(Real);
    const AllPairs<Real> p = given; // no store below can change it
    for (int begin = from / tile * tile; begin < p.count; begin += tile) {
        const int end = begin + tile < p.count ? begin + tile : p.count;
        for (int i = from; i < to && i < end; i += ROWS) {
            const int first = i / lanes * lanes;
            record = addRowsOfTile<Law, SCALARS>(d, p, i, first > begin ? first : begin, end, v,
                                                 sums, record);
        }
    }
}

template <class Law, class Real> AllPairsKernels<Real> kernelsOf() {
    return {addRowsAny<Law, Scalars::Evaluated, Real>, addRowsAny<Law, Scalars::Recorded, Real>,
            addRowsAny<Law, Scalars::Replayed, Real>, addRowsAny<Law, Scalars::ReplayedNear, Real>};
}

template <class Real> AllPairsKernels<Real> kernelsFor(PairLaw law) {
    switch (law) {
    case PairLaw::EqualSpheres:
        return kernelsOf<EqualSpheres, Real>();
    case PairLaw::UnequalSpheres:
        return kernelsOf<UnequalSpheres, Real>();
    default:
        return kernelsOf<GaussianEnvelopes, Real>();
    }
}

// Dispatch tables hold functions, not templates: one name per precision.
AllPairsKernels<float> singleAllPairsKernels(PairLaw law) {
    return kernelsFor<float>(law);
}
AllPairsKernels<double> doubleAllPairsKernels(PairLaw law) {
    return kernelsFor<double>(law);
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace PSE {

HWY_EXPORT(singleAllPairsKernels);
HWY_EXPORT(doubleAllPairsKernels);

template <> AllPairsKernels<float> allPairsKernels<float>(PairLaw law) {
    return HWY_DYNAMIC_DISPATCH(singleAllPairsKernels)(law);
}
template <> AllPairsKernels<double> allPairsKernels<double>(PairLaw law) {
    return HWY_DYNAMIC_DISPATCH(doubleAllPairsKernels)(law);
}

} // namespace PSE
#endif
