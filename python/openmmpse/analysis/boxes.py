# SPDX-License-Identifier: MIT
"""What a periodic fluid does to diffusion, and diffusion at short times from the library's own mobility; [A3], [A4]."""

from __future__ import annotations

import functools
import math

import numpy as np
from openmm import unit

REACH = 6.3  #: exp(-REACH^2) = 6e-18 is what both sums leave out


def boxVectors(box):
    """Box vectors as rows (3, 3), nm, of an edge, three edges, three vectors, or a Quantity of any of them."""
    if unit.is_quantity(box):
        box = box.value_in_unit(unit.nanometer)
    rows = np.array([getattr(row, "_value", row) for row in box] if np.ndim(box) else box, dtype=float)
    rows = np.eye(3) * rows if rows.ndim < 2 else rows
    if rows.shape != (3, 3) or not np.linalg.det(rows) > 0:
        raise ValueError(f"expected an edge, three edges or three right-handed vectors of a box in nm, got {box!r}")
    return rows


def latticeConstant(box):
    """C of [A4]: kT C/(6 pi eta V^(1/3)) is what the images take from the diffusion coefficient of a small particle.

    2.8372974794806 in a cube (Hasimoto 1959). A third of the trace of the periodic Stokeslet is a solution of Poisson's
    equation, so C is the lattice's Madelung constant in a neutral background, here by Ewald's sums to 1e-13.

    Parameters
    ----------
    box : float, array (3,) or (3, 3)
        an edge, three edges or three vectors (rows), nm; Quantities, too
    """
    return _latticeConstant(boxVectors(box).tobytes())


@functools.lru_cache(maxsize=64)
def _latticeConstant(data):
    box = np.frombuffer(data).reshape(3, 3)
    box = box / np.linalg.det(box) ** (1 / 3)
    kappa = math.sqrt(math.pi)  # for V = 1: both sums fall off alike
    r = np.sqrt(np.square(_lattice(box, REACH / kappa)).sum(axis=1))
    k2 = np.square(_lattice(2 * math.pi * np.linalg.inv(box).T, 2 * kappa * REACH)).sum(axis=1)
    near = sum(math.erfc(kappa * x) / x for x in r)
    waves = float((np.exp(-k2 / (4 * kappa**2)) / k2).sum())
    return 2 * kappa / math.sqrt(math.pi) + math.pi / kappa**2 - near - 4 * math.pi * waves


def finiteSizeCorrection(box, viscosity, kT, radius=0.0, gyration=0.0):
    """What to add to a diffusion coefficient measured in a periodic fluid, averaged over directions, nm^2/ps [A4]:

        D_inf - D_box = kT/(6 pi eta V^(1/3)) (C - (4 pi/3) (Rg^2 + a^2)/V^(2/3))

    The first term is the flow that the images of a point force cause at its place (Yeh and Hummer 2004); the second is
    the uniform background that keeps the mean flow zero, averaged over the N^2 pairs of beads and over all
    orientations (mean square distance 2 Rg^2). For diffusion at short times that is exact in every box, for beads
    nearer to each other than to images; one orientation differs from the mean by (Rg/L)^4 of the first term in a cube.
    At long times it is the usual approximation.

    Parameters
    ----------
    box : float, array (3,) or (3, 3)
        an edge, three edges or three vectors (rows), nm
    viscosity : float
        Da/(nm ps); in a suspension that of the suspension, with a radius of 0
    kT : float
        kJ/mol
    radius, gyration : float
        of a bead, and radius of gyration of the molecule, nm
    """
    vectors = boxVectors(box)
    edge = np.linalg.det(vectors) ** (1 / 3)
    second = 4 * math.pi / 3 * (gyration**2 + radius**2) / edge**2
    return float(kT / (6 * math.pi * viscosity * edge) * (latticeConstant(vectors) - second))


def shortTimeDiffusion(context, particles=None):
    """Exact short-time diffusion coefficient of the mean position of particles, nm^2/ps, in the fluid they are in [A3].

    A unit force spread evenly over them moves their mean by tr(sum_ij M_ij)/(3 N^2), averaged over three directions:
    Kirkwood's double sum with the mobility that the Context itself uses, at its positions, images, mixtures and all,
    to its tolerance.

    Parameters
    ----------
    context : openmm.Context
        with a PSEBrownianIntegrator
    particles : list of int, optional
        by default all that have a mass
    """
    from openmmpse import PSEBrownianIntegrator

    integrator = PSEBrownianIntegrator.cast(context.getIntegrator())
    system = context.getSystem()
    if particles is None:
        masses = (system.getParticleMass(i)._value for i in range(system.getNumParticles()))
        particles = [i for i, mass in enumerate(masses) if mass > 0]
    particles = np.asarray(particles)
    total = 0.0
    for axis in range(3):
        forces = np.zeros((system.getNumParticles(), 3))
        forces[particles, axis] = 1.0 / len(particles)
        total += np.mean(np.asarray(integrator.applyMobility(forces))[particles, axis])
    kT = (unit.MOLAR_GAS_CONSTANT_R * integrator.getTemperature()).value_in_unit(unit.kilojoule_per_mole)
    return float(kT * total / 3)


def _lattice(rows, reach):
    """Vectors of the lattice with these rows, without zero and no longer than reach, (n, 3)."""
    widths = 1 / np.linalg.norm(np.linalg.inv(rows), axis=0)  # distances of opposite faces
    ranges = [np.arange(-math.floor(reach / w), math.floor(reach / w) + 1) for w in widths]
    labels = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1).reshape(-1, 3)
    vectors = labels[np.any(labels != 0, axis=1)] @ rows
    return vectors[np.square(vectors).sum(axis=1) <= reach**2]
