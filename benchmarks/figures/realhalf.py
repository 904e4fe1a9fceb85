# SPDX-License-Identifier: MIT
"""The real half of the mobility as a sparse matrix, in NumPy and by quadrature, independent of the library.

Units: radius 1, 1/(6 pi eta a) = 1. M_R = RPY - M_W, M_W the integral [T6] of docs/theory.md over a weight w(k).
"""

import numpy as np
from common import scenes
from scipy.interpolate import CubicSpline
from scipy.sparse import bsr_matrix
from scipy.sparse.linalg import eigsh
from scipy.special import pro_ang1

NODES = 400
SMALLEST = 1e-4  # pair entries below this are left out; the spectrum changes by less than about 100 times that


def hasimoto(xi):
    """Nodes k, weights of a quadrature on [0, 13 xi], and w(k) there."""
    k, dk = _gauss(13 * xi)
    q = (k / (2 * xi)) ** 2
    return k, dk, np.sinc(k / np.pi) ** 2 * (1 + q) * np.exp(-q)


def prolate(c, R):
    """The same for the matched prolate split of bandwidth c and range R, up to the first zero of its weight.

    H0(k) = psi(k R/c), w = H0 - s k H0', s = (1 - 1/(3 |h2|))/2, H0 = 1 - |h2| k^2 + ...; psi from SciPy, |x| < 1.
    """
    y, dy = np.polynomial.legendre.leggauss(200)
    psi = pro_ang1(0, 0, c, y)[0]
    norm = psi @ dy
    h2 = 0.5 * R * R * ((psi * y * y) @ dy) / norm
    s = 0.5 * (1 - 1 / (3 * h2))

    def weight(k):
        phase = np.outer(k * R, y)  # psi is its own Fourier transform
        return (np.cos(phase) @ (psi * dy) + s * (phase * np.sin(phase)) @ (psi * dy)) / norm

    k = np.linspace(0, 3.2 * c / R, 4001)
    k0 = k[np.argmax(weight(k) <= 0) - 1]
    k, dk = _gauss(k0)
    return k, dk, weight(k)


def _gauss(top):
    x, dx = np.polynomial.legendre.leggauss(NODES)
    return 0.5 * top * (x + 1), 0.5 * top * dx


def scalars(quadrature, r):
    """F_R and G_R at distances r [T3], [T6], [T7]; absolute error 1e-8."""
    k, dk, w = quadrature
    kr = np.maximum(np.outer(r, k), 1e-4)
    j0 = np.sin(kr) / kr
    ratio = np.where(kr < 1e-2, 1 / 3 - kr**2 / 30, (j0 - np.cos(kr)) / kr**2)  # j1(x)/x
    FW, GW = 3 / np.pi * (j0 - ratio) @ (w * dk), 6 / np.pi * ratio @ (w * dk)
    far, s = r >= 2, np.maximum(r, 1e-12)
    F = np.where(far, 3 / (4 * s) + 1 / (2 * s**3), 1 - 9 * r / 32)
    G = np.where(far, 3 / (2 * s) - 1 / s**3, 1 - 3 * r / 16)
    return F - FW, G - GW


def matrix(x, length, quadrature, cutoff=None):
    """M_R (3N, 3N) of positions (nm) in a cube, nearest images only; cut off where entries fall below SMALLEST."""
    x, length = x / scenes.RADIUS, length / scenes.RADIUS
    r = np.linspace(2, length / 2, 800)
    F, G = scalars(quadrature, r)
    if cutoff is None:
        large = np.flatnonzero(np.maximum(abs(F), abs(G)) > SMALLEST)[-1]
        if large + 1 >= len(r):
            raise ValueError(
                f"the real half reaches beyond {length / 2:.3g} radii, half the box; use more particles or a larger xi"
            )
        cutoff = r[large + 1]
    i, j, vectors, distance = scenes.contacts(x, length, cutoff)
    tableF, tableG = (CubicSpline(r, y) for y in (F, G))
    f, g = tableF(distance), tableG(distance)
    for values, exact in zip((f, g), scalars(quadrature, distance[distance < 2])):
        values[distance < 2] = exact  # overlaps, beyond the kink at contact
    unit = vectors / distance[:, None]
    blocks = f[:, None, None] * np.eye(3) + (g - f)[:, None, None] * unit[:, :, None] * unit[:, None, :]
    self = scalars(quadrature, np.array([0.0]))[0][0]
    N = len(x)
    rows, columns = np.concatenate([i, j, np.arange(N)]), np.concatenate([j, i, np.arange(N)])
    data = np.concatenate([blocks, blocks, np.broadcast_to(self * np.eye(3), (N, 3, 3))])
    order = np.lexsort((columns, rows))
    starts = np.searchsorted(rows[order], np.arange(N + 1))
    return bsr_matrix((data[order], columns[order], starts), shape=(3 * N, 3 * N))


def extremes(M):
    """Smallest and largest eigenvalue, to 1e-3 of the largest or better."""
    largest = eigsh(M, 1, which="LA", tol=1e-4, return_eigenvectors=False, v0=np.ones(M.shape[0]))[0]
    smallest = eigsh(M, 1, which="SA", tol=1e-3, ncv=60, return_eigenvectors=False, v0=np.cos(np.arange(M.shape[0])))[0]
    return float(smallest), float(largest)
