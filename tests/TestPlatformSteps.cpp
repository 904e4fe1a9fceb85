// SPDX-License-Identifier: MIT
// What a step promises on every platform: noise by particle, whatever the device's order; exact
// continuation; nothing but M f at kT = 0; refusals that change nothing. Called with a platform
// and, for devices, a precision.
#include "PlatformTest.h"
#include "numerics/Noise.h"
#include <cstring>
#include <limits>

using namespace platformTest;
using OpenMM::Context;
using OpenMM::State;

namespace {

/// of rounding to double and single precision, relative
constexpr double EPSILON = std::numeric_limits<double>::epsilon() / 2,
                 SINGLE = std::numeric_limits<float>::epsilon() / 2;
/// edges that are powers of two: moving particles by them rounds nothing
const Box EVEN = rectangular(8, 8, 8), ODD = rectangular(9, 10, 11);

/** Neutral particles that exert no force; for their cut-off, devices sort particles. */
OpenMM::Force* sortedBy(int particles) {
    auto* force = new OpenMM::NonbondedForce();
    force->setNonbondedMethod(OpenMM::NonbondedForce::CutoffPeriodic);
    force->setCutoffDistance(2);
    for (int i = 0; i < particles; i++)
        force->addParticle(0, 1, 0);
    return force;
}

template <class Real> void appendBytes(const Vec3& x, string& bytes) {
    for (int d = 0; d < 3; d++) {
        const Real number = static_cast<Real>(x[d]);
        bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
    }
}

/**
 * The order in which a device keeps particles: where a checkpoint, which is a copy of the device's
 * memory, holds their coordinates.
 */
vector<size_t> placesInMemory(const string& checkpoint, const vector<Vec3>& positions) {
    vector<size_t> places;
    for (const Vec3& x : positions) {
        string bytes;
        if (target.hasSingleVectors())
            appendBytes<float>(x, bytes);
        else
            appendBytes<double>(x, bytes);
        places.push_back(checkpoint.find(bytes));
    }
    return places;
}

/** What a State tells, to see that nothing changed. */
struct Witness {
    explicit Witness(const Fluid& fluid) {
        const State state = fluid.context->getState(State::Positions | State::Velocities);
        positions = state.getPositions();
        velocities = state.getVelocities();
        time = state.getTime();
        steps = state.getStepCount();
    }
    bool operator==(const Witness& other) const {
        return identical(positions, other.positions) && identical(velocities, other.velocities) &&
               time == other.time && steps == other.steps;
    }
    vector<Vec3> positions, velocities;
    double time;
    long long steps;
};

/** Repels particles from the middle of the box; infinite there. */
OpenMM::Force* repulsion(int particles) {
    auto* force = new OpenMM::CustomExternalForce("-log(r2); r2=(x-5)^2+(y-5)^2+(z-5)^2");
    for (int i = 0; i < particles; i++)
        force->addParticle(i, {});
    return force;
}

} // namespace

TEST(Order, OfParticlesOnTheDeviceDoesNotShow) {
    if (target.isHost())
        GTEST_SKIP() << target.platform << " keeps particles in their own order";
    const int n = 100;
    const vector<Vec3> inside = randomPositions(n, EVEN, 3);
    vector<Vec3> positions = inside;
    for (int i = 0; i < n; i++) // outside the box, in all directions; a device moves them inside
        for (int d = 0; d < 3; d++)
            positions[i] += EVEN[d] * ((i >> d) % 4 - 1);
    Settings settings{EVEN};
    settings.temperature = 0;
    settings.force = sortedBy;
    Fluid sorted(settings, positions);
    sorted.integrator.step(260); // OpenMM sorts every 250 steps; without forces nothing moves
    ASSERT_TRUE(identical(sorted.positions(), positions));
    const vector<size_t> places = placesInMemory(sorted.checkpoint(), inside);
    ASSERT_NE(*std::max_element(places.begin(), places.end()), string::npos);
    ASSERT_FALSE(std::is_sorted(places.begin(), places.end())) << "the device sorted nothing";
    sorted.integrator.setTemperature(TEMPERATURE);

    settings.temperature = TEMPERATURE;
    settings.force = nullptr;
    Fluid fresh(settings, positions);
    const vector<size_t> own = placesInMemory(fresh.checkpoint(), positions);
    ASSERT_NE(*std::max_element(own.begin(), own.end()), string::npos);
    ASSERT_TRUE(std::is_sorted(own.begin(), own.end()));
    // Places depend on positions alone, and moving by the edges of this box is exact.
    EXPECT_TRUE(identical(sorted.integrator.sampleBrownianDisplacements(3),
                          fresh.integrator.sampleBrownianDisplacements(3)));
    const vector<Vec3> f = randomForces(n, 4);
    EXPECT_TRUE(identical(sorted.integrator.applyMobility(f), fresh.integrator.applyMobility(f)));
}

TEST(Order, AndPlacesAnyBoxesAwayShowAsRoundingOnly) {
    const int n = 60;
    const vector<Vec3> inside = randomPositions(n, ODD, 5);
    vector<Vec3> outside = inside;
    for (int i = 0; i < n; i++)
        for (int d = 0; d < 3; d++)
            outside[i] += ODD[d] * ((i >> d) % 4 - 1);
    const Settings settings{ODD};
    Fluid one(settings, inside), other(settings, outside);
    // All coordinates are exact in single precision. In single precision, a fraction of the box is
    // found with an error of 2^-24 of the distance from the origin in boxes, here 3 at most.
    EXPECT_LE(relativeError(other.integrator.sampleBrownianDisplacements(3),
                            one.integrator.sampleBrownianDisplacements(3)),
              fluidRounding(one.integrator.getNumericalParameters()));
}

TEST(FreeDraining, NoiseIsThatOfEachParticle) {
    const int n = 1500, samples = 5, seed = 12345;
    Settings settings;
    settings.model = PSEBrownianIntegrator::FreeDraining;
    settings.seed = seed;
    Fluid fluid(settings, randomPositions(n, settings.box, 6));
    const vector<Vec3> drawn = fluid.integrator.sampleBrownianDisplacements(samples);
    const double kT = 8.31446261815324e-3 * TEMPERATURE;
    const double amplitude = std::sqrt(2 * kT * STEP / DRAG);
    // Four numbers of the device are rounded on the way: mobility, its root, the noise's amplitude
    // and their product. The numbers of the noise are as exact as NoiseText.h says, those of the
    // CPU's own loops as TestCpuEngine does.
    const double ofNoise = target.platform == "CPU"    ? 1e-14
                           : target.hasSingleVectors() ? 4e-7
                                                       : 4 * EPSILON;
    const double ofRounding = 6 * (target.hasSingleVectors() ? SINGLE : EPSILON);
    double worst = 0;
    for (int sample = 0; sample < samples; sample++)
        for (int i = 0; i < n; i++) {
            double z[3];
            PSE::numerics::particleNoise(
                {seed, PSE::numerics::Stream::SampleReal, uint64_t(sample)}, i, z);
            for (int d = 0; d < 3; d++) {
                const double error = std::fabs(drawn[sample * n + i][d] / amplitude - z[d]);
                worst = std::max(worst, error / (ofNoise * std::max(1.0, std::fabs(z[d])) +
                                                 ofRounding * std::fabs(z[d])));
            }
        }
    EXPECT_LE(worst, 1);
}

TEST(Continuation, FromACheckpointIsExact) {
    const int n = 60;
    const vector<Vec3> positions = randomPositions(n, ODD, 7);
    Settings settings{ODD};
    settings.force = repulsion;
    Fluid fluid(settings, positions);
    fluid.integrator.step(3);
    fluid.integrator.sampleBrownianDisplacements(2);
    const string checkpoint = fluid.checkpoint();
    fluid.integrator.step(5);
    const Witness uninterrupted(fluid);
    const vector<Vec3> drawn = fluid.integrator.sampleBrownianDisplacements(1);
    EXPECT_GT(norm(difference(uninterrupted.positions, positions)), 0);

    fluid.load(checkpoint);
    fluid.integrator.step(5);
    EXPECT_TRUE(Witness(fluid) == uninterrupted);

    settings.seed = 99; // the checkpoint brings its own
    Fluid other(settings, randomPositions(n, ODD, 8));
    other.load(checkpoint);
    other.integrator.step(5);
    EXPECT_TRUE(Witness(other) == uninterrupted);
    EXPECT_TRUE(identical(other.integrator.sampleBrownianDisplacements(1), drawn));
}

// In a box that holds the ranges of all pairs, where CPU expands rows of the window and lists
// pairs.
TEST(UnequalSpheres, StepAsOnOtherPlatformsAndContinueExactly) {
    constexpr double TOLERANCE = 1e-3;
    const int n = 100;
    const Box box = rectangular(14, 15, 16);
    const vector<Vec3> positions = randomPositions(n, box, 14);
    Settings settings{box, TOLERANCE};
    for (int i = 0; i < n; i++)
        settings.radii.push_back(0.4 + 0.1 * (i % 5));
    settings.force = repulsion;
    const auto velocitiesOf = [&](Fluid& moved) {
        moved.integrator.step(1);
        return moved.velocities(); // displacements: of positions, single precision keeps too little
    };
    for (double temperature : {TEMPERATURE, 0.0}) {
        SCOPED_TRACE(temperature);
        settings.temperature = temperature;
        settings.parameters = nullptr;
        Fluid fluid(settings, positions);
        const PSE::NumericalParameters plan = fluid.integrator.getNumericalParameters();
        ASSERT_LT(plan.realCutoff, 7);
        settings.parameters = &plan;
        Fluid cpu("CPU", {}, settings, positions), reference("Reference", {}, settings, positions);
        const vector<Vec3> ours = velocitiesOf(fluid), cpus = velocitiesOf(cpu),
                           references = velocitiesOf(reference);
        if (target.platform != "Reference") {
            EXPECT_LE(relativeError(ours, cpus), TOLERANCE);
        }
        // Reference has no window, an error of first order in one vector of noise.
        EXPECT_LE(relativeError(target.platform == "Reference" ? cpus : ours, references),
                  temperature > 0 ? std::sqrt(TOLERANCE) : TOLERANCE);

        const string checkpoint = fluid.checkpoint();
        fluid.integrator.step(2);
        const Witness uninterrupted(fluid);
        fluid.load(checkpoint);
        fluid.integrator.step(2);
        EXPECT_TRUE(Witness(fluid) == uninterrupted);
    }
}

TEST(Massless, ParticlesStayAndAreTransparent) {
    const int n = 60;
    const vector<Vec3> positions = randomPositions(n, ODD, 9);
    Settings settings{ODD};
    for (int i = 0; i < n; i++)
        settings.masses.push_back(i % 3 == 0 ? 0 : 1);
    settings.force = repulsion;
    Fluid fluid(settings, positions);
    const vector<Vec3> f = randomForces(n, 10), u = fluid.integrator.applyMobility(f);
    fluid.integrator.step(2);
    const vector<Vec3> moved = fluid.positions();
    vector<Vec3> others, otherForces, otherVelocities;
    for (int i = 0; i < n; i++) {
        const bool same = identical({moved[i]}, {positions[i]});
        EXPECT_EQ(same, i % 3 == 0) << i;
        if (i % 3 == 0) {
            EXPECT_TRUE(identical({u[i]}, {Vec3()})) << i;
            continue;
        }
        others.push_back(positions[i]);
        otherForces.push_back(f[i]);
        otherVelocities.push_back(u[i]);
    }
    settings.masses.clear();
    settings.force = nullptr;
    Fluid without(settings, others);
    EXPECT_LE(relativeError(otherVelocities, without.integrator.applyMobility(otherForces)),
              fluidRounding(without.integrator.getNumericalParameters()));
}

TEST(WithoutNoise, AStepIsTheMobilityTimesTheForceTimesTheStepSize) {
    const int n = 60;
    const vector<Vec3> positions = randomPositions(n, ODD, 11);
    Settings settings{ODD};
    settings.temperature = 0;
    settings.force = repulsion;
    Fluid fluid(settings, positions);
    const vector<Vec3> f = fluid.context->getState(State::Forces).getForces();
    const vector<Vec3> u = fluid.integrator.applyMobility(f);
    EXPECT_EQ(norm(fluid.integrator.sampleBrownianDisplacements(1)), 0);
    fluid.integrator.step(1);
    const double rounding = fluidRounding(fluid.integrator.getNumericalParameters());
    EXPECT_LE(relativeError(fluid.velocities(), u), rounding);
    // Positions below 16 nm are rounded to a part in 2^24 of 8 nm in single precision, twice as
    // many bits in mixed; a host adds once more.
    const double single = 8 * SINGLE, mixed = single * SINGLE, exact = 16 * EPSILON;
    const double ofPositions = target.isSingle() ? single : std::max(mixed, exact);
    double largest = 0;
    for (const Vec3& v : u)
        largest = std::max(largest, std::sqrt(v.dot(v)));
    const vector<Vec3> moved = fluid.positions();
    for (int i = 0; i < n; i++)
        for (int d = 0; d < 3; d++)
            EXPECT_NEAR(moved[i][d], positions[i][d] + STEP * u[i][d],
                        ofPositions + rounding * STEP * largest)
                << i << ", " << d;
    EXPECT_EQ(fluid.context->getStepCount(), 1);
    EXPECT_EQ(fluid.context->getTime(), STEP);
}

TEST(Refusal, OfAToleranceBelowSinglePrecisionNamesLimitAndRemedy) {
    const Settings settings{ODD, 1e-6};
    const vector<Vec3> positions = randomPositions(4, ODD, 12);
    if (!target.hasSingleVectors()) {
        Fluid fluid(settings, positions);
        EXPECT_LE(fluid.integrator.getNumericalParameters().predictedError, 1e-6);
        return;
    }
    const string text = refusal([&] { Fluid(settings, positions); });
    EXPECT_NE(text.find("1e-05"), string::npos) << text;
    EXPECT_NE(text.find("Precision"), string::npos) << text;
}

TEST(Refusal, OfSeveralDevicesNamesTheProperty) {
    if (target.isHost())
        GTEST_SKIP() << target.platform << " has no devices to choose from";
    Properties properties = target.properties();
    properties["DeviceIndex"] = "0,0";
    try {
        OpenMM::System system;
        system.addParticle(1);
        OpenMM::VerletIntegrator integrator(0.001);
        Context context(system, integrator, OpenMM::Platform::getPlatformByName(target.platform),
                        properties);
    } catch (const OpenMM::OpenMMException& unsupported) {
        GTEST_SKIP() << "OpenMM cannot use a device twice here: " << unsupported.what();
    }
    const string text = refusal(
        [&] { Fluid(target.platform, properties, Settings{ODD}, randomPositions(4, ODD, 13)); });
    EXPECT_NE(text.find("2 devices"), string::npos) << text;
    EXPECT_NE(text.find("DeviceIndex"), string::npos) << text;
}

TEST(Refusal, NamesWhatIsNotFiniteAndChangesNothing) {
    const int n = 20, bad = 13;
    vector<Vec3> positions = randomPositions(n, ODD, 14);
    const Vec3 fine = positions[bad];
    Settings settings{ODD};
    settings.force = repulsion;
    Fluid fluid(settings, positions);
    fluid.integrator.step(2);
    for (double wrong : {std::nan(""), HUGE_VAL}) {
        positions[bad] = Vec3(fine[0], wrong, fine[2]);
        fluid.context->setPositions(positions);
        const string text = refusal([&] { fluid.integrator.step(1); });
        EXPECT_NE(text.find("position of particle 13 "), string::npos) << text;
        EXPECT_EQ(fluid.context->getStepCount(), 2);
        EXPECT_EQ(fluid.context->getTime(), 2 * STEP);
    }
    positions[bad] = Vec3(5, 5, 5); // where the force is 0/0
    fluid.context->setPositions(positions);
    const Witness before(fluid);
    const string text = refusal([&] { fluid.integrator.step(1); });
    EXPECT_NE(text.find("force of particle 13 "), string::npos) << text;
    EXPECT_TRUE(Witness(fluid) == before);

    positions[bad] = fine; // and goes on as if nothing had been tried
    fluid.context->setPositions(positions);
    fluid.integrator.step(1);
    EXPECT_TRUE(std::isfinite(norm(fluid.positions())));
    EXPECT_EQ(fluid.context->getStepCount(), 3);
}

int main(int argc, char** argv) {
    return run(argc, argv);
}
