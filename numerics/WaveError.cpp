// SPDX-License-Identifier: MIT
#include "numerics/PlanFamily.h"
#include "numerics/Quadrature.h"
#include "numerics/Window.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace PSE::numerics {

namespace {

/// Periods of the grid. Where the edge of the window is what limits it, aliases fall as 1/p only:
/// at the worst place those from farther away count, too.
constexpr int FARTHEST_ALIASES = 8;

/**
 * Sum over the modes k != 0 of k^-4. The integral V/(2 pi)^3 Int (k^2 + c^2)^-2 d^3k = V/(8 pi c)
 * equals it for the c that waveError() puts in place of the missing mode k = 0; c = 3.751/L in a
 * cube.
 */
double inverseFourthPowers(const Lattice& box) {
    // in units of the shortest mode of the shortest box vector
    constexpr double REACH = 4;
    constexpr int MOST_MODES = 64; // per axis: enough for an aspect ratio of 16
    const Matrix3 waves = box.waveVectors();
    const double shortest = std::min({box.length(0), box.length(1), box.length(2)}),
                 reach = REACH * 2 * M_PI / shortest;
    int limit[3];
    for (int d = 0; d < 3; d++)
        limit[d] =
            std::min(MOST_MODES, static_cast<int>(std::ceil(REACH * box.length(d) / shortest)));
    double sum = box.volume() / (2 * M_PI * M_PI * reach); // all modes beyond the reach
    for (int i = -limit[0]; i <= limit[0]; i++)
        for (int j = -limit[1]; j <= limit[1]; j++)
            for (int l = -limit[2]; l <= limit[2]; l++) {
                const double k2 = (waves * Vec3(i, j, l)).squaredNorm();
                if (k2 > 0 && k2 < reach * reach)
                    sum += 1 / (k2 * k2);
            }
    return sum;
}

/** The window's transform p periods above each node, relative to that there, p = 1, 2, ... */
std::vector<std::vector<double>> aliasRatios(const Window& window, const Quadrature& rule,
                                             int periods) {
    std::vector<std::vector<double>> all(periods);
    for (int p = 1; p <= periods; p++)
        for (double theta : rule.nodes)
            all[p - 1].push_back(window.transform(theta + 2 * M_PI * p) / window.transform(theta));
    return all;
}

} // namespace

Quadrature gradedBand(int nodes) {
    constexpr double CUBIC = 0.85;
    Quadrature rule = gaussLegendre(nodes, -1, 1);
    for (int i = 0; i < nodes; i++) {
        const double s = rule.nodes[i];
        rule.nodes[i] = M_PI * s * (1 - CUBIC + CUBIC * s * s);
        rule.weights[i] *= M_PI * (1 - CUBIC + 3 * CUBIC * s * s);
    }
    return rule;
}

double missingModes(const Lattice& box, double extent) {
    return std::pow(std::max(box.volume() / (8 * M_PI * inverseFourthPowers(box)), 3.751 / extent),
                    2);
}

double waveError(const Split& split, const Lattice& box, const std::array<int, 3>& grid,
                 int windowSupport, double windowShape, double phi, double extent,
                 double together) {
    constexpr int NODES = 24;
    const Quadrature rule = gradedBand(NODES);
    const Window window(windowSupport, windowShape);
    const int periods = (together > 0 ? FARTHEST_ALIASES : 1);
    const std::vector<std::vector<double>> ratios = aliasRatios(window, rule, periods);
    std::vector<double> aliasing(NODES);
    for (int i = 0; i < NODES; i++)
        aliasing[i] = window.aliasing(rule.nodes[i]);
    Matrix3 waves = box.waveVectors() / (2 * M_PI);
    std::array<double, 3> faces;
    for (int d = 0; d < 3; d++) {
        waves.col(d) *= grid[d];
        faces[d] = M_PI * effectivePoints(grid[d]) / box.length(d);
    }
    const double measure =
        double(grid[0]) * grid[1] * grid[2] / box.volume() / (8 * M_PI * M_PI * M_PI);
    // Stands for the missing mode k = 0 and, in pairs, for those that the extent makes useless. The
    // self mobility goes without: that part is then on the safe side in small boxes.
    const double damping = missingModes(box, extent);
    const double density = 3 * phi / (4 * M_PI);
    double pairs = 0, bias = 0;
    // of each axis: what the modes at each of its nodes add up to (component of the force, node)
    using Modes = Eigen::Matrix<double, 3, NODES>;
    std::array<Modes, 3> modes = {Modes::Zero(), Modes::Zero(), Modes::Zero()};
    for (int i = 0; i < NODES / 2; i++) // w(-k) = w(k): one half, twice
        for (int j = 0; j < NODES; j++)
            for (int l = 0; l < NODES; l++) {
                const Vec3 k = waves * Vec3(rule.nodes[i], rule.nodes[j], rule.nodes[l]);
                const double k2 = k.squaredNorm();
                const double full = 6 * M_PI * split.waveWeight(std::sqrt(k2)) / k2,
                             b = full * k2 / (k2 + damping);
                const double weight =
                    2 * measure * rule.weights[i] * rule.weights[j] * rule.weights[l];
                const double all = (1 + aliasing[i]) * (1 + aliasing[j]) * (1 + aliasing[l]) - 1;
                pairs += weight * b * b * all * (2 + all); // (1 + all)^2 - 1 without cancellation
                bias += weight * full * all;
                const int node[3] = {i, j, l},
                          mirror[3] = {NODES - 1 - i, NODES - 1 - j, NODES - 1 - l};
                const Vec3 transverse =
                    0.5 * weight * full * (Vec3::Ones() - k.cwiseProduct(k) / k2);
                for (int d = 0; d < 3; d++) {
                    modes[d].col(node[d]) += transverse;
                    modes[d].col(mirror[d]) += transverse;
                }
            }
    // of each period: (direction of the ripple, component of the force)
    std::vector<Matrix3> ripple(periods, Matrix3::Zero());
    for (int p = 0; p < periods; p++)
        for (int d = 0; d < 3; d++)
            for (int n = 0; n < NODES; n++)
                ripple[p].row(d) += ratios[p][n] * modes[d].col(n).transpose();
    // A particle at x feels a ripple 4 R_d cos(2 pi x_d/h_d) in its self mobility, of mean square 8
    // R_d^2. At the worst place all cosines have one sign, and what is lost adds up with them.
    const Split::Truncation lost = split.bandTruncation(faces, phi);
    double self =
        8 * ripple[0].squaredNorm() / 3 + std::pow(2 * bias / 3, 2) + lost.self * lost.self;
    if (together > 0) {
        double worst = 2 * bias / 3 + lost.self;
        for (const Matrix3& R : ripple)
            worst += 4 * R.cwiseAbs().sum() / 3;
        self = std::pow(worst / together, 2);
    }
    return std::sqrt(density * 2 / 3 * pairs + self + lost.pairs * lost.pairs);
}

Magnification magnification(const Split& split, const Lattice& box, const std::array<int, 3>& grid,
                            int windowSupport, double windowShape, double phi) {
    constexpr int NODES = 16;
    const Quadrature rule = gaussLegendre(NODES, -M_PI, M_PI);
    const Window window(windowSupport, windowShape);
    std::vector<double> inverse(NODES);
    for (int i = 0; i < NODES; i++)
        inverse[i] = window.transform(0) / window.transform(rule.nodes[i]);
    Matrix3 waves = box.waveVectors() / (2 * M_PI);
    for (int d = 0; d < 3; d++)
        waves.col(d) *= grid[d];
    const double measure =
        double(grid[0]) * grid[1] * grid[2] / box.volume() / (8 * M_PI * M_PI * M_PI);
    double squares = 0, self = 0;
    for (int i = 0; i < NODES; i++)
        for (int j = 0; j < NODES; j++)
            for (int l = 0; l < NODES; l++) {
                const Vec3 k = waves * Vec3(rule.nodes[i], rule.nodes[j], rule.nodes[l]);
                const double b =
                    6 * M_PI * split.waveWeight(k.norm()) / std::max(k.squaredNorm(), 1e-6);
                const double inverses = inverse[i] * inverse[j] * inverse[l],
                             weight = measure * rule.weights[i] * rule.weights[j] * rule.weights[l];
                squares += weight * b * b * inverses * inverses;
                self += weight * b * inverses * inverses;
            }
    return {std::sqrt(3 * phi / (4 * M_PI) * 2 / 3 * squares), 2.0 / 3 * self};
}

} // namespace PSE::numerics
