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

template <class Real> struct WaveKernels {
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
