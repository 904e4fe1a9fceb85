# SPDX-License-Identifier: MIT
"""
Shear and boxes that move with every model of the fluid, Forces with lists of neighbours under shear,
and the law of the noise across flips.
"""
import numpy as np
import openmm
import pytest

import scenes
from openmmpse import PSEBrownianIntegrator
from oracle import forceCouplingMatrix
from scenes import KB, Scene, errorRatio, makeContext, positionsOf, randomForces

pytestmark = [pytest.mark.hostOnly, pytest.mark.onePrecision]
T, DT = 300.0, 0.2


def slightlyTilted(box):
    box = np.array(box, dtype=float)
    box[1, 0] += 1e-3*box[0, 0]
    return box


def boxOf(context):
    return np.array(context.getState().getPeriodicBoxVectors()._value)


def sheared(rate, more=None):
    def configure(i):
        i.setShearRate(rate)
        if more is not None:
            more(i)
    return configure


def forceCoupling(i):
    i.setMobilityModel(PSEBrownianIntegrator.ForceCoupling)


def mobilityOf(scene, model):
    """The oracle's."""
    if model == "force coupling":
        return forceCouplingMatrix(scene.positions, scene.box, scene.radius, scenes.ETA)
    return scene.mobility


def sceneOf(model):
    box = slightlyTilted(scenes.cube(1.0))
    if model == "mixture":
        rng = np.random.default_rng(4)
        return scenes.mixture(rng.choice([0.4, 0.5, 0.8], 20), 0.12, box, 14)
    if model == "continuous":
        return scenes.mixture(np.geomspace(0.3, 0.9, 20), 0.12, box, 15)
    return scenes.randomSuspension(12, 0.06, box, 0.5, 16)


def errorNow(context, integrator, scene, model, forces):
    """The error of velocities in units of the tolerance's promise, at this moment of a run."""
    now = Scene(positionsOf(context), boxOf(context), scene.radius, scene.radii)
    exact = (mobilityOf(now, model) @ forces.ravel()).reshape(-1, 3)
    return errorRatio(integrator.applyMobility(forces), exact, forces, now)


MODELS = ["mixture", "continuous", "force coupling"]


@pytest.mark.parametrize("model", MODELS)
def testEveryModelUnderShear(platformName, model):
    """The error keeps the tolerance at any strain and past flips, with one Plan, noise on."""
    s = sceneOf(model)
    more = forceCoupling if model == "force coupling" else None
    context, integrator = makeContext(s, platformName, T, DT, 1e-3, configure=sheared(0.9, more))
    parameters = {k: v for k, v in integrator.getNumericalParameters().items()
                  if k != "lanczosIterations"}
    forces = randomForces(s)
    for step in range(8):
        integrator.step(1)
        if step % 2 == 1:
            assert errorNow(context, integrator, s, model, forces) <= 1e-3
    assert integrator.getStrain() == pytest.approx(8*0.9*DT)
    assert parameters == {k: v for k, v in integrator.getNumericalParameters().items()
                          if k != "lanczosIterations"}


@pytest.mark.parametrize("model", MODELS)
def testEveryModelInABoxThatMoves(platformName, model):
    """Slow and sudden changes, of size and shape: always the error of the box of the moment."""
    s = sceneOf(model)
    configure = forceCoupling if model == "force coupling" else None
    context, integrator = makeContext(s, platformName, T, DT, 1e-3, configure=configure)
    forces = randomForces(s)
    for factor in (1.005, 0.99, np.array([1.02, 0.985, 1.0]), 1.3):
        box = s.box*factor
        context.setPeriodicBoxVectors(*box)
        context.setPositions(s.positions @ np.linalg.inv(s.box) @ box)
        integrator.step(1)
        assert errorNow(context, integrator, s, model, forces) <= 1e-3


def assertRestartIsExact(make, before, after):
    """A new Context that loads a checkpoint continues a sheared run to the bit, its strain as well."""
    context, integrator = make()
    integrator.step(before)
    saved = context.createCheckpoint()
    integrator.step(after)
    other, again = make()
    other.loadCheckpoint(saved)
    again.step(after)
    assert np.array_equal(positionsOf(other), positionsOf(context))
    assert again.getStrain() == integrator.getStrain() != 0


@pytest.mark.parametrize("model", ["mixture", "force coupling"])
def testRestartOfEveryModelUnderShear(platformName, model):
    """To the bit, past a flip."""
    s = sceneOf(model)
    more = forceCoupling if model == "force coupling" else None

    def make():
        return makeContext(s, platformName, T, DT, 1e-3, seed=31, configure=sheared(0.9, more))
    assertRestartIsExact(make, 2, 3)


@pytest.mark.parametrize("model", ["equal", *MODELS])
def testNoiseLawAcrossAFlip(platformName, model):
    """
    A strain from 0.49 to 0.51 leaves the box at -0.49: the same lattice with other labels of its
    waves. The covariance of displacements before and after is that of the exact mobility of the
    lattice at 0.49 and, not reduced, at 0.51.
    """
    count = 2500
    radii = {"mixture": [0.5, 0.8, 0.5, 0.8], "continuous": [0.4, 0.5, 0.65, 0.9]}.get(model)
    s = scenes.mixture(radii or [0.5]*4, 0.04, scenes.cube(1.0), 8, apart=True)
    s = Scene(s.positions, s.box, s.radius, s.radii if radii else None)
    L = s.box[0, 0]

    def strained(strain):
        map = np.array([[1, 0, 0], [strain, 1, 0], [0, 0, 1]])
        return Scene(s.positions @ map, s.box @ map, s.radius, s.radii)
    more = forceCoupling if model == "force coupling" else None
    context, integrator = makeContext(strained(0.49), platformName, 0.0, 1.0, 1e-4,
                                      configure=sheared(0.02, more))
    for strain, tilt in ((0.49, 0.49), (0.51, -0.49)):
        assert boxOf(context)[1, 0] == pytest.approx(tilt*L, rel=1e-9)
        assert np.allclose(positionsOf(context), strained(strain).positions, rtol=0, atol=1e-9)
        integrator.setTemperature(T)
        samples = integrator.sampleBrownianDisplacements(count).reshape(count, -1)
        law = 2*KB*T*mobilityOf(strained(strain), model)
        scenes.assertUnitCovariance(scenes.whiten(samples, law), f"noise at {strain}", tests=2)
        integrator.setTemperature(0)
        integrator.step(1)


# ---------------------------------------------------------------- Forces with lists of neighbours

def manyBodies(N, seed):
    """Custom and standard non-bonded Forces of different cut-offs, on a scene in random order."""
    s = scenes.randomSuspension(N, 0.25, slightlyTilted([[1.3, 0, 0], [0, 1, 0], [0, 0, 1]]), 0.5, seed)
    custom = openmm.CustomNonbondedForce("200*step(s-r)*(s-r)^2; s=1.05")
    custom.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    nonbonded = openmm.NonbondedForce()
    nonbonded.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
    for i in range(N):
        custom.addParticle([])
        nonbonded.addParticle(0.1*(-1)**i, 0.8, 1.0)
    for force in (custom, nonbonded):
        force.setCutoffDistance(1.5)
    return s, [custom, nonbonded]


def assertForcesOfAFreshContext(context, fresh, tolerance=2e-5):
    fresh.setPeriodicBoxVectors(*boxOf(context))
    fresh.setPositions(positionsOf(context))
    expected, found = scenes.forcesOf(fresh), scenes.forcesOf(context)
    assert abs(found - expected).max() <= tolerance*abs(expected).max()


@pytest.mark.parametrize("rate, temperature", [(0.01, T), (0.1, T), (-0.4, T), (0.4, 0.0)])
def testForcesOfALongShearedRun(platformName, rate, temperature):
    """
    200 steps on the CPU platform, slow and fast, past flips, with and without noise: displacements of the run are those
    of Reference's forces. What a step uses shows in the path alone: at zero temperature the
    velocity of each step is M f of Reference's forces at its beginning, f to single precision.
    """
    N, parts = (150, 20) if platformName == "CPU" else (30, 2)  # Reference sums over all pairs
    s, forces = manyBodies(N, 9)
    context, integrator = makeContext(s, platformName, temperature, DT, forces=forces,
                                      configure=sheared(rate))
    _, same = manyBodies(N, 9)
    reference, oracle = makeContext(s, "Reference", forces=same, configure=lambda i: i.setMobilityModel(
        PSEBrownianIntegrator.FreeDraining))
    for part in range(parts):
        integrator.step(9)
        assertForcesOfAFreshContext(context, reference)
        before, box = positionsOf(context), boxOf(context)
        if temperature == 0:
            u = integrator.applyMobility(scenes.forcesOf(reference))
        integrator.step(1)
        if temperature == 0:
            flow = rate*DT*before[:, 1:2]*np.array([1, 0, 0])
            moved = positionsOf(context) - before - flow
            assert abs(moved - DT*u).max() <= 1e-4*abs(DT*u).max() + 1e-12*abs(before).max()
    assert abs(integrator.getStrain()) == pytest.approx(10*parts*abs(rate)*DT)


def testPositionsSetDuringAShearedRun(platformName):
    """Positions and box brought back to an earlier moment: forces are those of that moment."""
    s, forces = manyBodies(100 if platformName == "CPU" else 30, 3)
    context, integrator = makeContext(s, platformName, T, DT, forces=forces, configure=sheared(0.2))
    integrator.step(5)
    then, box, expected = positionsOf(context), boxOf(context), scenes.forcesOf(context)
    integrator.step(60)
    assert abs(scenes.forcesOf(context) - expected).max() > 0.1*abs(expected).max()
    context.setPeriodicBoxVectors(*box)
    context.setPositions(then)
    assert abs(scenes.forcesOf(context) - expected).max() <= 2e-5*abs(expected).max()
    integrator.step(1)


def testRestartWithListsOfNeighbours(platformName):
    """To the bit, though lists last for several steps: both runs begin with one."""
    def make():
        s, forces = manyBodies(150 if platformName == "CPU" else 30, 9)
        return makeContext(s, platformName, T, DT, forces=forces, configure=sheared(0.05))
    assertRestartIsExact(make, 13, 20)
