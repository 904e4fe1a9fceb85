# SPDX-License-Identifier: MIT
"""
The thermal displacements: covariance 2 kT dt M, normal, independent of each other, reproducible.

All statistical thresholds follow from scenes.FALSE_ALARM; seeds are fixed, so a test that passes
once always passes. Samples are whitened with the Cholesky factor of the expected covariance, after
which they must be independent unit normals (see scenes.assertUnitCovariance for the statistics).
Power: with n samples of d numbers, all variances too large by a factor 1 + e show at e sqrt(n d/2)
standard deviations, one correlation c between two of them at c sqrt(n).
"""
import itertools

import numpy as np
import pytest
from scipy import stats

from openmmpse import PSEBrownianIntegrator
from platformnames import coordinateRounding, served
import scenes
from scenes import (FALSE_ALARM, KB, assertUnitCovariance, assertZeroMean, forcesOf, makeContext,
                    mobilityColumns, positionsOf, randomForces, whiten, zScore)

T = 300.0
DT = 2.0
VARIANCE = 2*KB*T*DT
SPLITS = {"automatic": PSEBrownianIntegrator.AutomaticSplit,
          "Prolate": PSEBrownianIntegrator.Prolate, "Hasimoto": PSEBrownianIntegrator.Hasimoto}


def flat(samples):
    return samples.reshape(len(samples), samples.shape[1]*3)


def samplesOf(integrator, count):
    return flat(integrator.sampleBrownianDisplacements(count))


def assertNoCrossCovariance(y, z, label):
    """
    y (n,d) and z (n,e) of unit normals, independent of each other: n sum_ij (y^T z/n)_ij^2 is
    chi-square with d e degrees up to O(1/n). One common number among them shows at sqrt(n) sigma.
    """
    n = len(y)
    C = y.T @ z/n
    score = zScore(n*np.sum(C*C), C.size)
    limit = stats.norm.isf(FALSE_ALARM)
    assert score < limit, f"{label}: {score:.1f} sigma, largest entry {abs(C).max():.4f}"


def stepDisplacements(context, integrator, positions, count):
    """Displacements (count,3N) of single steps that all start at the same positions."""
    out = np.empty((count, positions.size))
    for row in out:
        context.setPositions(positions)
        integrator.step(1)
        row[:] = (positionsOf(context) - positions).ravel()
    return out


def suspension(seed=101, N=8, box=scenes.tilted(1)):
    return scenes.randomSuspension(N, 0.15, box, 0.5, seed)


# ---------------------------------------------------------------- covariance

@pytest.mark.hostOnly
@pytest.mark.parametrize("name, xi, split", [
    ("touching", 0, "automatic"), ("overlapping", 0.8, "Hasimoto"), ("overlapping", 2.0, "Hasimoto"),
    ("suspension", 0, "automatic"), ("suspension", 0.7, "Hasimoto"), ("suspension", 1.6, "Hasimoto"),
    ("elongated", 0, "automatic"), ("idealGas", 0, "automatic"),
    ("suspension", 0, "Prolate"), ("overlapping", 0, "Prolate"), ("idealGas", 0, "Prolate")])
def testCovarianceIsThatOfTheMobility(platformName, name, xi, split):
    """
    n = 5000, d = 6 to 24: variances wrong by 4 % (6 particles: 2.2 %) are found, and correlations
    of 0.1. A correlation between the two halves would add to the covariance, by up to the geometric
    mean of the two halves' variances and differently for each xi, so several xi exclude it, too.
    """
    checkCovariance(platformName, name, xi, split)


@pytest.mark.deviceOnly
@pytest.mark.onePrecision
@pytest.mark.parametrize("name", ["touching", "suspension"])
def testCovarianceOnDevices(platformName, name):
    """The same, though it follows from having the noise of the CPU."""
    checkCovariance(platformName, name, 0, "automatic")


def checkCovariance(platformName, name, xi, split):
    s = {"touching": lambda: scenes.pair(1.0, 4.0, 0.5),
         "overlapping": lambda: scenes.pair(0.25, 4.0, 0.5),
         "suspension": suspension,
         "elongated": lambda: suspension(102, 8, scenes.elongated(1)),
         "idealGas": lambda: scenes.idealGas(6, 0.1, scenes.cube(1), 0.5, 103)}[name]()

    def configure(i):
        i.setSplittingParameter(xi)
        i.setSplit(SPLITS[split])
    # Boxes of a few radii have room for the prolate split at loose tolerances only; 1e-2 in M is
    # far below what 5000 samples resolve.
    context, integrator = makeContext(s, platformName, T, DT, 1e-2 if split == "Prolate" else 1e-4,
                                      configure=configure)
    y = whiten(samplesOf(integrator, 5000), VARIANCE*s.mobility)
    assertUnitCovariance(y, f"{name}, xi = {xi}, {split}")
    assertZeroMean(y, name)


@pytest.mark.hostOnly
@pytest.mark.parametrize("shape, grid", [("cube", (6, 6, 6)), ("cube", (7, 7, 7)),
                                         ("cube", (6, 5, 8)), ("tilted", (6, 6, 6)),
                                         ("tilted", (5, 6, 7))])
def testNyquistAndConjugatePlanes(platformName, shape, grid):
    """
    A grid so small and a wave half so sharp that every mode counts, odd and even, and the mobility
    that the library itself applies on it. n = 6e4, d = 6 resolves 0.24 % of the sum of variances.
    The Nyquist planes hold 2 % to 6 % of it, should they enter one part and not the other; the
    modes of the plane n_z = 0, which a half spectrum stores with their conjugates, hold 20 %.
    """
    box = {"cube": scenes.cube, "tilted": scenes.tilted}[shape](3.0)
    s = scenes.Scene(np.array([[0.2, 0.5, 0.7], [1.1, 0.9, 1.9]]), box, 0.25)

    def configure(i):
        i.setSplittingParameter(7.0)
        i.setGridDimensions(*grid)
        i.setWindowSupport(4)
    context, integrator = makeContext(s, platformName, T, DT, 1e-5, configure=configure)
    assert tuple(integrator.getNumericalParameters()["gridDimensions"]) == grid
    M = mobilityColumns(integrator, 2)
    y = whiten(samplesOf(integrator, 60000), VARIANCE*M)
    assertUnitCovariance(y, f"grid {grid}", tests=5)


@pytest.mark.hostOnly
@pytest.mark.parametrize("split", ["Prolate", "Hasimoto"])
def testRealAndWaveHalfAreIndependent(platformName, split):
    """
    The halves taken apart through the public API: with odd numbers of modes, the average over all
    translations of the scene by grid points, same seed and so same random numbers, removes every
    wave (the characters of the translation group sum to zero) and leaves the real-space half, which
    does not depend on translations. Canonical correlations between the halves (each whitened with
    its own sample covariance): n times the sum of their squares is chi-square with 36 degrees
    (Pillai's trace). n = 3000: a particle's three numbers reused for one of the 22 modes correlate
    by about 0.2: 11 sigma.
    """
    n, grid = 3000, (3, 5, 3)
    s = scenes.Scene(np.array([[0.2, 0.5, 0.7], [1.1, 0.9, 1.9]]), scenes.cube(3.0), 0.5)

    def configure(i):
        i.setNumericalParameters({
            "split": split, "gridDimensions": grid, "windowSupport": 3,
            **({"xi": 1.4} if split == "Hasimoto" else {"xi": 0.7, "prolateBandwidth": 5.0})})
    real = 0
    for shift in itertools.product(*(range(g) for g in grid)):
        moved = s.moved((np.array(shift)/grid) @ s.box)
        context, integrator = makeContext(moved, platformName, T, DT, 1e-5, configure=configure)
        x = samplesOf(integrator, n)
        if shift == (0, 0, 0):
            total, M = x, mobilityColumns(integrator, 2)
        real = real + x/np.prod(grid)
    wave = total - real
    share = np.sum(real**2)/np.sum(total**2)
    assert 0.1 < share < 0.9, f"the real half has {share:.3f} of the variance: no test"
    halves = [whiten(x, x.T @ x/n) for x in (real, wave)]
    assertNoCrossCovariance(*halves, "between the halves")
    assertUnitCovariance(whiten(total, VARIANCE*M), "sum of the halves")


@pytest.mark.onePrecision
def testFreeDrainingCovariance(platformName):
    s = suspension(104, 10)
    context, integrator = makeContext(
        s, platformName, T, DT,
        configure=lambda i: i.setMobilityModel(PSEBrownianIntegrator.FreeDraining))
    y = samplesOf(integrator, 20000)/np.sqrt(VARIANCE*s.mu0)
    assertUnitCovariance(y, "free draining")
    assertZeroMean(y, "free draining")


@pytest.mark.onePrecision
def testNormality(platformName):
    """
    Kolmogorov-Smirnov for each whitened number, and the pooled excess kurtosis, whose standard
    deviation is sqrt(24/(n d)) = 0.016: sums of uniform numbers (three give -0.4) would be found.
    """
    s = suspension(105, 4, scenes.cube(1))
    context, integrator = makeContext(s, platformName, T, DT, 1e-4)
    y = whiten(samplesOf(integrator, 8000), VARIANCE*s.mobility)
    for i, column in enumerate(y.T):
        p = stats.kstest(column, "norm").pvalue
        assert p > FALSE_ALARM/y.shape[1], f"number {i} is not normal: p = {p:.1e}"
    excess = np.mean(y**4) - 3
    # var(y^4) = 96 for a unit normal.
    assert abs(excess) < stats.norm.isf(FALSE_ALARM/2)*np.sqrt(96/y.size)


@pytest.mark.onePrecision
# ---------------------------------------------------------------- a thermal step

def testCovarianceAndMeanOfThermalSteps(platformName):
    """
    Steps under constant forces: mean dt M f, covariance 2 kT dt M, none from one step to the next.
    The drift is made as large as the noise; n = 3000 resolves 2 % of it (a lost real-space half of
    M f would be of order 50 %).
    """
    s = suspension(106, 6)
    forces = randomForces(s)*np.sqrt(VARIANCE/s.mu0)/DT
    context, integrator = makeContext(s, platformName, T, DT, 1e-4,
                                      forces=[scenes.constantForces(forces)])
    steps = stepDisplacements(context, integrator, s.positions, 3000)
    y = whiten(steps - DT*s.velocities(forces).ravel(), VARIANCE*s.mobility)
    assertZeroMean(y, "mean of a thermal step")
    assertUnitCovariance(y, "thermal steps", tests=2)
    assertNoCrossCovariance(y[1:], y[:-1], "from step to step")


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def testForcesAndNoiseAdd(platformName, tolerance):
    """Same seed, with and without forces: the steps differ by dt M f, to rounding."""
    s = suspension(107, 12)
    forces = randomForces(s)*np.sqrt(VARIANCE/s.mu0)/DT
    tolerance = served(platformName, tolerance)
    ends, drifts = [], []
    for f in (forces, 0*forces):
        context, integrator = makeContext(s, platformName, T, DT, tolerance,
                                          forces=[scenes.constantForces(f)])
        drifts.append(DT*integrator.applyMobility(forcesOf(context)))
        integrator.step(1)
        ends.append(positionsOf(context))
    drift = drifts[0]
    rounding = 1e-11 if integrator.getNumericalParameters()["precision"] == "double" else 3e-6
    limit = rounding*(np.linalg.norm(ends[1] - s.positions) + np.linalg.norm(drift))
    limit += coordinateRounding(platformName)*sum(np.linalg.norm(end) for end in ends)
    assert np.linalg.norm(ends[0] - ends[1] - drift) < limit


def assertSameNoise(first, second, limit, steps=3, samples=20):
    """
    Two Contexts (each with its integrator) move the particles alike, within a limit relative to the
    displacement, in a few steps and in samples. Both start where the first one holds the particles.
    """
    (context, integrator), (other, twin) = first, second
    for step in range(steps):
        start = positionsOf(context)
        other.setPositions(start)
        integrator.step(1)
        twin.step(1)
        moved = np.linalg.norm(positionsOf(context) - start)
        ratio = np.linalg.norm(positionsOf(context) - positionsOf(other))/moved
        assert ratio <= limit, f"step {step}: {ratio:.2e} of the displacement"
    other.setPositions(positionsOf(context))
    x, y = samplesOf(integrator, samples), samplesOf(twin, samples)
    ratio = np.max(np.linalg.norm(x - y, axis=1)/np.linalg.norm(y, axis=1))
    assert ratio <= limit, f"samples: {ratio:.2e} of the displacement"


@pytest.mark.withGrid
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def testReferenceTakesTheSameThermalStep(platformName, tolerance):
    """Same seed and Plan: equal to sqrt(tolerance) of the displacement (one has no window)."""
    tolerance = served(platformName, tolerance)
    s = suspension(108, 25)
    gridded = makeContext(s, platformName, T, DT, tolerance, seed=9)
    parameters = gridded[1].getNumericalParameters()
    direct = makeContext(s, "Reference", T, DT, tolerance, seed=9,
                         configure=lambda i: i.setNumericalParameters(parameters))
    assertSameNoise(gridded, direct, np.sqrt(tolerance))


@pytest.mark.deviceOnly
@pytest.mark.parametrize("box, grid, split, tolerance", [
    ("tilted", None, "Prolate", 1e-3), ("tilted", None, "Hasimoto", 1e-5),
    ("cube", None, "Hasimoto", 1e-8), ("elongated", None, "automatic", 1e-4),
    ("cube", (10, 10, 10), "Hasimoto", 1e-3), ("cube", (11, 11, 11), "Hasimoto", 1e-3),
    ("tilted", (10, 9, 12), "Hasimoto", 1e-3), ("tilted", (9, 10, 11), "Hasimoto", 1e-3)])
def testDevicesHaveTheNoiseOfTheCpu(platformName, box, grid, split, tolerance):
    """
    Same seed and Plan, all particles massive but two: equal to the tolerance, mode by mode and
    particle by particle. What is shown of the CPU's noise (its covariance, its independence, its
    Nyquist and conjugate planes) is shown of theirs by this. Prescribed grids are odd, even and
    unequal, and coarse enough for every mode to matter.
    """
    tolerance = served(platformName, tolerance)
    shapes = {"cube": scenes.cube, "tilted": scenes.tilted, "elongated": scenes.elongated}
    s = suspension(108, 25, shapes[box](1))
    masses = [0.0 if i in (4, 17) else 1.0 for i in range(s.count)]

    def configure(i):
        i.setSplit(SPLITS[split])
        if grid:
            i.setSplittingParameter(3.5)
            i.setGridDimensions(*grid)
            i.setWindowSupport(4)
    host = makeContext(s, "CPU", T, DT, tolerance, seed=9, masses=masses, configure=configure)
    parameters = host[1].getNumericalParameters()
    device = makeContext(s, platformName, T, DT, tolerance, seed=9, masses=masses,
                         configure=lambda i: i.setNumericalParameters(parameters))
    assertSameNoise(device, host, tolerance)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def testThreadsDoNotChangeABit(tolerance):
    s = scenes.idealGas(1200, 0.05, scenes.tilted(1), 0.5, 109)
    bonds = [(i, i + 1) for i in range(s.count - 1)]
    results = []
    for threads in (1, 2):
        context, integrator = makeContext(s, "CPU", T, DT, tolerance, threads=threads,
                                          forces=[scenes.harmonicBonds(bonds, 1.0, 10.0)])
        samples = samplesOf(integrator, 3)
        integrator.step(6)
        results.append((samples, positionsOf(context)))
    assert np.array_equal(results[0][0], results[1][0])
    assert np.array_equal(results[0][1], results[1][1])


@pytest.mark.onePrecision
# ---------------------------------------------------------------- streams, seeds and counters

def testStreamsAreIndependent(platformName):
    """
    Steps, samples, another seed, and (seed + 1, step) against (seed, step + 1), which published
    codes confuse: no covariance. n = 3000; equal streams would show at 55 sigma.
    """
    s = suspension(110, 4, scenes.cube(1))
    covariance = VARIANCE*s.mobility
    n = 3000
    series = {}
    for seed in (41, 42):
        context, integrator = makeContext(s, platformName, T, DT, 1e-4, seed=seed)
        series[seed, "samples"] = whiten(samplesOf(integrator, n), covariance)
        steps = stepDisplacements(context, integrator, s.positions, n)
        series[seed, "steps"] = whiten(steps, covariance)
    for first, second in itertools.combinations(series, 2):
        for lag in (0, 1):
            for x, y in ((first, second), (second, first)):
                assertNoCrossCovariance(series[x][lag:], series[y][:n - lag], f"{x}, {y}, {lag}")


@pytest.mark.onePrecision
def testSameSeedSameNoise(platformName):
    s = suspension(111)
    runs = []
    for seed in (7, 7, 8):
        context, integrator = makeContext(s, platformName, T, DT, seed=seed)
        samples = samplesOf(integrator, 4)
        integrator.step(3)
        runs.append((samples, positionsOf(context)))
    assert np.array_equal(runs[0][0], runs[1][0]) and np.array_equal(runs[0][1], runs[1][1])
    assert not np.any(runs[0][0] == runs[2][0]) and not np.any(runs[0][1] == runs[2][1])


@pytest.mark.onePrecision
def testDrawnSeed(platformName):
    """Seed 0: a new one for each Context, which can be read back and reproduces the run."""
    s = suspension(112)
    context, integrator = makeContext(s, platformName, T, DT, seed=0)
    drawn = integrator.getNumericalParameters()["randomSeed"]
    samples = samplesOf(integrator, 2)
    other, second = makeContext(s, platformName, T, DT, seed=0)
    assert drawn != 0 and second.getNumericalParameters()["randomSeed"] not in (0, drawn)
    assert not np.any(samplesOf(second, 2) == samples)
    again, third = makeContext(s, platformName, T, DT, seed=drawn)
    assert np.array_equal(samplesOf(third, 2), samples)


@pytest.mark.onePrecision
def testRepeatedSamplesDiffer(platformName):
    """Every draw is new; how many are drawn at once does not matter (to the root's accuracy)."""
    s = suspension(113)
    context, integrator = makeContext(s, platformName, T, DT, 1e-4)
    pieces = np.concatenate([samplesOf(integrator, count) for count in (1, 3, 0, 2)])
    assert pieces.shape == (6, 3*s.count)
    for x, y in itertools.combinations(pieces, 2):
        assert not np.any(x == y)
    other, fresh = makeContext(s, platformName, T, DT, 1e-4)
    atOnce = fresh.sampleBrownianDisplacements(6)
    assert atOnce.shape == (6, s.count, 3) and atOnce.dtype == np.float64
    assert np.linalg.norm(flat(atOnce) - pieces) < 1e-3*np.linalg.norm(pieces)


@pytest.mark.onePrecision
def testSamplingLeavesTheTrajectoryAlone(platformName):
    s = suspension(114)
    bonds = [(i, i + 1) for i in range(s.count - 1)]
    trajectories = []
    for disturb in (False, True):
        context, integrator = makeContext(s, platformName, T, DT,
                                          forces=[scenes.harmonicBonds(bonds, 1.0, 10.0)])
        trajectory = []
        for step in range(6):
            if disturb:
                before = positionsOf(context)
                integrator.sampleBrownianDisplacements(1 + step)
                integrator.applyMobility(randomForces(s))
                assert np.array_equal(positionsOf(context), before)
                assert context.getStepCount() == step
            integrator.step(1)
            trajectory.append(positionsOf(context))
        trajectories.append(trajectory)
    assert np.array_equal(*trajectories)


@pytest.mark.onePrecision
# ---------------------------------------------------------------- temperature and step size

def testNoNoiseAtZeroTemperature(platformName):
    s = suspension(115)
    context, integrator = makeContext(s, platformName, 0.0, DT)
    assert not np.any(samplesOf(integrator, 3))
    start = positionsOf(context)
    integrator.step(5)
    assert np.array_equal(positionsOf(context), start)


@pytest.mark.onePrecision
@pytest.mark.parametrize("start", [0.0, 300.0])
def testTemperatureAndStepSizeActAtTheNextStep(platformName, start):
    """Noise scales with sqrt(T dt), also when the Context was made at zero temperature."""
    s = suspension(116)
    context, integrator = makeContext(s, platformName, 300.0, DT)
    integrator.step(1)
    expected = positionsOf(context) - s.positions
    # The automatic ones depend on whether there is noise when the Context is made.
    parameters = integrator.getNumericalParameters()
    for temperature, dt in ((1200.0, DT), (300.0, 4*DT), (75.0, 4*DT)):
        context, integrator = makeContext(s, platformName, start, DT,
                                          configure=lambda i: i.setNumericalParameters(parameters))
        integrator.setTemperature(temperature)
        integrator.setStepSize(dt)
        integrator.step(1)
        moved = positionsOf(context) - s.positions
        factor = np.sqrt(temperature*dt/(300.0*DT))
        assert np.linalg.norm(moved - factor*expected) < 1e-4*np.linalg.norm(moved)
        assert integrator.sampleBrownianDisplacements(1).any()
    integrator.setTemperature(0.0)
    before = positionsOf(context)
    integrator.step(1)
    assert np.array_equal(positionsOf(context), before)
    assert not np.any(integrator.sampleBrownianDisplacements(2))


@pytest.mark.onePrecision
def testMasslessParticlesGetNoNoise(platformName):
    """And the others get that of a fluid without them."""
    s = suspension(117)
    mobile = [i for i in range(s.count) if i not in (0, 3)]
    masses = [1.0 if i in mobile else 0.0 for i in range(s.count)]
    context, integrator = makeContext(s, platformName, T, DT, 1e-4, masses=masses)
    x = integrator.sampleBrownianDisplacements(4000)
    assert not np.any(np.delete(x, mobile, axis=1))
    others = scenes.Scene(s.positions[mobile], s.box, s.radius)
    assertUnitCovariance(whiten(flat(x[:, mobile]), VARIANCE*others.mobility), "mobile particles")
