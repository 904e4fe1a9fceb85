# SPDX-License-Identifier: MIT
"""Means and honest error bars from trajectories of the centre of mass.

Every error is one standard error of the mean over blocks that are long against the correlation time, so
that they count as independent. Displacements overlap inside a block, never across blocks or replicas.
Lengths in nm, times in ps, diffusion coefficients in nm^2/ps.
"""

from __future__ import annotations

import numpy as np

from openmmpse.analysis.displacements import meanSquares
from openmmpse.analysis.estimates import blocksOf, estimate, meanOfBlocks

CONTROL = (
    0.75  #: share of the noise's chance deviation taken off; best is (long-time over short-time D)^2, 0.7-0.9 here
)


def displacement_diffusion(paths, interval, lags, blocks_per_path, noise=None, noise_diffusion=0.0):
    """Mean square displacement over 6 t from paths of a point, (samples, 3), at lags given in samples.

    Returns (mean, error), one entry per lag. The windows of one lag overlap, which lowers the variance by a third.
    noise: paths of the random part of the same displacements, whose diffusion coefficient, noise_diffusion, is known.
    Most of the chance in a displacement is chance in its noise: the share CONTROL of what the noise shows beyond its
    known mean is taken off. A constant share keeps the estimate unbiased (a control variate); it halves the error bar.
    """
    times = 6 * interval * np.asarray(lags)
    rows = np.array([meanSquares(block, lags) / times for block in blocksOf(paths, blocks_per_path, max(lags))])
    if noise is not None:
        shown = [meanSquares(block, lags) / times for block in blocksOf(noise, blocks_per_path, max(lags))]
        rows -= CONTROL * (np.array(shown) - noise_diffusion)
    return meanOfBlocks(rows)


def noise_paths(paths, drifts, step):
    """Random part of paths sampled every step: position less the sum of drift velocity times step before it."""
    return [path - step * (np.cumsum(drift, axis=0) - drift) for path, drift in zip(paths, drifts)]


def drift_integral(drifts, step, longest, blocks_per_path):
    """What the correlations of the drift velocity take away from the short-time diffusion coefficient.

    drifts: paths (samples, 3), every step, of A = (1/N) sum_ij M_ij f_j, nm/ps: the velocity that the forces give to
    the centre of mass. In equilibrium, dynamics being reversible, the mean square displacement follows from it without
    the noise of the displacement itself (the cross term of drift and noise is minus twice the drift term):

        D(t) = D(0) - int_0^t (1 - s/t) C(s) ds,    D(long) = D(0) - int_0^inf C(s) ds,    C(s) = <A(s).A(0)>/3

    The sums used are exact for Euler-Maruyama steps of length h with harmonic forces, where D(t) is

        D(n h) = D(0) + h C_0/2 - (h/n) sum_(k=0)^(n-2) (n - 1 - k) C_k

    and D(long) the trapezoidal rule. Returns (times, (mean, error) of D(0) - D(t), (mean, error) of the second
    integral), for t = 1 .. longest steps.
    """
    rows = [_integrals(block, step, longest) for block in blocksOf(drifts, blocks_per_path, longest)]
    mean, error = meanOfBlocks(rows)
    return step * np.arange(1, longest + 1), (mean[0], error[0]), (mean[1], error[1])


def one_step_diffusion(groups, step):
    """Diffusion coefficient from independent displacements in one step, (groups, samples, 3), nm.

    One group belongs to one configuration. The error comes from the spread of the groups' means, so it holds the
    spread of the configurations too.
    """
    groups = np.asarray(groups, dtype=float)
    return estimate((groups**2).sum(axis=-1).mean(axis=-1) / (6 * step))


def _integrals(drift, step, longest):
    """D(0) - D(t) and the integral of C from 0 to t, for t = 1 .. longest steps: see `drift_integral`."""
    correlation = np.array(
        [(drift[k:] * drift[: len(drift) - k]).sum(axis=1).mean() / 3 for k in range(longest + 1)]
    )
    sums = np.cumsum(correlation)
    total = step * (sums - 0.5 * (correlation[0] + correlation))
    before = np.concatenate([[0.0], sums[:-2]])  # sum of C_k up to k = n - 2, for n = 1 .. longest
    apparent = step * (np.cumsum(before) / np.arange(1, longest + 1) - 0.5 * correlation[0])
    return apparent, total[1:]
