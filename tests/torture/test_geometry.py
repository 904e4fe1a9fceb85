# SPDX-License-Identifier: MIT
"""Boxes of any shape and places anywhere: what is accurate in a cube is accurate there too."""
import numpy as np
import openmm
import pytest
from scipy.spatial import cKDTree

import scenes
from platformnames import allServed, isDevice
from scenes import errorOf, errorRatio, forceKinds, makeContext, stored

RADIUS = 0.5
TEMPERATURE = 300.0
TOLERANCES = (1e-2, 1e-4, 1e-7) # on CPU the last is in double precision


def check(case, scene, platformName, tolerances=TOLERANCES):
    """Errors within each tolerance, for all kinds of forces; a step with noise is finite."""
    for tolerance in allServed(platformName, tolerances):
        context, integrator = makeContext(scene, platformName, TEMPERATURE, tolerance=tolerance)
        here = stored(scene, context)
        for forces in forceKinds(scene).values():
            ratio = errorOf(integrator, forces, here)/tolerance
            case.measure(**{f"at {tolerance:g}: error/tolerance": float(ratio)})
            assert ratio <= 1
        integrator.step(2)
        assert np.all(np.isfinite(scenes.positionsOf(context)))


BOXES = {
    "5 a": scenes.cube(5*RADIUS), "2 a": scenes.cube(2*RADIUS), "a": scenes.cube(RADIUS),
    "1:1:8": scenes.elongated(4.2*RADIUS), "1:8:8": np.diag([4.2, 33.6, 33.6])*RADIUS,
    "largest tilt": scenes.tilted(9*RADIUS), "largest tilt, other sign": scenes.tilted(9*RADIUS, -1),
    "largest tilt of 1:1:8": np.diag([1, 1, 8.0])*5*RADIUS + np.array(
        [[0, 0, 0], [2.5, 0, 0], [2.5, 2.5, 0]])*RADIUS,
}


@pytest.mark.parametrize("name", BOXES)
def testBoxes(platformName, name, hardCase):
    """
    Eight spheres at random places (any overlap) in boxes from a wide to 1:8:8 and to the largest
    tilt in all three directions.

    Errors within the tolerance.
    """
    box = BOXES[name]
    places = np.random.default_rng(711).random((8, 3)) @ box
    check(hardCase, scenes.Scene(places, box, RADIUS), platformName)


@pytest.mark.onePrecision
def testCrowdInATinyBox(platformName, hardCase):
    """
    Thirty spheres at random places in a box of 1.3 a and a tolerance of 1e-5: each has thousands of neighbours,
    most of them images.

    Errors within the tolerance; single precision, in which they would not be, is not taken, and refused by name
    on a device that has no other.
    """
    box, tolerance = scenes.cube(1.3*RADIUS), 1e-5
    scene = scenes.Scene(np.random.default_rng(720).random((30, 3)) @ box, box, RADIUS)
    if isDevice(platformName) and not platformName.endswith("double"):
        with pytest.raises(openmm.OpenMMException, match="needs double precision") as caught:
            makeContext(scene, platformName, tolerance=tolerance)
        hardCase.measure(message=str(caught.value).partition(": ")[2])
        return
    _context, integrator = makeContext(scene, platformName, tolerance=tolerance)
    assert integrator.getNumericalParameters()["precision"] == "double"
    check(hardCase, scene, platformName, [tolerance])


def testFacesAndCorners(platformName, hardCase):
    """
    Spheres exactly on corners, edges and faces of a tilted box, and a rounding error beside them.

    Errors within the tolerance.
    """
    box = scenes.tilted(9*RADIUS)
    fractions = np.array([[0, 0, 0], [0.5, 0, 0], [1, 1, 0.5], [0, 0.5, 0.5], [0.25, 0.75, 1],
                          [-1e-16, 0.3, 0.6], [np.nextafter(1, 0), 0.6, 0.3], [0.5, 1e-300, -1e-300]])
    check(hardCase, scenes.Scene(fractions @ box, box, RADIUS), platformName)


@pytest.mark.parametrize("tolerance", TOLERANCES)
def testFarImages(platformName, tolerance, hardCase):
    """
    Spheres up to 1e6 lengths of a cube or of a box of the largest tilt from the origin.

    The error against the exact mobility at the positions that the Context holds is within the
    tolerance.
    """
    for shape in (scenes.cube(1), scenes.tilted(1)):
        home = scenes.randomSuspension(12, 0.1, shape, RADIUS, 712)
        images = np.random.default_rng(713).integers(-10**6, 10**6, (home.count, 3))
        far = home.moved(images @ home.box)
        context, integrator = makeContext(far, platformName, tolerance=tolerance)
        held = far.at(scenes.positionsOf(context))
        for forces in forceKinds(far).values():
            ratio = errorOf(integrator, forces, held)/tolerance
            hardCase.measure(**{"error/tolerance": float(ratio)})
            assert ratio <= 1


@pytest.mark.parametrize("count", [1, 2, 3])
def testFewSpheres(platformName, count, hardCase):
    """
    One, two and three spheres in boxes from 5 a to 1000 a.

    Errors within the tolerance.
    """
    for width in (5, 30, 1000):
        box = scenes.cube(width*RADIUS)
        places = np.random.default_rng(714).random((count, 3))*3*RADIUS
        check(hardCase, scenes.Scene(places, box, RADIUS), platformName, TOLERANCES[::2])


def testAllInOneCorner(platformName, hardCase):
    """
    All spheres in one corner of a box that is empty otherwise: a droplet at a local volume fraction
    of 0.45 and at 1 with overlaps, together at 0.002 of the box.

    Errors within the tolerance, although a plan is made for the mean density.
    """
    dense = scenes.denseSuspension(2, 0.45, RADIUS, 715)
    gas = scenes.idealGas(32, 1.0, scenes.cube(1), RADIUS, 716)
    for droplet in (dense, gas):
        box = scenes.cube((32*4*np.pi/3*RADIUS**3/0.002)**(1/3))
        check(hardCase, scenes.Scene(droplet.positions, box, RADIUS), platformName)


def nearestTo(positions, box, count):
    """Two groups of indices (count,): a sphere and those nearest to it, and those of the densest spot."""
    edge = box[0, 0]
    distances, groups = cKDTree(positions % edge, boxsize=edge).query(positions % edge, count)
    return groups[0], groups[np.argmin(distances[:, -1])]


@pytest.mark.withGrid
@pytest.mark.hostOnly
def testAMillionSpheres(platformName, hardCase):
    """
    One million spheres at independent uniform places (any overlap) and a volume fraction of 0.1 on CPU (in the
    short form 20,000).

    A step with noise ends, finite; forces on one sphere and the 19 nearest to it give these the velocities of
    the sums over all pairs and images to the tolerance of 1e-2, and so do forces in the densest spot of all.
    """
    count, tolerance = 10**6 if hardCase.long else 20000, 1e-2
    scene = scenes.idealGas(count, 0.1, scenes.cube(1), RADIUS, 717)
    context, integrator = makeContext(scene, platformName, TEMPERATURE, tolerance=tolerance, threads=None)
    integrator.step(1)
    hardCase.measure(spheres=count,
                     iterations=integrator.getNumericalParameters()["lanczosIterations"])
    assert np.all(np.isfinite(scenes.velocitiesOf(context)))
    positions = scenes.positionsOf(context)
    for name, group in zip(("anywhere", "densest spot"), nearestTo(positions, scene.box, 20)):
        forces = np.zeros((count, 3))
        forces[group] = np.random.default_rng(719).normal(size=(20, 3))
        few = scenes.Scene(positions[group], scene.box, RADIUS)
        apart = np.linalg.norm(scenes.nearestImages(few.positions[:, None] - few.positions, scene.box), axis=2)
        overlaps = np.count_nonzero(apart < 2*RADIUS) - 20
        assert overlaps > 0
        ratio = errorRatio(np.asarray(integrator.applyMobility(forces))[group], few.velocities(forces[group]),
                           forces[group], few)/tolerance
        hardCase.measure(**{f"{name}: overlapping pairs": overlaps//2, f"{name}: error/tolerance": float(ratio)})
        assert ratio <= 1
