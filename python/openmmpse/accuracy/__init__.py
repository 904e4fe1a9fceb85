# SPDX-License-Identifier: MIT
"""What accuracy costs in time, for a scene of one's own: error of M f and of the noise against time per step.

    result = openmmpse.accuracy.measure(context, runLength=1_000_000)
    result = openmmpse.accuracy.measure(system, positions, integrator, runLength=1_000_000)
    print(result.recommended)
    print(openmmpse.accuracy.recommendStep(context, bias=0.01))

On the command line: `python -m openmmpse accuracy SYSTEM.xml STATE.xml INTEGRATOR.xml --run-length STEPS`.

docs/accuracy-and-speed.md explains the columns and the recommendation.
"""

from .limits import Limits
from .results import Result, Row
from .scene import Scene, SceneError
from .sweep import TOLERANCES, Sweep, measure
from .timestep import StepAdvice, recommendStep
from .tuning import Candidate, Tuning, tune

__all__ = [
    "Candidate", "Limits", "Result", "Row", "Scene", "SceneError", "StepAdvice", "Sweep", "TOLERANCES", "Tuning",
    "measure", "recommendStep", "tune",
]  # fmt: skip


def main(argv=None):
    """Run the command `accuracy` with command-line arguments; returns the exit status."""
    from . import command

    return command.main(argv)
