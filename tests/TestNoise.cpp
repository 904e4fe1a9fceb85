// SPDX-License-Identifier: MIT
// Counter-based noise: published answers, independence of streams, moments, and the rule for
// conjugate modes. Seeds are fixed. Statistical limits are 5.3 standard deviations, 1e-7 each, 1e-6
// or less for a test case.

#include "numerics/Noise.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <gtest/gtest.h>
#include <set>
#include <utility>
#include <vector>

using namespace PSE::numerics;

namespace {

using Words = std::array<uint32_t, 4>;
using Complex = std::complex<double>;
using Sample = std::vector<double>;

const double SIGMAS = 5.3;
const Stream STREAMS[] = {Stream::StepReal, Stream::StepWave, Stream::SampleReal,
                          Stream::SampleWave};

/** Normal numbers of `count` particles, three each. */
Sample particles(const NoiseKey& key, int count) {
    Sample all(3 * count);
    for (int i = 0; i < count; i++)
        particleNoise(key, i, &all[3 * i]);
    return all;
}

/** Mean of the product of two samples; for independent normal numbers its standard deviation is
 * 1/sqrt(n). */
double correlation(const Sample& a, const Sample& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); i++)
        sum += a[i] * b[i];
    return sum / a.size();
}

void expectUncorrelated(const Sample& a, const Sample& b) {
    EXPECT_LT(std::fabs(correlation(a, b)), SIGMAS / std::sqrt(double(a.size())));
    for (size_t i = 0; i < a.size(); i++)
        ASSERT_NE(a[i], b[i]);
}

} // namespace

// More than are computed together, and a rest.
TEST(ParticleNoise, OfManyIsToTheBitThatOfEach) {
    const NoiseKey key = {12345, Stream::StepReal, (uint64_t(3) << 32) + 7};
    for (int n : {1, 16, 40}) {
        std::vector<int> indices;
        for (int i = 0; i < n; i++)
            indices.push_back(3 * (n - i) + (i % 5 == 0 ? 1 << 30 : 0));
        std::vector<std::array<double, 3>> many(n);
        particleNoise(key, indices.data(), n, reinterpret_cast<double(*)[3]>(many.data()));
        for (int i = 0; i < n; i++) {
            std::array<double, 3> one;
            particleNoise(key, uint32_t(indices[i]), one.data());
            EXPECT_EQ(many[i], one) << n << " " << i;
        }
    }
}

TEST(Philox, GivesThePublishedKnownAnswers) {
    // Random123 1.14, tests/kat_vectors, lines "philox4x32 10".
    const uint32_t all = 0xffffffffu;
    EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}),
              (Words{0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u}));
    EXPECT_EQ(philox({all, all, all, all}, {all, all}),
              (Words{0x408f276du, 0x41c83b0eu, 0xa20bc7c6u, 0x6d5451fdu}));
    EXPECT_EQ(
        philox({0x243f6a88u, 0x85a308d3u, 0x13198a2eu, 0x03707344u}, {0xa4093822u, 0x299f31d0u}),
        (Words{0xd16cfe09u, 0x94fdccebu, 0x5001e420u, 0x24126ea1u}));
}

TEST(Noise, IsAPureFunctionOfItsArguments) {
    const NoiseKey key = {42, Stream::StepReal, 17};
    double a[3], b[3];
    particleNoise(key, 5, a);
    particleNoise({43, Stream::StepReal, 17}, 5, b);
    particleNoise(key, 5, b);
    for (int c = 0; c < 3; c++)
        EXPECT_EQ(a[c], b[c]);
}

TEST(Noise, EveryPartOfTheKeyCounts) {
    // Two changes of one part of the key each must give other numbers throughout, not only
    // uncorrelated ones.
    const NoiseKey base = {42, Stream::StepReal, 1000};
    const Sample reference = particles(base, 20000);
    for (uint32_t seed : {43u, 0x8000002au})
        expectUncorrelated(reference, particles({seed, base.stream, base.counter}, 20000));
    for (uint64_t counter : {uint64_t(1001), uint64_t(1000) + (uint64_t(1) << 32),
                             uint64_t(1000) + (uint64_t(1) << 47)})
        expectUncorrelated(reference, particles({base.seed, base.stream, counter}, 20000));
    for (Stream stream : {Stream::StepWave, Stream::SampleReal, Stream::SampleWave})
        expectUncorrelated(reference, particles({base.seed, stream, base.counter}, 20000));
}

TEST(Noise, StreamsShareNoNumbers) {
    // All uses, with indices that other uses have as well: every block of words is drawn once.
    std::set<Words> seen;
    int drawn = 0;
    for (Stream stream : STREAMS)
        for (uint32_t counter = 0; counter < 20; counter++)
            for (uint32_t index = 0; index < 500; index++, drawn++)
                seen.insert(philox({index, 0, counter, 0}, {7, uint32_t(stream)}));
    EXPECT_EQ(int(seen.size()), drawn);
    std::set<double> values;
    for (Stream stream : STREAMS)
        for (int index = 1; index <= 2000; index++) {
            double z[3];
            Complex modes[3];
            particleNoise({7, stream, 3}, index, z);
            modeNoise({7, stream, 3}, index, 0, 0, modes);
            values.insert({z[0], z[2]}); // the first words are those of the mode
            for (const Complex& mode : modes)
                values.insert({mode.real(), mode.imag()});
        }
    EXPECT_EQ(values.size(), 4u * 2000u * 8u);
}

TEST(Noise, UsesAllBitsOfTheIndexAndTheCounter) {
    const uint64_t index = 12345, counter = 678;
    const auto blocks = [](uint64_t i, uint64_t c) {
        std::array<Words, 2> words;
        for (uint32_t part = 0; part < 2; part++)
            inDouble::indexWords(1, 0, uint32_t(c), uint32_t(c >> 32), i, part, words[part].data());
        return words;
    };
    const auto expectOther = [&](const std::array<Words, 2>& other, int bit) {
        const std::array<Words, 2> own = blocks(index, counter);
        for (int part = 0; part < 2; part++)
            for (int i = 0; i < 4; i++) {
                EXPECT_NE(own[part][i], other[part][i]) << bit;
                EXPECT_NE(own[part][i], other[1 - part][i]) << bit;
            }
    };
    for (int bit = 0; bit < 64; bit++)
        expectOther(blocks(index ^ (uint64_t(1) << bit), counter), bit);
    for (int bit = 0; bit < 48; bit++)
        expectOther(blocks(index, counter ^ (uint64_t(1) << bit)), bit);
    EXPECT_EQ(blocks(index, counter), blocks(index, counter + (uint64_t(1) << 48)));
}

TEST(Noise, MomentsAreThoseOfANormalNumber) {
    const int count = 200000;
    const Sample z = particles({2024, Stream::StepReal, 9}, count);
    const double n = z.size(), exact[] = {0, 1, 0, 3, 0, 15, 0, 105};
    // Variance of z^m is E z^2m - (E z^m)^2: 1, 2, 15, 96, 945, 10170.
    const double variance[] = {1, 2, 15, 96, 945, 10170};
    for (int m = 1; m <= 6; m++) {
        double sum = 0;
        for (double value : z)
            sum += std::pow(value, m);
        EXPECT_LT(std::fabs(sum / n - exact[m - 1]), SIGMAS * std::sqrt(variance[m - 1] / n))
            << "moment " << m;
    }
}

TEST(Noise, DistributionPassesTheKolmogorovSmirnovTest) {
    Sample z = particles({5, Stream::SampleReal, 77}, 100000);
    std::sort(z.begin(), z.end());
    double worst = 0;
    for (size_t i = 0; i < z.size(); i++) {
        const double cdf = 0.5 * std::erfc(-z[i] / std::sqrt(2.0));
        worst = std::max(worst, std::max(std::fabs(cdf - double(i) / z.size()),
                                         std::fabs(cdf - double(i + 1) / z.size())));
    }
    EXPECT_LT(worst * std::sqrt(double(z.size())), 2.70); // 2 exp(-2 x^2) = 1e-6 at x = 2.69
}

TEST(Noise, ComponentsAndNeighboursAreIndependent) {
    const int count = 100000;
    const Sample z = particles({99, Stream::StepReal, 3}, count + 1);
    for (int lag : {1, 2, 3}) {
        double linear = 0, square = 0;
        const int n = 3 * count;
        for (int i = 0; i < n; i++) {
            linear += z[i] * z[i + lag];
            square += (z[i] * z[i] - 1) *
                      (z[i + lag] * z[i + lag] - 1); // catches radii shared by two numbers
        }
        EXPECT_LT(std::fabs(linear / n), SIGMAS / std::sqrt(double(n)));
        EXPECT_LT(std::fabs(square / n), SIGMAS * 2 / std::sqrt(double(n)));
    }
}

TEST(Noise, BoxMullerStaysFiniteAtTheExtremes) {
    for (uint32_t first : {0u, 1u, 0x7fffffffu, 0x80000000u, 0xfffffffeu, 0xffffffffu})
        for (uint32_t second : {0u, 1u, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
            double z0, z1;
            float y0, y1;
            boxMuller(first, second, z0, z1);
            boxMuller(first, second, y0, y1);
            EXPECT_LE(std::hypot(z0, z1), 6.8);
            EXPECT_LE(std::hypot(y0, y1), 6.8f);
            EXPECT_TRUE(std::isfinite(z0) && std::isfinite(z1) && std::isfinite(y0) &&
                        std::isfinite(y1));
        }
    double z0, z1;
    boxMuller(0u, 0u, z0, z1); // the largest radius, along the first axis
    EXPECT_NEAR(z0, std::sqrt(66 * std::log(2.0)), 1e-12);
    EXPECT_EQ(z1, 0);
    boxMuller(0u, 0x40000000u, z0, z1); // a quarter turn
    EXPECT_NEAR(z1, std::sqrt(66 * std::log(2.0)), 1e-12);
}

TEST(Noise, SinglePrecisionGivesTheSameNumbers) {
    // to the error that NoiseText.h states
    double largest = 0, square = 0;
    const int count = 100000;
    for (int i = 0; i < count; i++) {
        double z[3];
        float y[3];
        particleNoise({3, Stream::StepReal, 0}, i, z);
        particleNoise({3, Stream::StepReal, 0}, i, y);
        for (int c = 0; c < 3; c++) {
            const double error = (z[c] - y[c]) / z[c];
            largest = std::max(largest, std::fabs(error));
            square += error * error / (3 * count);
        }
    }
    EXPECT_LT(largest, 3.6e-7);
    EXPECT_LT(std::sqrt(square), 7e-8);
}

TEST(Modes, ExactlyOneOfAPairIsCanonical) {
    for (int i = -3; i <= 3; i++)
        for (int j = -3; j <= 3; j++)
            for (int l = -3; l <= 3; l++) {
                const int canonical = isCanonicalMode(i, j, l) + isCanonicalMode(-i, -j, -l);
                EXPECT_EQ(canonical, (i == 0 && j == 0 && l == 0) ? 0 : 1);
                // the stored half of a real transform holds canonical modes beyond its
                if (l > 0) {
                    // plane n3 = 0
                    EXPECT_TRUE(isCanonicalMode(i, j, l));
                }
            }
}

TEST(Modes, OppositeModesAreConjugate) {
    const NoiseKey key = {8, Stream::StepWave, 5};
    for (int i = -4; i <= 4; i++)
        for (int j = -4; j <= 4; j++)
            for (int l = -4; l <= 4; l++) {
                if (i == 0 && j == 0 && l == 0)
                    continue;
                Complex z[3], opposite[3];
                std::complex<float> y[3];
                modeNoise(key, i, j, l, z);
                modeNoise(key, -i, -j, -l, opposite);
                modeNoise(key, i, j, l, y);
                for (int c = 0; c < 3; c++) {
                    ASSERT_EQ(z[c], std::conj(opposite[c]));
                    ASSERT_LT(std::abs(z[c] - Complex(y[c])), 3.6e-7 * std::abs(z[c]));
                }
            }
}

TEST(Modes, DifferentPairsDrawDifferentNumbers) {
    // Small and the largest indices, which fill 21 bits each.
    std::set<std::pair<double, double>> seen;
    int pairs = 0;
    const int values[] = {-1048575, -16384, -2, -1, 0, 1, 2, 16384, 1048575};
    for (int i : values)
        for (int j : values)
            for (int l : values)
                if (isCanonicalMode(i, j, l)) {
                    Complex z[3];
                    modeNoise({8, Stream::StepWave, 5}, i, j, l, z);
                    seen.insert({z[0].real(), z[0].imag()});
                    pairs++;
                }
    EXPECT_EQ(pairs, (9 * 9 * 9 - 1) / 2);
    EXPECT_EQ(int(seen.size()), pairs);
}

TEST(Modes, CovarianceIsTheUnitMatrix) {
    // E[z_c z_d*] = delta, E[z_c z_d] = 0: real and imaginary parts independent, of variance 1/2.
    Complex hermitian[3][3] = {}, plain[3][3] = {}, neighbour = 0;
    double real = 0;
    int count = 0;
    Complex previous = 0;
    for (int i = -20; i <= 20; i++)
        for (int j = -20; j <= 20; j++)
            for (int l = 1; l <= 60; l++, count++) {
                Complex z[3];
                modeNoise({77, Stream::SampleWave, 1}, i, j, l, z);
                for (int c = 0; c < 3; c++)
                    for (int d = 0; d < 3; d++) {
                        hermitian[c][d] += z[c] * std::conj(z[d]);
                        plain[c][d] += z[c] * z[d];
                    }
                real += 2 * z[0].real() * z[0].real();
                neighbour += z[0] * std::conj(previous);
                previous = z[0];
            }
    const double limit = SIGMAS / std::sqrt(double(count));
    for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++) {
            EXPECT_LT(std::abs(hermitian[c][d] / double(count) - (c == d ? 1.0 : 0.0)), limit);
            EXPECT_LT(std::abs(plain[c][d] / double(count)), std::sqrt(2.0) * limit);
        }
    EXPECT_LT(std::fabs(real / count - 1), std::sqrt(2.0) * limit);
    EXPECT_LT(std::abs(neighbour / double(count)), limit);
}

TEST(Modes, FieldOfStoredHalfSpectrumIsRealWithTheRightVariance) {
    // sum_k z_k exp(i k x) over all non-Nyquist modes of a grid, each from its own call, is real:
    // the rule closes.
    for (int M : {5, 6}) {
        const int m = (M - 1) / 2;
        double mean = 0;
        const int counters = 2000;
        int modes = 0;
        for (int counter = 0; counter < counters; counter++) {
            Complex field = 0;
            modes = 0;
            for (int i = -m; i <= m; i++)
                for (int j = -m; j <= m; j++)
                    for (int l = -m; l <= m; l++) {
                        if (i == 0 && j == 0 && l == 0)
                            continue;
                        Complex z[3];
                        modeNoise({1, Stream::StepWave, uint64_t(counter)}, i, j, l, z);
                        field +=
                            z[1] * std::polar(1.0, 2 * M_PI * (0.31 * i + 0.62 * j - 0.17 * l));
                        modes++;
                    }
            ASSERT_LT(std::fabs(field.imag()), 1e-12);
            mean += field.real() * field.real() / counters;
        }
        EXPECT_LT(std::fabs(mean / modes - 1), SIGMAS * std::sqrt(2.0 / counters))
            << M; // variance: one per mode
    }
}
