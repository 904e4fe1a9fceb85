# SPDX-License-Identifier: MIT
"""
The error of the time step in equilibrium means: of first order [T58], [T59], and kept in bounds by the
step that is recommended [T60]. Radius 0.5 nm, unbounded fluid, so that dumbbells and chains far apart
are independent copies.
"""
from dataclasses import dataclass

import numpy as np
import openmm
import pytest
from scipy import stats

import dumbbells
import scenes
from openmmpse import PSEBrownianIntegrator, accuracy
from platformnames import isDirect
from polymers import assertAgree, blocked, deviation
from scenes import FALSE_ALARM, KB, makeContext, positionsOf

RADIUS, TEMPERATURE = 0.5, 300.0
KT = KB*TEMPERATURE
MU = 1/(6*np.pi*scenes.ETA*RADIUS)
UNIT = RADIUS**2/(KT*MU) # of time, ps
APART = 400.0 # nm between copies: what one does to another is below 1e-5 of what it does to itself
NORMAL = stats.norm.isf


# ---------------------------------------------------------------- copies of a molecule

@dataclass(frozen=True)
class Copies:
    """
    Molecules far apart: copies of `beads` spheres, bonds between neighbours, of energy
    kT x^2/2, x = (r - length)/spread, `pushing` times as stiff if compressed; in units of the radius.
    """
    number: int
    beads: int
    length: float
    spread: float
    pushing: float = 1.0

    def start(self, seed):
        """Positions (N,3) in nm: bond lengths normal (components of bonds of no length: exactly Boltzmann's)."""
        rng = np.random.default_rng(seed)
        bonds = rng.normal(size=(self.number, self.beads, 3))
        if self.length:
            bonds *= (self.length + self.spread*rng.normal(size=(self.number, self.beads, 1))
                      )/np.linalg.norm(bonds, axis=-1, keepdims=True)
        else:
            bonds *= self.spread
        side = int(np.ceil(self.number**(1/3)))
        sites = np.stack(np.unravel_index(np.arange(self.number), (side,)*3), -1)*APART
        bonds[:, 0] = sites/RADIUS
        return np.cumsum(bonds, axis=1).reshape(-1, 3)*RADIUS

    def force(self):
        k = KT/(self.spread*RADIUS)**2
        length = self.length*RADIUS
        bond = openmm.CustomBondForce(f"{k}/2*(r - {length})^2*(1 + {self.pushing - 1}*step({length} - r))")
        for i in range(self.number*self.beads):
            if (i + 1) % self.beads:
                bond.addBond(i, i + 1)
        return bond

    def context(self, platformName, dt, seed, model=PSEBrownianIntegrator.RotnePragerYamakawa):
        start = self.start(seed)
        return makeContext(scenes.Scene(start, scenes.cube(10.0), RADIUS), platformName, TEMPERATURE, dt, 1e-3,
                           seed=seed, forces=[self.force()], configure=lambda i: i.setMobilityModel(model),
                           boundary=PSEBrownianIntegrator.Unbounded)

    def bondsOf(self, positions):
        """Bond vectors in radii, (...,number,beads - 1,3)."""
        x = positions.reshape(*positions.shape[:-2], self.number, self.beads, 3)
        return np.diff(x, axis=-2)/RADIUS

    def frames(self, context, integrator, count, interval, warm):
        integrator.step(warm)
        out = np.empty((count, self.number*self.beads, 3))
        for frame in out:
            integrator.step(interval)
            frame[:] = positionsOf(context)
        return out


def fit(products, biases, powers):
    """
    Least squares of biases {mean, variance, degrees} by sum_p c_p x^p: coefficients, their standard
    errors, and chi square of what is left.
    """
    errors = np.sqrt([variance for _, variance, _ in biases])
    A = np.array([[x**p for p in powers] for x in products])/errors[:, None]
    y = np.array([mean for mean, _, _ in biases])/errors
    inverse = np.linalg.inv(A.T @ A)
    coefficients = inverse @ A.T @ y
    return coefficients, np.sqrt(np.diag(inverse)), np.sum((y - A @ coefficients)**2)


def relative(value, exact):
    mean, variance, degrees = value
    return mean/exact - 1, variance/exact**2, degrees


# ---------------------------------------------------------------- the dumbbell

def testExactDumbbell():
    """
    The law of a dumbbell at a finite step [T59]: for a constant mobility the closed form of [T1], for
    no step Boltzmann's, in between a bias of first order, whose rest is of second.
    """
    free = dumbbells.springs(0.0, 1.0, mobility=dumbbells.freeDraining)
    for product in (0.4, 0.2, 0.05):
        found = free.stationary(product/2, lambda r: r*r/3)
        assert found == pytest.approx(1/(1 - product/2), abs=1e-11)
    bond = dumbbells.springs(2.5, 0.5)
    exact = bond.boltzmann(bond.energy)
    bias = {p: bond.stationary(stepOf(p, 2.5, 0.5)/UNIT, bond.energy)/exact - 1 for p in (0.2, 0.1, 0.05, 0.025)}
    slopes = [bias[p]/p for p in bias]
    assert 0.49 < slopes[-1] < 0.51 # half, as for a constant mobility
    # Halving the step halves the distance of bias/p from its limit: second order is next.
    ratios = [(slopes[i] - slopes[i + 1])/(slopes[i + 1] - slopes[i + 2]) for i in range(2)]
    assert all(1.8 < ratio < 3 for ratio in ratios)


def stepOf(product, length, spread):
    """dt in ps from its product with the relaxation rate of a bond at that length."""
    G = dumbbells.unboundedRpy(np.array([length]))[1][0]
    return product*UNIT*spread**2/(2*(1 - G))


@pytest.mark.onePrecision
def testDumbbell(platformName, hardCase):
    """
    Dumbbells with springs of 2.5 a +- 0.5 a, so that contact and overlap count, at steps of 0.4, 0.2,
    0.1 and 0.05 over the rate at which their length relaxes (short form: the first three, two on devices and Reference).

    The mean energy of the springs is, at each step, that of the exact law of the discrete process (an
    integral equation, no random numbers); its bias is linear in the step with a slope of 0.50 (to its
    error bar) and a quadratic rest (false alarm 1e-6 together).
    """
    copies = Copies(number=5 if isDirect(platformName) else 50, beads=2, length=2.5, spread=0.5)
    bond = dumbbells.springs(2.5, 0.5)
    boltzmann = bond.boltzmann(bond.energy)
    cpu = platformName == "CPU"
    products = [0.4, 0.2, 0.1, 0.05][:4 if hardCase.long else 3 if cpu else 2]
    frames = (20_000 if cpu else 2000) if hardCase.long else 700 if cpu else 250
    biases, differences = [], {}
    for number, product in enumerate(products):
        dt = stepOf(product, 2.5, 0.5)
        context, integrator = copies.context(platformName, dt, 760 + number)
        interval = max(1, round(0.4/product))
        x = copies.frames(context, integrator, frames, interval, warm=round(4/product))
        energy = bond.energy(np.linalg.norm(copies.bondsOf(x), axis=-1)).mean(axis=(1, 2))
        mean = blocked(energy)
        exact = bond.stationary(dt/UNIT, bond.energy)
        differences[f"product {product}"] = (mean[0] - exact, *mean[1:])
        biases.append(relative(mean, boltzmann))
        hardCase.measure(**{f"bias at {product}": float(biases[-1][0]), f"exact at {product}": float(exact/boltzmann - 1)})
    hardCase.measure(**{"largest deviation (sigma)": assertAgree(differences, len(products) + 2)})
    if len(products) == 2:
        return
    assert deviation(biases[0]) > NORMAL(FALSE_ALARM), "the bias of the largest step must be seen"
    coefficients, errors, _ = fit(products, biases, (1, 2))
    hardCase.measure(slope=float(coefficients[0]), **{"its sigma": float(errors[0])})
    assert abs(coefficients[0] - 0.5) < NORMAL(FALSE_ALARM/2/(len(products) + 2))*errors[0] + 0.02


# ---------------------------------------------------------------- the chain

def rouse(beads):
    """Products of springs along a chain: the matrix whose eigenvalues are the rates of its modes, in k mu."""
    n = beads - 1
    return 2*np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)


def freeDrainingChain(beads, product):
    """
    Relative bias of mean square bonds and radius of gyration of a free-draining chain, exactly: bond
    vectors are an autoregressive process, whose covariance is (1 - R product/2)^-1 [T58].
    """
    n = beads - 1
    covariance = np.linalg.inv(np.eye(n) - rouse(beads)*product/2)
    positions = np.vstack([np.zeros(n), np.tril(np.ones((n, n)))])
    centred = positions - positions.mean(axis=0)
    gyration = np.trace(centred @ covariance @ centred.T)/np.trace(centred @ centred.T)
    return np.trace(covariance)/n - 1, gyration - 1


CHAIN_PRODUCTS = (0.4, 0.2, 0.1, 0.05)


def chainBiases(platformName, model, products, long, hardCase):
    """Relative bias of the mean square bond at steps of these products of stiffness and mobility of a bead."""
    cpu = platformName == "CPU"
    copies = Copies(number=12 if cpu else 4, beads=8, length=0.0, spread=1.0)
    frames = (20_000 if cpu else 2000) if long else 800 if cpu else 300
    biases = []
    for number, product in enumerate(products):
        context, integrator = copies.context(platformName, product*UNIT*copies.spread**2, 770 + number,
                                             getattr(PSEBrownianIntegrator, model))
        x = copies.frames(context, integrator, frames, max(1, round(0.4/product)), warm=round(10/product))
        square = np.sum(copies.bondsOf(x)**2, axis=-1).mean(axis=(1, 2))
        biases.append(relative(blocked(square), 3*copies.spread**2))
        hardCase.measure(**{f"bias at {product}": float(biases[-1][0])})
    return biases


@pytest.mark.onePrecision
def testFreeDrainingChain(platformName, hardCase):
    """
    Gaussian chains of 8 beads without hydrodynamic interactions at steps of 0.4, 0.2, 0.1 and 0.05 over
    stiffness times mobility of a bead (short form: the first two).

    The mean square bond is at each step that of the discrete process, in closed form (false alarm 1e-6
    together).
    """
    products = CHAIN_PRODUCTS[:4 if hardCase.long else 2]
    biases = chainBiases(platformName, "FreeDraining", products, hardCase.long, hardCase)
    differences = {f"product {product}": (mean - freeDrainingChain(8, product)[0], variance, degrees)
                   for product, (mean, variance, degrees) in zip(products, biases)}
    hardCase.measure(**{"largest deviation (sigma)": assertAgree(differences, len(products))})


@pytest.mark.hostOnly
def testChain(platformName, hardCase):
    """
    The same chains, bonds of 1.7 a (rms) and so with overlaps, with hydrodynamic interactions (short form:
    the first three on CPU, the first on the others).

    The bias lies between none and that of free draining at each step; a parabola extrapolates to the
    exact value; a polynomial without a constant leaves nothing beyond error bars, and the bias of the
    largest step is seen (false alarm 1e-6 together).
    """
    products = CHAIN_PRODUCTS[:4 if hardCase.long else 3 if platformName == "CPU" else 1]
    limit = NORMAL(FALSE_ALARM/(2*len(products) + 4))
    biases = chainBiases(platformName, "RotnePragerYamakawa", products, hardCase.long, hardCase)
    for product, bias in zip(products, biases):
        assert deviation(bias) > -limit
        assert deviation(bias, freeDrainingChain(8, product)[0]) < limit
    if len(products) == 1:
        return
    constants, errors, _ = fit(products, biases, (0, 1, 2))
    powers = (1, 2) if len(products) == 3 else (1, 2, 3) # 0.4 is 1.6 of a largest stable 2 without interactions
    slopes, slopeErrors, left = fit(products, biases, powers)
    hardCase.measure(**{"limit": float(constants[0]), "limit's sigma": float(errors[0]),
                        "slope": float(slopes[0]), "slope's sigma": float(slopeErrors[0])})
    assert abs(constants[0]) < limit*errors[0]
    assert stats.chi2.sf(left, 1) > FALSE_ALARM/10
    assert deviation(biases[0]) > limit, "the bias of the largest step must be seen"


# ---------------------------------------------------------------- the recommended step

def dumbbell(platformName, length, spread, pushing):
    """Context of a few of them with an arbitrary step."""
    return Copies(4, 2, length, spread, pushing).context(platformName, 1e-3*UNIT, 780)[0]


@pytest.mark.hostOnly
@pytest.mark.parametrize("bias", [0.1, 0.01])
@pytest.mark.parametrize("length, spread, pushing", [(2.5, 0.5, 1.0), (3.0, 0.2, 1.0), (2.5, 0.5, 4.0)])
def testRecommendedStepOfADumbbell(platformName, length, spread, pushing, bias, hardCase):
    """
    The step that `recommendStep` gives for dumbbells with soft and stiff springs, and with one that is
    four times as stiff if compressed, and wanted biases of 0.1 and 0.01.

    At it, the exact bias of the mean energy of the spring (no random numbers) is below the wanted one,
    and not below a quarter of it; the largest stable step is 2/(k mu) of the steeper side, at the largest
    of the mobilities (a longer bond has more).
    """
    bond = dumbbells.springs(length, spread, pushing)
    advice = accuracy.recommendStep(dumbbell(platformName, length, spread, pushing), bias=bias)
    found = bond.stationary(advice.recommended/UNIT, bond.energy)/bond.boltzmann(bond.energy) - 1
    hardCase.measure(**{"bias": float(found), "dt D0/a^2": float(advice.recommended/UNIT)})
    assert bias/4 < found < bias
    stable = stepOf(2, length, spread)/pushing
    assert 0.6*stable < advice.stable < 1.15*stable


def denseMobility(positions):
    """Of spheres in an unbounded fluid at positions (n,3) in radii: (3n,3n), in that of one."""
    r = positions[:, None] - positions[None]
    length = np.linalg.norm(r, axis=-1) + np.eye(len(r))
    F, G = (values[..., None, None] for values in dumbbells.unboundedRpy(length))
    direction = r/length[..., None]
    along = direction[..., :, None]*direction[..., None, :]
    pairs = F*(np.eye(3) - along) + G*along
    pairs[range(len(r)), range(len(r))] = np.eye(3)
    return pairs.transpose(0, 2, 1, 3).reshape(3*len(r), -1)


@pytest.mark.onePrecision
def testStiffestRate(platformName):
    """Lanczos's method finds the largest eigenvalue of the dense mobility times the matrix of the springs."""
    copies = Copies(1, 12, 0.0, 1.0)
    context, _ = copies.context(platformName, 1e-3*UNIT, 781)
    advice = accuracy.recommendStep(context, configurations=1)
    tree = np.diff(np.eye(12), axis=0)
    M = denseMobility(positionsOf(context)/RADIUS)
    exact = np.linalg.eigvals(M @ np.kron(tree.T @ tree, np.eye(3))).real.max()
    assert advice.rate*UNIT == pytest.approx(exact, rel=0.01)
    assert advice.stable == pytest.approx(2/advice.rate)
    share = advice.rate*1e-3*UNIT/2
    assert advice.bias == pytest.approx(share/(1 - share)) and advice.present == pytest.approx(1e-3*UNIT)


@pytest.mark.hostOnly
def testRecommendedStepOfAChain(platformName, hardCase):
    """
    Chains of 8 beads with springs of 2.5 a +- 0.2 a, at the step recommended for a bias of 0.1.

    The bias of the mean energy of the springs is below 0.1, and in the long form on CPU it is seen (false
    alarm 1e-6); the largest stable step is 11 times as long.
    """
    cpu = platformName == "CPU"
    copies = Copies(number=12 if cpu else 3, beads=8, length=2.5, spread=0.2)
    context, integrator = copies.context(platformName, 1e-3*UNIT, 783)
    advice = accuracy.recommendStep(context, bias=0.1)
    assert advice.stable == pytest.approx(11*advice.recommended)
    integrator.setStepSize(advice.recommended)
    frames = (20_000 if cpu else 2000) if hardCase.long else 1500 if cpu else 300
    x = copies.frames(context, integrator, frames, 2, warm=100)
    bond = dumbbells.springs(2.5, 0.2)
    energy = bond.energy(np.linalg.norm(copies.bondsOf(x), axis=-1)).mean(axis=(1, 2))
    found = relative(blocked(energy), bond.boltzmann(bond.energy))
    hardCase.measure(**{"bias": float(found[0]), "its sigma": float(np.sqrt(found[1])),
                        "dt D0/a^2": float(advice.recommended/UNIT)})
    assert deviation(found, 0.1) < NORMAL(FALSE_ALARM/2)
    assert not (cpu and hardCase.long) or deviation(found) > NORMAL(FALSE_ALARM/2)


@pytest.mark.hostOnly
def testLargestStableStep(platformName, hardCase):
    """
    Dumbbells with stiff springs (6 a +- 0.05 a) at 0.9 and at 1.2 times the largest stable step that
    `recommendStep` gives.

    At the one, bonds stay within 6 standard deviations of the discrete process for 400 steps; at the
    other, all leave 10 of them.
    """
    copies = Copies(4, 2, 6.0, 0.05)
    context, integrator = copies.context(platformName, 1e-3*UNIT, 782)
    stable = accuracy.recommendStep(context).stable

    def excess():
        """Deviations of bonds from 6 a in standard deviations at 0.9 of the limit, [T1]: 1/(1 - 0.9)."""
        return abs(np.linalg.norm(copies.bondsOf(positionsOf(context)), axis=-1) - 6)/(0.05*np.sqrt(10))

    integrator.setStepSize(0.9*stable)
    for _ in range(20):
        integrator.step(20)
        hardCase.measure(**{"standard deviations at 0.9": float(excess().max())})
        assert excess().max() < 6
    integrator.setStepSize(1.2*stable)
    largest = 0
    for _ in range(20):
        integrator.step(1)
        largest = np.maximum(largest, excess())
    hardCase.least(**{"at 1.2": float(largest.min())})
    assert largest.min() > 10


@pytest.mark.onePlatform
def testAStepInABoxThatMoves():
    """Where the short run would shear the box, the given positions alone count."""
    scene = scenes.randomSuspension(20, 0.1, scenes.cube(1), RADIUS, 784)
    bonds = scenes.harmonicBonds([(i, i + 1) for i in range(19)], 2.4*RADIUS, 100.0)
    context, _ = makeContext(scene, "CPU", TEMPERATURE, 1.0, forces=[bonds], configure=lambda i: i.setShearRate(1e-3))
    one, four = (accuracy.recommendStep(context, configurations=n) for n in (1, 4))
    assert one == four and one.rate > 0


@pytest.mark.onePlatform
def testNothingLimitsTheStep():
    """Without forces, the rms displacement of 0.3 radii; without noise either, nothing."""
    pair = scenes.pair(3.0, 20.0, RADIUS)
    for temperature, expected in ((TEMPERATURE, 0.09/6*UNIT), (0.0, None)):
        context, _ = makeContext(pair, "CPU", temperature, 1.0)
        advice = accuracy.recommendStep(context)
        assert advice.rate is None and advice.stable is None and advice.bias is None
        assert advice.recommended == (expected and pytest.approx(expected))


@pytest.mark.onePlatform
def testRecommendedStepWithoutAFluid():
    """A free-draining chain relaxes at stiffness times mobility times 2 - 2 cos(pi 7/8); spheres alone at no rate."""
    def free(integrator):
        integrator.setMobilityModel(PSEBrownianIntegrator.FreeDraining)

    stiffness = 40*KT/RADIUS**2
    chain = scenes.chain(8, 2*RADIUS, 20.0, RADIUS, 785)
    springs = scenes.harmonicBonds([(i, i + 1) for i in range(7)], 0.0, stiffness)
    context, _ = makeContext(chain, "CPU", TEMPERATURE, 1e-3*UNIT, forces=[springs], configure=free)
    advice = accuracy.recommendStep(context, bias=0.01)
    assert advice.rate == pytest.approx(stiffness*chain.mu0*(2 - 2*np.cos(np.pi*7/8)), rel=0.01)
    assert advice.recommended == pytest.approx(0.02/(1.01*advice.rate))
    context, _ = makeContext(chain, "CPU", TEMPERATURE, 1.0, configure=free)
    advice = accuracy.recommendStep(context)
    assert advice.recommended is None and "neither a fluid" in advice.reason
