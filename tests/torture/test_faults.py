# SPDX-License-Identifier: MIT
"""Faults of the surroundings: after each a clear error, the last good state, a live process."""
import gc
import multiprocessing
import os
import re
import signal
import threading
import time
import weakref

import numpy as np
import openmm
import pytest

import openmmpse
import scenes
from platformnames import allServed, isDevice
from scenes import makeContext, positionsOf, velocitiesOf

pytestmark = pytest.mark.onePrecision

RADIUS = 0.5
TEMPERATURE = 300.0
HEADER = 200 # bytes of a checkpoint that contain what OpenMM itself puts first


def suspension():
    return scenes.randomSuspension(12, 0.05, scenes.cube(1), RADIUS, 741)


def run(platformName, steps=4, forces=(), seed=5):
    context, integrator = makeContext(suspension(), platformName, TEMPERATURE, 0.5, seed=seed,
                                      forces=forces)
    integrator.step(steps)
    return context, integrator


def stateOf(context):
    return positionsOf(context), context.getTime()._value, context.getStepCount()


def assertUntouched(context, before):
    after = stateOf(context)
    assert np.array_equal(before[0], after[0]) and before[1:] == after[1:]


def refusalOf(call, *arguments, kinds=openmm.OpenMMException):
    with pytest.raises(kinds) as caught:
        call(*arguments)
    return str(caught.value)


def failingForce(action, after):
    """A PythonForce on all particles that does `action` once, at its call number `after`."""
    calls = []

    def compute(state):
        calls.append(1)
        forces = np.zeros((12, 3))
        return action(forces) if len(calls) == after else (0.0, forces)

    return openmm.PythonForce(compute)


def testAForceThatReturnsNoNumber(platformName, hardCase):
    """
    A PythonForce that returns NaN for one particle in its sixth call.

    The step is refused and names that particle (devices sum forces as integers, which have no NaN,
    and say -inf); positions, time and count are those before; the run goes on.
    """
    def action(forces):
        forces[7, 1] = np.nan
        return 0.0, forces

    context, integrator = run(platformName, forces=[failingForce(action, 6)])
    steps = context.getStepCount()
    message = refusalOf(integrator.step, 10)
    assert "force of particle 7" in message and "not finite" in message
    before = stateOf(context)
    assert steps <= before[2] <= steps + 2 and np.all(np.isfinite(before[0]))
    integrator.step(3)
    assert context.getStepCount() == before[2] + 3
    hardCase.measure(**{"steps before": before[2]})


def testAForceThatThrows(platformName, hardCase):
    """
    A PythonForce that raises ValueError in its sixth call.

    The caller gets an exception with its text; positions, time and count are those before; the run
    goes on.
    """
    def action(forces):
        raise ValueError("no parameters for this bond")

    context, integrator = run(platformName, forces=[failingForce(action, 6)])
    message = refusalOf(integrator.step, 10, kinds=Exception)
    assert "no parameters for this bond" in message
    before = stateOf(context)
    integrator.step(3)
    assert context.getStepCount() == before[2] + 3
    hardCase.measure(**{"steps before": before[2]})


def sheared(integrator):
    integrator.setShearRate(0.3)


def freeDraining(integrator):
    integrator.setMobilityModel(openmmpse.PSEBrownianIntegrator.FreeDraining)


def forceCoupling(integrator):
    integrator.setMobilityModel(openmmpse.PSEBrownianIntegrator.ForceCoupling)


PERIODIC, UNBOUNDED = openmmpse.PSEBrownianIntegrator.Periodic, openmmpse.PSEBrownianIntegrator.Unbounded
# Boundary, whether radii differ, tolerance, settings.
FLUIDS = {
    "equal spheres": (PERIODIC, False, 1e-3),
    "equal spheres at 1e-7": (PERIODIC, False, 1e-7),
    "mixture": (PERIODIC, True, 1e-3),
    "sheared": (PERIODIC, False, 1e-3, sheared),
    "sheared mixture": (PERIODIC, True, 1e-3, sheared),
    "force coupling": (PERIODIC, False, 1e-3, forceCoupling),
    "unbounded": (UNBOUNDED, True, 1e-3),
    "sheared, unbounded": (UNBOUNDED, False, 1e-3, sheared),
    "unbounded force coupling": (UNBOUNDED, True, 1e-3, forceCoupling),
    "free draining": (PERIODIC, True, 1e-3, freeDraining),
    "sheared, free draining": (PERIODIC, False, 1e-3, freeDraining, sheared),
}
ON_DEVICES = ("equal spheres", "sheared mixture", "unbounded force coupling") # each fluid needs programs of its own
FAULTS = {"NaN": np.nan, "infinity": np.inf, "exception": None}


class FaultyForce:
    """A PythonForce that has the fault that is named, once."""

    def __init__(self):
        self.fault = None

    def compute(self, state):
        fault, self.fault = self.fault, None
        if fault == "exception":
            raise ValueError("no parameters for this bond")
        forces = np.outer(np.ones(12), [1.0, 0.5, 0.0])
        if fault is not None:
            forces[7, 1] = FAULTS[fault]
        return 0.0, forces


def conditionOf(context, integrator):
    """All that a step changes."""
    state = context.getState(positions=True, velocities=True)
    return (state.getPositions(asNumpy=True)._value, state.getVelocities(asNumpy=True)._value,
            np.array(state.getPeriodicBoxVectors()._value), state.getTime()._value, state.getStepCount(),
            integrator.getStrain())


def inFluid(platformName, name):
    """A Context, its integrator, and what makes its Force fail."""
    boundary, differ, tolerance, *settings = FLUIDS[name]
    box = scenes.cube(1) + [[0, 0, 0], [1e-3, 0, 0], [0, 0, 0]] # devices tilt no box that was made rectangular
    scene = scenes.randomSuspension(12, 0.05, box, RADIUS, 741)
    if differ:
        scene = scenes.Scene(scene.positions, scene.box, RADIUS, np.linspace(0.6, 1.2, 12)*RADIUS)
    force = FaultyForce()
    context, integrator = makeContext(scene, platformName, TEMPERATURE, 0.5, tolerance, boundary=boundary,
                                      forces=[openmm.PythonForce(force.compute)],
                                      configure=lambda integrator: [set(integrator) for set in settings])
    return context, integrator, force


def testFaultsInEveryFluid(platformName, hardCase):
    """
    A PythonForce that returns NaN, then infinity, then raises an exception, in each kind of fluid (equal radii
    at two tolerances, of which the tighter is in double precision, mixtures, sheared, unbounded, force coupling,
    free draining; on devices in the short form three of them).

    Each time the step is refused with the reason; positions, velocities, box, time, count and strain are those
    before; the run goes on, to the bit, as one without faults.
    """
    tried = [name for name in FLUIDS if (hardCase.long or not isDevice(platformName) or name in ON_DEVICES)
             and allServed(platformName, [FLUIDS[name][2]])]
    for name in tried:
        context, integrator, force = inFluid(platformName, name)
        undisturbed, twin, _ = inFluid(platformName, name)
        for fault in FAULTS:
            integrator.step(2)
            before, force.fault = conditionOf(context, integrator), fault
            message = refusalOf(integrator.step, 1, kinds=Exception)
            reasons = ("no parameters for this bond",) if fault == "exception" else ("force of particle 7", "not finite")
            assert force.fault is None and all(reason in message for reason in reasons), (name, fault, message)
            after = conditionOf(context, integrator)
            assert all(np.array_equal(a, b) for a, b in zip(before, after)), (name, fault)
            integrator.step(1)
        twin.step(3*len(FAULTS))
        assert np.array_equal(positionsOf(context), positionsOf(undisturbed)), name
        assert np.all(np.isfinite(positionsOf(context)))
    hardCase.measure(fluids=len(tried), refused=len(tried)*len(FAULTS))


def testPositionsThatAreNotFinite(platformName, hardCase):
    """
    Positions set to infinity.

    The step is refused and names the particle; with good positions the run goes on as if nothing
    had happened, to the bit.
    """
    context, integrator = run(platformName)
    other, twin = run(platformName)
    good = positionsOf(context)
    bad = good.copy()
    bad[3, 2] = np.inf
    context.setPositions(bad)
    assert "position of particle 3" in refusalOf(integrator.step, 1)
    context.setPositions(good)
    other.setPositions(good)
    integrator.step(3)
    twin.step(3)
    assert np.array_equal(positionsOf(context), positionsOf(other))
    hardCase.measure(difference=0)


def testABoxBelowTheLimit(platformName, hardCase):
    """
    The box shrunk to a twentieth of the radius in mid-run.

    The step is refused with the limit; positions, time and count are those before, and can be saved; in
    the old box the run goes on.
    """
    context, integrator = run(platformName)
    box = context.getState().getPeriodicBoxVectors()
    before = stateOf(context)
    context.setPeriodicBoxVectors(*(0.05*RADIUS*np.eye(3)))
    message = refusalOf(integrator.step, 1)
    assert "box" in message and "larger" in message
    assertUntouched(context, before)
    context.createCheckpoint()
    saved = context.getState(positions=True, integratorParameters=True)
    assert np.array_equal(saved.getPositions(asNumpy=True)._value, before[0])
    context.setPeriodicBoxVectors(*box)
    integrator.step(2)
    assert np.all(np.isfinite(positionsOf(context)))
    hardCase.measure(message=message.partition(";")[2].strip())


@pytest.mark.withGrid
def testAGridBeyondMemory(platformName, hardCase):
    """
    A prescribed grid of 20,000 points in each direction.

    The Context is refused before anything is allocated, with a remedy; a new one with the automatic
    grid works.
    """
    def configure(integrator):
        integrator.setGridDimensions(20000, 20000, 20000)

    message = refusalOf(lambda: makeContext(suspension(), platformName, configure=configure))
    assert "memory" in message or "grid" in message
    context, integrator = run(platformName)
    hardCase.measure(message=message.partition(";")[2].strip())


def testACheckpointCutOffOrForeign(platformName, hardCase):
    """
    Checkpoints cut off at any of 40 places behind the header of OpenMM (which reads on where its
    header ends too early), and one of openmm.BrownianIntegrator.

    All are refused. OpenMM has taken positions, box and time from the checkpoint by then, so steps are
    refused, too, until there are others; a good checkpoint still loads and continues to the bit.
    """
    context, integrator = run(platformName)
    checkpoint = context.createCheckpoint()
    integrator.step(3)
    expected = positionsOf(context)
    rng = np.random.default_rng(742)
    other, fresh = run(platformName, seed=6)
    for cut in rng.integers(1, len(checkpoint) - HEADER, 40):
        refusalOf(other.loadCheckpoint, checkpoint[:-int(cut)])
        for call, arguments in ((fresh.step, (1,)), (fresh.applyMobility, (np.ones((12, 3)),)),
                                (fresh.sampleBrownianDisplacements, (1,)), (fresh.computeStress, ())):
            assert "last checkpoint was refused" in refusalOf(call, *arguments)
    other.setPeriodicBoxVectors(*suspension().box)
    other.setPositions(suspension().positions)
    fresh.step(1)
    assert np.all(np.isfinite(positionsOf(other)))
    theirs = openmm.BrownianIntegrator(TEMPERATURE, 50.0, 0.5)
    foreign = scenes.contextOn(platformName, scenes.makeSystem(suspension()), theirs, 1)
    foreign.setPositions(suspension().positions)
    refusalOf(other.loadCheckpoint, foreign.createCheckpoint())
    other.loadCheckpoint(checkpoint)
    fresh.step(3)
    assert np.array_equal(positionsOf(other), expected)
    hardCase.measure(refused=41)


def testXmlOfAFutureVersion(hardCase):
    """
    The XML of an integrator of version 99.

    Refused with both versions.
    """
    text = openmm.XmlSerializer.serialize(openmmpse.PSEBrownianIntegrator(300.0, 600.0, 0.5, 1.0))
    assert 'version="1"' in text
    message = refusalOf(openmm.XmlSerializer.deserialize,
                        text.replace('version="1"', 'version="99"'))
    assert "99" in message and "version 1" in message
    hardCase.measure(message=message)


def testStateOfAFutureVersion(platformName, hardCase):
    """
    The XML of a State whose integrator parameters have version 99.

    Refused with both versions; the run goes on.
    """
    context, integrator = run(platformName)
    state = context.getState(positions=True, integratorParameters=True)
    text = openmm.XmlSerializer.serialize(state)
    assert 'noiseStep="4"' in text
    future = openmm.XmlSerializer.deserialize(
        re.sub(r'(<IntegratorParameters [^>]*)version="1"', r'\1version="99"', text))
    message = refusalOf(context.setState, future)
    assert "version 99" in message and "version 1" in message
    integrator.step(2)
    assert np.all(np.isfinite(positionsOf(context)))
    hardCase.measure(message=message)


@pytest.fixture
def interruptible():
    """SIGINT raises KeyboardInterrupt also where a shell had it ignored, as of what runs in its background."""
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, previous)


def interruptedAfter(seconds, call, *arguments):
    """What SIGINT makes of a call, and how long after it the call went on."""
    sent = []

    def interrupt():
        sent.append(time.perf_counter())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(seconds, interrupt)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            call(*arguments)
    finally:
        timer.cancel()
    return time.perf_counter() - sent[0]


def testKeyboardInterrupt(platformName, interruptible, hardCase):
    """
    SIGINT during one call of step() for a hundred million steps, five times, and during one of
    sampleBrownianDisplacements().

    KeyboardInterrupt at a whole step, positions finite; a checkpoint from then continues to the bit.
    """
    context, integrator = run(platformName)
    counts = []
    for _ in range(5):
        interruptedAfter(0.1, integrator.step, 10**8)
        counts.append(context.getStepCount())
        assert np.all(np.isfinite(positionsOf(context)))
    assert counts == sorted(set(counts))
    before = stateOf(context)
    interruptedAfter(0.1, integrator.sampleBrownianDisplacements, 2 * 10**6)
    assertUntouched(context, before)
    checkpoint = context.createCheckpoint()
    integrator.step(3)
    other, fresh = run(platformName)
    other.loadCheckpoint(checkpoint)
    fresh.step(3)
    assert np.array_equal(positionsOf(other), positionsOf(context))
    hardCase.measure(steps=counts[-1])


@pytest.mark.parametrize("signals", [1, 2])
def testKeyboardInterruptInsideAForce(platformName, interruptible, hardCase, signals):
    """
    SIGINT, once and twice, while the function of a PythonForce runs.

    KeyboardInterrupt, as without such a Force: at the end of the step, or, if it came twice, at once,
    and then that step is not made; the run goes on.
    """
    def action(forces):
        for _ in range(signals):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01) # here Python looks at signals
        return 0.0, forces

    context, integrator = run(platformName, 4, [failingForce(action, 6)])
    with pytest.raises(KeyboardInterrupt):
        integrator.step(10**6)
    assert context.getStepCount() >= 5 if signals == 1 else context.getStepCount() == 5
    before = context.getStepCount()
    integrator.step(3)
    assert context.getStepCount() == before + 3 and np.all(np.isfinite(positionsOf(context)))
    hardCase.measure(steps=before)


def testTwoContextsInTwoThreads(platformName, hardCase):
    """
    Two Contexts with two integrators, each stepping in a thread of its own at the same time.

    Both get the trajectories that each gets alone, to the bit.
    """
    steps = 40
    alone = [positionsOf(run(platformName, steps, seed=seed)[0]) for seed in (5, 6)]
    together = [None, None]

    def work(i):
        together[i] = positionsOf(run(platformName, steps, seed=5 + i)[0])

    threads = [threading.Thread(target=work, args=(i,), daemon=True) for i in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for i in (0, 1):
        assert np.array_equal(alone[i], together[i])
    hardCase.measure(difference=0)


def testContextDroppedDuringARun(platformName, hardCase):
    """
    The last reference to a Context dropped in the midst of a step that another thread makes, five times.

    The Context lives until that call of step() ends, with all its steps, and is deleted then; another
    call is refused.
    """
    for _ in range(5):
        inside, dropped, deleted = threading.Event(), threading.Event(), threading.Event()
        messages = []

        def action(forces):
            inside.set()
            dropped.wait(60)
            return 0.0, forces

        context, integrator = run(platformName, 1, [failingForce(action, 3)])
        weakref.finalize(context, deleted.set)

        def work():
            integrator.step(10)
            messages.append(refusalOf(integrator.step, 1))

        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        assert inside.wait(60)
        del context
        gc.collect()
        assert not deleted.is_set()
        dropped.set()
        thread.join(60)
        assert not thread.is_alive() and deleted.wait(60)
        assert "needs a Context" in messages[0]
    hardCase.measure(runs=5)


def testTwoThreadsOnOneContext(platformName, hardCase):
    """
    Two threads that step one integrator, apply its mobility and draw its samples at the same time.

    Each call is made or refused with a remedy; steps add up to those of the calls that were made.
    """
    context, integrator = run(platformName, 1)
    forces = np.ones((12, 3))
    made, messages = [0, 0], []

    def work(i):
        for _ in range(40):
            try:
                integrator.step(5)
                made[i] += 5
                integrator.applyMobility(forces)
                integrator.sampleBrownianDisplacements(2)
            except openmm.OpenMMException as refusal:
                messages.append(str(refusal))

    threads = [threading.Thread(target=work, args=(i,), daemon=True) for i in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(120)
        assert not thread.is_alive()
    assert context.getStepCount() == 1 + sum(made)
    assert all("under way" in message and "Context of its own" in message for message in messages)
    assert np.all(np.isfinite(positionsOf(context)))
    hardCase.measure(refused=len(messages))


def child(queue, seed):
    try:
        queue.put(positionsOf(run("Reference", 3, seed=seed)[0]))
    except Exception as error: # told to the parent, which asserts
        queue.put(error)


@pytest.mark.hostOnly
def testForkAfterUse(platformName, hardCase):
    """
    A process that has used a Context forks; the child, which leaves that Context alone, makes a new
    one on Reference.

    The child gets the right positions within a minute, the parent goes on.
    """
    context, integrator = run(platformName)
    fork = multiprocessing.get_context("fork")
    queue = fork.Queue()
    process = fork.Process(target=child, args=(queue, 9), daemon=True)
    # Deleting a Context waits for its threads, which a child does not have: what is garbage already
    # goes before the fork, and the child's collector must not touch the rest.
    gc.collect()
    gc.freeze()
    try:
        process.start()
        found = queue.get(timeout=60)
        process.join(60)
    finally:
        gc.unfreeze()
        process.kill()
    assert process.exitcode == 0
    assert np.array_equal(found, positionsOf(run("Reference", 3, seed=9)[0]))
    integrator.step(3)
    assert np.all(np.isfinite(velocitiesOf(context)))
    hardCase.measure(**{"exit code": process.exitcode})
