# SPDX-License-Identifier: MIT
"""The CUDA plugin is loaded and registers its kernels, proved without a GPU: the toolkit's stub of
the driver's library has all its symbols, but no device."""

import json
import os
import subprocess
import sys
from pathlib import Path

import openmm.version
import pytest

from openmmpse import plugins

PROGRAM = """
import json
import openmm
from openmmpse import plugins
names = [openmm.Platform.getPlatform(i).getName() for i in range(openmm.Platform.getNumPlatforms())]
failures = [text for text in openmm.Platform.getPluginLoadFailures() if "CUDA" in text]
print(json.dumps([names, plugins.platforms(), failures]))
"""


def toolkits():
    """The folders of installed CUDA toolkits."""
    names = (os.environ.get("CUDA_PATH"), os.environ.get("CUDA_HOME"), "/usr/local/cuda")
    return [Path(name) for name in names if name]


@pytest.fixture
def stubbed(tmp_path):
    """The environment in which the stub is the driver's library."""
    if not (plugins.DIRECTORY / plugins.LIBRARIES["CUDA"]).exists():
        pytest.skip("the CUDA plugin is not installed (built with PSE_BUILD_CUDA=ON)")
    if not (Path(openmm.version.openmm_library_path) / "plugins" / "libOpenMMCUDA.so").exists():
        pytest.skip("OpenMM's CUDA platform is not installed (openmm-cuda-13)")
    for toolkit in toolkits():
        stub = toolkit / "lib64" / "stubs" / "libcuda.so"
        if stub.exists():
            (tmp_path / "libcuda.so.1").symlink_to(stub)
            return {**os.environ, "LD_LIBRARY_PATH": f"{tmp_path}:{toolkit / 'lib64'}"}
    pytest.skip("no CUDA toolkit with lib64/stubs/libcuda.so")


def testPluginLoadsAndRegistersWithTheStubDriver(stubbed):
    result = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=stubbed, capture_output=True, text=True, check=True
    )
    names, able, failures = json.loads(result.stdout)
    assert "CUDA" in names
    assert failures == []
    assert "CUDA" in able
