// SPDX-License-Identifier: MIT
#include "WaveKernels.h"
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "WaveKernels.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>
#include "LaneNumbers-inl.h"

HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int LANES = WAVE_LANES;

/** The last word of the counter block: see indexWords() of NoiseText.h. */
HWY_INLINE uint32_t lastWord(const numerics::NoiseKey& key, uint32_t part) {
    return (uint32_t(key.counter >> 32) & 0xFFFFu) | (part << 16);
}

/** The first two words of the counter block for LANES indices of 64 bits. */
struct NoiseIndices {
    uint32_t low[LANES], high[LANES];
};

#if HWY_TARGET == HWY_SCALAR
/** philox() of Noise.h for LANES indices: four rows of words. */
HWY_INLINE void philoxRow(const numerics::NoiseKey& key, uint32_t part, const NoiseIndices& index,
                          uint32_t words[4][LANES]) {
    for (int i = 0; i < LANES; i++) {
        const std::array<uint32_t, 4> own = numerics::philox(
            {index.low[i], index.high[i], uint32_t(key.counter), lastWord(key, part)},
            {key.seed, uint32_t(key.stream)});
        for (int word = 0; word < 4; word++)
            words[word][i] = own[word];
    }
}
#else
/**
 * philox() of Noise.h for LANES indices: four rows of words. Each index has a lane of 64 bits, of
 * which multiplications read the lower half; what is in the upper half does not matter.
 */
HWY_INLINE void philoxRow(const numerics::NoiseKey& key, uint32_t part, const NoiseIndices& index,
                          uint32_t words[4][LANES]) {
    const hn::CappedTag<uint64_t, LANES> d;
    const hn::Repartition<uint32_t, decltype(d)> halves;
    const hn::Rebind<uint32_t, decltype(d)> narrow;
    const auto product = [&](auto a, uint32_t b) {
        return hn::MulEven(hn::BitCast(halves, a), hn::Set(halves, b));
    };
    for (size_t i = 0; i < LANES; i += hn::Lanes(d)) {
        auto c0 = hn::PromoteTo(d, hn::LoadU(narrow, index.low + i)),
             c1 = hn::PromoteTo(d, hn::LoadU(narrow, index.high + i)),
             c2 = hn::Set(d, uint64_t(uint32_t(key.counter))),
             c3 = hn::Set(d, uint64_t(lastWord(key, part)));
        uint32_t k0 = key.seed, k1 = uint32_t(key.stream);
        for (int round = 0; round < 10; round++) {
            const auto p0 = product(c0, 0xD2511F53u), p1 = product(c2, 0xCD9E8D57u);
            c0 = hn::Xor(hn::Xor(hn::ShiftRight<32>(p1), c1), hn::Set(d, uint64_t(k0)));
            c2 = hn::Xor(hn::Xor(hn::ShiftRight<32>(p0), c3), hn::Set(d, uint64_t(k1)));
            c1 = p1;
            c3 = p0;
            k0 += 0x9E3779B9u;
            k1 += 0xBB67AE85u;
        }
        hn::StoreU(hn::TruncateTo(narrow, c0), narrow, words[0] + i);
        hn::StoreU(hn::TruncateTo(narrow, c1), narrow, words[1] + i);
        hn::StoreU(hn::TruncateTo(narrow, c2), narrow, words[2] + i);
        hn::StoreU(hn::TruncateTo(narrow, c3), narrow, words[3] + i);
    }
}
#endif

/** boxMuller() of Noise.h for LANES pairs of words; each number times `scale`. */
template <class Real>
HWY_INLINE void boxMullerRow(const uint32_t* HWY_RESTRICT first,
                             const uint32_t* HWY_RESTRICT second, Real scale, Real* HWY_RESTRICT z0,
                             Real* HWY_RESTRICT z1) {
    const hn::CappedTag<Real, LANES> d;
    for (int i = 0; i < LANES; i++) {
        z0[i] = (Real(first[i]) + Real(0.5)) * Real(1.0 / 4294967296.0);
        z1[i] = Real(int32_t(second[i])) * Real(M_PI / 2147483648.0);
    }
    for (size_t i = 0; i < LANES; i += hn::Lanes(d)) {
        const auto logarithm = hn::Min(hn::Log(d, hn::LoadU(d, z0 + i)), hn::Zero(d));
        const auto radius =
            hn::Mul(hn::Set(d, scale), hn::Sqrt(hn::Mul(hn::Set(d, Real(-2)), logarithm)));
        const auto angle = hn::LoadU(d, z1 + i);
        hn::StoreU(hn::Mul(radius, hn::Cos(d, angle)), d, z0 + i);
        hn::StoreU(hn::Mul(radius, hn::Sin(d, angle)), d, z1 + i);
    }
}

/** modeNoise() of Noise.h for one row of modes: real and imaginary part of each component. */
template <class Real>
HWY_INLINE void fillModeNoise(const WaveColumns<Real>& columns, int nx, Real noise[6][LANES]) {
    NoiseIndices index;
    // The indices of a row differ in n3 alone, which takes the bits from 42 on.
    const uint64_t base = numerics::modeIndex(nx, columns.ny, columns.firstZ + 1);
    for (int i = 0; i < LANES; i++) {
        index.low[i] = uint32_t(base);
        index.high[i] = uint32_t(base >> 32) + (uint32_t(i - 1) << 10);
    }
    uint32_t words[8][LANES];
    philoxRow(columns.key, 0, index, words);
    philoxRow(columns.key, 1, index, words + 4);
    for (int c = 0; c < 3; c++)
        boxMullerRow(words[2 * c], words[2 * c + 1], Real(M_SQRT1_2), noise[2 * c],
                     noise[2 * c + 1]);
    if (columns.firstZ == 0) {
        // In the plane n3 = 0, n and -n are both stored and must be conjugate: the shared routine
        // takes care of it.
        std::complex<Real> z[3];
        numerics::modeNoise(columns.key, nx, columns.ny, 0, z);
        for (int c = 0; c < 3; c++) {
            noise[2 * c][0] = z[c].real();
            noise[2 * c + 1][0] = z[c].imag();
        }
    }
}

/** One row of LANES modes; see WaveKernels::scaleColumns. */
template <class Real>
HWY_INLINE void scaleRow(const WaveColumns<Real>& columns, int nx, const Real* HWY_RESTRICT factors,
                         const Real noise[6][LANES], Real* const rows[3]) {
    const hn::CappedTag<Real, LANES> d;
    const Real* b = columns.waveVectors;
    const auto zero = hn::Zero(d), force = hn::Set(d, Real(columns.forced ? 1 : 0));
    for (size_t i = 0; i < LANES; i += hn::Lanes(d)) {
        const auto D = hn::LoadU(d, factors + i);
        const auto nz = lanesFrom(d, Real(columns.firstZ + int(i)));
        hn::Vec<decltype(d)> k[3], re[3], im[3];
        for (int c = 0; c < 3; c++)
            k[c] = hn::MulAdd(hn::Set(d, b[3 * c + 2]), nz,
                              hn::Set(d, b[3 * c] * nx + b[3 * c + 1] * columns.ny));
        const auto k2 = hn::MulAdd(k[0], k[0], hn::MulAdd(k[1], k[1], hn::Mul(k[2], k[2])));
        const auto weight = hn::Mul(force, D),
                   amplitude = hn::Mul(hn::Set(d, columns.noise), hn::Sqrt(D));
        auto alongRe = zero, alongIm = zero;
        for (int c = 0; c < 3; c++) {
            re[c] = im[c] = zero;
            if (columns.forced) {
                hn::LoadInterleaved2(d, rows[c] + 2 * i, re[c], im[c]);
                re[c] = hn::Mul(weight, re[c]);
                im[c] = hn::Mul(weight, im[c]);
            }
            if (columns.noise != 0) {
                re[c] = hn::MulAdd(amplitude, hn::LoadU(d, noise[2 * c] + i), re[c]);
                im[c] = hn::MulAdd(amplitude, hn::LoadU(d, noise[2 * c + 1] + i), im[c]);
            }
            alongRe = hn::MulAdd(k[c], re[c], alongRe);
            alongIm = hn::MulAdd(k[c], im[c], alongIm);
        }
        const auto kept = hn::Gt(D, zero);
        const auto inverse = hn::Div(hn::Set(d, Real(1)), k2);
        alongRe = hn::Mul(alongRe, inverse);
        alongIm = hn::Mul(alongIm, inverse);
        for (int c = 0; c < 3; c++) {
            // a choice, not a product: where nothing is kept, k may be zero and contents arbitrary
            re[c] = hn::IfThenElseZero(kept, hn::NegMulAdd(alongRe, k[c], re[c]));
            im[c] = hn::IfThenElseZero(kept, hn::NegMulAdd(alongIm, k[c], im[c]));
            hn::StoreInterleaved2(re[c], im[c], d, rows[c] + 2 * i);
        }
    }
}

template <class Real> HWY_INLINE bool anyKept(const Real* factors) {
    const hn::CappedTag<Real, LANES> d;
    auto largest = hn::Zero(d); // none is negative
    for (size_t i = 0; i < LANES; i += hn::Lanes(d))
        largest = hn::Max(largest, hn::LoadU(d, factors + i));
    return !hn::AllTrue(d, hn::Eq(largest, hn::Zero(d)));
}

/** w(k^2) of numerics::WaveWeight; arbitrary from last2 on. @param V  a vector of numbers of D */
template <class D, class V, class Real>
HWY_INLINE V weightOf(D d, const FactorColumns<Real>& columns, V k2) {
    const auto one = hn::Set(d, Real(1));
    const V place = hn::Mul(k2, hn::Set(d, columns.pieces / columns.last2));
    if (columns.pieces == 1) {
        const V t = hn::Sub(hn::Add(place, place), one);
        V w = hn::Set(d, columns.coefficients[0]);
        for (int power = 1; power <= columns.degree; power++)
            w = hn::MulAdd(w, t, hn::Set(d, columns.coefficients[power]));
        return w;
    }
    const V floor = hn::Floor(hn::Min(place, hn::Set(d, Real(columns.pieces - 1))));
    const V beyond = hn::Sub(place, floor), t = hn::Sub(hn::Add(beyond, beyond), one);
    const auto piece = hn::ConvertTo(hn::RebindToSigned<D>(), floor);
    V w = hn::GatherIndex(d, columns.coefficients, piece);
    for (int power = 1; power <= columns.degree; power++)
        w = hn::MulAdd(
            w, t, hn::GatherIndex(d, columns.coefficients + size_t(power) * columns.pieces, piece));
    return w;
}

template <class Real>
bool fillFactorsAny(const FactorColumns<Real>& columns, Real* HWY_RESTRICT factors) {
    const hn::CappedTag<Real, LANES> d;
    const Real* b = columns.waveVectors;
    const auto zero = hn::Zero(d), last2 = hn::Set(d, columns.last2);
    auto largest = zero;
    for (int x = 0; x < columns.sizeX; x++) {
        const int nx = (2 * x <= columns.sizeX ? x : x - columns.sizeX);
        const auto along = hn::Set(d, columns.inverseX[x] * columns.inverseY);
        for (size_t i = 0; i < LANES; i += hn::Lanes(d)) {
            const auto nz = lanesFrom(d, Real(columns.firstZ + int(i)));
            auto k2 = zero;
            for (int c = 0; c < 3; c++) {
                const auto k = hn::MulAdd(hn::Set(d, b[3 * c + 2]), nz,
                                          hn::Set(d, b[3 * c] * nx + b[3 * c + 1] * columns.ny));
                k2 = hn::MulAdd(k, k, k2);
            }
            const auto w = weightOf(d, columns, k2);
            const auto kept = hn::And(hn::Gt(k2, zero), hn::Lt(k2, last2));
            const auto D = hn::IfThenElseZero(
                kept, hn::Div(hn::Mul(hn::Mul(along, hn::LoadU(d, columns.inverseZ + i)),
                                      hn::Max(w, zero)),
                              k2));
            hn::StoreU(D, d, factors + size_t(x) * LANES + i);
            largest = hn::Max(largest, D);
        }
    }
    return !hn::AllTrue(d, hn::Eq(largest, zero));
}

template <class Real>
void scaleColumnsAny(const WaveColumns<Real>& columns, std::complex<Real>* const blocks[3]) {
    Real noise[6][LANES];
    for (int x = 0; x < columns.sizeX; x++) {
        const Real* factors = columns.factors + size_t(x) * LANES;
        Real* rows[3];
        for (int c = 0; c < 3; c++)
            rows[c] = reinterpret_cast<Real*>(blocks[c] + size_t(x) * LANES);
        if (!anyKept(factors)) {
            for (Real* row : rows)
                for (int i = 0; i < 2 * LANES; i++)
                    row[i] = 0;
            continue;
        }
        const int nx = (2 * x <= columns.sizeX ? x : x - columns.sizeX);
        if (columns.noise != 0)
            fillModeNoise(columns, nx, noise);
        scaleRow(columns, nx, factors, noise, rows);
    }
}

template <class Real>
void particleNoiseAny(const numerics::NoiseKey& key, const uint32_t* HWY_RESTRICT particles, int n,
                      Real* HWY_RESTRICT z) {
    NoiseIndices index = {};
    uint32_t words[4][LANES];
    Real g[4][LANES];
    for (int begin = 0; begin < n; begin += LANES) {
        const int used = (n - begin < LANES ? n - begin : LANES);
        for (int i = 0; i < used; i++)
            index.low[i] = particles[begin + i];
        philoxRow(key, 0, index, words);
        boxMullerRow(words[0], words[1], Real(1), g[0], g[1]);
        boxMullerRow(words[2], words[3], Real(1), g[2], g[3]);
        for (int i = 0; i < used; i++)
            for (int c = 0; c < 3; c++)
                z[3 * size_t(begin + i) + c] = g[c][i];
    }
}

// Dispatch tables hold functions, not templates: one name per precision.
WaveKernels<float> singleWaveKernels() {
    return {fillFactorsAny<float>, scaleColumnsAny<float>, particleNoiseAny<float>};
}
WaveKernels<double> doubleWaveKernels() {
    return {fillFactorsAny<double>, scaleColumnsAny<double>, particleNoiseAny<double>};
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace PSE {

HWY_EXPORT(singleWaveKernels);
HWY_EXPORT(doubleWaveKernels);

template <> WaveKernels<float> waveKernels<float>() {
    return HWY_DYNAMIC_DISPATCH(singleWaveKernels)();
}
template <> WaveKernels<double> waveKernels<double>() {
    return HWY_DYNAMIC_DISPATCH(doubleWaveKernels)();
}

} // namespace PSE
#endif
