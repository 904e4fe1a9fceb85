# SPDX-License-Identifier: MIT
"""The picture of what HydrodynamicsReporter wrote: iterations, error, cost and stress over time.

python -m openmmpse plot FILE.csv [--output FILE.png]
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import numpy

NEEDED = ("time_ps", "lanczos_iterations", "predicted_error")
SHARE = "share: "
STRESSES = {
    "osmotic_pressure_kJ_per_mol_nm3": "osmotic pressure",
    "shear_stress_xy_kJ_per_mol_nm3": "shear stress (xy)",
}
#: Okabe and Ito's palette with greys: told apart with any colour vision
COLOURS = ("#BBBBBB", "#E69F00", "#D55E00", "#56B4E9", "#0072B2", "#CC79A7", "#009E73")


class TableError(Exception):
    """Why a file cannot be drawn."""


def read(path):
    """{column: array of float64} of a file of HydrodynamicsReporter; empty fields are NaN.

    A last line that was cut off is left out. Raises TableError, naming the file, if it is none.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            header, *rows = list(csv.reader(file)) or [[]]
    except (OSError, UnicodeDecodeError) as error:
        raise TableError(f"{path} cannot be read: {error}") from None
    missing = [name for name in NEEDED if name not in header]
    if missing:
        raise TableError(f"{path} has no column {', '.join(missing)}; a file of HydrodynamicsReporter is expected")
    if rows and len(rows[-1]) != len(header):
        del rows[-1]
    if not rows:
        raise TableError(f"{path} has no line of numbers yet")
    try:
        numbers = numpy.array([[float(field) if field else numpy.nan for field in row] for row in rows])
    except ValueError as error:
        raise TableError(f"{path} has a line that is not one of numbers: {error}") from None
    return dict(zip(header, numbers.T))


def draw(columns, path):
    """Write the figure of a table that read() returned to a PNG file; columns that are absent are left out."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from .demo.figure import STYLE

    panels = [_iterations, _shares]
    panels += [_stress] if any(name in columns for name in STRESSES) else []
    panels += [_strain] if "strain" in columns else []
    scale, unit = _unitOf(columns["time_ps"])
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            len(panels), 1, figsize=(9, 1 + 2.7 * len(panels)), sharex=True, squeeze=False, constrained_layout=True
        )
        for panel, place in zip(panels, axes[:, 0]):
            panel(place, columns, columns["time_ps"] / scale)
        axes[-1, 0].set_xlabel(f"time ({unit})")
        figure.savefig(path, dpi=110)
        plt.close(figure)


def _unitOf(times):
    """The factor and the name of the unit in which times (ps) are easy to read."""
    for factor, unit in ((1e6, "µs"), (1e3, "ns")):
        if abs(times).max() >= 10 * factor:
            return factor, unit
    return 1.0, "ps"


def _iterations(axes, columns, time):
    """Lanczos iterations, and on a second axis the predicted error."""
    axes.step(time, columns["lanczos_iterations"], where="mid", color="#0072B2", lw=1.6)
    axes.set(title="Lanczos iterations and predicted error of M f", ylabel="iterations")
    axes.set_ylim(0, max(1, columns["lanczos_iterations"].max()) * 1.15)
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.yaxis.label.set_color("#0072B2")
    if columns["predicted_error"].max() > 0:
        right = axes.twinx()
        right.spines["right"].set_visible(True)
        right.plot(time, columns["predicted_error"], color="#D55E00", lw=1.6, ls="--")
        right.set_ylabel("predicted error", color="#D55E00")
        right.set_ylim(0, columns["predicted_error"].max() * 1.4)
        right.ticklabel_format(axis="y", style="sci", scilimits=(0, 0), useMathText=True)


def _shares(axes, columns, time):
    """What each part of the method costs, one above the other."""
    parts = {name: values for name, values in columns.items() if name.startswith(SHARE) and numpy.nansum(values) > 0}
    colours = [COLOURS[i % len(COLOURS)] for i, name in enumerate(n for n in columns if n.startswith(SHARE)) if name in parts]
    if parts:
        layers = axes.stackplot(
            time, *(100 * values for values in parts.values()), colors=colours, edgecolor="white", linewidth=0.4
        )
        labels = [name.removeprefix(SHARE) for name in parts]
        axes.legend(layers[::-1], labels[::-1], loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    axes.set(title="Cost of the steps so far, without the Forces", ylabel="share (%)", ylim=(0, 100))


def _stress(axes, columns, time):
    """Stresses, each with the mean of all lines."""
    for (name, title), colour in zip(STRESSES.items(), ("#0072B2", "#D55E00")):
        if name in columns:
            mean = numpy.nanmean(columns[name])
            axes.plot(time, columns[name], color=colour, lw=1.0, alpha=0.75, label=f"{title}, mean {mean:.3g}")
            axes.axhline(mean, color=colour, lw=1.4, ls="--")
    axes.set(title="Stress of the particles, and means of all lines", ylabel="kJ/(mol nm³)")
    axes.margins(y=0.25)
    axes.legend(loc="upper right", ncols=2)


def _strain(axes, columns, time):
    axes.plot(time, columns["strain"], color="#009E73", lw=1.8)
    axes.set(title="Strain", ylabel="strain")


def main(argv=None):
    """Draw the file on the command line; returns the exit status: 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(
        prog="python -m openmmpse plot", description="Draw what HydrodynamicsReporter wrote as a picture."
    )
    parser.add_argument("file", type=Path, metavar="FILE.csv")
    parser.add_argument("--output", type=Path, metavar="FILE.png", help="default: beside FILE.csv")
    options = parser.parse_args(argv)
    output = options.output or options.file.with_suffix(".png")
    try:
        columns = read(options.file)
        draw(columns, output)
    except (TableError, OSError) as error:
        print(f"plot: {error}", file=sys.stderr)
        return 2
    print(f"{len(columns['time_ps'])} lines of {options.file} are drawn in {output}")
    return 0
