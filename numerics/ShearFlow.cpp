// SPDX-License-Identifier: MIT
#include "numerics/ShearFlow.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

double ShearFlow::strain(double from, double dt) const {
    switch (protocol) {
    case Protocol::Oscillatory: {
        const double w = 2 * M_PI / time;
        // a difference of two sines, without its cancellation
        return rate * 2 / w * std::sin(0.5 * w * dt) * std::cos(w * (from + 0.5 * dt));
    }
    case Protocol::StartUp:
        return rate * std::clamp(from + dt - time, 0.0, dt);
    default:
        return rate * dt;
    }
}

double ShearFlow::rateAt(double t) const {
    switch (protocol) {
    case Protocol::Oscillatory:
        return rate * std::cos(2 * M_PI * t / time);
    case Protocol::StartUp:
        return t < time ? 0 : rate;
    default:
        return rate;
    }
}

} // namespace PSE::numerics
