# SPDX-License-Identifier: MIT
"""
openmmpse.analysis: error bars against independent repetitions, formulas against the library, direct sums and
published numbers.
"""
import itertools
import math
import re
from pathlib import Path
from types import SimpleNamespace

import matplotlib
import numpy as np
import openmm
import pytest
from openmm import app, unit
from scipy import stats

from openmmpse import analysis
from openmmpse.analysis import beads, displacements, trajectory
from openmmpse.demo import polymer
import scenes
from oracle import freeSpaceScalars
from scenes import FALSE_ALARM, cube, elongated, makeContext, rhombicDodecahedron, tilted, truncatedOctahedron
from scenes import ETA, Scene, mixture

PAGE = Path(__file__).resolve().parents[1] / "docs" / "analysis.md"
SPHERE = (1.0, 1 / (6 * math.pi), 1.0)  # radius, viscosity, kT: D0 = 1
matplotlib.use("Agg")
MOST = stats.norm.isf(FALSE_ALARM / 2)


# ---------------------------------------------------------------- estimates

def testEstimates():
    assert analysis.estimate([1.0, 2.0, 3.0]) == pytest.approx((2.0, 1 / math.sqrt(3)))
    assert analysis.Estimate(2.0, 0.5).deviation((0.0, 1.0)) == 2.0
    assert analysis.Estimate(2.0, 0.5).deviation((1.5, 3.0)) == 0.0
    assert analysis.Estimate(2.0, 0.3).minus(analysis.Estimate(1.0, 0.4)) == pytest.approx((1.0, 0.5))
    with pytest.raises(ValueError, match="at least 2 blocks"):
        analysis.estimate([1.0])


def testBlocksAreEqualAndTheRestIsAtTheStart():
    blocks = analysis.blocksOf([np.arange(11.0), np.arange(7.0)], 3)
    assert [list(block) for block in blocks] == [[2, 3, 4], [5, 6, 7], [8, 9, 10], [1, 2], [3, 4], [5, 6]]
    with pytest.raises(ValueError, match="lag of 5 samples does not fit in a block of 5"):
        analysis.blocksOf([np.zeros(10)], 2, 5)


def testWhatCannotBeAnalysedIsNamed():
    for runs, message in ((np.zeros((1, 3)), "two samples"), ([np.zeros((5, 3)), np.zeros((5, 2, 3))], "agree"),
                          (np.full((40, 3), np.nan), "not finite")):
        with pytest.raises(ValueError, match=message):
            analysis.meanSquareDisplacement(runs, 1.0)


# ---------------------------------------------------------------- mean square displacements

def testMeanSquaresAreThoseOfTheDoubleLoop():
    """By differences (few lags) and by Fourier transforms (many), in pieces, far from the origin."""
    path = 1e3 + np.cumsum(np.random.default_rng(1).normal(size=(50, 4, 3)), axis=0)
    exact = [np.mean([np.sum((path[t + k] - path[t])**2, axis=-1) for t in range(50 - k)]) for k in range(1, 50)]
    assert displacements.meanSquares(path, range(1, 50)) == pytest.approx(exact, rel=1e-11)
    assert displacements.meanSquares(path, [3, 7]) == pytest.approx([exact[2], exact[6]], rel=1e-11)
    chunk, displacements.CHUNK = displacements.CHUNK, 500
    try:
        assert displacements.meanSquares(path, range(1, 50)) == pytest.approx(exact, rel=1e-11)
    finally:
        displacements.CHUNK = chunk


def testCovarianceOfMeanSquares():
    """They are squares of normal numbers x: x.A.x and x.B.x have the covariance 2 tr(A S B S)."""
    samples, lags, noise = 9, [1, 2, 5], 0.7
    times = np.arange(samples)
    S = np.minimum.outer(times, times) + noise / 2 * np.eye(samples)
    forms = []
    for lag in lags:
        D = np.eye(samples, k=lag)[: samples - lag] - np.eye(samples)[: samples - lag]
        forms.append(D.T @ D / (samples - lag))
    exact = [[2 * np.trace(A @ S @ B @ S) for B in forms] for A in forms]
    assert displacements.brownianCovariance(samples, lags, noise) == pytest.approx(np.array(exact), rel=1e-12)


def brownian(rng, frames, particles, D=0.7, interval=2.0, noise=0.0, dimensions=3):
    steps = rng.normal(size=(frames, particles, dimensions)) * math.sqrt(2 * D * interval)
    return np.cumsum(steps, axis=0) + noise * rng.normal(size=steps.shape)


@pytest.mark.parametrize("kind", ["sphere alone", "inner motion", "moving together", "several runs"])
def testErrorBarsOfDiffusionAreRight(kind):
    """
    Many repetitions: deviations in units of the error bar follow Student's distribution, and their mean square is what
    that has. Particles that all move as one, which a fluid does to neighbours, are not counted as independent.
    """
    D, interval, repetitions, t, trends = 0.7, 2.0, 300, [], []
    rng = np.random.default_rng(21)
    for _ in range(repetitions):
        options = {"blocks": 20}
        if kind == "sphere alone":
            runs, options["offset"] = brownian(rng, 400, 1), False
        elif kind == "inner motion":
            runs = brownian(rng, 400, 4, noise=2.0)
        elif kind == "moving together":
            runs = np.repeat(brownian(rng, 400, 1, noise=1.0), 5, axis=1) + np.arange(5)[:, None]
        else:
            runs, options["blocks"] = [brownian(rng, 40, 2, noise=1.0, dimensions=2) for _ in range(20)], 1
        fit = analysis.diffusion(runs, interval, start=interval, count=4, **options)
        assert fit.degrees == 19
        t.append((fit.coefficient.value - D) / fit.coefficient.error)
        trends.append(fit.trend.value / fit.trend.error)
    for deviations in (t, trends):
        assert stats.kstest(deviations, stats.t(19).cdf).pvalue > FALSE_ALARM
        square = np.square(deviations)
        variance = 3 * 19**2 / (17 * 15) - (19 / 17)**2
        assert abs(square.mean() - 19 / 17) < MOST * math.sqrt(variance / repetitions), square.mean()


def testTheFitIsTheBestThereIs():
    """Its spread is that of generalised least squares with the exact covariance, well below that of a plain line."""
    rng, lags, frames, noise = np.random.default_rng(5), np.arange(1, 11), 200, 2.0
    D = []
    for _ in range(300):
        runs = [brownian(rng, frames, 8, noise=noise) for _ in range(2)]
        D.append(analysis.diffusion(runs, 2.0, count=10, blocks=1).coefficient.value)
    D = np.array(D)
    step = 2 * 0.7 * 2.0
    covariance = displacements.brownianCovariance(frames, lags, 2 * noise**2 / step) * step**2 / (3 * 16) / (2 * 2.0)**2
    design = np.column_stack([np.ones(10), lags])
    best = np.linalg.inv(design.T @ np.linalg.inv(covariance) @ design)[1, 1]
    plain = np.linalg.pinv(design)[1]
    # Variances of 300 normal numbers are known to 8 %: 300 times one over the true one follows chi-square.
    assert stats.chi2.isf(1 - FALSE_ALARM / 2, 299) < 299 * D.var(ddof=1) / best < stats.chi2.isf(FALSE_ALARM / 2, 299)
    assert best < 0.8 * plain @ covariance @ plain
    assert abs(D.mean() - 0.7) < MOST * math.sqrt(best / 300)


def testTrendTellsWhereMotionIsNotDiffusive():
    """A particle on a spring: a random walk at first, bounded later."""
    rng, x, path = np.random.default_rng(3), np.zeros((30, 3)), []
    for _ in range(3000):
        x = 0.8 * x + rng.normal(size=x.shape)
        path.append(x)
    fit = analysis.diffusion(np.array(path), 1.0)
    assert fit.trend.value < -10 * fit.trend.error
    late = analysis.diffusion(np.array(path), 1.0, start=40.0)
    limit = stats.t.isf(FALSE_ALARM / 2, late.degrees)
    assert late.coefficient.deviation(0.0) < limit and late.trend.deviation(0.0) < limit
    assert late.offset.deviation(2 * 3 / (1 - 0.8**2)) < limit


def testMeanSquareDisplacementOfBrownianMotion():
    curve = analysis.meanSquareDisplacement(brownian(np.random.default_rng(9), 4000, 3), 2.0)
    assert curve.times[0] == 2.0 and curve.times[-1] == 200.0
    limit = stats.t.isf(FALSE_ALARM / 2 / len(curve.times), 9)
    assert np.all(np.abs(curve.values - 6 * 0.7 * curve.times) < limit * curve.errors)
    assert np.all(curve.errors < 0.3 * curve.values)


def testTooShortAStartIsNamed():
    with pytest.raises(ValueError, match="start of 0.4 ps"):
        analysis.diffusion(np.zeros((100, 3)), 1.0, start=0.4)


def testCentres():
    x = np.random.default_rng(2).normal(size=(5, 6, 3))
    assert np.allclose(analysis.centresOf(x, 2)[:, 1], x[:, 3:].mean(axis=1))
    centres = analysis.centresOf(x, [[0, 5], [1, 2, 3]], masses=[1, 2, 3, 4, 5, 3])
    assert centres.shape == (5, 2, 3)
    assert np.allclose(centres[:, 0], (x[:, 0] + 3 * x[:, 5]) / 4)
    with pytest.raises(ValueError, match="6 particles cannot be 4"):
        analysis.centresOf(x, 4)


# ---------------------------------------------------------------- beads in infinite solvent

def pairScalars(distance):
    """Mobility of two unit spheres on the x axis in units of 1/(6 pi eta a): along and across the pair."""
    matrix = beads.mobilityMatrix(np.array([[0.0, 0, 0], [distance, 0, 0]]), 1.0, SPHERE[1])
    assert np.allclose(matrix, matrix.T, atol=1e-15)
    return matrix[0, 3], matrix[1, 4]


@pytest.mark.parametrize(
    "distance, along, across", [(2.0, 0.625, 0.4375), (0.5, 0.90625, 0.859375), (0.0, 1.0, 1.0)]
)
def testPairMobility(distance, along, across):
    assert pairScalars(distance) == pytest.approx((along, across), abs=1e-14)


def testMobilityJoinsAtContact():
    assert pairScalars(2.0 - 1e-9) == pytest.approx(pairScalars(2.0), abs=1e-8)


def testMobilityOfUnequalSpheres():
    """Apart, overlapping, one inside the other, concentric: against the scalars of the tests' oracle."""
    a, b = 0.7, 0.25
    for r in (2.0, 0.96, 0.95, 0.6, 0.451, 0.45, 0.1, 0.0):
        matrix = beads.mobilityMatrix(np.array([[0.0, 0, 0], [r, 0, 0]]), [a, b], SPHERE[1])
        across, along = freeSpaceScalars(r, a, b)
        assert matrix[0, 3] == pytest.approx(along, rel=1e-13) or r == 0
        assert matrix[1, 4] == pytest.approx(across, rel=1e-13)
        assert np.diag(matrix) == pytest.approx([1 / a] * 3 + [1 / b] * 3)


def testDoubletTranslatesAsTheReferenceSays():
    doublet = np.array([[0.0, 0, 0], [0, 0, 2.0]])
    mean = (0.8125 + 2 * 0.71875) / 3
    assert analysis.kirkwood(doublet, *SPHERE) == pytest.approx(mean, abs=1e-14)
    assert analysis.frozenBound(doublet, *SPHERE) == pytest.approx(mean, abs=1e-14)


@pytest.mark.parametrize("radii", [1.0, np.linspace(0.3, 2.0, 12)])
def testKirkwoodIsTheTraceOfTheDenseMobility(radii):
    frames = np.random.default_rng(3).normal(scale=2.0, size=(2, 12, 3))
    values = analysis.kirkwood(frames, radii, *SPHERE[1:])
    for positions, value in zip(frames, values, strict=True):
        dense = beads.mobilityMatrix(positions, radii, SPHERE[1]).reshape(12, 3, 12, 3)
        assert value == pytest.approx(np.einsum("iaja->", dense) / 3 / 144, rel=1e-13)


def testRigidBodyIsMinimalAtItsCentreAndTheSameFromAnyOrigin():
    positions = np.random.default_rng(4).normal(scale=2.0, size=(10, 3)) * [1, 1, 3]
    translation, rotation = analysis.rigidBody(positions, *SPHERE)
    moved = analysis.rigidBody(positions + [5.0, -7.0, 2.0], *SPHERE)
    assert moved == pytest.approx((translation, rotation), rel=1e-10)
    assert analysis.frozenBound(positions, *SPHERE) < translation < analysis.kirkwood(positions, *SPHERE)


@pytest.mark.parametrize("count, bond, expected", [
    (2, 2, 0.779432), (10, 2, 0.441176), (10, 4, 0.285586), (50, 4, 0.128453), (100, 2, 0.167527),
    (100, 4, 0.091133), (1000, 4, 0.029022),
])
def testGaussianChain(count, bond, expected):
    assert analysis.gaussianChainKirkwood(count, bond, *SPHERE) == pytest.approx(expected, abs=6e-7)


def testGaussianChainIsTheAverageOverDrawnChains():
    generator = np.random.default_rng(11)
    chains = np.array([polymer.equilibrium(generator, 20, 2.0) for _ in range(400)])
    sampled = analysis.estimate(analysis.kirkwood(chains, *SPHERE))
    assert sampled.deviation(analysis.gaussianChainKirkwood(20, 2.0, *SPHERE)) < MOST
    assert sampled.error < 0.01 * sampled.value


# ---------------------------------------------------------------- periodic fluids

def testPublishedLatticeConstants():
    """Hasimoto's simple cubic array, and the two others in terms of their volume fraction."""
    assert analysis.latticeConstant(3.0) == pytest.approx(2.8372974794806, abs=1e-13)
    per = (4 * math.pi / 3)**(1 / 3)
    assert analysis.latticeConstant(truncatedOctahedron(7.0)) / per == pytest.approx(1.7918585114, abs=1e-10)
    assert analysis.latticeConstant(rhombicDodecahedron(0.2)) / per == pytest.approx(1.7917472304, abs=1e-10)
    assert analysis.latticeConstant([1, 2, 3]) == analysis.latticeConstant(np.diag([1, 2, 3.0]) * unit.nanometer)


BOXES = {"cube": cube(8.0), "1:1:8": elongated(4.0), "flat": np.diag([9.0, 9.0, 4.0]), "tilted": tilted(8.0),
         "skew": np.array([[9.0, 0, 0], [2.5, 7.0, 0], [-4.0, 1.5, 6.0]])}


@pytest.mark.onePlatform
@pytest.mark.parametrize("shape", BOXES)
def testASphereInAPeriodicFluid(platformName, shape):
    """The library's mobility of one sphere and the finite-size correction make the one in infinite solvent, exactly."""
    box, radius, temperature = BOXES[shape], 0.6, 300.0
    context, _ = makeContext(Scene(np.array([[0.3, 0.2, 0.1]]), box, radius), platformName, temperature, tolerance=1e-8)
    kT = analysis.thermalEnergy(temperature)
    corrected = analysis.shortTimeDiffusion(context) + analysis.finiteSizeCorrection(box, ETA, kT, radius)
    assert corrected == pytest.approx(kT * analysis.stokesMobility(radius, ETA), rel=3e-8)


@pytest.mark.onePlatform
@pytest.mark.parametrize("shape", ["cube", "flat"])
def testAMoleculeInAPeriodicFluid(platformName, shape):
    """The term with the radius of gyration is exact in the mean over all directions."""
    box, radius, half, total = BOXES[shape], 0.2, 0.35, 0.0
    kT = analysis.thermalEnergy(300.0)
    context, _ = makeContext(Scene(np.eye(2, 3), box, radius), platformName, 300.0, tolerance=1e-8)
    for direction in itertools.product((-1, 0, 1), repeat=3):
        if direction > (0, 0, 0):  # of opposite ones, one
            # Quadrature with these weights is exact for polynomials of degree seven.
            weight = 2 * {1: 1 / 21, 2: 4 / 105, 3: 9 / 280}[int(np.abs(direction).sum())]
            pair = np.outer([half, -half], direction) / np.linalg.norm(direction)
            context.setPositions(pair)
            total += weight * analysis.shortTimeDiffusion(context)
    correction = analysis.finiteSizeCorrection(box, ETA, kT, radius, half)
    assert total + correction == pytest.approx(analysis.kirkwood(pair, radius, ETA, kT), rel=1e-6)
    assert correction < 0.9999 * analysis.finiteSizeCorrection(box, ETA, kT, radius)


@pytest.mark.onePlatform
def testKirkwoodOfAMixtureByTheLibrary(platformName):
    """Of some of its spheres, in an unbounded fluid: the double sum over those alone, whatever the others are."""
    from openmmpse import PSEBrownianIntegrator
    s = mixture(np.random.default_rng(1).uniform(0.2, 0.9, 12), 0.3, cube(1), 8)
    context, _ = makeContext(s, platformName, 300.0, tolerance=1e-8, boundary=PSEBrownianIntegrator.Unbounded)
    some, kT = [0, 3, 4, 9, 11], analysis.thermalEnergy(300.0)
    for chosen in (some, None):
        index = slice(None) if chosen is None else chosen
        exact = analysis.kirkwood(s.positions[index], s.radii[index], ETA, kT)
        assert analysis.shortTimeDiffusion(context, chosen) == pytest.approx(exact, rel=1e-7)


# ---------------------------------------------------------------- trajectories

def walk(box, frames, particles, step, seed):
    """Unwrapped positions, with steps of all lengths up to one given, beginning near a corner."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(frames, particles, 3))
    steps *= step * rng.random((frames, particles, 1))**(1 / 3) / np.linalg.norm(steps, axis=-1, keepdims=True)
    return np.cumsum(steps, axis=0)


@pytest.mark.parametrize("shape", BOXES)
def testUnwrappingIsExactBelowHalfABox(shape):
    """In reduced boxes however tilted: the last of frames wrapped at random, each particle to any image."""
    box = BOXES[shape]
    shortest = trajectory.shortestVectors(box[None])[0]
    labels = np.array(list(itertools.product(range(-2, 3), repeat=3)))
    assert shortest == pytest.approx(np.linalg.norm(labels[np.any(labels, axis=1)] @ box, axis=1).min())
    x = walk(box, 60, 20, 0.399 * shortest, 7)
    images = np.random.default_rng(8).integers(-2, 3, (60, 20, 3))
    images[0] = 0
    assert np.allclose(analysis.unwrap(x + images @ box, box), x, rtol=0, atol=1e-10)
    assert not np.allclose(x[-1], (x + images @ box)[-1])


def testNearestImagesAreThoseOfAllImages():
    rng, box = np.random.default_rng(6), BOXES["tilted"]
    vectors = rng.uniform(-20, 20, (1, 400, 3))
    labels = np.array(list(itertools.product(range(-6, 7), repeat=3)))
    shortest = np.linalg.norm(vectors[0][:, None] + labels @ box, axis=-1).min(axis=1)
    found = trajectory.nearestImages(vectors, box[None])[0]
    assert np.linalg.norm(found, axis=-1) == pytest.approx(shortest, rel=1e-12)


def testFramesTooFarApartAreRefused():
    box = BOXES["tilted"]
    x = walk(box, 60, 20, 0.45 * trajectory.shortestVectors(box[None])[0], 7)
    with pytest.raises(ValueError, match="two fifths.*enforcePeriodicBox=False"):
        analysis.unwrap(x, box)


def testABoxThatBreathesAddsNothingToDiffusion():
    """Steps are added up, each in its own box: a particle far from home does not jump by what its box grows."""
    edges = 5.0 * np.random.default_rng(4).uniform(0.995, 1.005, (500, 1, 1))
    x = walk(cube(5.0), 500, 10, 0.5, 3) + 200.0
    places, boxes = x / 5.0, np.eye(3) * edges
    exact = displacements.meanSquares(x, [1])
    assert displacements.meanSquares(analysis.unwrap(places % 1 * edges, boxes), [1]) == pytest.approx(exact, rel=0.01)
    assert displacements.meanSquares(places * edges, [1]) > 10 * exact  # lattice vectors added to positions


def fakeTraj(x, box, times):
    return SimpleNamespace(xyz=np.float32(x), time=times, unitcell_vectors=np.tile(np.float32(box), (len(x), 1, 1)))


def fakeUniverse(x, box, times):
    atoms = SimpleNamespace()

    class Frames:
        def __iter__(self):
            for positions, time in zip(x, times, strict=True):
                atoms.positions = np.float32(10 * positions)
                yield SimpleNamespace(time=time, triclinic_dimensions=np.float32(10 * box))
    return SimpleNamespace(atoms=atoms, trajectory=Frames())


def testReading():
    box, times = BOXES["skew"], 0.5 * np.arange(40)
    x = walk(box, 40, 5, 1.0, 1)
    wrapped = x - np.floor(x @ np.linalg.inv(box)) @ box
    universe = fakeUniverse(wrapped, box, times)
    universe.atoms.universe = universe
    for source in (fakeTraj(wrapped, box, times), universe, universe.atoms):
        found = analysis.readTrajectory(source)
        assert np.allclose(found.positions - found.positions[0], x - x[0], atol=1e-4)
        assert found.interval == pytest.approx(0.5)
        assert np.allclose(found.boxes, box, atol=1e-6)
        assert np.allclose(analysis.readTrajectory(source, unwrapped=False).positions, wrapped, atol=1e-5)
    plain = analysis.readTrajectory(x)
    assert np.array_equal(plain.positions, x)
    with pytest.raises(ValueError, match="no times"):
        plain.interval
    with pytest.raises(ValueError, match="not evenly spaced"):
        analysis.Trajectory(x, times**2, None).interval
    with pytest.raises(ValueError, match=r"\(frames, N, 3\)"):
        analysis.readTrajectory(x[0])


@pytest.mark.onePlatform
@pytest.mark.parametrize("reader", ["mdtraj", "MDAnalysis"])
@pytest.mark.parametrize("suffix, wrapped", [("dcd", True), ("xtc", True), ("dcd", False)])
def testFilesOfOpenMM(platformName, tmp_path, reader, suffix, wrapped):
    """What OpenMM's reporters write in a tilted box, read by the two libraries: the same paths as those of the run."""
    library = pytest.importorskip(reader)
    topology, residues = app.Topology(), []
    chain = topology.addChain()
    for _ in range(6):
        residues.append(topology.addAtom("C", app.element.carbon, topology.addResidue("BEA", chain)))
    box = BOXES["tilted"] / 2
    scene = Scene(np.random.default_rng(1).random((6, 3)) @ box, box, 0.3)
    context, integrator = makeContext(scene, platformName, 300.0, 20.0)
    topology.setPeriodicBoxVectors(box * unit.nanometer)
    simulation = app.Simulation(topology, context.getSystem(), openmm.XmlSerializer.clone(integrator),
                                context.getPlatform())
    simulation.context.setPositions(scene.positions)
    file, paths = tmp_path / f"run.{suffix}", []
    app.PDBFile.writeFile(topology, scene.positions * 10, open(tmp_path / "run.pdb", "w"))
    kind = app.DCDReporter if suffix == "dcd" else app.XTCReporter
    simulation.reporters.append(kind(str(file), 5, enforcePeriodicBox=wrapped))
    for _ in range(40):
        simulation.step(5)
        paths.append(simulation.context.getState(positions=True).getPositions(asNumpy=True)._value)
    simulation.reporters.clear()
    if reader == "mdtraj":
        source = library.load(str(file), top=str(tmp_path / "run.pdb"))
    else:
        source = library.Universe(str(tmp_path / "run.pdb"), str(file))
    found, paths = analysis.readTrajectory(source), np.array(paths)
    assert np.abs(paths[-1] - paths[0]).max() > 4.0  # images change
    assert np.allclose(found.positions - found.positions[0], paths - paths[0], atol=4e-3 if suffix == "xtc" else 1e-4)
    assert np.allclose(found.boxes[0], box, atol=1e-4)
    if (reader, suffix) != ("mdtraj", "dcd"):  # which gives numbers of frames
        assert found.interval == pytest.approx(100.0, rel=1e-3)


# ---------------------------------------------------------------- stress

def dumbbellStresses(rng, samples, count, k, h):
    """Stress sums V s (samples, 3, 3) of Hookean dumbbells without hydrodynamics, kT = zeta = 1, by steps of h."""
    decay, variance = 1 - 2 * k * h, 1 / k / (1 - k * h)
    Q = rng.normal(size=(count, 3)) * math.sqrt(variance)
    out = np.empty((samples, 3, 3))
    for n in range(samples):
        out[n] = k * Q.T @ Q
        Q = decay * Q + math.sqrt(4 * h) * rng.normal(size=Q.shape)
    return out, decay, variance


def testGreenKuboOfDumbbells():
    """G(t) = n kT exp(-t/lambda) in the form that finite steps have, its integral, and their error bars."""
    rng, volume, k, h, samples, deviations = np.random.default_rng(15), 40.0, 0.8, 0.1, 1000, []
    lags = np.array([1, 3, 10, 25])
    for _ in range(60):
        sums, decay, variance = dumbbellStresses(rng, samples, 6, k, h)
        found = analysis.greenKubo(sums / volume, h, volume**(1 / 3), 1.0, 25 * h, blocks=20)
        G = 6 / volume * (k * variance)**2 * decay**(2.0 * np.arange(26))
        eta = h * (np.cumsum(G) - (G + G[0]) / 2)
        deviations += [((found.modulus.values - G) / found.modulus.errors)[lags],
                       ((found.viscosity.values[1:] - eta[1:]) / found.viscosity.errors[1:])[lags - 1]]
    t = np.array(deviations)
    # Blocks are 16 relaxation times, of squares of normal numbers: error bars are low by a few per cent for their skew.
    assert np.all(np.abs(t) < 8.5)
    for quantity in (t[0::2], t[1::2]):
        assert np.all(np.abs(quantity.mean(axis=0)) < MOST * math.sqrt(19 / 17 / 60) + 0.3)
        assert np.all(np.abs(np.square(quantity).mean(axis=0) - 19 / 17) < 1.2)


def testOneShearAndFive():
    """All five shears give the xy modulus of an isotropic fluid, with a smaller error; a rotation changes nothing."""
    rng, samples = np.random.default_rng(5), 4000
    stresses = dumbbellStresses(rng, samples, 5, 0.8, 0.1)[0]
    five, one = (analysis.greenKubo(stresses, 0.1, 1.0, 1.0, 1.0, isotropic=flag).modulus for flag in (True, False))
    assert abs(five.values[0] - one.values[0]) < 6 * one.errors[0]
    assert five.errors[0] < 0.75 * one.errors[0]
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turned = analysis.greenKubo(turn @ stresses @ turn.T, 0.1, 1.0, 1.0, 1.0).modulus
    assert turned.values == pytest.approx(five.values, rel=1e-9)
    quantities = [unit.Quantity(s, unit.kilojoule_per_mole / unit.nanometer**3) for s in stresses]
    assert np.array_equal(analysis.greenKubo(quantities, 0.1, 1.0, 1.0, 1.0).modulus.values, five.values)
    with pytest.raises(ValueError, match=r"\(samples, 3, 3\)"):
        analysis.greenKubo(stresses[:, 0], 0.1, 1.0, 1.0, 1.0)
    with pytest.raises(ValueError, match="less than the interval"):
        analysis.greenKubo(stresses, 0.1, 1.0, 1.0, 0.01)


@pytest.mark.onePlatform
def testGreenKuboOfRouseChainsByTheLibrary(platformName):
    """computeStress() of free-draining chains of three beads: sign, units and volume; exact at these steps."""
    from openmmpse import PSEBrownianIntegrator
    count, radius, spread, edge = 12, 0.3, 0.4, 8.0
    kT = analysis.thermalEnergy(300.0)
    k, mobility = kT / spread**2, analysis.stokesMobility(radius, ETA)
    dt = 0.1 / (k * mobility)
    rng = np.random.default_rng(3)
    x = np.cumsum(rng.normal(size=(count, 3, 3)) * spread, axis=1).reshape(-1, 3)
    bonds = [(3 * c + i, 3 * c + i + 1) for c in range(count) for i in range(2)]
    springs = scenes.harmonicBonds(bonds, 0.0, k)
    springs.setUsesPeriodicBoundaryConditions(True)  # without anything periodic there is no volume
    context, integrator = makeContext(
        Scene(x, cube(edge), radius), platformName, 300.0, dt, forces=[springs],
        configure=lambda i: i.setMobilityModel(PSEBrownianIntegrator.FreeDraining))
    stresses = []
    for _ in range(1200):
        integrator.step(2)
        stresses.append(integrator.computeStress())
    found = analysis.greenKubo(stresses, 2 * dt, edge, kT, 20 * dt)
    G = np.zeros(11)
    for eigenvalue in (1, 3):
        rate = k * eigenvalue * mobility * dt
        G += count * kT / edge**3 / (1 - rate / 2)**2 * (1 - rate)**(4.0 * np.arange(11))
    limit = stats.t.isf(FALSE_ALARM / 4, 9)
    assert np.abs((found.modulus.values - G) / found.modulus.errors)[[0, 5]].max() < limit
    eta = 2 * dt * (np.cumsum(G) - (G + G[0]) / 2)
    assert abs(found.viscosity.values[-1] - eta[-1]) < limit * found.viscosity.errors[-1]
    assert found.viscosity.errors[-1] < 0.15 * eta[-1]


# ---------------------------------------------------------------- the page

def testThePageRuns(tmp_path, monkeypatch, capsys):
    """The script of docs/analysis.md, a quarter as long: what it prints, and its picture."""
    monkeypatch.chdir(tmp_path)
    script = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)[1]
    assert "STEPS, INTERVAL, STEP = 40_000," in script
    found = {}
    exec(compile(script.replace("40_000", "10_000"), str(PAGE), "exec"), found)
    assert capsys.readouterr().out.startswith("trend Estimate(")
    assert (tmp_path / "analysis.png").stat().st_size > 10_000
    limit = stats.t.isf(FALSE_ALARM / 2, found["fit"].degrees)
    assert found["fit"].coefficient.shifted(found["correction"]).deviation(found["kirkwood"].value) < limit
