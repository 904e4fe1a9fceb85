// SPDX-License-Identifier: MIT
#include "numerics/Window.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

double Window::operator()(double x) const {
    const double z = 2 * x / P;
    if (std::fabs(z) > 1)
        return 0;
    return std::cyl_bessel_i(0.0, beta * std::sqrt(1 - z * z)) / std::cyl_bessel_i(0.0, beta);
}

double Window::transform(double theta) const {
    const double half = 0.5 * P * theta, q2 = beta * beta - half * half,
                 q = std::sqrt(std::fabs(q2));
    const double shape = (q < 1e-4 ? 1 + q2 / 6 : (q2 > 0 ? std::sinh(q) : std::sin(q)) / q);
    return P * shape / std::cyl_bessel_i(0.0, beta);
}

double Window::aliasing(double theta) const {
    const double own = transform(theta);
    double sum = 0;
    // beyond its main lobe the square decays as 1/p^2: what is left out is below 2 %
    for (int p = 1; p <= 15; p++) {
        const double up = transform(theta + 2 * M_PI * p) / own,
                     down = transform(theta - 2 * M_PI * p) / own;
        sum += up * up + down * down;
    }
    return sum;
}

std::vector<Polynomial> Window::polynomials(double maxError) const {
    int degree = 2;
    std::vector<Polynomial> pieces;
    for (int j = 0; j < P; j++) {
        const auto piece = [&](double t) {
            return (*this)(std::min(0.5 * P, std::max(-0.5 * P, j + 0.5 * (t + 1 - P))));
        };
        pieces.push_back(fitPolynomial(piece, maxError, 2, 24));
        degree = std::max(degree, pieces.back().degree());
    }
    // one degree for all, so that a row of weights is one loop
    for (Polynomial& piece : pieces) {
        piece.chebyshev.resize(degree + 1, 0.0);
        piece.powers.resize(degree + 1, 0.0);
    }
    return pieces;
}

} // namespace PSE::numerics
