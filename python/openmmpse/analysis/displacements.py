# SPDX-License-Identifier: MIT
"""Mean square displacements and diffusion coefficients with error bars; docs/analysis.md [A1], [A2].

Positions must be unwrapped (see `trajectory.unwrap`), lengths in nm, times in ps, diffusion coefficients in nm^2/ps.
Windows of one lag overlap inside a block, never across blocks or runs, and all particles of a run are averaged before
any error is taken: particles that move each other need not be independent, only blocks must be long against whatever
relaxes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .estimates import FEWEST_BLOCKS, Curve, Estimate, blocksOf, estimate, meanOfBlocks, runsOf

CHUNK = 2**22  #: numbers that are Fourier transformed at a time
REFINEMENTS = 4  #: of the ratio of offset to slope that the weights of a fit depend on
MOST_OFFSET = 100.0  #: of that ratio, in displacements over the first lag


class Diffusion(NamedTuple):
    """What `diffusion` finds."""

    coefficient: Estimate  #: nm^2/ps
    offset: Estimate  #: of the straight line at time zero, nm^2
    trend: Estimate  #: late less early slope over 2 d, nm^2/ps; zero within its error where motion is diffusive
    curve: Curve  #: mean square displacement at the lags of the fit, nm^2
    degrees: int  #: of freedom of the error bars


def centresOf(positions, molecules, masses=None):
    """Centres of molecules: of mass, or without masses the means of their beads.

    Parameters
    ----------
    positions : array (frames, N, 3)
        unwrapped
    molecules : list of lists of int, or int
        indices of the particles of each, or the number of molecules if all are alike and one after the other
    masses : array (N,), optional
        in any unit

    Returns
    -------
    array (frames, molecules, 3)
    """
    positions = np.asarray(positions, dtype=float)
    if isinstance(molecules, (int, np.integer)):
        if molecules < 1 or positions.shape[1] % molecules:
            raise ValueError(f"{positions.shape[1]} particles cannot be {molecules} molecules of equal size")
        molecules = np.split(np.arange(positions.shape[1]), molecules)
    weights = np.ones(positions.shape[1]) if masses is None else np.asarray(masses, dtype=float)
    return np.stack([np.average(positions[:, list(m)], axis=1, weights=weights[list(m)]) for m in molecules], axis=1)


def spacedLags(longest):
    """About eight lags per factor of ten from 1 to the longest, which is included, in samples."""
    count = 2 + int(8 * np.log10(longest))
    return sorted({int(round(x)) for x in np.geomspace(1, longest, count)} | {int(longest)})


def meanSquares(path, lags):
    """Mean of |x(t + lag) - x(t)|^2 over all windows and particles, one number per lag, for path (samples, ..., d)."""
    path = np.asarray(path, dtype=float)
    if len(lags) <= 4 * math.log2(len(path)):  # about where the transforms become cheaper
        return np.array([np.square(path[k:] - path[:-k]).sum(axis=-1).mean() for k in lags])
    flat = path.reshape(len(path), -1)
    count, size = flat.shape[1], 2 ** math.ceil(math.log2(2 * len(path)))
    products = np.zeros(len(path))
    squares = np.zeros(len(path))
    for begin in range(0, count, max(1, CHUNK // size)):
        part = flat[:, begin : begin + max(1, CHUNK // size)]
        part = part - part.mean(axis=0)
        waves = np.fft.rfft(part, size, axis=0)
        products += np.fft.irfft(np.square(np.abs(waves)).sum(axis=1), size)[: len(path)]
        squares += np.square(part).sum(axis=1)
    sums = np.concatenate([[0.0], np.cumsum(squares)])
    lags = np.asarray(lags)
    windows = len(path) - lags
    # |x - y|^2 = x^2 + y^2 - 2 xy, each summed over the windows of a lag.
    total = sums[windows] + sums[-1] - sums[lags] - 2 * products[lags]
    return total / windows / (count // path.shape[-1])


def meanSquareDisplacement(runs, interval, lags=None, blocks=None):
    """Mean square displacement over all dimensions, with error bars [A1].

    Parameters
    ----------
    runs : array (frames, N, d) or (frames, d), or a list of them
        positions in nm, unwrapped, in equilibrium; a list has one for each independent run
    interval : float
        time between frames, ps
    lags : list of int, optional
        in frames; by default about eight per factor of ten up to a quarter of a block
    blocks : int, optional
        per run; by default ten in all. Each must be long against the relaxation of what is measured

    Returns
    -------
    Curve
        times in ps, values and errors in nm^2
    """
    runs = runsOf(runs)
    if lags is None:
        shortest = min(len(run) for run in runs) // (blocks or math.ceil(FEWEST_BLOCKS / len(runs)))
        lags = spacedLags(max(1, shortest // 4))
    lags = [int(lag) for lag in lags]
    rows = [meanSquares(block, lags) for block in blocksOf(runs, blocks, max(lags))]
    return Curve(np.array(lags) * float(interval), *meanOfBlocks(rows))


def diffusion(runs, interval, start=None, count=5, blocks=None, offset=True):
    """Diffusion coefficient: a straight line through mean square displacements by generalised least squares [A2].

    The lags are 1 .. count times `start`. Displacements of different lags are made of the same steps; the weights are
    those of Brownian motion plus a bounded random displacement, which is what a molecule's inner motion adds: the
    line's offset. The weights make the error bar small, the spread of blocks makes it right, whatever the motion is.
    Look at `trend`: if it is not zero within its error, `start` is too early.

    Parameters
    ----------
    runs, interval, blocks
        as in `meanSquareDisplacement`
    start : float, optional
        time in ps beyond which motion is diffusive; by default one frame
    count : int
        number of lags, 3 or more (without offset 1)
    offset : bool
        False: the line goes through the origin, as for a sphere alone; its error bar is the smallest then

    Returns
    -------
    Diffusion
        in nm^2 and ps
    """
    runs, interval = runsOf(runs), float(interval)
    first = 1 if start is None else int(round(float(start) / interval))
    if first < 1 or count < (3 if offset else 1):
        raise ValueError(
            f"a start of {start} ps is {first} frames of {interval} ps and there are {count} lags; needed are one "
            f"frame and {3 if offset else 1} lags at least"
        )
    lags = first * np.arange(1, count + 1)
    blocks = blocksOf(runs, blocks, lags[-1])
    rows = np.array([meanSquares(block, lags) for block in blocks])
    weights = _weights(rows.mean(axis=0), len(blocks[0]) // first, offset)
    scale = 1.0 / (2 * runs[0].shape[-1] * first * interval)
    early, late = (_slopes(count, offset, half) for half in (slice(None, count // 2 + 1), slice(count // 2, None)))
    return Diffusion(
        estimate(rows @ weights[-1] * scale),
        estimate(rows @ weights[0]) if offset else Estimate(0.0, 0.0),
        estimate(rows @ (late - early) * scale) if count > 1 else Estimate(0.0, 0.0),
        Curve(lags * interval, *meanOfBlocks(rows)),
        len(rows) - 1,
    )


def brownianCovariance(samples, lags, noise=0.0):
    """Covariance of mean square displacements of one coordinate of a random walk, (lags, lags), exact.

    samples  positions of the walk; its steps have variance 1
    noise    twice the variance of an independent displacement added to each position, so that means are noise + lag

    Two windows overlap in c steps, and their squares have the covariance 2 c^2: [A2].
    """
    lags = np.asarray(lags)
    i, j = lags[:, None, None], lags[None, :, None]
    shift = np.arange(-lags.max(), lags.max() + 1)  # of the second window's beginning; farther ones do not overlap
    pairs = np.minimum(samples - i, samples - j - shift) - np.maximum(0, -shift)
    common = np.clip(np.minimum(i, shift + j) - np.maximum(0, shift), 0, None).astype(float)
    common += noise / 2 * (1.0 * (shift == 0) + (shift == i - j) - (shift == i) - (shift == -j))
    total = 2 * (np.clip(pairs, 0, None) * common**2).sum(axis=-1)
    return total / np.outer(samples - lags, samples - lags)


def _weights(means, samples, offset):
    """Weights (parameters, lags) of (offset,) slope per first lag."""
    lags = np.arange(1, len(means) + 1)
    samples = max(samples, len(means) + 1)
    design = np.column_stack([np.ones(len(lags)), lags] if offset else [lags]).astype(float)
    noise = 0.0
    for _ in range(REFINEMENTS):
        inverse = np.linalg.inv(brownianCovariance(samples, lags, noise))
        weights = np.linalg.solve(design.T @ inverse @ design, design.T @ inverse)
        if not offset:
            break
        constant, slope = weights @ means
        noise = min(max(constant / slope, 0.0), MOST_OFFSET) if slope > 0 else MOST_OFFSET
    return weights


def _slopes(count, offset, part):
    """Weights (count,) of an ordinary straight line through some of the lags 1 .. count."""
    lags = np.arange(1.0, count + 1)[part]
    weights = np.zeros(count)
    centred = lags - lags.mean() if offset else lags
    weights[part] = centred / np.square(centred).sum()
    return weights
