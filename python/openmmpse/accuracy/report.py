# SPDX-License-Identifier: MIT
"""The tables of a measurement and of a tuning, in words and as CSV."""

from __future__ import annotations

import csv

import numpy as np

from .results import KINDS

PARAMETERS = ("xi", "realCutoff", "gridDimensions", "windowSupport", "lanczosIterations", "precision")


def text(result):
    """Lines of the whole report of a `Result`."""
    head = (
        f"{result.count} particles on platform {result.platform}; errors of M f relative to "
        f"max(|M f|, |f|/(6 pi eta a)) against a run at {_number(result.referenceTolerance)}"
    )
    return [head, "", *table(result), "", *stageTable(result), "", *conclusions(result)]


def table(result):
    """One line for each tolerance and split."""
    if not result.rows:
        return ["nothing was measured"]
    columns = ["tolerance", "random", "uniform", "scene", "noise", "split", "xi (1/nm)", "grid", "P", "Lanczos", "ms/step",
               "no Forces", "particle-steps/s"]  # fmt: skip
    widths = [9, 8, 8, 8, 8, 8, 9, 12, 3, 7, 8, 9, 16]
    lines = ["  ".join(f"{name:>{width}}" for name, width in zip(columns, widths))]
    for split in result.splits:
        chosen = result.recommendation(split)
        lines.append(f"{split} split".center(len(lines[0]), "-"))
        for row in result.rowsOf(split):
            used = row.parameters
            values = [f"{row.tolerance:.0e}", *(_number(row.errors.get(kind)) for kind in KINDS), _number(row.noise),
                      used["split"], f"{used['xi']:.4g}", "x".join(map(str, used["gridDimensions"])), str(used["windowSupport"]),
                      str(used["lanczosIterations"]) if row.noise is not None else "-", _milliseconds(row.seconds),
                      _milliseconds(row.bareSeconds),
                      f"{result.count / row.seconds:.3g}" if row.seconds else "-"]  # fmt: skip
            mark = "  <- recommended" if chosen and chosen.tolerance == row.tolerance else ""
            lines.append("  ".join(f"{value:>{width}}" for value, width in zip(values, widths)) + mark)
    return lines


def stageTable(result):
    """Share of each stage of a step without Forces, in percent, a column for each tolerance."""
    lines = []
    for split in result.splits:
        rows = result.rowsOf(split)
        names = list(dict.fromkeys(name for row in rows for name in row.stages))
        if not names:
            continue
        width = max(map(len, names)) + 2
        title = f"{split}: % of a step"
        lines.append(f"{title:{max(width, len(title) + 2)}}" + "".join(f"{row.tolerance:>8.0e}" for row in rows))
        width = max(width, len(title) + 2)
        for name in names:
            shares = "".join(f"{100 * row.stages[name]:>8.0f}" if name in row.stages else f"{'-':>8}" for row in rows)
            lines.append(f"{name:{width}}" + shares)
    return lines or ["no step was timed"]


def conclusions(result):
    """The limits, the recommendation and the notes, in sentences."""
    lines = []
    if result.limits is not None:
        limits = result.limits
        lines.append(f"Errors of a run of {result.runLength} steps that have nothing to do with the tolerance: "
                     f"time step {_number(limits.timeStep)}, statistics {_number(limits.statistical)}.")  # fmt: skip
        lines.append(f"Estimated so: {limits.assumptions}.")
        for split in result.splits:
            lines.append(f"Recommended tolerance, {split} split: {result.recommendation(split).reason}.")
    if result.step is not None:
        lines += stepText(result.step)
    lines += [f"Note: {note}" for note in result.notes]
    if not result.complete:
        lines.append("INTERRUPTED: what is missing was not measured, and times come from fewer rounds.")
    return lines


def stepText(advice):
    """Lines of a `StepAdvice`: what the step of the integrator does, and which one is recommended."""
    lines = []
    if advice.rate is not None:
        does = f"is off by {advice.bias:.2g} of itself" if advice.bias < np.inf else "grows without bound"
        lines.append(f"Time step: the stiffest mode relaxes at {advice.rate:.3g} /ps, so steps must stay below "
                     f"{advice.stable:.3g} ps; at {advice.present:g} ps its variance {does}.")  # fmt: skip
    if advice.recommended is not None:
        lines.append(f"Recommended time step: {advice.recommended:.2g} ps, for {advice.reason}.")
    return lines


def writeCsv(result, path):
    """All rows, with units in the header; stages in columns of their own."""
    stages = list(dict.fromkeys(name for row in result.rows for name in row.stages))
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([
            "split", "tolerance", *(f"error_{kind}" for kind in KINDS),
            *(f"error_{kind}_relative_to_Mf" for kind in KINDS),
            "lanczos_error", "noise_error", "best_s_per_step", "median_s_per_step", "best_s_per_step_without_forces",
            "median_s_per_step_without_forces", "particle_steps_per_s", *PARAMETERS, "recommended", "time_step_error",
            "statistical_error", "recommended_step_ps", "reference_tolerance", *(f"share: {name}" for name in stages),
        ])  # fmt: skip
        for row in result.rows:
            chosen, limits = result.recommendation(row.split), result.limits
            writer.writerow([
                row.parameters["split"], f"{row.tolerance:.0e}", *(_full(row.errors.get(kind)) for kind in KINDS),
                *(_full(row.plainErrors.get(kind)) for kind in KINDS), _full(row.lanczosError), _full(row.noise),
                _full(row.seconds), _full(median(row.times)), _full(row.bareSeconds), _full(median(row.bareTimes)),
                _full(result.count / row.seconds if row.seconds else None),
                *(_cell(row.parameters[k]) for k in PARAMETERS),
                int(bool(chosen and chosen.tolerance == row.tolerance)), _full(limits and limits.timeStep),
                _full(limits and limits.statistical), _full(result.step and result.step.recommended), f"{result.referenceTolerance:.0e}",
                *(row.stages.get(name, "") for name in stages),
            ])  # fmt: skip


def tuningText(tuning):
    """Lines of a `Tuning`: its table, and what to set."""
    lines = [f"{'':14}{'xi (1/nm)':>10}{'grid':>13}{'P':>4}{'cut-off (nm)':>13}{'error':>9}{'ms/step':>9}{'/ best':>8}"]
    for candidate in tuning.candidates:
        used, mark = candidate.parameters, "  <- best" if candidate is tuning.best else ""
        lines.append(
            f"{candidate.label:14}{used['xi']:>10.4g}{'x'.join(map(str, used['gridDimensions'])):>13}"
            f"{used['windowSupport']:>4}{used['realCutoff']:>13.4g}{candidate.error:>9.1e}"
            f"{1e3 * candidate.seconds:>9.3g}{candidate.seconds / tuning.best.seconds:>8.2f}{mark}"
        )
    lines += [f"Note: {note}" for note in tuning.notes]
    if tuning.best is tuning.automatic:
        return [*lines, f"At tolerance {tuning.tolerance:g} the automatic choice is the fastest of these: set nothing."]
    return [
        *lines,
        f"At tolerance {tuning.tolerance:g} the automatic choice takes {tuning.excess:.2f} times as long as the best.",
        "Nothing was changed. To use the best on this machine, before the Context is created:",
        f"  integrator.setNumericalParameters({tuning.best.settings!r})",
    ]


def median(values):
    """Of a list; None if it is empty."""
    ordered = sorted(values)
    return 0.5 * (ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]) if ordered else None


def _number(value):
    return "-" if value is None else f"{value:.1e}"


def _milliseconds(seconds):
    return "-" if seconds is None else f"{1e3 * seconds:.3g}"


def _full(value):
    return "" if value is None else f"{value:.6g}"


def _cell(value):
    return "x".join(map(str, value)) if isinstance(value, tuple) else value
