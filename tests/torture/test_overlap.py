# SPDX-License-Identifier: MIT
"""Spheres that overlap, up to all at one place: the mobility stays positive, noise and drift right."""
import numpy as np
import pytest

import scenes
from platformnames import allServed, isDirect, precisionOf
from scenes import errorOf, forceKinds, makeContext, mobilityColumns, stored

RADIUS = 0.5
ROUNDING = {"single": 2e-5, "mixed": 2e-5, "double": 1e-10} # in eigenvalues of M/mu0
TOLERANCES = (1e-2, 1e-5, 1e-7) # on CPU the last is in double precision
NO_EIGENVALUE = 1e-13 # mu0, of rounding in an exact matrix
TEMPERATURE = 300.0


class Fluid:
    """A Context at a tolerance."""

    def __init__(self, case, scene, platformName, tolerance):
        self.case, self.scene, self.tolerance = case, scene, tolerance
        self.rounding = ROUNDING[precisionOf(platformName, self.tolerance)]
        self.context, self.integrator = makeContext(scene, platformName, TEMPERATURE,
                                                    tolerance=self.tolerance)

    def move(self, scene):
        self.scene = scene
        self.context.setPositions(scene.positions)

    def checkPositivity(self):
        """
        Eigenvalues of the mobility that the library applies, beside those of the oracle. Where
        spheres lie upon each other the smallest is 0, and rounding may give it either sign.
        """
        M = mobilityColumns(self.integrator, self.scene.count)/self.scene.mu0
        assert np.linalg.norm(M - M.T, 2) < self.rounding
        smallest = np.linalg.eigvalsh(0.5*(M + M.T))[0]
        exact = np.linalg.eigvalsh(stored(self.scene, self.context).mobility/self.scene.mu0)[0]
        for name, value in (("smallest eigenvalue", smallest), ("exact eigenvalue", exact)):
            self.case.least(**{name: float(value) if abs(value) > NO_EIGENVALUE else 0.0})
        assert smallest > -self.rounding
        assert abs(smallest - exact) < 3*self.tolerance + self.rounding

    def checkContract(self):
        """Error against the oracle for each kind of forces; noise is finite."""
        here = stored(self.scene, self.context)
        for forces in forceKinds(self.scene).values():
            ratio = errorOf(self.integrator, forces, here)/self.tolerance
            self.case.measure(**{"error/tolerance": float(ratio)})
            assert ratio <= 1
        assert np.all(np.isfinite(self.integrator.sampleBrownianDisplacements(1)))
        self.integrator.step(1)
        assert np.all(np.isfinite(scenes.positionsOf(self.context)))
        iterations = self.integrator.getNumericalParameters()["lanczosIterations"]
        self.case.measure(iterations=iterations)


@pytest.mark.parametrize("tolerance", TOLERANCES)
def testPairsFromFarToOnePlace(platformName, tolerance, hardCase):
    """
    Two spheres at distances from 4 a to 0.

    The mobility is symmetric, none of its eigenvalues is negative beyond rounding, each is the
    exact one to the tolerance; errors of M f within the tolerance.
    """
    fluid = Fluid(hardCase, scenes.pair(4*RADIUS, 6.0, RADIUS), platformName, tolerance)
    for distance in (4, 3, 2.001, 2, 1.999, 1.5, 1, 0.5, 0.1, 1e-2, 1e-4, 1e-7, 0):
        fluid.move(scenes.pair(distance*RADIUS, 6.0, RADIUS))
        fluid.checkPositivity()
        fluid.checkContract()


@pytest.mark.parametrize("tolerance", TOLERANCES)
def testAllAtOnePlace(platformName, tolerance, hardCase):
    """
    Twenty spheres at one place.

    The mobility is that of one sphere for their mean force, and nothing else; Lanczos ends.
    """
    scene = scenes.Scene(np.tile([1.1, 2.2, 0.3], (20, 1)), scenes.cube(6.0), RADIUS)
    fluid = Fluid(hardCase, scene, platformName, tolerance)
    fluid.checkPositivity()
    fluid.checkContract()


@pytest.mark.parametrize("phi", [0.5, 1.0, 3.0])
def testIdealGas(platformName, phi, hardCase):
    """
    Independent uniform positions at volume fractions up to 3, tolerances from 1e-2 to 1e-7.

    Positive to rounding; errors within the tolerance; Lanczos ends.
    """
    N = 20 if isDirect(platformName) or not hardCase.long else 60
    scene = scenes.idealGas(N, phi, scenes.cube(1), RADIUS, 701)
    for tolerance in allServed(platformName, TOLERANCES):
        fluid = Fluid(hardCase, scene, platformName, tolerance)
        fluid.checkPositivity()
        fluid.checkContract()


@pytest.mark.parametrize("tolerance", TOLERANCES)
def testPolymerOfOverlappingBeads(platformName, tolerance, hardCase):
    """
    A phantom chain with bonds of a/2.

    Positive to rounding; errors within the tolerance; Lanczos ends.
    """
    scene = scenes.chain(24, 0.5*RADIUS, 9.0, RADIUS, 702)
    fluid = Fluid(hardCase, scene, platformName, tolerance)
    fluid.checkPositivity()
    fluid.checkContract()


def clusters():
    """Pairs, an octahedron and a condensed phase: positions (N,3) in nm."""
    octahedron = RADIUS*np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)
                                  if abs(x) + abs(y) + abs(z) == 1])*1.6 + [3.1, 2.7, 3.3]
    condensed = scenes.denseSuspension(2, 0.45, RADIUS, 703).positions + [1.0, 1.2, 0.9]
    return {"pair in contact": scenes.pair(2*RADIUS, 7.0, RADIUS).positions,
            "overlapping pair": scenes.pair(0.7*RADIUS, 7.0, RADIUS).positions,
            "octahedron": octahedron, "condensed phase": condensed}


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("name", clusters())
def testForcesWithinAClusterDoNotDriveIt(platformName, name, tolerance, hardCase):
    """
    A free cluster in a larger box with forces between its spheres that add up to zero.

    The drift of its centre is the exact one to the tolerance times the Stokes velocity of the rms
    force (zero for a pair).
    """
    scene = scenes.Scene(clusters()[name], scenes.cube(9.0), RADIUS)
    context, integrator = makeContext(scene, platformName, tolerance=tolerance)
    here = stored(scene, context)
    for forces in (scenes.balancedForces(scene), scenes.randomForces(scene)):
        forces = forces - forces.mean(axis=0)
        drift = np.asarray(integrator.applyMobility(forces)).mean(axis=0)
        exact = here.velocities(forces).mean(axis=0)
        stokes = scene.mu0*np.sqrt(np.mean(np.sum(forces**2, axis=1)))
        excess = np.linalg.norm(drift - exact)/stokes
        hardCase.measure(**{"drift/tolerance": float(excess/tolerance)})
        assert excess <= tolerance
        assert scene.count > 2 or np.linalg.norm(exact) < 1e-9*stokes
