# SPDX-License-Identifier: MIT
"""Relaxation of a network of springs in a solvent, by dense NumPy algebra, beside `openmmpse.analysis.beads`.

Units are OpenMM's: nm, ps, kJ/mol. Diffusion coefficients are in nm^2/ps.
"""

from __future__ import annotations

import numpy as np


def harmonic_modes(mobility, stiffness, kT):
    """Relaxation of a network of springs in a solvent, in the linear approximation.

    mobility, stiffness: (3N, 3N). Returns (rates, weights): relaxation rates (1/ps, rising) of all modes and what
    each contributes to the short-time diffusion coefficient of the centre of mass (nm^2/ps); modes of rate
    zero (rigid motions, rates below 1e-9 of the fastest are set to it) are what is left at long times:

        D(t) = sum_m weight_m (1 - exp(-rate_m t))/(rate_m t)
    """
    factor = np.linalg.cholesky(mobility)
    rates, modes = np.linalg.eigh(factor.T @ stiffness @ factor)
    rates[rates < 1e-9 * rates[-1]] = 0.0
    count = len(mobility) // 3
    centre = np.tile(np.eye(3), (count, 1)) / count
    weights = kT / 3 * ((centre.T @ factor @ modes) ** 2).sum(axis=0)
    return rates, weights


def apparent_diffusion(rates, weights, step, counts):
    """Mean square displacement of the centre of mass over 6 t, nm^2/ps, of `harmonic_modes` after `counts` > 0 steps.

    It is that of Euler-Maruyama steps (of length `step`, ps, rates times step below 2), exactly: a mode keeps the part
    1 - rate step of itself in every step. The limit of short steps is the formula of `harmonic_modes`.
    """
    decay = 1.0 - np.asarray(rates) * step
    counts = np.asarray(counts)[:, None]
    moving = decay < 1.0
    safe = np.where(moving, decay, 0.0)
    return np.where(moving, 2 * (1 - safe**counts) / ((1 - safe**2) * counts), 1.0) @ weights
