// SPDX-License-Identifier: MIT
#include "numerics/ProlateSplit.h"
#include "numerics/Quadrature.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace PSE::numerics {

namespace {

/// c up to which the polynomials of RealTable keep 5e-7 in single precision
constexpr double SINGLE_BANDWIDTH = 20;

double horner(const std::vector<double>& series, double t) {
    double sum = 0;
    for (size_t j = series.size(); j-- > 0;)
        sum = sum * t + series[j];
    return sum;
}

} // namespace

ProlateSplit::ProlateSplit(double bandwidth, double range, SphereModel model)
    : Split(model), psi(bandwidth), R(range) {
    const double c = bandwidth;
    // H0 = 1 + h2 k^2 + ..., h2 = -chi R^2/(2 c^2) by the equation of psi at 0; the sphere has 1/m
    s = 0.5 * (1 - 2 * c * c / (secondOrder(model) * psi.eigenvalue() * R * R));
    slope = psi.series().timesSlope();
    W = psi.series().plus(-s, slope);
    k0 = findZero();

    const std::vector<double> powers = psi.series().powers();
    const size_t n = powers.size();
    seriesF.resize(n);
    seriesC.assign(n, 0);
    for (size_t j = 0; j < n; j++) {
        const double odd = 2.0 * j + 1,
                     h = powers[j] / psi.integral() * (1 + s * odd) / (odd * (odd + 2));
        seriesF[j] = 3 / R * (odd + 1) * h;
        if (j > 0)
            seriesC[j - 1] = -6 / (R * R * R) * j * h;
    }

    beyond.pairs = pairsBeyondZero();
    // Int W dk over all k is known: (1 + s) Int H0 dk = (1 + s) pi/(R Int psi dx).
    beyond.self = (1 + s) * M_PI / (R * psi.integral()) - integrateWaves(0, k0).self;
}

double ProlateSplit::findZero() const {
    constexpr double STEP = 0.02;
    double high = 0.5; // psi has no zero inside the band
    while (W(high) > 0)
        high += STEP;
    double low = high - STEP;
    for (double mid = 0.5 * (low + high); mid > low && mid < high; mid = 0.5 * (low + high))
        (W(mid) > 0 ? low : high) = mid;
    return low * psi.bandwidth() / R;
}

double ProlateSplit::waveWeight(double k) const {
    return k < k0 ? std::max(0.0, W(k * R / psi.bandwidth())) : 0.0;
}

SmoothScalars ProlateSplit::waveScalars(double r) const {
    if (r > R) {
        if (model() == SphereModel::ForceCoupling)
            return forceCouplingFarField(r);
        const PairScalars rpy = rpyScalars(r);
        return {rpy.F, (rpy.G - rpy.F) / (r * r)};
    }
    const double t = r * r / (R * R);
    return {horner(seriesF, t), horner(seriesC, t)};
}

double ProlateSplit::maxDistance() const {
    return model() == SphereModel::ForceCoupling ? std::max(R, LARGEST_TAIL) : R;
}

double ProlateSplit::tableRange(bool single) const {
    if (single && psi.bandwidth() > SINGLE_BANDWIDTH)
        return 0;
    if (model() == SphereModel::ForceCoupling)
        return std::min(R, single ? SINGLE_RESOLVED : DOUBLE_RESOLVED);
    return R;
}

bool ProlateSplit::isPositive() const {
    // a Gaussian has no zero that k0 might come near to
    const bool below = (model() == SphereModel::ForceCoupling || k0 <= LARGEST_ZERO);
    return below && s >= SMALLEST_MATCHING && R >= SMALLEST_RANGE;
}

/**
 * Int W^2/k^2 dk from k0 on. Outside its band psi is an oscillation whose equation is marched with
 * x = cosh t: psi'' + coth t psi' = (chi - c^2 cosh^2 t) psi. After some periods W^2 has the mean 2
 * (s g)^2 x^3/(x^2 - 1)^{3/2} of its asymptotic form, g = psi(1)/Int psi.
 */
double ProlateSplit::pairsBeyondZero() const {
    constexpr double PHASE_STEP = 0.1, PERIODS = 4;
    const double c = psi.bandwidth(), chi = psi.eigenvalue(), x0 = k0 * R / c;
    if (x0 <= 1) // s < 0 has moved the zero into the band: no use as a split
        return std::numeric_limits<double>::infinity();
    const double z0 = std::sqrt(x0 * x0 - 1);
    double growth = x0 + z0; // exp t
    double y = psi(x0), dy = slope(x0) / x0 * z0;
    struct Place {
        double x, z; // cosh t, sinh t
        explicit Place(double e) : x(0.5 * (e + 1 / e)), z(0.5 * (e - 1 / e)) {}
    };
    const auto acceleration = [&](const Place& p, double y, double dy) {
        return (chi - c * c * p.x * p.x) * y - dy * p.x / p.z;
    };
    const auto density = [&](const Place& p, double y, double dy) { // W^2/x^2 dx/dt
        const double weight = y - s * dy * p.x / p.z;
        return weight * weight / (p.x * p.x) * p.z;
    };
    Place here(growth);
    double sum = 0, before = density(here, y, dy);
    while (here.x < x0 + PERIODS * M_PI / c) {
        const double h = PHASE_STEP / (c * here.x); // classical Runge-Kutta, Simpson's rule
        const double half = std::exp(0.5 * h);
        const Place mid(growth * half), end(growth * half * half);
        const double k1 = acceleration(here, y, dy), y2 = y + 0.5 * h * dy, d2 = dy + 0.5 * h * k1;
        const double k2 = acceleration(mid, y2, d2), y3 = y + 0.5 * h * d2, d3 = dy + 0.5 * h * k2;
        const double k3 = acceleration(mid, y3, d3), y4 = y + h * d3, d4 = dy + h * k3;
        const double middle = 0.5 * (density(mid, y2, d2) + density(mid, y3, d3));
        y += h / 6 * (dy + 2 * d2 + 2 * d3 + d4);
        dy += h / 6 * (k1 + 2 * k2 + 2 * k3 + acceleration(end, y4, d4));
        growth *= half * half;
        here = end;
        const double after = density(here, y, dy);
        sum += h / 6 * (before + 4 * middle + after);
        before = after;
    }
    const double g = psi.edge() / psi.integral();
    return R / c * (sum + 2 * s * s * g * g / here.z);
}

Split::DroppedWaves ProlateSplit::droppedWaves(double kMax) const {
    if (kMax >= k0)
        return beyond;
    const DroppedWaves inside = integrateWaves(kMax, k0);
    return {beyond.pairs + inside.pairs, beyond.self + inside.self};
}

Split::DroppedWaves ProlateSplit::droppedWaves(const std::array<double, 3>& faces) const {
    const double nearest = *std::min_element(faces.begin(), faces.end());
    if (nearest >= k0)
        return beyond;
    // w ends so close to the faces that the sphere inside them would count far too much
    const DroppedWaves inside = integrateOutside(faces, k0);
    return {beyond.pairs + inside.pairs, beyond.self + inside.self};
}

double ProlateSplit::realTruncation(double rc, double phi, double meanPhi) const {
    double random = 0, coherent = 0;
    const auto add = [&](double from, double to) {
        if (from >= to)
            return;
        const Quadrature rule = gaussPanels(PANEL_NODES, from, to);
        for (size_t i = 0; i < rule.nodes.size(); i++) {
            const double r = rule.nodes[i], shell = 4 * M_PI * r * r * rule.weights[i];
            const PairScalars real = realScalars(r);
            random += shell * (2 * real.F * real.F + real.G * real.G) / 3;
            coherent += shell * std::fabs(2 * real.F + real.G) / 3;
        }
    };
    add(std::max(rc, CONTACT), R);
    add(std::max(rc, R), maxDistance()); // the tail of force coupling
    const double alike = 3 * meanPhi / (4 * M_PI) * coherent;
    return std::sqrt(3 * phi / (4 * M_PI) * random + alike * alike);
}

} // namespace PSE::numerics
