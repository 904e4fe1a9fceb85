# SPDX-License-Identifier: MIT
"""Replicas of one molecule in its solvent, and the diffusion coefficients that follow from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from openmm import app

from openmmpse.analysis import Curve, Estimate, spacedLags

from . import protocol, statistics
from .parallel import add_progress
from .results import Row
from .simulate import Recorder, Solvent

ONE_STEP, FORCE = "one-step displacements", "velocity under a force"
DISPLACEMENT, DRIFT = "displacements", "drift correlations"
FREE_STEP, FREE_FORCE = "one-step, unbounded", "force, unbounded"  #: the first two, in infinite water
FREE_INTERVAL = 10  #: steps between records without hydrodynamics, where a record costs more than a step
FREE_SAMPLES, FREE_GROUPS = 1000, 10  #: one-step displacements per replica without hydrodynamics; in groups
FRAME_INTERVAL = 50  #: steps between frames of the trajectory file


class Replica(NamedTuple):
    """Records of one replica; lengths in nm, velocities in nm/ps."""

    centres: np.ndarray  #: (records, 3)
    drifts: np.ndarray  #: (records, 3), every step; empty without hydrodynamics
    moments: list  #: (samples, 3) one-step displacements of the centre, one entry per snapshot
    exact: list  #: exact short-time diffusion coefficient in the box, one per snapshot
    unbounded: tuple  #: lists of both, of the same snapshots in an unbounded fluid
    snapshots: list  #: (N, 3) each
    describe: str  #: what the integrator says of itself


def run_replica(molecule, sampling, start, seed, platform, hydrodynamics=True, trajectory=None):
    """One replica from `start`; writes trajectory.pdb and trajectory.dcd if a path is given."""
    solvent = Solvent(molecule, platform, seed, hydrodynamics)
    interval, steps, cost = (
        (1, sampling.steps, protocol.COST_STEP)
        if hydrodynamics
        else (FREE_INTERVAL, sampling.free_steps, protocol.COST_FREE_STEP)
    )
    replica = Replica([], [], [], [], ([], []), [], "")
    infinite = Solvent(molecule, platform, seed, unbounded=True) if hydrodynamics and sampling.snapshots else None
    solvent.place(start)
    solvent.run(sampling.run_in, cost)
    recorder = Recorder(solvent.integrator, interval, drift=hydrodynamics)
    reporters = [recorder] + ([_frames(solvent, trajectory)] if trajectory else [])
    segments = max(1, sampling.snapshots) if hydrodynamics else 1
    recorded_cost = cost + (protocol.COST_MOBILITY if hydrodynamics else 0)
    for _ in range(segments):
        solvent.run(steps // segments, recorded_cost, reporters)
        if hydrodynamics and sampling.snapshots:
            replica.snapshots.append(solvent.positions)
            _measure_short_time(solvent, sampling.samples, replica.exact, replica.moments)
            infinite.place(replica.snapshots[-1])
            _measure_short_time(infinite, sampling.samples, *replica.unbounded, cost=0)
    if not hydrodynamics:
        replica.moments.extend(np.split(solvent.one_step_displacements(FREE_SAMPLES), FREE_GROUPS))
    return replica._replace(
        centres=np.array(recorder.centres), drifts=np.array(recorder.drifts), describe=solvent.integrator.describe()
    )


def run_conformations(molecule, conformations, samples, seed, platform):
    """Short-time diffusion of conformations: exact values (in the box) and one-step displacements of the centre."""
    solvent = Solvent(molecule, platform, seed)
    exact, moments = [], []
    for conformation in conformations:
        solvent.place(conformation)
        _measure_short_time(solvent, samples, exact, moments)
    return exact, moments


def _measure_short_time(solvent, samples, exact, moments, cost=1):
    exact.append(solvent.short_time_diffusion())
    moments.append(solvent.one_step_displacements(samples))
    add_progress(cost * (samples * protocol.COST_SAMPLE + 3 * protocol.COST_MOBILITY))


def long_time_rows(name, replicas, sampling, step, correction, short, expected, label):
    """Rows and curves of the long-time value with hydrodynamics, and its estimate by displacements alone.

    short: Estimate of the short-time value in the box; correction: to infinite solvent, nm^2/ps.
    """
    lags = spacedLags(sampling.lag)
    centres, drifts = [replica.centres for replica in replicas], [replica.drifts for replica in replicas]
    plain, spread = statistics.displacement_diffusion(centres, step, lags, sampling.blocks)
    noise = statistics.noise_paths(centres, drifts, step)
    mean, error = statistics.displacement_diffusion(centres, step, lags, sampling.blocks, noise, short.value)
    error = np.hypot(error, statistics.CONTROL * short.error)
    times, apparent, total = statistics.drift_integral(drifts, step, sampling.lag, sampling.blocks)
    direct = Estimate(float(mean[-1]), float(error[-1])).shifted(correction)
    sharp = short.minus(Estimate(float(total[0][-1]), float(total[1][-1]))).shifted(correction)
    rows = [
        Row(name, True, "long", DISPLACEMENT, direct, expected, label),
        Row(name, True, "long", DRIFT, sharp, expected, label),
    ]
    curves = {
        "displacements": Curve(np.array(lags) * step, mean + correction, error),
        "drift": Curve(times, short.value + correction - apparent[0], np.hypot(short.error, apparent[1])),
    }
    return rows, curves, Estimate(float(plain[-1]), float(spread[-1])).shifted(correction)


def free_rows(name, replicas, sampling, step, expected, label, curves):
    """Rows without hydrodynamics; adds their curve to `curves`."""
    lags = spacedLags(sampling.lag // FREE_INTERVAL)
    mean, error = statistics.displacement_diffusion(
        [replica.centres for replica in replicas], FREE_INTERVAL * step, lags, sampling.blocks
    )
    curves["free"] = Curve(np.array(lags) * FREE_INTERVAL * step, mean, error)
    long = Estimate(float(mean[-1]), float(error[-1]))
    short = statistics.one_step_diffusion(np.concatenate([replica.moments for replica in replicas]), step)
    return [
        Row(name, False, "short", ONE_STEP, short, expected, label),
        Row(name, False, "long", DISPLACEMENT, long, expected, label),
    ]


def _frames(solvent, trajectory):
    """Reporter of the trajectory file, with the topology that reads it beside it."""
    topology = solvent.simulation.topology
    with open(trajectory.with_suffix(".pdb"), "w", encoding="utf-8") as file:
        app.PDBFile.writeFile(topology, solvent.positions, file)
    return app.DCDReporter(str(trajectory.with_suffix(".dcd")), FRAME_INTERVAL, enforcePeriodicBox=False)
