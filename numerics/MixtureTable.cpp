// SPDX-License-Identifier: MIT
#include "numerics/MixtureTable.h"
#include "numerics/SphericalBessel.h"
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace PSE::numerics {

namespace {

constexpr int MIN_DEGREE = 2;
/// of the error allowed, for the interpolation in the radii
constexpr double INTERPOLATION_SHARE = 0.5;
/// places between two nodes at which an interpolation is judged
constexpr int PROBES = 4;

double squaredBetween(double low, double high, double t) {
    return std::sqrt(0.5 * (low * low + high * high) + 0.5 * t * (high * high - low * low));
}

/** c_m of barycentric interpolation in a^2. */
std::vector<double> lagrange(const std::vector<double>& nodes,
                             const std::vector<double>& barycentric, double a) {
    std::vector<double> c(nodes.size(), 0.0);
    double sum = 0;
    for (size_t m = 0; m < nodes.size(); m++) {
        const double difference = a * a - nodes[m] * nodes[m];
        if (difference == 0) {
            std::fill(c.begin(), c.end(), 0.0);
            c[m] = 1;
            return c;
        }
        c[m] = barycentric[m] / difference;
        sum += c[m];
    }
    for (double& weight : c)
        weight /= sum;
    return c;
}

struct Basis {
    std::vector<double> nodes, barycentric;

    /** Chebyshev points in a^2: the wave part is an even, entire function of each radius. */
    Basis(double smallest, double largest, int n) {
        for (int m = n - 1; m >= 0; m--) {
            nodes.push_back(squaredBetween(smallest, largest, chebyshevPoint(m, n)));
            barycentric.push_back((m % 2 == 0 ? 1 : -1) * std::sin(M_PI * (m + 0.5) / n));
        }
    }

    /**
     * Largest error of the wave part of a pair that interpolation in one radius makes, relative to
     * the mobility of the larger sphere: |sinc(k aj)| times the larger radius is at most 1/k.
     */
    double error(const MixtureQuadrature& rule, double smallest, double largest) const {
        const int n = static_cast<int>(nodes.size()), probes = PROBES * n;
        double worst = 0;
        for (int p = 0; p <= probes; p++) {
            const double a = squaredBetween(smallest, largest, -1 + 2.0 * p / probes);
            const std::vector<double> c = lagrange(nodes, barycentric, a);
            double sum = 0;
            for (size_t q = 0; q < rule.waveNumbers().size(); q++) {
                const double k = rule.waveNumbers()[q];
                double missed = sinc(k * a);
                for (int m = 0; m < n; m++)
                    missed -= c[m] * sinc(k * nodes[m]);
                sum +=
                    rule.weights()[q] * std::fabs(missed) * std::max(a, std::min(largest, 1 / k));
            }
            worst = std::max(worst, sum);
        }
        return 2 * worst; // in either radius
    }
};

} // namespace

MixtureTable::MixtureTable(const Mixture& mixture, double maxError)
    : range(mixture.largestRange()) {
    const MixtureQuadrature rule(mixture, range);
    chooseNodes(mixture, rule, maxError);
    fit(mixture, rule, maxError);
}

void MixtureTable::chooseNodes(const Mixture& mixture, const MixtureQuadrature& rule,
                               double maxError) {
    const std::vector<double>& radii = mixture.radii();
    if (radii.size() <= MOST_CLASSES) {
        nodes = radii;
        return;
    }
    interpolated = true;
    const auto suffices = [&](const Basis& basis) {
        return basis.error(rule, radii.front(), radii.back()) <= INTERPOLATION_SHARE * maxError;
    };
    const bool possible = suffices(Basis(radii.front(), radii.back(), MOST_BASIS));
    for (int n = 2; possible && n <= MOST_BASIS; n++) {
        const Basis basis(radii.front(), radii.back(), n);
        if (suffices(basis)) {
            nodes = basis.nodes;
            barycentric = basis.barycentric;
            return;
        }
    }
    std::ostringstream message;
    message << radii.size() << " distinct radii of a ratio of " << radii.back() / radii.front()
            << " cannot be interpolated with " << MOST_BASIS
            << " functions at this tolerance; use at most " << MOST_CLASSES
            << " distinct radii, radii that differ less, or a looser tolerance";
    throw std::invalid_argument(message.str());
}

void MixtureTable::fit(const Mixture& mixture, const MixtureQuadrature& rule, double maxError) {
    const int n = size(), waves = static_cast<int>(rule.waveNumbers().size());
    // An even function of r with waves up to k needs k rc/2 terms in t, and some for its tail.
    const int points = static_cast<int>(25 + 0.6 * mixture.largestWaveNumber() * range);
    Eigen::MatrixXd kernelF(points, waves), kernelC(points, waves), shells(waves, n);
    for (int q = 0; q < waves; q++) {
        const double k = rule.waveNumbers()[q], w = rule.weights()[q];
        for (int p = 0; p < points; p++) {
            const double r = range * std::sqrt(0.5 * (1 + chebyshevPoint(p, points)));
            const BesselRatios j = besselRatios(k * r);
            kernelF(p, q) = w * (j.j0 - j.j1x);
            kernelC(p, q) = w * k * k * j.j2x2;
        }
        for (int m = 0; m < n; m++)
            shells(q, m) = sinc(k * nodes[m]);
    }
    double allowed = maxError;
    if (interpolated) { // what is fitted is added up with weights of both signs
        const double lebesgue = 1 + 2 / M_PI * std::log(static_cast<double>(n));
        allowed *= (1 - INTERPOLATION_SHARE) / (lebesgue * lebesgue);
    }
    functionsF.resize(n * n);
    functionsC.resize(n * n);
    int degree = MIN_DEGREE;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            const Eigen::VectorXd pair = shells.col(i).cwiseProduct(shells.col(j)),
                                  F = kernelF * pair, C = kernelC * pair;
            const double scale = interpolated ? nodes.back() : nodes[i];
            const double error = allowed / scale;
            functionsF[i * n + j] = functionsF[j * n + i] =
                fitPolynomial({F.data(), F.data() + points}, error, MIN_DEGREE);
            functionsC[i * n + j] = functionsC[j * n + i] =
                fitPolynomial({C.data(), C.data() + points}, error / (range * range), MIN_DEGREE);
            degree = std::max({degree, this->F(i, j).degree(), this->C(i, j).degree()});
        }
    finish(degree);
}

void MixtureTable::finish(int degree) {
    for (int i = 0; i < size(); i++)
        for (int j = 0; j < size(); j++) {
            Polynomial &f = functionsF[i * size() + j], &c = functionsC[i * size() + j];
            for (Polynomial* p : {&f, &c}) {
                p->chebyshev.resize(degree + 1, 0.0);
                p->powers.resize(degree + 1, 0.0);
            }
            double sumF = 0, sumC = 0;
            for (int l = 0; l <= degree; l++) {
                sumF += std::fabs(f.powers[l]);
                sumC += std::fabs(c.powers[l]) * range * range;
            }
            magnified = std::max(magnified, std::max(sumF, sumC) * std::max(nodes[i], nodes[j]));
        }
}

std::vector<double> MixtureTable::weights(double a) const {
    if (interpolated)
        return lagrange(nodes, barycentric, a);
    std::vector<double> c(nodes.size(), 0.0);
    const auto after = std::lower_bound(nodes.begin(), nodes.end(), a);
    size_t nearest = std::min<size_t>(after - nodes.begin(), nodes.size() - 1);
    if (nearest > 0 && a - nodes[nearest - 1] < nodes[nearest] - a)
        nearest--;
    c[nearest] = 1;
    return c;
}

SmoothScalars MixtureTable::waveScalars(double r, double ai, double aj) const {
    const double t = 2 * r * r / (range * range) - 1;
    const std::vector<double> ci = weights(ai), cj = weights(aj);
    SmoothScalars sum = {0, 0};
    for (int m = 0; m < size(); m++)
        for (int n = 0; n < size(); n++) {
            const double weight = ci[m] * cj[n];
            if (weight != 0) {
                sum.F += weight * F(m, n)(t);
                sum.C += weight * C(m, n)(t);
            }
        }
    return sum;
}

double MixtureTable::self(double a) const {
    return 1 / a - waveScalars(0, a, a).F;
}

SmoothScalars MixtureTable::operator()(double r, double ai, double aj) const {
    const PairScalars rpy = rpyScalars(r, ai, aj);
    const SmoothScalars wave = waveScalars(r, ai, aj);
    if (r == 0)
        return {rpy.F - wave.F, 0};
    return {rpy.F - wave.F, (rpy.G - rpy.F) / (r * r) - wave.C};
}

} // namespace PSE::numerics
