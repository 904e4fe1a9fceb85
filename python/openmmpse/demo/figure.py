# SPDX-License-Identifier: MIT
"""The picture: both molecules, and their diffusion with and without hydrodynamics beside theory."""
from __future__ import annotations

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend must be chosen first)
import numpy as np  # noqa: E402
from matplotlib.collections import EllipseCollection  # noqa: E402

from openmmpse.analysis import beads  # noqa: E402

from .trajectories import DISPLACEMENT, DRIFT, FORCE, FREE_FORCE, ONE_STEP  # noqa: E402

# Okabe and Ito's palette: told apart with any colour vision, and in grey.
WET, DRY, SHARP, THEORY, BAND = "#0072B2", "#D55E00", "#009E73", "#222222", "#E8E3D3"
EXPERIMENT = (1.0e-10, 1.1e-10)  #: m^2/s, measured for lysozymes in water at 20 C
MARKERS = {ONE_STEP: "o", FORCE: "D", FREE_FORCE: "P", DISPLACEMENT: "s", DRIFT: "^"}
SMALL = 9.5  #: points, size of the notes
STYLE = {"font.size": 11, "axes.titlesize": 12, "axes.titleweight": "bold", "axes.titlelocation": "left",
         "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False, "legend.fontsize": SMALL}


def draw(protein, polymer, path):
    """Write the figure of two `Result`s to a PNG file."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(13, 9.2), constrained_layout=True)
        _molecules(axes[0, 0], protein, polymer)
        _ladder(axes[0, 1], protein)
        _protein_times(axes[1, 0], protein)
        _polymer_times(axes[1, 1], polymer)
        figure.suptitle("A protein and a polymer moving through water: OpenMM with hydrodynamic interactions",
                        fontsize=15, fontweight="bold")
        figure.savefig(path, dpi=130)
        plt.close(figure)


def _si(value):
    return np.asarray(value) * beads.M2_PER_S


def _molecules(axes, protein, polymer):
    """Both molecules as spheres of their hydrodynamic radius, at one scale."""
    radii = protein.molecule.radius, polymer.molecule.radius
    left, right = _spread_in_plane(protein.positions), _spread_in_plane(polymer.positions)
    right = right + [left[:, 0].max() + radii[0] + 2.0 + radii[1] - right[:, 0].min(), 0, 0]
    _spheres(axes, left, radii[0], plt.cm.Blues)
    _spheres(axes, right, radii[1], plt.cm.Oranges)
    both = np.vstack([left, right])
    low, high = both[:, :2].min(axis=0) - 1.0, both[:, :2].max(axis=0) + 1.0
    floor = low[1] - 1.0
    axes.set(xlim=(low[0], high[0]), ylim=(floor - 4.0, high[1]),
             title="What moves: spheres of the hydrodynamic radius, to scale")
    axes.set_aspect("equal", adjustable="box", anchor="C")
    axes.text(left[:, 0].mean(), floor, f"T4 lysozyme\n{len(left)} residues", ha="center", va="top")
    axes.text(right[:, 0].mean(), floor, f"ideal polymer\n{len(right)} beads", ha="center", va="top")
    bar = floor - 3.0
    axes.plot([low[0], low[0] + 2.0], [bar, bar], color=THEORY, lw=3, solid_capstyle="butt")
    axes.text(low[0] + 2.3, bar, "2 nm", ha="left", va="center")
    axes.axis("off")


def _spread_in_plane(positions):
    """Positions turned so that the molecule is seen from the side where it is widest; third column is the depth."""
    centred = positions - positions.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    return centred @ axes.T


def _spheres(axes, positions, radius, colours):
    order = np.argsort(positions[:, 2])
    axes.add_collection(EllipseCollection(
        2 * radius, 2 * radius, 0, units="xy", offsets=positions[order, :2], transOffset=axes.transData,
        facecolors=colours(np.linspace(0.25, 0.85, len(order))), edgecolors="white", linewidths=0.6))


def _ladder(axes, protein):
    """Diffusion coefficients of the protein on a logarithmic scale."""
    levels = [(2, True, "short", "with hydrodynamics\nshort times"),
              (1, True, "long", "with hydrodynamics\nlong times"),
              (0, False, None, "without\nhydrodynamics")]
    axes.axvspan(*EXPERIMENT, color=BAND, zorder=0)
    axes.text(EXPERIMENT[1], 2.62, "measured for\nlysozymes", ha="right", va="center", fontsize=SMALL)
    for y, wet, times, _ in levels:
        rows = [row for row in protein.rows
                if row.hydrodynamics == wet and times in (None, row.times) and row.method in MARKERS]
        for offset, row in zip(np.linspace(0.13, -0.13, len(rows)), rows):
            axes.errorbar(_si(row.measured.value), y + offset, xerr=_si(row.measured.error), ms=7, capsize=4, lw=1.8,
                          fmt=MARKERS[row.method], color=WET if wet else DRY, zorder=3)
        expected = _si(rows[0].expected)
        axes.plot([expected] * 2, [y - 0.28, y + 0.28], color=THEORY, lw=1.8, zorder=2)
        axes.text(expected, y - 0.33, f"{rows[0].theory}: {_scientific(expected)}", ha="right" if wet else "left",
                  va="top", fontsize=SMALL, color=THEORY)
    free = _si(protein.row(False, "long").expected)
    for y, row in ((2, protein.row(True, "short", FORCE)), (1, protein.row(True, "long", DRIFT))):
        value = _si(row.measured.value)
        axes.annotate("", xy=(value * 0.88, y), xytext=(free, y),
                      arrowprops={"arrowstyle": "->", "color": WET, "lw": 1.5})
        axes.text(free * 3.2, y + 0.06, f"{value / free:.0f} times faster", color=WET, va="bottom")
    axes.axvline(free, color=DRY, lw=1, ls=":", zorder=1)
    for method, marker in MARKERS.items():
        axes.plot([], [], marker, ms=7, color="grey", label=method)
    axes.legend(loc="lower right", bbox_to_anchor=(0.82, 0.0), labelspacing=0.2, borderpad=0.1)
    axes.set(xscale="log", xlim=(2e-12, 2.2e-10), ylim=(-0.6, 2.8), yticks=[level[0] for level in levels],
             yticklabels=[level[3] for level in levels], xlabel="diffusion coefficient (m$^2$/s)",
             title="Protein: the solvent makes the difference")


def _protein_times(axes, protein):
    """Apparent diffusion coefficient of the protein against lag."""
    scale = 1e10
    axes.axhspan(*(scale * x for x in EXPERIMENT), color=BAND, zorder=0)
    _note(axes, 0.02, scale * 1.004e-10, "measured for lysozymes")
    for row, x, shift, text in ((protein.row(True, "short"), 0.98, 0.006, "Kirkwood: every bead gives way on its own"),
                                (protein.row(True, "long"), 0.02, -0.022, "rigid body: the beads move as one")):
        level = scale * float(_si(row.expected))
        axes.axhline(level, color=THEORY, lw=1.3, ls="--", zorder=1)
        _note(axes, x, level + shift, text)
    # The first step is left out: the square of drift times step counts there. After two steps D is Kirkwood's again.
    linear, drift, displacements = (
        type(curve)(*(None if part is None else part[1:] for part in curve))
        for curve in (protein.curves[name] for name in ("linear theory", "drift", "displacements")))
    axes.plot(linear.times, scale * _si(linear.values), color=THEORY, lw=1, ls=":",
              label="linear theory of the network")
    values, errors = scale * _si(drift.values), scale * _si(drift.errors)
    axes.plot(drift.times, values, color=SHARP, lw=2, label="short-time value less drift correlations")
    axes.fill_between(drift.times, values - errors, values + errors, color=SHARP, alpha=0.25, lw=0)
    _points(axes, displacements, scale, WET, "displacements of the centre of mass")
    axes.set(xscale="log", xlabel="lag (ps)", ylabel="$D$ = displacement$^2$/6t  ($10^{-10}$ m$^2$/s)",
             ylim=(0.86, 1.36), title="Protein: from loose beads to one body")
    axes.legend(loc="lower left")


def _polymer_times(axes, polymer):
    """Apparent diffusion coefficients of the polymer with and without hydrodynamics."""
    wet, dry = polymer.row(True, "short", FORCE), polymer.row(False, "short")
    low, high = polymer.row(True, "long").expected
    axes.axhspan(_si(low), _si(high), color=BAND, zorder=0)
    for row, factor, text in ((wet, 1.15, "Kirkwood's formula, averaged over chains"),
                              (dry, 1.25, "Rouse: N times the friction of a bead")):
        axes.axhline(_si(row.expected), color=THEORY, lw=1.3, ls="--", zorder=1)
        _note(axes, 0.98, _si(row.expected) * factor, text)
    _note(axes, 0.98, _si(low) * 0.75, "theory of long times: between frozen chains and Kirkwood")
    _points(axes, polymer.curves["displacements"], 1, WET, "with hydrodynamics")
    _points(axes, polymer.curves["free"], 1, DRY, "without hydrodynamics")
    axes.text(0.5, _si(np.sqrt(wet.expected * dry.expected)), f"{wet.measured.value / dry.expected:.0f} times faster",
              transform=axes.get_yaxis_transform(), ha="center", va="center", color=WET)
    axes.set(xscale="log", yscale="log", xlabel="lag (ps)", ylabel="$D$ = displacement$^2$/6t  (m$^2$/s)",
             ylim=(_si(dry.expected) * 0.5, _si(wet.expected) * 2), title=f"Polymer of {polymer.molecule.count} beads")
    axes.legend(loc="lower left", bbox_to_anchor=(0, 0.2))


def _note(axes, x, y, text):
    """Text at the height y of the data and the share x of the width, growing towards the middle."""
    axes.text(x, y, text, transform=axes.get_yaxis_transform(), ha="right" if x > 0.5 else "left", fontsize=SMALL)


def _scientific(value):
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"${mantissa} \\times 10^{{{int(exponent)}}}$"


def _points(axes, curve, scale, colour, label):
    axes.errorbar(curve.times, scale * _si(curve.values), yerr=scale * _si(curve.errors), fmt="o", ms=5, color=colour,
                  capsize=3, lw=1.5, label=label, zorder=3)
