# SPDX-License-Identifier: MIT
"""
Dense periodic Rotne-Prager-Yamakawa mobility in double precision: what the tests compare with.

It shares nothing with the library: neither its split (the wave factor here is Beenakker's, which is
not positive and has no sinc), nor its quadratures and tables, nor its window and grid. With
x = k^2/(4 xi^2) the wave part of M is, in units of mu0 = 1/(6 pi eta a),

    (6 pi a/V) sum_{k != 0} (I - kk) (1 - (ka)^2/3) (1 + x + 2 x^2) exp(-x) cos(k.r)/k^2

(C. W. J. Beenakker, J. Chem. Phys. 85, 1581 (1986)), and the real-space part is the free-space
tensor minus the integral of the wave part, for every r >= 0. That integral is

    W(r) = (3a/4) (I lap - grad grad) (1 + (a^2/3) lap) r erf(xi r),

an entire function of r^2; written with the Boys functions F_m(t) = int_0^1 u^2m exp(-t u^2) du it
has neither a branch nor a cancellation at small r. Overlaps, coincident particles, a particle's own
images and boxes smaller than a particle need no special case. Absolute error <= 1e-12 mu0.

For two radii a^2 is (ai^2 + aj^2)/2 in both, which is the exact tensor of spheres that are apart;
what overlap makes of it is left to the free-space tensor. Units are then 1/(6 pi eta).
"""
import itertools

import numpy as np
from scipy.special import gamma, gammainc

# exp(-REACH^2) = 5e-22 leaves room for the polynomials in front of both truncated sums.
REACH = 7.0


def boxVolume(box):
    """Volume (nm^3) of the cell whose vectors are the rows of box (nm)."""
    return abs(np.linalg.det(box))


def boysFunctions(t):
    """F_0, F_1, F_2 at t >= 0 (any shape), relative error about 1e-15."""
    t = np.asarray(t, dtype=float)
    # The two-term series below 1e-9 is exact to rounding; above, gammainc keeps relative accuracy.
    safe = np.maximum(t, 1e-9)
    f2 = np.where(t < 1e-9, 1/5 - t/7, gamma(2.5)*gammainc(2.5, safe)/(2*safe**2.5))
    e = np.exp(-t)
    f1 = (2*t*f2 + e)/3
    f0 = 2*t*f1 + e
    return f0, f1, f2


def freeSpaceRpy(r, a):
    """
    Scalars (perp, par) of the free-space tensor perp (I - rr) + par rr between equal spheres, in
    units of mu0, for r >= 0 (nm): H. Yamakawa, J. Chem. Phys. 53, 436 (1970), and below r = 2a
    J. Rotne and S. Prager, J. Chem. Phys. 50, 4831 (1969).
    """
    s = np.asarray(r, dtype=float)/a
    far = np.maximum(s, 2.0)
    perp = np.where(s < 2, 1 - 9*s/32, 3/(4*far) + 1/(2*far**3))
    par = np.where(s < 2, 1 - 3*s/16, 3/(2*far) - 1/far**3)
    return perp, par


def freeSpaceScalars(r, ai, aj):
    """
    The same between spheres of radii ai and aj (broadcast against r), in units of 1/(6 pi eta) and
    1/nm: P. J. Zuk, E. Wajnryb, K. A. Mizerski, P. Szymczak, J. Fluid Mech. 741, R5 (2014), whose
    scalars of 1 and rr are added up here.
    """
    r, ai, aj = np.broadcast_arrays(np.asarray(r, dtype=float), ai, aj)
    large, small = np.maximum(ai, aj), np.minimum(ai, aj)
    far = np.maximum(r, ai + aj)
    squares = (ai**2 + aj**2)/far**2
    isotropic, dyadic = 3/(4*far)*(1 + squares/3), 3/(4*far)*(1 - squares)
    near = np.where((r > large - small) & (r < ai + aj), r, ai + aj)
    gap = (ai - aj)**2
    partIsotropic = (16*near**3*(ai + aj) - (gap + 3*near**2)**2)/(32*near**3)/(ai*aj)
    partDyadic = 3*(gap - near**2)**2/(32*near**3)/(ai*aj)
    inside, apart = r <= large - small, r >= ai + aj
    one = np.where(apart, isotropic, np.where(inside, 1/large, partIsotropic))
    rr = np.where(apart, dyadic, np.where(inside, 0, partDyadic))
    return one, one + rr


def waveIntegral(r, a, xi):
    """Scalars (perp, par) of W(r), the infinite-box integral of the wave part, in units of mu0."""
    t = (xi*np.asarray(r, dtype=float))**2
    c = (a*xi)**2/3
    f0, f1, f2 = boysFunctions(t)
    e = np.exp(-t)
    # With s = xi r, g = (1 + (a^2/3) lap) s erf(s) and D = (1/s) d/ds:
    # par = 2 D g, perp = 2 D g + t D D g.
    first = f0 + e + c*(-4*f1 + (4*t - 12)*e)
    second = -2*f1 - 2*e + c*(8*f2 + (32 - 8*t)*e)
    scale = 1.5*a*xi/np.sqrt(np.pi)
    return scale*(2*first + t*second), scale*2*first


def latticeVectorsWithin(box, radius):
    """All lattice vectors (M,3) that a point of the cell centred at 0 may need to reach radius."""
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) @ box
    reach = radius + np.linalg.norm(corners, axis=1).max()
    widths = 1/np.linalg.norm(np.linalg.inv(box), axis=0)
    counts = np.floor(reach/widths).astype(int)
    n = np.array(list(itertools.product(*(range(-c, c + 1) for c in counts))), dtype=float)
    vectors = n @ box
    return vectors[np.linalg.norm(vectors, axis=1) <= reach]


def realSpacePart(positions, box, radii, xi):
    """Sum of RPY - W over all images within REACH/xi, as (N,3,N,3), in units of 1/(6 pi eta)."""
    N = len(positions)
    rc = max(REACH/xi, 2*radii.max())
    first, second = np.triu_indices(N)
    ai, aj = radii[first], radii[second]
    both = np.sqrt(0.5*(ai**2 + aj**2))
    fractional = (positions[first] - positions[second]) @ np.linalg.inv(box)
    nearest = (fractional - np.rint(fractional)) @ box
    blocks = np.zeros((len(first), 3, 3))
    for vector in latticeVectorsWithin(box, rc):
        r = nearest + vector
        distance = np.linalg.norm(r, axis=1)
        near = np.nonzero(distance < rc)[0]
        if len(near) == 0:
            continue
        d = distance[near]
        unit = r[near]/np.maximum(d, 1e-300)[:, None]
        freePerp, freePar = freeSpaceScalars(d, ai[near], aj[near])
        wavePerp, wavePar = waveIntegral(d, both[near], xi)
        perp, par = freePerp - wavePerp/both[near], freePar - wavePar/both[near]
        blocks[near] += perp[:, None, None]*np.eye(3)
        blocks[near] += ((par - perp)[:, None, None]*unit[:, :, None]*unit[:, None, :])
    M = np.zeros((N, 3, N, 3))
    M[first, :, second, :] = blocks
    M[second, :, first, :] = blocks
    return M


def waveVectorsWithin(box, cutoff):
    """One of each pair (k, -k), k != 0, with |k| <= cutoff (1/nm), as (M,3)."""
    lengths = np.linalg.norm(box, axis=1)
    counts = np.floor(cutoff*lengths/(2*np.pi)).astype(int)
    n = np.stack(np.meshgrid(*(np.arange(-c, c + 1) for c in counts), indexing="ij"),
                 -1).reshape(-1, 3)
    positive = (n[:, 0] > 0) | ((n[:, 0] == 0) & ((n[:, 1] > 0) | ((n[:, 1] == 0) & (n[:, 2] > 0))))
    k = 2*np.pi*n[positive] @ np.linalg.inv(box).T
    return k[np.einsum("ij,ij->i", k, k) <= cutoff**2]


def wavePart(positions, box, radii, xi):
    """The sum over wave vectors, as (N,3,N,3), in units of 1/(6 pi eta)."""
    def factor(k2):
        x = k2/(4*xi**2)
        return (1 + x + 2*x*x)*np.exp(-x)
    squares = (radii**2/6)[:, None] + (radii**2/6)[None, :]
    return waveSum(positions, box, 2*REACH*xi, factor, squares)


def waveSum(positions, box, cutoff, factor, squares=None):
    """
    6 pi/V times the sum over waves up to a cutoff of factor(k^2) (1 - squares k^2) (I - kk)
    cos(k.r)/k^2, as (N,3,N,3); squares is (N,N), or None for zero.
    """
    N = len(positions)
    k = waveVectorsWithin(box, cutoff)
    k2 = np.einsum("ij,ij->i", k, k)
    # Twice, because -k is not in the list.
    weight = 2*6*np.pi/boxVolume(box)*factor(k2)/k2
    phase = positions @ k.T
    waves = np.concatenate([np.cos(phase), np.sin(phase)], axis=1)
    M = np.zeros((N, 3, N, 3))
    for i in range(3):
        for j in range(i, 3):
            w = weight*((i == j) - k[:, i]*k[:, j]/k2)
            M[:, i, :, j] = (waves*np.tile(w, 2)) @ waves.T
            if squares is not None:
                M[:, i, :, j] -= squares*((waves*np.tile(w*k2, 2)) @ waves.T)
            M[:, j, :, i] = M[:, i, :, j]
    return M


def mobilityMatrix(positions, box, a, viscosity=None, xi=None):
    """
    The mobility M of N spheres in a periodic fluid with zero mean flow.

    positions  (N,3) in nm, anywhere
    box        (3,3), rows are the box vectors in nm; any three independent vectors
    a          hydrodynamic radius in nm, of all or (N,) of each
    viscosity  in Da/(nm ps); without it the result is in units of 1/(6 pi eta a), or, for (N,)
               radii, 1/(6 pi eta) and 1/nm
    xi         splitting parameter in 1/nm; the result does not depend on it
    returns    (3N,3N), row 3*i + component
    """
    positions = np.asarray(positions, dtype=float).reshape(-1, 3)
    box = np.asarray(box, dtype=float)
    N = len(positions)
    radii = np.broadcast_to(np.asarray(a, dtype=float), N)
    if xi is None:
        # Above 0.9/a the two parts grow like (a xi)^3 and cancel; 4/V^(1/3) balances the two costs.
        xi = min(4/boxVolume(box)**(1/3), 0.9/radii.max())
    M = realSpacePart(positions, box, radii, xi) + wavePart(positions, box, radii, xi)
    M = M.reshape(3*N, 3*N)
    if viscosity is not None:
        return M/(6*np.pi*viscosity)
    return M if np.ndim(a) else M*a


def forceCouplingMatrix(positions, box, a, viscosity=None):
    """
    The same of force coupling: Gaussian envelopes of width a/sqrt(pi) in place of surfaces, whose
    waves weigh exp(-(ka)^2/pi). No split is needed; REACH makes the sum exact to 1e-15.
    """
    positions = np.asarray(positions, dtype=float).reshape(-1, 3)
    box = np.asarray(box, dtype=float)
    N = len(positions)
    M = waveSum(positions, box, 0.85*REACH*np.sqrt(np.pi)/a, lambda k2: np.exp(-a*a*k2/np.pi))
    M = M.reshape(3*N, 3*N)
    return M*a if viscosity is None else M/(6*np.pi*viscosity)


def gaussianScalars(r, ai, aj):
    """
    The same between Gaussian envelopes of widths ai/sqrt(pi) and aj/sqrt(pi): the regularised
    Stokeslet of one Gaussian whose variance is the sum of both (M. R. Maxey, B. K. Patel, Int. J.
    Multiphase Flow 27, 1603 (2001)), by the Boys functions, which have no cancellation at r = 0.
    """
    variance = (np.square(ai) + np.square(aj))/np.pi
    t = np.asarray(r, dtype=float)**2/(2*variance)
    f0, f1, _ = boysFunctions(t)
    scale = 1.5/np.sqrt(2*np.pi*variance)
    return scale*(f0 + f1), 2*scale*(f0 - f1)


def unboundedMobilityMatrix(positions, radii, viscosity, scalars=freeSpaceScalars):
    """The mobility (3N,3N) of spheres of any radii (N,) in infinite solvent, with its units."""
    positions = np.asarray(positions, dtype=float).reshape(-1, 3)
    radii = np.asarray(radii, dtype=float)
    N = len(positions)
    r = positions[:, None, :] - positions[None, :, :]
    distance = np.linalg.norm(r, axis=2)
    unit = r/np.where(distance > 0, distance, 1)[:, :, None]
    perp, par = scalars(distance, radii[:, None], radii[None, :])
    M = perp[:, :, None, None]*np.eye(3)
    M = M + (par - perp)[:, :, None, None]*unit[:, :, :, None]*unit[:, :, None, :]
    M[np.arange(N), np.arange(N)] = np.eye(3)/radii[:, None, None]
    return M.transpose(0, 2, 1, 3).reshape(3*N, 3*N)/(6*np.pi*viscosity)


def freeSpaceMobilityMatrix(positions, a):
    """The mobility (3N,3N) in infinite solvent, in units of 1/(6 pi eta a)."""
    positions = np.asarray(positions, dtype=float).reshape(-1, 3)
    N = len(positions)
    r = positions[:, None, :] - positions[None, :, :]
    distance = np.linalg.norm(r, axis=2)
    unit = r/np.maximum(distance, 1e-300)[:, :, None]
    perp, par = freeSpaceRpy(distance, a)
    M = perp[:, :, None, None]*np.eye(3)
    M = M + (par - perp)[:, :, None, None]*unit[:, :, :, None]*unit[:, :, None, :]
    return M.transpose(0, 2, 1, 3).reshape(3*N, 3*N)
