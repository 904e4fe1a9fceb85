// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEARRAYS_H_
#define OPENMMPSE_DEVICEARRAYS_H_

#include "DeviceKernel.h"
#include "openmm/common/ComputeArray.h"
#include <vector>

namespace PSE {

/** Make an array hold at least `size` elements; its contents are lost if it grows. */
inline void reserve(OpenMM::ComputeArray& array, OpenMM::ComputeContext& context, size_t size,
                    int elementSize, const char* name) {
    size = std::max<size_t>(size, 1);
    if (!array.isInitialized())
        array.initialize(context, size, elementSize, name);
    else if (array.getSize() < size)
        array.resize(size);
}

/** An array of reals, or of mixed numbers, made from doubles. */
inline void uploadReals(OpenMM::ComputeArray& array, OpenMM::ComputeContext& context,
                        const std::vector<double>& values, const char* name) {
    if (!array.isInitialized())
        array.initialize(context, values.size(), realSize(context), name);
    array.upload(values, true);
}
inline void uploadMixed(OpenMM::ComputeArray& array, OpenMM::ComputeContext& context,
                        const std::vector<double>& values, const char* name) {
    if (!array.isInitialized())
        array.initialize(context, values.size(), mixedSize(context), name);
    array.upload(values, true);
}

} // namespace PSE

#endif
