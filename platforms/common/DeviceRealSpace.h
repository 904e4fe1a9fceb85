// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICEREALSPACE_H_
#define OPENMMPSE_DEVICEREALSPACE_H_

#include "DeviceGeometry.h"
#include "DeviceLanczos.h"
#include "DevicePrograms.h"
#include "DeviceSphereRows.h"
#include "StepSummary.h"
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
    static double bytesPerPair(const numerics::Plan& plan);
    /** Basis vectors of ten iterations, places, forces and velocities. */
    static double bytesPerParticle(int realSize);

    /** As if made for that box. */
    void setBox(const numerics::Plan& plan, const numerics::Lattice& box);
    void findNeighbours();
    /** Whether all neighbours found room, as the summary says; if not, there is room next time. */
    bool hadRoom();
    /** u = M_R f */
    void multiply(OpenMM::ComputeArray& f, OpenMM::ComputeArray& u);

    /** The square root of M_R. */
    DeviceLanczos& squareRoot() { return lanczos; }
    const DeviceLanczos& squareRoot() const { return lanczos; }

private:
    OpenMM::ComputeProgram prepareRows(DevicePrograms& programs, const numerics::Plan& plan,
                                       const numerics::Lattice& box, Defines defines);
    template <class... Arguments> void withMatrix(DeviceKernel& kernel, Arguments&&... arguments);

    OpenMM::ComputeContext& context;
    DevicePlaces& places;
    StepSummary& summary;
    DeviceLanczos lanczos;
    bool sumImages;
    int numImages = 0, capacity = 0;
    std::unique_ptr<DeviceSphereRows> sphereRows; ///< in place of the rows of equal spheres
    double self = 0;                              ///< of equal spheres: the diagonal of M_R
    DeviceNumbers geometry;
    OpenMM::ComputeArray planConstants, tables, counts;
    GrowingArray neighbours, images;
    DeviceKernel findKernel, multiplyReal;
};

} // namespace PSE

#endif
