# SPDX-License-Identifier: MIT
"""
The platforms that tests run on, by name: "Reference", "CPU" and, with their precision, those of a
device, as in "OpenCL-mixed"; and what may be expected of each.
"""
import functools

import openmm

PRECISIONS = ("single", "mixed", "double")
DEVICES = ("OpenCL", "CUDA")
# name of the platform in OpenMM -> names of it in tests
VARIANTS = {"Reference": ("Reference",), "CPU": ("CPU",),
            **{device: tuple(f"{device}-{precision}" for precision in PRECISIONS)
               for device in DEVICES}}
NAMES = tuple(name for names in VARIANTS.values() for name in names)


def familyOf(platformName):
    """The name that OpenMM has for it."""
    return platformName.partition("-")[0]


def platformNamed(platformName):
    return openmm.Platform.getPlatformByName(familyOf(platformName))


def platformOptions(platformName, threads=None):
    """Properties of a Context; CPU alone has threads, by default all there are."""
    if isDevice(platformName):
        return {"Precision": platformName.partition("-")[2]}
    return {"Threads": str(threads)} if platformName == "CPU" and threads else {}


def contextOn(platformName, system, integrator, threads=None):
    return openmm.Context(system, integrator, platformNamed(platformName),
                          platformOptions(platformName, threads))


@functools.cache
def absence(family):
    """Why nothing can run on a platform; empty if it can. Only that of a device may be absent."""
    if family not in DEVICES:
        return ""
    try:
        platform = openmm.Platform.getPlatformByName(family)
    except openmm.OpenMMException as error:
        return f"OpenMM has no platform {family} here ({error})"
    if not platform.supportsKernels(["IntegratePSEStep"]):
        return f"the plugin of openmmpse for {family} is not loaded"
    system = openmm.System()
    system.addParticle(1)
    try:
        openmm.Context(system, openmm.VerletIntegrator(1), platform)
    except openmm.OpenMMException as error:
        return f"{family} found no device that OpenMM can use ({error})"
    return ""


# ---------------------------------------------------------------- what to expect

def isDirect(platformName):
    """It sums over wave vectors and pairs one by one: no window, no FFT, small scenes only."""
    return platformName == "Reference"


def isDevice(platformName):
    return familyOf(platformName) in DEVICES


def precisionOf(platformName, tolerance):
    """What getNumericalParameters() calls the precision of a fluid at a tolerance."""
    if isDevice(platformName):
        return platformName.partition("-")[2]
    return "single" if platformName == "CPU" and tolerance >= 0.99e-5 else "double"


def lowestTolerance(platformName):
    """The tightest tolerance that is not refused."""
    return 1e-5 if isDevice(platformName) and not platformName.endswith("double") else 1e-10


def served(platformName, tolerance):
    """The tolerance, or the tightest that the platform serves."""
    return max(tolerance, lowestTolerance(platformName))


def allServed(platformName, tolerances):
    """Those of many that are not refused."""
    return [tolerance for tolerance in tolerances if tolerance >= lowestTolerance(platformName)]


def velocityRounding(platformName):
    """Relative rounding of a velocity that is one product, in the arithmetic of the platform."""
    return 1e-12 if not isDevice(platformName) or platformName.endswith("double") else 3e-7


def coordinateRounding(platformName):
    """
    Relative rounding of a coordinate, a velocity or a force as the Context holds it: a float, two
    floats (their correction is one as well, and at most half a unit of the first), or a double.
    """
    if not isDevice(platformName):
        return 1.2e-16
    return {"single": 6e-8, "mixed": 3.6e-15, "double": 1.2e-16}[platformName.partition("-")[2]]
