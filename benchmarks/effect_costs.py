# SPDX-License-Identifier: MIT
"""Which effects are on in which scene, and what each costs: the table of docs/effects.md.

Every scene runs on the CPU platform at tolerance 1e-3, dt D0/a^2 = 1e-3. Only one particle is pulled at, so the time of
a step is that of the fluid; it is divided among the parts of the method by getStageTimes(). Scenes of one group take turns, so
the ratios within a group mean more than the times.
"""
import argparse
import re
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import spheres
from openmmpse import PSEBrownianIntegrator
from openmmpse.accuracy import stages


@dataclass
class Scene:
    """What is simulated, and how the integrator is set up for it."""

    name: str
    positions: np.ndarray
    edge: float = 0  #: of the periodic cube (nm); 0: unbounded fluid
    temperature: float = spheres.TEMPERATURE
    model: str = "RotnePragerYamakawa"
    radii: np.ndarray = None  #: of each particle, where they differ
    shearRate: float = 0  #: 1/ps
    points: int = 0  #: of the grid per axis; 0: automatic
    steps: int = 10
    seconds: list = field(default_factory=list)

    def integratorOf(self):
        integrator = PSEBrownianIntegrator(self.temperature, spheres.VISCOSITY, spheres.RADIUS, spheres.STEP)
        integrator.setMobilityModel(getattr(PSEBrownianIntegrator, self.model))
        boundary = PSEBrownianIntegrator.Periodic if self.edge else PSEBrownianIntegrator.Unbounded
        integrator.setFluidBoundary(boundary)
        integrator.setRandomNumberSeed(1)
        for i, radius in enumerate(self.radii if self.radii is not None else []):
            integrator.setParticleRadius(i, radius)
        integrator.setShearRate(self.shearRate)
        if self.points:
            integrator.setGridDimensions(self.points, self.points, self.points)
        return integrator

    def start(self, threads):
        system = spheres.makeSystem(len(self.positions), self.edge or 10.0)
        self.integrator = self.integratorOf()
        self.context = spheres.context(system, self.positions, self.integrator, threads)

    def row(self):
        """Milliseconds of a step, in all and by column."""
        total = 1e3*np.median(self.seconds)
        parts = stages.partsOf(self.integrator.getStageTimes())
        return total, {part: share*total for part, share in parts.items()}

    def effects(self):
        """Those that are on, in words."""
        return ", ".join(line.split(":", 1)[0] for line in self.integrator.describe().splitlines()
                         if re.match(r"[a-z ]+: on\b", line)) or "none"


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


def mixed(radii, phi):
    """Edge of the cube that spheres of these radii fill to phi."""
    return (4/3*np.pi*np.sum(radii**3)/phi)**(1/3)


def randomSpheres(count):
    """Spheres at random places, phi = 0.2: equal ones, five radii, and all of them different."""
    rng = np.random.default_rng(5)
    five, any_ = rng.choice(np.linspace(0.8, 1.6, 5), count), np.exp(rng.uniform(np.log(0.5), np.log(2), count))
    places = rng.random((count, 3))
    return [Scene("random spheres, phi = 0.2", *(places*mixed(np.ones(count), 0.2), mixed(np.ones(count), 0.2))),
            Scene("mixture of five radii, 1:2", places*mixed(five, 0.2), mixed(five, 0.2), radii=five),
            Scene("every sphere its own radius, 1:4", places*mixed(any_, 0.2), mixed(any_, 0.2), radii=any_)]


def groups(count):
    """Scenes, those together that are to be compared."""
    dilute, dense = spheres.suspension(count, 0.01), spheres.suspension(count, 0.3)
    gel = spheres.gel(count, 0.1)
    rate = 1e-4/spheres.STEP
    yield [Scene("dilute suspension, phi = 0.01", *dilute), Scene("the same, athermal", *dilute, temperature=0),
           Scene("the same, free draining", *dilute, model="FreeDraining")]
    yield [Scene("dense suspension, phi = 0.3", *dense), Scene("the same, athermal", *dense, temperature=0),
           Scene("the same, sheared", *dense, shearRate=rate),
           Scene("the same, athermal and sheared", *dense, temperature=0, shearRate=rate),
           Scene("the same, force coupling", *dense, model="ForceCoupling")]
    yield [Scene("gel, phi = 0.1", *gel), Scene("the same, athermal", *gel, temperature=0)]
    yield randomSpheres(count)
    for beads in (100, 1000):
        walk = chain(beads)
        yield [Scene(f"chain of {beads}, unbounded", walk, steps=30),
               Scene("the same, athermal", walk, temperature=0, steps=30)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=16000)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--processor-time", action="store_true", help="for machines with other work: with one thread")
    parser.add_argument("--output", type=Path, help="write the table here, too")
    arguments = parser.parse_args()
    clock = time.process_time if arguments.processor_time else time.perf_counter
    lines = ["| scene | effects | ms per step | " + " | ".join(stages.PARTS) + " |", "|---|---|" + "---:|"*(1 + len(stages.PARTS))]
    print("\n".join(lines))
    for group in groups(arguments.particles):
        for scene in group:
            scene.start(arguments.threads)
        for _ in range(arguments.rounds):
            for scene in group:
                scene.seconds.append(spheres.secondsPerStep([scene.integrator], scene.steps, 1, clock)[0])
        for scene in group:
            total, cells = scene.row()
            numbers = " | ".join("-" if value == 0 else f"{value:.1f}" for value in cells.values())
            lines.append(f"| {scene.name} | {scene.effects()} | {total:.1f} | {numbers} |")
            print(lines[-1], flush=True)
    if arguments.output:
        arguments.output.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
