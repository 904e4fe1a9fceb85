// SPDX-License-Identifier: MIT
#include "HostStepKernel.h"
#include "openmm/internal/ContextImpl.h"
#include <cmath>

using namespace PSE::numerics;
using OpenMM::ContextImpl;
using std::string;
using std::vector;
using OmmVec3 = OpenMM::Vec3;

namespace PSE {

HostStepKernel::HostStepKernel(string name, const OpenMM::Platform& platform,
                               OpenMM::ReferencePlatform::PlatformData& data,
                               std::unique_ptr<EngineFactory> factory)
    : PlannedStepKernel(name, platform), data(data), factory(std::move(factory)) {}

void HostStepKernel::boxVectors(OmmVec3 box[3]) const {
    for (int d = 0; d < 3; d++)
        box[d] = data.periodicBoxVectors[d];
}

void HostStepKernel::useEngine(const Plan& plan, const Lattice& box) {
    engine = factory->create(plan, box, viscosity, scene.mobile, clock);
}

void HostStepKernel::useUnbounded(const UnboundedPlan& plan) {
    engine = factory->createUnbounded(plan, scene.radii, viscosity, scene.mobile, clock);
}

void HostStepKernel::useFreeDraining() {
    engine = factory->createFreeDraining(viscosity, scene.radii, scene.mobile, clock);
}

string HostStepKernel::precisionName(const Plan& plan) const {
    return (plan.split || plan.mixture) && plan.precision == Precision::Single ? "single"
                                                                               : "double";
}

string HostStepKernel::precisionName(const UnboundedPlan& plan) const {
    return plan.precision == Precision::Single ? "single" : "double";
}

void HostStepKernel::followPositions() {
    followBox();
    gather(*data.positions, positions);
    engine->setPositions(positions);
}

void HostStepKernel::gather(const vector<OmmVec3>& all, vector<Vec3>& mobile) const {
    mobile.resize(scene.mobile.size());
    for (size_t i = 0; i < mobile.size(); i++)
        mobile[i] = fromOpenMM(all[scene.mobile[i]]);
}

vector<OmmVec3> HostStepKernel::scattered(const vector<Vec3>& mobile, double scale) const {
    vector<OmmVec3> all(masses.size());
    for (size_t i = 0; i < mobile.size(); i++)
        all[scene.mobile[i]] = toOpenMM(mobile[i]) * scale;
    return all;
}

void HostStepKernel::requireFinite(const vector<Vec3>& values,
                                   const CheckedQuantity& quantity) const {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& value : values)
        sum += 0.0 * value; // not a number as soon as one of them is not finite
    if (sum == Vec3::Zero())
        return;
    for (size_t i = 0; i < values.size(); i++)
        if (!values[i].allFinite())
            refuseNotFinite(quantity, scene.mobile[i], values[i]);
}

double HostStepKernel::checkedVelocities(ContextImpl& context, double dt) const {
    requireFinite(velocities, VELOCITY);
    Vec3 largest = Vec3::Zero();
    for (const Vec3& velocity : velocities)
        largest = largest.cwiseMax(velocity.cwiseAbs());
    if (mayBlowUp(largest.maxCoeff(), dt)) {
        vector<OfParticle> all;
        for (size_t i = 0; i < velocities.size(); i++)
            all.emplace_back(scene.mobile[i], velocities[i]);
        refuseBlowUp(context, all, dt);
    }
    return largest.maxCoeff();
}

void HostStepKernel::refusePlaces(const CheckedQuantity& quantity, bool next) const {
    requireFinite(positions, quantity);
    for (size_t i = 0; i < positions.size(); i++)
        if (positions[i].cwiseAbs().maxCoeff() > farthestPosition())
            refuseFarAway(scene.mobile[i], positions[i], next);
}

void HostStepKernel::checkNextPositions() const {
    const double farthest = farthestPosition();
    bool fine = true;
    for (const Vec3& x : positions)
        for (int d = 0; d < 3; d++)
            fine &= std::fabs(x[d]) <= farthest; // false for what is not a number
    if (!fine)
        refusePlaces(NEXT_POSITION, true);
}

void HostStepKernel::checkPositions(ContextImpl&) {
    const double farthest = farthestPosition();
    bool fine = true;
    for (int i : scene.mobile) {
        const OmmVec3& x = (*data.positions)[i];
        for (int d = 0; d < 3; d++)
            fine &= std::fabs(x[d]) <= farthest; // false for what is not a number
    }
    if (fine)
        return;
    gather(*data.positions, positions);
    refusePlaces(POSITION, false);
}

void HostStepKernel::computeForces(ContextImpl& context, int groups) {
    factory->evaluate(*data.positions, data.periodicBoxVectors, isSheared(),
                      [&] { PlannedStepKernel::computeForces(context, groups); });
}

StepState HostStepKernel::getStepState() const {
    factory->startAnew();
    return PlannedStepKernel::getStepState();
}

void HostStepKernel::setStepState(const StepState& state) {
    factory->startAnew();
    PlannedStepKernel::setStepState(state);
}

void HostStepKernel::addFlow(double strain, double dt) {
    for (size_t i = 0; i < velocities.size(); i++)
        velocities[i][0] += strain / dt * positions[i][1];
}

void HostStepKernel::execute(ContextImpl& context, const PSEBrownianIntegrator& integrator) {
    gather(*data.forces, forces);
    requireFinite(forces, FORCE);
    followPositions();
    const Thermal noise = thermal(integrator, false);
    engine->computeVelocities(&forces, noise.kT > 0 ? &noise : NULL, velocities);
    const double dt = integrator.getStepSize(), fastest = checkedVelocities(context, dt),
                 flow = strainOf(data.time, dt);
    if (flow != 0)
        addFlow(flow, dt);
    for (size_t i = 0; i < velocities.size(); i++)
        positions[i] += dt * velocities[i];
    checkNextPositions();
    if (flow != 0 && scene.periodicBox) {
        const Matrix3 box = shearedBox(flow).vectors();
        context.setPeriodicBoxVectors(toOpenMM(box.col(0)), toOpenMM(box.col(1)),
                                      toOpenMM(box.col(2)));
    }
    for (size_t i = 0; i < positions.size(); i++) {
        (*data.positions)[scene.mobile[i]] = toOpenMM(positions[i]);
        (*data.velocities)[scene.mobile[i]] = toOpenMM(velocities[i]);
    }
    context.computeVirtualSites();
    if (flow != 0)
        factory->followBox(*data.positions, data.periodicBoxVectors);
    strain += flow;
    growth.add(fastest, dt);
    data.time += dt;
    data.stepCount++;
    steps++;
}

double HostStepKernel::computeKineticEnergy(ContextImpl&) {
    double energy = 0;
    for (size_t i = 0; i < masses.size(); i++)
        energy += 0.5 * masses[i] * (*data.velocities)[i].dot((*data.velocities)[i]);
    return energy;
}

vector<OmmVec3> HostStepKernel::applyMobility(ContextImpl&, const vector<OmmVec3>& given) {
    vector<Vec3> mobile;
    gather(given, mobile);
    requireFinite(mobile, GIVEN_FORCE);
    const StageClock ofSteps = clock;
    followPositions();
    vector<Vec3> u;
    engine->computeVelocities(&mobile, NULL, u);
    clock = ofSteps;
    return scattered(u, 1);
}

vector<OmmVec3> HostStepKernel::sampleBrownianDisplacements(ContextImpl&,
                                                            const PSEBrownianIntegrator& integrator,
                                                            int count) {
    vector<OmmVec3> all;
    all.reserve(masses.size() * count);
    const StageClock ofSteps = clock;
    followPositions();
    vector<Vec3> u(scene.mobile.size(), Vec3::Zero());
    for (int i = 0; i < count; i++) {
        const Thermal noise = thermal(integrator, true);
        if (noise.kT > 0) {
            engine->computeVelocities(NULL, &noise, u);
            samples++;
        }
        const vector<OmmVec3> displacements = scattered(u, noise.dt);
        all.insert(all.end(), displacements.begin(), displacements.end());
    }
    clock = ofSteps;
    return all;
}

} // namespace PSE
