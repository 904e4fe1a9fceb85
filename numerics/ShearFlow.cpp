// SPDX-License-Identifier: MIT
#include "numerics/ShearFlow.h"
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace PSE::numerics {

namespace {

/// beyond, the place of a particle in its box is lost to rounding
constexpr double LARGEST_STRAIN = 1e9;

void requireTime(double t) {
    if (std::isfinite(t))
        return;
    std::ostringstream message;
    message << "the time is " << t << " ps, and shear flow is a function of time, which must be "
            << "finite; call Context.setTime, or set the shear rate to 0";
    throw std::invalid_argument(message.str());
}

double strainOfStep(const ShearFlow& flow, double from, double dt) {
    switch (flow.protocol) {
    case ShearFlow::Protocol::Oscillatory: {
        const double w = 2 * M_PI / flow.time;
        // a difference of two sines, without its cancellation
        return flow.rate * 2 / w * std::sin(0.5 * w * dt) * std::cos(w * (from + 0.5 * dt));
    }
    case ShearFlow::Protocol::StartUp:
        return flow.rate * std::clamp(from + dt - flow.time, 0.0, dt);
    default:
        return flow.rate * dt;
    }
}

} // namespace

double ShearFlow::strain(double from, double dt) const {
    requireTime(from);
    const double strain = strainOfStep(*this, from, dt);
    if (std::fabs(strain) <= LARGEST_STRAIN)
        return strain;
    std::ostringstream message;
    message << "the shear rate of " << rate << " /ps makes a strain of " << strain
            << " in a step of " << dt << " ps, the limit is " << LARGEST_STRAIN
            << "; use a lower shear rate or a smaller step size";
    throw std::invalid_argument(message.str());
}

double ShearFlow::rateAt(double t) const {
    requireTime(t);
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
