// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_BENCHMARKS_SCENES_H_
#define OPENMMPSE_BENCHMARKS_SCENES_H_

// Scenes that the benchmarks share: equal spheres of radius 1 nm, the same numbers on every
// machine.

#include "OpenMM.h"
#include "openmmpse/PSEBrownianIntegrator.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace PSE::benchmarks {

constexpr double RADIUS = 1, VISCOSITY = 600, TEMPERATURE = 300; ///< nm, Da/(nm ps), K
constexpr double DRAG = 6 * M_PI * VISCOSITY * RADIUS;           ///< Da/ps
constexpr double KT = 0.00831446261815324 * TEMPERATURE;         ///< kJ/mol

/** The step (ps) in which a sphere alone diffuses so that dt D0/a^2 is the given number. */
inline double diffusiveStep(double fraction) {
    return fraction * RADIUS * RADIUS * DRAG / KT;
}

/** Uniform numbers in [0, 1), the same with every standard library. */
class Uniform {
public:
    explicit Uniform(uint64_t seed) : engine(seed) {}
    double operator()() { return double(engine() >> 11) * 0x1p-53; }
    /** Each component in [-half, half). */
    OpenMM::Vec3 vector(double half) {
        const double x = (*this)(), y = (*this)(), z = (*this)();
        return (OpenMM::Vec3(x, y, z) * 2 - OpenMM::Vec3(1, 1, 1)) * half;
    }

private:
    std::mt19937_64 engine;
};

/** Length of the cube (nm) in which n spheres fill the volume fraction phi. */
inline double boxLength(int n, double phi) {
    return std::cbrt(n * 4 * M_PI / 3 * RADIUS * RADIUS * RADIUS / phi);
}

/**
 * n positions on randomly chosen places of a cubic lattice, each displaced at random as far as
 * spheres do not overlap on average.
 * @param shuffled  neighbours in space get indices far apart, as in a suspension that has been
 * stirred; else the order is that of the lattice, as a program that has just built it has
 */
inline std::vector<OpenMM::Vec3> jitteredLattice(int n, double phi, bool shuffled,
                                                 uint64_t seed = 1) {
    const int side = static_cast<int>(std::ceil(std::cbrt(n) - 1e-9));
    const double length = boxLength(n, phi), spacing = length / side;
    const double jitter = 0.5 * std::max(0.2 * RADIUS, spacing - 2 * RADIUS);
    Uniform random(seed);
    std::vector<OpenMM::Vec3> all;
    all.reserve(size_t(side) * side * side);
    for (int x = 0; x < side; x++)
        for (int y = 0; y < side; y++)
            for (int z = 0; z < side; z++)
                all.push_back((OpenMM::Vec3(x, y, z) + OpenMM::Vec3(0.5, 0.5, 0.5)) * spacing +
                              random.vector(jitter));
    // Vacancies at random: a lattice whose last layer is empty would be a slab.
    std::vector<OpenMM::Vec3> chosen;
    chosen.reserve(n);
    size_t left = all.size();
    for (const OpenMM::Vec3& place : all)
        if (random() * double(left--) < double(n - chosen.size()))
            chosen.push_back(place);
    for (size_t i = chosen.size(); shuffled && i > 1; i--)
        std::swap(chosen[i - 1], chosen[size_t(random() * double(i))]);
    return chosen;
}

/** A chain of n touching beads that fills a cube row by row, to and fro: as compact as a globule.
 */
inline std::vector<OpenMM::Vec3> compactChain(int n, uint64_t seed = 1) {
    const int side = static_cast<int>(std::ceil(std::cbrt(n) - 1e-9));
    Uniform random(seed);
    std::vector<OpenMM::Vec3> beads;
    for (int i = 0; i < n; i++) {
        const int z = i / (side * side), row = i / side;
        const int y = (z % 2 == 0 ? row % side : side - 1 - row % side);
        const int x = (row % 2 == 0 ? i % side : side - 1 - i % side);
        beads.push_back(OpenMM::Vec3(x, y, z) * 2 * RADIUS + random.vector(0.1 * RADIUS));
    }
    return beads;
}

/** A System of n particles in a cube. */
inline std::unique_ptr<OpenMM::System> cubicSystem(int n, double length) {
    auto system = std::make_unique<OpenMM::System>();
    system->setDefaultPeriodicBoxVectors(OpenMM::Vec3(length, 0, 0), OpenMM::Vec3(0, length, 0),
                                         OpenMM::Vec3(0, 0, length));
    for (int i = 0; i < n; i++)
        system->addParticle(1.0);
    return system;
}

/** Load the plugins from folders separated by ':'. */
inline void loadPlugins(const std::string& folders) {
    std::istringstream list(folders);
    for (std::string folder; std::getline(list, folder, ':');)
        OpenMM::Platform::loadPluginsFromDirectory(folder);
}

} // namespace PSE::benchmarks

#endif
