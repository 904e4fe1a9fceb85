// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_SPHEREMODEL_H_
#define OPENMMPSE_NUMERICS_SPHEREMODEL_H_

// What a split divides: the mobility of equal spheres, lengths in radii, mobilities in 1/(6 pi eta
// a).

#include "numerics/ForceCoupling.h"
#include "numerics/Rpy.h"
#include <cmath>

namespace PSE::numerics {

/** How a sphere moves the fluid and is moved by it. */
enum class SphereModel {
    RotnePragerYamakawa, ///< by its surface [T2, T3]
    ForceCoupling        ///< by a Gaussian envelope [T41]
};

/** Wave weight of the whole mobility: what the weights of both halves add up to. */
inline double totalWeight(SphereModel model, double k) {
    if (model == SphereModel::ForceCoupling)
        return forceCouplingWeight(k);
    const double sinc = (k < 1e-4 ? 1 - k * k / 6 : std::sin(k) / k);
    return sinc * sinc;
}

/** The number m of that weight's beginning, 1 - k^2/m + O(k^4). */
inline double secondOrder(SphereModel model) {
    return model == SphereModel::ForceCoupling ? M_PI : 3.0;
}

/** The pair tensor of spheres of any radii in infinite fluid, r >= 0. */
inline PairScalars totalScalars(SphereModel model, double r, double ai, double aj) {
    return model == SphereModel::ForceCoupling ? forceCouplingScalars(r, ai, aj)
                                               : rpyScalars(r, ai, aj);
}

/** The pair tensor in infinite fluid, r >= 0. */
inline PairScalars totalScalars(SphereModel model, double r) {
    return model == SphereModel::ForceCoupling ? forceCouplingScalars(r, 1, 1) : rpyScalars(r);
}

} // namespace PSE::numerics

#endif
