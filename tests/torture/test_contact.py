# SPDX-License-Identifier: MIT
"""Contacts: nearly hard spheres up to dense packings, gels held by strong bonds, stiff springs."""
import re

import numpy as np
import openmm
import pytest

import openmmpse
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


def hardSphereEnergies(phi):
    """
    kT of a sphere, in each phase that there may be, from the pressure Z of hard spheres of the diameter of Barker
    and Henderson: that of a 36th power is 1 + 12 U. Z of a fluid is Carnahan's and Starling's, of a crystal that
    of free volumes.
    """
    eta = phi*(barkerHenderson()/2)**3
    fluid = (1 + eta + eta**2 - eta**3)/(1 - eta)**3
    crystal = 1/(1 - (eta/CLOSEST_PACKING)**(1/3))
    return [(Z - 1)/12 for Z in ([fluid] if eta < MELTING else []) + ([crystal] if eta > FREEZING else [])]


def barkerHenderson(steepness=36, reach=2.4):
    """Diameter in radii of hard spheres that nearlyHard() stands for."""
    r = np.linspace(1e-3, reach, 100_001)
    energy = 20*((1.9/r)**steepness - (1.9/reach)**steepness)
    return reach*np.mean(1 - np.exp(-np.minimum(energy, 700)))


FREEZING, MELTING, CLOSEST_PACKING = 0.494, 0.545, np.pi/np.sqrt(18)


@pytest.mark.onePrecision
@pytest.mark.parametrize("phi, tolerance", [(0.45, 1e-3), (0.55, 1e-3), (0.60, 1e-3), (0.45, 1e-7)])
def testNearlyHardSpheres(platformName, phi, tolerance, hardCase):
    """
    Nearly hard spheres (36th power, 20 kT at 1.9 a) at volume fractions of 0.45 to 0.60, steps of
    1e-4 a^2/D: 32 spheres and 200 steps, in the long form 2000, on CPU 256 spheres and 20,000 steps (at 1e-7, in
    double precision, 2000).

    No pair comes nearer than 1.8 a (140 kT); potential energy stays below twice that of hard spheres of the
    diameter of Barker and Henderson, and with 256 spheres its mean over the second half is within a third of
    that (their pressure is not exact for a power, nor is the mean of an explicit step), or between fluid and
    crystal where both may be; after the run the error of M f of the contact forces is within the tolerance.
    """
    large = hardCase.long and platformName == "CPU"
    cells = 4 if large else 2
    scene = scenes.denseSuspension(cells, phi, RADIUS, 731) if phi < FREEZING else crystal(phi, cells)
    context, integrator = makeContext(scene, platformName, TEMPERATURE, 1e-4*RADIUS**2/DIFFUSION,
                                      tolerance, forces=[nearlyHard(scene)])
    expected, energies = hardSphereEnergies(phi), []
    for _ in range(200 if large and tolerance == TOLERANCE else 20 if hardCase.long else 4):
        integrator.step(100 if hardCase.long else 50)
        state = context.getState(energy=True)
        energies.append(state.getPotentialEnergy()._value/(scene.count*KT))
        nearest = nearestDistance(scenes.positionsOf(context), scene.box)/RADIUS
        hardCase.measure(**{"largest energy/kT": float(energies[-1]), "expected at most": float(max(expected))})
        hardCase.least(**{"nearest/a": float(nearest)})
        assert energies[-1] < 2*max(expected) and nearest > 1.8
    if len(energies) >= 200:
        mean = np.mean(energies[len(energies)//2:])
        hardCase.measure(**{"mean energy/kT": float(mean), "expected at least": float(min(expected))})
        assert 2/3*min(expected) < mean < 4/3*max(expected)
    here = scene.at(scenes.positionsOf(context))
    error = errorOf(integrator, scenes.forcesOf(context), here)
    hardCase.measure(spheres=scene.count, **{"error/tolerance": float(error/tolerance)},
                     iterations=integrator.getNumericalParameters()["lanczosIterations"])
    assert error <= tolerance


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


def fractalDimension(positions):
    """
    From the sizes of the clusters that an aggregate was grown of, which lie one behind the other: the slope
    of their numbers of spheres over their radii of gyration, from 4 spheres to all, in logarithms.
    """
    counts = 2**np.arange(2, int(np.log2(len(positions))) + 1)
    sizes = [np.sqrt(np.mean(positions.reshape(-1, n, 3).var(axis=1).sum(axis=1))) for n in counts]
    return np.polyfit(np.log(sizes), np.log(counts), 1)[0]


WELL, INVERSE_WIDTH = 20*KT, 5/RADIUS # of a bond


def attraction(scene):
    """A Morse potential between all pairs: a bond at contact that breaks, and a repulsion below."""
    force = openmm.CustomNonbondedForce(f"{WELL}*((1 - exp(-{INVERSE_WIDTH}*(r - {2*RADIUS})))^2 - 1)")
    force.setNonbondedMethod(force.CutoffPeriodic)
    force.setCutoffDistance(3.2*RADIUS)
    force.setUseSwitchingFunction(True)
    force.setSwitchingDistance(2.8*RADIUS)
    for _ in range(scene.count):
        force.addParticle([])
    return force


@pytest.mark.onePrecision
def testGel(platformName, hardCase):
    """
    A fractal aggregate of 128 spheres (clusters joined to clusters; on Reference the first 32 of them) in a box
    at a volume fraction of 0.02, held by an attraction between all pairs that is 20 kT deep at contact and gone
    at 3.2 a, so that bonds may break.

    The dimension that the aggregate is grown with is between 1.7 and 2.3; none of its bonds breaks (at 2.6 a
    there are 2 kT left of 20), the energy stays below that of three quarters of them; the error of M f of the
    forces that hold it is within the tolerance; Lanczos ends.
    """
    positions, bonds = aggregate(128, 732)
    dimension = fractalDimension(positions)
    hardCase.measure(dimension=float(dimension))
    assert 1.7 < dimension < 2.3
    N = 32 if isDirect(platformName) else 128
    bonds = [pair for pair in bonds if max(pair) < N]
    assert len(bonds) == N - 1
    scene = scenes.Scene(positions[:N], scenes.cube((N*4*np.pi/3*RADIUS**3/0.02)**(1/3)), RADIUS)
    context, integrator = makeContext(scene, platformName, TEMPERATURE, 1e-4*RADIUS**2/DIFFUSION,
                                      TOLERANCE, forces=[attraction(scene)])
    for _ in range(4):
        integrator.step(1000 if hardCase.long else 30)
        there = scenes.positionsOf(context)
        lengths = [np.linalg.norm(there[i] - there[j])/RADIUS for i, j in bonds]
        energy = context.getState(energy=True).getPotentialEnergy()._value/(WELL*len(bonds))
        hardCase.measure(**{"longest bond/a": float(max(lengths)), "energy/(20 kT bonds)": float(energy)})
        assert max(lengths) < 2.6 and energy < -0.75
    error = errorOf(integrator, scenes.forcesOf(context), scene.at(there))
    hardCase.measure(**{"error/tolerance": float(error/TOLERANCE),
                        "iterations": integrator.getNumericalParameters()["lanczosIterations"]})
    assert error <= TOLERANCE


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


def overshooting(platformName, fluid, factor=3.0):
    """
    Springs without length between spheres 20 a apart, in steps of `factor` times their relaxation time:
    above 2, each overshoots by more than the one before.
    """
    pairs = 4
    centres = scenes.randomSuspension(pairs, 0.002, scenes.cube(1), RADIUS, 735)
    half = np.array([0.48, 0.6, 0.64])*10*RADIUS
    scene = scenes.Scene(np.concatenate([centres.positions - half, centres.positions + half]), centres.box, RADIUS)
    dt = 0.1*RADIUS**2/DIFFUSION
    springs = scenes.harmonicBonds([(i, i + pairs) for i in range(pairs)], 0.0, factor/(2*scene.mu0*dt))

    def configure(integrator):
        if fluid == "FreeDraining":
            integrator.setMobilityModel(openmmpse.PSEBrownianIntegrator.FreeDraining)
        else:
            integrator.setFluidBoundary(getattr(openmmpse.PSEBrownianIntegrator, fluid))

    return makeContext(scene, platformName, TEMPERATURE, dt, TOLERANCE, forces=[springs], configure=configure)


@pytest.mark.onePrecision
@pytest.mark.parametrize("fluid", ["Periodic", "Unbounded", "FreeDraining"])
def testSpringsBeyondStability(platformName, fluid, hardCase):
    """
    Stretched springs at 1.5 times the largest stable stiffness: the explicit step blows up, each
    displacement about twice the one before.

    Within 20 steps an exception names a particle, its displacement, the limit and the remedy; positions,
    time and count are those before that step, which is refused again; with a smaller step size the run
    goes on from there, and with positions set anew from these.
    """
    context, integrator = overshooting(platformName, fluid)
    start, dt = scenes.positionsOf(context), integrator.getStepSize()
    with pytest.raises(openmm.OpenMMException) as caught:
        for _ in range(20):
            before = context.getState(positions=True)
            integrator.step(1)
    message = str(caught.value)
    for words in (r"particle \d would move by \d", r"more than \d", r"grown in each of the last 1\d steps",
                  "smaller step size", "recommendStep"):
        assert re.search(words, message), message
    after = context.getState(positions=True)
    positions = scenes.positionsOf(context)
    assert np.array_equal(positions, before.getPositions(asNumpy=True)._value) and np.all(np.isfinite(positions))
    assert (after.getTime(), after.getStepCount()) == (before.getTime(), before.getStepCount())
    hardCase.measure(**{"farthest coordinate (nm)": float(abs(positions).max()), "steps before": after.getStepCount()})
    with pytest.raises(openmm.OpenMMException, match="would move by"):
        integrator.step(1)
    integrator.setStepSize(0.3*dt)
    integrator.step(30)
    assert abs(scenes.positionsOf(context)).max() < 0.5*abs(positions).max()
    integrator.setStepSize(dt)
    context.setPositions(start)
    integrator.step(5)


@pytest.mark.onePrecision
def testSpringsThatBlowUpInTime(platformName, hardCase):
    """
    Springs of 3 a at 1.5 times the largest stable stiffness, in equilibrium at first: beads that pass through
    each other keep lengths below 9 a, in a chaotic motion, until chance ends it after hundreds of steps.

    Within 10,000 steps an exception names a particle and the remedy, before any coordinate is beyond 1e8 nm;
    positions set anew, the Context goes on.
    """
    context, integrator, bonds, _ = dumbbells(3.0, platformName)
    start = scenes.positionsOf(context)
    with pytest.raises(openmm.OpenMMException) as caught:
        for _ in range(2000):
            integrator.step(5)
    message = str(caught.value)
    assert "particle" in message and "step size" in message, message
    positions = scenes.positionsOf(context)
    assert abs(positions).max() < 1e8
    hardCase.measure(**{"farthest coordinate (nm)": float(abs(positions).max()),
                        "steps before": context.getStepCount()})
    context.setPositions(start)
    integrator.setStepSize(0.01*integrator.getStepSize())
    integrator.step(5)
    assert abs(bonds() - 3).max() < 1


def overlapping(scene, power):
    """kT (2a/r)^power between all pairs."""
    force = openmm.CustomNonbondedForce(f"{KT}*({2*RADIUS}/r)^{power}")
    force.setNonbondedMethod(force.CutoffPeriodic)
    force.setCutoffDistance(5*RADIUS)
    for _ in range(scene.count):
        force.addParticle([])
    return force


def chainOfFene(beads):
    """A chain nearly at its largest extension, and its bonds."""
    longest, stiffness = 3*RADIUS, 10*KT/RADIUS**2
    bonds = openmm.CustomBondForce(f"{-0.5*stiffness*longest**2}*log(1 - (r/{longest})^2)")
    for i in range(beads - 1):
        bonds.addBond(i, i + 1, [])
    return scenes.Scene(np.outer(np.arange(beads), [0.96*longest, 0, 0]), scenes.cube(30*RADIUS), RADIUS), bonds


@pytest.mark.onePrecision
@pytest.mark.parametrize("start", ["overlaps", "strained bonds", "a field that grows", "noise"])
def testStartsThatAreHard(platformName, start, hardCase):
    """
    What a blow-up is not: thirty spheres at random places that repel each other with the fourth power, a
    chain of bonds at 0.96 of their largest length, a field that doubles in each of 25 steps, one sphere in
    steps of a hundred boxes.

    No step is refused.
    """
    scene, forces, size, temperature = scenes.idealGas(30, 0.1, scenes.cube(1), RADIUS, 736), [], 1e-4, TEMPERATURE
    if start == "overlaps":
        forces = [overlapping(scene, 4)]
    elif start == "strained bonds":
        scene, bonds = chainOfFene(10)
        forces = [bonds, overlapping(scene, 4)]
    elif start == "a field that grows":
        forces, temperature = [openmm.CustomExternalForce("-strength*x")], 0.0
        forces[0].addGlobalParameter("strength", KT/RADIUS)
        for i in range(scene.count):
            forces[0].addParticle(i, [])
    else:
        scene, size = scenes.idealGas(1, 0.1, scenes.cube(1), RADIUS, 737), 1e5
    context, integrator = makeContext(scene, platformName, temperature, size*RADIUS**2/DIFFUSION, 1e-2,
                                      forces=forces)
    longest = 0.0
    for step in range(25 if start == "a field that grows" else 100):
        if temperature == 0:
            context.setParameter("strength", 2.0**step*KT/RADIUS)
        before = scenes.positionsOf(context)
        integrator.step(1)
        longest = max(longest, abs(scenes.positionsOf(context) - before).max())
    hardCase.measure(**{"longest step/box": float(longest/scene.box[0, 0])})
    if start in ("a field that grows", "noise"):
        assert longest > 50*scene.box[0, 0]
