# SPDX-License-Identifier: MIT
"""What a step with hydrodynamics costs, and what accuracy costs, on the CPU platform.

For hard-sphere-like suspensions at volume fraction 0.1: particle-steps per second with and without noise for a range of
tolerances, the measured error of M f against a run at 1e-9, and the ratio to a step of openmm.BrownianIntegrator with
the same System in the same run (soft repulsion between the spheres). Machines are noisy: the ratios mean more than the
times.
"""
import argparse

import numpy as np
import openmm

import spheres as scenes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=16000)
    parser.add_argument("--phi", type=float, default=0.1, help="volume fraction")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    positions, length = scenes.lattice(arguments.particles, arguments.phi)
    system = scenes.makeSystem(arguments.particles, length, repulsion=True)
    plain = openmm.BrownianIntegrator(scenes.TEMPERATURE, scenes.DRAG/scenes.MASS, scenes.STEP)
    plainContext = scenes.context(system, positions, plain, arguments.threads)

    forces = np.random.default_rng(1).normal(size=positions.shape)
    tight = scenes.hydrodynamic(system, positions, 1e-9, 0.0, arguments.threads)
    exact = tight[1].applyMobility(forces)
    del tight
    print(f"{arguments.particles} spheres, phi = {arguments.phi}, {arguments.threads} threads")
    print("tolerance  error of M f  predicted  grid         ms/step  particle-steps/s  without noise  / Brownian")
    for tolerance in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        thermal = scenes.hydrodynamic(system, positions, tolerance, scenes.TEMPERATURE, arguments.threads)
        still = scenes.hydrodynamic(system, positions, tolerance, 0.0, arguments.threads)
        error = np.linalg.norm(thermal[1].applyMobility(forces) - exact)/np.linalg.norm(exact)
        used = thermal[1].getNumericalParameters()
        seconds = scenes.secondsPerStep((thermal[1], still[1], plain), arguments.steps, arguments.rounds)
        n = arguments.particles
        grid = "x".join(map(str, used["gridDimensions"]))
        print(f"{tolerance:<9g}  {error:<12.2e}  {used['predictedError']:<9.1e}  {grid:<11}  {1e3*seconds[0]:<7.1f}"
              f"  {n/seconds[0]:<16.3g}  {n/seconds[1]:<13.3g}  {seconds[0]/seconds[2]:.1f}")


if __name__ == "__main__":
    main()
