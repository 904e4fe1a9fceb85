# SPDX-License-Identifier: MIT
"""Many runs at once: killed workers, failing runs, checkpoints, and the table they end in."""
import functools
import importlib.util
import os
import re
import signal
from pathlib import Path

import numpy as np
import openmm
import pytest

from openmmpse import PSEBrownianIntegrator, analysis, ensemble
from platformnames import contextOn

ROOT = Path(__file__).resolve().parents[1]
INTERVAL, STEPS, EVERY = 5, 100, 4  # a checkpoint each 20 steps


def chain(seed, beads=12, platform="CPU", threads=None):
    """A Context with a chain in a small periodic box. Several threads add OpenMM's forces in any order."""
    system = openmm.System()
    system.setDefaultPeriodicBoxVectors(*(8.0 * np.eye(3)))
    bonds, soft = openmm.HarmonicBondForce(), openmm.CustomNonbondedForce("20*(1-r)^2")
    soft.setNonbondedMethod(soft.CutoffPeriodic)
    soft.setCutoffDistance(1.0)
    for i in range(beads):
        system.addParticle(1.0)
        soft.addParticle([])
        if i:
            bonds.addBond(i - 1, i, 0.9, 100.0)
    system.addForce(bonds)
    system.addForce(soft)
    integrator = PSEBrownianIntegrator(300.0, 600.0, 0.4, 2.0)
    integrator.setRandomNumberSeed(seed)
    context = contextOn(platform, system, integrator, threads)
    context.setPositions(0.9 * np.arange(beads)[:, None] * np.eye(3)[0])
    return context


def positionsOf(context):
    return np.array(context.getState(positions=True).getPositions(asNumpy=True)._value)


def wander(run):
    """The chain's positions; what kind of disturbance there is on the way is in the scene."""
    kind = run.scene["kind"] if isinstance(run.scene, dict) else run.scene
    context = chain(run.seed)

    def observe(context):
        with open(run.folder / "observed.txt", "a", encoding="utf-8") as file:
            file.write(f"{run.attempt} {context.getStepCount()}\n")
        marker = run.folder / "disturbed"
        if kind != "quiet" and context.getStepCount() == 75 and not marker.exists():
            marker.touch()
            if kind == "killed":
                os.kill(os.getpid(), signal.SIGKILL)
            raise RuntimeError("a passing trouble")
        if kind == "hopeless" and context.getStepCount() == 30:
            raise ValueError("no way out")
        return positionsOf(context)

    run.follow(context, 20, INTERVAL, name="run-in")
    path = run.follow(context, STEPS, INTERVAL, observe, every=EVERY)
    np.save(run.folder / "path.npy", path)
    threads = context.getPlatform().getPropertyValue(context, "Threads")
    return {"last": path[-1], "D": analysis.Estimate(1.0, 0.5), "threads": threads, "process": os.getpid()}


def testAKilledWorkerLosesNothing(tmp_path):
    """
    A run whose worker is killed, one that raises once and one that always does, beside quiet ones, on two processes:
    each path is to the bit that of a run that nothing disturbed.
    """
    pytest.importorskip("distributed")
    pytest.importorskip("pandas")
    from distributed import Client, LocalCluster
    scenes = [{"kind": kind, "size": 1} for kind in ("quiet", "killed", "flaky", "hopeless")]
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0",
                      silence_logs=50) as cluster, Client(cluster) as client:
        table = ensemble.runEnsemble(wander, scenes, [7], tmp_path / "sweep", client, retries=1, progress=False)
    assert list(table["kind"]) == ["quiet", "killed", "flaky", "hopeless"] and set(table["seed"]) == {7}
    assert list(table["attempts"]) == [1, 2, 2, 2]
    assert list(table["error"]) == ["", "", "", "ValueError: no way out"]
    assert list(table["D_error"][:3]) == [0.5] * 3 and list(table["threads"][:3]) == ["1"] * 3
    ensemble.perform(wander, {"kind": "quiet"}, 7, tmp_path / "alone")
    exact = np.load(tmp_path / "alone" / "path.npy")
    assert exact.shape == (STEPS // INTERVAL, 12, 3) and np.ptp(exact[:, 0], axis=0).min() > 0
    for i in range(3):
        folder = tmp_path / "sweep" / ensemble._name(scenes[i], 7)
        assert np.array_equal(np.load(folder / "path.npy"), exact)
        assert np.array_equal(table["last"][i], exact[-1])
        processes = [line.split()[-1] for line in (folder / "attempts.txt").read_text().splitlines()]
        assert len(processes) == table["attempts"][i] and processes[-1] == str(int(table["process"][i]))
        if scenes[i]["kind"] == "killed":
            assert processes[0] != processes[1]  # another worker
        # The second attempt goes on after the last checkpoint, at step 60; the first had come to 75.
        observed = [line.split() for line in (folder / "observed.txt").read_text().splitlines()]
        starts = {attempt: int(step) for attempt, step in reversed(observed)}
        assert starts == ({"1": 25} if i == 0 else {"1": 25, "2": 65})
    import pandas
    kept = pandas.read_csv(tmp_path / "sweep" / "table.csv")
    assert list(kept.columns) == list(table.columns) and list(kept["attempts"]) == [1, 2, 2, 2]
    # What is finished is read and not done again; no cluster is started for nothing.
    again = ensemble.runEnsemble(forbidden, scenes[:3], [7], tmp_path / "sweep")
    assert list(again["attempts"]) == [1, 2, 2] and np.array_equal(again["last"][1], exact[-1])


def forbidden(run):
    raise AssertionError("this was finished")


def testAResultInPlainSight(tmp_path):
    """One run here, as on a worker: its row, whatever `simulate` returns."""
    assert ensemble.perform(lambda run: run.seed**2, "a", 3, tmp_path / "a")["result"] == 9
    row = ensemble.perform(lambda run: {"x": np.float32(0.5), "list": np.arange(2)}, 4, 1, tmp_path / "b")
    assert row["x"] == 0.5 and row["list"] == [0, 1] and row["attempts"] == 1 and row["error"] == ""
    with pytest.raises(ValueError, match="may not be called seed"):
        ensemble.perform(lambda run: {"seed": 1}, 4, 1, tmp_path / "c")
    with pytest.raises(ValueError, match="may not be called beads"):
        ensemble.perform(lambda run: {"beads": 1}, {"beads": 3}, 1, tmp_path / "d")


@pytest.mark.hostOnly  # devices: test_restart.py
@pytest.mark.parametrize("elsewhere", [False, True])
def testCheckpointsAndStates(platformName, tmp_path, monkeypatch, elsewhere):
    """
    On the machine that wrote it a checkpoint is loaded, on another one the State. Both go on to the bit here, wherever
    in the life of a list of neighbours that is.
    """
    run, context, follower = ensemble.Run("x", 5, tmp_path), chain(5, platform=platformName, threads=1), None
    assert run.restore(context) is None
    for step in (17, 34, 51, 68, 85):
        context.getIntegrator().step(17)
        if follower:
            follower.getIntegrator().step(17)
            assert np.array_equal(positionsOf(follower), positionsOf(context))
        run.save(context, series=np.arange(3.0))
        before, follower = positionsOf(context), chain(5, platform=platformName, threads=1)
        with monkeypatch.context() as patch:
            if elsewhere:
                patch.setattr(ensemble, "_machine", lambda context: "another")
                patch.setattr(openmm.Context, "loadCheckpoint", None)
            assert list(ensemble.Run("x", 5, tmp_path).restore(follower)["series"]) == [0, 1, 2]
        assert follower.getStepCount() == context.getStepCount() == step
        assert np.array_equal(positionsOf(follower), before)


def testACheckpointIsWholeOrTheLastOne(tmp_path, monkeypatch):
    """Whoever dies while writing leaves the last checkpoint and no rubbish."""
    run, context = ensemble.Run("x", 5, tmp_path), chain(5)
    run.save(context, number=1)

    def tear(file, **content):
        file.write(b"half of it")
        raise OSError("disk full")
    monkeypatch.setattr(np, "savez", tear)
    with pytest.raises(OSError, match="disk full"):
        run.save(context, number=2)
    assert run.restore(context)["number"] == 1
    assert [path.name for path in tmp_path.iterdir()] == ["checkpoint.npz"]


def testWhatCannotBeAnEnsembleIsNamed(tmp_path):
    pytest.importorskip("distributed")
    pytest.importorskip("pandas")
    sweep = functools.partial(ensemble.runEnsemble, forbidden, folder=tmp_path)
    with pytest.raises(TypeError, match="build it in simulate"):
        sweep([openmm.System()], 1)
    with pytest.raises(ValueError, match="seeds must be positive"):
        sweep([1], [0, 1])
    with pytest.raises(ValueError, match="only once"):
        sweep([1, 1], 2)


def testWhatIsMissingIsNamed(tmp_path, monkeypatch):
    import sys
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r"distributed.*openmm-pse\[ensemble\]"):
        ensemble.runEnsemble(forbidden, [1], 1, tmp_path)


def testSeedsOfNoise(tmp_path):
    """Of their own for each scene and seed, the same wherever they are asked, and what setRandomNumberSeed() takes."""
    seeds = [ensemble.Run({"beads": n}, seed, tmp_path).noiseSeed for n in range(20) for seed in range(1, 21)]
    assert len(set(seeds)) == 400 and min(seeds) > 0 and max(seeds) < 2**31
    assert ensemble.Run({"beads": 4}, 7, tmp_path / "x").noiseSeed == seeds[4 * 20 + 6] == 1220271873
    chain(max(seeds))


def testNamesOfFolders():
    assert ensemble._name({"beads": 10, "box": 2.5}, 3).startswith("beads=10_box=2.5-")
    assert ensemble._name({"a": 1, "b": 2}, 1) == ensemble._name({"b": np.int64(2), "a": 1}, 1)
    assert ensemble._name("x" * 200, 1) != ensemble._name("x" * 201, 1)


# ---------------------------------------------------------------- the page and the example

def testThePageRuns(tmp_path):
    """One run of the script in docs/ensembles.md, a tenth as long: a sphere in its box."""
    page = ROOT / "docs" / "ensembles.md"
    script = re.search(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)[1]
    assert "20_000" in script
    found = {"__name__": "page"}
    exec(compile(script.replace("20_000", "2_000"), str(page), "exec"), found)
    row = ensemble.perform(found["simulate"], {"radius": 1.0}, 1, tmp_path)
    D = analysis.Estimate(row["D"], row["D_error"])
    kT, viscosity = analysis.thermalEnergy(293.15), 1.002 * analysis.MPA_S
    exact = kT * analysis.stokesMobility(1.0, viscosity) - analysis.finiteSizeCorrection(10.0, viscosity, kT, 1.0)
    assert D.deviation(exact) < 12  # false alarm rate 1e-6 (Student's distribution, 10 blocks)
    assert D.error < 0.2 * exact


def testTheExample(tmp_path, monkeypatch):
    """examples/parameter_sweep.py without its cluster: chains of five beads, with and without hydrodynamics."""
    pandas = pytest.importorskip("pandas")
    spec = importlib.util.spec_from_file_location("parameter_sweep", ROOT / "examples" / "parameter_sweep.py")
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    rows = []
    for wet in (True, False):
        for seed in range(1, 5):
            scene = {"beads": 5, "hydrodynamics": wet, "length": 5}
            rows.append(scene | ensemble.perform(example.simulate, scene, seed, tmp_path / f"{wet}{seed}"))
    table = pandas.DataFrame(rows)
    lines = example.draw(table, tmp_path / "picture.png")
    assert len(lines) == 2 and "Rouse 0.2000" in lines[1] and (tmp_path / "picture.png").stat().st_size > 5000
    alone = example.KT * analysis.stokesMobility(example.RADIUS, example.VISCOSITY)
    # Errors of the blocks of four runs have 36 degrees of freedom: false alarm rate below 1e-6.
    for wet, expected in ((True, table["Kirkwood"].mean() / alone), (False, 0.2)):
        runs = table[table["hydrodynamics"] == wet]
        error = np.sqrt(np.square(runs["D_error"]).sum()) / len(runs) / alone
        assert abs(runs["D"].mean() / alone - expected) < 6 * error
