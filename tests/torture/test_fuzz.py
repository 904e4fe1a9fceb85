# SPDX-License-Identifier: MIT
"""
Random scenes and random calls against the Reference platform and direct sums: what must hold is in
tests/lockstep.py, what is drawn in tests/randomscenes.py. A scene that failed once is kept by name.
"""
import hypothesis
import numpy as np
import pytest
from scipy import stats

from hardcases import SPLIT_OVER
from lockstep import Lockstep, Refused
from platformnames import familyOf, precisionOf, served
from randomscenes import RandomScene, randomScenes
from scenes import FALSE_ALARM

# Scenes on each family of platforms; of a device each needs programs of its own.
SHORT = {"Reference": 25, "CPU": 72}
LONG = {"Reference": 500, "CPU": 1400}
SHORT_DEVICE, LONG_DEVICE = 3, 40
SHORT_CHUNKS, LONG_CHUNKS = 2, 8 # that processes share
REFUSED = 0.1 # of all scenes, at most

# Scenes that something was wrong with.
KEPT = {
    "unequal Gaussian envelopes at one place": RandomScene(
        seed=54124, count=46, model="ForceCoupling", boundary="Unbounded", phi=0.1894, places="one place",
        kinds=0, ratio=6.817, massless=4, radius=10.36, temperature=3000.0, tolerance=6.236e-06,
        size=0.01034, calls=(("samples", 2), ("checkpoint", 2))),
    "unequal spheres at one place": RandomScene(
        seed=54124, count=46, boundary="Unbounded", phi=0.1894, places="one place", kinds=0, ratio=6.8,
        tolerance=6.236e-06, size=0.01034, calls=(("samples", 2),)),
    "a real half that needs many iterations": RandomScene(
        seed=25026, count=36, model="ForceCoupling", split="Prolate", phi=0.03034, edges=(1.664, 0.7475),
        places="chain", tolerance=0.002921, size=6.019e-07, strain=0.397, calls=(("places", 43989),)),
    "positions set between a restart and a sheared step": RandomScene(
        seed=50334, count=51, model="FreeDraining", phi=0.001324, tilts=(1.0, 1.0, -1.0), places="droplet",
        temperature=0.0, size=4.467e-05, repulsion=True, strain=0.241,
        calls=(("step", 1), ("checkpoint", 1), ("places", 6))),
    "waves of unequal spheres in a box that moves, up to the end of the window": RandomScene(
        seed=14445, count=35, split="Hasimoto", phi=0.05225, edges=(2.072, 3.514), tilts=(0.0, 0.31, -1.0), kinds=5,
        ratio=5.423, massless=15, radius=2.802, viscosity=1.161, tolerance=4.237e-05, bonds=True, repulsion=True,
        wrapped=False, strain=-0.336, protocol="StartUpShear", calls=(("samples", 2),)),
    "a State of positions in other images of the box": RandomScene(
        seed=59483, count=34, images=3, kinds=3, ratio=5.48, radius=0.1927, viscosity=573000.0, temperature=0.0,
        tolerance=4.188e-06, size=4.467e-06, bonds=True, repulsion=True, strain=0.266, calls=(("xml",),)),
    "seven Gaussian envelopes at the worst place between grid points": RandomScene(
        seed=60573, count=7, model="ForceCoupling", split="AllWaves", phi=0.01087, places="one place",
        tolerance=0.0001964, strain=0.385),
}
# The same, of what is decided on hosts.
KEPT_ON_HOSTS = {
    "a Plan of CPU for unequal spheres in a tilted box that moves": RandomScene(
        seed=12254, split="Hasimoto", phi=2.085, edges=(3.589, 0.3911), tilts=(-0.63, 1.0, -1.0), places="chain",
        kinds=0, ratio=8.385, radius=2.792, temperature=0.0, tolerance=0.002284, size=0.07786, repulsion=True,
        wrapped=False, strain=-0.269, protocol="OscillatoryShear",
        calls=(("box", 0.938, 0.34), ("stress",), ("parameter", 0.191))),
    "a State saved in a box that the prescribed Plan does not fit": RandomScene(
        count=37, phi=0.003671, edges=(1.344, 2.065), bonds=True, repulsion=True, strain=0.353,
        calls=(("rate", 0.0), ("box", 1.035, 0.307), ("xml",), ("remake", 2.572e-06, 1.5))),
    "a box set after a checkpoint of a Context without steps": RandomScene(
        seed=16112, count=33, phi=0.006342, edges=(1.418, 0.8162), places="chain", massless=7, tolerance=1.315e-06,
        size=1.149e-05, repulsion=True, calls=(("stress",), ("checkpoint", 1), ("box", 0.984, 0.128))),
    "a list of neighbours begun between a checkpoint and its return": RandomScene(
        seed=36054, boundary="Unbounded", places="chain", size=0.002227, repulsion=True,
        calls=(("step", 3), ("checkpoint", 2), ("step", 4))),
    "a box set before a copy of what was made for another temperature": RandomScene(
        phi=0.02941, edges=(0.5449, 1.376), kinds=2, ratio=5.627, temperature=0.0, tolerance=0.001752, size=0.7536,
        calls=(("reinitialize", False), ("temperature", 2.0), ("samples", 1), ("box", 0.96, 0.042), ("xml",))),
}

ONE_PLACE = dict(seed=5, count=20, places="one place", pull=2.0, calls=(("samples", 1), ("checkpoint", 1)))
# Scenes at the ends of what effects allow.
CHOSEN = {
    "unequal spheres at one place": RandomScene(**ONE_PLACE, kinds=3, ratio=4.0),
    "a hundred to one at one place": RandomScene(**ONE_PLACE, kinds=2, ratio=100.0, tolerance=1e-2),
    "Gaussian envelopes at one place": RandomScene(**ONE_PLACE, model="ForceCoupling"),
    "unbounded, at one place": RandomScene(**ONE_PLACE, boundary="Unbounded"),
    "unbounded Gaussian envelopes of many sizes at one place": RandomScene(
        **ONE_PLACE, model="ForceCoupling", boundary="Unbounded", kinds=0, ratio=10.0),
    "unbounded, a million radii apart": RandomScene(
        seed=6, boundary="Unbounded", phi=1e-15, kinds=2, ratio=3.0, pull=2.0, calls=(("samples", 1),)),
    "a thousand strains in a step": RandomScene(seed=7, strain=1000.3, pull=2.0, calls=(("step", 3),)),
    "a thousand strains in a step, unequal spheres": RandomScene(
        seed=7, strain=-1000.3, kinds=3, ratio=4.0, pull=2.0, calls=(("step", 3),)),
    "a thousand strains in a step, unbounded": RandomScene(
        seed=7, strain=1000.3, boundary="Unbounded", wrapped=False, pull=2.0, calls=(("step", 3),)),
    "a trillionth of a strain in a step": RandomScene(
        seed=8, model="ForceCoupling", strain=1e-12, repulsion=True, calls=(("step", 3), ("rate", -1.0))),
}


def pytest_generate_tests(metafunc):
    if SPLIT_OVER in metafunc.fixturenames:
        chunks = LONG_CHUNKS if metafunc.config.getoption("long") else SHORT_CHUNKS
        metafunc.parametrize(SPLIT_OVER, [f"{number}/{chunks}" for number in range(1, chunks + 1)])


def numberOfScenes(config, platformName, chunk):
    """Of a chunk; those of all chunks add up to what was asked for."""
    long = config.getoption("long")
    count = config.getoption("fuzz_scenes") or (LONG if long else SHORT).get(
        familyOf(platformName), LONG_DEVICE if long else SHORT_DEVICE)
    number, chunks = map(int, chunk.split("/"))
    return count*number//chunks - count*(number - 1)//chunks


def seedOf(seed, chunk):
    return int(np.random.SeedSequence([seed, *map(int, chunk.split("/"))]).generate_state(1)[0])


def testRandomScenes(platformName, chunk, hardCase, request):
    """
    Random scenes (1 to 60 spheres, equal, of few or of many radii up to 1:10, volume fractions from
    3e-4 to 3, any tilt, every model, boundary, split and shear protocol, Forces of all kinds, viscosities,
    radii, temperatures, tolerances and steps over decades) under random calls: steps, positions, boxes,
    settings, checkpoints, XML, new Contexts, samples, stresses, and what is to be refused.

    M f within the tolerance of direct sums or of Reference, each step within the sum of both errors and
    that of the noise; the same to the bit when steps are taken one by one or repeated; nothing but finite
    numbers; else a refusal with a number and a remedy that leaves the state as it was.
    """
    refused, double = [], 0
    seed = request.config.getoption("fuzz_seed")
    count = numberOfScenes(request.config, platformName, chunk)

    @hypothesis.seed(seedOf(seed, chunk))
    @hypothesis.settings(max_examples=count, database=None, deadline=None, print_blob=False,
                         phases=(hypothesis.Phase.generate, hypothesis.Phase.shrink),
                         suppress_health_check=list(hypothesis.HealthCheck))
    @hypothesis.given(randomScenes)
    def hold(scene):
        nonlocal double
        double += precisionOf(platformName, served(platformName, scene.tolerance)) == "double"
        try:
            lockstep = Lockstep(scene, platformName)
        except Refused as refusal:
            refused.append(refusal)
            return
        try:
            lockstep.run()
        except Refused as refusal:
            refused.append(refusal)
        hardCase.measure(**{f"{what}/allowed": ratio for what, ratio in lockstep.measured.items()})

    if count > 0:
        hold()
    hardCase.measure(seed=seed)
    hardCase.add(scenes=count, **{"in double precision": double, "scenes refused": len(refused)})
    assert len(refused) <= stats.binom.isf(FALSE_ALARM, count, REFUSED)


@pytest.mark.parametrize("name", CHOSEN)
def testScenesAtTheEnds(platformName, name, hardCase):
    """
    All spheres at one place, unequal, as Gaussian envelopes and without a boundary; a million radii
    apart; a thousand strains in a step and a trillionth of one.

    The same, and none of them is refused.
    """
    lockstep = Lockstep(CHOSEN[name], platformName)
    lockstep.run()
    hardCase.measure(**{f"{what}/allowed": ratio for what, ratio in lockstep.measured.items()})


@pytest.mark.parametrize("name", KEPT)
def testScenesThatFailedOnce(platformName, name, hardCase):
    """
    Random scenes in which something was wrong once.

    The same, and none of them is refused.
    """
    lockstep = Lockstep(KEPT[name], platformName)
    lockstep.run()
    hardCase.measure(**{f"{what}/allowed": ratio for what, ratio in lockstep.measured.items()})


@pytest.mark.hostOnly
@pytest.mark.parametrize("name", KEPT_ON_HOSTS)
def testScenesThatFailedOnceOnHosts(platformName, name, hardCase):
    """
    Random scenes in which a Plan that one platform had chosen was refused, or a list of neighbours not the same.

    The same, and none of them is refused.
    """
    lockstep = Lockstep(KEPT_ON_HOSTS[name], platformName)
    lockstep.run()
    hardCase.measure(**{f"{what}/allowed": ratio for what, ratio in lockstep.measured.items()})
