# SPDX-License-Identifier: MIT
"""
Spheres of unequal radii in a periodic fluid: the contract of setErrorTolerance() with every overlap
and nesting, positivity, noise, and that equal radii stay what they were.
"""
import functools

import numpy as np
import openmm
import pytest

from openmmpse import PSEBrownianIntegrator
from platformnames import isDevice, isDirect, served
import scenes
from scenes import (Scene, assertUnitCovariance, errorOf, errorRatio, forceKinds, makeContext, mixture,
                    mobilityColumns, randomForces, stored, whiten)

pytestmark = pytest.mark.onePrecision
SPLITS = {"automatic": PSEBrownianIntegrator.AutomaticSplit,
          "Prolate": PSEBrownianIntegrator.Prolate, "Hasimoto": PSEBrownianIntegrator.Hasimoto}


def twoSizes(small, large, share, N):
    """share of N have the smaller radius, the others the larger one, in turn."""
    return np.where(np.arange(N) % 10 < 10*share, small, large)


def logUniform(smallest, largest, N, seed):
    """The two ends, and N - 2 between: as many radii as spheres."""
    between = np.random.default_rng(seed).random(N - 2)
    return np.concatenate([[smallest, largest], smallest*(largest/smallest)**between])


def nested(N):
    """One in ten is ten times as large; one small sphere has the centre of a large one."""
    s = mixture(twoSizes(0.25, 2.5, 0.9, N), 0.25, scenes.cube(1), 61)
    large = np.argmax(s.radii)
    s.positions[:3] = s.positions[large] + [[0, 0, 0], [2.24, 0, 0], [0, 0, -2.8]]
    return s


# name -> function of the number of particles that the platform affords
SCENES = {
    "twoSizesOverlapping": lambda N: mixture(twoSizes(0.5, 1.0, 0.5, N), 0.3, scenes.tilted(1), 60),
    "nested": nested,
    "continuous": lambda N: mixture(logUniform(0.25, 1.25, N, 62), 0.2, scenes.tilted(1, -1), 62),
    "widelyContinuous": lambda N: mixture(logUniform(0.2, 2.0, N, 63), 0.2, scenes.cube(1), 63),
    "apart": lambda N: mixture(twoSizes(0.3, 0.9, 0.7, N), 0.15, scenes.rhombicDodecahedron(1), 64, True),
    "fiveSizes": lambda N: mixture(np.linspace(0.4, 0.8, 5)[np.arange(N) % 5], 0.1, scenes.elongated(1), 65),
    "smallBox": lambda N: Scene(mixture(twoSizes(0.5, 1.0, 0.5, 8), 0.3, scenes.tilted(1), 66).positions,
                                scenes.tilted(2.6), 0.5, twoSizes(0.5, 1.0, 0.5, 8)),
    "pair": lambda N: Scene(scenes.pair(0.9, 12.0, 0.5).positions, scenes.cube(12.0), 0.5, np.array([0.5, 1.2])),
}


@functools.lru_cache(maxsize=None)
def scene(name, N):
    return SCENES[name](N)


def sceneFor(name, platformName):
    return scene(name, 40 if isDirect(platformName) else 120)


def withSplit(split, configure=lambda integrator: None):
    def both(integrator):
        integrator.setSplit(SPLITS[split])
        configure(integrator)
    return both


def servedMixture(platformName, tolerance):
    """In single precision below 1e-4 mixtures of widely different radii are refused."""
    single = isDevice(platformName) and not platformName.endswith("double")
    return max(served(platformName, tolerance), 1e-4 if single else 0)


def ofOneSize(s, size):
    """Random forces on the largest or the smallest spheres alone."""
    return randomForces(s)*(s.radii == size(s.radii))[:, None]


# ---------------------------------------------------------------- the contract

@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("split", ["automatic", "Hasimoto"])
def testErrorContract(platformName, name, split):
    s = sceneFor(name, platformName)
    failures = []
    for tolerance in sorted({servedMixture(platformName, t) for t in (1e-2, 1e-3, 1e-5)}):
        context, integrator = makeContext(s, platformName, tolerance=tolerance, configure=withSplit(split))
        parameters = integrator.getNumericalParameters()
        assert 0 < parameters["predictedError"] <= tolerance
        here = stored(s, context)
        kinds = {**forceKinds(s), "smallest": ofOneSize(s, min), "largest": ofOneSize(s, max),
                 "weight": scenes.uniformForces(s)*(s.radii**3)[:, None]}
        for kind, forces in kinds.items():
            ratio = errorOf(integrator, forces, here)/tolerance
            if not ratio <= 1:
                failures.append(f"{kind} forces at {tolerance:g}: error {ratio:.2f} tolerance")
    assert not failures, "; ".join(failures)


def clusterOfSmallOnes(radii, seed):
    """Mean phi = 0.1, and all spheres of the smallest radius in one cluster of phi = 0.3."""
    s = mixture(radii, 0.1, scenes.cube(1), seed)
    rng = np.random.default_rng(seed + 1)
    small = np.flatnonzero(s.radii == min(s.radii))
    directions = rng.normal(size=(len(small), 3))
    directions *= rng.random((len(small), 1))**(1/3)/np.linalg.norm(directions, axis=1)[:, None]
    s.positions[small] = s.positions[small[0]] + min(s.radii)*(len(small)/0.3)**(1/3)*directions
    return s, small


def dipolesOn(s, chosen):
    """Each of these spheres pushes its nearest neighbour among them and is pushed back."""
    forces, near = np.zeros((s.count, 3)), s.positions[chosen]
    distances = np.linalg.norm(near[:, None] - near, axis=2) + 1e9*np.eye(len(chosen))
    for i, f in zip(range(len(chosen)), randomForces(s)):
        forces[chosen[i]] += f
        forces[chosen[np.argmin(distances[i])]] -= f
    return forces


@pytest.mark.parametrize("name, radii", [("1:2", twoSizes(0.5, 1.0, 0.9, 120)), ("1:10", twoSizes(0.25, 2.5, 0.9, 120)),
                                         ("five", np.linspace(0.5, 1.0, 5)[np.arange(120) % 5])])
def testClusterOfTheSmallestSpheres(platformName, name, radii):
    """Errors are relative to the velocities of the whole cluster; the Plan knows of mean densities alone [T27]."""
    if isDirect(platformName):
        radii = radii[:40]
    s, small = clusterOfSmallOnes(radii, 71)
    alone = ofOneSize(s, min)
    for tolerance in sorted({servedMixture(platformName, t) for t in (1e-2, 1e-5)}):
        context, integrator = makeContext(s, platformName, tolerance=tolerance)
        here = stored(s, context)
        for kind, forces in {"random": alone, "dipoles": dipolesOn(s, small)}.items():
            ratio = errorOf(integrator, forces, here)/tolerance
            assert ratio <= 1, f"{kind} at {tolerance:g}: error {ratio:.2f} tolerance"


@pytest.mark.hostOnly  # devices have the same Plan and tables; their kernels know of no number of radii
@pytest.mark.withGrid
@pytest.mark.parametrize("widest", [2.5, 10])
def testTenThousandRadiiOfTheirOwn(platformName, widest):
    """
    Twenty neighbours among ten thousand spheres, no two of one radius, are pulled: direct sums for them and for
    twenty others anywhere, in the norm of the contract.
    """
    s = mixture(logUniform(0.3, 0.3*widest, 10000, 72), 0.2, scenes.cube(1), 72)
    assert len(set(s.radii)) == 10000
    near = np.argsort(np.linalg.norm(scenes.nearestImages(s.positions - s.positions[2], s.box), axis=1))
    chosen = np.concatenate([near[:20], near[20:5000:249]])
    few = Scene(s.positions[chosen], s.box, s.radius, s.radii[chosen])
    pulls = randomForces(few)*(np.arange(few.count) < 20)[:, None]
    forces = np.zeros((s.count, 3))
    forces[chosen] = pulls
    for tolerance in (1e-3, 1e-5):
        context, integrator = makeContext(s, platformName, tolerance=tolerance)
        u = integrator.applyMobility(forces)[chosen]
        assert errorRatio(u, few.velocities(pulls), pulls, few) <= tolerance


@pytest.mark.parametrize("name", ["twoSizesOverlapping", "nested", "smallBox"])
def testWorstForce(platformName, name):
    """The whole error matrix, forces measured by the velocities that they would give alone."""
    s = scene(name, 20)
    for tolerance in (1e-2, servedMixture(platformName, 1e-5)):
        context, integrator = makeContext(s, platformName, tolerance=tolerance)
        error = mobilityColumns(integrator, s.count) - stored(s, context).mobility
        own = np.repeat(s.ownMobilities.ravel(), 3)
        assert np.linalg.norm(error/own, 2) <= 3*tolerance


@pytest.mark.parametrize("split", ["Prolate", "Hasimoto"])
def testSymmetryAndPositivity(platformName, split):
    """Any overlap and nesting, coincident equal spheres included: M' is symmetric and >= 0."""
    s = nested(20)
    s.positions[5] = s.positions[4]
    tolerance = 1e-2
    context, integrator = makeContext(s, platformName, tolerance=tolerance, configure=withSplit(split))
    M = mobilityColumns(integrator, s.count)/s.mu0
    double = integrator.getNumericalParameters()["precision"] == "double"
    # Single precision: the tables' powers magnify rounding of 6e-8 up to 17 times here (Hasimoto's; 7 times prolate),
    # relative to 1/(6 pi eta a) of the Plan's a = 0.26: 2e-6 in F and in r^2 C of a pair. Over 19 pairs of a sphere, of
    # random signs, 2 sqrt(19) times as much, 1.7e-5. The CPU rounds sums of products once.
    rounding = 1e-11 if double else 2e-5 if isDevice(platformName) else 5e-6
    assert np.linalg.norm(M - M.T, 2) < rounding
    eigenvalues = np.linalg.eigvalsh(0.5*(M + M.T))
    assert eigenvalues[0] > -rounding
    assert abs(eigenvalues[:3]).max() < rounding      # the coincident pair: no relative mobility


@pytest.mark.onePrecision
@pytest.mark.parametrize("split, values", [("Prolate", (0.25, 0.45, 0.9)), ("Hasimoto", (0.35, 0.6, 1.1))])
def testSplittingParameterDoesNotMatter(platformName, split, values):
    s, tolerance = scene("continuous", 40), 1e-4
    forces = randomForces(s)
    for xi in values:
        context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                          configure=withSplit(split, lambda i: i.setSplittingParameter(xi)))
        parameters = integrator.getNumericalParameters()
        assert parameters["xi"] == xi and parameters["split"] == split
        ratio = errorOf(integrator, forces, stored(s, context))/tolerance
        assert ratio <= 1, f"xi = {xi}: error {ratio:.2f} tolerance, {parameters}"


@pytest.mark.onePrecision
@pytest.mark.parametrize("split", ["Prolate", "Hasimoto"])
@pytest.mark.parametrize("name", ["twoSizesOverlapping", "continuous", "smallBox"])
def testPlanIsReproduced(platformName, name, split):
    """The returned dict, given to another integrator: the same dict and velocities, to the bit."""
    s = scene(name, 40)
    forces = randomForces(s)
    context, integrator = makeContext(s, platformName, tolerance=1e-3, configure=withSplit(split))
    parameters = integrator.getNumericalParameters()
    again, copy = makeContext(s, platformName, tolerance=1e-3, seed=0,
                              configure=lambda i: i.setNumericalParameters(parameters))
    assert copy.getNumericalParameters() == parameters
    assert np.array_equal(copy.applyMobility(forces), integrator.applyMobility(forces))


@pytest.mark.onePrecision
def testSizesAHundredTimesApart(platformName):
    """Two classes, a small sphere inside a large one; or a refusal that says what to do."""
    a = np.array([0.05, 0.05, 5.0, 0.05, 5.0])
    rng = np.random.default_rng(67)
    s = Scene(rng.random((5, 3))*16, scenes.cube(16.0), 0.05, a)
    s.positions[1] = s.positions[2] + [4.9, 0, 0]
    try:
        context, integrator = makeContext(s, platformName, tolerance=1e-3)
    except openmm.OpenMMException as refusal:
        assert not isDirect(platformName)
        for words in ("radii", "nm", "looser tolerance"):
            assert words in str(refusal)
        return
    for kind, forces in forceKinds(s).items():
        assert errorOf(integrator, forces, stored(s, context)) <= 1e-3, kind


# ---------------------------------------------------------------- noise

def eightInOne():
    """Eight spheres of a tenth of the radius of the ninth: inside it, across its surface, anywhere."""
    s = mixture([2.5] + 8*[0.25], 0.25, scenes.cube(1), 61)
    s.positions[1:4] = s.positions[0] + [[0.3, 0, 0], [2.24, 0, 0], [0, 0, -2.8]]
    return s


NOISY = {
    "continuous": lambda: mixture(logUniform(0.3, 1.5, 8, 68), 0.1, scenes.tilted(1), 68),
    "1:2 overlapping": lambda: mixture(twoSizes(0.5, 1.0, 0.5, 10), 0.5, scenes.tilted(1), 60),
    "1:10 nested": eightInOne,
}


@pytest.mark.onePrecision
@pytest.mark.parametrize("split, tolerance", [("Prolate", 1e-3), ("Hasimoto", 1e-3), ("automatic", 1e-6)])
@pytest.mark.parametrize("name", NOISY)
def testCovarianceIsThatOfTheMobility(platformName, name, split, tolerance):
    """
    n = 5000, d = 24 to 30: variances wrong by 2.2 % on the whole are found, and correlations of 0.1; false alarm
    rate 1e-6. At 1e-6 that is noise in double precision on the CPU.
    """
    kT, dt = scenes.KB*300, 2.0
    s = NOISY[name]()
    context, integrator = makeContext(s, platformName, 300, dt, servedMixture(platformName, tolerance),
                                      configure=withSplit(split))
    samples = integrator.sampleBrownianDisplacements(5000).reshape(5000, -1)
    assertUnitCovariance(whiten(samples, 2*kT*dt*s.mobility), f"{name}, {split}")


# ---------------------------------------------------------------- what else depends on radii

@pytest.mark.onePrecision
def testEqualRadiiTakeThePathOfOneRadius(platformName):
    """setParticleRadius with one value for all: to the bit what the constructor's radius gives."""
    s = scenes.randomSuspension(20, 0.15, scenes.tilted(1), 0.5, 69)
    each = Scene(s.positions, s.box, 7.0, np.full(20, 0.5))
    found = []
    for one in (s, each):
        context, integrator = makeContext(one, platformName, 300, 2.0)
        integrator.step(3)
        found.append((scenes.positionsOf(context), integrator.applyMobility(randomForces(s)),
                      integrator.getNumericalParameters()))
        assert "unequal radii" not in integrator.describe()
    assert np.array_equal(found[0][0], found[1][0]) and np.array_equal(found[0][1], found[1][1])
    assert found[0][2] == found[1][2]


@pytest.mark.onePrecision
def testMasslessParticlesKeepTheirRadiiToThemselves(platformName):
    """Radii belong to particles of the System, also where some of them do not feel the fluid."""
    s = scene("twoSizesOverlapping", 20)
    masses = np.where(np.arange(20) % 3 == 0, 0.0, 100.0)
    mobile = masses > 0
    context, integrator = makeContext(s, platformName, masses=masses)
    forces = randomForces(s)*mobile[:, None]
    u = integrator.applyMobility(forces)
    alone = Scene(s.positions[mobile], s.box, 0.5, s.radii[mobile])
    assert np.all(u[~mobile] == 0)
    assert errorRatio(u[mobile], alone.velocities(forces[mobile]), forces[mobile], alone) <= 1e-3


@pytest.mark.onePrecision
def testDescription(platformName):
    context, integrator = makeContext(scene("fiveSizes", 40), platformName)
    assert ("unequal radii: 5 distinct, from 0.4 to 0.8 nm, because setParticleRadius was called; each is a class "
            "of its own") in integrator.describe()
    context, integrator = makeContext(scene("continuous", 40), platformName)
    assert "40 distinct, from 0.25 to 1.25 nm" in integrator.describe()
    assert "functions of the radius" in integrator.describe()
    nine = mixture(np.linspace(0.4, 0.8, 9)[np.arange(40) % 9], 0.1, scenes.cube(1), 65)
    context, integrator = makeContext(nine, platformName)
    assert "are interpolated by" in integrator.describe()


@pytest.mark.onePrecision
def testCheckpointOfOtherRadiiIsRefused(platformName):
    """Two spheres have changed places; all numerical parameters are the same."""
    s = scene("twoSizesOverlapping", 20)
    radii = s.radii.copy()
    radii[[3, 7]] = radii[[7, 3]]
    context, integrator = makeContext(s, platformName, 300)
    checkpoint = context.createCheckpoint()
    other, fresh = makeContext(Scene(s.positions, s.box, 0.5, radii), platformName, 300)
    with pytest.raises(openmm.OpenMMException, match="checksum"):
        other.loadCheckpoint(checkpoint)
    context.loadCheckpoint(checkpoint)


@pytest.mark.onePrecision
def testRefusalsNameValueLimitAndRemedy(platformName):
    s = scene("continuous", 40)

    def messageOf(split, **wishes):
        def configure(i):
            i.setNumericalParameters(wishes)
        with pytest.raises(openmm.OpenMMException) as refusal:
            makeContext(s, platformName, tolerance=1e-4, configure=withSplit(split, configure))
        return str(refusal.value)
    for message, words in (
            (messageOf("Prolate", realCutoff=2.4), ("2.4 nm", "2.5 nm", "cutoff 0")),
            (messageOf("Prolate", realCutoff=5.0, xi=1.0), ("1 /nm", "5 nm", "prescribe one")),
            (messageOf("Prolate", prolateBandwidth=5.0), ("bandwidth of 5", "0.0001", "larger bandwidth")),
            (messageOf("Hasimoto", xi=0.5, realCutoff=4.0), ("0.5 /nm", "4 nm", "0.0001", "larger"))):
        for word in words:
            assert word in message, message
