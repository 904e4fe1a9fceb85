// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_CHEBYSHEV_H_
#define OPENMMPSE_NUMERICS_CHEBYSHEV_H_

#include <functional>
#include <vector>

namespace PSE::numerics {

/**
 * A polynomial in t in [-1, 1], fitted at Chebyshev points, in both bases: Chebyshev (stable at any
 * degree, for double) and powers of t (Horner's rule, for the fast paths).
 */
struct Polynomial {
    std::vector<double> chebyshev; ///< f(t) = sum c_n T_n(t)
    /// f(t) = sum p_n t^n; loses digits where the degree is high (RealTable: xi rc > 8)
    std::vector<double> powers;

    int degree() const { return static_cast<int>(chebyshev.size()) - 1; }
    /** Clenshaw's recurrence in the Chebyshev basis. */
    double operator()(double t) const;
};

/** Chebyshev point j of n, in (-1, 1), descending. */
double chebyshevPoint(int j, int n);

/** The polynomial with these coefficients in the Chebyshev basis. */
Polynomial fromChebyshev(std::vector<double> coefficients);

/** Fit by interpolation at degree + 1 Chebyshev points. */
Polynomial fitPolynomial(const std::function<double(double)>& f, int degree);

/**
 * The lowest degree (>= minDegree) whose neglected Chebyshev coefficients sum to less than
 * maxError, from samples at maxDegree + 1 points. The fit uses maxDegree if none does.
 */
Polynomial fitPolynomial(const std::function<double(double)>& f, double maxError, int minDegree,
                         int maxDegree);
/** The same from the values at all chebyshevPoint()s of maxDegree + 1. */
Polynomial fitPolynomial(const std::vector<double>& values, double maxError, int minDegree);

} // namespace PSE::numerics

#endif
