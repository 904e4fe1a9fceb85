# SPDX-License-Identifier: MIT
"""The pages of docs/: their code runs as printed and gives the numbers that it should, their commands and the files
that they name are there, and the reference has every public name. `./run docs` builds the site."""

import inspect
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import openmm
import pytest

import openmmpse
from openmmpse import __main__ as commandLine

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS / "extensions"))

import plaindocstrings  # noqa: E402  (beside the pages, not a package)
import publicnames  # noqa: E402

PAGES = sorted([*DOCS.glob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"])
FOLDERS = "benchmarks|cmake|docs|examples|numerics|openmmapi|packaging|platforms|python|serialization|tests"
FILE = re.compile(rf"(?<![\w/.-])(?:{FOLDERS})/[\w/.-]+\.(?:cc|cff|cmake|cpp|csv|h|i|json|md|png|py|svg|toml|txt)\b")
SHORT = {
    "quick-start": ("FRAMES, STEPS = 2000, 100", "FRAMES, STEPS = 200, 20"),  # 20 ns instead of 1000
    "reporter": ("COUNT, EDGE, STEPS = 300, 8.0, 3000", "COUNT, EDGE, STEPS = 60, 5.0, 60"),
}
SIGMAS = 4.9  # two-sided false-alarm rate 1e-6


def textOf(page):
    return (DOCS / f"{page}.md").read_text(encoding="utf-8")


def runPage(page, folder, monkeypatch):
    """The names that are left when all Python blocks of a page have run, as one script, in a folder."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setenv("OPENMM_CPU_THREADS", "1")
    blocks = re.findall(r"^```python\n(.*?)^```", textOf(page), re.MULTILINE | re.DOTALL)
    script = "\n".join(blocks)
    if page in SHORT:
        assert SHORT[page][0] in script
        script = script.replace(*SHORT[page])
    scope = {"__name__": page}
    exec(compile(script, f"{page}.md", "exec"), scope)
    return scope


def test_quickStart(tmp_path, monkeypatch):
    names = runPage("quick-start", tmp_path, monkeypatch)
    assert (tmp_path / "diffusion.png").stat().st_size > 10_000
    kT, viscosity = 8.31446e-3 * 293.15, 603.4185
    assert names["bead"] == pytest.approx(1000 * kT / (6 * math.pi * viscosity * 0.5), rel=1e-5)
    # The error bar is nearly that of 600 independent normal numbers; its own, from 20 blocks, is 16 %.
    assert names["error"] / names["measured"] == pytest.approx(math.sqrt(2 / 600), rel=SIGMAS * 0.16)
    # The chain is faster than its beads each for itself, and slower than one bead.
    assert names["measured"] - SIGMAS * names["error"] > names["bead"] / names["BEADS"]
    assert names["measured"] + SIGMAS * names["error"] < names["bead"]


def test_choosing(tmp_path, monkeypatch):
    names = runPage("choosing", tmp_path, monkeypatch)
    assert names["radius"].value_in_unit(openmm.unit.nanometer) == pytest.approx(1.95, abs=5e-3)
    advice = names["advice"]
    assert advice.recommended == pytest.approx(advice.stable * 0.01 / 1.01, rel=1e-9)  # theory [T60]
    for name in ("system", "state", "integrator"):
        openmm.XmlSerializer.deserialize((tmp_path / f"{name}.xml").read_text())


def test_reporter(tmp_path, monkeypatch):
    names = runPage("reporter", tmp_path, monkeypatch)
    header, *lines = (tmp_path / "fluid.csv").read_text().splitlines()
    assert len(lines) == 3 and header == ",".join(names["reporter"].columns)
    cells = re.findall(r"^\| (`[^|]*)", textOf("reporter"), re.MULTILINE)  # the first column of the table
    documented = {name for cell in cells for name in re.findall(r"`([^`]+)`", cell)}
    assert {"share: ..." if name.startswith("share: ") else name for name in names["reporter"].columns} == documented


def test_viscositiesOfTheTable():
    rows = re.findall(r"^\| water, \d+ °C \| ([\d.]+) \| ([\d.]+) \|$", textOf("choosing"), re.MULTILINE)
    assert len(rows) == 3
    for milliPascalSeconds, daltons in rows:
        assert float(milliPascalSeconds) * 602.214 == pytest.approx(float(daltons), rel=1e-3)


def kirkwood(positions, radius):
    """Mean over all pairs of a third of the trace of the Rotne-Prager-Yamakawa tensor, in 1/(6 pi eta a)."""
    r = np.linalg.norm(positions[:, None] - positions[None], axis=-1) / radius
    return np.where(r >= 2, 1 / np.maximum(r, 2), 1 - r / 4).mean()


def test_finiteSizeRecipe(tmp_path, monkeypatch):
    names = runPage("model", tmp_path, monkeypatch)
    assert names["slowed"] == pytest.approx(names["exact"], abs=1e-5)
    assert names["exact"] == pytest.approx(0.72046, abs=5e-6)
    single = 1000 * names["KT"] / (6 * math.pi * names["ETA"] * names["A"])
    assert names["infinite"] == pytest.approx(single * kirkwood(names["chain"], names["A"]), rel=1e-4)
    # What is left is of the order (Rg/L)^4 of the correction.
    left = (names["gyration2"] / names["edge"] ** 2) ** 2 * (names["corrected"] - names["inBox"])
    assert abs(names["corrected"] - names["infinite"]) < 3 * left + 1e-4 * names["infinite"]
    for name in ("inBox", "corrected", "infinite"):
        assert f"{names[name]:.4f}" in textOf("model")


def test_dragOfCubicArrays():
    rows = re.findall(r"^\| (0\.\d+) \| ([\d.]+) \| [\d.]+ \|$", textOf("model"), re.MULTILINE)
    assert len(rows) == 6
    for fraction, drag in rows:
        phi = float(fraction)
        exact = 1 / (1 - 2.837297 * (3 * phi / (4 * math.pi)) ** (1 / 3) + phi)
        assert float(drag) == pytest.approx(exact, abs=6e-4)


def test_migrating(tmp_path, monkeypatch):
    names = runPage("migrating", tmp_path, monkeypatch)
    expected = names["expected"]
    particles = 2000
    for integrator in (names["before"], names["control"]):
        # The mean of 3 N squares of normal numbers; the page prints it.
        assert integrator.getRandomNumberSeed() == 1
        integrator = openmm.XmlSerializer.clone(integrator)
        if "PSE" in openmm.XmlSerializer.serialize(integrator):
            integrator = openmmpse.PSEBrownianIntegrator.cast(integrator)
        measured = names["meanSquareStep"](integrator)
        assert abs(measured / expected - 1) < SIGMAS * math.sqrt(2 / (3 * particles))
    integrator = names["integrator"]  # in units in which the diffusion coefficient of a sphere is T
    kT = 8.31446e-3 * integrator.getTemperature()._value
    mobility = 1 / (6 * math.pi * integrator.getViscosity()._value * integrator.getRadius()._value)
    assert kT * mobility == pytest.approx(1, rel=1e-5)


def commandsIn(text):
    return re.findall(r"^    (?:python -m openmmpse|\./run) .*", text, re.MULTILINE)


def test_commandsAreThere(capsys):
    usage = subprocess.run(["bash", ROOT / "run", "help"], capture_output=True, text=True, check=True).stdout
    for line in [line for page in PAGES for line in commandsIn(page.read_text(encoding="utf-8"))]:
        words = line.split("#")[0].replace("`", "").split()
        if words[0] == "./run":
            assert re.search(rf"^  {words[1]} ", usage, re.MULTILINE), line
            continue
        main, _ = commandLine.COMMANDS[words[3]]
        with pytest.raises(SystemExit):
            main(["--help"])
        known = capsys.readouterr().out
        for option in (word for word in words[4:] if word.startswith("--")):
            assert option in known, line


def test_commandsAreFound():
    """The pattern of the test above finds what it should."""
    assert len(commandsIn(textOf("quick-start"))) == 2
    assert len(commandsIn((ROOT / "README.md").read_text(encoding="utf-8"))) >= 4


def test_filesAreThere():
    named = {(page.name, name) for page in PAGES for name in FILE.findall(page.read_text(encoding="utf-8"))}
    missing = [(page, name) for page, name in named if not (ROOT / name).exists()]
    assert missing == [("theory.md", "tests/TestX.cpp")]  # X stands for any


def test_filesAreFound():
    assert "numerics/SphereModel.h" in FILE.findall(textOf("developer"))


def test_referenceHasEveryMethod():
    text = textOf("api")
    prefix = "openmmpse.PSEBrownianIntegrator."
    written = re.findall(rf"^\.\. auto(?:method|attribute):: {re.escape(prefix)}(\w+)$", text, re.MULTILINE)
    public = {name.removeprefix(prefix) for name in publicnames.publicNames() if name.startswith(prefix)}
    assert len(written) == len(set(written))
    assert set(written) == public
    assert {"applyMobility", "setShearRate", "Periodic", "cast"} <= public


def test_publicNamesAreDocumented():
    modules = publicnames.publicModules()
    assert {"openmmpse", "openmmpse.accuracy"} <= set(modules)
    assert "openmmpse.conversion" not in modules
    for moduleName, module in modules.items():
        for name in module.__all__:
            assert f"{moduleName}.{name}" in publicnames.publicNames()
            value = getattr(module, name)
            if inspect.isclass(value) or callable(value):
                assert inspect.getdoc(value), f"{moduleName}.{name} has no docstring"


def test_plainDocstrings():
    lines = ["Error |u - M f|, rate*y:", "", "    code | is * kept", "", "    all of it", "", "a_ and `b_`:", "    too", "so"]
    assert plaindocstrings.reStructured(lines) == [
        r"Error \|u - M f\|, rate\*y:", "", "::", "", "    code | is * kept", "", "    all of it", "",
        r"a\_ and `b_`::", "", "    too", "", "so", "",
    ]  # fmt: skip


def test_columnsOfDocstrings():
    lines = ["x         |r|", "          on", "a wider name", "          its meaning"]
    assert plaindocstrings.reStructured(lines) == [
        "``x``", r"    \|r\|", "    on", "``a wider name``", "    its meaning", "",
    ]  # fmt: skip
    sections = ["Returns", "-------", "dict", "    keys  and values"]
    assert plaindocstrings.reStructured(sections) == [*sections, ""]
