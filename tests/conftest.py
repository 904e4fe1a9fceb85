# SPDX-License-Identifier: MIT
"""
Runs every test with an argument `platformName` on each platform in each precision; marks say where
it need not run, and --platform chooses. On a platform of a device that is not there no test runs:
test_platforms.py tells it, by a skipped test for each.
"""
import pytest

from hardcases import HARD_CASE, HardCase, described, keepRows, rowsOf, writePage
from platformnames import DEVICES, NAMES, VARIANTS, absence, allServed, familyOf, isDevice, isDirect

NOWHERE = pytest.param(None, id="nowhere")
MARKS = {
    "onePlatform": "runs on one platform: what it tests is decided before any platform sees it",
    "onePrecision": "runs in one precision of a device: what it tests does not depend on it",
    "hostOnly": "not on devices, where what it tests follows from having the noise of the CPU",
    "deviceOnly": "runs on devices alone",
    "withGrid": "not on a platform that sums directly",
}


def pytest_addoption(parser):
    parser.addoption(
        "--platform",
        action="append",
        choices=list(dict.fromkeys((*VARIANTS, *NAMES))),
        help="run the tests on this platform only (may be repeated); default: all",
    )
    parser.addoption("--long", action="store_true", help="hard cases in full, not in their short form")
    parser.addoption("--fuzz-seed", type=int, default=1, help="draws other random scenes (default: 1)")
    parser.addoption("--fuzz-scenes", type=int, help="number of random scenes on each platform")
    parser.addoption("--torture-table", metavar="PAGE", help="fill the tables of hard cases of this page")


def pytest_configure(config):
    for name, meaning in MARKS.items():
        config.addinivalue_line("markers", f"{name}: {meaning}")


def chosenNames(config):
    """All names of platforms that --platform asks for, whether or not they are there."""
    asked = config.getoption("platform") or VARIANTS
    return [name for name in NAMES if name in asked or familyOf(name) in asked]


def namesFor(chosen, marks):
    """Those of the chosen names that are there and that the marks of a test leave."""
    names = [name for name in chosen if not absence(familyOf(name))]
    if "hostOnly" in marks:
        names = [name for name in names if not isDevice(name)]
    if "deviceOnly" in marks:
        names = [name for name in names if isDevice(name)]
    if "withGrid" in marks:
        names = [name for name in names if not isDirect(name)]
    if "onePlatform" in marks:
        names = names[:1]
    if "onePrecision" in marks:
        names = [name for i, name in enumerate(names)
                 if familyOf(name) not in map(familyOf, names[:i])]
    return names


def pytest_generate_tests(metafunc):
    chosen = chosenNames(metafunc.config)
    if "platformName" in metafunc.fixturenames:
        marks = {mark.name for mark in metafunc.definition.iter_markers()}
        if "hardCase" in metafunc.fixturenames and not metafunc.config.getoption("long"):
            marks.add("onePrecision")
        names = namesFor(chosen, marks)
        metafunc.parametrize("platformName", names or [NOWHERE], scope="session")
    if "device" in metafunc.fixturenames:
        devices = [device for device in DEVICES if device in map(familyOf, chosen)]
        metafunc.parametrize("device", devices or [NOWHERE])


def isNowhere(item):
    parameters = item.callspec.params if hasattr(item, "callspec") else {}
    return any(name in parameters and parameters[name] is None for name in ("platformName", "device"))


def isUnserved(item):
    """A hard case with a tolerance that its platform would refuse."""
    parameters = item.callspec.params if hasattr(item, "callspec") else {}
    return ("hardCase" in item.fixturenames and {"platformName", "tolerance"} <= set(parameters)
            and not allServed(parameters["platformName"], [parameters["tolerance"]]))


def pytest_collection_modifyitems(config, items):
    nowhere = [item for item in items if isNowhere(item) or isUnserved(item)]
    if nowhere:
        items[:] = [item for item in items if item not in nowhere]
        config.hook.pytest_deselected(items=nowhere)
    # What compiles recorded programs comes after all that records some (in one process).
    items.sort(key=lambda item: item.path.name == "test_cuda_kernels.py")


def pytest_report_header(config):
    return (f"hard cases: {'long' if config.getoption('long') else 'short'} form, random scenes with seed "
            f"{config.getoption('fuzz_seed')} (--fuzz-seed), all other seeds fixed")


def pytest_terminal_summary(terminalreporter):
    """Tables that tests recorded as a property are printed, whatever the outcome; with -v also hard cases."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for title, table in report.user_properties:
                if title != HARD_CASE:
                    terminalreporter.section(title)
                    terminalreporter.write_line(table)
    stats = terminalreporter.stats # under "" are the reports of teardowns
    failed = {report.nodeid for outcome in ("failed", "error") for report in stats.get(outcome, ())}
    rows = rowsOf([*stats.get("", ()), *stats.get("error", ())], failed)
    if rows and terminalreporter.verbosity > 0:
        terminalreporter.section("hard cases")
        for row in rows:
            terminalreporter.write_line(described(row))
    destination = terminalreporter.config.getoption("torture_table")
    if destination:
        keepRows(destination, rows)
        writePage(destination)


@pytest.fixture
def hardCase(request):
    """What a test of tests/torture tells of itself: its row in the table of docs/robustness.md."""
    case = HardCase(request)
    yield case
    case.tell()
