// SPDX-License-Identifier: MIT
// The RPY tensor of unequal spheres in SIMD: included by each file of kernels, once for every
// instruction set.
#if defined(OPENMMPSE_RPYLOOPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OPENMMPSE_RPYLOOPS_INL_H_
#undef OPENMMPSE_RPYLOOPS_INL_H_
#else
#define OPENMMPSE_RPYLOOPS_INL_H_
#endif

#include <hwy/highway.h>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// In radii squared: below, pairs count as this far apart; C d d^T then vanishes.
template <class Real> constexpr double SMALLEST_R2 = sizeof(Real) == 4 ? 1e-16 : 1e-30;
// Unused lanes are at this distance, and arithmetic with subnormal numbers takes a hundred times as
// long.
static_assert(SMALLEST_R2<float> * SMALLEST_R2<float> > std::numeric_limits<float>::min(),
              "squares of distances in the formulas below are normal numbers");

/**
 * F and C = (G - F)/r^2 of the tensor of spheres of any radii, apart, overlapping, or one inside
 * the other [T24], by selection: what is not chosen may overflow.
 * @param r2  squared distance, at least SMALLEST_R2
 * @param s   its inverse root
 * @param inverse  1/(ai aj)
 */
template <class D, class V = hn::Vec<D>>
HWY_INLINE void rpyOfUnequal(D d, V r2, V s, V ai, V aj, V inverse, V& F, V& C) {
    using Real = hn::TFromD<D>;
    const auto constant = [&](double value) { return hn::Set(d, Real(value)); };
    const auto s2 = hn::Mul(s, s);
    const auto sum = hn::Add(ai, aj), difference = hn::Sub(ai, aj),
               difference2 = hn::Mul(difference, difference);
    const auto squares = hn::Mul(constant(0.25), hn::Mul(s2, hn::MulAdd(ai, ai, hn::Mul(aj, aj))));
    const auto apartF = hn::Mul(s, hn::Add(squares, constant(0.75)));
    const auto apartC = hn::Mul(s, hn::NegMulAdd(constant(3), squares, constant(0.75)));
    // of overlapping spheres, times ai aj
    const auto scale = hn::Mul(constant(1.0 / 32), hn::Mul(s, s2));
    const auto skew = hn::MulAdd(constant(3), r2, difference2), gap = hn::Sub(difference2, r2);
    const auto partF =
        hn::Mul(inverse, hn::NegMulAdd(hn::Mul(skew, skew), scale, hn::Mul(constant(0.5), sum)));
    const auto partC = hn::Mul(inverse, hn::Mul(constant(3), hn::Mul(scale, hn::Mul(gap, gap))));
    const auto apart = hn::Gt(r2, hn::Mul(sum, sum)), inside = hn::Le(r2, difference2);
    const auto insideF = hn::Mul(inverse, hn::Min(ai, aj));
    F = hn::IfThenElse(apart, apartF, hn::IfThenElse(inside, insideF, partF));
    C = hn::Mul(s2, hn::IfThenElse(apart, apartC, hn::IfThenZeroElse(inside, partC)));
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#endif
