# SPDX-License-Identifier: MIT
"""What the figures share: scenes, style, numbers in CSV files, and what of the library is available."""

import csv
import functools
import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen first)
import openmm  # noqa: E402
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import spheres as scenes  # noqa: E402
from openmmpse.accuracy import stages  # noqa: E402

# Okabe and Ito's palette: told apart with any colour vision, and in grey by the markers.
BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK = "#0072B2", "#D55E00", "#009E73", "#AA4499", "#56B4E9", "#222222"
CYCLE = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)
SPLIT_STYLE = {"Hasimoto": (BLUE, "o"), "Prolate": (ORANGE, "s")}
STYLE = {
    "font.size": 10.5,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": True,
    "legend.framealpha": 0.9,
    "legend.edgecolor": "none",
    "legend.fontsize": 9,
    "axes.grid": True,
    "grid.color": "#E2E2E2",
    "grid.linewidth": 0.7,
    "axes.axisbelow": True,
    "lines.linewidth": 1.7,
    "lines.markersize": 6,
}
LARGEST_PICTURE = 150_000  # bytes
REAL_WORDS = ("neighbour", "real", "pair", "Lanczos")


class Effort(NamedTuple):
    """How much to measure."""

    quick: bool
    threads: int

    def choose(self, quick, full):
        return quick if self.quick else full


@functools.lru_cache(maxsize=1)
def splits():
    """Names of the splits that the library has for an ordinary suspension."""
    positions, length = scenes.lattice(64, 0.1)
    system = scenes.makeSystem(64, length)
    names = []
    for name in ("Hasimoto", "Prolate"):
        try:
            _, integrator = scenes.hydrodynamic(system, positions, split=name, threads=1)
        except openmm.OpenMMException:
            continue
        if integrator.getNumericalParameters()["split"] == name:
            names.append(name)
    return tuple(names)


def realShare(integrator):
    """Share of the real half in the steps so far, by the names of the stages."""
    shares = stages.shares(integrator.getStageTimes())
    return sum(share for name, share in shares.items() if any(word in name for word in REAL_WORDS))


def writeRows(path, rows):
    """Dicts with the same keys as CSV."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({key: f"{value:.6g}" if isinstance(value, float) else value for key, value in row.items()})


def readRows(path):
    """What writeRows() wrote, numbers as float."""
    with open(path, newline="", encoding="utf-8") as file:
        return [{key: _value(text) for key, text in row.items()} for row in csv.DictReader(file)]


def _value(text):
    try:
        return float(text)
    except ValueError:
        return text


def where(rows, **wanted):
    """Rows whose entries are these."""
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def values(rows, key):
    return [row[key] for row in rows]


def millions(rows, key):
    """One entry of all rows, in millions."""
    return [row[key] / 1e6 for row in rows]


def distinct(rows, key):
    """Values of one entry in the order of their appearance."""
    return list(dict.fromkeys(row[key] for row in rows))


def panels(count, width=11.0, height=4.3):
    """A figure and its axes side by side; to be used within plt.rc_context(STYLE)."""
    figure, axes = plt.subplots(1, count, figsize=(width, height), constrained_layout=True, squeeze=False)
    return figure, axes[0]


def save(figure, path):
    """Write a PNG and complain if it is too large for the repository."""
    figure.savefig(path, dpi=100)
    plt.close(figure)
    if path.stat().st_size > LARGEST_PICTURE:
        raise ValueError(f"{path} has {path.stat().st_size} bytes, more than {LARGEST_PICTURE}; draw less or smaller")


def plainTicks(axis, subs=(1, 2, 5)):
    """Plain numbers at a few places of a logarithmic axis."""
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.0f}" if x >= 1000 else f"{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def markdown(header, lines):
    """Lines of a table."""
    return [
        "| " + " | ".join(header) + " |",
        "|" + "---|" * len(header),
        *("| " + " | ".join(line) + " |" for line in lines),
    ]


def count(number):
    """1,234 or 1.23 million."""
    return f"{number / 1e6:.2f} million" if number >= 1e6 else f"{number:,.0f}"


def rounded(number):
    """PTPS with two digits."""
    return f"{float(f'{number:.2g}'):,.0f}"
