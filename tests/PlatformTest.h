// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_TESTS_PLATFORMTEST_H_
#define OPENMMPSE_TESTS_PLATFORMTEST_H_

// What the tests share that run on the platform and in the precision given on the command line.
// Where that platform or a device for it is missing, they are skipped, with the reason.

#include "OpenMM.h"
#include "openmmpse/PSEBrownianIntegrator.h"
#include "openmmpse/PSEKernels.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <stdexcept>
#include <gtest/gtest.h>
#include <iostream>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace platformTest {

using OpenMM::Vec3;
using PSE::PSEBrownianIntegrator;
using std::string;
using std::vector;

using Box = std::array<Vec3, 3>;
using Properties = std::map<string, string>;

constexpr double ETA = 600, RADIUS = 1, STEP = 0.1, TEMPERATURE = 300; // Da/(nm ps), nm, ps, K
constexpr double DRAG = 6 * M_PI * ETA * RADIUS;                       // Da/ps
constexpr int SKIPPED = 77; ///< exit status that ctest shows as "Skipped"

/** Where the tests run, from the command line. */
struct Target {
    string platform = "Reference", precision; ///< no precision: the platform has but one

    Properties properties() const {
        return precision.empty() ? Properties{} : Properties{{"Precision", precision}};
    }
    bool isHost() const { return platform == "Reference" || platform == "CPU"; }
    /** Positions, and the fluid of a device, are numbers of single precision. */
    bool isSingle() const { return precision == "single"; }
    /** Vectors on a device are in single precision. */
    bool hasSingleVectors() const { return precision == "single" || precision == "mixed"; }
};

inline Target target;

/** OpenMM's plugins and ours, from the folders in OPENMM_PLUGIN_DIR, separated by ':'. */
inline void loadPlugins() {
    const char* folders = std::getenv("OPENMM_PLUGIN_DIR");
    if (folders == nullptr)
        throw std::runtime_error(
            "set OPENMM_PLUGIN_DIR to the folders of OpenMM's plugins and of ours");
    std::istringstream list(folders);
    for (string folder; std::getline(list, folder, ':');)
        OpenMM::Platform::loadPluginsFromDirectory(folder);
}

inline Box rectangular(double x, double y, double z) {
    return {Vec3(x, 0, 0), Vec3(0, y, 0), Vec3(0, 0, z)};
}

/** As oblique as OpenMM's reduced form allows. */
inline Box mostTilted(double x, double y, double z) {
    return {Vec3(x, 0, 0), Vec3(x / 2, y, 0), Vec3(-x / 2, y / 2, z)};
}

/** Coordinates of single precision hold these multiples exactly up to 256 nm. */
inline double rounded(double x) {
    return std::round(x * 65536) / 65536;
}

/**
 * Evenly distributed in the box: particles overlap. All coordinates are exact in single precision,
 * so that every platform sees the same positions.
 */
inline vector<Vec3> randomPositions(int count, const Box& box, uint32_t seed) {
    std::mt19937 engine(seed);
    vector<Vec3> positions(count);
    for (Vec3& x : positions) {
        Vec3 sum;
        for (const Vec3& edge : box)
            sum += edge * (engine() / 4294967296.0);
        x = Vec3(rounded(sum[0]), rounded(sum[1]), rounded(sum[2]));
    }
    return positions;
}

/** Components between -1 and 1 kJ/(mol nm), exact in single precision. */
inline vector<Vec3> randomForces(int count, uint32_t seed) {
    return randomPositions(count, {Vec3(2, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, 2)}, seed);
}

inline double norm(const vector<Vec3>& values) {
    double sum = 0;
    for (const Vec3& v : values)
        sum += v.dot(v);
    return std::sqrt(sum);
}

inline vector<Vec3> difference(const vector<Vec3>& a, const vector<Vec3>& b) {
    if (a.size() != b.size())
        throw std::runtime_error("vectors of different length are compared");
    vector<Vec3> result(a.size());
    for (size_t i = 0; i < a.size(); i++)
        result[i] = a[i] - b[i];
    return result;
}

/** |a - b|/|b|, 2-norm over all particles. */
inline double relativeError(const vector<Vec3>& a, const vector<Vec3>& b) {
    return norm(difference(a, b)) / norm(b);
}

/** Bit by bit. */
inline bool identical(const vector<Vec3>& a, const vector<Vec3>& b) {
    for (size_t i = 0; i < a.size(); i++)
        for (int d = 0; d < 3; d++)
            if (a[i][d] != b[i][d])
                return false;
    return a.size() == b.size();
}

/** What a test wants of a Context; the rest is the same for all of them. */
struct Settings {
    Box box = rectangular(10, 10, 10);
    double tolerance = 1e-3;
    PSEBrownianIntegrator::MobilityModel model = PSEBrownianIntegrator::RotnePragerYamakawa;
    const PSE::NumericalParameters* parameters = nullptr; ///< of another Context's Plan
    vector<double> masses = {};                           ///< empty: 1 Da each
    OpenMM::Force* (*force)(int particles) = nullptr;     ///< makes what the System takes over
    int seed = 7;
    double temperature = TEMPERATURE;
    vector<double> radii = {}; ///< empty: RADIUS each
};

/** A Context on one platform, with all that it needs. */
class Fluid {
public:
    Fluid(const string& platform, const Properties& properties, const Settings& settings,
          const vector<Vec3>& positions)
        : integrator(settings.temperature, ETA, RADIUS, STEP) {
        system.setDefaultPeriodicBoxVectors(settings.box[0], settings.box[1], settings.box[2]);
        for (size_t i = 0; i < positions.size(); i++)
            system.addParticle(settings.masses.empty() ? 1 : settings.masses[i]);
        if (settings.force != nullptr)
            system.addForce(settings.force(static_cast<int>(positions.size())));
        integrator.setFluidBoundary(PSEBrownianIntegrator::Periodic);
        integrator.setMobilityModel(settings.model);
        integrator.setErrorTolerance(settings.tolerance);
        if (settings.parameters != nullptr)
            integrator.setNumericalParameters(*settings.parameters);
        integrator.setRandomNumberSeed(settings.seed);
        for (size_t i = 0; i < settings.radii.size(); i++)
            integrator.setParticleRadius(static_cast<int>(i), settings.radii[i]);
        context.reset(new OpenMM::Context(
            system, integrator, OpenMM::Platform::getPlatformByName(platform), properties));
        context->setPositions(positions);
    }
    /** On the platform and in the precision that are tested. */
    Fluid(const Settings& settings, const vector<Vec3>& positions)
        : Fluid(target.platform, target.properties(), settings, positions) {}

    vector<Vec3> positions() const {
        return context->getState(OpenMM::State::Positions).getPositions();
    }
    vector<Vec3> velocities() const {
        return context->getState(OpenMM::State::Velocities).getVelocities();
    }
    string checkpoint() const {
        std::stringstream stream;
        context->createCheckpoint(stream);
        return stream.str();
    }
    void load(const string& checkpoint) {
        std::stringstream stream(checkpoint);
        context->loadCheckpoint(stream);
    }

    OpenMM::System system;
    PSEBrownianIntegrator integrator;
    std::unique_ptr<OpenMM::Context> context;
};

/**
 * What rounding makes of the fluid's vectors: hundreds of roundings for each component, magnified
 * by the window. Relative, 2-norm.
 */
inline double fluidRounding(const PSE::NumericalParameters& used) {
    return used.precision == "double" ? 1e-12 : 2e-6;
}

/** The text of the OpenMMException that an action must throw; empty, and a failure, if none. */
inline string refusal(const std::function<void()>& action) {
    try {
        action();
    } catch (const OpenMM::OpenMMException& thrown) {
        return thrown.what();
    }
    ADD_FAILURE() << "nothing was refused";
    return "";
}

/** What keeps the target from being tested; no reason: nothing does. */
struct Obstacle {
    string reason;
    bool isOurs = false; ///< something is wrong with what was built here
};

inline Obstacle obstacle() {
    using OpenMM::Platform;
    string failures;
    bool oursFailed = false;
    for (const string& failure : Platform::getPluginLoadFailures()) {
        failures += "\n  " + failure;
        oursFailed |= failure.find("OpenMMPSE" + target.platform) != string::npos;
    }
    try {
        Platform& platform = Platform::getPlatformByName(target.platform);
        // with OpenMM's own integrator: what is missing then is not missing because of us
        OpenMM::System system;
        system.addParticle(1);
        OpenMM::VerletIntegrator integrator(0.001);
        OpenMM::Context context(system, integrator, platform, target.properties());
        if (!platform.supportsKernels({PSE::IntegratePSEStepKernel::Name()}))
            return {"our plugin for it was not built, or not loaded" + failures,
                    oursFailed || target.isHost()};
    } catch (const OpenMM::OpenMMException& missing) {
        return {missing.what() + failures, target.isHost()};
    }
    return {};
}

/** All tests of a binary: main(). @return their exit status, or SKIPPED */
inline int run(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    if (argc < 2 || argc > 3) {
        std::cerr << "usage: " << argv[0] << " PLATFORM [single|mixed|double]\n";
        return 2;
    }
    target.platform = argv[1];
    target.precision = argc == 3 ? argv[2] : "";
    loadPlugins();
    const Obstacle found = obstacle();
    if (found.reason.empty())
        return RUN_ALL_TESTS();
    std::cout << (found.isOurs ? "Failed on " : "Skipped on ") << target.platform << " "
              << target.precision << ": " << found.reason << "\n";
    return found.isOurs ? 1 : SKIPPED;
}

} // namespace platformTest

#endif
