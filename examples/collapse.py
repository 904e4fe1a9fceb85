# SPDX-License-Identifier: MIT
"""
Collapse of a polymer in a poor solvent, with and without hydrodynamic interactions.

Swollen chains of beads are put into a solvent in which beads attract each other by 2 kT. They form pearls, pearls
merge, and the chain ends as a globule. Pearls that are pulled together through a fluid move it along: hydrodynamic
interactions make the collapse faster, the more so the longer the chain is.

Expected: collapse times grow as N^1.40 (+- 0.08) with and as N^1.89 (+- 0.09) without hydrodynamic interactions
(Kikuchi, Ryder, Pooley and Yeomans 2005, Phys. Rev. E 71, 061804; they argue for 4/3 and 2), measured there by another
model. Here it is the time in which four fifths of the way of the mean square radius of gyration to that of a globule
are done, in chains so short that exponents may differ from those by 0.4.
"""
import numpy as np
import openmm
from common import DRY, KT, WET, Row, chain, fluid, main, meanOf, mobility, plainTicks, plt, positionsOf, save
from tqdm import tqdm

RADIUS, BOND, DEPTH, RANGE = 0.5, 1.0, 2.0, 0.25  #: nm, nm, kT, and range of the attraction in nm
TIME = BOND**2 / (KT * mobility(RADIUS))  #: ps, in which a bead diffuses over a bond (over six)
STEP = {True: 0.0015 * TIME, False: 0.0005 * TIME}  #: neighbours that drag each other along relax slower
RECORD = 0.1 * TIME
PUBLISHED = {True: (1.40, 0.08), False: (1.89, 0.09)}  #: exponents and their errors
SHORT = 0.4  #: by which the exponent of short chains may differ


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
    counts, chains = ([16, 32], 12) if options.short else ([30, 60, 120], 24)
    rows, times, errors = [], {}, {}
    figure, axes = plt.subplots(1, 3, figsize=(9.6, 3.4))
    with tqdm(desc="chains", unit=" bead steps", unit_scale=True, disable=None) as bar:
        for wet, color, name in ((True, WET, "with"), (False, DRY, "without")):
            found = [collapse(count, chains, wet, options, bar) for count in counts]
            times[wet] = np.array([duration(radii, count) for (radii, _), count in zip(found, counts)])
            errors[wet] = np.array([meanOf([duration(np.delete(radii, i, axis=0), count) for i in range(chains)])[1]
                                    * (chains - 1) for (radii, _), count in zip(found, counts)])  # jackknife
            span = np.log(counts[-1] / counts[0])
            slope = np.log(times[wet][-1] / times[wet][0]) / span
            error = np.hypot(*(errors[wet] / times[wet])[[0, -1]]) / span
            rows.append(Row(f"exponent of the time, {name} hydrodynamics", slope, error, PUBLISHED[wet][0],
                            "Kikuchi et al.", PUBLISHED[wet][1] + SHORT, chains - 1))
            radii, last = found[-1]
            axes[1].plot(np.arange(radii.shape[1]) * RECORD / 1000, radii.mean(axis=0), color=color, label=name)
            axes[2].errorbar(counts, times[wet] / 1000, errors[wet] / 1000, fmt="o-", color=color)
            last = last - last.mean(axis=0) + [0, 0 if wet else -8, 0]
            axes[0].plot(last[:, 0], last[:, 1], "o-", ms=7, lw=1, color=color, mec="white")
    for i, count in enumerate(counts):
        ratio = times[False][i] / times[True][i]
        error = ratio * np.hypot(errors[True][i] / times[True][i], errors[False][i] / times[False][i])
        rows.append(Row(f"N = {count}: faster by a factor of", ratio, error, np.nan, "", 0.0, chains - 1))
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
