# SPDX-License-Identifier: MIT
"""python -m openmmpse accuracy: what it writes, what it refuses, and that it can be interrupted."""
import ast
import csv
import os
import signal
import subprocess
import sys

import numpy as np
import openmm
import pytest

import scenes
from accuracyscenes import TEMPERATURE, smallSuspension, springs, template
from openmmpse import PSEBrownianIntegrator, accuracy
from openmmpse.accuracy import command, report, tuning


@pytest.fixture(scope="module")
def small():
    return smallSuspension()


@pytest.fixture
def files(small, tmp_path):
    """Paths of SYSTEM.xml, STATE.xml and INTEGRATOR.xml of the small scene."""
    return filesOf(small, tmp_path, lambda integrator: None)


def filesOf(small, tmp_path, configure):
    context, integrator = scenes.makeContext(small, "CPU", temperature=TEMPERATURE, forces=[springs(small)],
                                             configure=configure)
    contents = context.getSystem(), context.getState(positions=True), integrator
    paths = [tmp_path/name for name in ("system.xml", "state.xml", "integrator.xml")]
    for path, content in zip(paths, contents):
        path.write_text(openmm.XmlSerializer.serialize(content))
    return [str(path) for path in paths]


SMALL = ["--rounds", "1", "--property", "Threads=1"]


def testCommandWritesTablePictureAndNumbers(files, tmp_path, capsys):
    out = tmp_path/"a"/"b"
    arguments = [*files, "--output", str(out), *SMALL, "--tolerances", "1e-1", "1e-3", "1e-5", "--run-length", "5000"]
    assert accuracy.main(arguments) == 0
    printed = capsys.readouterr().out
    assert "automatic split" in printed and ("Hasimoto" in printed or "Prolate" in printed)
    assert "Recommended tolerance" in printed and "run of 5000 steps" in printed
    assert (out/"accuracy.txt").read_text().strip() in printed
    assert (out/"accuracy.png").read_bytes().startswith(b"\x89PNG")
    with open(out/"accuracy.csv") as file:
        rows = list(csv.DictReader(file))
    assert [row["tolerance"] for row in rows] == ["1e-01", "1e-03", "1e-05"]
    assert float(rows[2]["error_random"]) < 1e-2*float(rows[0]["error_random"])
    marked = [line for line in printed.splitlines() if line.endswith("<- recommended")]
    assert len(marked) == sum(row["recommended"] == "1" for row in rows) <= 1


def testCommandRecommendsAStep(small, files, tmp_path, capsys):
    """The words, the number of recommendStep() and that of the table; [T60] is tested in torture/test_order.py."""
    arguments = [*files, "--output", str(tmp_path), *SMALL, "--tolerances", "1e-1", "--bias"]
    assert accuracy.main([*arguments, "0.02"]) == 0
    printed = capsys.readouterr().out
    advice = accuracy.recommendStep(command.load(command._parser().parse_args(files)), bias=0.02)
    assert f"relaxes at {advice.rate:.3g} /ps, so steps must stay below {advice.stable:.3g} ps" in printed
    assert f"at 1 ps its variance is off by {advice.bias:.2g}" in printed
    assert (f"Recommended time step: {advice.recommended:.2g} ps, for a variance of the stiffest mode that is 2 % too "
            "large") in printed
    with open(tmp_path/"accuracy.csv") as file:
        assert float(next(csv.DictReader(file))["recommended_step_ps"]) == pytest.approx(advice.recommended, rel=1e-5)
    assert accuracy.main([*arguments, "0.02", "--step", str(1.5*advice.stable)]) == 0
    assert "its variance grows without bound" in capsys.readouterr().out


def testCommandOnSplitsThatAreNone(small, tmp_path, capsys):
    """An unbounded fluid, and force coupling by waves alone: no splitting parameter, which tuning leaves out."""
    def unbounded(integrator):
        integrator.setFluidBoundary(PSEBrownianIntegrator.Unbounded)

    def waves(integrator):
        integrator.setMobilityModel(PSEBrownianIntegrator.ForceCoupling)
        integrator.setSplit(PSEBrownianIntegrator.AllWaves)
    for name, configure in (("none", unbounded), ("AllWaves", waves)):
        paths, out = filesOf(small, tmp_path, configure), tmp_path/name
        split = [] if name == "none" else ["--split", name]
        assert accuracy.main([*paths, "--output", str(out), *SMALL, *split, "--tolerances", "1e-1", "1e-3"]) == 0
        with open(out/"accuracy.csv") as file:
            rows = list(csv.DictReader(file))
        assert [row["split"] for row in rows] == [name, name]
        for row, tolerance in zip(rows, (1e-1, 1e-3)):
            assert 0 < float(row["error_random"]) <= tolerance
        capsys.readouterr()
        assert accuracy.main([*paths, "--output", str(out), "--tune", *SMALL, *split]) == 0
        printed = capsys.readouterr().out
        assert "<- best" in printed and "xi x" not in printed and "left out" not in printed


def testOptionsReplaceTheIntegrator(files, tmp_path, capsys):
    settings = ["--temperature", "0", "--viscosity", "603.4", "--radius", "0.5", "--step", "2"]
    for start in ([*files[:2], *settings], [*files, "--temperature", "0", "--step", "2"]):
        scene = command.load(command._parser().parse_args([*start, "--periodic"]))
        assert (scene.thermalEnergy, scene.stepSize, scene.radius) == (0, 2, 0.5)
        assert scene.freeMobility == pytest.approx(1/(6*np.pi*603.4*0.5))


def testCommandTunes(files, tmp_path, capsys):
    assert accuracy.main([*files, "--output", str(tmp_path), "--tune", *SMALL]) == 0
    printed = capsys.readouterr().out
    assert "<- best" in printed and (tmp_path/"tuning.txt").exists()
    for line in printed.splitlines():
        if "setNumericalParameters" in line:
            settings = ast.literal_eval(line.partition("(")[2].rpartition(")")[0])
            template().setNumericalParameters(settings)
            assert settings
    best = tuning.Candidate("b", {"split": "Hasimoto", "xi": 2.5}, {"xi": 2.5, "gridDimensions": (9, 9, 9),
                            "windowSupport": 4, "realCutoff": 1.0}, 1e-4, [1.0])
    slow = tuning.Candidate("automatic", {}, best.parameters, 1e-4, [1.5])
    lines = report.tuningText(tuning.Tuning(1e-3, [slow, best]))
    assert "1.50 times" in "\n".join(lines) and "({'split': 'Hasimoto', 'xi': 2.5})" in lines[-1]


def testInterruptionLeavesWhatIsKnown(files, tmp_path, capsys, monkeypatch):
    from openmmpse.accuracy.scene import Probe

    calls, original = [], Probe.secondsPerStep

    def interrupted(self, *arguments, **options):
        calls.append(1)
        if len(calls) > 3:
            raise KeyboardInterrupt
        return original(self, *arguments, **options)

    monkeypatch.setattr(Probe, "secondsPerStep", interrupted)
    assert accuracy.main([*files, "--output", str(tmp_path), *SMALL]) == 130
    printed = capsys.readouterr().out
    begun = {line.split()[0] for line in printed.splitlines() if line.strip()}
    assert "INTERRUPTED" in printed and {"1e-01", "1e-02"} <= begun and "1e-03" not in begun
    assert (tmp_path/"accuracy.png").exists()
    with open(tmp_path/"accuracy.csv") as file:
        assert [bool(row["best_s_per_step_without_forces"]) for row in csv.DictReader(file)] == [True, False]


@pytest.mark.skipif(os.name != "posix", reason="signals")
def testSignalEndsTheCommandProperly(files, tmp_path):
    arguments = [sys.executable, "-m", "openmmpse", "accuracy", *files, "--output", str(tmp_path),
                 "--rounds", "1000000", "--tolerances", "1e-1"]
    process = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    seen = b""
    while b"timing, round" not in seen:
        piece = os.read(process.stderr.fileno(), 4096)
        assert piece, seen
        seen += piece
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 130 and b"Traceback" not in err and b"INTERRUPTED" in out
    assert (tmp_path/"accuracy.csv").exists()


def testInterruptedBeforeAnything(files, tmp_path, capsys, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(accuracy.sweep, "forceKinds", interrupted)
    assert accuracy.main([*files, "--output", str(tmp_path/"out"), *SMALL]) == 130
    assert "before anything was measured" in capsys.readouterr().err
    monkeypatch.setattr(command, "tune", interrupted)
    assert accuracy.main([*files, "--tune", "--output", str(tmp_path/"out")]) == 130


@pytest.mark.parametrize("change, words", [
    (lambda f: ["nowhere.xml", *f[1:]], ["nowhere.xml", "does not exist", "System"]),
    (lambda f: [f[1], f[1], f[2]], ["holds a State", "System is expected"]),
    (lambda f: [f[0], f[0], f[2]], ["holds a System", "State is expected"]),
    (lambda f: [*f[:2], f[0]], ["holds a System", "PSEBrownianIntegrator is expected"]),
    (lambda f: f[:2], ["--temperature, --viscosity, --radius, --step missing", "INTEGRATOR.xml"]),
    (lambda f: [*f[:2], "--radius", "0.5"], ["--temperature, --viscosity, --step missing"]),
    (lambda f: [*f, "--platform", "Abacus"], ["'Abacus'", "Reference", "CPU"]),
    (lambda f: [*f, "--property", "Threads"], ["--property Threads", "NAME=VALUE"]),
    (lambda f: [*f, "--property", "Colour=2"], ["Colour"]),
    (lambda f: [*f, "--tolerances", "1e-12"], ["1e-12", "1e-09", "0.1"]),
    (lambda f: [*f, "--run-length", "0"], ["runLength is 0", "positive"]),
    (lambda f: [*f, "--correlation-time", "-1"], ["correlationTime is -1", "positive"]),
    (lambda f: [*f, "--rounds", "0"], ["rounds is 0"]),
    (lambda f: [*f, "--bias", "0"], ["bias is 0", "positive"]),
    (lambda f: [*f, "--radius", "-1"], ["radius is -1", "positive"]),
    (lambda f: [*f, "--tune", "--tolerances", "1e-3", "1e-4"], ["one tolerance", "2 were given"]),
    (lambda f: [*f, "--tune", "--split", "both"], ["one split"]),
])  # fmt: skip
def testBadCommandLines(files, tmp_path, capsys, change, words):
    assert accuracy.main([*change(files), "--output", str(tmp_path/"out")]) == 2
    message = capsys.readouterr().err
    assert message.startswith("accuracy: ") and "Traceback" not in message
    for word in words:
        assert word in message


def testBadFiles(small, files, tmp_path, capsys):
    bad = tmp_path/"bad.xml"

    def messageFor(content, place):
        bad.write_text(content if isinstance(content, str) else openmm.XmlSerializer.serialize(content))
        arguments = [str(bad) if i == place else path for i, path in enumerate(files)]
        assert accuracy.main(arguments) == 2
        return capsys.readouterr().err

    context, _ = scenes.makeContext(small, "CPU")
    assert "holds no positions" in messageFor(context.getState(velocities=True), 1)
    assert "no XML file" in messageFor("hello", 0)
    brownian = messageFor(openmm.BrownianIntegrator(300, 1, 1), 2)
    assert "Integrator; a PSEBrownianIntegrator is expected" in brownian and "--viscosity" in brownian
    message = messageFor(scenes.makeSystem(small, masses=[0.0]*small.count), 0)
    assert "none of the 30 particles can move" in message and "mass above 0" in message
    assert "(30, 3)" in messageFor(scenes.makeSystem(scenes.pair(1.0, 5.0, 0.5)), 0)
    free = template()
    free.setMobilityModel(PSEBrownianIntegrator.FreeDraining)
    assert "FreeDraining" in messageFor(free, 2)
