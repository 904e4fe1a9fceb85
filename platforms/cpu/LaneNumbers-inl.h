// SPDX-License-Identifier: MIT
// Included by each file of kernels, once for every instruction set.
#if defined(OPENMMPSE_LANENUMBERS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef OPENMMPSE_LANENUMBERS_INL_H_
#undef OPENMMPSE_LANENUMBERS_INL_H_
#else
#define OPENMMPSE_LANENUMBERS_INL_H_
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/**
 * first + number of the lane. Highway's Iota, of a number that is not known when it is compiled, is
 * built in memory lane by lane, and waits there for its own stores.
 */
template <class D> HWY_INLINE hn::Vec<D> lanesFrom(D d, hn::TFromD<D> first) {
    return hn::Add(hn::Iota(d, 0), hn::Set(d, first));
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#endif
