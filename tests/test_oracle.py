# SPDX-License-Identifier: MIT
"""The oracle against exact values, against itself, and against what any mobility must obey."""
import numpy as np
import pytest

from oracle import (boxVolume, freeSpaceMobilityMatrix, freeSpaceRpy, freeSpaceScalars,
                    mobilityMatrix, waveIntegral)

ACCURACY = 1e-12
CUBIC = 2.8372974794806
# Any three vectors of the same lattice: integer rows, determinant 1.
OTHER_VECTORS = np.array([[1, 0, 0], [2, 1, 0], [-3, 1, 1]])


def mixedConfiguration(L, a, seed=3):
    """Twenty particles, random ones far out, a coincident, an overlapping and a touching pair."""
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-3*L, 3*L, (20, 3))
    positions[1] = positions[0]
    positions[3] = positions[2] + [0.5*a, 0, 0]
    positions[5] = positions[4] + 2*a*np.array([0.48, 0.6, 0.64])
    return positions


@pytest.mark.parametrize("L", [2.0, 2.5, 3.0, 6.0, 20.0, 200.0])
def testSingleParticleInCube(L):
    """1 - 2.837 a/L + (4 pi/3)(a/L)^3 has no further terms for 2a <= L."""
    a = 0.7
    exact = 1 - CUBIC/L + 4*np.pi/3/L**3
    M = mobilityMatrix([[0.1, 0.2, 0.3]], np.eye(3)*L*a, a)
    assert abs(M - exact*np.eye(3)).max() < ACCURACY


@pytest.mark.parametrize("lattice, constant", [
    ([[1, 1, -1], [1, -1, 1], [-1, 1, 1]], 1.7918585114),
    ([[1, 1, 0], [1, 0, 1], [0, 1, 1]], 1.7917472304)])
def testSingleParticleInTriclinicLattice(lattice, constant):
    """Body and face centred cubic arrays: 1 - c phi^(1/3) + phi; c is known to ten digits."""
    a = 1.3
    box = np.array(lattice)*3.0*a
    phi = 4*np.pi/3*a**3/boxVolume(box)
    M = mobilityMatrix([[0, 0, 0]], box, a)
    assert abs(M - (1 - constant*phi**(1/3) + phi)*np.eye(3)).max() < 1e-10


def testFreeSpaceTensor():
    """Exact fractions at r = 0, a/2 and 2a (perpendicular, parallel)."""
    perp, par = freeSpaceRpy(np.array([0, 0.5, 2.0]), 1.0)
    assert np.allclose(perp, [1, 0.859375, 0.4375], rtol=0, atol=1e-15)
    assert np.allclose(par, [1, 0.90625, 0.625], rtol=0, atol=1e-15)


@pytest.mark.parametrize("r", [0.0, 1e-7, 1e-3, 0.4, 2.0, 5.0])
def testWaveIntegralAgainstQuadrature(r):
    """
    W(r) is the inverse Fourier transform of the wave factor: with b(k) the factor times 6 pi a, par
    = (1/pi^2) int b j1(kr)/(kr) dk and perp = (1/(2 pi^2)) int b (j0 - j1/(kr)) dk (k^2 cancels).
    """
    a, xi = 0.9, 0.8
    nodes, weights = np.polynomial.legendre.leggauss(400)
    k = 0.5*(nodes + 1)*16*xi
    w = 0.5*weights*16*xi
    x = k*k/(4*xi*xi)
    b = 6*np.pi*a*(1 - a*a*k*k/3)*(1 + x + 2*x*x)*np.exp(-x)
    q = k*r
    j0 = np.sinc(q/np.pi)
    # j1(q)/q by its series where the closed form cancels.
    closed = np.maximum(q, 0.05)
    j1q = np.where(q < 0.05, 1/3 - q*q/30 + q**4/840,
                   (np.sin(closed)/closed - np.cos(closed))/closed**2)
    perp, par = waveIntegral(r, a, xi)
    assert abs(par - np.sum(w*b*j1q)/np.pi**2) < ACCURACY
    assert abs(perp - np.sum(w*b*(j0 - j1q))/(2*np.pi**2)) < ACCURACY


@pytest.mark.parametrize("box", [np.eye(3)*7, np.diag([4, 4, 32.0]), np.eye(3)*1.5,
                                 7*np.array([[1, 0, 0], [0.5, 1, 0], [0.5, 0.5, 1]])])
def testSplittingParameterAndLatticeVectorsDoNotMatter(box):
    a = 1.0
    positions = mixedConfiguration(7, a)
    default = mobilityMatrix(positions, box, a)
    other = mobilityMatrix(positions, OTHER_VECTORS @ box, a, xi=0.65)
    assert abs(default - other).max() < ACCURACY
    assert abs(default - default.T).max() < ACCURACY
    # A coincident pair has no relative mobility at all; nothing may lie below zero.
    assert np.linalg.eigvalsh(default)[0] > -ACCURACY
    if boxVolume(box) > 300:
        distinct = np.delete(np.arange(60), [3, 4, 5])
        assert np.linalg.eigvalsh(default[np.ix_(distinct, distinct)])[0] > 1e-3


def testHugeBoxIsFreeSpace():
    """
    A pair at r in a box of side L sees free space but for the mean flow -2.837 a/L, which is the
    same for all pairs, and terms of order a r^2/L^3 (the neutralising background).
    """
    a, L = 1.0, 4000.0
    positions = np.array([[0, 0, 0], [0.3, 0.5, -0.2], [2, 0, 0], [3, 1, 5.0]])
    M = mobilityMatrix(positions, np.eye(3)*L, a) + CUBIC*a/L*np.tile(np.eye(3), (4, 4))
    assert abs(M - freeSpaceMobilityMatrix(positions, a)).max() < 5e-9


def testReplicatedCell():
    """Two cells of a crystal as one doubled cell: the same velocities for the same forces."""
    a = 1.0
    rng = np.random.default_rng(8)
    box = np.array([[6, 0, 0], [1.5, 5, 0], [-1, 2, 7.0]])
    positions = rng.uniform(0, 6, (5, 3))
    forces = rng.normal(size=(5, 3))
    single = mobilityMatrix(positions, box, a) @ forces.ravel()
    doubledBox = box.copy()
    doubledBox[1] *= 2
    doubled = mobilityMatrix(np.vstack([positions, positions + box[1]]), doubledBox, a)
    assert abs(doubled @ np.tile(forces.ravel(), 2) - np.tile(single, 2)).max() < ACCURACY


def testUnequalSpheresAreAveragedOverTheirSurfaces():
    """
    The tensor of two spheres is the flow of one (uniform within it, Stokeslet and source doublet
    outside), averaged over the surface of the other; by a rule that knows nothing of its kinks.
    """
    n = 4000
    nodes, weights = (2*np.arange(n) + 1)/n - 1, 2/n
    for ai, aj in ((1, 1), (1, 2), (0.4, 3), (3, 0.4)):
        for r in (0.3*abs(ai - aj) + 0.1, abs(ai - aj) + 0.2, 0.9*(ai + aj), 2*(ai + aj)):
            x, y = r + ai*nodes, ai*np.sqrt(1 - nodes**2)
            s = np.hypot(x, y)
            square = (aj/np.maximum(s, aj))**2
            perp = np.where(s < aj, 1/aj, 0.75/s*(1 + square/3))
            par = np.where(s < aj, 1/aj, 1.5/s*(1 - square/3))
            trace = np.sum(weights/2*(2*perp + par))
            along = np.sum(weights/2*(perp + (par - perp)*(x/s)**2))
            assert np.allclose(freeSpaceScalars(r, ai, aj), ((trace - along)/2, along), rtol=0, atol=2e-6)


@pytest.mark.parametrize("box", [np.eye(3)*9, 7*np.array([[1, 0, 0], [0.5, 1, 0], [0.5, 0.5, 1]])])
def testUnequalSpheresDoNotDependOnTheSplittingParameter(box):
    """Also for a smaller sphere inside a larger one; nothing lies below zero."""
    positions = mixedConfiguration(7, 1.0)
    radii = np.random.default_rng(9).choice([0.3, 1.0, 2.5], 20)
    radii[:2] = 0.3, 2.5
    default = mobilityMatrix(positions, box, radii)
    other = mobilityMatrix(positions, OTHER_VECTORS @ box, radii, xi=0.3)
    assert abs(default - other).max() < ACCURACY
    assert abs(default - default.T).max() < ACCURACY
    assert np.linalg.eigvalsh(default)[0] > -ACCURACY
    equal = mobilityMatrix(positions, box, np.full(20, 1.3))
    assert abs(equal*1.3 - mobilityMatrix(positions, box, 1.3)).max() < ACCURACY
