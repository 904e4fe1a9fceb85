# SPDX-License-Identifier: MIT
"""How much is sampled, and what it costs."""

from __future__ import annotations

from typing import NamedTuple

#: Expected cost of an operation, in steps with hydrodynamics of about 160 beads; only the progress bar depends on it.
COST_STEP, COST_SAMPLE, COST_MOBILITY, COST_FREE_STEP = 1.0, 0.7, 0.4, 0.08


class Sampling(NamedTuple):
    """Amounts for one molecule. Lags and lengths in steps."""

    replicas: int
    run_in: int  #: steps left out at the start of each replica
    steps: int  #: recorded steps of each replica
    lag: int  #: of the long-time diffusion coefficient
    blocks: int  #: per replica, for error bars
    snapshots: int  #: of each replica, for one-step moments and dense theory
    samples: int  #: one-step displacements per snapshot
    free_steps: int  #: recorded steps of each replica without hydrodynamics

    @property
    def cost(self):
        recorded = self.run_in + self.steps * (1 + COST_MOBILITY)
        moments = self.snapshots * (self.samples * COST_SAMPLE + 3 * COST_MOBILITY)
        free = (self.run_in + self.free_steps) * COST_FREE_STEP
        return self.replicas * (COST_STEP * recorded + moments + free)


class Protocol(NamedTuple):
    protein: Sampling
    polymer: Sampling
    conformations: int  #: independent chains for the polymer's short-time diffusion
    samples: int  #: one-step displacements of each of them

    @property
    def cost(self):
        moments = self.conformations * (self.samples * COST_SAMPLE + 3 * COST_MOBILITY)
        return self.protein.cost + self.polymer.cost + moments


#: The protein's lag is 2.5 times the relaxation time of its slowest network mode. Displacements alone, with overlapping
#: windows in three dimensions, have a relative error of sqrt(4 lag/(9 steps)), 6 %; the control variate halves it.
FULL = Protocol(
    protein=Sampling(
        replicas=5, run_in=300, steps=5600, lag=225, blocks=4, snapshots=4, samples=250, free_steps=8000
    ),
    polymer=Sampling(replicas=10, run_in=0, steps=800, lag=200, blocks=1, snapshots=0, samples=0, free_steps=4000),
    conformations=200,
    samples=10,
)

#: An eighth of the sampling: the same results with error bars three times as wide.
QUICK = Protocol(
    protein=FULL.protein._replace(replicas=3, steps=1200, blocks=2, snapshots=2, samples=100, free_steps=3000),
    polymer=FULL.polymer._replace(replicas=4, steps=300, lag=100, free_steps=1000),
    conformations=40,
    samples=10,
)
