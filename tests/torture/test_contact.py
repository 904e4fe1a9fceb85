# SPDX-License-Identifier: MIT
"""Contacts: nearly hard spheres up to dense packings, gels held by strong bonds, stiff springs."""
import numpy as np
import openmm
import pytest

import scenes
from platformnames import isDirect
from scenes import KB, errorOf, makeContext

RADIUS = 0.5
TEMPERATURE = 300.0
KT = KB*TEMPERATURE
DIFFUSION = KT/(6*np.pi*scenes.ETA*RADIUS)
TOLERANCE = 1e-3


def nearlyHard(scene, steepness=36):
    """20 kT at a centre distance of 1.9 a, a steep power of the distance, cut off at 2.4 a."""
    force = openmm.CustomNonbondedForce(f"{20*KT}*(({1.9*RADIUS}/r)^{steepness} - ({1.9/2.4})^{steepness})")
    force.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    force.setCutoffDistance(2.4*RADIUS)
    for _ in range(scene.count):
        force.addParticle([])
    return force


def nearestDistance(positions, box):
    closest = np.inf
    for i in range(1, len(positions)):
        r = scenes.nearestImages(positions[:i] - positions[i], box)
        closest = min(closest, np.linalg.norm(r, axis=1).min())
    return closest


def crystal(phi, cells=2):
    """A face-centred cubic crystal, which is the only arrangement of spheres at 0.55 and beyond."""
    N = 4*cells**3
    L = (N*4*np.pi/3*RADIUS**3/phi)**(1/3)
    base = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    corners = np.stack(np.meshgrid(*[np.arange(cells)]*3, indexing="ij"), -1).reshape(-1, 1, 3)
    return scenes.Scene((base + corners).reshape(-1, 3)*L/cells, scenes.cube(L), RADIUS)


@pytest.mark.onePrecision
@pytest.mark.parametrize("phi", [0.45, 0.55, 0.60])
def testNearlyHardSpheres(platformName, phi, hardCase):
    """
    Nearly hard spheres (36th power, 20 kT at 1.9 a) at volume fractions of 0.45 to 0.60, steps of
    1e-4 a^2/D.

    No pair comes nearer than 1.6 a, potential energy stays finite and of the order of N kT, and
    after the run the error of M f of the contact forces is within the tolerance.
    """
    scene = scenes.denseSuspension(2, phi, RADIUS, 731) if phi < 0.5 else crystal(phi)
    context, integrator = makeContext(scene, platformName, TEMPERATURE, 1e-4*RADIUS**2/DIFFUSION,
                                      TOLERANCE, forces=[nearlyHard(scene)])
    for _ in range(4):
        integrator.step(500 if hardCase.long else 50)
        state = context.getState(energy=True)
        energy = state.getPotentialEnergy()._value/(scene.count*KT)
        nearest = nearestDistance(scenes.positionsOf(context), scene.box)/RADIUS
        hardCase.measure(**{"energy/(N kT)": float(energy)})
        hardCase.least(**{"nearest/a": float(nearest)})
        assert np.isfinite(energy) and energy < 50
        assert nearest > 1.6
    here = scene.at(scenes.positionsOf(context))
    error = errorOf(integrator, scenes.forcesOf(context), here)
    hardCase.measure(**{"error/tolerance": float(error/TOLERANCE),
                        "iterations": integrator.getNumericalParameters()["lanczosIterations"]})
    assert error <= TOLERANCE


def aggregate(N, seed):
    """
    A fractal aggregate, grown by clusters that touch clusters at random places and orientations:
    positions (N,3) and the pairs that touch. N is a power of two.
    """
    rng = np.random.default_rng(seed)
    clusters = [(np.zeros((1, 3)), []) for _ in range(N)]
    while len(clusters) > 1:
        joined = []
        for (first, bonds), (second, others) in zip(clusters[::2], clusters[1::2]):
            while True:
                turned = second @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
                i, j = rng.integers(len(first)), rng.integers(len(second))
                direction = rng.normal(size=3)
                direction *= 2*RADIUS/np.linalg.norm(direction)
                placed = turned - turned[j] + first[i] + direction
                gaps = np.linalg.norm(placed[:, None] - first[None], axis=-1)
                gaps[j, i] = np.inf
                if gaps.min() > 2*RADIUS:
                    break
            joined.append((np.concatenate([first, placed]),
                           bonds + [(i, len(first) + j)]
                           + [(len(first) + p, len(first) + q) for p, q in others]))
        clusters = joined
    return clusters[0]


@pytest.mark.onePrecision
def testGel(platformName, hardCase):
    """
    A fractal aggregate (clusters joined to clusters, dimension about 2) held by bonds of 20 kT at a
    stretch of a/5 in a box at a volume fraction of 0.02, with repulsion.

    No bond grows beyond 2.6 a; the error of M f of the forces that hold it is within the
    tolerance; Lanczos ends.
    """
    N = 32 if isDirect(platformName) else 128
    positions, bonds = aggregate(N, 732)
    spread = positions - positions.mean(axis=0)
    dimension = np.log(N)/np.log(np.sqrt(np.mean(np.sum(spread**2, axis=1)))/RADIUS)
    scene = scenes.Scene(positions, scenes.cube((N*4*np.pi/3*RADIUS**3/0.02)**(1/3)), RADIUS)
    springs = scenes.harmonicBonds(bonds, 2*RADIUS, 2*20*KT/(0.2*RADIUS)**2)
    springs.setUsesPeriodicBoundaryConditions(True)
    context, integrator = makeContext(scene, platformName, TEMPERATURE, 1e-4*RADIUS**2/DIFFUSION,
                                      TOLERANCE, forces=[springs, nearlyHard(scene)])
    integrator.step(1000 if hardCase.long else 100)
    there = scenes.positionsOf(context)
    lengths = [np.linalg.norm(there[i] - there[j])/RADIUS for i, j in bonds]
    hardCase.measure(**{"longest bond/a": float(max(lengths)), "dimension": float(dimension)})
    assert max(lengths) < 2.6
    if N < 100:
        here = scene.at(there)
        error = errorOf(integrator, scenes.forcesOf(context), here)
        hardCase.measure(**{"error/tolerance": float(error/TOLERANCE)})
        assert error <= TOLERANCE
    hardCase.measure(iterations=integrator.getNumericalParameters()["lanczosIterations"])


def dumbbells(stiffness, platformName):
    """
    Pairs with bonds of 3 a whose stretch is multiplied by 1 - stiffness in each step, and the
    standard deviation of their lengths in radii.
    """
    pairs = 8
    rng = np.random.default_rng(733)
    centres = scenes.randomSuspension(pairs, 0.002, scenes.cube(1), RADIUS, 734)
    along = rng.normal(size=(pairs, 3))
    along *= 3*RADIUS/np.linalg.norm(along, axis=1)[:, None]
    positions = np.concatenate([centres.positions - along/2, centres.positions + along/2])
    scene = scenes.Scene(positions, centres.box, RADIUS)
    dt = 1e-4*RADIUS**2/DIFFUSION
    slower = 1 - (3/2/3 - 1/27) # relative mobility along the bond [T4], in units of 2 mu0
    springs = scenes.harmonicBonds([(i, i + pairs) for i in range(pairs)], 3*RADIUS,
                                   stiffness/(2*scene.mu0*slower*dt))
    context, integrator = makeContext(scene, platformName, TEMPERATURE, dt, TOLERANCE, forces=[springs])

    def bonds():
        """Lengths in radii."""
        first, second = scenes.positionsOf(context).reshape(2, pairs, 3)
        return np.linalg.norm(second - first, axis=1)/RADIUS

    # that of x' = (1 - stiffness) x + sqrt(4 D dt) z
    variance = 4e-4*slower/(1 - (1 - stiffness)**2)
    return context, integrator, bonds, variance


@pytest.mark.onePrecision
def testStiffSprings(platformName, hardCase):
    """
    Springs at 0.9 of the largest stable product of stiffness, mobility and step (2).

    After each of 10 times 100 steps (10 times 20 in the short form) every bond is within 6 standard
    deviations of its length (false alarm 2e-7 in 80 normal numbers).
    """
    context, integrator, bonds, variance = dumbbells(1.8, platformName)
    for _ in range(10):
        integrator.step(100 if hardCase.long else 20)
        excess = abs(bonds() - 3).max()/np.sqrt(variance)
        hardCase.measure(**{"standard deviations": float(excess)})
        assert excess < 6


@pytest.mark.onePrecision
def testSpringsBeyondStability(platformName, hardCase):
    """
    Springs at 1.5 times the largest stable stiffness: the explicit step blows up.

    An exception names a particle and the remedy, before any coordinate is not a number; positions
    set anew, the Context goes on.
    """
    context, integrator, bonds, _ = dumbbells(3.0, platformName)
    start = scenes.positionsOf(context)
    with pytest.raises(openmm.OpenMMException) as caught:
        for _ in range(200):
            integrator.step(5)
    message = str(caught.value)
    assert "particle" in message and "step size" in message, message
    positions = scenes.positionsOf(context)
    assert np.all(np.isfinite(positions))
    hardCase.measure(**{"farthest coordinate (nm)": float(abs(positions).max()),
                        "steps before": context.getStepCount()})
    context.setPositions(start)
    integrator.setStepSize(0.01*integrator.getStepSize())
    integrator.step(5)
    assert abs(bonds() - 3).max() < 1
