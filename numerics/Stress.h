// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_STRESS_H_
#define OPENMMPSE_NUMERICS_STRESS_H_

#include "numerics/Vec3.h"
#include <functional>
#include <vector>

namespace PSE::numerics {

/**
 * The parts of the stress of the particles [T46]: symmetric, positive where the suspension pulls at
 * its surroundings, in kJ/(mol nm^3). The pressure that the particles add is -trace/3.
 */

/** -n kT 1 of a number of particles in a volume (nm^3); kT in kJ/mol. */
Matrix3 idealStress(double count, double kT, double volume);

/**
 * What spheres resist the flow (rate*y, 0, 0) with, each as if alone [T48].
 * @param radii      nm
 * @param viscosity  Da/(nm ps)
 * @param rate       1/ps
 * @param volume     nm^3
 */
Matrix3 singleSphereStress(const std::vector<double>& radii, double viscosity, double rate,
                           double volume);

/** Energy (kJ/mol) after x -> map x, of positions and box alike; the map is upper triangular. */
using EnergyOfMap = std::function<double(const Matrix3& map)>;

/**
 * The derivative of an energy by a homogeneous strain, symmetric [T47]: 24 energies.
 * @param step  the largest strain
 * @return kJ/mol, with an error of the fourth order in the step, and rounding of the energies over
 * the step
 */
Matrix3 strainDerivative(const EnergyOfMap& energy, double step);

/** The step at which both errors are alike. @param rounding  relative, of the energies */
double strainStep(double rounding);

} // namespace PSE::numerics

#endif
