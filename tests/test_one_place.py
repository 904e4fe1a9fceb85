# SPDX-License-Identifier: MIT
"""
All spheres at one place, which may be the worst between grid points: what a grid errs by has no mean
there, and must keep the contract of setErrorTolerance() all the same, for few spheres.
"""
import itertools

import numpy as np
import pytest

import scenes
from openmmpse import PSEBrownianIntegrator
from platformnames import allServed
from scenes import Scene, errorRatio, makeContext

RADIUS = 0.5
BOXES = {"narrow": scenes.cube(6*RADIUS), "cube": scenes.cube(12*RADIUS), "tilted": scenes.tilted(20*RADIUS)}
TOLERANCES = (1e-2, 1e-4, 1e-5)
# model, split, radii of every other sphere over the others
FAMILIES = {"automatic": ("RotnePragerYamakawa", "AutomaticSplit", 1),
            "Hasimoto": ("RotnePragerYamakawa", "Hasimoto", 1),
            "unequal": ("RotnePragerYamakawa", "AutomaticSplit", 2),
            "unequal, Hasimoto": ("RotnePragerYamakawa", "Hasimoto", 2),
            "Gaussian envelopes": ("ForceCoupling", "AutomaticSplit", 1),
            "Gaussian envelopes, waves alone": ("ForceCoupling", "AllWaves", 1)}
# Of a cell of the grid, which is fixed in the box: where a sum of three cosines is largest and smallest.
CORNERS = [np.array(corner) for corner in ((0, 0, 0), (0.5, 0.5, 0.5))]


def configure(family):
    model, split, _ = FAMILIES[family]

    def set(integrator):
        integrator.setMobilityModel(getattr(PSEBrownianIntegrator, model))
        integrator.setSplit(getattr(PSEBrownianIntegrator, split))
    return set


def mobilityOf(family, scene):
    """The exact one (3N,3N): of the oracle, or, of Gaussian envelopes, of a tight sum over waves."""
    if FAMILIES[family][0] == "RotnePragerYamakawa":
        return scene.mobility
    _, integrator = makeContext(scene, "Reference", tolerance=1e-9, configure=configure(family))
    return scenes.mobilityColumns(integrator, scene.count)


def failuresAtTheWorstPlace(platformName, family, pair, of, kind, tolerance):
    """
    What errs by more than the tolerance, in words.

    pair  one sphere of each kind
    of    (2, 3, 2, 3) the exact mobility of the pair
    kind  (N,) of each sphere
    """
    count = len(kind)
    M = of[kind][:, :, kind].reshape(3*count, 3*count)
    radii = None if pair.radii is None else pair.radii[kind]
    scene = Scene(np.zeros((count, 3)), pair.box, pair.radius, radii)
    context, integrator = makeContext(scene, platformName, tolerance=tolerance, configure=configure(family))
    grid = np.array(integrator.getNumericalParameters()["gridDimensions"])
    failures = []
    for corner in CORNERS:
        context.setPositions(np.tile((1 + corner)/grid @ pair.box, (count, 1)))
        for forces in (scenes.uniformForces(scene), scenes.randomForces(scene)):
            exact = (M @ forces.ravel()).reshape(-1, 3)
            error = errorRatio(integrator.applyMobility(forces), exact, forces, scene)/tolerance
            if not error <= 1:
                failures.append(f"{count} at {tolerance:g}, {corner}: {error:.2f} tolerances")
    return failures


def pairOf(family, ratio, box):
    """And its exact mobility (2, 3, 2, 3)."""
    pair = Scene(np.zeros((2, 3)), box, RADIUS, None if ratio == 1 else np.array([ratio, 1])*RADIUS)
    return pair, mobilityOf(family, pair).reshape(2, 3, 2, 3)


@pytest.mark.hostOnly
@pytest.mark.withGrid
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("box", BOXES)
def testAtTheWorstPlaceBetweenGridPoints(platformName, box, family):
    """Uniform and random forces."""
    ratio = FAMILIES[family][2]
    pair, of = pairOf(family, ratio, BOXES[box])
    failures = []
    for count, tolerance in itertools.product((1, 7), allServed(platformName, TOLERANCES)):
        if count > 1 or ratio == 1:
            failures += failuresAtTheWorstPlace(platformName, family, pair, of, np.arange(count) % 2, tolerance)
    assert not failures, "; ".join(failures)


@pytest.mark.hostOnly
@pytest.mark.withGrid
@pytest.mark.parametrize("family", ["unequal", "unequal, Hasimoto"])
@pytest.mark.parametrize("ratio, edge", [(1.3, 2.5), (2, 2.2), (4, 5), (4, 7), (10, 2.2), (10, 2.5)])
def testUnequalSpheresInANarrowBox(platformName, ratio, edge, family):
    """
    Few modes and images, whose errors add up, up to single precision's end.

    edge  of the box, in radii of the larger sphere
    """
    pair, of = pairOf(family, ratio, scenes.cube(edge*ratio*RADIUS))
    failures = []
    for kind, tolerance in itertools.product(([0, 1], [0, 1, 0], [0, 1, 1, 1]),
                                             allServed(platformName, (1e-3, 1e-5, 1e-6, 1e-7))):
        failures += failuresAtTheWorstPlace(platformName, family, pair, of, np.array(kind), tolerance)
    assert not failures, "; ".join(failures)
