// SPDX-License-Identifier: MIT
#include "StepKernel.h"
#include "StrainedContext.h"
#include "numerics/ShearFlow.h"
#include "numerics/Stress.h"
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
using OmmVec3 = OpenMM::Vec3;

namespace PSE {

namespace {

constexpr char CHECKPOINT_MAGIC[] = "openmmpse checkpoint 4";
/// Boxes from the origin: there a position is known to 1e-7 of the box.
constexpr double FARTHEST = 1e9;
/// Radii that rounding of a coordinate may be, in an unbounded fluid: 1e-7 at 1e9 radii from the
/// origin in double precision; in single precision a tenth at 2e6.
constexpr double FINEST_PLACE = 1e-7, COARSEST_PLACE = 0.1, SINGLE_EPSILON = 1e-8;
/// Radii that a growing step may be long, in an unbounded fluid [T63].
constexpr double LONGEST_STEP = 1e3;
/// Minus the cosine between a step of such a growth and the one before, at least.
constexpr double REVERSED = 0.9;
constexpr uint64_t LARGEST_COUNTER = uint64_t(1) << 48;
/// A box that moves is planned with this room for longer and for shorter vectors [T37].
constexpr double GROWTH = 1.03, SHRINKAGE = 0.97;
/// A change by less than this, of an entry relative to the diagonal one in its row, is that of a
/// box that moves; a larger one sets another box once and for all.
constexpr double SMALL_CHANGE = 0.1;
constexpr double ROUNDING = 1e-12;
/// Relative rounding of a sum of energies, by the precision of its terms.
constexpr double DOUBLE_ENERGY = 1e-15, SINGLE_ENERGY = 1e-7;

template <class T> void write(std::ostream& stream, const T& value) {
    stream.write(reinterpret_cast<const char*>(&value), sizeof(T));
}

template <class T> T read(std::istream& stream) {
    T value;
    stream.read(reinterpret_cast<char*>(&value), sizeof(T));
    if (!stream)
        throw OpenMMException(
            "PSEBrownianIntegrator: the checkpoint ends early; it is truncated or was not written "
            "with PSEBrownianIntegrator. Create a new one with Context.createCheckpoint");
    return value;
}

SplitChoice choiceOf(PSEBrownianIntegrator::Split split) {
    switch (split) {
    case PSEBrownianIntegrator::Prolate:
        return SplitChoice::Prolate;
    case PSEBrownianIntegrator::Hasimoto:
        return SplitChoice::Hasimoto;
    case PSEBrownianIntegrator::AllWaves:
        return SplitChoice::AllWaves;
    default:
        return SplitChoice::Automatic;
    }
}

/** Units of OpenMM, of a matrix that is symmetric: rows are columns. */
std::vector<OmmVec3> rowsOf(const Matrix3& matrix) {
    std::vector<OmmVec3> rows;
    for (int d = 0; d < 3; d++)
        rows.emplace_back(matrix(d, 0), matrix(d, 1), matrix(d, 2));
    return rows;
}

/** What a call returns; refusals of the numerics get the name of the integrator. */
template <class Call> auto named(const Call& call) {
    try {
        return call();
    } catch (const std::invalid_argument& refusal) {
        throw OpenMMException(string("PSEBrownianIntegrator: ") + refusal.what());
    }
}

/** @throws std::invalid_argument */
Lattice latticeOf(const OmmVec3 box[3]) {
    return Lattice(fromOpenMM(box[0]), fromOpenMM(box[1]), fromOpenMM(box[2]));
}

ShearFlow flowOf(const PSEBrownianIntegrator& integrator) {
    using Protocol = ShearFlow::Protocol;
    const auto protocol = integrator.getShearProtocol();
    return {protocol == PSEBrownianIntegrator::OscillatoryShear ? Protocol::Oscillatory
            : protocol == PSEBrownianIntegrator::StartUpShear   ? Protocol::StartUp
                                                                : Protocol::Steady,
            integrator.getShearRate(), integrator.getShearTime()};
}

/** Whether what was planned for keeps its promises in a box, too [T37]. */
bool serves(const PlanRequest& planned, const Lattice& box) {
    if (!planned.moving)
        return box == planned.box;
    for (int d = 0; d < 3; d++) {
        const double shortest = planned.shortest * planned.box.vectors()(d, d);
        if (box.length(d) > (1 + ROUNDING) * planned.box.length(d) ||
            box.vectors()(d, d) < (1 - ROUNDING) * shortest)
            return false;
    }
    return true;
}

bool isSmallChange(const Lattice& from, const Lattice& to) {
    for (int row = 0; row < 3; row++)
        for (int column = row; column < 3; column++)
            if (std::fabs(to.vectors()(row, column) - from.vectors()(row, column)) >
                SMALL_CHANGE * from.vectors()(row, row))
                return false;
    return true;
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

/** FNV-1a over the bits of all numbers. */
uint64_t hashOf(const std::vector<double>& values) {
    uint64_t hash = 14695981039346656037u;
    for (double value : values) {
        uint64_t bits;
        std::memcpy(&bits, &value, sizeof(bits));
        for (int byte = 0; byte < 8; byte++)
            hash = (hash ^ ((bits >> (8 * byte)) & 0xFF)) * 1099511628211u;
    }
    return hash;
}

string radiiInWords(const std::vector<double>& radii) {
    std::ostringstream text;
    text.precision(17);
    text << "first radius " << (radii.empty() ? 0 : radii[0]) << " nm";
    if (isMixture(radii))
        text << " of unequal ones (checksum " << hashOf(radii) << ")";
    return text.str();
}

void writeText(std::ostream& stream, const string& text) {
    write(stream, uint64_t(text.size()));
    stream.write(text.data(), text.size());
}

} // namespace

void refuseNotFinite(const CheckedQuantity& quantity, int particle, const Vec3& value) {
    std::ostringstream message;
    message << "PSEBrownianIntegrator: " << quantity.what << " of particle " << particle << " is ("
            << value[0] << ", " << value[1] << ", " << value[2] << ") " << quantity.unit
            << ", which is not finite; " << quantity.remedy;
    throw OpenMMException(message.str());
}

void PlannedStepKernel::initialize(ContextImpl& context, const PSEBrownianIntegrator& integrator,
                                   const Scene& sceneSeen) {
    scene = sceneSeen;
    settings = &integrator;
    engineBox.reset();
    lastBox.reset();
    masses.clear();
    for (int i = 0; i < context.getSystem().getNumParticles(); i++)
        masses.push_back(context.getSystem().getParticleMass(i));
    viscosity = integrator.getViscosity();
    seed = integrator.getRandomNumberSeed();
    while (seed == 0)
        seed = osrngseed() & 0x7FFFFFFF; // positive, like the seeds that users write
    if (!scene.hydrodynamics || scene.mobile.empty()) {
        useFreeDraining();
        return;
    }
    if (scene.unbounded) {
        planUnbounded(integrator);
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
    const Lattice box = currentBox();
    request.reset(new PlanRequest{box, static_cast<int>(scene.mobile.size()), scene.radii[0],
                                  integrator.getErrorTolerance(), integrator.getTemperature() > 0,
                                  0, false, overrides, choiceOf(integrator.getSplit())});
    if (isMixture(scene.radii))
        request->radii = scene.radii;
    if (scene.forceCoupling)
        request->model = SphereModel::ForceCoupling;
    adapt(*request);
    const std::optional<Prepared> moving = prepareFor(box);
    use(moving ? *moving : prepared(*request), box);
}

void PlannedStepKernel::planUnbounded(const PSEBrownianIntegrator& integrator) {
    UnboundedRequest wanted = {integrator.getErrorTolerance(),
                               integrator.getRequestedNumericalParameters().lanczosTolerance};
    if (scene.forceCoupling)
        wanted.model = SphereModel::ForceCoupling;
    adapt(wanted);
    const UnboundedPlan made = makeUnboundedPlan(wanted, scene.radii);
    useUnbounded(made);
    unboundedPlan.reset(new UnboundedPlan(made));
}

Lattice PlannedStepKernel::currentBox() const {
    OmmVec3 box[3];
    boxVectors(box);
    return named([&] { return latticeOf(box); });
}

bool PlannedStepKernel::isSheared() const {
    return scene.periodicBox && settings->getShearRate() != 0;
}

double PlannedStepKernel::strainOf(double time, double dt) const {
    if (settings->getShearRate() == 0)
        return 0;
    return named([&] { return flowOf(*settings).strain(time, dt); });
}

std::vector<OmmVec3> PlannedStepKernel::computeStress(ContextImpl& context,
                                                      const PSEBrownianIntegrator& integrator,
                                                      int parts, int groups) {
    const double volume = currentBox().volume();
    Matrix3 stress = Matrix3::Zero();
    if (parts & PSEBrownianIntegrator::IdealStress)
        stress += idealStress(double(scene.mobile.size()),
                              KT_PER_KELVIN * integrator.getTemperature(), volume);
    if (parts & PSEBrownianIntegrator::HydrodynamicStress) {
        const double rate = named([&] { return flowOf(integrator).rateAt(context.getTime()); });
        stress += singleSphereStress(scene.radii, viscosity, rate, volume);
    }
    if (parts & PSEBrownianIntegrator::InterparticleStress)
        stress += interparticleStress(context, groups);
    return rowsOf(stress);
}

Matrix3 PlannedStepKernel::interparticleStress(ContextImpl& context, int groups) {
    if (!boxCanTilt())
        throw OpenMMException(
            "PSEBrownianIntegrator: computeStress: the box of the System is rectangular, and on "
            "this platform OpenMM computes no Force in a sheared box then; tilt the default box a "
            "little before the Context is created (System.setDefaultPeriodicBoxVectors with "
            "b.x = 1e-3 a.x, say), or use the platform CPU");
    const Lattice box = currentBox();
    straining = true;
    StrainedContext strained(context, box, groups);
    const double step = strainStep(strained.isDouble() ? DOUBLE_ENERGY : SINGLE_ENERGY);
    const auto restore = [&] {
        strained.restore();
        straining = false;
    };
    try {
        const Matrix3 slope =
            strainDerivative([&](const Matrix3& map) { return strained.energy(map); }, step);
        restore();
        return slope / box.volume();
    } catch (const std::exception& failure) {
        restore();
        std::ostringstream message;
        message << "PSEBrownianIntegrator: computeStress: no energy in a box strained by " << step
                << ": " << failure.what();
        throw OpenMMException(message.str());
    }
}

std::optional<PlannedStepKernel::Prepared> PlannedStepKernel::prepareFor(const Lattice& box) const {
    const bool sheared = isSheared();
    const bool breathes =
        !scene.barostat.empty() || (lastBox && box != *lastBox && isSmallChange(*lastBox, box));
    const bool planned = request->moving || !(sheared || !scene.barostat.empty());
    const Lattice needed = sheared ? box.mostSheared() : box;
    if (planned && serves(*request, needed))
        return std::nullopt;
    PlanRequest next = *request;
    next.moving = sheared;
    next.box = needed;
    next.shortest = 1;
    if (breathes) {
        PlanRequest wide = next;
        wide.moving = true;
        wide.box = needed.scaled(GROWTH);
        wide.shortest = SHRINKAGE / GROWTH;
        try {
            return prepared(wide);
        } catch (const OpenMMException&) {
            // no room to move in: each box then has a Plan of its own
        }
    }
    return prepared(next);
}

std::optional<PlannedStepKernel::Prepared> PlannedStepKernel::upcoming() const {
    try {
        return prepareFor(currentBox());
    } catch (const OpenMMException&) {
        return std::nullopt; // what has been computed so far can be saved all the same
    }
}

void PlannedStepKernel::use(const Prepared& next, const Lattice& box) {
    useEngine(next.plan, box);
    currentPlan = next.plan;
    *request = next.request;
    nowIn(box);
}

void PlannedStepKernel::nowIn(const Lattice& box) {
    engineBox = box;
    lastBox = box;
}

void PlannedStepKernel::followBox() {
    if (!request)
        return;
    const Lattice box = currentBox();
    if (const std::optional<Prepared> next = prepareFor(box))
        use(*next, box);
    else if (box != *engineBox)
        setEngineBox(box);
    nowIn(box);
}

double PlannedStepKernel::farthestPosition() const {
    if (unboundedPlan) {
        const double rounding = coordinateRounding();
        const double place = (rounding > SINGLE_EPSILON ? COARSEST_PLACE : FINEST_PLACE);
        return unboundedPlan->a * place / rounding;
    }
    if (!request)
        return std::numeric_limits<double>::max();
    return FARTHEST * currentBox().vectors().diagonal().maxCoeff();
}

void PlannedStepKernel::refuseFarAway(int particle, const Vec3& position, bool next) const {
    std::ostringstream message;
    message << "PSEBrownianIntegrator: particle " << particle << (next ? " would be " : " is ")
            << position.cwiseAbs().maxCoeff() << " nm from the origin, more than ";
    if (unboundedPlan)
        message << farthestPosition() << " nm, and its distance to a neighbour is lost to "
                << "rounding; set positions nearer to the origin";
    else
        message << FARTHEST << " boxes, and its place in the box is lost to rounding; set "
                << "positions nearer to the box";
    message << ", and if steps have brought it there, use a smaller step size"
            << (settings->getShearRate() != 0 ? " or a lower shear rate" : "");
    throw OpenMMException(message.str());
}

double PlannedStepKernel::longestStep() const {
    if (!scene.periodicBox)
        return LONGEST_STEP * *std::max_element(scene.radii.begin(), scene.radii.end());
    const Lattice box = currentBox();
    return std::max({box.length(0), box.length(1), box.length(2)});
}

bool PlannedStepKernel::mayBlowUp(double velocity, double dt) const {
    return growth.isRunaway(velocity, dt) && dt * velocity > longestStep();
}

void PlannedStepKernel::refuseBlowUp(ContextImpl& context,
                                     const std::vector<OfParticle>& velocities, double dt) const {
    std::vector<OmmVec3> before;
    context.getVelocities(before);
    const OfParticle* fastest = &velocities.at(0);
    double along = 0, square = 0, squareBefore = 0;
    for (const OfParticle& entry : velocities) {
        const Vec3 last = fromOpenMM(before[entry.first]);
        along += entry.second.dot(last);
        square += entry.second.squaredNorm();
        squareBefore += last.squaredNorm();
        if (entry.second.squaredNorm() > fastest->second.squaredNorm())
            fastest = &entry;
    }
    if (along > -REVERSED * std::sqrt(square * squareBefore))
        return;
    std::ostringstream message;
    message << "PSEBrownianIntegrator: the step size of " << dt
            << " ps is too long for the forces: "
            << "particle " << fastest->first << " would move by " << dt * fastest->second.norm()
            << " nm, more than " << longestStep()
            << (scene.periodicBox ? " nm (the longest box vector)"
                                  : " nm (1000 of the largest radius)")
            << ", back over its last step, and the largest velocity has grown in each of the last "
            << growth.length() + 1 << " steps, by a factor of "
            << fastest->second.cwiseAbs().maxCoeff() / growth.start()
            << " in all; this step is not made. Use a smaller step size (in Python, "
            << "openmmpse.accuracy.recommendStep finds one), from a state of before that";
    throw OpenMMException(message.str());
}

void PlannedStepKernel::positionsSet() {
    if (!straining) // which ends with everything as it was
        growth.forget();
    positionsChanged();
}

Thermal PlannedStepKernel::thermal(const PSEBrownianIntegrator& integrator, bool sample) const {
    const uint64_t counter = sample ? samples : steps;
    const NoiseKey real = {uint32_t(seed), sample ? Stream::SampleReal : Stream::StepReal, counter};
    const NoiseKey wave = {uint32_t(seed), sample ? Stream::SampleWave : Stream::StepWave, counter};
    return {KT_PER_KELVIN * integrator.getTemperature(), integrator.getStepSize(), real, wave};
}

NumericalParameters PlannedStepKernel::parametersOf(const Plan& plan) const {
    NumericalParameters p;
    p.split = "none";
    p.precision = (unboundedPlan ? precisionName(*unboundedPlan) : precisionName(plan));
    p.instructions = instructions();
    p.randomSeed = seed;
    if (unboundedPlan) {
        p.lanczosTolerance = unboundedPlan->lanczosTolerance;
        p.lanczosIterations = lanczosIterations();
        p.predictedError = unboundedPlan->predictedError;
    }
    if (!request)
        return p;
    p.split = plan.splitName();
    p.xi = plan.xi;
    p.realCutoff = plan.realCutoff;
    p.prolateBandwidth = plan.bandwidth;
    p.splitReason = plan.splitReason;
    p.radiusFunctions = plan.radiusFunctions;
    for (int d = 0; d < 3; d++)
        p.gridDimensions[d] = plan.grid[d];
    p.windowSupport = plan.windowSupport;
    p.windowShape = plan.windowShape;
    p.lanczosTolerance = plan.lanczosTolerance;
    p.lanczosIterations = lanczosIterations();
    p.predictedError = plan.predictedError;
    return p;
}

NumericalParameters PlannedStepKernel::getNumericalParameters() const {
    return parametersOf(currentPlan);
}

PlannedStepKernel::Prepared PlannedStepKernel::prepared(const PlanRequest& next) const {
    return named([&] { return Prepared{next, makePlan(next)}; });
}

string PlannedStepKernel::signature(const Plan& plan) const {
    const NumericalParameters p = parametersOf(plan);
    std::ostringstream text;
    text.precision(17);
    const char* interacting = (scene.forceCoupling ? "force coupling" : "Rotne-Prager-Yamakawa");
    text << (scene.hydrodynamics ? interacting : "free draining")
         << (scene.unbounded ? ", unbounded" : "") << ", viscosity " << viscosity << " Da/(nm ps), "
         << radiiInWords(scene.radii) << ", particles " << scene.mobile.size() << " of "
         << masses.size() << ", split " << p.split << ", xi " << p.xi << " /nm, real-space cutoff "
         << p.realCutoff << " nm, prolate bandwidth " << p.prolateBandwidth << ", grid "
         << p.gridDimensions[0] << " x " << p.gridDimensions[1] << " x " << p.gridDimensions[2]
         << ", window support " << p.windowSupport << ", window shape " << p.windowShape
         << ", Lanczos tolerance " << p.lanczosTolerance << ", " << p.precision << " precision";
    return text.str();
}

StepState PlannedStepKernel::getStepState() const {
    StepState state;
    state.step = steps;
    state.sample = samples;
    state.strain = strain;
    if (!request)
        return state;
    const std::optional<Prepared> next = upcoming();
    const PlanRequest& planned = next ? next->request : *request;
    for (int d = 0; d < 3; d++) {
        state.plannedBox[d] = toOpenMM(planned.box.vectors().col(d));
        state.lastBox[d] = toOpenMM(lastBox->vectors().col(d));
    }
    state.plannedToMove = planned.moving;
    state.plannedShortest = planned.shortest;
    state.plannedThermal = planned.thermal;
    return state;
}

PlanRequest PlannedStepKernel::requestOf(const StepState& state) const {
    const auto damaged = [](const string& what) -> OpenMMException {
        return OpenMMException("PSEBrownianIntegrator: the State or checkpoint holds " + what +
                               "; it is damaged");
    };
    if (state.step >= LARGEST_COUNTER || state.sample >= LARGEST_COUNTER)
        throw damaged("a noise counter of 2^48 or more");
    if (!std::isfinite(state.strain))
        throw damaged("a strain that is not finite");
    if (!(state.plannedShortest > 0 && state.plannedShortest <= 1))
        throw damaged("a planned box that shrinks by a factor of " +
                      std::to_string(state.plannedShortest));
    PlanRequest planned = *request;
    planned.moving = state.plannedToMove;
    planned.shortest = state.plannedShortest;
    planned.thermal = state.plannedThermal;
    try {
        planned.box = latticeOf(state.plannedBox);
        if (state.lastBox[0][0] != 0)
            latticeOf(state.lastBox);
    } catch (const std::invalid_argument&) {
        throw damaged("a planned or a last box that is none");
    }
    return planned;
}

void PlannedStepKernel::setStepState(const StepState& state) {
    if (request && state.plannedBox[0][0] != 0) {
        const PlanRequest planned = requestOf(state);
        const Lattice box = currentBox();
        const Lattice needed = isSheared() ? box.mostSheared() : box;
        const bool same = planned.box == request->box && planned.moving == request->moving &&
                          planned.shortest == request->shortest &&
                          planned.thermal == request->thermal;
        if (!same && serves(planned, needed))
            use(prepared(planned), box);
        if (state.lastBox[0][0] != 0)
            lastBox = latticeOf(state.lastBox);
    }
    steps = state.step;
    samples = state.sample;
    strain = state.strain;
}

void PlannedStepKernel::createCheckpoint(std::ostream& stream) const {
    if (straining)
        return;
    const StepState state = getStepState();
    writeText(stream, CHECKPOINT_MAGIC);
    const std::optional<Prepared> next = request ? upcoming() : std::nullopt;
    writeText(stream, signature(next ? next->plan : currentPlan));
    write(stream, seed);
    write(stream, state.step);
    write(stream, state.sample);
    write(stream, state.strain);
    for (const OmmVec3& edge : state.plannedBox)
        write(stream, edge);
    write(stream, state.plannedToMove);
    write(stream, state.plannedShortest);
    write(stream, state.plannedThermal);
    for (const OmmVec3& edge : state.lastBox)
        write(stream, edge);
}

void PlannedStepKernel::loadCheckpoint(std::istream& stream) {
    if (straining)
        return;
    const string magic = readText(stream, 256);
    if (magic != CHECKPOINT_MAGIC)
        throw OpenMMException(
            "PSEBrownianIntegrator: the checkpoint is of another kind or version ('" + magic +
            "'); this version reads '" + CHECKPOINT_MAGIC + "'");
    const string theirs = readText(stream, 4096);
    const int theirSeed = read<int>(stream);
    StepState state;
    state.step = read<decltype(state.step)>(stream);
    state.sample = read<decltype(state.sample)>(stream);
    state.strain = read<double>(stream);
    for (OmmVec3& edge : state.plannedBox)
        edge = read<OmmVec3>(stream);
    state.plannedToMove = read<bool>(stream);
    state.plannedShortest = read<double>(stream);
    state.plannedThermal = read<bool>(stream);
    for (OmmVec3& edge : state.lastBox)
        edge = read<OmmVec3>(stream);
    // Only what the checkpoint was planned for makes a Plan that may be compared with its own.
    const bool planned = request && state.plannedBox[0][0] != 0;
    const string ours = signature(planned ? prepared(requestOf(state)).plan : currentPlan);
    if (theirs != ours)
        throw OpenMMException(
            "PSEBrownianIntegrator: the checkpoint was written with other numerical parameters (" +
            theirs + ") than this Context has (" + ours +
            "); create the Context with the same settings, or give them "
            "by setNumericalParameters. Positions, box and time of this Context are now the "
            "checkpoint's");
    setStepState(state);
    seed = theirSeed;
}

} // namespace PSE
