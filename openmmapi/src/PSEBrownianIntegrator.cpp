// SPDX-License-Identifier: MIT
#include "openmmpse/PSEBrownianIntegrator.h"
#include "openmmpse/PSEKernels.h"
#include "openmmpse/internal/Scene.h"
#include "openmm/Context.h"
#include "openmm/OpenMMException.h"
#include "openmm/serialization/SerializationNode.h"
#include <cmath>
#include <sstream>

using namespace OpenMM;
using std::string;
using std::vector;

namespace PSE {

namespace {

constexpr double SMALLEST_TOLERANCE = 1e-10, LARGEST_TOLERANCE = 1e-1;
/// nm: far beyond all bodies in a fluid, and near enough that no power of one overflows
constexpr double SMALLEST_RADIUS = 1e-15, LARGEST_RADIUS = 1e15;
constexpr int SMALLEST_SUPPORT = 3, LARGEST_SUPPORT = 16;
constexpr double SMALLEST_BANDWIDTH = 3, LARGEST_BANDWIDTH = 30;
/// the entries of a box in a State, row by row
constexpr const char* BOX_ENTRIES[3][3] = {{"ax"}, {"bx", "by"}, {"cx", "cy", "cz"}};

[[noreturn]] void refuse(const string& message) {
    throw OpenMMException("PSEBrownianIntegrator: " + message);
}

void requirePositive(const char* name, double value, const char* unit) {
    if (std::isfinite(value) && value > 0)
        return;
    std::ostringstream message;
    message << name << " is " << value << " " << unit << "; it must be positive and finite";
    refuse(message.str());
}

void requireInRange(const char* name, double value, double low, double high) {
    if (value >= low && value <= high)
        return;
    std::ostringstream message;
    message << name << " is " << value << "; it must lie in [" << low << ", " << high << "]";
    refuse(message.str());
}

void requireRadius(const char* name, double value) {
    requirePositive(name, value, "nm");
    if (value >= SMALLEST_RADIUS && value <= LARGEST_RADIUS)
        return;
    std::ostringstream message;
    message << name << " is " << value << " nm; it must lie in [" << SMALLEST_RADIUS << ", "
            << LARGEST_RADIUS << "] nm: give it in nm, or as a Quantity with its unit";
    refuse(message.str());
}

void requireIndex(int index) {
    if (index < 0)
        refuse("particle index is " + std::to_string(index) +
               "; it must not be negative: the first particle has index 0");
}

void writeBox(SerializationNode& node, const Vec3 box[3]) {
    for (int d = 0; d < 3; d++)
        for (int c = 0; c <= d; c++)
            node.setDoubleProperty(BOX_ENTRIES[d][c], box[d][c]);
}

void readBox(const SerializationNode& node, Vec3 box[3]) {
    for (int d = 0; d < 3; d++)
        for (int c = 0; c <= d; c++)
            box[d][c] = node.getDoubleProperty(BOX_ENTRIES[d][c]);
}

/** A counter of the noise from the text of a State. */
unsigned long long counter(const string& text) {
    if (text.empty() || text.size() > 15 || text.find_first_not_of("0123456789") != string::npos)
        refuse("the State holds the noise counter '" + text +
               "', which is not a number below 2^48; it is damaged");
    return std::stoull(text);
}

/** While it lives, nobody else may use the Context: no other thread, no Force that is computed. */
class Exclusive {
public:
    Exclusive(std::atomic<bool>& inUse, const char* method) : inUse(inUse) {
        if (inUse.exchange(true))
            refuse(string(method) +
                   " was called while another call on the same integrator is under way, in another "
                   "thread or in one that computes a Force; wait for its end, or give each thread "
                   "an integrator and a Context of its own");
    }
    ~Exclusive() { inUse = false; }
    Exclusive(const Exclusive&) = delete;
    Exclusive& operator=(const Exclusive&) = delete;

private:
    std::atomic<bool>& inUse;
};

} // namespace

PSEBrownianIntegrator::PSEBrownianIntegrator(double temperature, double viscosity, double radius,
                                             double stepSize) {
    setTemperature(temperature);
    setViscosity(viscosity);
    setRadius(radius);
    setStepSize(stepSize);
    setConstraintTolerance(1e-5);
}

void PSEBrownianIntegrator::requireUnbound(const char* setter) const {
    if (context != NULL)
        refuse(string(setter) +
               " was called after a Context had been created; what it sets is fixed from then on. "
               "Set it before, or make a copy of the integrator and a new Context");
}

void PSEBrownianIntegrator::requireBound(const char* method) const {
    if (context == NULL)
        refuse(string(method) + " needs a Context, and this integrator is not bound to one; create "
                                "it with openmm.Context(system, integrator)");
}

void PSEBrownianIntegrator::requirePositions(const char* method) const {
    requireBound(method);
    if (!positionsSet)
        refuse(string(method) +
               " needs positions, and none have been set; call Context.setPositions first");
    requireWhole(method);
}

void PSEBrownianIntegrator::requireWhole(const char* method) const {
    if (halfLoaded)
        refuse(
            string(method) +
            ": the last checkpoint was refused after OpenMM had taken positions, velocities, box "
            "and time from it, which do not go with the noise of this integrator; load another "
            "checkpoint or a State, or set box and positions");
}

void PSEBrownianIntegrator::setTemperature(double value) {
    if (!std::isfinite(value) || value < 0) {
        std::ostringstream message;
        message << "temperature is " << value << " K; it must be finite and not negative";
        refuse(message.str());
    }
    temperature = value;
}

void PSEBrownianIntegrator::setViscosity(double value) {
    requireUnbound("setViscosity");
    requirePositive("viscosity", value, "Da/(nm ps)");
    viscosity = value;
}

void PSEBrownianIntegrator::setRadius(double value) {
    requireUnbound("setRadius");
    requireRadius("radius", value);
    radius = value;
}

void PSEBrownianIntegrator::setStepSize(double size) {
    requirePositive("step size", size, "ps");
    Integrator::setStepSize(size);
}

double PSEBrownianIntegrator::getParticleRadius(int index) const {
    requireIndex(index);
    const auto own = particleRadii.find(index);
    return own == particleRadii.end() ? radius : own->second;
}

void PSEBrownianIntegrator::setParticleRadius(int index, double value) {
    requireUnbound("setParticleRadius");
    requireIndex(index);
    requireRadius("particle radius", value);
    particleRadii[index] = value;
}

void PSEBrownianIntegrator::setErrorTolerance(double value) {
    requireUnbound("setErrorTolerance");
    requireInRange("error tolerance", value, SMALLEST_TOLERANCE, LARGEST_TOLERANCE);
    tolerance = value;
}

void PSEBrownianIntegrator::setMobilityModel(MobilityModel model) {
    requireUnbound("setMobilityModel");
    requireInRange("mobility model", model, RotnePragerYamakawa, FreeDraining);
    mobilityModel = model;
}

void PSEBrownianIntegrator::setFluidBoundary(FluidBoundary boundary) {
    requireUnbound("setFluidBoundary");
    requireInRange("fluid boundary", boundary, Automatic, Unbounded);
    fluidBoundary = boundary;
}

void PSEBrownianIntegrator::setShearRate(double rate) {
    if (!std::isfinite(rate)) {
        std::ostringstream message;
        message << "shear rate is " << rate << " 1/ps; it must be finite";
        refuse(message.str());
    }
    if (context != NULL && rate != 0) {
        requireShear(*scene);
        kernel.getAs<IntegratePSEStepKernel>().requireShear(*context);
    }
    shearRate = rate;
}

void PSEBrownianIntegrator::setShearProtocol(ShearProtocol protocol, double time) {
    requireInRange("shear protocol", protocol, SteadyShear, StartUpShear);
    if (protocol == OscillatoryShear)
        requirePositive("period of the shear", time, "ps");
    if (!std::isfinite(time)) {
        std::ostringstream message;
        message << "time of the shear protocol is " << time << " ps; it must be finite";
        refuse(message.str());
    }
    shearProtocol = protocol;
    shearTime = time;
}

void PSEBrownianIntegrator::setSplit(Split value) {
    requireUnbound("setSplit");
    requireInRange("split", value, AutomaticSplit, AllWaves);
    split = value;
}

void PSEBrownianIntegrator::setSplittingParameter(double xi) {
    requireUnbound("setSplittingParameter");
    if (xi != 0)
        requirePositive("splitting parameter", xi, "1/nm");
    requested.xi = xi;
}

void PSEBrownianIntegrator::getGridDimensions(int& nx, int& ny, int& nz) const {
    nx = requested.gridDimensions[0];
    ny = requested.gridDimensions[1];
    nz = requested.gridDimensions[2];
}

void PSEBrownianIntegrator::setGridDimensions(int nx, int ny, int nz) {
    requireUnbound("setGridDimensions");
    if (nx != 0 || ny != 0 || nz != 0)
        for (int n : {nx, ny, nz})
            requireInRange("grid dimension", n, SMALLEST_SUPPORT, 32768);
    requested.gridDimensions[0] = nx;
    requested.gridDimensions[1] = ny;
    requested.gridDimensions[2] = nz;
}

void PSEBrownianIntegrator::setWindowSupport(int support) {
    requireUnbound("setWindowSupport");
    if (support != 0)
        requireInRange("window support", support, SMALLEST_SUPPORT, LARGEST_SUPPORT);
    requested.windowSupport = support;
}

void PSEBrownianIntegrator::setNumericalParameters(const NumericalParameters& parameters) {
    requireUnbound("setNumericalParameters");
    // validates before anything is changed
    PSEBrownianIntegrator trial(temperature, viscosity, radius, getStepSize());
    trial.setSplittingParameter(parameters.xi);
    trial.setGridDimensions(parameters.gridDimensions[0], parameters.gridDimensions[1],
                            parameters.gridDimensions[2]);
    trial.setWindowSupport(parameters.windowSupport);
    if (parameters.realCutoff != 0)
        requirePositive("realCutoff", parameters.realCutoff, "nm");
    if (parameters.prolateBandwidth != 0)
        requireInRange("prolateBandwidth", parameters.prolateBandwidth, SMALLEST_BANDWIDTH,
                       LARGEST_BANDWIDTH);
    if (parameters.prolateBandwidth != 0 &&
        (parameters.split == "Hasimoto" || parameters.split == "AllWaves"))
        refuse("prolateBandwidth is not 0, and split is '" + parameters.split +
               "', which has none; set it to 0, or split to 'Prolate'");
    if (parameters.windowShape != 0)
        requirePositive("windowShape", parameters.windowShape, "");
    if (parameters.lanczosTolerance != 0)
        requireInRange("lanczosTolerance", parameters.lanczosTolerance, 1e-14, 0.5);
    if (parameters.split == "Hasimoto")
        split = Hasimoto;
    else if (parameters.split == "Prolate")
        split = Prolate;
    else if (parameters.split == "AllWaves")
        split = AllWaves;
    else if (parameters.split != "" && parameters.split != "none")
        refuse("split is '" + parameters.split +
               "'; it must be 'Prolate', 'Hasimoto', 'AllWaves', 'none' or empty");
    requested = trial.requested;
    requested.realCutoff = parameters.realCutoff;
    requested.prolateBandwidth = parameters.prolateBandwidth;
    requested.windowShape = parameters.windowShape;
    requested.lanczosTolerance = parameters.lanczosTolerance;
    if (parameters.randomSeed != 0)
        randomSeed = parameters.randomSeed;
}

void PSEBrownianIntegrator::setRandomNumberSeed(int seed) {
    requireUnbound("setRandomNumberSeed");
    randomSeed = seed;
}

void PSEBrownianIntegrator::initialize(ContextImpl& contextRef) {
    if (owner != NULL && &contextRef.getOwner() != owner)
        throw OpenMMException("This Integrator is already bound to a context");
    const auto seen = std::make_shared<const Scene>(makeScene(contextRef.getSystem(), *this));
    Kernel created =
        contextRef.getPlatform().createKernel(IntegratePSEStepKernel::Name(), contextRef);
    created.getAs<IntegratePSEStepKernel>().initialize(contextRef, *this, *seen);
    kernel = created;
    scene = seen;
    positionsSet = false;
    halfLoaded = false;
    context = &contextRef;
    owner = &contextRef.getOwner();
}

void PSEBrownianIntegrator::stateChanged(State::DataType changed) {
    if (changed != State::Positions)
        return;
    positionsSet = true;
    halfLoaded = false;
    if (context != NULL)
        kernel.getAs<IntegratePSEStepKernel>().positionsSet();
}

void PSEBrownianIntegrator::cleanup() {
    // Without a Context nothing here is in use: settings may be changed again, and another Context
    // may be created.
    kernel = Kernel();
    context = NULL;
    owner = NULL;
}

vector<string> PSEBrownianIntegrator::getKernelNames() {
    return {IntegratePSEStepKernel::Name()};
}

double PSEBrownianIntegrator::computeKineticEnergy() {
    return kernel.getAs<IntegratePSEStepKernel>().computeKineticEnergy(*context);
}

void PSEBrownianIntegrator::step(int steps) {
    requireBound("step");
    requireWhole("step");
    const Exclusive use(inUse, "step");
    for (int i = 0; i < steps; i++) {
        if (context->updateContextState())
            kernel.getAs<IntegratePSEStepKernel>().positionsChanged();
        kernel.getAs<IntegratePSEStepKernel>().checkPositions(*context);
        kernel.getAs<IntegratePSEStepKernel>().computeForces(*context, getIntegrationForceGroups());
        kernel.getAs<IntegratePSEStepKernel>().execute(*context, *this);
    }
}

vector<Vec3> PSEBrownianIntegrator::applyMobility(const vector<Vec3>& forces) {
    requirePositions("applyMobility");
    if (static_cast<int>(forces.size()) != context->getSystem().getNumParticles()) {
        std::ostringstream message;
        message << "applyMobility was given " << forces.size() << " forces; the System has "
                << context->getSystem().getNumParticles() << " particles";
        refuse(message.str());
    }
    const Exclusive use(inUse, "applyMobility");
    kernel.getAs<IntegratePSEStepKernel>().checkPositions(*context);
    return kernel.getAs<IntegratePSEStepKernel>().applyMobility(*context, forces);
}

vector<Vec3> PSEBrownianIntegrator::sampleBrownianDisplacements(int count) {
    requirePositions("sampleBrownianDisplacements");
    if (count < 0) {
        std::ostringstream message;
        message << "sampleBrownianDisplacements was asked for " << count
                << " samples; the count cannot be negative";
        refuse(message.str());
    }
    const Exclusive use(inUse, "sampleBrownianDisplacements");
    kernel.getAs<IntegratePSEStepKernel>().checkPositions(*context);
    return kernel.getAs<IntegratePSEStepKernel>().sampleBrownianDisplacements(*context, *this,
                                                                              count);
}

vector<Vec3> PSEBrownianIntegrator::computeStress(int parts, int groups) {
    requirePositions("computeStress");
    requireInRange("stress parts", parts, IdealStress, TotalStress);
    if (scene->unbounded || !scene->periodicBox)
        refuse("computeStress: nothing here is periodic, so there is no volume to refer a stress "
               "to; call setFluidBoundary(Periodic) before the Context is created, or sum "
               "positions times forces of getState() yourself");
    const Exclusive use(inUse, "computeStress");
    kernel.getAs<IntegratePSEStepKernel>().checkPositions(*context);
    return kernel.getAs<IntegratePSEStepKernel>().computeStress(
        *context, *this, parts, groups & getIntegrationForceGroups());
}

NumericalParameters PSEBrownianIntegrator::getNumericalParameters() const {
    requireBound("getNumericalParameters");
    return kernel.getAs<const IntegratePSEStepKernel>().getNumericalParameters();
}

vector<StageTime> PSEBrownianIntegrator::getStageTimes() const {
    requireBound("getStageTimes");
    return kernel.getAs<const IntegratePSEStepKernel>().getStageTimes();
}

double PSEBrownianIntegrator::getStrain() const {
    requireBound("getStrain");
    return kernel.getAs<const IntegratePSEStepKernel>().getStrain();
}

string PSEBrownianIntegrator::describe() const {
    requireBound("describe");
    const IntegratePSEStepKernel& step = kernel.getAs<const IntegratePSEStepKernel>();
    return describeScene(*scene, *this, step.getNumericalParameters(), step.getStageTimes(),
                         step.getStrain());
}

void PSEBrownianIntegrator::createCheckpoint(std::ostream& stream) const {
    kernel.getAs<const IntegratePSEStepKernel>().createCheckpoint(stream);
}

void PSEBrownianIntegrator::loadCheckpoint(std::istream& stream) {
    // Positions are the checkpoint's by now, even if the rest of it is refused.
    kernel.getAs<IntegratePSEStepKernel>().positionsSet();
    halfLoaded = true;
    kernel.getAs<IntegratePSEStepKernel>().loadCheckpoint(stream);
    halfLoaded = false;
}

void PSEBrownianIntegrator::serializeParameters(SerializationNode& node) const {
    const StepState state = kernel.getAs<const IntegratePSEStepKernel>().getStepState();
    node.setIntProperty("version", 1);
    node.setStringProperty("noiseStep", std::to_string(state.step));
    node.setStringProperty("noiseSample", std::to_string(state.sample));
    node.setDoubleProperty("strain", state.strain);
    if (state.plannedBox[0][0] == 0)
        return;
    SerializationNode& planned = node.createChildNode("PlannedBox");
    writeBox(planned, state.plannedBox);
    planned.setBoolProperty("moves", state.plannedToMove);
    planned.setDoubleProperty("shortest", state.plannedShortest);
    planned.setBoolProperty("thermal", state.plannedThermal);
    writeBox(node.createChildNode("LastBox"), state.lastBox);
}

void PSEBrownianIntegrator::deserializeParameters(const SerializationNode& node) {
    if (node.getProperties().empty() && node.getChildren().empty())
        return; // the State of an integrator that has no parameters: nothing to continue
    if (!node.hasProperty("noiseStep"))
        refuse("the State holds the parameters of another integrator; save it without integrator "
               "parameters, or load it with the integrator that wrote it");
    if (node.getIntProperty("version") != 1)
        refuse("the integrator parameters in this State have version " +
               std::to_string(node.getIntProperty("version")) +
               "; this version of openmmpse reads version 1");
    StepState state;
    state.step = counter(node.getStringProperty("noiseStep"));
    state.sample = counter(node.getStringProperty("noiseSample"));
    state.strain = node.getDoubleProperty("strain", 0);
    for (const SerializationNode& child : node.getChildren())
        if (child.getName() == "PlannedBox") {
            readBox(child, state.plannedBox);
            state.plannedToMove = child.getBoolProperty("moves");
            state.plannedShortest = child.getDoubleProperty("shortest");
            state.plannedThermal = child.getBoolProperty("thermal");
        } else if (child.getName() == "LastBox")
            readBox(child, state.lastBox);
    kernel.getAs<IntegratePSEStepKernel>().setStepState(state);
}

} // namespace PSE
