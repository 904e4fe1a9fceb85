# SPDX-License-Identifier: MIT
"""
The ForceCoupling mobility in a periodic fluid against plain sums over waves: by waves alone
(AllWaves) and with a real half (Prolate), which must be one mobility with one noise.
"""
import functools

import numpy as np
import openmm
import pytest

from openmmpse import PSEBrownianIntegrator
from oracle import forceCouplingMatrix, mobilityMatrix
from platformnames import isDevice, isDirect, precisionOf, served
import scenes
from scenes import (KB, assertUnitCovariance, assertZeroMean, errorRatio, forceKinds, makeContext,
                    mobilityColumns, positionsOf, randomForces, stored, whiten)
from test_noise import assertSameNoise, samplesOf

pytestmark = pytest.mark.onePrecision
T, DT = 300.0, 2.0
VARIANCE = 2*KB*T*DT
TOLERANCES = {"Reference": [1e-2, 1e-5, 1e-8], "CPU": [1e-2, 1e-3, 1e-5, 1e-8],
              "single": [1e-3], "mixed": [1e-5], "double": [1e-8]}
SPLITS = {"automatic": PSEBrownianIntegrator.AutomaticSplit,
          "Prolate": PSEBrownianIntegrator.Prolate, "AllWaves": PSEBrownianIntegrator.AllWaves}
CUBIC = 2.8372974794806


def forceCoupling(split="automatic", configure=lambda integrator: None):
    def all(integrator):
        integrator.setMobilityModel(PSEBrownianIntegrator.ForceCoupling)
        integrator.setSplit(SPLITS[split])
        configure(integrator)
    return all


def tolerancesOf(platformName):
    return TOLERANCES[precisionOf(platformName, 1) if isDevice(platformName) else platformName]


# name -> function of the number of particles that the platform affords
SCENES = {
    "oneInTinyCube": lambda N: scenes.Scene(np.array([[0.3, 0.7, 0.9]]), scenes.cube(1.1), 0.5),
    "touchingPair": lambda N: scenes.pair(1.4, 9.0, 0.7),
    "coincidentPair": lambda N: scenes.pair(0.0, 7.0, 0.7),
    "sixInTinyCube": lambda N: scenes.idealGas(6, 3.0, scenes.cube(1), 0.5, 30),
    "suspension10": lambda N: scenes.randomSuspension(N, 0.1, scenes.cube(1), 0.5, 32),
    "suspension45": lambda N: scenes.denseSuspension(3 if N > 60 else 2, 0.45, 0.5, 33),
    "idealGasTilted": lambda N: scenes.idealGas(N, 0.2, scenes.tilted(1, -1), 0.5, 34),
    "elongated": lambda N: scenes.randomSuspension(N, 0.1, scenes.elongated(1), 0.5, 38),
}


@functools.lru_cache(maxsize=None)
def scene(name, size):
    return SCENES[name](size)


@functools.lru_cache(maxsize=None)
def mobilityOf(s):
    """The oracle's M (3N,3N), in nm/ps per kJ/(mol nm)."""
    return forceCouplingMatrix(s.positions, s.box, s.radius, scenes.ETA)


def errorOf(integrator, forces, s):
    exact = (mobilityOf(s) @ np.ravel(forces)).reshape(-1, 3)
    return errorRatio(integrator.applyMobility(forces), exact, forces, s)


# ---------------------------------------------------------------- the contract

@pytest.mark.parametrize("split", ["Prolate", "AllWaves"])
@pytest.mark.parametrize("name", SCENES)
def testErrorContract(platformName, name, split):
    """|u - M f| <= tolerance max(|M f|, |f|/(6 pi eta a)) for random, uniform, balanced forces."""
    s = scene(name, 40 if isDirect(platformName) else 120)
    failures, found = [], 0
    for tolerance in tolerancesOf(platformName):
        try:
            context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                              configure=forceCoupling(split))
        except openmm.OpenMMException as refusal:
            # small boxes have no room for a range; waves alone serve every box
            assert split == "Prolate" and "range of at least" in str(refusal)
            assert "AllWaves" in str(refusal)
            continue
        parameters = integrator.getNumericalParameters()
        assert parameters["split"] == split
        assert 0 < parameters["predictedError"] <= tolerance
        here = stored(s, context)
        for kind, forces in forceKinds(s).items():
            ratio = errorOf(integrator, forces, here)/tolerance
            found += 1
            if not ratio <= 1:
                failures.append(f"{kind} forces at {tolerance:g}: error {ratio:.2f} tolerance")
    assert not failures, "; ".join(failures)
    assert found > 0 or "Tiny" in name or name in ("suspension45", "elongated")


@pytest.mark.onePrecision
@pytest.mark.parametrize("split, tolerance", [("Prolate", 1e-2), ("AllWaves", 1e-2),
                                              ("AllWaves", 1e-5)])
def testWorstForceSymmetryAndPositivity(platformName, split, tolerance):
    """Overlapping and coincident particles included: within 3 tolerance of M, symmetric and >= 0."""
    a = 0.5
    s = scenes.idealGas(12, 0.3, scenes.tilted(1), a, 53)
    s.positions[1] = s.positions[0]
    s.positions[3] = s.positions[2] + [0.5*a, 0, 0]
    context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                      configure=forceCoupling(split))
    M = mobilityColumns(integrator, s.count)/s.mu0
    exact = mobilityOf(stored(s, context))/s.mu0
    assert np.linalg.norm(M - exact, 2) <= 3*tolerance
    rounding = 5e-6 if integrator.getNumericalParameters()["precision"] != "double" else 1e-11
    assert np.linalg.norm(M - M.T, 2) < rounding
    eigenvalues = np.linalg.eigvalsh(0.5*(M + M.T))
    assert abs(eigenvalues[:3]).max() < rounding    # the coincident pair: no relative mobility
    assert eigenvalues[3] > 1e-4


@pytest.mark.onePrecision
def testSelfMobilityIsTheExactSeries(platformName):
    """
    1 - 2.837297 a/L + 4 (a/L)^3, 4 being 4 pi times the 1/pi of the Gaussian's k^2: exact but for
    exp(-pi (L/a)^2/4), which is 1e-22 here. In double precision the library is asked for 1e-9.
    """
    a, L = 0.5, 4.0
    s = scenes.Scene(np.array([[0.3, 1.7, 2.9]]), scenes.cube(L), a)
    exact = 1 - CUBIC*a/L + 4*(a/L)**3
    assert abs(forceCouplingMatrix(s.positions, s.box, a) - exact*np.eye(3)).max() < 1e-12
    tolerance = served(platformName, 1e-9)
    for split in ("AllWaves", "Prolate") if tolerance > 1e-6 else ("AllWaves",):
        context, integrator = makeContext(s, platformName, tolerance=tolerance,
                                          configure=forceCoupling(split))
        M = mobilityColumns(integrator, 1)/s.mu0
        assert abs(M - exact*np.eye(3)).max() <= tolerance, split


@pytest.mark.onePrecision
def testFarAwayItIsRotnePragerYamakawa(platformName):
    """
    Two spheres eight radii apart: the pair mobilities differ by 3/4 (2/3 - 2/pi) (a/r)^3 across
    and -2 times that along, relative to mu0, and through the images by their cubic terms.
    """
    a, r, L = 0.5, 4.0, 24.0
    s = scenes.pair(r, L, a)
    context, integrator = makeContext(s, platformName, tolerance=served(platformName, 1e-6),
                                      configure=forceCoupling())
    M = mobilityColumns(integrator, 2)/s.mu0
    difference = (M - mobilityMatrix(s.positions, s.box, a))[:3, 3:]
    d = s.positions[1] - s.positions[0]
    n = d/np.linalg.norm(d)
    gap = 0.75*(2/3 - 2/np.pi)
    expected = -gap*((a/r)**3*(np.eye(3) - 3*np.outer(n, n)) + 8*np.pi/3*(a/L)**3*np.eye(3))
    assert abs(difference - expected).max() < 3e-6 + 0.05*gap*(a/r)**3


# ---------------------------------------------------------------- parameters

def testParametersAndWords(platformName):
    """AllWaves has neither range nor xi; both kinds are reproduced by their dict, to the bit."""
    s = scenes.randomSuspension(30, 0.1, scenes.tilted(1), 0.5, 57)
    forces = randomForces(s)
    for split in ("AllWaves", "Prolate"):
        context, integrator = makeContext(s, platformName, tolerance=1e-3, seed=17,
                                          configure=forceCoupling(split))
        parameters = integrator.getNumericalParameters()
        assert parameters["split"] == split
        alone = split == "AllWaves"
        for key in ("xi", "realCutoff", "prolateBandwidth", "lanczosTolerance"):
            assert (parameters[key] == 0) == alone, key
        text = integrator.describe()
        assert "force coupling by Gaussian envelopes" in text
        assert ("split: none, all by waves (AllWaves)" in text) == alone
        assert ("real-space cutoff" in text) == ("Lanczos" in text) == (not alone)
        other, copy = makeContext(
            s, platformName, tolerance=1e-3, seed=0,
            configure=forceCoupling("automatic", lambda i: i.setNumericalParameters(parameters)))
        assert copy.getNumericalParameters() == parameters
        assert np.array_equal(copy.applyMobility(forces), integrator.applyMobility(forces))


@pytest.mark.onePrecision
def testWhichWay(platformName):
    """A dilute box gets a real half, one too small for its range waves alone; describe() says why."""
    dilute = scenes.randomSuspension(40, 0.02, scenes.cube(1), 0.5, 75)
    small = scenes.idealGas(30, 0.6, scenes.cube(1), 0.5, 76)
    context, integrator = makeContext(dilute, platformName, configure=forceCoupling())
    assert integrator.getNumericalParameters()["split"] == "Prolate"
    assert "cost model" in integrator.describe()
    assert integrator.getNumericalParameters()["realCutoff"] <= 7*0.5 or isDirect(platformName)
    other, twin = makeContext(small, platformName, tolerance=1e-5, configure=forceCoupling())
    assert twin.getNumericalParameters()["split"] == "AllWaves"
    assert "because at tolerance 1e-05 the prolate split needs a range" in twin.describe()
    context.setPeriodicBoxVectors(*small.box)    # and back: the Plan follows the box
    forces = randomForces(dilute)
    before = dilute.at(positionsOf(context))
    moved = scenes.Scene(before.positions, small.box, before.radius)
    exact = (forceCouplingMatrix(moved.positions, moved.box, 0.5, scenes.ETA) @ forces.ravel())
    u = integrator.applyMobility(forces)
    assert errorRatio(u, exact.reshape(-1, 3), forces, moved) <= 1e-3
    context.setPeriodicBoxVectors(*dilute.box)
    assert errorOf(integrator, forces, before) <= 1e-3


@pytest.mark.onePrecision
@pytest.mark.parametrize("configure, words", [
    (forceCoupling("automatic", lambda i: i.setParticleRadius(3, 0.7)),
     ["particle 3", "0.7", "0.5", "ForceCoupling in a periodic fluid", "RotnePragerYamakawa"]),
    (forceCoupling("automatic", lambda i: i.setSplit(PSEBrownianIntegrator.Hasimoto)),
     ["Hasimoto", "ForceCoupling", "setSplit(AutomaticSplit)", "setSplit(AllWaves)"]),
    (forceCoupling("AllWaves", lambda i: i.setSplittingParameter(0.5)),
     ["splitting parameter", "AllWaves", "leave them 0"]),
    (forceCoupling("automatic", lambda i: i.setSplittingParameter(1.9)),
     ["range of 0.526", "Gaussian tail", "leave splitting parameter"]),
    (forceCoupling("Prolate", lambda i: i.setSplittingParameter(0.19)),
     ["range of 5.2", "tables of force coupling", "larger splitting parameter"]),
    (lambda i: i.setSplit(PSEBrownianIntegrator.AllWaves),
     ["Rotne-Prager-Yamakawa", "setSplit(AutomaticSplit)", "setMobilityModel(ForceCoupling)"])])
def testRefusals(platformName, configure, words):
    s = scenes.randomSuspension(60, 0.02, scenes.cube(1), 0.5, 75)
    with pytest.raises(openmm.OpenMMException) as caught:
        makeContext(s, platformName, configure=configure)
    for word in ("PSEBrownianIntegrator", *words):
        assert word in str(caught.value)


# ---------------------------------------------------------------- noise

@pytest.mark.hostOnly
@pytest.mark.parametrize("split", ["Prolate", "AllWaves"])
def testCovarianceIsThatOfTheMobility(platformName, split):
    """n = 5000 samples of 24 numbers: variances wrong by 2.2 % and correlations of 0.1 are found."""
    s = scenes.randomSuspension(8, 0.15, scenes.tilted(1), 0.5, 101)
    context, integrator = makeContext(s, platformName, T, DT, 1e-2, configure=forceCoupling(split))
    assert integrator.getNumericalParameters()["split"] == split
    y = whiten(samplesOf(integrator, 5000), VARIANCE*mobilityOf(s))
    assertUnitCovariance(y, split)
    assertZeroMean(y, split)
    assert (integrator.getNumericalParameters()["lanczosIterations"] == 0) == (split == "AllWaves")


@pytest.mark.withGrid
@pytest.mark.parametrize("split, tolerance", [("Prolate", 1e-3), ("AllWaves", 1e-5)])
def testPlatformsTakeTheSameThermalStep(platformName, split, tolerance):
    """
    With the Plan and the seed of the CPU: devices to the tolerance, Reference (which has no window)
    to its square root.
    """
    s = scenes.randomSuspension(25, 0.15, scenes.tilted(1), 0.5, 108)
    cpu = makeContext(s, "CPU", T, DT, tolerance, seed=9, configure=forceCoupling(split))
    parameters = cpu[1].getNumericalParameters()
    other = platformName if isDevice(platformName) else "Reference"
    twin = makeContext(s, other, T, DT, tolerance, seed=9, configure=forceCoupling(
        split, lambda i: i.setNumericalParameters(parameters)))
    assertSameNoise(cpu, twin, tolerance if isDevice(platformName) else np.sqrt(tolerance))


def testThreadsDoNotChangeABit():
    s = scenes.idealGas(1200, 0.2, scenes.tilted(1), 0.5, 109)
    for split in ("Prolate", "AllWaves"):
        results = []
        for threads in (1, 2):
            context, integrator = makeContext(s, "CPU", T, DT, 1e-3, threads=threads,
                                              configure=forceCoupling(split))
            integrator.step(3)
            results.append(positionsOf(context))
        assert np.array_equal(*results), split


# ---------------------------------------------------------------- continuation

@pytest.mark.parametrize("split", ["Prolate", "AllWaves"])
def testCheckpointContinuesToTheBit(platformName, split):
    s = scenes.randomSuspension(20, 0.1, scenes.tilted(1), 0.5, 401)

    def fresh(configure=forceCoupling(split)):
        bonds = scenes.harmonicBonds([(i, i + 1) for i in range(s.count - 1)], 1.5, 5.0)
        return makeContext(s, platformName, T, DT, 1e-3, 31, [bonds], configure=configure)
    context, integrator = fresh()
    integrator.step(3)
    checkpoint = context.createCheckpoint()
    integrator.step(5)
    other, twin = fresh()
    other.loadCheckpoint(checkpoint)
    twin.step(5)
    assert np.array_equal(positionsOf(other), positionsOf(context))
    rigid, integrator = fresh(lambda i: None)
    with pytest.raises(openmm.OpenMMException, match="force coupling.*Rotne-Prager-Yamakawa"):
        rigid.loadCheckpoint(checkpoint)
