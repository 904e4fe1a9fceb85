// SPDX-License-Identifier: MIT
#include "Instructions.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "Instructions.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

/** Chosen like the loops, so that it tells what they run on rather than what there would be. */
const char* nameOfThisTarget() {
    return hwy::TargetName(HWY_TARGET);
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace PSE {

HWY_EXPORT(nameOfThisTarget);

const char* instructionSet() {
    return HWY_DYNAMIC_DISPATCH(nameOfThisTarget)();
}

} // namespace PSE
#endif
