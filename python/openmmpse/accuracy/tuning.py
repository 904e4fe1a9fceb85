# SPDX-License-Identifier: MIT
"""How far the automatic numerical parameters are from the fastest ones, for one scene on one machine."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import openmm

from .scene import checkNumbers, sceneOf
from .sweep import ROUND_SECONDS, ROUNDS, checkedTolerances

FACTORS = (0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0)  #: of the automatic splitting parameter
SUPPORTS = (-1, 1)  #: added to the automatic support of the window
SLACK = 1.5  #: candidates may be in error by that many tolerances: the measured error is that of one vector


@dataclass
class Candidate:
    """One choice of numerical parameters, with what it takes to make it."""

    label: str  #: in words
    settings: dict  #: for setNumericalParameters(); empty: automatic
    parameters: dict = field(default_factory=dict)  #: in use
    error: float = 0.0  #: of M f for random forces, as in `Row.errors`
    times: list = field(default_factory=list)  #: seconds of a step, without the System's Forces where possible

    @property
    def seconds(self):
        """The best of the timed rounds (s)."""
        return min(self.times)


@dataclass
class Tuning:
    """Candidates at one tolerance; the first is the automatic choice."""

    tolerance: float  #: of all candidates
    candidates: list  #: of `Candidate`
    notes: list = field(default_factory=list)  #: what was left out and why

    @property
    def automatic(self):
        """The automatic choice."""
        return self.candidates[0]

    @property
    def best(self):
        """The fastest of those that keep the tolerance; the automatic one if none is faster."""
        good = [c for c in self.candidates if c.times and c.error <= SLACK * self.tolerance]
        return min(good or [self.automatic], key=lambda c: c.seconds)

    @property
    def excess(self):
        """Time of the automatic choice over that of the best one."""
        return self.automatic.seconds / self.best.seconds


def tune(source, positions=None, integrator=None, *, box=None, platform=None, properties=None, tolerance=1e-3,
         split="automatic", rounds=ROUNDS, progress=None):  # fmt: skip
    """Time steps with other splitting parameters and window supports than the automatic ones.

    Nothing is changed: `tuning.best.settings` is what a user may give to setNumericalParameters(), for this scene and
    machine. Splitting parameters from half to twice the automatic one and one grid point more and less of support are
    tried.

    Parameters
    ----------
    tolerance : float
        from 1e-10 to 1e-1
    source, positions, integrator, box, platform, properties, split, rounds, progress
        as in `measure`

    Returns
    -------
    Tuning
        a `Candidate` for each choice, the automatic one first

    Raises
    ------
    SceneError
        for what cannot be measured
    openmm.OpenMMException
        for what the library refuses
    """
    checkNumbers(rounds=rounds)
    (tolerance,) = checkedTolerances([tolerance])
    scene = sceneOf(source, positions, integrator, box, platform, properties).requireFluid()
    automatic = scene.probe(tolerance, split)
    used = automatic.parameters
    forces = np.random.default_rng(11).normal(size=scene.positions.shape)
    forces[~scene.mobile] = 0
    exact = scene.probe(max(1e-10, 1e-2 * tolerance), thermal=False, exact=True).velocities(forces)
    scale = max(np.linalg.norm(exact), scene.freeMobility * np.linalg.norm(forces[scene.mobile]))
    tuning = Tuning(tolerance, [])
    running = []
    for candidate in _candidates(used):
        try:
            probe = scene.probe(tolerance, split, parameters=candidate.settings) if candidate.settings else automatic
        except openmm.OpenMMException as error:
            tuning.notes.append(f"{candidate.label} left out: {error}")
            continue
        candidate.parameters = probe.parameters
        candidate.error = float(np.linalg.norm(probe.velocities(forces) - exact) / scale)
        tuning.candidates.append(candidate)
        running.append((probe, candidate))
    for number in range(int(rounds)):
        for i, (probe, candidate) in enumerate(running):
            candidate.times.append(probe.secondsPerStep(ROUND_SECONDS, withForces=scene.timingGroup is None))
            if progress:
                progress(f"tuning, round {number + 1} of {rounds}", (number + (i + 1) / len(running)) / rounds)
    return tuning


def _candidates(used):
    """`Candidate`s around the parameters in use, the automatic one first."""
    split, xi, support = used["split"], used["xi"], used["windowSupport"]
    yield Candidate("automatic", {})
    for factor in FACTORS if xi else ():  # waves alone, and the unbounded fluid, are not divided
        if factor != 1:
            yield Candidate(f"xi x {factor:g}", {"split": split, "xi": float(f"{factor * xi:.4g}")})
    for change in SUPPORTS if support else ():
        settings = {"split": split, "xi": float(f"{xi:.4g}"), "windowSupport": support + change}
        yield Candidate(f"support {support + change}", settings)
