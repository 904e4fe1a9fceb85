# SPDX-License-Identifier: MIT
"""Installation check: what is installed where, and does each platform get known numbers right?"""

from __future__ import annotations

import argparse
import ctypes
import functools
import importlib.metadata
import importlib.util
import math
import os
import platform
import subprocess
import sys
import time
from pathlib import Path

import numpy
import openmm
from openmm import unit

import openmmpse
from openmmpse import plugins
from openmmpse.conversion import VISCOSITY_UNIT, inUnit

WATER = inUnit(1.002e-3 * unit.pascal * unit.second, VISCOSITY_UNIT, "viscosity")  # at 20 C
TEMPERATURE = 293.15  #: K
RADIUS = 0.5  #: nm
STEP = 0.1  #: ps
PARTICLES, VOLUME_FRACTION = 300, 0.1
#: of the Reference platform for one particle, whose mobility is known, and for what others are compared with
EXACT = 1e-8
TOLERANCE = 1e-3  #: of the platforms that are checked
#: of one random displacement, over the tolerance: the window of a grid changes it, in ways that leave its covariance
NOISE_SLACK = 5
SECONDS = 1.0  #: about what the timing of steps may take on one platform

REMEDIES = {
    "OpenCL": "to use it, install the OpenCL driver of a GPU, or PoCL for the processor (Debian, Ubuntu: apt-get "
    "install ocl-icd-libopencl1 pocl-opencl-icd)",
    "CUDA": "to use it, an NVIDIA GPU, its driver for CUDA 13 and pip install 'openmm-pse[cuda13]' are needed",
}
#: module -> what needs it, and where it comes from
WANTED = {
    "matplotlib": ("pictures", "matplotlib"),
    "tqdm": ("progress bars", "tqdm"),
    "openmm_systems": ("the demo", "openmm-systems"),
}


def relativeSelfMobility(aOverL):
    """Mobility of a particle in a cubic box, in units of 1/(6 pi eta a), for a radius/box <= 1/2.

    Exact for the Rotne-Prager-Yamakawa mobility; its leading terms are those of Hasimoto,
    J. Fluid Mech. 5, 317 (1959).
    """
    return 1 - 2.8372974794806 * aOverL + 4 * math.pi / 3 * aOverL**3


def contextOf(platformName, positions, box, tolerance, parameters=None):
    """A Context of spheres in water without Forces, and its integrator.

    positions   (N, 3) (nm)
    box         edge of the cube (nm)
    parameters  numerical ones of another Context, to be used here
    """
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*(openmm.Vec3(*row) for row in box * numpy.eye(3)))
    for _ in positions:
        system.addParticle(1)
    integrator = openmmpse.PSEBrownianIntegrator(TEMPERATURE, WATER, RADIUS, STEP)
    integrator.setErrorTolerance(tolerance)
    integrator.setFluidBoundary(integrator.Periodic)
    integrator.setRandomNumberSeed(1)
    if parameters is not None:
        integrator.setNumericalParameters(parameters)
    context = openmm.Context(system, integrator, openmm.Platform.getPlatformByName(platformName))
    context.setPositions(positions)
    return context, integrator


def errorOfSelfMobility(platformName):
    """Relative error of the velocity of one particle in a box of ten radii."""
    box, force = 10 * RADIUS, 10.0
    context, integrator = contextOf(platformName, [openmm.Vec3(0.1, 0.2, 0.3)], box, EXACT)
    velocity = integrator.applyMobility([[force, 0, 0]])[0, 0]
    exact = force / (6 * math.pi * WATER * RADIUS) * relativeSelfMobility(RADIUS / box)
    return abs(velocity / exact - 1)


@functools.cache
def suspension():
    """Positions (nm) of overlapping spheres, forces (kJ/(mol nm)) on them, both (N, 3), and the edge of the box (nm)."""
    generator = numpy.random.default_rng(1)
    box = (PARTICLES * 4 * math.pi / 3 * RADIUS**3 / VOLUME_FRACTION) ** (1 / 3)
    return box * generator.random((PARTICLES, 3)), generator.normal(size=(PARTICLES, 3)), box


@functools.cache
def exactVelocities():
    """M f of the suspension (nm/ps) by the direct sums of Reference, to EXACT."""
    positions, forces, box = suspension()
    context, integrator = contextOf("Reference", positions, box, EXACT)
    return integrator.applyMobility(forces)


def checkSuspension(platformName):
    """Errors of M f and of one random displacement on a platform, and the time of a thermal step (s).

    The first is that of setErrorTolerance(), against EXACT; the second is relative, against Reference with the same
    numerical parameters and seed: every platform draws the same numbers.
    """
    positions, forces, box = suspension()
    context, integrator = contextOf(platformName, positions, box, TOLERANCE)
    exact = exactVelocities()
    scale = max(numpy.linalg.norm(exact), numpy.linalg.norm(forces) / (6 * math.pi * WATER * RADIUS))
    error = numpy.linalg.norm(integrator.applyMobility(forces) - exact) / scale
    drawn = integrator.sampleBrownianDisplacements(1)
    parameters = integrator.getNumericalParameters()
    reference, twin = contextOf("Reference", positions, box, TOLERANCE, parameters)
    expected = twin.sampleBrownianDisplacements(1)
    noise = numpy.linalg.norm(drawn - expected) / numpy.linalg.norm(expected)
    return error, noise, secondsOfAStep(context, integrator)


def secondsOfAStep(context, integrator):
    """Wall-clock time (s) of a step: the mean of as many as fit into SECONDS, after two to warm up."""
    integrator.step(2)
    context.getState(positions=True)
    steps, begin = 0, time.perf_counter()
    while steps == 0 or time.perf_counter() - begin < SECONDS:
        integrator.step(10)
        context.getState(positions=True)  # waits for a device
        steps += 10
    return (time.perf_counter() - begin) / steps


def simdInstructions():
    """The vector instructions of this processor that matter here, as Linux reports them."""
    known = ("sse4_1", "avx2", "avx512f", "asimd", "sve")
    try:
        words = set(Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").split())
    except OSError:
        return "unknown"
    return " ".join(name for name in known if name in words) or "none"


def instructionsInUse():
    """The instruction set of the CPU platform's loops, as Highway calls it; nothing if that platform is not loaded."""
    if "CPU" not in plugins.platforms():
        return None
    context, integrator = contextOf("CPU", [openmm.Vec3(0, 0, 0)], 10 * RADIUS, TOLERANCE)
    return integrator.getNumericalParameters()["instructions"]


def fourierLibrary():
    """Version and place of the FFTW that this process has loaded with the CPU plugin; nothing if there is none."""
    try:
        words = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace").split()
    except OSError:
        return None
    paths = sorted({Path(word) for word in words if Path(word).name.startswith(("libfftw3.", "libfftw3-"))})
    if not paths:
        return None
    try:
        version = (ctypes.c_char * 64).in_dll(ctypes.CDLL(str(paths[0])), "fftw_version").value.decode()
    except (OSError, ValueError):  # another library with the interface of FFTW
        version = "with the interface of FFTW, of unknown version"
    owner = "bundled" if paths[0].parent.name.endswith(".libs") else "the system's"
    return f"{version}, {owner} ({paths[0]})"


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
        return f"OpenMM has no platform {name} here" + (f" ({reason})" if reason else "") + f"; {REMEDIES[name]}"
    if name == "CUDA" and not (plugins.DIRECTORY / plugins.LIBRARIES[name]).exists():
        return "its plugin is another package: pip install 'openmm-pse[cuda13]'"
    return None if platform.getDevices() else f"no device found; {REMEDIES[name]}"


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
        f"processor  {len(os.sched_getaffinity(0))} cores usable, "
        f"OPENMM_CPU_THREADS={os.environ.get('OPENMM_CPU_THREADS', '(not set: all cores)')}"
    )
    print(f"SIMD       {instructionsInUse() or 'none'} in use, the processor has {simdInstructions()}")
    print(f"FFT        {fourierLibrary() or 'none loaded'}")
    found = sorted(path.name for path in plugins.DIRECTORY.glob("libOpenMMPSE*.so"))
    print(f"plugins    {' '.join(found) or 'none'} in {plugins.DIRECTORY}")
    if "OPENMM_PLUGIN_DIR" in os.environ:
        print(
            f"           OPENMM_PLUGIN_DIR={os.environ['OPENMM_PLUGIN_DIR']}: "
            "OpenMM looks for its own plugins only there; unset it unless that is meant"
        )
    printLoadFailures()
    print(f"platforms  {' '.join(plugins.platforms()) or 'none'}")
    for module, (use, package) in WANTED.items():
        if importlib.util.find_spec(module) is None:
            print(f"           without {module}, which {use} would need: pip install {package}")
    print(f"water      at 20 C: 1.002 mPa s = {WATER:.3f} Da/(nm ps)")


def checkPlatform(name):
    """Run the checks on one platform, print the outcome and return whether it is right."""
    if name in plugins.DEVICES and (reason := whyNoDevice(name)):
        print(f"{name:10} not used: {reason}")
        return True
    if name not in plugins.platforms():
        print(
            f"{name:10} FAILED: the platform or its plugin {plugins.LIBRARIES[name]} is not loaded; see above, "
            "or install anew: pip install --force-reinstall openmm-pse"
        )
        return False
    try:
        right, text = checkOne() if name == "Reference" else checkMany(name)
    except openmm.OpenMMException as exception:
        right, text = False, str(exception)
    print(f"{name:10} {'ok' if right else 'FAILED'}: {text}")
    return right


def checkOne():
    """Whether Reference, which all others are compared with, has a known number right, and the outcome in words."""
    error = errorOfSelfMobility("Reference")
    return error <= EXACT, f"one particle in a box of 10 radii: mobility off by {error:.1e} (allowed {EXACT:.0e})"


def checkMany(name):
    """Whether another platform agrees with Reference for a suspension, and the outcome in words."""
    error, noise, seconds = checkSuspension(name)
    allowed = NOISE_SLACK * TOLERANCE
    return error <= TOLERANCE and noise <= allowed, (
        f"{PARTICLES} spheres against direct sums: M f off by {error:.1e} (allowed {TOLERANCE:.0e}), noise by "
        f"{noise:.1e} (allowed {allowed:.0e}), {1e3 * seconds:.3g} ms per step"
    )


def checkApart(name):
    """checkPlatform() in a process of its own: drivers of devices may end a process instead of telling an error."""
    sys.stdout.flush()
    status = subprocess.run([sys.executable, "-m", "openmmpse", "doctor", "--platform", name], check=False).returncode
    if status not in (0, 1):
        print(
            f"{name:10} FAILED: its driver ended the process (status {status}); what it said may stand above. Renew "
            "the driver; with PoCL, install the linker, too (Debian, Ubuntu: apt-get install binutils)"
        )
    return status == 0


def main(argv=None):
    """Print the report; return 0 if every platform that this machine has works, else 1."""
    parser = argparse.ArgumentParser(prog="python -m openmmpse doctor", description=__doc__)
    parser.add_argument("--platform", choices=plugins.LIBRARIES, help="check this platform alone")
    options = parser.parse_args(argv)
    if options.platform:
        return 0 if checkPlatform(options.platform) else 1
    printInstallation()
    apart = [name for name in plugins.DEVICES if name in plugins.platforms() and not whyNoDevice(name)]
    results = [checkApart(name) if name in apart else checkPlatform(name) for name in plugins.LIBRARIES]
    return 0 if all(results) else 1
