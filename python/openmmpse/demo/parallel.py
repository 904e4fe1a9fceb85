# SPDX-License-Identifier: MIT
"""Runs the replicas side by side, one process and one thread each, under one progress bar.

For a few hundred beads this beats many threads in one replica: nobody waits for anybody. It also makes every
replica reproducible to the bit, because forces are then summed in a fixed order.
"""

from __future__ import annotations

import multiprocessing
import os
import queue
import signal
from concurrent.futures import ProcessPoolExecutor

from tqdm import tqdm

MOST_PROCESSES = 8  #: more would wait for the protein's replicas

_progress = None  # queue to the bar, set in every worker process


def add_progress(cost):
    """Tell the bar that work of this cost is done, in steps with hydrodynamics; for use in a worker."""
    if _progress is not None:
        _progress.put(cost)


def _initialize(progress):
    global _progress
    _progress = progress
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # an interrupt ends a worker at once and without a traceback


class Team:
    """A process for every core. Tasks start in the order of their submission."""

    def __init__(self, total):
        context = multiprocessing.get_context("spawn")
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        self.size = min(cores, MOST_PROCESSES)
        self.progress = context.Queue()
        self.pool = ProcessPoolExecutor(self.size, context, _initialize, (self.progress,))
        self.bar = tqdm(
            total=total,
            desc=f"simulating in {self.size} processes",
            smoothing=0.05,
            bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}",
        )

    def submit(self, task, *arguments):
        return self.pool.submit(task, *arguments)

    def collect(self, futures):
        """Results in order of the futures; keeps the bar moving while it waits."""
        for future in futures:
            while not future.done():
                self._advance(0.2)
        self._advance(0.0)
        return [future.result() for future in futures]

    def finish(self):
        """All is done: fill the bar, whose costs are estimates."""
        self.bar.update(self.bar.total - self.bar.n)

    def close(self):
        """End the workers; what has not started is dropped."""
        self.bar.close()
        self.pool.shutdown(wait=True, cancel_futures=True)

    def _advance(self, patience):
        try:
            cost = self.progress.get(timeout=patience) if patience else self.progress.get_nowait()
            while True:
                self.bar.update(min(cost, self.bar.total - self.bar.n))
                cost = self.progress.get_nowait()
        except queue.Empty:
            return
