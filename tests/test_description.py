# SPDX-License-Identifier: MIT
"""describe() lists every effect, on or off, with the reason."""
import openmm
import pytest

import scenes
from openmmpse import PSEBrownianIntegrator
from scenes import makeContext

pytestmark = pytest.mark.onePrecision
TILTED = scenes.randomSuspension(6, 0.05, scenes.tilted(1), 0.5, 303)


def linesOf(platformName, temperature=300.0, configure=None, forces=()):
    _, integrator = makeContext(TILTED, platformName, temperature, configure=configure, forces=forces)
    return integrator.describe().splitlines()


def testAPlainSuspension(platformName):
    lines = linesOf(platformName)
    assert ("hydrodynamic interactions: on (Rotne-Prager-Yamakawa, equal radii), because the mobility model is not "
            "FreeDraining") in lines
    assert "fluid: periodic in the box of the Context, as set by setFluidBoundary" in lines
    assert "thermal noise: on (seed 5), because the temperature of 300 K is above 0" in lines
    assert "shear flow: off, because the shear rate is 0" in lines


@pytest.mark.parametrize("protocol, time, words", [
    ("SteadyShear", 0, "(steady, the box tilts with it), because the shear rate"),
    ("OscillatoryShear", 40.0, "(oscillatory with period 40 ps, the box tilts with it), because the largest shear rate"),
    ("StartUpShear", 7.0, "(from time 7 ps on, the box tilts with it), because the shear rate")])
def testWhatIsSheared(platformName, protocol, time, words):
    def configure(i):
        i.setShearRate(0.1)
        i.setShearProtocol(getattr(PSEBrownianIntegrator, protocol), time)
    assert f"shear flow: on {words} of 0.1 /ps is not 0; strain so far 0" in linesOf(platformName, configure=configure)


def testWhatIsOff(platformName):
    lines = linesOf(platformName, 0.0, lambda i: i.setMobilityModel(PSEBrownianIntegrator.FreeDraining))
    assert ("hydrodynamic interactions: off, because the mobility model is FreeDraining: M = 1/(6 pi eta a)"
            in lines)
    assert "thermal noise: off, because the temperature is 0" in lines
    assert not any(line.startswith("fluid:") for line in lines)


def testABoxThatABarostatMoves(platformName):
    forces = [scenes.periodicDummyForce(TILTED.count, TILTED.box), openmm.MonteCarloBarostat(1.0, 300.0)]
    assert "box: moves, because the System has a MonteCarloBarostat" in linesOf(platformName, forces=forces)
