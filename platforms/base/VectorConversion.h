// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_VECTORCONVERSION_H_
#define OPENMMPSE_VECTORCONVERSION_H_

#include "numerics/Vec3.h"
#include "openmm/Vec3.h"

namespace PSE {

inline numerics::Vec3 fromOpenMM(const OpenMM::Vec3& v) {
    return numerics::Vec3(v[0], v[1], v[2]);
}

inline OpenMM::Vec3 toOpenMM(const numerics::Vec3& v) {
    return OpenMM::Vec3(v[0], v[1], v[2]);
}

} // namespace PSE

#endif
