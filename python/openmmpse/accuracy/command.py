# SPDX-License-Identifier: MIT
"""Command line: python -m openmmpse accuracy SYSTEM.xml STATE.xml [INTEGRATOR.xml] ..."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import openmm

from openmmpse import PSEBrownianIntegrator

from . import figure, report
from .scene import Scene, SceneError
from .sweep import ROUNDS, TOLERANCES, Sweep
from .timestep import BIAS
from .tuning import tune

SETTINGS = ("temperature", "viscosity", "radius", "step")


def main(argv=None):
    """Measure, print and write; returns the exit status: 0, 2 for bad input, 130 if interrupted."""
    options = _parser().parse_args(argv)
    try:
        scene = load(options).requireFluid()
        bar = _Bar()
        if options.tune:
            return _tune(scene, options, bar)
        return _sweep(scene, options, bar)
    except (SceneError, ValueError, OSError, openmm.OpenMMException) as error:
        print(f"accuracy: {error}", file=sys.stderr)
        return 2


def _parser():
    parser = argparse.ArgumentParser(
        prog="python -m openmmpse accuracy",
        description="Measure error and time of a step over tolerances, for your own scene, and recommend one.",
        epilog="Write the files with openmm.XmlSerializer.serialize(...) of the System, of "
        "context.getState(positions=True) and of the integrator. Options replace the settings of INTEGRATOR.xml.",
    )
    parser.add_argument("system", type=Path, metavar="SYSTEM.xml")
    parser.add_argument("state", type=Path, metavar="STATE.xml", help="positions and box")
    parser.add_argument("integrator", type=Path, nargs="?", metavar="INTEGRATOR.xml", help="a PSEBrownianIntegrator")
    for name, words in zip(SETTINGS, ("K", "Da/(nm ps); 1 mPa s = 602.214", "hydrodynamic, nm", "ps")):
        parser.add_argument(f"--{name}", type=float, help=words)
    parser.add_argument("--periodic", action="store_true", help="the fluid is periodic even if no Force is")
    parser.add_argument("--platform", default="CPU", help="OpenMM platform (default: %(default)s)")
    parser.add_argument("--property", action="append", default=[], metavar="NAME=VALUE", help="of the platform")
    parser.add_argument("--run-length", type=int, default=1_000_000, metavar="STEPS",
                        help="steps of the run that is planned (default: %(default)s)")  # fmt: skip
    parser.add_argument("--correlation-time", type=float, metavar="PS",
                        help="displacements count as independent after it (default: a^2/D0)")  # fmt: skip
    parser.add_argument("--bias", type=float, default=BIAS,
                        help="relative error of the stiffest mode that a step is recommended for (default: %(default)s)")  # fmt: skip
    parser.add_argument("--tolerances", type=float, nargs="+", metavar="TOL",
                        help="default: 1e-1 to 1e-8; with --tune one, default 1e-3")  # fmt: skip
    parser.add_argument("--split", choices=("automatic", "Hasimoto", "Prolate", "AllWaves", "both"), default="automatic")
    parser.add_argument("--budget", type=float, default=120.0, metavar="SECONDS",
                        help="for the tight run that errors are measured against (default: %(default)s)")  # fmt: skip
    parser.add_argument(
        "--rounds", type=int, default=ROUNDS, help="timed turns of each tolerance (default: %(default)s)"
    )
    parser.add_argument("--output", type=Path, default=Path("accuracy-output"), metavar="DIR",
                        help="folder of the results (default: %(default)s)")  # fmt: skip
    parser.add_argument("--tune", action="store_true",
                        help="instead, time other parameters than the automatic ones at one tolerance")  # fmt: skip
    return parser


def load(options):
    """The `Scene` that the command line names. Raises SceneError or OSError, naming the file."""
    system = _read(options.system, openmm.System, "System")
    state = _read(options.state, openmm.State, "State")
    try:
        positions = state.getPositions(asNumpy=True)
    except openmm.OpenMMException:
        raise SceneError(
            f"{options.state} holds no positions; write it from context.getState(positions=True)"
        ) from None
    return Scene(system, positions, _integrator(options), state.getPeriodicBoxVectors(), options.platform,
                 _properties(options.property))  # fmt: skip


def _read(path, kind, name):
    """The OpenMM object in an XML file."""
    try:
        content = openmm.XmlSerializer.deserialize(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise SceneError(f"{path} does not exist; the {name} is read from it") from None
    except (ValueError, openmm.OpenMMException) as error:
        raise SceneError(f"{path} is no XML file of OpenMM's ({error}); a {name} is expected") from None
    if not isinstance(content, kind):
        raise SceneError(f"{path} holds a {type(content).__name__}; a {name} is expected there")
    return content


def _integrator(options):
    """A PSEBrownianIntegrator from a file, from options, or from a file with options that replace its settings."""
    given = {name: getattr(options, name) for name in SETTINGS}
    if options.integrator is None:
        missing = [f"--{name}" for name, value in given.items() if value is None]
        if missing:
            raise SceneError(f"{', '.join(missing)} missing; give INTEGRATOR.xml or all of --{' --'.join(SETTINGS)}")
        integrator = PSEBrownianIntegrator(*given.values())
    else:
        read = _read(options.integrator, openmm.Integrator, "PSEBrownianIntegrator")
        if not PSEBrownianIntegrator.isinstance(read):
            raise SceneError(
                f"{options.integrator} holds a {type(read).__name__}; a PSEBrownianIntegrator is expected: "
                f"leave the file out and give --{' --'.join(SETTINGS)}"
            )
        integrator = PSEBrownianIntegrator.cast(read)
        setters = ("setTemperature", "setViscosity", "setRadius", "setStepSize")
        for setter, value in zip(setters, given.values()):
            if value is not None:
                getattr(integrator, setter)(value)
    if options.periodic:
        integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
    return integrator


def _properties(pairs):
    values = {}
    for pair in pairs:
        name, separator, value = pair.partition("=")
        if not separator:
            raise SceneError(f"--property {pair}: NAME=VALUE is expected, for example Threads=2")
        values[name] = value
    return values


class _Bar:
    """Progress bar in the style of the demo's; appears with the first piece of work."""

    def __init__(self):
        self._bar = None

    def __call__(self, text, share):
        if self._bar is None:
            from tqdm import tqdm

            self._bar = tqdm(total=1.0, miniters=0, bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}")
        self._bar.set_description_str(text, refresh=False)
        self._bar.update(max(0.0, share - self._bar.n))

    def close(self):
        if self._bar is not None:
            self._bar.close()


def _sweep(scene, options, bar):
    sweep = Sweep(scene, options.run_length, options.tolerances or TOLERANCES, options.split, options.correlation_time,
                  options.budget, options.rounds, bar, options.bias)  # fmt: skip
    options.output.mkdir(parents=True, exist_ok=True)
    status = 0
    try:
        sweep.run()
    except KeyboardInterrupt:
        status = 130
    finally:
        bar.close()
    result = sweep.result
    if result.referenceTolerance is None:
        print("interrupted before anything was measured", file=sys.stderr)
        return status
    lines = report.text(result)
    _write(options.output / "accuracy.txt", lines)
    report.writeCsv(result, options.output / "accuracy.csv")
    figure.draw(result, options.output / "accuracy.png")
    print("\n".join(lines))
    print(f"\nIn {options.output}: accuracy.txt, accuracy.csv, accuracy.png")
    return status


def _tune(scene, options, bar):
    tolerances = options.tolerances or [1e-3]
    if len(tolerances) > 1:
        raise SceneError(f"--tune takes one tolerance, {len(tolerances)} were given")
    if options.split == "both":
        raise SceneError("--tune takes one split; run it once with --split Hasimoto and once with --split Prolate")
    try:
        result = tune(scene, tolerance=tolerances[0], split=options.split, rounds=options.rounds, progress=bar)
    except KeyboardInterrupt:
        print("interrupted; nothing was changed", file=sys.stderr)
        return 130
    finally:
        bar.close()
    lines = report.tuningText(result)
    options.output.mkdir(parents=True, exist_ok=True)
    _write(options.output / "tuning.txt", lines)
    print("\n".join(lines))
    return 0


def _write(path, lines):
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
