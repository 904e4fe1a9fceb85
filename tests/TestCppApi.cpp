// SPDX-License-Identifier: MIT
// The public C++ API as a C++ program uses it, on each platform: plugins loaded by OpenMM, not
// linked.
#include "PlatformTest.h"
#include "OpenMM.h"
#include "openmmpse/PSEBrownianIntegrator.h"
#include "openmmpse/PSEKernels.h"
#include "openmm/KernelFactory.h"
#include "openmm/internal/ForceImpl.h"
#include "openmm/reference/ReferencePlatform.h"
#include <cmath>
#include <cstdlib>
#include <gtest/gtest.h>
#include <sstream>

using namespace OpenMM;
using PSE::PSEBrownianIntegrator;
using std::string;
using std::vector;

namespace {

constexpr double ETA = 600, RADIUS = 1, BOX = 10;

class CppApi : public testing::TestWithParam<const char*> {
protected:
    static void SetUpTestSuite() { platformTest::loadPlugins(); }
    Platform& platform() const { return Platform::getPlatformByName(GetParam()); }
};

System cubicSystem(int numParticles) {
    System system;
    system.setDefaultPeriodicBoxVectors(Vec3(BOX, 0, 0), Vec3(0, BOX, 0), Vec3(0, 0, BOX));
    for (int i = 0; i < numParticles; i++)
        system.addParticle(1.0);
    return system;
}

/** Mobility of one particle in a cube, in units of 1/(6 pi eta a): exact for RPY. */
double exactSelfMobility() {
    const double c = RADIUS / BOX;
    return 1 - 2.8372974794806 * c + 4 * M_PI / 3 * c * c * c;
}

/** A step that moves nothing and counts how often it hears of new positions. */
class ListeningKernel : public PSE::IntegratePSEStepKernel {
public:
    ListeningKernel(const string& name, const Platform& platform, int& heard)
        : IntegratePSEStepKernel(name, platform), heard(heard) {}
    void initialize(ContextImpl&, const PSEBrownianIntegrator&, const PSE::Scene&) override {}
    void positionsChanged() override { heard++; }
    void checkPositions(ContextImpl&) override {}
    void execute(ContextImpl&, const PSEBrownianIntegrator&) override {}
    double computeKineticEnergy(ContextImpl&) override { return 0; }
    vector<Vec3> applyMobility(ContextImpl&, const vector<Vec3>& forces) override { return forces; }
    vector<Vec3> sampleBrownianDisplacements(ContextImpl&, const PSEBrownianIntegrator&,
                                             int) override {
        return {};
    }
    vector<Vec3> computeStress(ContextImpl&, const PSEBrownianIntegrator&, int, int) override {
        return {};
    }
    PSE::NumericalParameters getNumericalParameters() const override { return {}; }
    vector<PSE::StageTime> getStageTimes() const override { return {}; }
    void createCheckpoint(std::ostream&) const override {}
    void loadCheckpoint(std::istream&) override { throw OpenMMException("refused"); }
    PSE::StepState getStepState() const override { return {}; }
    double getStrain() const override { return 0; }
    void setStepState(const PSE::StepState&) override {}

private:
    int& heard;
};

/** A Force that tells at every second step, as a barostat would, that it has moved particles. */
class MovingForce : public Force {
public:
    bool usesPeriodicBoundaryConditions() const override { return true; }

protected:
    ForceImpl* createImpl() const override { return new Impl(*this); }

private:
    struct Impl : ForceImpl {
        explicit Impl(const Force& owner) : owner(owner) {}
        void initialize(ContextImpl&) override {}
        const Force& getOwner() const override { return owner; }
        void updateContextState(ContextImpl&, bool& forcesInvalid) override {
            forcesInvalid |= (++calls % 2 == 0);
        }
        double calcForcesAndEnergy(ContextImpl&, bool, bool, int) override { return 0; }
        std::map<string, double> getDefaultParameters() override { return {}; }
        vector<string> getKernelNames() override { return {}; }
        const Force& owner;
        int calls = 0;
    };
};

class ListeningPlatform : public ReferencePlatform {
public:
    ListeningPlatform() {
        registerKernelFactory(PSE::IntegratePSEStepKernel::Name(), new Factory(heard));
    }
    int heard = 0;

private:
    struct Factory : KernelFactory {
        explicit Factory(int& heard) : heard(heard) {}
        KernelImpl* createKernelImpl(string name, const Platform& platform,
                                     ContextImpl&) const override {
            return new ListeningKernel(name, platform, heard);
        }
        int& heard;
    };
};

} // namespace

TEST(PositionsChanged, IsToldToTheKernelWheneverSomethingButAStepSetsThem) {
    ListeningPlatform platform;
    System system = cubicSystem(2);
    system.addForce(new MovingForce());
    CustomExternalForce* gravity = new CustomExternalForce("g*x");
    gravity->addGlobalParameter("g", 1);
    system.addForce(gravity);
    PSEBrownianIntegrator integrator(300, ETA, RADIUS, 0.1);
    Context context(system, integrator, platform);
    EXPECT_EQ(platform.heard, 0);
    context.setPositions({Vec3(1, 2, 3), Vec3(4, 5, 6)});
    EXPECT_EQ(platform.heard, 1);
    context.setVelocities({Vec3(), Vec3()});
    context.setParameter("g", 2);
    EXPECT_EQ(platform.heard, 1);
    integrator.step(1);
    EXPECT_EQ(platform.heard, 1);
    integrator.step(1);
    EXPECT_EQ(platform.heard, 2);
    std::stringstream checkpoint;
    context.createCheckpoint(checkpoint);
    // The kernel refuses its part, but the positions are new.
    EXPECT_THROW(context.loadCheckpoint(checkpoint), OpenMMException);
    EXPECT_EQ(platform.heard, 3);
    context.reinitialize();
    EXPECT_EQ(platform.heard, 3);
    context.setPositions({Vec3(1, 2, 3), Vec3(4, 5, 6)});
    EXPECT_EQ(platform.heard, 4);
}

TEST_P(CppApi, OneParticleInACubeHasTheExactMobility) {
    System system = cubicSystem(1);
    PSEBrownianIntegrator integrator(300, ETA, RADIUS, 0.1);
    integrator.setFluidBoundary(PSEBrownianIntegrator::Periodic);
    integrator.setErrorTolerance(1e-6);
    Context context(system, integrator, platform());
    context.setPositions({Vec3(1.2, 3.4, 5.6)});
    const vector<Vec3> u = integrator.applyMobility({Vec3(0, 0, 2)});
    EXPECT_NEAR(u[0][2] * 6 * M_PI * ETA * RADIUS / 2, exactSelfMobility(), 1e-6);
    EXPECT_NEAR(u[0][0] * 6 * M_PI * ETA * RADIUS / 2, 0, 1e-6);
}

TEST_P(CppApi, AStepWithoutNoiseIsTheMobilityTimesTheForce) {
    System system = cubicSystem(1);
    CustomExternalForce* gravity = new CustomExternalForce("-3*x");
    gravity->addParticle(0);
    system.addForce(gravity);
    PSEBrownianIntegrator integrator(0, ETA, RADIUS, 0.5);
    integrator.setFluidBoundary(PSEBrownianIntegrator::Periodic);
    Context context(system, integrator, platform());
    context.setPositions({Vec3(1, 2, 3)});
    const Vec3 u = integrator.applyMobility({Vec3(3, 0, 0)})[0];
    integrator.step(1);
    const State state = context.getState(State::Positions | State::Velocities);
    for (int d = 0; d < 3; d++) {
        EXPECT_NEAR(state.getPositions()[0][d], Vec3(1, 2, 3)[d] + 0.5 * u[d], 1e-15);
        EXPECT_DOUBLE_EQ(state.getVelocities()[0][d], u[d]);
    }
    EXPECT_DOUBLE_EQ(state.getTime(), 0.5);
}

TEST_P(CppApi, ParametersReproduceAPlan) {
    System system = cubicSystem(5);
    PSEBrownianIntegrator first(300, ETA, RADIUS, 0.1);
    first.setFluidBoundary(PSEBrownianIntegrator::Periodic);
    first.setRandomNumberSeed(3);
    Context context(system, first, platform());
    vector<Vec3> positions;
    for (int i = 0; i < 5; i++)
        positions.push_back(Vec3(i, 0.5 * i, 9 - i));
    context.setPositions(positions);
    const PSE::NumericalParameters used = first.getNumericalParameters();
    PSEBrownianIntegrator second(300, ETA, RADIUS, 0.1);
    second.setFluidBoundary(PSEBrownianIntegrator::Periodic);
    second.setNumericalParameters(used);
    Context again(system, second, platform());
    again.setPositions(positions);
    first.step(3);
    second.step(3);
    const State a = context.getState(State::Positions), b = again.getState(State::Positions);
    for (int i = 0; i < 5; i++)
        for (int d = 0; d < 3; d++) {
            EXPECT_EQ(a.getPositions()[i][d], b.getPositions()[i][d]);
            EXPECT_NE(a.getPositions()[i][d], positions[i][d]);
        }
    EXPECT_GT(first.getNumericalParameters().lanczosIterations, 0);
    EXPECT_LE(used.predictedError, 1e-3);
}

TEST_P(CppApi, SettingsAreFixedWhileAContextExists) {
    System system = cubicSystem(1);
    PSEBrownianIntegrator integrator(300, ETA, RADIUS, 0.1);
    integrator.setFluidBoundary(PSEBrownianIntegrator::Periodic);
    {
        Context context(system, integrator, platform());
        EXPECT_THROW(integrator.setErrorTolerance(1e-4), OpenMMException);
        EXPECT_EQ(integrator.getErrorTolerance(), 1e-3);
        integrator.setTemperature(0); // takes effect at the next step
    }
    integrator.setErrorTolerance(1e-4);
    EXPECT_EQ(integrator.getErrorTolerance(), 1e-4);
    EXPECT_THROW(integrator.step(1), OpenMMException);
}

TEST_P(CppApi, RefusalNamesTheSetter) {
    System system = cubicSystem(2);
    PSEBrownianIntegrator integrator(300, ETA, RADIUS, 0.1);
    integrator.setFluidBoundary(PSEBrownianIntegrator::Periodic);
    integrator.setParticleRadius(2, 2.0); // there are particles 0 and 1
    try {
        Context context(system, integrator, platform());
        FAIL() << "a radius of no particle was accepted";
    } catch (const OpenMMException& refusal) {
        EXPECT_NE(string(refusal.what()).find("setParticleRadius"), string::npos) << refusal.what();
    }
    system.addParticle(1.0); // the same integrator can be used where the particle exists
    integrator.setParticleRadius(2, RADIUS);
    Context context(system, integrator, platform());
}

INSTANTIATE_TEST_SUITE_P(Platforms, CppApi, testing::Values("Reference", "CPU"),
                         [](const testing::TestParamInfo<const char*>& info) {
                             return string(info.param);
                         });
