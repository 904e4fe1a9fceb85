# SPDX-License-Identifier: MIT
"""
Steps of an unbounded fluid against dense Cholesky factorisation by LAPACK, in one run.

A chain of touching beads in a good solvent (a self-avoiding walk by pivots), radius 0.5 nm, water. Prints one line per
number of beads: milliseconds per thermal step of the integrator on platform CPU at the default tolerance, Lanczos
iterations, and milliseconds for what a step with a dense matrix takes (filling the matrix, LAPACK's dpotrf, its product
with noise, the product with forces), with as many threads, and the ratio.

python benchmarks/unbounded.py [--beads N ...] [--threads T] [--compact] [--tolerance TOL]
"""

import argparse
import os
import time

import numpy as np
import openmm

RADIUS, VISCOSITY, TEMPERATURE, STEP = 0.5, 603.4, 293.15, 1.0
LEAST_SECONDS = 0.5


def goodSolvent(count, pivots, seed=1):
    """Self-avoiding walk of bond 2a, (N,3) nm: from a rod, by random pivots that leave no overlap."""
    rng = np.random.default_rng(seed)
    x = np.zeros((count, 3))
    x[:, 0] = 2*RADIUS*np.arange(count)
    for _ in range(pivots):
        pivot = rng.integers(1, max(2, count - 1))
        rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        moved = x[pivot] + (x[pivot + 1:] - x[pivot]) @ rotation.T
        if not _overlaps(x[:pivot + 1], moved):
            x[pivot + 1:] = moved
    return x


def _overlaps(first, second):
    for chunk in np.array_split(second, max(1, len(second)//200)):
        squares = (first**2).sum(1)[:, None] + (chunk**2).sum(1)[None, :] - 2*first @ chunk.T
        if squares.size and squares.min() < (2*RADIUS)**2*0.999:
            return True
    return False


def globule(count, seed=1):
    """Beads at a volume fraction of 0.4 in a ball: a jittered cubic lattice, (N,3) nm."""
    rng = np.random.default_rng(seed)
    spacing = RADIUS*(4*np.pi/3/0.4)**(1/3)
    side = int(np.ceil((2*count)**(1/3))) + 1
    grid = np.stack(np.meshgrid(*[np.arange(side) - side/2]*3), -1).reshape(-1, 3)*spacing
    nearest = grid[np.argsort((grid**2).sum(1))[:count]]
    return nearest + rng.uniform(-0.05, 0.05, nearest.shape)


def integratorSeconds(positions, threads, tolerance):
    """(Seconds per thermal step, Lanczos iterations of the last one)."""
    import openmmpse

    system = openmm.System()
    bonds = openmm.HarmonicBondForce()
    for i in range(len(positions)):
        system.addParticle(1)
        if i:
            bonds.addBond(i - 1, i, 2*RADIUS, 100.0)
    system.addForce(bonds)
    integrator = openmmpse.PSEBrownianIntegrator(TEMPERATURE, VISCOSITY, RADIUS, STEP)
    integrator.setFluidBoundary(integrator.Unbounded)
    integrator.setErrorTolerance(tolerance)
    integrator.setRandomNumberSeed(1)
    platform = openmm.Platform.getPlatformByName("CPU")
    context = openmm.Context(system, integrator, platform, {"Threads": str(threads)})
    context.setPositions(positions)
    seconds = _perCall(lambda: integrator.step(1))
    return seconds, integrator.getNumericalParameters()["lanczosIterations"]


def denseSeconds(positions):
    """Seconds of a step with the dense matrix: filled, factorised by LAPACK, multiplied twice."""
    from scipy.linalg import blas, lapack

    count = len(positions)
    forces, z = np.random.default_rng(2).normal(size=(2, 3*count))

    def step():
        M = denseMobility(positions)
        velocities = blas.dsymv(1.0, M, forces, lower=1)
        factor, info = lapack.dpotrf(M, lower=1, overwrite_a=1, clean=0)
        if info != 0:
            raise ValueError("the dense matrix is not positive definite")
        return velocities + blas.dtrmv(factor, z, lower=1)

    return _perCall(step)


def denseMobility(positions):
    """(3N,3N) in Fortran order, units of 1/(6 pi eta a), particles' components in three blocks."""
    count = len(positions)
    M = np.empty((3*count, 3*count), order="F")
    d = (positions[:, None] - positions[None])/RADIUS
    r2 = np.einsum("ijk,ijk->ij", d, d)
    np.fill_diagonal(r2, 1.0)
    r = np.sqrt(r2)
    near = r < 2
    F = np.where(near, 1 - 9/32*r, (0.75 + 0.5/r2)/r)
    C = np.where(near, 3/32/r, (0.75 - 1.5/r2)/(r*r2))
    np.fill_diagonal(F, 1.0)
    np.fill_diagonal(C, 0.0)
    for a in range(3):
        for b in range(a + 1):
            M[a*count:(a + 1)*count, b*count:(b + 1)*count] = C*d[:, :, a]*d[:, :, b] + (F if a == b else 0)
    return M


def _perCall(call):
    call()
    least, begin, calls = np.inf, time.perf_counter(), 0
    while calls < 3 or time.perf_counter() - begin < LEAST_SECONDS:
        start = time.perf_counter()
        call()
        least = min(least, time.perf_counter() - start)
        calls += 1
    return least


def main():
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument("--beads", type=int, nargs="+", default=[2, 5, 10, 20, 50, 100, 200, 1000])
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--tolerance", type=float, default=1e-3)
    parser.add_argument("--compact", action="store_true", help="a globule instead of a chain")
    options = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", str(options.threads))
    print(f"{'beads':>6} {'step (ms)':>10} {'iterations':>11} {'dense (ms)':>11} {'ratio':>7}")
    for count in options.beads:
        positions = globule(count) if options.compact else goodSolvent(count, min(3*count, 1500))
        seconds, iterations = integratorSeconds(positions, options.threads, options.tolerance)
        dense = denseSeconds(positions)
        print(f"{count:>6} {1e3*seconds:>10.4g} {iterations:>11} {1e3*dense:>11.4g} {dense/seconds:>7.3g}", flush=True)


if __name__ == "__main__":
    main()
