# SPDX-License-Identifier: MIT
"""The small scene on which the tests of openmmpse.accuracy measure."""
import scenes
from openmmpse import PSEBrownianIntegrator

TEMPERATURE, STEP = 293.15, 1.0  #: K, ps


def template(temperature=TEMPERATURE, radius=0.5, seed=7):
    """The integrator of a scene, in a periodic fluid."""
    integrator = PSEBrownianIntegrator(temperature, scenes.ETA, radius, STEP)
    integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
    integrator.setRandomNumberSeed(seed)
    return integrator


def springs(scene, k=200.0):
    """Bonds between every other particle and the next."""
    return scenes.harmonicBonds([(i, i + 1) for i in range(0, scene.count - 1, 2)], 2.4*scene.radius, k)


def smallSuspension():
    return scenes.randomSuspension(30, 0.15, scenes.cube(1), 0.5, seed=3)
