# SPDX-License-Identifier: MIT
"""
The Python face of the library: units, settings and their errors, numerical parameters, arrays.
Numbers in OpenMM's units: nm, ps, Da, kJ/mol, K.
"""

import math
import threading
import time

import numpy as np
import openmm
import pytest
from openmm import unit

from openmmpse import PSEBrownianIntegrator
from platformnames import contextOn, velocityRounding

pytestmark = pytest.mark.onePrecision

VISCOSITY = unit.dalton / (unit.nanometer * unit.picosecond)
PER_MOLE_FORCE = unit.kilojoule_per_mole / unit.nanometer
# name of the setting: its argument, a value with another unit, the value and unit that come back
QUANTITIES = {
    "Temperature": (
        "temperature",
        0.31 * unit.kilojoule / unit.joule * unit.kelvin,
        310.0,
        unit.kelvin,
    ),
    "Viscosity": ("viscosity", 1.002e-3 * unit.pascal * unit.second, 603.418504152, VISCOSITY),
    "Radius": ("radius", 4.84 * unit.angstrom, 0.484, unit.nanometer),
    "StepSize": ("size", 20 * unit.femtosecond, 0.02, unit.picosecond),
    "ShearRate": ("rate", 5 / unit.nanosecond, 0.005, unit.picosecond**-1),
    "SplittingParameter": ("xi", 0.25 / unit.angstrom, 2.5, unit.nanometer**-1),
}
KEYS = {
    "split",
    "xi",
    "realCutoff",
    "prolateBandwidth",
    "gridDimensions",
    "windowSupport",
    "windowShape",
    "lanczosTolerance",
    "lanczosIterations",
    "predictedError",
    "precision",
    "instructions",
    "randomSeed",
}


def makeIntegrator():
    return PSEBrownianIntegrator(300.0, 600.0, 0.5, 0.01)


def makeContext(
    platformName,
    count=4,
    integrator=None,
    box=5.0,
    forces=(),
    boundary=PSEBrownianIntegrator.Periodic,
):
    """Particles on a diagonal of a cubic box, and the integrator that moves them."""
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*(np.eye(3) * box))
    for _ in range(count):
        system.addParticle(1)
    for force in forces:
        system.addForce(force)
    integrator = integrator or makeIntegrator()
    integrator.setFluidBoundary(boundary)
    context = contextOn(platformName, system, integrator)
    context.setPositions(np.arange(count)[:, None] * [0.9, 0.8, 0.7])
    return context, integrator


# ---------------------------------------------------------------- settings and their units


@pytest.mark.parametrize("name", QUANTITIES)
def testQuantitiesAndPlainNumbers(name):
    _, quantity, value, expectedUnit = QUANTITIES[name]
    integrator = makeIntegrator()
    setter, getter = getattr(integrator, f"set{name}"), getattr(integrator, f"get{name}")
    for given in (quantity, value, np.float64(value)):
        setter(2 * value)
        setter(given)
        assert unit.is_quantity(getter())
        assert getter().unit == expectedUnit
        assert getter()._value == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("name", QUANTITIES)
@pytest.mark.parametrize("wrong", [3 * unit.coulomb, 3 * unit.nanometer**2, 3 * unit.dimensionless])
def testWrongDimension(name, wrong):
    argument, _, _, expectedUnit = QUANTITIES[name]
    integrator = makeIntegrator()
    before = getattr(integrator, f"get{name}")()
    with pytest.raises(TypeError) as error:
        getattr(integrator, f"set{name}")(wrong)
    assert argument in str(error.value) and str(expectedUnit) in str(error.value)
    assert getattr(integrator, f"get{name}")() == before


@pytest.mark.parametrize(
    "position, argument, expected",
    [
        (0, "temperature", "kelvin"),
        (1, "viscosity", "dalton"),
        (2, "radius", "nanometer"),
        (3, "stepSize", "picosecond"),
    ],
)
def testUnitsInTheConstructor(position, argument, expected):
    good = [
        300 * unit.kelvin,
        1e-3 * unit.pascal * unit.second,
        5 * unit.angstrom,
        10 * unit.femtosecond,
    ]
    integrator = PSEBrownianIntegrator(*good)
    assert integrator.getViscosity()._value == pytest.approx(602.214076, rel=1e-12)
    assert integrator.getRadius()._value == pytest.approx(0.5, rel=1e-12)
    assert integrator.getStepSize()._value == pytest.approx(0.01, rel=1e-12)
    for wrong in (1 * unit.coulomb, "1", None, [1, 2]):
        arguments = list(good)
        arguments[position] = wrong
        with pytest.raises(TypeError) as error:
            PSEBrownianIntegrator(*arguments)
        assert argument in str(error.value) and expected in str(error.value)


def testKeywordArguments():
    integrator = PSEBrownianIntegrator(temperature=300, viscosity=600, radius=0.5, stepSize=0.01)
    integrator.setParticleRadius(index=1, radius=0.6)
    assert integrator.getParticleRadius(index=1) == 0.6 * unit.nanometer


@pytest.mark.parametrize(
    "name, values, wrong",
    [
        (
            "MobilityModel",
            [
                PSEBrownianIntegrator.RotnePragerYamakawa,
                PSEBrownianIntegrator.ForceCoupling,
                PSEBrownianIntegrator.FreeDraining,
            ],
            3,
        ),
        (
            "FluidBoundary",
            [
                PSEBrownianIntegrator.Automatic,
                PSEBrownianIntegrator.Periodic,
                PSEBrownianIntegrator.Unbounded,
            ],
            3,
        ),
        (
            "Split",
            [
                PSEBrownianIntegrator.AutomaticSplit,
                PSEBrownianIntegrator.Prolate,
                PSEBrownianIntegrator.Hasimoto,
            ],
            -1,
        ),
        ("WindowSupport", [0, 3, 16], 17),
        ("RandomNumberSeed", [0, 1, -5, 2**31 - 1], None),
    ],
)
def testIntegerSettings(name, values, wrong):
    integrator = makeIntegrator()
    setter, getter = getattr(integrator, f"set{name}"), getattr(integrator, f"get{name}")
    for value in values + values[::-1]:
        setter(np.int64(value))
        assert getter() == value
    for notAnInteger in (1.5, "1", None):
        with pytest.raises(TypeError, match=str(notAnInteger)):
            setter(notAnInteger)
    if wrong is not None:
        with pytest.raises(openmm.OpenMMException, match=str(wrong)):
            setter(wrong)
    assert getter() == values[0]


def testErrorTolerance():
    integrator = makeIntegrator()
    assert integrator.getErrorTolerance() == 1e-3
    for tolerance in (1e-10, 1e-5, 1e-1):
        integrator.setErrorTolerance(tolerance)
        assert (
            type(integrator.getErrorTolerance()) is float
            and integrator.getErrorTolerance() == tolerance
        )
    with pytest.raises(TypeError, match="tolerance"):
        integrator.setErrorTolerance(1e-3 * unit.nanometer)


def testParticleRadii():
    integrator = makeIntegrator()
    integrator.setParticleRadius(np.int32(7), 9 * unit.angstrom)
    integrator.setParticleRadius(2, 0.25)
    assert integrator.getParticleRadii() == {2: 0.25 * unit.nanometer, 7: 0.9 * unit.nanometer}
    assert integrator.getParticleRadius(2) == 0.25 * unit.nanometer
    assert integrator.getParticleRadius(3) == integrator.getRadius() == 0.5 * unit.nanometer
    with pytest.raises(TypeError, match="radius.*nanometer"):
        integrator.setParticleRadius(2, 1 * unit.kelvin)
    with pytest.raises(TypeError, match="index.*1.5"):
        integrator.setParticleRadius(1.5, 1)


def testGridDimensions():
    integrator = makeIntegrator()
    assert integrator.getGridDimensions() == (0, 0, 0)
    integrator.setGridDimensions(20, np.int64(24), 30)
    assert integrator.getGridDimensions() == (20, 24, 30)
    with pytest.raises(TypeError, match="ny"):
        integrator.setGridDimensions(20, 24.5, 30)


@pytest.mark.parametrize(
    "call, value",
    [
        (lambda i: i.setTemperature(-1.25), "-1.25"),
        (lambda i: i.setTemperature(math.nan), "nan"),
        (lambda i: i.setViscosity(0), "0"),
        (lambda i: i.setViscosity(-2.5), "-2.5"),
        (lambda i: i.setViscosity(math.inf), "inf"),
        (lambda i: i.setRadius(0), "0"),
        (lambda i: i.setRadius(-0.25), "-0.25"),
        (lambda i: i.setRadius(math.nan), "nan"),
        (lambda i: i.setStepSize(0), "0"),
        (lambda i: i.setStepSize(-0.5), "-0.5"),
        (lambda i: i.setStepSize(math.inf), "inf"),
        (lambda i: i.setErrorTolerance(0.25), r"0\.25.*1e-10.*0\.1"),
        (lambda i: i.setErrorTolerance(5e-11), r"5e-11.*1e-10"),
        (lambda i: i.setErrorTolerance(math.nan), "nan"),
        (lambda i: i.setShearRate(math.inf), "inf"),
        (lambda i: i.setParticleRadius(-3, 1), "-3"),
        (lambda i: i.setParticleRadius(0, -0.75), "-0.75"),
        (lambda i: i.getParticleRadius(-4), "-4"),
        (lambda i: i.setSplittingParameter(-1.5), "-1.5"),
        (lambda i: i.setGridDimensions(20, 20, 0), "0"),
        (lambda i: i.setGridDimensions(20, -8, 20), "-8"),
        (lambda i: i.setWindowSupport(2), r"2.*3.*16"),
        (lambda i: i.setMobilityModel(9), "9"),
        (lambda i: PSEBrownianIntegrator(-5, 600, 0.5, 0.01), "-5"),
        (lambda i: PSEBrownianIntegrator(300, -7, 0.5, 0.01), "-7"),
        (lambda i: PSEBrownianIntegrator(300, 600, math.nan, 0.01), "nan"),
        (lambda i: PSEBrownianIntegrator(300, 600, 0.5, 0), "0"),
    ],
)
def testRangeErrorsNameTheValue(call, value):
    integrator = makeIntegrator()
    before = openmm.XmlSerializer.serialize(integrator)
    with pytest.raises(openmm.OpenMMException, match=f"PSEBrownianIntegrator: .*{value}"):
        call(integrator)
    assert openmm.XmlSerializer.serialize(integrator) == before


def testWhatActsAtOnceAndWhatIsFixed(platformName):
    context, integrator = makeContext(platformName)
    for setter, arguments in [
        ("setViscosity", [500]),
        ("setRadius", [0.6]),
        ("setParticleRadius", [0, 0.6]),
        ("setErrorTolerance", [1e-2]),
        ("setMobilityModel", [2]),
        ("setFluidBoundary", [0]),
        ("setSplit", [2]),
        ("setSplittingParameter", [3]),
        ("setGridDimensions", [8, 8, 8]),
        ("setWindowSupport", [6]),
        ("setRandomNumberSeed", [5]),
        ("setNumericalParameters", [{"xi": 2.0}]),
    ]:
        before = openmm.XmlSerializer.serialize(integrator)
        with pytest.raises(openmm.OpenMMException, match=setter):
            getattr(integrator, setter)(*arguments)
        assert openmm.XmlSerializer.serialize(integrator) == before
    integrator.setTemperature(0)
    integrator.setStepSize(0.02)
    integrator.step(1)
    assert context.getTime() == 0.02 * unit.picosecond


def testCallsBeforeAContextExists():
    integrator = makeIntegrator()
    for name, arguments in [
        ("step", [1]),
        ("applyMobility", [np.zeros((1, 3))]),
        ("sampleBrownianDisplacements", [1]),
        ("getNumericalParameters", []),
        ("describe", []),
    ]:
        with pytest.raises(openmm.OpenMMException, match=f"{name}.*Context"):
            getattr(integrator, name)(*arguments)


# ---------------------------------------------------------------- numerical parameters


def testNumericalParametersOfAContext(platformName):
    integrator = makeIntegrator()
    integrator.setRandomNumberSeed(11)
    _, integrator = makeContext(platformName, integrator=integrator)
    parameters = integrator.getNumericalParameters()
    assert set(parameters) == KEYS
    types = {
        "split": str,
        "precision": str,
        "instructions": str,
        "gridDimensions": tuple,
        "windowSupport": int,
        "lanczosIterations": int,
        "randomSeed": int,
    }
    assert all(type(value) is types.get(key, float) for key, value in parameters.items())
    assert bool(parameters["instructions"]) == (platformName == "CPU")
    assert parameters["split"] in ("Prolate", "Hasimoto") and parameters["randomSeed"] == 11
    assert (
        parameters["xi"] > 0
        and parameters["realCutoff"] > 0
        and min(parameters["gridDimensions"]) > 0
    )
    assert 0 < parameters["predictedError"] <= 1e-3


def testRequestedNumericalParameters():
    integrator = makeIntegrator()
    assert set(integrator.getRequestedNumericalParameters()) == KEYS
    integrator.setNumericalParameters(
        {
            "split": "Hasimoto",
            "xi": 2.5 / unit.nanometer,
            "realCutoff": 12 * unit.angstrom,
            "gridDimensions": [16, 18, 20],
            "windowSupport": 7,
            "windowShape": 11.5,
            "lanczosTolerance": 1e-3,
            "randomSeed": 3,
            "lanczosIterations": 4,
            "predictedError": 1e-3,
            "precision": "double",
            "instructions": "AVX2",
        }
    )
    requested = integrator.getRequestedNumericalParameters()
    assert requested["xi"] == 2.5 == integrator.getSplittingParameter()._value
    assert requested["realCutoff"] == pytest.approx(1.2)
    assert requested["gridDimensions"] == (16, 18, 20) == integrator.getGridDimensions()
    assert (
        requested["windowSupport"] == 7
        and requested["windowShape"] == 11.5
        and requested["lanczosTolerance"] == 1e-3
    )
    assert integrator.getSplit() == PSEBrownianIntegrator.Hasimoto
    assert integrator.getRandomNumberSeed() == 3
    integrator.setNumericalParameters({"split": "Prolate", "prolateBandwidth": 9.5})
    assert integrator.getRequestedNumericalParameters()["prolateBandwidth"] == 9.5
    assert integrator.getSplit() == PSEBrownianIntegrator.Prolate


@pytest.mark.parametrize(
    "parameters, error, message",
    [
        ({"xi": 2.0, "cutoff": 1.0}, ValueError, "cutoff"),
        ({"split": 3}, TypeError, "split.*3"),
        ({"gridDimensions": (8, 8)}, TypeError, r"gridDimensions.*\(8, 8\)"),
        ({"windowSupport": 6.5}, TypeError, r"windowSupport.*6\.5"),
        ({"xi": 2 * unit.nanometer}, TypeError, "xi"),
        ([1, 2], TypeError, "dict"),
        (None, TypeError, "dict"),
        ({"split": "Ewald"}, openmm.OpenMMException, "Ewald"),
        ({"prolateBandwidth": "9"}, TypeError, "prolateBandwidth"),
        ({"prolateBandwidth": -9.5}, openmm.OpenMMException, "-9.5"),
        ({"xi": -3.5}, openmm.OpenMMException, "-3.5"),
        ({"xi": 2.0, "realCutoff": -0.5}, openmm.OpenMMException, "-0.5"),
        ({"xi": 2.0, "lanczosTolerance": 7.5}, openmm.OpenMMException, "7.5"),
    ],
)
def testRefusedNumericalParametersChangeNothing(parameters, error, message):
    integrator = makeIntegrator()
    before = openmm.XmlSerializer.serialize(integrator)
    with pytest.raises(error, match=message):
        integrator.setNumericalParameters(parameters)
    assert openmm.XmlSerializer.serialize(integrator) == before


# ---------------------------------------------------------------- arrays


def testShapesAndTypesOfResults(platformName):
    _, integrator = makeContext(platformName)
    velocities = integrator.applyMobility(np.ones((4, 3)))
    assert (
        type(velocities) is np.ndarray
        and velocities.shape == (4, 3)
        and velocities.dtype == np.float64
    )
    velocities += 1  # writable, and nobody else's
    samples = integrator.sampleBrownianDisplacements(3)
    assert (
        type(samples) is np.ndarray and samples.shape == (3, 4, 3) and samples.dtype == np.float64
    )
    assert np.all(np.isfinite(samples)) and len(np.unique(samples)) == samples.size
    assert integrator.sampleBrownianDisplacements(0).shape == (0, 4, 3)
    with pytest.raises(openmm.OpenMMException, match="-2"):
        integrator.sampleBrownianDisplacements(-2)
    with pytest.raises(TypeError, match="2.5"):
        integrator.sampleBrownianDisplacements(2.5)


def testWhatForcesMayBe(platformName):
    context, integrator = makeContext(platformName)
    forces = np.arange(12.0).reshape(4, 3)
    expected = integrator.applyMobility(forces)
    assert np.abs(expected).max() > 0
    vectors = [openmm.Vec3(*row) for row in forces]
    for same in (
        forces.tolist(),
        vectors,
        forces.astype(int),
        forces.astype(np.float32),
        np.asfortranarray(forces),
        np.repeat(forces, 2, axis=0)[::2],
        unit.Quantity(forces, PER_MOLE_FORCE),
        unit.Quantity(vectors, PER_MOLE_FORCE),
    ):
        assert np.array_equal(integrator.applyMobility(same), expected)
    kilocalories = unit.Quantity(forces / 41.84, unit.kilocalorie_per_mole / unit.angstrom)
    piconewtons = unit.Quantity(forces / 0.602214076, unit.piconewton)
    for same in (kilocalories, piconewtons):
        assert integrator.applyMobility(same) == pytest.approx(
            expected, rel=max(1e-12, 10 * velocityRounding(platformName))
        )
    assert np.array_equal(forces, np.arange(12.0).reshape(4, 3))
    none = context.getState(forces=True).getForces(asNumpy=True)
    assert np.all(integrator.applyMobility(none) == 0)


@pytest.mark.parametrize(
    "forces, got",
    [
        (np.ones((3, 3)), r"\(3, 3\)"),
        (np.ones(12), r"\(12,\)"),
        (np.ones((4, 2)), r"\(4, 2\)"),
        (np.ones((1, 4, 3)), r"\(1, 4, 3\)"),
        (7.0, r"\(\)"),
        ([], r"\(0,\)"),
        ([[1, 2, 3], [1, 2]], r"\[\[1, 2, 3\], \[1, 2\]\]"),
        ("abc", "abc"),
        (None, "None"),
        ([["1", "2", "3"]] * 4, "'1'"),
        (np.ones((4, 3)) * 1j, "j"),
    ],
)
def testForcesOfTheWrongShapeOrKind(forces, got):
    _, integrator = makeContext("Reference")
    with pytest.raises(ValueError, match=rf"\(4, 3\).*{got}"):
        integrator.applyMobility(forces)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def testForcesThatAreNotFinite(bad):
    _, integrator = makeContext("Reference")
    forces = np.ones((4, 3))
    forces[2, 1] = forces[3, 0] = bad
    with pytest.raises(ValueError, match=f"particle 2.*{bad}"):
        integrator.applyMobility(forces)


def testForcesOfTheWrongDimension():
    _, integrator = makeContext("Reference")
    with pytest.raises(TypeError, match="forces.*nanometer.*kelvin"):
        integrator.applyMobility(unit.Quantity(np.ones((4, 3)), unit.kelvin))


# ---------------------------------------------------------------- threads of Python


@pytest.mark.parametrize("call", ["step", "sampleBrownianDisplacements"])
def testOtherThreadsRunDuringLongCalls(platformName, call):
    """While the GIL is held, a thread that sleeps between ticks can tick only at a call's ends."""
    _, integrator = makeContext(platformName)
    ticks, stop = 0, threading.Event()

    def tick():
        nonlocal ticks
        while not stop.is_set():
            ticks += 1
            time.sleep(1e-4)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        amount, during = 100, 0
        while during < 20 and amount < 1e6:
            before = ticks
            getattr(integrator, call)(amount)
            during = ticks - before
            amount *= 2
    finally:
        stop.set()
        thread.join()
    assert during >= 20


def testForcesComputedInPython(platformName):
    """A PythonForce needs the GIL that step() has released."""

    def pull(state):
        return 0 * unit.kilojoule_per_mole, np.tile([0, 0, 2.0], (4, 1)) * PER_MOLE_FORCE

    integrator = makeIntegrator()
    integrator.setTemperature(0)
    context, integrator = makeContext(
        platformName, integrator=integrator, forces=[openmm.PythonForce(pull)]
    )
    expected = integrator.applyMobility(np.tile([0, 0, 2.0], (4, 1)))
    integrator.step(1)
    velocities = context.getState(velocities=True).getVelocities(asNumpy=True)._value
    assert velocities == pytest.approx(expected, rel=1e-6, abs=1e-12)
