// SPDX-License-Identifier: MIT
// Rows of spheres that are sums of a few products [T54]: included by SphereKernels.cpp, once for
// every instruction set.
#if defined(OPENMMPSE_SPHEREROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OPENMMPSE_SPHEREROWS_INL_H_
#undef OPENMMPSE_SPHEREROWS_INL_H_
#else
#define OPENMMPSE_SPHEREROWS_INL_H_
#endif

#include "LaneNumbers-inl.h"
#include "SphereKernels.h"
#include <cstdint>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/** `terms` polynomials of t at once; coefficients[degree + 1][terms], highest powers first. */
template <int TERMS, class D, class Real = hn::TFromD<D>>
HWY_INLINE void evaluateTerms(D d, const Real* HWY_RESTRICT coefficients, int degree, hn::Vec<D> t,
                              hn::Vec<D>* HWY_RESTRICT terms) {
    for (int j = 0; j < TERMS; j++)
        terms[j] = hn::Set(d, *coefficients++);
#pragma GCC unroll 2
    for (int power = 1; power <= degree; power++)
        for (int j = 0; j < TERMS; j++)
            terms[j] = hn::MulAdd(terms[j], t, hn::Set(d, *coefficients++));
}

/** Small integers, as many as there are lanes, from numbers and to numbers. */
template <class D> HWY_INLINE hn::Vec<hn::Rebind<int32_t, D>> integersOf(D, hn::Vec<D> numbers) {
    const hn::Rebind<int32_t, D> di;
    if constexpr (sizeof(hn::TFromD<D>) == 4)
        return hn::ConvertTo(di, numbers);
    else
        return hn::DemoteTo(di, numbers);
}
template <class D> HWY_INLINE hn::Vec<D> numbersOf(D d, hn::Vec<hn::Rebind<int32_t, D>> integers) {
    if constexpr (sizeof(hn::TFromD<D>) == 4)
        return hn::ConvertTo(d, integers);
    else
        return hn::PromoteTo(d, integers);
}

/** First row and number of rows of a sphere in each of its planes, for a shape with a rowScale. */
template <class Real>
HWY_INLINE void findChords(const GridSpheres<Real>& g, int particle,
                           SphereChords* HWY_RESTRICT chords) {
    const hn::CappedTag<Real, SPHERE_LANES> d;
    const hn::Rebind<int8_t, decltype(d)> bytes;
    const auto one = hn::Set(d, Real(1)), zero = hn::Zero(d);
    const Real scale = g.shapes[g.shape[particle]].rowScale;
    const Real* HWY_RESTRICT offset = g.offset + 3 * size_t(particle);
    const auto store = [&](hn::Vec<decltype(d)> numbers, int8_t* to) HWY_ATTR {
        hn::StoreU(hn::DemoteTo(bytes, integersOf(d, numbers)), bytes, to);
    };
    for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(d))) {
        const auto x = lanesFrom(d, offset[0] + Real(k));
        const auto t = hn::MulSub(hn::Mul(hn::Set(d, scale * g.plane), x), x, one),
                   left = hn::Max(hn::Sub(one, t), zero);
        const auto half = hn::Sqrt(hn::Mul(left, hn::Set(d, 1 / (scale * g.line)))),
                   middle = hn::MulSub(hn::Set(d, g.skewY), x, hn::Set(d, offset[1]));
        const auto from = hn::Max(hn::Ceil(hn::Sub(middle, half)), zero),
                   to = hn::Min(hn::Floor(hn::Add(middle, half)),
                                hn::Set(d, Real(SPHERE_LANES - 1)));
        const auto all = hn::Max(hn::Add(hn::Sub(to, from), one), zero);
        store(hn::Min(from, hn::Set(d, Real(SPHERE_LANES))), chords->first + k);
        store(hn::IfThenElseZero(hn::Gt(left, zero), all), chords->count + k);
    }
}

template <int TERMS, class Real>
void weighRowsOf(const GridSpheres<Real>& g, int from, int to, SphereChords* chords,
                 Real* alongWeights) {
    const hn::CappedTag<Real, SPHERE_LANES> d;
    const auto one = hn::Set(d, Real(1));
    for (int particle = from; particle < to; particle++) {
        const int kind = g.shape[particle];
        const Real scale = g.shapes[kind].rowScale;
        if (scale == 0)
            continue;
        findChords(g, particle, chords + particle);
        Real* HWY_RESTRICT out = alongWeights + size_t(particle) * TERMS * SPHERE_LANES;
        const Real* HWY_RESTRICT along = g.along + size_t(kind) * TERMS * (g.rowDegree + 1);
        for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(d))) {
            const auto z = lanesFrom(d, g.offset[3 * size_t(particle) + 2] + k);
            const auto t = hn::MulSub(hn::Mul(hn::Set(d, scale * g.point), z), z, one);
            hn::Vec<decltype(d)> terms[TERMS];
            evaluateTerms<TERMS>(d, along, g.rowDegree, hn::Min(t, one), terms);
            for (int j = 0; j < TERMS; j++)
                hn::StoreU(hn::IfThenElseZero(hn::Lt(t, one), terms[j]), d,
                           out + j * SPHERE_LANES + k);
        }
    }
}

/**
 * The rows that a sphere touches in a few planes, and the factors of its terms there. They are
 * visited in one loop: how many there are in a plane is hard to predict, and would be for each.
 */
template <int TERMS, class Real> struct SphereRows {
    /// numbers that are written together, where vectors are as long
    static constexpr int LANES = 2 * SPHERE_LANES;
    static constexpr int ROOM = SPHERE_LANES * SPHERE_LANES + LANES;
    Real weights[TERMS][ROOM];
    int32_t at[ROOM]; ///< first points, in a whole grid
    int count;        ///< even: the last row may be one of weight 0
    int particle;

    /** Those of planes [dx, end) from the first one on; plane dx is x of the grids. */
    HWY_INLINE void find(const GridSpheres<Real>& g, int sphere, int dx, int end, int x) {
        particle = sphere;
        const hn::CappedTag<Real, SPHERE_LANES> d;
        const hn::CappedTag<int32_t, SPHERE_LANES> di;
        const hn::CappedTag<Real, LANES> wide;
        const int kind = g.shape[particle];
        const Real scale = g.shapes[kind].rowScale;
        const Real* HWY_RESTRICT offset = g.offset + 3 * size_t(particle);
        const SphereChords& chords = g.chords[particle];
        // of each plane: what it takes of t; its first row, from the middle one of a tilted box's
        // plane, in the grid, and how many there are from it on before they begin again
        Real taken[SPHERE_LANES], fromMiddle[SPHERE_LANES];
        int32_t place[SPHERE_LANES], left[SPHERE_LANES];
        for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(d))) {
            const hn::Rebind<int8_t, decltype(d)> bytes;
            const hn::Rebind<int32_t, decltype(d)> integers;
            const auto first = hn::PromoteTo(integers, hn::LoadU(bytes, chords.first + k));
            const auto x = lanesFrom(d, offset[0] + Real(k));
            hn::StoreU(hn::MulSub(hn::Mul(hn::Set(d, scale * g.plane), x), x, hn::Set(d, Real(1))),
                       d, taken + k);
            const auto middle = hn::MulSub(hn::Set(d, g.skewY), x, hn::Set(d, offset[1]));
            hn::StoreU(hn::Sub(numbersOf(d, first), middle), d, fromMiddle + k);
            const auto row = hn::Add(first, hn::Set(integers, g.first[3 * size_t(particle) + 1]));
            hn::StoreU(hn::Sub(hn::Set(integers, g.size[1]), row), integers, left + k);
            hn::StoreU(hn::Add(hn::Mul(row, hn::Set(integers, static_cast<int32_t>(g.rowLength))),
                               hn::Set(integers, g.first[3 * size_t(particle) + 2])),
                       integers, place + k);
        }
        const Real line = scale * g.line;
        const auto whole = hn::Set(di, static_cast<int32_t>(g.size[1] * g.rowLength));
        Real t[ROOM];
        int n = 0;
        for (; dx < end; dx++) { // each writes a vector, of which the next keeps its rows
            for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(d))) {
                const auto y = lanesFrom(d, fromMiddle[dx] + Real(k));
                hn::StoreU(hn::MulAdd(hn::Mul(hn::Set(d, line), y), y, hn::Set(d, taken[dx])), d,
                           t + n + k);
            }
            const int32_t first = place[dx] + static_cast<int32_t>(x * g.planeLength);
            for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(di))) {
                const auto row = lanesFrom(di, k);
                const auto there =
                    hn::Add(hn::Mul(row, hn::Set(di, static_cast<int32_t>(g.rowLength))),
                            hn::Set(di, first));
                const auto before = hn::Lt(row, hn::Set(di, left[dx]));
                hn::StoreU(hn::Sub(there, hn::IfThenZeroElse(before, whole)), di, at + n + k);
            }
            n += chords.count[dx];
            if (++x == g.size[0])
                x = 0;
        }
        for (int k = 0; k < LANES; k += static_cast<int>(hn::Lanes(wide)))
            hn::StoreU(hn::Set(wide, Real(1)), wide, t + n + k);
        const Real* HWY_RESTRICT across = g.across + size_t(kind) * TERMS * (g.rowDegree + 1);
        for (int k = 0; k < n; k += static_cast<int>(hn::Lanes(wide))) {
            hn::Vec<decltype(wide)> terms[TERMS];
            const auto capped = hn::Min(hn::LoadU(wide, t + k), hn::Set(wide, Real(1)));
            evaluateTerms<TERMS>(wide, across, g.rowDegree, capped, terms);
            for (int j = 0; j < TERMS; j++)
                hn::StoreU(terms[j], wide, weights[j] + k);
        }
        for (int j = 0; j < TERMS; j++)
            weights[j][n] = 0;
        at[n] = 0;
        count = n + n % 2;
    }
};

/** Calls even(at, weights) and odd(at, weights) for every other row; `at` in the whole grid. */
template <int TERMS, class D, class Work, class Real = hn::TFromD<D>>
HWY_INLINE void visitRows(D d, const GridSpheres<Real>& g, const SphereRows<TERMS, Real>& rows,
                          Work& even, Work& odd) {
    const Real* HWY_RESTRICT along = g.alongWeights + size_t(rows.particle) * TERMS * SPHERE_LANES;
    // what would else be read again after every number that is written
    const int count = rows.count;
    for (int k = 0; k < SPHERE_LANES; k += static_cast<int>(hn::Lanes(d))) {
        hn::Vec<D> terms[TERMS];
        for (int j = 0; j < TERMS; j++)
            terms[j] = hn::LoadU(d, along + j * SPHERE_LANES + k);
        const auto weigh = [&](int row) HWY_ATTR {
            auto w = hn::Mul(hn::Set(d, rows.weights[0][row]), terms[0]);
            for (int j = 1; j < TERMS; j++)
                w = hn::MulAdd(hn::Set(d, rows.weights[j][row]), terms[j], w);
            return w;
        };
        for (int row = 0; row < count; row += 2) {
            even(size_t(rows.at[row]) + k, weigh(row));
            odd(size_t(rows.at[row + 1]) + k, weigh(row + 1));
        }
    }
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#endif
