// SPDX-License-Identifier: MIT
#include "DeviceEngine.h"
#include "DevicePrograms.h"
#include <algorithm>
#include <cmath>
#include <limits>

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

DeviceEngine::DeviceEngine(DevicePrograms& programs, int particles, const std::vector<int>& mobile,
                           const Lattice& box, double range, double unit, int summaryRows,
                           StageClock& clock, std::shared_ptr<const SizeGroups> sizes)
    : context(programs.context()), numParticles(particles), unit(unit),
      summary(programs, static_cast<int>(mobile.size()), summaryRows),
      places(programs, particles, mobile, box, range, summary, std::move(sizes)),
      stages(programs.context(), clock) {
    const int n = std::max(1, places.count());
    forces.initialize(context, n, 4 * realSize(context), "pseForces");
    u.initialize(context, n, 4 * realSize(context), "pseVelocities");
    const ComputeProgram program = programs.particles();
    takeForcesKernel = DeviceKernel(context, program, "takeForces");
    takeGivenForces = DeviceKernel(context, program, "takeGivenForces");
    checkKernel = DeviceKernel(context, program, "checkVelocities");
    moveParticles = DeviceKernel(context, program, "moveParticles");
}

void DeviceEngine::takeForces() {
    takeForcesKernel(places.count(), places.count(), context.getPaddedNumAtoms(),
                     context.getLongForceBuffer(), places.slots(), forces, summary.maxima());
}

void DeviceEngine::takeForces(const std::vector<double>& values) {
    given.reserve(context, numParticles, 4 * realSize(context), "pseGivenForces");
    if (realIsDouble(context))
        (*given).upload(values.data());
    else
        (*given).upload(std::vector<float>(values.begin(), values.end()).data());
    takeGivenForces(places.count(), places.count(), places.places(), *given, forces);
}

void DeviceEngine::checkVelocities() {
    checkKernel(places.count(), places.count(), u, summary.maxima());
}

void DeviceEngine::move(double dt) {
    if (context.getUseMixedPrecision())
        moveParticles(places.count(), places.count(), Mixed{dt}, Mixed{unit}, places.slots(), u,
                      context.getPosq(), context.getVelm(), context.getPosqCorrection());
    else
        moveParticles(places.count(), places.count(), Mixed{dt}, Mixed{unit}, places.slots(), u,
                      context.getPosq(), context.getVelm());
    stages.charge("positions");
}

std::vector<std::pair<int, numerics::Vec3>> DeviceEngine::velocities() const {
    const std::vector<int> particles = places.particles();
    std::vector<std::pair<int, numerics::Vec3>> result;
    const auto take = [&](auto numbers) { // four for each place
        u.download(numbers.data());
        for (size_t i = 0; i < particles.size(); i++)
            result.push_back(
                {particles[i],
                 unit * numerics::Vec3(numbers[4 * i], numbers[4 * i + 1], numbers[4 * i + 2])});
    };
    if (realIsDouble(context))
        take(std::vector<double>(4 * u.getSize()));
    else
        take(std::vector<float>(4 * u.getSize()));
    return result;
}

DeviceFreeDraining::DeviceFreeDraining(DevicePrograms& programs, int particles,
                                       const std::vector<int>& mobile,
                                       const std::vector<double>& radii, double viscosity,
                                       StageClock& clock)
    : DeviceEngine(programs, particles, mobile, Lattice::orthorhombic(1, 1, 1), 0, 1, 0, clock) {
    std::vector<double> values(particles, 0.0);
    for (size_t i = 0; i < mobile.size(); i++)
        values[mobile[i]] = 1 / (6 * M_PI * viscosity * radii[i]);
    uploadReals(mobility, context, values, "pseMobility");
    drainFreely = DeviceKernel(context, programs.particles(), "drainFreely");
}

void DeviceFreeDraining::setPositions() {
    places.update();
}

void DeviceFreeDraining::computeVelocities(bool forced, const Thermal* thermal) {
    const double noise = thermal == NULL ? 0 : std::sqrt(2 * thermal->kT / thermal->dt);
    const NoiseKey key = thermal == NULL ? NoiseKey{} : thermal->real;
    drainFreely(places.count(), places.count(), forced ? 1 : 0, Real{noise}, kernelKey(key),
                places.places(), mobility, forces, u);
    checkVelocities();
    summary.read(0);
    stages.charge("free draining");
}

namespace {

std::shared_ptr<const SizeGroups> sizesOf(const Plan& plan) {
    return plan.mixture ? std::make_shared<const SizeGroups>(plan) : nullptr;
}

/**
 * The range (nm) for which particles are sorted into cells: that of the real half, or without one
 * the extent of the blocks of grid points for which waveSpace.cc collects particles.
 */
double cellRange(const Plan& plan, const Lattice& box) {
    constexpr double BLOCK_POINTS = 8;
    if (plan.hasRealHalf())
        return plan.realCutoff;
    double spacing = std::numeric_limits<double>::infinity();
    for (int d = 0; d < 3; d++)
        spacing = std::min(spacing, box.width(d) / plan.grid[d]);
    return BLOCK_POINTS * spacing;
}

} // namespace

DevicePeriodicEngine::DevicePeriodicEngine(DevicePrograms& programs, int particles,
                                           const std::vector<int>& mobile, const Plan& plan,
                                           const Lattice& box, double viscosity, StageClock& clock)
    : DeviceEngine(programs, particles, mobile, box, cellRange(plan, box),
                   1 / (6 * M_PI * viscosity * plan.a),
                   plan.hasRealHalf() ? DeviceLanczos::summaryRows(LanczosTridiagonal::REAL_HALF)
                                      : 0,
                   clock, sizesOf(plan)),
      plan(plan), drag(6 * M_PI * viscosity * plan.a),
      spheres(plan.mixture ? new DeviceSpheres(programs, plan, particles, mobile, places)
                           : nullptr),
      waveSpace(programs, plan, box, places, spheres.get()) {
    if (plan.hasRealHalf())
        realSpace.emplace(programs, plan, box, places, summary, spheres.get());
}

void DevicePeriodicEngine::setBox(const Lattice& box) {
    places.setBox(box, cellRange(plan, box));
    if (realSpace)
        realSpace->setBox(plan, box);
    waveSpace.setBox(plan, box);
}

void DevicePeriodicEngine::setPositions() {
    places.update();
    if (spheres)
        spheres->update();
    waveSpace.evaluateWindows();
    stages.charge("sorting of particles and window weights");
    if (realSpace) {
        realSpace->findNeighbours();
        stages.charge("neighbours");
    }
}

/** Everything up to the one reading of the summary. */
void DevicePeriodicEngine::launch(bool forced, const Thermal* thermal, double noise) {
    if (forced && realSpace) {
        realSpace->multiply(forces, u);
        stages.charge("real-space velocities");
    } else
        context.clearBuffer(u);
    int rows = 0;
    if (noise > 0 && realSpace) {
        rows = realSpace->squareRoot().start(thermal->real);
        stages.charge("real-space noise (Lanczos)");
    }
    waveSpace.addVelocities(forced ? &forces : NULL, noise, noise > 0 ? thermal->wave : NoiseKey{},
                            u, stages);
    checkVelocities();
    summary.read(rows);
}

void DevicePeriodicEngine::computeVelocities(bool forced, const Thermal* thermal) {
    const double noise =
        thermal == NULL ? 0 : std::sqrt(2 * thermal->kT * drag / thermal->dt); // a force
    launch(forced, thermal, noise);
    while (realSpace && !realSpace->hadRoom()) {
        realSpace->findNeighbours();
        launch(forced, thermal, noise);
    }
    if (noise > 0 && realSpace) {
        realSpace->squareRoot().add(noise, u);
        stages.charge("real-space noise (Lanczos)");
    }
}

} // namespace PSE
