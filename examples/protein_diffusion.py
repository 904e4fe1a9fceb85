# SPDX-License-Identifier: MIT
"""
Diffusion of a protein, from its structure file.

    python examples/protein_diffusion.py [my.pdb]

One bead per residue at the C-alpha atoms, radius 0.484 nm (Ortega, Amoros and Garcia de la Torre 2011), held in shape
by the springs of an elastic network, in an unbounded fluid. Without a file: T4 lysozyme from the package
openmm-systems. Beads in the lee of others are hardly dragged by the solvent: with hydrodynamic interactions the
protein diffuses some forty times faster than without.

Expected: over short times Kirkwood's sum over the same shapes; over long times the same beads as a rigid body (dense
matrices in NumPy); without hydrodynamics D0/N; and by measurements on folded proteins a hydrodynamic radius of
0.475 N^0.29 nm (Wilkins et al. 1999, Biochemistry 38, 16424), from which single proteins differ by some 5 to 10 %.
"""
import numpy as np
from shared import DRY, KT, THEORY, VISCOSITY, WET, Row, main, mobility, plt, save
from tqdm import tqdm

from openmmpse import analysis
from openmmpse.demo import network, simulate, statistics, structure

RADIUS = 0.484  #: nm
MEASURED = 0.1  #: by which a folded protein may differ from the law of Wilkins et al.
RIGID = 0.02  #: by which a protein that breathes may differ from a rigid one
OPTIONS = [("structure", {"nargs": "?", "help": "a PDB file (default: T4 lysozyme)"})]
SI = analysis.M2_PER_S * 1e10  #: nm^2/ps in 1e-10 m^2/s


def follow(solvent, start, steps, interval, drift, bar):
    """Records of the centre (n, 3), nm, and of its drift velocity, nm/ps, and some shapes on the way."""
    recorder, shapes = simulate.Recorder(solvent.integrator, interval, drift), []
    solvent.place(start)
    solvent.simulation.step(300)
    solvent.simulation.reporters.append(recorder)
    for _ in range(10):
        solvent.simulation.step(steps // 10)
        shapes.append((solvent.positions, solvent.short_time_diffusion() if drift else None))
        bar.update(steps // 10)
    return np.array(recorder.centres), np.array(recorder.drifts), shapes


def longTime(paths, drifts, step, lag, short, blocks):
    """Long-time diffusion coefficient by displacements and by drift correlations, and their curves in time.

    paths, drifts: records of every step, each cut into so many blocks, which error bars come from.
    """
    noise = statistics.noise_paths(paths, drifts, step)
    lags = sorted({1, lag // 8, lag // 4, lag // 2, lag})
    mean, error = statistics.displacement_diffusion(paths, step, lags, blocks, noise, short.value)
    times, apparent, total = statistics.drift_integral(drifts, step, lag, blocks)
    displaced = analysis.Estimate(mean[-1], np.hypot(error[-1], statistics.CONTROL * short.error))
    sharp = short.minus(analysis.Estimate(total[0][-1], total[1][-1]))
    return displaced, sharp, (np.array(lags) * step, mean, error), (times, short.value - apparent[0])


def run(options):
    protein = structure.read(options.structure, options.structure) if options.structure else structure.load()
    x0, count = protein.positions, len(protein.positions)
    springs = network.connect(x0)
    linear = network.relax(springs, x0, RADIUS, VISCOSITY, KT)
    system = network.build_system(count, springs, 100.0)
    molecule = simulate.Molecule(protein.topology, system, RADIUS, linear.step, 100.0)
    replicas, steps, lag, blocks = (2, 1200, 50, 10) if options.short else (5, 5600, 225, 4)
    wet, dry = [], []
    with tqdm(total=replicas * 2 * steps, desc="steps", disable=None) as bar:
        for seed in range(options.seed, options.seed + replicas):
            fluid = simulate.Solvent(molecule, options.platform, seed, unbounded=True)
            wet.append(follow(fluid, x0, steps, 1, True, bar))
            alone = simulate.Solvent(molecule, options.platform, seed + 100, hydrodynamics=False)
            dry.append(follow(alone, x0, steps, 10, False, bar))
    shapes = [shape for _, _, found in wet for shape in found]
    short = analysis.estimate([value for _, value in shapes])
    kirkwood = np.mean([analysis.kirkwood(x, RADIUS, VISCOSITY, KT) for x, _ in shapes])
    rigid = np.mean([analysis.rigidBody(x, RADIUS, VISCOSITY, KT)[0] for x, _ in shapes[::5]])
    paths, drifts = [w[0] for w in wet], [w[1] for w in wet]
    displaced, sharp, points, curve = longTime(paths, drifts, linear.step, lag, short, blocks)
    free = statistics.displacement_diffusion([d[0] for d in dry], 10 * linear.step, [1], blocks)
    degrees, late = blocks * replicas - 1, rigid * SI * (0.06 if options.short else RIGID)
    law = KT * mobility(0.475 * count**0.29)
    rows = [
        Row("D over short times, 1e-10 m2/s", short.value * SI, 0.0, kirkwood * SI, "Kirkwood", 1e-3 * kirkwood * SI),
        Row("D over long times, by drift", sharp.value * SI, sharp.error * SI, rigid * SI, "rigid body", late, degrees),
        Row("D over long times, by displacements", displaced.value * SI, displaced.error * SI, rigid * SI, "rigid body",
            late, degrees),
        Row("the same by drift", sharp.value * SI, sharp.error * SI, law * SI, "Wilkins et al.", MEASURED * law * SI,
            degrees),
        Row("D without hydrodynamics", free[0][0] * SI, free[1][0] * SI, KT * mobility(RADIUS) / count * SI, "D0/N",
            0.0, degrees),
    ]
    draw(protein, points, curve, rigid, law, rows[-1], options)
    return rows


def draw(protein, points, curve, rigid, law, free, options):
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 3.8), width_ratios=(1, 1.4))
    x = protein.positions @ np.linalg.svd(protein.positions, full_matrices=False)[2].T
    x = x[x[:, 2].argsort()]
    left.scatter(x[:, 0], x[:, 1], s=150, c=x[:, 2], cmap="Blues", edgecolors="white", lw=0.6)
    left.set(aspect="equal", xlabel="nm", title=f"{len(x)} residues")
    right.plot(curve[0], curve[1] * SI, color=WET, label="simulated, by drift")
    right.errorbar(points[0], points[1] * SI, points[2] * SI, fmt="o", color=WET, label="simulated, by displacements")
    right.axhline(rigid * SI, color=THEORY, label="rigid body")
    right.axhline(law * SI, color=THEORY, ls=":", label="Wilkins et al. 1999")
    right.axhline(free.value, color=DRY, label="simulated, without hydrodynamics")
    right.set(xlabel="time, ps", title="diffusion coefficient, 1e-10 m2/s", ylim=(0, 1.5 * rigid * SI))
    right.legend(loc="center right", bbox_to_anchor=(1, 0.35))
    save(figure, options, "protein_diffusion.png")


if __name__ == "__main__":
    main(run, __doc__, more=OPTIONS)
