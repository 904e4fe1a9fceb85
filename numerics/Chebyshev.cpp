// SPDX-License-Identifier: MIT
#include "numerics/Chebyshev.h"
#include <cmath>
#include <utility>

namespace PSE::numerics {

namespace {

std::vector<double> valuesAtPoints(const std::function<double(double)>& f, int n) {
    std::vector<double> values(n);
    for (int j = 0; j < n; j++)
        values[j] = f(chebyshevPoint(j, n));
    return values;
}

std::vector<double> chebyshevCoefficients(const std::vector<double>& values) {
    const int n = static_cast<int>(values.size());
    std::vector<double> c(n);
    for (int k = 0; k < n; k++) {
        double sum = 0;
        for (int j = 0; j < n; j++)
            sum += values[j] * std::cos(M_PI * k * (j + 0.5) / n);
        c[k] = (k == 0 ? 1.0 : 2.0) * sum / n;
    }
    return c;
}

std::vector<double> toPowers(const std::vector<double>& chebyshev) {
    const int n = static_cast<int>(chebyshev.size());
    std::vector<double> powers(n, 0.0), current(n, 0.0), previous(n, 0.0), next(n);
    current[0] = 1; // T_0
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < n; i++)
            powers[i] += chebyshev[k] * current[i];
        for (int i = 0; i < n; i++) // T_1 = t T_0, then T_{k+1} = 2 t T_k - T_{k-1}
            next[i] = (k == 0 ? 1 : 2) * (i > 0 ? current[i - 1] : 0) - previous[i];
        previous = current;
        current = next;
    }
    return powers;
}

} // namespace

double chebyshevPoint(int j, int n) {
    return std::cos(M_PI * (j + 0.5) / n);
}

double Polynomial::operator()(double t) const {
    double b1 = 0, b2 = 0;
    for (int k = degree(); k > 0; k--) {
        const double b = chebyshev[k] + 2 * t * b1 - b2;
        b2 = b1;
        b1 = b;
    }
    return chebyshev[0] + t * b1 - b2;
}

Polynomial fromChebyshev(std::vector<double> coefficients) {
    Polynomial p;
    p.powers = toPowers(coefficients);
    p.chebyshev = std::move(coefficients);
    return p;
}

Polynomial fitPolynomial(const std::function<double(double)>& f, int degree) {
    return fromChebyshev(chebyshevCoefficients(valuesAtPoints(f, degree + 1)));
}

Polynomial fitPolynomial(const std::function<double(double)>& f, double maxError, int minDegree,
                         int maxDegree) {
    return fitPolynomial(valuesAtPoints(f, maxDegree + 1), maxError, minDegree);
}

Polynomial fitPolynomial(const std::vector<double>& values, double maxError, int minDegree) {
    std::vector<double> c = chebyshevCoefficients(values);
    int degree = static_cast<int>(values.size()) - 1;
    double neglected = 0;
    while (degree > minDegree && neglected + std::fabs(c[degree]) < maxError)
        neglected += std::fabs(c[degree--]);
    c.resize(degree + 1);
    return fromChebyshev(std::move(c));
}

} // namespace PSE::numerics
