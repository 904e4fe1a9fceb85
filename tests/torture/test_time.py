# SPDX-License-Identifier: MIT
"""
Long times: equilibrium means of a melt of chains against Monte Carlo, what must not depend on
numerical parameters, memory, and the counter of steps beyond 32 bits. Restarts in mid-run are in
test_restart.py.
"""
import functools
import os

import numpy as np
import openmm
import pytest

import scenes
from openmmpse import PSEBrownianIntegrator
from platformnames import isDevice, isDirect
from polymers import NAMES, Melt, assertAgree, blocked, combined, deviation
from scenes import FALSE_ALARM, KB, makeContext, positionsOf
from test_contact import RADIUS, barkerHenderson, nearlyHard

SMALL, LARGE = Melt(chains=4, beads=5), Melt(chains=20, beads=10)
PRODUCT = 0.05 # of stiffness of a bond, mobility of a bead and the smaller time step
TOLERANCE = 1e-2


# ---------------------------------------------------------------- equilibrium

@functools.cache
def monteCarlo(melt, long):
    """Means, and configurations to start from."""
    if melt.count > 50:
        return melt.equilibrium(64, 400, 10, 741)
    return melt.equilibrium(1000 if long else 300, 400 if long else 120, 5, 742)


def series(melt, start, platformName, product, steps, interval, seed):
    """What is observed every so many steps, {name: (frames,)}, and the Context with its integrator."""
    context, integrator = makeContext(melt.scene(start), platformName, melt.temperature, melt.stepSize(product),
                                      TOLERANCE, seed=seed, forces=melt.forces())
    integrator.step(steps//10)
    frames = np.empty((steps//interval, melt.count, 3))
    for frame in frames:
        integrator.step(interval)
        frame[:] = positionsOf(context)
    parts = [melt.observed(part) for part in np.array_split(frames, max(1, frames.size//1_000_000))]
    return {name: np.concatenate([part[name] for part in parts]) for name in NAMES}, context, integrator


def amountOf(platformName, long):
    """(melt, steps at PRODUCT, steps at twice that, steps from frame to frame)"""
    if platformName == "CPU":
        return (LARGE, 1_000_000, 250_000, 50) if long else (SMALL, 6000, 3000, 4)
    if long:
        return SMALL if isDirect(platformName) else LARGE, 10_000, 4000, 10
    return SMALL, 1200 if isDirect(platformName) else 640, 480, 4


@pytest.mark.onePrecision
def testEquilibrium(platformName, hardCase):
    """
    Chains in a box, harmonic bonds, soft repulsion between all beads: on CPU 200 beads and one million
    steps (in the short form 20 beads and 6000), 1e4 steps on the other platforms.

    Mean square bonds, radius of gyration, energy and osmotic pressure, extrapolated to no time step
    from two step sizes, are those of a Metropolis Monte Carlo of the same potential within the error
    bars of both, and do not drift: the second half of the run agrees with the first, and so does the last third;
    all deviations together exceed them with a probability of 1e-6.
    """
    melt, steps, fewer, interval = amountOf(platformName, hardCase.long)
    expected, starts = monteCarlo(melt, hardCase.long)
    fine, context, integrator = series(melt, starts[0], platformName, PRODUCT, steps, interval, 743)
    coarse, _, _ = series(melt, starts[1], platformName, 2*PRODUCT, fewer, interval, 744)
    # A(dt) = A + c dt + O(dt^2): what is left is of the order of (dt times the largest relaxation rate)^2.
    blocks = 32 if steps > 5000 else 8
    differences = {name: combined((2, blocked(fine[name], blocks)), (-1, blocked(coarse[name], blocks)),
                                  (-1, expected[name])) for name in NAMES}
    drifts = driftsOf(fine, blocks)
    comparisons = len(differences) + len(drifts)
    hardCase.measure(**{"largest deviation (sigma)": assertAgree(differences, comparisons),
                        "largest drift (sigma)": assertAgree(drifts, comparisons, "drift of")})
    for name in NAMES:
        tellRelative(hardCase, name, differences[name], expected[name][0])
        tellRelative(hardCase, f"{name}, second half less first", drifts[name, "halves"], expected[name][0])
    assertPressure(melt, context, integrator)


def driftsOf(fine, blocks):
    """What the second half of a run has more than the first, and the last third more than the first."""
    drifts = {}
    for name in NAMES:
        for label, parts in (("halves", 2), ("thirds", 3)):
            cut = np.array_split(fine[name], parts)
            first, last = (blocked(part, max(3, blocks//parts)) for part in (cut[0], cut[-1]))
            drifts[name, label] = combined((1, last), (-1, first))
    return drifts


def tellRelative(case, name, difference, scale):
    """A difference as above, and the smallest one that would stand out by 5 standard deviations."""
    mean, variance, _ = difference
    case.measure(**{f"{name}: relative error": float(mean/scale),
                    f"{name}: would be seen from (5 sigma)": float(abs(5*np.sqrt(variance)/scale))})


def assertPressure(melt, context, integrator):
    """The virial of the sums here is that of the library, to what it makes of energies in floats."""
    if isDevice(context.getPlatform().getName()):
        return # a rectangular default box is not strained there
    ideal = melt.count*melt.kT/melt.edge**3
    pressure = -np.trace(integrator.computeStress()._value)/3/ideal
    assert abs(pressure - melt.observed(positionsOf(context)[None])["pressure"][0]) < 1e-3


@pytest.mark.onePlatform
def testPressureOfNearlyHardSpheres(hardCase):
    """
    60 nearly hard spheres (36th power, 20 kT at 1.9 a) at a volume fraction of 0.2 on CPU, 3e5 steps of
    1e-4 a^2/D (short form: 1e4).

    The osmotic pressure beyond the ideal one is that of Carnahan and Starling for spheres of the diameter
    of Barker and Henderson, to 3 % (for that mapping and for the time step) and error bars (false alarm
    1e-6).
    """
    steepness, reach, kT = 36, 2.4, KB*300.0
    phi = 0.2*(barkerHenderson(steepness, reach)/2)**3
    beyond = (1 + phi + phi**2 - phi**3)/(1 - phi)**3 - 1
    dilute, N = scenes.randomSuspension(60, 0.16, scenes.cube(1), RADIUS, 755), 60
    shrunk = (0.16/0.2)**(1/3)
    scene = scenes.Scene(dilute.positions*shrunk, dilute.box*shrunk, RADIUS)
    tick = RADIUS**2/(kT*scene.mu0)
    context, integrator = makeContext(scene, "CPU", 300.0, 5e-6*tick, TOLERANCE, forces=[nearlyHard(scene)])
    integrator.step(500)
    integrator.setStepSize(1e-4*tick)
    steps = 300_000 if hardCase.long else 10_000
    integrator.step(steps//10)
    virials, edge = [], scene.box[0, 0]/RADIUS
    first, second = np.triu_indices(N, 1)
    for _ in range(steps//10):
        integrator.step(10)
        x = positionsOf(context)/RADIUS
        between = x[first] - x[second]
        between -= edge*np.rint(between/edge)
        distances = np.linalg.norm(between, axis=1)
        near = distances[distances < reach]
        virials.append(np.sum(steepness*20*(1.9/near)**steepness)/(3*N))
    mean, variance, degrees = blocked(virials, 32 if hardCase.long else 16)
    hardCase.measure(**{"measured": float(mean), "Carnahan-Starling": float(beyond),
                        "relative difference would be seen from (5 sigma)": float(0.03 + 5*np.sqrt(variance)/beyond)})
    away = (max(0.0, abs(mean - beyond) - 0.03*beyond), variance, degrees)
    assert deviation(away) < scenes.stats.norm.isf(FALSE_ALARM/2)


def testMonteCarloOfIdealChains():
    """Without repulsion: <bond^2> = 3 s^2, <Rg^2> = 3 s^2 (n^2 - 1)/6n, as many pressures as chains."""
    melt = Melt(chains=4, beads=5, height=0.0)
    found, _ = melt.equilibrium(300, 150, 5, 745)
    exact = {"bond^2": 3*melt.spread**2, "radius of gyration^2": 3*melt.spread**2*24/30, "pressure": 1/5}
    for name, value in exact.items():
        assert abs(deviation(found[name], value)) < scenes.stats.norm.isf(FALSE_ALARM/6), name
        assert np.sqrt(found[name][1]) < 0.03*value


# ---------------------------------------------------------------- numerical parameters

@pytest.mark.onePrecision
def testParametersOfTheFluid(platformName, hardCase):
    """
    The same chains with splitting parameters of 0.6 and 1.5 times the automatic one and tolerances of
    1e-2 to 1e-4, everything else alike.

    Mean energy, radius of gyration and diffusion coefficient agree with those of the first within
    error bars (false alarm 1e-6 for all together).
    """
    melt = SMALL
    steps = (50_000 if platformName == "CPU" else 10_000) if hardCase.long else 1600 if platformName == "CPU" else 320
    start = monteCarlo(melt, hardCase.long)[1][2]
    results = []
    variants = [(1e-2, 1.0), (1e-2, 0.6), (1e-4, 1.5), (1e-3, 1.0)]
    if not hardCase.long:
        variants = variants[:3]
    for number, (tolerance, factor) in enumerate(variants):
        results.append(longRun(melt, start, platformName, tolerance, factor, steps, 750 + number))
    first = results[0]
    comparisons = len(first)*(len(results) - 1)
    for (tolerance, factor), other in zip(variants[1:], results[1:]):
        differences = {name: combined((1, other[name]), (-1, first[name])) for name in first}
        label = f"tolerance {tolerance:g}, xi times {factor:g}"
        hardCase.measure(**{"largest deviation (sigma)": assertAgree(differences, comparisons, label)})
    mean, variance, _ = first["diffusion"]
    hardCase.measure(**{"diffusion/D0": float(mean),
                        "diffusion: difference would be seen from (5 sigma)": float(5*np.sqrt(2*variance)/mean)})


def longRun(melt, start, platformName, tolerance, factor, steps, seed):
    """{energy of a bead (kT), radius of gyration^2, diffusion coefficient of beads over that of one alone}"""
    # Long steps, whose bias is that of all alike: a block is several relaxation times of a chain then.
    dt, lag, blocks = melt.stepSize(6*PRODUCT), 4, 8

    def contextWith(xi):
        return makeContext(melt.scene(start), platformName, melt.temperature, dt, tolerance, seed=seed,
                           forces=melt.forces(),
                           configure=lambda i: xi and i.setNumericalParameters({"split": "Hasimoto", "xi": xi}))

    context, integrator = contextWith(0)
    if factor != 1:
        context, integrator = contextWith(factor*integrator.getNumericalParameters()["xi"])
    integrator.step(steps//10)
    frames, energies = np.empty((steps//lag, melt.count, 3)), np.empty(steps//lag)
    for i, frame in enumerate(frames):
        integrator.step(lag)
        frame[:] = positionsOf(context)
        energies[i] = context.getState(energy=True).getPotentialEnergy()._value
    moved = np.diff(frames, axis=0)
    diffusion = np.mean(moved**2, axis=(1, 2))/(2*lag*dt*melt.kT*melt.mobility)
    return {"energy": blocked(energies/(melt.count*melt.kT), blocks),
            "radius of gyration^2": blocked(melt.observed(frames)["radius of gyration^2"], blocks),
            "diffusion": blocked(diffusion, blocks)}


@pytest.mark.onePlatform
@pytest.mark.parametrize("boundary", ["Periodic", "Unbounded"])
def testThreads(boundary, hardCase):
    """
    A hundred chains with bonds alone (OpenMM's nonbonded forces on CPU depend on their threads) on one
    thread and on two, 300 steps (in the long form 20,000).

    The trajectories are the same to the bit.
    """
    melt = Melt(chains=20, beads=10)
    start = melt.idealChains(1, 747)[0]
    ends = []
    for threads in (1, 2):
        context, integrator = makeContext(melt.scene(start), "CPU", melt.temperature, melt.stepSize(PRODUCT),
                                          TOLERANCE, forces=melt.forces()[:1], threads=threads,
                                          boundary=getattr(PSEBrownianIntegrator, boundary))
        integrator.step(20_000 if hardCase.long else 300)
        ends.append(positionsOf(context))
    hardCase.measure(difference=float(abs(ends[0] - ends[1]).max()))
    assert np.array_equal(*ends) and abs(ends[0] - start).max() > melt.radius


# ---------------------------------------------------------------- memory

def residentBytes():
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1])*os.sysconf("SC_PAGE_SIZE")


@pytest.mark.onePrecision
def testMemory(platformName, hardCase):
    """
    Steps, samples of noise, products M f and positions read back, again and again.

    After a warm-up the process grows by less than 1 MB: in the long form, one million steps on CPU and
    1e4 on the others, that is one byte a step and 100.
    """
    melt = SMALL
    rounds = (5000 if platformName == "CPU" else 50) if hardCase.long else 50 if platformName == "CPU" else 6
    each = 200 if hardCase.long else 20
    context, integrator = makeContext(melt.scene(melt.idealChains(1, 748)[0]), platformName, melt.temperature,
                                      melt.stepSize(PRODUCT), TOLERANCE, forces=melt.forces())

    def work():
        integrator.step(each)
        integrator.applyMobility(np.ones((melt.count, 3)))
        integrator.sampleBrownianDisplacements(2)
        context.getState(positions=True, forces=True, energy=True)
        context.createCheckpoint()

    for _ in range(max(5, rounds//10)):
        work()
    before = residentBytes()
    for _ in range(rounds):
        work()
    growth = residentBytes() - before
    hardCase.measure(**{"steps": rounds*each, "growth (kB)": growth//1024})
    assert growth < 1e6


# ---------------------------------------------------------------- counters

def countedContext(platformName, count, seed=51, split="Prolate", temperature=300.0):
    """A few spheres whose Context and noise have already counted so many steps."""
    scene = scenes.randomSuspension(4, 0.05, scenes.tilted(1), 0.5, 749)
    context, integrator = makeContext(scene, platformName, temperature, 1.0, 1e-3, seed=seed)
    integrator.step(1)
    state = openmm.XmlSerializer.serialize(context.getState(positions=True, integratorParameters=True))
    assert 'noiseStep="1"' in state
    context.setState(openmm.XmlSerializer.deserialize(state.replace('noiseStep="1"', f'noiseStep="{count}"')))
    context.setStepCount(count)
    context.setTime(1.0*count)
    return context, integrator, scene.at(positionsOf(context))


def stepsFrom(context, integrator, scene, count):
    """Displacements (count,3N) of single steps that all start at the positions of the scene."""
    out = np.empty((count, 3*scene.count))
    for row in out:
        context.setPositions(scene.positions)
        integrator.step(1)
        row[:] = (positionsOf(context) - scene.positions).ravel()
    return out


@pytest.mark.onePrecision
@pytest.mark.parametrize("crossing", [2**31, 2**32])
def testStepCounter(platformName, crossing, hardCase):
    """
    The counters of a Context and of its noise set to just below 2^31 and 2^32, and steps across.

    Counts and times go on; no displacement comes twice, nor one of the first steps of all; their law is
    that of the exact mobility on both sides together (false alarm 1e-6); a checkpoint and a State from
    before the crossing continue to the bit.
    """
    n = 1000 if hardCase.long else 80 if isDevice(platformName) else 300
    context, integrator, scene = countedContext(platformName, crossing - n//2)
    across = stepsFrom(context, integrator, scene, n)
    assert context.getStepCount() == crossing + n - n//2
    assert context.getTime()._value == crossing + n - n//2
    fresh = stepsFrom(*countedContext(platformName, 0), n)
    both = np.concatenate([across, fresh])
    # Among 2 n^2 pairs of vectors of 12 independent components none is nearer than about 1.
    scale = np.sqrt(np.mean(both**2))
    nearest = min(np.sort(np.linalg.norm(both - row, axis=1))[1] for row in both)/scale
    hardCase.least(**{"nearest pair of displacements": float(nearest)})
    assert nearest > 0.2
    white = scenes.whiten(across, 2*scenes.KB*300.0*scene.mobility)
    for part, name in ((white[:n//2], "before"), (white[n//2:], "after"), (white, "both")):
        scenes.assertUnitCovariance(part, name, tests=3)
    assertRestarts(platformName, crossing)


def assertRestarts(platformName, crossing):
    context, integrator, _ = countedContext(platformName, crossing - 3)
    checkpoint = context.createCheckpoint()
    state = context.getState(positions=True, parameters=True, integratorParameters=True)
    integrator.step(6)
    expected, count = positionsOf(context), context.getStepCount()
    for back in (lambda c: c.loadCheckpoint(checkpoint), lambda c: c.setState(state)):
        other, again, _ = countedContext(platformName, 7)
        back(other)
        again.step(6)
        assert np.array_equal(positionsOf(other), expected) and other.getStepCount() == count == crossing + 3


@pytest.mark.onePrecision
@pytest.mark.withGrid
@pytest.mark.parametrize("crossing", [2**31, 2**32])
def testReferenceCountsTheSame(platformName, crossing):
    """The noise across is that of Reference: all 64 bits of the counter arrive, on devices as well."""
    found = [stepsFrom(*countedContext(name, crossing - 2), 4) for name in (platformName, "Reference")]
    scale = np.sqrt(np.mean(found[1]**2))
    assert abs(found[0] - found[1]).max() < 0.1*scale
