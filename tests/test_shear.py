# SPDX-License-Identifier: MIT
"""
Shear flow [T35], [T36], [T38]: the flow, the box that tilts with it, and what must not notice it.
Boxes begin with a small tilt, because OpenMM's devices tilt no box that was made rectangular.
"""
import copy

import numpy as np
import openmm
import pytest
from scipy import stats

import scenes
from openmmpse import PSEBrownianIntegrator
from platformnames import isDevice, precisionOf, served
from scenes import FALSE_ALARM, KB, Scene, errorRatio, makeContext, positionsOf, randomForces
from test_bad_input import assertMentions, messageOf

STEADY, OSCILLATORY, STARTUP = (PSEBrownianIntegrator.SteadyShear,
                                PSEBrownianIntegrator.OscillatoryShear,
                                PSEBrownianIntegrator.StartUpShear)
T, DT = 300.0, 1.0


def barelyTilted(box):
    box = np.array(box)
    box[1, 0] += 1e-3*box[0, 0]
    return box


def suspension(seed=3, N=24, phi=0.1):
    return scenes.randomSuspension(N, phi, barelyTilted(scenes.cube(1.0)), 0.5, seed)


def shear(rate, protocol=STEADY, time=0.0, more=None):
    def configure(i):
        i.setShearRate(rate)
        i.setShearProtocol(protocol, time)
        if more is not None:
            more(i)
    return configure


def freeDraining(i):
    i.setMobilityModel(PSEBrownianIntegrator.FreeDraining)


def boxOf(context):
    return np.array(context.getState().getPeriodicBoxVectors()._value)


def rounding(platformName):
    """Of positions of some ten nanometres; OpenMM wraps them in floats, in mixed precision, too."""
    if not isDevice(platformName):
        return 1e-11
    return {"single": 1e-5, "mixed": 1e-6, "double": 1e-9}[platformName.partition("-")[2]]


def repulsion(scene):
    force = openmm.CustomNonbondedForce("200*step(s-r)*(s-r)^2; s=1.05")
    force.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    force.setCutoffDistance(1.1)
    for _ in range(scene.count):
        force.addParticle([])
    return force


def run(context, integrator, steps):
    path = []
    for _ in range(steps):
        integrator.step(1)
        path.append(positionsOf(context))
    return np.array(path)


# ---------------------------------------------------------------- the flow

def followFreeParticles(platformName, protocol, time, strain, more):
    s = Scene(np.array([[1.0, 2.0, 3.0], [4.0, 6.5, 5.0], [0.5, -3.0, 1.0]]),
              barelyTilted(np.diag([6.0, 7.0, 8.0])), 0.5)
    context, integrator = makeContext(
        s, platformName, 0.0, DT, forces=[scenes.periodicDummyForce(3, s.box)],
        configure=shear(0.037, protocol, time, more))
    for t in range(1, 61):
        before = positionsOf(context)
        integrator.step(1)
        x = positionsOf(context)
        expected = s.positions + strain(t)*s.positions[:, 1:2]*np.array([1, 0, 0])
        assert abs(x - expected).max() <= rounding(platformName)*max(1, t/10)
        assert np.allclose(scenes.velocitiesOf(context), (x - before)/DT, rtol=0,
                           atol=10*rounding(platformName))
        assert integrator.getStrain() == pytest.approx(strain(t), rel=1e-12, abs=1e-14)
        tilt = 1e-3*6 + strain(t)*7
        box = boxOf(context)
        assert abs(box[1, 0]) <= 3.0
        assert box[1, 0] == pytest.approx(tilt - 6*np.rint((tilt - box[1, 0])/6), abs=1e-6)
        assert np.allclose(np.diag(box), [6, 7, 8], rtol=1e-6) and box[2, 0] == box[2, 1] == 0


@pytest.mark.parametrize("protocol, time, strain", [
    (STEADY, 0.0, lambda t: 0.037*t),
    (OSCILLATORY, 31.0, lambda t: 0.037*31/(2*np.pi)*np.sin(2*np.pi*t/31)),
    (STARTUP, 7.25, lambda t: 0.037*max(0.0, t - 7.25))])
def testFreeParticlesFollowTheFlow(platformName, protocol, time, strain):
    """x = x0 + strain y0, exactly, whatever the tilt and its flips; velocities are displacements."""
    followFreeParticles(platformName, protocol, time, strain, freeDraining)


@pytest.mark.onePrecision
def testParticlesInTheFluidFollowTheFlow(platformName):
    followFreeParticles(platformName, STEADY, 0.0, lambda t: 0.037*t, None)


@pytest.mark.onePrecision
def testEveryVectorWithAYComponentTilts(platformName):
    """c tilts by its own y component; images keep their distances through every flip."""
    box = np.array([[6.0, 0, 0], [0.5, 7, 0], [-2.0, 3.0, 8]])
    s = Scene(np.array([[1.0, 1.0, 1.0], [3.0, 5.0, 6.0]]), box, 0.5)
    context, integrator = makeContext(s, platformName, configure=shear(0.05))
    for step in range(1, 61):
        integrator.step(1)
        flow = np.array([[1, 0, 0], [0.05*step, 1, 0], [0, 0, 1]])
        now = boxOf(context)
        # the same lattice: one basis in terms of the other is an integer matrix of determinant 1
        change = now @ np.linalg.inv(box @ flow)
        assert np.allclose(change, np.rint(change), atol=1e-5)
        assert round(np.linalg.det(np.rint(change))) == 1
        assert 2*abs(now[1, 0]) <= 6 and 2*abs(now[2, 0]) <= 6
        x = positionsOf(context)
        wanted = (s.positions[0] - s.positions[1]) @ flow
        assert np.allclose(x[0] - x[1], wanted, atol=10*rounding(platformName))


@pytest.mark.parametrize("tolerance, split", [(1e-3, "AutomaticSplit"), (1e-3, "Hasimoto"), (1e-7, "AutomaticSplit")])
def testALatticeUnderShearIsPeriodic(platformName, tolerance, split):
    """
    A falling simple cubic lattice under shear: after each unit of strain the same lattice, so each
    period has the same displacements, 100 flips in a row, to 1e-6. At 1e-3 the prolate range is less than the
    spacing: waves alone, on a grid in which all spheres have the same place, so that floats do not show. In
    sums over pairs, as Hasimoto's split has here, velocities of two spheres differ by their rounding, 2^-24 of
    the fall; if always to the same side, heights differ after t periods by t times that, and the flow has
    carried one away from the other by t^2/2 times that. Six times that is allowed where it is more than 1e-6.
    Where positions are floats (the images that OpenMM keeps are, in mixed precision, too) each step rounds
    coordinates of up to X by at most X 2^-24: after n steps two of them differ by sqrt(2n/3) X 2^-24, root mean
    square, and six times that is allowed. OpenMM wraps x every 250 steps, of which each adds at most L/perStrain.
    """
    side, L, perStrain = 2, 4.0, 16
    tolerance = served(platformName, tolerance)
    double = precisionOf(platformName, tolerance) == "double"
    floats = isDevice(platformName) and not double
    periods = 30 if floats else 100
    places = np.stack(np.meshgrid(*[np.arange(side)]*3, indexing="ij"), -1).reshape(-1, 3)
    s = Scene((places + 0.25)*L/side, barelyTilted(scenes.cube(L)), 0.5)
    pull = scenes.constantForces(np.tile([30.0, -50.0, 0.0], (s.count, 1)))
    context, integrator = makeContext(
        s, platformName, stepSize=DT, tolerance=tolerance, forces=[pull, repulsion(s)],
        configure=shear(1.0/perStrain, more=lambda i: i.setSplit(getattr(PSEBrownianIntegrator, split))))
    context.setPeriodicBoxVectors(*scenes.cube(L))
    pairs = integrator.getNumericalParameters()["realCutoff"] > L/side

    def allowed(steps, largest):
        return 6*np.sqrt(2*steps/3)*largest*2.0**-24 if floats else 1e-6
    heights, relative = [positionsOf(context)[:, 1]], None
    for period in range(periods):
        integrator.step(perStrain)
        x = positionsOf(context)
        heights.append(x[:, 1])
        lattice = (x - x[0]) - (period + 1)*(x - x[0])[:, 1:2]*np.array([1, 0, 0])
        relative = lattice if relative is None else relative
        fall = (heights[0] - heights[-1]).max()
        rounded = 0 if double or not pairs else 6*2.0**-24*fall*(period + 1)/2
        assert abs(lattice - relative).max() < allowed(periods*perStrain, L*(1 + 250/perStrain)) + rounded
    falls = np.diff(np.array(heights), axis=0)
    assert falls.max() < -0.01
    # the lattice falls across the grid, whose error shows
    assert abs(falls - falls[0]).max() < allowed(2*perStrain, 2*L) + 2*tolerance*abs(falls).max()
    assert integrator.getStrain() == pytest.approx(periods, rel=1e-12)
    assert abs(boxOf(context)[1, 0]) < 1e-9


def forceCoupling(i):
    i.setMobilityModel(PSEBrownianIntegrator.ForceCoupling)


def unbounded(i):
    i.setFluidBoundary(PSEBrownianIntegrator.Unbounded)


def mixtureOfTwo():
    return scenes.mixture(np.where(np.arange(24) % 5 == 0, 0.8, 0.4), 0.1, barelyTilted(scenes.cube(1.0)), 4)


@pytest.mark.onePrecision
@pytest.mark.parametrize("scene, more", [
    (suspension, None), (mixtureOfTwo, None), (suspension, freeDraining),
    (suspension, forceCoupling), (suspension, unbounded),
    (mixtureOfTwo, lambda i: (forceCoupling(i), unbounded(i)))])
def testStepsAreThoseOfReference(platformName, scene, more):
    """
    Positions, velocities and box after steps past a flip, whatever the fluid: each step is exact to the
    tolerance, and an error of a velocity shears on, strain times what it has become in y.
    """
    s, tolerance, steps = scene(), 1e-4, 8
    pull = 40*randomForces(s)
    found = []
    for name in (platformName, "Reference"):
        context, integrator = makeContext(s, name, 0.0, DT, tolerance,
                                          forces=[repulsion(s), scenes.constantForces(pull)],
                                          configure=shear(0.17, more=more))
        integrator.step(steps)
        found.append((positionsOf(context), scenes.velocitiesOf(context), boxOf(context)))
        assert integrator.getStrain() == pytest.approx(0.17*steps, rel=1e-12)
    bound = (1 + 0.17*steps)*tolerance*np.linalg.norm(pull*s.ownMobilities*DT*steps) + 10*rounding(platformName)
    assert abs(found[0][0] - found[1][0]).max() < bound
    assert abs(found[0][1] - found[1][1]).max() < 2*bound/steps/DT + 10*rounding(platformName)
    assert np.allclose(found[0][2], found[1][2], rtol=0, atol=1e-9)


@pytest.mark.onePrecision
def testAChainInAnUnboundedFluidIsSheared(platformName):
    """
    Without images there is no box to tilt: a rectangular one stays as it is. The middle of a dumbbell
    without forces but its bond follows the flow exactly; the bond turns it to the flow's axis.
    """
    s = Scene(np.array([[0.0, 1.5, 0.2], [0.3, 3.5, -0.2]]), scenes.cube(30.0), 0.5)
    bond = scenes.harmonicBonds([(0, 1)], 2.0, 500.0)
    context, integrator = makeContext(s, platformName, 0.0, DT, tolerance=1e-4, forces=[bond],
                                      configure=shear(0.05), boundary=PSEBrownianIntegrator.Automatic)
    integrator.step(200)
    assert integrator.getStrain() == pytest.approx(10.0)
    assert np.allclose(boxOf(context), s.box)
    x = positionsOf(context)
    centre = s.positions.mean(axis=0) + 10.0*2.5*np.array([1, 0, 0])
    assert abs(x.mean(axis=0) - centre).max() < 300*rounding(platformName)
    along = x[1] - x[0]
    assert np.linalg.norm(along) == pytest.approx(2.0, abs=0.2)
    assert abs(along[1]) < 0.25*abs(along[0])  # at right angles in the beginning


# ---------------------------------------------------------------- the fluid in a tilting box

def testVelocitiesAtEveryStrain(platformName):
    """The error keeps the tolerance at any strain, with one Plan, made for the worst tilt."""
    s = suspension()
    tolerance = 1e-4 if "single" not in platformName else 1e-3
    context, integrator = makeContext(s, platformName, tolerance=tolerance, configure=shear(0.13))
    forces = randomForces(s)
    plan = integrator.getNumericalParameters()
    integrator.step(3)
    assert "wave factors of the moving box" in integrator.describe()
    for _ in range(12):
        integrator.step(1)
        now = Scene(positionsOf(context), boxOf(context), s.radius)
        error = errorRatio(integrator.applyMobility(forces), now.velocities(forces), forces, now)
        assert error <= tolerance
    assert integrator.getNumericalParameters() == plan


@pytest.mark.onePrecision
def testTwoReducedFormsOfOneLattice(platformName):
    """b and b - a at half tilt: one lattice, so the same velocities and the same law of noise."""
    tolerance, count = 1e-4, 1500 if isDevice(platformName) else 4000
    s = scenes.randomSuspension(4, 0.04, scenes.cube(1.0), 0.5, 8)
    L = s.box[0, 0]
    boxes = [np.array([[L, 0, 0], [0.5*sign*L, L, 0], [0, 0, L]]) for sign in (1, -1)]
    exact = Scene(s.positions, boxes[0], s.radius)
    assert np.allclose(Scene(s.positions, boxes[1], s.radius).mobility, exact.mobility, atol=1e-12)
    forces = randomForces(s)
    for box in boxes:
        context, integrator = makeContext(Scene(s.positions, box, s.radius), platformName, T, DT,
                                          tolerance, configure=shear(0.01))
        u = integrator.applyMobility(forces)
        assert errorRatio(u, exact.velocities(forces), forces, exact) <= tolerance
        samples = integrator.sampleBrownianDisplacements(count).reshape(count, -1)
        scenes.assertUnitCovariance(
            scenes.whiten(samples, 2*KB*T*DT*exact.mobility), "noise", tests=2)


def plannedForShear(platformName, start, tolerance, fromStill):
    """
    A Context, and its integrator.

    fromStill  with what a box at rest takes, prescribed
    """
    prescribe = None
    if fromStill:
        _, planned = makeContext(start, platformName, tolerance=tolerance)
        parameters = planned.getNumericalParameters()

        def prescribe(i):
            i.setNumericalParameters(parameters)
    return makeContext(start, platformName, tolerance=tolerance, configure=shear(0.01, more=prescribe))


DEFAULT = None  # tolerance
ASKED_FOR = [(DEFAULT, True), (DEFAULT, False), (1e-2, False), (1e-4, False), (1e-5, False)]  # tolerance, fromStill


@pytest.mark.hostOnly  # what decides it is the Plan's alone
@pytest.mark.withGrid
@pytest.mark.parametrize("count", [12, 30, 50, 100, 110])  # Plans differ for up to 100 spheres
def testErrorUnderShearIsThatOfTheOrthogonalBox(platformName, count):
    """At fixed xi, grid and support, mean over 20 configurations, half tilt against none."""
    errors = np.zeros((20, len(ASKED_FOR), 2))  # in tolerances
    for seed in range(20):
        s = scenes.randomSuspension(count, 0.1, scenes.cube(1.0), 0.5, 100 + seed)
        start = Scene(s.positions, barelyTilted(s.box), s.radius)
        made = [plannedForShear(platformName, start, *asked) for asked in ASKED_FOR]
        forces = randomForces(s, seed)
        for column, tilt in enumerate((0.0, 0.5)):
            box = np.array(s.box)
            box[1, 0] = tilt*box[0, 0]
            now = Scene(s.positions @ np.linalg.inv(s.box) @ box, box, s.radius)
            exact = now.velocities(forces)
            for row, (context, integrator) in enumerate(made):
                context.setPeriodicBoxVectors(*box)
                context.setPositions(now.positions)
                error = errorRatio(integrator.applyMobility(forces), exact, forces, now)
                errors[seed, row, column] = error/integrator.getErrorTolerance()
    orthogonal, sheared = errors.mean(axis=0).T
    assert np.all(sheared <= 1.2*orthogonal), dict(zip(ASKED_FOR, sheared/orthogonal))
    assert errors.max() <= 1


# ---------------------------------------------------------------- noise and shear

@pytest.mark.onePrecision
def testMeanSquareDisplacementInShear(platformName):
    """
    A free particle spreads along the flow as 2 D t (1 + (rate t)^2/3). The sum of n steps has the
    variance 2 D t (1 + (rate dt)^2 (n - 1)(2n - 1)/6) exactly; with n steps it differs from that of
    continuous time by a factor below 1 + 1.5/n. N independent Gaussians: chi-square, two-sided.
    """
    N, n, rate = 4000, 30, 0.1
    s = Scene(np.zeros((N, 3)), barelyTilted(scenes.cube(10.0)), 0.5)
    context, integrator = makeContext(s, platformName, T, DT, configure=shear(rate, more=freeDraining),
                                      boundary=PSEBrownianIntegrator.Automatic, seed=17)
    integrator.step(n)
    x = positionsOf(context)
    D = KB*T*s.mu0
    along = 2*D*DT*n*(1 + (rate*DT)**2*(n - 1)*(2*n - 1)/6)
    continuous = 2*D*DT*n*(1 + (rate*DT*n)**2/3)
    assert abs(along/continuous - 1) < 1.5/n
    for values, variance in ((x[:, 0], along), (x[:, 1], 2*D*DT*n), (x[:, 2], 2*D*DT*n)):
        total = np.sum(values**2)/variance
        assert stats.chi2.cdf(total, N) > FALSE_ALARM/6 and stats.chi2.sf(total, N) > FALSE_ALARM/6


@pytest.mark.onePrecision
def testWithoutARateNothingChanges(platformName):
    """The protocol alone is no flow: trajectories agree to the bit with those without it."""
    s = suspension()
    paths = []
    for configure in (None, shear(0.0, OSCILLATORY, 5.0)):
        context, integrator = makeContext(s, platformName, T, DT, forces=[repulsion(s)],
                                          configure=configure)
        paths.append(run(context, integrator, 6))
        assert integrator.getStrain() == 0 and np.array_equal(boxOf(context)[0], s.box[0])
    assert np.array_equal(*paths)


# ---------------------------------------------------------------- changes and restarts

@pytest.mark.onePrecision
def testRateThatChangesWhileRunning(platformName):
    """From zero to a rate, the Plan is made anew for the worst tilt; back to zero it stays."""
    s = suspension()
    context, integrator = makeContext(s, platformName)
    still = integrator.getNumericalParameters()
    integrator.step(2)
    assert integrator.getNumericalParameters() == still
    forces = randomForces(s)
    strain = 0.0
    for rate in (0.2, -0.35, 0.0, 0.3):
        integrator.setShearRate(rate)
        integrator.step(3)
        strain += 3*rate
        assert integrator.getStrain() == pytest.approx(strain, abs=1e-12)
        now = Scene(positionsOf(context), boxOf(context), s.radius)
        error = errorRatio(integrator.applyMobility(forces), now.velocities(forces), forces, now)
        assert error <= 1e-3
    context2, sheared = makeContext(s, platformName, configure=shear(0.3))
    assert (sheared.getNumericalParameters()["gridDimensions"]
            == integrator.getNumericalParameters()["gridDimensions"])


@pytest.mark.onePrecision
@pytest.mark.parametrize("way", ["checkpoint", "state"])
@pytest.mark.parametrize("protocol, time", [(STEADY, 0.0), (OSCILLATORY, 9.0)])
def testRestartUnderShear(platformName, way, protocol, time):
    """To the bit, past flips, with the strain so far."""
    s = suspension()

    def make(seed=41):
        return makeContext(s, platformName, T, DT, forces=[repulsion(s)], seed=seed,
                           configure=shear(0.17, protocol, time))
    context, integrator = make()
    integrator.step(5)
    if way == "checkpoint":
        saved = context.createCheckpoint()
    else:
        state = context.getState(positions=True, velocities=True, parameters=True,
                                 integratorParameters=True)
        saved = openmm.XmlSerializer.serialize(state)
    expected, box, strain = run(context, integrator, 5), boxOf(context), integrator.getStrain()
    other, fresh = make()
    if way == "checkpoint":
        other.loadCheckpoint(saved)
    else:
        other.setState(openmm.XmlSerializer.deserialize(saved))
    assert fresh.getStrain() != 0
    assert np.array_equal(run(other, fresh, 5), expected)
    assert np.array_equal(boxOf(other), box) and fresh.getStrain() == strain


@pytest.mark.onePrecision
def testCopiesKeepTheProtocol():
    integrator = PSEBrownianIntegrator(T, scenes.ETA, 0.5, DT)
    integrator.setShearRate(0.1)
    integrator.setShearProtocol(OSCILLATORY, 4.5)
    text = openmm.XmlSerializer.serialize(integrator)
    again = PSEBrownianIntegrator.cast(openmm.XmlSerializer.deserialize(text))
    assert (again.getShearProtocol(), again.getShearTime()._value) == (OSCILLATORY, 4.5)
    # what was written before there were protocols
    old = text.replace('shearProtocol="1"', "").replace('shearTime="4.5"', "")
    assert old != text
    again = PSEBrownianIntegrator.cast(openmm.XmlSerializer.deserialize(old))
    assert (again.getShearProtocol(), again.getShearTime()._value) == (STEADY, 0.0)
    assert again.getShearRate()._value == 0.1


# ---------------------------------------------------------------- Forces see the sheared images

@pytest.mark.onePrecision
@pytest.mark.parametrize("still", [1, 3, 60])
def testForcesInAShearedBox(platformName, still):
    """
    Forces of a running, sheared Context are those of a new one at its positions and box: lists of
    neighbours have followed, even where no particle but one has moved and only images come nearer
    (one in `still` particles moves, the others have no mass).
    """
    s = suspension(9, 60, 0.25)
    masses = [100.0 if i % still == 0 else 0.0 for i in range(s.count)]
    nonbonded = openmm.NonbondedForce()
    nonbonded.setNonbondedMethod(openmm.NonbondedForce.CutoffPeriodic)
    nonbonded.setCutoffDistance(1.3)
    for i in range(s.count):
        nonbonded.addParticle(0.1*(-1)**i, 0.8, 1.0)
    custom = repulsion(s)
    custom.setCutoffDistance(1.3)

    def make(name):
        return makeContext(s, name, T, 0.2, forces=[copy.deepcopy(nonbonded), copy.deepcopy(custom)],
                           masses=masses, configure=shear(0.05))
    context, integrator = make(platformName)
    reference, _ = make("Reference")
    for _ in range(20):
        integrator.step(4)
        reference.setPeriodicBoxVectors(*boxOf(context))
        reference.setPositions(positionsOf(context))
        expected = scenes.forcesOf(reference)
        found = scenes.forcesOf(context)
        assert abs(found - expected).max() <= 1e-4*abs(expected).max()


def crowd(N):
    return scenes.idealGas(N, 0.2, barelyTilted(scenes.cube(1.0)), 0.5, 9)


@pytest.mark.onePrecision
def testListsFollowABoxBeneathParticlesThatStay(platformName):
    """Nothing moves but images, so that lists of neighbours that go by particles alone would be stale."""
    s = crowd(700)
    context, integrator = makeContext(s, platformName, masses=[0.0]*s.count, forces=[repulsion(s)],
                                      configure=shear(0.05, more=freeDraining))
    reference, _ = makeContext(s, "Reference", masses=[0.0]*s.count, forces=[repulsion(s)],
                               configure=freeDraining)
    for _ in range(4):
        integrator.step(6)
        assert abs(positionsOf(context) - s.positions).max() < 10*rounding(platformName)
        reference.setPeriodicBoxVectors(*boxOf(context))
        expected = scenes.forcesOf(reference)
        assert abs(scenes.forcesOf(context) - expected).max() <= 1e-4*abs(expected).max()


@pytest.mark.onePrecision
def testForcesOverManyFlips(platformName):
    """Past six flips and a new order of OpenMM's particles, which wraps them: forces and images are right."""
    s = crowd(300)

    def make(name):
        return makeContext(s, name, T, 0.1, forces=[repulsion(s)], configure=shear(0.2, more=freeDraining))
    context, integrator = make(platformName)
    reference, _ = make("Reference")
    for _ in range(6):
        integrator.step(49)
        before = positionsOf(context)
        integrator.step(1)
        x, v = positionsOf(context), scenes.velocitiesOf(context)
        assert abs(x - before - 0.1*v).max() < 20*rounding(platformName)
        reference.setPeriodicBoxVectors(*boxOf(context))
        reference.setPositions(x)
        expected = scenes.forcesOf(reference)
        assert abs(scenes.forcesOf(context) - expected).max() <= 1e-3*abs(expected).max()
    assert integrator.getStrain() == pytest.approx(6.0)
    assert abs(positionsOf(context)).max() > 5*s.box[0, 0]  # not wrapped


# ---------------------------------------------------------------- refusals

@pytest.mark.onePrecision
def testShearAndABarostatAreRefused(platformName):
    s = suspension()
    forces = [scenes.periodicDummyForce(s.count, s.box), openmm.MonteCarloBarostat(1.0, T)]
    message = messageOf(lambda: makeContext(s, platformName, T, forces=forces,
                                            configure=shear(0.1)))
    assertMentions(message, "setShearRate", "MonteCarloBarostat", "remove", "0")
    forces = [scenes.periodicDummyForce(s.count, s.box), openmm.MonteCarloBarostat(1.0, T)]
    context, integrator = makeContext(s, platformName, T, forces=forces)
    assertMentions(messageOf(integrator.setShearRate, 0.1), "MonteCarloBarostat", "remove")
    assert integrator.getShearRate()._value == 0
    integrator.step(1)


@pytest.mark.onePrecision
@pytest.mark.parametrize("arguments, words", [
    ((OSCILLATORY, 0.0), ["period", "0", "positive"]), ((STARTUP, np.inf), ["time", "inf"]),
    ((7, 1.0), ["shear protocol", "7"])])
def testProtocolsThatCannotBe(arguments, words):
    integrator = PSEBrownianIntegrator(T, scenes.ETA, 0.5, DT)
    assertMentions(messageOf(integrator.setShearProtocol, *arguments), *words)
    assert integrator.getShearProtocol() == STEADY


@pytest.mark.onePrecision
def testOnlyMasslessParticles(platformName):
    """Nothing moves, in whatever image, and the box of a periodic Force tilts all the same."""
    s = suspension()
    s = s.moved(np.outer(np.arange(s.count) % 3 - 1, s.box[1] + s.box[2]))
    context, integrator = makeContext(s, platformName, T, DT, masses=[0.0]*s.count,
                                      forces=[repulsion(s)], configure=shear(0.1))
    integrator.step(4)
    assert abs(positionsOf(context) - s.positions).max() < max(1e-6, rounding(platformName))
    assert boxOf(context)[1, 0] == pytest.approx(1e-3*s.box[0, 0] + 0.4*s.box[1, 1], rel=1e-5)
