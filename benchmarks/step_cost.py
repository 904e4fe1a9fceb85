# SPDX-License-Identifier: MIT
"""What a step with hydrodynamics costs, and what accuracy costs, on the CPU platform.

For hard-sphere-like suspensions at volume fraction 0.1: particle-steps per second with and without noise for a range of
tolerances, the measured error of M f against a run at 1e-9, and the ratio to a step of openmm.BrownianIntegrator with the
same System in the same run (soft repulsion between the spheres). Machines are noisy: the ratios mean more than the times.
"""
import argparse
import itertools
import time

import numpy as np
import openmm

from openmmpse import PSEBrownianIntegrator

RADIUS, VISCOSITY, TEMPERATURE, STEP = 1.0, 600.0, 300.0, 1.0  # nm, Da/(nm ps), K, ps
DRAG = 6*np.pi*VISCOSITY*RADIUS


def suspension(numParticles, phi):
    """A System of spheres with a WCA repulsion, and positions on a jittered lattice."""
    length = (numParticles*4/3*np.pi*RADIUS**3/phi)**(1/3)
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*(np.eye(3)*length))
    sigma = 2*RADIUS/2**(1/6)
    repulsion = openmm.CustomNonbondedForce(f"4*2.5*(s^12-s^6)+2.5; s={sigma}/r")
    repulsion.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    repulsion.setCutoffDistance(2*RADIUS)
    for _ in range(numParticles):
        system.addParticle(100.0)
        repulsion.addParticle([])
    system.addForce(repulsion)
    side = int(np.ceil(numParticles**(1/3)))
    cells = np.array(list(itertools.islice(itertools.product(range(side), repeat=3), numParticles)))
    jitter = np.random.default_rng(0).uniform(-0.5, 0.5, cells.shape)*max(0.0, 1 - 2*RADIUS*side/length)
    return system, (cells + 0.5 + jitter)*length/side


def hydrodynamic(system, positions, tolerance, temperature, threads):
    integrator = PSEBrownianIntegrator(temperature, VISCOSITY, RADIUS, STEP)
    integrator.setErrorTolerance(tolerance)
    integrator.setRandomNumberSeed(1)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"), {"Threads": str(threads)})
    context.setPositions(positions)
    return context, integrator


def secondsPerStep(integrators, steps, rounds):
    """Best wall-clock time of a step of each integrator, measured in turns so that a noisy moment hits all alike."""
    best = [np.inf]*len(integrators)
    for integrator in integrators:
        integrator.step(3)
    for _ in range(rounds):
        for i, integrator in enumerate(integrators):
            start = time.perf_counter()
            integrator.step(steps)
            best[i] = min(best[i], (time.perf_counter() - start)/steps)
    return best


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=16000)
    parser.add_argument("--phi", type=float, default=0.1, help="volume fraction")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    system, positions = suspension(arguments.particles, arguments.phi)

    plain = openmm.BrownianIntegrator(TEMPERATURE, DRAG/100.0, STEP)
    plainContext = openmm.Context(system, plain, openmm.Platform.getPlatformByName("CPU"), {"Threads": str(arguments.threads)})
    plainContext.setPositions(positions)

    forces = np.random.default_rng(1).normal(size=positions.shape)
    tight = hydrodynamic(system, positions, 1e-9, 0.0, arguments.threads)
    exact = tight[1].applyMobility(forces)
    del tight
    print(f"{arguments.particles} spheres, phi = {arguments.phi}, {arguments.threads} threads")
    print("tolerance  error of M f  predicted  grid         ms/step  particle-steps/s  without noise  / BrownianIntegrator")
    for tolerance in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        thermal = hydrodynamic(system, positions, tolerance, TEMPERATURE, arguments.threads)
        still = hydrodynamic(system, positions, tolerance, 0.0, arguments.threads)
        error = np.linalg.norm(thermal[1].applyMobility(forces) - exact)/np.linalg.norm(exact)
        used = thermal[1].getNumericalParameters()
        seconds = secondsPerStep((thermal[1], still[1], plain), arguments.steps, arguments.rounds)
        n = arguments.particles
        print(f"{tolerance:<9g}  {error:<12.2e}  {used['predictedError']:<9.1e}  {'x'.join(map(str, used['gridDimensions'])):<11}"
              f"  {1e3*seconds[0]:<7.1f}  {n/seconds[0]:<16.3g}  {n/seconds[1]:<13.3g}  {seconds[0]/seconds[2]:.1f}")


if __name__ == "__main__":
    main()
