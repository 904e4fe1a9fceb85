// SPDX-License-Identifier: MIT
#include "numerics/Mixture.h"
#include "numerics/Quadrature.h"
#include "numerics/SphericalBessel.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

Mixture::Mixture(std::shared_ptr<const Envelope> envelope, const std::vector<double>& radii,
                 double cut)
    : H(std::move(envelope)), ofParticles(radii), distinct(radii), pointRange(H->range() - cut) {
    std::sort(distinct.begin(), distinct.end());
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
}

double Mixture::waveWeight(double k, double ai, double aj) const {
    return envelope(k) * sinc(k * ai) * sinc(k * aj);
}

MixtureQuadrature::MixtureQuadrature(const Mixture& mixture, double largestDistance) {
    // The integrand oscillates as cos(k (r + ai + aj)): resolved with half as many nodes as that
    // has radians, and some more.
    const double end = mixture.largestWaveNumber();
    const int n = static_cast<int>(60 + 0.6 * end * (largestDistance + 2 * mixture.radii().back()));
    const Quadrature rule = gaussLegendre(n, 0, end);
    k = rule.nodes;
    for (int i = 0; i < n; i++)
        w.push_back(3 / M_PI * rule.weights[i] * mixture.envelope(k[i]));
}

std::vector<double> MixtureQuadrature::of(double ai, double aj) const {
    std::vector<double> pair(k.size());
    for (size_t i = 0; i < k.size(); i++)
        pair[i] = w[i] * sinc(k[i] * ai) * sinc(k[i] * aj);
    return pair;
}

MixtureScales::MixtureScales(const Mixture& mixture) {
    const MixtureQuadrature rule(mixture, 0);
    k = rule.waveNumbers();
    for (double weight : rule.weights())
        w.push_back(2.0 / 3 * weight);
    growth = 0;
    for (double a : mixture.radii()) {
        const double scale = (*this)(a);
        growth = std::max(growth, 1 / (a * scale * scale));
    }
}

double MixtureScales::operator()(double a) const {
    double wave = 0;
    for (size_t i = 0; i < k.size(); i++) {
        const double s = sinc(k[i] * a);
        wave += w[i] * s * s;
    }
    return std::sqrt(std::max(1 / a - wave, LEAST_SHARE / a));
}

SmoothScalars MixtureQuadrature::at(double r, const std::vector<double>& pair) const {
    SmoothScalars sum = {0, 0};
    for (size_t i = 0; i < k.size(); i++) {
        const BesselRatios j = besselRatios(k[i] * r);
        sum.F += pair[i] * (j.j0 - j.j1x);
        sum.C += pair[i] * k[i] * k[i] * j.j2x2;
    }
    return sum;
}

} // namespace PSE::numerics
