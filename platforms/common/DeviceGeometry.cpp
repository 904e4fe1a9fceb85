// SPDX-License-Identifier: MIT
#include "DeviceGeometry.h"
#include <cmath>

using namespace OpenMM;
using PSE::numerics::Lattice;
using PSE::numerics::Matrix3;

namespace PSE {

std::vector<double> geometryOf(const ComputeContext& context, const Lattice& box, double unit) {
    const Matrix3 v = box.vectors() / unit;
    const double one = realIsDouble(context) ? std::ldexp(1.0, -64) : std::ldexp(1.0, -32);
    return {one * v(0, 0), one * v(0, 1), one * v(1, 1), one * v(0, 2), one * v(1, 2),
            one * v(2, 2), v(0, 0),       v(0, 1),       v(1, 1)};
}

bool isTilted(const Lattice& box) {
    const Matrix3& v = box.vectors();
    return v(0, 1) != 0 || v(0, 2) != 0 || v(1, 2) != 0;
}

int uploadImages(ComputeArray& array, ComputeContext& context, const Lattice& box, double range,
                 double unit) {
    std::vector<double> vectors;
    for (const numerics::Vec3& image : box.imagesWithin(range)) {
        const double other = image == numerics::Vec3::Zero() ? 0 : 1;
        vectors.insert(vectors.end(), {image[0] / unit, image[1] / unit, image[2] / unit, other});
    }
    uploadVectors(array, context, vectors, "pseImages");
    return static_cast<int>(vectors.size() / 4);
}

} // namespace PSE
