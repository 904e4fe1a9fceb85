# SPDX-License-Identifier: MIT
"""
Scenes that the tests share, a helper that puts one into an OpenMM Context, and the statistics with
which noise is judged. Lengths in nm, water at 20 C (eta = 603.4 Da/(nm ps)).
"""
import functools
from dataclasses import dataclass

import numpy as np
import openmm
from scipy import stats

import openmmpse
from oracle import boxVolume, mobilityMatrix
from platformnames import contextOn

ETA = 603.4
KB = 0.00831446261815324
ROOM_TEMPERATURE = 300.0
# Probability with which a statistical test may fail although the library is right.
FALSE_ALARM = 1e-6


# ---------------------------------------------------------------- boxes

def cube(L):
    return np.eye(3)*L


def elongated(w):
    """1:1:8."""
    return np.diag([w, w, 8.0*w])


def tilted(L, sign=1):
    """The largest tilt that OpenMM's reduced form allows, in all three off-diagonal entries."""
    return L*np.array([[1, 0, 0], [0.5*sign, 1, 0], [0.5*sign, 0.5, 1]])


def rhombicDodecahedron(L):
    return L*np.array([[1, 0, 0], [0, 1, 0], [0.5, 0.5, np.sqrt(0.5)]])


def truncatedOctahedron(L):
    return L*np.array([[1, 0, 0], [1/3, 2*np.sqrt(2)/3, 0], [-1/3, np.sqrt(2)/3, np.sqrt(6)/3]])


def scaledToVolume(box, volume):
    return box*(volume/boxVolume(box))**(1/3)


# ---------------------------------------------------------------- configurations

@dataclass(frozen=True, eq=False)
class Scene:
    """
    Spheres at positions (N,3) (nm) in a box with row vectors (nm), of one radius (nm), or each of
    its own of `radii` (N,).
    """
    positions: np.ndarray
    box: np.ndarray
    radius: float
    radii: np.ndarray = None

    @property
    def count(self):
        return len(self.positions)

    @property
    def mu0(self):
        """Mobility of one sphere in infinite solvent, nm/ps per kJ/(mol nm)."""
        return 1/(6*np.pi*ETA*self.radius)

    @property
    def ownMobilities(self):
        """The same of each, to be multiplied with forces (N,3)."""
        return self.mu0 if self.radii is None else 1/(6*np.pi*ETA*self.radii[:, None])

    @functools.cached_property
    def mobility(self):
        """The oracle's M (3N,3N), in nm/ps per kJ/(mol nm)."""
        a = self.radius if self.radii is None else self.radii
        return mobilityMatrix(self.positions, self.box, a, ETA)

    def velocities(self, forces):
        return (self.mobility @ np.ravel(forces)).reshape(-1, 3)

    def moved(self, shifts):
        return Scene(self.positions + shifts, self.box, self.radius, self.radii)

    def at(self, positions):
        """The same spheres elsewhere; asked again for the same place, the same Scene."""
        key = np.asarray(positions).tobytes()
        if key not in self.elsewhere:
            self.elsewhere[key] = Scene(positions, self.box, self.radius, self.radii)
        return self.elsewhere[key]

    @functools.cached_property
    def elsewhere(self):
        return {}


def nearestImages(r, box):
    """Shortest image of each vector, for a reduced box."""
    shifts = np.stack(np.meshgrid(*[[-1, 0, 1]]*3, indexing="ij"), -1).reshape(-1, 3) @ box
    f = r @ np.linalg.inv(box)
    images = ((f - np.rint(f)) @ box)[..., None, :] + shifts
    best = np.argmin(np.einsum("...i,...i->...", images, images), axis=-1)
    return np.take_along_axis(images, best[..., None, None], axis=-2)[..., 0, :]


def randomSuspension(N, phi, box, radius, seed):
    """Hard spheres by random sequential addition (phi <= 0.3); box gives only the shape."""
    rng = np.random.default_rng(seed)
    box = scaledToVolume(np.asarray(box, dtype=float), N*4*np.pi/3*radius**3/phi)
    positions = np.empty((N, 3))
    placed = 0
    while placed < N:
        trial = rng.random(3) @ box
        gaps = np.linalg.norm(nearestImages(positions[:placed] - trial, box), axis=1)
        if np.all(gaps > 2*radius):
            positions[placed] = trial
            placed += 1
    return Scene(positions, box, radius)


def denseSuspension(cells, phi, radius, seed, sweeps=60):
    """4*cells^3 hard spheres in a cube: an FCC crystal molten by Monte Carlo, for phi up to 0.5."""
    rng = np.random.default_rng(seed)
    N = 4*cells**3
    L = (N*4*np.pi/3*radius**3/phi)**(1/3)
    base = np.array([[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    corners = np.stack(np.meshgrid(*[np.arange(cells)]*3, indexing="ij"), -1).reshape(-1, 1, 3)
    positions = ((base + corners).reshape(-1, 3) + 0.25)*L/cells
    for _ in range(sweeps):
        moves = rng.uniform(-0.3, 0.3, (N, 3))*radius
        for i in range(N):
            trial = positions[i] + moves[i]
            r = positions - trial
            r -= L*np.rint(r/L)
            r2 = np.einsum("ij,ij->i", r, r)
            r2[i] = np.inf
            if r2.min() > 4*radius*radius:
                positions[i] = trial
    return Scene(positions, cube(L), radius)


def idealGas(N, phi, box, radius, seed):
    """Independent uniform positions: any overlap occurs."""
    box = scaledToVolume(np.asarray(box, dtype=float), N*4*np.pi/3*radius**3/phi)
    return Scene(np.random.default_rng(seed).random((N, 3)) @ box, box, radius)


def mixture(radii, phi, box, seed, apart=False):
    """
    Spheres of these radii at independent uniform positions (any overlap and nesting occurs), or
    apart from each other, the largest placed first; box gives only the shape.
    """
    rng = np.random.default_rng(seed)
    radii = np.asarray(radii, dtype=float)
    box = scaledToVolume(np.asarray(box, dtype=float), 4*np.pi/3*np.sum(radii**3)/phi)
    positions = rng.random((len(radii), 3)) @ box
    placed = []
    for i in np.argsort(-radii, kind="stable") if apart else ():
        while placed and np.any(np.linalg.norm(nearestImages(positions[placed] - positions[i], box), axis=1)
                                < radii[placed] + radii[i]):
            positions[i] = rng.random(3) @ box
        placed.append(i)
    return Scene(positions, box, radii[0], radii)


def chain(N, bond, L, radius, seed):
    """A freely jointed phantom chain, unwrapped: it overlaps itself and leaves the box."""
    steps = np.random.default_rng(seed).normal(size=(N, 3))
    steps *= bond/np.linalg.norm(steps, axis=1)[:, None]
    return Scene(np.cumsum(steps, axis=0), cube(L), radius)


def pair(distance, L, radius):
    """Two spheres at a distance (nm) along a direction that favours no axis."""
    direction = np.array([0.48, 0.6, 0.64])
    centre = np.array([0.31, 0.17, 0.83])*L
    return Scene(np.array([centre, centre + distance*direction]), cube(L), radius)


# ---------------------------------------------------------------- forces

def randomForces(scene, seed=11):
    return np.random.default_rng(seed).normal(size=(scene.count, 3))


def uniformForces(scene):
    return np.tile([1.0, 0.3, -0.5], (scene.count, 1))


def balancedForces(scene, seed=12):
    """Opposite forces on each particle and its nearest free neighbour; no net force at all."""
    rng = np.random.default_rng(seed)
    forces = np.zeros((scene.count, 3))
    free = list(range(scene.count))
    while len(free) > 1:
        i = free.pop(0)
        gaps = np.linalg.norm(nearestImages(scene.positions[free] - scene.positions[i], scene.box),
                              axis=1)
        j = free.pop(int(np.argmin(gaps)))
        forces[i] = rng.normal(size=3)
        forces[j] = -forces[i]
    return forces


def forceKinds(scene):
    kinds = {"random": randomForces(scene), "uniform": uniformForces(scene)}
    if scene.count > 1:
        kinds["balanced"] = balancedForces(scene)
    return kinds


# ---------------------------------------------------------------- Contexts

def periodicDummyForce(N, box):
    """A Force that does nothing but tell OpenMM that the system is periodic."""
    force = openmm.CustomNonbondedForce("0*r")
    force.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    force.setCutoffDistance(0.3*np.diag(box).min())
    for _ in range(N):
        force.addParticle([])
    return force


def constantForces(vectors):
    """A Force that pulls every particle with a constant vector, kJ/(mol nm)."""
    force = openmm.CustomExternalForce("-(fx*x+fy*y+fz*z)")
    for name in ("fx", "fy", "fz"):
        force.addPerParticleParameter(name)
    for i, vector in enumerate(vectors):
        force.addParticle(i, [float(v) for v in vector])
    return force


def harmonicBonds(bonds, length, k):
    """Harmonic bonds between pairs (i, j), with k in kJ/(mol nm^2)."""
    force = openmm.HarmonicBondForce()
    for i, j in bonds:
        force.addBond(int(i), int(j), length, k)
    return force


def makeSystem(scene, forces=(), masses=None):
    system = openmm.System()
    for i in range(scene.count):
        system.addParticle(100.0 if masses is None else masses[i])
    system.setDefaultPeriodicBoxVectors(*[openmm.Vec3(*row) for row in scene.box])
    for force in forces:
        system.addForce(force)
    return system


def makeContext(scene, platformName, temperature=0.0, stepSize=1.0, tolerance=None, seed=5,
                forces=(), masses=None, threads=1, configure=None,
                boundary=openmmpse.PSEBrownianIntegrator.Periodic):
    """
    A Context with positions set, and its integrator.

    threads    one by default, because most scenes are tiny
    configure  called with the integrator before the Context is made
    boundary   what surrounds the particles
    """
    integrator = openmmpse.PSEBrownianIntegrator(temperature, ETA, scene.radius, stepSize)
    integrator.setFluidBoundary(boundary)
    for i, a in enumerate([] if scene.radii is None else scene.radii):
        integrator.setParticleRadius(i, float(a))
    integrator.setRandomNumberSeed(seed)
    if tolerance is not None:
        integrator.setErrorTolerance(tolerance)
    if configure is not None:
        configure(integrator)
    context = contextOn(platformName, makeSystem(scene, forces, masses), integrator, threads)
    context.setPositions(scene.positions)
    return context, integrator


def positionsOf(context):
    """Positions (N,3) in nm, not wrapped into the box."""
    return np.array(context.getState(positions=True).getPositions(asNumpy=True)._value)


def stored(scene, context):
    """
    The scene at the positions that the Context holds: where they are floats, an oracle to compare
    with at a tolerance of 1e-5 must be asked there.
    """
    positions = positionsOf(context)
    return scene if abs(positions - scene.positions).max() < 1e-12 else scene.at(positions)


def forcesOf(context):
    """Forces (N,3) in kJ/(mol nm); devices round what a Force was told to floats, and its result."""
    return np.array(context.getState(forces=True).getForces(asNumpy=True)._value)


def velocitiesOf(context):
    return np.array(context.getState(velocities=True).getVelocities(asNumpy=True)._value)


def mobilityColumns(integrator, N):
    """The mobility (3N,3N) that the library applies, column by column."""
    columns = []
    for j in range(3*N):
        forces = np.zeros(3*N)
        forces[j] = 1
        columns.append(np.ravel(integrator.applyMobility(forces.reshape(-1, 3))))
    return np.array(columns).T


def errorRatio(velocities, exact, forces, scene):
    """Error of M f in the norm of the contract: to be compared with the tolerance."""
    scale = max(np.linalg.norm(exact), np.linalg.norm(forces*scene.ownMobilities))
    return np.linalg.norm(velocities - exact)/scale


def errorOf(integrator, forces, scene):
    """The same for what an integrator at that scene makes of forces."""
    exact = scene.velocities(forces)
    return errorRatio(integrator.applyMobility(forces), exact, forces, scene)


# ---------------------------------------------------------------- statistics

def whiten(samples, covariance):
    """Rows y = L^-1 x, covariance = L L^T: independent unit normals if x has that covariance."""
    return np.linalg.solve(np.linalg.cholesky(covariance), samples.T).T


def zScore(statistic, degrees):
    """Chi-square value as the equivalent number of standard deviations, both tails kept exact."""
    upper = stats.chi2.sf(statistic, degrees)
    if upper < 0.5:
        return stats.norm.isf(upper)
    return stats.norm.ppf(stats.chi2.cdf(statistic, degrees))


def assertUnitCovariance(y, label="", tests=1):
    """
    n samples y (n,d) must have covariance 1 (mean known to be 0).

    With S = y^T y/n: n*trace(S) is chi-square with n d degrees of freedom, exactly (all variances
    at once), n S_ii is chi-square with n degrees (each variance), and n sum_{i<j} S_ij^2 + (n/2)
    sum_i (S_ii - 1)^2 is chi-square with d(d+1)/2 degrees up to O(d^2/n) (all covariances at once,
    in any direction). Two-sided; FALSE_ALARM is shared among all d + 2 statistics and the number of
    tests.
    """
    n, d = y.shape
    S = y.T @ y/n
    limit = stats.norm.isf(FALSE_ALARM/(2*tests*(d + 2)))
    total = zScore(n*np.trace(S), n*d)
    ratio = np.trace(S)/d
    assert abs(total) < limit, f"{label}: all variances off by {total:.1f} sigma, ratio {ratio:.5f}"
    for i in range(d):
        z = zScore(n*S[i, i], n)
        assert abs(z) < limit, f"{label}: variance {i} off by {z:.1f} sigma, ratio {S[i, i]:.5f}"
    E = S - np.eye(d)
    both = n*np.sum(np.triu(E, 1)**2) + n/2*np.sum(np.diag(E)**2)
    z = zScore(both, d*(d + 1)//2)
    assert z < limit, f"{label}: covariances off by {z:.1f} sigma, largest entry {abs(E).max():.5f}"


def assertZeroMean(y, label=""):
    """The mean m of n rows of d unit normals: n m.m is chi-square with d degrees, exactly."""
    n, d = y.shape
    m = y.mean(axis=0)
    z = zScore(n*m @ m, d)
    limit = stats.norm.isf(FALSE_ALARM)
    assert z < limit, f"{label}: mean off by {z:.1f} sigma, largest {abs(m).max():.5f}"
