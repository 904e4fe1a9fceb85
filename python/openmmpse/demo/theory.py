# SPDX-License-Identifier: MIT
"""What theory says about the diffusion of a molecule made of beads, by dense NumPy algebra.

Nothing here shares a line with the integrator: free space instead of a periodic box, matrices
instead of sums over a grid. Units are OpenMM's: nm, ps, kJ/mol, Da/(nm ps). Diffusion coefficients are
in nm^2/ps (1 nm^2/ps = 1e-6 m^2/s).

Symbols: a radius of a bead, eta viscosity, M mobility, kT thermal energy, r distance, N beads.
"""

from __future__ import annotations

import math

import numpy as np

GAS_CONSTANT = 8.31446261815324e-3  #: kJ/(mol K), CODATA 2018 (exact)
M2_PER_S = 1e-6  #: one nm^2/ps in m^2/s
MPA_S = 602.21407621  #: one mPa s in Da/(nm ps): 1e-3 N_A 1e3 1e-21
CUBIC_LATTICE_CONSTANT = 2.8372974794806  #: Hasimoto 1959, simple cubic array of Stokeslets


def thermal_energy(temperature):
    """kT in kJ/mol at a temperature in K."""
    return GAS_CONSTANT * temperature


def stokes_mobility(radius, viscosity):
    """Mobility 1/(6 pi eta a) of one sphere, in nm/ps per kJ/(mol nm)."""
    return 1.0 / (6.0 * math.pi * viscosity * radius)


def rpy_mobility(positions, radius, viscosity):
    """Rotne-Prager-Yamakawa mobility of equal spheres in infinite solvent, overlaps included.

    positions: (N, 3), nm. Returns (3N, 3N), nm/ps per kJ/(mol nm), symmetric positive definite.
    Source: Rotne and Prager 1969; Yamakawa 1970; for r < 2a Rotne and Prager's overlap form.
    """
    a = radius
    r, unit = _distances(positions)
    n = len(r)
    far = r >= 2 * a
    safe = np.where(r > 0, r, 1.0)
    identity = np.where(far, 3 * a / (4 * safe) + a**3 / (2 * safe**3), 1 - 9 * r / (32 * a))
    dyadic = np.where(far, 3 * a / (4 * safe) - 3 * a**3 / (2 * safe**3), 3 * r / (32 * a))
    blocks = identity[..., None, None] * np.eye(3)
    blocks = blocks + dyadic[..., None, None] * unit[..., :, None] * unit[..., None, :]
    matrix = blocks.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
    return stokes_mobility(a, viscosity) * matrix


def kirkwood(positions, radius, viscosity, kT):
    """Short-time diffusion coefficient of the centre of mass, nm^2/ps: kT tr(sum_ij M_ij)/(3 N^2).

    Exact for the Rotne-Prager-Yamakawa mobility; only its trace enters, which is 1/(6 pi eta r) beyond
    contact and (1 - r/4a)/(6 pi eta a) for overlapping beads (r = 0 is the bead itself).
    """
    r, _ = _distances(positions)
    far = r >= 2 * radius
    trace = np.where(far, radius / np.where(far, r, 1.0), 1 - r / (4 * radius))
    return kT * stokes_mobility(radius, viscosity) * trace.mean()


def rigid_body(positions, radius, viscosity, kT):
    """Diffusion of the beads frozen into one rigid body.

    Returns (translation in nm^2/ps, rotation in 1/ps), each a third of a trace. Translation is taken
    at the centre of diffusion, whose coefficient every point of the body shares at long times (Brenner 1967;
    Garcia de la Torre and Bloomfield 1981).
    """
    centred = positions - np.mean(positions, axis=0)
    motion = _rigid_motions(centred)
    resistance = motion.T @ np.linalg.solve(rpy_mobility(centred, radius, viscosity), motion)
    mobility = np.linalg.inv(resistance)
    rotation, coupling = mobility[3:, 3:], mobility[3:, :3]
    skew = np.array(
        [coupling[1, 2] - coupling[2, 1], coupling[2, 0] - coupling[0, 2], coupling[0, 1] - coupling[1, 0]]
    )
    centre = np.linalg.solve(np.trace(rotation) * np.eye(3) - rotation, skew)
    shift = np.eye(6)
    shift[:3, 3:] = -_cross(centre)
    at_centre = shift @ mobility @ shift.T
    return kT * np.trace(at_centre[:3, :3]) / 3, kT * np.trace(rotation) / 3


def frozen_bound(positions, radius, viscosity, kT):
    """What one shape contributes to a lower bound of the long-time diffusion coefficient, nm^2/ps.

        <kT tr(R^-1)/3> <= D(long) <= Kirkwood,     R = sum_ij (M^-1)_ij

    D(long) is the least value of kT <(e + grad phi) M (e + grad phi)> over functions phi of the shape, with e the
    average over beads; Kirkwood's formula is phi = 0 (Wilemski and Tanaka 1981). The bound takes the least value shape
    by shape: the beads then move with one velocity, as if frozen together. <> averages over shapes.
    """
    motion = _rigid_motions(positions)[:, :3]
    resistance = motion.T @ np.linalg.solve(rpy_mobility(positions, radius, viscosity), motion)
    return kT * np.trace(np.linalg.inv(resistance)) / 3


def free_draining(count, radius, viscosity, kT):
    """Diffusion coefficient of the centre of mass of `count` beads without hydrodynamics: D0/N, nm^2/ps."""
    return kT * stokes_mobility(radius, viscosity) / count


def radius_of_gyration(positions):
    """Root mean square distance of the beads from their mean, nm."""
    centred = positions - np.mean(positions, axis=0)
    return math.sqrt((centred**2).sum(axis=1).mean())


def finite_size_correction(edge, viscosity, kT, gyration=0.0, radius=0.0):
    """What to add to the diffusion coefficient measured in a cubic periodic box, nm^2/ps.

        D_inf - D_box = kT/(6 pi eta L) (2.837297 - (4 pi/3) (Rg^2 + a^2)/L^2)

    The first term is the flow that the images of a point force cause at its place; the second is the
    uniform background that keeps the mean flow zero, averaged over the N^2 pairs of beads and over all
    orientations (mean square distance 2 Rg^2). Exact for one sphere (Rg = 0); the next order is (Rg/L)^4 of the first.
    """
    second = 4 * math.pi / 3 * (gyration**2 + radius**2) / edge**2
    return kT / (6 * math.pi * viscosity * edge) * (CUBIC_LATTICE_CONSTANT - second)


def gaussian_chain_kirkwood(count, bond, radius, viscosity, kT):
    """Kirkwood's short-time diffusion coefficient averaged over ideal Gaussian chains, nm^2/ps.

    count: beads; bond: root mean square bond length, nm. Each distance along the chain has a Maxwell
    distribution; the average of the traced Rotne-Prager-Yamakawa tensor over it is closed (error functions).
    """
    total = float(count)
    for separation in range(1, count):
        spread = bond * math.sqrt(separation / 3.0)
        total += 2 * (count - separation) * _maxwell_average(spread, radius)
    return kT * stokes_mobility(radius, viscosity) * total / count**2


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


def _distances(positions):
    """Distances (N, N) and unit vectors (N, N, 3), zero on the diagonal, of r_ij = x_i - x_j."""
    positions = np.asarray(positions, dtype=float)
    difference = positions[:, None] - positions[None, :]
    r = np.sqrt((difference**2).sum(axis=-1))
    return r, difference / np.where(r > 0, r, 1.0)[..., None]


def _cross(vector):
    """Matrix of the cross product vector x (.)."""
    x, y, z = vector
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _rigid_motions(positions):
    """(3N, 6): bead velocities caused by unit velocities and unit angular velocities of the body."""
    return np.vstack([np.hstack([np.eye(3), -_cross(x)]) for x in positions])


def _maxwell_average(spread, radius):
    """Mean of a/r beyond r = 2a and 1 - r/4a below it, for r with normal components of width `spread`."""
    c = 2 * radius / spread
    tail = math.sqrt(2 / math.pi) * math.exp(-c * c / 2)
    inside = math.erf(c / math.sqrt(2)) - c * tail
    mean_inside = 2 * math.sqrt(2 / math.pi) - (c * c + 2) * tail
    return radius / spread * tail + inside - spread / (4 * radius) * mean_inside
