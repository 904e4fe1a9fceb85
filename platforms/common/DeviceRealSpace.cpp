// SPDX-License-Identifier: MIT
#include "DeviceRealSpace.h"
#include "DeviceGeometry.h"
#include "numerics/Lanczos.h"
#include "numerics/RealTable.h"
#include "numerics/Rpy.h"
#include <cmath>
#include <cstdint>

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

namespace {

constexpr int FIRST_ITERATIONS = 5; ///< of a first step
/// in radii squared; below, 1/r^2 is not needed and might overflow
constexpr double SMALLEST_R2 = 1e-30;
/// of the range, in units of the box: what rounding of fractions may do, and more
constexpr double REACH_MARGIN = 1e-6;

/** Append the powers of a polynomial, highest first. */
void appendCoefficients(const Polynomial& p, std::vector<double>& all) {
    all.insert(all.end(), p.powers.rbegin(), p.powers.rend());
}

} // namespace

mm_int4 kernelKey(const NoiseKey& key) {
    return mm_int4(static_cast<int>(key.seed), static_cast<int>(key.stream),
                   static_cast<int>(uint32_t(key.counter)),
                   static_cast<int>(uint32_t(key.counter >> 32)));
}

int DeviceRealSpace::summaryRows() {
    return 2 * LanczosTridiagonal::MAX_ITERATIONS + 1;
}

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
      lanczosTolerance(plan.lanczosTolerance),
      // Eigenvalues of the truncated M_R may lie below zero by the error of the truncation.
      negativeTolerance(std::max(2 * plan.predictedError, 1e-10)),
      reorthogonalise(realIsDouble(this->context)), sumImages(plan.sumImages) {
    Defines defines = {{"MOST_VECTORS", std::to_string(LanczosTridiagonal::MAX_ITERATIONS)},
                       {"SMALLEST_R2", context.doubleToString(SMALLEST_R2)}};
    if (sumImages)
        defines["SUM_IMAGES"] = "1";
    else if (isTilted(box))
        defines["TILTED"] = "1";
    if (spheres != nullptr)
        sphereRows.reset(
            new DeviceSphereRows(programs, plan, box, places, *spheres, summary, defines));
    const ComputeProgram program =
        sphereRows ? sphereRows->program() : prepareRows(programs, plan, box, defines);
    multiplyReal = DeviceKernel(context, program, "multiplyReal");
    drawNoise = DeviceKernel(context, program, "drawNoise");
    expandBasis = DeviceKernel(context, program, "expandBasis");
    makeOrthogonal = DeviceKernel(context, program, "makeOrthogonal");
    findOverlaps = DeviceKernel(context, program, "findOverlaps");
    removeOverlaps = DeviceKernel(context, program, "removeOverlaps");
    combineBasis = DeviceKernel(context, program, "combineBasis");
    if (reorthogonalise)
        overlaps.initialize(context,
                            LanczosTridiagonal::MAX_ITERATIONS * groupsFor(context, places.count()),
                            mixedSize(context), "pseOverlaps");
    coefficients.initialize(context, LanczosTridiagonal::MAX_ITERATIONS, realSize(context),
                            "pseCoefficients");
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
    prepareGeometry(plan, box);
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
    const ComputeProgram program = programs.realSpace(defines, constants);
    findKernel = DeviceKernel(context, program, "findNeighbours");
    return program;
}

/** What realSpace.cc calls geometry, in that order; the images of the box, if they are summed. */
void DeviceRealSpace::prepareGeometry(const Plan& plan, const Lattice& box) {
    const double rc = plan.realCutoff / plan.a;
    std::vector<double> values = geometryOf(context, box, plan.a);
    values.insert(values.end(),
                  {rc * rc, 2 / (rc * rc), makeRealTable(*plan.split, rc, plan.tableError).self});
    for (int d = 0; d < 3; d++)
        values.push_back(
            std::min((1 + REACH_MARGIN) * plan.realCutoff / box.width(d) + REACH_MARGIN, 0.9));
    uploadReals(geometry, context, values, "pseGeometry");
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
        findKernel(n, n, capacity, numImages, places.places(), images, geometry, *neighbours,
                   counts, summary.maxima());
    else
        findKernel(n, n, capacity, places.cells(), places.places(), places.cellStarts(), geometry,
                   *neighbours, counts, summary.maxima());
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
        kernel(n, n, planConstants, places.places(), images, *neighbours, counts, geometry, tables,
               arguments...);
    else
        kernel(n, n, planConstants, places.places(), *neighbours, counts, geometry, tables,
               arguments...);
}

void DeviceRealSpace::multiply(ComputeArray& f, ComputeArray& u) {
    withMatrix(multiplyReal, f, u);
}

int DeviceRealSpace::startSquareRoot(const NoiseKey& key) {
    noise = key;
    done = 0;
    const int expected = iterations > 0 ? iterations : FIRST_ITERATIONS;
    basis.reserve(context, size_t(expected + 1) * places.count(), 4 * realSize(context),
                  "pseBasis");
    drawNoise(places.count(), places.count(), kernelKey(noise), places.places(), *basis,
              summary.partialSums());
    iterate(0, expected);
    return 2 * expected + 1;
}

void DeviceRealSpace::iterate(int from, int to) {
    for (int i = from; i < to; i++) {
        withMatrix(expandBasis, i, *basis, summary.partialSums());
        const int n = places.count();
        makeOrthogonal(n, n, i, *basis, summary.partialSums());
        if (reorthogonalise) {
            findOverlaps(n, n, i, *basis, overlaps);
            removeOverlaps(n, n, i, *basis, overlaps, summary.partialSums());
        }
    }
    done = to;
}

void DeviceRealSpace::addSquareRoot(double amplitude, ComputeArray& u) {
    LanczosTridiagonal small(lanczosTolerance, negativeTolerance);
    const auto norm = [this](int i) { return std::sqrt(summary.sum(2 * i)); };
    for (bool finished = false; !finished;) {
        const int i = small.iterations();
        if (i == done) {
            const size_t needed = size_t(done + 2) * places.count();
            if (basis.size() < needed) { // more room loses what there is: the same once more
                iterations = std::min(done + 1 + done / 2, LanczosTridiagonal::MAX_ITERATIONS);
                startSquareRoot(noise);
            } else
                iterate(done, done + 1);
            summary.read(2 * done + 1);
        }
        if (norm(0) == 0)
            return;
        finished = small.add(summary.sum(2 * i + 1) / norm(i), norm(i + 1));
    }
    iterations = small.iterations();
    std::vector<double> weights(coefficients.getSize(), 0.0);
    for (int i = 0; i < iterations; i++)
        weights[i] = amplitude * norm(0) * small.coefficients()[i] / norm(i);
    coefficients.upload(weights, true);
    combineBasis(places.count(), places.count(), iterations, *basis, coefficients, u);
}

} // namespace PSE
