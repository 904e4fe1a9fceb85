// SPDX-License-Identifier: MIT
#include "DeviceUnbounded.h"
#include "numerics/Rpy.h"
#include <cmath>

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

namespace {

/// in radii squared: below, pairs count as this far apart
constexpr double SMALLEST_SINGLE = 1e-20, SMALLEST_DOUBLE = 1e-30;

/** A polynomial in t by Horner's rule, as an expression: its numbers become immediates. */
std::string expressionOf(const ComputeContext& context, const std::vector<double>& powers) {
    std::string text;
    for (size_t n = powers.size(); n-- > 0;)
        text = context.doubleToString(powers[n]) + (text.empty() ? "" : "+t*(" + text + ")");
    return "(" + text + ")";
}

Defines definesFor(const ComputeContext& context, const UnboundedPlan& plan) {
    using c = RpyCoefficients;
    Defines defines = DeviceLanczos::defines(LanczosTridiagonal::WHOLE);
    const auto define = [&](const char* name, double value) {
        defines[name] = context.doubleToString(value);
    };
    define("SMALLEST_R2", realIsDouble(context) ? SMALLEST_DOUBLE : SMALLEST_SINGLE);
    if (plan.model == SphereModel::ForceCoupling) {
        define("SPREAD", GaussianPairs::SPREAD);
        defines["GAUSSIAN_F"] = expressionOf(context, plan.gaussian.F);
        defines["GAUSSIAN_C"] = expressionOf(context, plan.gaussian.C);
    } else if (plan.equalRadii) {
        defines["EQUAL_RADII"] = "1";
        define("CONTACT", c::CONTACT);
        define("APART_F1", c::APART_F1);
        define("APART_F3", c::APART_F3);
        define("APART_G1", c::APART_G1);
        define("APART_G3", c::APART_G3);
        define("OVERLAP_F1", c::OVERLAP_F1);
        define("OVERLAP_G1", c::OVERLAP_G1);
    }
    return defines;
}

} // namespace

DeviceUnbounded::DeviceUnbounded(DevicePrograms& programs, int particles,
                                 const std::vector<int>& mobile, const UnboundedPlan& plan,
                                 const std::vector<double>& radii, double viscosity,
                                 StageClock& clock)
    : DeviceEngine(programs, particles, mobile, Lattice::orthorhombic(1, 1, 1), 0,
                   1 / (6 * M_PI * viscosity * plan.a),
                   DeviceLanczos::summaryRows(LanczosTridiagonal::WHOLE), clock),
      drag(6 * M_PI * viscosity * plan.a), perRadius(1 / plan.a),
      lanczos(programs.context(), places, summary, plan.lanczosTolerance, plan.negativeTolerance,
              LanczosTridiagonal::WHOLE),
      images(programs.context()) {
    std::vector<double> values(particles, 1.0);
    for (size_t i = 0; i < mobile.size(); i++)
        values[mobile[i]] = radii[i] / plan.a;
    uploadReals(radius, context, values, "pseRadius");
    centres.initialize(context, places.count(), 4 * realSize(context), "pseCentres");
    if (context.getUseMixedPrecision())
        rests.initialize(context, places.count(), 4 * realSize(context), "pseRests");
    const ComputeProgram program = programs.unbounded(definesFor(context, plan));
    locateCentres = DeviceKernel(context, program, "locateCentres");
    multiplyAll = DeviceKernel(context, program, "multiplyAll");
    lanczos.use(program, [this](DeviceKernel& expandBasis, int iteration, ComputeArray& basis,
                                ComputeArray& partial) {
        withMatrix(expandBasis, iteration, basis, partial);
    });
}

/** Launch a kernel that begins with MATRIX_PARAMETERS. */
template <class... Arguments>
void DeviceUnbounded::withMatrix(DeviceKernel& kernel, Arguments&&... arguments) {
    const int n = places.count();
    if (context.getUseMixedPrecision())
        kernel(n, n, Real{perRadius}, centres, rests, arguments...);
    else
        kernel(n, n, Real{perRadius}, centres, arguments...);
}

void DeviceUnbounded::setPositions() {
    places.update();
    OpenMM::Vec3 a, b, c;
    context.getPeriodicBoxVectors(a, b, c);
    Matrix3 box;
    box << a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2];
    images.follow(box);
    const int n = places.count();
    if (context.getUseMixedPrecision())
        locateCentres(n, n, context.getPosq(), places.slots(), places.places(), radius,
                      images.shifts(), centres, context.getPosqCorrection(), rests);
    else
        locateCentres(n, n, context.getPosq(), places.slots(), places.places(), radius,
                      images.shifts(), centres);
}

void DeviceUnbounded::computeVelocities(bool forced, const Thermal* thermal) {
    const double noise =
        thermal == NULL ? 0 : std::sqrt(2 * thermal->kT * drag / thermal->dt); // a force
    if (forced) {
        withMatrix(multiplyAll, forces, u);
        stages.charge("velocities");
    } else
        context.clearBuffer(u);
    const int rows = (noise > 0 ? lanczos.start(thermal->real) : 0);
    checkVelocities();
    summary.read(rows);
    if (noise > 0) {
        lanczos.add(noise, u);
        stages.charge("noise (Lanczos)");
    }
}

} // namespace PSE
