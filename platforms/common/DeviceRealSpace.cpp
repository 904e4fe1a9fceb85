// SPDX-License-Identifier: MIT
#include "DeviceRealSpace.h"
#include "numerics/Lanczos.h"
#include "numerics/RealTable.h"
#include "numerics/Rpy.h"
#include <cmath>
#include <cstdint>

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

namespace {

/// in radii squared; below, 1/r^2 is not needed and might overflow
constexpr double SMALLEST_R2 = 1e-30;
/// of the range, in units of the box: what rounding of fractions may do, and more
constexpr double REACH_MARGIN = 1e-6;

/** Eigenvalues of the truncated M_R may lie below zero by the error of the truncation. */
double negativeTolerance(const Plan& plan) {
    const double growth = plan.mixture ? MixtureScales(*plan.mixture).errorGrowth() : 1;
    return std::max(2 * plan.predictedError * growth, 1e-10);
}

/** Append the powers of a polynomial, highest first. */
void appendCoefficients(const Polynomial& p, std::vector<double>& all) {
    all.insert(all.end(), p.powers.rbegin(), p.powers.rend());
}

} // namespace

double DeviceRealSpace::bytesPerPair(const Plan& plan) {
    if (plan.mixture)
        return 0; // pairs have ranges of their own: DeviceSphereRows counts them
    return ROOM * (plan.sumImages ? sizeof(mm_int2) : sizeof(int));
}

double DeviceRealSpace::bytesPerParticle(int realSize) {
    return 14.0 * 4 * realSize + 64;
}

DeviceRealSpace::DeviceRealSpace(DevicePrograms& programs, const Plan& plan, const Lattice& box,
                                 DevicePlaces& places, StepSummary& summary, DeviceSpheres* spheres)
    : context(programs.context()), places(places), summary(summary),
      lanczos(this->context, places, summary, plan.lanczosTolerance, negativeTolerance(plan),
              LanczosTridiagonal::REAL_HALF),
      sumImages(plan.sumImages), geometry(programs, "pseGeometry") {
    Defines defines = DeviceLanczos::defines(LanczosTridiagonal::REAL_HALF);
    defines["SMALLEST_R2"] = context.doubleToString(SMALLEST_R2);
    if (sumImages)
        defines["SUM_IMAGES"] = "1";
    else if (mayBeTilted(context, plan, box))
        defines["TILTED"] = "1";
    if (spheres != nullptr)
        sphereRows.reset(
            new DeviceSphereRows(programs, plan, box, places, *spheres, summary, defines));
    const ComputeProgram program =
        sphereRows ? sphereRows->program() : prepareRows(programs, plan, box, defines);
    multiplyReal = DeviceKernel(context, program, "multiplyReal");
    lanczos.use(program, [this](DeviceKernel& expandBasis, int iteration, ComputeArray& basis,
                                ComputeArray& partial) {
        withMatrix(expandBasis, iteration, basis, partial);
    });
    if (sphereRows)
        lanczos.scaleBy(spheres->kinds(), sphereRows->scales());
}

/** Of equal spheres. @return the program that all kernels are from */
ComputeProgram DeviceRealSpace::prepareRows(DevicePrograms& programs, const Plan& plan,
                                            const Lattice& box, Defines defines) {
    const int n = places.count();
    const double mean = meanNeighbours(box, n, plan.realCutoff);
    capacity = static_cast<int>(std::min(ROOM * mean + LEAST_ROOM, MOST_ROOM));
    const RealTable table = makeRealTable(*plan.split, plan.realCutoff / plan.a, plan.tableError);
    std::vector<double> values;
    appendCoefficients(table.F, values);
    appendCoefficients(table.C, values);
    uploadReals(tables, context, values, "pseTables");
    self = table.self;
    setBox(plan, box);
    counts.initialize<int>(context, n, "pseCounts");

    using c = RpyCoefficients;
    const PlanConstants constants = {{"DEGREE_F", table.F.degree()},
                                     {"DEGREE_C", table.C.degree()}};
    uploadConstants(planConstants, context, constants);
    defines.insert({{"CONTACT", context.doubleToString(c::CONTACT)},
                    {"APART_F1", context.doubleToString(c::APART_F1)},
                    {"APART_F3", context.doubleToString(c::APART_F3)},
                    {"APART_G1", context.doubleToString(c::APART_G1)},
                    {"APART_G3", context.doubleToString(c::APART_G3)},
                    {"OVERLAP_F1", context.doubleToString(c::OVERLAP_F1)},
                    {"OVERLAP_G1", context.doubleToString(c::OVERLAP_G1)}});
    if (!table.rpy)
        defines["POLYNOMIALS_ALONE"] = "1";
    const ComputeProgram program = programs.realSpace(defines, constants);
    findKernel = DeviceKernel(context, program, "findNeighbours");
    return program;
}

/** What realSpace.cc calls geometry, in that order; the images of the box, if they are summed. */
void DeviceRealSpace::setBox(const Plan& plan, const Lattice& box) {
    if (sphereRows) {
        sphereRows->setBox(plan, box);
        return;
    }
    const double rc = plan.realCutoff / plan.a;
    std::vector<double> values = geometryOf(context, box, plan.a);
    values.insert(values.end(), {rc * rc, 2 / (rc * rc), self});
    for (int d = 0; d < 3; d++)
        values.push_back(
            std::min((1 + REACH_MARGIN) * plan.realCutoff / box.width(d) + REACH_MARGIN, 0.9));
    geometry.set(values);
    if (sumImages)
        numImages = uploadImages(images, context, box, plan.realCutoff, plan.a);
}

void DeviceRealSpace::findNeighbours() {
    if (sphereRows) {
        sphereRows->find();
        return;
    }
    const int n = places.count();
    const int entry = sumImages ? sizeof(mm_int2) : sizeof(int);
    neighbours.reserve(context, size_t(capacity) * n, entry, "pseNeighbours");
    if (sumImages)
        findKernel(n, n, capacity, numImages, places.places(), *images, geometry.array(),
                   *neighbours, counts, summary.maxima());
    else
        findKernel(n, n, capacity, places.cells(), places.places(), places.cellStarts(),
                   geometry.array(), *neighbours, counts, summary.maxima());
}

bool DeviceRealSpace::hadRoom() {
    if (sphereRows)
        return sphereRows->hadRoom();
    const double most = summary.maximum(StepSummary::Neighbours);
    if (most <= capacity)
        return true;
    capacity = static_cast<int>(MORE_ROOM * most);
    return false;
}

/** Launch a kernel that begins with MATRIX_PARAMETERS. */
template <class... Arguments>
void DeviceRealSpace::withMatrix(DeviceKernel& kernel, Arguments&&... arguments) {
    const int n = places.count();
    if (sphereRows)
        sphereRows->withMatrix(kernel, arguments...);
    else if (sumImages)
        kernel(n, n, planConstants, places.places(), *images, *neighbours, counts, geometry.array(),
               tables, arguments...);
    else
        kernel(n, n, planConstants, places.places(), *neighbours, counts, geometry.array(), tables,
               arguments...);
}

void DeviceRealSpace::multiply(ComputeArray& f, ComputeArray& u) {
    withMatrix(multiplyReal, f, u);
}

} // namespace PSE
