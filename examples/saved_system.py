# SPDX-License-Identifier: MIT
"""
An OpenMM System saved as XML by somebody else's model, run with hydrodynamics by changing one line.

    python examples/saved_system.py [system.xml coordinates.gro]

Without files: a structure-based model of chymotrypsin inhibitor 2 with one bead per residue, written by SMOG 2 and
built by OpenSMOG (Oliveira, Contessoto et al. 2022, Protein Science 31, 158; pip install OpenSMOG), at its usual
reduced temperature of 0.5. Nothing in the file knows of this library. A radius of 0.484 nm per residue is all that is
added.

Expected, as hydrodynamic radii kT/(6 pi eta D), which depend neither on temperature nor on the solvent: without
hydrodynamics N times the radius of a bead; with them, in single steps, Kirkwood's sum over the same shapes; over
long times the same shapes as rigid bodies, and 0.475 N^0.29 nm, measured on folded proteins (Wilkins et al. 1999,
Biochemistry 38, 16424), from which single proteins differ by some 5 to 10 %.
"""
import contextlib
import importlib.util
import io
from pathlib import Path

import numpy as np
import openmm
from shared import DRY, FORCE, THEORY, VISCOSITY, WET, Row, main, meanOf, mobility, plainTicks, plt, save
from openmm import app, unit
from protein_diffusion import MEASURED, RADIUS, RIGID, longTime
from tqdm import tqdm

from openmmpse import PSEBrownianIntegrator, analysis

TEMPERATURE = 0.5 / 0.00831446261815324  #: K; kT = 0.5 kJ/mol, the reduced temperature of the model
STEP, BROWNIAN_STEP = 0.25, 0.04  #: ps; beads that drag each other along relax slower, so longer steps are stable
OPTIONS = [("files", {"nargs": "*", "help": "a System as XML and coordinates as .gro"})]


def byOpenSMOG(folder):
    """What the owner of the model does: build it and save it. Returns the paths of both files."""
    shipped = Path(importlib.util.find_spec("OpenSMOG").submodule_search_locations[0]) / "share/tests/2ci2.CA"
    with contextlib.redirect_stdout(io.StringIO()):
        from OpenSMOG import SBM
        model = SBM(time_step=0.002, collision_rate=1.0, r_cutoff=3.0, temperature=0.5, cmm=False, warn=False)
        files = [str(shipped / name) for name in ("frame.0.gro", "opentest.top", "opentest.xml")]
        model.saveFolder(str(folder))
        model.loadSystem(Grofile=files[0], Topfile=files[1], Xmlfile=files[2])
    (folder / "system.xml").write_text(openmm.XmlSerializer.serialize(model.system))
    return folder / "system.xml", files[0]


def record(system, positions, integrator, step, records, interval, options, bar):
    """Positions of the centre (records, 3), nm, its drift velocities if there is a fluid, and 20 shapes."""
    properties = {"Threads": "1"} if options.platform == "CPU" else {}
    integrator.setRandomNumberSeed(options.seed)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatform(options.platform), properties)
    context.setPositions(positions)
    integrator.step(int(200 / step))
    centres, drifts, shapes = [], [], []
    for i in range(records):
        state = context.getState(positions=True, forces=True)
        x = state.getPositions(asNumpy=True).value_in_unit(unit.nanometer)
        centres.append(x.mean(axis=0))
        if isinstance(integrator, PSEBrownianIntegrator):
            drifts.append(integrator.applyMobility(state.getForces(asNumpy=True).value_in_unit(FORCE)).mean(axis=0))
        if i % (records // 20) == 0:
            samples = integrator.sampleBrownianDisplacements(100).mean(axis=1) if drifts else np.zeros((1, 3))
            shapes.append((np.array(x), (samples**2).sum(axis=-1).mean() / (6 * step)))
        integrator.step(interval)
        bar.update(interval)
    return np.array(centres), np.array(drifts), shapes


def run(options):
    file, coordinates = options.files or byOpenSMOG(options.output)
    system = openmm.XmlSerializer.deserialize(Path(file).read_text())
    positions = app.GromacsGroFile(coordinates).getPositions(asNumpy=True)
    count = len(positions)
    records, lag, blocks, late = (3000, 100, 20, 0.07) if options.short else (60000, 2000, 12, RIGID)
    kT = analysis.thermalEnergy(TEMPERATURE)
    scale = kT * mobility(1.0)
    friction = 1 / (mobility(RADIUS) * system.getParticleMass(0).value_in_unit(unit.dalton))

    # The line that changes:
    before = openmm.BrownianIntegrator(TEMPERATURE, friction, BROWNIAN_STEP)
    after = PSEBrownianIntegrator(TEMPERATURE, VISCOSITY, RADIUS, STEP)

    with tqdm(total=records * 2, desc="steps", disable=None) as bar:
        dry = record(system, positions, before, BROWNIAN_STEP, records // 10, 10, options, bar)
        wet = record(system, positions, after, STEP, records, 1, options, bar)
    shapes = [x for x, _ in wet[2]]
    squares = (np.diff(dry[0], axis=0)**2).sum(axis=1) / (60 * BROWNIAN_STEP)
    free = analysis.Estimate(*meanOf([part.mean() for part in np.array_split(squares, 16)])[:2])
    first, error, degrees = meanOf([value for _, value in wet[2]])
    kirkwood = np.mean([analysis.kirkwood(x, RADIUS, VISCOSITY, kT) for x in shapes])
    rigid = np.mean([analysis.rigidBody(x, RADIUS, VISCOSITY, kT)[0] for x in shapes[::4]])
    _, last, points, curve = longTime([wet[0]], [wet[1]], STEP, lag, analysis.Estimate(kirkwood, 0.0), blocks)
    rows = [Row(name, scale / d.value, scale * d.error / d.value**2, radius, source, slack * radius, degrees)
            for name, d, radius, source, slack, degrees in (
        ("Rh, nm: BrownianIntegrator", free, count * RADIUS, "N times 0.484 nm", 0.0, 15),
        ("PSEBrownianIntegrator, one step", analysis.Estimate(first, error), scale / kirkwood, "Kirkwood", 1e-3,
         degrees),
        ("PSEBrownianIntegrator, long times", last, scale / rigid, "rigid bodies", late, blocks - 1),
        ("the same", last, 0.475 * count**0.29, "Wilkins et al.", MEASURED, blocks - 1))]
    figure, axis = plt.subplots(figsize=(5.6, 3.8))
    axis.plot(curve[0], scale / curve[1], color=WET, label="PSEBrownianIntegrator")
    axis.axhline(rows[0].value, color=DRY, label="BrownianIntegrator")
    axis.axhline(scale / rigid, color=THEORY, lw=1, label="rigid bodies")
    axis.axhline(rows[-1].expected, color=THEORY, ls=":", label="Wilkins et al. 1999")
    axis.set(xscale="log", yscale="log", xlabel="time, ps", title=f"hydrodynamic radius of {count} residues, nm")
    plainTicks(axis.yaxis, (1, 2, 5, 10, 20, 50))
    axis.legend(loc="center right")
    save(figure, options, "saved_system.png")
    return rows


if __name__ == "__main__":
    main(run, __doc__, more=OPTIONS)
