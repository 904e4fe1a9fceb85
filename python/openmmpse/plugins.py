# SPDX-License-Identifier: MIT
"""Where the plugins of this package are, and which platforms can run the integrator."""

from pathlib import Path

import openmm

DIRECTORY = Path(__file__).resolve().parents[1] / "OpenMM.libs" / "lib" / "plugins"
KERNEL = "IntegratePSEStep"
LIBRARIES = {
    name: f"libOpenMMPSE{name}.so" for name in ("Reference", "CPU", "OpenCL", "CUDA")
}
DEVICES = ("OpenCL", "CUDA")  # not every machine has one


def loadedPlatforms():
    """Return {name: platform} of all that OpenMM has loaded."""
    loaded = [openmm.Platform.getPlatform(i) for i in range(openmm.Platform.getNumPlatforms())]
    return {platform.getName(): platform for platform in loaded}


def platforms():
    """Return the names of the loaded OpenMM platforms that can run PSEBrownianIntegrator."""
    return [
        name for name, platform in loadedPlatforms().items() if platform.supportsKernels([KERNEL])
    ]


def loadMissing():
    """Load the plugins that `import openmm` did not load.

    It loads them all by itself, unless OPENMM_PLUGIN_DIR names other folders or OpenMM is installed
    in another environment than this package.
    """
    present, loaded = platforms(), loadedPlatforms()
    for platform, library in LIBRARIES.items():
        if platform in loaded and platform not in present and (DIRECTORY / library).exists():
            openmm.Platform.loadPluginLibrary(str(DIRECTORY / library))
