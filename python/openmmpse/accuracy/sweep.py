# SPDX-License-Identifier: MIT
"""Errors and times of a scene over a range of tolerances."""

from __future__ import annotations

import time

import numpy as np
import openmm

from . import limits, stages, timestep
from .results import KINDS, Result, Row
from .scene import SceneError, checkNumbers, sceneOf

TOLERANCES = tuple(10.0**-digits for digits in range(1, 9))  #: that `measure` goes through (dimensionless)
TIGHTEST = 1e-10  #: that the library serves
MARGIN = 10  #: the run that errors are measured against is tighter than all others by at least this factor
ROUNDS = 5
ROUND_SECONDS = 0.15  #: of steps in one round of one tolerance
MOST_AT_ONCE = 100_000  #: particles; beyond, tolerances are timed one after the other, which saves memory
LANCZOS_TIGHT = 1e-9
DOUBLE_PRICE = 2.0


def measure(source, positions=None, integrator=None, *, box=None, platform=None, properties=None, runLength=1_000_000,
            tolerances=TOLERANCES, split="automatic", correlationTime=None, budget=120.0, rounds=ROUNDS,
            progress=None, bias=timestep.BIAS):  # fmt: skip
    """Measure what accuracy costs for a scene.

    Errors of M f and of the noise against a run at a tolerance of 1e-10, times of steps, and the other errors of the
    run that is planned: docs/accuracy-and-speed.md derives them.

    Parameters
    ----------
    source : openmm.Context, Scene or openmm.System
        with a PSEBrownianIntegrator; a System needs positions and integrator, too
    positions : array-like of shape (N, 3), or a Quantity of one
        in nm; see `Scene`
    integrator : PSEBrownianIntegrator
        see `Scene`
    box, platform, properties
        see `Scene`; default: those of the source
    runLength : int
        steps of the run that is planned, > 0: decides how large its statistical error will be
    tolerances : sequence of float
        to measure, each from 1e-10 to 1e-1
    split : str
        "automatic", "Hasimoto", "Prolate", "AllWaves", or "both" for Hasimoto and Prolate
    correlationTime : float
        time (ps) after which displacements of a particle count as independent, > 0; default: a^2/D0
    budget : float
        seconds that the tight run may take by estimate, > 0; if it would take more, a looser one is the reference,
        and tolerances less than ten times looser than that are left out
    rounds : int
        timed turns of each tolerance, > 0
    progress : callable
        called with (text, share of the work done)
    bias : float
        relative error of the stiffest mode's variance that a time step is recommended for, > 0

    Returns
    -------
    Result
        with a `Row` for each tolerance and split

    Raises
    ------
    SceneError
        for what cannot be measured
    openmm.OpenMMException
        for what the library refuses
    """
    scene = sceneOf(source, positions, integrator, box, platform, properties).requireFluid()
    return Sweep(scene, runLength, tolerances, split, correlationTime, budget, rounds, progress, bias).run()


def forceKinds(scene, actual):
    """{kind: forces (N, 3)} on the particles that move; the kind "scene" only if the System exerts forces."""
    random = np.random.default_rng(11).normal(size=scene.positions.shape)
    uniform = np.tile([1.0, 0.3, -0.5], (len(random), 1))
    kinds = dict(zip(KINDS, (random, uniform, actual)))
    for forces in kinds.values():
        forces[~scene.mobile] = 0
    if not np.any(actual):
        del kinds["scene"]
    return kinds


class Sweep:
    """A measurement in progress: `result`, a `Result`, holds what is known so far, also after an interruption of run().

    Parameters
    ----------
    scene : Scene
        what is measured; the other parameters are those of `measure`
    """

    def __init__(self, scene, runLength=1_000_000, tolerances=TOLERANCES, split="automatic", correlationTime=None,
                 budget=120.0, rounds=ROUNDS, progress=None, bias=timestep.BIAS):  # fmt: skip
        checkNumbers(runLength=runLength, correlationTime=correlationTime, budget=budget, rounds=rounds, bias=bias)
        self.scene, self.runLength, self.correlationTime = scene, int(runLength), correlationTime
        self.tolerances = checkedTolerances(tolerances)
        self.splits = ("Hasimoto", "Prolate") if split == "both" else (split,)
        self.budget, self.rounds, self.progress, self.bias = budget, int(rounds), progress, bias
        self.result = Result(scene.count, scene.platform, self.runLength)
        self._probes = []

    def run(self):
        """Measure everything, and return the `Result`."""
        self._total = 3 + len(self.splits) * len(self.tolerances) * (1 + self.rounds)
        self._done = 0
        if self.scene.prescribed:
            self._note(f"the integrator prescribes {self.scene.prescribed}; measured with automatic parameters")
        self._reference()
        self._advance("other errors of the run")
        self.result.limits = limits.estimate(self.scene, self.runLength, self.correlationTime)
        self._adviseStep()
        self._advance("other errors of the run")
        for split in self.splits:
            self._sweep(split)
        if not self.result.rows:
            raise SceneError(self.result.notes[-1])
        self._time()
        self.result.complete = True
        return self.result

    def _note(self, text):
        if text not in self.result.notes:
            self.result.notes.append(text)

    def _advance(self, text, parts=1):
        self._done += parts
        if self.progress:
            self.progress(text, min(1.0, self._done / self._total))

    def _adviseStep(self):
        try:
            self.result.step = timestep.advise(self.scene, self.bias)
        except (openmm.OpenMMException, SceneError) as error:
            self._note(f"no time step recommended, because a short run failed: {error}")

    # ---- the tight run ----

    def _reference(self):
        """Velocities that errors are measured against, at the tightest tolerance within budget and memory."""
        scout = self.scene.probe(1e-3, thermal=False)
        self._kinds = forceKinds(self.scene, scout.forces())
        if "scene" not in self._kinds:
            self._note("the System exerts no forces at these positions: no error for them")
        scout.velocities(self._kinds["random"])
        start = time.perf_counter()
        scout.velocities(self._kinds["random"])
        seconds = time.perf_counter() - start
        del scout
        self._advance("tight run")
        tolerance = TIGHTEST
        while expectedSeconds(seconds, tolerance) * len(self._kinds) > self.budget and tolerance < 1e-3:
            tolerance *= 10
        if tolerance > TIGHTEST:
            self._note(
                f"reference at {tolerance:.0e}: by estimate a tighter one takes over {self.budget:g} s"
            )
        tight = None
        while tight is None:
            try:
                tight = self.scene.probe(tolerance, thermal=False, exact=True)
            except openmm.OpenMMException as error:
                tolerance *= 10
                if tolerance > 1.1e-3:
                    raise
                self._note(f"reference at {tolerance:.0e}: {error}")
        self._exact = {kind: tight.velocities(forces) for kind, forces in self._kinds.items()}
        self.result.referenceTolerance = tolerance
        wanted, limit = self.tolerances, MARGIN * tolerance * 0.999
        self.tolerances = tuple(x for x in wanted if x >= limit)
        if len(self.tolerances) < len(wanted):
            self._note(f"tolerances below {MARGIN * tolerance:.0e} left out: too close to the reference")

    # ---- errors ----

    def _sweep(self, split):
        refused = {}
        for tolerance in self.tolerances:
            self._advance(f"errors at {tolerance:g}, {split} split", 0)
            try:
                probe = self._probe(tolerance, split)
            except openmm.OpenMMException as error:
                refused.setdefault(str(error), []).append(f"{tolerance:g}")
                self._advance(f"errors at {tolerance:g}, {split} split", 1 + self.rounds)
                continue
            row = self._errors(probe, tolerance, split)
            self.result.rows.append(row)
            self._clock(probe, row)  # a first round, so that an interruption leaves times as well
            self._advance(f"errors at {tolerance:g}, {split} split", 2)
            if self.scene.count <= MOST_AT_ONCE:
                self._probes.append((probe, row))
            else:
                self._rounds([(probe, row)])
        for message, tolerances in refused.items():
            self._note(f"{split} split left out at {', '.join(tolerances)}: {message}")

    def _probe(self, tolerance, split):
        probe = self.scene.probe(tolerance, split)
        used = probe.parameters["split"]
        if split not in ("automatic", used):
            raise openmm.OpenMMException(f"the library used the {used} split instead for this scene")
        return probe

    def _errors(self, probe, tolerance, split):
        errors, plain = {}, {}
        for kind, forces in self._kinds.items():
            exact = self._exact[kind]
            difference = np.linalg.norm(probe.velocities(forces) - exact)
            free = self.scene.freeMobility * np.linalg.norm(forces[self.scene.mobile])
            errors[kind] = float(difference / max(np.linalg.norm(exact), free))
            plain[kind] = float(difference / np.linalg.norm(exact)) if np.any(exact) else float("nan")
        lanczos = noise = None
        if self.scene.thermalEnergy > 0:
            lanczos = lanczosError(self.scene, probe)
            noise = plain["random"] + 2 * lanczos
        return Row(tolerance, split, probe.parameters, errors, plain, lanczos, noise)

    # ---- times ----

    def _time(self):
        self._rounds(self._probes)
        self._probes = []
        self._advance("done", self._total - self._done)

    def _rounds(self, probes):
        for number in range(1, self.rounds):
            for probe, row in probes:
                if number < roundsFor(row.seconds, self.rounds):
                    self._clock(probe, row)
                self._advance(f"timing, round {number + 1} of {self.rounds}")

    def _clock(self, probe, row):
        row.times.append(probe.secondsPerStep(ROUND_SECONDS))
        bare = probe.secondsPerStep(ROUND_SECONDS, withForces=False)
        if bare is not None:
            row.bareTimes.append(bare)
        row.stages = stages.shares(probe.integrator.getStageTimes())
        row.parameters = probe.parameters


def lanczosError(scene, probe):
    """Relative error of a vector of noise that stopping the Lanczos process makes, rms over samples and particles.

    Both Contexts have the same Plan and seed, so that all else is equal.
    """
    count = int(np.clip(np.ceil(2000 / scene.count), 2, 50))
    used = probe.parameters
    tight = {**used, "lanczosTolerance": min(LANCZOS_TIGHT, 0.1 * used["lanczosTolerance"])}
    exact = scene.probe(probe.integrator.getErrorTolerance(), used["split"], parameters=tight).displacements(count)
    return float(np.linalg.norm(probe.displacements(count) - exact) / np.linalg.norm(exact))


def expectedSeconds(seconds, tolerance):
    """Rough time of a product M f at a tolerance, from that at 1e-3: the cube of the digits, twice in double."""
    return seconds * DOUBLE_PRICE * (np.log10(tolerance) / -3) ** 3


def roundsFor(seconds, rounds):
    """Fewer rounds for long steps, which average the noise of the machine by themselves; at least two."""
    return int(np.clip(np.ceil(8 / seconds), min(2, rounds), rounds))


def checkedTolerances(tolerances):
    """Tolerances as a tuple, loosest first. Raises ValueError for those that the library does not serve."""
    values = tuple(sorted((float(x) for x in tolerances), reverse=True))
    for value in values:
        if not TIGHTEST * MARGIN * 0.999 <= value <= 0.1:
            raise ValueError(
                f"tolerance {value:g} cannot be measured; it must lie in [{TIGHTEST * MARGIN:g}, 0.1], "
                f"because the tightest run to compare with has {TIGHTEST:g}"
            )
    if not values:
        raise ValueError("no tolerances given; give at least one between 1e-9 and 0.1")
    return values
