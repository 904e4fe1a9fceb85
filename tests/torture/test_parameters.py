# SPDX-License-Identifier: MIT
"""Extreme parameters: every number that a user may set, from end to end of its range."""
import numpy as np
import openmm
import pytest

import openmmpse
import scenes
from platformnames import coordinateRounding, isDevice, lowestTolerance, served
from scenes import KB, errorOf, forceKinds, makeContext, stored

RADIUS = 0.5
SPLITS = {"Prolate": openmmpse.PSEBrownianIntegrator.Prolate,
          "Hasimoto": openmmpse.PSEBrownianIntegrator.Hasimoto}


def suspension():
    return scenes.randomSuspension(40, 0.05, scenes.cube(1), RADIUS, 721)


def worstError(integrator, here):
    return max(float(errorOf(integrator, forces, here)) for forces in forceKinds(here).values())


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize("tolerance", [1e-2, 1e-5])
def testSplittingParameter(platformName, split, tolerance, hardCase):
    """
    Splitting parameters from 0.01/a to 4/a and beyond, for either split.

    Those that the scene does not allow are refused by name; all others keep the tolerance.
    """
    scene = suspension()
    tolerance = served(platformName, tolerance)
    kept, refused = [], 0
    for xi in np.geomspace(0.005, 10, 24)/RADIUS:
        def configure(integrator):
            integrator.setSplit(SPLITS[split])
            integrator.setSplittingParameter(xi)
        try:
            context, integrator = makeContext(scene, platformName, tolerance=tolerance,
                                              configure=configure)
        except openmm.OpenMMException as refusal:
            assert any(word in str(refusal) for word in ("splitting parameter", "range")), refusal
            refused += 1
            continue
        error = worstError(integrator, stored(scene, context))
        hardCase.measure(**{"error/tolerance": error/tolerance})
        assert error <= tolerance, f"xi = {xi}"
        kept.append(float(xi*RADIUS))
    assert kept
    hardCase.measure(served=len(kept), refused=refused)
    hardCase.least(**{"smallest xi a": min(kept)})
    hardCase.measure(**{"largest xi a": max(kept)})


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


@pytest.mark.hostOnly # OpenMM's devices hold forces as multiples of 2^-32 below 2^31 kJ/(mol nm)
def testUnitsOverTwelveDecades(platformName, hardCase):
    """
    The same scene in units of length, time and energy that differ by up to twelve decades: radii
    of 1e-3 to 1e6 nm, viscosities of 1e-6 to 1e6 of water's, temperatures of 1e-6 to 1e6 K.

    In units of the radius and of kT the steps are the same to rounding.
    """
    scene = suspension()
    forces = scenes.randomForces(scene)

    def steps(length, viscosity, temperature):
        """Displacements in radii of a drift and of a step with noise, both in reduced units."""
        radius = RADIUS*length
        diffusion = KB*temperature/(6*np.pi*viscosity*radius)
        integrator = openmmpse.PSEBrownianIntegrator(temperature, viscosity, radius,
                                                     1e-3*radius**2/diffusion)
        integrator.setFluidBoundary(openmmpse.PSEBrownianIntegrator.Periodic)
        integrator.setRandomNumberSeed(9)
        integrator.setErrorTolerance(1e-4)
        there = scenes.Scene(scene.positions*length, scene.box*length, radius)
        pull = scenes.constantForces(forces*KB*temperature/radius)
        context = scenes.contextOn(platformName, scenes.makeSystem(there, [pull]), integrator, 1)
        context.setPositions(there.positions)
        integrator.step(2)
        return (scenes.positionsOf(context) - there.positions)/radius

    usual = steps(1, scenes.ETA, 300.0)
    assert np.all(np.abs(usual) < 1)
    for length, viscosity, temperature in [
            (2e-3, 1, 1), (2e6, 1, 1), (1, 1e-6, 1), (1, 1e6, 1), (1, 1, 1e-6), (1, 1, 1e6),
            (2e3, 1e3, 1e-3), (2e-3, 1e6, 1e6), (2e6, 1e-6, 1e-6)]:
        difference = abs(steps(length, scenes.ETA*viscosity, 300.0*temperature) - usual).max()
        hardCase.measure(difference=float(difference))
        # the second step continues from rounded coordinates, and float arithmetic rounds its own
        assert difference < 2e-5


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
