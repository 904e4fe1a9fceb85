# SPDX-License-Identifier: MIT
"""Which time step keeps equilibrium means right: from the rate of the stiffest mode.

docs/time-step.md derives it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .scene import checkNumbers, sceneOf

BIAS = 0.01  #: relative, of the variance of the stiffest mode
CONFIGURATIONS = 4  #: along a short run, the given positions first
STRETCH, WORK = 100, 200_000  #: steps from one to the next; fewer if they times the number of particles exceed it
MOST_MOVED = 0.3  #: rms displacement of a sphere in a step, in radii: describe() warns beyond
TOLERANCE = 1e-3  #: of the mobility that rates are found with
SHIFT = 1e-3  #: largest displacement of a finite difference, in radii
ITERATIONS, ACCURACY = 60, 2e-3  #: of a largest rate
RESOLUTION = 1e-2  #: rates below this in units of D0/a^2 limit nothing; forces may be rounded to floats


class StepAdvice(NamedTuple):
    """Time steps for a scene, in ps; None: nothing limits them."""

    rate: float | None  #: relaxation rate of the stiffest mode, 1/ps: largest eigenvalue of M times the Hessian
    stable: float | None  #: 2/rate: a larger step makes that mode blow up
    present: float  #: the step of the integrator
    bias: float | None  #: relative error of that mode's variance at the present step; infinite if it blows up
    wanted: float  #: the error that `recommended` allows
    recommended: float | None  #: the step with that error
    reason: str  #: what limits it, in words


def recommendStep(source, positions=None, integrator=None, *, box=None, platform=None, properties=None, bias=BIAS,
                  configurations=CONFIGURATIONS):  # fmt: skip
    """Recommend the step size at which the variance of the stiffest mode is off by a fraction `bias`.

    A mode that relaxes at the rate w keeps the variance (kT/k)/(1 - w dt/2) instead of kT/k, so a step of

        dt = 2 bias/((1 + bias) w)

    has the wanted bias in the stiffest mode, and less in all others and in every sum of them, as lengths of bonds and
    radii of gyration are; 2/w is the limit of stability. w is the largest eigenvalue of M K, M the mobility and K the
    derivatives of the forces, by Lanczos's method with K in central differences, to 0.2 % (docs/time-step.md). Relax
    the scene first: an overlap that equilibrium does not have makes the steps shorter than need be.

    Where no forces limit it, or softer ones than the fluid, the step is that of an rms displacement of 0.3 radii, in
    which the mobility changes; without a fluid (FreeDraining) nothing limits it there.

    Example:

        advice = openmmpse.accuracy.recommendStep(simulation.context, bias=0.01)
        integrator.setStepSize(advice.recommended * unit.picosecond)

    Parameters
    ----------
    source, positions, integrator, box, platform, properties
        as in `measure`
    bias : float
        wanted relative error of the variance, > 0
    configurations : int
        that the curvature is looked for at, > 0, along a short run which begins at the positions given, with steps as
        found so far; the largest counts, because curvature varies where forces are steep. Where the box moves, only
        the first

    Returns
    -------
    StepAdvice
        steps in ps

    Raises
    ------
    SceneError
        for what cannot be measured
    openmm.OpenMMException
        for what the library refuses
    """
    checkNumbers(bias=bias, configurations=configurations)
    return advise(sceneOf(source, positions, integrator, box, platform, properties), bias, int(configurations))


def advise(scene, bias=BIAS, configurations=CONFIGURATIONS):
    """`StepAdvice` for a `Scene`; see `recommendStep`."""
    probe = scene.probe(TOLERANCE, exact=True)
    positions, rate = scene.positions, 0.0
    for number in range(configurations):
        rate = max(rate, stiffestRate(probe, positions))
        if number < configurations - 1:
            positions = probe.run(positions, _step(scene, rate, bias)[0] or scene.stepSize, _stretch(scene))
            if positions is None:  # they belong to another box than the scene
                break
    present = scene.stepSize
    step, reason = _step(scene, rate, bias)
    if rate == 0:
        return StepAdvice(None, None, present, None, bias, step, reason)
    share = rate * present / 2
    return StepAdvice(rate, 2 / rate, present, share / (1 - share) if share < 1 else np.inf, bias, step, reason)


def _step(scene, rate, bias):
    """(step in ps or None, what limits it)"""
    limits = []
    if rate > 0:
        limits.append((2 * bias / ((1 + bias) * rate), f"a variance of the stiffest mode that is {100 * bias:g} % too large"))
    diffusion = scene.thermalEnergy * scene.freeMobility
    if diffusion > 0 and scene.hasFluid:
        limits.append(
            ((MOST_MOVED * scene.radius) ** 2 / (6 * diffusion), f"an rms displacement of {MOST_MOVED:g} radii")
        )
    missing = "neither noise nor forces that vary" if scene.hasFluid else "neither a fluid nor forces that vary"
    return min(limits, default=(None, f"nothing: there are {missing}"))


def stiffestRate(probe, positions):
    """Largest eigenvalue (1/ps) of M K at positions (N, 3) in nm, K minus the derivatives of the forces; 0 if none is.

    K M is symmetric in the scalar product g.M g' of forces, so Lanczos's method with its three terms finds the largest
    eigenvalue first (that rounding loses orthogonality only repeats it). An iteration evaluates the forces twice and
    M f once.
    """
    scene = probe.scene
    least = RESOLUTION * scene.freeMobility * _thermal(scene)
    diagonal, beside, largest = [], [], 0.0
    before = np.zeros((scene.count, 3))
    g = np.random.default_rng(8).normal(size=before.shape)
    for n in range(min(ITERATIONS, 3 * scene.count)):
        u = probe.velocitiesAt(positions, g)
        # Spheres at one place move as one: for forces that part them, g.M g is 0, and rounding may make it negative.
        length = np.sqrt(max(np.sum(g * u), 0.0))
        if n > 0:
            if length <= 1e-3 * max(largest, least):
                break
            beside.append(length)
        g, u = g / length, u / length
        grown = stiffnessTimes(probe, positions, u)
        diagonal.append(np.sum(grown * u))
        g, before = grown - diagonal[-1] * g - (beside[-1] if n > 0 else 0.0) * before, g
        projected = np.diag(diagonal) + np.diag(beside, 1) + np.diag(beside, -1)
        previous, largest = largest, np.linalg.eigvalsh(projected)[-1]
        if n > 4 and abs(largest - previous) < ACCURACY * abs(largest):
            break
    return float(largest) if largest > least else 0.0


def _stretch(scene):
    """Steps of a short run; direct sums over pairs make it shorter."""
    work = scene.count ** (2 if scene.platform == "Reference" else 1)
    return int(np.clip(WORK // work, 2, STRETCH))


def stiffnessTimes(probe, positions, velocity):
    """K u for u (count, 3): by how much forces grow against a displacement, central differences; error about 1e-3."""
    shift = SHIFT * probe.scene.radius / np.sqrt(np.max(np.sum(velocity**2, axis=1)))
    ends = []
    for sign in (1, -1):
        moved = positions.copy()
        moved[probe.scene.mobile] += sign * shift * velocity
        ends.append(probe.forcesAt(moved))
    return (ends[1] - ends[0]) / (2 * shift)


def _thermal(scene):
    """A stiffness (kJ/(mol nm^2)) to compare others with: kT/a^2, at temperature 0 that of 1 kJ/mol."""
    return (scene.thermalEnergy or 1.0) / scene.radius**2
