// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_THERMAL_H_
#define OPENMMPSE_THERMAL_H_

#include "numerics/Noise.h"

namespace PSE {

/** The thermal part of a step: u += sqrt(2 kT/dt) M^{1/2} z [T1]. */
struct Thermal {
    double kT, dt;                 ///< kJ/mol, ps
    numerics::NoiseKey real, wave; ///< the noise of the two halves
};

} // namespace PSE

#endif
