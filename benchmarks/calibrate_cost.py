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
import spheres as scenes

FACTORS = (0.65, 0.8, 1.0, 1.2, 1.4)  # of the automatic splitting parameter
NAMES = ("SPREAD", "PER PARTICLE (not in the model: no choice depends on it)", "GRID", "PAIR_BUILD", "PAIR_APPLY")


def scene(numParticles, phi, tolerance, split, xi):
    """A Context on one thread with a jittered lattice of spheres; with an automatic xi if xi is None."""
    positions, length = scenes.lattice(numParticles, phi)
    return scenes.hydrodynamic(scenes.makeSystem(numParticles, length), positions, tolerance, threads=1, split=split,
                               parameters={"xi": xi} if xi else None)


def stepTime(integrator):
    """Processor time of one step in ns, the best of a few, after warming up."""
    return 1e9*scenes.secondsPerStep([integrator], steps=2, rounds=8, clock=time.process_time)[0]


def features(numParticles, phi, parameters):
    """What each of NAMES multiplies."""
    points = np.prod(parameters["gridDimensions"], dtype=float)
    pairs = numParticles*phi*(parameters["realCutoff"]/scenes.RADIUS)**3
    return [numParticles*parameters["windowSupport"]**3, numParticles, points, pairs,
            pairs*(parameters["lanczosIterations"] + 1)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--particles", type=int, default=8000)
    arguments = parser.parse_args()
    rows, times = [], []
    for phi, tolerance, split in itertools.product((0.02, 0.1, 0.3), (1e-2, 1e-3, 1e-4), ("Prolate", "Hasimoto")):
        made, integrator = scene(arguments.particles, phi, tolerance, split, None)
        automatic = integrator.getNumericalParameters()["xi"]
        measured = []
        for factor in FACTORS:
            try:
                made, integrator = scene(arguments.particles, phi, tolerance, split, automatic*factor)
            except openmm.OpenMMException:  # no prolate split at this range
                measured.append(np.nan)
                continue
            measured.append(stepTime(integrator))
            rows.append(features(arguments.particles, phi, integrator.getNumericalParameters()))
            times.append(measured[-1])
        excess = measured[FACTORS.index(1.0)]/np.nanmin(measured)
        print(f"phi {phi} tolerance {tolerance:g} {split}: automatic xi {automatic:.3f}, ms/step at {FACTORS} of it "
              f"{np.round(np.array(measured)/1e6, 2)}, automatic/best {excess:.2f}", flush=True)
    from scipy.optimize import nnls
    relative = np.array(rows)/np.array(times)[:, None]
    constants, _ = nnls(relative, np.ones(len(times)))
    for name, constant in zip(NAMES, constants):
        print(f"{name}: {constant:.2f} ns")
    print(f"model/measured: {(relative @ constants).min():.2f} .. {(relative @ constants).max():.2f}")


if __name__ == "__main__":
    main()
