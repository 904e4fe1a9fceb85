// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_PROLATEFUNCTION_H_
#define OPENMMPSE_NUMERICS_PROLATEFUNCTION_H_

#include <vector>

namespace PSE::numerics {

/** sum_l b_l P_{2l}(x), Legendre polynomials. */
class EvenLegendreSeries {
public:
    EvenLegendreSeries() = default;
    explicit EvenLegendreSeries(const std::vector<double>& coefficients);
    /** Clenshaw's recurrence; x may lie outside [-1, 1]. */
    double operator()(double x) const;
    /** The series of x f'(x). */
    EvenLegendreSeries timesSlope() const;
    /** The series of this one plus `factor` times another one of the same length. */
    EvenLegendreSeries plus(double factor, const EvenLegendreSeries& other) const;
    std::vector<double> coefficients() const;
    /**
     * The same in powers of x^2. For psi the largest is 42 at c = 16 and 1300 at c = 25: by so much
     * rounding grows in a sum over powers.
     */
    std::vector<double> powers() const;

private:
    /** b_l, and P_{2l+2} = (u x^2 - v) P_{2l} - w P_{2l-2}. */
    struct Term {
        double b, u, v, w;
    };
    std::vector<Term> terms;
};

/**
 * The prolate spheroidal wave function of order zero, psi(x), psi(0) = 1 [T19]: the even solution
 * of
 *
 *     d/dx (1 - x^2) dpsi/dx + (chi - c^2 x^2) psi = 0
 *
 * with the smallest chi, finite at x = 1. Among all functions on [-1, 1] its Fourier transform has
 * the most of its square in [-c, c], and it is its own transform, Int_{-1}^{1} psi(y) cos(c x y) dy
 * = psi(x) Int_{-1}^{1} psi(y) dy, for every x.
 */
class ProlateFunction {
public:
    /** @param c  bandwidth, in [1, 40] */
    explicit ProlateFunction(double c);
    double bandwidth() const { return c; }
    /** The separation constant chi; relative error 1e-15. */
    double eigenvalue() const { return chi; }
    /**
     * psi(x), |x| <= 2; absolute error 1e-14 on [-1, 1], and beyond 1e-14 of the largest term of
     * the series, which is 40 at c = 3, x = 1.7.
     */
    double operator()(double x) const { return value(x); }
    const EvenLegendreSeries& series() const { return value; }
    /** Int_{-1}^{1} psi dx. */
    double integral() const { return 2 * value.coefficients()[0]; }
    /** psi(1). */
    double edge() const { return value(1); }

private:
    double c, chi;
    EvenLegendreSeries value;
};

} // namespace PSE::numerics

#endif
