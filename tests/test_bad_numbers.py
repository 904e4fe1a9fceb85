# SPDX-License-Identifier: MIT
"""
Numbers that are legal one by one and lead nowhere are refused by their own name, with the value, the limit and the
remedy, and not by what breaks later because of them.
"""
import numpy as np
import openmm
import pytest

import scenes
from openmmpse import PSEBrownianIntegrator, accuracy
from platformnames import contextOn
from scenes import ETA, makeContext, positionsOf
from test_bad_input import assertMentions, makeIntegrator, messageOf

pytestmark = pytest.mark.onePrecision
NAN, INF = float("nan"), float("inf")
TILTED = scenes.randomSuspension(6, 0.05, scenes.tilted(1), 0.5, 304)


def unchanged(context, call, *words):
    """The call is refused in these words, and nothing has moved."""
    before, steps = positionsOf(context), context.getStepCount()
    assertMentions(messageOf(call), *words)
    assert np.array_equal(positionsOf(context), before) and context.getStepCount() == steps


@pytest.mark.parametrize("value", [1e-320, 9e-16, 1.1e15, 1e200])
def testRadiiThatNoBodyHas(value):
    integrator = makeIntegrator()
    words = ("radius", f"{value:g} nm", "1e-15", "1e+15", "unit")
    assertMentions(messageOf(integrator.setRadius, value), *words)
    assertMentions(messageOf(integrator.setParticleRadius, 2, value), "particle " + words[0], *words[1:])
    assertMentions(messageOf(PSEBrownianIntegrator, 300.0, ETA, value, 1.0), *words)
    assert integrator.getRadius()._value == 0.5 and not integrator.getParticleRadii()
    for limit in (1e-15, 1e15):
        integrator.setParticleRadius(2, limit)


def testAParticleIndexBelowZero():
    assertMentions(messageOf(makeIntegrator().setParticleRadius, -1, 0.5), "index", "-1", "negative", "0")


@pytest.mark.parametrize("protocol", ["SteadyShear", "OscillatoryShear", "StartUpShear"])
def testATimeThatIsNoTime(platformName, protocol):
    """Shear flow is a function of it; without shear nobody asks."""
    def configure(i):
        i.setShearProtocol(getattr(PSEBrownianIntegrator, protocol), 40.0)
    context, integrator = makeContext(TILTED, platformName, configure=configure)
    integrator.setShearRate(0.1)
    integrator.step(2)
    for value in (NAN, INF):
        context.setTime(value)
        unchanged(context, lambda: integrator.step(1), "time", f"{value:g} ps", "finite", "setTime", "shear rate")
        assertMentions(messageOf(integrator.computeStress), "time", f"{value:g} ps", "setTime")
    context.setTime(2.0)
    integrator.step(1)
    context.setTime(NAN)
    integrator.setShearRate(0.0)
    integrator.step(1)


@pytest.mark.parametrize("rate", [2e9, -1e300])
def testAShearRateThatNoBoxFollows(platformName, rate):
    context, integrator = makeContext(TILTED, platformName)
    integrator.setShearRate(rate)
    unchanged(context, lambda: integrator.step(1), "shear rate", f"{rate:g} /ps", "strain", "1e+09", "lower",
              "smaller step")
    integrator.setShearRate(0.1)
    integrator.step(1)


def testAFlowThatCarriesParticlesAway(platformName):
    """Each step is within the limit; together they are not."""
    context, integrator = makeContext(TILTED, platformName)
    integrator.setShearRate(6e8)
    message = messageOf(integrator.step, 100)
    assertMentions(message, "from the origin", "boxes", "lower shear rate")


def testWithoutAContext():
    message = messageOf(makeIntegrator().step, 1)
    assertMentions(message, "step needs a Context", "not bound", "openmm.Context(system, integrator)")
    assert "!" not in message


# ---------------------------------------------------------------- advice on the time step

def springs(count):
    force = openmm.HarmonicBondForce()
    for i in range(count - 1):
        force.addBond(i, i + 1, 1.0, 500.0)
    return force


def pile(platformName, count):
    """A chain whose beads are all at one place."""
    s = scenes.Scene(np.zeros((count, 3)), scenes.cube(20.0), 0.5)
    return makeContext(s, platformName, 300.0, 0.05, forces=[springs(count)],
                       boundary=PSEBrownianIntegrator.Unbounded)


@pytest.mark.hostOnly
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [2, 5])
def testAdviceForBeadsAtOnePlace(platformName, count):
    """Beads part by their noise: advice as for a chain that is stretched, within what its shape changes."""
    context, integrator = pile(platformName, count)
    advice = accuracy.recommendStep(context)
    line, _ = pile(platformName, count)
    line.setPositions(np.arange(count)[:, None]*np.eye(3)[0])
    stretched = accuracy.recommendStep(line)
    assert 0.3 < advice.recommended/stretched.recommended < 3
    assert np.all(positionsOf(context) == 0)


@pytest.mark.hostOnly
def testNoAdviceWithoutPositions(platformName):
    s = scenes.Scene(np.zeros((3, 3)), scenes.cube(20.0), 0.5)
    context = contextOn(platformName, scenes.makeSystem(s, [springs(3)]), makeIntegrator())
    for call in (accuracy.recommendStep, accuracy.measure):
        with pytest.raises(accuracy.SceneError, match="positions.*setPositions"):
            call(context)
