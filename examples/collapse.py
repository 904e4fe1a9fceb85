# SPDX-License-Identifier: MIT
"""
Collapse of a polymer in a poor solvent, with and without hydrodynamic interactions.

Swollen chains of beads are put into a solvent in which beads attract each other by 2 kT. They form pearls, pearls
merge, and the chain ends as a globule. Pearls that are pulled together through a fluid move it along: hydrodynamic
interactions make the collapse faster, the more so the longer the chain is.

Expected: the ratio of collapse times without and with hydrodynamic interactions grows as N^0.49, with an error of 0.12:
N^1.89 over N^1.40 (Kikuchi, Ryder, Pooley and Yeomans 2005, Phys. Rev. E 71, 061804, who argue for 2 and 4/3). Here the
time is that in which four fifths of the way of the mean square radius of gyration to that of a globule are done, in
short chains, whose single exponents are smaller than those and are printed without anything to compare with.
"""
import numpy as np
import openmm
from shared import DRY, KT, WET, Row, chain, fluid, main, meanOf, mobility, plainTicks, plt, positionsOf, save
from tqdm import tqdm

RADIUS, BOND, DEPTH, RANGE = 0.5, 1.0, 2.0, 0.25  #: nm, nm, kT, and range of the attraction in nm
TIME = BOND**2 / (KT * mobility(RADIUS))  #: ps, in which a bead diffuses over a bond (over six)
STEP = {True: 0.0015 * TIME, False: 0.0005 * TIME}  #: neighbours that drag each other along relax slower
RECORD = 0.1 * TIME
PUBLISHED = 1.89 - 1.40, np.hypot(0.09, 0.08)  #: exponent of the ratio of times, and its error


def system(count):
    """Beads on stiff springs, which attract each other by the potential of Morse."""
    stiffness = 2 * DEPTH * KT / RANGE**2  # of the attraction; that of the bonds is the same
    result = chain(count, openmm.HarmonicBondForce(), (BOND, stiffness))
    pairs = openmm.CustomNonbondedForce(f"{DEPTH * KT}*(e^2 - 2*e); e = exp(({BOND} - r)/{RANGE})")
    pairs.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffNonPeriodic)
    pairs.setCutoffDistance(2.5 * BOND)
    for i in range(count):
        pairs.addParticle([])
    for i in range(count - 1):
        pairs.addExclusion(i, i + 1)
    result.addForce(pairs)
    return result


def swollen(count, generator):
    """A self-avoiding walk (count, 3), nm: grown bead by bead, begun anew where it finds no free place."""
    while True:
        x = np.zeros((1, 3))
        while 0 < len(x) < count:
            steps = generator.normal(size=(20, 3))
            trials = x[-1] + BOND * steps / np.linalg.norm(steps, axis=1)[:, None]
            free = (np.linalg.norm(trials[:, None] - x, axis=-1) > 0.99 * BOND).all(axis=1)
            x = np.vstack([x, trials[free.argmax()]]) if free.any() else x[:0]
        if len(x) == count:
            return x


def threshold(start, count):
    """Mean square radius of gyration (nm^2) when four fifths of the way from `start` to the globule's are done."""
    return 0.2 * start + 0.8 * 0.16 * BOND**2 * count**(2 / 3)


def collapse(count, chains, hydrodynamics, options, bar):
    """Square radii of gyration (chains, records), nm^2, until their mean passes the threshold, and a chain then."""
    step = STEP[hydrodynamics]
    context, integrator = fluid(system(count), RADIUS, step, options, hydrodynamics, seed=count)
    generator = np.random.default_rng([options.seed, count])
    states = [swollen(count, generator) for _ in range(chains)]
    radii = [[x.var(axis=0).sum() for x in states]]
    while np.mean(radii[-1]) > threshold(np.mean(radii[0]), count):
        for i in range(chains):
            context.setPositions(states[i])
            integrator.step(round(RECORD / step))
            states[i] = positionsOf(context)
            bar.update(round(RECORD / step) * count)
        radii.append([x.var(axis=0).sum() for x in states])
    return np.transpose(radii), states[0]


def duration(radii, count):
    """Time (ps) in which the mean of radii (chains, records) passes the threshold, between the last two records."""
    mean = radii.mean(axis=0)
    before, after = mean[-2:] - threshold(mean[0], count)
    return (radii.shape[1] - 1 - after / (after - before)) * RECORD


def run(options):
    counts, chains = ([16, 32], 40) if options.short else ([30, 60, 120], 24)
    rows, times, errors = [], {}, {}
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 3.4))
    with tqdm(desc="chains", unit=" bead steps", unit_scale=True, disable=None) as bar:
        for wet, color, name in ((True, WET, "with"), (False, DRY, "without")):
            found = [collapse(count, chains, wet, options, bar) for count in counts]
            times[wet] = np.array([duration(radii, count) for (radii, _), count in zip(found, counts)])
            errors[wet] = np.array([meanOf([duration(np.delete(radii, i, axis=0), count) for i in range(chains)])[1]
                                    * (chains - 1) for (radii, _), count in zip(found, counts)])  # jackknife
            radii, last = found[-1]
            axes[1].plot(np.arange(radii.shape[1]) * RECORD / 1000, radii.mean(axis=0), color=color, label=name)
            axes[2].errorbar(counts, times[wet] / 1000, errors[wet] / 1000, fmt="o-", color=color)
            last = last - last.mean(axis=0) + [0, 0 if wet else -8, 0]
            axes[0].plot(last[:, 0], last[:, 1], "o-", ms=7, lw=1, color=color, mec="white")
    shares = {wet: errors[wet] / times[wet] for wet in times}  # relative errors
    ratios, relative = times[False] / times[True], np.hypot(shares[True], shares[False])
    for count, ratio, share in zip(counts, ratios, relative):
        rows.append(Row(f"N = {count}: faster by a factor of", ratio, ratio * share, np.nan, "", 0.0, chains - 1))
    for name, y, share in (("with hydrodynamics", times[True], shares[True]), ("without", times[False], shares[False]),
                           ("the ratio", ratios, relative)):
        slope, error = np.array([np.log(y[-1] / y[0]), np.hypot(share[0], share[-1])]) / np.log(counts[-1] / counts[0])
        rows.append(Row(f"exponent: {name}", slope, error, np.nan, "", 0.0, chains - 1))
    rows[-1] = rows[-1]._replace(expected=PUBLISHED[0], source="Kikuchi et al.", slack=PUBLISHED[1])
    axes[0].set(aspect="equal", xlabel="nm", title="chains at the end")
    axes[1].set(xlabel="time, ns", title=f"Rg^2 of {counts[-1]} beads, nm2")
    axes[1].legend(title="hydrodynamics")
    axes[2].set(xscale="log", yscale="log", xlabel="beads", title="time of collapse, ns")
    plainTicks(axes[2].xaxis, counts)
    plainTicks(axes[2].yaxis, (2, 5, 10, 20, 50))
    save(figure, options, "collapse.png")
    return rows


if __name__ == "__main__":
    main(run, __doc__)
