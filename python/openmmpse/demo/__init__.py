# SPDX-License-Identifier: MIT
"""Demo: a real protein and a polymer moving through water, with and without hydrodynamic interactions.

python -m openmmpse demo [--output FOLDER] [--platform NAME] [--quick]
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path


def main(argv=None):
    """Run the demo with command-line arguments; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m openmmpse demo", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--output", type=Path, default=Path("demo-output"), help="folder of the results (default: %(default)s)"
    )
    parser.add_argument("--platform", default="CPU", help="OpenMM platform (default: %(default)s)")
    parser.add_argument(
        "--quick", action="store_true", help="an eighth of the sampling, error bars three times as wide"
    )
    options = parser.parse_args(argv)
    try:
        import matplotlib  # noqa: F401
        import tqdm  # noqa: F401
    except ImportError as error:
        print(f"the demo needs {error.name}; install it with: pip install {error.name}", file=sys.stderr)
        return 2
    import openmm
    from . import structure

    try:
        openmm.Platform.getPlatform(options.platform)
        protein = structure.load()
    except (openmm.OpenMMException, FileNotFoundError, ValueError) as error:
        print(error, file=sys.stderr)
        return 2
    options.output.mkdir(parents=True, exist_ok=True)
    return _run(protein, options)


def _run(structure, options):
    from . import experiments, figure, protocol, report
    from .parallel import Team

    begin = time.perf_counter()
    plan = protocol.QUICK if options.quick else protocol.FULL
    team = Team(plan.cost)
    try:
        pending = (
            experiments.protein(structure, plan.protein, options.platform, team, options.output),
            experiments.chain(plan, options.platform, team, options.output),
        )
        results = [evaluate() for evaluate in pending]
        team.finish()
    except KeyboardInterrupt:
        print("interrupted; only trajectories may have been written", file=sys.stderr)
        return 130
    finally:
        team.close()
    cost = report.tolerance_cost(results[0], options.platform)
    figure.draw(*results, options.output / "diffusion.png")
    report.write_csv(results, options.output / "diffusion.csv")
    lines = report.text(results, cost)
    complete = "\n".join(lines + report.descriptions(results)) + "\n"
    (options.output / "diffusion.txt").write_text(complete, encoding="utf-8")
    print("\n".join(lines))
    print(f"\n{time.perf_counter() - begin:.0f} s on platform {options.platform}. In {options.output}: diffusion.png, "
          "diffusion.txt, diffusion.csv, and trajectories protein.dcd and polymer.dcd with their .pdb")
    return 0
