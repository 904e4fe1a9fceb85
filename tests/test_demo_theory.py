# SPDX-License-Identifier: MIT
"""The demo: theory and statistics against exact values, and its whole way from structure file to picture, in small."""

import csv
import math

import numpy as np
import pytest
from openmm import app

from openmmpse import demo
from openmmpse.analysis import beads, finiteSizeCorrection
from openmmpse.demo import network, protocol, report, statistics, structure, theory

WATER = 1.002 * beads.MPA_S
KT = beads.thermalEnergy(293.15)


def load_protein():
    try:
        return structure.load()
    except FileNotFoundError as error:
        pytest.skip(str(error))


def test_units():
    assert WATER == pytest.approx(603.418, abs=2e-3)
    assert KT == pytest.approx(1.380649e-23 * 6.02214076e23 * 293.15 / 1000, rel=1e-12)


def test_lysozyme():
    """The issue's numbers for its 162 beads: 1.28e-10 and 1.06e-10 m^2/s, 2.7e-12 without hydrodynamics."""
    protein = load_protein()
    assert protein.positions.shape == (162, 3)
    shape = (protein.positions, 0.484, WATER, KT)
    kirkwood, (rigid, rotation) = beads.kirkwood(*shape), beads.rigidBody(*shape)
    free = beads.freeDraining(162, 0.484, WATER, KT)
    assert kirkwood * beads.M2_PER_S == pytest.approx(1.2775e-10, abs=1e-14)
    assert rigid * beads.M2_PER_S == pytest.approx(1.0554e-10, abs=1e-14)
    assert free * beads.M2_PER_S == pytest.approx(2.733e-12, abs=1e-15)
    assert (round(kirkwood / free), round(rigid / free)) == (47, 39)
    assert rotation * 1e12 == pytest.approx(1.84e7, rel=1e-2)
    correction = finiteSizeCorrection(20.0, WATER, KT, 0.484, beads.radiusOfGyration(protein.positions))
    assert correction / rigid == pytest.approx(0.284, abs=0.005)

    springs = network.connect(protein.positions)
    linear = network.relax(springs, protein.positions, 0.484, WATER, KT)
    assert linear.weights.sum() == pytest.approx(kirkwood, rel=1e-10)
    # What is left when the network has relaxed is the rigid body (at its centroid, 0.1 % above the centre of diffusion).
    assert linear.weights[linear.rates == 0].sum() == pytest.approx(rigid, rel=2e-3)
    assert linear.fluctuation == pytest.approx(0.06, abs=0.002)
    assert linear.slowest_time < 60 < 100 < 225 * linear.step


def harmonic_walk(generator, steps, spring, step):
    """Two coordinates with a correlated mobility, three copies of them: paths of their mean and of its drift velocity."""
    mobility = np.array([[1.0, 0.4], [0.4, 0.5]])
    stiffness = spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    root = np.linalg.cholesky(mobility)
    x = np.zeros((2, 3))
    means, drifts = np.empty((steps, 3)), np.empty((steps, 3))
    noise = generator.normal(size=(steps, 2, 3)) * math.sqrt(2 * step)
    for n in range(steps):
        velocity = -mobility @ stiffness @ x
        means[n], drifts[n] = x.mean(axis=0), velocity.mean(axis=0)
        x = x + step * velocity + root @ noise[n]
    return means, drifts, mobility


def test_estimators_of_long_time_diffusion():
    """Two coupled beads: short time (1' M 1)/4 = 0.575, long time 1/(1' M^-1 1) = 0.34/0.7 = 0.485714, all exact in Euler steps."""
    step, lag, longest = 0.3, 30, 30
    runs = [harmonic_walk(np.random.default_rng(seed), 4000, 1.0, step) for seed in range(6)]
    paths, drifts = [run[0][200:] for run in runs], [run[1][200:] for run in runs]
    short, long = runs[0][2].sum() / 4, 1 / np.linalg.inv(runs[0][2]).sum()
    rate, weights = 0.7 * 1.0, np.array([long, short - long])  # mobility of the difference: 1 + 0.5 - 0.8
    lags = [1, 2, 5, lag]
    exact = theory.apparent_diffusion(np.array([0.0, rate]), weights, step, lags)

    plain, wide = statistics.displacement_diffusion(paths, step, lags, 4)
    noise = statistics.noise_paths(paths, drifts, step)
    controlled, narrow = statistics.displacement_diffusion(paths, step, lags, 4, noise, short)
    _, apparent, total = statistics.drift_integral(drifts, step, longest, 4)
    # False alarm rate of all 13 numbers together 1e-6: 8 standard errors (Student's distribution, 24 blocks).
    assert np.all(np.abs(plain - exact) < 8 * wide)
    assert np.all(np.abs(controlled - exact) < 8 * narrow)
    assert narrow[-1] < 0.75 * wide[-1]
    for count, value in zip(lags, exact):
        assert (
            abs(short - apparent[0][count - 1] - value) <= 8 * apparent[1][count - 1] + 1e-12
        )  # D(2 h) = D(0) exactly
    assert abs(short - total[0][-1] - long) < 8 * total[1][-1]
    assert total[1][-1] < narrow[-1]


def test_noise_path_is_the_noise():
    step, drift = 0.5, np.array([[1.0, 0, 0], [2.0, 0, 0], [3.0, 0, 0]])
    kicks = np.array([[0.1, 0, 0], [0.0, 0.2, 0]])
    path = np.vstack([np.zeros(3), np.cumsum(step * drift[:-1] + kicks, axis=0)])
    assert np.allclose(statistics.noise_paths([path], [drift], step)[0][1:], np.cumsum(kicks, axis=0))


def test_one_step_diffusion():
    generator = np.random.default_rng(8)
    measured = statistics.one_step_diffusion(
        generator.normal(scale=math.sqrt(2 * 0.7 * 0.01), size=(40, 100, 3)), 0.01
    )
    assert measured.deviation(0.7) < 5.8  # false alarm rate 1e-6 (Student's distribution, 40 groups)
    assert measured.error == pytest.approx(0.7 * math.sqrt(2 / 12000), rel=0.4)


def test_effects_are_read_from_the_description():
    description = "waves: on (how), because\nnoise: on\nshear flow: off, because the rate is 0\nstep: 2 ps"
    assert report.effects(description) == "Effects on: waves, noise; off: shear flow."


def test_whole_demo_in_small(tmp_path, monkeypatch):
    load_protein()
    small = protocol.Sampling(
        replicas=2, run_in=10, steps=120, lag=20, blocks=2, snapshots=1, samples=5, free_steps=400
    )
    monkeypatch.setattr(
        protocol, "QUICK", protocol.Protocol(small, small._replace(snapshots=0), conformations=8, samples=2)
    )
    assert demo.main(["--quick", "--output", str(tmp_path / "out")]) == 0
    with open(tmp_path / "out" / "diffusion.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 14
    # The same shape without a box: what the finite-size correction leads to, to the tolerance of both.
    infinite = next(row for row in rows if row["method"] == "force, unbounded")
    assert float(infinite["D_m2_per_s"]) == pytest.approx(float(infinite["theory_low_m2_per_s"]), rel=2e-3)
    # Short-time values under a force carry no noise but that of the shapes: a coarse check that all parts fit together.
    for molecule, expected in (("protein", 1.2775e-10), ("polymer", 0.718e-10)):
        row = next(row for row in rows if row["molecule"] == molecule and row["method"] == "velocity under a force")
        assert float(row["D_m2_per_s"]) == pytest.approx(expected, rel=0.02 if molecule == "protein" else 0.3)
    assert (tmp_path / "out" / "diffusion.png").read_bytes().startswith(b"\x89PNG")
    assert "Effects on:" in (tmp_path / "out" / "diffusion.txt").read_text(encoding="utf-8")
    for name, count in (("protein", 162), ("polymer", 100)):
        assert app.PDBFile(str(tmp_path / "out" / f"{name}.pdb")).topology.getNumAtoms() == count
        assert (tmp_path / "out" / f"{name}.dcd").stat().st_size > 2 * 12 * count  # two frames
