# SPDX-License-Identifier: MIT
"""What a measurement hands back."""

from __future__ import annotations

from dataclasses import dataclass, field

from .limits import Limits, Recommendation, recommend
from .timestep import StepAdvice

KINDS = ("random", "uniform", "scene")  #: of forces: unit normals, all alike, those of the System


@dataclass
class Row:
    """One tolerance with one split. Errors are relative (docs/accuracy-and-speed.md), times are in seconds a step."""

    tolerance: float  #: that was set
    split: str  #: asked for: "automatic" may lead to either, parameters["split"] is the one in use
    parameters: dict  #: as getNumericalParameters() returns them
    errors: dict  #: kind of forces -> |u - M f|/max(|M f|, |f|/(6 pi eta a))
    plainErrors: dict  #: kind of forces -> |u - M f|/|M f|
    lanczosError: float | None = None  #: of one vector of noise; None at temperature 0
    noise: float | None = None  #: of the covariance of the noise, upper estimate; None at temperature 0
    times: list = field(default_factory=list)  #: rounds of steps with the Forces of the System
    bareTimes: list = field(default_factory=list)  #: rounds of steps without them
    stages: dict = field(default_factory=dict)  #: stage -> share of a step without Forces

    @property
    def worst(self):
        """The hydrodynamic error: the largest of all."""
        values = [*self.errors.values(), self.noise]
        return max(value for value in values if value is not None)

    @property
    def seconds(self):
        """Best round of a step with Forces; None if none was timed."""
        return min(self.times, default=None)

    @property
    def bareSeconds(self):
        """The same without Forces."""
        return min(self.bareTimes, default=None)


@dataclass
class Result:
    """A sweep over tolerances; rows in the order of their measurement, loosest tolerance first for each split."""

    count: int  #: particles that move
    platform: str  #: its name
    runLength: int  #: steps
    referenceTolerance: float | None = None  #: of the run that errors are measured against
    limits: Limits | None = None  #: the other errors of the run
    step: StepAdvice | None = None  #: a time step
    rows: list = field(default_factory=list)  #: of `Row`
    notes: list = field(default_factory=list)  #: what was left out and why, assumptions
    complete: bool = False  #: False while it runs, and after an interruption

    def rowsOf(self, split):
        """Those of one split, as it was asked for."""
        return [row for row in self.rows if row.split == split]

    @property
    def splits(self):
        """Names of the splits that were asked for."""
        return list(dict.fromkeys(row.split for row in self.rows))

    def recommendation(self, split=None) -> Recommendation | None:
        """`Recommendation` for one split, by default for the first; None if nothing was measured."""
        rows = self.rowsOf(split or self.splits[0]) if self.rows else []
        if not rows or self.limits is None:
            return None
        return recommend({row.tolerance: row.worst for row in rows}, self.limits)

    @property
    def recommended(self):
        """The recommended tolerance, None if there is none."""
        chosen = self.recommendation()
        return chosen.tolerance if chosen else None
