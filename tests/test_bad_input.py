# SPDX-License-Identifier: MIT
"""
Bad input is refused with a message that names the value or the setter and says what to do instead,
and nothing is lost: after a refused setting the old one holds, after a refused step positions, time
and step count are what they were, and the Context goes on once the cause is removed.
"""

import numpy as np
import openmm
import pytest
from openmm import unit

from openmmpse import PSEBrownianIntegrator
import scenes
from platformnames import contextOn, isDevice, velocityRounding
from scenes import ETA, makeContext, makeSystem, positionsOf

pytestmark = pytest.mark.onePrecision

PERIODIC = PSEBrownianIntegrator.Periodic
NAN, INF = float("nan"), float("inf")
VISCOSITY_UNIT = unit.dalton/(unit.nanometer*unit.picosecond)


def makeIntegrator():
    integrator = PSEBrownianIntegrator(300.0, ETA, 0.5, 1.0)
    integrator.setFluidBoundary(PERIODIC)
    return integrator


def suspension():
    return scenes.randomSuspension(6, 0.05, scenes.cube(1), 0.5, 301)


def messageOf(call, *args, kinds=(openmm.OpenMMException,)):
    """What the call says when it refuses."""
    with pytest.raises(kinds) as caught:
        call(*args)
    return str(caught.value)


def assertMentions(message, *words):
    for word in words:
        assert word.lower() in message.lower(), f"{word!r} is missing in: {message}"


def refusal(platformName, configure=None, system=None):
    """The message with which Context creation is refused."""
    integrator = makeIntegrator()
    if configure is not None:
        configure(integrator)
    system = makeSystem(suspension()) if system is None else system
    return messageOf(contextOn, platformName, system, integrator)


# ---------------------------------------------------------------- values

@pytest.mark.parametrize("position, name, values", [
    (0, "temperature", [-1.0, -1e-9, NAN, INF]), (1, "viscosity", [0.0, -602.0, NAN, INF]),
    (2, "radius", [0.0, -0.5, NAN, INF]), (3, "step size", [0.0, -1.0, NAN, INF])])
def testConstructorValues(position, name, values):
    for value in values:
        arguments = [300.0, ETA, 0.5, 1.0]
        arguments[position] = value
        assertMentions(messageOf(PSEBrownianIntegrator, *arguments), name, f"{value:g}", "must be")


@pytest.mark.parametrize("name, setter, values", [
    ("Temperature", "setTemperature", [-1.0, NAN, INF]),
    ("Viscosity", "setViscosity", [0.0, -602.0, NAN, INF]),
    ("Radius", "setRadius", [0.0, -0.5, NAN, INF]),
    ("StepSize", "setStepSize", [0.0, -1.0, NAN, INF]),
    ("ErrorTolerance", "setErrorTolerance", [0.0, 9e-11, 0.11, -1e-3, NAN, INF]),
    ("MobilityModel", "setMobilityModel", [-1, 3]), ("FluidBoundary", "setFluidBoundary", [-1, 3]),
    ("Split", "setSplit", [-1, 4]),
    ("SplittingParameter", "setSplittingParameter", [-1.0, NAN, INF]),
    ("WindowSupport", "setWindowSupport", [-1, 1, 2, 17]),
    ("ShearRate", "setShearRate", [NAN, INF])])
def testSettersKeepTheOldValue(name, setter, values):
    integrator = makeIntegrator()
    before = getattr(integrator, "get" + name)()
    for value in values:
        assertMentions(messageOf(getattr(integrator, setter), value), f"{value:g}", "must")
        assert getattr(integrator, "get" + name)() == before


def testTheToleranceMessageGivesTheRange():
    integrator = makeIntegrator()
    for value in (1e-11, 0.2):
        assertMentions(messageOf(integrator.setErrorTolerance, value), "tolerance", f"{value:g}",
                       "1e-10", "0.1")
    for value in (1e-10, 1e-1):
        integrator.setErrorTolerance(value)


def testGridDimensions():
    integrator = makeIntegrator()
    for grid in ((0, 8, 8), (-8, 8, 8), (8, 8, 2), (8, 8, 100000)):
        bad = next(n for n in grid if not 3 <= n <= 32768)
        assertMentions(messageOf(integrator.setGridDimensions, *grid), "grid dimension", str(bad))
        assert tuple(integrator.getGridDimensions()) == (0, 0, 0)


def testParticleRadii():
    integrator = makeIntegrator()
    for value in (0.0, -1.0, NAN):
        assertMentions(messageOf(integrator.setParticleRadius, 2, value), "radius", f"{value:g}")
    assertMentions(messageOf(integrator.setParticleRadius, -1, 0.5), "index", "-1")
    assert not integrator.getParticleRadii()


def testRadiusOfAParticleThatDoesNotExist(platformName):
    message = refusal(platformName, lambda i: i.setParticleRadius(6, 0.5))
    assertMentions(message, "setParticleRadius", "particle 6", "0 to 5")


def testNumericalParameters():
    """One bad entry, and none is taken over."""
    integrator = makeIntegrator()
    good = {"xi": 1.0, "gridDimensions": (16, 16, 16), "windowSupport": 5, "realCutoff": 2.0}
    for key, value in (("xi", -1.0), ("gridDimensions", (16, 0, 16)), ("windowSupport", 40),
                       ("realCutoff", -2.0), ("windowShape", NAN), ("lanczosTolerance", 2.0),
                       ("split", "Ewald"), ("prolateBandwidth", 2.9), ("prolateBandwidth", 30.1),
                       ("prolateBandwidth", NAN)):
        messageOf(integrator.setNumericalParameters, {**good, key: value})
        assert integrator.getSplittingParameter()._value == 0 and integrator.getWindowSupport() == 0
        assert tuple(integrator.getGridDimensions()) == (0, 0, 0)
    unknown = {**good, "cutoff": 2.0}
    message = messageOf(integrator.setNumericalParameters, unknown, kinds=ValueError)
    assertMentions(message, "cutoff")


# ---------------------------------------------------------------- units and array shapes

@pytest.mark.parametrize("call, words", [
    (lambda i: i.setTemperature(300*unit.nanometer), ["temperature", "kelvin"]),
    (lambda i: i.setViscosity(1.0*unit.picosecond), ["viscosity"]),
    (lambda i: i.setRadius(0.5*unit.kelvin), ["radius", "nanometer"]),
    (lambda i: i.setStepSize(0.5*unit.nanometer), ["picosecond"]),
    (lambda i: i.setParticleRadius(0, 1*unit.dalton), ["radius", "nanometer"]),
    (lambda i: i.setErrorTolerance(1e-3*unit.nanometer), ["tolerance"]),
    (lambda i: i.setSplittingParameter(1*unit.nanometer), ["xi", "nanometer"]),
    (lambda i: i.setShearRate(1*unit.picosecond), ["rate"]),
    (lambda i: i.setTemperature("warm"), ["temperature", "warm"]),
    (lambda i: i.setGridDimensions(8, 8.5, 8), ["8.5"]),
    (lambda i: i.setRandomNumberSeed(1.5), ["seed", "1.5"]),
    (lambda i: PSEBrownianIntegrator(1*unit.nanometer, ETA, 0.5, 1.0), ["temperature", "kelvin"]),
    (lambda i: PSEBrownianIntegrator(300, ETA, 0.5*unit.dalton, 1.0), ["radius", "nanometer"])])
def testUnitsOfTheWrongDimension(call, words):
    integrator = makeIntegrator()
    before = openmm.XmlSerializer.serialize(integrator)
    assertMentions(messageOf(call, integrator, kinds=TypeError), *words)
    assert openmm.XmlSerializer.serialize(integrator) == before


def testUnitsAreConverted():
    """The same physics in other units: angstrom, femtosecond, pascal second."""
    integrator = PSEBrownianIntegrator(300*unit.kelvin, 1.002e-3*unit.pascal*unit.second,
                                       5*unit.angstrom, 2000*unit.femtosecond)
    viscosity = integrator.getViscosity().value_in_unit(VISCOSITY_UNIT)
    assert viscosity == pytest.approx(603.4186, rel=1e-5)
    assert integrator.getRadius().value_in_unit(unit.nanometer) == pytest.approx(0.5, rel=1e-12)
    assert integrator.getStepSize().value_in_unit(unit.picosecond) == pytest.approx(2.0, rel=1e-12)
    assert integrator.getTemperature().value_in_unit(unit.kelvin) == 300


@pytest.mark.onePlatform
@pytest.mark.parametrize("forces", [
    np.zeros((5, 3)), np.zeros((7, 3)), np.zeros((6, 2)), np.zeros(18), np.zeros((1, 6, 3)),
    np.zeros((0, 3)), [], 1.0, [[0, 0, 0]]*5 + [[0, 0]], [["a", "b", "c"]]*6])
def testShapesOfForces(platformName, forces):
    context, integrator = makeContext(suspension(), platformName)
    message = messageOf(integrator.applyMobility, forces,
                        kinds=(ValueError, openmm.OpenMMException))
    assertMentions(message, "forces", "(6, 3)")


@pytest.mark.onePlatform
def testForcesOfTheWrongDimension(platformName):
    context, integrator = makeContext(suspension(), platformName)
    forces = np.zeros((6, 3))*unit.nanometer
    assertMentions(messageOf(integrator.applyMobility, forces, kinds=TypeError), "forces")
    good = np.ones((6, 3))
    inCalories = good/4.184*unit.kilocalorie_per_mole/unit.nanometer
    assert np.allclose(integrator.applyMobility(inCalories), integrator.applyMobility(good),
                       rtol=1e-6)


def testNonFiniteForcesGiven(platformName):
    context, integrator = makeContext(suspension(), platformName)
    forces = np.ones((6, 3))
    forces[4, 1] = NAN
    forces[5, 0] = INF
    message = messageOf(integrator.applyMobility, forces,
                        kinds=(ValueError, openmm.OpenMMException))
    assertMentions(message, "particle 4", "nan", "finite")


@pytest.mark.onePlatform
def testNumberOfSamples(platformName):
    context, integrator = makeContext(suspension(), platformName, 300.0)
    assertMentions(messageOf(integrator.sampleBrownianDisplacements, -1), "-1", "negative")
    messageOf(integrator.sampleBrownianDisplacements, 1.5, kinds=TypeError)


# ---------------------------------------------------------------- what is not there yet

def addConstraint(system):
    system.addConstraint(0, 1, 1.0)
    return system


def testForceCouplingWhereItIsNotAvailable(platformName):
    def forceCoupling(integrator):
        integrator.setMobilityModel(PSEBrownianIntegrator.ForceCoupling)
        integrator.setParticleRadius(3, 0.7)
    assertMentions(refusal(platformName, forceCoupling), "PSEBrownianIntegrator",
                   "setParticleRadius", "particle 3", "0.7", "0.5", "RotnePragerYamakawa",
                   "Unbounded")


@pytest.mark.hostOnly
@pytest.mark.parametrize("parameters, words", [
    ({"xi": 1.0}, ["range of 1 nm", "below", "1.7", "tolerance 0.001", "smaller splitting"]),
    ({"realCutoff": 1.1}, ["range of 1.1 nm", "below", "looser tolerance"]),
    ({"xi": 0.01}, ["range of 100 nm", "0.499", "smallest box width", "larger box"]),
    ({"xi": 0.5, "realCutoff": 2.1}, ["0.5 /nm", "2.1 nm", "not those of one prolate range"]),
    ({"xi": 0.5, "prolateBandwidth": 29.0}, ["bandwidth of 29", "negative", "prolateBandwidth 0"]),
    ({"xi": 0.45, "prolateBandwidth": 3.0}, ["bandwidth of 3", "error", "larger bandwidth"])])
def testProlateSplitWhereItIsNotValid(platformName, parameters, words):
    """The value, the limit and the remedy; and without setSplit the other split takes over."""
    s = scenes.randomSuspension(30, 0.1, scenes.cube(1), 0.5, 75)

    def configure(i, split):
        i.setNumericalParameters(parameters)
        i.setSplit(split)
    message = messageOf(lambda: makeContext(s, platformName, configure=lambda i: configure(
        i, PSEBrownianIntegrator.Prolate)))
    assertMentions(message, "PSEBrownianIntegrator", *words, "AutomaticSplit", "Hasimoto")
    if parameters.get("xi") == 0.01:
        return
    context, integrator = makeContext(s, platformName, configure=lambda i: configure(
        i, PSEBrownianIntegrator.AutomaticSplit))
    assert integrator.getNumericalParameters()["split"] == "Hasimoto"
    assertMentions(integrator.describe(), "Hasimoto split, because", *words[:1])


def testProlateSplitInABoxTooSmallForIt(platformName):
    s = scenes.Scene(np.zeros((1, 3)), scenes.cube(3.0), 0.5)
    message = messageOf(lambda: makeContext(
        s, platformName, tolerance=1e-6,
        configure=lambda i: i.setSplit(PSEBrownianIntegrator.Prolate)))
    assertMentions(message, "1e-06", "range of at least", "0.499", "3 nm", "larger box")


def testBandwidthOfAnotherSplit():
    integrator = makeIntegrator()
    message = messageOf(integrator.setNumericalParameters,
                        {"split": "Hasimoto", "prolateBandwidth": 9.0})
    assertMentions(message, "prolateBandwidth", "Hasimoto", "Prolate")


def testConstraints(platformName):
    message = refusal(platformName, system=addConstraint(makeSystem(suspension())))
    assertMentions(message, "constraint", "1", "bonds")


def testSystemWithoutParticles(platformName):
    assertMentions(refusal(platformName, system=openmm.System()), "no particles")


def testARefusedIntegratorCanBeUsedAfterRepair(platformName):
    """Nothing is half bound: the same integrator serves once the cause is removed."""
    s = suspension()
    integrator = makeIntegrator()
    messageOf(contextOn, platformName, addConstraint(makeSystem(s)), integrator)
    messageOf(integrator.step, 1)
    context = contextOn(platformName, makeSystem(s), integrator)
    context.setPositions(s.positions)
    start = positionsOf(context)
    integrator.step(1)
    assert np.all(positionsOf(context) != start)


def testFreeDrainingNeedsNoFluid(platformName):
    """What only a fluid cannot do is not refused without one: unequal radii, no periodic box."""
    s = suspension()

    def configure(i):
        i.setMobilityModel(PSEBrownianIntegrator.FreeDraining)
        i.setParticleRadius(2, 1.5)

    context, integrator = makeContext(s, platformName, configure=configure,
                                      boundary=PSEBrownianIntegrator.Automatic)
    u = integrator.applyMobility(np.ones((6, 3)))
    expected = np.full((6, 3), s.mu0)
    expected[2] /= 3
    assert np.allclose(u, expected, rtol=velocityRounding(platformName))


# ---------------------------------------------------------------- boxes and grids

@pytest.mark.parametrize("value", [NAN, INF])
def testBoxThatIsNotFinite(platformName, value):
    """In the System, and set later: refused by name, and the Context goes on with a good box."""
    s = suspension()
    L = s.box[0, 0]
    bad = [openmm.Vec3(L, 0, 0), openmm.Vec3(0, L, 0), openmm.Vec3(0, 0, value)]
    system = makeSystem(s)
    try:
        system.setDefaultPeriodicBoxVectors(*bad)
    except openmm.OpenMMException:
        pass                                   # OpenMM itself may refuse; the good box then remains
    else:
        assertMentions(refusal(platformName, system=system), "box", "finite")
    context, integrator = makeContext(s, platformName, 300.0)
    start = positionsOf(context)
    try:
        context.setPeriodicBoxVectors(*bad)
    except openmm.OpenMMException:
        pass
    else:
        for call, argument in ((integrator.step, 1), (integrator.applyMobility, np.ones((6, 3))),
                               (integrator.sampleBrownianDisplacements, 1)):
            assertMentions(messageOf(call, argument), "box", "finite")
        assert context.getStepCount() == 0
    context.setPeriodicBoxVectors(*s.box)  # first: on devices OpenMM reads positions by way of it
    assert np.array_equal(positionsOf(context), start)
    integrator.step(1)
    assert np.all(np.isfinite(positionsOf(context))) and context.getStepCount() == 1


def testGridBeyondMemory():
    """Far too fine a grid: the grid, the memory and the remedy are named, and quickly."""
    s = suspension()
    huge = scenes.Scene(s.positions, scenes.cube(4000.0), s.radius)
    integrator = makeIntegrator()
    integrator.setSplittingParameter(3.0)
    message = messageOf(contextOn, "CPU", makeSystem(huge), integrator)
    assertMentions(message, "grid", "splitting parameter", "box")
    integrator = makeIntegrator()
    integrator.setGridDimensions(16384, 16384, 16384)
    message = messageOf(contextOn, "CPU", makeSystem(s), integrator)
    assertMentions(message, "16384 x 16384 x 16384", "GB", "memory")


def testVolumeFractionBeyondSense(platformName):
    """Many particles in a box much smaller than a radius."""
    crowd = scenes.Scene(np.zeros((1000, 3)), scenes.cube(0.06), 0.5)
    message = messageOf(contextOn, platformName, makeSystem(crowd), makeIntegrator())
    assertMentions(message, "volume fraction", "limit is 100", "larger box")


def testNeighboursBeyondMemory(platformName):
    """A range over many neighbours, images included: more pairs than memory holds."""
    crowd = scenes.Scene(np.zeros((20000, 3)), scenes.cube(33.0), 0.5)
    integrator = makeIntegrator()
    integrator.setSplittingParameter(0.04)
    message = messageOf(contextOn, platformName, makeSystem(crowd), integrator)
    assertMentions(message, "neighbours", "GB")


def testImagesBeyondCounting(platformName):
    """A range over a million images of the box."""
    few = scenes.Scene(np.zeros((3, 3)), scenes.cube(10.0), 0.5)
    integrator = makeIntegrator()
    integrator.setSplittingParameter(2e-6)
    message = messageOf(contextOn, platformName, makeSystem(few), integrator)
    assertMentions(message, "2e-06", "images", "larger splitting parameter")


def testPositionLostToRounding(platformName):
    s = suspension()
    context, integrator = makeContext(s, platformName, 300.0)
    far = s.positions.copy()
    far[2, 1] = 1e20 if isDevice(platformName) else 1e200  # finite as a float, too
    context.setPositions(far)
    for call, argument in ((integrator.step, 1), (integrator.applyMobility, np.ones((6, 3)))):
        assertMentions(messageOf(call, argument), "particle 2", f"{far[2, 1]:g}", "rounding")
    context.setPositions(s.positions)
    integrator.step(1)


@pytest.mark.parametrize("edge", [0.049, 1e-3, 1e-9])
def testBoxBelowATenthOfTheRadius(platformName, edge):
    tiny = scenes.Scene(np.zeros((1, 3)), scenes.cube(edge), 0.5)
    message = messageOf(contextOn, platformName, makeSystem(tiny), makeIntegrator())
    assertMentions(message, f"{edge:g} nm", "radius", "larger box")


def testBoxThatGrowsBeyondMemory():
    """Set between steps: the step is refused, nothing has moved, and the old box still works."""
    s = suspension()
    context, integrator = makeContext(s, "CPU", 300.0,
                                      configure=lambda i: i.setSplittingParameter(3.0))
    integrator.step(1)
    before = positionsOf(context)
    context.setPeriodicBoxVectors(*scenes.cube(4000.0))
    assertMentions(messageOf(integrator.step, 1), "grid", "box")
    assert np.array_equal(positionsOf(context), before) and context.getStepCount() == 1
    context.setPeriodicBoxVectors(*s.box)
    integrator.step(1)
    assert context.getStepCount() == 2


def testBoxThatCannotBeMeant(platformName):
    """A thousandth of a radius: a mistake of units, not a crystal."""
    system = makeSystem(scenes.Scene(suspension().positions, scenes.cube(4e-4), 0.5))
    assertMentions(refusal(platformName, system=system), "box", "radius", "0.0004", "larger")


def testGridSmallerThanTheWindow(platformName):
    def configure(i):
        i.setGridDimensions(4, 16, 16)
        i.setWindowSupport(6)
    assertMentions(refusal(platformName, configure), "4", "window support 6", "setWindowSupport")


# ---------------------------------------------------------------- positions and forces

def stateOf(context):
    return positionsOf(context), context.getTime()._value, context.getStepCount()


def assertSameState(first, second):
    assert np.array_equal(first[0], second[0], equal_nan=True) and first[1:] == second[1:]


@pytest.mark.parametrize("value", [NAN, INF, -INF])
def testNonFinitePositions(platformName, value):
    """The first bad particle is named, by every method, before any Force or Lanczos is blamed."""
    s = suspension()
    context, integrator = makeContext(s, platformName, 300.0,
                                      forces=[scenes.harmonicBonds([(0, 1)], 1.0, 10.0)])
    integrator.step(2)
    bad = positionsOf(context)
    bad[2, 1] = value
    bad[4] = NAN
    context.setPositions(bad)
    before = stateOf(context)
    for call, argument in ((integrator.step, 3), (integrator.applyMobility, np.ones((6, 3))),
                           (integrator.sampleBrownianDisplacements, 2)):
        message = messageOf(call, argument)
        assertMentions(message, "position of particle 2", "nan" if np.isnan(value) else "inf",
                       "finite")
        assertSameState(stateOf(context), before)
    context.setPositions(s.positions)
    integrator.step(1)
    assert np.all(np.isfinite(positionsOf(context))) and context.getStepCount() == 3


def singularForce(k=1.0):
    """Infinite where a particle touches the plane x = 0, not a number beyond it."""
    force = openmm.CustomExternalForce("strength*log(x)")
    force.addGlobalParameter("strength", k)
    for i in range(6):
        force.addParticle(i, [])
    return force


def testNonFiniteForces(platformName):
    s = suspension()
    s.positions[:, 0] += 1.0
    context, integrator = makeContext(s, platformName, 300.0, 0.1, forces=[singularForce()])
    integrator.step(2)
    bad = positionsOf(context)
    bad[3, 0] = -1.0                            # the energy is nan here, the force finite
    bad[4, 0] = 0.0                             # the force is infinite here
    context.setPositions(bad)
    before = stateOf(context)
    message = messageOf(integrator.step, 5)
    assertMentions(message, "force of particle 4", "inf", "finite")
    assertSameState(stateOf(context), before)
    context.setPositions(s.positions)
    integrator.step(1)
    assert context.getStepCount() == 3


def testForcesThatThrowTheParticlesAway(platformName):
    """Finite forces too large for the arrays in use: refused before a position becomes infinite."""
    s = suspension()
    context, integrator = makeContext(s, platformName, 300.0, 1.0, forces=[singularForce(0.0)])
    context.setPositions(s.positions + [1.0, 0, 0])
    integrator.step(1)
    context.setParameter("strength", 1e300)
    before = stateOf(context)
    try:
        integrator.step(1)
    except openmm.OpenMMException as refused:
        assertMentions(str(refused), "particle 0", "step size")
        assertSameState(stateOf(context), before)
    else:
        assert np.all(np.isfinite(positionsOf(context)))
        context.setPositions(s.positions + [1.0, 0, 0])
    context.setParameter("strength", 0.0)
    integrator.step(1)
    assert np.all(np.isfinite(positionsOf(context)))


def testAFailedStepLeavesTheNoiseAlone(platformName):
    """A run that was interrupted by a refused step goes on as if it had not been."""
    s = suspension()
    ends = []
    for interrupt in (False, True):
        context, integrator = makeContext(s, platformName, 300.0)
        integrator.step(2)
        if interrupt:
            good = positionsOf(context)
            context.setPositions(np.full_like(good, NAN))
            messageOf(integrator.step, 1)
            messageOf(integrator.sampleBrownianDisplacements, 1)
            context.setPositions(good)
        integrator.step(2)
        ends.append((positionsOf(context), integrator.sampleBrownianDisplacements(2)))
    assert np.array_equal(ends[0][0], ends[1][0]) and np.array_equal(ends[0][1], ends[1][1])


# ---------------------------------------------------------------- at the wrong time

@pytest.mark.parametrize("call", [
    lambda i: i.step(1), lambda i: i.applyMobility(np.zeros((1, 3))),
    lambda i: i.sampleBrownianDisplacements(1), lambda i: i.getNumericalParameters(),
    lambda i: i.describe(), lambda i: i.getStageTimes()])
def testCallsBeforeAContextExists(call):
    assertMentions(messageOf(call, makeIntegrator()), "Context", "not bound")


@pytest.mark.parametrize("setter, arguments, getter", [
    ("setViscosity", (1.0,), "getViscosity"),
    ("setRadius", (1.0,), "getRadius"),
    ("setParticleRadius", (0, 0.7), "getParticleRadii"),
    ("setErrorTolerance", (1e-2,), "getErrorTolerance"),
    ("setMobilityModel", (PSEBrownianIntegrator.FreeDraining,), "getMobilityModel"),
    ("setFluidBoundary", (PSEBrownianIntegrator.Automatic,), "getFluidBoundary"),
    ("setSplit", (PSEBrownianIntegrator.Hasimoto,), "getSplit"),
    ("setSplittingParameter", (1.0,), "getSplittingParameter"),
    ("setGridDimensions", (16, 16, 16), "getGridDimensions"),
    ("setWindowSupport", (6,), "getWindowSupport"),
    ("setNumericalParameters", ({"xi": 1.0},), "getSplittingParameter"),
    ("setRandomNumberSeed", (99,), "getRandomNumberSeed")])
def testSettersThatActAtContextCreation(setter, arguments, getter):
    context, integrator = makeContext(suspension(), "CPU")
    before = getattr(integrator, getter)()
    assertMentions(messageOf(getattr(integrator, setter), *arguments), setter, "Context")
    assert getattr(integrator, getter)() == before
    integrator.step(1)


def testSettersThatActAtTheNextStep():
    context, integrator = makeContext(suspension(), "CPU")
    integrator.setTemperature(310.0)
    integrator.setStepSize(0.5)
    integrator.setShearRate(0.5)
    integrator.setShearProtocol(PSEBrownianIntegrator.StartUpShear, 0.25)
    assertMentions(messageOf(integrator.setTemperature, -5.0), "-5")
    integrator.step(1)
    assert context.getTime()._value == pytest.approx(0.5)
    assert integrator.getStrain() == pytest.approx(0.125)


def testOneIntegratorServesOneContext(platformName):
    s = suspension()
    context, integrator = makeContext(s, platformName)
    messageOf(contextOn, platformName, makeSystem(s), integrator)
    integrator.step(1)
    assert context.getStepCount() == 1


def testPositionsNotSet(platformName):
    s = suspension()
    integrator = makeIntegrator()
    context = contextOn(platformName, makeSystem(s), integrator)
    for call, argument in ((integrator.step, 1), (integrator.applyMobility, np.ones((6, 3))),
                           (integrator.sampleBrownianDisplacements, 1)):
        assertMentions(messageOf(call, argument), "positions")
