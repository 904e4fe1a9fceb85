// SPDX-License-Identifier: MIT
#include "CommonStepKernel.h"
#include "openmm/OpenMMException.h"
#include "openmm/common/ContextSelector.h"
#include "openmm/common/IntegrationUtilities.h"
#include "openmm/internal/ContextImpl.h"
#include <cmath>
#include <limits>
#include <sstream>

using namespace PSE::numerics;
using OpenMM::ContextImpl;
using OpenMM::ContextSelector;
using OpenMM::OpenMMException;
using std::vector;
using OmmVec3 = OpenMM::Vec3;

namespace PSE {

namespace {

/** Single precision adds 4e-7 to the error of the fluid: from this tolerance on it is hidden. */
constexpr double SINGLE_PRECISION_FLOOR = 1e-5;
/// kJ/(mol nm); OpenMM's fixed-point forces on devices hold 2^31, and so does what is not a number
constexpr double LARGEST_FORCE = 1073741824.0;
/// One step in so many is measured, besides the first few.
constexpr int MEASURED_FIRST = 3, MEASURE_EVERY = 256;
/// Of the way to the farthest position: after it positions are checked again.
constexpr double SHORT_WAY = 1e-3;
/// Kernels count grid points and window points with 32 bits.
constexpr double LARGEST_INDEX = 2e9;

} // namespace

CommonStepKernel::CommonStepKernel(std::string name, const OpenMM::Platform& platform,
                                   OpenMM::ComputeContext& context, int devices,
                                   std::function<void()> forgetLists)
    : PlannedStepKernel(name, platform), device(context), numDevices(devices),
      forgetLists(std::move(forgetLists)), programs(context) {}

CommonStepKernel::~CommonStepKernel() {
    ContextSelector selector(device);
    engine.reset();
    flow.reset();
    programs.clear();
}

void CommonStepKernel::initialize(ContextImpl& context, const PSEBrownianIntegrator& integrator,
                                  const Scene& sceneSeen) {
    if (numDevices > 1)
        throw OpenMMException(
            "PSEBrownianIntegrator: the Context was asked to use " + std::to_string(numDevices) +
            " devices, the limit is 1: the fluid couples all particles; name a single device in "
            "the platform property DeviceIndex");
    if (device.getMaxThreadBlockSize() < GROUP_SIZE)
        throw OpenMMException("PSEBrownianIntegrator: this device runs work groups of at most " +
                              std::to_string(device.getMaxThreadBlockSize()) + " threads, and " +
                              std::to_string(GROUP_SIZE) +
                              " are needed; use another device or the CPU platform");
    scene = sceneSeen;
    if (integrator.getShearRate() != 0)
        requireShear(context);
    tolerance = integrator.getErrorTolerance();
    device.initializeContexts();
    ContextSelector selector(device);
    PlannedStepKernel::initialize(context, integrator, sceneSeen);
}

void CommonStepKernel::requireShear(ContextImpl&) const {
    if (scene.periodicBox && !device.getBoxIsTriclinic())
        throw OpenMMException(
            "PSEBrownianIntegrator: setShearRate: the default box of the System is rectangular, "
            "and on this platform a Context that began with such a box cannot tilt it; give the "
            "System a default box with a tilt, however small "
            "(System.setDefaultPeriodicBoxVectors with b = (0.001 ax, by, 0)), before the Context "
            "is created: its box may be set to the rectangular one afterwards. Or use the "
            "platform CPU, or leave the shear rate at 0");
}

void CommonStepKernel::boxVectors(OmmVec3 box[3]) const {
    device.getPeriodicBoxVectors(box[0], box[1], box[2]);
}

void CommonStepKernel::adapt(PlanRequest& request) const {
    request.singleFloor =
        realIsDouble(device) ? std::numeric_limits<double>::infinity() : SINGLE_PRECISION_FLOOR;
    request.directSums = false;
    request.singleOnly = !realIsDouble(device);
}

void CommonStepKernel::adapt(UnboundedRequest& request) const {
    if (!realIsDouble(device))
        request.singleFloor = SINGLE_PRECISION_FLOOR;
}

double CommonStepKernel::coordinateRounding() const {
    return mixedIsDouble(device) ? PlannedStepKernel::coordinateRounding() : 6e-8;
}

std::string CommonStepKernel::precisionName() const {
    return device.getUseDoublePrecision()  ? "double"
           : device.getUseMixedPrecision() ? "mixed"
                                           : "single";
}

void CommonStepKernel::requireRoom(const Plan& plan, const Lattice& box) const {
    std::ostringstream message;
    const double windows = 3.0 * plan.windowSupport * scene.mobile.size();
    if (std::max(plan.gridPoints(), windows) > LARGEST_INDEX) {
        message << "PSEBrownianIntegrator: this scene needs " << plan.gridPoints()
                << " grid points and " << windows << " window weights, the limit on a device is "
                << LARGEST_INDEX
                << " each; loosen the tolerance, choose a smaller splitting parameter, a smaller "
                   "box or fewer particles";
        throw OpenMMException(message.str());
    }
    // On a processor the device's memory is the machine's; of other devices OpenMM does not tell.
    if (device.getIsCPU())
        requireMemory(plan, box, scene.mobile.size(), memoryUse(plan, box));
    if (plan.precision == Precision::Double && !realIsDouble(device)) {
        message << "PSEBrownianIntegrator: the tolerance " << tolerance << " with these parameters "
                << "(predicted error " << plan.predictedError << ", "
                << meanNeighbours(plan, box, double(scene.mobile.size()))
                << " neighbours of each particle) needs double precision, and "
                << "this Context computes the fluid in single precision (Precision "
                << precisionName(plan) << "), which serves tolerances down to "
                << SINGLE_PRECISION_FLOOR << "; set the platform property Precision to double, or "
                << "loosen the tolerance, or leave automatic what is prescribed of the window, the "
                << "grid and the splitting parameter";
        throw OpenMMException(message.str());
    }
}

MemoryUse CommonStepKernel::memoryUse(const Plan& plan, const Lattice& box) const {
    const int real = realSize(device);
    const double ofSpheres = plan.mixture ? DeviceSpheres::bytesPerParticle(real) +
                                                DeviceSphereRows::bytesPerParticle(plan, box, real)
                                          : 0;
    return {DeviceWaveSpace::bytesPerGridPoint(plan, real), DeviceRealSpace::bytesPerPair(plan),
            DeviceWaveSpace::bytesPerParticle(plan, real) +
                DeviceRealSpace::bytesPerParticle(real) + ofSpheres};
}

void CommonStepKernel::useEngine(const Plan& plan, const Lattice& box) {
    requireRoom(plan, box);
    ContextSelector selector(device);
    try {
        std::unique_ptr<DeviceEngine> made(new DevicePeriodicEngine(
            programs, static_cast<int>(masses.size()), scene.mobile, plan, box, viscosity, clock));
        engine = std::move(made);
    } catch (const OpenMMException& failure) {
        const std::string what = failure.what();
        if (what.find("Error creating array") == std::string::npos)
            throw;
        const MemoryUse use = memoryUse(plan, box);
        std::ostringstream message;
        message << "PSEBrownianIntegrator: the device has no room for a grid of " << plan.grid[0]
                << " x " << plan.grid[1] << " x " << plan.grid[2] << " points ("
                << use.perGridPoint * plan.gridPoints() / 1e9 << " GB) and " << scene.mobile.size()
                << " particles (" << what
                << "); loosen the tolerance, choose a smaller splitting parameter, a smaller box "
                   "or fewer particles";
        throw OpenMMException(message.str());
    }
    stepsSinceStart = 0;
}

void CommonStepKernel::setEngineBox(const Lattice& box) {
    ContextSelector selector(device);
    engine->setBox(box);
}

void CommonStepKernel::useUnbounded(const UnboundedPlan& plan) {
    if (plan.precision == Precision::Double && !realIsDouble(device)) {
        std::ostringstream message;
        message << "PSEBrownianIntegrator: the tolerance " << tolerance
                << " needs double precision, and this Context computes the fluid in single "
                << "precision (Precision " << precisionName() << "), which serves tolerances down "
                << "to " << SINGLE_PRECISION_FLOOR
                << "; set the platform property Precision to double, or loosen the tolerance";
        throw OpenMMException(message.str());
    }
    if (device.getIsCPU())
        requireMemory(scene.mobile.size(), 4 * realSize(device), 12 * realSize(device));
    ContextSelector selector(device);
    engine.reset(new DeviceUnbounded(programs, static_cast<int>(masses.size()), scene.mobile, plan,
                                     scene.radii, viscosity, clock));
    stepsSinceStart = 0;
}

void CommonStepKernel::useFreeDraining() {
    ContextSelector selector(device);
    engine.reset(new DeviceFreeDraining(programs, static_cast<int>(masses.size()), scene.mobile,
                                        scene.radii, viscosity, clock));
    stepsSinceStart = 0;
}

void CommonStepKernel::checkPositions(ContextImpl& context) {
    // Our own steps that would lead away from finite positions are refused; those of another
    // integrator, in a CompoundIntegrator, are not.
    followBoxOfLists();
    const double farthest = farthestPosition();
    const bool near = travelled < SHORT_WAY * farthest;
    if (positionsChecked && near && stepCountSeen == device.getStepCount())
        return;
    vector<OmmVec3> positions;
    context.getPositions(positions);
    largestCoordinate = 0;
    for (int i : scene.mobile) {
        const Vec3 x = fromOpenMM(positions[i]);
        if (!x.allFinite())
            refuseNotFinite(POSITION, i, x);
        if (x.cwiseAbs().maxCoeff() > farthest)
            refuseFarAway(i, x);
        largestCoordinate = std::max(largestCoordinate, x.cwiseAbs().maxCoeff());
    }
    positionsChecked = true;
    travelled = 0;
    stepCountSeen = device.getStepCount();
}

/**
 * OpenMM's lists of neighbours go by how far particles have moved; a box that moves beneath them is
 * not noticed there [T37].
 */
void CommonStepKernel::followBoxOfLists() {
    OmmVec3 box[3];
    boxVectors(box);
    if (std::equal(box, box + 3, boxOfLists))
        return;
    ContextSelector selector(device);
    forgetLists();
    std::copy(box, box + 3, boxOfLists);
}

bool CommonStepKernel::measures() const {
    return stepsSinceStart < MEASURED_FIRST || stepsSinceStart % MEASURE_EVERY == 0;
}

void CommonStepKernel::execute(ContextImpl& context, const PSEBrownianIntegrator& integrator) {
    ContextSelector selector(device);
    followBox();
    if (stepsSinceStart == 1)
        clock = StageClock(); // the first step compiled and loaded what later ones only run
    engine->clock().start(measures());
    engine->setPositions();
    engine->takeForces();
    const Thermal noise = thermal(integrator, false);
    engine->computeVelocities(true, noise.kT > 0 ? &noise : NULL);
    const double dt = integrator.getStepSize(), strained = strainOf(device.getTime(), dt);
    checkStep(context, dt, strained);
    engine->move(dt);
    travelled += dt * engine->largestVelocity() + farthestFlow(strained);
    growth.add(engine->largestVelocity(), dt);
    if (strained != 0)
        flowAlong(strained, dt);
    strain += strained;
    device.getIntegrationUtilities().computeVirtualSites();
    device.setTime(device.getTime() + dt);
    device.setStepCount(device.getStepCount() + 1);
    stepCountSeen = device.getStepCount();
    device.reorderAtoms();
    steps++;
    stepsSinceStart++;
}

/** Particles have made a step; now they follow the flow, and the box does. */
void CommonStepKernel::flowAlong(double strained, double dt) {
    if (!flow)
        flow.emplace(programs);
    OmmVec3 edges[3];
    boxVectors(edges);
    const Lattice box(fromOpenMM(edges[0]), fromOpenMM(edges[1]), fromOpenMM(edges[2]));
    flow->carry(strained, dt, box);
    if (scene.periodicBox) {
        flow->tilt(strained, box);
        followBoxOfLists();
    }
    engine->clock().charge("positions");
}

/** At least as far as the flow of a strain carries any particle in a step (nm). */
double CommonStepKernel::farthestFlow(double strained) const {
    return std::fabs(strained) * (largestCoordinate + travelled);
}

/** Refuse, before anything moves, what is not finite or leads beyond where positions mean a place.
 */
void CommonStepKernel::checkStep(ContextImpl& context, double dt, double strained) const {
    if (!(engine->largestForce() < LARGEST_FORCE))
        refuseForce(context);
    if (!std::isfinite(engine->largestVelocity()))
        refuseVelocity();
    if (mayBlowUp(engine->largestVelocity(), dt))
        refuseBlowUp(context, engine->velocities(), dt);
    const double largest = realIsDouble(device) ? std::numeric_limits<double>::max()
                                                : std::numeric_limits<float>::max();
    const double farthest = std::min(largest, farthestPosition());
    if (!(dt * engine->largestVelocity() + farthestFlow(strained) < farthest))
        refuseMove(context, dt, strained, farthest);
    if (strained != 0 && scene.periodicBox)
        shearedBox(strained); // throws what it would throw later
}

/** Name the first particle whose force the device cannot hold. */
void CommonStepKernel::refuseForce(ContextImpl& context) const {
    vector<OmmVec3> forces;
    context.getForces(forces);
    for (int i : scene.mobile) {
        Vec3 force = fromOpenMM(forces[i]);
        if (force.cwiseAbs().maxCoeff() < LARGEST_FORCE)
            continue;
        for (int c = 0; c < 3; c++) // what was not a number, the device has made a large one
            if (std::fabs(force[c]) >= LARGEST_FORCE)
                force[c] = std::copysign(std::numeric_limits<double>::infinity(), force[c]);
        CheckedQuantity quantity = FORCE;
        quantity.unit = "kJ/(mol nm) (beyond 2^30 on this platform, or not a number)";
        refuseNotFinite(quantity, i, force);
    }
    throw OpenMMException("PSEBrownianIntegrator: a force on this device is not finite");
}

/** The first particle with a component that is not below a limit; index -1 if there is none. */
CommonStepKernel::OfParticle CommonStepKernel::firstBeyond(const vector<OfParticle>& all,
                                                           double limit) const {
    OfParticle first(-1, Vec3::Zero());
    for (const OfParticle& entry : all) {
        const Vec3& v = entry.second;
        const bool fine = v.allFinite() && v.cwiseAbs().maxCoeff() < limit;
        if (!fine && (first.first < 0 || entry.first < first.first))
            first = entry;
    }
    return first;
}

void CommonStepKernel::refuseVelocity() const {
    const OfParticle worst =
        firstBeyond(engine->velocities(), std::numeric_limits<double>::infinity());
    refuseNotFinite(VELOCITY, worst.first, worst.second);
}

/** If a particle's step is not below a limit (nm). */
void CommonStepKernel::refuseMove(ContextImpl& context, double dt, double strained,
                                  double limit) const {
    vector<OmmVec3> positions;
    context.getPositions(positions);
    vector<OfParticle> steps = engine->velocities();
    for (OfParticle& entry : steps) {
        entry.second *= dt;
        entry.second[0] += strained * positions.at(entry.first)[1];
    }
    const OfParticle worst = firstBeyond(steps, limit);
    if (worst.first < 0)
        return;
    CheckedQuantity quantity = NEXT_POSITION;
    std::ostringstream unit;
    unit << quantity.unit << " (farther than " << limit << " nm from this one)";
    const std::string text = unit.str();
    quantity.unit = text.c_str();
    refuseNotFinite(quantity, worst.first, fromOpenMM(positions.at(worst.first)) + worst.second);
}

double CommonStepKernel::computeKineticEnergy(ContextImpl&) {
    ContextSelector selector(device);
    return device.getIntegrationUtilities().computeKineticEnergy(0);
}

/** What the engine computed last, by particle of the System. */
vector<OmmVec3> CommonStepKernel::velocities(double scale) const {
    vector<OmmVec3> all(masses.size());
    for (const auto& entry : engine->velocities())
        all[entry.first] = scale * OmmVec3(entry.second[0], entry.second[1], entry.second[2]);
    return all;
}

vector<OmmVec3> CommonStepKernel::applyMobility(ContextImpl&, const vector<OmmVec3>& given) {
    double largest = 0;
    for (int i : scene.mobile) {
        const Vec3 force = fromOpenMM(given[i]);
        if (!force.allFinite())
            refuseNotFinite(GIVEN_FORCE, i, force);
        largest = std::max(largest, force.cwiseAbs().maxCoeff());
    }
    ContextSelector selector(device);
    followBox();
    if (largest == 0)
        return vector<OmmVec3>(masses.size());
    // over the largest: forces of any size fit single precision
    vector<double> scaled(4 * masses.size(), 0.0);
    for (int i : scene.mobile)
        for (int c = 0; c < 3; c++)
            scaled[4 * i + c] = given[i][c] / largest;
    engine->clock().start(false);
    engine->setPositions();
    engine->takeForces(scaled);
    engine->computeVelocities(true, NULL);
    return velocities(largest);
}

vector<OmmVec3>
CommonStepKernel::sampleBrownianDisplacements(ContextImpl&, const PSEBrownianIntegrator& integrator,
                                              int count) {
    ContextSelector selector(device);
    followBox();
    engine->clock().start(false);
    engine->setPositions();
    vector<OmmVec3> all;
    all.reserve(masses.size() * count);
    for (int i = 0; i < count; i++) {
        const Thermal noise = thermal(integrator, true);
        if (noise.kT > 0) {
            engine->computeVelocities(false, &noise);
            samples++;
        }
        const vector<OmmVec3> displacements =
            noise.kT > 0 ? velocities(noise.dt) : vector<OmmVec3>(masses.size());
        all.insert(all.end(), displacements.begin(), displacements.end());
    }
    return all;
}

} // namespace PSE
