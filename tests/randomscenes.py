# SPDX-License-Identifier: MIT
"""
Random scenes and sequences of calls, as hypothesis draws them: a RandomScene is written in a few
numbers that can be kept by hand, and makes from them whatever a Context needs.
"""
import dataclasses
import functools
from dataclasses import dataclass

import numpy as np
import openmm
from hypothesis import strategies as st

import oracle
import scenes
from openmmpse import PSEBrownianIntegrator
from platformnames import served

KINDS_OF_PLACES = ("uniform", "chain", "droplet", "one place")
SPLITS = {"RotnePragerYamakawa": ("AutomaticSplit", "Prolate", "Hasimoto"),
          "ForceCoupling": ("AutomaticSplit", "Prolate", "AllWaves"),
          "FreeDraining": ("AutomaticSplit",)}
PROTOCOLS = ("SteadyShear", "OscillatoryShear", "StartUpShear")
UNBOUNDED_ORACLES = {"RotnePragerYamakawa": oracle.freeSpaceScalars, "ForceCoupling": oracle.gaussianScalars}
LARGEST_PULL = 10.0 # kT/a


@dataclass(frozen=True)
class RandomScene:
    """
    What is not written here (places, directions of forces, which sphere has which radius) is drawn
    with `seed`. Particle 0 is never massless.
    """
    seed: int = 0
    count: int = 12
    model: str = "RotnePragerYamakawa"
    boundary: str = "Periodic"
    split: str = "AutomaticSplit"
    phi: float = 0.1                 # of all spheres in the box
    edges: tuple = (1.0, 1.0)        # by, cz in units of ax
    tilts: tuple = (0.0, 0.0, 0.0)   # bx, cx, cy in units of the largest
    places: str = "uniform"
    images: int = 0                  # how many boxes away particles may be
    kinds: int = 1                   # how many radii there are; 0: each particle has its own
    ratio: float = 1.0               # of the largest radius to the smallest
    massless: int = 0
    radius: float = 0.5              # the smallest, nm
    viscosity: float = scenes.ETA
    temperature: float = scenes.ROOM_TEMPERATURE
    tolerance: float = 1e-3
    size: float = 1e-3               # of a step, in a^2/D (D at room temperature if that is 0)
    pull: float = 0.0                # external forces, in kT/a
    bonds: bool = False
    repulsion: bool = False
    wrapped: bool = True             # bonds and repulsion use periodic boundary conditions
    strain: float = 0.0              # per step
    protocol: str = "SteadyShear"
    calls: tuple = ()

    def __repr__(self):
        """As it must be written to get it again, without what is as usual."""
        told = [f"{field.name}={getattr(self, field.name)!r}" for field in dataclasses.fields(self)
                if getattr(self, field.name) != field.default]
        return f"RandomScene({', '.join(told)})"

    # ------------------------------------------------------------ what it is

    @property
    def isPeriodicFluid(self):
        if self.model == "FreeDraining":
            return False
        return self.boundary == "Periodic" or self.boundary == "Automatic" and self.forcesArePeriodic

    @property
    def isUnboundedFluid(self):
        return self.model != "FreeDraining" and not self.isPeriodicFluid

    @property
    def forcesArePeriodic(self):
        return self.wrapped and (self.bonds or self.repulsion)

    @property
    def hasStress(self):
        return self.isPeriodicFluid or self.model == "FreeDraining" and self.forcesArePeriodic

    @functools.cached_property
    def radii(self):
        rng = np.random.default_rng([self.seed, 1])
        if self.kinds == 0:
            return self.radius*self.ratio**rng.random(self.count)
        return self.radius*np.geomspace(1, self.ratio, self.kinds)[rng.integers(0, self.kinds, self.count)]

    @functools.cached_property
    def masses(self):
        masses = np.full(self.count, 50.0)
        still = np.random.default_rng([self.seed, 2]).permutation(np.arange(1, self.count))[:self.massless]
        masses[still] = 0
        return masses

    @property
    def mobile(self):
        return self.masses > 0

    @functools.cached_property
    def box(self):
        bx, cx, cy = self.tilts
        by, cz = self.edges
        if self.strain != 0 and bx == 0:
            bx = 2e-3 # devices tilt no box that was made rectangular
        box = np.array([[1, 0, 0], [0.5*bx, by, 0], [0.5*cx, 0.5*cy*by, cz]])
        return scenes.scaledToVolume(box, 4*np.pi/3*np.sum(self.radii**3)/self.phi)

    @property
    def isTilted(self):
        return np.any(self.box != np.diag(np.diag(self.box)))

    def placesDrawn(self, seed):
        """Positions (N,3) in nm."""
        rng = np.random.default_rng([seed, 3])
        if self.places == "one place":
            positions = np.tile(rng.random(3) @ self.box, (self.count, 1))
        elif self.places == "chain":
            positions = scenes.chain(self.count, 1.5*self.radii.mean(), 1.0, 1.0, [seed, 4]).positions
        else:
            positions = rng.random((self.count, 3)) @ self.box
            if self.places == "droplet":
                positions *= min(1.0, (self.phi/0.5)**(1/3))
        return positions + rng.integers(-self.images, self.images + 1, (self.count, 3)) @ self.box

    # ------------------------------------------------------------ what it is made of

    @property
    def kT(self):
        """kJ/mol, that of room temperature if there is none."""
        return scenes.KB*(self.temperature or scenes.ROOM_TEMPERATURE)

    @property
    def largestMobility(self):
        return 1/(6*np.pi*self.viscosity*self.radii.min())

    @property
    def stepSize(self):
        return self.size*self.radii.min()**2/(self.kT*self.largestMobility)

    @property
    def rate(self):
        return self.strain/self.stepSize

    @property
    def stiffness(self):
        """Far below what an explicit step could not follow."""
        return float(min(50*self.kT/self.radii.min()**2, 0.02/(self.largestMobility*self.stepSize)))

    @property
    def reach(self):
        """Of the repulsion, nm: boxes may shrink by a quarter."""
        return float(min(2.2*self.radii.max(), 0.3*np.diag(self.box).min()))

    @property
    def largestForce(self):
        """At least that of a pair, in the repulsion (kJ/(mol nm))."""
        return 2*self.stiffness*self.reach if self.repulsion else 0.0

    def makeForces(self):
        forces = []
        if self.pull > 0:
            vectors = np.random.default_rng([self.seed, 5]).normal(size=(self.count, 3))
            pull = scenes.constantForces(vectors*self.pull*self.kT/self.radii.min())
            pull.setEnergyFunction("-strength*(fx*x+fy*y+fz*z)")
            pull.addGlobalParameter("strength", 1.0)
            pull.setForceGroup(1)
            forces.append(pull)
        if self.bonds:
            pairs = [(i, i + 1) for i in range(self.count - 1)]
            chain = scenes.harmonicBonds(pairs, 2*self.radii.min(), self.stiffness)
            chain.setUsesPeriodicBoundaryConditions(self.wrapped)
            chain.setForceGroup(2)
            forces.append(chain)
        if self.repulsion:
            push = openmm.CustomNonbondedForce(f"{self.stiffness!r}*step(s-r)*(s-r)^2; s={self.reach!r}")
            push.setNonbondedMethod(push.CutoffPeriodic if self.wrapped else push.CutoffNonPeriodic)
            push.setCutoffDistance(1.001*self.reach)
            for _ in range(self.count):
                push.addParticle([])
            forces.append(push)
        return forces

    def makeSystem(self, box=None):
        """In a default box that may be another one."""
        box = self.box if box is None else box
        return scenes.makeSystem(scenes.Scene(self.masses, box, self.radius), self.makeForces(), self.masses)

    def makeIntegrator(self, platformName, tolerance=None):
        I = PSEBrownianIntegrator
        made = I(self.temperature, self.viscosity, self.radius, self.stepSize)
        made.setMobilityModel(getattr(I, self.model))
        made.setFluidBoundary(getattr(I, self.boundary))
        made.setSplit(getattr(I, self.split))
        made.setErrorTolerance(served(platformName, tolerance or self.tolerance))
        made.setRandomNumberSeed(self.seed % 2**31 + 1)
        for i, radius in enumerate(self.radii):
            if radius != self.radius:
                made.setParticleRadius(i, float(radius))
        made.setShearRate(self.rate)
        made.setShearProtocol(getattr(I, self.protocol), 3.5*self.stepSize)
        return made

    # ------------------------------------------------------------ what must come out

    def mobility(self, positions, box):
        """The exact M of the mobile particles (3n,3n) by direct sums; None where nothing is summed."""
        here, radii = positions[self.mobile], self.radii[self.mobile]
        if self.isUnboundedFluid:
            return oracle.unboundedMobilityMatrix(here, radii, self.viscosity, UNBOUNDED_ORACLES[self.model])
        if self.model == "FreeDraining":
            return np.diag(np.repeat(1/(6*np.pi*self.viscosity*radii), 3))
        if self.model == "ForceCoupling":
            return oracle.forceCouplingMatrix(here, box, self.radius, self.viscosity)
        return oracle.mobilityMatrix(here, box, radii if self.ratio > 1 else self.radius, self.viscosity)


# ---------------------------------------------------------------- how they are drawn

def power(rng, low, high):
    """10 to a power in [low, high]."""
    return float(f"{10.0**rng.uniform(low, high):.4g}")


def number(rng, low, high):
    return round(float(rng.uniform(low, high)), 3)


def oneOf(rng, *choices):
    return choices[rng.integers(len(choices))]


CALLS = {
    "step": lambda rng: (int(rng.integers(1, 4)),),
    "places": lambda rng: (int(rng.integers(2**16)),),
    "box": lambda rng: (number(rng, 0.92, 1.1), number(rng, 0, 1)),
    "parameter": lambda rng: (number(rng, 0, 1),),
    "temperature": lambda rng: (oneOf(rng, 0.0, 0.5, 2.0),),
    "size": lambda rng: (oneOf(rng, 0.1, 0.5),),
    "rate": lambda rng: (oneOf(rng, 0.0, -1.0, 0.5),),
    "checkpoint": lambda rng: (int(rng.integers(1, 3)),),
    "xml": lambda rng: (),
    "remake": lambda rng: (power(rng, -6, -1), oneOf(rng, 1.0, 1.5)),
    "reinitialize": lambda rng: (bool(rng.integers(2)),),
    "samples": lambda rng: (int(rng.integers(3)),),
    "describe": lambda rng: (),
    "stress": lambda rng: (),
    "refused calls": lambda rng: (),
}
MOST_CALLS = 6


def drawnCall(rng):
    name = oneOf(rng, *CALLS)
    return name, *CALLS[name](rng)


def drawnScene(key):
    """The scene of a number: all that is drawn is drawn here."""
    rng = np.random.default_rng(key)
    model = oneOf(rng, *["RotnePragerYamakawa"]*3, "ForceCoupling", "FreeDraining")
    count = int(rng.integers(1, 61))
    return RandomScene(
        seed=int(rng.integers(2**16)), count=count, model=model,
        boundary=oneOf(rng, "Periodic", "Periodic", "Automatic", "Unbounded"), split=oneOf(rng, *SPLITS[model]),
        phi=power(rng, -3.5, 0.5), edges=oneOf(rng, (1.0, 1.0), (power(rng, -0.6, 0.6), power(rng, -0.6, 0.6))),
        tilts=oneOf(rng, (0.0, 0.0, 0.0), tuple(oneOf(rng, -1.0, -0.63, 0.0, 0.31, 1.0) for _ in range(3))),
        places=oneOf(rng, *KINDS_OF_PLACES), images=oneOf(rng, 0, 0, 1, 3), kinds=oneOf(rng, 1, 1, 1, 0, 2, 3, 5),
        ratio=power(rng, 0.05, 1), massless=oneOf(rng, 0, 0, int(rng.integers(count//2 + 1))),
        radius=oneOf(rng, 0.5, power(rng, -1.3, 1.7)), viscosity=oneOf(rng, scenes.ETA, power(rng, -2, 6)),
        temperature=oneOf(rng, *[scenes.ROOM_TEMPERATURE]*3, 0.0, 3.0, 3000.0),
        tolerance=power(rng, -6, -1), size=power(rng, -7, 0), pull=oneOf(rng, 0.0, number(rng, 0, LARGEST_PULL)),
        bonds=bool(rng.integers(2)), repulsion=bool(rng.integers(2)), wrapped=bool(rng.integers(2)),
        strain=oneOf(rng, 0.0, number(rng, -0.4, 0.4)), protocol=oneOf(rng, *PROTOCOLS),
        calls=tuple(drawnCall(rng) for _ in range(rng.integers(1, MOST_CALLS + 1))))


def simplified(scene, told):
    """Fields and calls whose byte is 0 are as usual, or left out: that is where hypothesis shrinks to."""
    fields = [field.name for field in dataclasses.fields(scene)]
    kept = {name: getattr(scene, name) for name, byte in zip(fields, told) if byte > 0 and name != "calls"}
    calls = tuple(call for call, byte in zip(scene.calls, told[len(fields):]) if byte > 0)
    return RandomScene(**kept, calls=calls)


def possible(scene):
    """The next one that asks for nothing that is refused whatever the numbers are."""
    if scene.kinds == 1 or scene.model == "ForceCoupling" and scene.isPeriodicFluid:
        scene = dataclasses.replace(scene, kinds=1, ratio=1.0)
    if scene.split not in SPLITS[scene.model]:
        scene = dataclasses.replace(scene, split="AutomaticSplit")
    if scene.boundary == "Unbounded" or not scene.wrapped:
        scene = dataclasses.replace(scene, images=0)
    if scene.places == "one place": # a pair force has no direction there, a bond that of rounding if images differ
        scene = dataclasses.replace(scene, repulsion=False, bonds=scene.bonds and scene.images == 0)
    return scene


NUMBERS_TOLD = len(dataclasses.fields(RandomScene)) + MOST_CALLS
randomScenes = st.builds(lambda key, told: possible(simplified(drawnScene(key), told)),
                         st.integers(0, 2**63 - 1), st.binary(min_size=NUMBERS_TOLD, max_size=NUMBERS_TOLD))
