// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEARRAYS_H_
#define OPENMMPSE_DEVICEARRAYS_H_

#include "DeviceKernel.h"
#include "openmm/OpenMMException.h"
#include "openmm/common/ComputeArray.h"
#include <memory>
#include <vector>

namespace PSE {

/** An array that grows; its contents are lost when it does. */
class GrowingArray {
public:
    /**
     * Room for `size` elements.
     * @throws OpenMMException if the device has none; the array is then empty
     */
    void reserve(OpenMM::ComputeContext& context, size_t size, int elementSize, const char* name) {
        size = std::max<size_t>(size, 1);
        if (array && array->getSize() >= size)
            return;
        array.reset(); // first, so that the old and the new one need not fit together
        std::unique_ptr<OpenMM::ComputeArray> made(new OpenMM::ComputeArray());
        try {
            made->initialize(context, size, elementSize, name);
        } catch (const OpenMM::OpenMMException& failure) {
            throw OpenMM::OpenMMException(
                "PSEBrownianIntegrator: the device has no room for an array of " +
                std::to_string(1e-9 * size * elementSize) + " GB, " + failure.what() +
                "; use fewer particles, a larger box, or another platform");
        }
        array = std::move(made);
    }
    size_t size() const { return array ? array->getSize() : 0; }
    OpenMM::ComputeArray& operator*() { return *array; }

private:
    std::unique_ptr<OpenMM::ComputeArray> array;
};

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
/** An array of vectors of four numbers. */
inline void uploadVectors(OpenMM::ComputeArray& array, OpenMM::ComputeContext& context,
                          const std::vector<double>& values, const char* name, bool areDoubles) {
    if (!array.isInitialized())
        array.initialize(context, values.size() / 4,
                         4 * (areDoubles ? sizeof(double) : sizeof(float)), name);
    if (areDoubles)
        array.upload(values.data());
    else
        array.upload(std::vector<float>(values.begin(), values.end()).data());
}

} // namespace PSE

#endif
