# SPDX-License-Identifier: MIT
"""
Forces with a net sum [T52]: no mean flow of fluid and particles together, against the settling of a
simple cubic array (Hasimoto 1959, Sangani and Acrivos 1982) and the flux through the box.
"""
import numpy as np
import pytest

import scenes
from openmmpse import PSEBrownianIntegrator
from scenes import Scene, constantForces, makeContext, positionsOf

pytestmark = pytest.mark.onePrecision
CUBIC = 2.837297479


def arrayOf(side, L, a):
    """side^3 spheres on a simple cubic lattice of spacing L."""
    places = np.stack(np.meshgrid(*[np.arange(side)]*3, indexing="ij"), -1).reshape(-1, 3)
    return Scene((places + [0.31, 0.17, 0.83])*L, scenes.cube(side*L), a)


@pytest.mark.parametrize("side", [1, 3])
def testACubicArraySettlesAsPublished(platformName, side):
    """
    U/U0 = 1 - 2.837297 a/L + (4 pi/3)(a/L)^3, exact for the mobility used here, for one sphere in
    its box and for 27; and 1 - 1.7601 phi^(1/3) + phi of rigid spheres to the next order, phi^2.
    """
    a = 0.5
    for L in (5.0, 10.0):
        s = arrayOf(side, L, a)
        tolerance = 1e-4
        context, integrator = makeContext(s, platformName, tolerance=tolerance)
        for force in ([0.0, 0.0, -3.0], [1.0, -2.0, 0.5]):
            forces = np.tile(force, (s.count, 1))
            u = integrator.applyMobility(forces)
            ratio = 1 - CUBIC*a/L + 4*np.pi/3*(a/L)**3
            # the tolerance is that of the largest error of a vector, relative to F/(6 pi eta a)
            assert abs(u/s.mu0 - ratio*forces).max() <= 2*tolerance*np.linalg.norm(force)
            phi = 4*np.pi/3*(a/L)**3
            published = 1 - 1.7601*phi**(1/3) + phi
            assert abs(ratio - published) < 2*phi**2 + 1e-4*phi**(1/3)


def testStepsSettleAsMuch(platformName):
    """A step moves by the same velocity, in one body; box and lattice stay as they are."""
    s = arrayOf(2, 5.0, 0.5)
    pull = np.tile([0.0, 0.0, -30.0], (s.count, 1))
    context, integrator = makeContext(s, platformName, stepSize=2.0, tolerance=1e-4,
                                      forces=[constantForces(pull)])
    integrator.step(20)
    ratio = 1 - CUBIC*0.1 + 4*np.pi/3*1e-3
    moved = positionsOf(context) - s.positions
    assert abs(moved - 40*s.mu0*ratio*pull).max() <= 2e-4*40*s.mu0*30


def testThereIsNoMeanFlow(platformName):
    """
    The velocity of the fluid and the particles together has no mean: a small sphere that no force
    pulls at, averaged over all places between pulled ones, stays where it is on average. The mean
    over a fine lattice of places kills all waves but those that the lattice does not resolve.
    """
    L, points = 6.0, 4
    places = np.stack(np.meshgrid(*[np.arange(points)]*3, indexing="ij"), -1).reshape(-1, 3)
    probes = (places + 0.5)*L/points
    pulled = np.array([[0.4, 0.9, 0.3], [3.9, 2.2, 4.6], [1.8, 5.2, 2.9]])
    s = Scene(np.concatenate([pulled, probes]), scenes.cube(L), 1.0)
    context, integrator = makeContext(s, platformName, tolerance=1e-4)
    for force in ([0.0, 0.0, -3.0], [2.0, 1.0, 0.0]):
        forces = np.zeros((s.count, 3))
        forces[:3] = force
        mean = integrator.applyMobility(forces)[3:].mean(axis=0)
        # what the waves of the lattice of probes carry: sinc(k a)^2/k^2 at k = 2 pi points/L
        k = 2*np.pi*points/L
        left = 3*6*np.linalg.norm(force)*(np.sin(k)/k)**2/(scenes.ETA*k**2*L**3)
        assert np.linalg.norm(mean) <= 2*left + 1e-4*s.mu0*np.linalg.norm(force)
        assert np.linalg.norm(mean) < 0.02*s.mu0*np.linalg.norm(force)
    # three net forces on one fluid: velocities add up, so the convention is linear
    one, two = np.zeros((s.count, 3)), np.zeros((s.count, 3))
    one[0], two[2] = [0, 0, 1.0], [0.5, -2.0, 0]
    both = integrator.applyMobility(one + two)
    apart = integrator.applyMobility(one) + integrator.applyMobility(two)
    assert abs(both - apart).max() <= 1e-5*abs(both).max()


def testNoWallNoNetFlowUnbounded(platformName):
    """An unbounded fluid has no such convention: one sphere falls with Stokes's velocity."""
    s = Scene(np.zeros((1, 3)), scenes.cube(5.0), 0.5)
    context, integrator = makeContext(s, platformName, boundary=PSEBrownianIntegrator.Unbounded)
    u = integrator.applyMobility([[0.0, 0.0, -1.0]])
    assert np.allclose(u, [[0, 0, -s.mu0]], rtol=1e-5)
