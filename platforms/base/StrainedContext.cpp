// SPDX-License-Identifier: MIT
#include "StrainedContext.h"
#include "VectorConversion.h"
#include "openmm/Context.h"
#include "openmm/OpenMMException.h"
#include "openmm/Platform.h"
#include <algorithm>
#include <cmath>
#include <sstream>

using namespace PSE::numerics;
using OpenMM::OpenMMException;

namespace PSE {

StrainedContext::StrainedContext(OpenMM::ContextImpl& context, const Lattice& box, int groups)
    : context(context), box(box), groups(groups) {
    std::ostringstream stream(std::ios::binary);
    context.createCheckpoint(stream);
    saved = stream.str();
    context.getPositions(positions);
    moved.resize(positions.size());
}

void StrainedContext::restore() {
    std::istringstream stream(saved, std::ios::binary);
    context.loadCheckpoint(stream);
}

double StrainedContext::energy(const Matrix3& map) {
    const Matrix3 edges = box.deformed(map).vectors();
    context.setPeriodicBoxVectors(toOpenMM(edges.col(0)), toOpenMM(edges.col(1)),
                                  toOpenMM(edges.col(2)));
    for (size_t i = 0; i < positions.size(); i++)
        moved[i] = toOpenMM(map * fromOpenMM(positions[i]));
    context.setPositions(moved);
    context.computeVirtualSites();
    const double value = context.calcForcesAndEnergy(false, true, groups);
    if (!std::isfinite(value))
        throw OpenMMException("the potential energy is not finite; check the positions");
    return value;
}

bool StrainedContext::isDouble() const {
    const OpenMM::Platform& platform = context.getPlatform();
    const auto& names = platform.getPropertyNames();
    if (std::find(names.begin(), names.end(), "Precision") == names.end())
        return platform.supportsDoublePrecision();
    return platform.getPropertyValue(context.getOwner(), "Precision") == "double";
}

} // namespace PSE
