# SPDX-License-Identifier: MIT
"""Scenes that the benchmarks share, spheres of 1 nm in water as suspensions and as gels, and how they are timed."""

import functools
import time

import numpy as np
import openmm

from openmmpse import PSEBrownianIntegrator

RADIUS, VISCOSITY, TEMPERATURE, MASS = 1.0, 600.0, 300.0, 100.0  # nm, Da/(nm ps), K, Da
DRAG = 6 * np.pi * VISCOSITY * RADIUS
KT = 0.00831446261815324 * TEMPERATURE
STEP = 1e-3 * RADIUS**2 * DRAG / KT  # ps; dt D0/a^2 = 1e-3, as real runs have
TILE = 130_000  # particles; larger suspensions are periodic repetitions of smaller ones
GEL_TILE = 2000


# ---------------------------------------------------------------- configurations


def edge(numParticles, phi):
    """Edge of the cube (nm) that the spheres fill to the volume fraction phi."""
    return (numParticles * 4 / 3 * np.pi * RADIUS**3 / phi) ** (1 / 3)


def lattice(numParticles, phi, shuffled=True):
    """Positions (N, 3) on a jittered cubic lattice without overlaps up to phi = 0.5, and the edge.

    In random order, as in a suspension that has been stirred, or in the order of space.
    """
    length = edge(numParticles, phi)
    side = int(np.ceil(numParticles ** (1 / 3) - 1e-9))
    rng = np.random.default_rng(0)
    places = rng.choice(side**3, numParticles, replace=False)
    cells = np.stack(np.unravel_index(places if shuffled else np.sort(places), (side,) * 3), axis=1)
    jitter = rng.uniform(-0.5, 0.5, cells.shape) * max(0.0, 1 - 2 * RADIUS * side / length)
    return (cells + 0.5 + jitter) * length / side, length


@functools.lru_cache(maxsize=4)
def suspension(numParticles, phi):
    """Positions (N, 3) of a random suspension without overlaps (up to 0.1 % of a radius), and the edge.

    Independent positions whose overlaps are pushed apart. Above TILE particles an eighth of them is repeated.
    """
    if numParticles > TILE:
        return _repeated(*suspension(numParticles // 8, phi))
    length = edge(numParticles, phi)
    rng = np.random.default_rng(1)
    x = rng.random((numParticles, 3)) * length
    for _ in range(1000):
        i, j, r, distance = contacts(x, length, 2.02 * RADIUS)
        if not len(i) or distance.min() > 1.999 * RADIUS:
            break
        push = (0.5 * (2.03 * RADIUS - distance) / distance)[:, None] * r
        np.add.at(x, i, push)
        np.subtract.at(x, j, push)
        x %= length
    return x, length


@functools.lru_cache(maxsize=4)
def gel(numParticles, phi):
    """Positions (N, 3) of a gel by diffusion-limited cluster aggregation, and the edge of its box.

    Rigid clusters of touching spheres wander until they meet and then stay together; fractal dimension about 1.8 to 2
    between the size of a sphere and that of the clusters when they fill the box. A cluster far from all others jumps as
    far as the way is free for sure, which is what makes this quick; no two spheres ever overlap. GEL_TILE spheres that
    became one cluster are repeated; numParticles is that many times a power of 8.
    """
    if numParticles > GEL_TILE:
        return _repeated(*gel(numParticles // 8, phi))
    length = edge(numParticles, phi)
    x, _ = suspension(numParticles, min(phi, 0.1))
    x = x * (length / edge(numParticles, min(phi, 0.1)))
    rng = np.random.default_rng(2)
    labels = np.arange(numParticles)
    reach, bond = 3 * RADIUS, 0.1 * RADIUS  # seen around a sphere; longest gap of a bond
    for _ in range(100_000):
        i, j, _, distance = contacts(x, length, 2 * RADIUS + reach)
        labels, foreign = _joined(labels, i, j, distance - 2 * RADIUS, bond)
        count = labels.max() + 1
        if count == 1:
            break
        free = np.full(count, reach)
        np.minimum.at(free, labels[i[foreign]], distance[foreign] - 2 * RADIUS)
        np.minimum.at(free, labels[j[foreign]], distance[foreign] - 2 * RADIUS)
        direction = rng.normal(size=(count, 3))
        direction *= (0.5 * np.maximum(free, bond) / np.linalg.norm(direction, axis=1))[:, None]
        x = (x + direction[labels]) % length
    return x, length


def _joined(labels, i, j, gaps, bond):
    """Labels 0, 1, ... of clusters after bonding all pairs with a small gap, and which pairs are of two clusters."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    near = gaps <= bond
    count = labels.max() + 1
    graph = coo_matrix((np.ones(near.sum()), (labels[i[near]], labels[j[near]])), shape=(count, count))
    labels = connected_components(graph, directed=False)[1][labels]
    return labels, labels[i] != labels[j]


def contacts(x, length, distance):
    """Pairs (i, j) closer than a distance in a periodic cube, r_ij = x_i - x_j and its length."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(x, boxsize=length).query_pairs(distance, output_type="ndarray")
    i, j = pairs[:, 0], pairs[:, 1]
    r = x[i] - x[j]
    r -= length * np.rint(r / length)
    return i, j, r, np.maximum(np.linalg.norm(r, axis=1), 1e-9)


def _repeated(x, length):
    """Twice in each direction, in random order."""
    shifts = length * np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), -1).reshape(-1, 1, 3)
    return np.random.default_rng(3).permutation((x + shifts).reshape(-1, 3)), 2 * length


def fractalDimension(x, length, inner, outer):
    """Slope of log(spheres within r of a sphere) against log r between two distances (nm)."""
    radii = np.geomspace(inner, outer, 8)
    _, _, _, distance = contacts(x, length, outer)
    within = [1 + 2 * np.count_nonzero(distance <= r) / len(x) for r in radii]
    return np.polyfit(np.log(radii), np.log(within), 1)[0]


# ---------------------------------------------------------------- Contexts and times


def makeSystem(numParticles, length, repulsion=False):
    """An openmm.System of spheres in a cube, with a WCA repulsion if asked for.

    Without one, a constant force pulls on the first sphere: it costs nothing, but a step without any force would skip
    half of the fluid's work.
    """
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*(np.eye(3) * length))
    for _ in range(numParticles):
        system.addParticle(MASS)
    if repulsion:
        force = openmm.CustomNonbondedForce(f"4*{KT}*(s^12-s^6)+{KT}; s={2 * RADIUS / 2 ** (1 / 6)}/r")
        force.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
        force.setCutoffDistance(2 * RADIUS)
        for _ in range(numParticles):
            force.addParticle([])
    else:
        force = openmm.CustomExternalForce("-x")
        force.addParticle(0, [])
    system.addForce(force)
    return system


def hydrodynamic(
    system,
    positions,
    tolerance=1e-3,
    temperature=TEMPERATURE,
    threads=2,
    split=None,
    parameters=None,
    step=STEP,
    device=None,
):
    """A Context with positions set, and its PSEBrownianIntegrator: on the CPU, or on a device (platform, precision)."""
    integrator = PSEBrownianIntegrator(temperature, VISCOSITY, RADIUS, step)
    integrator.setErrorTolerance(tolerance)
    integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
    integrator.setRandomNumberSeed(1)
    if split is not None:
        integrator.setSplit(getattr(PSEBrownianIntegrator, split))
    if parameters:
        integrator.setNumericalParameters(parameters)
    return context(system, positions, integrator, threads, device), integrator


def context(system, positions, integrator, threads, device=None):
    """A Context with positions set: on the CPU platform, or on a device (platform, precision)."""
    name, properties = (device[0], {"Precision": device[1]}) if device else ("CPU", {"Threads": str(threads)})
    made = openmm.Context(system, integrator, openmm.Platform.getPlatformByName(name), properties)
    made.setPositions(positions)
    return made


def secondsPerStep(integrators, steps=5, rounds=5, clock=time.perf_counter):
    """Best time of a step of each integrator, measured in turns so that a noisy moment hits all alike."""
    best = [np.inf] * len(integrators)
    for integrator in integrators:
        integrator.step(min(3, steps))
    for _ in range(rounds):
        for i, integrator in enumerate(integrators):
            start = clock()
            integrator.step(steps)
            best[i] = min(best[i], (clock() - start) / steps)
    return best
