# SPDX-License-Identifier: MIT
"""Many runs at once, scene by seed, on the workers of Dask distributed; docs/ensembles.md.

    def simulate(run):
        context = build(run.scene, run.seed)
        centres = run.follow(context, steps=100_000, interval=100, observe=centreOfMass)
        return {"D": analysis.diffusion(centres, 100 * dt).coefficient}

    if __name__ == "__main__":
        table = ensemble.runEnsemble(simulate, [{"beads": n} for n in (10, 20, 40)], seeds=8, folder="sweep")

Dask places the runs, notices what fails and starts it again; a run goes on from its last checkpoint.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import re
import socket
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import openmm

from openmmpse.analysis.estimates import Estimate

__all__ = ["Run", "perform", "runEnsemble"]

CHECKPOINT, RESULT, ATTEMPTS, TABLE = "checkpoint.npz", "result.json", "attempts.txt", "table.csv"
CHECKPOINTS = 20  #: in a series that `Run.follow` records, unless told otherwise
OWN = ("seed", "attempts", "seconds", "error")  #: columns of the table that are not of scenes or results
INSTALL = "install what it needs with: pip install 'openmm-pse[ensemble]'"


class Run:
    """One run: a scene, a seed, and a folder that survives whoever works on it.

    Parameters
    ----------
    scene, seed
        what `simulate` is to be done with
    folder : path
        of this run alone: for files of one's own, too
    """

    def __init__(self, scene, seed, folder):
        self.scene, self.seed, self.folder = scene, seed, Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self._series = None

    @property
    def noiseSeed(self):
        """A seed for random numbers of its own for each scene and seed, from 1 to 2^31 - 1.

        The integrator's noise depends on its seed, the step and the particle alone. With run.seed runs of different
        scenes share it: differences between scenes get smaller errors, but results of scenes are not independent.
        """
        digest = hashlib.sha256(f"{_text(self.scene)} {self.seed}".encode()).digest()
        return 1 + int.from_bytes(digest[:8], "little") % (2**31 - 1)

    @property
    def attempt(self):
        """1, and one more each time that the run is begun again."""
        path = self.folder / ATTEMPTS
        return len(path.read_text(encoding="utf-8").splitlines()) if path.exists() else 0

    def save(self, context, **arrays):
        """Write a checkpoint, and arrays that belong to it, in place of the last one: all of it or nothing.

        The Context is left as one is that restores it, so that a run with checkpoints and one that was begun again from
        any of them are the same to the bit.
        """
        context = getattr(context, "context", context)
        state = context.getState(positions=True, velocities=True, parameters=True, integratorParameters=True)
        checkpoint = context.createCheckpoint()
        content = {
            "checkpoint": np.frombuffer(checkpoint, dtype=np.uint8),
            "state": np.array(openmm.XmlSerializer.serialize(state)),
            "machine": np.array(_machine(context)),
            **{f"array {name}": np.asarray(value) for name, value in arrays.items()},
        }
        _replace(self.folder / CHECKPOINT, lambda file: np.savez(file, **content))
        _forgetLists(context, checkpoint)

    def restore(self, context):
        """Bring a Context to the last checkpoint and return the arrays saved with it; None if there is no checkpoint.

        OpenMM's checkpoints are bound to version, platform and device. Where those are the same, one is loaded and the
        run goes on as if nothing had happened, to the bit. Elsewhere it goes on from the State that is kept beside:
        with all digits and, for the PSEBrownianIntegrator with the same seed, the same noise, while random numbers of
        others, as a barostat's, begin anew.
        """
        path = self.folder / CHECKPOINT
        if not path.exists():
            return None
        context = getattr(context, "context", context)
        with np.load(path, allow_pickle=False) as content:
            if str(content["machine"]) == _machine(context):
                context.loadCheckpoint(content["checkpoint"].tobytes())
            else:
                context.setState(openmm.XmlSerializer.deserialize(str(content["state"])))
            prefix = "array "
            return {name[len(prefix) :]: content[name] for name in content.files if name.startswith(prefix)}

    def follow(self, context, steps, interval, observe=None, name="records", every=None):
        """Make steps and return what is observed between them, an array (steps // interval, ...).

        Checkpoints are written on the way, with what was observed so far, and at the end. In a run that is begun again
        the first call restores the last checkpoint, so what was made of the Context before it (positions, a
        minimisation) does not count then. Several series may follow each other, each of a name of its own; between
        them nothing may change the Context. Trajectory files of reporters do not know of any of this: observe what is
        needed, or write to run.folder in `observe`.

        Parameters
        ----------
        context : openmm.Context or app.Simulation
            of a Simulation the Context is used, its reporters are not
        steps, interval : int
            in all, and between two records
        observe : callable, optional
            observe(context) returns a number or an array of always the same shape; by default nothing is recorded
        name : str
            of the series
        every : int, optional
            records from one checkpoint to the next; by default a twentieth of all
        """
        context = getattr(context, "context", context)
        if self._series is None:
            self._series = self.restore(context) or {}
        total, records = steps // interval, list(self._series.get(name, ()))
        every = every or max(1, total // CHECKPOINTS)
        while len(records) < total:
            context.getIntegrator().step(interval)
            records.append(np.asarray(observe(context) if observe else ()))
            if len(records) % every == 0 or len(records) == total:
                self._series[name] = np.array(records)
                self.save(context, **self._series)
        return np.array(records)


def runEnsemble(simulate, scenes, seeds, folder, client=None, threads=1, retries=2, progress=True):
    """Do simulate(run) for every scene with every seed, and return one table.

    Scripts need if __name__ == "__main__" around the call, as with all processes in Python. An exception in a run
    loses no other run: it is told in the table.

    Parameters
    ----------
    simulate : callable
        of a `Run`; returns a dict of results, or one. Numbers, texts, `openmmpse.analysis.Estimate` (two columns) and
        arrays (lists in the table) will do. Workers load it by its module, or get a copy if that is the script
    scenes : list
        plain values that describe what to simulate: numbers, texts, dicts or lists of them. Keys of dicts become
        columns of the table
    seeds : int or list of int
        positive numbers, or how many of them, from 1; give run.noiseSeed or run.seed to the integrator
    folder : path
        of all files; all workers must see it. What is finished in there is not done again, so the same call goes on
        where it was interrupted, or adds scenes and seeds: take a new folder for another `simulate`
    client : distributed.Client, optional
        by default that of a cluster of processes on this machine, one for every `threads` cores, which ends with the
        call
    threads : int
        of OpenMM's CPU platform, per run: sums of forces are the same to the bit with one alone
    retries : int
        how often a run that raises an exception is tried again, from its last checkpoint; how many workers may be lost
        under a run is Dask's setting distributed.scheduler.allowed-failures (three)
    progress : bool
        show a bar

    Returns
    -------
    pandas.DataFrame
        columns of scenes, seed, those of results, attempts, seconds of the last one, and error: the text of the
        exception of a run that failed to the end, else empty. It is also in folder/table.csv
    """
    _need("distributed", "pandas")
    folder = Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    runs = [(scene, seed, folder / _name(scene, seed)) for scene in scenes for seed in _seeds(seeds)]
    if len({path for _, _, path in runs}) < len(runs):
        raise ValueError("each scene and each seed may be given only once")
    rows = {path: _read(path / RESULT) for _, _, path in runs if (path / RESULT).exists()}
    pending = [run for run in runs if run[2] not in rows]
    try:
        if pending:
            _distribute(simulate, pending, rows, client, threads, retries, progress)
    finally:
        table = _table(runs, rows)
        _replace(folder / TABLE, lambda file: file.write(table.to_csv(index=False).encode()))
    return table


def perform(simulate, scene, seed, folder, threads=1):
    """Do one run here, as a worker does it, and return its row: for trying `simulate` without a cluster."""
    openmm.Platform.getPlatform("CPU").setPropertyDefaultValue("Threads", str(threads))
    os.environ["OPENMM_CPU_THREADS"] = str(threads)  # for processes that this one starts
    run = Run(scene, seed, folder)
    with open(run.folder / ATTEMPTS, "a", encoding="utf-8") as file:
        file.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')} {socket.gethostname()} process {os.getpid()}\n")
    begin = time.perf_counter()
    row = _columns(simulate(run), scene)
    row |= {"attempts": run.attempt, "seconds": round(time.perf_counter() - begin, 3), "error": ""}
    text = json.dumps(row, default=_plain)
    _replace(run.folder / RESULT, lambda file: file.write(text.encode()))
    return json.loads(text)


def _distribute(simulate, pending, rows, client, threads, retries, progress):
    """Have the pending runs done; their rows are added as they come."""
    from dask import system
    from distributed import Client, LocalCluster, as_completed
    from tqdm import tqdm

    own = None
    if client is None:
        workers = max(1, min(system.CPU_COUNT // threads, len(pending)))
        own = LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=":0")
        client = Client(own)
    futures = {}
    try:
        for scene, seed, path in pending:
            options = {"pure": False, "retries": retries}
            futures[client.submit(perform, simulate, scene, seed, path, threads, **options)] = path
        with tqdm(total=len(pending), desc="runs", unit="run", disable=not progress) as bar:
            for future in as_completed(list(futures)):
                path = futures.pop(future)
                rows[path] = future.result() if future.status == "finished" else _failure(future, path)
                future.release()
                bar.update()
    finally:
        client.cancel(list(futures))
        if own is not None:
            client.close()
            own.close()


def _failure(future, path):
    """Row of a run that failed to the end."""
    error = future.exception() if future.status == "error" else None
    text = f"{type(error).__name__}: {error}" if error is not None else f"the run was {future.status}"
    return {"attempts": Run(None, None, path).attempt, "error": text}


def _columns(result, scene):
    """Results as columns of the table."""
    result = result if isinstance(result, Mapping) else {"result": result}
    row = {}
    for name, value in result.items():
        estimate = isinstance(value, Estimate)
        row |= {name: value.value, f"{name}_error": value.error} if estimate else {name: value}
    taken = sorted(set(row) & {*OWN, *(scene if isinstance(scene, Mapping) else ("scene",))})
    if taken:
        names = ", ".join(taken)
        raise ValueError(f"results may not be called {names}: these are columns of the scene or of the table")
    return row


def _table(runs, rows):
    """All rows so far as a DataFrame, in order of scenes and seeds."""
    import pandas

    lines = []
    for scene, seed, path in runs:
        columns = dict(scene) if isinstance(scene, Mapping) else {"scene": scene}
        lines.append(columns | {"seed": seed} | rows.get(path, {"error": "not done"}))
    table = pandas.DataFrame(lines)
    last = [name for name in OWN[1:] if name in table]
    return table[[name for name in table if name not in last] + last]


def _seeds(seeds):
    seeds = list(range(1, seeds + 1)) if isinstance(seeds, (int, np.integer)) else [int(seed) for seed in seeds]
    if not seeds or min(seeds) < 1:
        raise ValueError(f"seeds must be positive numbers, as 0 draws another one each time; got {seeds}")
    return seeds


def _name(scene, seed):
    """Folder of a run: readable, and different for different scenes."""
    text = _text(scene)
    words = re.sub(r"[^A-Za-z0-9.=+-]+", "_", text.replace('": ', "=")).strip("_")[:48]
    return f"{words}-{hashlib.sha256(text.encode()).hexdigest()[:8]}-seed{seed}"


def _text(scene):
    """The same text for the same scene, everywhere."""
    try:
        return json.dumps(scene, sort_keys=True, default=_plain)
    except TypeError:
        raise TypeError(
            f"scene {scene!r}: expected numbers, texts, or lists and dicts of them, which can be told apart on every "
            "machine; give what describes a System, and build it in simulate()"
        ) from None


def _machine(context):
    """What a checkpoint is bound to."""
    device = context.getPlatform()
    names = [name for name in ("DeviceName", "Precision") if name in device.getPropertyNames()]
    properties = [device.getPropertyValue(context, name) for name in names]
    return " ".join([openmm.Platform.getOpenMMVersion(), platform.machine(), device.getName(), *properties])


def _forgetLists(context, checkpoint):
    """Have OpenMM's CPU platform make its list of neighbours anew.

    It keeps a list while particles are near the places where it was made, whatever is loaded, and the order in it is
    that in which forces are rounded. Eight periods away, which changes no energy of a periodic System and is beyond the
    room that lists of others have, it must make another one, and back again, too.
    """
    if context.getPlatform().getName() != "CPU":
        return
    state = context.getState(positions=True)
    shift = 8 * state.getPeriodicBoxVectors(asNumpy=True)[0]
    try:
        context.setPositions(state.getPositions(asNumpy=True) + shift)
        context.getState(energy=True)
    except openmm.OpenMMException:
        pass  # a Force that minds the place; the list comes before
    finally:
        context.loadCheckpoint(checkpoint)


def _plain(value):
    """NumPy's numbers and arrays, for JSON."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no number, text, list or dict: {value!r}")


def _read(path):
    return json.loads(path.read_text(encoding="utf-8"))


def _replace(path, write):
    """Write a file beside and put it in place at once: whoever is killed in between leaves the last one whole."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _need(*modules):
    for module in modules:
        try:
            __import__(module)
        except ImportError:
            raise ImportError(f"runEnsemble() uses {module}; {INSTALL}", name=module) from None
