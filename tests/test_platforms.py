# SPDX-License-Identifier: MIT
"""Which platforms the tests ran on: one that is not there is skipped here, once, with the reason."""
import openmm
import pytest

import scenes
from platformnames import (VARIANTS, absence, contextOn, coordinateRounding, lowestTolerance,
                       precisionOf, served)


def testDeviceIsThere(device):
    """And a Context asked for on it is on it, in each precision, with positions of that rounding."""
    if absence(device):
        pytest.skip(f"no test has run on {device}: {absence(device)}")
    s = scenes.pair(1.4, 8.0, 0.5)
    for name in VARIANTS[device]:
        context = contextOn(name, scenes.makeSystem(s), openmm.VerletIntegrator(1))
        platform = context.getPlatform()
        assert platform.getName() == device
        assert platform.getPropertyValue(context, "Precision") == name.partition("-")[2]
        context.setPositions(s.positions)
        error = abs(scenes.positionsOf(context)/s.positions - 1).max()
        rounding = coordinateRounding(name)
        assert (error > 1e-10) == (rounding > 1e-10) and error <= rounding


def testUnknownDevicesAreAbsent(monkeypatch):
    monkeypatch.setattr("platformnames.DEVICES", ("Abacus",))
    assert "no platform Abacus" in absence("Abacus")
    assert absence("Reference") == ""


def testWhatIsExpectedOfEach():
    assert [precisionOf(name, 1e-5) for name in ("Reference", "CPU", "OpenCL-mixed", "CUDA-double")] == [
        "double", "single", "mixed", "double"]
    assert precisionOf("CPU", 1e-6) == "double"
    assert [lowestTolerance(name) for name in ("CPU", "CUDA-single", "OpenCL-double")] == [1e-10, 1e-5, 1e-10]
    assert served("CUDA-mixed", 1e-7) == 1e-5 and served("CPU", 1e-7) == 1e-7
