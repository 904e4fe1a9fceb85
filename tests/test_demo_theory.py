# SPDX-License-Identifier: MIT
"""The demo: theory and statistics against exact values, and its whole way from structure file to picture, in small."""

import csv
import math

import numpy as np
import pytest
from openmm import app

from openmmpse import demo
from openmmpse.demo import network, polymer, protocol, report, statistics, structure, theory

UNIT = {"radius": 1.0, "viscosity": 1.0 / (6 * math.pi), "kT": 1.0}  # D0 = 1
WATER = 1.002 * theory.MPA_S
KT = theory.thermal_energy(293.15)


def load_protein():
    try:
        return structure.load()
    except FileNotFoundError as error:
        pytest.skip(str(error))


def test_units():
    assert WATER == pytest.approx(603.418, abs=2e-3)
    assert KT == pytest.approx(1.380649e-23 * 6.02214076e23 * 293.15 / 1000, rel=1e-12)


def pair_scalars(distance):
    """Mobility of two unit spheres on the x axis in units of 1/(6 pi eta a): along and across the pair."""
    matrix = theory.rpy_mobility(np.array([[0.0, 0, 0], [distance, 0, 0]]), 1.0, UNIT["viscosity"])
    assert np.allclose(matrix, matrix.T, atol=1e-15)
    return matrix[0, 3], matrix[1, 4]


@pytest.mark.parametrize(
    "distance, along, across", [(2.0, 0.625, 0.4375), (0.5, 0.90625, 0.859375), (0.0, 1.0, 1.0)]
)
def test_pair_mobility(distance, along, across):
    assert pair_scalars(distance) == pytest.approx((along, across), abs=1e-14)


def test_mobility_joins_at_contact():
    assert pair_scalars(2.0 - 1e-9) == pytest.approx(pair_scalars(2.0), abs=1e-8)


def test_doublet_translates_as_the_reference_says():
    doublet = np.array([[0.0, 0, 0], [0, 0, 2.0]])
    mean = (0.8125 + 2 * 0.71875) / 3
    assert theory.kirkwood(doublet, **UNIT) == pytest.approx(mean, abs=1e-14)
    assert theory.frozen_bound(doublet, **UNIT) == pytest.approx(mean, abs=1e-14)


def test_kirkwood_is_the_trace_of_the_dense_mobility():
    positions = np.random.default_rng(3).normal(scale=2.0, size=(12, 3))
    dense = theory.rpy_mobility(positions, 1.0, UNIT["viscosity"]).reshape(12, 3, 12, 3)
    assert theory.kirkwood(positions, **UNIT) == pytest.approx(np.einsum("iaja->", dense) / 3 / 144, rel=1e-13)


def test_rigid_body_is_minimal_at_its_centre_and_the_same_from_any_origin():
    positions = np.random.default_rng(4).normal(scale=2.0, size=(10, 3)) * [1, 1, 3]
    translation, rotation = theory.rigid_body(positions, **UNIT)
    moved = theory.rigid_body(positions + [5.0, -7.0, 2.0], **UNIT)
    assert moved == pytest.approx((translation, rotation), rel=1e-10)
    assert theory.frozen_bound(positions, **UNIT) < translation < theory.kirkwood(positions, **UNIT)


@pytest.mark.parametrize(
    "count, bond, expected",
    [
        (2, 2, 0.779432),
        (10, 2, 0.441176),
        (10, 4, 0.285586),
        (50, 4, 0.128453),
        (100, 2, 0.167527),
        (100, 4, 0.091133),
        (1000, 4, 0.029022),
    ],
)
def test_gaussian_chain(count, bond, expected):
    assert theory.gaussian_chain_kirkwood(count, bond, **UNIT) == pytest.approx(expected, abs=6e-7)


def test_gaussian_chain_is_the_average_over_drawn_chains():
    generator = np.random.default_rng(11)
    drawn = [theory.kirkwood(polymer.equilibrium(generator, 20, 2.0), **UNIT) for _ in range(400)]
    sampled = statistics.estimate(drawn)
    # False alarm rate 1e-6.
    assert sampled.deviation(theory.gaussian_chain_kirkwood(20, 2.0, **UNIT)) < 4.9
    assert sampled.error < 0.01 * sampled.value


def test_finite_size_of_one_sphere():
    assert 1.0 - theory.finite_size_correction(20.0, UNIT["viscosity"], 1.0, radius=1.0) == pytest.approx(
        0.85865872, abs=1e-8
    )


def test_lysozyme():
    """The issue's numbers for its 162 beads: 1.28e-10 and 1.06e-10 m^2/s, 2.7e-12 without hydrodynamics."""
    protein = load_protein()
    assert protein.positions.shape == (162, 3)
    beads = (protein.positions, 0.484, WATER, KT)
    kirkwood, (rigid, rotation) = theory.kirkwood(*beads), theory.rigid_body(*beads)
    free = theory.free_draining(162, 0.484, WATER, KT)
    assert kirkwood * theory.M2_PER_S == pytest.approx(1.2775e-10, abs=1e-14)
    assert rigid * theory.M2_PER_S == pytest.approx(1.0554e-10, abs=1e-14)
    assert free * theory.M2_PER_S == pytest.approx(2.733e-12, abs=1e-15)
    assert (round(kirkwood / free), round(rigid / free)) == (47, 39)
    assert rotation * 1e12 == pytest.approx(1.84e7, rel=1e-2)
    correction = theory.finite_size_correction(20.0, WATER, KT, theory.radius_of_gyration(protein.positions), 0.484)
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


def test_estimates():
    assert statistics.estimate([1.0, 2.0, 3.0]) == pytest.approx((2.0, 1 / math.sqrt(3)))
    assert statistics.Estimate(2.0, 0.5).deviation((0.0, 1.0)) == 2.0
    assert statistics.Estimate(2.0, 0.5).deviation((1.5, 3.0)) == 0.0
    assert statistics.Estimate(2.0, 0.3).minus(statistics.Estimate(1.0, 0.4)) == pytest.approx((1.0, 0.5))
    with pytest.raises(ValueError, match="at least 2 blocks"):
        statistics.estimate([1.0])
    with pytest.raises(ValueError, match="lag 30"):
        statistics.displacement_diffusion([np.zeros((40, 3))], 1.0, [30], 2)


def test_effects_are_read_from_the_description():
    description = "waves: on (why)\nnoise: on\nshear flow: off (rate 0)\nstep: 2 ps"
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
