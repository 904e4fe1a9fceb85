# SPDX-License-Identifier: MIT
"""Fit the constants of numerics/PlanCost.h to measured steps of the CPU platform.

Prints the constants (ns on one thread) and how far the automatic splitting parameter is from the fastest one. Run it on
an otherwise idle machine; nothing depends on it at run time.
"""
import argparse
import itertools
import time

import numpy as np
import openmm
from openmm import unit

import openmmpse
from openmmpse import PSEBrownianIntegrator


def scene(numParticles, phi, tolerance, temperature, xi):
    """A jittered lattice of spheres of radius 1 nm in a cube, on one thread of the CPU platform."""
    length = (numParticles*4/3*np.pi/phi)**(1/3)
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*(np.eye(3)*length))
    for _ in range(numParticles):
        system.addParticle(1.0)
    # steps so short that the neighbour list is built once: its price does not depend on xi alone
    integrator = PSEBrownianIntegrator(temperature, 600.0, 1.0, 1e-6)
    integrator.setErrorTolerance(tolerance)
    integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
    integrator.setRandomNumberSeed(1)
    if xi:
        integrator.setSplittingParameter(xi)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName("CPU"), {"Threads": "1"})
    side = int(np.ceil(numParticles**(1/3)))
    cells = np.array(list(itertools.islice(itertools.product(range(side), repeat=3), numParticles)))
    jitter = np.random.default_rng(0).uniform(-0.2, 0.2, cells.shape)
    context.setPositions((cells + 0.5 + jitter)*length/side)
    return context, integrator


def stepTime(integrator, repeats=4):
    """Processor time of one step in ns, the best of a few, after warming up."""
    integrator.step(2)
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        integrator.step(2)
        best = min(best, (time.process_time() - start)/2)
    return best*1e9


def features(numParticles, phi, parameters):
    """What each constant of the model multiplies: [SPREAD, GRID, PAIR_BUILD, PAIR_APPLY]."""
    points = np.prod(parameters["gridDimensions"], dtype=float)
    pairs = numParticles*phi*parameters["realCutoff"]**3
    return [numParticles*parameters["windowSupport"]**3, points, pairs,
            pairs*parameters["lanczosIterations"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--particles", type=int, default=8000)
    arguments = parser.parse_args()
    rows, times, best = [], [], []
    for phi, tolerance in itertools.product((0.02, 0.1, 0.3), (1e-2, 1e-3, 1e-4)):
        measured = []
        context, integrator = scene(arguments.particles, phi, tolerance, 300.0, None)
        automatic = integrator.getNumericalParameters()["xi"]
        for factor in (0.6, 0.8, 1.0, 1.25, 1.6):
            context, integrator = scene(arguments.particles, phi, tolerance, 300.0, automatic*factor)
            nanoseconds = stepTime(integrator)
            parameters = integrator.getNumericalParameters()
            rows.append(features(arguments.particles, phi, parameters))
            times.append(nanoseconds)
            measured.append(nanoseconds)
        best.append((phi, tolerance, automatic, np.round(np.array(measured)/1e6, 2), measured[2]/min(measured)))
    from scipy.optimize import nnls
    relative = np.array(rows)/np.array(times)[:, None]
    constants, _ = nnls(relative, np.ones(len(times)))
    print("SPREAD %.2f  GRID %.1f  PAIR_BUILD %.1f  PAIR_APPLY %.2f" % tuple(constants))
    print("model/measured: %.2f .. %.2f" % ((relative @ constants).min(), (relative @ constants).max()))
    for phi, tolerance, xi, milliseconds, excess in best:
        print(f"phi {phi} tolerance {tolerance}: automatic xi {xi:.3f}, ms per step at 0.6 .. 1.6 of it {milliseconds}, "
              f"automatic/best {excess:.2f}")


if __name__ == "__main__":
    main()
