// SPDX-License-Identifier: MIT
// Unequal spheres on the CPU: both halves of the mobility against their definitions.
#include "CpuEngine.h"
#include "EngineScenes.h"
#include "numerics/Envelope.h"
#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <random>

using namespace PSE;
using namespace PSE::numerics;
using namespace engineScenes;

namespace {

struct Spheres {
    std::string name;
    Lattice box;
    std::vector<double> radii;
    std::vector<Vec3> positions, forces;
    Plan plan;
};

/** Grid and window for a wide margin below `error`, no wave beyond. */
Spheres makeSpheres(const std::string& name, const Lattice& box, std::vector<double> radii,
                    double spacing) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> anywhere(-1, 2); // images of the box too
    std::normal_distribution<double> normal;
    Spheres scene = {name, box, radii, {}, {}, {}};
    for (size_t i = 0; i < radii.size(); i++) {
        const double s[3] = {anywhere(random), anywhere(random), anywhere(random)};
        scene.positions.push_back(box.cartesian(Vec3(s[0], s[1], s[2])));
        const double f[3] = {normal(random), normal(random), normal(random)};
        scene.forces.push_back(Vec3(f[0], f[1], f[2]));
    }
    scene.positions[0] = Vec3::Zero(); // on a grid point
    Plan& plan = scene.plan;
    plan.a = 1;
    for (int d = 0; d < 3; d++)
        plan.grid[d] = nextFftSize(static_cast<int>(std::ceil(box.length(d) / spacing)));
    plan.windowSpacing = 0;
    for (int d = 0; d < 3; d++)
        plan.windowSpacing = std::max(plan.windowSpacing, box.length(d) / plan.grid[d]);
    plan.windowSupport = 8;
    plan.windowShape = 2.05 * plan.windowSupport;
    plan.windowError = 1e-8;
    const double bandwidth = 14, end = 0.94 * M_PI / plan.windowSpacing;
    const double range = ProlateEnvelope(bandwidth, 1).largestWaveNumber() / end;
    plan.mixture =
        std::make_shared<Mixture>(std::make_shared<ProlateEnvelope>(bandwidth, range), radii);
    plan.tableError = 1e-9;
    plan.realCutoff = plan.mixture->largestRange();
    plan.sumImages = plan.realCutoff >= 0.5 * box.smallestWidth();
    return scene;
}

std::vector<double> cycled(const std::vector<double>& some, int n) {
    std::vector<double> radii;
    for (int i = 0; i < n; i++)
        radii.push_back(some[i % some.size()]);
    return radii;
}

std::vector<Spheres> mixtures() {
    const Lattice tilted(Vec3(9, 0, 0), Vec3(4.4, 8, 0), Vec3(-4.2, 3.7, 10));
    std::vector<double> all;
    for (int i = 0; i < 40; i++)
        all.push_back(0.5 + 0.03 * i);
    return {makeSpheres("two sizes", Lattice::orthorhombic(12, 10, 11), cycled({1, 2}, 30), 0.8),
            makeSpheres("tilted", tilted, cycled({0.6, 1, 2.5}, 30), 0.8),
            makeSpheres("hollow", Lattice::orthorhombic(20, 22, 24), cycled({0.4, 4}, 12), 0.6),
            makeSpheres("larger than the box", Lattice::orthorhombic(6, 5, 4.5),
                        cycled({0.5, 5}, 6), 0.5),
            makeSpheres("all unequal", tilted, all, 0.8)};
}

/** M_W f by its definition: the sum over all waves. */
std::vector<Vec3> waveVelocities(const Spheres& scene) {
    const Mixture& mixture = *scene.plan.mixture;
    const Matrix3 waves = scene.box.waveVectors();
    const double end = mixture.largestWaveNumber(), unit = 6 * M_PI / scene.box.volume();
    int most[3];
    for (int d = 0; d < 3; d++)
        most[d] = static_cast<int>(end * scene.box.length(d) / (2 * M_PI)) + 1;
    const size_t n = scene.radii.size();
    std::vector<Vec3> u(n, Vec3::Zero());
    for (int x = -most[0]; x <= most[0]; x++)
        for (int y = -most[1]; y <= most[1]; y++)
            for (int z = 0; z <= most[2]; z++) { // the other half is the conjugate
                const Vec3 k = waves * Vec3(x, y, z);
                const double k2 = k.squaredNorm(), length = std::sqrt(k2);
                if (k2 == 0 || length >= end)
                    continue;
                Vec3 re = Vec3::Zero(), im = Vec3::Zero();
                std::vector<double> cosine(n), sine(n);
                for (size_t i = 0; i < n; i++) {
                    const double phase = k.dot(scene.positions[i]),
                                 shell =
                                     std::sin(length * scene.radii[i]) / (length * scene.radii[i]);
                    cosine[i] = shell * std::cos(phase);
                    sine[i] = shell * std::sin(phase);
                    re += cosine[i] * scene.forces[i];
                    im -= sine[i] * scene.forces[i];
                }
                const double weight = (z == 0 ? 1 : 2) * unit * mixture.envelope(length) / k2;
                re = weight * (re - k * (k.dot(re) / k2));
                im = weight * (im - k * (k.dot(im) / k2));
                for (size_t i = 0; i < n; i++)
                    u[i] += cosine[i] * re - sine[i] * im;
            }
    return u;
}

template <class Real> std::vector<Vec3> griddedVelocities(const Spheres& scene, int threadCount) {
    OpenMM::ThreadPool pool(threadCount);
    const Threads threads(pool, threadCount == 1);
    CpuWaveSpace<Real> space(scene.plan, scene.box, threads);
    std::vector<Vec3> fractions;
    for (const Vec3& x : scene.positions)
        fractions.push_back(scene.box.wrappedFractional(x));
    space.setPositions(fractions);
    const int n = static_cast<int>(fractions.size());
    space.takeForces(scene.forces, 1, 0, n);
    std::vector<Vec3> u(n, Vec3::Zero());
    StageClock clock;
    space.addVelocities(true, 0, {}, 1, u, clock);
    return u;
}

/** M_R f by its definition [T26]: all pairs and images within their ranges. */
std::vector<Vec3> realVelocities(const Spheres& scene) {
    const Mixture& mixture = *scene.plan.mixture;
    const MixtureTable table(mixture, scene.plan.tableError);
    std::vector<Vec3> u;
    for (size_t i = 0; i < scene.radii.size(); i++) {
        u.push_back(table.self(scene.radii[i]) * scene.forces[i]);
        for (size_t j = 0; j < scene.radii.size(); j++)
            for (const Vec3& image : scene.box.imagesWithin(mixture.largestRange())) {
                const Vec3 d = scene.box.wrapped(scene.positions[i]) -
                               scene.box.wrapped(scene.positions[j]) + image;
                if (d.norm() >= mixture.range(scene.radii[i], scene.radii[j]) ||
                    (i == j && image == Vec3::Zero()))
                    continue;
                const SmoothScalars s = table(d.norm(), scene.radii[i], scene.radii[j]);
                u[i] += s.F * scene.forces[j] + s.C * d.dot(scene.forces[j]) * d;
            }
    }
    return u;
}

template <class Real> std::vector<Vec3> tabulatedVelocities(const Spheres& scene) {
    OpenMM::ThreadPool pool(1);
    const Threads threads(pool, true);
    CpuRealSpace<Real> space(scene.plan, scene.box, threads);
    std::vector<Vec3> fractions;
    for (const Vec3& x : scene.positions)
        fractions.push_back(scene.box.wrappedFractional(x));
    space.setPositions(fractions);
    return realProduct(space, scene.forces);
}

/** A suspension in which every sphere has a radius of its own, planned as a platform does it. */
Spheres continuousSuspension(int n) {
    Spheres scene = {"continuous", Lattice::orthorhombic(30, 32, 34), {}, {}, {}, {}};
    std::mt19937 random(n);
    std::uniform_real_distribution<double> fraction(0, 1);
    std::normal_distribution<double> normal;
    for (int i = 0; i < n; i++) {
        const double s[3] = {fraction(random), fraction(random), fraction(random)};
        scene.positions.push_back(scene.box.cartesian(Vec3(s[0], s[1], s[2])));
        scene.forces.push_back(Vec3(normal(random), normal(random), normal(random)));
        scene.radii.push_back(0.4 + 0.6 * fraction(random));
    }
    PlanRequest request = {scene.box, n, 1, 1e-2, true, 1e-5, false, {}};
    request.radii = scene.radii;
    scene.plan = makePlan(request);
    return scene;
}

template <class Real>
std::vector<Vec3> engineVelocities(const Spheres& scene, int threads, bool noise = true) {
    OpenMM::ThreadPool pool(threads);
    StageClock clock;
    std::vector<int> indices;
    for (size_t i = 0; i < scene.radii.size(); i++)
        indices.push_back(static_cast<int>(i));
    CpuEngine<Real> engine(scene.plan, scene.box, 1, indices, pool, clock);
    engine.setPositions(scene.positions);
    const Thermal thermal = {1, 0.01, {7, Stream::StepReal, 3}, {7, Stream::StepWave, 3}};
    std::vector<Vec3> u;
    engine.computeVelocities(&scene.forces, noise ? &thermal : NULL, u);
    return u;
}

} // namespace

TEST(CpuMixture, WaveHalfIsTheSumOverWavesOnEveryInstructionSet) {
    for (const Spheres& scene : mixtures()) {
        const std::vector<Vec3> exact = waveVelocities(scene);
        for (int64_t target : runnableTargets()) {
            SCOPED_TRACE(scene.name + ", " + hwy::TargetName(target));
            const ChosenTarget chosen(target);
            EXPECT_LT(distance(griddedVelocities<double>(scene, 1), exact), 1e-6 * norm(exact));
            EXPECT_LT(distance(griddedVelocities<float>(scene, 1), exact), 1e-5 * norm(exact));
        }
    }
}

/** Rows of small spheres as sums of products, a larger one beside them whose rows are not. */
TEST(CpuMixture, RowsAsSumsOfProductsKeepTheErrorOnEveryInstructionSet) {
    constexpr double ERROR = 2e-4;
    for (double tilt : {0.0, 4.5, -6.0}) { // as of a sheared box
        const Lattice box(Vec3(12, 0, 0), Vec3(tilt, 10, 0), Vec3(0, 0, 11));
        Spheres scene = makeSpheres("small", box, cycled({0.5, 0.7, 0.9, 2}, 32), 0.9);
        scene.plan.windowSupport = 5;
        scene.plan.windowShape = 2.05 * 5;
        // its aliases are more than the error of the rows: both ways of evaluation have the same
        scene.plan.windowError = 1e-8;
        const std::vector<Vec3> fine = griddedVelocities<double>(scene, 1);
        scene.plan.windowError = ERROR;
        for (int64_t target : runnableTargets()) {
            SCOPED_TRACE(hwy::TargetName(target));
            const ChosenTarget chosen(target);
            const std::vector<Vec3> rough = griddedVelocities<double>(scene, 1),
                                    single = griddedVelocities<float>(scene, 2);
            EXPECT_LT(distance(rough, fine), 8 * ERROR * norm(fine)) << tilt;
            EXPECT_GT(distance(rough, fine), 0.01 * ERROR * norm(fine)) << tilt;
            EXPECT_LT(distance(single, rough), 1e-5 * norm(fine)) << tilt;
        }
    }
}

TEST(CpuMixture, RealHalfIsItsDefinitionOnEveryInstructionSet) {
    for (Spheres scene : mixtures()) {
        scene.positions[1] = scene.positions[2]; // at one place
        scene.positions[3] = scene.positions[2] + Vec3(1e-20, 0, 0);
        const std::vector<Vec3> exact = realVelocities(scene);
        const double magnified =
            MixtureTable(*scene.plan.mixture, scene.plan.tableError).magnification();
        for (int64_t target : runnableTargets()) {
            SCOPED_TRACE(scene.name + ", " + hwy::TargetName(target));
            const ChosenTarget chosen(target);
            // Horner's rule in powers of t loses what the table says.
            EXPECT_LT(distance(tabulatedVelocities<double>(scene), exact),
                      (1e-13 + 4e-16 * magnified) * norm(exact));
            EXPECT_LT(distance(tabulatedVelocities<float>(scene), exact),
                      (3e-6 + 2e-8 * magnified) * norm(exact));
        }
    }
}

TEST(CpuMixture, BitsDoNotDependOnThreads) {
    const Spheres scene = continuousSuspension(3000);
    const std::vector<Vec3> single = engineVelocities<float>(scene, 1),
                            twice = engineVelocities<double>(scene, 1);
    for (int threads : {2, 3, 5}) {
        EXPECT_EQ(engineVelocities<float>(scene, threads), single) << threads << " threads";
        EXPECT_EQ(engineVelocities<double>(scene, threads), twice) << threads << " threads";
    }
    EXPECT_LT(distance(single, twice), 1e-3 * norm(twice));
}

TEST(CpuMixture, TenThousandRadiiOfTheirOwn) {
    const Spheres scene = continuousSuspension(10000);
    ASSERT_GT(scene.plan.mixture->radii().size(), 9900u);
    Spheres few = scene; // one radius for those within 0.3 %: another table, other kernels
    for (double& a : few.radii)
        a = 0.1 * std::pow(1.006, std::round(std::log(a / 0.1) / std::log(1.006)));
    PlanRequest request = {few.box, 10000, 1, 1e-2, true, 1e-5, false, {}};
    request.radii = few.radii;
    few.plan = makePlan(request);
    EXPECT_LT(few.plan.mixture->radii().size(), 200u);
    const std::vector<Vec3> u = engineVelocities<float>(scene, 2, false),
                            v = engineVelocities<float>(few, 2, false);
    // The mobility of a particle changes by as much as its radius.
    EXPECT_LT(distance(u, v), 0.01 * norm(u));
    EXPECT_GT(distance(u, v), 1e-5 * norm(u));
}
