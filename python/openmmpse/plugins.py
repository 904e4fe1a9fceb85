# SPDX-License-Identifier: MIT
"""Where the plugins of this package are, and which platforms can run the integrator."""

from pathlib import Path

import openmm

DIRECTORY = Path(__file__).resolve().parents[1] / "OpenMM.libs" / "lib" / "plugins"
KERNEL = "IntegratePSEStep"
LIBRARIES = {"Reference": "libOpenMMPSEReference.so", "CPU": "libOpenMMPSECPU.so"}


def platforms():
    """Return the names of the loaded OpenMM platforms that can run PSEBrownianIntegrator."""
    loaded = [openmm.Platform.getPlatform(i) for i in range(openmm.Platform.getNumPlatforms())]
    return [platform.getName() for platform in loaded if platform.supportsKernels([KERNEL])]


def loadMissing():
    """Load the plugins that `import openmm` did not load.

    It loads them all by itself, unless OPENMM_PLUGIN_DIR names other folders or OpenMM is installed
    in another environment than this package.
    """
    present = platforms()
    loaded = {
        openmm.Platform.getPlatform(i).getName() for i in range(openmm.Platform.getNumPlatforms())
    }
    for platform, library in LIBRARIES.items():
        if platform in loaded and platform not in present and (DIRECTORY / library).exists():
            openmm.Platform.loadPluginLibrary(str(DIRECTORY / library))
