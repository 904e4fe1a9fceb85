// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_WAVEKERNELS_H_
#define OPENMMPSE_WAVEKERNELS_H_

// Inner loops over modes and noise, compiled for every instruction set and chosen at run time.

#include "numerics/Noise.h"
#include <complex>
#include <cstddef>

namespace PSE {

/// modes n3 that are treated together
constexpr int WAVE_LANES = 16;

/** WAVE_LANES columns of modes at fixed y, the unit of work between two transforms along x. */
template <class Real> struct WaveColumns {
    int sizeX;           ///< grid points M_x
    int ny;              ///< signed wave index along y
    int firstZ;          ///< n3 of the first column, a multiple of WAVE_LANES
    Real waveVectors[9]; ///< columns of k = waveVectors n, row-major, in 1/a
    /// [M_x][WAVE_LANES] wave factor over window^2, 0 for dropped modes
    const Real* factors;
    bool forced;
    Real noise; ///< amplitude of the thermal part, 0 for none
    numerics::NoiseKey key;
};

/** The factors of WAVE_LANES columns of modes at fixed y, for a box that moves [T36]. */
template <class Real> struct FactorColumns {
    int sizeX, ny, firstZ;    ///< as in WaveColumns
    Real waveVectors[9];      ///< as in WaveColumns
    const Real* inverseX;     ///< [M_x] 1/window^2, 0 for dropped modes
    Real inverseY;            ///< the same, times what all factors have in common
    const Real* inverseZ;     ///< [WAVE_LANES], from firstZ on
    Real last2;               ///< k^2 beyond which w is 0
    int pieces, degree;       ///< of w, as in numerics::WaveWeight
    const Real* coefficients; ///< [degree + 1][pieces], highest power first
};

template <class Real> struct WaveKernels {
    /** WaveColumns::factors. @return whether any is not zero */
    bool (*fillFactors)(const FactorColumns<Real>& columns, Real* factors);
    /**
     * u = (I - kk)(D f + noise sqrt(D) z) in place of f, for three blocks [x][WAVE_LANES] of
     * complex numbers; without forces their contents do not matter.
     */
    void (*scaleColumns)(const WaveColumns<Real>& columns, std::complex<Real>* const blocks[3]);
    /**
     * particleNoise() of Noise.h: z[n][3] for n particles, given by their indices in the System.
     */
    void (*particleNoise)(const numerics::NoiseKey& key, const uint32_t* particles, int n, Real* z);
};

/** The loops for the best instruction set of this machine. */
template <class Real> WaveKernels<Real> waveKernels();

} // namespace PSE

#endif
