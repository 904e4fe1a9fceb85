# SPDX-License-Identifier: MIT
"""Diffusion of molecules made of beads in infinite solvent, by dense NumPy algebra on configurations; [A3].

Nothing here shares a line with the integrator. Units are OpenMM's: nm, ps, kJ/mol, Da/(nm ps). Diffusion coefficients
are in nm^2/ps (1 nm^2/ps = 1e-6 m^2/s). Beads may differ in radius.

Symbols: a radius of a bead, eta viscosity, M mobility, kT thermal energy, r distance, N beads.
"""

from __future__ import annotations

import math

import numpy as np

GAS_CONSTANT = 8.31446261815324e-3  #: kJ/(mol K), CODATA 2018 (exact)
M2_PER_S = 1e-6  #: one nm^2/ps in m^2/s
MPA_S = 602.21407621  #: one mPa s in Da/(nm ps): 1e-3 N_A 1e3 1e-21


def thermalEnergy(temperature):
    """kT in kJ/mol at a temperature in K."""
    return GAS_CONSTANT * temperature


def stokesMobility(radius, viscosity):
    """Mobility 1/(6 pi eta a) of one sphere, in nm/ps per kJ/(mol nm)."""
    return 1.0 / (6.0 * math.pi * viscosity * radius)


def radiusOfGyration(positions):
    """Root mean square distance of the beads from their mean, nm; of (N, 3) a number, of (..., N, 3) an array."""
    positions = np.asarray(positions, dtype=float)
    centred = positions - positions.mean(axis=-2, keepdims=True)
    return np.sqrt(np.square(centred).sum(axis=-1).mean(axis=-1))


def mobilityMatrix(positions, radii, viscosity):
    """Rotne-Prager-Yamakawa mobility of spheres in infinite solvent, overlaps included.

    Source: Rotne and Prager 1969; Yamakawa 1970; for unequal radii Zuk, Wajnryb, Mizerski, Szymczak 2014.

    Parameters
    ----------
    positions : array (N, 3)
        nm
    radii : float or array (N,)
        nm
    viscosity : float
        Da/(nm ps)

    Returns
    -------
    array (3N, 3N)
        nm/ps per kJ/(mol nm), symmetric positive definite
    """
    r, unit = _distances(positions)
    n = len(r)
    large, small = _pairsOf(radii, n)
    safe = np.where(r > 0, r, 1.0)
    squares = (large**2 + small**2) / safe**2
    gap, product = (large - small) ** 2, large * small
    identity = np.select(
        [r >= large + small, r > large - small],
        [
            3 / (4 * safe) * (1 + squares / 3),
            (16 * safe**3 * (large + small) - (gap + 3 * safe**2) ** 2) / (32 * safe**3 * product),
        ],
        1 / large,
    )
    dyadic = np.select(
        [r >= large + small, r > large - small],
        [3 / (4 * safe) * (1 - squares), 3 * (gap - safe**2) ** 2 / (32 * safe**3 * product)],
        0.0,
    )
    blocks = identity[..., None, None] * np.eye(3)
    blocks = blocks + dyadic[..., None, None] * unit[..., :, None] * unit[..., None, :]
    return stokesMobility(1.0, viscosity) * blocks.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)


def kirkwood(positions, radii, viscosity, kT):
    """Short-time diffusion coefficient of the mean position of the beads: kT tr(sum_ij M_ij)/(3 N^2) [A3].

    Exact for the Rotne-Prager-Yamakawa mobility; only its trace enters, which over 3 is 1/(6 pi eta r) beyond contact,
    (2 r (a + b) - r^2 - (a - b)^2)/(4 r a b) over 6 pi eta where spheres of radii a and b overlap, 1/(6 pi eta a) where
    the smaller one is inside. Kirkwood's formula for the long-time coefficient, of which it is an upper bound.

    Parameters
    ----------
    positions : array (N, 3) or (frames, N, 3)
        nm, in infinite solvent: not wrapped
    radii : float or array (N,)
        nm
    viscosity : float
        Da/(nm ps)
    kT : float
        kJ/mol

    Returns
    -------
    float, or array (frames,)
        nm^2/ps
    """
    positions = np.asarray(positions, dtype=float)
    if positions.ndim == 3:
        return np.array([kirkwood(x, radii, viscosity, kT) for x in positions])
    r = _distances(positions, directions=False)
    large, small = _pairsOf(radii, len(r))
    safe = np.where(r > 0, r, 1.0)
    touching = (2 * safe * (large + small) - safe**2 - (large - small) ** 2) / (4 * safe * large * small)
    trace = np.select([r >= large + small, r > large - small], [1 / safe, touching], 1 / large)
    return float(kT * stokesMobility(1.0, viscosity) * trace.mean())


def gaussianChainKirkwood(count, bond, radius, viscosity, kT):
    """Kirkwood's short-time diffusion coefficient averaged over ideal Gaussian chains, nm^2/ps [A3].

    Each distance along the chain has a Maxwell distribution; the average of the traced Rotne-Prager-Yamakawa tensor
    over it is closed (error functions).

    Parameters
    ----------
    count : int
        beads
    bond, radius : float
        root mean square length of a bond, and radius of a bead, nm
    viscosity, kT : float
        Da/(nm ps), kJ/mol
    """
    total = float(count)
    for separation in range(1, count):
        spread = bond * math.sqrt(separation / 3.0)
        total += 2 * (count - separation) * _maxwellAverage(spread, radius)
    return kT * stokesMobility(radius, viscosity) * total / count**2


def freeDraining(count, radius, viscosity, kT):
    """Diffusion coefficient of the centre of `count` equal beads without hydrodynamics: D0/N, nm^2/ps."""
    return kT * stokesMobility(radius, viscosity) / count


def rigidBody(positions, radii, viscosity, kT):
    """Diffusion of the beads frozen into one rigid body.

    Translation is taken at the centre of diffusion, whose coefficient every point of the body shares at long times
    (Brenner 1967; Garcia de la Torre and Bloomfield 1981).

    Parameters
    ----------
    positions : array (N, 3)
        nm, three or more not on a line
    radii : float or array (N,)
        nm
    viscosity, kT : float
        Da/(nm ps), kJ/mol

    Returns
    -------
    (float, float)
        translation in nm^2/ps and rotation in 1/ps, each a third of a trace
    """
    centred = positions - np.mean(positions, axis=0)
    motion = _rigidMotions(centred)
    resistance = motion.T @ np.linalg.solve(mobilityMatrix(centred, radii, viscosity), motion)
    mobility = np.linalg.inv(resistance)
    rotation, coupling = mobility[3:, 3:], mobility[3:, :3]
    skew = np.array(
        [coupling[1, 2] - coupling[2, 1], coupling[2, 0] - coupling[0, 2], coupling[0, 1] - coupling[1, 0]]
    )
    centre = np.linalg.solve(np.trace(rotation) * np.eye(3) - rotation, skew)
    shift = np.eye(6)
    shift[:3, 3:] = -_cross(centre)
    atCentre = shift @ mobility @ shift.T
    return kT * np.trace(atCentre[:3, :3]) / 3, kT * np.trace(rotation) / 3


def frozenBound(positions, radii, viscosity, kT):
    """What one shape contributes to a lower bound of the long-time diffusion coefficient, nm^2/ps:

        <kT tr(R^-1)/3> <= D(long) <= Kirkwood,     R = sum_ij (M^-1)_ij

    D(long) is the least value of kT <(e + grad phi) M (e + grad phi)> over functions phi of the shape, with e the
    average over beads; Kirkwood's formula is phi = 0 (Wilemski and Tanaka 1981). The bound takes the least value shape
    by shape: the beads then move with one velocity, as if frozen together. <> averages over shapes. Parameters as in
    `rigidBody`.
    """
    motion = _rigidMotions(positions)[:, :3]
    resistance = motion.T @ np.linalg.solve(mobilityMatrix(positions, radii, viscosity), motion)
    return kT * np.trace(np.linalg.inv(resistance)) / 3


def _distances(positions, directions=True):
    """Distances (N, N), and unit vectors (N, N, 3), zero on the diagonal, of r_ij = x_i - x_j."""
    positions = np.asarray(positions, dtype=float)
    difference = positions[:, None] - positions[None, :]
    r = np.sqrt(np.square(difference).sum(axis=-1))
    return (r, difference / np.where(r > 0, r, 1.0)[..., None]) if directions else r


def _pairsOf(radii, count):
    """The larger and the smaller radius of each pair, (N, N)."""
    radii = np.broadcast_to(np.asarray(radii, dtype=float), (count,))
    if not np.all(radii > 0):
        raise ValueError(f"radii must be positive; the smallest is {radii.min()} nm")
    return np.maximum.outer(radii, radii), np.minimum.outer(radii, radii)


def _cross(vector):
    """Matrix of the cross product vector x (.)."""
    x, y, z = vector
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _rigidMotions(positions):
    """(3N, 6): bead velocities caused by unit velocities and unit angular velocities of the body."""
    return np.vstack([np.hstack([np.eye(3), -_cross(x)]) for x in positions])


def _maxwellAverage(spread, radius):
    """Mean of a/r beyond r = 2a and 1 - r/4a below it, for r with normal components of width `spread`."""
    c = 2 * radius / spread
    tail = math.sqrt(2 / math.pi) * math.exp(-c * c / 2)
    inside = math.erf(c / math.sqrt(2)) - c * tail
    meanInside = 2 * math.sqrt(2 / math.pi) - (c * c + 2) * tail
    return radius / spread * tail + inside - spread / (4 * radius) * meanInside
