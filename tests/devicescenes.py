# SPDX-License-Identifier: MIT
"""Small scenes that between them use every device kernel, with every define: what is recorded to be
compiled for CUDA, and what runs on a simulator of a device (simulate_device.py).
"""

import numpy as np

import scenes
from openmmpse import PSEBrownianIntegrator as Integrator

FEW = np.where(np.arange(20) % 5 == 0, 1.0, 0.4)  # classes of radii
MANY = np.linspace(0.4, 0.9, 20)  # radii that are interpolated
BARELY_TILTED = np.array([[1, 0, 0], [1e-3, 1, 0], [0, 0, 1]])  # so that devices may tilt it more


def suspension(shape, count=20):
    return scenes.randomSuspension(count, 0.1, shape, 0.5, 3)


def equalSpheres(precision):
    """(scene, tolerance, what to tell the integrator): both splits, the loosest and the tightest tables."""
    rectangular, tilted = suspension(scenes.cube(1)), suspension(scenes.tilted(1))
    tightest = 1e-6 if precision == "double" else 1e-4
    return [
        (rectangular, 1e-3, lambda it: it.setSplit(Integrator.Prolate)),
        (tilted, 1e-3, lambda it: it.setSplit(Integrator.Hasimoto)),
        (rectangular, 1e-1, lambda it: None),
        (rectangular, tightest, lambda it: None),
    ]


def unequalSpheres():
    """Classes and interpolated radii; one box needs images, one is tilted. Each also unbounded."""
    small = scenes.mixture(FEW, 0.1, scenes.cube(1), 4)
    bounded = [
        (small, 1e-3),
        (scenes.mixture(MANY, 0.1, scenes.tilted(1), 5), 1e-2),
        (scenes.Scene(small.positions[:5], scenes.cube(3.0), 0.4, FEW[:5]), 1e-3),
    ]
    return [
        (scene, tolerance, configure)
        for scene, tolerance in bounded
        for configure in (lambda it: None, unbounded)
    ]


def otherModels():
    spheres = suspension(scenes.cube(1))
    return [
        (spheres, 1e-3, unbounded),
        (spheres, 1e-3, unboundedGaussian),
        (spheres, 1e-2, lambda it: it.setMobilityModel(Integrator.ForceCoupling)),
        (spheres, 1e-3, lambda it: it.setMobilityModel(Integrator.FreeDraining)),
    ]


def sheared():
    """Boxes that move: equal spheres in several work groups, and a mixture."""
    return [
        (scene, 1e-2, lambda it: it.setShearRate(0.01))
        for scene in (suspension(BARELY_TILTED, 300), scenes.mixture(FEW, 0.1, BARELY_TILTED, 4))
    ]


def unbounded(integrator):
    integrator.setFluidBoundary(Integrator.Unbounded)


def unboundedGaussian(integrator):
    unbounded(integrator)
    integrator.setMobilityModel(Integrator.ForceCoupling)


def allFor(precision):
    return [*equalSpheres(precision), *unequalSpheres(), *otherModels(), *sheared()]


def runOnOpenCL(precision, scene, tolerance, configure):
    """Let the library do all it can at a scene."""
    context, integrator = scenes.makeContext(
        scene, f"OpenCL-{precision}", 300, tolerance=tolerance, configure=configure
    )
    integrator.step(2)
    integrator.sampleBrownianDisplacements(1)
    assert np.all(np.isfinite(integrator.applyMobility(scenes.randomForces(scene))))
    return context
