# SPDX-License-Identifier: MIT
"""What accuracy costs: the errors are right, and the recommendation follows its rule."""
import copy
import re
from pathlib import Path

import numpy as np
import openmm
import pytest
from openmm import unit

import openmmpse
import scenes
from accuracyscenes import STEP, TEMPERATURE, smallSuspension, springs, template
from openmmpse import PSEBrownianIntegrator, accuracy
from openmmpse.accuracy import limits, report, stages, tuning
from openmmpse.accuracy.limits import Limits, recommend
from openmmpse.accuracy.scene import Scene, SceneError
from platformnames import contextOn, familyOf, isDirect, lowestTolerance, platformOptions

pytestmark = pytest.mark.onePrecision

KT = scenes.KB*TEMPERATURE


@pytest.fixture(scope="module")
def small():
    return smallSuspension()


def sceneOf(small, platformName="CPU", temperature=TEMPERATURE, forces=None, masses=None):
    system = scenes.makeSystem(small, [springs(small)] if forces is None else forces, masses)
    options = platformOptions(platformName, 1)
    integrator = template(temperature, small.radius)
    return Scene(system, small.positions, integrator, platform=familyOf(platformName), properties=options)


# ---------------------------------------------------------------- the sweep

def testErrorsAreThoseAgainstTheOracleAndKeepTheTolerance(small, platformName):
    tightest = 1e-10  # that of the run which errors are measured against, in double precision on any platform
    expected = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5]
    result = accuracy.measure(sceneOf(small, platformName), rounds=1, tolerances=(1e-1, 1e-2, 1e-3, 1e-4, 1e-5))
    assert result.complete and result.referenceTolerance == pytest.approx(tightest)
    assert [row.tolerance for row in result.rows] == pytest.approx(expected)
    for row in result.rows:
        assert set(row.errors) == {"random", "uniform", "scene"}
        assert all(0 < error <= row.tolerance for error in row.errors.values())
        assert row.seconds > 0 and row.bareSeconds > 0 and sum(row.stages.values()) == pytest.approx(1, abs=0.06)
    for kind in ("random", "uniform", "scene"):
        errors = [row.errors[kind] for row in result.rows]
        assert errors[3] < 1e-1*errors[1] < 1e-1*errors[0]
        assert len(errors) == 4 or errors[4] < 1e-2*errors[1]
    # the same numbers from the dense matrix, which knows nothing of tolerances
    context, integrator = scenes.makeContext(small, platformName, tolerance=1e-2, forces=[springs(small)],
                                             temperature=TEMPERATURE)
    force = np.array(context.getState(forces=True).getForces(asNumpy=True)._value)
    uniform = scenes.uniformForces(small)
    for kind, forces in (("scene", force), ("uniform", uniform)):
        assert result.rows[1].errors[kind] == pytest.approx(scenes.errorOf(integrator, forces, small), rel=1e-5 if lowestTolerance(platformName) < 1e-6 else 1e-3)


@pytest.mark.hostOnly
def testNoiseIsCovarianceErrorPlusTwiceTheLanczosError(small, platformName):
    scene = sceneOf(small, platformName)
    result = accuracy.measure(scene, rounds=1, tolerances=(1e-1, 1e-3))
    for row in result.rows:
        assert row.noise == row.plainErrors["random"] + 2*row.lanczosError
        if isDirect(platformName):  # its Lanczos process is as tight as the one it is compared with
            assert row.lanczosError == 0
        else:
            assert 0 < row.lanczosError < 2*row.parameters["lanczosTolerance"]
    assert result.rows[1].noise < 0.1*result.rows[0].noise
    # One vector of normal forces estimates |dM|/|M| in the Frobenius norm: here with all columns, 90 of them.
    probe = scene.probe(1e-1)
    error = np.linalg.norm(scenes.mobilityColumns(probe.integrator, small.count) - small.mobility)
    assert 0.5 < result.rows[0].plainErrors["random"]/(error/np.linalg.norm(small.mobility)) < 2


def testNoiseNumberBoundsTheMeasuredCovariance():
    """Overlapping particles, a large real half, Lanczos stopped after two iterations: its share is visible."""
    gas = scenes.idealGas(20, 1.0, scenes.cube(1), 0.5, seed=2)
    scene = sceneOf(gas, forces=[])
    used = scene.probe(1e-2, parameters={"xi": 0.5}).parameters
    loose = {**used, "lanczosTolerance": 0.4}
    lanczos = accuracy.sweep.lanczosError(scene, scene.probe(1e-2, parameters=loose))
    assert 0.05 < lanczos < 0.1
    probe = scene.probe(1e-2, parameters=loose)
    size = np.linalg.norm(gas.mobility)
    bound = np.linalg.norm(scenes.mobilityColumns(probe.integrator, gas.count) - gas.mobility)/size + 2*lanczos
    draws = probe.displacements(10000).reshape(10000, -1)/np.sqrt(2*KT*STEP)
    difference = np.linalg.norm(draws.T @ draws/len(draws) - gas.mobility)/size
    # of exact noise E|C - M|^2 = (tr M^2 + (tr M)^2)/n, and 1.5 times its root is beyond chance (a sum of thousands)
    chance = 1.5*np.sqrt((size**2 + np.trace(gas.mobility)**2)/len(draws))/size
    assert chance < 0.15 and difference < bound + chance < 0.35


def testLanczosErrorFollowsItsTolerance(small):
    scene = sceneOf(small)
    used = scene.probe(1e-2).parameters
    errors = [accuracy.sweep.lanczosError(scene, scene.probe(1e-2, parameters={**used, "lanczosTolerance": x}))
              for x in (1e-1, 1e-3, 1e-5)]
    assert errors[0] > 5*errors[1] > 25*errors[2] > 0
    assert errors[2] < 1e-5


def testTemperatureZeroHasNoNoise(small):
    result = accuracy.measure(sceneOf(small, temperature=0), rounds=1, tolerances=(1e-2,))
    (row,) = result.rows
    assert row.noise is None and row.lanczosError is None and result.limits.statistical is None
    assert result.limits.timeStep > 0 and "no statistical error" in result.limits.assumptions
    assert report.table(result)[-1].split()[4] == "-"


def testMasslessParticlesAreLeftOut(small):
    masses = [0.0 if i % 3 == 0 else 1.0 for i in range(small.count)]
    result = accuracy.measure(sceneOf(small, masses=masses), rounds=1, tolerances=(1e-1, 1e-3))
    assert result.count == 20
    assert 0 < result.rows[1].errors["scene"] < 1e-3


def testContextIsLeftAsItIs(small):
    context, integrator = scenes.makeContext(small, "CPU", tolerance=1e-3, forces=[springs(small)],
                                             temperature=TEMPERATURE)
    integrator.step(3)
    before = openmm.XmlSerializer.serialize(context.getState(positions=True, forces=True, parameters=True))
    draws = copy.copy(integrator), integrator.getNumericalParameters()
    result = accuracy.measure(context, rounds=1, tolerances=(1e-1,), runLength=1000)
    assert result.platform == "CPU" and result.runLength == 1000 and len(result.rows) == 1
    after = openmm.XmlSerializer.serialize(context.getState(positions=True, forces=True, parameters=True))
    assert before == after and integrator.getNumericalParameters() == draws[1]


def testPrescribedParametersAreNamedAndNotUsed(small):
    integrator = template(radius=small.radius)
    integrator.setNumericalParameters({"xi": 3.1, "gridDimensions": (40, 40, 40)})
    system = scenes.makeSystem(small, [springs(small)])
    result = accuracy.measure(system, small.positions*unit.nanometer, integrator, rounds=1, tolerances=(1e-2,))
    assert result.rows[0].parameters["xi"] != pytest.approx(3.1)
    assert any("'xi': 3.1" in note and "40" in note for note in result.notes)


def testBoxOfTheStateIsUsed(small):
    wide = scenes.cube(2*small.box[0, 0])
    system = scenes.makeSystem(small, [springs(small)])
    scene = Scene(system, small.positions, template(radius=small.radius), box=wide*unit.nanometer)
    dilute = scenes.Scene(small.positions, wide, small.radius)
    forces = scenes.randomForces(dilute)
    assert scenes.errorRatio(scene.probe(1e-4).velocities(forces), dilute.velocities(forces), forces, dilute) < 1e-4
    assert system.getDefaultPeriodicBoxVectors()[0][0]._value == pytest.approx(small.box[0, 0])
    assert scene.system.getDefaultPeriodicBoxVectors()[0][0]._value == pytest.approx(wide[0, 0])


def testStepsWithoutForcesDoTheWorkOfTheFluid(small):
    """They move a particle that nothing of the System pulls, and leave the System alone."""
    context, integrator = scenes.makeContext(small, "CPU", forces=[springs(small)])
    system = context.getSystem()
    scene = Scene(system, small.positions, template(0, small.radius))
    assert system.getNumForces() == 1 and scene.system.getNumForces() == 2 and scene.timingGroup == 30
    probe = scene.probe(1e-3)
    assert np.allclose(probe.forces(), context.getState(forces=True).getForces(asNumpy=True)._value)
    positions = {}
    for withForces in (True, False):
        assert probe.secondsPerStep(1e-9, withForces) > 0
        positions[withForces] = scenes.positionsOf(probe.context) - small.positions
    flow = small.mobility[:, 0].reshape(-1, 3)  # of a force of 1 kJ/(mol nm) along x on the first particle
    moved = positions[False]
    assert np.linalg.norm(moved/np.linalg.norm(moved) - flow/np.linalg.norm(flow)) < 1e-3
    assert np.linalg.norm(positions[True]) > 10*np.linalg.norm(moved)
    for i in range(32):
        force = springs(small)
        force.setForceGroup(i)
        system.addForce(force)
    full = Scene(system, small.positions, template(0, small.radius))
    assert full.timingGroup is None and full.probe(1e-2).secondsPerStep(1e-9, False) is None
    assert accuracy.measure(full, rounds=1, tolerances=(1e-2,)).rows[0].bareSeconds is None


def testTightRunThatTakesTooLongIsLoosened(small):
    result = accuracy.measure(sceneOf(small), rounds=1, budget=1e-9)
    assert result.referenceTolerance == pytest.approx(1e-3)
    assert [row.tolerance for row in result.rows] == pytest.approx([1e-1, 1e-2])
    assert any("1e-03" in note and "estimate" in note for note in result.notes)
    assert any("left out" in note for note in result.notes)


def testBothSplits(small):
    result = accuracy.measure(sceneOf(small), split="both", rounds=1, tolerances=(1e-2, 1e-3))
    assert result.splits[0] == "Hasimoto"
    if "Prolate" in result.splits:
        assert all(row.errors["random"] <= row.tolerance for row in result.rowsOf("Prolate"))
    else:
        assert any(note.startswith("Prolate split left out at 0.01, 0.001") for note in result.notes)


def testProgressReachesTheEnd(small):
    seen = []
    accuracy.measure(sceneOf(small), rounds=2, tolerances=(1e-1, 1e-2), progress=lambda *what: seen.append(what))
    shares = [share for _, share in seen]
    assert shares == sorted(shares) and shares[-1] == 1.0 and any("0.01" in text for text, _ in seen)


# ---------------------------------------------------------------- the recommendation

@pytest.mark.parametrize("timeStep, statistical, expected, word", [
    (5e-3, 1e-1, 1e-2, "time-step"),
    (1e-1, 5e-4, 1e-4, "statistical"),
    (None, 5e-2, 1e-1, "statistical"),
    (1e-3, None, 1e-3, "time-step"),
    (1e-9, 1e-2, None, "time-step"),
    (None, None, None, "no recommendation"),
])
def testLoosestToleranceBelowBothErrors(timeStep, statistical, expected, word):
    errors = {1e-1: 4e-2, 1e-2: 4e-3, 1e-3: 8e-4, 1e-4: 3e-5}
    tolerance, reason = recommend(errors, Limits(timeStep, statistical, ""))
    assert tolerance == expected and word in reason


def testLongerRunsNeedTighterTolerances(small):
    scene = sceneOf(small)
    short, long = (limits.estimate(scene, steps) for steps in (10**4, 10**8))
    assert short.timeStep == long.timeStep
    assert short.statistical == pytest.approx(100*long.statistical)
    independent = limits.estimate(scene, 10**4, correlationTime=1e-3)
    components = limits.independentComponents(scene)
    assert independent.statistical == pytest.approx(np.sqrt(2/(components*1e4)))
    assert "a^2/D0" in short.assumptions and "a^2/D0" not in independent.assumptions


def testIndependentComponentsOfTheDenseMatrix(small):
    """(tr M)^2/tr M^2 against the oracle. Its two sums over n vectors have variances 2 tr M^2/n and 2 tr M^4/n."""
    M, vectors = small.mobility, 10
    exact = np.trace(M)**2/np.sum(M**2)
    spread = 2*np.sqrt(2*np.sum(M**2)/vectors)/np.trace(M) + np.sqrt(2*np.sum((M @ M)**2)/vectors)/np.sum(M**2)
    assert abs(limits.independentComponents(sceneOf(small))/exact - 1) < 4.9*spread < 1
    # and this is what the uncertainty of a mean square follows: 4,000 draws of all components
    draws = np.random.default_rng(1).normal(size=(4000, len(M))) @ np.linalg.cholesky(M).T
    squares = np.sum(draws**2, axis=1)
    assert squares.std()/squares.mean() == pytest.approx(limits.statisticalError(exact, 1), rel=0.15)


@pytest.mark.parametrize("temperature", (0.0, TEMPERATURE))
def testTimeStepErrorOfAHarmonicTrap(temperature, platformName):
    """A mode of stiffness k keeps a variance in error by mu k dt/2 [T1]: exactly what the estimate must say."""
    box, k = 20.0, 2e4
    one = scenes.Scene(np.array([[0.3, -0.2, 0.4]]), scenes.cube(box), 0.5)
    trap = openmm.CustomExternalForce(f"{k/2}*(x^2+y^2+z^2)")
    trap.addParticle(0, [])
    x = one.radius/box
    mobility = one.mu0*(1 - 2.8372974794806*x + 4*np.pi/3*x**3)
    expected = mobility*k*STEP/2
    assert limits.timeStepError(sceneOf(one, platformName, temperature, [trap])) == pytest.approx(expected, rel=2e-3)


def testTimeStepErrorOfAQuarticTrap():
    """Here noise changes the mean force: <(x + d + w)^3> = (x + d)^3 + 3 (x + d) s^2, s^2 = kT mu dt in half a step."""
    a, c, offset, spacing = 0.5, 2e3, 0.1, 30.0
    sites = spacing*np.stack(np.meshgrid(*[np.arange(4)]*3), -1).reshape(-1, 3)
    signs = np.random.default_rng(3).choice([-1.0, 1.0], 64)
    dilute = scenes.Scene(sites + np.outer(signs*offset, [1, 0, 0]), scenes.cube(4*spacing), a)
    trap = openmm.CustomExternalForce(f"{c}*(x-x0)^4")
    trap.addPerParticleParameter("x0")
    for i, site in enumerate(sites):
        trap.addParticle(i, [site[0]])
    drift = -4*c*offset**3*dilute.mu0*STEP/2
    moved, square = offset + drift, KT*dilute.mu0*STEP
    expected = abs((moved**3 + 3*moved*square)/offset**3 - 1)
    # 2048 squares of normal numbers: 3 % at one standard deviation, 15 % at a false-alarm rate of 1e-6; mobility 4 %
    measured = limits.timeStepError(sceneOf(dilute, forces=[trap]))
    assert 3*square/offset**2 > 0.02 and measured == pytest.approx(expected, rel=0.19)


def testMeanLengthIsFreeOfTheBiasOfNoise():
    generator = np.random.default_rng(4)
    vector = generator.normal(size=3000)
    noisy = vector + 5*generator.normal(size=(8, 3000))
    plain = np.linalg.norm(noisy.mean(axis=0))/np.linalg.norm(vector)
    # variance of the estimate of the square: 4 s^2/8 + 2 s^4/(8*7) for each of 3000 components, s^2 = 25
    spread = np.sqrt((4*25/8 + 2*625/56)*3000)/3000/2
    assert abs(limits.meanLength(noisy)/np.linalg.norm(vector) - 1) < 4.9*spread < 0.4 < plain - 1
    pure = generator.normal(size=(8, 3000))
    assert 0 < limits.meanLength(pure) < 0.5*np.linalg.norm(pure.mean(axis=0))


# ---------------------------------------------------------------- stages of a step

def testSharesOfStagesAndParts(small, platformName):
    times = {"spreading": 3.0, "gathering": 2.0, "wave factors of the moving box": 5.0}
    assert stages.shares(times) == {"spreading": 0.3, "gathering": 0.2, "wave factors of the moving box": 0.5}
    parts = stages.partsOf(times)
    assert list(parts) == list(stages.PARTS) and parts["grid"] == 0.5 == parts["moving box"] and sum(parts.values()) == 1
    probe = sceneOf(small, platformName).probe(1e-3)
    assert stages.partsOf(probe.integrator.getStageTimes()) == {} == probe.integrator.getStageTimes()
    probe.integrator.step(3)
    times = probe.integrator.getStageTimes()
    assert min(times.values()) >= 0 < sum(times.values())
    cost = next(line for line in probe.integrator.describe().splitlines() if line.startswith("cost"))
    for stage, share in stages.shares(times).items():
        assert f" {stage} {100*share:.0f} %" in cost
    assert sum(stages.partsOf(times).values()) == pytest.approx(1, abs=1e-12)


def testEveryStageBelongsToAPart():
    """All names in the sources of the platforms, and none that only looks like one."""
    sources = [path.read_text() for path in (Path(__file__).parents[1]/"platforms").rglob("*") if path.is_file()]
    names = {name for text in sources for call in re.findall(r"charge\(([^;]*)\);|MOVING_BOX\[\] = (.*);", text)
             for name in re.findall(r'"([^"]+)"', "".join(call))}
    assert len(names) > 15 and "wave factors of the moving box" in names
    assert {stages.partOf(name) for name in names} == set(stages.PARTS)
    with pytest.raises(ValueError, match="turbulence"):
        stages.partOf("turbulence")


# ---------------------------------------------------------------- tuning

@pytest.mark.hostOnly
def testTuningOffersWhatTheIntegratorAccepts(small, platformName):
    result = accuracy.tune(sceneOf(small, platformName), tolerance=1e-2, rounds=1)
    assert result.automatic.settings == {} and len(result.candidates) + len(result.notes) == 9
    assert result.excess >= 1 and result.best.seconds <= result.automatic.seconds
    for candidate in result.candidates[1:]:
        integrator = template(radius=small.radius)
        integrator.setErrorTolerance(1e-2)
        integrator.setNumericalParameters(candidate.settings)
        context = contextOn(platformName, scenes.makeSystem(small), integrator)
        used = integrator.getNumericalParameters()
        del context
        for key in ("xi", "gridDimensions", "windowSupport", "realCutoff"):
            assert used[key] == candidate.parameters[key]
        assert candidate.error <= 2e-2
    assert len({candidate.parameters["xi"] for candidate in result.candidates}) >= 3  # the box is small


def testTuningKeepsTheTolerance():
    def candidate(label, seconds, error):
        return tuning.Candidate(label, {"xi": 1.0}, {}, error, [2*seconds, seconds])

    slow, fast, wrong = candidate("automatic", 3.0, 5e-4), candidate("fast", 2.0, 1.2e-3), candidate("wrong", 1.0, 2e-3)
    result = tuning.Tuning(1e-3, [slow, wrong, fast])
    assert result.best is fast and result.excess == 1.5
    assert tuning.Tuning(1e-3, [slow, wrong]).best is slow


def testNoStepWhereAShortRunFails(small, monkeypatch):
    def failing(*_):
        raise openmm.OpenMMException("blown up")

    monkeypatch.setattr(accuracy.timestep, "advise", failing)
    result = accuracy.measure(sceneOf(small), rounds=1, tolerances=(1e-1,))
    assert result.complete and result.step is None and any("blown up" in note for note in result.notes)


def testForcesOnVirtualSites():
    """A spring on the mean of two spheres: k/4 on each and between them, for M a rate of (mu + mu') k/2."""
    a, k, far = 0.5, 500.0, 5.0
    system = scenes.makeSystem(scenes.Scene(np.zeros((3, 3)), scenes.cube(20.0), a), masses=[1.0, 1.0, 0.0])
    system.setVirtualSite(2, openmm.TwoParticleAverageSite(0, 1, 0.5, 0.5))
    spring = openmm.CustomExternalForce(f"{k/2}*x^2")
    spring.addParticle(2, [])
    system.addForce(spring)
    integrator = template(radius=a)
    integrator.setFluidBoundary(PSEBrownianIntegrator.Unbounded)
    scene = Scene(system, [[0, 0, 0], [0, 0, far], [0, 0, far/2]], integrator)
    r = far/a
    expected = k/2*scene.freeMobility*(1 + 3/(4*r) + 1/(2*r**3))
    assert accuracy.recommendStep(scene, configurations=1).rate == pytest.approx(expected, rel=2e-3)


def testBadScenes(small):
    system = scenes.makeSystem(small)
    holes = small.positions.copy()
    holes[4, 1] = np.nan
    with pytest.raises(SceneError, match="position of particle 4"):
        Scene(system, holes, template())
    with pytest.raises(TypeError, match="needs positions and integrator"):
        accuracy.measure(system)
    with pytest.raises(SceneError, match="is a VerletIntegrator"):
        Scene(system, small.positions, openmm.VerletIntegrator(1.0))
    singular = openmm.CustomExternalForce("sqrt(x-1000)")
    singular.addParticle(3, [])
    with pytest.raises(SceneError, match="force on particle 3.*relax"):
        accuracy.measure(sceneOf(small, forces=[singular]), rounds=1)
    many = openmm.System()
    many.setDefaultPeriodicBoxVectors(*np.eye(3)*60)
    for _ in range(2001):
        many.addParticle(1)
    with pytest.raises(SceneError, match="2001 particles.*Reference.*2000.*CPU"):
        Scene(many, np.zeros((2001, 3)), template(), platform="Reference")


def testItIsExported():
    assert openmmpse.accuracy.measure is accuracy.sweep.measure
