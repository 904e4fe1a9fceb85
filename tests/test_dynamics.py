# SPDX-License-Identifier: MIT
"""
Steps: where particles go at zero temperature, and which distributions thermal ones produce.
Thresholds of statistical tests follow from scenes.FALSE_ALARM; seeds are fixed.
"""
import numpy as np
import openmm
import pytest
from scipy import stats

from oracle import mobilityMatrix
from openmmpse import PSEBrownianIntegrator
from platformnames import (contextOn, coordinateRounding, isDevice, isDirect, served,
                           velocityRounding)
import scenes
from scenes import (ETA, FALSE_ALARM, KB, Scene, forcesOf, makeContext, positionsOf,
                    randomForces, velocitiesOf, zScore)

T = 300.0
KT = KB*T


def freeDraining(integrator):
    integrator.setMobilityModel(PSEBrownianIntegrator.FreeDraining)


def assertVariance(values, expected, label):
    """The sum of n squared independent normals over their variance is chi-square with n degrees."""
    z = zScore(np.sum(np.square(values))/expected, np.size(values))
    ratio = np.mean(np.square(values))/expected
    limit = stats.norm.isf(FALSE_ALARM/2)
    assert abs(z) < limit, f"{label}: variance off by {z:.1f} sigma, ratio {ratio:.5f}"


def trajectory(context, integrator, frames, interval=1):
    """Positions (frames,N,3) after every interval steps."""
    out = np.empty((frames, *positionsOf(context).shape))
    for frame in out:
        integrator.step(interval)
        frame[:] = positionsOf(context)
    return out


# ---------------------------------------------------------------- zero temperature

@pytest.mark.parametrize("tolerance", [1e-3, 1e-7])
def testStepIsDtTimesVelocity(platformName, tolerance):
    """x moves by dt M f (to the rounding of x), v = displacement/dt, time and count go on."""
    tolerance = served(platformName, tolerance)
    # Velocities of a step and of applyMobility are the same but for rounding.
    places = max(1e-14, 2*coordinateRounding(platformName))
    numbers = 10*velocityRounding(platformName) if isDevice(platformName) else 1e-13
    s = scenes.randomSuspension(12, 0.1, scenes.tilted(1), 0.5, 201)
    context, integrator = makeContext(s, platformName, 0.0, 0.7, tolerance,
                                      forces=[scenes.constantForces(50*randomForces(s))])
    forces = forcesOf(context)
    for step in range(1, 4):
        start = positionsOf(context)
        u = integrator.applyMobility(forces)
        integrator.step(1)
        moved = positionsOf(context) - start
        far = abs(start).max()
        assert abs(moved - 0.7*u).max() < places*far + numbers*abs(moved).max()
        assert np.allclose(velocitiesOf(context), u, rtol=1e-12,
                           atol=places*far/0.7 + numbers*abs(u).max())
        assert context.getStepCount() == step
        assert context.getTime()._value == pytest.approx(0.7*step, rel=1e-12)


def testSedimentationFollowsTheOracle(platformName):
    """Three spheres fall past each other: 40 Euler steps with the dense mobility."""
    tolerance = 1e-5
    s = Scene(np.array([[0, 0, 0], [1.1, 0.2, 0.4], [2.3, -0.1, 0.0]]), scenes.cube(10.0), 0.5)
    forces = np.tile([0.0, 0.0, -60.0], (3, 1))
    context, integrator = makeContext(s, platformName, 0.0, 2.0, tolerance,
                                      forces=[scenes.constantForces(forces)])
    integrator.step(40)
    expected = s.positions.copy()
    for _ in range(40):
        M = mobilityMatrix(expected, s.box, s.radius, ETA)
        expected = expected + 2.0*(M @ forces.ravel()).reshape(-1, 3)
    travelled = np.linalg.norm(expected - s.positions)
    assert travelled > 1.5   # three radii: far enough for the order of the three to matter
    assert np.linalg.norm(positionsOf(context) - expected) < 3*tolerance*travelled


@pytest.mark.onePrecision
def testOnlyIntegrationForceGroupsAct(platformName):
    s = scenes.pair(1.4, 8.0, 0.5)
    pull = 1000.0*np.array([[1, 0, 0], [0, 1, 0]])
    first = scenes.constantForces(pull)
    second = scenes.constantForces([[0, 0, 5000], [0, 0, 5000]])
    second.setForceGroup(3)
    context, integrator = makeContext(s, platformName, 0.0, 1.0, forces=[first, second],
                                      configure=lambda i: i.setIntegrationForceGroups({0}))
    start = positionsOf(context)
    u = integrator.applyMobility(pull)
    integrator.step(1)
    rounding = 2*coordinateRounding(platformName)*abs(start).max()
    assert np.allclose(positionsOf(context) - start, u, atol=max(1e-14, rounding),
                       rtol=max(1e-9, 10*velocityRounding(platformName)))


@pytest.mark.parametrize("model", ["RotnePragerYamakawa", "FreeDraining"])
def testMasslessParticlesStayWhereTheyAre(platformName, model):
    """Massless particles are pulled like the others and do not move a bit; virtual sites follow."""
    s = scenes.randomSuspension(9, 0.05, scenes.cube(1), 0.5, 202)
    masses = [0.0 if i in (2, 5, 8) else 10.0 for i in range(9)]
    integrator = PSEBrownianIntegrator(T, ETA, s.radius, 2.0)
    integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
    integrator.setMobilityModel(getattr(PSEBrownianIntegrator, model))
    system = scenes.makeSystem(s, [scenes.constantForces(20*randomForces(s))], masses)
    system.setVirtualSite(8, openmm.TwoParticleAverageSite(0, 1, 0.25, 0.75))
    context = contextOn(platformName, system, integrator)
    context.setPositions(s.positions)
    context.computeVirtualSites()
    start = positionsOf(context)
    integrator.step(5)
    x = positionsOf(context)
    assert np.array_equal(x[[2, 5]], start[[2, 5]])
    assert np.allclose(x[8], 0.25*x[0] + 0.75*x[1], rtol=0,
                       atol=max(1e-12, 4*coordinateRounding(platformName)*abs(x).max()))
    mobile = [0, 1, 3, 4, 6, 7]
    assert np.all(x[mobile] != start[mobile])
    assert not np.any(velocitiesOf(context)[[2, 5]])


@pytest.mark.onePrecision
# ---------------------------------------------------------------- one particle

def testFreeDiffusion(platformName):
    """
    One sphere in a cube of side 20a: D = 0.85865872 D0 exactly, in every direction and at every
    lag. 9000 numbers resolve 1.5 % of D at one sigma; the finite-size effect is 14 %.
    """
    s = Scene(np.array([[1.0, 2.0, 3.0]]), scenes.cube(10.0), 0.5)
    dt, lag = 5.0, 16
    context, integrator = makeContext(s, platformName, T, dt, 1e-3)
    x = trajectory(context, integrator, 3000)[:, 0]
    D = 0.85865872*KT*s.mu0
    steps = np.diff(np.vstack([s.positions, x]), axis=0)
    for axis in range(3):
        assertVariance(steps[:, axis], 2*D*dt, f"steps along axis {axis}")
    assertVariance(steps, 2*D*dt, "steps")
    assertVariance(x[lag::lag] - x[:-lag:lag], 2*D*dt*lag, f"displacements over {lag} steps")


@pytest.mark.onePrecision
@pytest.mark.parametrize("product", [1.0, 0.5])
def testTetheredParticleHasTheExactDiscreteVariance(platformName, product):
    """
    A constant mobility mu and a spring k: Euler steps make x(n+1) = (1 - mu k dt) x(n) + noise, of
    variance exactly kT/k/(1 - mu k dt/2) and correlation 1 - mu k dt from step to step: twice, or
    4/3 of, what Boltzmann says. Frames far enough apart to be independent; 4500 numbers resolve
    2 % of it.
    """
    a, L, dt = 0.5, 6.0, 10.0
    s = Scene(np.zeros((1, 3)), scenes.cube(L), a)
    mu = s.mu0*(1 - 2.8372974794806*a/L + 4*np.pi/3*(a/L)**3)
    k = product/(mu*dt)
    spring = openmm.CustomExternalForce("0.5*k*(x*x+y*y+z*z)")
    spring.addGlobalParameter("k", k)
    spring.addParticle(0, [])
    context, integrator = makeContext(s, platformName, T, dt, 1e-4, forces=[spring])
    interval = 1 if product == 1.0 else 8      # 0.5^8: a correlation of 0.004
    x = trajectory(context, integrator, 1550, interval)[50:, 0]
    variance = KT/k/(1 - product/2)
    assertVariance(x, variance, f"mu k dt = {product}")
    if product == 1.0:
        # Products of successive independent normals: mean 0, variance 1.
        score = np.sum(x[1:]*x[:-1])/variance/np.sqrt(x[1:].size)
        assert abs(score) < stats.norm.isf(FALSE_ALARM/2), f"step to step: {score:.1f} sigma"


# ---------------------------------------------------------------- dumbbells

def dumbbells(count, k, phi, a, seed):
    """Pairs in a cube, their separations from Boltzmann's distribution for a spring of length 0."""
    rng = np.random.default_rng(seed)
    L = (2*count*4*np.pi/3*a**3/phi)**(1/3)
    first = rng.uniform(0, L, (count, 3))
    second = first + rng.normal(size=(count, 3))*np.sqrt(KT/k)
    return Scene(np.stack([first, second], axis=1).reshape(-1, 3), scenes.cube(L), a)


@pytest.mark.onePrecision
def testFreeDrainingDumbbellsHaveTheExactDiscreteVariance(platformName):
    """Constant relative mobility 2 mu0: kT/k/(1 - mu k dt/2) again, with independent copies."""
    a, product, dt = 0.5, 0.8, 4.0
    k = product/(2*dt/(6*np.pi*ETA*a))
    s = dumbbells(3000, k, 0.01, a, 203)
    bonds = [(2*i, 2*i + 1) for i in range(3000)]
    context, integrator = makeContext(s, platformName, T, dt, configure=freeDraining,
                                      forces=[scenes.harmonicBonds(bonds, 0.0, k)])
    integrator.step(12)                        # 0.2^24 of the initial variance is left
    x = positionsOf(context)
    assertVariance(x[0::2] - x[1::2], KT/k/(1 - product/2), "free-draining dumbbells")


def meanSquareSeparation(platformName, count, k, dt, steps, a):
    """k <r^2>/(3 kT) and its squared standard error (50 blocks), after a start-up of a tenth."""
    s = dumbbells(count, k, 0.05, a, 204)
    bonds = [(2*i, 2*i + 1) for i in range(count)]
    context, integrator = makeContext(s, platformName, T, dt, 1e-2,
                                      forces=[scenes.harmonicBonds(bonds, 0.0, k)])
    integrator.step(steps//10)
    x = trajectory(context, integrator, 50*(steps//50))
    r2 = np.sum((x[:, 0::2] - x[:, 1::2])**2, axis=2).mean(axis=1)*k/(3*KT)
    blocks = r2.reshape(50, -1).mean(axis=1)
    return blocks.mean(), blocks.var(ddof=1)/50


@pytest.mark.hostOnly
def testDumbbellExtrapolatesToBoltzmann(platformName):
    """
    Springs of zero length with rms separation 3a, so that overlap, touching and distance all count:
    k <r^2>/(3 kT) -> 1 as dt -> 0. At 2 mu0 k dt = 0.8, 0.4, 0.2 it is 1.333, 1.127, 1.055 (a
    simulation of 3e5 free copies): the parabola through the three inverse values misses 1 by
    0.25 %. Dumbbells in one box interact through the fluid, which changes no equilibrium.
    Errors from blocks much longer than the relaxation time; Student's t with 50 degrees.
    """
    a = 0.5
    k = 3*KT/(3*a)**2
    mu0 = 1/(6*np.pi*ETA*a)
    count, steps, allowed = ((6, (1200, 2400, 4800), 0.07) if isDirect(platformName) else
                             (120, (400, 800, 1600), 0.025) if isDevice(platformName) else
                             (60, (800, 1600, 3200), 0.025))
    products = np.array([0.8, 0.4, 0.2])
    results = [meanSquareSeparation(platformName, count, k, product/(2*mu0*k), n, a)
               for product, n in zip(products, steps)]
    # Lagrange weights of the parabola through three points, at 0.
    weights = [np.prod([q/(q - p) for q in products if q != p]) for p in products]
    limit = sum(w/mean for w, (mean, variance) in zip(weights, results))
    error = np.sqrt(sum(w*w*variance/mean**4 for w, (mean, variance) in zip(weights, results)))
    assert error < allowed, f"too few steps: {error}"
    score = (abs(limit - 1) - 0.004)/error
    assert score < stats.t.isf(FALSE_ALARM/2, 50), f"inverse limit {limit:.4f} +- {error:.4f}, from {results}"
    # The error of the largest step is there, and of first order.
    assert results[0][0] - 1 > 0.15


# ---------------------------------------------------------------- against OpenMM

def quarticWell(N):
    force = openmm.CustomExternalForce("20*(x^2+y^2+z^2)^2")
    for i in range(N):
        force.addParticle(i, [])
    return force


@pytest.mark.onePrecision
@pytest.mark.parametrize("inWell", [True, False])
def testFreeDrainingIsBrownianIntegrator(platformName, inWell):
    """
    With mass * friction = 6 pi eta a the two make the same steps, apart from the random numbers:
    8000 particles from one point, 15 steps. Kolmogorov-Smirnov sees 6 % in width, the ratio of
    variances of free particles 5 %.
    """
    N, a, dt, mass = 8000, 0.5, 3.0, 40.0
    s = Scene(np.tile([0.3, -0.2, 0.1], (N, 1)), scenes.cube(20.0), a)
    forces = [quarticWell(N)] if inWell else []
    context, integrator = makeContext(s, platformName, T, dt, forces=forces, configure=freeDraining,
                                      masses=[mass]*N)
    integrator.step(15)
    ours = positionsOf(context)
    standard = openmm.BrownianIntegrator(T, 6*np.pi*ETA*a/mass, dt)
    standard.setRandomNumberSeed(3)
    other = contextOn(platformName, scenes.makeSystem(
        s, [quarticWell(N)] if inWell else [], [mass]*N), standard)
    other.setPositions(s.positions)
    standard.step(15)
    theirs = positionsOf(other)
    for x, y, name in [(ours[:, i], theirs[:, i], "xyz"[i]) for i in range(3)] + [
            (np.linalg.norm(ours, axis=1), np.linalg.norm(theirs, axis=1), "r")]:
        p = stats.ks_2samp(x, y, method="asymp").pvalue
        assert p > FALSE_ALARM/4, f"distributions of {name} differ: p = {p:.1e}"
    if not inWell:
        moved, standardMoved = ours - s.positions, theirs - s.positions
        assertVariance(moved, 2*KT*s.mu0*dt*15, "free draining")
        ratio = np.sum(moved**2)/np.sum(standardMoved**2)
        n = 3*N
        assert stats.f.isf(1 - FALSE_ALARM/2, n, n) < ratio < stats.f.isf(FALSE_ALARM/2, n, n)
