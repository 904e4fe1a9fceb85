// SPDX-License-Identifier: MIT
#include "HostStepKernel.h"
#include "FreeDrainingEngine.h"
#include "openmmpse/internal/Units.h"
#include "openmm/OpenMMException.h"
#include "openmm/internal/ContextImpl.h"
#include "openmm/internal/OSRngSeed.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

using namespace PSE::numerics;
using OpenMM::ContextImpl;
using OpenMM::OpenMMException;
using std::string;
using std::vector;
using OmmVec3 = OpenMM::Vec3;

namespace PSE {

namespace {

constexpr char CHECKPOINT_MAGIC[] = "openmmpse checkpoint 1";
/// Boxes from the origin: there a position is known to 1e-7 of the box.
constexpr double FARTHEST = 1e9;
constexpr uint64_t LARGEST_COUNTER = uint64_t(1) << 48;

Vec3 fromOpenMM(const OmmVec3& v) {
    return Vec3(v[0], v[1], v[2]);
}

OmmVec3 toOpenMM(const Vec3& v) {
    return OmmVec3(v[0], v[1], v[2]);
}

template <class T> void write(std::ostream& stream, const T& value) {
    stream.write(reinterpret_cast<const char*>(&value), sizeof(T));
}

template <class T> T read(std::istream& stream) {
    T value;
    stream.read(reinterpret_cast<char*>(&value), sizeof(T));
    if (!stream)
        throw OpenMMException(
            "PSEBrownianIntegrator: the checkpoint ends early; it is truncated or was not written "
            "with "
            "PSEBrownianIntegrator. Create a new one with Context.createCheckpoint");
    return value;
}

SplitChoice choiceOf(PSEBrownianIntegrator::Split split) {
    switch (split) {
    case PSEBrownianIntegrator::Prolate:
        return SplitChoice::Prolate;
    case PSEBrownianIntegrator::Hasimoto:
        return SplitChoice::Hasimoto;
    default:
        return SplitChoice::Automatic;
    }
}

string readText(std::istream& stream, size_t limit) {
    const uint64_t length = read<uint64_t>(stream);
    if (length > limit)
        throw OpenMMException(
            "PSEBrownianIntegrator: the checkpoint was not written with PSEBrownianIntegrator; "
            "load it with the integrator that wrote it");
    string text(length, ' ');
    for (char& c : text)
        c = read<char>(stream);
    return text;
}

void writeText(std::ostream& stream, const string& text) {
    write(stream, uint64_t(text.size()));
    stream.write(text.data(), text.size());
}

} // namespace

HostStepKernel::HostStepKernel(string name, const OpenMM::Platform& platform,
                               OpenMM::ReferencePlatform::PlatformData& data,
                               std::unique_ptr<EngineFactory> factory)
    : IntegratePSEStepKernel(name, platform), data(data), factory(std::move(factory)) {}

void HostStepKernel::initialize(ContextImpl& context, const PSEBrownianIntegrator& integrator,
                                const Scene& sceneSeen) {
    scene = sceneSeen;
    masses.clear();
    for (int i = 0; i < context.getSystem().getNumParticles(); i++)
        masses.push_back(context.getSystem().getParticleMass(i));
    viscosity = integrator.getViscosity();
    seed = integrator.getRandomNumberSeed();
    while (seed == 0)
        seed = osrngseed() & 0x7FFFFFFF; // positive, like the seeds that users write
    if (!scene.hydrodynamics || scene.mobile.empty()) {
        engine.reset(new FreeDrainingEngine(viscosity, scene.radii, scene.mobile, clock));
        return;
    }
    const NumericalParameters& wish = integrator.getRequestedNumericalParameters();
    PlanOverrides overrides;
    overrides.xi = wish.xi;
    overrides.realCutoff = wish.realCutoff;
    overrides.bandwidth = wish.prolateBandwidth;
    for (int d = 0; d < 3; d++)
        overrides.grid[d] = wish.gridDimensions[d];
    overrides.windowSupport = wish.windowSupport;
    overrides.windowShape = wish.windowShape;
    overrides.lanczosTolerance = wish.lanczosTolerance;
    request.reset(new PlanRequest{currentBox(), static_cast<int>(scene.mobile.size()),
                                  scene.radii[0], integrator.getErrorTolerance(),
                                  integrator.getTemperature() > 0, 0, false, overrides,
                                  choiceOf(integrator.getSplit())});
    factory->adapt(*request);
    plan(request->box);
}

Lattice HostStepKernel::currentBox() const {
    const OmmVec3* box = data.periodicBoxVectors;
    try {
        return Lattice(fromOpenMM(box[0]), fromOpenMM(box[1]), fromOpenMM(box[2]));
    } catch (const std::invalid_argument& refusal) {
        throw OpenMMException(string("PSEBrownianIntegrator: ") + refusal.what());
    }
}

void HostStepKernel::plan(const Lattice& box) {
    const Plan made = planFor(box);
    engine = factory->create(made, box, viscosity, scene.mobile, clock);
    currentPlan = made;
    request->box = box;
}

void HostStepKernel::followPositions() {
    if (request) {
        const Lattice box = currentBox();
        if (box != request->box)
            plan(box);
    }
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

void HostStepKernel::requireFinite(const vector<Vec3>& values, const char* what, const char* unit,
                                   const char* remedy) const {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& value : values)
        sum += 0.0 * value; // not a number as soon as one of them is not finite
    if (sum == Vec3::Zero())
        return;
    for (size_t i = 0; i < values.size(); i++)
        if (!values[i].allFinite()) {
            std::ostringstream message;
            message << "PSEBrownianIntegrator: " << what << " of particle " << scene.mobile[i]
                    << " is (" << values[i][0] << ", " << values[i][1] << ", " << values[i][2]
                    << ") " << unit << ", which is not finite; " << remedy;
            throw OpenMMException(message.str());
        }
}

void HostStepKernel::checkPositions(ContextImpl&) {
    const OmmVec3* box = data.periodicBoxVectors;
    const double farthest = request ? FARTHEST * std::max({box[0][0], box[1][1], box[2][2]})
                                    : std::numeric_limits<double>::max();
    bool fine = true;
    for (int i : scene.mobile) {
        const OmmVec3& x = (*data.positions)[i];
        for (int d = 0; d < 3; d++)
            fine &= std::fabs(x[d]) <= farthest; // false for what is not a number
    }
    if (fine)
        return;
    gather(*data.positions, positions);
    requireFinite(positions, "the position", "nm", "set finite positions");
    for (size_t i = 0; i < positions.size(); i++)
        if (positions[i].cwiseAbs().maxCoeff() > farthest) {
            std::ostringstream message;
            message << "PSEBrownianIntegrator: particle " << scene.mobile[i] << " is "
                    << positions[i].cwiseAbs().maxCoeff() << " nm from the origin, more than "
                    << FARTHEST << " boxes, and its place in the box is lost to rounding; set "
                    << "positions nearer to the box";
            throw OpenMMException(message.str());
        }
}

Thermal HostStepKernel::thermal(const PSEBrownianIntegrator& integrator, bool sample) const {
    const uint64_t counter = sample ? samples : steps;
    const NoiseKey real = {uint32_t(seed), sample ? Stream::SampleReal : Stream::StepReal, counter};
    const NoiseKey wave = {uint32_t(seed), sample ? Stream::SampleWave : Stream::StepWave, counter};
    return {KT_PER_KELVIN * integrator.getTemperature(), integrator.getStepSize(), real, wave};
}

void HostStepKernel::execute(ContextImpl& context, const PSEBrownianIntegrator& integrator) {
    gather(*data.forces, forces);
    requireFinite(forces, "the force", "kJ/(mol nm)",
                  "check the Forces at these positions, or use a smaller step size");
    followPositions();
    const Thermal noise = thermal(integrator, false);
    engine->computeVelocities(&forces, noise.kT > 0 ? &noise : NULL, velocities);
    requireFinite(velocities, "the velocity", "nm/ps",
                  "its force is too large; use a smaller step size");

    const double dt = integrator.getStepSize();
    for (size_t i = 0; i < velocities.size(); i++)
        positions[i] += dt * velocities[i];
    requireFinite(positions, "the next position", "nm", "use a smaller step size");
    for (size_t i = 0; i < positions.size(); i++) {
        (*data.positions)[scene.mobile[i]] = toOpenMM(positions[i]);
        (*data.velocities)[scene.mobile[i]] = toOpenMM(velocities[i]);
    }
    context.computeVirtualSites();
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
    requireFinite(mobile, "the given force", "kJ/(mol nm)", "give finite forces");
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

NumericalParameters HostStepKernel::parametersOf(const Plan& plan) const {
    NumericalParameters p;
    p.split = "none";
    p.precision = "double";
    p.randomSeed = seed;
    if (!request)
        return p;
    p.split = plan.split->name();
    p.xi = plan.xi;
    p.realCutoff = plan.realCutoff;
    p.prolateBandwidth = plan.bandwidth;
    p.splitReason = plan.splitReason;
    for (int d = 0; d < 3; d++)
        p.gridDimensions[d] = plan.grid[d];
    p.windowSupport = plan.windowSupport;
    p.windowShape = plan.windowShape;
    p.lanczosTolerance = plan.lanczosTolerance;
    p.lanczosIterations = engine->lanczosIterations();
    p.predictedError = plan.predictedError;
    p.precision = (plan.precision == Precision::Single ? "single" : "double");
    return p;
}

NumericalParameters HostStepKernel::getNumericalParameters() const {
    return parametersOf(currentPlan);
}

Plan HostStepKernel::planFor(const Lattice& box) const {
    PlanRequest changed = *request;
    changed.box = box;
    try {
        return makePlan(changed);
    } catch (const std::invalid_argument& refusal) {
        throw OpenMMException(string("PSEBrownianIntegrator: ") + refusal.what());
    }
}

string HostStepKernel::signature(const Plan& plan) const {
    const NumericalParameters p = parametersOf(plan);
    std::ostringstream text;
    text.precision(17);
    text << (scene.hydrodynamics ? "Rotne-Prager-Yamakawa" : "free draining") << ", viscosity "
         << viscosity << " Da/(nm ps), first radius " << (scene.radii.empty() ? 0 : scene.radii[0])
         << " nm, particles " << scene.mobile.size() << " of " << masses.size() << ", split "
         << p.split << ", xi " << p.xi << " /nm, real-space cutoff " << p.realCutoff
         << " nm, prolate bandwidth " << p.prolateBandwidth << ", grid " << p.gridDimensions[0]
         << " x " << p.gridDimensions[1] << " x " << p.gridDimensions[2] << ", window support "
         << p.windowSupport << ", window shape " << p.windowShape << ", Lanczos tolerance "
         << p.lanczosTolerance << ", " << p.precision << " precision";
    return text.str();
}

void HostStepKernel::createCheckpoint(std::ostream& stream) const {
    writeText(stream, CHECKPOINT_MAGIC);
    // The box may have changed since the last step: what counts is the Plan that the next step will
    // use.
    const bool stale = request && currentBox() != request->box;
    writeText(stream, signature(stale ? planFor(currentBox()) : currentPlan));
    write(stream, seed);
    write(stream, steps);
    write(stream, samples);
}

void HostStepKernel::loadCheckpoint(std::istream& stream) {
    const string magic = readText(stream, 256);
    if (magic != CHECKPOINT_MAGIC)
        throw OpenMMException(
            "PSEBrownianIntegrator: the checkpoint is of another kind or version ('" + magic +
            "'); this version reads '" + CHECKPOINT_MAGIC + "'");
    const string theirs = readText(stream, 4096);
    const int theirSeed = read<int>(stream);
    const uint64_t theirSteps = read<uint64_t>(stream), theirSamples = read<uint64_t>(stream);
    if (request && currentBox() != request->box)
        plan(currentBox()); // the box came with the checkpoint, and with it the Plan to compare
    const string ours = signature(currentPlan);
    if (theirs != ours)
        throw OpenMMException(
            "PSEBrownianIntegrator: the checkpoint was written with other numerical parameters (" +
            theirs + ") than this Context has (" + ours +
            "); create the Context with the same settings, or give them "
            "by setNumericalParameters. Positions, box and time of this Context are now the "
            "checkpoint's");
    seed = theirSeed;
    steps = theirSteps;
    samples = theirSamples;
}

void HostStepKernel::getCounters(unsigned long long& step, unsigned long long& sample) const {
    step = steps;
    sample = samples;
}

void HostStepKernel::setCounters(unsigned long long step, unsigned long long sample) {
    if (step >= LARGEST_COUNTER || sample >= LARGEST_COUNTER)
        throw OpenMMException("PSEBrownianIntegrator: the State holds a noise counter of 2^48 or "
                              "more; it is damaged");
    steps = step;
    samples = sample;
}

} // namespace PSE
