// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEREALSPACE_H_
#define OPENMMPSE_DEVICEREALSPACE_H_

#include "DevicePlaces.h"
#include "DevicePrograms.h"
#include "DeviceSphereRows.h"
#include "StepSummary.h"
#include "numerics/Noise.h"
#include "numerics/Plan.h"

namespace PSE {

/**
 * The real-space half on a device [T7, T18]: rows of neighbours, products with M_R and its square
 * root. Mobilities in units of 1/(6 pi eta a), vectors by place.
 */
class DeviceRealSpace {
public:
    /** @param spheres  of a mixture, else NULL */
    DeviceRealSpace(DevicePrograms& programs, const numerics::Plan& plan,
                    const numerics::Lattice& box, DevicePlaces& places, StepSummary& summary,
                    DeviceSpheres* spheres = nullptr);
    /** Rows of the StepSummary's sums that the Lanczos process may use. */
    static int summaryRows();

    static double bytesPerPair(const numerics::Plan& plan);
    /** Basis vectors of ten iterations, places, forces and velocities. */
    static double bytesPerParticle(int realSize);

    void findNeighbours();
    /** Whether all neighbours found room, as the summary says; if not, there is room next time. */
    bool hadRoom();
    /** u = M_R f */
    void multiply(OpenMM::ComputeArray& f, OpenMM::ComputeArray& u);

    /**
     * Draw z and run as many Lanczos iterations as were needed last, without waiting for them.
     * @return rows of sums that the summary must be asked for
     */
    int startSquareRoot(const numerics::NoiseKey& key);
    /**
     * u += amplitude M_R^{1/2} z, after the summary was read; runs more iterations if needed.
     * @throws std::runtime_error for an indefinite M_R, or without convergence
     */
    void addSquareRoot(double amplitude, OpenMM::ComputeArray& u);
    int lanczosIterations() const { return iterations; }

private:
    OpenMM::ComputeProgram prepareRows(DevicePrograms& programs, const numerics::Plan& plan,
                                       const numerics::Lattice& box, Defines defines);
    void prepareGeometry(const numerics::Plan& plan, const numerics::Lattice& box);
    void iterate(int from, int to);
    template <class... Arguments> void withMatrix(DeviceKernel& kernel, Arguments&&... arguments);

    OpenMM::ComputeContext& context;
    DevicePlaces& places;
    StepSummary& summary;
    double lanczosTolerance, negativeTolerance;
    bool reorthogonalise, sumImages;
    int numImages = 0, capacity = 0;
    std::unique_ptr<DeviceSphereRows> sphereRows; ///< in place of the rows of equal spheres
    OpenMM::ComputeArray planConstants, geometry, tables, images, counts, coefficients, overlaps;
    GrowingArray neighbours, basis;
    DeviceKernel findKernel, multiplyReal, drawNoise, expandBasis, makeOrthogonal, findOverlaps,
        removeOverlaps, combineBasis;
    numerics::NoiseKey noise = {};
    int iterations = 0; ///< of the last square root
    int done = 0;       ///< of this one so far
};

/** The key as kernels take it. */
OpenMM::mm_int4 kernelKey(const numerics::NoiseKey& key);

} // namespace PSE

#endif
