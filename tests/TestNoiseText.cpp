// SPDX-License-Identifier: MIT
// The noise of NoiseText.h, in both precisions, against long double: the functions of which it
// consists for words throughout their range, every number against its definition, moments.

#include "NoiseOracle.h"
#include <gtest/gtest.h>
#include <random>

// Once more, with an inverse root as bad as a device's may be.
namespace roughRoot {
using real = float;
using mm_ulong = uint64_t;
#define DEVICE inline
#define RSQRT(x) (1.00001f / std::sqrt(x))
#include "numerics/NoiseText.h"
#undef RSQRT
#undef DEVICE
} // namespace roughRoot

namespace inSingle = PSE::numerics::inSingle;
namespace inDouble = PSE::numerics::inDouble;
using noiseOracle::Errors;
using noiseOracle::Words;

namespace {

const double SIGMAS = 5.3; // 1e-7

/** Random pairs of words, one of every four with a first word near an end. */
std::vector<std::array<uint32_t, 2>> randomPairs(int count) {
    std::mt19937 random(31);
    std::vector<std::array<uint32_t, 2>> all;
    for (int i = 0; i < count; i++) {
        const uint32_t first = random(), second = random();
        const uint32_t end = (i % 8 == 0 ? first >> first % 32 : ~(first >> first % 32));
        all.push_back({i % 4 == 0 ? end : first, second});
    }
    return all;
}

} // namespace

TEST(NoiseText, GivesThePublishedKnownAnswersOfPhilox) {
    // Random123 1.14, tests/kat_vectors, lines "philox4x32 10".
    const uint32_t all = 0xffffffffu;
    const struct {
        Words block;
        uint32_t key[2];
        Words answer;
    } known[] = {
        {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u}},
        {{all, all, all, all}, {all, all}, {0x408f276du, 0x41c83b0eu, 0xa20bc7c6u, 0x6d5451fdu}},
        {{0x243f6a88u, 0x85a308d3u, 0x13198a2eu, 0x03707344u},
         {0xa4093822u, 0x299f31d0u},
         {0xd16cfe09u, 0x94fdccebu, 0x5001e420u, 0x24126ea1u}},
    };
    for (const auto& line : known) {
        Words single = line.block, twice = line.block;
        inSingle::philox(single.data(), line.key[0], line.key[1]);
        inDouble::philox(twice.data(), line.key[0], line.key[1]);
        EXPECT_EQ(single, line.answer);
        EXPECT_EQ(twice, line.answer);
    }
}

TEST(NoiseText, LogarithmIsExactForWordsOfEverySize) {
    Errors single, twice, radius;
    for (uint32_t word : noiseOracle::hardWords(257, 4096)) {
        const long double exact = noiseOracle::minusLogarithm(word);
        const float computed = inSingle::minusLogarithm(word);
        single.add(computed, exact, exact);
        radius.add(inSingle::positiveRoot(2 * computed), std::sqrt(2 * exact),
                   std::sqrt(2 * exact));
        twice.add(inDouble::minusLogarithm(word), exact, exact);
    }
    EXPECT_LT(single.largest, noiseOracle::LOGARITHM_ERROR<float>);
    EXPECT_LT(radius.largest, 1.55e-7);
    EXPECT_LT(radius.rms(), 4e-8);
    EXPECT_LT(twice.largest, noiseOracle::LOGARITHM_ERROR<double>);
    EXPECT_LT(twice.rms(), 6e-17);
}

TEST(NoiseText, CosineAndSineAreExactForWordsOfEverySize) {
    // Relative to their own size, however close the angle is to a zero.
    Errors single, twice;
    for (uint32_t word : noiseOracle::hardWords(509, 4096)) {
        const std::array<long double, 2> exact = noiseOracle::circle(word);
        float c, s;
        double cosine, sine;
        inSingle::cosineAndSine(word, &c, &s);
        inDouble::cosineAndSine(word, &cosine, &sine);
        single.add(c, exact[0], exact[0]);
        single.add(s, exact[1], exact[1]);
        twice.add(cosine, exact[0], exact[0]);
        twice.add(sine, exact[1], exact[1]);
    }
    EXPECT_LT(single.largest, noiseOracle::CIRCLE_ERROR<float>);
    EXPECT_LT(single.rms(), 4e-8);
    EXPECT_LT(twice.largest, noiseOracle::CIRCLE_ERROR<double>);
    EXPECT_LT(twice.rms(), 6e-17);
}

TEST(NoiseText, CosineAndSineOfQuarterTurnsAreWholeNumbers) {
    const int exact[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    for (uint32_t quarter = 0; quarter < 4; quarter++) {
        float c, s;
        double cosine, sine;
        inSingle::cosineAndSine(quarter << 30, &c, &s);
        inDouble::cosineAndSine(quarter << 30, &cosine, &sine);
        EXPECT_EQ(c, exact[quarter][0]);
        EXPECT_EQ(s, exact[quarter][1]);
        EXPECT_EQ(cosine, exact[quarter][0]);
        EXPECT_EQ(sine, exact[quarter][1]);
    }
}

TEST(NoiseText, NormalNumbersKeepTheStatedErrorForAnyInverseRoot) {
    Errors single, rough, twice;
    for (const auto& [first, second] : randomPairs(1000000)) {
        float x[2], y[2];
        double z[2];
        inSingle::boxMuller(first, second, &x[0], &x[1]);
        roughRoot::boxMuller(first, second, &y[0], &y[1]);
        inDouble::boxMuller(first, second, &z[0], &z[1]);
        const auto exact = noiseOracle::normalPair(first, second, 1);
        for (int c = 0; c < 2; c++) {
            single.add(x[c], exact[c], exact[c]);
            rough.add(y[c], exact[c], exact[c]);
            twice.add(z[c], exact[c], exact[c]);
        }
    }
    EXPECT_LT(single.largest, noiseOracle::NUMBER_ERROR<float>);
    EXPECT_LT(rough.largest, noiseOracle::NUMBER_ERROR<float>);
    EXPECT_LT(single.rms(), 6e-8);
    EXPECT_LT(twice.largest, noiseOracle::NUMBER_ERROR<double>);
    EXPECT_LT(twice.rms(), 9e-17);
}

TEST(NoiseText, ExtremeWordsGiveTheSmallestAndTheLargestRadius) {
    float x, y;
    inSingle::boxMuller(0, 0, &x, &y);
    EXPECT_FLOAT_EQ(x, float(std::sqrt(66 * std::log(2.0))));
    EXPECT_EQ(y, 0);
    // -2 ln(1 - 2^-33) = 2^-32: where (w + 1/2)/2^32 is rounded to 1, this number would be zero.
    inSingle::boxMuller(0xffffffffu, 0x40000000u, &x, &y);
    EXPECT_EQ(x, 0);
    EXPECT_FLOAT_EQ(y, 1.0f / 65536);
    inSingle::boxMuller(0xffffffffu, 0x80000000u, &x, &y);
    EXPECT_FLOAT_EQ(x, -1.0f / 65536);
    double u, v;
    inDouble::boxMuller(0, 0, &u, &v);
    EXPECT_DOUBLE_EQ(u, std::sqrt(66 * std::log(2.0)));
    EXPECT_EQ(v, 0);
    inDouble::boxMuller(0xffffffffu, 0xc0000000u, &u, &v);
    EXPECT_EQ(u, 0);
    EXPECT_DOUBLE_EQ(v, -std::sqrt(-2 * std::log1p(-0.5 / 4294967296.0)));
    // Next to a half, where the exponent changes with the word.
    for (uint32_t word : {0x7fffffffu, 0x80000000u})
        EXPECT_DOUBLE_EQ(inDouble::minusLogarithm(word), double(noiseOracle::minusLogarithm(word)));
}

TEST(NoiseText, ParticlesDrawTheNumbersOfTheDefinition) {
    const uint64_t counter = 0xABCDE1234567890u; // more than the 48 bits that count
    for (uint32_t particle : {0u, 1u, 77u, 0x80000000u, 0xffffffffu})
        for (uint32_t seed : {0u, 42u, 0xfedcba98u})
            for (uint32_t stream : {0u, 2u}) {
                float single[3];
                double twice[3];
                const uint32_t low = uint32_t(counter), high = uint32_t(counter >> 32);
                inSingle::particleNoise(seed, stream, low, high, particle, single);
                inDouble::particleNoise(seed, stream, low, high, particle, twice);
                const auto exact = noiseOracle::particleNoise(seed, stream, counter, particle);
                for (int c = 0; c < 3; c++) {
                    EXPECT_NEAR(single[c] / exact[c], 1, noiseOracle::NUMBER_ERROR<float>);
                    EXPECT_NEAR(twice[c] / exact[c], 1, noiseOracle::NUMBER_ERROR<double>);
                }
            }
}

TEST(NoiseText, ModesDrawTheNumbersOfTheDefinition) {
    // All signs and zeros, and the largest components.
    const int values[] = {-1048575, -257, -1, 0, 1, 2, 300, 1048575};
    const uint64_t counter = 0x123456789ABCu;
    const uint32_t low = uint32_t(counter), high = uint32_t(counter >> 32);
    for (int n1 : values)
        for (int n2 : values)
            for (int n3 : values) {
                if (n1 == 0 && n2 == 0 && n3 == 0)
                    continue;
                float single[6], opposite[6];
                double twice[6];
                inSingle::modeNoise(9, 1, low, high, n1, n2, n3, single, single + 3);
                inSingle::modeNoise(9, 1, low, high, -n1, -n2, -n3, opposite, opposite + 3);
                inDouble::modeNoise(9, 1, low, high, n1, n2, n3, twice, twice + 3);
                const auto exact = noiseOracle::modeNoise(9, 1, counter, n1, n2, n3);
                for (int c = 0; c < 6; c++) {
                    ASSERT_NEAR(single[c] / exact[c], 1, noiseOracle::NUMBER_ERROR<float>);
                    ASSERT_NEAR(twice[c] / exact[c], 1, noiseOracle::NUMBER_ERROR<double>);
                    ASSERT_EQ(opposite[c], c < 3 ? single[c] : -single[c]);
                }
            }
}

TEST(NoiseText, MomentsInSinglePrecisionAreThoseOfANormalNumber) {
    const int count = 100000;
    std::vector<double> z;
    for (int i = 0; i < count; i++) {
        float own[6];
        inSingle::particleNoise(5, 0, 7, 0, i, own);
        z.insert(z.end(), own, own + 3);
        inSingle::modeNoise(5, 1, 7, 0, i, -3, 1, own, own + 3); // of variance 1/2
        for (float number : own)
            z.push_back(std::sqrt(2.0) * number);
    }
    const double n = double(z.size()), exact[] = {0, 1, 0, 3, 0, 15};
    const double variance[] = {1, 2, 15, 96, 945, 10170}; // E z^2m - (E z^m)^2
    for (int m = 1; m <= 6; m++) {
        double sum = 0;
        for (double value : z)
            sum += std::pow(value, m);
        EXPECT_LT(std::fabs(sum / n - exact[m - 1]), SIGMAS * std::sqrt(variance[m - 1] / n)) << m;
    }
    for (int lag = 1; lag <= 9; lag++) {
        double linear = 0, square = 0;
        for (size_t i = 0; i + lag < z.size(); i++) {
            linear += z[i] * z[i + lag];
            square += (z[i] * z[i] - 1) * (z[i + lag] * z[i + lag] - 1);
        }
        EXPECT_LT(std::fabs(linear), SIGMAS * std::sqrt(n)) << lag;
        EXPECT_LT(std::fabs(square), SIGMAS * 2 * std::sqrt(n)) << lag;
    }
}
