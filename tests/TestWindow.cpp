// SPDX-License-Identifier: MIT
// Kaiser-Bessel window, Chebyshev fits and Gauss-Legendre rules, each against another way to the
// same number.

#include "numerics/Chebyshev.h"
#include "numerics/Quadrature.h"
#include "numerics/Window.h"
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using namespace PSE::numerics;

namespace {

const long double PI = std::acos(-1.0L);

/** The supports and shapes that tolerances 1e-1 to 1e-10 lead to: P, beta. */
const double SHAPES[][2] = {{3, 5.3},  {4, 6.28}, {4, 7.6},   {5, 9.9}, {6, 12.2},
                            {7, 14.5}, {8, 16.8}, {10, 21.4}, {12, 26}, {14, 28}};

/** I0 by its power series, all terms positive: relative error about 1e-18. */
long double besselI0(long double x) {
    const long double quarter = x * x / 4;
    long double term = 1, sum = 1;
    for (int n = 1; term > 1e-22L * sum; n++) {
        term *= quarter / ((long double)n * n);
        sum += term;
    }
    return sum;
}

long double windowReference(int P, long double beta, long double x) {
    const long double z = 2 * x / P;
    return besselI0(beta * std::sqrt(std::max(0.0L, 1 - z * z))) / besselI0(beta);
}

/**
 * Int W(x) exp(-i theta x) dx by the tanh-sinh rule in extended precision, which does not mind the
 * step of the window at its edges; absolute error below 1e-16 P.
 */
double transformReference(int P, double beta, double theta) {
    const long double step = 1.0L / 64;
    long double sum = 0;
    for (int i = -64 * 4; i <= 64 * 4; i++) {
        const long double t = i * step, s = PI / 2 * std::sinh(t), x = 0.5L * P * std::tanh(s);
        const long double weight = 0.5L * P * PI / 2 * std::cosh(t) / (std::cosh(s) * std::cosh(s));
        sum += step * weight * windowReference(P, beta, x) * std::cos(theta * x);
    }
    return double(sum);
}

template <class Real> Real horner(const Polynomial& p, Real t) {
    Real sum = Real(p.powers[p.degree()]);
    for (int n = p.degree() - 1; n >= 0; n--)
        sum = sum * t + Real(p.powers[n]);
    return sum;
}

} // namespace

TEST(Quadrature, IsExactForPolynomialsOfDegree2nMinus1) {
    for (int n : {1, 2, 3, 8, 24, 64}) {
        const Quadrature rule = gaussLegendre(n, -1, 1);
        for (int degree = 0; degree < 2 * n; degree++) {
            double sum = 0;
            for (int i = 0; i < n; i++)
                sum += rule.weights[i] * std::pow(rule.nodes[i], degree);
            ASSERT_NEAR(sum, degree % 2 == 0 ? 2.0 / (degree + 1) : 0, 2e-14) << n << " " << degree;
        }
        double sum = 0;
        for (int i = 0; i < n; i++)
            sum += rule.weights[i] * std::pow(rule.nodes[i], 2 * n);
        if (n < 9) {
            EXPECT_GT(2.0 / (2 * n + 1) - sum, 1e-6) << "one degree more cannot be exact";
        }
    }
}

TEST(Quadrature, NodesOfSmallRulesAreTheClosedForms) {
    const Quadrature two = gaussLegendre(2, 3, 5), three = gaussLegendre(3, -1, 1);
    EXPECT_DOUBLE_EQ(two.nodes[0], 4 - 1 / std::sqrt(3.0));
    EXPECT_DOUBLE_EQ(two.nodes[1], 4 + 1 / std::sqrt(3.0));
    EXPECT_DOUBLE_EQ(two.weights[0], 1);
    EXPECT_NEAR(three.nodes[0], -std::sqrt(0.6), 1e-15);
    EXPECT_NEAR(three.weights[1], 8.0 / 9, 1e-15);
}

TEST(Quadrature, PanelsResolveOscillationsWithThreeQuartersOfANodePerRadian) {
    for (double k : {0.5, 30.0, 85.3, 400.0, 3000.0}) {
        const double from = -1, to = 2;
        const Quadrature rule = gaussPanels(static_cast<int>(0.75 * k * (to - from)), from, to);
        ASSERT_EQ(rule.nodes.size() % PANEL_NODES, 0u);
        double cosine = 0, cubic = 0;
        for (size_t i = 0; i < rule.nodes.size(); i++) {
            ASSERT_GT(rule.nodes[i], i == 0 ? from : rule.nodes[i - 1]);
            cosine += rule.weights[i] * std::cos(k * rule.nodes[i]);
            cubic += rule.weights[i] * std::pow(rule.nodes[i], 3);
        }
        EXPECT_NEAR(cosine, (std::sin(k * to) - std::sin(k * from)) / k, 1e-14 + 1e-16 * k) << k;
        EXPECT_NEAR(cubic, 15.0 / 4, 1e-13);
    }
}

TEST(Quadrature, LargeRulesResolveOscillations) {
    // A rule of n nodes resolves cos(k x) on an interval of length L once n > k L/2.
    for (int n : {200, 1000}) {
        const double length = 3, k = 1.7 * n / length;
        const Quadrature rule = gaussLegendre(n, 0, length);
        double sum = 0, total = 0;
        for (int i = 0; i < n; i++) {
            sum += rule.weights[i] * std::cos(k * rule.nodes[i]);
            total += rule.weights[i];
            ASSERT_GT(rule.nodes[i], i == 0 ? 0 : rule.nodes[i - 1]);
            ASSERT_GT(rule.weights[i], 0);
        }
        EXPECT_NEAR(sum, std::sin(k * length) / k, 1e-13);
        EXPECT_NEAR(total, length, 1e-12);
    }
}

TEST(Chebyshev, BothBasesGiveBackAPolynomial) {
    const auto f = [](double t) { return 3 - 2 * t + 0.5 * t * t * t - t * t * t * t * t; };
    const Polynomial p = fitPolynomial(f, 7);
    const double exact[] = {3, -2, 0, 0.5, 0, -1, 0, 0};
    ASSERT_EQ(p.degree(), 7);
    for (int n = 0; n <= 7; n++)
        EXPECT_NEAR(p.powers[n], exact[n], 1e-12);
    for (double t = -1; t <= 1; t += 0.01) {
        EXPECT_NEAR(p(t), f(t), 1e-14);
        EXPECT_NEAR(horner(p, t), f(t), 1e-13);
    }
    EXPECT_NEAR(fitPolynomial(f, 0)(0.3), 3, 1e-15); // degree 0: the value at the middle
}

TEST(Chebyshev, PicksTheLowestDegreeThatKeepsTheError) {
    const auto f = [](double t) { return std::exp(2 * t); };
    for (double maxError : {1e-2, 1e-5, 1e-9, 1e-13}) {
        const Polynomial p = fitPolynomial(f, maxError, 2, 40);
        double worst = 0, lower = 0;
        const Polynomial cheaper = fitPolynomial(f, p.degree() - 1);
        for (double t = -1; t <= 1; t += 0.001) {
            worst = std::max(worst, std::fabs(p(t) - f(t)));
            lower = std::max(lower, std::fabs(cheaper(t) - f(t)));
        }
        EXPECT_LT(worst, maxError + 1e-14);
        EXPECT_GT(
            lower,
            0.4 * maxError); // one degree less would not do, but for the factor of interpolation
    }
}

TEST(Chebyshev, DegreeStaysBetweenItsBounds) {
    const auto constant = [](double) { return 1.5; };
    const auto kink = [](double t) { return std::fabs(t); };
    EXPECT_EQ(fitPolynomial(constant, 1e-3, 2, 10).degree(), 2);
    EXPECT_EQ(fitPolynomial(kink, 1e-12, 2, 10).degree(), 10);
}

TEST(Window, IsTheRatioOfBesselFunctions) {
    for (const auto& s : SHAPES) {
        const int P = int(s[0]);
        const Window window(P, s[1]);
        EXPECT_EQ(window(0), 1);
        EXPECT_EQ(window(0.5 * P + 1e-9), 0);
        EXPECT_EQ(window(-0.5 * P - 1e-9), 0);
        for (int i = -50; i <= 50; i++) {
            const double x = 0.5 * P * i / 50;
            ASSERT_NEAR(window(x), double(windowReference(P, s[1], x)), 1e-14) << P << " " << x;
        }
    }
}

TEST(Window, TransformIsTheFourierIntegralOfTheTruncatedWindow) {
    for (const auto& s : SHAPES) {
        const int P = int(s[0]);
        const Window window(P, s[1]);
        for (double theta :
             {0.0, 0.1, 0.7, 1.5, 2.5, 3.0, M_PI, 2 * s[1] / P, 4.0, 6.3, 12.0, 20.0}) {
            const double exact = transformReference(P, s[1], theta);
            ASSERT_NEAR(window.transform(theta), exact, 1e-13) << P << " " << theta;
            if (theta <= M_PI) { // inside the band it is divided by: relative error
                ASSERT_NEAR(window.transform(theta) / exact, 1, 1e-10) << P << " " << theta;
            }
            ASSERT_EQ(window.transform(theta), window.transform(-theta));
        }
    }
}

TEST(Window, TransformIsSmoothWhereTheHyperbolicSineTurnsIntoTheSine) {
    const Window window(6, 12.2);
    const double edge = 2 * 12.2 / 6;
    double previous = window.transform(edge - 1e-5);
    for (int i = -99; i <= 100; i++) {
        const double value = window.transform(edge + 1e-7 * i);
        ASSERT_NEAR(value, previous, 1e-9);
        ASSERT_LE(value, previous);
        previous = value;
    }
}

TEST(Window, MinShapeKeepsTheZerosOutsideTheNyquistBand) {
    for (int P = 2; P <= 16; P++) {
        const double beta = Window::minShape(P);
        const Window least(P, beta), smaller(P, 0.5 * beta);
        double lowest = least.transform(0), lowestOfSmaller = lowest;
        for (int i = 0; i <= 2000; i++) {
            const double theta = M_PI * i / 2000;
            ASSERT_GT(least.transform(theta), 0);
            lowest = std::min(lowest, least.transform(theta) / least.transform(0));
            lowestOfSmaller = std::min(lowestOfSmaller, smaller.transform(theta));
        }
        // At the edge of the band q is 0.05 P or less: the transform is P/I0(beta), its peak P
        // sinh(beta)/(beta I0(beta)).
        EXPECT_GT(lowest, 0.8 * beta / std::sinh(beta)) << P;
        if (P >= 3) {
            EXPECT_LT(lowestOfSmaller, 0)
                << "half of minShape must fail, or this test proves nothing";
        }
        // The first zero: q = i pi, theta = 2 sqrt(beta^2 + pi^2)/P.
        const double zero = 2 * std::sqrt(beta * beta + M_PI * M_PI) / P;
        EXPECT_GT(zero, M_PI);
        EXPECT_NEAR(least.transform(zero), 0, 1e-14 * P);
    }
}

TEST(Window, AliasingIsTheSumOverAllAliases) {
    for (const auto& s : SHAPES) {
        const Window window(int(s[0]), s[1]);
        double measured = 0,
               exact =
                   0; // mean over the band with the weight of the self mobility, 1/k^2 times k^2
        for (int i = 0; i <= 24; i++) {
            const double theta = 0.8 * M_PI * i / 24;
            double sum = 0;
            for (int p = -200; p <= 200; p++)
                if (p != 0)
                    sum += std::pow(
                        window.transform(theta + 2 * M_PI * p) / window.transform(theta), 2);
            measured += window.aliasing(theta);
            exact += sum;
            EXPECT_LE(window.aliasing(theta), sum * (1 + 1e-12));
            EXPECT_GE(window.aliasing(theta), 0.75 * sum) << s[0] << " " << theta;
        }
        EXPECT_NEAR(measured / exact, 1, 0.02) << s[0];
        EXPECT_NEAR(window.aliasing(M_PI), 1,
                    0.01); // the Nyquist wave and its alias are one and the same
    }
}

TEST(Window, PolynomialsGiveTheWindowOnEveryGridPoint) {
    for (const auto& s : SHAPES) {
        const int P = int(s[0]);
        const Window window(P, s[1]);
        for (double maxError : {1e-2, 1e-4, 1e-7, 1e-12}) {
            const std::vector<Polynomial> pieces = window.polynomials(maxError);
            ASSERT_EQ(int(pieces.size()), P);
            double worst = 0, worstFloat = 0;
            for (int i = 0; i <= 400; i++) {
                const double u = 7 + i / 400.0; // a particle at u touches i0 ... i0 + P - 1
                const double i0 = std::ceil(u - 0.5 * P), t = 2 * (i0 - u) + P - 1;
                ASSERT_LE(std::fabs(t), 1);
                for (int j = 0; j < P; j++) {
                    ASSERT_EQ(pieces[j].degree(), pieces[0].degree());
                    const double exact =
                        double(windowReference(P, s[1], std::min(0.5 * P, i0 + j - u)));
                    worst = std::max(worst, std::fabs(pieces[j](t) - exact));
                    worst = std::max(worst, std::fabs(horner(pieces[j], t) - exact));
                    worstFloat =
                        std::max(worstFloat, std::fabs(horner(pieces[j], float(t)) - exact));
                }
            }
            EXPECT_LE(worst, maxError) << "P " << P << " degree " << pieces[0].degree();
            EXPECT_LE(worstFloat, maxError + 1e-6) << "P " << P;
        }
    }
}

TEST(Window, PolynomialDegreeStaysAffordable) {
    // Degrees that the error of each support asks for; a loop
    // over powers costs that.
    const double cases[][3] = {
        {4, 7.6, 1e-3}, {5, 9.9, 1e-4}, {6, 12.2, 1e-5}, {7, 14.5, 1e-6}, {8, 16.8, 1e-7}};
    for (const auto& c : cases)
        EXPECT_LE(Window(int(c[0]), c[1]).polynomials(c[2])[0].degree(), int(c[0]) + 1);
}
