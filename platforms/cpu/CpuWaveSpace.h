// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_CPUWAVESPACE_H_
#define OPENMMPSE_CPUWAVESPACE_H_

#include "CpuSpread.h"
#include "Fft.h"
#include "MobilityEngine.h"
#include "Threads.h"
#include "WaveKernels.h"
#include "numerics/Lattice.h"
#include "numerics/Plan.h"
#include "numerics/WaveFactors.h"
#include <memory>
#include <vector>

namespace PSE {

/**
 * The wave-space half on a grid [T4, T9, T10]: spread, transform, scale
 * (forced and thermal part together), transform back, gather. Mobilities in units of 1/(6 pi eta
 * a).
 */
template <class Real> class CpuWaveSpace {
public:
    CpuWaveSpace(const numerics::Plan& plan, const numerics::Lattice& box, const Threads& threads);
    /** Bytes per grid point of everything that grows with the grid. */
    static double bytesPerGridPoint(const numerics::Plan& plan, const numerics::Lattice& box);
    /** Bytes per particle. */
    static double bytesPerParticle(const numerics::Plan& plan);
    /** Another box with the same Plan, which was made for one that moves [T36]. */
    void setBox(const numerics::Lattice& box);
    /** @param fractions  coordinates along the box vectors, in [0, 1) */
    void setPositions(const std::vector<numerics::Vec3>& fractions);
    // The same in parts, those of placeParticles():
    void begin(int particles) { spreading->begin(particles); }
    void assign(const std::vector<numerics::Vec3>& fractions, int from, int to) {
        spreading->assign(fractions, from, to);
    }
    void sort() { spreading->sort(); }
    void place(const std::vector<numerics::Vec3>& fractions, int from, int to) {
        spreading->place(fractions, from, to);
    }
    /** The forces of addVelocities() on the particles at places [from, to), over a unit. */
    void takeForces(const std::vector<numerics::Vec3>& forces, double unit, int from, int to) {
        spreading->takeForces(forces, unit, from, to);
    }
    /**
     * u += unit (M_W f + noise M_W^{1/2} z).
     * @param forced  there are forces, and takeForces() was called for all places
     * @param noise   amplitude, 0 for none
     */
    void addVelocities(bool forced, Real noise, const numerics::NoiseKey& key, double unit,
                       std::vector<numerics::Vec3>& u, StageClock& clock);

private:
    using Complex = std::complex<Real>;
    void prepareFactors(const numerics::WaveFactors& waves);
    void prepareMovingFactors(const numerics::Plan& plan);
    FactorColumns<Real> factorColumns() const;
    size_t factorRow(int y, int chunk, int x) const {
        return ((size_t(y) * chunks + chunk) * size[0] + x) * WAVE_LANES;
    }
    /** Signed wave index of a place along axis d. */
    int waveIndex(int d, int i) const { return 2 * i <= size[d] ? i : i - size[d]; }
    void spread();
    void scale(bool forced, Real noise, const numerics::NoiseKey& key);
    void scaleLine(int y, int thread, WaveColumns<Real> columns);
    void gather(double unit, std::vector<numerics::Vec3>& u);

    numerics::Lattice box;
    double a;
    const Threads& threads;
    WaveKernels<Real> waveLoops = waveKernels<Real>();
    int size[3];
    int chunks; ///< groups of WAVE_LANES modes along z
    size_t rowLength, planeLength;
    std::unique_ptr<CpuSpread<Real>> spreading;
    std::unique_ptr<GridFft<Real>> fft;
    FftArray<Real> grids[3];     ///< [x][y][z], real or complex
    FftArray<Real> factors;      ///< [y][chunk][x][WAVE_LANES]
    std::vector<int> keptChunks; ///< per y: beyond, no mode is kept
    /// of a box that moves, else NULL; its weight in powers, highest first, and its deconvolution
    std::unique_ptr<numerics::MovingWaveFactors> moving;
    std::vector<Real> weightCoefficients, deconvolution[3];
    /// per thread: four planes, or three blocks of columns
    std::vector<std::unique_ptr<FftArray<Real>>> scratch;
};

} // namespace PSE

#endif
