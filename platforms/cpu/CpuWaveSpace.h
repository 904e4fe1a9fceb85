// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUWAVESPACE_H_
#define OPENMMPSE_CPUWAVESPACE_H_

#include "Fft.h"
#include "SimdKernels.h"
#include "Threads.h"
#include "MobilityEngine.h"
#include <memory>

namespace PSE {

/**
 * The wave-space half on a grid [T4, T9, T10]: spread by the Kaiser-Bessel window, transform, scale
 * (forced and thermal part together), transform back, gather. Mobilities in units of 1/(6 pi eta
 * a).
 */
template <class Real> class CpuWaveSpace {
public:
    CpuWaveSpace(const numerics::Plan& plan, const numerics::Lattice& box, const Threads& threads);
    /** Bytes per grid point of everything that grows with the grid. */
    static double bytesPerGridPoint(const numerics::Plan& plan);
    void setPositions(const std::vector<numerics::Vec3>& x);
    /**
     * u += M_W f + noise M_W^{1/2} z.
     * @param forces  [n][3], or NULL
     * @param noise   amplitude, 0 for none
     */
    void addVelocities(const Real* forces, Real noise, const numerics::NoiseKey& key, Real* u,
                       StageClock& clock);

private:
    using Complex = std::complex<Real>;
    void prepareFactors(const numerics::Plan& plan);
    void sortByColumn();
    GridParticles<Real> particles() const;
    void spread(const Real* forces);
    void scale(bool forced, Real noise, const numerics::NoiseKey& key);
    void gather(Real* u);

    numerics::Lattice box;
    double a;
    const Threads& threads;
    const SimdKernels<Real>& simd = simdKernels<Real>();
    int support, padded, size[3], windowDegree;
    size_t rowLength, blockLength;
    std::vector<Real> windowCoefficients;
    std::unique_ptr<GridFft<Real>> fft;
    FftArray<Real> grids[3]; ///< [x][y][rowLength], real or complex
    FftArray<Real> factors;  ///< [y][x][blockLength]
    /// per thread: three columns and the noise of one row
    std::vector<std::unique_ptr<FftArray<Real>>> blocks;
    std::vector<int> order, columnOf, columnStart, first, sortedFirst;
    std::vector<Real> offsets, weights, sortedForces, sortedVelocities;
};

} // namespace PSE

#endif
