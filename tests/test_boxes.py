# SPDX-License-Identifier: MIT
"""Boxes that change between steps: by the user, by a barostat; with hysteresis [T37]."""
import numpy as np
import openmm
import pytest
from scipy import stats

import scenes
from openmmpse import PSEBrownianIntegrator
from scenes import FALSE_ALARM, KB, Scene, errorRatio, makeContext, positionsOf, randomForces

pytestmark = pytest.mark.onePrecision
T, DT = 300.0, 0.5
PLAN = ("split", "xi", "realCutoff", "gridDimensions", "windowSupport", "windowShape")


def suspension(N=24, box=None, seed=6):
    return scenes.randomSuspension(N, 0.1, scenes.cube(1.0) if box is None else box, 0.5, seed)


def planOf(integrator):
    parameters = integrator.getNumericalParameters()
    return tuple(parameters[key] for key in PLAN)


def moveBox(context, scene, factor):
    """Box and positions scaled by one factor, or one for each axis."""
    box = scene.box*factor
    now = Scene(scene.positions @ np.linalg.inv(scene.box) @ box, box, scene.radius)
    context.setPeriodicBoxVectors(*box)
    context.setPositions(now.positions)
    return now


def isotropicBarostat(pressure, frequency=1, seed=5):
    force = openmm.MonteCarloBarostat(pressure, T, frequency)
    force.setRandomNumberSeed(seed)
    return force


# ---------------------------------------------------------------- the same Plan, the new box

@pytest.mark.parametrize("split", [PSEBrownianIntegrator.Prolate, PSEBrownianIntegrator.Hasimoto])
def testABreathingBoxKeepsItsPlan(platformName, split):
    """After the first small change nothing is planned anew, and each box has its own velocities."""
    s = suspension()
    tolerance = 1e-3 if "single" in platformName else 1e-4
    context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                      configure=lambda i: i.setSplit(split))
    static = planOf(integrator)
    forces = randomForces(s)
    plans = []
    for step, factor in enumerate((1.004, 1.02, 0.99, np.array([1.01, 0.985, 1.02]), 0.98, 1.0)):
        now = moveBox(context, s, factor)
        u = integrator.applyMobility(forces)
        assert errorRatio(u, now.velocities(forces), forces, now) <= tolerance
        integrator.step(1)
        plans.append(planOf(integrator))
    assert len(set(plans)) == 1 and plans[0] != static
    # far away it is planned anew, for that box alone
    now = moveBox(context, s, 1.5)
    u = integrator.applyMobility(forces)
    assert errorRatio(u, now.velocities(forces), forces, now) <= tolerance
    other, fresh = makeContext(now, platformName, tolerance=tolerance,
                               configure=lambda i: i.setSplit(split))
    assert planOf(integrator) == planOf(fresh)


@pytest.mark.onePrecision
def testASlowDriftIsFollowedInFewPlans(platformName):
    """100 boxes, each larger by 0.3 %: the promise is kept, with a Plan for about every ten."""
    s = suspension()
    context, integrator = makeContext(s, platformName, tolerance=1e-3)
    forces = randomForces(s)
    plans = []
    for step in range(100):
        now = moveBox(context, s, 1.003**(step + 1))
        u = integrator.applyMobility(forces)
        plans.append(integrator.getNumericalParameters()["xi"])
        if step % 9 == 0:
            assert errorRatio(u, now.velocities(forces), forces, now) <= 1e-3
    changes = np.count_nonzero(np.diff(plans))
    assert 5 <= changes <= 20


@pytest.mark.onePrecision
def testABoxTooSmallForImagesOfNeighbours(platformName):
    """A moving box whose range exceeds half of it: images are summed, and follow."""
    s = scenes.pair(1.2, 3.0, 0.5)
    context, integrator = makeContext(s, platformName, tolerance=1e-3)
    forces = randomForces(s)
    for factor in (1.01, 0.99, np.array([1.02, 1.0, 0.985])):
        now = moveBox(context, s, factor)
        u = integrator.applyMobility(forces)
        assert errorRatio(u, now.velocities(forces), forces, now) <= 1e-3


def testRefusedChangesLeaveTheOldState(platformName):
    """What cannot be planned is refused: nothing moves, no counter counts, the old box goes on."""
    s = suspension()
    paths = []
    for disturb in (False, True):
        context, integrator = makeContext(s, platformName, T, DT, seed=9,
                                          configure=lambda i: i.setSplittingParameter(0.6))
        integrator.step(2)
        if disturb:
            before, plan = positionsOf(context), planOf(integrator)
            for bad in (scenes.cube(0.02), scenes.cube(2.5e5)):
                context.setPeriodicBoxVectors(*bad)
                with pytest.raises(openmm.OpenMMException, match="box"):
                    integrator.step(1)
                assert planOf(integrator) == plan and context.getStepCount() == 2
            context.setPeriodicBoxVectors(*s.box)
            assert np.allclose(positionsOf(context), before, rtol=0, atol=1e-5)
            context.setPositions(before)
        integrator.step(2)
        paths.append(positionsOf(context))
    assert np.allclose(*paths, rtol=0, atol=1e-4 if "single" in platformName else 1e-7)


@pytest.mark.parametrize("way", ["checkpoint", "state"])
def testRestartInABreathingBox(platformName, way):
    """The Plan is that of a box long gone; a restart knows it, and goes on to the bit."""
    s = suspension()

    def make():
        return makeContext(s, platformName, T, DT, seed=12)
    context, integrator = make()
    for factor in (1.01, 1.02, 0.995):
        context.setPeriodicBoxVectors(*(factor*s.box))
        integrator.step(2)
    if way == "checkpoint":
        saved = context.createCheckpoint()
    else:
        state = context.getState(positions=True, velocities=True, parameters=True,
                                 integratorParameters=True)
        saved = openmm.XmlSerializer.serialize(state)
    integrator.step(3)
    other, fresh = make()
    if way == "checkpoint":
        other.loadCheckpoint(saved)
    else:
        other.setState(openmm.XmlSerializer.deserialize(saved))
    fresh.step(3)
    static, still = make()
    assert planOf(fresh) == planOf(integrator) != planOf(still)
    assert np.array_equal(positionsOf(other), positionsOf(context))


@pytest.mark.onePrecision
@pytest.mark.parametrize("way", ["checkpoint", "state"])
def testABoxSetAroundARestart(platformName, way):
    """
    Whether a box moves or is another one counts from the last step, which a restart remembers: here the
    second one is a small change of the first, which no step has seen, and none of that before.
    """
    s = suspension()
    context, integrator = makeContext(s, platformName, T, DT, seed=12)
    integrator.step(2)
    context.setPeriodicBoxVectors(*(1.01*s.box))
    if way == "checkpoint":
        saved = context.createCheckpoint()
    else:
        saved = context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
        saved = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(saved))
    other, fresh = makeContext(s, platformName, T, DT, seed=12)
    if way == "checkpoint":
        other.loadCheckpoint(saved)
    else:
        other.setState(saved)
    for one, steps in ((context, integrator), (other, fresh)):
        one.setPeriodicBoxVectors(*(1.105*s.box))
        steps.step(3)
    assert planOf(fresh) == planOf(integrator)
    assert np.array_equal(positionsOf(other), positionsOf(context))


# ---------------------------------------------------------------- barostats

@pytest.mark.hostOnly
def testVolumeOfAnIdealGas(platformName):
    """
    With no forces the volume has the density V^N exp(-P V/kT): a gamma distribution of order N + 1
    and mean (N + 1) kT/P. Samples far apart against the correlation time (their lag-one correlation
    is checked) are independent; their sum is a gamma variable of order n (N + 1), two-sided. The
    fluid is planned anew far more rarely than the box moves.
    """
    N, n, apart = (400, 50, 15) if platformName == "CPU" else (60, 12, 15)
    volume = 6.25*N
    pressure = (N + 1)*KB*T/volume/0.06022140857  # bar
    s = scenes.idealGas(N, N*4*np.pi/3*0.3**3/volume, scenes.cube(1.0), 0.3, 2)
    context, integrator = makeContext(
        s, platformName, T, DT, seed=3,
        forces=[scenes.periodicDummyForce(N, s.box*0.5), isotropicBarostat(pressure)],
        configure=lambda i: i.setErrorTolerance(1e-2))
    assert "MonteCarloBarostat" in integrator.describe()
    integrator.step(100)
    volumes, plans = [], set()
    for _ in range(n):
        integrator.step(apart)
        volumes.append(context.getState().getPeriodicBoxVolume()._value)
        plans.add(planOf(integrator))
    volumes = np.array(volumes)
    deviations = volumes - volumes.mean()
    correlation = deviations[1:] @ deviations[:-1]/(deviations @ deviations)
    if n >= 50:  # fewer samples could not tell
        assert abs(correlation) < stats.norm.isf(FALSE_ALARM/2)/np.sqrt(n)
    total = volumes.sum()*(N + 1)/volume
    distribution = stats.gamma(n*(N + 1))
    assert distribution.cdf(total) > FALSE_ALARM/2 and distribution.sf(total) > FALSE_ALARM/2
    assert len(plans) <= n/2


@pytest.mark.onePrecision
@pytest.mark.parametrize("barostat", [
    lambda: openmm.MonteCarloAnisotropicBarostat([200.0]*3, T, True, True, True, 2),
    lambda: openmm.MonteCarloFlexibleBarostat(200.0, T, 2),
    lambda: openmm.MonteCarloMembraneBarostat(200.0, 0.0, T,
                                              openmm.MonteCarloMembraneBarostat.XYIsotropic,
                                              openmm.MonteCarloMembraneBarostat.ZFree, 2)])
def testEveryBarostat(platformName, barostat):
    """The velocities after its moves are those of the box it has made."""
    s = suspension()
    context, integrator = makeContext(s, platformName, T, DT, tolerance=1e-3,
                                      forces=[scenes.periodicDummyForce(s.count, s.box), barostat()])
    integrator.step(30)
    box = np.array(context.getState().getPeriodicBoxVectors()._value)
    assert abs(box - s.box).max() > 1e-4
    now = Scene(positionsOf(context), box, s.radius)
    forces = randomForces(s)
    u = integrator.applyMobility(forces)
    assert errorRatio(u, now.velocities(forces), forces, now) <= 1e-3
