// SPDX-License-Identifier: MIT
// The error estimates behind the Plan against errors measured by explicit sums.

#include "numerics/AllWaves.h"
#include "numerics/HasimotoSplit.h"
#include "numerics/NearImages.h"
#include "numerics/Plan.h"
#include "numerics/ProlateSplit.h"
#include "numerics/Window.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <gtest/gtest.h>
#include <random>
#include <set>
#include <vector>

using namespace PSE::numerics;

namespace {

using Complex = std::complex<double>;
using Vectors = std::vector<Vec3>;

/** Particles anywhere in a box (lengths in radii), overlaps included, with a unit force each. */
struct Suspension {
    Lattice box;
    Vectors x, f;

    Suspension(const Lattice& box, int n, unsigned seed) : box(box), x(n), f(n) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> uniform;
        std::normal_distribution<double> normal;
        for (int i = 0; i < n; i++) {
            x[i] = box.cartesian(Vec3(uniform(random), uniform(random), uniform(random)));
            f[i] = Vec3(normal(random), normal(random), normal(random)).normalized();
        }
    }
};

/** A cubic box, or one of maximal tilt, that holds n particles at volume fraction phi. */
Lattice boxFor(int n, double phi, bool tilted) {
    const double L = std::cbrt(4 * M_PI / 3 * n / phi);
    return tilted ? Lattice(Vec3(L, 0, 0), Vec3(0.5 * L, L, 0), Vec3(-0.5 * L, 0.5 * L, L))
                  : Lattice::orthorhombic(L, L, L);
}

double rms(const Vectors& u) {
    double sum = 0;
    for (const Vec3& v : u)
        sum += v.squaredNorm();
    return std::sqrt(sum / u.size());
}

Vectors difference(const Vectors& u, const Vectors& v) {
    Vectors d(u.size());
    for (size_t i = 0; i < u.size(); i++)
        d[i] = u[i] - v[i];
    return d;
}

/** One factor of a particle's plane waves: per axis, for n = -limit ... limit. */
struct Phases {
    std::array<int, 3> limit;
    std::vector<std::array<std::vector<Complex>, 3>> of; ///< [particle][axis][limit + n]
};

/** exp(-2 pi i n s), s the fractional coordinate: the exact transform. */
Phases exactPhases(const Suspension& s, const std::array<int, 3>& limit) {
    Phases phases{limit, {}};
    phases.of.resize(s.x.size());
    for (size_t j = 0; j < s.x.size(); j++)
        for (int d = 0; d < 3; d++)
            for (int n = -limit[d]; n <= limit[d]; n++)
                phases.of[j][d].push_back(
                    std::polar(1.0, -2 * M_PI * n * s.box.fractional(s.x[j])[d]));
    return phases;
}

/** Spread along one axis onto the grid, transform the grid, divide the window out: sum_g W(u - g)
 * exp(-2 pi i n g/M)/W^. */
Phases gridPhases(const Suspension& s, const std::array<int, 3>& grid, const Window& window) {
    Phases phases{{(grid[0] - 1) / 2, (grid[1] - 1) / 2, (grid[2] - 1) / 2},
                  {}}; // without the Nyquist planes
    const int P = window.support();
    phases.of.resize(s.x.size());
    for (size_t j = 0; j < s.x.size(); j++)
        for (int d = 0; d < 3; d++) {
            const double u = s.box.fractional(s.x[j])[d] * grid[d], first = std::ceil(u - 0.5 * P);
            for (int n = -phases.limit[d]; n <= phases.limit[d]; n++) {
                Complex sum = 0;
                for (int g = 0; g < P; g++)
                    sum += window(first + g - u) *
                           std::polar(1.0, -2 * M_PI * n * (first + g) / grid[d]);
                phases.of[j][d].push_back(sum / window.transform(2 * M_PI * n / grid[d]));
            }
        }
    return phases;
}

/** Velocities sum_k B(k) (I - kk) S_i* sum_j S_j f_j, B = 6 pi w/(V k^2) where `keep` says so, mode
 * by mode. */
Vectors waveVelocities(const Suspension& s, const Split& split, const Phases& phases,
                       const std::function<bool(double)>& keep) {
    Vectors u(s.x.size(), Vec3::Zero());
    std::vector<Complex> wave(s.x.size());
    const std::array<int, 3>& m = phases.limit;
    for (int i = -m[0]; i <= m[0]; i++)
        for (int j = -m[1]; j <= m[1]; j++)
            // -k gives the complex conjugate: twice the real part
            for (int l = 0; l <= m[2]; l++) {
                const Vec3 k = s.box.waveVectors() * Vec3(i, j, l);
                const double k2 = k.squaredNorm();
                if (k2 == 0 || !keep(std::sqrt(k2)))
                    continue;
                const double B = (l == 0 ? 1 : 2) * 6 * M_PI / s.box.volume() *
                                 split.waveWeight(std::sqrt(k2)) / k2;
                Eigen::Vector3cd force = Eigen::Vector3cd::Zero();
                for (size_t p = 0; p < s.x.size(); p++) {
                    wave[p] = phases.of[p][0][m[0] + i] * phases.of[p][1][m[1] + j] *
                              phases.of[p][2][m[2] + l];
                    force += wave[p] * s.f[p];
                }
                force -= k * (k.cast<Complex>().dot(force) / k2);
                for (size_t p = 0; p < s.x.size(); p++)
                    u[p] += B * (std::conj(wave[p]) * force).real();
            }
    return u;
}

std::array<int, 3> limitFor(const Lattice& box, double kMax) {
    std::array<int, 3> limit;
    for (int d = 0; d < 3; d++)
        limit[d] = static_cast<int>(kMax * box.length(d) / (2 * M_PI));
    return limit;
}

Vectors exactWave(const Suspension& s, const Split& split, double kMax) {
    return waveVelocities(s, split, exactPhases(s, limitFor(s.box, kMax)),
                          [kMax](double k) { return k <= kMax; });
}

Vectors griddedWave(const Suspension& s, const Split& split, const std::array<int, 3>& grid,
                    const Window& window) {
    return waveVelocities(s, split, gridPhases(s, grid, window), [](double) { return true; });
}

/** Velocities from real-space pairs at rc < r < farthest, images included. */
Vectors droppedPairs(const Suspension& s, const Split& split, double rc, double farthest) {
    std::vector<PairScalars>
        scalars; // linear interpolation at this spacing: error 1e-4 of the value
    const double step = 0.01;
    for (int i = 0; i * step <= farthest + step; i++)
        scalars.push_back(split.realScalars(i * step));
    Vectors u(s.x.size(), Vec3::Zero());
    const Vectors images = s.box.imagesWithin(farthest);
    for (size_t i = 0; i < s.x.size(); i++)
        for (size_t j = 0; j < s.x.size(); j++)
            for (const Vec3& image : images) {
                const Vec3 d = s.x[i] - s.x[j] + image;
                const double r = d.norm(), x = r / step - int(r / step);
                if (r <= rc || r >= farthest)
                    continue;
                const PairScalars &a = scalars[int(r / step)], &b = scalars[int(r / step) + 1];
                const double F = (1 - x) * a.F + x * b.F, G = (1 - x) * a.G + x * b.G;
                u[i] += F * s.f[j] + (G - F) / (r * r) * d.dot(s.f[j]) * d;
            }
    return u;
}

/** The whole real half, self mobility and images included. */
Vectors realVelocities(const Suspension& s, const Split& split, double range) {
    Vectors u(s.x.size());
    const Vectors images = s.box.imagesWithin(range);
    for (size_t i = 0; i < s.x.size(); i++) {
        u[i] = split.realSelf() * s.f[i];
        for (size_t j = 0; j < s.x.size(); j++)
            for (const Vec3& image : images) {
                const Vec3 d = s.x[i] - s.x[j] + image;
                const double r = d.norm();
                if (r == 0 || r > range)
                    continue;
                const PairScalars p = split.realScalars(r);
                u[i] += p.F * s.f[j] + (p.G - p.F) / (r * r) * d.dot(s.f[j]) * d;
            }
    }
    return u;
}

Vectors sum(const Vectors& u, const Vectors& v) {
    Vectors s(u.size());
    for (size_t i = 0; i < u.size(); i++)
        s[i] = u[i] + v[i];
    return s;
}

/** M f by Hasimoto's split and exact waves: error below 1e-13. */
Vectors exactProduct(const Suspension& s, double xi) {
    const HasimotoSplit split(xi);
    return sum(exactWave(s, split, 12 * xi),
               realVelocities(s, split, std::min(2 + 6 / xi, split.maxDistance())));
}

} // namespace

TEST(Estimates, WaveTruncationIntegralConverged) {
    // The same integrals by Simpson's rule, for every xi a Plan accepts; oscillations of sinc^2
    // included.
    for (double xi : {1e-3, 0.05, 0.5, 2.0, 4.0}) {
        const HasimotoSplit split(xi);
        for (double y : {0.5, 1.5, 3.0, 5.0, 8.0}) {
            const double low = y * xi, high = 13 * xi;
            const int n = 20000;
            double pairs = 0, self = 0;
            for (int i = 0; i <= n; i++) {
                const double k = low + (high - low) * i / n,
                             weight = (i == 0 || i == n ? 1 : (i % 2 == 1 ? 4 : 2));
                const double b = 6 * M_PI * split.waveWeight(k) / (k * k);
                pairs += weight * b * b * k * k * (high - low) / (3 * n);
                self += weight * b * k * k * (high - low) / (3 * n);
            }
            const double phi = 0.2, share = 1 / (3 * M_PI * M_PI);
            const double exact =
                std::sqrt(3 * phi / (4 * M_PI) * share * pairs + share * share * self * self);
            EXPECT_NEAR(split.waveTruncation(low, phi) / exact, 1, 0.02) << xi << " " << y;
        }
    }
}

/** Int from low of 4 pi r^2 (2 F^2 + G^2)/3 and of 4 pi r^2 |2 F + G|/3, by Simpson's rule. */
std::array<double, 2> realTails(const Split& split, double low) {
    const double high = split.maxDistance();
    const int n = 1000;
    std::array<double, 2> sums = {0, 0};
    for (int i = 0; i <= n; i++) {
        const double r = low + (high - low) * i / n;
        const double weight =
            (i == 0 || i == n ? 1 : (i % 2 == 1 ? 4 : 2)) * (high - low) / (3 * n);
        const PairScalars s = split.realScalars(r);
        sums[0] += weight * 4 * M_PI * r * r * (2 * s.F * s.F + s.G * s.G) / 3;
        sums[1] += weight * 4 * M_PI * r * r * std::fabs(2 * s.F + s.G) / 3;
    }
    return sums;
}

TEST(Estimates, RealTruncationIntegralConverged) {
    const double phi = 0.2, n = 3 * phi / (4 * M_PI);
    for (double xi : {1e-3, 0.05, 0.5, 2.0}) {
        const HasimotoSplit split(xi);
        for (double y : {0.01, 0.5, 1.0, 2.0, 3.0, 4.0}) {
            const std::array<double, 2> tails = realTails(split, 2 + y / xi);
            const double exact = std::sqrt(n * tails[0] + n * n * tails[1] * tails[1]);
            EXPECT_NEAR(split.realTruncation(2 + y / xi, phi) / exact, 1, 0.03) << xi << " " << y;
        }
    }
}

TEST(Estimates, CutoffsInvertTheTruncations) {
    for (double xi : {0.01, 0.5, 2.0}) {
        const HasimotoSplit split(xi);
        for (double error : {1e-2, 1e-4, 1e-7, 5e-11}) {
            const double kc = split.waveCutoff(error, 0.3), rc = split.realCutoff(error, 0.3);
            EXPECT_LE(split.waveTruncation(kc, 0.3), error);
            EXPECT_GT(split.waveTruncation(0.999 * kc, 0.3), error);
            EXPECT_LE(split.realTruncation(rc, 0.3), error);
            if (rc > 2) {
                EXPECT_GT(split.realTruncation(2 + 0.999 * (rc - 2), 0.3), error);
            }
        }
    }
}

TEST(Estimates, WaveTruncationIsTheMeasuredError) {
    for (double phi : {0.05, 0.3})
        for (double xi : {0.4, 0.7}) {
            const Suspension s(boxFor(200, phi, phi < 0.1), 200, 11);
            const HasimotoSplit split(xi);
            const double last = 9 * xi;
            const Phases phases = exactPhases(s, limitFor(s.box, last));
            for (double y : {2.5, 4.5}) {
                const Vectors dropped = waveVelocities(
                    s, split, phases, [=](double k) { return k > y * xi && k <= last; });
                const double ratio = rms(dropped) / split.waveTruncation(y * xi, phi);
                EXPECT_GT(ratio, 0.7) << phi << " " << xi << " " << y;
                EXPECT_LT(ratio, 1.4) << phi << " " << xi << " " << y;
            }
        }
}

TEST(Estimates, RealTruncationIsTheMeasuredError) {
    for (double phi : {0.05, 0.3})
        for (double xi : {0.4, 0.8}) {
            Suspension s(boxFor(200, phi, phi < 0.1), 200, 12);
            const HasimotoSplit split(xi);
            for (double y : {2.0, 3.0, 4.0}) {
                const double rc = 1.5 + y / xi, n = 3 * phi / (4 * M_PI), farthest = rc + 1.5 / xi;
                const std::array<double, 2> tails = realTails(split, rc);
                const double random = rms(droppedPairs(s, split, rc, farthest));
                EXPECT_GT(random / std::sqrt(n * tails[0]), 0.7) << phi << " " << xi << " " << y;
                EXPECT_LT(random / std::sqrt(n * tails[0]), 1.4) << phi << " " << xi << " " << y;
                Suspension alike = s;
                alike.f.assign(200, Vec3(0, 0, 1));
                const double coherent = rms(droppedPairs(alike, split, rc, farthest));
                const double ratio = coherent / split.realTruncation(rc, phi);
                EXPECT_GT(ratio, 0.5) << phi << " " << xi << " " << y;
                EXPECT_LT(ratio, 1.4) << phi << " " << xi << " " << y;
            }
        }
}

TEST(Estimates, WaveErrorIsTheMeasuredError) {
    struct Case {
        int P;
        double beta, xi;
        int M;
        bool tilted;
    };
    const Case cases[] = {{4, 7.6, 0.6, 12, false},  {4, 7.6, 0.6, 13, true},
                          {5, 9.9, 0.6, 14, false},  {5, 9.9, 0.5, 15, true},
                          {6, 12.2, 0.5, 15, false}, {7, 14.5, 0.4, 14, false},
                          {8, 16.8, 0.4, 16, true},  {3, 5.3, 0.7, 12, false}};
    for (const Case& c : cases) {
        const double phi = 0.2;
        const HasimotoSplit split(c.xi);
        const Window window(c.P, c.beta);
        const Lattice box = boxFor(50, phi, c.tilted);
        const std::array<int, 3> grid = {c.M, c.tilted ? c.M + 2 : c.M, c.tilted ? c.M + 3 : c.M};
        double square = 0;
        for (unsigned seed = 1; seed <= 3; seed++) {
            const Suspension s(box, 50, seed);
            square += std::pow(rms(difference(griddedWave(s, split, grid, window),
                                              exactWave(s, split, 10 * c.xi))),
                               2) /
                      3;
        }
        const double ratio = std::sqrt(square) / waveError(split, box, grid, c.P, c.beta, phi);
        EXPECT_GT(ratio, 0.5) << "P " << c.P << " M " << c.M;
        EXPECT_LT(ratio, 1.3) << "P " << c.P << " M " << c.M;
    }
}

TEST(Estimates, WaveErrorAtTheWorstPlaceIsTheMeasuredError) {
    // A grid point or the middle of a cell; three at one place err like one.
    for (bool tilted : {false, true})
        for (int P : {4, 5}) {
            const double xi = 0.6, beta = 1.9 * P;
            const HasimotoSplit split(xi);
            const Window window(P, beta);
            const Lattice box = boxFor(3, 3 * 4 * M_PI / 3 / 1000, tilted);
            const std::array<int, 3> grid = {12, 14, 15};
            double worst = 0;
            for (double place : {0.0, 0.5})
                for (int axis = 0; axis < 3; axis++) {
                    Suspension s(box, 3, 1);
                    const Vec3 there((2 + place) / grid[0], (3 + place) / grid[1],
                                     (1 + place) / grid[2]);
                    s.x.assign(3, box.cartesian(there));
                    s.f.assign(3, Vec3::Unit(axis));
                    const Vectors error = difference(griddedWave(s, split, grid, window),
                                                     exactWave(s, split, 10 * xi));
                    worst = std::max(worst, rms(error) / 3); // of three forces
                }
            const double ratio = worst / waveError(split, box, grid, P, beta, 0, 1e9, 1);
            EXPECT_GT(ratio, 0.4) << P << " " << tilted;
            EXPECT_LT(ratio, 1.1) << P << " " << tilted;
            EXPECT_GT(worst, 1.2 * waveError(split, box, grid, P, beta, 0)) << P << " " << tilted;
        }
}

TEST(Estimates, MobilityAmongImagesIsHardlyMoreThanTheExactOne) {
    // in a cube the exact one; elsewhere at most 1.03 of the smallest of three
    const double xi = 0.6;
    const HasimotoSplit split(xi);
    for (const Vec3& edges : {Vec3(5, 5, 5), Vec3(12, 12, 12), Vec3(6, 6, 24), Vec3(6, 20, 20)}) {
        const Lattice box = Lattice::orthorhombic(edges[0], edges[1], edges[2]);
        Suspension s(box, 1, 1);
        s.x[0] = Vec3::Zero();
        double smallest = 2;
        for (int axis = 0; axis < 3; axis++) {
            s.f[0] = Vec3::Unit(axis);
            Vec3 u = exactWave(s, split, 12 * xi)[0] + split.realScalars(0).F * s.f[0];
            for (const Vec3& image : box.imagesWithin(8 / xi)) {
                const double r = image.norm();
                if (r == 0 || r > 8 / xi)
                    continue;
                const PairScalars M = split.realScalars(r);
                u += M.F * s.f[0] + (M.G - M.F) / (r * r) * image.dot(s.f[0]) * image;
            }
            smallest = std::min(smallest, u[axis]);
        }
        const double estimate = mobilityAmongImages(imageSpacing(box), 1, 1);
        EXPECT_LT(estimate, 1.03 * smallest) << edges.transpose();
        EXPECT_GT(estimate, 0.6 * smallest) << edges.transpose();
        if (edges[0] == edges[2]) {
            EXPECT_NEAR(estimate, smallest, 1e-4) << edges.transpose();
            const double gaussian = exactWave(s, AllWaves(), 11)[0][2];
            EXPECT_NEAR(mobilityAmongImages(edges[0], 1, 1, SphereModel::ForceCoupling), gaussian,
                        1e-4)
                << edges.transpose();
        }
    }
    EXPECT_GT(mobilityAmongImages(1, 1, 1), 0.09);
}

TEST(Estimates, WaveErrorOfOneParticleIsThatOfItsSelfMobility) {
    // phi = 0 leaves the ripple of the self mobility over a grid cell, its mean, and the
    // truncation.
    for (bool tilted : {false, true}) {
        const double xi = 0.6, beta = 7.6;
        const int P = 4;
        const HasimotoSplit split(xi);
        const Window window(P, beta);
        const Lattice box = boxFor(1, 4 * M_PI / 3 / 1000, tilted);
        const std::array<int, 3> grid = {12, 14, 15};
        double square = 0;
        const int trials = 60;
        for (unsigned seed = 1; seed <= trials; seed++) {
            const Suspension s(box, 1, seed);
            square += std::pow(rms(difference(griddedWave(s, split, grid, window),
                                              exactWave(s, split, 10 * xi))),
                               2) /
                      trials;
        }
        const double ratio = std::sqrt(square) / waveError(split, box, grid, P, beta, 0);
        EXPECT_GT(ratio, 0.5);
        EXPECT_LT(ratio, 1.3);
    }
}

TEST(Estimates, ErrorsOfAWholeProductAreBelowTheTolerance) {
    // Unit forces: the promise is an rms error below tolerance max(|M f|, 1).
    for (double tolerance : {1e-1, 1e-2, 1e-3, 1e-5})
        for (bool tilted : {false, true}) {
            const Suspension s(boxFor(80, 0.2, tilted), 80, 21);
            PlanRequest request = {s.box, 80, 1.0, tolerance, true, 1e-5, false, {}};
            request.split = SplitChoice::Hasimoto;
            request.overrides.xi = 0.6;
            const Plan plan = makePlan(request);
            const Window window(plan.windowSupport, plan.windowShape);
            Vectors error = difference(griddedWave(s, *plan.split, plan.grid, window),
                                       exactWave(s, *plan.split, 9 * plan.xi));
            const Vectors real =
                droppedPairs(s, *plan.split, plan.realCutoff, plan.realCutoff + 2 / plan.xi);
            EXPECT_LT(rms(difference(error, real)), tolerance);
            EXPECT_GT(rms(difference(error, real)), 0.02 * tolerance)
                << "far too accurate: time is wasted";
        }
}

TEST(Estimates, DroppedWavesOfTheProlateSplitAreTheMeasuredError) {
    // Everything but the waves beyond k0, against M f by the other split.
    for (double phi : {0.05, 0.3})
        for (bool tilted : {false, true}) {
            const Suspension s(boxFor(120, phi, tilted), 120, 13);
            const Vectors exact = exactProduct(s, 0.6);
            for (const auto& [c, R] : {std::pair{6.0, 3.5}, {9.0, 4.0}, {9.0, 6.0}, {14.0, 5.5}}) {
                const ProlateSplit split(c, R);
                ASSERT_TRUE(split.isPositive());
                const Vectors u =
                    sum(exactWave(s, split, split.firstZero()), realVelocities(s, split, R));
                const double ratio =
                    rms(difference(u, exact)) / split.waveTruncation(split.firstZero(), phi);
                EXPECT_GT(ratio, 0.7) << phi << " " << c << " " << R;
                EXPECT_LT(ratio, 1.4) << phi << " " << c << " " << R;
            }
        }
}

TEST(Estimates, WaveErrorOfTheProlateSplitIsTheMeasuredError) {
    struct Case {
        int P;
        double beta, c, R, finer;
        bool tilted;
    };
    // as Plans choose them, coarser and finer
    for (const Case& k : {Case{4, 7.6, 6.5, 4, 1.06, false},
                          {4, 7.6, 6.5, 4, 1.3, true},
                          {5, 9.9, 9, 4.5, 1.06, true},
                          {5, 9.9, 9, 4.5, 1.3, false},
                          {6, 12.2, 11.5, 5, 1, false},
                          {7, 14.5, 14, 5.5, 1.1, true},
                          {8, 16.8, 16.5, 6.5, 1.08, false}}) {
        const double phi = 0.04; // a box of many waves
        const ProlateSplit split(k.c, k.R);
        const Window window(k.P, k.beta);
        const Lattice box = boxFor(50, phi, k.tilted);
        std::array<int, 3> grid;
        for (int d = 0; d < 3; d++)
            grid[d] = static_cast<int>(k.finer * k.c / k.R * box.length(d) / M_PI) + 1;
        double square = 0;
        for (unsigned seed = 1; seed <= 3; seed++) {
            const Suspension s(box, 50, seed);
            const Vectors u =
                sum(griddedWave(s, split, grid, window), realVelocities(s, split, k.R));
            square += std::pow(rms(difference(u, exactProduct(s, 0.5))), 2) / 3;
        }
        const double ratio = std::sqrt(square) / waveError(split, box, grid, k.P, k.beta, phi);
        EXPECT_GT(ratio, 0.5) << "P " << k.P << " grid " << grid[0];
        EXPECT_LT(ratio, 1.3) << "P " << k.P << " grid " << grid[0];
    }
}

TEST(Estimates, ErrorsOfAWholeProductWithTheProlateSplitAreBelowTheTolerance) {
    std::set<double> tested;
    for (double phi : {0.04, 0.3})
        for (bool tilted : {false, true}) {
            const int n = 40;
            std::vector<Suspension> kinds(3, Suspension(boxFor(n, phi, tilted), n, 22));
            for (int i = 0; i < n; i++) { // random, uniform, balanced
                kinds[1].f[i] = Vec3(0.6, 0, 0.8);
                kinds[2].f[i] = Vec3(0, i % 2 == 0 ? 1 : -1, 0);
            }
            std::vector<Vectors> exact;
            for (const Suspension& s : kinds)
                exact.push_back(exactProduct(s, phi < 0.1 ? 0.5 : 0.8));
            for (double tolerance : {1e-1, 1e-2, 1e-3, 1e-4}) {
                const Plan plan =
                    makePlan({kinds[0].box, n, 1.0, tolerance, true, 1e-5, false, {}});
                if (plan.split->name() != "Prolate") {
                    EXPECT_LT(tolerance, 0.5e-2) << "every box here serves the looser ones";
                    continue;
                }
                tested.insert(tolerance);
                const Window window(plan.windowSupport, plan.windowShape);
                for (size_t kind = 0; kind < kinds.size(); kind++) {
                    const Suspension& s = kinds[kind];
                    const Vectors u = sum(griddedWave(s, *plan.split, plan.grid, window),
                                          realVelocities(s, *plan.split, plan.realCutoff));
                    const double error =
                        rms(difference(u, exact[kind])) / std::max(1.0, rms(exact[kind]));
                    EXPECT_LT(error, tolerance) << phi << " " << kind;
                    EXPECT_GT(error, 0.02 * tolerance) << "far too accurate: time is wasted";
                }
            }
        }
    EXPECT_GE(tested.size(), 3u);
}
