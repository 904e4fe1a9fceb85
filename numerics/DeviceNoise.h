// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_DEVICENOISE_H_
#define OPENMMPSE_NUMERICS_DEVICENOISE_H_

// The noise of NoiseText.h for the processor, in namespaces inSingle and inDouble.

#include <cmath>
#include <cstdint>

#define DEVICE inline

namespace PSE::numerics::inSingle {
using real = float;
using mm_ulong = uint64_t;
#define RSQRT(x) (1.0f / std::sqrt(x))
#include "numerics/NoiseText.h"
#undef RSQRT
} // namespace PSE::numerics::inSingle

namespace PSE::numerics::inDouble {
using real = double;
using mm_ulong = uint64_t;
#define USE_DOUBLE_PRECISION 1
#define SQRT std::sqrt
#include "numerics/NoiseText.h"
#undef USE_DOUBLE_PRECISION
#undef SQRT
} // namespace PSE::numerics::inDouble

#undef DEVICE
#undef LEADING_ZEROS
#undef BITS_OF
#undef FROM_BITS

#endif
