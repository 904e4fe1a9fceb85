# SPDX-License-Identifier: MIT
"""Two beads tied by a spring, in water: an OpenMM script with the solvent's flow put in by one line."""
import openmm
from openmm import app, unit

from openmmpse import PSEBrownianIntegrator

system = openmm.System()
spring = openmm.HarmonicBondForce()
topology = app.Topology()
residue = topology.addResidue("DUM", topology.addChain())
for _ in range(2):
    system.addParticle(100 * unit.dalton)
    topology.addAtom("C", app.element.carbon, residue)
spring.addBond(0, 1, 3.0 * unit.nanometer, 10 * unit.kilojoule_per_mole / unit.nanometer**2)
system.addForce(spring)
system.setDefaultPeriodicBoxVectors([20, 0, 0], [0, 20, 0], [0, 0, 20])

# Without the solvent's flow: integrator = openmm.BrownianIntegrator(293 * unit.kelvin, friction, 10 * unit.picosecond)
integrator = PSEBrownianIntegrator(293 * unit.kelvin, 603.4, 1.0 * unit.nanometer, 10 * unit.picosecond)
integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)

simulation = app.Simulation(topology, system, integrator, openmm.Platform.getPlatform("CPU"))
simulation.context.setPositions([[0, 0, 0], [3, 0, 0]] * unit.nanometer)
simulation.step(1000)
pull = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]  # kJ/(mol nm) on the second bead: the first one follows
print("velocities in nm/ps:\n", integrator.applyMobility(pull))
print(integrator.describe())
