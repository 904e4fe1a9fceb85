# SPDX-License-Identifier: MIT
"""Error against tolerance: 5,000 spheres, phi = 0.2, against a run at 1e-10 (Fiore et al. 2017, Fig. 2)."""

import numpy as np
from common import CYCLE, SPLIT_STYLE, STYLE, markdown, panels, plt, save, scenes, splits, values, where

NAME = "error"
PHI, REFERENCE = 0.2, 1e-10
XI = (0.4, 0.6, 0.8)  # in 1/radius


def measure(effort):
    count = effort.choose(1000, 5000)
    positions, length = scenes.suspension(count, PHI)
    system = scenes.makeSystem(count, length)
    forces = {
        "random": np.random.default_rng(1).normal(size=(count, 3)),
        "uniform": np.tile([0.0, 0.0, 1.0], (count, 1)),
    }

    def velocities(tolerance, split, xi):
        parameters = {"split": split or "", "xi": xi / scenes.RADIUS}
        _, integrator = scenes.hydrodynamic(system, positions, tolerance, 0.0, effort.threads, parameters=parameters)
        return {kind: integrator.applyMobility(f) for kind, f in forces.items()}, integrator.getNumericalParameters()

    exact, _ = velocities(REFERENCE, None, 0.0)
    series = [(split, 0.0) for split in splits()] + [("Hasimoto", xi) for xi in effort.choose((), XI)]
    rows = []
    for split, xi in series:
        tolerances = 10.0 ** -np.arange(1, effort.choose(6, 8.4), effort.choose(1, 1 if xi else 0.5))
        for tolerance in tolerances:
            computed, used = velocities(tolerance, split, xi)
            row = {
                "split": split,
                "xi_a": xi or "automatic",
                "tolerance": float(tolerance),
                "phi": PHI,
                "particles": count,
            }
            for kind in forces:
                difference = np.linalg.norm(computed[kind] - exact[kind])
                row[f"error_{kind}"] = float(difference / np.linalg.norm(exact[kind]))
                scale = max(np.linalg.norm(exact[kind]), np.linalg.norm(forces[kind]) / scenes.DRAG)
                row[f"contract_{kind}"] = float(difference / scale)
            row["grid"], row["support"] = used["gridDimensions"][0], used["windowSupport"]
            row["xi_a_used"], row["cutoff_over_a"] = used["xi"] * scenes.RADIUS, used["realCutoff"] / scenes.RADIUS
            rows.append(row)
    return rows


def draw(rows, path):
    with plt.rc_context(STYLE):
        figure, (left, right) = panels(2)
        tolerances = sorted(set(values(rows, "tolerance")))
        for axes in (left, right):
            axes.plot(tolerances, tolerances, color="#888888", ls="--", lw=1.2, label="error = tolerance")
            axes.set(xscale="log", yscale="log", xlabel="tolerance asked for", ylabel="error of M f, relative to |M f|")
            axes.invert_xaxis()
        for split in dict.fromkeys(values(where(rows, xi_a="automatic"), "split")):
            colour, marker = SPLIT_STYLE[split]
            mine = where(rows, split=split, xi_a="automatic")
            left.plot(
                values(mine, "tolerance"),
                values(mine, "error_random"),
                color=colour,
                marker=marker,
                label=f"{split}, random forces",
            )
            left.plot(
                values(mine, "tolerance"),
                values(mine, "error_uniform"),
                color=colour,
                marker=marker,
                mfc="white",
                ls=":",
                label=f"{split}, sedimentation",
            )
        left.set_title("Automatic parameters")
        for colour, xi in zip(CYCLE, XI):
            mine = where(rows, xi_a=xi)
            if mine:
                right.plot(
                    values(mine, "tolerance"),
                    values(mine, "error_uniform"),
                    color=colour,
                    marker="o",
                    ms=4,
                    label=rf"$\xi a$ = {xi:g}",
                )
        right.set_title("Prescribed splitting parameter, sedimentation")
        for axes in (left, right):
            axes.legend(loc="lower left")
        save(figure, path)


def table(rows):
    lines = []
    for row in rows:
        digits = -np.log10(row["tolerance"])
        if row["xi_a"] == "automatic" and abs(digits - round(digits)) < 1e-6:
            lines.append(
                [
                    row["split"],
                    f"1e-{round(digits)}",
                    f"{row['error_random']:.1e}",
                    f"{row['error_uniform']:.1e}",
                    f"{row['contract_uniform']:.1e}",
                    f"{row['grid']:.0f}³",
                    f"{row['support']:.0f}",
                    f"{row['cutoff_over_a']:.1f}",
                ]
            )
    return markdown(
        [
            "split",
            "tolerance",
            "error, random forces",
            "error, sedimentation",
            "the same by the contract's norm",
            "grid",
            "support",
            "cut-off / a",
        ],
        lines,
    )
