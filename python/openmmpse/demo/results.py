# SPDX-License-Identifier: MIT
"""What the two experiments hand to the report."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from openmmpse.analysis import Estimate

AGREEMENT = 3.0  #: standard errors that count as agreement


class Row(NamedTuple):
    """One measured diffusion coefficient beside what theory says; nm^2/ps."""

    molecule: str
    hydrodynamics: bool
    times: str  #: "short" or "long"
    method: str
    measured: Estimate
    expected: float | tuple  #: a number, or (low, high)
    theory: str

    @property
    def deviation(self):
        return self.measured.deviation(self.expected)

    @property
    def agrees(self):
        return self.deviation <= AGREEMENT


class Result(NamedTuple):
    """One molecule."""

    name: str
    rows: list
    curves: dict
    facts: list  #: sentences for the report
    molecule: object  #: `simulate.Molecule`
    describe: str  #: what the integrator says of itself, with hydrodynamics
    positions: np.ndarray  #: one configuration, nm

    def row(self, hydrodynamics, times, method=None):
        """The first row that matches."""
        for row in self.rows:
            if row.hydrodynamics == hydrodynamics and row.times == times and method in (None, row.method):
                return row
        raise KeyError((hydrodynamics, times, method))
