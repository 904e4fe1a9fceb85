# SPDX-License-Identifier: MIT
"""
A colloidal gel forms: attractive spheres aggregate, with and without hydrodynamic interactions.

Spheres at a volume fraction of 0.1 in a periodic fluid that attract each other by 8 kT at contact, from equilibrium of
hard spheres on. Single spheres find each other, and clusters stick together. The
solvent has to leave the gap between two clusters, and what moves together moves faster than each part would alone:
clusters stay mobile and are slow to compact, which in long runs of many spheres makes open structures (Furukawa and
Tanaka 2010, Phys. Rev. Lett. 104, 245702; Varga, Wang and Swan 2015, Soft Matter 11, 9009).

No number is published for this very model, with so few spheres. Printed are the mean number of contacts of a sphere and
the share of spheres in the largest cluster, at the end, in both solvents.
Expected: the contacts at the beginning, 4 pi n times the integral of g r^2 over the range, with the contact value of
Carnahan and Starling for g, which is lower by a few percent at the end of the range.
"""
import numpy as np
import openmm
from shared import DRY, KT, WET, Row, fluid, main, meanOf, mobility, plt, positionsOf, save
from sedimentation import lattice, sweep
from tqdm import tqdm

from openmmpse import PSEBrownianIntegrator

RADIUS, PHI, DEPTH, RANGE = 1.0, 0.1, 8.0, 0.3  #: nm, -, kT, nm
CONTACT = 2 * RADIUS + RANGE
TIME = RADIUS**2 / (KT * mobility(RADIUS))  #: ps, in which a sphere diffuses over its radius (over six)
STEP = {True: 0.0005 * TIME, False: 0.00025 * TIME}  #: neighbours that drag each other along relax slower
RECORD = 0.5 * TIME
START = PHI / RADIUS**3 * (CONTACT**3 - (2 * RADIUS)**3) * (1 - PHI / 2) / (1 - PHI)**3  #: contacts of hard spheres


def suspension(count, edge):
    """System of spheres that attract each other by the potential of Morse."""
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*np.eye(3) * edge)
    pairs = openmm.CustomNonbondedForce(f"{DEPTH * KT}*(e^2 - 2*e); e = exp(({2 * RADIUS} - r)/{RANGE})")
    pairs.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
    pairs.setCutoffDistance(2 * RADIUS + 5 * RANGE)
    for _ in range(count):
        system.addParticle(1.0)
        pairs.addParticle([])
    system.addForce(pairs)
    return system


def structure(x, edge):
    """Contacts of each sphere (N,), and the number of its cluster (N,)."""
    r = x[:, None] - x
    near = ((r - edge * np.rint(r / edge))**2).sum(axis=-1) < CONTACT**2
    labels = np.arange(len(x))
    while True:  # each takes the smallest label around it until none changes
        spread = np.where(near, labels, len(x)).min(axis=1)
        if (spread == labels).all():
            return near.sum(axis=1) - 1, labels
        labels = spread[spread]


def aggregate(x, edge, records, hydrodynamics, options, bar):
    """Contacts per sphere and share of the largest cluster in time (records, 2), and the last positions."""
    step = STEP[hydrodynamics]
    context, integrator = fluid(suspension(len(x), edge), RADIUS, step, options, hydrodynamics, seed=2,
                                boundary=PSEBrownianIntegrator.Periodic, threads=1)
    context.setPositions(x)
    found = []
    for _ in range(records):
        contacts, labels = structure(positionsOf(context), edge)
        found.append((contacts.mean(), np.bincount(labels).max() / len(x)))
        integrator.step(round(RECORD / step))
        bar.update()
    return np.array(found), positionsOf(context)


def run(options):
    count, records, copies = (80, 4, 4) if options.short else (125, 12, 4)
    edge = (count * 4 * np.pi / 3 * RADIUS**3 / PHI)**(1 / 3)
    generator = np.random.default_rng(options.seed)
    rows, results = [], {}
    with tqdm(total=2 * copies * records, desc="records", disable=None) as bar:
        for copy in range(copies):
            x = lattice(count, edge)
            for _ in range(50):
                sweep(x, edge, RADIUS, generator)
            for wet in (True, False):
                results.setdefault(wet, []).append(aggregate(x, edge, records, wet, options, bar))
    before = meanOf([curve[0, 0] for curve, _ in results[True]])
    rows.append(Row("contacts of a sphere at the beginning", *before[:2], START, "Carnahan, Starling", 0.08 * START,
                    before[2]))
    figure, axes = plt.subplots(1, 3, figsize=(10, 3.5), width_ratios=(1.2, 1, 1))
    times = np.arange(records) * RECORD / TIME
    for wet, color, name in ((True, WET, "with"), (False, DRY, "without")):
        curves = np.array([curve for curve, _ in results[wet]])
        value, error = curves.mean(axis=0), curves.std(axis=0, ddof=1) / copies**0.5
        for column, what in enumerate(("contacts of a sphere", "share of the largest cluster")):
            rows.append(Row(f"{what}, {name} hydrodynamics", value[-1, column], error[-1, column], np.nan, "", 0.0,
                            copies - 1))
            axes[column + 1].plot(times, value[:, column], color=color, label=name)
            axes[column + 1].set(xlabel="time over a^2/D0", title=what)
    axes[1].legend(title="hydrodynamics")
    x = results[True][-1][1]
    labels = np.unique(structure(x, edge)[1], return_inverse=True)[1]
    order = [i for i in (x % edge)[:, 1].argsort()[::-1] if x[i, 1] % edge < edge / 2]
    axes[0].scatter(*(x % edge)[order][:, [0, 2]].T, s=230, c=labels[order] % 20, cmap="tab20", edgecolors="white")
    axes[0].set(aspect="equal", xticks=[], yticks=[], title="clusters in half the box")
    save(figure, options, "gel.png")
    return rows


if __name__ == "__main__":
    main(run, __doc__)
