# SPDX-License-Identifier: MIT
"""
Zimm against Rouse: how diffusion and relaxation of a chain in a theta solvent depend on its length.

Ideal chains of 10 to 300 beads in an unbounded fluid, with and without hydrodynamic interactions. Beads that drag each
other along let the chain diffuse as D ~ N^-1/2 (Zimm) instead of N^-1 (Rouse), and its slowest mode relax in N^3/2
instead of N^2. The relaxation of 300 beads in a fluid is left out: to measure it takes hundreds of chains.

Expected, without any free parameter: D by Kirkwood's sum over Gaussian chains in closed form; 1/tau by the mean rate at
which the mode begins to decay, stiffness times <v M v>; memory makes it slower by a few percent in a fluid.
"""
import math

import numpy as np
import openmm
from shared import DRY, KT, VISCOSITY, WET, Row, meanOf, mobility, plainTicks, plt, ratioOf
from shared import chain, fluid, forcesOf, main, positionsOf, save
from tqdm import tqdm

from openmmpse import analysis
from openmmpse.demo import polymer

RADIUS, BOND = 0.5, 1.0  #: nm; root mean square length of a bond
SPRING = 3 * KT / BOND**2
RECORDS, LAG = 40, 8  #: records per relaxation time, and how many of them the decay is taken over
CHAINS, TOO_LONG = 64, 300  #: behind a diffusion coefficient; beads of a chain whose relaxation is not measured
MEMORY = 0.05  #: by which a mode in a fluid may be slower than it begins


def expected(count, hydrodynamics, radius=RADIUS, bond=BOND):
    """Diffusion coefficient (nm^2/ps), relaxation time (ps) and vector (N,) of the mode."""
    mode = np.cos(math.pi * (np.arange(count) + 0.5) / count) * math.sqrt(2 / count)
    stiffness = 4 * 3 * KT / bond**2 * math.sin(math.pi / (2 * count))**2
    if not hydrodynamics:
        return KT * mobility(radius) / count, 1 / (mobility(radius) * stiffness), mode
    # sums over all pairs of ever longer chains: second differences are the mean mobility of a pair
    sums = [n**2 * analysis.gaussianChainKirkwood(n, bond, radius, VISCOSITY, KT) / KT for n in range(1, count + 1)]
    row = np.diff([0, 0, *sums], n=2) / 2
    row[0] *= 2  # a bead and itself are one pair, not two
    matrix = row[abs(np.subtract.outer(np.arange(count), np.arange(count)))]
    return KT * matrix.mean(), 1 / (stiffness * mode @ matrix @ mode), mode


def diffusion(integrator, context, chains, step):
    """Diffusion coefficient (nm^2/ps) by thermal displacements of the centres of equilibrium chains."""
    values = []
    for x in chains:
        context.setPositions(x)
        centres = np.mean(integrator.sampleBrownianDisplacements(50), axis=1)
        values.append((centres**2).sum(axis=1).mean() / (6 * step))
    return meanOf(values)


def follow(count, replicas, hydrodynamics, options, bar):
    """(value, error, degrees of freedom) of the diffusion coefficient (nm^2/ps) and of the relaxation time (ps)."""
    _, tau, mode = expected(count, hydrodynamics)
    step = min((0.03 if hydrodynamics else 0.1) / (SPRING * mobility(RADIUS)), tau / RECORDS / 4)
    interval = round(tau / RECORDS / step)
    system = chain(count, openmm.HarmonicBondForce(), (0.0, SPRING))
    context, integrator = fluid(system, RADIUS, step, options, hydrodynamics, seed=count, threads=1 + (count >= 100))
    generator = np.random.default_rng([options.seed, count])
    found = diffusion(integrator, context, [polymer.equilibrium(generator, count, BOND) for _ in range(CHAINS)], step)
    if hydrodynamics and count >= TOO_LONG:
        return found, (0, 0, 0)
    lost, begun = [], []
    for _ in range(replicas):
        context.setPositions(polymer.equilibrium(generator, count, BOND))
        x, v = [], []
        for _ in range(3 * LAG + 1):
            x.append(mode @ positionsOf(context))
            v.append(mode @ integrator.applyMobility(forcesOf(context)))
            integrator.step(interval)
            bar.update(interval * count)
        # noise does not know what was before it, so the drift alone tells how a mode is forgotten over LAG records
        x, v = np.array(x[:-LAG]), np.array(v)
        path = sum(v[i:len(x) + i] + v[i + 1:len(x) + i + 1] for i in range(LAG)) * interval * step / 2
        lost.append(-(x * path).sum())
        begun.append((x * x).sum())
    decay, error, degrees = ratioOf(lost, begun)
    time = -(span := LAG * interval * step) / math.log1p(-decay)
    return found, (time, time**2 / span * error / (1 - decay), degrees)


def exponent(counts, values, errors, exact):
    """Slope of log values over log counts by weights of their errors, its error, and that of the exact values."""
    weights = (values / errors)**2
    away = np.log(counts) - np.average(np.log(counts), weights=weights)
    norm = (weights * away**2).sum()
    return (weights * away) @ np.log(values) / norm, norm**-0.5, (weights * away) @ np.log(exact) / norm


def run(options):
    counts, replicas = ([10, 20, 30], [30] * 3) if options.short else ([10, 30, 100, 300], [256, 128, 32, 5])
    rows, (figure, axes) = [], plt.subplots(1, 2, figsize=(8.6, 3.8))
    with tqdm(desc="chains", unit=" bead steps", unit_scale=True, disable=None) as bar:
        for name, wet, color in (("Zimm", True, WET), ("Rouse", False, DRY)):
            found = np.array([follow(*pair, wet, options, bar) for pair in zip(counts, replicas)])
            quantities = ("D/D0", KT * mobility(RADIUS), 0, "Kirkwood"), ("tau, ns", 1000, MEMORY * wet, "first decay")
            for column, (what, unit, slack, source) in enumerate(quantities):
                n = np.count_nonzero(found[:, column, 0])
                exact = np.array([expected(count, wet)[column] for count in counts[:n]]) / unit
                value, error, degrees = found[:n, column].T / [[unit], [unit], [1]]
                rows += [Row(f"{name}, N = {counts[i]}: {what}", value[i], error[i], exact[i], source if wet else name,
                             slack * exact[i], degrees[i]) for i in range(n)]
                slope, *others = exponent(counts[:n], value, error, exact)
                rows.append(Row(f"{name}: exponent of {what.split(',')[0]}", slope, *others, "the same",
                                slack / math.log(3), degrees.min()))
                axes[column].errorbar(counts[:n], value, error, fmt="o", color=color, label=f"{name}: {slope:.2f}")
                axes[column].plot(counts[:n], exact, color=color, lw=1)
    for axis, title in zip(axes, ("diffusion coefficient over that of a bead", "relaxation time of the chain, ns")):
        axis.set(xscale="log", yscale="log", xlabel="beads", title=title)
        axis.legend(title="exponents")
        plainTicks(axis.xaxis, counts)
    save(figure, options, "zimm_and_rouse.png")
    return rows


if __name__ == "__main__":
    main(run, __doc__)
