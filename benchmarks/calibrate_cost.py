# SPDX-License-Identifier: MIT
"""Fit the constants of numerics/PlanCost.h to measured steps of the CPU platform.

Prints the constants (ns on one thread) and how far the automatic splitting parameter is from the fastest one. Run it on
an otherwise idle machine; nothing depends on it at run time.
"""
import argparse
import itertools
import time

import numpy as np

import scenes

STEP = 1e-6  # ps: so short that the neighbour list is built once, because its price does not depend on xi alone


def scene(numParticles, phi, tolerance, temperature, xi):
    """A jittered lattice of spheres on one thread of the CPU platform, with an automatic xi if xi is None."""
    positions, length = scenes.lattice(numParticles, phi)
    parameters = {"xi": xi} if xi else None
    return scenes.hydrodynamic(scenes.makeSystem(numParticles, length), positions, tolerance, temperature, threads=1,
                               parameters=parameters, step=STEP)


def stepTime(integrator):
    """Processor time of one step in ns, the best of a few, after warming up."""
    return 1e9*scenes.secondsPerStep([integrator], steps=2, rounds=4, clock=time.process_time)[0]


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
        print(f"phi {phi} tolerance {tolerance:g}: automatic xi {xi:.3f}, ms/step at 0.6 .. 1.6 of it {milliseconds}, "
              f"automatic/best {excess:.2f}")


if __name__ == "__main__":
    main()
