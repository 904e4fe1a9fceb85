# SPDX-License-Identifier: MIT
"""The table, in words, as text and as CSV, and what the tolerance cost."""

from __future__ import annotations

import csv
import re
import time
from typing import NamedTuple

from openmmpse.analysis import beads

from . import simulate
from .results import AGREEMENT
from .simulate import Solvent
from .trajectories import DRIFT, FORCE

TIGHT_TOLERANCE = 1e-5  #: the comparison that tells what the demo's tolerance cost
TIMED_STEPS = 40


class ToleranceCost(NamedTuple):
    """The demo's tolerance against a much tighter one, for the protein."""

    difference: float  #: relative, of the short-time diffusion coefficient
    predicted: float  #: relative, the integrator's own estimate for velocities
    seconds: float  #: per step
    tight_seconds: float


def tolerance_cost(result, platform):
    """Measure `ToleranceCost` at the last configuration of a molecule."""
    values, seconds, predicted = [], [], []
    for tolerance in (simulate.TOLERANCE, TIGHT_TOLERANCE):
        solvent = Solvent(result.molecule, platform, seed=1, tolerance=tolerance)
        solvent.place(result.positions)
        values.append(solvent.short_time_diffusion())
        solvent.simulation.step(5)
        start = time.perf_counter()
        solvent.simulation.step(TIMED_STEPS)
        seconds.append((time.perf_counter() - start) / TIMED_STEPS)
        predicted.append(solvent.integrator.getNumericalParameters()["predictedError"])
    return ToleranceCost(abs(values[0] / values[1] - 1), predicted[0], *seconds)


def table(results):
    """Lines of the table of all measured diffusion coefficients, in 1e-10 m^2/s."""
    lines = [f"{'':9}{'hydrodyn.':11}{'times':7}{'method':25}{'measured':>17}   {'theory':28}{'std. errors':>11}",
             "-" * 111]
    for result in results:
        for row in result.rows:
            low, high = _interval(row)
            expected = _number(low) if low == high else f"{_number(low)}-{_number(high)}"
            switch = "on" if row.hydrodynamics else "off"
            lines.append(f"{row.molecule:9}{switch:11}{row.times:7}{row.method:25}{_measured(row):>17}   "
                         f"{expected + '  ' + row.theory:28}{row.deviation:>9.1f}{'' if row.agrees else ' !'}")
    return [*lines,
            "diffusion coefficients of the centre of mass in 1e-10 m^2/s, infinite solvent; +- one standard error;",
            f"last column: distance from theory in standard errors, up to {AGREEMENT:.0f} count as agreement"]


def write_csv(results, path):
    """All rows with units in the header."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["molecule", "hydrodynamics", "times", "method", "D_m2_per_s", "standard_error_m2_per_s",
                         "theory_low_m2_per_s", "theory_high_m2_per_s", "theory", "distance_in_standard_errors"])
        for result in results:
            for row in result.rows:
                numbers = [f"{x * beads.M2_PER_S:.6e}" for x in (*row.measured, *_interval(row))]
                writer.writerow([row.molecule, "on" if row.hydrodynamics else "off", row.times, row.method, *numbers,
                                 row.theory, f"{row.deviation:.2f}"])


def text(results, cost):
    """Lines of the whole report."""
    facts = [f"{result.name}: {fact}" for result in results for fact in result.facts]
    return [*facts, "", *table(results), "", *summary(*results, cost)]


def descriptions(results):
    """Lines that the integrators say of themselves."""
    lines = []
    for result in results:
        lines += ["", f"The integrator of the {result.name} with hydrodynamics:"]
        lines += ["  " + line for line in result.describe.splitlines()]
    return lines


def effects(description):
    """One sentence from the lines "effect: on ..." and "effect: off ..." of an integrator's description."""
    switches = re.findall(r"^(.+?): (on|off)\b", description, re.MULTILINE)
    on = [name for name, state in switches if state == "on"]
    off = [name for name, state in switches if state == "off"]
    return f"Effects on: {', '.join(on) or 'none'}; off: {', '.join(off) or 'none'}."


def summary(protein, polymer, cost):
    """The demo's result in plain sentences."""
    free, rouse = protein.row(False, "long").expected, polymer.row(False, "long").expected
    short, long = protein.row(True, "short", FORCE), protein.row(True, "long", DRIFT)
    chain = polymer.row(True, "short", FORCE)
    rows = [row for result in (protein, polymer) for row in result.rows]
    return [
        f"T4 lysozyme diffuses with {_measured(short)} e-10 m^2/s at short and {_measured(long)} at long times, "
        f"{short.measured.value / free:.0f} and {long.measured.value / free:.0f} times faster",
        f"than without hydrodynamics ({_number(free)}); measured for lysozymes: 1.0-1.1.",
        f"The polymer diffuses with {_measured(chain)} e-10 m^2/s at short times, "
        f"{chain.measured.value / rouse:.0f} times faster than without ({_number(rouse)}, Rouse).",
        f"{sum(row.agrees for row in rows)} of {len(rows)} values agree with theory within {AGREEMENT:.0f} standard "
        "errors.",
        effects(protein.describe) + " The runs without hydrodynamics keep the noise.",
        f"Tolerance {simulate.TOLERANCE:g} changed the protein's short-time value by {100 * cost.difference:.1g} % "
        f"({100 * cost.predicted:.1g} % predicted for velocities;",
        f"statistical error of the long-time value: {100 * long.measured.error / long.measured.value:.1f} %).",
        f"A step of the protein takes {1e3 * cost.seconds:.2g} ms on one core; at tolerance {TIGHT_TOLERANCE:g} it "
        f"would take {1e3 * cost.tight_seconds:.2g} ms."]


def _interval(row):
    """Ends of what theory allows."""
    return row.expected if isinstance(row.expected, tuple) else (row.expected, row.expected)


def _measured(row):
    value, error = row.measured
    return f"{_number(value)} +- {_number(error, _decimals(value))}"


def _number(value, decimals=None):
    """nm^2/ps in 1e-10 m^2/s."""
    return f"{value * beads.M2_PER_S * 1e10:.{_decimals(value) if decimals is None else decimals}f}"


def _decimals(value):
    """Of a number in 1e-10 m^2/s: one more below 0.1."""
    return 4 if abs(value * beads.M2_PER_S * 1e10) < 0.1 else 3
