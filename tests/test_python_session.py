# SPDX-License-Identifier: MIT
"""
What a session in Python does around the integrator: XML, copies, pickles, openmm.app.Simulation
with reporters and checkpoints, import order, the command line.
"""

import copy
import math
import os
import pickle
import re
import subprocess
import sys
from xml.etree import ElementTree

import numpy as np
import openmm
import pytest
from openmm import app, unit

import openmmpse
from openmmpse import PSEBrownianIntegrator, plugins
from platformnames import contextOn, platformNamed, platformOptions

pytestmark = pytest.mark.onePrecision

COUNT = 6
BOX = 4.0


def odd():
    """An integrator in which no setting has its default, and every number needs all its digits."""
    integrator = PSEBrownianIntegrator(1000 / 3, 602.214076 / 7, 0.1 + 0.2, math.pi * 1e-3)
    integrator.setParticleRadius(5, math.sqrt(2))
    integrator.setParticleRadius(0, math.nextafter(0.3, 1))
    integrator.setErrorTolerance(1e-3 / 3)
    integrator.setMobilityModel(PSEBrownianIntegrator.FreeDraining)
    integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
    integrator.setShearRate(-1e-5 / 3)
    integrator.setShearProtocol(PSEBrownianIntegrator.StartUpShear, 7 / 3)
    integrator.setNumericalParameters(
        {
            "xi": 10 / 3,
            "realCutoff": 4 / 3,
            "gridDimensions": (12, 15, 16),
            "windowSupport": 5,
            "windowShape": 100 / 9,
            "lanczosTolerance": 1e-4 / 3,
        }
    )
    integrator.setSplit(PSEBrownianIntegrator.Hasimoto)
    integrator.setRandomNumberSeed(-123456789)
    integrator.setConstraintTolerance(1e-6 / 3)
    integrator.setIntegrationForceGroups({0, 31})
    return integrator


def settings(integrator):
    """Everything that can be set, by name of the getter. Quantities compare exactly."""
    getters = [name for name in dir(integrator) if name.startswith("get")]
    bound = ("getNumericalParameters", "getStageTimes", "getStrain")
    needArgument = ("getParticleRadius",)
    return {
        name: getattr(integrator, name)() for name in getters if name not in bound + needArgument
    }


def makeSystem(forces=()):
    """A ring on springs in a periodic box; its forces are the same to the bit in every run."""
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*(np.eye(3) * BOX))
    springs = openmm.HarmonicBondForce()
    springs.setUsesPeriodicBoundaryConditions(True)
    for i in range(COUNT):
        system.addParticle(1)
        springs.addBond(i, (i + 1) % COUNT, 1.0, 50.0)
    system.addForce(springs)
    for force in forces:
        system.addForce(force)
    return system


def ring():
    angles = 2 * np.pi * np.arange(COUNT) / COUNT
    return np.stack([np.cos(angles), np.sin(angles), 0.1 * np.arange(COUNT)], axis=1)


def makeIntegrator(seed=1):
    integrator = PSEBrownianIntegrator(300, 600, 0.4, 0.5)
    integrator.setRandomNumberSeed(seed)
    return integrator


def makeSimulation(platformName, seed=1):
    topology = app.Topology()
    chain = topology.addChain()
    for _ in range(COUNT):
        topology.addAtom("B", app.Element.getBySymbol("C"), topology.addResidue("BEA", chain))
    simulation = app.Simulation(
        topology,
        makeSystem(),
        makeIntegrator(seed),
        platformNamed(platformName),
        platformOptions(platformName, 1),
    )
    simulation.context.setPositions(ring())
    return simulation


def positionsOf(context):
    return context.getState(positions=True).getPositions(asNumpy=True)._value


# ---------------------------------------------------------------- XML, copies, pickles


def testXmlKeepsEverythingExactly():
    integrator = odd()
    text = openmm.XmlSerializer.serialize(integrator)
    read = PSEBrownianIntegrator.cast(openmm.XmlSerializer.deserialize(text))
    assert settings(read) == settings(integrator)
    assert settings(integrator) != settings(makeIntegrator())
    assert openmm.XmlSerializer.serialize(read) == text


@pytest.mark.parametrize(
    "duplicate",
    [copy.copy, copy.deepcopy, lambda i: pickle.loads(pickle.dumps(i))],
    ids=["copy", "deepcopy", "pickle"],
)
def testCopiesAreEqualAndIndependent(duplicate):
    integrator = odd()
    integrator.note = "mine"
    other = duplicate(integrator)
    assert type(other) is PSEBrownianIntegrator and other.thisown
    assert settings(other) == settings(integrator)
    other.setTemperature(77)
    assert integrator.getTemperature() == 1000 / 3 * unit.kelvin
    del integrator
    assert other.getTemperature() == 77 * unit.kelvin


def testCopiesKeepWhatPythonAdded():
    class Named(PSEBrownianIntegrator):
        pass

    integrator = Named(300, 600, 0.4, 0.5)
    integrator.note = ["mine"]
    other = copy.deepcopy(integrator)
    assert type(other) is Named and other.note == ["mine"] and other.note is not integrator.note
    assert other.getRadius() == 0.4 * unit.nanometer


def testCopiesCanMoveASystem(platformName):
    trajectories = []
    for integrator in (
        makeIntegrator(),
        copy.deepcopy(makeIntegrator()),
        pickle.loads(pickle.dumps(makeIntegrator())),
    ):
        context = contextOn(platformName, makeSystem(), integrator)
        context.setPositions(ring())
        integrator.step(3)
        assert context.getIntegrator() is integrator
        trajectories.append(positionsOf(context))
    assert np.array_equal(trajectories[0], trajectories[1]) and np.array_equal(
        trajectories[0], trajectories[2]
    )
    assert not np.array_equal(trajectories[0], ring())


def testCastAndIsinstance():
    base = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(odd()))
    verlet = openmm.VerletIntegrator(0.001)
    assert PSEBrownianIntegrator.isinstance(base) and not PSEBrownianIntegrator.isinstance(verlet)
    integrator = PSEBrownianIntegrator.cast(base)
    assert PSEBrownianIntegrator.cast(integrator) is integrator
    del base
    assert settings(integrator) == settings(odd())
    with pytest.raises(openmm.OpenMMException, match="cast"):
        PSEBrownianIntegrator.cast(verlet)
    alive = openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(odd()))
    PSEBrownianIntegrator.cast(alive)
    assert alive.getStepSize() == math.pi * 1e-3 * unit.picosecond


@pytest.mark.parametrize("version", [2, 99, 0])
def testOtherVersionsOfTheXmlAreRefused(version):
    root = ElementTree.fromstring(openmm.XmlSerializer.serialize(odd()))
    assert root.get("version") == "1"
    root.set("version", str(version))
    with pytest.raises(openmm.OpenMMException, match=f"version {version}.*version 1"):
        openmm.XmlSerializer.deserialize(ElementTree.tostring(root, encoding="unicode"))


def testXmlWithAValueOutOfRangeIsRefused():
    text = openmm.XmlSerializer.serialize(makeIntegrator()).replace(
        'viscosity="600"', 'viscosity="-600"'
    )
    with pytest.raises(openmm.OpenMMException, match="-600"):
        openmm.XmlSerializer.deserialize(text)


# ---------------------------------------------------------------- openmm.app


def testSimulationWithReporters(platformName, tmp_path):
    simulation = makeSimulation(platformName)
    log, trajectory, restart = (
        tmp_path / "log.csv",
        tmp_path / "trajectory.dcd",
        tmp_path / "restart.chk",
    )
    simulation.reporters += [
        app.StateDataReporter(
            str(log),
            2,
            step=True,
            time=True,
            potentialEnergy=True,
            kineticEnergy=True,
            temperature=True,
        ),
        app.DCDReporter(str(trajectory), 5),
        app.CheckpointReporter(str(restart), 10),
    ]
    simulation.step(20)
    table = np.genfromtxt(log, delimiter=",")  # the header is a comment
    assert table.shape == (10, 5) and np.all(np.isfinite(table))
    assert list(table[:, 0]) == list(range(2, 21, 2))
    assert table[:, 1] == pytest.approx(np.arange(2, 21, 2) * 0.5)
    assert np.all(table[:, 3] > 0)
    assert trajectory.stat().st_size > 4 * 3 * 4 * COUNT and restart.stat().st_size > 0
    assert simulation.context.getState().getTime() == 10 * unit.picosecond


def testMinimizationBeforeTheRun(platformName):
    simulation = makeSimulation(platformName)
    simulation.context.setPositions(1.5 * ring())
    before = simulation.context.getState(energy=True).getPotentialEnergy()
    simulation.minimizeEnergy(maxIterations=20)
    assert simulation.context.getState(energy=True).getPotentialEnergy() < before
    simulation.step(1)


def testCheckpointContinuesToTheBit(platformName, tmp_path):
    restart = str(tmp_path / "restart.chk")
    simulation = makeSimulation(platformName)
    simulation.step(7)
    simulation.integrator.sampleBrownianDisplacements(2)
    simulation.saveCheckpoint(restart)

    def continued(other):
        samples = other.integrator.sampleBrownianDisplacements(1)
        other.step(5)
        return [
            positionsOf(other.context),
            samples,
            np.array([other.currentStep, other.context.getTime()._value]),
        ]

    expected = continued(simulation)
    simulation.loadCheckpoint(restart)
    fresh = makeSimulation(platformName)
    fresh.loadCheckpoint(restart)
    for other in (simulation, fresh):
        for a, b in zip(continued(other), expected):
            assert np.array_equal(a, b)


def testStateFileContinuesToTheBit(platformName, tmp_path):
    file = str(tmp_path / "state.xml")
    simulation = makeSimulation(platformName)
    simulation.step(7)
    simulation.saveState(file)
    simulation.step(5)
    fresh = makeSimulation(platformName)
    fresh.loadState(file)
    fresh.step(5)
    assert np.array_equal(positionsOf(fresh.context), positionsOf(simulation.context))
    assert fresh.currentStep == 12


def testReinitializeTakesNewSettings(platformName):
    simulation = makeSimulation(platformName)
    simulation.step(2)
    positions = positionsOf(simulation.context)
    simulation.context.reinitialize(preserveState=True)
    assert np.array_equal(positionsOf(simulation.context), positions)
    simulation.step(2)


# ---------------------------------------------------------------- new processes


def runPython(*arguments, **environment):
    """Run this interpreter as from a fresh shell; return exit status, output and errors."""
    inherited = {key: value for key, value in os.environ.items() if key != "OPENMM_PLUGIN_DIR"}
    done = subprocess.run(
        [sys.executable, *arguments],
        env={**inherited, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("imports", ["import openmmpse, openmm", "import openmm, openmmpse"])
def testPluginsAreLoadedInAnyOrderOfImports(imports):
    """One for every platform that OpenMM has here; not every machine has a device."""
    status, output, errors = runPython(
        "-c",
        f"{imports}\nfrom openmmpse import plugins\n"
        "print(*plugins.loadedPlatforms())\nprint(*plugins.platforms())",
    )
    assert (status, errors) == (0, "")
    loaded, able = (line.split() for line in output.splitlines())
    assert able == [
        name
        for name in loaded
        if name in plugins.LIBRARIES and (plugins.DIRECTORY / plugins.LIBRARIES[name]).exists()
    ]
    assert {"Reference", "CPU"} <= set(able)


def testPluginsAreLoadedWhenOpenmmLooksElsewhere(tmp_path):
    code = "import openmmpse\nfrom openmmpse import plugins\nprint(plugins.platforms())"
    status, output, errors = runPython("-c", code, OPENMM_PLUGIN_DIR=str(tmp_path))
    assert (status, output.strip(), errors) == (0, "['Reference']", "")


def testImportingOpenmmAloneReadsTheXml(tmp_path):
    file = tmp_path / "integrator.xml"
    file.write_text(openmm.XmlSerializer.serialize(odd()), encoding="utf-8")
    code = (
        "import sys, openmm\n"
        "integrator = openmm.XmlSerializer.deserialize(open(sys.argv[1]).read())\n"
        "print(integrator.getStepSize()._value)"
    )
    status, output, errors = runPython("-c", code, str(file))
    assert (status, errors) == (0, "")
    assert float(output) == math.pi * 1e-3


def testDoctor(tmp_path):
    status, output, _ = runPython("-m", "openmmpse", "doctor")
    assert status == 0
    for text in (
        openmmpse.__version__,
        openmm.__version__,
        "603.419 Da/(nm ps)",
        "Reference  ok",
        "CPU        ok",
        "ms per step",
    ):
        assert text in output
    lines = {line.split()[0]: line for line in output.splitlines() if line[0] != " "}
    context, integrator = makeContextForInstructions()
    assert f" {integrator.getNumericalParameters()['instructions']} in use" in lines["SIMD"]
    assert re.search(r"fftw-3\.\d+\.\d+\S*, (bundled|the system's) \(/", lines["FFT"])
    for device in plugins.DEVICES:
        assert re.search(rf"{device} +(ok: 300 spheres|not used: .*(install|nothing))", lines[device])
    status, output, _ = runPython("-m", "openmmpse", "doctor", OPENMM_PLUGIN_DIR=str(tmp_path))
    assert status == 1
    assert "CPU        FAILED" in output and str(tmp_path) in output and "Reference  ok" in output
    assert "none in use" in output and "unset it" in output and "pip install --force-reinstall" in output


def makeContextForInstructions():
    system = openmm.System()
    system.addParticle(1)
    integrator = PSEBrownianIntegrator(300, 600, 0.5, 0.01)
    return contextOn("CPU", system, integrator), integrator


def testDoctorSurvivesDrivers(monkeypatch, capsys, tmp_path):
    """One that ends the process, one that fails, and one that is right."""
    from openmmpse import doctor

    interpreter = tmp_path / "python"
    monkeypatch.setattr(doctor.sys, "executable", str(interpreter))
    for script, right in (("kill -ABRT $$", False), ("exit 1", False), ('[ "$5" = OpenCL ]', True)):
        interpreter.write_text(f"#!/bin/sh\n{script}\n")
        interpreter.chmod(0o755)
        assert doctor.checkApart("OpenCL") == right
        assert ("ended the process (status -6)" in capsys.readouterr().out) == ("ABRT" in script)


def testDoctorNoticesWrongNumbers(monkeypatch, capsys):
    """A mobility a tenth of a per cent off, noise a per cent off, and a mobility of one particle off by 1e-7."""
    from openmmpse import doctor

    monkeypatch.setattr(doctor, "SECONDS", 0.0)
    assert doctor.checkPlatform("CPU") and doctor.checkPlatform("Reference")
    text = capsys.readouterr().out
    assert "CPU        ok" in text and "Reference  ok" in text
    genuine = doctor.contextOf

    class Wrong:
        """An integrator that answers with numbers that are a little off."""

        def __init__(self, integrator, mobility, noise):
            self.integrator, self.mobility, self.noise = integrator, mobility, noise

        def applyMobility(self, forces):
            return self.mobility * self.integrator.applyMobility(forces)

        def sampleBrownianDisplacements(self, count):
            return self.noise * self.integrator.sampleBrownianDisplacements(count)

        def __getattr__(self, name):
            return getattr(self.integrator, name)

    for platformName, mobility, noise in (("CPU", 1.002, 1), ("CPU", 1, 1.01), ("Reference", 1 + 1e-7, 1)):

        def contextOf(name, *arguments):
            context, integrator = genuine(name, *arguments)
            return context, Wrong(integrator, mobility, noise) if name == platformName else integrator

        monkeypatch.setattr(doctor, "contextOf", contextOf)
        assert not doctor.checkPlatform(platformName)
        assert f"{platformName:10} FAILED" in capsys.readouterr().out


def testCommandLineUsage():
    status, _, errors = runPython("-m", "openmmpse", "dance")
    assert status == 2 and "dance" in errors and "doctor" in errors
    assert runPython("-m", "openmmpse", "--help")[0] == 0
