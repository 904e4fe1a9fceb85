# SPDX-License-Identifier: MIT
"""What can only go wrong on a device: sorting, rows that grow, positions and refusals that the host does not see."""
import re
from pathlib import Path

import numpy as np
import openmm
import pytest

import openmmpse
from platformnames import contextOn, familyOf
from scenes import (ETA, Scene, constantForces, cube, makeContext, makeSystem, mixture, periodicDummyForce,
                    positionsOf, randomForces, randomSuspension, tilted)

pytestmark = [pytest.mark.deviceOnly, pytest.mark.onePrecision]
L, RADIUS = 40.0, 0.5
ROUNDING = 2e-6  # of both platforms in single precision, at positions rounded to floats
LOOSE = 1e-2     # tolerance: cheap grids
KERNELS = Path(__file__).resolve().parents[1] / "platforms" / "common" / "kernels"
WRITTEN_COMPONENT = re.compile(r"\]\s*\.\s*([xyzw]+|s[0-9a-f]+)\s*([-+*/&|^]|<<|>>)?=(?!=)")


def testKernelsWriteVectorsInArraysAsAWhole():
    """Compilers of OpenCL write one component as all four: lost where another thread writes another one."""
    assert all(map(WRITTEN_COMPONENT.search, ("starts[place].x = 1;", "u[i+1] .y+=f;", "sums[k].s03 = 0;")))
    assert not any(map(WRITTEN_COMPONENT.search, ("x = u[i].x;", "u[i].x == 0", "u[i].x >= 0", "next.x = s*v[i].x;")))
    texts = {path.name: path.read_text() for path in KERNELS.glob("*.cc")}
    assert texts
    assert [name for name, text in texts.items() if WRITTEN_COMPONENT.search(text)] == []


def clustered(N, few):
    """Particles on the right of the box but for a few, whose cells come before those of all others."""
    x = np.random.default_rng(0).random((N, 3))*L
    x[:, 0] = 0.7*L + 0.3*x[:, 0]
    x[:few, 0] = 1e-3
    return Scene(x.astype(np.float32).astype(float), cube(L), RADIUS)


def difference(scene, platformName, **options):
    """Relative difference of M f and of a draw of displacements from those of the CPU with the same Plan."""
    context, integrator = makeContext(scene, platformName, temperature=300.0, tolerance=LOOSE, **options)
    plan = integrator.getNumericalParameters()
    other, reference = makeContext(scene, "CPU", temperature=300.0, tolerance=LOOSE,
                                   configure=lambda cpu: cpu.setNumericalParameters(plan), **options)
    forces = randomForces(scene)
    pairs = ((integrator.applyMobility(forces), reference.applyMobility(forces)),
             (integrator.sampleBrownianDisplacements(1), reference.sampleBrownianDisplacements(1)))
    return [np.linalg.norm(a - b)/np.linalg.norm(b) for a, b in pairs]


@pytest.mark.parametrize("N", [100, 1100])  # OpenMM sorts up to 1024 keys in another way
def testClusteredParticlesAreSorted(platformName, N):
    assert max(difference(clustered(N, 5), platformName)) < ROUNDING


def testParticlesThatDoNotMoveAreNotSorted(platformName):
    scene = clustered(1100, 5)
    masses = np.where(np.arange(1100) % 11 == 0, 100.0, 0.0)
    assert max(difference(scene, platformName, masses=masses)) < ROUNDING


def testRowsOfNeighboursGrow(platformName):
    # 150 particles within a few radii in a box for which the mean density promises no neighbours
    x = L/2 + 1.0*np.random.default_rng(1).normal(size=(150, 3))
    scene = Scene(x.astype(np.float32).astype(float), cube(L), RADIUS)
    mobility, _ = difference(scene, platformName)
    assert mobility < ROUNDING


def testStrongOverlapsNeedNoMoreIterationsThanOnTheCpu(platformName):
    """In double precision: without reorthogonalisation the process would take 98 iterations instead of 76."""
    x = 10 + 4*np.random.default_rng(1).random((125, 3))
    scene = Scene(x, cube(20.0), 1.0)
    draws, iterations, plan = [], [], {}
    for name in ("CPU", familyOf(platformName) + "-double"):
        _, integrator = makeContext(scene, name, temperature=300.0, tolerance=1e-8,
                                    configure=lambda one: one.setNumericalParameters(plan))
        draws.append(integrator.sampleBrownianDisplacements(1))
        plan = integrator.getNumericalParameters()
        iterations.append(plan["lanczosIterations"])
    assert iterations[1] == iterations[0] > 50
    assert np.linalg.norm(draws[1] - draws[0]) < 1e-9*np.linalg.norm(draws[0])


def unequal():
    """Three size groups, one sphere inside another, and a range that is not that of all pairs."""
    radii = np.where(np.arange(60) % 20 == 0, 3.0, np.where(np.arange(60) % 3 == 0, 0.9, 0.4))
    scene = mixture(radii, 0.2, tilted(1.0), seed=6)
    scene.positions[1] = scene.positions[0] + [0.5, 0, 1.0]
    return scene


def testUnequalSpheresDifferByRoundingBetweenPrecisions(platformName):
    """Rows of each size group, cells of their own: what single precision finds, double precision does."""
    scene, plan = unequal(), {}
    found = []
    for precision in ("single", "double"):
        _, integrator = makeContext(scene, f"{familyOf(platformName)}-{precision}", temperature=300.0, tolerance=1e-3,
                                    configure=lambda one: one.setNumericalParameters(plan))
        plan = integrator.getNumericalParameters()
        found.append((integrator.applyMobility(randomForces(scene)), integrator.sampleBrownianDisplacements(1)))
    for single, double in zip(*found):
        assert 0 < np.linalg.norm(single - double) < 10*ROUNDING*np.linalg.norm(double)


def testUnequalSpheresContinueFromACheckpointToTheBit(platformName):
    scene = unequal()
    context, integrator = makeContext(scene, platformName, temperature=300.0, stepSize=1.0)
    integrator.step(2)
    checkpoint = context.createCheckpoint()
    integrator.step(2)
    uninterrupted = positionsOf(context)
    other, fresh = makeContext(scene, platformName, temperature=300.0, stepSize=1.0, seed=99)
    other.loadCheckpoint(checkpoint)
    fresh.step(2)
    assert np.array_equal(positionsOf(other), uninterrupted)


def testRowsOfUnequalSpheresGrow(platformName):
    """Hundreds of neighbours in a box whose mean density promises few: all of them are found."""
    rng = np.random.default_rng(7)
    x = L/2 + 1.5*rng.normal(size=(150, 3))
    scene = Scene(x.astype(np.float32).astype(float), cube(L), RADIUS, np.where(np.arange(150) % 10 == 0, 1.5, 0.4))
    context, integrator = makeContext(scene, platformName, tolerance=1e-3)
    other, reference = makeContext(scene, "Reference", tolerance=1e-6)
    forces = randomForces(scene)
    exact = reference.applyMobility(forces)
    assert np.linalg.norm(integrator.applyMobility(forces) - exact) < 1e-3*np.linalg.norm(exact)


def testTooLongAStepNamesItsParticle(platformName):
    scene = randomSuspension(10, 0.1, cube(1.0), RADIUS, seed=3)
    forces = np.zeros((10, 3))
    forces[7, 1] = 1e6

    def drainFreely(integrator):
        integrator.setMobilityModel(openmmpse.PSEBrownianIntegrator.FreeDraining)

    context, integrator = makeContext(scene, platformName, stepSize=1e40, forces=[constantForces(forces)],
                                      configure=drainFreely)
    before = positionsOf(context)
    with pytest.raises(openmm.OpenMMException, match="position of particle 7"):
        integrator.step(1)
    assert np.array_equal(positionsOf(context), before)
    assert context.getStepCount() == 0


def testPositionsOfAnotherIntegratorAreChecked(platformName):
    scene = randomSuspension(10, 0.1, cube(1.0), RADIUS, seed=3)
    ours = openmmpse.PSEBrownianIntegrator(0.0, ETA, RADIUS, 1.0)
    ours.setFluidBoundary(openmmpse.PSEBrownianIntegrator.Periodic)
    other = openmm.CustomIntegrator(1.0)
    other.addGlobalVariable("bad", np.nan)
    other.addComputePerDof("x", "x+bad")
    both = openmm.CompoundIntegrator()
    both.addIntegrator(ours)
    both.addIntegrator(other)
    context = contextOn(platformName, makeSystem(scene), both)
    context.setPositions(scene.positions)
    both.step(1)
    both.setCurrentIntegrator(1)
    both.step(1)
    both.setCurrentIntegrator(0)
    with pytest.raises(openmm.OpenMMException, match="position of particle 0 is .*not finite"):
        both.step(1)


def testABoxThatChangesNeedsNoNewProgram(platformName, monkeypatch, tmp_path):
    scene = randomSuspension(40, 0.1, cube(1.0), RADIUS, seed=4)
    context, integrator = makeContext(scene, platformName, tolerance=LOOSE)
    integrator.step(1)
    monkeypatch.setenv("OPENMMPSE_KERNEL_DUMP", str(tmp_path))
    context.setPeriodicBoxVectors(*(1.02*scene.box))
    integrator.step(1)
    assert integrator.getNumericalParameters()["gridDimensions"] != (0, 0, 0)
    assert list(tmp_path.glob("particles*")) == []


def testAShearedBoxNeedsNoNewProgram(platformName, monkeypatch, tmp_path):
    """Nor does one whose rate begins later, once it has a Plan."""
    scene = randomSuspension(40, 0.1, tilted(1.0), RADIUS, seed=4)
    context, integrator = makeContext(scene, platformName, 300.0, 1.0, LOOSE)
    integrator.step(1)
    integrator.setShearRate(0.1)
    integrator.step(1)
    plan = integrator.getNumericalParameters()["gridDimensions"]
    monkeypatch.setenv("OPENMMPSE_KERNEL_DUMP", str(tmp_path))
    integrator.step(12)
    assert integrator.getStrain() > 1
    assert integrator.getNumericalParameters()["gridDimensions"] == plan
    assert list(tmp_path.iterdir()) == []


def testACheckpointKnowsImagesInAShearedBox(platformName):
    """Of particles that OpenMM has wrapped: they continue to the bit, where they were, past flips."""
    scene = randomSuspension(40, 0.1, tilted(1.0), RADIUS, seed=4)

    def make():
        def configure(integrator):
            integrator.setMobilityModel(openmmpse.PSEBrownianIntegrator.FreeDraining)
            integrator.setShearRate(0.1)
        return makeContext(scene, platformName, 300.0, 1.0, seed=8, configure=configure,
                           forces=[periodicDummyForce(scene.count, scene.box)])
    context, integrator = make()
    integrator.step(270)
    saved = context.createCheckpoint()
    integrator.step(20)
    expected = positionsOf(context)
    assert abs(expected).max() > 5*scene.box[0, 0]
    other, fresh = make()
    other.loadCheckpoint(saved)
    fresh.step(20)
    assert np.array_equal(positionsOf(other), expected)
    assert fresh.getStrain() == integrator.getStrain()


def testARectangularDefaultBoxIsNotSheared(platformName):
    """At creation and later, with a remedy that works: a small tilt, which may be taken back to zero."""
    s = Scene(np.array([[1.0, 1, 1], [3, 1, 2]]), 6*np.eye(3), 0.5)

    def make(scene, rate):
        return makeContext(scene, platformName, 0, configure=lambda i: i.setShearRate(rate))
    context, integrator = make(s, 0.0)
    for refuse in (lambda: integrator.setShearRate(0.1), lambda: make(s, 0.1)):
        with pytest.raises(openmm.OpenMMException,
                           match="setShearRate.*rectangular.*setDefaultPeriodicBoxVectors.*platform CPU"):
            refuse()
    assert integrator.getShearRate()._value == 0
    integrator.step(1)
    box = 6*np.eye(3)
    box[1, 0] = 0.006
    context, integrator = make(Scene(s.positions, box, 0.5), 0.1)
    context.setPeriodicBoxVectors(*s.box)
    integrator.step(1)
    assert np.allclose(positionsOf(context), s.positions + 0.1*s.positions[:, 1:2]*[1, 0, 0], atol=1e-6)
    assert np.allclose(context.getState().getPeriodicBoxVectors()._value, [[6, 0, 0], [0.6, 6, 0], [0, 0, 6]])
