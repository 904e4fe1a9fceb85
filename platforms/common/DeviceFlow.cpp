// SPDX-License-Identifier: MIT
#include "DeviceFlow.h"

using namespace OpenMM;
using PSE::numerics::Lattice;
using PSE::numerics::Matrix3;

namespace PSE {

DeviceFlow::DeviceFlow(DevicePrograms& programs)
    : context(programs.context()), images(programs.context()) {
    carryAlong = DeviceKernel(context, programs.particles(), "carryAlong");
}

void DeviceFlow::carry(double strain, double dt, const Lattice& box) {
    Matrix3 heights = box.vectors(); // alone: the rest tilts in every step
    heights.row(0).setZero();
    images.follow(heights);
    const int n = context.getNumAtoms();
    if (context.getUseMixedPrecision())
        carryAlong(n, n, Mixed{strain}, Mixed{dt}, images.shifts(), context.getPosq(),
                   context.getVelm(), context.getPosqCorrection());
    else
        carryAlong(n, n, Mixed{strain}, Mixed{dt}, images.shifts(), context.getPosq(),
                   context.getVelm());
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
