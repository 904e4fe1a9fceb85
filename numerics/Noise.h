// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_NOISE_H_
#define OPENMMPSE_NUMERICS_NOISE_H_

// Counter-based Gaussian noise [T17]: a pure function of (seed, stream, counter, index), so that
// every platform, any number of threads and any order of evaluation give the same numbers, and a
// restart needs the counter alone.

#include <array>
#include <cmath>
#include <complex>
#include <cstdint>

namespace PSE::numerics {

/** Uses of noise that must never share numbers. */
enum class Stream : uint32_t { StepReal = 0, StepWave = 1, SampleReal = 2, SampleWave = 3 };

/** Selects one vector of noise. */
struct NoiseKey {
    uint32_t seed;
    Stream stream;
    uint64_t counter; ///< step or sample number, below 2^32 times 2^16
};

/**
 * Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC11): ten rounds of a bijection of 128 bits, keyed
 * by 64.
 */
inline std::array<uint32_t, 4> philox(std::array<uint32_t, 4> c, std::array<uint32_t, 2> key) {
    for (int round = 0; round < 10; round++) {
        const uint64_t p0 = uint64_t(0xD2511F53u) * c[0], p1 = uint64_t(0xCD9E8D57u) * c[2];
        c = {uint32_t(p1 >> 32) ^ c[1] ^ key[0], uint32_t(p1), uint32_t(p0 >> 32) ^ c[3] ^ key[1],
             uint32_t(p0)};
        key[0] += 0x9E3779B9u;
        key[1] += 0xBB67AE85u;
    }
    return c;
}

/** Two standard normal numbers from two random words (Box-Muller); |z| <= 6.8. */
template <class Real> inline void boxMuller(uint32_t first, uint32_t second, Real& z0, Real& z1) {
    const Real unit = Real(1.0 / 4294967296.0);
    // (w + 1/2)/2^32 lies in (0, 1]; for the logarithm only, so that rounding to 1 does no harm.
    const Real radius = std::sqrt(-2 * std::log((Real(first) + Real(0.5)) * unit));
    // A signed angle in [-pi, pi) keeps full precision in single arithmetic.
    const Real angle = Real(int32_t(second)) * Real(M_PI / 2147483648.0);
    z0 = radius * std::cos(angle);
    z1 = radius * std::sin(angle);
}

/** Eight normal numbers for an index of 64 bits. */
template <class Real> inline void normals(const NoiseKey& key, uint64_t index, Real z[8]) {
    for (uint32_t part = 0; part < 2; part++) {
        // The index takes 64 bits of the counter block, the step 48 and the part 16; the stream is
        // half of the key.
        const std::array<uint32_t, 4> words =
            philox({uint32_t(index), uint32_t(index >> 32), uint32_t(key.counter),
                    (uint32_t(key.counter >> 32) & 0xFFFFu) | (part << 16)},
                   {key.seed, uint32_t(key.stream)});
        boxMuller(words[0], words[1], z[4 * part], z[4 * part + 1]);
        boxMuller(words[2], words[3], z[4 * part + 2], z[4 * part + 3]);
    }
}

/** Three standard normal numbers for a particle, by its index in the System. */
template <class Real> inline void particleNoise(const NoiseKey& key, uint32_t particle, Real z[3]) {
    const std::array<uint32_t, 4> words =
        philox({particle, 0, uint32_t(key.counter), uint32_t(key.counter >> 32) & 0xFFFFu},
               {key.seed, uint32_t(key.stream)});
    Real unused;
    boxMuller(words[0], words[1], z[0], z[1]);
    boxMuller(words[2], words[3], z[2], unused);
}

/** Of n and -n, the one from which both draw: the first non-zero of (n3, n1, n2) is positive. */
inline bool isCanonicalMode(int n1, int n2, int n3) {
    return n3 > 0 || (n3 == 0 && (n1 > 0 || (n1 == 0 && n2 > 0)));
}

/**
 * The 64-bit index of a mode, the same for n and -n: 21 bits of two's complement for each canonical
 * component.
 */
inline uint64_t modeIndex(int n1, int n2, int n3) {
    const int sign = isCanonicalMode(n1, n2, n3) ? 1 : -1;
    const auto packed = [sign](int n) { return uint64_t(sign * n) & 0x1FFFFFu; };
    return packed(n1) | packed(n2) << 21 | packed(n3) << 42;
}

/**
 * Three complex normal numbers for a mode n, E[z z*] = 1 each (real and imaginary part of variance
 * 1/2), and z(-n) = z(n)* exactly.
 */
template <class Real>
inline void modeNoise(const NoiseKey& key, int n1, int n2, int n3, std::complex<Real> z[3]) {
    const Real half = Real(M_SQRT1_2), sign = Real(isCanonicalMode(n1, n2, n3) ? 1 : -1);
    Real g[8];
    normals(key, modeIndex(n1, n2, n3), g);
    for (int c = 0; c < 3; c++)
        z[c] = std::complex<Real>(half * g[2 * c], sign * half * g[2 * c + 1]);
}

} // namespace PSE::numerics

#endif
