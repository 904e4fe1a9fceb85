# SPDX-License-Identifier: MIT
"""
A dumbbell in an unbounded fluid, moved by steps of Euler and Maruyama: its stationary law at a finite
time step, to rounding, without any random number and without the library.

Lengths in radii, energies in kT, mobilities in that of one sphere.
"""
from dataclasses import dataclass
from typing import Callable

import numpy as np


def unboundedRpy(r):
    """(F, G) of the Rotne-Prager-Yamakawa tensor [T3]."""
    far = np.maximum(r, 2)
    return (np.where(r < 2, 1 - 9*r/32, 3/(4*far) + 1/(2*far**3)),
            np.where(r < 2, 1 - 3*r/16, 3/(2*far) - 1/far**3))


def freeDraining(r):
    return np.zeros_like(r), np.zeros_like(r)


@dataclass(frozen=True)
class Bond:
    """
    A bond whose length r stays within (0, reach): energy and its derivative, functions of r, and
    what the other sphere does to one, (F, G)(r).
    """
    energy: Callable
    slope: Callable
    reach: float
    mobility: Callable = unboundedRpy

    def nodes(self, count=200):
        """Gauss-Legendre nodes and weights on (0, reach)."""
        x, w = np.polynomial.legendre.leggauss(count)
        return self.reach*(x + 1)/2, self.reach*w/2

    def boltzmann(self, observable):
        """The exact mean of observable(r)."""
        r, w = self.nodes()
        p = w*r*r*np.exp(-self.energy(r))
        return np.sum(p*observable(r))/np.sum(p)

    def stationary(self, dt, observable):
        """
        The mean of observable(r) after infinitely many steps dt. The length after a step depends on
        that before alone: its density, by quadrature over the direction, is the kernel of an
        integral equation, solved on the nodes (Nystroem).
        """
        r, w = self.nodes()
        K = self.kernel(r, r, dt)*w[:, None]
        K /= K.sum(axis=0) # what the quadrature and the ends of the interval lose
        # K p = p with sum p = 1
        A = K - np.eye(len(r))
        A[0] = 1
        p = np.linalg.solve(A, np.eye(len(r))[0])
        return np.sum(p*observable(r))

    def kernel(self, after, before, dt, angles=80):
        """
        Densities (len(after), len(before)) of lengths after a step. The vector after it is normal: its
        mean lies along the bond, m, its variances are those along, s2, and across, t2.
        """
        F, G = self.mobility(before)
        along, across = 2*(1 - G), 2*(1 - F)
        m = abs(before - dt*along*self.slope(before))[:, None]
        s2, t2 = 2*dt*along[:, None], 2*dt*across[:, None]
        x, w = np.polynomial.legendre.leggauss(angles)
        u, w = (x + 1)/2, w/2
        # cosine c = 1 - 2 u^2 resolves the peak at c = 1; dc = 4 u du
        c, w = 1 - 2*u*u, 4*u*w
        densities = np.empty((len(after), len(before)))
        for row, r in zip(densities, after):
            exponent = -(r*c - m)**2/(2*s2) - (r*r*(1 - c*c))/(2*t2)
            row[:] = np.exp(np.maximum(exponent, -90)) @ w*r*r/(np.sqrt(2*np.pi*s2[:, 0])*t2[:, 0])
        return densities


def springs(length, spread, pushing=1.0, mobility=unboundedRpy):
    """U = x^2/2 with x = (r - length)/spread, in kT; `pushing` times as stiff below that length."""
    def energy(r):
        x = (r - length)/spread
        return np.where(x < 0, pushing, 1.0)*x*x/2

    def slope(r):
        x = (r - length)/spread
        return np.where(x < 0, pushing, 1.0)*x/spread

    return Bond(energy, slope, length + 9*spread, mobility)
