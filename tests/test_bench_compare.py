# SPDX-License-Identifier: MIT
"""The judgements behind `./run bench`: what fails, what is only reported, and what a broken file of counts leads to."""

import copy
import importlib.util
import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[1] / "benchmarks"


def script(name):
    """A script of the benchmarks as a module."""
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(FOLDER))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(FOLDER))
    return module


bench, reach = script("instruction_counts"), script("reach")

KEPT = {
    "environment": {"target": "AVX2", "FFTW": "1"},
    "cases": {"small": {"total": 1000, "ours": 400, "FFTW": 300, "OpenMM": 200, "system": 100}},
}


def changed(environment=None, **counts):
    """KEPT with other counts of its case."""
    result = copy.deepcopy(KEPT)
    result["cases"]["small"].update(counts)
    result["environment"].update(environment or {})
    return result


def run(tmp_path, measured, *arguments, kept=KEPT):
    """Exit status of the script with a file of counts (none if kept is None) and counts given instead of measured."""
    path = tmp_path / "counts.json"
    if kept is not None:
        path.write_text(kept if isinstance(kept, str) else json.dumps(kept))
    call = ["--program", "unused", "--file", str(path), *arguments]
    return bench.main(call, measure=lambda program, progress: measured)


@pytest.mark.parametrize(
    "counts, status, verdict",
    [
        ({}, 0, "ok"),
        ({"total": 1009, "ours": 403}, 0, "ok"),
        ({"total": 1049, "ours": 419}, 0, "total +4.9%, ours +4.8%"),
        ({"total": 1051}, 1, "GREW: total +5.1%"),
        ({"total": 1005, "ours": 430}, 1, "GREW: ours +7.5%"),
        ({"total": 900}, 0, "shrank: total -10.0%; keep it with --update"),
    ],
)
def testGrowthBeyondFivePercentFails(tmp_path, capsys, counts, status, verdict):
    assert run(tmp_path, changed(**counts)) == status
    printed = capsys.readouterr().out
    assert verdict in printed
    assert ("FAILED" in printed) == (status == 1)


def testGrowthWithAnotherLibraryIsReportedOnly(tmp_path, capsys):
    assert run(tmp_path, changed({"FFTW": "2"}, total=2000)) == 0
    printed = capsys.readouterr().out
    assert "GREW: total +100.0%, but not only the sources differ" in printed
    assert "FFTW: kept 1, here 2" in printed


def testNewAndLostCasesAreReported(tmp_path, capsys):
    measured = copy.deepcopy(KEPT)
    measured["cases"]["large"] = measured["cases"].pop("small")
    assert run(tmp_path, measured) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any("large" in line and "new: keep it with --update" in line for line in lines)
    assert any("small" in line and "gone: drop it with --update" in line for line in lines)


@pytest.mark.parametrize("kept", [None, "{ not JSON"])
def testMissingOrDamagedFileSaysWhatToDo(tmp_path, capsys, kept):
    assert run(tmp_path, KEPT, kept=kept) == 2
    printed = capsys.readouterr().err
    assert "counts.json" in printed and "./run bench --update" in printed


@pytest.mark.parametrize("kept", [None, "{ not JSON", KEPT])
def testUpdateKeepsWhatWasMeasured(tmp_path, kept):
    measured = changed(total=5000)
    assert run(tmp_path, measured, "--update", kept=kept) == 0
    assert bench.load(tmp_path / "counts.json") == measured


def testAnotherInstructionSetIsSkipped(tmp_path, capsys):
    measured = {"environment": {"target": "SSE4"}, "cases": {}}
    assert run(tmp_path, measured, "--update") == 0
    assert "Skipped" in capsys.readouterr().out
    assert bench.load(tmp_path / "counts.json") == KEPT


def testMissingProgramIsNamed(tmp_path, capsys):
    path = tmp_path / "counts.json"
    path.write_text(json.dumps(KEPT))
    assert bench.main(["--program", str(tmp_path / "absent"), "--file", str(path)]) == 2
    assert capsys.readouterr().err.startswith("bench: ")


def testCostsOfCalleesAreCountedOnceAndByOwner():
    profile = """events: Ir
ob=(1) /x/plugins/libOpenMMPSECPU.so
fn=(1) step
10 100
cob=(2) /usr/lib/libfftw3f.so.3
cfn=(2) execute
calls=3 0
11 5000
+1 7
ob=(2)
fn=(2)
0 5000
ob=(3) /x/lib/libOpenMM.so
* 20
cob=(1)
calls=1 10
-2 107
ob=(4) /lib/libc.so.6
3 9
totals: 5136
""".splitlines(True)
    counts = bench.instructionsByOwner(profile)
    assert counts == {"total": 5136, "ours": 107, "FFTW": 5000, "OpenMM": 20, "system": 9}


def testKeptCountsAreComplete():
    kept = bench.load(bench.COUNTS)
    assert kept["environment"]["target"] == bench.TARGET
    assert len(kept["cases"]) >= 5
    for name, counts in kept["cases"].items():
        parts = {owner: counts[owner] for owner in (*bench.OWNERS, bench.REST)}
        assert counts["total"] == sum(parts.values())
        transforms = not name.startswith(("unbounded", "free draining"))
        assert [owner for owner, count in parts.items() if count == 0] == ([] if transforms else ["FFTW"])


@pytest.mark.parametrize(
    "value, target, expected",
    [
        (4.0, (8, 4, True), "aim"),
        (4.1, (8, 4, True), "must"),
        (8.1, (8, 4, True), "MISSED"),
        (0.8, (0.6, 0.8, False), "aim"),
        (0.7, (0.6, 0.8, False), "must"),
        (0.5, (0.6, 0.8, False), "MISSED"),
    ],
)
def testVerdictsOfReach(value, target, expected):
    assert reach.verdict(value, *target) == expected


def testReachJudgesTheMedianOfTheRatiosOfRounds():
    slow, fast = reach.Times(), reach.Times()
    for above, below in ((3.0, 1.0), (40.0, 8.0), (7.0, 1.0)):  # the machine was busy in the second round
        slow.add(above, 2*above)
        fast.add(below, below)
    row = reach.judged(reach.Result("step", reach.ratio, (slow, fast), "note"), 0.25)
    assert (row["measured"], row["lowest"], row["highest"]) == (5, 3, 7)
    assert row["byCpu"] == 10 and row["verdict"] == "must"


@pytest.mark.parametrize("others, mark", [(0.02, "must "), (0.5, "must?")])
def testReachDoubtsTimesOnABusyMachine(others, mark):
    result = reach.Result("step", None, (), "note", cpu=False)
    result.values = [7.0]
    assert mark in reach.line(reach.judged(result, others))


def testReachHasATargetForEveryRowItMeasures():
    missed = {name for name in reach.TARGETS if name.split(",")[0].split(" ")[0] not in reach.ROWS}
    assert not missed
    for what, must, aim, lessIsBetter in reach.TARGETS.values():
        assert (aim < must) == lessIsBetter, what


@pytest.mark.parametrize("shuffled", [True, False])
def testReachScenesAreSuspensions(shuffled):
    """The volume fraction asked for, all inside the box, and in the order of space or not."""
    positions, length = reach.lattice(1000, 0.2, shuffled)
    assert len(positions) == 1000
    assert 1000*4/3*math.pi*reach.RADIUS**3/length**3 == pytest.approx(0.2)
    assert positions.min() > 0 and positions.max() < length
    toNext = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    assert (np.median(toNext) > 0.3*length) == shuffled
