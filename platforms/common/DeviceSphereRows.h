// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_DEVICESPHEREROWS_H_
#define OPENMMPSE_DEVICESPHEREROWS_H_

#include "DeviceGeometry.h"
#include "DeviceSpheres.h"
#include "StepSummary.h"

namespace PSE {

/**
 * Rows of the real half for unequal spheres [T25, T26], with the two scalars of every pair, which
 * are evaluated once in a step.
 */
class DeviceSphereRows {
public:
    /** @param defines  of the kernels that multiply with the rows */
    DeviceSphereRows(DevicePrograms& programs, const numerics::Plan& plan,
                     const numerics::Lattice& box, DevicePlaces& places, DeviceSpheres& spheres,
                     StepSummary& summary, Defines defines);
    static double bytesPerParticle(const numerics::Plan& plan, const numerics::Lattice& box,
                                   int realSize);

    OpenMM::ComputeProgram program() const { return compiled; }
    /** What makes M_R of each kind of sphere well conditioned [T55]. */
    OpenMM::ComputeArray& scales() { return scaling; }
    /** As if made for that box. */
    void setBox(const numerics::Plan& plan, const numerics::Lattice& box);
    void find();
    /** Whether all neighbours found room, as the summary says; if not, there is room next time. */
    bool hadRoom();
    /** Launch a kernel that begins with MATRIX_PARAMETERS. */
    template <class... Arguments> void withMatrix(DeviceKernel& kernel, Arguments&&... arguments) {
        const int n = places.count(), groups = places.sizes()->size();
        if (sumImages)
            kernel(n, n, groups, groupRows, places.places(), *images, spheres.kinds(), selves,
                   *neighbours, counts, *pairs, geometry.array(), arguments...);
        else
            kernel(n, n, groups, groupRows, places.places(), spheres.kinds(), selves, *neighbours,
                   counts, *pairs, geometry.array(), arguments...);
    }

private:
    void prepareTables(const numerics::Plan& plan, Defines& defines, PlanConstants& constants);
    size_t placeRows();

    OpenMM::ComputeContext& context;
    DevicePlaces& places;
    DeviceSpheres& spheres;
    StepSummary& summary;
    bool sumImages, interpolates = false;
    int numImages = 0;
    std::vector<double> capacities; ///< length of the rows of each group
    size_t entries = 0;             ///< of all rows, 0 before they have their places
    OpenMM::ComputeProgram compiled;
    DeviceNumbers geometry;
    OpenMM::ComputeArray planConstants, groupRows, groupRadii, counts, tables, weights, selves,
        scaling;
    GrowingArray neighbours, pairs, images;
    DeviceKernel findSpheres, evaluatePairs;
};

} // namespace PSE

#endif
