// SPDX-License-Identifier: MIT
#include "DeviceImages.h"
#include <cstring>

using namespace OpenMM;

namespace PSE {

/** Whoever wraps or unwraps particles does not tell: all are compared. */
void DeviceImages::follow(const numerics::Matrix3& box) {
    const std::vector<mm_int4>& images = context.getPosCellOffsets();
    if (images.size() == imagesSeen.size() && box == boxSeen &&
        std::memcmp(images.data(), imagesSeen.data(), images.size() * sizeof(mm_int4)) == 0)
        return;
    std::vector<double> values;
    values.reserve(4 * images.size());
    for (const mm_int4& image : images) {
        const numerics::Vec3 shift = box * numerics::Vec3(image.x, image.y, image.z);
        values.insert(values.end(), {shift[0], shift[1], shift[2], 0.0});
    }
    uploadVectors(array, context, values, "pseShifts", mixedIsDouble(context));
    imagesSeen = images;
    boxSeen = box;
}

} // namespace PSE
