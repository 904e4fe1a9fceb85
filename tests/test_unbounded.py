# SPDX-License-Identifier: MIT
"""
The unbounded fluid: sums over all pairs of spheres of any radii, without a box, against dense
matrices of the oracle and their symmetric square root.
"""
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import openmm
import pytest

import scenes
from openmmpse import PSEBrownianIntegrator
from oracle import freeSpaceScalars, gaussianScalars, unboundedMobilityMatrix
from platformnames import contextOn, coordinateRounding, isDevice, lowestTolerance, precisionOf, served
from scenes import ETA, KB, forcesOf, positionsOf, velocitiesOf

pytestmark = pytest.mark.onePrecision
TEMPERATURE, STEP = 300.0, 1.0
MODELS = {PSEBrownianIntegrator.RotnePragerYamakawa: freeSpaceScalars,
          PSEBrownianIntegrator.ForceCoupling: gaussianScalars}
NAMES = {PSEBrownianIntegrator.RotnePragerYamakawa: "RPY",
         PSEBrownianIntegrator.ForceCoupling: "ForceCoupling"}
models = pytest.mark.parametrize("model", MODELS, ids=NAMES.values())


class Spheres:
    """Positions (N,3) and radii (N,) in nm, such that single precision holds them exactly."""

    def __init__(self, positions, radii):
        self.positions = np.round(np.asarray(positions, dtype=float)*4096)/4096
        self.radii = np.round(np.broadcast_to(radii, len(positions))*4096)/4096

    @property
    def count(self):
        return len(self.positions)

    def mobility(self, model=PSEBrownianIntegrator.RotnePragerYamakawa):
        return unboundedMobilityMatrix(self.positions, self.radii, ETA, MODELS[model])


def context(spheres, platformName, tolerance=1e-3, temperature=TEMPERATURE, threads=1, forces=(),
            masses=None, seed=5, configure=None, box=None,
            boundary=PSEBrownianIntegrator.Unbounded,
            model=PSEBrownianIntegrator.RotnePragerYamakawa):
    system = openmm.System()
    for i in range(spheres.count):
        system.addParticle(100.0 if masses is None else masses[i])
    if box is not None:
        system.setDefaultPeriodicBoxVectors(*box)
    for force in forces:
        system.addForce(force)
    integrator = PSEBrownianIntegrator(temperature, ETA, float(spheres.radii[0]), STEP)
    integrator.setFluidBoundary(boundary)
    integrator.setMobilityModel(model)
    integrator.setErrorTolerance(served(platformName, tolerance))
    integrator.setRandomNumberSeed(seed)
    for i, radius in enumerate(spheres.radii):
        if radius != spheres.radii[0]:
            integrator.setParticleRadius(i, float(radius))
    if configure is not None:
        configure(integrator)
    made = contextOn(platformName, system, integrator, threads)
    made.setPositions(spheres.positions)
    return made, integrator


def walk(count, bond, seed):
    """A freely jointed chain."""
    steps = np.random.default_rng(seed).normal(size=(count, 3))
    return np.cumsum(bond*steps/np.linalg.norm(steps, axis=1)[:, None], axis=0)


def equalChain():
    return Spheres(walk(40, 1.0, 1), 0.5)


def mixture():
    """Apart, overlapping, nested and coincident, in radii 1:10."""
    rng = np.random.default_rng(2)
    positions = rng.normal(scale=1.5, size=(40, 3))
    positions[7] = positions[3]
    return Spheres(positions, np.geomspace(0.125, 1.25, 40)[rng.permutation(40)])


def faraway():
    """Two clusters, a million radii apart: their own pairs must not suffer."""
    positions = mixture().positions.copy()
    positions[20:] += [5e5, 0, -2.5e5]
    return Spheres(positions, 0.5)


SCENES = {"chain": equalChain, "mixture": mixture, "faraway": faraway,
          "one": lambda: Spheres([[3.0, -7.0, 900.0]], 0.5),
          "dumbbell": lambda: Spheres([[0, 0, 0], [1.0, 0, 0]], 0.5),
          "three": lambda: Spheres([[0, 0, 0], [0, 0, 0], [0.25, 0, 0]], [0.5, 0.5, 2.0])}
SINGULAR = ("faraway", "three")  # two equal spheres at one place
everyScene = pytest.mark.parametrize("name", SCENES)


def sceneOf(name, platformName):
    spheres = SCENES[name]()
    if name == "faraway" and coordinateRounding(platformName) > 1e-8:
        spheres = Spheres(np.float64(np.float32(spheres.positions)), spheres.radii)
    return spheres


def kindsOfForces(spheres):
    random = np.random.default_rng(11).normal(size=(spheres.count, 3))
    balanced = np.array([random[i//2]*(-1)**i for i in range(spheres.count)])
    return np.float64(np.float32(random)), np.tile([1.0, 0.25, -0.5], (spheres.count, 1)), \
        np.float64(np.float32(balanced))


def errorOf(u, exact, forces, spheres):
    """In the norm of the contract."""
    alone = forces/(6*np.pi*ETA*spheres.radii[:, None])
    return np.linalg.norm(u - exact)/max(np.linalg.norm(exact), np.linalg.norm(alone))


# ---------------------------------------------------------------- mobility and noise

@models
@everyScene
def testErrorContract(platformName, name, model):
    spheres = sceneOf(name, platformName)
    M = spheres.mobility(model)
    for tolerance in (1e-3, lowestTolerance(platformName)):
        _, integrator = context(spheres, platformName, tolerance, model=model)
        parameters = integrator.getNumericalParameters()
        assert parameters["predictedError"] <= tolerance
        for forces in kindsOfForces(spheres):
            exact = (M @ forces.ravel()).reshape(-1, 3)
            error = errorOf(integrator.applyMobility(forces), exact, forces, spheres)
            assert error <= max(parameters["predictedError"], 1e-13), f"tolerance {tolerance:g}"


def rawNoise(spheres, count):
    """The z of `count` samples with the seed of context(), from what it does without hydrodynamics."""
    _, integrator = context(spheres, "CPU", 1e-10,
                            model=PSEBrownianIntegrator.FreeDraining)
    amplitude = np.sqrt(2*KB*TEMPERATURE*STEP/(6*np.pi*ETA*spheres.radii))
    return integrator.sampleBrownianDisplacements(count)/amplitude[:, None]


@models
@everyScene
def testNoiseIsTheSymmetricRootTimesTheNoiseOfTheParticles(platformName, name, model):
    """
    Not a statistical test: with the z that belong to the seed, sqrt(2 kT dt) M^{1/2} z, to the
    rounding of the root on Reference and to a few tolerances elsewhere (the Lanczos stop is an
    estimate). All platforms have the same noise, as they all pass this. Coincident spheres have
    eigenvalues of zero, which the rounding of M in single precision makes 1e-6 of the largest: the
    root of that stays, although the covariance errs by 1e-6.
    """
    spheres = sceneOf(name, platformName)
    values, vectors = np.linalg.eigh(spheres.mobility(model))
    root = (vectors*np.sqrt(2*KB*TEMPERATURE*STEP*np.maximum(values, 0))) @ vectors.T
    z = rawNoise(spheres, 3).reshape(3, -1)
    for tolerance in (1e-3, 1e-6):
        tolerance = served(platformName, tolerance)
        _, integrator = context(spheres, platformName, tolerance, model=model)
        samples = integrator.sampleBrownianDisplacements(3).reshape(3, -1)
        allowed = 1e-6 if platformName == "Reference" else 2*tolerance
        if name in SINGULAR and isDevice(platformName) and not platformName.endswith("double"):
            allowed = max(allowed, 1e-3)
        for mine, exact in zip(samples, z @ root):
            assert np.linalg.norm(mine - exact) <= allowed*np.linalg.norm(exact)


@models
@pytest.mark.parametrize("coincident", [0, 25])
def testNoiseOfManyIterations(platformName, model, coincident):
    """
    Close and coincident spheres: tens of iterations, in which rounding must not take the place of
    convergence (errors were up to nine tolerances). Of two at one place what is left of the noise
    of their distance is the rounding of M: 1e-6 of the variance.
    """
    count = 60 if platformName == "Reference" else 150
    positions = np.random.default_rng(2).normal(scale=2.4*(count/150)**(1/3), size=(count, 3))
    positions[:coincident] = positions[count - coincident:]
    spheres = Spheres(positions, 0.5)
    values, vectors = np.linalg.eigh(spheres.mobility(model))
    root = (vectors*np.sqrt(2*KB*TEMPERATURE*STEP*np.maximum(values, 0))) @ vectors.T
    z = rawNoise(spheres, 3).reshape(3, -1)
    for tolerance in (1e-3, served(platformName, 1e-4)):
        _, integrator = context(spheres, platformName, tolerance, model=model)
        samples = integrator.sampleBrownianDisplacements(3).reshape(3, -1)
        for mine, exact in zip(samples, z @ root):
            error, size = mine - exact, np.linalg.norm(exact)
            lost = vectors[:, :3*coincident].T @ error
            assert np.linalg.norm(error) <= np.hypot(1.5*tolerance, np.linalg.norm(lost)/size)*size
            assert np.linalg.norm(lost) <= np.hypot(1.5*tolerance, 1e-3)*size


@pytest.mark.hostOnly
def testCovarianceOfForceCoupling(platformName):
    """n = 5000 samples of 24 numbers: variances wrong by 2.2 % and correlations of 0.1 are found."""
    rng = np.random.default_rng(8)
    spheres = Spheres(rng.normal(scale=1.2, size=(8, 3)), rng.uniform(0.25, 1.0, 8))
    model = PSEBrownianIntegrator.ForceCoupling
    _, integrator = context(spheres, platformName, 1e-2, model=model)
    samples = integrator.sampleBrownianDisplacements(5000).reshape(5000, -1)
    y = scenes.whiten(samples, 2*KB*TEMPERATURE*STEP*spheres.mobility(model))
    scenes.assertUnitCovariance(y)
    scenes.assertZeroMean(y)


def testEveryThreadCountGivesTheSameBits():
    """Enough particles for several slabs of rows; both precisions, all kinds of pairs."""
    rng = np.random.default_rng(3)
    positions = rng.normal(scale=4, size=(700, 3))
    rigid, gaussian = MODELS
    for radii, model in ((0.5, rigid), (rng.uniform(0.25, 1, 700), rigid), (0.5, gaussian)):
        for tolerance in (1e-3, 1e-6):
            results = []
            for threads in (1, 2, 5):
                made, integrator = context(Spheres(positions, radii), "CPU", tolerance,
                                           threads=threads, model=model)
                integrator.step(2)
                results.append(positionsOf(made))
            assert np.array_equal(results[0], results[1])
            assert np.array_equal(results[0], results[2])


@pytest.mark.onePrecision
def testManyParticlesAgainstTheSum(platformName):
    """Rows of the sum for a few of ten thousand particles: all slabs and groups take part."""
    count = 400 if platformName == "Reference" else 10000
    spheres = Spheres(walk(count, 1.0, 4), 0.5)
    forces = np.tile([1.0, 0.25, -0.5], (count, 1))
    _, integrator = context(spheres, platformName, 1e-1)
    u = integrator.applyMobility(forces)
    for i in (0, count//3, count - 1):
        d = spheres.positions[i] - spheres.positions
        r = np.linalg.norm(d, axis=1)
        perp, par = freeSpaceScalars(r, 0.5, 0.5)
        along = np.einsum("ij,ij->i", d, forces)/np.maximum(r, 1e-9)**2
        exact = (perp[:, None]*forces + ((par - perp)*along)[:, None]*d).sum(axis=0)
        assert np.allclose(u[i]*6*np.pi*ETA, exact, rtol=0, atol=1e-5*np.linalg.norm(exact))


def memoryOf(count, platformName):
    """Prints by how much a thermal step of `count` beads raises the peak of this process's memory, in kB."""
    def kilobytes(name):
        return int(re.search(rf"{name}:\s*(\d+) kB", Path("/proc/self/status").read_text())[1])
    _, few = context(Spheres(walk(10, 1.0, 4), 0.5), platformName, 1e-1)
    few.step(1)
    before = kilobytes("VmRSS")
    _, many = context(Spheres(walk(count, 1.0, 4), 0.5), platformName, 1e-1)
    many.step(1)
    print(kilobytes("VmHWM") - before)


@pytest.mark.hostOnly
@pytest.mark.withGrid
def testManyParticlesInBoundedMemory(platformName):
    """
    A dense matrix of ten thousand particles would have 3.6 GB in single precision; with a few Krylov vectors, a
    step takes less than 0.1. In a process of its own, whose memory no other test has raised.
    """
    script = f"import test_unbounded; test_unbounded.memoryOf(10000, {platformName!r})"
    done = subprocess.run([sys.executable, "-B", "-c", script], capture_output=True, text=True,
                          cwd=Path(__file__).parent)
    assert done.returncode == 0, done.stderr
    assert 1e3 < int(done.stdout) < 100e3  # kB; ten thousand positions alone are some hundred


# ---------------------------------------------------------------- known values

def testTouchingPairHasThePublishedMobilities(platformName):
    """Doublet of touching spheres: 0.8125 along the axis, 0.71875 across; 0.75 for the difference."""
    _, integrator = context(SCENES["dumbbell"](), platformName, 1e-5)
    mu0 = 1/(6*np.pi*ETA*0.5)
    both = integrator.applyMobility([[1, 1, 0], [1, 1, 0]])/mu0
    assert np.allclose(both/2, [[0.8125, 0.71875, 0]]*2, rtol=1e-6, atol=1e-7)
    apart = integrator.applyMobility([[1, 0, 0], [-1, 0, 0]])/mu0
    assert np.allclose(apart[0] - apart[1], [0.75, 0, 0], rtol=1e-6, atol=1e-7)


def testKirkwoodOfAChain(platformName):
    """
    Spread a force evenly, average over its directions: the isotropic part of all pairs, a/r beyond
    contact and 1 - r/4a below.
    """
    chain = equalChain()
    _, integrator = context(chain, platformName, 1e-5, temperature=0)
    traced = sum(integrator.applyMobility(np.tile(e, (40, 1)))[:, c].sum()
                 for c, e in enumerate(np.eye(3)))/(3*40**2)
    r = np.linalg.norm(chain.positions[:, None] - chain.positions[None], axis=-1)/0.5
    sums = np.where(r > 2, 1/np.maximum(r, 1), 1 - r/4).mean()
    assert traced*6*np.pi*ETA*0.5 == pytest.approx(sums, rel=2e-6)


@pytest.mark.onePrecision
def testAGrowingBoxApproachesTheUnboundedFluid(platformName):
    """
    Force coupling of a pair in a cubic box: less by 2.837297 mu0 a/L on the diagonal, but for
    terms of (a/L)^3 and a r^2/L^3, which an L twice as large makes eight times smaller.
    """
    spheres, model = SCENES["dumbbell"](), PSEBrownianIntegrator.ForceCoupling
    tolerance = served(platformName, 1e-7)
    forces, mu0 = kindsOfForces(spheres)[0], 1/(6*np.pi*ETA*0.5)
    _, integrator = context(spheres, platformName, tolerance, temperature=0, model=model)
    unbounded = integrator.applyMobility(forces)/mu0
    rest = []
    for L in (8.0, 16.0):
        _, integrator = context(spheres, platformName, tolerance, temperature=0, model=model,
                                box=np.eye(3)*L, boundary=PSEBrownianIntegrator.Periodic)
        u = integrator.applyMobility(forces)/mu0
        rest.append(u - unbounded + 2.8372974794806*0.5/L*forces.sum(axis=0))
    size = np.linalg.norm(forces)
    assert 1e-3 < np.linalg.norm(rest[0])/size < 0.01
    assert np.linalg.norm(rest[0] - 8*rest[1]) <= (0.05*np.linalg.norm(rest[0])
                                                   + 10*tolerance*size)


# ---------------------------------------------------------------- the way of a step

def pulls(spheres):
    return scenes.constantForces(kindsOfForces(spheres)[0])


def testPeriodicForcesLeaveTheFluidUnbounded(platformName):
    """OpenMM's devices keep images within the box of a Force with a cutoff; the fluid has none."""
    rng = np.random.default_rng(8)
    spheres = Spheres(6*rng.random((20, 3)) + [-3, 7, 27], 0.5)
    force = scenes.periodicDummyForce(20, scenes.cube(10.0))
    made, integrator = context(spheres, platformName, forces=[force], box=scenes.cube(10.0))
    pull = rng.normal(size=(20, 3))
    for _ in range(2):
        exact = (Spheres.mobility(spheres) @ pull.ravel()).reshape(-1, 3)
        assert np.linalg.norm(integrator.applyMobility(pull) - exact) < 1e-5*np.linalg.norm(exact)
        integrator.step(1)
        spheres.positions = positionsOf(made)


@models
def testAStepIsMobilityTimesForceAndNoise(platformName, model):
    """At kT = 0 M f dt; with noise the same and what the noise alone does from the same place."""
    spheres = mixture()
    made, integrator = context(spheres, platformName, temperature=0, forces=[pulls(spheres)],
                               model=model)
    drift = integrator.applyMobility(forcesOf(made))
    assert not integrator.sampleBrownianDisplacements(2).any()
    integrator.step(1)
    assert np.allclose(velocitiesOf(made), drift, rtol=1e-5, atol=1e-6*abs(drift).max())
    moved = positionsOf(made) - spheres.positions
    assert np.allclose(moved, drift*STEP, rtol=1e-5, atol=1e-6*abs(spheres.positions).max())
    steps = [context(spheres, platformName, forces=force, model=model)
             for force in ([pulls(spheres)], ())]
    for _, each in steps:
        each.step(1)
    wet, alone = (velocitiesOf(each) for each, _ in steps)
    assert np.allclose(wet - alone, drift, rtol=0, atol=3e-3*abs(alone).max())


@pytest.mark.onePrecision
def testTheBoxPlaysNoPart(platformName):
    """A tiny box, and a change of it, leave the trajectory as it is to the bit."""
    spheres = equalChain()
    plain, first = context(spheres, platformName)
    boxed, second = context(spheres, platformName, box=np.eye(3)*0.25)
    for integrator in (first, second):
        integrator.step(1)
    boxed.setPeriodicBoxVectors(*(np.eye(3)*7.0))
    for integrator in (first, second):
        integrator.step(1)
    assert np.array_equal(positionsOf(plain), positionsOf(boxed))


@pytest.mark.onePrecision
def testAutomaticFollowsTheForces(platformName):
    """Unbounded if no Force is periodic, else periodic; describe() gives the reason."""
    spheres = Spheres(walk(6, 1.0, 5), 0.5)
    automatic = PSEBrownianIntegrator.Automatic
    plain, integrator = context(spheres, platformName, boundary=automatic)
    _, asked = context(spheres, platformName)
    assert np.array_equal(integrator.applyMobility(spheres.positions),
                          asked.applyMobility(spheres.positions))
    assert "unbounded" in integrator.describe() and "no Force uses periodic" in integrator.describe()
    assert "as set by setFluidBoundary" in asked.describe()
    box = np.eye(3)*20.0
    _, periodic = context(spheres, platformName, boundary=automatic, box=box,
                          forces=[scenes.periodicDummyForce(6, box)])
    assert "periodic in the box" in periodic.describe()
    assert periodic.getNumericalParameters()["gridDimensions"] != (0, 0, 0)


def testNumericalParametersAndDescription(platformName):
    spheres = mixture()
    _, integrator = context(spheres, platformName, 1e-3, forces=[pulls(spheres)])
    integrator.step(1)
    parameters = integrator.getNumericalParameters()
    assert parameters["xi"] == 0 and tuple(parameters["gridDimensions"]) == (0, 0, 0)
    assert parameters["split"] == "none" and parameters["precision"] == precisionOf(platformName, 1e-3)
    assert 0 < parameters["predictedError"] <= 1e-3
    assert parameters["lanczosTolerance"] == (1e-12 if platformName == "Reference" else 5e-4)
    assert 2 < parameters["lanczosIterations"] <= 120
    text = integrator.describe()
    for words in ("unequal radii", "direct sums over all pairs", "noise (Lanczos)", "velocities"):
        assert words in text
    _, again = context(spheres, platformName, 1e-3,
                       configure=lambda i: i.setNumericalParameters(parameters))
    assert again.getNumericalParameters()["lanczosTolerance"] == parameters["lanczosTolerance"]


@pytest.mark.onePrecision
def testMasslessParticlesAreTransparent(platformName):
    spheres = mixture()
    masses = np.where(np.arange(spheres.count) % 4, 10.0, 0.0)
    mobile = masses > 0
    forces = kindsOfForces(spheres)[0]
    made, integrator = context(spheres, platformName, 1e-4, masses=masses)
    u = integrator.applyMobility(forces)
    rest = Spheres(spheres.positions[mobile], spheres.radii[mobile])
    exact = (rest.mobility() @ forces[mobile].ravel()).reshape(-1, 3)
    assert errorOf(u[mobile], exact, forces[mobile], rest) <= 1e-4 and not u[~mobile].any()
    integrator.step(2)
    assert np.array_equal(positionsOf(made)[~mobile], spheres.positions[~mobile])


@pytest.mark.onePrecision
def testRestartIsExact(platformName):
    """By a checkpoint; one of other radii, or of a periodic fluid, is refused."""
    spheres = mixture()
    made, integrator = context(spheres, platformName)
    integrator.step(2)
    integrator.sampleBrownianDisplacements(1)
    checkpoint = made.createCheckpoint()
    integrator.step(2)
    other, again = context(spheres, platformName, seed=77)
    other.loadCheckpoint(checkpoint)
    again.step(2)
    assert np.array_equal(positionsOf(made), positionsOf(other))
    radii = spheres.radii.copy()
    radii[5] *= 2
    elsewhere, _ = context(Spheres(spheres.positions, radii), platformName)
    with pytest.raises(openmm.OpenMMException, match="other numerical parameters"):
        elsewhere.loadCheckpoint(checkpoint)


@pytest.mark.onePrecision
def testPositionsTooFarForTheirPrecisionAreRefused(platformName):
    """With the limit; a step that would lead there leaves the Context usable."""
    spheres = Spheres([[0, 0, 0], [1.0, 0, 0]], 0.5)
    made, integrator = context(spheres, platformName)
    made.setPositions([[0, 0, 0], [1e10, 0, 0]])
    with pytest.raises(openmm.OpenMMException) as caught:
        integrator.step(1)
    for words in ("particle 1", "1e+10 nm from the origin", "rounding", "nearer to the origin"):
        assert words in str(caught.value)
    made.setPositions(spheres.positions)
    integrator.step(1)
