# SPDX-License-Identifier: MIT
"""Particle-steps per second against the splitting parameter (Fiore et al. 2017, Figs 4 and 7), the automatic choice marked."""

import numpy as np
import openmm
from common import (
    BLACK,
    CYCLE,
    GREEN,
    SPLIT_STYLE,
    STYLE,
    distinct,
    markdown,
    panels,
    plainTicks,
    plt,
    save,
    scenes,
    splits,
)
from common import millions, values, where
from lanczos import squareRoot

NAME = "splitting"
FACTORS = (0.4, 0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5)
TOLERANCE = 1e-3


def measure(effort):
    main = effort.choose(4000, 16000)
    cases = [(main, 0.1)] + [(effort.choose(2000, 8000), phi) for phi in effort.choose((), (0.02, 0.1, 0.4))]
    factors = effort.choose((0.5, 0.8, 1.0, 1.25, 2.0), FACTORS)
    rows = []
    for number, phi in cases:
        positions, length = scenes.suspension(number, phi)
        system = scenes.makeSystem(number, length)
        for split in splits():
            rows += sweep(system, positions, number, phi, split, factors if number == main else factors[1:-1], effort)
    return rows


def sweep(system, positions, number, phi, split, factors, effort):
    """Rows for one scene and split; all splitting parameters are timed in turns."""
    made, automatic = scenes.hydrodynamic(system, positions, TOLERANCE, threads=effort.threads, split=split)
    xi = automatic.getNumericalParameters()["xi"]
    iterations = fullIterations(automatic, number) if phi == 0.1 else ""
    del made, automatic
    running = []
    for factor in factors:
        try:
            pair = [
                scenes.hydrodynamic(
                    system,
                    positions,
                    TOLERANCE,
                    temperature,
                    effort.threads,
                    parameters={"split": split, "xi": xi * factor},
                )
                for temperature in (scenes.TEMPERATURE, 0.0)
            ]
        except openmm.OpenMMException:
            continue  # outside the range of this split
        running.append((factor, pair))
    seconds = scenes.secondsPerStep([x for _, pair in running for _, x in pair], steps=2, rounds=effort.choose(2, 4))
    rows = []
    for i, (factor, ((_, thermal), _)) in enumerate(running):
        used = thermal.getNumericalParameters()
        rows.append(
            {
                "particles": number,
                "phi": phi,
                "split": split,
                "tolerance": TOLERANCE,
                "factor": factor,
                "xi_a": used["xi"] * scenes.RADIUS,
                "thermal_ptps": number / seconds[2 * i],
                "deterministic_ptps": number / seconds[2 * i + 1],
                "full_lanczos_iterations": iterations,
                "iterations": used["lanczosIterations"],
                "grid": used["gridDimensions"][0],
                "cutoff_over_a": used["realCutoff"] / scenes.RADIUS,
            }
        )
    return rows


def fullIterations(integrator, number):
    """Lanczos iterations that the full mobility would take."""
    z = np.random.default_rng(2).normal(size=3 * number)
    return squareRoot(lambda v: integrator.applyMobility(v.reshape(-1, 3)).ravel() * scenes.DRAG, z, TOLERANCE)[1]


def draw(rows, path):
    main = rows[0]["particles"]
    with plt.rc_context(STYLE):
        figure, axes = panels(2)
        for split in distinct(rows, "split"):
            colour, _ = SPLIT_STYLE[split]
            mine = where(rows, particles=main, phi=0.1, split=split)
            x = values(mine, "xi_a")
            axes[0].plot(
                x,
                millions(mine, "deterministic_ptps"),
                color=colour,
                ls="--",
                marker="^",
                label=f"{split}, without noise",
            )
            axes[0].plot(x, millions(mine, "thermal_ptps"), color=colour, marker="o", label=f"{split}, with noise")
            if split == "Hasimoto":
                axes[0].plot(
                    x,
                    [r["deterministic_ptps"] / 1e6 / r["full_lanczos_iterations"] for r in mine],
                    color=GREEN,
                    ls=":",
                    marker="v",
                    label="Lanczos on all of M",
                )
            star(axes[0], where(mine, factor=1.0))
        axes[0].set_title(rf"{main:,.0f} spheres, $\phi$ = 0.1")
        others = [r for r in rows if r["particles"] != main] or rows
        for colour, phi in zip(CYCLE, distinct(others, "phi")):
            for split, ls in zip(distinct(others, "split"), ("-", ":")):
                mine = where(others, phi=phi, split=split)
                axes[1].plot(
                    values(mine, "xi_a"),
                    millions(mine, "thermal_ptps"),
                    color=colour,
                    ls=ls,
                    marker="o",
                    label=rf"$\phi$ = {phi:g}, {split}",
                )
                star(axes[1], where(mine, factor=1.0))
        axes[1].set_title(f"{others[0]['particles']:,.0f} spheres, with noise")
        for each in axes:
            each.plot([], [], "*", color=BLACK, ms=12, label="automatic choice")
            each.set(
                xscale="log",
                yscale="log",
                xlabel=r"splitting parameter $\xi a$",
                ylabel="million particle-steps per second",
            )
            plainTicks(each.xaxis, subs=(1, 1.5, 2, 3, 5, 7))
            plainTicks(each.yaxis, subs=(1, 2, 5))
            low, high = each.get_ylim()
            each.set_ylim(low * (low / high) ** (0.3 if each is axes[0] else 0.5), high * 1.1)
            each.legend(loc="lower center", ncols=2, fontsize=8)
        save(figure, path)


def star(axes, rows):
    axes.plot(values(rows, "xi_a"), millions(rows, "thermal_ptps"), "*", color=BLACK, ms=13, zorder=4)


def table(rows):
    lines = []
    for number in distinct(rows, "particles"):
        for phi in distinct(where(rows, particles=number), "phi"):
            for split in distinct(rows, "split"):
                mine = where(rows, particles=number, phi=phi, split=split)
                automatic, best = where(mine, factor=1.0)[0], max(mine, key=lambda r: r["thermal_ptps"])
                lines.append(
                    [
                        f"{number:,.0f}",
                        f"{phi:g}",
                        split,
                        f"{automatic['xi_a']:.3g}",
                        f"{best['xi_a']:.3g}",
                        f"{best['thermal_ptps'] / automatic['thermal_ptps']:.2f}",
                        f"{automatic['thermal_ptps'] / automatic['deterministic_ptps']:.2f}",
                    ]
                )
    return markdown(
        [
            "particles",
            "phi",
            "split",
            "automatic xi a",
            "fastest xi a of those tried",
            "time of the automatic / fastest",
            "speed with noise / without",
        ],
        lines,
    )
