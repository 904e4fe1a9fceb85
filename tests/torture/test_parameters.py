# SPDX-License-Identifier: MIT
"""Extreme parameters: every number that a user may set, from end to end of its range."""
import numpy as np
import openmm
import pytest

import openmmpse
import scenes
from platformnames import coordinateRounding, isDevice, lowestTolerance
from scenes import KB, errorOf, forceKinds, makeContext, stored

RADIUS = 0.5
SPLITS = {"Prolate": openmmpse.PSEBrownianIntegrator.Prolate,
          "Hasimoto": openmmpse.PSEBrownianIntegrator.Hasimoto}


def suspension():
    return scenes.randomSuspension(40, 0.05, scenes.cube(1), RADIUS, 721)


def worstError(integrator, here):
    return max(float(errorOf(integrator, forces, here)) for forces in forceKinds(here).values())


class Served:
    """Which splitting parameters a platform serves, each with its error."""

    def __init__(self, case, platformName, split, tolerance):
        self.case, self.platformName, self.split, self.tolerance = case, platformName, split, tolerance
        self.scene, self.refused, self.kept = suspension(), [], []
        self.thorough = case.long or not isDevice(platformName)
        self.precision = 0.01 if self.thorough else 0.1 # devices make programs for each

    def context(self, xi):
        def configure(integrator):
            integrator.setSplit(SPLITS[self.split])
            integrator.setSplittingParameter(xi)
        return makeContext(self.scene, self.platformName, tolerance=self.tolerance, configure=configure)

    def automatic(self):
        _context, integrator = self.context(0)
        return integrator.getNumericalParameters()["xi"]

    def serves(self, xi):
        try:
            context, integrator = self.context(xi)
        except openmm.OpenMMException as refusal:
            assert any(word in str(refusal) for word in ("splitting parameter", "range")), refusal
            self.refused.append(xi)
            return False
        error = worstError(integrator, stored(self.scene, context))
        self.case.measure(**{"error/tolerance": error/self.tolerance})
        assert error <= self.tolerance, f"xi = {xi}"
        self.kept.append(xi)
        return True

    def end(self, good, bad):
        """The last that is served on the way from one that is to one that is not."""
        assert not self.serves(bad)
        while abs(np.log(bad/good)) > self.precision:
            middle = np.sqrt(good*bad)
            good, bad = (middle, bad) if self.serves(middle) else (good, middle)
        return good


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5, 1e-7])
def testSplittingParameter(platformName, split, tolerance, hardCase):
    """
    Splitting parameters from 0.005/a to 10/a for either split: from the automatic one to the smallest and to the
    largest that are served, which are found to 1 %, and 24 over the range (in the short form 12, on devices none
    and the ends to 10 %).

    Those that the scene does not allow are refused by name and lie beyond those that it allows; all others, up
    to both ends, keep the tolerance.
    """
    served = Served(hardCase, platformName, split, tolerance)
    low, high, start = 0.005/RADIUS, 10/RADIUS, served.automatic()
    smallest, largest = served.end(start, low), served.end(start, high)
    if served.thorough:
        for xi in np.geomspace(low, high, 24 if hardCase.long else 12):
            served.serves(xi)
    assert smallest <= min(served.kept) and max(served.kept) <= largest
    assert not any(smallest < xi < largest for xi in served.refused)
    hardCase.measure(served=len(served.kept), refused=len(served.refused),
                     **{"smallest xi a": float(smallest*RADIUS), "largest xi a": float(largest*RADIUS)})


def testEveryTolerance(platformName, hardCase):
    """
    Tolerances 1e-1, 1e-2, ... down to 1e-10 (single precision of a device: 1e-5).

    The measured error is below each; only the tightest of a device may be refused, which then asks
    for another precision.
    """
    scene = suspension()
    for tolerance in 10.0**-np.arange(1, 11):
        if tolerance < 0.9*lowestTolerance(platformName):
            break
        try:
            context, integrator = makeContext(scene, platformName, tolerance=tolerance)
        except openmm.OpenMMException as refusal:
            assert isDevice(platformName) and tolerance < 2*lowestTolerance(platformName)
            assert "double precision" in str(refusal)
            break
        error = worstError(integrator, stored(scene, context))
        hardCase.measure(**{"error/tolerance": error/tolerance})
        hardCase.least(tolerance=float(tolerance))
        assert error <= tolerance


def testUnitsOverTwelveDecades(platformName, hardCase):
    """
    The same scene in units of length, time and energy that differ by up to twelve decades: radii of 1e-4 to
    1e8 nm (among them nm and micron colloids), viscosities of 1e-6 to 1e6 of water's, temperatures of 1e-6 to
    1e6 of room temperature.

    In units of the radius and of kT two steps with noise and the product M f are the same to rounding. On
    devices no Force acts in the steps: OpenMM holds its sum as multiples of 2^-32 kJ/(mol nm), which is not
    enough for kT/a of large spheres.
    """
    scene = suspension()
    forces = scenes.randomForces(scene)

    def steps(length, viscosity, temperature):
        """Displacements in radii and velocities in D/a."""
        radius = RADIUS*length
        diffusion = KB*temperature/(6*np.pi*viscosity*radius)
        integrator = openmmpse.PSEBrownianIntegrator(temperature, viscosity, radius,
                                                     1e-3*radius**2/diffusion)
        integrator.setFluidBoundary(openmmpse.PSEBrownianIntegrator.Periodic)
        integrator.setRandomNumberSeed(9)
        integrator.setErrorTolerance(1e-4)
        there = scenes.Scene(scene.positions*length, scene.box*length, radius)
        pull = forces*KB*temperature/radius
        acting = [] if isDevice(platformName) else [scenes.constantForces(pull)]
        context = scenes.contextOn(platformName, scenes.makeSystem(there, acting), integrator, 1)
        context.setPositions(there.positions)
        velocities = np.asarray(integrator.applyMobility(pull))*radius/diffusion
        integrator.step(2)
        return (scenes.positionsOf(context) - there.positions)/radius, velocities

    usual = steps(1, scenes.ETA, 300.0)
    assert np.all(np.abs(usual[0]) < 1) and 0.3 < np.std(usual[1]) < 3
    units = [(2e-4, 1e6, 1e6), (2e8, 1e-6, 1e-6), (2e3, 1, 1)]
    if hardCase.long or not isDevice(platformName):
        units += [(2e-4, 1, 1), (2e8, 1, 1), (1, 1e-6, 1), (1, 1e6, 1), (1, 1, 1e-6), (1, 1, 1e6), (2, 1, 1),
                  (2e3, 1e3, 1e-3)]
    for length, viscosity, temperature in units:
        for name, found, expected in zip(("step", "velocity"),
                                         steps(length, scenes.ETA*viscosity, 300.0*temperature), usual):
            difference = abs(found - expected).max()
            hardCase.measure(**{f"difference of a {name}": float(difference)})
            # the second step continues from rounded coordinates, and float arithmetic rounds its own
            assert difference < 2e-5, (name, length, viscosity, temperature)


@pytest.mark.onePrecision
def testStepSizes(platformName, hardCase):
    """
    Step sizes from 1e-9 to 1 a^2/D.

    Each displacement is dt times the velocity, finite, and of the size that diffusion gives.
    """
    scene = suspension()
    diffusion = KB*300.0*scene.mu0
    for size in 10.0**np.arange(-9, 1):
        context, integrator = makeContext(scene, platformName, 300.0, size*RADIUS**2/diffusion)
        before = scenes.positionsOf(context)
        integrator.step(1)
        moved = scenes.positionsOf(context) - before
        expected = integrator.getStepSize()._value*scenes.velocitiesOf(context)
        rounding = 4*coordinateRounding(platformName)*abs(scene.positions).max()
        assert np.allclose(moved, expected, rtol=1e-5, atol=rounding)
        rms = np.sqrt(np.mean(moved**2)/(2*size))/RADIUS
        hardCase.measure(**{"largest rms/ideal": float(rms)})
        hardCase.least(**{"smallest rms/ideal": float(rms)})
        # 120 numbers of variance below that of one sphere in infinite solvent
        assert 0.4 < rms < 1.5 or rounding > 0.1*RADIUS*np.sqrt(2*size)


@pytest.mark.onePrecision
@pytest.mark.parametrize("ratio", [10, 100])
def testRadiiFarApart(platformName, ratio, hardCase):
    """
    Two radii in the ratio 1:10 and 1:100, some small spheres inside large ones and some at their
    centres.

    Errors within the tolerance of 1e-2, or a refusal that says what would help.
    """
    small = 0.1
    radii = np.array([small*ratio]*2 + [small]*10)
    scene = scenes.mixture(radii, 0.2, scenes.cube(1), 722)
    scene.positions[2] = scene.positions[0]
    scene.positions[3] = scene.positions[0] + [0.5*small*ratio, 0, 0]
    scene.positions[4] = scene.positions[1] + [small*ratio, 0, 0]
    tolerance = 1e-2
    try:
        context, integrator = makeContext(scene, platformName, 300.0, 1e-6, tolerance=tolerance)
    except openmm.OpenMMException as refusal:
        hardCase.measure(refused=str(refusal)[:120])
        assert "use" in str(refusal) or "loosen" in str(refusal)
        assert ratio > 10
        return
    error = worstError(integrator, stored(scene, context))
    hardCase.measure(**{"error/tolerance": error/tolerance})
    assert error <= tolerance
    integrator.step(2)
    assert np.all(np.isfinite(scenes.positionsOf(context)))
