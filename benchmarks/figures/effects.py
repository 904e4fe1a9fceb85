# SPDX-License-Identifier: MIT
"""What each effect costs: nothing, forces, hydrodynamics, noise."""

import openmm
from common import CYCLE, STYLE, markdown, panels, plt, save, scenes, splits

NAME = "effects"
PHI, TOLERANCE = 0.1, 1e-3
BARE, FORCES = "motion alone (BrownianIntegrator)", "+ forces (BrownianIntegrator)"


def measure(effort):
    number = effort.choose(4000, 16000)
    positions, length = scenes.suspension(number, PHI)
    empty, full = (scenes.makeSystem(number, length, repulsion) for repulsion in (False, True))
    running, contexts = {}, []
    for name, system in ((BARE, empty), (FORCES, full)):
        running[name] = openmm.BrownianIntegrator(scenes.TEMPERATURE, scenes.DRAG / scenes.MASS, scenes.STEP)
        contexts.append(scenes.context(system, positions, running[name], effort.threads))
    for split in splits():
        for what, temperature in (("+ hydrodynamics", 0.0), ("+ noise", scenes.TEMPERATURE)):
            made, integrator = scenes.hydrodynamic(full, positions, TOLERANCE, temperature, effort.threads, split)
            running[f"{what}, {split} split"] = integrator
            contexts.append(made)
    seconds = scenes.secondsPerStep(list(running.values()), steps=5, rounds=effort.choose(3, 10))
    return [
        {
            "what": name,
            "particles": number,
            "phi": PHI,
            "tolerance": TOLERANCE,
            "ms_per_step": 1e3 * time,
            "over_forces_alone": time / seconds[1],
        }
        for name, time in zip(running, seconds)
    ]


def draw(rows, path):
    with plt.rc_context(STYLE):
        figure, (axes,) = panels(1, width=8.5, height=0.55 * len(rows) + 1.2)
        for y, row in enumerate(reversed(rows)):
            colour = CYCLE[0] if "Hasimoto" in row["what"] else CYCLE[1] if "Prolate" in row["what"] else "#888888"
            axes.barh(y, row["ms_per_step"], color=colour, height=0.65)
            axes.text(
                row["ms_per_step"],
                y,
                f"  {row['ms_per_step']:.3g} ms = {row['over_forces_alone']:.2g} x",
                va="center",
                fontsize=9.5,
            )
        axes.set(
            yticks=range(len(rows)),
            yticklabels=[row["what"] for row in reversed(rows)],
            xlabel="time per step (ms)",
            title=rf"{rows[0]['particles']:,.0f} repelling spheres, $\phi$ = {PHI:g}, tolerance {TOLERANCE:g}",
        )
        axes.set_xlim(0, 1.3 * max(row["ms_per_step"] for row in rows))
        axes.grid(False, axis="y")
        save(figure, path)


def table(rows):
    return markdown(
        ["what a step does", "ms per step", "over a step with forces alone"],
        [[r["what"], f"{r['ms_per_step']:.3g}", f"{r['over_forces_alone']:.2g}"] for r in rows],
    )
