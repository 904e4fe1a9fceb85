# SPDX-License-Identifier: MIT
"""The picture of a measurement: error against time per step, with the recommended tolerance marked."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen first)
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: E402

from ..demo.figure import DRY, SHARP, STYLE, THEORY, WET  # noqa: E402

COLOURS = {"Hasimoto": WET, "Prolate": DRY}
MARKERS = {"Hasimoto": "o", "Prolate": "s"}


def draw(result, path):
    """Write the figure of a `Result` to a PNG file; rows without times are left out."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(8.5, 5.6), constrained_layout=True)
        for split in result.splits:
            _curve(axes, result, split)
        axes.set(xscale="log", yscale="log", xlabel="time per step (ms)", ylabel="relative error",
                 title=f"What accuracy costs: {result.count} particles, platform {result.platform}")  # fmt: skip
        axes.grid(True, which="major", color="#DDDDDD", lw=0.7)
        axes.set_axisbelow(True)
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        _widen(axes)
        _limits(axes, result)
        axes.legend(loc="upper right", frameon=True, framealpha=0.9, edgecolor="none")
        figure.savefig(path, dpi=110)
        plt.close(figure)


def _curve(axes, result, split):
    rows = [row for row in result.rowsOf(split) if row.seconds]
    if not rows:
        return
    colour, marker = COLOURS.get(split, SHARP), MARKERS.get(split, "D")
    times, errors = [1e3 * row.seconds for row in rows], [row.worst for row in rows]
    axes.plot(times, errors, marker=marker, color=colour, lw=1.8, ms=7, label=f"{split} split: largest error")
    axes.plot(times, [row.errors["random"] for row in rows], ls=":", color=colour, lw=1.5,
              label=f"{split} split: M f, random forces")  # fmt: skip
    for row, x, y in zip(rows, times, errors):
        axes.annotate(f"{row.tolerance:.0e}".replace("e-0", "e-"), (x, y), xytext=(7, 7), textcoords="offset points",
                      color=colour, fontsize=9)  # fmt: skip
    chosen = result.recommendation(split)
    for row, x, y in zip(rows, times, errors):
        if chosen and row.tolerance == chosen.tolerance:
            axes.plot([x], [y], marker="o", ms=18, mfc="none", mec=THEORY, mew=2, ls="none",
                      label=f"recommended, {split}: {row.tolerance:g}")  # fmt: skip


def _widen(axes):
    """Room for the labels of the points, of the lines and for the legend."""
    low, high = axes.get_xlim()
    axes.set_xlim(low, high * (high / low) ** 0.45)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.2)


def _limits(axes, result):
    """Horizontal lines of the run's other errors, or arrows to where they are beyond the picture."""
    if result.limits is None:
        return
    low, high = axes.get_ylim()
    named = [(result.limits.timeStep, "time-step error", "--"),
             (result.limits.statistical, f"statistical error of {result.runLength:,} steps", "-.")]  # fmt: skip
    named = [entry for entry in named if entry[0] is not None]
    for value, name, style in named:
        shown = min(max(value, low * 1.3), high / 1.3)
        beyond = "" if shown == value else " (beyond this picture)"
        lower = len(named) > 1 and value == min(entry[0] for entry in named)
        axes.axhline(shown, color=THEORY, lw=1.3, ls=style, zorder=1)
        below = lower and shown > low * 2
        axes.annotate(f"{name} {value:.1e}{beyond}", (0.99, shown), xycoords=axes.get_yaxis_transform(),
                      xytext=(0, -3 if below else 2), textcoords="offset points", fontsize=9, color=THEORY,
                      ha="right", va="top" if below else "bottom")  # fmt: skip
