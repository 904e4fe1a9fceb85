# SPDX-License-Identifier: MIT
"""Elastic network: springs that hold the beads of a protein near their places in the structure file.

Springs join all pairs within a cut-off; their constants fall with the square of the distance (Yang, Song and Jernigan
2009), which makes slow and fast modes lie closer together than equal springs do: fewer steps per relaxation.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import openmm

from openmmpse.analysis import beads

from . import theory

CUTOFF = 1.5  #: nm; with it the slowest mode is 72 times slower than the fastest one (no cut-off: 190 times)
STRENGTH = (
    160.0  #: kJ/mol: constant times squared distance; beads then fluctuate by 0.06 nm, as in crystals of lysozyme
)
RESIDUE_MASS = 110.0  #: Da, mean mass of a residue; it does not enter Brownian motion
#: Step size times fastest rate. Unstable at 2; 0.8 widens the fluctuations by 3 % and leaves diffusion over long
#: times untouched. A free bead would move 0.036 nm in such a step (0.07 radii), but neighbours are dragged along
#: together: their distance changes by 0.011 nm per step, a third of its fluctuation of 0.034 nm.
STEP_FRACTION = 0.8


class Network(NamedTuple):
    pairs: np.ndarray  #: (springs, 2), particle indices
    lengths: np.ndarray  #: rest lengths, nm
    constants: np.ndarray  #: kJ/(mol nm^2)


def connect(positions, cutoff=CUTOFF, strength=STRENGTH):
    """Network of a structure, (N, 3) in nm."""
    first, second = np.triu_indices(len(positions), k=1)
    lengths = np.linalg.norm(positions[first] - positions[second], axis=1)
    near = lengths < cutoff
    pairs = np.column_stack([first[near], second[near]])
    return Network(pairs, lengths[near], strength / lengths[near] ** 2)


def stiffness(network, positions):
    """Second derivatives of the energy at rest, (3N, 3N), kJ/(mol nm^2)."""
    count = len(positions)
    matrix = np.zeros((count, 3, count, 3))
    for (i, j), length, constant in zip(*network):
        along = (positions[i] - positions[j]) / length
        block = constant * np.outer(along, along)
        matrix[i, :, i] += block
        matrix[j, :, j] += block
        matrix[i, :, j] -= block
        matrix[j, :, i] -= block
    return matrix.reshape(3 * count, 3 * count)


def build_system(count, network, edge):
    """OpenMM System of the network in a cubic box."""
    system = openmm.System()
    for _ in range(count):
        system.addParticle(RESIDUE_MASS)
    system.setDefaultPeriodicBoxVectors((edge, 0, 0), (0, edge, 0), (0, 0, edge))
    springs = openmm.HarmonicBondForce()
    for (i, j), length, constant in zip(*network):
        springs.addBond(int(i), int(j), length, constant)
    system.addForce(springs)
    return system


class Relaxation(NamedTuple):
    """Linear theory of the network in the solvent: modes, and the step size that follows from the fastest one."""

    rates: np.ndarray  #: 1/ps, rising; six zeros (rigid motions) first
    weights: np.ndarray  #: nm^2/ps, share of each mode in the short-time diffusion of the centre of mass
    fluctuation: float  #: root mean square displacement of a bead from its place, nm

    @property
    def slowest_time(self):
        """Relaxation time of the slowest network mode, ps."""
        return 1.0 / self.rates[self.rates > 0][0]

    @property
    def step(self):
        """Step size, ps, rounded down to 1 fs."""
        return math.floor(1000 * STEP_FRACTION / self.rates[-1]) / 1000


def relax(network, positions, radius, viscosity, kT):
    """`Relaxation` of a network at rest, from the dense Rotne-Prager-Yamakawa mobility."""
    springs = stiffness(network, positions)
    mobility = beads.mobilityMatrix(positions, radius, viscosity)
    rates, weights = theory.harmonic_modes(mobility, springs, kT)
    values = np.linalg.eigvalsh(springs)
    fluctuation = math.sqrt(kT * (1.0 / values[6:]).sum() / len(positions))
    if np.count_nonzero(rates) != 3 * len(positions) - 6:
        raise ValueError("the elastic network is not rigid: enlarge its cut-off")
    return Relaxation(rates, weights, fluctuation)
