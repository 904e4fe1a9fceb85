# SPDX-License-Identifier: MIT
"""
Sedimentation: how much slower a suspension settles than a single sphere.

Hard spheres in a periodic box, drawn from equilibrium by Monte Carlo, all pulled down by the same force. The fluid they
drag down returns upwards between them, so they hinder each other: the effect is one of hydrodynamic interactions alone,
without them every sphere would settle as if it were alone at any volume fraction.

Expected: U/U0 = (1 - phi)^3/(1 + 2 phi) + phi^2/5, which is the Rotne-Prager-Yamakawa mobility averaged over the
Percus-Yevick fluid (Brady and Durlofsky 1988, Phys. Fluids 31, 717). A periodic box of N spheres settles slower by
1.7601 (phi/N)^(1/3) S, S = (1 - phi)^4/(1 + 2 phi)^2 the structure factor at zero wave number; that is added.
The distances that Percus and Yevick's theory gives to spheres are not exact: up to 4 % of U at phi = 0.4 may be left.
"""
import numpy as np
import openmm
from shared import THEORY, WET, Row, fluid, main, meanOf, mobility, plt, save
from tqdm import tqdm

from openmmpse import PSEBrownianIntegrator

RADIUS = 1.0  #: nm
DIFFERENCE = 0.04  #: of U/U0, between formula and simulation


def formula(phi):
    return (1 - phi)**3 / (1 + 2 * phi) + phi**2 / 5


def finiteSize(phi, count):
    """What to add to U/U0 of `count` spheres in a periodic cube."""
    return 1.7601 * (phi / count)**(1 / 3) * (1 - phi)**4 / (1 + 2 * phi)**2


def lattice(count, edge):
    """`count` places of a face-centred cubic lattice that fills the cube, chosen evenly."""
    cells = int(np.ceil((count / 4)**(1 / 3)))
    corners = np.stack(np.meshgrid(*[np.arange(cells)] * 3, indexing="ij"), -1).reshape(-1, 1, 3)
    places = (corners + [[0, 0, 0], [0.5, 0.5, 0], [0.5, 0, 0.5], [0, 0.5, 0.5]]).reshape(-1, 3) * edge / cells
    return places[np.linspace(0, len(places) - 1, count).astype(int)]


def sweep(x, edge, reach, generator):
    """One Monte Carlo move of each hard sphere of x (N, 3), in place; returns the share that was accepted."""
    accepted = 0
    for i, move in enumerate(generator.uniform(-reach, reach, x.shape)):
        r = x - (x[i] + move)
        r -= edge * np.rint(r / edge)
        square = np.einsum("ij,ij->i", r, r)
        square[i] = np.inf
        if square.min() >= 4 * RADIUS**2:
            x[i] += move
            accepted += 1
    return accepted / len(x)


def settle(phi, count, samples, sweeps, options, bar):
    """U/U0 of `samples` equilibrium configurations, `sweeps` sweeps apart, and the last of them."""
    edge = (count * 4 * np.pi / 3 * RADIUS**3 / phi)**(1 / 3)
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*np.eye(3) * edge)
    for _ in range(count):
        system.addParticle(1.0)
    context, integrator = fluid(system, RADIUS, 1.0, options, boundary=PSEBrownianIntegrator.Periodic)
    generator = np.random.default_rng([options.seed, int(1000 * phi)])
    x, reach, values = lattice(count, edge), 0.5 * RADIUS, []
    for sample in range(-4, samples):  # the first four forget the lattice
        for _ in range(sweeps):
            reach *= 0.9 if sweep(x, edge, reach, generator) < 0.4 else 1.1
            reach = min(reach, edge / 4)
        if sample >= 0:
            context.setPositions(x)
            speeds = [integrator.applyMobility(np.tile(axis, (count, 1))) @ axis for axis in np.eye(3)]
            values.append(np.mean(speeds) / mobility(RADIUS))
        bar.update()
    return values, x % edge


def run(options):
    count, samples, sweeps = (108, 12, 15) if options.short else (256, 40, 40)
    fractions = [0.1, 0.3] if options.short else [0.02, 0.05, 0.1, 0.2, 0.3, 0.4]
    rows, raw = [], []
    with tqdm(total=len(fractions) * (samples + 4), desc="configurations", disable=None) as bar:
        for phi in fractions:
            values, x = settle(phi, count, samples, sweeps, options, bar)
            value, error, degrees = meanOf(values)
            raw.append(value)
            rows.append(Row(f"U/U0 at phi = {phi}", value + finiteSize(phi, count), error, formula(phi),
                            "Brady and Durlofsky", DIFFERENCE * formula(phi), degrees))
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 3.8))
    near = x[x[:, 1].argsort()[::-1]]
    left.scatter(near[:, 0], near[:, 2], s=420, c=near[:, 1], cmap="Blues_r", edgecolors="white")
    left.set(title=f"phi = {fractions[-1]}: {count} spheres in a box", aspect="equal", xticks=[], yticks=[])
    phi = np.linspace(0, 0.45, 100)
    right.plot(phi, formula(phi), color=THEORY, label="theory")
    right.plot(phi, np.maximum(1 - 5 * phi, 0), color=THEORY, lw=0.8, ls=":", label="1 - 5 phi")
    right.errorbar(fractions, [row.value for row in rows], [row.error for row in rows], fmt="o", color=WET,
                   label="simulated, box corrected")
    right.plot(fractions, raw, "o", mfc="none", color=WET, label="as simulated")
    right.axhline(1, color="#D55E00", lw=1)
    right.annotate("without hydrodynamics", (0.45, 1), ha="right", va="bottom", color="#D55E00")
    right.set(xlabel="volume fraction phi", title="settling velocity over that of one sphere", ylim=(0, 1.1))
    right.legend(loc="center right", bbox_to_anchor=(1, 0.65))
    save(figure, options, "sedimentation.png")
    return rows


if __name__ == "__main__":
    main(run, __doc__)
