// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_NUMERICS_NEARIMAGES_H_
#define OPENMMPSE_NUMERICS_NEARIMAGES_H_

// What spheres at one place move with in a periodic box, for estimates of errors [T14]. Lengths in
// the unit of the Plan.

#include "numerics/Lattice.h"
#include "numerics/SphereModel.h"

namespace PSE::numerics {

/** Edge of the cube of images that stands for a box: of its volume, at most its shortest vector. */
double imageSpacing(const Lattice& box);

/**
 * Mobility of a sphere of radius a for a force on one of radius b at its place, or on itself, among
 * all images, 1/(6 pi eta); never less than 0.1/max(a, b).
 * @param spacing  of the images, see imageSpacing()
 */
double mobilityAmongImages(double spacing, double a, double b,
                           SphereModel model = SphereModel::RotnePragerYamakawa);

} // namespace PSE::numerics

#endif
