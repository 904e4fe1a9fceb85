// SPDX-License-Identifier: MIT
#include "DeviceFlow.h"
#include <cstring>

using namespace OpenMM;
using PSE::numerics::Lattice;
using PSE::numerics::Matrix3;

namespace PSE {

DeviceFlow::DeviceFlow(DevicePrograms& programs) : context(programs.context()) {
    carryAlong = DeviceKernel(context, programs.particles(), "carryAlong");
}

/** Whoever wraps or unwraps particles does not tell: all are compared. */
void DeviceFlow::followImages(const Lattice& box) {
    const std::vector<mm_int4>& images = context.getPosCellOffsets();
    if (images.size() == imagesSeen.size() &&
        std::memcmp(images.data(), imagesSeen.data(), images.size() * sizeof(mm_int4)) == 0)
        return;
    const Matrix3& v = box.vectors();
    std::vector<double> heights;
    heights.reserve(images.size());
    for (const mm_int4& image : images)
        heights.push_back(v(1, 1) * image.y + v(1, 2) * image.z);
    uploadMixed(lifts, context, heights, "pseLifts");
    imagesSeen = images;
}

void DeviceFlow::carry(double strain, double dt, const Lattice& box) {
    followImages(box);
    const int n = context.getNumAtoms();
    if (context.getUseMixedPrecision())
        carryAlong(n, n, Mixed{strain}, Mixed{dt}, lifts, context.getPosq(), context.getVelm(),
                   context.getPosqCorrection());
    else
        carryAlong(n, n, Mixed{strain}, Mixed{dt}, lifts, context.getPosq(), context.getVelm());
}

void DeviceFlow::tilt(double strain, const Lattice& box) {
    const Matrix3 after = box.sheared(strain).vectors();
    const auto edge = [&](int d) { return Vec3(after(0, d), after(1, d), after(2, d)); };
    // Not by ContextImpl: it would bring all positions to the host, and back rounded.
    context.setPeriodicBoxVectors(edge(0), edge(1), edge(2));
    const std::array<int, 2> flips = box.flips(strain);
    if (flips[0] == 0 && flips[1] == 0)
        return;
    for (mm_int4& image : context.getPosCellOffsets())
        image.x += flips[0] * image.y + flips[1] * image.z;
}

} // namespace PSE
