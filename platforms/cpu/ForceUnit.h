// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_FORCEUNIT_H_
#define OPENMMPSE_FORCEUNIT_H_

#include "Thermal.h"
#include "numerics/Vec3.h"
#include <algorithm>
#include <cmath>
#include <vector>

namespace PSE {

/**
 * A unit of forces in which the largest is 1: that of the forces, or the force whose Stokes
 * velocity is the thermal one.
 */
struct ForceUnit {
    double unit;  ///< 0: neither forces nor noise
    bool forced;  ///< there are forces other than zero
    double noise; ///< amplitude of the thermal part in that unit, 0 for none

    /** @param drag  6 pi eta a */
    ForceUnit(const std::vector<numerics::Vec3>* forces, const Thermal* thermal, double drag) {
        double largest = 0;
        if (forces != NULL)
            for (const numerics::Vec3& f : *forces)
                largest = std::max(largest, f.cwiseAbs().maxCoeff());
        const double thermalForce =
            (thermal == NULL ? 0 : std::sqrt(2 * thermal->kT * drag / thermal->dt));
        unit = std::max(largest, thermalForce);
        forced = largest > 0;
        noise = unit > 0 ? thermalForce / unit : 0;
    }
};

} // namespace PSE

#endif
