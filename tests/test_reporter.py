# SPDX-License-Identifier: MIT
"""HydrodynamicsReporter in an openmm.app.Simulation: numbers, restarts, interruptions, and the picture of its file."""

import csv
import io
import os
import signal
import struct
import threading

import numpy as np
import openmm
import pytest
from openmm import app, unit

from openmmpse import HydrodynamicsReporter, PSEBrownianIntegrator, plot
from openmmpse.accuracy import stages
from openmmpse.reporter import SHARES
from platformnames import isDevice, platformNamed, platformOptions

COUNT, BOX, RADIUS, STEP, RATE = 30, 5.0, 0.4, 0.25, 2e-3
FIXED = ("step", "time_ps", "lanczos_iterations", "predicted_error")


def repulsion():
    """A soft repulsion, which has a stress."""
    force = openmm.CustomNonbondedForce("20*(1-r)^2*step(1-r)")
    force.setNonbondedMethod(force.CutoffPeriodic)
    force.setCutoffDistance(1.1)
    for _ in range(COUNT):
        force.addParticle([])
    return force


def bonds():
    """Forces without a box."""
    force = openmm.HarmonicBondForce()
    for i in range(COUNT - 1):
        force.addBond(i, i + 1, 1.0, 50.0)
    return force


def simulationOn(platformName, integrator=None, configure=lambda integrator: None, periodic=True):
    """A Simulation of a few spheres in a box with a small tilt, which every platform can shear."""
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*(BOX * np.array([[1, 0, 0], [0.001, 1, 0], [0, 0, 1]])))
    topology = app.Topology()
    chain = topology.addChain()
    for _ in range(COUNT):
        system.addParticle(1)
        topology.addAtom("S", None, topology.addResidue("S", chain))
    system.addForce(repulsion() if periodic else bonds())
    if integrator is None:
        integrator = PSEBrownianIntegrator(300, 600, RADIUS, STEP)
        integrator.setRandomNumberSeed(4)
        configure(integrator)
    simulation = app.Simulation(topology, system, integrator, platformNamed(platformName),
                                platformOptions(platformName, threads=1))
    simulation.context.setPositions(BOX * np.random.default_rng(3).random((COUNT, 3)))
    return simulation


def rowsOf(text):
    """Lines of a file as dicts of floats."""
    return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(io.StringIO(text))]


def withoutShares(rows):
    """What two runs have in common: times of a clock are never the same."""
    return [{name: value for name, value in row.items() if name not in SHARES} for row in rows]


# ---------------------------------------------------------------- numbers


@pytest.mark.onePrecision
def testNumbersAreThoseOfTheIntegrator(platformName, tmp_path):
    simulation = simulationOn(platformName, configure=lambda integrator: integrator.setShearRate(RATE))
    path = tmp_path / "fluid.csv"
    simulation.reporters.append(HydrodynamicsReporter(path, 5, stress=True, strain=True))
    simulation.step(3)
    assert rowsOf(path.read_text()) == []
    simulation.step(17)
    integrator, rows = simulation.integrator, rowsOf(path.read_text())
    assert tuple(rows[0]) == (
        *FIXED, *SHARES, "osmotic_pressure_kJ_per_mol_nm3", "shear_stress_xy_kJ_per_mol_nm3", "strain")  # fmt: skip
    assert [row["step"] for row in rows] == [5, 10, 15, 20]
    assert [row["time_ps"] for row in rows] == pytest.approx([5 * STEP, 10 * STEP, 15 * STEP, 20 * STEP])
    assert [row["strain"] for row in rows] == pytest.approx([RATE * row["time_ps"] for row in rows])
    last, used = rows[-1], integrator.getNumericalParameters()
    assert last["lanczos_iterations"] == used["lanczosIterations"] > 0
    assert last["predicted_error"] == used["predictedError"] > 0
    shares = stages.partsOf(integrator.getStageTimes())
    if not isDevice(platformName):  # whose times are those of a few steps
        assert {name: last[f"share: {name}"] for name in shares} == pytest.approx(shares, abs=1e-12)
    assert all(sum(row[name] for name in SHARES) == pytest.approx(1) for row in rows if not isDevice(platformName))
    stress = integrator.computeStress().value_in_unit(unit.kilojoule_per_mole / unit.nanometer**3)
    pressure, shear = last["osmotic_pressure_kJ_per_mol_nm3"], last["shear_stress_xy_kJ_per_mol_nm3"]
    assert pressure == pytest.approx(-np.trace(stress) / 3, rel=1e-3) and pressure > 0
    assert shear == pytest.approx(stress[0, 1], rel=1e-3, abs=1e-3 * pressure)


@pytest.mark.onePlatform
def testPartsThatAreNotActiveCostNothing(platformName):
    for configure, periodic, active in (
        (lambda integrator: integrator.setMobilityModel(integrator.FreeDraining), True, {"free draining"}),
        (lambda integrator: None, False, {"pairs", "pair noise"}),
    ):
        simulation = simulationOn(platformName, configure=configure, periodic=periodic)
        file = io.StringIO()
        simulation.reporters.append(HydrodynamicsReporter(file, 2))
        simulation.step(2)
        (row,) = rowsOf(file.getvalue())  # the file is still open
        assert {name for name in stages.PARTS if row[f"share: {name}"] > 0} == active
        assert (row["lanczos_iterations"] > 0) == ("pair noise" in active)


@pytest.mark.onePlatform
def testForceGroupsOfTheStress(platformName):
    simulation = simulationOn(platformName)
    file = io.StringIO()
    simulation.reporters.append(HydrodynamicsReporter(file, 1, stress=True, groups={3}))
    simulation.step(1)
    volume = BOX**3
    ideal = COUNT * 300 * unit.MOLAR_GAS_CONSTANT_R.value_in_unit(unit.kilojoule_per_mole / unit.kelvin) / volume
    assert rowsOf(file.getvalue())[0]["osmotic_pressure_kJ_per_mol_nm3"] == pytest.approx(ideal, rel=1e-5)


# ---------------------------------------------------------------- restarts and interruptions


@pytest.mark.onePlatform
def testARunThatWasCutOffIsContinued(platformName, tmp_path):
    """From a checkpoint, with later lines and half of one in the file: as if nothing had happened."""
    whole, cut = tmp_path / "whole.csv", tmp_path / "cut.csv"
    simulation = simulationOn(platformName)
    simulation.reporters.append(HydrodynamicsReporter(whole, 2))
    simulation.step(20)
    simulation = simulationOn(platformName)
    simulation.reporters.append(HydrodynamicsReporter(str(cut), 2))
    simulation.step(11)
    checkpoint = simulation.context.createCheckpoint()
    simulation.step(6)
    with cut.open("a") as file:
        file.write("18,4.5,")
    simulation = simulationOn(platformName)
    simulation.context.loadCheckpoint(checkpoint)
    simulation.reporters.append(HydrodynamicsReporter(cut, 2, append=True))
    simulation.step(9)
    assert withoutShares(rowsOf(cut.read_text())) == withoutShares(rowsOf(whole.read_text()))
    assert len(rowsOf(cut.read_text())) == 10


@pytest.mark.onePlatform
def testWhatCannotBeContinued(platformName, tmp_path):
    path = tmp_path / "fluid.csv"
    simulation = simulationOn(platformName)
    simulation.reporters.append(HydrodynamicsReporter(path, 2))
    simulation.step(4)
    before = path.read_text()
    with pytest.raises(ValueError, match="cannot be continued.*strain"):
        HydrodynamicsReporter(path, 2, strain=True, append=True)
    other = simulationOn(platformName)  # at step 0
    other.reporters.append(HydrodynamicsReporter(path, 2, append=True))
    with pytest.raises(ValueError, match="begins at step 2.*another run"):
        other.step(2)
    assert path.read_text() == before
    HydrodynamicsReporter(tmp_path / "new.csv", 2, append=True)
    assert (tmp_path / "new.csv").read_text().startswith("step,time_ps,")
    HydrodynamicsReporter(path, 2)
    assert rowsOf(path.read_text()) == []


@pytest.mark.onePlatform
def testControlCLeavesWholeLinesAndASimulationThatGoesOn(platformName, tmp_path):
    simulation = simulationOn(platformName)
    path = tmp_path / "fluid.csv"
    simulation.reporters.append(HydrodynamicsReporter(path, 1, progress=True))
    simulation.step(1)
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            simulation.step(10**9)
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, previous)
    reached = simulation.currentStep
    rows = rowsOf(path.read_text())
    assert path.read_text().endswith("\n") and reached > 1 and reached - len(rows) in (0, 1)
    simulation.step(3)
    assert [row["step"] for row in rowsOf(path.read_text())][-3:] == [reached + 1, reached + 2, reached + 3]


@pytest.mark.onePlatform
def testProgress(platformName, tmp_path, capsys):
    simulation = simulationOn(platformName)
    simulation.reporters.append(HydrodynamicsReporter(tmp_path / "a.csv", 4, progress=True, totalSteps=12))
    simulation.step(8)
    assert "8.00/12.0" in capsys.readouterr().err
    simulation.step(4)
    bar = capsys.readouterr().err
    assert "12.0/12.0" in bar and "Lanczos iterations" in bar and "100%" in bar
    simulation.step(4)  # beyond the end, without a bar
    assert capsys.readouterr().err == ""


# ---------------------------------------------------------------- refusals


@pytest.mark.onePlatform
def testRefusals(platformName, tmp_path):
    for interval, error in ((0, ValueError), (-5, ValueError), (2.5, TypeError), ("10", TypeError)):
        with pytest.raises(error, match="reportInterval"):
            HydrodynamicsReporter(io.StringIO(), interval)
    simulation = simulationOn(platformName, openmm.VerletIntegrator(0.001))
    simulation.reporters.append(HydrodynamicsReporter(io.StringIO(), 1000))
    with pytest.raises(TypeError, match="VerletIntegrator.*take the reporter out"):
        simulation.step(1)
    simulation = simulationOn(platformName, periodic=False)
    simulation.reporters.append(HydrodynamicsReporter(io.StringIO(), 1000, stress=True))
    with pytest.raises(openmm.OpenMMException, match="nothing here is periodic"):
        simulation.step(1)  # and not after a thousand
    assert simulation.currentStep == 0


@pytest.mark.onePlatform
def testAnIntegratorFromXml(platformName):
    """It is a plain openmm.Integrator for Python."""
    integrator = PSEBrownianIntegrator(300, 600, RADIUS, STEP)
    plain = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(integrator))
    assert not isinstance(plain, PSEBrownianIntegrator)
    simulation = simulationOn(platformName, plain)
    file = io.StringIO()
    with HydrodynamicsReporter(file, 1) as reporter:
        simulation.reporters.append(reporter)
        simulation.step(3)
    assert len(rowsOf(file.getvalue())) == 3


# ---------------------------------------------------------------- the picture


@pytest.mark.onePlatform
def testThePicture(platformName, tmp_path, capsys):
    simulation = simulationOn(platformName, configure=lambda integrator: integrator.setShearRate(RATE))
    paths = tmp_path / "plain.csv", tmp_path / "all.csv"
    simulation.reporters.append(HydrodynamicsReporter(paths[0], 2))
    simulation.reporters.append(HydrodynamicsReporter(paths[1], 2, stress=True, strain=True))
    simulation.step(10)
    heights = []
    for path in paths:
        assert plot.main([str(path)]) == 0
        assert "5 lines" in capsys.readouterr().out
        picture = path.with_suffix(".png").read_bytes()
        assert picture.startswith(b"\x89PNG")
        heights.append(struct.unpack(">I", picture[20:24])[0])
    assert heights[1] > 1.5 * heights[0]  # two panels more
    columns = plot.read(paths[1])
    rows = rowsOf(paths[1].read_text())
    assert all(list(columns[name]) == [row[name] for row in rows] for name in rows[0])


def testFilesThatCannotBeDrawn(tmp_path, capsys):
    path = tmp_path / "fluid.csv"
    header = ",".join(FIXED)
    for text, words in (
        (None, "cannot be read"),
        ("", "no column time_ps"),
        ("step,x\n1,2\n", "no column time_ps"),
        (f"{header}\n", "no line of numbers"),
        (f"{header}\n1,2,3,fast\n", "not one of numbers"),
    ):
        if text is not None:
            path.write_text(text)
        assert plot.main([str(path)]) == 2
        assert words in capsys.readouterr().err
    path.write_text(f"{header}\n1,0.5,3,1e-4\n2,1.0,3,1e-4\n3,1.")
    assert plot.main([str(path), "--output", str(tmp_path / "other.png")]) == 0  # the line that was cut off is left out
    assert (tmp_path / "other.png").stat().st_size > 1000 and list(plot.read(path)["step"]) == [1, 2]
