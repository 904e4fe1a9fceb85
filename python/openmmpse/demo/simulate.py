# SPDX-License-Identifier: MIT
"""Runs one molecule in its box and records how its centre of mass moves.

Everything goes through openmm.app.Simulation and reporters, as in a user's own script.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import openmm
from openmm import app, unit

import openmmpse
from openmmpse.analysis import beads, finiteSizeCorrection, shortTimeDiffusion

from .parallel import add_progress

TEMPERATURE = 293.15  #: K
VISCOSITY = 1.002 * beads.MPA_S  #: water at 20 C, Da/(nm ps)
THERMAL_ENERGY = beads.thermalEnergy(TEMPERATURE)
TOLERANCE = 1e-3
FORCE_UNIT = unit.kilojoule_per_mole / unit.nanometer


class Molecule(NamedTuple):
    """A system of equal beads and what the solvent needs to know about it."""

    topology: app.Topology
    system: openmm.System
    radius: float  #: nm
    step: float  #: ps
    edge: float  #: of the cubic box, nm

    @property
    def count(self):
        return self.system.getNumParticles()


class Recorder:
    """Reporter that keeps the centre of mass and, if asked to, the drift velocity, every `interval` steps."""

    def __init__(self, integrator, interval, drift=False):
        self.integrator, self.interval, self.drift = integrator, interval, drift
        self.centres, self.drifts = [], []

    def describeNextReport(self, simulation):
        steps = self.interval - simulation.currentStep % self.interval
        include = ["positions", "forces"] if self.drift else ["positions"]
        return {"steps": steps, "periodic": False, "include": include}

    def report(self, simulation, state):
        self.centres.append(_plain(state.getPositions(asNumpy=True), unit.nanometer).mean(axis=0))
        if self.drift:
            forces = _plain(state.getForces(asNumpy=True), FORCE_UNIT)
            self.drifts.append(np.mean(self.integrator.applyMobility(forces), axis=0))


class Solvent:
    """A molecule in water, with or without hydrodynamic interactions, ready to run.

    unbounded: in infinite water instead of the molecule's periodic box.
    """

    def __init__(self, molecule, platform, seed, hydrodynamics=True, tolerance=TOLERANCE, unbounded=False):
        self.molecule, self.hydrodynamics = molecule, hydrodynamics
        self.integrator = openmmpse.PSEBrownianIntegrator(TEMPERATURE, VISCOSITY, molecule.radius, molecule.step)
        boundaries = openmmpse.PSEBrownianIntegrator
        self.integrator.setFluidBoundary(boundaries.Unbounded if unbounded else boundaries.Periodic)
        self.integrator.setErrorTolerance(tolerance)
        self.integrator.setRandomNumberSeed(seed)
        if not hydrodynamics:
            self.integrator.setMobilityModel(openmmpse.PSEBrownianIntegrator.FreeDraining)
        properties = {"Threads": "1"} if platform == "CPU" else {}
        self.simulation = app.Simulation(
            molecule.topology, molecule.system, self.integrator, openmm.Platform.getPlatform(platform), properties
        )

    @property
    def positions(self):
        """(N, 3), nm, not wrapped into the box."""
        state = self.simulation.context.getState(positions=True)
        return _plain(state.getPositions(asNumpy=True), unit.nanometer)

    def place(self, positions):
        self.simulation.context.setPositions(positions)

    def run(self, steps, cost, reporters=()):
        """Advance by `steps`, each of the given cost on the progress bar."""
        self.simulation.reporters[:] = reporters
        piece = 200
        for start in range(0, steps, piece):
            count = min(piece, steps - start)
            self.simulation.step(count)
            add_progress(count * cost)
        self.simulation.reporters.clear()

    def short_time_diffusion(self):
        """Exact short-time diffusion coefficient of the centre of mass at the present positions, in this fluid, nm^2/ps."""
        return shortTimeDiffusion(self.simulation.context)

    def one_step_displacements(self, samples):
        """(samples, 3): displacement of the centre of mass in one step at the present positions, without forces, nm."""
        return np.mean(np.asarray(self.integrator.sampleBrownianDisplacements(samples)), axis=1)


def to_infinite(molecule, gyration):
    """What to add to a diffusion coefficient measured in the molecule's box with hydrodynamics, nm^2/ps."""
    return finiteSizeCorrection(molecule.edge, VISCOSITY, THERMAL_ENERGY, molecule.radius, gyration)


def _plain(quantity, expected_unit):
    return np.asarray(quantity.value_in_unit(expected_unit))
