# SPDX-License-Identifier: MIT
"""Which effects are on in which scene, and what each costs: the tables of docs/effects.md.

    python benchmarks/effect_costs.py --threads 1 --processor-time --write

Dilute and dense suspensions, a gel, random spheres and chains, of equal and of five radii, with and without noise and
shear, on the CPU platform at tolerance 1e-3, dt D0/a^2 = 1e-3. Only one particle is pulled at, so the time of a step is that
of the fluid; it is divided among the parts of the method by getStageTimes(). The variants of one scene take turns, so
the ratios within a scene mean more than the times.
"""
import argparse
import functools
import re
import time
from pathlib import Path

import numpy as np
from tqdm import tqdm

import spheres
import texts
from openmmpse import PSEBrownianIntegrator
from openmmpse.accuracy import stages

TEXT = Path(__file__).resolve().parents[1]/"docs"/"effects.md"
RATE = 1e-4/spheres.STEP  # 1/ps
EQUAL, FIVE, OWN = "equal", "five, 1:2", "each its own, 1:4"
STEPS, BEAD_STEPS = 10, 100_000  # timed in a round; the second of a chain, over its beads: processor time has ticks of 4 ms


class Variant:
    """One integrator for a scene, and what its steps took."""

    def __init__(self, scene, radii, thermal=True, sheared=False, model="RotnePragerYamakawa", points=0):
        self.scene, self.radii, self.thermal, self.sheared, self.model = scene, radii, thermal, sheared, model
        self.points = points  # of the grid per axis; 0: automatic
        self.seconds = []

    def start(self, threads):
        integrator = PSEBrownianIntegrator(self.thermal*spheres.TEMPERATURE, spheres.VISCOSITY, spheres.RADIUS,
                                           spheres.STEP)
        integrator.setMobilityModel(getattr(PSEBrownianIntegrator, self.model))
        boundary = PSEBrownianIntegrator.Periodic if self.scene.edge else PSEBrownianIntegrator.Unbounded
        integrator.setFluidBoundary(boundary)
        integrator.setRandomNumberSeed(1)
        for i, radius in enumerate(radiiOf(self.radii, len(self.scene.positions))):
            integrator.setParticleRadius(i, radius)
        integrator.setShearRate(self.sheared*RATE)
        integrator.setGridDimensions(self.points, self.points, self.points)
        system = spheres.makeSystem(len(self.scene.positions), self.scene.edge or 10.0)
        self.integrator = integrator
        self.context = spheres.context(system, self.scene.positions, integrator, threads)

    def measure(self, clock):
        steps = STEPS if self.scene.edge else BEAD_STEPS//len(self.scene.positions)
        self.seconds.append(spheres.secondsPerStep([self.integrator], steps, 1, clock)[0])

    @property
    def milliseconds(self):
        return 1e3*np.median(self.seconds)

    def over(self, other):
        """The median of the ratios to another variant of the same rounds."""
        return np.median(np.divide(self.seconds, other.seconds))

    def effects(self):
        """Those that describe() tells of besides hydrodynamic interactions, in words."""
        text = self.integrator.describe()
        on = re.findall(r"^(.+?): on\b", text, re.MULTILINE)
        if "hydrodynamic interactions" in on:
            on.remove("hydrodynamic interactions")
        else:
            on.append("free draining")
        on += [f"{count} radii" for count in re.findall(r"^unequal radii: (\d+)", text, re.MULTILINE)]
        on += re.findall(r"\b(force coupling)\b", text)[:1] + re.findall(r"^fluid: (unbounded)", text, re.MULTILINE)
        return ", ".join(on) or "none"


class Scene:
    """A configuration, and the variants of it that are compared."""

    def __init__(self, name, positions, edge=0.0, radii=(EQUAL, FIVE), more=()):
        self.name, self.positions, self.edge = name, positions, edge
        self.variants = [Variant(self, sizes, thermal, sheared) for sizes in radii for thermal in (True, False)
                         for sheared in (False, True)]
        self.variants += [Variant(self, EQUAL, model=model) for model in more]

    def variant(self, radii, thermal, sheared):
        return next(v for v in self.variants if (v.radii, v.thermal, v.sheared) == (radii, thermal, sheared))

    def overview(self):
        """A line for each choice of radii: milliseconds of a step."""
        equal = self.variant(EQUAL, True, False)
        for sizes in dict.fromkeys(v.radii for v in self.variants):
            four = [self.variant(sizes, thermal, sheared) for thermal in (True, False) for sheared in (False, True)]
            cells = [f"{v.milliseconds:.3g}" for v in four]
            ratio = "" if sizes == EQUAL else f"{four[0].over(equal):.2f}"
            yield f"| {self.name} | {sizes} | {' | '.join(cells)} | {four[1].over(four[0]):.2f} | {ratio} |"

    def shares(self):
        """A table: the effects of each variant, its time, and what part of it each part of the method takes."""
        found = [stages.partsOf(v.integrator.getStageTimes()) for v in self.variants]
        parts = [part for part in stages.PARTS if any(shares[part] > 0 for shares in found)]
        yield from ("", f"**{self.name[0].upper()}{self.name[1:]}**", "")
        yield from (f"| effects besides hydrodynamic interactions | ms | {' | '.join(parts)} |", f"|---|---:|{'---:|'*len(parts)}")
        for v, shares in zip(self.variants, found):
            cells = [f"{100*shares[part]:.0f} %" if shares[part] > 0 else "-" for part in parts]
            yield f"| {v.effects()} | {v.milliseconds:.3g} | {' | '.join(cells)} |"


@functools.cache
def radiiOf(sizes, count):
    """Radii (nm) whose mean cube is 1, as that of equal spheres; empty for those."""
    rng = np.random.default_rng(5)
    if sizes == EQUAL:
        return ()
    radii = (rng.choice(np.linspace(1, 2, 5), count) if sizes == FIVE else np.exp(rng.uniform(0, np.log(4), count)))
    return radii*spheres.RADIUS/np.mean(radii**3)**(1/3)


def chain(beads):
    """A self-avoiding walk of touching beads."""
    rng = np.random.default_rng(4)
    x = [np.zeros(3)]
    while len(x) < beads:
        step = rng.normal(size=3)
        new = x[-1] + 2*spheres.RADIUS*step/np.linalg.norm(step)
        if np.linalg.norm(np.array(x) - new, axis=1).min() > 1.8*spheres.RADIUS:
            x.append(new)
    return np.array(x)


def randomSpheres(count):
    """Name, positions and edge of the box."""
    edge = spheres.edge(count, 0.2)
    return "random overlapping spheres, phi = 0.2", np.random.default_rng(6).random((count, 3))*edge, edge


def scenes(count):
    yield lambda: Scene("dilute suspension, phi = 0.01", *spheres.suspension(count, 0.01), more=["FreeDraining"])
    yield lambda: Scene("dense suspension, phi = 0.3", *spheres.suspension(count, 0.3), more=["ForceCoupling"])
    yield lambda: Scene("gel, phi = 0.1", *spheres.gel(count, 0.1))
    yield lambda: Scene(*randomSpheres(count), (EQUAL, FIVE, OWN))
    for beads in (100, 1000):
        yield lambda beads=beads: Scene(f"chain of {beads}, unbounded", chain(beads))


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=16000, help="of all scenes but chains: 2000 times a power of 8, "
                        "for the gel (default: %(default)s)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--processor-time", action="store_true", help="for machines with other work: with one thread")
    parser.add_argument("--write", action="store_true", help=f"put the tables into {TEXT.name}")
    options = parser.parse_args(argv)
    clock = time.process_time if options.processor_time else time.perf_counter
    overview, details = [], []
    for make in tqdm(list(scenes(options.particles)), desc="scenes", disable=None):
        scene = make()
        for variant in scene.variants:
            variant.start(options.threads)
        for _ in range(options.rounds):
            for variant in scene.variants:
                variant.measure(clock)
        overview += scene.overview()
        details += scene.shares()
    kind = "processor time" if options.processor_time else "time"
    lines = [f"{options.particles:,} particles unless a chain, {options.threads} thread(s): milliseconds of {kind} of a step, "
             f"medians of {options.rounds} rounds; ratios are medians of those within a round, of thermal steps.", "",
             "| scene | radii | thermal | thermal, sheared | athermal | athermal, sheared | sheared over still | "
             "over equal radii |", "|---|---|---:|---:|---:|---:|---:|---:|", *overview, "",
             "The same divided among the parts of the method, by the clock:", *details]
    print("\n".join(lines))
    if options.write:
        texts.fill(TEXT, "effect_costs", lines)


if __name__ == "__main__":
    main()
