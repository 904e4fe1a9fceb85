// SPDX-License-Identifier: MIT
#include "numerics/RadialWindow.h"
#include "numerics/Quadrature.h"
#include <algorithm>
#include <cmath>

namespace PSE::numerics {

namespace {

/// 2 a r in rho^2: below, the difference of two moments loses digits
constexpr double NARROW = 0.05;
/// Chebyshev points that the polynomial of a kernel is fitted to, and distances where it is judged
constexpr int SAMPLES = 33, JUDGED = 64;

/** i1(q)/q with q^2 of either sign, i1 the modified spherical Bessel function; 1/3 at 0. */
double besselShape(double q2) {
    if (std::fabs(q2) < 0.5) {
        double term = 1.0 / 3, sum = term;
        for (int n = 1; n < 10; n++) {
            term *= q2 / (2 * n * (2 * n + 3));
            sum += term;
        }
        return sum;
    }
    const double q = std::sqrt(std::fabs(q2));
    if (q2 > 0)
        return (std::cosh(q) - std::sinh(q) / q) / q2;
    return (std::cos(q) - std::sin(q) / q) / q2;
}

} // namespace

double SphereKernel::operator()(double r) const {
    if (r < inner || r > reach)
        return 0;
    return polynomial(std::min(1.0, std::max(-1.0, scale * r * r + shift)));
}

RadialWindow::RadialWindow(double support, double shape, double spacing)
    : rho(0.5 * support * spacing), beta(shape), peak(std::cyl_bessel_i(0.0, shape)) {
    const auto shapeOf = [&](double t) {
        const double q = beta * std::sqrt(std::max(0.0, 0.5 * (1 - t)));
        return q * std::cyl_bessel_i(1.0, q) / (beta * peak);
    };
    moments = fitPolynomial(shapeOf, 1e-16, 8, 60);
}

double RadialWindow::spacing(const Lattice& box, const std::array<int, 3>& grid) {
    double largest = 0;
    for (int d = 0; d < 3; d++)
        largest = std::max(largest, box.length(d) / grid[d]);
    return largest;
}

double RadialWindow::operator()(double r) const {
    if (r > rho)
        return 0;
    return std::cyl_bessel_i(0.0, beta * std::sqrt(1 - r * r / (rho * rho))) / peak;
}

/** Int s' w(s') ds' from s to rho. */
double RadialWindow::moment(double s) const {
    return s < rho ? rho * rho / beta * moments(2 * s * s / (rho * rho) - 1) : 0;
}

double RadialWindow::operator()(double r, double a) const {
    if (2 * a * r > NARROW * rho * rho || r + a > rho)
        return r == 0 ? (*this)(a) : (moment(std::fabs(r - a)) - moment(r + a)) / (2 * a * r);
    static const Quadrature angles = gaussLegendre(8, -1, 1); // cosines
    double mean = 0;
    for (size_t i = 0; i < angles.nodes.size(); i++)
        mean += 0.5 * angles.weights[i] *
                (*this)(std::sqrt(std::max(0.0, r * r + a * a + 2 * a * r * angles.nodes[i])));
    return mean;
}

double RadialWindow::transform(double k) const {
    const double half = rho * k;
    return 4 * M_PI * rho * rho * rho * besselShape(beta * beta - half * half) / peak;
}

SphereKernel RadialWindow::kernel(double a, double maxError) const {
    SphereKernel kernel;
    kernel.inner = std::max(0.0, a - rho);
    kernel.reach = reach(a);
    const double from = kernel.inner * kernel.inner, to = kernel.reach * kernel.reach;
    kernel.scale = 2 / (to - from);
    kernel.shift = -(to + from) / (to - from);
    const auto average = [&](double t) {
        return (*this)(std::sqrt(std::max(from, (t - kernel.shift) / kernel.scale)), a);
    };
    Polynomial& p = kernel.polynomial;
    p = fitPolynomial(average, SAMPLES - 1);

    // What is still missing at each distance when the sum of Chebyshev polynomials has grown by
    // one more, with the share of the ball that the distance stands for.
    std::array<double, JUDGED> t, missing, share, current, previous;
    double allowed = 0;
    for (int i = 0; i < JUDGED; i++) {
        const double r = kernel.inner + (kernel.reach - kernel.inner) * (i + 0.5) / JUDGED;
        t[i] = kernel.scale * r * r + kernel.shift;
        missing[i] = (*this)(r, a);
        share[i] = r * r;
        allowed += share[i] * missing[i] * missing[i];
        current[i] = 1;
        previous[i] = t[i]; // T_-1
    }
    allowed *= maxError * maxError;
    int degree = 0;
    for (;; degree++) {
        double error = 0;
        for (int i = 0; i < JUDGED; i++) {
            missing[i] -= p.chebyshev[degree] * current[i];
            error += share[i] * missing[i] * missing[i];
            const double next = 2 * t[i] * current[i] - previous[i];
            previous[i] = current[i];
            current[i] = next;
        }
        if (degree == MAX_DEGREE || (degree >= 2 && error <= allowed))
            break;
    }
    return {
        kernel.scale, kernel.shift, kernel.inner, kernel.reach,
        fromChebyshev(std::vector<double>(p.chebyshev.begin(), p.chebyshev.begin() + degree + 1))};
}

} // namespace PSE::numerics
