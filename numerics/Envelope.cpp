// SPDX-License-Identifier: MIT
#include "numerics/Envelope.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

ProlateEnvelope::ProlateEnvelope(double bandwidth, double range)
    : Envelope(range), psi(bandwidth), H(psi.series().plus(-0.5, psi.series().timesSlope())) {
    constexpr double STEP = 0.02;
    double high = 1; // psi has no zero inside the band, and H is above it there
    while (H(high) > 0)
        high += STEP;
    double low = high - STEP;
    for (double mid = 0.5 * (low + high); mid > low && mid < high; mid = 0.5 * (low + high))
        (H(mid) > 0 ? low : high) = mid;
    k0 = low * bandwidth / R;
}

double ProlateEnvelope::operator()(double k) const {
    return k < k0 ? std::clamp(H(k * R / psi.bandwidth()), 0.0, 1.0) : 0.0;
}

double ProlateEnvelope::squareBeyond(double k) const {
    // the asymptotic form of ProlateSplit with s = 1/2
    const double x = std::max(k, k0) * R / psi.bandwidth(), g = psi.edge() / psi.integral();
    return 0.5 * g * g * x * x * x / std::pow(x * x - 1, 1.5);
}

double HasimotoEnvelope::operator()(double k) const {
    const double q = k * k / (4 * xi * xi);
    return k < largestWaveNumber() ? (1 + q) * std::exp(-q) : 0.0;
}

} // namespace PSE::numerics
