# SPDX-License-Identifier: MIT
"""Linear viscosity of what is in the solvent, from the stress at rest (Green and Kubo); docs/analysis.md [A6]."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from openmm import unit

from .boxes import boxVectors
from .estimates import Curve, blocksOf, meanOfBlocks, runsOf

STRESS = unit.kilojoule_per_mole / unit.nanometer**3


class GreenKubo(NamedTuple):
    """What `greenKubo` finds."""

    modulus: Curve  #: relaxation modulus G(t), kJ/(mol nm^3)
    viscosity: Curve  #: its integral from 0 to t, Da/(nm ps): what the particles add to the viscosity of the solvent


def greenKubo(stresses, interval, box, kT, longest, blocks=None, isotropic=True):
    """Relaxation modulus and viscosity from the stress at rest, with error bars [A6]:

        G(t) = V/kT <s_xy(t) s_xy(0)>,     viscosity = its integral

    In equilibrium the mean of a shear stress is zero and is not subtracted. The solvent's own viscosity is not in it.

    Parameters
    ----------
    stresses : array (samples, 3, 3), list of Quantities, or list of arrays
        kJ/(mol nm^3), of integrator.computeStress() at even intervals without flow; a list of arrays has one for each
        independent run
    interval : float
        between samples, ps; short against the fastest relaxation that counts
    box : float, array (3,) or (3, 3)
        an edge, three edges or three vectors (rows), nm, whose volume the stress is of
    kT : float
        kJ/mol
    longest : float
        time up to which both are wanted, ps. The error of the integral grows with it: take its value where G has
        vanished within its error, and not later
    blocks : int, optional
        per run; by default ten in all. Each is to be many times `longest`
    isotropic : bool
        True: the mean over all five independent shears, which have the same modulus in an isotropic fluid; False: xy
        alone

    Returns
    -------
    GreenKubo
        times in ps
    """
    runs = [_shears(run, isotropic) for run in runsOf(_plain(stresses))]
    interval, volume = float(interval), float(np.linalg.det(boxVectors(box)))
    most = int(round(float(longest) / interval))
    if most < 1:
        raise ValueError(f"longest is {longest} ps, less than the interval of {interval} ps between samples")
    rows = np.array([volume / kT * _correlation(block, most) for block in blocksOf(runs, blocks, most)])
    steps = (rows[:, 1:] + rows[:, :-1]) * interval / 2
    integrals = np.hstack([np.zeros((len(rows), 1)), np.cumsum(steps, axis=1)])
    times = interval * np.arange(most + 1)
    return GreenKubo(Curve(times, *meanOfBlocks(rows)), Curve(times, *meanOfBlocks(integrals)))


def _shears(stresses, isotropic):
    """(samples, 5) or (samples, 1): stresses each of which has the variance of s_xy in an isotropic fluid.

    The mean of s_ab s_ab of a traceless symmetric tensor is ten times that of s_xy s_xy.
    """
    if stresses.ndim != 3 or stresses.shape[1:] != (3, 3):
        raise ValueError(f"expected stresses of shape (samples, 3, 3), got {stresses.shape}")
    s = (stresses + stresses.transpose(0, 2, 1)) / 2
    if not isotropic:
        return s[:, 0, 1][:, None]
    xx, yy, zz = s[:, 0, 0], s[:, 1, 1], s[:, 2, 2]
    diagonals = [(xx - yy) / 2, (2 * zz - xx - yy) / (2 * math.sqrt(3))]
    return np.stack([s[:, 0, 1], s[:, 0, 2], s[:, 1, 2], *diagonals], axis=1)


def _correlation(values, longest):
    """<v(t) v(0)>, averaged over the columns of (samples, columns), at lags 0 .. longest."""
    samples = len(values)
    size = 2 ** math.ceil(math.log2(samples + longest + 1))
    waves = np.fft.rfft(values, size, axis=0)
    sums = np.fft.irfft(np.square(np.abs(waves)).mean(axis=1), size)[: longest + 1]
    return sums / (samples - np.arange(longest + 1))


def _plain(stresses):
    """Stresses without units, whether one array, a list of arrays or a list of single Quantities."""
    if unit.is_quantity(stresses):
        return stresses.value_in_unit(STRESS)
    if isinstance(stresses, (list, tuple)):
        values = [s.value_in_unit(STRESS) if unit.is_quantity(s) else s for s in stresses]
        return np.array(values) if np.shape(values[0]) == (3, 3) else values
    return stresses
