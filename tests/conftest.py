# SPDX-License-Identifier: MIT
"""Runs every test with an argument `platformName` on each platform; --platform chooses."""

PLATFORMS = ("Reference", "CPU")


def pytest_addoption(parser):
    parser.addoption(
        "--platform",
        action="append",
        choices=PLATFORMS,
        help="run the tests on this platform only (may be repeated); default: all",
    )


def pytest_generate_tests(metafunc):
    if "platformName" in metafunc.fixturenames:
        metafunc.parametrize(
            "platformName", metafunc.config.getoption("platform") or PLATFORMS, scope="session"
        )


def pytest_collection_modifyitems(items):
    """What compiles recorded programs comes after all that records some."""
    items.sort(key=lambda item: item.path.name == "test_cuda_kernels.py")


def pytest_terminal_summary(terminalreporter):
    """Tables that tests recorded as a property are printed, whatever the outcome."""
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for title, table in report.user_properties:
                terminalreporter.section(title)
                terminalreporter.write_line(table)
