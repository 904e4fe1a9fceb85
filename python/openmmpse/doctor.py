# SPDX-License-Identifier: MIT
"""Installation check: what is installed where, and does each platform get a known number right?"""

import argparse
import importlib.metadata
import math
import os
import platform
from pathlib import Path

import openmm
from openmm import unit

import openmmpse
from openmmpse import plugins
from openmmpse.conversion import VISCOSITY_UNIT, inUnit

WATER = inUnit(1.002e-3 * unit.pascal * unit.second, VISCOSITY_UNIT, "viscosity")  # at 20 C
TOLERANCES = {"Reference": 1e-8, "CPU": 1e-4}


def relativeSelfMobility(aOverL):
    """Mobility of a particle in a cubic box, in units of 1/(6 pi eta a), for a radius/box <= 1/2.

    Exact for the Rotne-Prager-Yamakawa mobility; its leading terms are those of Hasimoto,
    J. Fluid Mech. 5, 317 (1959).
    """
    return 1 - 2.8372974794806 * aOverL + 4 * math.pi / 3 * aOverL**3


def errorOfSelfMobility(platformName):
    """Relative error of the velocity of one particle in a box of ten radii, and the tolerance."""
    radius, force = 0.5, 10.0
    box = 10 * radius
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(
        *(openmm.Vec3(*(box * (i == j) for j in range(3))) for i in range(3))
    )
    system.addParticle(1)
    integrator = openmmpse.PSEBrownianIntegrator(293.15, WATER, radius, 1)
    tolerance = TOLERANCES.get(platformName, 1e-3)
    integrator.setErrorTolerance(tolerance)
    integrator.setFluidBoundary(integrator.Periodic)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName(platformName))
    context.setPositions([openmm.Vec3(0.1, 0.2, 0.3)])
    velocity = integrator.applyMobility([[force, 0, 0]])[0, 0]
    exact = force / (6 * math.pi * WATER * radius) * relativeSelfMobility(radius / box)
    return abs(velocity / exact - 1), tolerance


def simdInstructions():
    """The vector instructions of this processor that matter here, as Linux reports them."""
    known = ("sse4_1", "avx2", "avx512f", "asimd", "sve")
    try:
        words = set(Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").split())
    except OSError:
        return "unknown"
    return " ".join(name for name in known if name in words) or "none"


def loadFailures():
    """{library: why OpenMM could not load it}."""
    parts = [
        failure.removeprefix("Error loading library ").partition(": ")
        for failure in openmm.Platform.getPluginLoadFailures()
    ]
    return {Path(library).name: reason for library, _, reason in parts}


def whyNoDevice(name):
    """Why this machine cannot run a platform that needs a device; nothing if it should."""
    platform = plugins.loadedPlatforms().get(name)
    if platform is None:
        reason = loadFailures().get(f"libOpenMM{name}.so")
        return f"OpenMM has no platform {name} here" + (f" ({reason})" if reason else "")
    if name == "CUDA" and not (plugins.DIRECTORY / plugins.LIBRARIES[name]).exists():
        return "its plugin is another package: pip install 'openmm-pse[cuda13]'"
    return None if platform.getDevices() else "no device found"


def printLoadFailures():
    """Print why plugins were not loaded: ours each, OpenMM's own in one line. Where there is no
    device, nothing needs its plugins."""
    unneeded = [plugins.LIBRARIES[name] for name in plugins.DEVICES if whyNoDevice(name)]
    others = []
    for library, reason in loadFailures().items():
        if not library.startswith("libOpenMMPSE"):
            others.append(f"{library} ({reason})")
        elif library not in unneeded:
            print(f"           NOT LOADED: {library} ({reason})")
    if others:
        more = f" and {len(others) - 1} more" if len(others) > 1 else ""
        print(f"           without OpenMM's own {others[0]}{more}, which openmmpse does not need")


def printInstallation():
    """Print versions, places and failures to load."""
    print(f"openmmpse  {openmmpse.__version__} ({Path(openmmpse.__file__).parent})")
    print(f"openmm     {importlib.metadata.version('openmm')} ({Path(openmm.__file__).parent})")
    print(
        f"python     {platform.python_version()}, {' '.join(platform.libc_ver())}, "
        f"{platform.machine()}"
    )
    print(
        f"processor  {len(os.sched_getaffinity(0))} cores usable, SIMD {simdInstructions()}, "
        f"OPENMM_CPU_THREADS={os.environ.get('OPENMM_CPU_THREADS', '(not set: all cores)')}"
    )
    found = sorted(path.name for path in plugins.DIRECTORY.glob("libOpenMMPSE*.so"))
    print(f"plugins    {' '.join(found) or 'none'} in {plugins.DIRECTORY}")
    if "OPENMM_PLUGIN_DIR" in os.environ:
        print(
            f"           OPENMM_PLUGIN_DIR={os.environ['OPENMM_PLUGIN_DIR']}: "
            "OpenMM looks for its own plugins only there"
        )
    printLoadFailures()
    print(f"platforms  {' '.join(plugins.platforms()) or 'none'}")
    print(f"water      at 20 C: 1.002 mPa s = {WATER:.3f} Da/(nm ps)")


def checkPlatform(name):
    """Run the check on one platform, print the outcome and return whether it is right."""
    if name in plugins.DEVICES and (reason := whyNoDevice(name)):
        print(f"{name:10} not used: {reason}")
        return True
    if name not in plugins.platforms():
        print(
            f"{name:10} FAILED: the platform or its plugin {plugins.LIBRARIES[name]} is not loaded"
        )
        return False
    try:
        error, tolerance = errorOfSelfMobility(name)
    except openmm.OpenMMException as exception:
        print(f"{name:10} FAILED: {exception}")
        return False
    right = error <= tolerance
    print(
        f"{name:10} {'ok' if right else 'FAILED'}: mobility of one particle in a box of 10 radii, "
        f"relative error {error:.1e}, allowed {tolerance:.0e}"
    )
    return right


def main(argv=None):
    """Print the report; return 0 if every platform that this machine has works, else 1."""
    parser = argparse.ArgumentParser(prog="python -m openmmpse doctor", description=__doc__)
    parser.parse_args(argv)
    printInstallation()
    results = [checkPlatform(name) for name in plugins.LIBRARIES]
    return 0 if all(results) else 1
