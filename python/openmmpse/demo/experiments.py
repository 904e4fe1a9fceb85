# SPDX-License-Identifier: MIT
"""The two experiments: a protein and a polymer, each with and without hydrodynamics, beside theory.

Both measure diffusion of the centre of mass in four ways. Short times: variance of single Brownian steps, and, without
noise, the velocity that an evenly spread force causes. Long times: displacements over lags beyond the relaxation of the
molecule, and, sharper, short-time value minus the integral of drift correlations (`statistics.drift_integral`).

Each experiment hands its simulations to a `parallel.Team` and returns a function that waits for them and evaluates.
"""
from __future__ import annotations

import numpy as np

from openmmpse.analysis import Curve, Estimate, beads, estimate

from . import network, polymer, simulate, statistics, theory
from .results import Result, Row
from .simulate import THERMAL_ENERGY as kT
from .simulate import VISCOSITY, to_infinite
from .trajectories import (
    FORCE,
    FREE_FORCE,
    FREE_STEP,
    ONE_STEP,
    free_rows,
    long_time_rows,
    run_conformations,
    run_replica,
)

RESIDUE_RADIUS = 0.484  #: nm, one bead per residue (Ortega, Amoros and Garcia de la Torre 2011)
PROTEIN_EDGE = 20.0  #: nm; finite-size correction 29 % of the long-time D, its next order 0.4 % (both are applied)
PARTS = 4  #: tasks that the polymer's independent conformations are divided into
FROZEN_CHAINS = 40  #: chains that the dense lower bound of the polymer's long-time value is averaged over, to 2 %
PROTEIN_SEED, POLYMER_SEED, CHAIN_SEED = 1000, 2000, 3000  #: of the first replica each; every run has its own
FREE_SEED = 500  #: added for the runs without hydrodynamics


def protein(structure, sampling, platform, team, folder):
    """T4 lysozyme as an elastic network in water."""
    x0 = structure.positions
    springs = network.connect(x0)
    linear = network.relax(springs, x0, RESIDUE_RADIUS, VISCOSITY, kT)
    system = network.build_system(len(x0), springs, PROTEIN_EDGE)
    structure.topology.setUnitCellDimensions((PROTEIN_EDGE,) * 3)
    molecule = simulate.Molecule(structure.topology, system, RESIDUE_RADIUS, linear.step, PROTEIN_EDGE)
    starts = [x0] * sampling.replicas
    runs = _submit(team, molecule, sampling, starts, PROTEIN_SEED, platform, folder / "protein")

    def evaluate():
        wet, dry = (team.collect(futures) for futures in runs)
        facts = [
            f"{len(x0)} residues from {structure.source}; {len(springs.pairs)} springs, beads fluctuate by "
            f"{linear.fluctuation:.3f} nm",
            f"step {molecule.step:.3f} ps, slowest network mode {linear.slowest_time:.0f} ps, long-time lag "
            f"{sampling.lag * molecule.step:.0f} ps, {sampling.replicas} replicas of "
            f"{sampling.steps * molecule.step / 1000:.2f} ns",
        ]
        return _protein_result(wet, dry, sampling, molecule, x0, linear, facts)

    return evaluate


def _protein_result(wet, dry, sampling, molecule, x0, linear, facts):
    """`Result` of the protein's replicas with (wet) and without (dry) hydrodynamics."""
    fluid = (RESIDUE_RADIUS, VISCOSITY, kT)
    snapshots = [x for replica in wet for x in replica.snapshots]
    kirkwood = float(np.mean([beads.kirkwood(x, *fluid) for x in snapshots]))
    rigid = float(np.mean([beads.rigidBody(x, *fluid)[0] for x in snapshots]))
    correction = to_infinite(molecule, beads.radiusOfGyration(x0))
    short = estimate([value for replica in wet for value in replica.exact])
    moments = [displacements for replica in wet for displacements in replica.moments]
    one_step = statistics.one_step_diffusion(moments, molecule.step).shifted(correction)
    # Theory and simulation see the same configurations here, so the tolerance is all that may separate them.
    exact = Estimate(short.value, simulate.TOLERANCE * short.value).shifted(correction)
    long, curves, plain = long_time_rows(
        "protein", wet, sampling, molecule.step, correction, short, rigid, "rigid body, dense")
    free = beads.freeDraining(len(x0), *fluid)
    # The same snapshots without a box: what the finite-size correction must lead to.
    infinite = estimate([value for replica in wet for value in replica.unbounded[0]])
    infinite = Estimate(infinite.value, simulate.TOLERANCE * infinite.value)
    steps = [displacements for replica in wet for displacements in replica.unbounded[1]]
    rows = [
        Row("protein", True, "short", ONE_STEP, one_step, kirkwood, "Kirkwood, dense"),
        Row("protein", True, "short", FORCE, exact, kirkwood, "Kirkwood, dense"),
        Row("protein", True, "short", FREE_STEP, statistics.one_step_diffusion(steps, molecule.step), exact.value,
            "periodic, corrected"),
        Row("protein", True, "short", FREE_FORCE, infinite, exact.value, "periodic, corrected"),
        *long,
        *free_rows("protein", dry, sampling, molecule.step, free, "D0/N", curves),
    ]
    counts = np.unique(np.geomspace(1, 4 * sampling.lag, 60).astype(int))
    linear_theory = theory.apparent_diffusion(linear.rates, linear.weights, molecule.step, counts)
    curves["linear theory"] = Curve(counts * molecule.step, linear_theory, None)
    facts = [*facts, _plain_fact(plain), _size_fact(correction, rigid, PROTEIN_EDGE)]
    return Result("protein", rows, curves, facts, molecule, wet[0].describe, snapshots[-1])


def chain(plan, platform, team, folder):
    """An ideal bead-spring polymer in the same water."""
    sampling, molecule = plan.polymer, polymer.build()
    generator = np.random.default_rng(CHAIN_SEED)
    starts = [polymer.equilibrium(generator) for _ in range(sampling.replicas)]
    conformations = [polymer.equilibrium(generator) for _ in range(plan.conformations)]
    runs = _submit(team, molecule, sampling, starts, POLYMER_SEED, platform, folder / "polymer")
    parts = [
        team.submit(run_conformations, molecule, conformations[i::PARTS], plan.samples, CHAIN_SEED + i, platform)
        for i in range(PARTS)
    ]

    def evaluate():
        fluid = (polymer.RADIUS, VISCOSITY, kT)
        frozen = float(np.mean([beads.frozenBound(x, *fluid) for x in conformations[:FROZEN_CHAINS]]))
        (wet, dry), measured = (team.collect(futures) for futures in runs), team.collect(parts)
        facts = [
            f"ideal chain of {polymer.COUNT} beads, bond {polymer.BOND:.1f} nm, radius of gyration "
            f"{polymer.GYRATION:.1f} nm",
            f"step {molecule.step:.1f} ps, {plan.conformations} independent chains for short times, "
            f"{sampling.replicas} replicas of {sampling.steps * molecule.step / 1000:.1f} ns, "
            f"long-time lag {sampling.lag * molecule.step / 1000:.1f} ns",
        ]
        return _polymer_result(wet, dry, measured, sampling, molecule, frozen, facts, starts[-1])

    return evaluate


def _polymer_result(wet, dry, measured, sampling, molecule, frozen, facts, positions):
    """`Result` of the polymer's replicas and of its independent conformations (measured); frozen: lower bound of D."""
    fluid = (polymer.RADIUS, VISCOSITY, kT)
    kirkwood = beads.gaussianChainKirkwood(polymer.COUNT, polymer.BOND, *fluid)
    correction = to_infinite(molecule, polymer.GYRATION)
    short = estimate([value for exact, _ in measured for value in exact])
    moments = [displacements for _, part in measured for displacements in part]
    one_step = statistics.one_step_diffusion(moments, molecule.step).shifted(correction)
    long, curves, plain = long_time_rows(
        "polymer", wet, sampling, molecule.step, correction, short, (frozen, kirkwood), "frozen to Kirkwood")
    rouse = beads.freeDraining(polymer.COUNT, *fluid)
    rows = [
        Row("polymer", True, "short", ONE_STEP, one_step, kirkwood, "Kirkwood, ensemble"),
        Row("polymer", True, "short", FORCE, short.shifted(correction), kirkwood, "Kirkwood, ensemble"),
        *long,
        *free_rows("polymer", dry, sampling, molecule.step, rouse, "Rouse, D0/N", curves),
    ]
    facts = [*facts, _plain_fact(plain), _size_fact(correction, kirkwood, polymer.EDGE)]
    return Result("polymer", rows, curves, facts, molecule, wet[0].describe, positions)


def _submit(team, molecule, sampling, starts, seed, platform, trajectory):
    """Futures of the replicas with and without hydrodynamics: same molecule, step, starts. The first writes frames."""
    wet = [
        team.submit(run_replica, molecule, sampling, start, seed + i, platform, True, None if i else trajectory)
        for i, start in enumerate(starts)
    ]
    dry = [
        team.submit(run_replica, molecule, sampling, start, seed + FREE_SEED + i, platform, False)
        for i, start in enumerate(starts)
    ]
    return wet, dry


def _plain_fact(plain):
    value, error = (x * beads.M2_PER_S * 1e10 for x in plain)
    return f"long-time displacements alone, without the control variate: {value:.3f} +- {error:.3f} e-10 m^2/s"


def _size_fact(correction, value, edge):
    share = 100 * correction / value
    return f"box {edge:.0f} nm; finite-size correction added to all values with hydrodynamics: {share:.0f} %"
