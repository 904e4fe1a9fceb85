// SPDX-License-Identifier: MIT
#include "SimdKernels.h"
#include "numerics/Rpy.h"
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "SimdKernels.cpp"
#include <hwy/foreach_target.h> // compiles this file once more for each instruction set
#include <hwy/highway.h>
#include <hwy/contrib/math/math-inl.h>

// Plain loops over padded rows: inside these namespaces the compiler may use the instruction set in
// question, and does.
HWY_BEFORE_NAMESPACE();
namespace PSE {
namespace HWY_NAMESPACE {

template <int PADDED, class Real>
HWY_INLINE void evaluateWindowsPadded(const WindowPolynomials<Real>& window,
                                      const Real* HWY_RESTRICT t, int n,
                                      Real* HWY_RESTRICT weights) {
    for (int row = 0; row < 3 * n; row++) {
        Real w[PADDED];
        for (int j = 0; j < PADDED; j++)
            w[j] = window.coefficients[j];
        for (int power = 1; power <= window.degree; power++)
            for (int j = 0; j < PADDED; j++)
                w[j] = w[j] * t[row] + window.coefficients[power * PADDED + j];
        for (int j = 0; j < PADDED; j++)
            weights[row * size_t(PADDED) + j] = w[j];
    }
}

template <class Real>
void evaluateWindowsAny(const WindowPolynomials<Real>& window, const Real* t, int n,
                        Real* weights) {
    if (window.padded == 4)
        evaluateWindowsPadded<4>(window, t, n, weights);
    else if (window.padded == 8)
        evaluateWindowsPadded<8>(window, t, n, weights);
    else
        evaluateWindowsPadded<16>(window, t, n, weights);
}

template <int PADDED, class Real>
HWY_INLINE void spreadParticle(const GridParticles<Real>& p, int particle, int dx,
                               Real* const planes[3]) {
    const Real* weights = p.weights + size_t(particle) * 3 * PADDED;
    const int* first = p.first + 3 * size_t(particle);
    Real row[3][PADDED];
    for (int c = 0; c < 3; c++)
        for (int j = 0; j < PADDED; j++)
            row[c][j] = p.forces[3 * size_t(particle) + c] * weights[dx] * weights[2 * PADDED + j];
    int y = first[1];
    for (int dy = 0; dy < p.support; dy++) {
        const Real wy = weights[PADDED + dy];
        const size_t offset = y * p.rowLength + first[2];
        for (int c = 0; c < 3; c++) {
            Real* HWY_RESTRICT target = planes[c] + offset;
            for (int j = 0; j < PADDED; j++)
                target[j] += wy * row[c][j];
        }
        if (++y == p.size[1])
            y = 0;
    }
}

template <int PADDED, class Real>
HWY_INLINE void spreadPlanePadded(const GridParticles<Real>& p, int x, Real* const planes[3]) {
    const size_t rows = p.size[1];
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < rows * p.rowLength; i++)
            planes[c][i] = 0;
    for (int dx = 0; dx < p.support; dx++) {
        const int column = (x - dx + p.size[0]) % p.size[0];
        const int begin = p.columnStart[column * rows], end = p.columnStart[(column + 1) * rows];
        for (int particle = begin; particle < end; particle++)
            spreadParticle<PADDED>(p, particle, dx, planes);
    }
    for (int c = 0; c < 3; c++)
        for (size_t y = 0; y < rows; y++) {
            Real* row = planes[c] + y * p.rowLength;
            for (int z = p.size[2]; z < p.size[2] + PADDED - 1; z++)
                row[z % p.size[2]] += row[z];
        }
}

template <class Real>
void spreadPlaneAny(const GridParticles<Real>& p, int x, Real* const planes[3]) {
    if (p.padded == 4)
        spreadPlanePadded<4>(p, x, planes);
    else if (p.padded == 8)
        spreadPlanePadded<8>(p, x, planes);
    else
        spreadPlanePadded<16>(p, x, planes);
}

template <int PADDED, class Real>
HWY_INLINE void gatherPadded(const GridParticles<Real>& p, int from, int to,
                             const Real* const grids[3], Real* HWY_RESTRICT u) {
    for (int particle = from; particle < to; particle++) {
        const Real* weights = p.weights + size_t(particle) * 3 * PADDED;
        const int* first = p.first + 3 * size_t(particle);
        Real sum[3][PADDED] = {};
        int x = first[0];
        for (int dx = 0; dx < p.support; dx++) {
            int y = first[1];
            for (int dy = 0; dy < p.support; dy++) {
                const Real w = weights[dx] * weights[PADDED + dy];
                const size_t offset = (size_t(x) * p.size[1] + y) * p.rowLength + first[2];
                for (int c = 0; c < 3; c++)
                    for (int j = 0; j < PADDED; j++)
                        sum[c][j] += w * grids[c][offset + j];
                if (++y == p.size[1])
                    y = 0;
            }
            if (++x == p.size[0])
                x = 0;
        }
        for (int c = 0; c < 3; c++) {
            Real total = 0;
            for (int j = 0; j < PADDED; j++)
                total += sum[c][j] * weights[2 * PADDED + j];
            u[3 * size_t(particle) + c] = total;
        }
    }
}

template <class Real>
void gatherAny(const GridParticles<Real>& p, int from, int to, const Real* const grids[3],
               Real* u) {
    if (p.padded == 4)
        gatherPadded<4>(p, from, to, grids, u);
    else if (p.padded == 8)
        gatherPadded<8>(p, from, to, grids, u);
    else
        gatherPadded<16>(p, from, to, grids, u);
}

// Loops of the fixed length PAIR_LANES are whole SIMD vectors.

/** F and C of one block from its displacements; lanes from `used` on count for nothing. */
template <class Real>
HWY_INLINE void evaluateBlock(const PairPolynomials<Real>& table, int used, PairBlock<Real>& p) {
    const Real scale = 2 / (table.rc * table.rc);
    Real r2[PAIR_LANES], t[PAIR_LANES], waveF[PAIR_LANES], waveC[PAIR_LANES];
    for (int k = 0; k < PAIR_LANES; k++) {
        r2[k] = p.dx[k] * p.dx[k] + p.dy[k] * p.dy[k] + p.dz[k] * p.dz[k];
        t[k] = scale * r2[k] - 1;
        waveF[k] = table.F[0];
        waveC[k] = table.C[0];
    }
    for (int power = 1; power <= table.degreeF; power++)
        for (int k = 0; k < PAIR_LANES; k++)
            waveF[k] = waveF[k] * t[k] + table.F[power];
    for (int power = 1; power <= table.degreeC; power++)
        for (int k = 0; k < PAIR_LANES; k++)
            waveC[k] = waveC[k] * t[k] + table.C[power];
    for (int k = 0; k < PAIR_LANES; k++) {
        Real F, G;
        numerics::rpyScalars(std::sqrt(r2[k]), F, G);
        const Real C = (G - F) / r2[k];
        p.F[k] = F - waveF[k];
        p.C[k] = (r2[k] > 0 ? C : 0) - waveC[k]; // r r^T vanishes at r = 0
    }
    for (int k = used; k < PAIR_LANES; k++)
        p.F[k] = p.C[k] = 0;
}

template <class Real>
void evaluateBlocksAny(const PairPolynomials<Real>& table, int count, int last,
                       PairBlock<Real>* blocks) {
    for (int b = 0; b < count; b++)
        evaluateBlock(table, b == count - 1 ? last : PAIR_LANES, blocks[b]);
}

/**
 * Nearest images of x_i - x_j for n <= PAIR_LANES candidates, the last one repeated in the unused
 * places.
 */
HWY_INLINE void displace(const PairGeometry& g, int i, const int32_t* HWY_RESTRICT candidates,
                         int n, double* HWY_RESTRICT dx, double* HWY_RESTRICT dy,
                         double* HWY_RESTRICT dz) {
    const double inverseX = 1 / g.box[0], inverseY = 1 / g.box[2], inverseZ = 1 / g.box[5];
    for (int k = 0; k < PAIR_LANES; k++) {
        const int32_t j = candidates[k < n ? k : n - 1];
        dx[k] = g.x[i] - g.x[j];
        dy[k] = g.y[i] - g.y[j];
        dz[k] = g.z[i] - g.z[j];
    }
    for (int k = 0; k < PAIR_LANES; k++) {
        const double nc = std::floor(dz[k] * inverseZ + 0.5);
        dx[k] -= nc * g.box[3];
        dy[k] -= nc * g.box[4];
        dz[k] -= nc * g.box[5];
        const double nb = std::floor(dy[k] * inverseY + 0.5);
        dx[k] -= nb * g.box[1];
        dy[k] -= nb * g.box[2];
        dx[k] -= std::floor(dx[k] * inverseX + 0.5) * g.box[0];
    }
}

/** Neighbours found so far that do not fill a block yet. */
template <class Real> struct PairStage {
    int n = 0;
    int32_t neighbour[2 * PAIR_LANES];
    Real dx[2 * PAIR_LANES], dy[2 * PAIR_LANES], dz[2 * PAIR_LANES];

    /** Move the first `used` <= PAIR_LANES of them to a block. */
    HWY_INLINE void moveTo(PairBlock<Real>& block, int used) {
        for (int k = 0; k < PAIR_LANES; k++) {
            const int from = (k < used ? k : 0);
            block.neighbour[k] = neighbour[from];
            block.dx[k] = dx[from];
            block.dy[k] = dy[from];
            block.dz[k] = dz[from];
        }
        for (int k = 0; k < PAIR_LANES; k++) {
            neighbour[k] = neighbour[k + PAIR_LANES];
            dx[k] = dx[k + PAIR_LANES];
            dy[k] = dy[k + PAIR_LANES];
            dz[k] = dz[k + PAIR_LANES];
        }
        n -= used;
    }
};

template <class Real>
int fillRowAny(const PairGeometry& g, const PairPolynomials<Real>& table, int i,
               const int32_t* candidates, int n, PairBlock<Real>* row) {
    const double range2 = g.range * g.range, scale = 1 / g.radius;
    double dx[PAIR_LANES], dy[PAIR_LANES], dz[PAIR_LANES];
    PairStage<Real> stage;
    int blocks = 0;
    for (int begin = 0; begin < n; begin += PAIR_LANES) {
        const int lanes = (n - begin < PAIR_LANES ? n - begin : PAIR_LANES);
        displace(g, i, candidates + begin, lanes, dx, dy, dz);
        // no branch: one out of range is overwritten by the next
        for (int k = 0; k < lanes; k++) {
            stage.neighbour[stage.n] = candidates[begin + k];
            stage.dx[stage.n] = Real(dx[k] * scale);
            stage.dy[stage.n] = Real(dy[k] * scale);
            stage.dz[stage.n] = Real(dz[k] * scale);
            stage.n += (dx[k] * dx[k] + dy[k] * dy[k] + dz[k] * dz[k] < range2);
        }
        if (stage.n >= PAIR_LANES) {
            stage.moveTo(row[blocks], PAIR_LANES);
            evaluateBlock(table, PAIR_LANES, row[blocks++]);
        }
    }
    if (stage.n > 0) {
        const int used = stage.n;
        stage.moveTo(row[blocks], used);
        evaluateBlock(table, used, row[blocks++]);
    }
    return blocks;
}

template <class Real>
void multiplyRowsAny(const PairRows<Real>& rows, int from, int to, const Real* HWY_RESTRICT v,
                     Real* HWY_RESTRICT out) {
    for (int i = from; i < to; i++) {
        Real x[PAIR_LANES] = {}, y[PAIR_LANES] = {}, z[PAIR_LANES] = {};
        const PairBlock<Real>* row = rows.blocks + rows.start[i];
        for (int b = 0; b < rows.count[i]; b++) {
            const PairBlock<Real>& p = row[b];
            for (int k = 0; k < PAIR_LANES; k++) {
                const int32_t j = 3 * p.neighbour[k];
                const Real vx = v[j], vy = v[j + 1], vz = v[j + 2];
                const Real along = p.C[k] * (p.dx[k] * vx + p.dy[k] * vy + p.dz[k] * vz);
                x[k] += p.F[k] * vx + along * p.dx[k];
                y[k] += p.F[k] * vy + along * p.dy[k];
                z[k] += p.F[k] * vz + along * p.dz[k];
            }
        }
        const Real* own = v + 3 * size_t(i);
        Real sum[3] = {rows.self * own[0], rows.self * own[1], rows.self * own[2]};
        for (int k = 0; k < PAIR_LANES; k++) {
            sum[0] += x[k];
            sum[1] += y[k];
            sum[2] += z[k];
        }
        for (int c = 0; c < 3; c++)
            out[3 * size_t(i) + c] = sum[c];
    }
}

/**
 * philox() of Noise.h for a row of indices that differ in their upper word, one loop that the
 * compiler vectorises.
 */
HWY_INLINE void philoxRow(const numerics::NoiseKey& key, uint32_t part, uint32_t low,
                          const uint32_t* HWY_RESTRICT high, int n, uint32_t* HWY_RESTRICT w0,
                          uint32_t* HWY_RESTRICT w1, uint32_t* HWY_RESTRICT w2,
                          uint32_t* HWY_RESTRICT w3) {
    const uint32_t step = uint32_t(key.counter),
                   last = (uint32_t(key.counter >> 32) & 0xFFFFu) | (part << 16);
    const uint32_t seed = key.seed, stream = uint32_t(key.stream);
    for (int i = 0; i < n; i++) {
        uint32_t c0 = low, c1 = high[i], c2 = step, c3 = last, k0 = seed, k1 = stream;
#pragma GCC unroll 10
        for (int round = 0; round < 10; round++) {
            const uint64_t p0 = uint64_t(0xD2511F53u) * c0, p1 = uint64_t(0xCD9E8D57u) * c2;
            c0 = uint32_t(p1 >> 32) ^ c1 ^ k0;
            c1 = uint32_t(p1);
            c2 = uint32_t(p0 >> 32) ^ c3 ^ k1;
            c3 = uint32_t(p0);
            k0 += 0x9E3779B9u;
            k1 += 0xBB67AE85u;
        }
        w0[i] = c0;
        w1[i] = c1;
        w2[i] = c2;
        w3[i] = c3;
    }
}

/**
 * boxMuller() of Noise.h for n pairs of words, n a multiple of the vector length; each number times
 * `scale`.
 */
template <class Real>
HWY_INLINE void boxMullerRow(const uint32_t* HWY_RESTRICT first,
                             const uint32_t* HWY_RESTRICT second, int n, Real scale,
                             Real* HWY_RESTRICT z0, Real* HWY_RESTRICT z1) {
    namespace hn = hwy::HWY_NAMESPACE;
    const hn::ScalableTag<Real> d;
    for (int i = 0; i < n; i++) {
        z0[i] = (Real(first[i]) + Real(0.5)) * Real(1.0 / 4294967296.0);
        z1[i] = Real(int32_t(second[i])) * Real(M_PI / 2147483648.0);
    }
    for (size_t i = 0; i < size_t(n); i += hn::Lanes(d)) {
        const auto logarithm = hn::Min(hn::Log(d, hn::LoadU(d, z0 + i)), hn::Zero(d));
        const auto radius =
            hn::Mul(hn::Set(d, scale), hn::Sqrt(hn::Mul(hn::Set(d, Real(-2)), logarithm)));
        const auto angle = hn::LoadU(d, z1 + i);
        hn::StoreU(hn::Mul(radius, hn::Cos(d, angle)), d, z0 + i);
        hn::StoreU(hn::Mul(radius, hn::Sin(d, angle)), d, z1 + i);
    }
}

/**
 * modeNoise() of Noise.h for a row of modes n3 = 0, 1, ..., count - 1.
 *
 * noise  [6][blockLength]: real and imaginary part of each component
 */
template <class Real>
HWY_INLINE void fillModeNoise(const WaveRow<Real>& row, int nx, int count,
                              Real* HWY_RESTRICT noise) {
    constexpr int BATCH = 64; // a multiple of every vector length
    uint32_t high[BATCH], words[8][BATCH];
    const Real half = Real(M_SQRT1_2);
    for (int begin = 0; begin < count; begin += BATCH) {
        // Beyond `count` the row is padding, at least up to a multiple of 16: noise there is never
        // used.
        const int n = (count - begin >= BATCH ? BATCH : (count - begin + 15) / 16 * 16);
        const uint64_t base = numerics::modeIndex(nx, row.ny, begin > 0 ? begin : 1);
        for (int i = 0; i < n; i++)
            high[i] = uint32_t(base >> 32) + (uint32_t(begin > 0 ? i : i - 1) << 10);
        for (uint32_t part = 0; part < 2; part++)
            philoxRow(row.key, part, uint32_t(base), high, n, words[4 * part], words[4 * part + 1],
                      words[4 * part + 2], words[4 * part + 3]);
        for (int c = 0; c < 3; c++)
            boxMullerRow(words[2 * c], words[2 * c + 1], n, half,
                         noise + 2 * c * row.blockLength + begin,
                         noise + (2 * c + 1) * row.blockLength + begin);
    }
    // In the plane n3 = 0, n and -n are both stored and must be conjugate: the shared routine takes
    // care of it.
    std::complex<Real> z[3];
    numerics::modeNoise(row.key, nx, row.ny, 0, z);
    for (int c = 0; c < 3; c++) {
        noise[2 * c * row.blockLength] = z[c].real();
        noise[(2 * c + 1) * row.blockLength] = z[c].imag();
    }
}

template <class Real>
void scaleWavesAny(const WaveRow<Real>& row, std::complex<Real>* const blocks[3],
                   Real* HWY_RESTRICT scratch) {
    const Real* b = row.waveVectors;
    for (size_t i = 0; row.noise == 0 && i < waveScratch(row.blockLength); i++)
        scratch[i] = 0;
    for (int x = 0; x < row.size[0]; x++) {
        const int nx = (2 * x <= row.size[0] ? x : x - row.size[0]);
        const Real* factors = row.factors + x * row.blockLength;
        if (row.noise != 0)
            fillModeNoise(row, nx, row.size[2] / 2 + 1, scratch);
        Real* wave[3];
        for (int c = 0; c < 3; c++)
            wave[c] = reinterpret_cast<Real*>(blocks[c] + x * row.blockLength);
        for (int nz = 0; nz <= row.size[2] / 2; nz++) {
            const Real D = factors[nz];
            if (D == 0) { // dropped modes; their noise has not been drawn
                for (int c = 0; c < 3; c++)
                    wave[c][2 * nz] = wave[c][2 * nz + 1] = 0;
                continue;
            }
            const Real k[3] = {b[0] * nx + b[1] * row.ny + b[2] * nz,
                               b[3] * nx + b[4] * row.ny + b[5] * nz,
                               b[6] * nx + b[7] * row.ny + b[8] * nz};
            const Real inverse = 1 / (k[0] * k[0] + k[1] * k[1] + k[2] * k[2]),
                       force = row.forced ? D : 0;
            const Real amplitude = row.noise * std::sqrt(D);
            for (int part = 0; part < 2; part++) { // real, imaginary
                Real u[3], along = 0;
                for (int c = 0; c < 3; c++) {
                    u[c] = amplitude * scratch[(2 * c + part) * row.blockLength + nz];
                    if (row.forced)
                        u[c] += force * wave[c][2 * nz + part];
                    along += k[c] * u[c];
                }
                for (int c = 0; c < 3; c++)
                    wave[c][2 * nz + part] = u[c] - along * inverse * k[c];
            }
        }
    }
}

template <class Real> SimdKernels<Real> allKernels() {
    return {evaluateWindowsAny<Real>, spreadPlaneAny<Real>,  gatherAny<Real>,    fillRowAny<Real>,
            evaluateBlocksAny<Real>,  multiplyRowsAny<Real>, scaleWavesAny<Real>};
}

// Dispatch tables hold functions, not templates: one name per precision.
SimdKernels<float> singleKernels() {
    return allKernels<float>();
}
SimdKernels<double> doubleKernels() {
    return allKernels<double>();
}

} // namespace HWY_NAMESPACE
} // namespace PSE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace PSE {

HWY_EXPORT(singleKernels);
HWY_EXPORT(doubleKernels);

template <> const SimdKernels<float>& simdKernels<float>() {
    static const SimdKernels<float> kernels = HWY_DYNAMIC_DISPATCH(singleKernels)();
    return kernels;
}

template <> const SimdKernels<double>& simdKernels<double>() {
    static const SimdKernels<double> kernels = HWY_DYNAMIC_DISPATCH(doubleKernels)();
    return kernels;
}

} // namespace PSE
#endif
