# SPDX-License-Identifier: MIT
"""How accurate the hydrodynamics of a run need to be: its other two errors, and the tolerance that stays below both.

Both are estimates for one configuration; docs/accuracy-and-speed.md derives them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

PROBE_TOLERANCE, PROBE_TOLERANCE_LARGE, LARGE = 1e-6, 1e-4, 50_000  #: of the steps that are compared; particles
ENOUGH = 2000  #: particles times pairs of noise that average the noise out of the time-step error
RESOLUTION = 1e-7  #: differences of two products M f below this are the error of the products


class Limits(NamedTuple):
    """The other errors of a run, relative; None: does not apply."""

    timeStep: float | None  #: change of the mean velocity within a step
    statistical: float | None  #: of a diffusion coefficient from the whole run
    assumptions: str  #: of both, in one line

    @property
    def lowest(self):
        """What the hydrodynamic error has to stay below; None if nothing limits it."""
        return min((x for x in (self.timeStep, self.statistical) if x is not None), default=None)


class Recommendation(NamedTuple):
    tolerance: float | None  #: None if no measured tolerance is good enough
    reason: str


def recommend(errors, limits):
    """`Recommendation`: the loosest tolerance whose error is below the time-step error and the statistical error.

    errors  {tolerance: hydrodynamic error}
    """
    if limits.lowest is None:
        return Recommendation(None, "no recommendation: there are neither noise nor forces, nothing else is in error")
    parts = [(limits.timeStep, "time-step"), (limits.statistical, "statistical")]
    binding = next(name for value, name in parts if value == limits.lowest)
    good = [tolerance for tolerance, error in errors.items() if error <= limits.lowest]
    if good:
        best = max(good)
        return Recommendation(
            best, f"{best:g}: its error {errors[best]:.1e} is below the {binding} error {limits.lowest:.1e}"
        )
    tightest = min(errors)
    return Recommendation(
        None,
        f"none of those measured: even at {tightest:g} the error {errors[tightest]:.1e} is above the {binding} error "
        f"{limits.lowest:.1e}; measure tighter tolerances, or accept that hydrodynamics limit the accuracy",
    )


def estimate(scene, runLength, correlationTime=None):
    """`Limits` of a run of `runLength` steps that starts as the scene is.

    correlationTime  ps after which displacements of a particle count as independent; default: a^2/D0
    """
    statistical, sentence = _statisticalError(scene, runLength, correlationTime)
    timeStep = timeStepError(scene)
    return Limits(
        timeStep,
        statistical,
        "time-step error: change of mean drift and mobility within a step, to first order, at the given positions; "
        + sentence,
    )


def timeStepError(scene):
    """Relative change of the mean velocity that is due to the size of the step, to first order in it.

    One step of size dt moves particles by u(x0) dt on average, u = M f; two steps of dt/2 by u(x0) dt/2 + <u(x1)> dt/2,
    <> the mean over the noise of the first. Weak order 1 makes the error of dt twice the difference of both:
    |<u(x1)> - u(x0)|/|u(x0)|. Noise enters in antithetic pairs, which cancels what is odd in it, and the square of the
    mean is estimated by products of different pairs. The larger of two values: with the forces of the System, and with
    fixed random forces (the change of M alone). None at temperature 0 without forces.
    """
    tolerance = PROBE_TOLERANCE if scene.count <= LARGE else PROBE_TOLERANCE_LARGE
    probe = scene.probe(tolerance, exact=True)
    fixed = np.random.default_rng(5).normal(size=scene.positions.shape)
    start = [probe.velocities(probe.forces()), probe.velocities(fixed)]
    drift = 0.5 * scene.stepSize * start[0]
    if scene.thermalEnergy > 0:
        pairs = int(np.clip(np.ceil(ENOUGH / scene.count), 2, 32))
        kicks = np.sqrt(0.5) * probe.displacements(pairs)
    else:
        kicks = np.zeros((1, *drift.shape))
    changes = [[], []]
    for kick in kicks:
        ends = [_velocitiesAt(probe, drift + sign * kick, fixed) for sign in ((1, -1) if np.any(kick) else (0,))]
        for i in range(2):
            changes[i].append(np.mean([end[i] for end in ends], axis=0) - start[i])
    lengths = [np.linalg.norm(u) for u in start]
    values = [meanLength(change) / length for change, length in zip(changes, lengths) if length > 0]
    return max(max(values), RESOLUTION) if np.any(kicks) or lengths[0] > 0 else None


def _velocitiesAt(probe, shift, fixed):
    """M f after a shift (count, 3) in nm, for the forces there and for fixed ones."""
    positions = probe.scene.positions.copy()
    positions[probe.scene.mobile] += shift
    probe.place(positions)
    return probe.velocities(probe.forces()), probe.velocities(fixed)


def meanLength(samples):
    """Length of the mean of noisy vectors, free of the bias of the noise, or its standard error if that is larger."""
    samples = np.reshape(samples, (len(samples), -1))
    count = len(samples)
    if count == 1:
        return float(np.linalg.norm(samples[0]))
    products = (samples.sum(axis=0) ** 2 - (samples**2).sum(axis=0)) / (count * (count - 1))
    error = np.sqrt(products.size) * products.std()
    return float(np.sqrt(max(products.sum(), error)))


def _statisticalError(scene, runLength, correlationTime):
    """(relative error, sentence) of the diffusion coefficient averaged over the whole run and all particles."""
    if scene.thermalEnergy == 0:
        return None, "no statistical error: temperature 0"
    diffusion = scene.thermalEnergy * scene.freeMobility
    natural = scene.radius**2 / diffusion
    time = natural if correlationTime is None else correlationTime
    independent = max(1.0, runLength * scene.stepSize / max(time, scene.stepSize))
    components = independentComponents(scene)
    name = "a^2/D0 = " if correlationTime is None else ""
    return statisticalError(components, independent), (
        f"statistical error: that of the diffusion coefficient from all displacements of a run of {runLength} steps, "
        f"independent after {name}{time:.3g} ps, {components:.0f} of {3 * scene.count} components "
        "independent at one time"
    )


def statisticalError(components, times):
    """Relative standard error of a mean square from components times `times` independent normal numbers."""
    return float(np.sqrt(2 / (components * times)))


def independentComponents(scene):
    """(tr M)^2/tr M^2: as many independent displacements are as uncertain in their mean square as the 3 N of M."""
    probe = scene.probe(1e-3, thermal=False)
    generator = np.random.default_rng(6)
    vectors = int(np.clip(np.ceil(300 / scene.count), 1, 300))
    trace = square = 0.0
    for _ in range(vectors):
        forces = generator.normal(size=scene.positions.shape)
        velocities = probe.velocities(forces)
        trace += np.sum(velocities * forces[scene.mobile]) / vectors
        square += np.sum(velocities**2) / vectors
    return trace**2 / square
