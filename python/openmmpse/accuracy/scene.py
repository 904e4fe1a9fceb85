# SPDX-License-Identifier: MIT
"""A user's scene, and Contexts of it at any tolerance."""

from __future__ import annotations

import copy
import time

import numpy as np
import openmm
from openmm import unit

from openmmpse import PSEBrownianIntegrator, plugins
from openmmpse.conversion import FORCE_UNIT, VISCOSITY_UNIT

LAST_GROUP = 30  #: force groups are bits of an int
LONG_STEP = 5.0  #: seconds; such steps are timed one at a time
MOST_FOR_REFERENCE = 2000  #: particles; direct sums over modes take seconds a step there
BOLTZMANN = (unit.BOLTZMANN_CONSTANT_kB * unit.AVOGADRO_CONSTANT_NA).value_in_unit(
    unit.kilojoule_per_mole / unit.kelvin
)
#: the names of splits as they are asked for and as getNumericalParameters() has them; an unbounded fluid has none
SPLITS = {"automatic": "AutomaticSplit", "Hasimoto": "Hasimoto", "Prolate": "Prolate", "AllWaves": "AllWaves",
          "none": "AutomaticSplit"}


class SceneError(ValueError):
    """A scene that cannot be measured; the text names the value, the limit and the remedy."""


class Scene:
    """What moves, where it is, and how: a System, positions in a box, the settings of an integrator, a platform.

    Parameters
    ----------
    system : openmm.System
    positions : array-like of shape (N, 3), or a Quantity of one
        in nm
    integrator : PSEBrownianIntegrator
        it is copied; its tolerance and numerical parameters are not used
    box : array-like of shape (3, 3), or a Quantity of one
        box vectors as rows (nm); default: those of the System
    platform : str
        name of an OpenMM platform that can run the integrator
    properties : dict
        platform properties, for example {"Threads": "2"}

    Raises
    ------
    SceneError
        for what cannot be measured
    """

    def __init__(self, system, positions, integrator, box=None, platform="CPU", properties=None):
        self.box = _box(system.getDefaultPeriodicBoxVectors() if box is None else box)
        self.positions = _positions(positions, system.getNumParticles())
        self.mobile = np.array([system.getParticleMass(i)._value > 0 for i in range(system.getNumParticles())])
        self.hasVirtualSites = any(system.isVirtualSite(i) for i in range(system.getNumParticles()))
        self.system, self.timingGroup = _prepared(system, self.box, self.mobile)
        self.platform, self.properties = _platform(platform), dict(properties or {})
        choosable = openmm.Platform.getPlatform(self.platform).getPropertyNames()
        self._double = {"Precision": "double"} if "Precision" in choosable else {}
        self._template = _template(integrator)
        #: numerical parameters that the user's integrator prescribes; measurements leave them automatic
        self.prescribed = _prescribed(self._template)
        self._template.setNumericalParameters({})
        if self._template.getRandomNumberSeed() == 0:
            self._template.setRandomNumberSeed(1)  # comparisons need the same noise in several Contexts
        self._check()

    @classmethod
    def ofContext(cls, context, platform=None, properties=None):
        """The scene of a Context with a PSEBrownianIntegrator, as it is now; the Context is left as it is."""
        state = context.getState(positions=True)
        name = context.getPlatform().getName()
        if platform in (None, name) and properties is None:
            names = context.getPlatform().getPropertyNames()
            properties = {key: context.getPlatform().getPropertyValue(context, key) for key in names}
        scene = cls(
            context.getSystem(),
            state.getPositions(asNumpy=True),
            context.getIntegrator(),
            state.getPeriodicBoxVectors(),
            platform or name,
            properties,
        )
        try:
            context.getState(forces=True)  # a State tells zeros where no positions have been set
        except openmm.OpenMMException as error:
            raise SceneError(
                f"no forces can be computed in this Context ({error}); set positions by Context.setPositions"
            ) from error
        return scene

    @property
    def count(self):
        """Number of particles that move."""
        return int(self.mobile.sum())

    @property
    def thermalEnergy(self):
        """kT in kJ/mol."""
        return BOLTZMANN * self._template.getTemperature().value_in_unit(unit.kelvin)

    @property
    def stepSize(self):
        """dt in ps."""
        return self._template.getStepSize().value_in_unit(unit.picosecond)

    @property
    def radius(self):
        """Hydrodynamic radius a of the first particle that moves, nm."""
        return self._template.getParticleRadius(int(np.argmax(self.mobile))).value_in_unit(unit.nanometer)

    @property
    def freeMobility(self):
        """1/(6 pi eta a), nm/ps per kJ/(mol nm)."""
        viscosity = self._template.getViscosity().value_in_unit(VISCOSITY_UNIT)
        return 1 / (6 * np.pi * viscosity * self.radius)

    def probe(self, tolerance, split="automatic", thermal=True, parameters=None, exact=False):
        """A `Probe` of this scene; numerical parameters are automatic but for those in a dict `parameters`.

        exact  in double precision, where the platform has a choice: to compare others with

        Raises openmm.OpenMMException for what the library refuses.
        """
        integrator = copy.copy(self._template)
        integrator.setErrorTolerance(tolerance)
        integrator.setSplit(getattr(PSEBrownianIntegrator, SPLITS[split]))
        if parameters:
            integrator.setNumericalParameters(parameters)
        if not thermal:
            integrator.setTemperature(0)
        return Probe(self, integrator, {**self.properties, **(self._double if exact else {})})

    @property
    def hasFluid(self):
        """Whether particles feel each other through the fluid."""
        return self._template.getMobilityModel() != PSEBrownianIntegrator.FreeDraining

    def requireFluid(self):
        """The scene itself. Raises SceneError where there is no hydrodynamic error to measure."""
        if not self.hasFluid:
            raise SceneError(
                "the integrator is set to FreeDraining, which has no hydrodynamic error; "
                "call setMobilityModel(PSEBrownianIntegrator.RotnePragerYamakawa)"
            )
        return self

    def _check(self):
        if self.count == 0:
            raise SceneError(
                f"none of the {len(self.mobile)} particles can move (all masses are 0); "
                "give a mass above 0 to those that do: its value does not matter"
            )
        if self.platform == "Reference" and self.count > MOST_FOR_REFERENCE:
            raise SceneError(
                f"{self.count} particles move, and platform Reference, which sums directly, is measured up to "
                f"{MOST_FOR_REFERENCE}; choose platform CPU"
            )


class Probe:
    """One Context of a scene."""

    def __init__(self, scene, integrator, properties):
        self.scene, self.integrator = scene, integrator
        platform = openmm.Platform.getPlatform(scene.platform)
        self.context = openmm.Context(scene.system, integrator, platform, properties)
        self.place(scene.positions)
        self._warm = False
        self._groups = integrator.getIntegrationForceGroups()
        if scene.timingGroup is not None:
            self._groups &= ~(1 << scene.timingGroup)
        integrator.setIntegrationForceGroups(self._groups)

    @property
    def parameters(self):
        return self.integrator.getNumericalParameters()

    def place(self, positions):
        """Set positions (N, 3) in nm, in the box of the scene; virtual sites go where they belong."""
        self.context.setPeriodicBoxVectors(*(openmm.Vec3(*row) for row in self.scene.box))
        self.context.setPositions(positions)
        if self.scene.hasVirtualSites:
            self.context.computeVirtualSites()

    def velocities(self, forces):
        """M f of the particles that move, (count, 3) in nm/ps, for forces (N, 3) in kJ/(mol nm)."""
        return self.integrator.applyMobility(forces)[self.scene.mobile]

    def velocitiesAt(self, positions, forces):
        """M f at positions (N, 3) in nm of the particles that move, for forces (count, 3) on them."""
        self.place(positions)
        everybody = np.zeros_like(self.scene.positions)
        everybody[self.scene.mobile] = forces
        return self.velocities(everybody)

    def forcesAt(self, positions):
        """Forces of the System at positions (N, 3) in nm on the particles that move, (count, 3) in kJ/(mol nm)."""
        self.place(positions)
        return self.forces()[self.scene.mobile]

    def run(self, positions, stepSize, steps):
        """Positions (N, 3) in nm after so many steps of stepSize (ps) from positions; None if the box has changed."""
        self.place(positions)
        self.integrator.setStepSize(stepSize)
        self.integrator.step(steps)
        state = self.context.getState(positions=True)
        same = np.allclose(_box(state.getPeriodicBoxVectors()), self.scene.box, rtol=1e-6, atol=0)
        return np.array(state.getPositions(asNumpy=True)._value) if same else None

    def displacements(self, count):
        """Brownian displacements of the particles that move, (count, n, 3) in nm."""
        return self.integrator.sampleBrownianDisplacements(count)[:, self.scene.mobile]

    def forces(self):
        """Forces of the System at the present positions, (N, 3) in kJ/(mol nm); zero where nothing moves."""
        state = self.context.getState(forces=True, groups=self._groups)
        values = np.array(state.getForces(asNumpy=True).value_in_unit(FORCE_UNIT))
        values[~self.scene.mobile] = 0
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if bad.size:
            raise SceneError(
                f"the force on particle {bad[0]} is {values[bad[0]]} kJ/(mol nm) at these positions; "
                "relax the scene first, for example by openmm.LocalEnergyMinimizer"
            )
        return values

    def secondsPerStep(self, seconds, withForces=True):
        """Wall-clock time of one step from the positions of the scene, over about `seconds`; 1 to 100 steps.

        withForces  whether the Forces of the System are evaluated; without them, the fluid does all its work for one
                    force on one particle. None if the System leaves no force group free for that.
        """
        if not withForces and self.scene.timingGroup is None:
            return None
        self.place(self.scene.positions)
        self.integrator.setIntegrationForceGroups(self._groups if withForces else 1 << self.scene.timingGroup)
        try:
            first = self._time(1)
            if not self._warm:
                self._warm, first = True, self._time(1)
            if first > LONG_STEP:
                return first
            steps = int(np.clip(seconds / first, 1, 100))
            return self._time(steps)
        finally:
            self.integrator.setIntegrationForceGroups(self._groups)

    def _time(self, steps):
        start = time.perf_counter()
        self.integrator.step(steps)
        return (time.perf_counter() - start) / steps


def sceneOf(source, positions=None, integrator=None, box=None, platform=None, properties=None):
    """A `Scene` from what `measure` and `tune` accept."""
    if isinstance(source, Scene):
        return source
    if isinstance(source, openmm.Context):
        return Scene.ofContext(source, platform, properties)
    if positions is None or integrator is None:
        raise TypeError(f"measuring a {type(source).__name__} needs positions and integrator; a Context needs neither")
    return Scene(source, positions, integrator, box, platform or "CPU", properties)


def checkNumbers(**numbers):
    """Raise ValueError for a number that is given and not positive and finite."""
    for name, value in numbers.items():
        if value is not None and not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} is {value}; it must be positive and finite")


def _positions(positions, expected):
    values = positions.value_in_unit(unit.nanometer) if unit.is_quantity(positions) else positions
    values = np.array(values, dtype=float)
    if values.shape != (expected, 3):
        raise SceneError(
            f"positions have shape {values.shape}, and the System has {expected} particles: ({expected}, 3) is "
            "expected; save the State from a Context of this System"
        )
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if bad.size:
        raise SceneError(f"the position of particle {bad[0]} is {values[bad[0]]} nm; it must be finite")
    return values


def _box(vectors):
    values = vectors.value_in_unit(unit.nanometer) if unit.is_quantity(vectors) else vectors
    return np.array([[float(getattr(x, "_value", x)) for x in getattr(v, "_value", v)] for v in values])


def _prepared(system, box, mobile):
    """(copy of the System, group): in that box, which parameters are chosen for, and with a Force to time with.

    That Force pulls on one particle and is alone in its group, so that a step with this group alone costs what the
    fluid costs: a step without any force would skip part of that. The group is None if the System uses all of them.
    """
    used = {force.getForceGroup() for force in system.getForces()}
    system = copy.deepcopy(system)
    system.setDefaultPeriodicBoxVectors(*(openmm.Vec3(*row) for row in box))
    group = next((g for g in range(LAST_GROUP, -1, -1) if g not in used), None)
    if group is not None and np.any(mobile):
        pull = openmm.CustomExternalForce("-x")
        pull.addParticle(int(np.argmax(mobile)), [])
        pull.setForceGroup(group)
        system.addForce(pull)
    return system, group


def _prescribed(integrator):
    """What an integrator prescribes instead of leaving it to the tolerance, as a dict."""
    requested = integrator.getRequestedNumericalParameters()
    known = ("xi", "realCutoff", "windowSupport", "windowShape", "lanczosTolerance", "gridDimensions")
    return {key: requested[key] for key in known if np.any(requested[key])}


def _platform(name):
    known = plugins.platforms()
    if name not in known:
        raise SceneError(f"platform {name!r} cannot run PSEBrownianIntegrator; choose one of {', '.join(known)}")
    return name


def _template(integrator):
    if not PSEBrownianIntegrator.isinstance(integrator):
        raise SceneError(
            f"the integrator is a {type(integrator).__name__}, and accuracy is measured for a PSEBrownianIntegrator; "
            "give one, or temperature, viscosity, radius and step"
        )
    return copy.copy(PSEBrownianIntegrator.cast(integrator))
