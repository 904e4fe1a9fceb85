// SPDX-License-Identifier: MIT
// One fluid on all platforms: M f against Reference, the noise of the same Plan against CPU and
// Reference. Called with a platform and, for devices, a precision.
#include "PlatformTest.h"

using namespace platformTest;
using OpenMM::Context;

namespace {

/// of Reference, whose sums are direct: far below what is compared with it
constexpr double EXACT = 1e-10;

struct Scene {
    const char* name;
    Box box;
    int particles;
};

/// all that makes a kernel another one
const Scene SCENES[] = {
    {"rectangular", rectangular(9, 10, 11), 60},
    {"tilted", mostTilted(10, 10, 9), 60},
    {"images", rectangular(5, 5.5, 6), 40}, // the range exceeds half the box
};

/** For a platform's own precision; the loosest for one scene is enough. */
vector<double> tolerances(const Scene& scene) {
    vector<double> all = {1e-3, 1e-5};
    if (&scene == SCENES)
        all.push_back(1e-2);
    if (!target.hasSingleVectors())
        all.push_back(1e-8);
    return all;
}

/** |u - M f| over max(|M f|, |f|/(6 pi eta a)): what the tolerance bounds. */
double mobilityError(const vector<Vec3>& u, const vector<Vec3>& exact, const vector<Vec3>& f) {
    return norm(difference(u, exact)) / std::max(norm(exact), norm(f) / DRAG);
}

/** Random, uniform and balanced forces. */
vector<vector<Vec3>> kindsOfForces(int count) {
    vector<Vec3> balanced = randomForces(count, 11);
    for (int i = 1; i < count; i += 2)
        balanced[i] = balanced[i - 1] * -1.0;
    return {randomForces(count, 10), vector<Vec3>(count, Vec3(1, -0.5, 0.25)), balanced};
}

/** What a Context makes of its Plan and seed. */
struct Drawn {
    explicit Drawn(Fluid& fluid)
        : samples(fluid.integrator.sampleBrownianDisplacements(2)), velocities([&] {
              fluid.integrator.step(1);
              return fluid.velocities();
          }()),
          used(fluid.integrator.getNumericalParameters()) {}
    vector<Vec3> samples, velocities; ///< the latter of one step
    PSE::NumericalParameters used;
};

void expectSameNoise(const Drawn& one, const Drawn& other, double bound) {
    EXPECT_LE(relativeError(one.samples, other.samples), bound);
    EXPECT_LE(relativeError(one.velocities, other.velocities), bound);
}

/**
 * With the same Plan and seed, two platforms with a window differ by rounding and, if they end the
 * Lanczos process at different iterations, by its tolerance, which is below the Plan's.
 */
double noiseBound(const Drawn& one, const Drawn& other, double tolerance) {
    if (one.used.lanczosIterations != other.used.lanczosIterations)
        return tolerance;
    return std::min(tolerance, std::max(fluidRounding(one.used), fluidRounding(other.used)));
}

/** A force on every particle that does not depend on its place, so that steps have a drift. */
OpenMM::Force* pull(int particles) {
    auto* force = new OpenMM::CustomExternalForce("-(fx*x+fy*y+fz*z)");
    for (const char* name : {"fx", "fy", "fz"})
        force->addPerParticleParameter(name);
    const vector<Vec3> f = randomForces(particles, 12);
    for (int i = 0; i < particles; i++)
        force->addParticle(i, {f[i][0], f[i][1], f[i][2]});
    return force;
}

/** All particles within a cube of four radii: most are in the range of each other. */
vector<Vec3> cluster(int particles) {
    vector<Vec3> positions = randomPositions(particles, rectangular(4, 4, 4), 13);
    for (Vec3& x : positions)
        x += Vec3(5, 5, 5);
    return positions;
}

/** On a cubic lattice in a box of 20 nm, more than three radii from each other. */
vector<Vec3> lattice(int particles) {
    vector<Vec3> positions;
    for (int i = 0; i < particles; i++)
        positions.push_back(Vec3(i % 6, i / 6 % 6, i / 36) * 3.25);
    return positions;
}

/**
 * Against a Context on CPU with the same Plan and history. Among overlapping particles Lanczos
 * processes magnify rounding, so that the tolerance is all that holds; on Reference its root.
 */
void expectNoiseOfCpu(Fluid& fluid, Fluid& cpu, double tolerance) {
    const bool windowed = target.platform != "Reference";
    expectSameNoise(Drawn(fluid), Drawn(cpu), windowed ? tolerance : std::sqrt(tolerance));
}

void expectSamePlan(const PSE::NumericalParameters& a, const PSE::NumericalParameters& b) {
    EXPECT_EQ(a.split, b.split);
    EXPECT_EQ(a.xi, b.xi);
    EXPECT_EQ(a.realCutoff, b.realCutoff);
    EXPECT_EQ(a.windowSupport, b.windowSupport);
    EXPECT_EQ(a.windowShape, b.windowShape);
    for (int d = 0; d < 3; d++)
        EXPECT_EQ(a.gridDimensions[d], b.gridDimensions[d]);
}

string named(const Scene& scene, double tolerance) {
    std::ostringstream text;
    text << scene.name << ", tolerance " << tolerance;
    return text.str();
}

} // namespace

// M f of the Plan that the platform makes itself, against sums to EXACT. The same Context then
// draws noise, and others with its Plan draw theirs. Reference has no window, whose aliasing is an
// error of first order in one vector of noise: of the square root of the tolerance.
TEST(Platforms, AgreeInMobilityToTheToleranceAndInNoiseWithTheSamePlan) {
    for (const Scene& scene : SCENES) {
        const vector<Vec3> positions = randomPositions(scene.particles, scene.box, 1);
        const vector<vector<Vec3>> kinds = kindsOfForces(scene.particles);
        Settings settings{scene.box, EXACT};
        Fluid precise("Reference", {}, settings, positions);
        settings.force = pull;
        for (double tolerance : tolerances(scene)) {
            SCOPED_TRACE(named(scene, tolerance));
            settings.tolerance = tolerance;
            settings.parameters = nullptr;
            Fluid fluid(settings, positions);
            for (const vector<Vec3>& f : kinds)
                EXPECT_LE(mobilityError(fluid.integrator.applyMobility(f),
                                        precise.integrator.applyMobility(f), f),
                          tolerance);
            const PSE::NumericalParameters plan = fluid.integrator.getNumericalParameters();
            settings.parameters = &plan;
            Fluid cpu("CPU", {}, settings, positions);
            Fluid reference("Reference", {}, settings, positions);
            const Drawn ours(fluid), cpus(cpu), references(reference);
            expectSamePlan(cpus.used, plan);
            expectSamePlan(references.used, plan);
            if (target.platform != "Reference")
                expectSameNoise(ours, cpus, noiseBound(ours, cpus, tolerance));
            expectSameNoise(ours, target.platform == "Reference" ? cpus : references,
                            std::sqrt(tolerance));
        }
    }
}

// The same of unequal spheres: five radii, each a class of its own, and as many as particles. On
// devices tables of mixtures have functions that magnify rounding; by how much is for the Plan to
// bound, at a tenth of the tolerance.
TEST(Platforms, AgreeInMobilityAndInNoiseOfUnequalSpheres) {
    constexpr double TOLERANCE = 1e-3;
    for (const Scene& scene : {SCENES[1], SCENES[2]})
        for (int distinct : {5, scene.particles}) {
            SCOPED_TRACE(scene.name + (" box, distinct radii: " + std::to_string(distinct)));
            const vector<Vec3> positions = randomPositions(scene.particles, scene.box, 1);
            Settings settings{scene.box, EXACT};
            for (int i = 0; i < scene.particles; i++)
                settings.radii.push_back(0.6 + 0.8 * (i % distinct) / (distinct - 1));
            Fluid precise("Reference", {}, settings, positions);
            settings.force = pull;
            settings.tolerance = TOLERANCE;
            Fluid fluid(settings, positions);
            for (const vector<Vec3>& f : kindsOfForces(scene.particles)) {
                vector<Vec3> own = f; // velocities that each would have alone
                for (int i = 0; i < scene.particles; i++)
                    own[i] /= DRAG * settings.radii[i] / RADIUS;
                const vector<Vec3> exact = precise.integrator.applyMobility(f);
                EXPECT_LE(norm(difference(fluid.integrator.applyMobility(f), exact)),
                          TOLERANCE * std::max(norm(exact), norm(own)));
            }
            const PSE::NumericalParameters plan = fluid.integrator.getNumericalParameters();
            settings.parameters = &plan;
            Fluid cpu("CPU", {}, settings, positions);
            Fluid reference("Reference", {}, settings, positions);
            const Drawn ours(fluid), cpus(cpu), references(reference);
            expectSamePlan(cpus.used, plan);
            if (target.platform != "Reference")
                expectSameNoise(ours, cpus, TOLERANCE);
            expectSameNoise(ours, target.platform == "Reference" ? cpus : references,
                            std::sqrt(TOLERANCE));
        }
}

// Rows of neighbours have room for a multiple of their mean number in an even fluid; in a cluster,
// most particles are neighbours of each other from the first product on.
TEST(Growth, OfNeighbourRowsShowsNowhere) {
    const int n = 125;
    const vector<Vec3> dense = cluster(n), f = randomForces(n, 14);
    Settings settings{rectangular(20, 20, 20)};
    Fluid cpu("CPU", {}, settings, dense);
    const PSE::NumericalParameters plan = cpu.integrator.getNumericalParameters();
    settings.parameters = &plan;
    Fluid fluid(settings, dense), again(settings, dense);
    const vector<Vec3> exact = cpu.integrator.applyMobility(f);
    EXPECT_LE(mobilityError(fluid.integrator.applyMobility(f), exact, f), settings.tolerance);
    expectNoiseOfCpu(again, cpu, settings.tolerance); // found too short in the midst of noise
}

TEST(Growth, OfTheNumberOfLanczosIterationsShowsNowhere) {
    const int n = 125;
    Settings settings{rectangular(20, 20, 20), 1e-4};
    Fluid cpu("CPU", {}, settings, lattice(n));
    const PSE::NumericalParameters plan = cpu.integrator.getNumericalParameters();
    settings.parameters = &plan;
    Fluid fluid(settings, lattice(n));
    expectNoiseOfCpu(fluid, cpu, settings.tolerance);
    const int few = fluid.integrator.getNumericalParameters().lanczosIterations;
    for (Fluid* each : {&cpu, &fluid})
        each->context->setPositions(cluster(n));
    expectNoiseOfCpu(fluid, cpu, settings.tolerance);
    EXPECT_GT(fluid.integrator.getNumericalParameters().lanczosIterations, 2 * few);
    for (Fluid* each : {&cpu, &fluid}) // and back: a count too large is none the less right
        each->context->setPositions(lattice(n));
    expectNoiseOfCpu(fluid, cpu, settings.tolerance);
    EXPECT_LE(fluid.integrator.getNumericalParameters().lanczosIterations, few + 1);
}

TEST(BoxChange, MakesANewPlanAndBackTheOldOne) {
    const Scene& first = SCENES[0];
    const int n = first.particles;
    const Box wide = rectangular(13, 12, 12.5);
    const vector<Vec3> positions = randomPositions(n, first.box, 3), f = randomForces(n, 15);
    Settings settings{first.box};
    Fluid fluid(settings, positions);
    const vector<Vec3> before = fluid.integrator.applyMobility(f);
    const PSE::NumericalParameters old = fluid.integrator.getNumericalParameters();
    fluid.integrator.step(1);

    fluid.context->setPeriodicBoxVectors(wide[0], wide[1], wide[2]);
    fluid.integrator.step(1);
    EXPECT_NE(fluid.integrator.getNumericalParameters().xi, old.xi);
    fluid.context->setPositions(positions);
    const vector<Vec3> u = fluid.integrator.applyMobility(f);
    settings.box = wide;
    Fluid fresh(settings, positions);
    expectSamePlan(fluid.integrator.getNumericalParameters(),
                   fresh.integrator.getNumericalParameters());
    EXPECT_TRUE(identical(u, fresh.integrator.applyMobility(f)));
    settings.tolerance = EXACT;
    Fluid reference("Reference", {}, settings, positions);
    const vector<Vec3> exact = reference.integrator.applyMobility(f);
    EXPECT_LE(mobilityError(u, exact, f), 1e-3);
    EXPECT_GT(relativeError(before, exact), 1e-2); // the box does matter

    fluid.context->setPeriodicBoxVectors(first.box[0], first.box[1], first.box[2]);
    EXPECT_TRUE(identical(fluid.integrator.applyMobility(f), before));
    expectSamePlan(fluid.integrator.getNumericalParameters(), old);
}

int main(int argc, char** argv) {
    return run(argc, argv);
}
