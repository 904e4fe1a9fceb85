// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_VEC3_H_
#define OPENMMPSE_NUMERICS_VEC3_H_

#include <Eigen/Dense>

namespace PSE::numerics {

using Vec3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

} // namespace PSE::numerics

#endif
