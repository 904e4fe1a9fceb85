# SPDX-License-Identifier: MIT
"""What the examples share: options, Contexts with and without the solvent's flow, rows of numbers, pictures."""
import argparse
import math
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import openmm
from openmm import unit

from openmmpse import PSEBrownianIntegrator, analysis

TEMPERATURE = 293.15  #: K
VISCOSITY = 1.002 * analysis.MPA_S  #: water at 20 C, Da/(nm ps)
FORCE = unit.kilojoule_per_mole / unit.nanometer
KT = analysis.thermalEnergy(TEMPERATURE)  #: kJ/mol
WET, DRY, THEORY = "#0072B2", "#D55E00", "#222222"  #: with and without hydrodynamic interactions, and expected
STYLE = {"axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False,
         "figure.constrained_layout.use": True}


class Row(NamedTuple):
    """One line of the table. slack: how far the expected number may be off for a known reason, beyond `error`."""

    quantity: str
    value: float
    error: float  #: one standard error
    expected: float  #: not a number where nothing is expected
    source: str
    slack: float = 0.0
    degrees: int = 10**6  #: of freedom behind `error`


def meanOf(independent):
    """(mean, standard error, degrees of freedom) of independent numbers (n,)."""
    independent = np.asarray(independent, dtype=float)
    return independent.mean(), independent.std(ddof=1) / math.sqrt(len(independent)), len(independent) - 1


def ratioOf(above, below):
    """The same of the ratio of two means over independent pairs of numbers (n,), to first order in their errors."""
    ratio = np.mean(above) / np.mean(below)
    return ratio, *meanOf((np.asarray(above) - ratio * np.asarray(below)) / np.mean(below))[1:]


def mobility(radius):
    """Of one sphere in water, nm/ps per kJ/(mol nm)."""
    return analysis.stokesMobility(radius, VISCOSITY)


def fluid(system, radius, step, options, hydrodynamics=True, seed=0, temperature=TEMPERATURE,
          boundary=PSEBrownianIntegrator.Unbounded, threads=1):
    """A Context of the System in water, and its integrator; without hydrodynamics each particle feels its own drag."""
    integrator = PSEBrownianIntegrator(temperature, VISCOSITY, radius, step)
    integrator.setFluidBoundary(boundary)
    integrator.setRandomNumberSeed(options.seed + seed)
    if not hydrodynamics:
        integrator.setMobilityModel(PSEBrownianIntegrator.FreeDraining)
    properties = {"Threads": str(threads)} if options.platform == "CPU" else {}
    return openmm.Context(system, integrator, openmm.Platform.getPlatform(options.platform), properties), integrator


def positionsOf(context):
    """(N, 3), nm, not wrapped into a box."""
    return context.getState(positions=True).getPositions(asNumpy=True).value_in_unit(unit.nanometer)


def forcesOf(context):
    """(N, 3), kJ/(mol nm)."""
    return context.getState(forces=True).getForces(asNumpy=True).value_in_unit(FORCE)


def chain(count, force, parameters):
    """System of `count` beads in a row; `force` is a bond Force, which gets the parameters for each bond."""
    system = openmm.System()
    for i in range(count):
        system.addParticle(1.0)  # masses do not enter the motion
        if i > 0:
            force.addBond(i - 1, i, *parameters)
    system.addForce(force)
    return system


def table(rows):
    """The rows as lines of text."""
    width = max(len(row.quantity) for row in rows)
    head = f"{'quantity':{width}}  {'simulated +- error':>22}  {'expected':>10}  by"
    return "\n".join([head] + [f"{row.quantity:{width}}  {row.value:12.5g} +- {row.error:6.2g}  {row.expected:10.5g}  "
                               f"{row.source}" for row in rows])


def plainTicks(axis, values):
    """Ticks of a logarithmic axis at these values alone, as plain numbers."""
    axis.set(major_locator=plt.FixedLocator(values), minor_locator=plt.NullLocator(), major_formatter="{x:g}")


def save(figure, options, name):
    """Write a picture into the output folder."""
    figure.savefig(options.output / name)


def main(run, description, argv=None, more=()):
    """Read the command line, run(options), print its rows. more: (name, arguments of add_argument) of own options."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="seconds instead of minutes, with wider error bars")
    parser.add_argument("--output", type=Path, default=Path("example-output"), help="folder of the picture")
    parser.add_argument("--platform", default="CPU", help="OpenMM platform (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="(default: %(default)s)")
    for name, arguments in more:
        parser.add_argument(name, **arguments)
    options = parser.parse_args(argv)
    options.output.mkdir(parents=True, exist_ok=True)
    plt.switch_backend("Agg")
    with plt.rc_context(STYLE):
        rows = run(options)
    print(table(rows))
    return rows
