# SPDX-License-Identifier: MIT
"""
Chains of beads with harmonic bonds and a soft repulsion: the Force objects, what is observed of
positions, and the equilibrium means by a Metropolis Monte Carlo that shares nothing with the library
but the potential.
"""
from dataclasses import dataclass

import numpy as np
import openmm
from scipy import stats

import scenes
from scenes import FALSE_ALARM, KB

NAMES = ("bond^2", "radius of gyration^2", "soft energy", "pressure")


@dataclass(frozen=True)
class Melt:
    """
    Chains of beads of one radius (nm) in a cube at volume fraction phi.

    spread   standard deviation (nm) of each component of a bond vector of an ideal chain
    height   of the repulsion height*(1 - r/2a)^2 within 2 a between all pairs, in kT
    """
    chains: int
    beads: int
    phi: float = 0.1
    radius: float = 0.5
    spread: float = 0.25
    height: float = 3.0
    temperature: float = 300.0

    @property
    def count(self):
        return self.chains*self.beads

    @property
    def kT(self):
        return KB*self.temperature

    @property
    def edge(self):
        return (self.count*4*np.pi/3*self.radius**3/self.phi)**(1/3)

    @property
    def stiffness(self):
        """Of a bond, kJ/(mol nm^2)."""
        return self.kT/self.spread**2

    @property
    def mobility(self):
        """Of a bead alone, nm/ps per kJ/(mol nm)."""
        return 1/(6*np.pi*scenes.ETA*self.radius)

    def stepSize(self, product):
        """The step (ps) whose product with stiffness of a bond and mobility of a bead is given."""
        return product/(self.stiffness*self.mobility)

    def idealChains(self, copies, seed):
        """Independent ideal chains at random places: positions (copies,N,3), not wrapped."""
        rng = np.random.default_rng(seed)
        bonds = rng.normal(size=(copies, self.chains, self.beads, 3))*self.spread
        bonds[:, :, 0] = rng.random((copies, self.chains, 3))*self.edge
        return np.cumsum(bonds, axis=2).reshape(copies, -1, 3)

    def scene(self, positions):
        return scenes.Scene(positions, scenes.cube(self.edge), self.radius)

    def forces(self):
        bonds = [(c*self.beads + i, c*self.beads + i + 1)
                 for c in range(self.chains) for i in range(self.beads - 1)]
        soft = openmm.CustomNonbondedForce(f"{self.height*self.kT}*(1 - r/{2*self.radius})^2")
        soft.setNonbondedMethod(openmm.CustomNonbondedForce.CutoffPeriodic)
        soft.setCutoffDistance(2*self.radius)
        for _ in range(self.count):
            soft.addParticle([])
        return [scenes.harmonicBonds(bonds, 0.0, self.stiffness), soft]

    def softEnergies(self, r):
        """kT of vectors (...,3): energies, and their r*U' for the virial."""
        r = r - self.edge*np.rint(r/self.edge)
        x = np.sqrt(np.sum(r*r, axis=-1))/(2*self.radius)
        inside = np.maximum(1 - x, 0)
        return self.height*inside**2, -2*self.height*x*inside

    def observed(self, positions):
        """
        Of positions (copies,N,3), each (copies,): mean square bond and radius of gyration (nm^2), soft
        energy of a bead (kT), osmotic pressure over that of as many free beads.
        """
        x = positions.reshape(len(positions), self.chains, self.beads, 3)
        square = np.mean(np.sum(np.diff(x, axis=2)**2, axis=-1), axis=(1, 2))
        gyration = np.sum(x.var(axis=2), axis=-1).mean(axis=1)
        energy, virial = np.zeros(len(x)), np.zeros(len(x))
        for i in range(1, self.count):
            u, ru = self.softEnergies(positions[:, :i] - positions[:, i:i + 1])
            energy += u.sum(axis=1)
            virial -= ru.sum(axis=1)
        virial -= square*self.chains*(self.beads - 1)/self.spread**2
        return dict(zip(NAMES, (square, gyration, energy/self.count, 1 + virial/(3*self.count))))

    def equilibrium(self, copies, sweeps, every, seed):
        """
        Means and squared standard errors of what is observed, {name: (mean, variance, degrees)}, and the
        last positions (copies,N,3).

        Metropolis moves of one bead after the other, in all of `copies` independent systems at once. They
        begin as ideal chains; twice the square of the beads of a chain, some four of its relaxation times,
        are sweeps to forget that, and of `sweeps` after them every so many counts. Errors come from the
        spread of the copies, which are independent exactly.
        """
        rng = np.random.default_rng(seed)
        x = self.idealChains(copies, seed + 1)
        sums, counted = dict.fromkeys(NAMES, 0.0), 0
        for sweep in range(-2*self.beads**2, sweeps):
            for i in range(self.count):
                self.move(x, i, rng)
            if sweep >= 0 and sweep % every == 0:
                values, counted = self.observed(x), counted + 1
                sums = {name: sums[name] + values[name] for name in NAMES}
        return {name: meanOf(sums[name]/counted) for name in NAMES}, x

    def move(self, x, i, rng):
        """One Metropolis move of bead i in each of positions x (copies,N,3), in place."""
        trial = x[:, i] + rng.uniform(-1.5, 1.5, (len(x), 3))*self.spread
        place, change = i % self.beads, np.zeros(len(x))
        for position, sign in ((trial, 1), (x[:, i], -1)):
            energies = self.softEnergies(x - position[:, None])[0] if self.height else np.zeros(x.shape[:2])
            energies[:, i] = 0
            change += sign*energies.sum(axis=1)
            for j in ([i - 1] if place > 0 else []) + ([i + 1] if place < self.beads - 1 else []):
                change += sign*np.sum((x[:, j] - position)**2, axis=1)/(2*self.spread**2)
        accepted = rng.random(len(x)) < np.exp(np.minimum(-change, 0))
        x[accepted, i] = trial[accepted]


# ---------------------------------------------------------------- means with error bars

def meanOf(independent):
    """(mean, squared standard error, degrees of freedom) of independent numbers (n,)."""
    independent = np.asarray(independent)
    return independent.mean(), independent.var(ddof=1)/len(independent), len(independent) - 1


def blocked(series, blocks=32):
    """The same of a correlated series, from blocks which must be much longer than its memory."""
    length = len(series)//blocks
    return meanOf(np.asarray(series)[-length*blocks:].reshape(blocks, length).mean(axis=1))


def combined(*weighted):
    """The same of a sum of (weight, mean as above): Welch's effective degrees of freedom."""
    parts = [weight**2*variance for weight, (_, variance, _) in weighted]
    degrees = sum(parts)**2/sum(part**2/of[2] for part, (_, of) in zip(parts, weighted))
    return sum(weight*of[0] for weight, of in weighted), sum(parts), degrees


def deviation(value, exact=0.0):
    """Of a mean as above from an exact value, in standard deviations of a normal number."""
    mean, variance, degrees = value
    t = (mean - exact)/np.sqrt(variance)
    return float(np.sign(t)*stats.norm.isf(stats.t.sf(abs(t), degrees)))


def assertAgree(values, comparisons, label=""):
    """
    Each of {name: difference as above} is zero within its error. FALSE_ALARM is shared among all
    comparisons of a test. Returns the largest deviation.
    """
    limit = stats.norm.isf(FALSE_ALARM/(2*comparisons))
    scores = {name: deviation(value) for name, value in values.items()}
    for name, score in scores.items():
        mean, variance, _ = values[name]
        assert abs(score) < limit, f"{label} {name}: off by {mean:.3g} +- {np.sqrt(variance):.1g}, {score:.1f} sigma"
    return max(map(abs, scores.values()))
