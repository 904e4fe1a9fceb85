// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICESPHERESPREAD_H_
#define OPENMMPSE_DEVICESPHERESPREAD_H_

#include "DeviceGeometry.h"
#include "DeviceSpheres.h"

namespace PSE {

/**
 * Unequal spheres between particles and the grid [T30, T31]: the radial window averaged over each
 * sphere, a polynomial that is evaluated where it is used.
 */
class DeviceSphereSpread {
public:
    DeviceSphereSpread(DevicePrograms& programs, const numerics::Plan& plan,
                       const numerics::Lattice& box, DevicePlaces& places, DeviceSpheres& spheres);
    static double bytesPerParticle(const numerics::Plan& plan, int realSize);
    /** Kernels of the waves, which are those of all Plans. */
    OpenMM::ComputeProgram program() const { return compiled; }
    /** As if made for that box. */
    void setBox(const numerics::Plan& plan, const numerics::Lattice& box);
    /** grids = forces, spread */
    void spread(OpenMM::ComputeArray& f, OpenMM::ComputeArray grids[3]);
    /** u += what the grids hold at the spheres */
    void gather(OpenMM::ComputeArray grids[3], OpenMM::ComputeArray& u);

private:
    int makeShapes(const numerics::Plan& plan);

    OpenMM::ComputeContext& context;
    DevicePlaces& places;
    DeviceSpheres& spheres;
    OpenMM::mm_int4 size;
    OpenMM::ComputeProgram compiled;
    DeviceNumbers metric;
    OpenMM::ComputeArray planConstants, reaches, shapes, coefficients;
    DeviceKernel spreadSpheres, gatherSpheres;
};

} // namespace PSE

#endif
