# SPDX-License-Identifier: MIT
"""Numbers with honest error bars: means over blocks and runs that count as independent.

Every error is one standard error of the mean. Where it comes from a spread of n blocks it is itself known only to a
fraction 1/sqrt(2(n - 1)); deviations in units of it follow Student's distribution with n - 1 degrees of freedom.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

FEWEST_BLOCKS = 10  #: altogether, unless told otherwise: error bars then are known to 24 %


class Estimate(NamedTuple):
    """A measured number and its standard error, same unit."""

    value: float
    error: float

    def scaled(self, factor):
        return Estimate(self.value * factor, self.error * abs(factor))

    def shifted(self, constant):
        return Estimate(self.value + constant, self.error)

    def minus(self, other):
        """Difference of two independent estimates."""
        return Estimate(self.value - other.value, math.hypot(self.error, other.error))

    def deviation(self, expected):
        """Distance from an expected number, or from the nearer end of an interval (low, high), in standard errors."""
        low, high = expected if isinstance(expected, tuple) else (expected, expected)
        distance = max(low - self.value, self.value - high, 0.0)
        if distance == 0.0:
            return 0.0
        return distance / self.error if self.error > 0 else math.inf


class Curve(NamedTuple):
    """A quantity against time (ps) with standard errors (None: exact)."""

    times: np.ndarray
    values: np.ndarray
    errors: np.ndarray | None


def meanOfBlocks(blocks):
    """Mean and standard error over the first axis of (blocks, ...); at least two blocks."""
    blocks = np.asarray(blocks, dtype=float)
    if len(blocks) < 2:
        raise ValueError(f"an error bar needs at least 2 blocks, not {len(blocks)}")
    return blocks.mean(axis=0), blocks.std(axis=0, ddof=1) / math.sqrt(len(blocks))


def estimate(blocks):
    """Estimate from independent numbers, one per block."""
    mean, error = meanOfBlocks(blocks)
    return Estimate(float(mean), float(error))


def runsOf(source):
    """What analysis takes as samples, as a list of float arrays (samples, ...): one array, or a list of one per run."""
    runs = list(source) if isinstance(source, (list, tuple)) else [source]
    runs = [np.asarray(run, dtype=float) for run in runs]
    if not runs or any(run.ndim < 1 or len(run) < 2 for run in runs):
        raise ValueError("expected an array whose first axis is time, of two samples at least, or a list of those")
    if len({run.shape[1:] for run in runs}) > 1:
        raise ValueError(f"runs must agree in all but their length; got shapes {[run.shape for run in runs]}")
    bad = [number for number, run in enumerate(runs) if not np.isfinite(run).all()]
    if bad:
        raise ValueError(f"run {bad[0]} has samples that are not finite; leave out what came after it went wrong")
    return runs


def blocksOf(runs, blocks=None, longest=0):
    """Cut each run into equal blocks; the odd rest at its start is left out.

    Parameters
    ----------
    runs : list of array (samples, ...)
        independent runs
    blocks : int, optional
        per run; by default as few as make ten in all runs together
    longest : int
        samples of a lag, which must fit in a block

    Returns
    -------
    list of array
        the blocks of all runs

    Raises
    ------
    ValueError
        if a lag does not fit
    """
    count = blocks or math.ceil(FEWEST_BLOCKS / len(runs))
    pieces = []
    for run in runs:
        length = len(run) // count
        if length <= max(longest, 1):
            raise ValueError(
                f"a lag of {longest} samples does not fit in a block of {length}, a run of {len(run)} samples cut in "
                f"{count}: run longer, or ask for a shorter lag or fewer blocks"
            )
        start = len(run) - count * length
        pieces += [run[start + i * length : start + (i + 1) * length] for i in range(count)]
    return pieces
