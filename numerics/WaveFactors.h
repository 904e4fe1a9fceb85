// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_WAVEFACTORS_H_
#define OPENMMPSE_NUMERICS_WAVEFACTORS_H_

#include "numerics/Plan.h"
#include "numerics/RadialWindow.h"
#include "numerics/Vec3.h"
#include "numerics/WaveWeight.h"
#include <array>
#include <memory>
#include <vector>

namespace PSE::numerics {

/**
 * What turns gridded forces into gridded velocities, mode by mode [T4, T10, T30]: the wave factor
 * of the split over the volume, over the square of the window's transform.
 */
class WaveFactors {
public:
    WaveFactors(const Plan& plan, const Lattice& box);
    /** Signed wave number of index i along axis d. */
    int waveNumber(int d, int i) const { return 2 * i <= grid[d] ? i : i - grid[d]; }
    /** k = waves n, in 1/a. */
    const Matrix3& waves() const { return waveVectors; }
    /**
     * D of the mode with the wave numbers of indices x, y and z <= grid[2]/2, in 1/(6 pi eta a); 0
     * for what no platform keeps: the mean flow and the Nyquist planes, where n and -n coincide on
     * the grid but not in k.
     */
    double operator()(int x, int y, int z) const;

private:
    double ofMixture(double k) const;

    std::shared_ptr<const Split> split;
    std::shared_ptr<const Mixture> mixture;
    std::array<int, 3> grid;
    Matrix3 waveVectors;
    double unit;
    std::vector<double> inverse[3];   ///< 1/W^ along each axis, for equal spheres
    std::vector<RadialWindow> radial; ///< that of a mixture, else none
    double cell = 0;                  ///< volume per grid point
};

/**
 * WaveFactors of a box that moves, in parts:
 *
 *     D = scale(box) weight(k^2)/k^2 deconvolution[0][x] deconvolution[1][y] deconvolution[2][z]
 *
 * for k != 0. Of these only the scale and k know the box.
 */
class MovingWaveFactors {
public:
    explicit MovingWaveFactors(const Plan& plan);
    double scale(const Lattice& box) const;

    /// of a mixture with the window, which is a function of k there
    WaveWeight weight;
    /// by index along each axis (the last: up to M/2), 0 on Nyquist planes
    std::vector<double> deconvolution[3];

private:
    double a, perVolume, timesVolume;
};

} // namespace PSE::numerics

#endif
