# SPDX-License-Identifier: MIT
"""Calls in blocks between which signals are heard: nothing else about them may change."""
import os
import signal
import threading

import numpy as np
import openmm
import pytest

import scenes
from openmmpse import interruption
from openmmpse.interruption import DeferredInterrupt, inBlocks, keptContext
from scenes import makeContext, positionsOf

pytestmark = pytest.mark.onePlatform
SUSPENSION = scenes.randomSuspension(8, 0.05, scenes.cube(1), 0.5, 881)


def raised():
    os.kill(os.getpid(), signal.SIGINT)
    sum(range(1000)) # here Python looks at signals


@pytest.fixture
def heard():
    """Signals that a handler of the script has got; it does not raise."""
    signals = []
    previous = signal.signal(signal.SIGINT, lambda number, frame: signals.append(number))
    yield signals
    signal.signal(signal.SIGINT, previous)


@pytest.mark.parametrize("count, blocks", [
    (-3, [-3]), (0, [0]), (1, [1]), (2, [1, 1]), (33, [1, 32]), (600, [1, 32, 200, 200, 167])])
def testBlocksLastAFifthOfASecond(monkeypatch, count, blocks):
    """Steps of a millisecond, by a clock that they move."""
    clock, made = [0.0], []

    def call(steps):
        made.append(steps)
        clock[0] += steps*1e-3

    monkeypatch.setattr(interruption.time, "perf_counter", lambda: clock[0])
    inBlocks(call, count)
    assert made == blocks


def testALongStepIsABlock(monkeypatch):
    monkeypatch.setattr(interruption, "BLOCK_SECONDS", 0.0)
    made = []
    inBlocks(made.append, 5)
    assert made == [1]*5


def testAnotherThreadMakesOneCall():
    blocks = []
    thread = threading.Thread(target=inBlocks, args=(blocks.append, 1000))
    thread.start()
    thread.join()
    assert blocks == [1000]


def testTheHandlerOfTheScriptGetsTheSignalAfterTheBlock(heard):
    told = []

    def call(steps):
        if not told:
            raised()
        told.append(len(heard))

    inBlocks(call, 40)
    assert told[0] == 0 and told[1] == 1 and heard == [signal.SIGINT]


def testASecondSignalDoesNotWait(heard):
    with DeferredInterrupt():
        raised()
        assert heard == []
        raised()
        assert len(heard) == 1
    assert len(heard) == 2 # the failure of what the second one ended must not hide it
    raised()
    assert len(heard) == 3 # the handler is back


def testIgnoredSignalsStayIgnored():
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        inBlocks(lambda steps: raised(), 2)
        assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, previous)


def testStepsAndSamplesAreTheSameInAnyBlocks(platformName, monkeypatch):
    found = []
    for seconds in (0.0, 1e6):
        monkeypatch.setattr(interruption, "BLOCK_SECONDS", seconds)
        context, integrator = makeContext(SUSPENSION, platformName, 300.0, 0.5, seed=7)
        integrator.step(50)
        samples = integrator.sampleBrownianDisplacements(45)
        assert samples.shape == (45, 8, 3)
        found.append((positionsOf(context), samples))
    assert np.array_equal(found[0][0], found[1][0]) and np.array_equal(found[0][1], found[1][1])


def testTheContextOfAnIntegrator(platformName):
    context, integrator = makeContext(SUSPENSION, platformName, 300.0, 0.5)
    makeContext(SUSPENSION, platformName, 300.0, 0.5)
    assert keptContext(integrator) is context and keptContext(integrator) is context
    del context
    assert keptContext(integrator) is None
    context = openmm.Context(scenes.makeSystem(SUSPENSION), integrator, openmm.Platform.getPlatformByName("Reference"))
    assert keptContext(integrator) is context


def testSamplesBeyondMemory(platformName):
    context, integrator = makeContext(SUSPENSION, platformName, 300.0, 0.5)
    with pytest.raises(MemoryError, match="8, 3"):
        integrator.sampleBrownianDisplacements(10**12)
    with pytest.raises(openmm.OpenMMException, match="-1"):
        integrator.sampleBrownianDisplacements(-1)
    assert integrator.sampleBrownianDisplacements(0).shape == (0, 8, 3)


@pytest.mark.parametrize("kind", [KeyboardInterrupt, SystemExit, ValueError])
def testAnExceptionWithoutATextIsNamed(platformName, kind):
    def compute(state):
        raise kind

    context, integrator = makeContext(SUSPENSION, platformName, 300.0, 0.5, forces=[openmm.PythonForce(compute)])
    with pytest.raises(openmm.OpenMMException, match="without a text"):
        integrator.step(1)
    assert context.getStepCount() == 0
