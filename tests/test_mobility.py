# SPDX-License-Identifier: MIT
"""
applyMobility against the dense oracle: the contract of setErrorTolerance(), which is

    |u - M f| <= tolerance * max(|M f|, |f|/(6 pi eta a))          random, uniform, balanced forces
    largest singular value of (M' - M) <= 3 tolerance/(6 pi eta a)  the worst force there is

and what must hold whatever the tolerance: symmetry, positivity, invariances, and that the numerical
parameters move cost and not results.
"""
import functools

import numpy as np
import openmm
import pytest

from openmmpse import PSEBrownianIntegrator
from platformnames import (coordinateRounding, isDevice, isDirect, precisionOf, served,
                           velocityRounding)
import scenes
from scenes import (Scene, errorOf, errorRatio, forceKinds, makeContext, mobilityColumns,
                    positionsOf, randomForces, stored)

# By platform, or by precision of a device: there a Context takes seconds to compile.
TOLERANCES = {"Reference": [1e-2, 1e-3, 1e-5, 1e-10], "CPU": [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8],
              "single": [1e-3, 1e-5], "mixed": [1e-5], "double": [1e-10]}
OF_HASIMOTO = {**TOLERANCES, "single": [1e-5], "mixed": [1e-3], "double": [1e-7]}
# Rounding of the arrays in use, relative to 1/(6 pi eta a): what exact identities may lose.
ROUNDING = {"single": 5e-6, "mixed": 5e-6, "double": 1e-11}
SPLITS = {"automatic": PSEBrownianIntegrator.AutomaticSplit,
          "Prolate": PSEBrownianIntegrator.Prolate, "Hasimoto": PSEBrownianIntegrator.Hasimoto}
PARAMETER_KEYS = {
    "split", "xi", "realCutoff", "prolateBandwidth", "gridDimensions", "windowSupport", "windowShape",
    "lanczosTolerance", "lanczosIterations", "predictedError", "precision", "instructions",
    "randomSeed"}


def outsideTheBox(scene, farthest, seed=21):
    """The same scene with every particle moved by lattice vectors, one of them far."""
    rng = np.random.default_rng(seed)
    shifts = rng.integers(-3, 4, (scene.count, 3))
    shifts[0] = np.array([200, -300, 100])*farthest//300
    return scene.moved(shifts @ scene.box)


def randomPoints(N, seed):
    return np.random.default_rng(seed).random((N, 3))


# name -> function of the number of particles that the platform affords
SCENES = {
    "oneInCube": lambda N: Scene(np.array([[0.3, 1.7, 2.9]]), scenes.cube(5.0), 0.5),
    "oneInTinyCube": lambda N: Scene(np.array([[0.3, 0.7, 0.9]]), scenes.cube(1.1), 0.5),
    "touchingPair": lambda N: scenes.pair(1.4, 9.0, 0.7),
    "overlappingPair": lambda N: scenes.pair(0.35, 9.0, 0.7),
    "coincidentPair": lambda N: scenes.pair(0.0, 7.0, 0.7),
    "sixInTinyCube": lambda N: Scene(randomPoints(6, 30), scenes.cube(1.0), 0.5),
    "pairInSmallCube": lambda N: scenes.pair(0.6, 1.6, 0.5),
    "three": lambda N: scenes.idealGas(3, 0.05, scenes.cube(1), 0.5, 31),
    "suspension10": lambda N: scenes.randomSuspension(N, 0.1, scenes.cube(1), 0.5, 32),
    "suspension45": lambda N: scenes.denseSuspension(3 if N > 60 else 2, 0.45, 0.5, 33),
    "idealGas": lambda N: scenes.idealGas(N, 0.2, scenes.cube(1), 0.5, 34),
    "chain": lambda N: scenes.chain(min(N, 100), 1.6, 24.0*(min(N, 100)/100)**0.5, 0.8, 35),
    "maximalTilt": lambda N: scenes.randomSuspension(N, 0.1, scenes.tilted(1), 0.5, 36),
    "negativeTilt": lambda N: scenes.randomSuspension(N, 0.2, scenes.tilted(1, -1), 0.5, 37),
    "elongated": lambda N: scenes.randomSuspension(N, 0.1, scenes.elongated(1), 0.5, 38),
    "rhombicDodecahedron":
        lambda N: scenes.randomSuspension(N, 0.1, scenes.rhombicDodecahedron(1), 0.5, 39),
    "truncatedOctahedron":
        lambda N: scenes.randomSuspension(N, 0.1, scenes.truncatedOctahedron(1), 0.5, 40),
    "outsideTheBox": lambda N: scenes.randomSuspension(N, 0.1, scenes.tilted(1), 0.5, 41),
}


@functools.lru_cache(maxsize=None)
def scene(name, size, farthest=300):
    s = SCENES[name](size)
    return outsideTheBox(s, farthest) if name == "outsideTheBox" else s


def sceneFor(name, platformName):
    return scene(name, 40 if isDirect(platformName) else 160, farthestImage(platformName))


def farthestImage(platformName):
    """A float of a coordinate far away does not tell the place in the box to the tolerance."""
    return 300 if coordinateRounding(platformName) < 1e-10 else 3


def tolerancesOf(platformName, split="automatic"):
    table = OF_HASIMOTO if split == "Hasimoto" else TOLERANCES
    return table[precisionOf(platformName, 1) if isDevice(platformName) else platformName]


def smallScene(seed=51, N=12, phi=0.15, box=scenes.cube(1)):
    return scenes.randomSuspension(N, phi, box, 0.5, seed)


def withSplit(split, configure=lambda integrator: None):
    def both(integrator):
        integrator.setSplit(SPLITS[split])
        configure(integrator)
    return both


def rounding(integrator):
    return ROUNDING[integrator.getNumericalParameters()["precision"]]


# ---------------------------------------------------------------- the contract

@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("split", ["automatic", "Hasimoto"])
def testErrorContract(platformName, name, split):
    s = sceneFor(name, platformName)
    failures = []
    for tolerance in tolerancesOf(platformName, split):
        context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                          configure=withSplit(split))
        here = stored(s, context)
        for kind, forces in forceKinds(s).items():
            ratio = errorOf(integrator, forces, here)/tolerance
            if not ratio <= 1:
                failures.append(f"{kind} forces at {tolerance:g}: error {ratio:.2f} tolerance")
    assert not failures, "; ".join(failures)


@pytest.mark.parametrize("name", ["oneInCube", "overlappingPair", "suspension10", "maximalTilt",
                                  "elongated"])
def testParametersReported(platformName, name):
    s = sceneFor(name, platformName)
    for tolerance in tolerancesOf(platformName):
        context, integrator = makeContext(s, platformName, tolerance=tolerance)
        parameters = integrator.getNumericalParameters()
        assert PARAMETER_KEYS <= set(parameters)
        assert 0 < parameters["predictedError"] <= tolerance
        assert parameters["xi"] > 0 and parameters["realCutoff"] > 0
        prolate = parameters["split"] == "Prolate"
        assert prolate or parameters["split"] == "Hasimoto"
        assert prolate or parameters["prolateBandwidth"] == 0
        if prolate:
            assert 3 <= parameters["prolateBandwidth"] <= 30
            assert parameters["xi"]*parameters["realCutoff"] == pytest.approx(1, rel=1e-12)
            assert parameters["realCutoff"] < 0.5*np.diag(s.box).min()
        if name in ("overlappingPair", "suspension10", "maximalTilt") and tolerance >= 1e-3:
            assert prolate  # there is room for its range
        assert len(parameters["gridDimensions"]) == 3
        assert min(parameters["gridDimensions"]) >= parameters["windowSupport"] >= 3
        assert parameters["randomSeed"] == 5
        assert parameters["precision"] == precisionOf(platformName, tolerance)


@pytest.mark.parametrize("box", ["cube", "tilted", "elongated"])
@pytest.mark.parametrize("split", ["automatic", "Hasimoto"])
def testWorstForce(platformName, box, split):
    """The whole error matrix; no force can find more than its largest singular value."""
    shapes = {"cube": scenes.cube, "tilted": scenes.tilted, "elongated": scenes.elongated}
    s = smallScene(52, 16, 0.15, shapes[box](1))
    failures = []
    for tolerance in tolerancesOf(platformName, split):
        context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                          configure=withSplit(split))
        error = mobilityColumns(integrator, s.count) - stored(s, context).mobility
        worst = np.linalg.norm(error, 2)/s.mu0/tolerance
        if not worst <= 3:
            failures.append(f"at {tolerance:g}: {worst:.2f} tolerance")
    assert not failures, "; ".join(failures)


@pytest.mark.parametrize("tolerance, split", [(1e-2, "Prolate"), (1e-2, "Hasimoto"),
                                              (1e-5, "Hasimoto")])
def testSymmetryAndPositivity(platformName, tolerance, split):
    """Overlapping, touching and coincident particles included: M' is symmetric and >= 0."""
    a = 0.5
    s = scenes.idealGas(10, 0.3, scenes.tilted(1), a, 53)
    s.positions[1] = s.positions[0]
    s.positions[3] = s.positions[2] + [0.5*a, 0, 0]
    s.positions[5] = s.positions[4] + [0, 2*a, 0]
    context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                      configure=withSplit(split))
    M = mobilityColumns(integrator, s.count)/s.mu0
    limit = rounding(integrator)
    assert np.linalg.norm(M - M.T, 2) < limit
    eigenvalues = np.linalg.eigvalsh(0.5*(M + M.T))
    assert abs(eigenvalues[:3]).max() < limit      # the coincident pair: no relative mobility
    assert eigenvalues[3] > 1e-3


@pytest.mark.onePrecision
# ---------------------------------------------------------------- numerical parameters

@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
@pytest.mark.parametrize("split", ["automatic", "Prolate", "Hasimoto"])
def testSplittingParameterDoesNotMatter(platformName, split, tolerance):
    s = scenes.idealGas(30, 0.1, scenes.tilted(1), 0.5, 54)
    forces = randomForces(s)
    # ranges of the prolate split: wide enough to be positive, up to half of the box of 5.4 nm
    values = {1e-3: (0.375, 0.45, 0.52), 1e-5: (0.375,)}[tolerance] if split == "Prolate" else (
        0.6, 1.0, 1.7, 2.6)
    for xi in values:
        context, integrator = makeContext(
            s, platformName, tolerance=tolerance,
            configure=withSplit(split, lambda i: i.setSplittingParameter(xi)))
        parameters = integrator.getNumericalParameters()
        assert parameters["xi"] == pytest.approx(xi, rel=1e-12)
        assert split == "automatic" or parameters["split"] == split
        ratio = errorOf(integrator, forces, stored(s, context))/tolerance
        assert ratio <= 1, f"xi = {xi}: error {ratio:.2f} tolerance, {parameters}"


@pytest.mark.onePrecision
@pytest.mark.parametrize("extra", [(0, 0, 0), (1, 1, 1), (0, 1, 2), (3, 2, 1)])
def testOddEvenAndUnequalGrids(platformName, extra):
    """The Plan's own grid made finer by hand: odd, even and mixed numbers of points, primes."""
    s = smallScene(55, 12, 0.15, scenes.tilted(1))
    tolerance = 1e-4
    context, integrator = makeContext(s, platformName, tolerance=tolerance)
    automatic = integrator.getNumericalParameters()
    grid = [2*((n + 1)//2) + e for n, e in zip(automatic["gridDimensions"], extra)]

    def configure(i):
        i.setSplittingParameter(automatic["xi"])
        i.setGridDimensions(*grid)
    context, integrator = makeContext(s, platformName, tolerance=tolerance, configure=configure)
    assert list(integrator.getNumericalParameters()["gridDimensions"]) == grid
    for kind, forces in forceKinds(s).items():
        ratio = errorOf(integrator, forces, s)/tolerance
        assert ratio <= 1, f"{kind} forces on grid {grid}: error {ratio:.2f} tolerance"


@pytest.mark.onePrecision
def testWiderWindow(platformName):
    s = smallScene(56)
    tolerance = 1e-4
    context, integrator = makeContext(s, platformName, tolerance=tolerance)
    support = integrator.getNumericalParameters()["windowSupport"] + 1
    context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                      configure=lambda i: i.setWindowSupport(support))
    assert integrator.getNumericalParameters()["windowSupport"] == support
    forces = randomForces(s)
    assert errorOf(integrator, forces, s) <= tolerance


@pytest.mark.onePrecision
@pytest.mark.parametrize("split", ["Prolate", "Hasimoto"])
def testBothSplitsGiveOneMobility(platformName, split):
    """And the dict of one Context makes it in another, whatever the tolerance that one has."""
    s = smallScene(74, 30, 0.05, scenes.tilted(1))
    forces = randomForces(s)
    exact = s.velocities(forces)
    for tolerance in (1e-1, 1e-2, 1e-4):
        context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                          configure=withSplit(split))
        parameters = integrator.getNumericalParameters()
        assert parameters["split"] == split
        u = integrator.applyMobility(forces)
        assert errorRatio(u, exact, forces, s) <= tolerance
        other, copy = makeContext(s, platformName, tolerance=3e-3,
                                  configure=lambda i: i.setNumericalParameters(parameters))
        found = copy.getNumericalParameters()
        for key in ("split", "xi", "realCutoff", "prolateBandwidth", "gridDimensions",
                    "windowSupport", "windowShape"):
            assert found[key] == parameters[key], key
        # The modes are the same; tables and window polynomials follow the tolerance.
        assert errorRatio(copy.applyMobility(forces), u, forces, s) <= 0.1*max(tolerance, 3e-3)


@pytest.mark.onePrecision
def testWhichSplit(platformName):
    """Prolate is the default; a box too small for it gets the other one, and describe() says so."""
    wide, narrow = smallScene(75, 40, 0.1), scenes.pair(1.2, 5.0, 0.5)
    for s, tolerance, name, words in ((wide, 1e-3, "Prolate", "Prolate split (default)"),
                                      (narrow, 1e-5, "Hasimoto", "Hasimoto split, because")):
        context, integrator = makeContext(s, platformName, tolerance=tolerance)
        assert integrator.getNumericalParameters()["split"] == name
        assert words in integrator.describe()
        context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                          configure=withSplit("Hasimoto"))
        assert "Hasimoto split (as prescribed)" in integrator.describe()
    context, integrator = makeContext(narrow, platformName, tolerance=1e-5)
    assert "smallest box width 5 nm" in integrator.describe()
    context, integrator = makeContext(wide, platformName)
    context.setPeriodicBoxVectors(*scenes.cube(2.3))    # and back: the Plan follows the box
    integrator.applyMobility(np.ones((40, 3)))
    assert integrator.getNumericalParameters()["split"] == "Hasimoto"
    context.setPeriodicBoxVectors(*wide.box)
    integrator.applyMobility(np.ones((40, 3)))
    assert integrator.getNumericalParameters()["split"] == "Prolate"


@pytest.mark.onePrecision
@pytest.mark.parametrize("split, tolerance", [("Prolate", 1e-3), ("Prolate", 1e-2),
                                              ("Hasimoto", 1e-3), ("Hasimoto", 1e-6)])
def testPlanIsReproduced(platformName, split, tolerance):
    """The returned dict, given to another integrator: the same dict and velocities, to the bit."""
    tolerance = served(platformName, tolerance)
    s = smallScene(57, 20, 0.1, scenes.tilted(1))
    forces = randomForces(s)
    xi = 1.3 if split == "Hasimoto" else 0.47
    context, integrator = makeContext(
        s, platformName, tolerance=tolerance, seed=17,
        configure=withSplit(split, lambda i: i.setSplittingParameter(xi)))
    parameters = integrator.getNumericalParameters()
    again, copy = makeContext(s, platformName, tolerance=tolerance, seed=0,
                              configure=lambda i: i.setNumericalParameters(parameters))
    assert copy.getNumericalParameters() == parameters
    assert np.array_equal(copy.applyMobility(forces), integrator.applyMobility(forces))


@pytest.mark.withGrid
@pytest.mark.parametrize("split, tolerance", [("Prolate", 1e-2), ("Prolate", 1e-4),
                                              ("Hasimoto", 1e-2), ("Hasimoto", 1e-6)])
def testReferenceAgreesWithTheSamePlan(platformName, split, tolerance):
    tolerance = served(platformName, tolerance)
    s = smallScene(58, 30, 0.1, scenes.tilted(1))
    forces = randomForces(s)
    context, gridded = makeContext(s, platformName, tolerance=tolerance, configure=withSplit(split))
    parameters = gridded.getNumericalParameters()
    other, reference = makeContext(stored(s, context), "Reference", tolerance=tolerance,
                                   configure=lambda i: i.setNumericalParameters(parameters))
    # The Reference platform converges its Lanczos iteration to 1e-12 whatever it is told.
    same = ("split", "xi", "realCutoff", "prolateBandwidth", "gridDimensions", "windowSupport",
            "windowShape")
    found = reference.getNumericalParameters()
    assert {key: found[key] for key in same} == {key: parameters[key] for key in same}
    u = reference.applyMobility(forces)
    assert errorRatio(gridded.applyMobility(forces), u, forces, s) <= tolerance


# ---------------------------------------------------------------- invariances

@pytest.mark.parametrize("tolerance", [1e-3, 1e-7])
def testLatticeVectorsDoNotMatter(platformName, tolerance):
    """
    The crystal decides, not the vectors that describe it: b and b - a at half tilt span the same
    one. Moving particles by lattice vectors changes nothing but rounding.
    """
    tolerance = served(platformName, tolerance)
    s = smallScene(59, 12, 0.15, scenes.tilted(1))
    a, b, c = s.box
    forces = randomForces(s)
    for other in ([a, b - a, c], [a, b, c - a], [a, b, c - b], [a, b - a, c - b]):
        same = Scene(s.positions, np.array(other), s.radius)
        context, integrator = makeContext(same, platformName, tolerance=tolerance)
        u = integrator.applyMobility(forces)
        ratio = errorRatio(u, stored(s, context).velocities(forces), forces, s)/tolerance
        assert ratio <= 1, f"box {np.array(other).tolist()}: error {ratio:.2f} tolerance"
        moved = outsideTheBox(same, farthestImage(platformName))
        context.setPositions(moved.positions)
        assert errorRatio(integrator.applyMobility(forces), u, forces, s) < rounding(integrator)


@pytest.mark.onePrecision
def testPermutedAxes(platformName):
    """A crystal turned by 120 degrees about 111, box 1:1:8: the velocities turn with it."""
    tolerance = 1e-4
    s = smallScene(60, 12, 0.1, scenes.elongated(1))
    forces = randomForces(s)
    exact = s.velocities(forces)
    for order in ([0, 1, 2], [1, 2, 0], [2, 0, 1]):
        turned = Scene(s.positions[:, order], s.box[order][:, order], s.radius)
        context, integrator = makeContext(turned, platformName, tolerance=tolerance)
        u = integrator.applyMobility(forces[:, order])
        assert errorRatio(u, exact[:, order], forces, s) <= tolerance


@pytest.mark.onePrecision
@pytest.mark.parametrize("axis", [0, 1, 2])
def testDoubledBox(platformName, axis):
    tolerance = 1e-4
    s = smallScene(61, 8, 0.1)
    box = s.box.copy()
    box[axis] *= 2
    doubled = Scene(np.vstack([s.positions, s.positions + s.box[axis]]), box, s.radius)
    forces = np.tile(randomForces(s), (2, 1))
    exact = np.tile(s.velocities(forces[:s.count]), (2, 1))
    context, integrator = makeContext(doubled, platformName, tolerance=tolerance)
    assert errorRatio(integrator.applyMobility(forces), exact, forces, s) <= tolerance


@pytest.mark.onePrecision
def testTranslation(platformName):
    """The grid must not show: 20 random translations of the whole crystal."""
    tolerance = 1e-3
    s = smallScene(62, 12, 0.15, scenes.rhombicDodecahedron(1))
    forces = randomForces(s)
    exact = s.velocities(forces)
    context, integrator = makeContext(s, platformName, tolerance=tolerance)
    for shift in np.random.default_rng(63).uniform(-5, 5, (20, 3)):
        context.setPositions(s.positions + shift)
        assert errorRatio(integrator.applyMobility(forces), exact, forces, s) <= tolerance


@pytest.mark.onePrecision
def testBoxChangedBetweenSteps(platformName):
    """
    Larger, smaller, tilted: velocities and the next step belong to the new box. On devices OpenMM
    tilts only a box that was tilted when the Context was made.
    """
    tolerance = 1e-4
    s = smallScene(64, 12, 0.1, scenes.tilted(1))
    forces = 1000*randomForces(s)  # steps far above the rounding of positions
    context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                      forces=[scenes.constantForces(forces)])
    integrator.step(2)
    L = s.box[0, 0]
    for box in (scenes.cube(1.3*L), scenes.cube(0.9*L), scenes.tilted(L),
                np.diag([L, 1.5*L, 1.1*L])):
        context.setPositions(s.positions)
        context.setPeriodicBoxVectors(*box)
        now = Scene(s.positions, box, s.radius)
        exact = now.velocities(forces)
        ratio = errorRatio(integrator.applyMobility(forces), exact, forces, now)/tolerance
        assert ratio <= 1, f"box {box.tolist()}: error {ratio:.2f} tolerance"
        integrator.step(1)
        u = (positionsOf(context) - s.positions)/1.0
        assert errorRatio(u, exact, forces, now) <= tolerance


@pytest.mark.onePrecision
def testPositionsChangedBetweenCalls(platformName):
    """applyMobility acts at the current positions, whoever moved them and how far."""
    tolerance = 1e-4
    s = smallScene(65, 12, 0.1)
    forces = randomForces(s)
    context, integrator = makeContext(s, platformName, tolerance=tolerance)
    for scale in (1e-3, 0.1, 3.0):
        moved = s.moved(np.random.default_rng(66).normal(size=(s.count, 3))*scale)
        context.setPositions(moved.positions)
        assert errorOf(integrator, forces, moved) <= tolerance


@pytest.mark.onePrecision
# ---------------------------------------------------------------- who takes part, and how

def testMasslessParticlesAreTransparent(platformName):
    tolerance = 1e-4
    s = smallScene(67, 14, 0.15)
    mobile = np.array([i for i in range(14) if i not in (0, 5, 13)])
    masses = [1.0 if i in mobile else 0.0 for i in range(14)]
    context, integrator = makeContext(s, platformName, tolerance=tolerance, masses=masses)
    forces = randomForces(s)
    u = integrator.applyMobility(forces)
    others = Scene(s.positions[mobile], s.box, s.radius)
    assert not np.any(np.delete(u, mobile, axis=0))
    exact = others.velocities(forces[mobile])
    assert errorRatio(u[mobile], exact, forces[mobile], others) <= tolerance


@pytest.mark.onePrecision
def testMassesDoNotMatter(platformName):
    s = smallScene(68)
    forces = randomForces(s)
    context, integrator = makeContext(s, platformName)
    heavy, other = makeContext(s, platformName, masses=list(np.linspace(1, 1000, s.count)))
    assert np.array_equal(integrator.applyMobility(forces), other.applyMobility(forces))


@pytest.mark.onePrecision
def testAutomaticBoundaryFollowsTheForces(platformName):
    """A Force that uses periodic boundary conditions makes the fluid periodic."""
    s = smallScene(69)
    forces = randomForces(s)
    context, integrator = makeContext(s, platformName)
    dummy = scenes.periodicDummyForce(s.count, s.box)
    other, automatic = makeContext(s, platformName, forces=[dummy],
                                   boundary=PSEBrownianIntegrator.Automatic)
    assert np.array_equal(integrator.applyMobility(forces), automatic.applyMobility(forces))
    assert "periodic" in automatic.describe().lower()


def testFreeDraining(platformName):
    s = smallScene(70)
    forces = randomForces(s)
    context, integrator = makeContext(
        s, platformName, configure=lambda i: i.setMobilityModel(PSEBrownianIntegrator.FreeDraining))
    assert np.allclose(integrator.applyMobility(forces), forces*s.mu0, atol=0,
                       rtol=velocityRounding(platformName))
    parameters = integrator.getNumericalParameters()
    assert parameters["xi"] == 0 and tuple(parameters["gridDimensions"]) == (0, 0, 0)


@pytest.mark.onePrecision
def testDefaults(platformName):
    """Tolerance 1e-3 unless told otherwise, and an integrator that nothing was set on works."""
    s = smallScene(71)
    forces = randomForces(s)
    context, integrator = makeContext(s, platformName)
    assert integrator.getErrorTolerance() == 1e-3
    assert errorOf(integrator, forces, s) <= 1e-3


@pytest.mark.onePrecision
def testInputAndOutputOfApplyMobility(platformName):
    """Array-likes in, a new float64 array out; linear; nothing moves and no step is counted."""
    s = smallScene(72)
    context, integrator = makeContext(s, platformName, temperature=300.0)
    start = positionsOf(context)
    forces = randomForces(s)
    u = integrator.applyMobility(forces)
    assert isinstance(u, np.ndarray) and u.shape == (s.count, 3) and u.dtype == np.float64
    assert u.flags.writeable and u.flags.c_contiguous
    assert np.array_equal(u, integrator.applyMobility(forces.tolist()))
    assert np.array_equal(u, integrator.applyMobility([openmm.Vec3(*f) for f in forces]))
    assert np.array_equal(u, integrator.applyMobility(np.asfortranarray(forces)))
    assert np.array_equal(u, integrator.applyMobility(np.repeat(forces, 2, axis=0)[::2]))
    assert np.array_equal(integrator.applyMobility(4*forces), 4*u)
    assert not np.any(integrator.applyMobility(np.zeros_like(forces)))
    assert np.array_equal(positionsOf(context), start)
    assert context.getStepCount() == 0 and context.getTime()._value == 0


def testThreadsDoNotChangeABit():
    s = scene("suspension10", 160)
    forces = randomForces(s)
    results = []
    for threads in (1, 2):
        context, integrator = makeContext(s, "CPU", threads=threads,
                                          configure=lambda i: i.setSplittingParameter(1.2))
        results.append(integrator.applyMobility(forces))
    assert np.array_equal(*results)


@pytest.mark.parametrize("tilt", [0.2, -0.499])
def testNeighbourListInTiltedBoxes(tilt):
    """Boxes wide enough for the neighbour list: it must find the pairs across every face of a tilted box."""
    a, L = 0.5, 22.0
    box = np.array([[L, 0, 0], [tilt*L, L, 0], [tilt*L, tilt*L, L]])
    s = Scene(np.random.default_rng(61).random((400, 3)) @ box, box, a)
    forces = randomForces(s)
    context, integrator = makeContext(s, "CPU", tolerance=1e-3,
                                      configure=lambda i: i.setSplittingParameter(0.6/a))
    parameters = integrator.getNumericalParameters()
    assert parameters["realCutoff"] < 0.499*L  # else the explicit sum over images would be tested
    oracle, exact = makeContext(s, "Reference",
                                configure=lambda i: i.setNumericalParameters(parameters))
    ratio = errorRatio(integrator.applyMobility(forces), exact.applyMobility(forces), forces, s)
    assert ratio <= 1e-3
    unmoved = integrator.applyMobility(forces)
    for shift in np.random.default_rng(62).random((3, 3)):
        context.setPositions(s.positions + shift @ box)
        assert errorRatio(integrator.applyMobility(forces), unmoved, forces, s) <= 2e-3
