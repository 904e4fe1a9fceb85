# SPDX-License-Identifier: MIT
"""
A parameter sweep: diffusion of ideal chains over their length and with several seeds, many runs at once.

Each run, a length with a seed, goes to a process of Dask distributed; whatever is interrupted goes on from its last
checkpoint when the same command is given again. Runs of the same length make one number with an error bar.

Expected: without hydrodynamics D0/N, with it less than Kirkwood's sum over the shapes that were seen,
which is an upper bound of the diffusion coefficient at long times.
"""
import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import openmm

from openmmpse import PSEBrownianIntegrator, analysis, ensemble

TEMPERATURE, VISCOSITY = 293.15, 1.002 * analysis.MPA_S  # K, Da/(nm ps): water
KT = analysis.thermalEnergy(TEMPERATURE)
RADIUS, BOND, STEP = 0.5, 1.0, 10.0  # nm, nm (root mean square), ps
RECORDS = 500  # of each run, and
LAG = 5  # how many of them to the first lag of the fit


def build(count, hydrodynamics, seed):
    """A Context with a chain drawn from equilibrium, in an unbounded fluid."""
    system, bonds = openmm.System(), openmm.HarmonicBondForce()
    for i in range(count):
        system.addParticle(1.0)
        if i > 0:
            bonds.addBond(i - 1, i, 0.0, 3 * KT / BOND**2)
    system.addForce(bonds)
    integrator = PSEBrownianIntegrator(TEMPERATURE, VISCOSITY, RADIUS, STEP)
    integrator.setFluidBoundary(PSEBrownianIntegrator.Unbounded)
    integrator.setRandomNumberSeed(seed)
    if not hydrodynamics:
        integrator.setMobilityModel(PSEBrownianIntegrator.FreeDraining)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform("CPU"))
    steps = np.random.default_rng([seed, count]).normal(scale=BOND / np.sqrt(3), size=(count, 3))
    context.setPositions(np.cumsum(steps, axis=0))
    return context


def simulate(run):
    """One run: diffusion coefficient of the centre at long times, and Kirkwood's of its shapes, nm^2/ps."""
    count, hydrodynamics, length = run.scene["beads"], run.scene["hydrodynamics"], run.scene["length"]
    shape = analysis.gaussianChainKirkwood(count, BOND, RADIUS, VISCOSITY, KT)
    relaxation = BOND**2 * (count - 1 / count) / 6 / shape  # Rg^2/D: shapes are forgotten in a fifth of it
    interval = max(1, round(length * relaxation / RECORDS / STEP))

    def observe(context):
        x = context.getState(positions=True).getPositions(asNumpy=True)._value
        return [*x.mean(axis=0), analysis.kirkwood(x, RADIUS, VISCOSITY, KT)]

    series = run.follow(build(count, hydrodynamics, run.noiseSeed), RECORDS * interval, interval, observe)
    time = interval * STEP
    fit = analysis.diffusion(series[:, :3], time, start=LAG * time, count=3, offset=hydrodynamics)
    return {"D": fit.coefficient, "Kirkwood": series[:, 3].mean()}


def draw(table, path):
    """Diffusion coefficients against length, each the mean over seeds, and one line of text for each."""
    alone, lines = KT * analysis.stokesMobility(RADIUS, VISCOSITY), []
    figure, axes = plt.subplots(figsize=(5.2, 3.8), layout="constrained")
    for wet, color in ((True, "#0072B2"), (False, "#D55E00")):
        means = []
        for count, runs in table[table["hydrodynamics"] == wet].groupby("beads"):
            # Each run has its own error bar, of ten blocks: together they know it better than the spread of a few runs.
            error = np.sqrt(np.square(runs["D_error"]).sum()) / len(runs)
            D, shape = analysis.Estimate(runs["D"].mean(), error).scaled(1 / alone), runs["Kirkwood"].mean() / alone
            means.append((count, *D, shape if wet else 1 / count))
            lines.append(f"{'with' if wet else 'without':>7} hydrodynamics, {count:3} beads: D/D0 = {D.value:.4f} +- "
                         f"{D.error:.4f}, {'Kirkwood' if wet else 'Rouse'} {means[-1][-1]:.4f}")
        counts, values, errors, expected = np.array(means).T
        axes.plot(counts, expected, color=color, lw=1, label="Kirkwood's sum" if wet else "$D_0/N$")
        axes.errorbar(counts, values, errors, fmt="o", color=color, capsize=3, label="with hydrodynamics" if wet else
                      "without")
    axes.set(xscale="log", yscale="log", xlabel="beads $N$", ylabel="$D/D_0$ at long times")
    axes.set_xticks(counts, [f"{count:g}" for count in counts])
    axes.minorticks_off()
    axes.legend(frameon=False)
    figure.savefig(path, dpi=120)
    plt.close(figure)
    return lines


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="seconds instead of minutes, with wider error bars")
    parser.add_argument("--output", type=Path, default=Path("example-output"), help="folder of all files")
    options = parser.parse_args(argv)
    counts, length, seeds = ((5, 10), 5, 3) if options.short else ((5, 10, 20, 40), 20, 8)
    scenes = [{"beads": n, "hydrodynamics": wet, "length": length} for n in counts for wet in (True, False)]
    table = ensemble.runEnsemble(simulate, scenes, seeds, options.output / "parameter_sweep")
    print("\n".join(draw(table, options.output / "parameter_sweep.png")))
    print(f"all runs: {options.output / 'parameter_sweep' / ensemble.TABLE}")


if __name__ == "__main__":
    plt.switch_backend("Agg")
    main()
