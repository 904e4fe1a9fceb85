# SPDX-License-Identifier: MIT
"""
The stress of the particles and its parts [T46]-[T49], against sums over pairs, OpenMM's own pressure
and the stresslet of a sphere. Default boxes are tilted, because devices shear no rectangular one.
"""
import numpy as np
import openmm
import pytest

import scenes
from openmm import unit
from openmmpse import PSEBrownianIntegrator
from scenes import ETA, KB, Scene, makeContext, positionsOf
from test_bad_input import assertMentions, messageOf

IDEAL, PAIRS, FLOW, TOTAL = (PSEBrownianIntegrator.IdealStress,
                             PSEBrownianIntegrator.InterparticleStress,
                             PSEBrownianIntegrator.HydrodynamicStress,
                             PSEBrownianIntegrator.TotalStress)
STRESS_UNIT = unit.kilojoule_per_mole/unit.nanometer**3
T, DT = 300.0, 0.5


def tilted(L):
    return L*np.array([[1, 0, 0], [0.2, 1, 0], [-0.3, 0.4, 1]])


def stressOf(integrator, *arguments):
    return integrator.computeStress(*arguments).value_in_unit(STRESS_UNIT)


def volumeOf(scene):
    return np.prod(np.diag(scene.box))


def energyError(platformName):
    """Of a stress, over |U|/V and the stress itself: rounding of energies over the strain."""
    return 1e-8 if platformName == "Reference" or "double" in platformName else 1e-4


def assertStress(found, expected, platformName, energyDensity):
    scale = abs(energyDensity) + abs(expected).max()
    assert found.shape == (3, 3) and np.array_equal(found, found.T)
    assert abs(found - expected).max() <= energyError(platformName)*scale


def repulsion(scene, sigma=1.0, epsilon=3.0):
    """WCA: the force vanishes at the cut-off, and so does the energy."""
    force = openmm.CustomNonbondedForce(f"4*{epsilon}*(({sigma}/r)^12-({sigma}/r)^6)+{epsilon}")
    force.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    force.setCutoffDistance(2**(1/6)*sigma)
    for _ in range(scene.count):
        force.addParticle([])
    return force


def sumOverPairs(scene, sigma=1.0, epsilon=3.0):
    """Stress and energy of WCA spheres by the nearest images of all pairs."""
    i, j = np.triu_indices(scene.count, 1)
    r = scenes.nearestImages(scene.positions[i] - scene.positions[j], scene.box)
    d = np.linalg.norm(r, axis=1)
    near = d < 2**(1/6)*sigma
    r, s = r[near], (sigma/d[near])**6
    slope = 4*epsilon*(-12*s*s + 6*s)/d[near]
    stress = np.einsum("p,pi,pj->ij", slope/d[near], r, r)/volumeOf(scene)
    return stress, np.sum(4*epsilon*(s*s - s) + epsilon)


def flow(rate, protocol=PSEBrownianIntegrator.SteadyShear, time=0.0):
    def configure(i):
        i.setShearRate(rate)
        i.setShearProtocol(protocol, time)
    return configure


# ---------------------------------------------------------------- each part

def testADumbbell(platformName):
    """
    k (r - r0) r r/(r V), exactly, its bond reaching across a face; stretched along x + y, the xy
    entry is positive, as in a flow of positive rate.
    """
    k, r0 = 40.0, 1.125  # exact in single precision, in which devices keep them
    for direction in ([1, 1, 0], [0.3, -0.5, 0.8]):
        arm = 1.7*np.array(direction)/np.linalg.norm(direction)
        s = Scene(np.array([[4.9, 4.8, 0.2], [4.9, 4.8, 0.2] + arm]), tilted(5.0), 0.4)
        context, integrator = makeContext(s, platformName,
                                          forces=[scenes.harmonicBonds([(0, 1)], r0, k)])
        expected = k*(1.7 - r0)*np.outer(arm, arm)/1.7/volumeOf(s)
        energy = 0.5*k*(1.7 - r0)**2
        assertStress(stressOf(integrator, PAIRS), expected, platformName, energy/volumeOf(s))
        if direction[2] == 0:
            assert stressOf(integrator)[0, 1] > 0.4*k*(1.7 - r0)*1.7/volumeOf(s)


def testAFluidOfRepulsiveSpheres(platformName):
    """Sums over pairs with their nearest images, in a tilted box."""
    s = scenes.idealGas(60, 0.25, tilted(1.0), 0.5, 4)
    # overlaps relaxed: the energy of a liquid, not of a collision
    context, integrator = makeContext(s, "Reference", stepSize=0.01,
                                      forces=[repulsion(s, 0.95, 3.0)])
    openmm.LocalEnergyMinimizer.minimize(context, 2000.0)
    s = Scene(positionsOf(context), s.box, s.radius)
    context, integrator = makeContext(s, platformName, T, forces=[repulsion(s)])
    expected, energy = sumOverPairs(s)
    assert np.trace(expected) < 0 and energy > 1
    assertStress(stressOf(integrator, PAIRS), expected, platformName, energy/volumeOf(s))


def pressureOfOpenMM(scene, charges, platformName, N):
    """
    A Context with charges by particle mesh Ewald and bonds across faces, between nearest images of
    0 and 1, 2 and 3 ... of N, and the diagonal entries of the pressure that OpenMM's flexible
    barostat computes.
    """
    nonbonded = openmm.NonbondedForce()
    nonbonded.setNonbondedMethod(openmm.NonbondedForce.PME)
    nonbonded.setEwaldErrorTolerance(1e-5)  # at the cut-off charges jump by that
    nonbonded.setCutoffDistance(2.2)
    nonbonded.setUseSwitchingFunction(True)
    nonbonded.setSwitchingDistance(1.5)
    for charge in charges:
        nonbonded.addParticle(charge, 0.9, 0.5)
    bonds = openmm.HarmonicBondForce()
    bonds.setUsesPeriodicBoundaryConditions(True)
    for i in range(0, scene.count, 2):
        others = np.arange((i + 1) % N, scene.count, N)  # the same particle of each copy
        gaps = scenes.nearestImages(scene.positions[others] - scene.positions[i], scene.box)
        bonds.addBond(i, int(others[np.argmin(np.linalg.norm(gaps, axis=1))]), 1.0, 5.0)
    barostat = openmm.MonteCarloFlexibleBarostat(1.0, T, 0, False)
    context, integrator = makeContext(scene, platformName, forces=[nonbonded, bonds, barostat])
    bar = (1*unit.bar*unit.AVOGADRO_CONSTANT_NA).value_in_unit(STRESS_UNIT)
    pressure = barostat.computeCurrentPressure(context)[:3]
    return context, integrator, bar*np.array([getattr(p, "_value", p) for p in pressure])


@pytest.mark.hostOnly
def testAgainstOpenMMsBarostat(platformName):
    """
    The pressure of OpenMM on the faces of a cube, and on those of two such cubes in a box that is
    turned by 45 degrees: (xx + yy)/2 + xy and (xx + yy)/2 - xy.
    """
    s = scenes.randomSuspension(14, 0.06, scenes.cube(1.0), 0.5, 21)
    charges = 0.5*(-1.0)**np.arange(s.count)
    context, integrator, pressure = pressureOfOpenMM(s, charges, platformName, s.count)
    found = stressOf(integrator, PAIRS)
    energy = context.getState(energy=True).getPotentialEnergy()._value
    # of forces by meshes, and theirs is a plain central difference by 1e-3
    error = (1e-4 if platformName == "Reference" else 1e-3)*(abs(energy)/volumeOf(s) + abs(found).max())
    assert abs(np.diag(found) + pressure).max() <= error
    L = s.box[0, 0]
    turn = np.array([[1, 1, 0], [-1, 1, 0], [0, 0, np.sqrt(2)]])/np.sqrt(2)
    double = Scene(np.concatenate([s.positions, s.positions + [L, 0, 0]]) @ turn.T,
                   np.diag([np.sqrt(2)*L, np.sqrt(2)*L, L]), s.radius)
    turned = pressureOfOpenMM(double, np.tile(charges, 2), platformName, s.count)[2]
    expected = -np.array([turned[0], turned[1]])
    assert abs(np.diag(turn @ found @ turn.T)[:2] - expected).max() <= error
    assert abs(found[0, 1]) > 20*error


def testIdealAndHydrodynamicParts(platformName):
    """-n kT of the particles that move, and (20/3) pi eta a^3 E/V: Einstein's 5/2 phi 2 eta E."""
    s = scenes.mixture([0.5, 0.5, 0.8, 0.3], 0.1, tilted(1.0), 9, apart=True)
    context, integrator = makeContext(s, platformName, T, masses=[1.0, 1.0, 1.0, 0.0])
    V = volumeOf(s)
    assert np.allclose(stressOf(integrator, IDEAL), -3*KB*T/V*np.eye(3), rtol=1e-12, atol=0)
    assert not stressOf(integrator, FLOW).any() and not stressOf(integrator, PAIRS).any()
    assert np.array_equal(stressOf(integrator), stressOf(integrator, IDEAL))
    integrator.setShearRate(0.02)
    phi = 4*np.pi/3*np.sum(s.radii[:3]**3)/V
    strainRate = 0.01*np.array([[0, 1, 0], [1, 0, 0], [0, 0, 0]])
    expected = 2.5*phi*2*ETA*strainRate
    assert np.allclose(stressOf(integrator, FLOW), expected, rtol=1e-12, atol=0)
    assert np.allclose(stressOf(integrator, IDEAL | FLOW), expected - 3*KB*T/V*np.eye(3), rtol=1e-12)


@pytest.mark.hostOnly
@pytest.mark.parametrize("protocol, time, rateAfter", [
    (PSEBrownianIntegrator.OscillatoryShear, 7.0, lambda t: np.cos(2*np.pi*t/7.0)),
    (PSEBrownianIntegrator.StartUpShear, 1.2, lambda t: float(t >= 1.2))])
def testHydrodynamicPartFollowsTheProtocol(platformName, protocol, time, rateAfter):
    s = Scene(np.array([[1.0, 2.0, 3.0]]), scenes.cube(6.0), 0.5)
    context, integrator = makeContext(s, platformName, stepSize=DT, configure=flow(0.1, protocol, time))
    for step in range(5):
        expected = 20*np.pi/3*ETA*0.5**3/volumeOf(s)*0.05*rateAfter(step*DT)
        assert stressOf(integrator, FLOW)[0, 1] == pytest.approx(expected, rel=1e-9, abs=1e-12)
        integrator.step(1)


@pytest.mark.onePrecision
def testTheSumAndTheGroups(platformName):
    """The total is the sum of its parts; force groups choose among Forces, as the integrator's do."""
    s = scenes.randomSuspension(8, 0.1, tilted(1.0), 0.5, 2)
    near, far = (scenes.harmonicBonds([(0, 1), (2, 3)], 0.5, k) for k in (2.0, 30.0))
    far.setForceGroup(3)
    context, integrator = makeContext(s, platformName, T, forces=[near, far])
    parts = [stressOf(integrator, part) for part in (IDEAL, PAIRS, FLOW)]
    assert np.allclose(stressOf(integrator), sum(parts), rtol=1e-9)
    assert np.array_equal(stressOf(integrator, TOTAL), stressOf(integrator))
    one, other = stressOf(integrator, PAIRS, {0}), stressOf(integrator, PAIRS, 1 << 3)
    both = abs(parts[1]).max()
    assert abs(one + other - parts[1]).max() < 1e-3*both
    assert abs(15*one - other).max() < 1e-3*both and abs(one).max() > 0.01*both
    integrator.setIntegrationForceGroups({0})
    assert np.array_equal(stressOf(integrator, PAIRS), stressOf(integrator, PAIRS, {0}))


# ---------------------------------------------------------------- nothing is left behind

def testNothingIsChanged(platformName):
    """Checkpoints are the same to the bit before and after, and so are the steps that follow."""
    s = scenes.randomSuspension(16, 0.1, tilted(1.0), 0.5, 2)
    paths = []
    for measure in (False, True):
        context, integrator = makeContext(s, platformName, T, DT, forces=[
            scenes.harmonicBonds([(0, 1), (2, 3)], 0.5, 20.0), scenes.periodicDummyForce(16, s.box)])
        integrator.step(3)
        if measure:
            before = context.createCheckpoint()
            stressOf(integrator)
            assert context.createCheckpoint() == before
        integrator.step(3)
        paths.append(positionsOf(context))
    assert np.array_equal(*paths)


def testAForceThatFails(platformName):
    """In the strained box its cut-off is too long: refused, and nothing is changed."""
    s = scenes.randomSuspension(16, 0.1, tilted(1.0), 0.5, 2)
    force = repulsion(s)
    force.setCutoffDistance(0.49999*np.diag(s.box).min())
    context, integrator = makeContext(s, platformName, T, DT, forces=[force])
    integrator.step(3)
    before = context.createCheckpoint()
    assertMentions(messageOf(integrator.computeStress), "computeStress", "strained", "cutoff")
    assert context.createCheckpoint() == before
    integrator.step(1)


# ---------------------------------------------------------------- refusals

@pytest.mark.onePrecision
@pytest.mark.parametrize("parts, kind, words", [
    (0, openmm.OpenMMException, ["parts", "0", "[1, 7]"]), (8, openmm.OpenMMException, ["8"]),
    ("all", TypeError, ["parts", "integer"])])
def testPartsThatAreNone(platformName, parts, kind, words):
    s = scenes.pair(2.0, 6.0, 0.5)
    context, integrator = makeContext(s, platformName)
    assertMentions(messageOf(integrator.computeStress, parts, kinds=(kind,)), *words)


@pytest.mark.onePrecision
def testThereMustBeAVolumeAndPositions(platformName):
    s = scenes.pair(2.0, 6.0, 0.5)
    context, integrator = makeContext(s, platformName, boundary=PSEBrownianIntegrator.Unbounded)
    assertMentions(messageOf(integrator.computeStress), "volume", "setFluidBoundary(Periodic)")
    alone = PSEBrownianIntegrator(T, ETA, 0.5, DT)
    assertMentions(messageOf(alone.computeStress), "computeStress", "Context")


@pytest.mark.onePrecision
@pytest.mark.deviceOnly
def testARectangularBoxOfADevice(platformName):
    """Refused with the remedy; the parts that need no strain are there."""
    s = scenes.pair(2.0, 6.0, 0.5)
    context, integrator = makeContext(s, platformName, T)
    assertMentions(messageOf(integrator.computeStress), "rectangular", "setDefaultPeriodicBoxVectors")
    assert stressOf(integrator, IDEAL)[0, 0] == pytest.approx(-2*KB*T/216)
