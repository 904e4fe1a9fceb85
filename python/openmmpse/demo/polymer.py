# SPDX-License-Identifier: MIT
"""Ideal bead-spring chain: beads on a Gaussian random walk, held by springs without length."""

from __future__ import annotations

import numpy as np
import openmm
from openmm import app

from . import simulate

COUNT = 100
RADIUS = 0.5  #: nm
BOND = 2 * RADIUS  #: root mean square bond length, nm
EDGE = 40.0  #: nm, ten radii of gyration
GYRATION = BOND * ((COUNT - 1.0 / COUNT) / 6) ** 0.5  #: nm; exact, Rg^2 = b^2 (N^2 - 1)/(6 N)
STEP = 8.0  #: ps; root mean square displacement of a free bead 0.29 radii per step, fastest spring rate times step 0.04
BEAD_MASS = 100.0  #: Da; it does not enter Brownian motion


def equilibrium(generator, count=COUNT, bond=BOND):
    """One chain drawn from equilibrium, (count, 3) in nm, mean at the origin: no run-in is needed."""
    steps = generator.normal(scale=bond / np.sqrt(3.0), size=(count - 1, 3))
    walk = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    return walk - walk.mean(axis=0)


def build():
    """The chain as a `Molecule`: springs of constant 3 kT/b^2 give bonds of root mean square length b."""
    system = openmm.System()
    topology = app.Topology()
    chain = topology.addChain("A")
    carbon = app.Element.getBySymbol("C")
    springs = openmm.HarmonicBondForce()
    atoms = []
    for i in range(COUNT):
        system.addParticle(BEAD_MASS)
        atoms.append(topology.addAtom("C", carbon, topology.addResidue("BEA", chain)))
        if i:
            springs.addBond(i - 1, i, 0.0, 3 * simulate.THERMAL_ENERGY / BOND**2)
            topology.addBond(atoms[i - 1], atoms[i])
    system.addForce(springs)
    system.setDefaultPeriodicBoxVectors((EDGE, 0, 0), (0, EDGE, 0), (0, 0, EDGE))
    topology.setUnitCellDimensions((EDGE, EDGE, EDGE))
    return simulate.Molecule(topology, system, RADIUS, STEP, EDGE)
