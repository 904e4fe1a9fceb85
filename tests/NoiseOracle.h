// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_TESTS_NOISEORACLE_H_
#define OPENMMPSE_TESTS_NOISEORACLE_H_

// The noise of [T17] in long double, from the words, and words that are hard for the precisions
// that NoiseText.h has.

#include "numerics/DeviceNoise.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace noiseOracle {

using Words = std::array<uint32_t, 4>;

/** What NoiseText.h states, relative, for Real. */
template <class Real> const double LOGARITHM_ERROR = 1.6e-16;
template <class Real> const double CIRCLE_ERROR = 2e-16;
template <class Real> const double NUMBER_ERROR = 5e-16;
template <> inline const double LOGARITHM_ERROR<float> = 1.61e-7;
template <> inline const double CIRCLE_ERROR<float> = 1.41e-7;
template <> inline const double NUMBER_ERROR<float> = 3.6e-7;

const long double PI = std::acos(-1.0L), TWO_32 = 4294967296.0L;

/** Largest and root mean square of errors. */
struct Errors {
    double largest = 0, squares = 0;
    size_t count = 0;

    void add(long double computed, long double exact, long double scale) {
        const double error = computed == exact ? 0 : double(std::fabs((computed - exact) / scale));
        largest = std::max(largest, error);
        squares += error * error;
        count++;
    }
    double rms() const { return std::sqrt(squares / count); }
};

inline long double minusLogarithm(uint32_t word) {
    const long double below = word + 0.5L, above = TWO_32 - below; // both exact
    return below < above ? -std::log(below / TWO_32) : -std::log1p(-above / TWO_32);
}

/** Cosine and sine; relative error 3e-19, none at whole quarter turns. */
inline std::array<long double, 2> circle(uint32_t word) {
    const int64_t quarters = (int64_t(word) + 0x20000000) >> 30;
    const long double rest = (word - (quarters << 30)) * (PI / 2147483648.0L);
    const long double c = std::cos(rest), s = std::sin(rest);
    const std::array<long double, 2> turned[] = {{c, s}, {-s, c}, {-c, -s}, {s, -c}};
    return turned[quarters % 4];
}

inline std::array<long double, 2> normalPair(uint32_t first, uint32_t second,
                                             long double variance) {
    const long double radius = std::sqrt(2 * variance * minusLogarithm(first));
    const auto [cosine, sine] = circle(second);
    return {radius * cosine, radius * sine};
}

/** Words of a counter block, as [T17] has it. */
inline Words words(uint32_t seed, uint32_t stream, uint64_t counter, uint64_t index,
                   uint32_t part) {
    Words block = {uint32_t(index), uint32_t(index >> 32), uint32_t(counter),
                   uint32_t((counter >> 32) % 65536 + 65536 * uint64_t(part))};
    PSE::numerics::inDouble::philox(block.data(), seed, stream);
    return block;
}

/** Three numbers of a particle. */
inline std::array<long double, 3> particleNoise(uint32_t seed, uint32_t stream, uint64_t counter,
                                                uint32_t particle) {
    const Words w = words(seed, stream, counter, particle, 0);
    const auto a = normalPair(w[0], w[1], 1), b = normalPair(w[2], w[3], 1);
    return {a[0], a[1], b[0]};
}

/** Real parts and imaginary parts of a mode: re1 re2 re3 im1 im2 im3. */
inline std::array<long double, 6> modeNoise(uint32_t seed, uint32_t stream, uint64_t counter,
                                            int n1, int n2, int n3) {
    const std::array<int, 3> order = {n3, n1, n2};
    const int sign = (order > std::array<int, 3>{} ? 1 : -1);
    uint64_t index = 0;
    for (int n : {n3, n2, n1}) // 21 bits each, n1 lowest
        index = index * 2097152 + uint64_t((sign * int64_t(n) + 2097152) % 2097152);
    const Words w0 = words(seed, stream, counter, index, 0),
                w1 = words(seed, stream, counter, index, 1);
    const auto a = normalPair(w0[0], w0[1], 0.5L), b = normalPair(w0[2], w0[3], 0.5L),
               c = normalPair(w1[0], w1[1], 0.5L);
    return {a[0], b[0], c[0], sign * a[1], sign * b[1], sign * c[1]};
}

/**
 * Every stride-th word, all within 2^16 of both ends, all within `reach` of where something changes
 * (powers of two and two thirds of them, the logarithm's intervals; eighths of a turn), and the
 * words that are worst for the two precisions without fused operations.
 */
inline std::vector<uint32_t> hardWords(uint64_t stride, int64_t reach) {
    std::vector<uint32_t> all = {3217089472u, 4261412434u, 715381552u, 358360272u,
                                 3267420501u, 589269380u,  484472444u};
    for (uint64_t word = 0; word < uint64_t(1) << 32; word += stride)
        all.push_back(uint32_t(word));
    for (int64_t word = -65536; word < 65536; word++)
        all.push_back(uint32_t(word));
    std::vector<int64_t> places;
    for (int bit = 0; bit < 32; bit++) {
        places.push_back(int64_t(1) << bit);
        places.push_back((int64_t(2) << bit) / 3);
        places.push_back(-(int64_t(1) << bit)); // from the upper end
    }
    for (uint32_t eighth = 1; eighth < 8; eighth++)
        places.push_back(int64_t(eighth) << 29);
    for (int64_t place : places)
        for (int64_t shift = -reach; shift < reach; shift++)
            all.push_back(uint32_t(place + shift));
    return all;
}

} // namespace noiseOracle

#endif
