# SPDX-License-Identifier: MIT
"""Types: the stub of the SWIG module agrees with it, and scripts of users are checked by it (with mypy)."""

import subprocess
import sys

import pytest

pytest.importorskip("mypy")

CONFIGURATION = """
[mypy]
[mypy-openmm.*]
ignore_missing_imports = True
"""
#: of SWIG's own making
SWIG = """
openmmpse.binding.PSEBrownianIntegrator.__swig_destroy__
openmmpse.binding.PSEBrownianIntegrator.thisown
"""
RIGHT = """
import openmm
from openmm import unit
from openmmpse import HydrodynamicsReporter, PSEBrownianIntegrator, accuracy

integrator = PSEBrownianIntegrator(300 * unit.kelvin, 600, radius=0.5, stepSize=1)
integrator.setErrorTolerance(1e-3)
integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
integrator.setNumericalParameters({"xi": 2.5})
iterations: int = integrator.getNumericalParameters()["lanczosIterations"]
speed: float = integrator.applyMobility([[0, 0, 1.0]]).max()
stress = integrator.computeStress(integrator.IdealStress, groups={0, 3})
times: list[float] = list(integrator.getStageTimes().values())
openmm.Context(openmm.System(), integrator)
reporter = HydrodynamicsReporter("fluid.csv", 1000, stress=True, progress=True, totalSteps=10**6)
print(accuracy.measure, reporter.columns)
"""
WRONG = """
from openmmpse import HydrodynamicsReporter, PSEBrownianIntegrator

integrator = PSEBrownianIntegrator(300, 600, 0.5)
integrator.setErrorTolerance("tight")
integrator.setGridDimensions(16, 16)
integrator.getNumericalParameters()["iterations"]
HydrodynamicsReporter("fluid.csv", "1000")
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One for all, so that what mypy knows of NumPy serves again."""
    path = tmp_path_factory.mktemp("typing")
    for name, text in {"mypy.ini": CONFIGURATION, "allowed.txt": SWIG, "right.py": RIGHT, "wrong.py": WRONG}.items():
        (path / name).write_text(text)
    return path


def run(folder, *arguments):
    done = subprocess.run([sys.executable, "-m", *arguments], cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def testTheStubAgreesWithTheModule(folder):
    """Every name, argument and default, in both directions."""
    status, output = run(folder, "mypy.stubtest", "openmmpse.binding", "--concise", "--mypy-config-file", "mypy.ini",
                         "--allowlist", "allowed.txt")  # fmt: skip
    assert status == 0, output


def testScriptsAreChecked(folder):
    status, output = run(folder, "mypy", "right.py")
    assert status == 0, output
    status, output = run(folder, "mypy", "wrong.py")
    errors = [line for line in output.splitlines() if ": error: " in line]
    assert status == 1 and [int(line.split(":")[1]) for line in errors] == [4, 5, 6, 7, 8], output
