# SPDX-License-Identifier: MIT
"""What tests of tests/torture measure arrives on the page of hard cases as it was, and the page is not stale."""
import json
from pathlib import Path
from types import SimpleNamespace

import pytest

import hardcases
from hardcases import HARD_CASE, HardCase

PAGE = Path(__file__).resolve().parents[1]/"docs"/"robustness.md"


def requested(order=0, **parameters):
    """What pytest hands to the fixture of a test."""
    node = SimpleNamespace(originalname="testFewSpheres", callspec=SimpleNamespace(params=parameters), user_properties=[])
    node.session = SimpleNamespace(items=[None]*order + [node])
    return SimpleNamespace(node=node, path=Path("test_geometry.py"), config=SimpleNamespace(getoption=lambda _: False))


def reportOf(request, **measured):
    case = HardCase(request)
    for how, values in measured.items():
        getattr(case, how)(**values)
    case.tell()
    return SimpleNamespace(when="teardown", nodeid=str(id(request)), user_properties=request.node.user_properties)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
@pytest.mark.parametrize("how", ["measure", "least", "add"])
def testWhatIsNoNumberFails(how, value):
    for before in ({}, {"error": 0.2}):
        case = HardCase(requested())
        getattr(case, how)(**before)
        with pytest.raises(AssertionError, match="error is"):
            getattr(case, how)(error=value)
        if value != value:
            assert case.measured["error"][1] != case.measured["error"][1]
            with pytest.raises(AssertionError, match="error is nan"):
                getattr(case, how)(error=0.3)


def testNumbersGivenAgain():
    report = reportOf(requested(platformName="CPU", tolerance=1e-2, name="5 a"), measure={"error/tolerance": 0.5})
    assert json.loads(report.user_properties[0][1])["variant"] == "tolerance = 0.01, 5 a"
    case = HardCase(requested())
    for value in (0.2, 0.3, 0.1):
        case.measure(most=value)
        case.least(least=value)
        case.add(sum=value)
    assert [value for _, value in case.measured.values()] == [0.3, 0.1, pytest.approx(0.6)]


def testPartsOfATestAreOneRow():
    """In whatever order processes tell them."""
    parts = [reportOf(requested(order=2 - i, platformName="CPU", chunk=f"{i}/3"), measure={"error/allowed": 0.1*(i % 2)},
                      least={"nearest": 1.0 + i}, add={"scenes": 5}) for i in range(3)]
    first = reportOf(requested(order=5, platformName="Reference"), measure={"error/allowed": 0.4})
    rows = hardcases.rowsOf([first, *parts], failed={parts[1].nodeid})
    assert [(row["platform"], row["failed"]) for row in rows] == [("CPU", True), ("Reference", False)]
    assert rows[0]["measured"] == {"error/allowed": 0.1, "nearest": 1.0, "scenes": 15}


def testARunReplacesWhatItRan(tmp_path):
    page = tmp_path/"page.md"
    page.write_text("<!-- overview -->\n<!-- end -->\n<!-- table geometry -->\nbefore\n<!-- end -->\n")
    for platform, error in (("CPU", 0.6789), ("Reference", 0.25), ("CPU", 0.75)):
        rows = hardcases.rowsOf([reportOf(requested(platformName=platform), measure={"error/tolerance": error})])
        hardcases.keepRows(page, rows)
        hardcases.writePage(page)
    text = page.read_text()
    assert "| error/tolerance | 0.25 | 0.75 |" in text and "before" not in text and "0.68" not in text
    assert "0.25 | 0.75 |  | short | fixed | none |" in text
    hardcases.writePage(page)
    assert page.read_text() == text


def testThePageIsNotStale():
    """It is what `./run torture` makes of its numbers and of the docstrings of all hard cases."""
    text = PAGE.read_text()
    assert hardcases.filled(text, hardcases.readRows(PAGE)) == text, "python tests/hardcases.py writes it anew"
    areas = {path.stem.removeprefix("test_") for path in hardcases.FOLDER.glob("test_*.py")}
    for area in areas:
        assert f"<!-- table {area} -->" in text, area
        for case in hardcases.casesOf(area):
            assert f"*Tried:* {case.tried}\n" in text and f"*Must hold:* {case.holds}\n" in text, case.name
