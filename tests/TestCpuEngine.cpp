// SPDX-License-Identifier: MIT
// The CPU engine on every instruction set that this machine has, and for any number of threads.
#include "CpuEngine.h"
#include "EngineScenes.h"
#include "Memory.h"
#include "ParticleOrder.h"
#include "WaveKernels.h"
#include "numerics/Plan.h"
#include "numerics/RealTable.h"
#include "openmm/OpenMMException.h"
#include <gtest/gtest.h>
#include <memory>
#include <random>

using namespace PSE;
using namespace PSE::numerics;
using namespace engineScenes;

namespace {

const double TILTED_BOX[3][3] = {{20, 0, 0}, {9.5, 18, 0}, {-9, 8.5, 19}};

struct EngineScene {
    std::string name;
    Lattice box;
    std::vector<Vec3> positions, forces;
    double tolerance;
    Plan plan;
};

EngineScene makeScene(const std::string& name, const Lattice& box, int n, double tolerance) {
    std::mt19937 random(n);
    std::uniform_real_distribution<double> anywhere(-1, 2); // images of the box too
    std::normal_distribution<double> normal;
    EngineScene scene = {name, box, {}, {}, tolerance, {}};
    for (int i = 0; i < n; i++) {
        const double s[3] = {anywhere(random), anywhere(random), anywhere(random)};
        scene.positions.push_back(box.cartesian(Vec3(s[0], s[1], s[2])));
        const double f[3] = {normal(random), normal(random), normal(random)};
        scene.forces.push_back(Vec3(f[0], f[1], f[2]));
    }
    if (n > 4) // two at one place, one on a corner of the box
        scene.positions[1] = scene.positions[2], scene.positions[3] = Vec3::Zero();
    PlanRequest request = {box, n, 1, tolerance, true, 1e-5, false, {}};
    scene.plan = makePlan(request);
    return scene;
}

Lattice tiltedBox() {
    const auto column = [](int d) {
        return Vec3(TILTED_BOX[d][0], TILTED_BOX[d][1], TILTED_BOX[d][2]);
    };
    return Lattice(column(0), column(1), column(2));
}

std::vector<EngineScene> scenes() {
    const Lattice tilted = tiltedBox();
    std::vector<EngineScene> all;
    for (double tolerance : {1e-3, 1e-6}) {
        all.push_back(makeScene("cube", Lattice::orthorhombic(24, 24, 24), 200, tolerance));
        all.push_back(makeScene("long box", Lattice::orthorhombic(12, 60, 15), 150, tolerance));
        all.push_back(makeScene("tilted box", tilted, 150, tolerance));
        all.push_back(makeScene("images", Lattice::orthorhombic(6, 6, 7), 9, tolerance));
        all.push_back(makeScene("one particle", Lattice::orthorhombic(30, 30, 30), 1, tolerance));
    }
    return all;
}

std::vector<int> indicesOf(const EngineScene& scene) {
    std::vector<int> indices;
    for (size_t i = 0; i < scene.positions.size(); i++)
        indices.push_back(static_cast<int>(3 * i + 1)); // not all particles of a System are mobile
    return indices;
}

std::unique_ptr<MobilityEngine> makeEngine(const EngineScene& scene, OpenMM::ThreadPool& pool,
                                           StageClock& clock, Precision precision) {
    const std::vector<int> indices = indicesOf(scene);
    if (precision == Precision::Single)
        return std::make_unique<CpuEngine<float>>(scene.plan, scene.box, 1, indices, pool, clock);
    return std::make_unique<CpuEngine<double>>(scene.plan, scene.box, 1, indices, pool, clock);
}

std::vector<Vec3> velocities(const EngineScene& scene, int threads, Precision precision,
                             const std::vector<Vec3>* before = NULL) {
    OpenMM::ThreadPool pool(threads);
    StageClock clock;
    const std::unique_ptr<MobilityEngine> engine = makeEngine(scene, pool, clock, precision);
    const Thermal thermal = {
        1, 0.01, {7, Stream::StepReal, 5000000000u}, {7, Stream::StepWave, 5000000000u}};
    std::vector<Vec3> u;
    if (before != NULL) {
        engine->setPositions(*before);
        engine->computeVelocities(&scene.forces, &thermal, u);
    }
    engine->setPositions(scene.positions);
    engine->computeVelocities(&scene.forces, &thermal, u);
    return u;
}

/** M_R f by its definition [T5]: all pairs and images within range. */
std::vector<Vec3> realVelocities(const EngineScene& scene) {
    const RealTable table =
        makeRealTable(*scene.plan.split, scene.plan.realCutoff, scene.plan.tableError);
    std::vector<Vec3> u;
    for (size_t i = 0; i < scene.positions.size(); i++) {
        u.push_back(table.self * scene.forces[i]);
        for (size_t j = 0; j < scene.positions.size(); j++)
            for (const Vec3& image : scene.box.imagesWithin(scene.plan.realCutoff)) {
                const Vec3 d = scene.box.wrapped(scene.positions[i]) -
                               scene.box.wrapped(scene.positions[j]) + image;
                if (d.norm() >= table.rc || (i == j && image == Vec3::Zero()))
                    continue;
                const SmoothScalars s = table(d.norm());
                u[i] += s.F * scene.forces[j] + s.C * d.dot(scene.forces[j]) * d;
            }
    }
    return u;
}

template <class Real>
double realSpaceError(const EngineScene& scene, const std::vector<Vec3>& exact) {
    OpenMM::ThreadPool pool(1);
    const Threads threads(pool, true);
    CpuRealSpace<Real> space(scene.plan, scene.box, threads);
    std::vector<Vec3> fractions;
    for (const Vec3& x : scene.positions)
        fractions.push_back(scene.box.wrappedFractional(x));
    space.setPositions(fractions);
    return distance(realProduct(space, scene.forces), exact) / norm(exact);
}

/** Largest and root mean square difference of the loops' numbers from those of NoiseText.h. */
template <class Real> std::array<double, 2> particleNoiseErrors(int count) {
    const NoiseKey key = {3, Stream::StepReal, 5000000000u};
    std::vector<uint32_t> particles;
    for (int i = 0; i < count; i++)
        particles.push_back(40000u * i + 7);
    std::vector<Real> z(3 * particles.size());
    waveKernels<Real>().particleNoise(key, particles.data(), count, z.data());
    double largest = 0, squares = 0;
    for (int i = 0; i < count; i++) {
        double exact[3];
        particleNoise(key, particles[i], exact);
        for (int c = 0; c < 3; c++) {
            const double error = std::fabs(z[3 * size_t(i) + c] - exact[c]);
            largest = std::max(largest, error);
            squares += error * error;
        }
    }
    return {largest, std::sqrt(squares / (3.0 * count))};
}

} // namespace

TEST(CpuEngine, EveryInstructionSetDrawsTheSameNoise) {
    for (int64_t target : runnableTargets()) {
        SCOPED_TRACE(hwy::TargetName(target));
        const ChosenTarget chosen(target);
        // These loops round the uniform number to single precision: 2^-25 in x = 1 - R^2/2.
        const auto [largest, rms] = particleNoiseErrors<float>(100001);
        EXPECT_LT(largest, std::sqrt(2 / 33554432.0));
        EXPECT_LT(rms, 5e-7);
        EXPECT_LT(particleNoiseErrors<double>(100001)[0], 1e-14);
    }
}

TEST(CpuEngine, SortingByKeyIsStable) {
    std::vector<int> start, order;
    sortByKey({2, 0, 2, 1, 0, 5}, 6, start, order);
    EXPECT_EQ(start, (std::vector<int>{0, 2, 3, 5, 5, 5, 6}));
    EXPECT_EQ(order, (std::vector<int>{1, 4, 3, 0, 2, 5}));
    sortByKey({}, 2, start, order);
    EXPECT_EQ(start, (std::vector<int>{0, 0, 0}));
    EXPECT_TRUE(order.empty());
}

TEST(CpuEngine, RealHalfIsItsDefinitionOnEveryInstructionSet) {
    const std::vector<int64_t> targets = runnableTargets();
    for (const EngineScene& scene : scenes()) {
        const std::vector<Vec3> exact = realVelocities(scene);
        for (int64_t target : targets) {
            SCOPED_TRACE(scene.name + ", tolerance " + std::to_string(scene.tolerance) + ", " +
                         hwy::TargetName(target));
            const ChosenTarget chosen(target);
            EXPECT_LT(realSpaceError<double>(scene, exact), 1e-12);
            EXPECT_LT(realSpaceError<float>(scene, exact), 2e-6);
        }
    }
}

TEST(CpuEngine, NearestFractionsAreEnoughUpToHalfTheWidthOfATiltedBox) {
    int within = 0, beyond = 0;
    for (double scale : {0.5, 0.55, 0.6, 0.65, 0.7, 0.8, 0.9, 1.1}) {
        const EngineScene scene = makeScene("tilted box", tiltedBox().scaled(scale), 60, 1e-2);
        if (scene.plan.sumImages)
            continue;
        double reach = 0; // of the range, in fractions of the box
        for (int d = 0; d < 3; d++)
            reach = std::max(reach, scene.plan.realCutoff / scene.box.width(d));
        (reach > 0.5 ? beyond : within)++;
        const std::vector<Vec3> exact = realVelocities(scene);
        EXPECT_LT(realSpaceError<double>(scene, exact), 1e-12) << "reach " << reach;
        EXPECT_LT(realSpaceError<float>(scene, exact), 2e-6) << "reach " << reach;
    }
    EXPECT_GT(within, 0);
    EXPECT_GT(beyond, 0);
}

TEST(CpuEngine, DistancesWhoseSquaresUnderflowStayFinite) {
    EngineScene scene = makeScene("images", Lattice::orthorhombic(8, 8, 8), 3, 1e-3);
    scene.positions = {Vec3::Zero(), Vec3(1e-20, 0, 0), Vec3(0, 4, 0)};
    PlanRequest request = {scene.box, 3, 1, 1e-3, true, 1e-5, false, {}, SplitChoice::Hasimoto};
    request.overrides.xi = 0.5; // a range of more than half the box
    scene.plan = makePlan(request);
    ASSERT_TRUE(scene.plan.sumImages);
    const std::vector<Vec3> exact = realVelocities(scene);
    EXPECT_LT(realSpaceError<float>(scene, exact), 2e-6);
    EXPECT_LT(realSpaceError<double>(scene, exact), 1e-12);
}

TEST(CpuEngine, EveryInstructionSetGivesTheSameStep) {
    const std::vector<int64_t> targets = runnableTargets();
    ASSERT_GE(targets.size(), 1u);
    for (EngineScene scene : scenes()) {
        const bool single = scene.plan.precision == Precision::Single;
        scene.plan.lanczosTolerance = single ? 1e-5 : 1e-10; // hides no difference
        const std::vector<Vec3> expected = velocities(scene, 1, Precision::Double);
        for (int64_t target : targets) {
            SCOPED_TRACE(scene.name + ", tolerance " + std::to_string(scene.tolerance) + ", " +
                         hwy::TargetName(target));
            const ChosenTarget chosen(target);
            // The square root magnifies rounding where overlaps make M_R nearly singular.
            EXPECT_LT(distance(velocities(scene, 1, Precision::Double), expected),
                      1e-8 * norm(expected));
            if (single) {
                EXPECT_LT(distance(velocities(scene, 1, Precision::Single), expected),
                          5e-5 * norm(expected));
            }
        }
    }
}

TEST(CpuEngine, BitsDependNeitherOnThreadsNorOnEarlierPositions) {
    EngineScene scene = makeScene("cube", Lattice::orthorhombic(40, 40, 45), 3000, 1e-3);
    std::vector<Vec3> elsewhere = scene.positions;
    for (size_t i = 0; i < elsewhere.size(); i++)
        elsewhere[i] += Vec3(1.5 * (i % 3), 0.7 * (i % 5), -0.3 * (i % 7));
    for (Precision precision : {Precision::Single, Precision::Double}) {
        const std::vector<Vec3> expected = velocities(scene, 1, precision);
        for (int threads : {2, 3, 5})
            EXPECT_EQ(velocities(scene, threads, precision), expected) << threads << " threads";
        EXPECT_EQ(velocities(scene, 2, precision, &elsewhere), expected);
    }
}

TEST(CpuEngine, NoTimeIsChargedToNoiseThatIsAbsent) {
    const EngineScene scene = makeScene("cube", Lattice::orthorhombic(24, 24, 24), 20, 1e-3);
    OpenMM::ThreadPool pool(1);
    StageClock clock;
    const std::unique_ptr<MobilityEngine> engine =
        makeEngine(scene, pool, clock, Precision::Single);
    std::vector<Vec3> u;
    engine->setPositions(scene.positions);
    engine->computeVelocities(&scene.forces, NULL, u);
    ASSERT_FALSE(clock.times().empty());
    for (const StageTime& stage : clock.times())
        EXPECT_EQ(std::string(stage.stage).find("Lanczos"), std::string::npos) << stage.stage;
}

/** Room for the vectors of the Lanczos process, or a refusal with numbers and remedy. */
TEST(Memory, OfAnUnboundedFluidGrowsWithItsParticles) {
    const Memory small = {1e9, "machine"};
    EXPECT_NO_THROW(requireMemory(300000, 12, 1000, small)); // 0.36 and 0.3 of 0.8 GB
    try {
        requireMemory(400000, 12, 1000, small);
        FAIL() << "0.88 GB of 0.8 GB were granted";
    } catch (const OpenMM::OpenMMException& refusal) {
        const std::string text = refusal.what();
        for (const char* words : {"unbounded fluid of 400000 particles", "0.48 GB", "0.4 GB",
                                  "0.8 GB can be used", "fewer particles"})
            EXPECT_NE(text.find(words), std::string::npos) << words << " in " << text;
    }
}
