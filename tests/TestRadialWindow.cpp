// SPDX-License-Identifier: MIT
// The window of unequal spheres, each number against quadrature in extended precision.

#include "numerics/GridMetric.h"
#include "numerics/RadialWindow.h"
#include "numerics/Vec3.h"
#include "numerics/WindowRows.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <vector>

using namespace PSE::numerics;

namespace {

const long double PI = std::acos(-1.0L);

/** P, beta, the error that goes with them. */
const double SHAPES[][3] = {{3, 6.15, 1e-3},  {4, 8.2, 5e-4},  {4.5, 9.3, 5e-4},
                            {5, 10.25, 5e-5}, {6, 12.3, 5e-6}, {8, 16.4, 1e-7}};
/// in grid spacings: smaller and larger than the window, and in between
const double RADII[] = {0.03, 0.1, 0.3, 0.7, 1, 1.45, 1.9, 2.5, 3.1, 6, 10};
constexpr double SPACING = 0.7;

/** I0 by its power series: relative error about 1e-18. */
long double besselI0(long double x) {
    const long double quarter = x * x / 4;
    long double term = 1, sum = 1;
    for (int n = 1; term > 1e-22L * sum; n++) {
        term *= quarter / ((long double)n * n);
        sum += term;
    }
    return sum;
}

long double windowReference(double P, long double beta, long double r) {
    const long double z = 2 * r / (P * SPACING);
    return z > 1 ? 0 : besselI0(beta * std::sqrt(1 - z * z)) / besselI0(beta);
}

/** Int f over [from, to] by the tanh-sinh rule, which does not mind steps at the ends. */
long double integral(const std::function<long double(long double)>& f, long double from,
                     long double to) {
    const long double step = 1.0L / 32, mid = (from + to) / 2, half = (to - from) / 2;
    long double sum = 0;
    for (int i = -32 * 4; i <= 32 * 4; i++) {
        const long double t = i * step, s = PI / 2 * std::sinh(t);
        sum += step * half * PI / 2 * std::cosh(t) / (std::cosh(s) * std::cosh(s)) *
               f(mid + half * std::tanh(s));
    }
    return sum;
}

/** The mean over the sphere: with s^2 = r^2 + a^2 + 2 a r cos, a r dcos = s ds. */
long double averageReference(double P, double beta, double r, double a) {
    const long double rho = 0.5L * P * SPACING, from = std::fabs((long double)r - a),
                      to = std::min(rho, (long double)r + a);
    if (from >= to)
        return 0;
    return integral([&](long double s) { return s * windowReference(P, beta, s); }, from, to) /
           (2.0L * a * r);
}

/** 4 pi Int f(r) r^2 sinc(k r) dr over pieces. */
long double transformOf(const std::function<long double(long double)>& f,
                        const std::vector<double>& pieces, double k) {
    long double sum = 0;
    for (size_t i = 1; i < pieces.size(); i++)
        sum += integral(
            [&](long double r) { return 4 * PI * r * f(r) * (k == 0 ? r : std::sin(k * r) / k); },
            pieces[i - 1], pieces[i]);
    return sum;
}

double sinc(double x) {
    return x == 0 ? 1 : std::sin(x) / x;
}

} // namespace

/** By vectors: the box is oblique, its grid coarse and unequal. */
TEST(GridMetric, MeasuresDistancesAsVectorsDo) {
    const Lattice box(Vec3(9, 0, 0), Vec3(4.5, 8, 0), Vec3(-4.5, 4, 7));
    const std::array<int, 3> grid = {10, 12, 9};
    const double unit = 0.8;
    const GridMetric metric(box, grid, unit);
    for (const Vec3& n : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(2.5, -1.25, 3.75),
                          Vec3(-0.1, 4, 0.3), Vec3(0, 0, 0)}) {
        const double exact =
            box.cartesian(Vec3(n[0] / grid[0], n[1] / grid[1], n[2] / grid[2])).squaredNorm() /
            (unit * unit);
        const double y = n[1] - metric.skewY * n[0],
                     z = n[2] - metric.skewX * n[0] - metric.skewZ * n[1];
        EXPECT_NEAR(metric.plane * n[0] * n[0] + metric.line * y * y + metric.point * z * z, exact,
                    1e-13 * (1 + exact));
    }
    for (int d = 0; d < 3; d++) // a ball as wide as the box touches all points of an axis
        EXPECT_NEAR(metric.pointsPerLength[d] * box.width(d) / unit, grid[d], 1e-12);
}

TEST(RadialWindow, AverageIsThatOverTheSphere) {
    for (const auto& s : SHAPES) {
        const RadialWindow window(s[0], s[1], SPACING);
        EXPECT_DOUBLE_EQ(window.radius(), 0.5 * s[0] * SPACING);
        EXPECT_NEAR(window(0.3), double(windowReference(s[0], s[1], 0.3)), 1e-14);
        for (double radius : RADII) {
            const double a = radius * SPACING;
            EXPECT_NEAR(window(0, a), window(a), 1e-14);
            for (int i = 1; i < 60; i++) {
                const double r = 1.05 * window.reach(a) * i / 60;
                ASSERT_NEAR(window(r, a), double(averageReference(s[0], s[1], r, a)), 1e-13)
                    << s[0] << " " << radius << " " << r;
            }
        }
    }
}

TEST(RadialWindow, TransformIsTheFourierIntegral) {
    for (const auto& s : SHAPES) {
        const RadialWindow window(s[0], s[1], SPACING);
        const auto w = [&](long double r) { return windowReference(s[0], s[1], r); };
        const double whole = window.transform(0);
        for (double theta : {0.0, 0.1, 0.7, 1.5, 2.5, M_PI, 2 * s[1] / s[0], 4.0, 6.3, 12.0}) {
            const double k = theta / SPACING,
                         exact = double(transformOf(w, {0, window.radius()}, k));
            ASSERT_NEAR(window.transform(k), exact, 1e-14 * whole) << s[0] << " " << theta;
        }
        // nowhere in the band divides what is nearly nothing
        EXPECT_GE(window.band(), 1.3 * M_PI / SPACING * (s[1] < 2 * s[0] ? 0 : 1));
        for (int i = 0; i <= 100; i++)
            EXPECT_GT(window.transform(window.band() * i / 100),
                      0.5 * s[1] * s[1] * std::exp(-s[1]) * whole);
    }
}

TEST(RadialWindow, TransformOfTheAverageIsThatOfTheWindowTimesSinc) {
    for (const auto& s : SHAPES) {
        const RadialWindow window(s[0], s[1], SPACING);
        for (double radius : {0.3, 1.45, 2.5, 6.0}) {
            const double a = radius * SPACING;
            std::vector<double> pieces = {0, std::fabs(a - window.radius()), window.reach(a)};
            for (double theta : {0.0, 0.4, 1.3, 2.2, 3.0}) {
                const double k = theta / SPACING,
                             measured = double(transformOf(
                                 [&](long double r) { return window(double(r), a); }, pieces, k));
                ASSERT_NEAR(measured, window.transform(k) * sinc(k * a),
                            3e-14 * window.transform(0))
                    << s[0] << " " << radius << " " << theta;
            }
        }
    }
}

TEST(RadialWindow, KernelsArePolynomialsOfTheErrorAskedFor) {
    for (const auto& s : SHAPES) {
        const RadialWindow window(s[0], s[1], SPACING);
        for (double radius : RADII) {
            const double a = radius * SPACING;
            const SphereKernel kernel = window.kernel(a, s[2]);
            EXPECT_LT(kernel.polynomial.degree(), RadialWindow::MAX_DEGREE);
            EXPECT_DOUBLE_EQ(kernel.reach, window.reach(a));
            double squares = 0, missed = 0;
            for (int i = 0; i < 1000; i++) {
                const double r = window.reach(a) * (i + 0.5) / 1000, exact = window(r, a);
                squares += r * r * exact * exact;
                missed += r * r * std::pow(kernel(r) - exact, 2);
                if (r < kernel.inner) {
                    ASSERT_EQ(exact, 0);
                }
            }
            EXPECT_LT(std::sqrt(missed / squares), 1.1 * s[2]) << s[0] << " " << radius;
            EXPECT_EQ(kernel(1.0001 * window.reach(a)), 0);
            // a lower degree would not do
            const SphereKernel rough = window.kernel(a, 30 * s[2]);
            EXPECT_LT(rough.polynomial.degree(), kernel.polynomial.degree());
        }
    }
}

/** By a rule of its own over the cylinder of rows, in [0, 1]: error over the average itself. */
double errorOfRows(const RadialWindow& window, double a, const WindowRows& rows) {
    constexpr int POINTS = 150;
    const double step = window.reach(a) / POINTS;
    double squares = 0, missed = 0;
    for (int i = 0; i < POINTS; i++)
        for (int j = 0; j < POINTS; j++) {
            const double d = (i + 0.5) * step, z = (j + 0.5) * step,
                         exact = window(std::sqrt(d * d + z * z), a);
            squares += d * exact * exact;
            missed += d * std::pow(rows(d, z) - exact, 2);
        }
    return std::sqrt(missed / squares);
}

TEST(WindowRows, AreSumsOfAFewProductsOfTheErrorAskedFor) {
    const double shapes[][3] = {{4, 8.2, 5e-4}, {5, 10.25, 1e-4}, {6, 12.3, 5e-5}};
    for (const auto& s : shapes) {
        const RadialWindow window(s[0], s[1], SPACING);
        for (double radius : {0.3, 0.7, 1.0}) {
            SCOPED_TRACE(std::to_string(s[0]) + " " + std::to_string(radius));
            const double a = radius * SPACING;
            const WindowRows rows = windowRows(window, a, s[2]),
                             rough = windowRows(window, a, 30 * s[2]);
            ASSERT_GE(rows.terms(), 3);
            EXPECT_LE(rows.terms(), WindowRows::MOST_TERMS);
            EXPECT_LT(errorOfRows(window, a, rows), 1.05 * s[2]);
            EXPECT_LT(errorOfRows(window, a, rough), 1.05 * 30 * s[2]);
            // a lower degree or fewer terms would not do
            EXPECT_LT(rough.terms() + rough.degree(), rows.terms() + rows.degree() - 1);
            EXPECT_GT(errorOfRows(window, a, rough), 1.05 * s[2]);
        }
    }
    // the edge of a narrow window has a slope that a few products do not describe
    EXPECT_EQ(windowRows(RadialWindow(4, 8.2, SPACING), SPACING, 1e-5).terms(), 0);
}

TEST(RadialWindow, SpacingIsTheLargestAlongTheBoxVectors) {
    const Lattice box(Vec3(10, 0, 0), Vec3(3, 4, 0), Vec3(0, 0, 6));
    EXPECT_DOUBLE_EQ(RadialWindow::spacing(box, {20, 20, 20}), 0.5);
    EXPECT_DOUBLE_EQ(RadialWindow::spacing(box, {40, 10, 20}), 0.5);
    EXPECT_DOUBLE_EQ(RadialWindow::spacing(box, {40, 20, 10}), 0.6);
}
