// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_SCENE_H_
#define OPENMMPSE_SCENE_H_

#include "openmmpse/PSEBrownianIntegrator.h"
#include "openmm/System.h"
#include <string>
#include <vector>

namespace PSE {

/**
 * Which effects a System and an integrator's settings call for, decided once for every platform.
 */
struct OPENMM_EXPORT_PSE Scene {
    /// indices of the particles that move and feel the fluid (mass > 0)
    std::vector<int> mobile;
    std::vector<double> radii;  ///< their hydrodynamic radii (nm)
    int numMassless = 0;        ///< particles that do not move and are transparent to the fluid
    bool hydrodynamics = false; ///< particles feel each other through the fluid
    bool unbounded = false; ///< that fluid is infinite, and the box of the Context plays no part
    /// Forces or fluid see images of the particles: shear tilts the box
    bool periodicBox = false;
    std::string barostat;       ///< the kind of Force that moves the box; empty: none
    bool forceCoupling = false; ///< by Gaussian envelopes instead of rigid spheres' surfaces
    std::string model;          ///< of the mobility, in words; empty: no hydrodynamics
    std::string boundaryReason; ///< why the fluid is periodic, or unbounded
};

/**
 * Decide which effects are active.
 * @throws OpenMMException naming what is asked for but cannot be simulated, and what to do
 */
OPENMM_EXPORT_PSE Scene makeScene(const OpenMM::System& system,
                                  const PSEBrownianIntegrator& integrator);

/** @throws OpenMMException if something in the scene keeps its box from being sheared */
void requireShear(const Scene& scene);

/** The text of PSEBrownianIntegrator::describe(). */
std::string describeScene(const Scene& scene, const PSEBrownianIntegrator& integrator,
                          const NumericalParameters& parameters,
                          const std::vector<StageTime>& stages, double strain);

} // namespace PSE

#endif
