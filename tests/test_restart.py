# SPDX-License-Identifier: MIT
"""
A run that is continued is the run that was not interrupted: from a checkpoint to the bit, from a
State in XML with noise that does not repeat. A checkpoint of something else is refused.
"""
import copy
import pickle

import numpy as np
import openmm
import pytest

from openmmpse import PSEBrownianIntegrator
import scenes
from platformnames import contextOn, isDirect, served
from scenes import makeContext, positionsOf, randomForces

T, DT = 300.0, 4.0


def suspension(N=20, seed=401):
    return scenes.randomSuspension(N, 0.1, scenes.tilted(1), 0.5, seed)


def bondedContext(platformName, s=None, seed=31, tolerance=1e-3, threads=1, configure=None, T=T):
    """A suspension whose particles are also the beads of a chain; stiff enough to matter."""
    s = suspension() if s is None else s
    bonds = scenes.harmonicBonds([(i, i + 1) for i in range(s.count - 1)], 1.5, 5.0)
    return makeContext(s, platformName, T, DT, tolerance, seed, [bonds], threads=threads,
                       configure=configure)


def run(context, integrator, steps):
    """Positions after each step."""
    out = []
    for _ in range(steps):
        integrator.step(1)
        out.append(positionsOf(context))
    return np.array(out)


def stateOf(context):
    return positionsOf(context), context.getTime()._value, context.getStepCount()


def assertSameState(first, second):
    assert np.array_equal(first[0], second[0]) and first[1:] == second[1:]


# ---------------------------------------------------------------- checkpoints

@pytest.mark.parametrize("tolerance, split", [(1e-3, "Prolate"), (1e-6, "Hasimoto")])
@pytest.mark.parametrize("before", [0, 1, 13])
def testCheckpointContinuesToTheBit(platformName, tolerance, split, before):
    """
    In a Context of its own, in the same one after other steps, and after long runs: displacements
    of a radius in between, so that neighbour lists and iteration counts are not those of a fresh
    start.
    """
    tolerance = served(platformName, tolerance)

    def configure(i):
        i.setSplit(getattr(PSEBrownianIntegrator, split))
    context, integrator = bondedContext(platformName, tolerance=tolerance, configure=configure)
    assert integrator.getNumericalParameters()["split"] == split
    run(context, integrator, before)
    checkpoint = context.createCheckpoint()
    at = stateOf(context)
    expected = run(context, integrator, 25)
    assert np.abs(expected[-1] - at[0]).max() > 0.25
    samples = integrator.sampleBrownianDisplacements(2)

    other, fresh = bondedContext(platformName, tolerance=tolerance, configure=configure)
    other.loadCheckpoint(checkpoint)
    assertSameState(stateOf(other), at)
    assert np.array_equal(run(other, fresh, 25), expected)
    assert np.array_equal(fresh.sampleBrownianDisplacements(2), samples)
    context.loadCheckpoint(checkpoint)
    assert np.array_equal(run(context, integrator, 25), expected)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def testCheckpointWithTwoThreads(tolerance):
    """Bonded forces are reproducible: everything is, and one thread gives the same as two."""
    s = suspension(100, 402)
    context, integrator = bondedContext("CPU", s, tolerance=tolerance, threads=2)
    run(context, integrator, 5)
    checkpoint = context.createCheckpoint()
    expected = run(context, integrator, 10)
    samples = integrator.sampleBrownianDisplacements(2)
    u = integrator.applyMobility(randomForces(s))
    for threads in (2, 1):
        other, fresh = bondedContext("CPU", s, tolerance=tolerance, threads=threads)
        other.loadCheckpoint(checkpoint)
        assert np.array_equal(run(other, fresh, 10), expected)
        assert np.array_equal(fresh.sampleBrownianDisplacements(2), samples)
        assert np.array_equal(fresh.applyMobility(randomForces(s)), u)


@pytest.mark.onePrecision
def testSampleCounterIsRestored(platformName):
    """Samples go on where they were: the ones drawn before the checkpoint do not come again."""
    context, integrator = bondedContext(platformName)
    first = integrator.sampleBrownianDisplacements(3)
    checkpoint = context.createCheckpoint()
    second = integrator.sampleBrownianDisplacements(3)
    assert not np.any(first == second)
    other, fresh = bondedContext(platformName)
    other.loadCheckpoint(checkpoint)
    assert np.array_equal(fresh.sampleBrownianDisplacements(3), second)


@pytest.mark.onePrecision
def testDrawnSeedIsRestored(platformName):
    """Seed 0 in both Contexts: they draw different ones, and the checkpoint brings its own."""
    context, integrator = bondedContext(platformName, seed=0)
    run(context, integrator, 3)
    checkpoint = context.createCheckpoint()
    expected = run(context, integrator, 5)
    other, fresh = bondedContext(platformName, seed=0)
    drawn = integrator.getNumericalParameters()["randomSeed"]
    assert fresh.getNumericalParameters()["randomSeed"] != drawn
    other.loadCheckpoint(checkpoint)
    assert fresh.getNumericalParameters()["randomSeed"] == drawn
    assert np.array_equal(run(other, fresh, 5), expected)


def testCheckpointAfterTheBoxChanged(platformName):
    """The checkpoint brings the box along, and with it what the Plan makes of it."""
    s = suspension()
    context, integrator = bondedContext(platformName, s)
    run(context, integrator, 2)
    for box, steps in ((1.2*s.box, 3), (np.diag(np.diag(s.box)), 0)):
        context.setPeriodicBoxVectors(*box)
        run(context, integrator, steps)
        checkpoint = context.createCheckpoint()
        expected = run(context, integrator, 5)
        other, fresh = bondedContext(platformName, s)
        other.loadCheckpoint(checkpoint)
        assert np.array_equal(run(other, fresh, 5), expected)
        assert fresh.getNumericalParameters() == integrator.getNumericalParameters()


@pytest.mark.onePrecision
def testFreeDrainingCheckpoint(platformName):
    def freeDraining(i):
        i.setMobilityModel(PSEBrownianIntegrator.FreeDraining)
    context, integrator = bondedContext(platformName, configure=freeDraining)
    run(context, integrator, 3)
    checkpoint = context.createCheckpoint()
    expected = run(context, integrator, 5)
    other, fresh = bondedContext(platformName, configure=freeDraining)
    other.loadCheckpoint(checkpoint)
    assert np.array_equal(run(other, fresh, 5), expected)


@pytest.mark.onePrecision
# ---------------------------------------------------------------- checkpoints of something else

@pytest.mark.parametrize("what", ["tolerance", "split", "bandwidth", "xi", "grid", "window", "model",
                                  "viscosity", "radius"])
def testCheckpointOfAnotherPlanIsRefused(platformName, what):
    """The message names what differs; seed, counters and noise of the Context stay its own."""
    untouched, twin = bondedContext(platformName)
    support = twin.getNumericalParameters()["windowSupport"]
    configure = {"tolerance": None,
                 "split": lambda i: i.setSplit(PSEBrownianIntegrator.Hasimoto),
                 "bandwidth": lambda i: i.setNumericalParameters({"prolateBandwidth": 9.75}),
                 "xi": lambda i: i.setSplittingParameter(1.11),
                 "grid": lambda i: i.setGridDimensions(20, 20, 20),
                 "window": lambda i: i.setWindowSupport(support + 2),
                 "viscosity": lambda i: i.setViscosity(777.0),
                 "radius": lambda i: i.setRadius(0.51),
                 "model": lambda i: i.setMobilityModel(PSEBrownianIntegrator.FreeDraining)}[what]
    context, integrator = bondedContext(platformName, seed=77,
                                        tolerance=1e-2 if what == "tolerance" else 1e-3,
                                        configure=configure)
    run(context, integrator, 3)
    checkpoint = context.createCheckpoint()
    other, fresh = bondedContext(platformName)
    parameters = fresh.getNumericalParameters()
    with pytest.raises(openmm.OpenMMException) as caught:
        other.loadCheckpoint(checkpoint)
    message = str(caught.value)
    assert "checkpoint" in message and "setNumericalParameters" in message
    assert str(parameters["gridDimensions"][0]) in message
    assert fresh.getNumericalParameters() == parameters
    other.setPositions(suspension().positions)
    assert np.array_equal(run(other, fresh, 3), run(untouched, twin, 3))


@pytest.mark.onePrecision
def testCheckpointOfAnotherNumberOfParticlesIsRefused(platformName):
    context, integrator = bondedContext(platformName, suspension(21))
    other, fresh = bondedContext(platformName)
    with pytest.raises(openmm.OpenMMException, match="(?i)particles"):
        other.loadCheckpoint(context.createCheckpoint())


@pytest.mark.onePrecision
def testTruncatedCheckpointIsRefused(platformName):
    """Whatever is missing at the end, it is noticed, and the Context still works."""
    context, integrator = bondedContext(platformName)
    run(context, integrator, 2)
    checkpoint = context.createCheckpoint()
    expected = run(context, integrator, 3)
    other, fresh = bondedContext(platformName, seed=32)
    for missing in (1, 8, 20, 100):
        with pytest.raises(openmm.OpenMMException, match="checkpoint"):
            other.loadCheckpoint(checkpoint[:-missing])
    other.loadCheckpoint(checkpoint)
    assert np.array_equal(run(other, fresh, 3), expected)


@pytest.mark.onePrecision
def testCheckpointOfAnotherIntegratorIsRefused(platformName):
    s = suspension()
    standard = openmm.BrownianIntegrator(T, 50.0, DT)
    bonds = scenes.harmonicBonds([(i, i + 1) for i in range(s.count - 1)], 1.5, 5.0)
    theirs = contextOn(platformName, scenes.makeSystem(s, [bonds]), standard, 1)
    theirs.setPositions(s.positions)
    context, integrator = bondedContext(platformName)
    with pytest.raises(openmm.OpenMMException, match="checkpoint"):
        context.loadCheckpoint(theirs.createCheckpoint())


# ---------------------------------------------------------------- States and integrators in XML

def stateThroughXml(context):
    state = context.getState(positions=True, velocities=True, parameters=True,
                             integratorParameters=True)
    return openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(state))


def testStateContinuesTheNoise(platformName):
    """The counters travel in the State: with the same seed and Plan it goes on to the bit."""
    context, integrator = bondedContext(platformName)
    run(context, integrator, 4)
    integrator.sampleBrownianDisplacements(3)
    state = stateThroughXml(context)
    expected = run(context, integrator, 5)
    samples = integrator.sampleBrownianDisplacements(1)
    other, fresh = bondedContext(platformName)
    other.setState(state)
    found = run(other, fresh, 5)
    # The text of a State holds every digit of positions and box.
    assert np.array_equal(found, expected)
    assert np.array_equal(fresh.sampleBrownianDisplacements(1), samples)
    assert other.getStepCount() == context.getStepCount() and other.getTime() == context.getTime()


@pytest.mark.onePrecision
@pytest.mark.parametrize("text", ["", "abc", "1.5", "12abc", "-3", "999999999999999999999"])
def testDamagedNoiseCounterIsRefused(platformName, text):
    """The counter in the XML of a State is a plain number below 2^48, or it is named."""
    context, integrator = bondedContext(platformName)
    run(context, integrator, 4)
    state = context.getState(positions=True, integratorParameters=True)
    xml = openmm.XmlSerializer.serialize(state)
    assert 'noiseStep="4"' in xml
    damaged = openmm.XmlSerializer.deserialize(xml.replace('noiseStep="4"', f'noiseStep="{text}"'))
    with pytest.raises(openmm.OpenMMException, match="damaged") as caught:
        context.setState(damaged)
    assert f"'{text}'" in str(caught.value)
    assert np.all(np.isfinite(run(context, integrator, 1)))


@pytest.mark.onePrecision
def testStateDoesNotRepeatTheNoise(platformName, tmp_path):
    """A saved State, loaded into a run of the same seed: no displacement comes again."""
    s = suspension()
    context, integrator = makeContext(s, platformName, T, DT, seed=33)
    first = np.diff(np.vstack([s.positions[None], run(context, integrator, 4)]), axis=0)
    (tmp_path/"state.xml").write_text(openmm.XmlSerializer.serialize(stateThroughXml(context)))
    other, fresh = makeContext(s, platformName, T, DT, seed=33)
    other.setState(openmm.XmlSerializer.deserialize((tmp_path/"state.xml").read_text()))
    start = positionsOf(other)
    second = np.diff(np.vstack([start[None], run(other, fresh, 4)]), axis=0)
    for x in first:
        for y in second:
            # 60 numbers: independent ones correlate by 0.13, the same noise elsewhere by 0.9.
            assert np.sum(x*y) < 0.7*np.linalg.norm(x)*np.linalg.norm(y)


@pytest.mark.onePrecision
@pytest.mark.parametrize("way, split", [("xml", "Hasimoto"), ("deepcopy", "Hasimoto"),
                                        ("pickle", "Hasimoto"), ("xml", "Prolate")])
def testCopiesOfAnIntegrator(platformName, way, split):
    """Every setting survives, and the copy makes the same steps as the original."""
    s = suspension()

    def configure(i):
        if split == "Prolate":
            i.setNumericalParameters({"split": split, "xi": 0.45, "prolateBandwidth": 11.3})
        else:
            i.setSplittingParameter(1.2)
            i.setSplit(PSEBrownianIntegrator.Hasimoto)
        i.setGridDimensions(14, 15, 16)
        i.setWindowSupport(6)
        i.setParticleRadius(3, 0.5)
        i.setIntegrationForceGroups({0, 2})

    context, integrator = bondedContext(platformName, s, seed=34, tolerance=1e-3,
                                        configure=configure)
    assert integrator.getNumericalParameters()["split"] == split
    again = {"xml": lambda: PSEBrownianIntegrator.cast(
                 openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(integrator))),
             "deepcopy": lambda: copy.deepcopy(integrator),
             "pickle": lambda: pickle.loads(pickle.dumps(integrator))}[way]()
    assert isinstance(again, PSEBrownianIntegrator)
    for name in ("Temperature", "Viscosity", "Radius", "StepSize", "ErrorTolerance",
                 "MobilityModel", "FluidBoundary", "Split", "SplittingParameter", "GridDimensions",
                 "WindowSupport", "RandomNumberSeed", "ShearRate", "ParticleRadii",
                 "IntegrationForceGroups"):
        assert getattr(again, "get" + name)() == getattr(integrator, "get" + name)(), name
    requested = integrator.getRequestedNumericalParameters()
    assert again.getRequestedNumericalParameters() == requested
    assert (requested["prolateBandwidth"] == 11.3) == (split == "Prolate")
    other = contextOn(platformName, context.getSystem(), again, 1)
    other.setPositions(s.positions)
    assert np.array_equal(run(other, again, 3), run(context, integrator, 3))


@pytest.mark.onePrecision
def testReinitializeStartsAfresh(platformName):
    """context.reinitialize() that preserves the state: the noise does not repeat."""
    s = suspension()
    context, integrator = makeContext(s, platformName, T, DT, seed=35)
    first = run(context, integrator, 3)
    context.reinitialize(preserveState=True)
    assert np.array_equal(positionsOf(context), first[-1])
    more = run(context, integrator, 3)
    step = (first[0] - s.positions).ravel()
    again = (more[0] - first[-1]).ravel()
    assert step @ again < 0.7*np.linalg.norm(step)*np.linalg.norm(again)
    other, uninterrupted = makeContext(s, platformName, T, DT, seed=35)
    assert np.allclose(run(other, uninterrupted, 6)[-1], more[-1], rtol=0, atol=1e-3)


@pytest.mark.onePrecision
@pytest.mark.parametrize("way", ["checkpoint", "state", "reinitialize"])
def testAHeatedRunContinues(platformName, way):
    """A Context keeps the Plan it was made with at 0 K when it is heated, and so does what goes on from there."""
    # a scene where noise, which makes pairs dear, moves the split
    s = scenes.randomSuspension(60, 0.1, scenes.tilted(1), 0.5, 402)

    def configure(i):
        if isDirect(platformName):
            i.setSplit(PSEBrownianIntegrator.Hasimoto)
    context, integrator = bondedContext(platformName, s, T=0.0, configure=configure)
    cold = integrator.getNumericalParameters()
    other, fresh = bondedContext(platformName, s, configure=configure)
    assert fresh.getNumericalParameters()["xi"] != cold["xi"]
    integrator.setTemperature(T)
    run(context, integrator, 4)
    state = stateThroughXml(context)
    checkpoint = context.createCheckpoint()
    expected = run(context, integrator, 5)
    if way == "checkpoint":
        other.loadCheckpoint(checkpoint)
    elif way == "state":
        other.setState(state)
    else:
        context.loadCheckpoint(checkpoint)
        context.reinitialize(preserveState=True)
        other, fresh = context, integrator
    assert fresh.getNumericalParameters()["xi"] == cold["xi"]
    assert np.array_equal(run(other, fresh, 5), expected)
