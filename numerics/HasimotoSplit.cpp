// SPDX-License-Identifier: MIT
#include "numerics/HasimotoSplit.h"
#include "numerics/Quadrature.h"
#include "numerics/SphericalBessel.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

namespace {

constexpr int TAIL_POINTS = 160;
/// xi rc: what the polynomials of RealTable resolve, and up to which they keep 5e-7 in single
/// precision
constexpr double LARGEST_RANGE = 8.2, SINGLE_RANGE = 6;

/**
 * For each point of an equidistant table of f >= 0, the integral from there to the last point.
 */
std::vector<double> integralsToInfinity(const std::vector<double>& f, double step) {
    std::vector<double> integrals(f.size(), 0.0);
    for (size_t i = f.size() - 1; i-- > 0;) {
        // f decays like a Gaussian: a trapezium in its logarithm is far better than one in its
        // value.
        const double slope = (f[i] > 0 && f[i + 1] > 0 ? std::log(f[i] / f[i + 1]) : 0);
        const double area =
            (std::fabs(slope) > 1e-3 ? (f[i] - f[i + 1]) / slope : 0.5 * (f[i] + f[i + 1]));
        integrals[i] = integrals[i + 1] + step * area;
    }
    return integrals;
}

/** A table at a fractional index, linear in the logarithm; constant beyond its ends. */
double logarithmicMean(const std::vector<double>& table, double index) {
    const int i = std::clamp(static_cast<int>(index), 0, static_cast<int>(table.size()) - 2);
    const double x = std::clamp(index - i, 0.0, 1.0);
    return std::exp((1 - x) * std::log(std::max(table[i], 1e-300)) +
                    x * std::log(std::max(table[i + 1], 1e-300)));
}

} // namespace

HasimotoSplit::HasimotoSplit(double xi) : xi(xi) {
    // exp(-k^2/4xi^2) is 4e-19 at k = 13 xi; the real part of separate spheres decays as exp(-xi^2
    // (r - 2)^2).
    kEnd = 13 * xi;
    largestDistance = CONTACT + 8 / xi;
    // w itself oscillates as cos(2 k)
    const int n = static_cast<int>(1 + 0.75 * kEnd * (largestDistance + 2));
    const Quadrature rule = gaussPanels(n, 0, kEnd);
    waveNumbers = rule.nodes;
    weights = rule.weights;
    for (size_t i = 0; i < weights.size(); i++)
        weights[i] *= 3 / M_PI * waveWeight(waveNumbers[i]);
    prepareTails();
}

double HasimotoSplit::waveWeight(double k) const {
    const double sinc = (k < 1e-4 ? 1 - k * k / 6 : std::sin(k) / k), q = k * k / (4 * xi * xi);
    return sinc * sinc * (1 + q) * std::exp(-q);
}

SmoothScalars HasimotoSplit::waveScalars(double r) const {
    SmoothScalars sum = {0, 0};
    for (size_t i = 0; i < weights.size(); i++) {
        const double k = waveNumbers[i];
        const BesselRatios j = besselRatios(k * r);
        sum.F += weights[i] * (j.j0 - j.j1x);
        sum.C += weights[i] * k * k * j.j2x2;
    }
    return sum;
}

double HasimotoSplit::tableRange(bool single) const {
    return (single ? SINGLE_RANGE : LARGEST_RANGE) / xi;
}

Split::DroppedWaves HasimotoSplit::droppedWaves(double kMax) const {
    if (kMax >= kEnd)
        return {0, 0};
    return integrateWaves(kMax, std::min(kEnd, kMax + 0.8 * kEnd));
}

double HasimotoSplit::tailDistance(int i) const {
    return CONTACT + (largestDistance - CONTACT) * i / (TAIL_POINTS - 1);
}

void HasimotoSplit::prepareTails() {
    std::vector<double> random(TAIL_POINTS), coherent(TAIL_POINTS);
    for (int i = 0; i < TAIL_POINTS; i++) {
        const double r = tailDistance(i);
        const PairScalars s = realScalars(r);
        random[i] = 4 * M_PI * r * r * (2 * s.F * s.F + s.G * s.G) / 3;
        coherent[i] = 4 * M_PI * r * r * std::fabs(2 * s.F + s.G) / 3;
    }
    randomTail = integralsToInfinity(random, tailDistance(1) - tailDistance(0));
    coherentTail = integralsToInfinity(coherent, tailDistance(1) - tailDistance(0));
}

double HasimotoSplit::realTruncation(double rc, double phi, double meanPhi) const {
    const double position = (rc - CONTACT) / (largestDistance - CONTACT) * (TAIL_POINTS - 1);
    const double random = 3 * phi / (4 * M_PI) * logarithmicMean(randomTail, position);
    const double alike = 3 * meanPhi / (4 * M_PI) * logarithmicMean(coherentTail, position);
    return std::sqrt(random + alike * alike);
}

} // namespace PSE::numerics
