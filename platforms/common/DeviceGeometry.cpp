// SPDX-License-Identifier: MIT
#include "DeviceGeometry.h"
#include <cmath>

using namespace OpenMM;
using PSE::numerics::Lattice;
using PSE::numerics::Matrix3;
using PSE::numerics::Plan;

namespace PSE {

std::vector<double> geometryOf(const ComputeContext& context, const Lattice& box, double unit) {
    const Matrix3 v = box.vectors() / unit;
    const double one = realIsDouble(context) ? std::ldexp(1.0, -64) : std::ldexp(1.0, -32);
    return {one * v(0, 0), one * v(0, 1), one * v(1, 1), one * v(0, 2), one * v(1, 2),
            one * v(2, 2), v(0, 0),       v(0, 1),       v(1, 1)};
}

DeviceNumbers::DeviceNumbers(DevicePrograms& programs, const char* name) {
    ComputeContext& context = programs.context();
    numbers.initialize(context, MOST, realSize(context), name);
    setNumbers = DeviceKernel(context, programs.particles(), "setNumbers");
}

void DeviceNumbers::set(std::vector<double> values) {
    values.resize(MOST, 0.0);
    const auto four = [&](int i) {
        return Real4{values[i], values[i + 1], values[i + 2], values[i + 3]};
    };
    setNumbers(1, numbers, four(0), four(4), four(8), four(12));
}

bool mayBeTilted(const ComputeContext& context, const Plan& plan, const Lattice& box) {
    const Matrix3& v = box.vectors();
    // OpenMM tilts no box of a Context that began with a rectangular one
    return v(0, 1) != 0 || v(0, 2) != 0 || v(1, 2) != 0 ||
           (plan.moving && context.getBoxIsTriclinic());
}

int uploadImages(GrowingArray& array, ComputeContext& context, const Lattice& box, double range,
                 double unit) {
    std::vector<double> vectors;
    for (const numerics::Vec3& image : box.imagesWithin(range)) {
        const double other = image == numerics::Vec3::Zero() ? 0 : 1;
        vectors.insert(vectors.end(), {image[0] / unit, image[1] / unit, image[2] / unit, other});
    }
    const size_t count = vectors.size() / 4;
    array.reserve(context, count, 4 * realSize(context), "pseImages");
    vectors.resize(4 * array.size(), 0.0);
    uploadVectors(*array, context, vectors, "pseImages", realIsDouble(context));
    return static_cast<int>(count);
}

} // namespace PSE
