// SPDX-License-Identifier: MIT
#include "numerics/ProlateFunction.h"
#include <Eigen/Eigenvalues>
#include <cmath>

namespace PSE::numerics {

namespace {

/// of the coefficients left out, the largest is below 1e-20
int termsFor(double c) {
    return static_cast<int>(c / 2) + 16;
}

/** The equation of psi in normalised even Legendre polynomials: a symmetric tridiagonal matrix. */
struct Tridiagonal {
    Eigen::VectorXd diagonal, beside;

    explicit Tridiagonal(double c) {
        const int n = termsFor(c);
        diagonal.resize(n);
        beside.resize(n - 1);
        for (int i = 0; i < n; i++) {
            const double l = 2 * i, square = c * c;
            diagonal[i] =
                l * (l + 1) + square * (2 * l * (l + 1) - 1) / ((2 * l + 3) * (2 * l - 1));
            if (i < n - 1)
                beside[i] = square * (l + 1) * (l + 2) /
                            ((2 * l + 3) * std::sqrt((2 * l + 1) * (2 * l + 5)));
        }
    }

    /**
     * The eigenvector, from its last entry down, where no term cancels: every entry has a small
     * relative error, however small it is.
     * @return by how far chi fails the first row, divided by the square of the vector
     */
    double solve(double chi, Eigen::VectorXd& v) const {
        const int n = static_cast<int>(diagonal.size());
        v.resize(n);
        v[n - 1] = 1e-60;
        v[n - 2] = -(diagonal[n - 1] - chi) * v[n - 1] / beside[n - 2];
        for (int i = n - 2; i > 0; i--)
            v[i - 1] = -((diagonal[i] - chi) * v[i] + beside[i] * v[i + 1]) / beside[i - 1];
        const double residual = (diagonal[0] - chi) * v[0] + beside[0] * v[1];
        return residual * v[0] / v.squaredNorm();
    }
};

} // namespace

EvenLegendreSeries::EvenLegendreSeries(const std::vector<double>& coefficients) {
    for (size_t l = 0; l < coefficients.size(); l++) {
        // x^2 P_n = up P_{n+2} + same P_n + down P_{n-2}
        const double n = 2.0 * l, up = (n + 1) * (n + 2) / ((2 * n + 1) * (2 * n + 3)),
                     same = (n + 1) * (n + 1) / ((2 * n + 1) * (2 * n + 3)) +
                            n * n / ((2 * n + 1) * (2 * n - 1)),
                     down = n * (n - 1) / ((2 * n + 1) * (2 * n - 1));
        terms.push_back({coefficients[l], 1 / up, same / up, down / up});
    }
}

double EvenLegendreSeries::operator()(double x) const {
    const double square = x * x;
    double b1 = 0, b2 = 0;
    for (size_t l = terms.size(); l-- > 0;) {
        const double w = (l + 1 < terms.size() ? terms[l + 1].w : 0);
        const double b = (terms[l].b - w * b2) + (terms[l].u * square - terms[l].v) * b1;
        b2 = b1;
        b1 = b;
    }
    return b1;
}

EvenLegendreSeries EvenLegendreSeries::timesSlope() const {
    // x P_n' = n P_n + sum over m = n - 2, n - 4, ... of (2m + 1) P_m
    std::vector<double> slope(terms.size());
    double above = 0;
    for (size_t l = terms.size(); l-- > 0;) {
        slope[l] = 2.0 * l * terms[l].b + (4.0 * l + 1) * above;
        above += terms[l].b;
    }
    return EvenLegendreSeries(slope);
}

EvenLegendreSeries EvenLegendreSeries::plus(double factor, const EvenLegendreSeries& other) const {
    EvenLegendreSeries sum = *this;
    for (size_t l = 0; l < terms.size(); l++)
        sum.terms[l].b += factor * other.terms[l].b;
    return sum;
}

std::vector<double> EvenLegendreSeries::coefficients() const {
    std::vector<double> b;
    for (const Term& term : terms)
        b.push_back(term.b);
    return b;
}

std::vector<double> EvenLegendreSeries::powers() const {
    const size_t n = terms.size();
    // P_{2l} and P_{2l-2} in x^2: large and of both signs, hence long double.
    std::vector<long double> sum(n, 0), p(n, 0), before(n, 0), next(n);
    p[0] = 1;
    for (const Term& term : terms) {
        for (size_t j = 0; j < n; j++) {
            sum[j] += term.b * p[j];
            next[j] = (j > 0 ? term.u * p[j - 1] : 0) - term.v * p[j] - term.w * before[j];
        }
        before = p;
        p = next;
    }
    return std::vector<double>(sum.begin(), sum.end());
}

ProlateFunction::ProlateFunction(double c) : c(c) {
    const Tridiagonal matrix(c);
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen;
    eigen.computeFromTridiagonal(matrix.diagonal, matrix.beside, Eigen::EigenvaluesOnly);
    chi = eigen.eigenvalues()[0];
    Eigen::VectorXd v;
    constexpr int NEWTON_STEPS = 2; // from 1e-13 to rounding
    for (int i = 0; i < NEWTON_STEPS; i++)
        chi += matrix.solve(chi, v);
    matrix.solve(chi, v);
    std::vector<double> legendre;
    for (int i = 0; i < v.size(); i++)
        legendre.push_back(v[i] * std::sqrt(2 * i + 0.5));
    const double centre = EvenLegendreSeries(legendre)(0);
    for (double& b : legendre)
        b /= centre;
    value = EvenLegendreSeries(legendre);
}

} // namespace PSE::numerics
