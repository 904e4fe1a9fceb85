# SPDX-License-Identifier: MIT
"""
DNA in shear flow: how far a long molecule is stretched, against the Weissenberg number.

Bacteriophage lambda DNA, stained and 21 um long, as 11 beads on 10 springs with the elasticity of worm-like chains
(Marko and Siggia 1995; bead radius 77 nm and Kuhn length 106 nm of Jendrejack, de Pablo and Graham 2002, J. Chem. Phys.
116, 7752; no excluded volume), in an unbounded fluid. Shear makes chains tumble, so that they are never stretched out
for long. Wi is the shear rate times the time in which the square of a stretch relaxes, half that of the slowest mode.

Expected: single molecules under the microscope stretch to 40 to 50 % on average at high Wi (Smith, Babcock, Chu 1999,
Science 283, 1724); at rest the mean square end-to-end distance of worm-like springs, by quadrature; and, in a control
with linear springs and without hydrodynamic interactions, <R^2> of a Rouse chain in shear flow, in closed form.
"""
import math

import numpy as np
import openmm
from shared import DRY, KT, WET, Row, chain, fluid, main, meanOf, mobility, plainTicks, plt, positionsOf, save
from tqdm import tqdm
from zimm_and_rouse import expected

RADIUS, KUHN, LENGTH, COUNT = 77.0, 106.0, 2098.8, 11  #: nm, nm, nm of a spring, beads
BOND = math.sqrt(LENGTH * KUHN)  #: nm, root mean square of a spring that is hardly stretched
SPRING = 3 * KT / BOND**2
TIME = 1 / (SPRING * mobility(RADIUS))  #: ps, in which one such spring pulls in a bead
PUBLISHED, SPREAD = 0.45, 0.1  #: fractional stretch at high Wi, and what measurements and models differ by


def wormlike():
    """The chain; a spring stretched beyond 90 % goes on as a linear one: steps would jump over the singularity."""
    near, c = "0.25/(1 - x) - x/4 + x^2/2", 0.9
    value, slope, bend = 0.25 / (1 - c) - c / 4 + c**2 / 2, 0.25 / (1 - c)**2 - 0.25 + c, 0.5 / (1 - c)**3 + 1
    energy = (f"{2 * KT * LENGTH / KUHN}*select(step({c} - x), {near}, {value} + {slope}*(x - {c}) "
              f"+ {bend / 2}*(x - {c})^2); x = r/{LENGTH}")
    return chain(COUNT, openmm.CustomBondForce(energy), ([],))


def atRest():
    """Mean square end-to-end distance of worm-like springs, nm^2."""
    x = (np.arange(20000) + 0.5) / 20000
    weight = x**2 * np.exp(-2 * LENGTH / KUHN * (0.25 / (1 - x) - 0.25 - x / 4 + x**2 / 2))
    return (COUNT - 1) * LENGTH**2 * (weight * x**2).sum() / weight.sum()


def rouse(rate):
    """<R^2> of linear springs without hydrodynamics at a shear rate: each mode of stiffness k stretches by itself."""
    p = np.arange(1, COUNT)[:, None]
    modes = math.sqrt(2 / COUNT) * np.cos(math.pi * p * (np.arange(COUNT) + 0.5) / COUNT)
    stiffness = 4 * SPRING * np.sin(math.pi * p[:, 0] / (2 * COUNT))**2
    ends = (modes[:, -1] - modes[:, 0])**2 * KT / stiffness
    return (ends * (3 + (rate / (mobility(RADIUS) * stiffness))**2 / 2)).sum()


def shear(system, wi, hydrodynamics, times, fraction, options, bar):
    """End-to-end vectors (records, 3) and stretch along the flow (records,), nm, and some shapes, at Wi."""
    tau = expected(COUNT, hydrodynamics, RADIUS, BOND)[1]
    step, interval = fraction * TIME, max(1, round(0.02 * tau / (fraction * TIME)))
    context, integrator = fluid(system, RADIUS, step, options, hydrodynamics, seed=round(100 * wi))
    integrator.setShearRate(2 * wi / tau)
    generator = np.random.default_rng(options.seed)
    context.setPositions(np.cumsum(generator.normal(size=(COUNT, 3)) * BOND / 2, axis=0))
    integrator.step(round(8 * tau / step))
    ends, stretch, shapes = [], [], []
    for i in range(round(times * tau / (interval * step))):
        integrator.step(interval)
        x = positionsOf(context)
        ends.append(x[-1] - x[0])
        stretch.append(np.ptp(x[:, 0]))
        if i % 100 == 0:
            shapes.append(x - x.mean(axis=0))
        bar.update(interval)
    return np.array(ends), np.array(stretch), shapes


def blocked(series, blocks=20):
    """(mean, standard error, degrees of freedom) of a correlated series, from blocks of it."""
    return meanOf([block.mean() for block in np.array_split(series, blocks)])


def run(options):
    numbers, times = ([0, 3], 60) if options.short else ([0, 1, 3, 10, 30, 100], 40)
    linear = chain(COUNT, openmm.HarmonicBondForce(), (0.0, SPRING))
    rows, found = [], []
    with tqdm(desc="steps", unit_scale=True, disable=None) as bar:
        wi, tau = 2.0, expected(COUNT, False, RADIUS, BOND)[1]
        ends = shear(linear, wi, False, 4 * times, 0.04, options, bar)[0]
        value, error, degrees = blocked((ends**2).sum(axis=1) / rouse(0))
        rows.append(Row("Rouse chain, Wi = 2: <R^2>/<R^2>0", value, error, rouse(2 * wi / tau) / rouse(0), "modes",
                        0.02 * value, degrees))
        for wi in numbers:
            much, fraction = (times, 0.01) if wi < 5 else (0.4 * times, 0.0015)
            ends, stretch, shapes = shear(wormlike(), wi, True, much, fraction, options, bar)
            found.append((*blocked(stretch / ((COUNT - 1) * LENGTH)), shapes[-1]))
            if wi == 0:
                value, error, _ = blocked((ends**2).sum(axis=1) / atRest())
                rows.append(Row("DNA at rest: <R^2>/quadrature", value, error, 1.0, "quadrature", 0.02, degrees))
            rows.append(Row(f"DNA, Wi = {wi}: stretch", *found[-1][:2], PUBLISHED if wi >= 100 else np.nan,
                            "Smith et al." if wi >= 100 else "", SPREAD, degrees))
    draw(numbers, found, options)
    return rows


def draw(numbers, found, options):
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 3.6), width_ratios=(1.3, 1))
    for i, (wi, (*_, x)) in enumerate(zip(numbers, found)):
        left.plot(x[:, 0] / 1000, x[:, 1] / 1000 - 3 * i, "o-", color=WET, ms=3, lw=1)
        left.annotate(f"Wi = {wi}", (-13, -3 * i), va="center")
    left.set(aspect="equal", xlim=(-13, 11), xlabel="um, along the flow", yticks=[], title="snapshots")
    left.spines["left"].set_visible(False)
    right.errorbar(numbers, [f[0] for f in found], [f[1] for f in found], fmt="o-", color=WET)
    right.axhspan(0.4, 0.5, color=DRY, alpha=0.2, lw=0)
    right.annotate("measured at high Wi", (0, 0.51), color=DRY)
    right.set(xscale="symlog", ylim=(0, 0.7), xlabel="Wi", title="mean stretch over contour length")
    plainTicks(right.xaxis, numbers)
    save(figure, options, "sheared_dna.png")


if __name__ == "__main__":
    main(run, __doc__)
