// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEWAVESPACE_H_
#define OPENMMPSE_DEVICEWAVESPACE_H_

#include "DeviceClock.h"
#include "DevicePlaces.h"
#include "DeviceSphereSpread.h"
#include "numerics/Noise.h"
#include "numerics/Plan.h"
#include "numerics/WaveFactors.h"

namespace PSE {

/**
 * The wave-space half on a device [T4, T9, T10]: spread by the Kaiser-Bessel window, or as unequal
 * spheres, transform, scale (forced and thermal part together), transform back, gather. Mobilities
 * in units of 1/(6 pi eta a), vectors by place.
 */
class DeviceWaveSpace {
public:
    /** @param spheres  of a mixture, else NULL */
    DeviceWaveSpace(DevicePrograms& programs, const numerics::Plan& plan,
                    const numerics::Lattice& box, DevicePlaces& places,
                    DeviceSpheres* spheres = nullptr);
    /** Bytes of reals of one size for each grid point, and for each particle. */
    static double bytesPerGridPoint(const numerics::Plan& plan, int realSize);
    static double bytesPerParticle(const numerics::Plan& plan, int realSize);

    /** Follow a box that moves, with a Plan made for it. */
    void setBox(const numerics::Plan& plan, const numerics::Lattice& box);
    /** Windows at the places as they are now. */
    void evaluateWindows();
    /**
     * u += M_W f + noise M_W^{1/2} z
     * @param f      NULL: none
     * @param noise  amplitude, 0 for none
     */
    void addVelocities(OpenMM::ComputeArray* f, double noise, const numerics::NoiseKey& key,
                       OpenMM::ComputeArray& u, DeviceClock& clock);

private:
    OpenMM::ComputeProgram prepareWindow(DevicePrograms& programs, const numerics::Plan& plan);
    void spread(OpenMM::ComputeArray& f);
    void gather(OpenMM::ComputeArray& u);
    void prepareFactors(const numerics::Plan& plan, const numerics::Lattice& box);
    void prepareMovingFactors(const numerics::Plan& plan);
    void followBox(DeviceClock& clock);

    OpenMM::ComputeContext& context;
    DevicePlaces& places;
    OpenMM::mm_int4 size;
    int support, lanes;
    std::unique_ptr<DeviceSphereSpread> sphereSpread; ///< in place of the window
    /// of a box that moves, else NULL: factors are then made on the device, when they are needed
    std::unique_ptr<numerics::MovingWaveFactors> moving;
    double scale = 0; ///< of the factors of a box that moves
    bool factorsStale = false;
    DeviceNumbers waves;
    OpenMM::ComputeArray planConstants, coefficients, starts, weights, factors;
    OpenMM::ComputeArray weightPowers, deconvolution;
    OpenMM::ComputeArray grids[3], modes[3];
    OpenMM::FFT3D fft;
    DeviceKernel windowKernel, spreadForces, makeFactors, scaleWaves, gatherVelocities;
};

} // namespace PSE

#endif
