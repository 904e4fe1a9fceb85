// SPDX-License-Identifier: MIT
#include "DeviceSphereSpread.h"
#include "numerics/GridMetric.h"
#include "numerics/RadialWindow.h"

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

namespace {
/// threads for each sphere, as in sphereSpread.cc
constexpr int LANES = 32;
/// Without a hollow, rounding must not lose the centre itself, t = -1.
constexpr double ANY = -2;

RadialWindow windowOf(const Plan& plan) {
    return RadialWindow(plan.windowSupport, plan.windowShape, plan.windowSpacing);
}
} // namespace

DeviceSphereSpread::DeviceSphereSpread(DevicePrograms& programs, const Plan& plan,
                                       const Lattice& box, DevicePlaces& places,
                                       DeviceSpheres& spheres)
    : context(programs.context()), places(places), spheres(spheres),
      size(plan.grid[0], plan.grid[1], plan.grid[2], 0), metric(programs, "pseMetric") {
    setBox(plan, box);
    std::vector<double> reach;
    for (const SizeGroups::Group& group : places.sizes()->groups)
        reach.push_back(windowOf(plan).reach(group.largest));
    uploadReals(reaches, context, reach, "pseReaches");
    const int degree = makeShapes(plan);
    const PlanConstants constants = {{"SPHERE_DEGREE", degree}};
    uploadConstants(planConstants, context, constants);
    compiled = programs.sphereSpread(constants);
    spreadSpheres = DeviceKernel(context, compiled, "spreadSpheres");
    gatherSpheres = DeviceKernel(context, compiled, "gatherSpheres");
}

void DeviceSphereSpread::setBox(const Plan& plan, const Lattice& box) {
    const GridMetric m(box, plan.grid, plan.a);
    metric.set({m.plane, m.line, m.point, m.skewY, m.skewX, m.skewZ, m.pointsPerLength[0],
                m.pointsPerLength[1], m.pointsPerLength[2]});
}

double DeviceSphereSpread::bytesPerParticle(const Plan& plan, int realSize) {
    const double kinds =
        double(plan.mixture->radii().size()) / plan.mixture->particleRadii().size();
    return kinds * (4 + RadialWindow::MAX_DEGREE + 1) * realSize;
}

/** The kernel of each distinct radius. @return the degree of their polynomials */
int DeviceSphereSpread::makeShapes(const Plan& plan) {
    const std::vector<double>& radii = plan.mixture->radii();
    const int kinds = static_cast<int>(radii.size());
    const RadialWindow window = windowOf(plan);
    std::vector<SphereKernel> kernels(kinds);
    forEach(context, kinds, [&](int i) { kernels[i] = window.kernel(radii[i], plan.windowError); });
    int degree = 0;
    for (const SphereKernel& kernel : kernels)
        degree = std::max(degree, kernel.polynomial.degree());
    std::vector<double> all, powers(size_t(degree + 1) * kinds, 0.0);
    for (int i = 0; i < kinds; i++) {
        const SphereKernel& kernel = kernels[i];
        all.insert(all.end(),
                   {kernel.scale, kernel.shift, kernel.inner > 0 ? -1 : ANY, kernel.reach});
        const std::vector<double>& own = kernel.polynomial.powers;
        std::copy(own.rbegin(), own.rend(),
                  powers.begin() + size_t(i + 1) * (degree + 1) - own.size());
    }
    uploadVectors(shapes, context, all, "pseShapes", realIsDouble(context));
    uploadReals(coefficients, context, powers, "pseShells");
    return degree;
}

void DeviceSphereSpread::spread(ComputeArray& f, ComputeArray grids[3]) {
    spreadSpheres(context.getNumThreadBlocks() * GROUP_SIZE, size, places.sizes()->size(),
                  planConstants, places.groupCells(), reaches, places.cellStarts(), places.places(),
                  spheres.kinds(), shapes, coefficients, metric.array(), f, grids[0], grids[1],
                  grids[2]);
}

void DeviceSphereSpread::gather(ComputeArray grids[3], ComputeArray& u) {
    gatherSpheres(LANES * places.count(), places.count(), size, planConstants, places.places(),
                  spheres.kinds(), shapes, coefficients, metric.array(), grids[0], grids[1],
                  grids[2], u);
}

} // namespace PSE
