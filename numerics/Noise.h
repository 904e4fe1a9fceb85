// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_NOISE_H_
#define OPENMMPSE_NUMERICS_NOISE_H_

// Counter-based Gaussian noise [T17]: a pure function of (seed, stream, counter, index), so that
// every platform, any number of threads and any order of evaluation give the same numbers, and a
// restart needs the counter alone. The definitions are those of NoiseText.h.

#include "numerics/DeviceNoise.h"
#include <array>
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

/** The random words of a counter block: philox() of NoiseText.h. */
inline std::array<uint32_t, 4> philox(std::array<uint32_t, 4> block, std::array<uint32_t, 2> key) {
    inDouble::philox(block.data(), key[0], key[1]);
    return block;
}

using inDouble::isCanonicalMode;
using inDouble::modeIndex;

/** Two standard normal numbers from two random words (Box-Muller); |z| <= 6.8. */
template <class Real> inline void boxMuller(uint32_t first, uint32_t second, Real& z0, Real& z1) {
    using inDouble::boxMuller, inSingle::boxMuller;
    boxMuller(first, second, &z0, &z1);
}

/** Three standard normal numbers for a particle, by its index in the System. */
template <class Real> inline void particleNoise(const NoiseKey& key, uint32_t particle, Real z[3]) {
    using inDouble::particleNoise, inSingle::particleNoise;
    particleNoise(key.seed, uint32_t(key.stream), uint32_t(key.counter),
                  uint32_t(key.counter >> 32), particle, z);
}

/**
 * The same for n particles, in double precision: the random words of many come first, so that their
 * long chains of dependent operations overlap.
 * @param z  [n]
 */
template <class Index>
inline void particleNoise(const NoiseKey& key, const Index* particles, int n, double (*z)[3]) {
    constexpr int TOGETHER = 16;
    uint32_t words[TOGETHER][4];
    for (int from = 0; from < n; from += TOGETHER) {
        const int count = (n - from < TOGETHER ? n - from : TOGETHER);
        for (int i = 0; i < count; i++)
            inDouble::indexWords(key.seed, uint32_t(key.stream), uint32_t(key.counter),
                                 uint32_t(key.counter >> 32), uint32_t(particles[from + i]), 0,
                                 words[i]);
        for (int i = 0; i < count; i++)
            inDouble::particleNormals(words[i], z[from + i]);
    }
}

/**
 * Three complex normal numbers for a mode n, E[z z*] = 1 each (real and imaginary part of variance
 * 1/2), and z(-n) = z(n)* exactly.
 */
template <class Real>
inline void modeNoise(const NoiseKey& key, int n1, int n2, int n3, std::complex<Real> z[3]) {
    using inDouble::modeNoise, inSingle::modeNoise;
    Real re[3], im[3];
    modeNoise(key.seed, uint32_t(key.stream), uint32_t(key.counter), uint32_t(key.counter >> 32),
              n1, n2, n3, re, im);
    for (int c = 0; c < 3; c++)
        z[c] = {re[c], im[c]};
}

} // namespace PSE::numerics

#endif
