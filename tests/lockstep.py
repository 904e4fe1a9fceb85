# SPDX-License-Identifier: MIT
"""
Runs a RandomScene on a platform and holds every step against the Reference platform and against
direct sums. Three Contexts see the same calls: the subject, whose steps are taken as a user takes
them; its shadow on the same platform, whose steps are taken one by one, and which must agree with it
to the bit; and an oracle, which before each step is put to the place of the shadow, so that errors do
not add up. Bounds are those of the contract: `tolerance` for a product of one platform with the exact
mobility (3 times that for forces that are neither random nor uniform nor balanced), the sum of both for
two platforms, the root of the tolerance for the noise of a grid against that of sums over waves.
"""
import contextlib
import dataclasses
import re

import numpy as np
import openmm

import scenes
from openmmpse import PSEBrownianIntegrator
from platformnames import contextOn, coordinateRounding, isDevice, precisionOf, served, velocityRounding
from scenes import positionsOf

ANY_FORCES = 3                    # tolerances, for the worst forces there are
SINGLE, DOUBLE = 6e-8, 2.3e-16    # roundings
SINGLE_STRESS, DOUBLE_STRESS = 1e-4, 1e-8 # of the energy, [T47]
LARGEST_RATIO = 10.0              # of radii
DIRECT_SUMS = 20                  # mobile particles up to which there are direct sums
REMEDIES = ("use ", "set ", "loosen", "tighten", "give ", "choose", "larger", "smaller", "create ", "call ", "check ")
PLAN = ("split", "xi", "realCutoff", "prolateBandwidth", "gridDimensions", "windowSupport",
        "windowShape", "lanczosTolerance")
EVERYTHING = dict(positions=True, velocities=True, parameters=True, integratorParameters=True)


class Refused(Exception):
    """The platform refused, as it may, and said why, the limit, and what would help."""


@contextlib.contextmanager
def refusing():
    """Turns a refusal with a clear text into Refused."""
    try:
        yield
    except openmm.OpenMMException as refusal:
        text = str(refusal)
        assert any(c.isdigit() for c in text) and any(word in text for word in REMEDIES), f"unclear: {text}"
        raise Refused(text) from None


def roundingOfForces(platformName):
    """Of coordinates and energies that OpenMM's Forces are computed with."""
    return DOUBLE if platformName in ("Reference", "OpenCL-double", "CUDA-double") else SINGLE


class Party:
    """A Context and its integrator."""

    def __init__(self, platformName, system, integrator):
        self.platformName, self.integrator = platformName, integrator
        self.stepped = False # since the Context was made
        self.context = contextOn(platformName, system, integrator, 1)

    @property
    def box(self):
        return np.array(self.context.getState().getPeriodicBoxVectors()._value)

    @property
    def positions(self):
        return positionsOf(self.context)

    def condition(self):
        """What must be the same of the subject and its shadow."""
        state = self.context.getState(positions=True, velocities=True)
        return (state.getPositions(asNumpy=True)._value, state.getVelocities(asNumpy=True)._value,
                np.array(state.getPeriodicBoxVectors()._value), state.getTime()._value,
                state.getStepCount(), self.integrator.getStrain())

    def plan(self):
        parameters = self.integrator.getNumericalParameters()
        return {name: parameters[name] for name in PLAN}

    def put(self, positions, box):
        self.context.setPeriodicBoxVectors(*box)
        self.context.setPositions(positions)


def same(first, second):
    return all(np.array_equal(a, b) for a, b in zip(first, second))


class Lockstep:
    """A RandomScene on a platform; `measured` has the largest of each error over what it may be."""

    def __init__(self, scene, platformName):
        self.scene, self.platformName = scene, platformName
        self.settings = {"Temperature": scene.temperature, "StepSize": scene.stepSize, "ShearRate": scene.rate}
        self.measured = {}
        with refusing():
            self.subject = self.makeParty(platformName)
            self.shadow = self.makeParty(platformName)
        for party in (self.subject, self.shadow):
            party.context.setPositions(scene.placesDrawn(scene.seed))
        self.oracle = None

    # ------------------------------------------------------------ Contexts

    @property
    def tolerance(self):
        return served(self.platformName, self.scene.tolerance)

    @property
    def hasListsOfOpenMM(self):
        """
        OpenMM's lists of neighbours on CPU begin when it sees fit, and go on after a checkpoint: floats are
        added in another order.
        """
        return self.scene.repulsion and self.platformName == "CPU"

    @property
    def keepsImages(self):
        """
        Where a Force has a cutoff, OpenMM's devices wrap positions into the box when they are set: a State with
        positions outside of it comes back to rounding, that of floats in mixed precision, too.
        """
        return isDevice(self.platformName) and self.scene.repulsion and self.scene.wrapped

    def makeParty(self, platformName, plan=None, box=None):
        integrator = self.scene.makeIntegrator(platformName, self.tolerance)
        if plan is not None:
            integrator.setSplit(PSEBrownianIntegrator.AutomaticSplit)
            integrator.setNumericalParameters(plan)
        for name, value in self.settings.items():
            getattr(integrator, "set" + name)(value)
        return Party(platformName, self.scene.makeSystem(box), integrator)

    def remade(self, party, plan=None):
        """The same with the settings of now, in the same state."""
        state = party.context.getState(**EVERYTHING)
        if plan is not None: # not that of the State
            text = openmm.XmlSerializer.serialize(state)
            state = openmm.XmlSerializer.deserialize(re.sub("<PlannedBox[^>]*/>", "", text))
        made = self.makeParty(party.platformName, plan, self.shadow.box)
        made.context.setState(state)
        return made

    def meetOracle(self):
        """Outside of steps; a box that was set since the last one may need another Plan."""
        self.meetBox()
        self.followPlan()

    def followPlan(self):
        """The oracle has the same waves and the same range as the shadow."""
        plan = self.shadow.plan()
        with refusing(): # what is chosen freely for a box that moves may not be prescribed for one
            if self.oracle is None:
                self.oracle = self.makeParty("Reference", plan, self.shadow.box)
                self.oracle.context.setPositions(self.shadow.positions)
            elif plan != self.planOfOracle:
                self.oracle = self.remade(self.oracle, plan)
        self.planOfOracle = plan

    def run(self):
        """@raises Refused if the platform cannot serve the scene."""
        self.checkProducts()
        for name, *arguments in self.scene.calls:
            before = self.subject.condition()
            try:
                getattr(self, "call" + name.title().replace(" ", ""))(*arguments)
            except openmm.OpenMMException as refusal:
                raise AssertionError(f"{name}{tuple(arguments)}: {refusal}") from refusal
            except Refused:
                after = self.subject.condition()
                assert name == "step" or same(before, after), f"{name}{tuple(arguments)} left another state"
                raise
            self.compare(name)
        self.callStep(1)
        self.checkProducts()

    def compare(self, what):
        first, second = self.subject.condition(), self.shadow.condition()
        assert all(np.all(np.isfinite(value)) for value in first), f"not finite after {what}"
        assert same(first, second), f"not the same to the bit after {what}: {abs(first[0] - second[0]).max():g} nm"

    def hold(self, what, error, allowed):
        ratio = float(error/allowed) if allowed > 0 else (np.inf if error > 0 else 0.0)
        self.measured[what] = max(ratio, self.measured.get(what, 0.0))
        assert ratio <= 1, f"{what}: {error:g} is {ratio:.3g} of what it may be ({self.scene!r})"

    # ------------------------------------------------------------ products

    def both(self, method, *arguments):
        """What a method of both integrators returns, which is the same."""
        with refusing():
            first = np.array(getattr(self.subject.integrator, method)(*arguments))
        second = np.array(getattr(self.shadow.integrator, method)(*arguments))
        assert np.all(np.isfinite(first)), method
        assert np.array_equal(first, second), f"{method} is not the same to the bit"
        return first

    def ownMobilities(self):
        return np.where(self.scene.mobile, 1/(6*np.pi*self.scene.viscosity*self.scene.radii), 0)[:, None]

    def scaleOf(self, forces, velocities):
        """That of errors in the contract."""
        return max(np.linalg.norm(velocities), np.linalg.norm(self.ownMobilities()*forces))

    def exactProduct(self, positions, box):
        """M f by direct sums, as a function of forces; None where these would take long."""
        mobile = self.scene.mobile
        if np.count_nonzero(mobile) > DIRECT_SUMS and self.scene.isPeriodicFluid:
            return None
        M = self.scene.mobility(positions, box)

        def product(forces):
            velocities = np.zeros_like(forces)
            velocities[mobile] = (M @ forces[mobile].ravel()).reshape(-1, 3)
            return velocities
        return product

    def checkProducts(self):
        """M f for three kinds of forces against direct sums, or against Reference."""
        positions, box = self.shadow.positions, self.shadow.box
        here = scenes.Scene(positions, box, self.scene.radius)
        kinds = [np.where(self.scene.mobile[:, None], forces, 0)*self.scene.kT/self.scene.radius
                 for forces in scenes.forceKinds(here).values()]
        found = [self.both("applyMobility", forces) for forces in kinds]
        exactly = self.exactProduct(positions, box)
        if exactly is None:
            self.meetOracle()
            self.oracle.put(positions, box)
        for forces, velocities in zip(kinds, found):
            assert not np.any(velocities[~self.scene.mobile])
            if exactly is None:
                exact = self.oracle.integrator.applyMobility(forces)
            else:
                exact = exactly(forces)
            allowed = self.tolerance*(2 if exactly is None else 1)
            if self.scene.model == "FreeDraining":
                allowed = 10*velocityRounding(self.platformName)
            self.hold("product", np.linalg.norm(velocities - exact), allowed*self.scaleOf(forces, exact))

    # ------------------------------------------------------------ steps

    def callStep(self, count):
        with refusing():
            self.subject.integrator.step(count)
        for _ in range(count):
            self.singleStep()
        self.compare("step")

    def singleStep(self):
        start, box = self.shadow.positions, self.shadow.box
        self.shadow.integrator.step(1)
        self.shadow.stepped = True
        moved = self.shadow.positions - start
        self.followPlan()
        self.oracle.put(start, box)
        forces = scenes.forcesOf(self.oracle.context)*self.scene.mobile[:, None]
        drift = np.asarray(self.oracle.integrator.applyMobility(forces))
        exactly = self.exactProduct(start, box)
        if exactly is not None:
            exact = exactly(forces)
            self.hold("drift", np.linalg.norm(drift - exact), ANY_FORCES*self.tolerance*self.scaleOf(forces, exact))
        strained = self.oracle.integrator.getStrain()
        self.oracle.integrator.step(1)
        expected = self.oracle.positions - start
        strained = self.oracle.integrator.getStrain() - strained
        dt = self.settings["StepSize"]
        noise = expected - dt*drift
        noise[:, 0] -= strained*start[:, 1]*self.scene.mobile
        allowed = (2*ANY_FORCES*self.tolerance*self.scaleOf(forces, drift)*dt + self.allowedNoise(noise)
                   + self.allowedRounding(start, expected, box))
        self.hold("step", np.linalg.norm(moved - expected), allowed)
        assert np.allclose(self.shadow.box, self.oracle.box, rtol=1e-6, atol=1e-6*abs(box).max())

    def allowedNoise(self, noise):
        kT = scenes.KB*self.settings["Temperature"]
        typical = np.sqrt(6*kT*self.settings["StepSize"]*self.ownMobilities().sum())
        if self.scene.model == "FreeDraining":
            share = 10*velocityRounding(self.platformName)
        else:
            share = 2*self.tolerance if self.scene.isUnboundedFluid else np.sqrt(self.tolerance)
            if self.scene.places == "one place": # rounding of eigenvalues that are zero [T32]
                rounding = SINGLE if precisionOf(self.platformName, self.tolerance) != "double" else DOUBLE
                share += np.sqrt(rounding*self.scene.count)
        return share*max(np.linalg.norm(noise), typical) if kT > 0 else 0.0

    def allowedRounding(self, positions, moved, box):
        """Of coordinates, and of forces computed at rounded coordinates."""
        scene = self.scene
        farthest = abs(positions).max() + abs(moved).max() + abs(box).max()
        places = coordinateRounding(self.platformName)
        if isDevice(self.platformName) and scene.strain != 0:
            places = max(places, SINGLE) # OpenMM keeps images in floats
        pull = 5*scene.pull*scene.kT/scene.radii.min()
        stiffness = scene.stiffness*(2*scene.bonds + scene.count*scene.repulsion)
        ofForce = 8*roundingOfForces(self.platformName)*(stiffness*farthest + pull)
        if isDevice(self.platformName):
            ofForce += 2.0**-31
        numbers = np.sqrt(3*scene.count)
        largest = scene.count*self.ownMobilities().max()
        return numbers*(4*places*farthest + self.settings["StepSize"]*largest*ofForce)

    # ------------------------------------------------------------ calls

    def everyContext(self):
        parties = (self.subject, self.shadow, self.oracle)
        return [party for party in parties if party is not None]

    def callPlaces(self, seed):
        positions = self.scene.placesDrawn(seed)
        for party in (self.subject, self.shadow):
            party.context.setPositions(positions)

    def callBox(self, factor, tilt):
        box = self.shadow.box
        if 0.8 < np.diag(box*factor).min()/np.diag(self.scene.box).min() < 1.3:
            box *= factor
        if self.scene.isTilted:
            box[1, 0] = (tilt - 0.5)*box[0, 0]
        for party in (self.subject, self.shadow):
            party.context.setPeriodicBoxVectors(*box)

    def callParameter(self, value):
        self.meetOracle()
        for party in self.everyContext():
            if self.scene.pull > 0:
                party.context.setParameter("strength", value)

    def set(self, name, value):
        self.meetOracle()
        self.settings[name] = value
        for party in self.everyContext():
            getattr(party.integrator, "set" + name)(value)

    def callTemperature(self, factor):
        self.set("Temperature", factor*scenes.ROOM_TEMPERATURE)

    def callSize(self, factor):
        self.set("StepSize", factor*self.settings["StepSize"])

    def callRate(self, factor):
        self.set("ShearRate", factor*self.settings["ShearRate"])

    def callCheckpoint(self, steps):
        """Steps, back, the same steps again, and back."""
        subject = self.subject
        data = subject.context.createCheckpoint()
        self.shadow.context.createCheckpoint() # begins a list of neighbours, as that of the subject does
        before = subject.condition()
        with refusing():
            subject.integrator.step(steps)
        after = subject.condition()
        if self.hasListsOfOpenMM:
            subject.context.loadCheckpoint(data)
            subject.integrator.step(steps)
            first, after = after, subject.condition()
            rounding = 1e-6*(self.scene.radius + abs(first[0]).max())
            assert np.allclose(first[0], after[0], rtol=0, atol=rounding), "a checkpoint does not repeat the steps"
        for last in (False, True):
            subject.context.loadCheckpoint(data)
            assert same(before[2:], subject.condition()[2:]) and np.array_equal(before[0], subject.positions)
            if not last:
                subject.integrator.step(steps)
                assert same(after, subject.condition()), "a checkpoint does not repeat the steps"
        # whether a box that is set next is another one counts from the first step
        if not self.shadow.stepped or self.hasListsOfOpenMM:
            data = self.shadow.context.createCheckpoint()
            for _ in range(3 if self.hasListsOfOpenMM else 1):
                self.shadow.integrator.step(steps)
                self.shadow.context.loadCheckpoint(data)
            self.shadow.stepped = True
        subject.context.setVelocities(before[1])
        self.shadow.context.setVelocities(before[1])
        self.meetBox()

    def callXml(self):
        """System, integrator and State as texts: another Context made from them goes on."""
        before = self.subject.positions
        self.subject = self.throughXml(self.subject)
        if self.hasListsOfOpenMM or self.keepsImages:
            self.shadow = self.throughXml(self.shadow)
        else:
            self.shadow.context.getState(**EVERYTHING)
        if self.keepsImages:
            unit = DOUBLE if self.platformName.endswith("double") else SINGLE
            rounding = 4*unit*(abs(before).max() + abs(self.shadow.box).max())
            assert abs(self.subject.positions - before).max() <= rounding, "other positions after xml"
        self.meetBox()

    def throughXml(self, party):
        def copied(thing):
            return openmm.XmlSerializer.deserialize(openmm.XmlSerializer.serialize(thing))
        state = copied(party.context.getState(**EVERYTHING))
        integrator = PSEBrownianIntegrator.cast(copied(party.integrator))
        if (self.scene.temperature > 0) != (self.settings["Temperature"] > 0):
            party.integrator.applyMobility(np.zeros((self.scene.count, 3))) # in a box that was set since the last step
            integrator.setNumericalParameters(party.plan()) # it was made for another temperature
        made = Party(self.platformName, copied(party.context.getSystem()), integrator)
        made.context.setState(state)
        return made

    def meetBox(self):
        """Whether a box that is set next is a small change counts from the box that was used last."""
        self.both("applyMobility", np.zeros((self.scene.count, 3)))

    def callRemake(self, tolerance, swollen):
        """Another tolerance and other radii: a new Context from the State of the old one."""
        self.meetOracle()
        ratio = min(LARGEST_RATIO, self.scene.ratio*swollen) if self.scene.kinds != 1 else 1.0
        before = self.scene
        self.scene = dataclasses.replace(before, tolerance=tolerance, ratio=ratio)
        fuller = np.sum(self.scene.radii**3)/np.sum(before.radii**3)
        self.scene = dataclasses.replace(self.scene, phi=before.phi*fuller) # in the same box
        with refusing():
            self.subject = self.remade(self.subject)
        self.shadow = self.remade(self.shadow)
        self.oracle = self.remade(self.oracle)
        self.planOfOracle = None

    def callReinitialize(self, preserved):
        positions, box = self.shadow.positions, self.shadow.box
        for party in (self.subject, self.shadow):
            party.context.reinitialize(preserved)
            party.stepped = False
            if not preserved:
                party.put(positions, box)
        if not preserved:
            self.oracle = None # counters begin anew

    def callSamples(self, count):
        drawn = self.both("sampleBrownianDisplacements", count)
        self.meetOracle()
        self.oracle.put(self.shadow.positions, self.shadow.box)
        expected = np.array(self.oracle.integrator.sampleBrownianDisplacements(count))
        for sample, wanted in zip(drawn, expected):
            self.hold("noise", np.linalg.norm(sample - wanted), self.allowedNoise(wanted) + 1e-300)

    def callDescribe(self):
        text = self.subject.integrator.describe().lower()
        assert "nan" not in text and "inf" not in text.replace("infinite", ""), text
        if self.scene.isPeriodicFluid:
            assert 0 < self.subject.integrator.getNumericalParameters()["predictedError"] <= self.tolerance

    def callStress(self):
        """Without external forces, which have none, and bonds that may change their image in a strain."""
        if not self.scene.hasStress or isDevice(self.platformName) and not self.scene.isTilted:
            self.refusalOf("computeStress", words=("call ", "tilt "))
            return
        groups = ~(1 << 1) & ~((1 << 2) if self.scene.wrapped else 0)
        self.meetOracle()
        self.oracle.put(self.shadow.positions, self.shadow.box)
        self.oracle.context.setTime(self.shadow.context.getTime())
        with refusing():
            found = self.subject.integrator.computeStress(7, groups)._value
        if self.hasListsOfOpenMM:
            self.shadow.integrator.computeStress(7, groups)
        expected = self.oracle.integrator.computeStress(7, groups)._value
        energy = self.oracle.context.getState(energy=True, groups=groups).getPotentialEnergy()._value
        volume = np.linalg.det(self.shadow.box)
        share = DOUBLE_STRESS if roundingOfForces(self.platformName) < SINGLE else SINGLE_STRESS
        rounding = self.allowedRounding(self.shadow.positions, 0*self.shadow.positions, self.shadow.box)
        stiff = self.scene.stiffness*self.scene.count*abs(self.shadow.box).max()
        allowed = 2*share*energy/volume + stiff*rounding/volume + 1e-6*abs(np.asarray(expected)).max()
        self.hold("stress", abs(np.asarray(found) - np.asarray(expected)).max(), allowed)

    def refusalOf(self, method, *arguments, words):
        try:
            getattr(self.subject.integrator, method)(*arguments)
        except openmm.OpenMMException as refusal:
            assert any(word in str(refusal) for word in words), refusal
        else:
            raise AssertionError(f"{method}{arguments} was not refused")

    def callRefusedCalls(self):
        """What may not be set now, and positions that are none: refused; afterwards all is as before."""
        subject = self.subject
        for setter, value in (("setErrorTolerance", 1e-2), ("setRadius", 1.0), ("setViscosity", 1.0),
                              ("setFluidBoundary", 0), ("setMobilityModel", 0), ("setSplit", 0)):
            self.refusalOf(setter, value, words=("fixed",))
        good = subject.positions
        bad = good.copy()
        bad[0, 1] = np.nan
        subject.context.setPositions(bad)
        for method, argument in (("step", 1), ("applyMobility", np.ones_like(good)),
                                 ("sampleBrownianDisplacements", 1)):
            self.refusalOf(method, argument, words=("particle 0",))
        for party in (subject, self.shadow):
            party.context.setPositions(good)
