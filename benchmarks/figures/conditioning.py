# SPDX-License-Identifier: MIT
"""Condition number of the real half and its Lanczos iterations (Fiore et al. 2017, Fig. 1): they do not depend on N."""

import realhalf
from common import (
    BLUE,
    GREEN,
    ORANGE,
    SPLIT_STYLE,
    STYLE,
    count,
    distinct,
    markdown,
    panels,
    plainTicks,
    plt,
    save,
    scenes,
)
from common import splits, values, where

NAME = "conditioning"
PHI, LANCZOS = 0.1, 1e-3
BANDWIDTH = 9.0  # of the prolate split at tolerances about 1e-3


def measure(effort):
    rows = []
    for number in effort.choose((500, 2000), (500, 2000, 8000)):
        for xi in effort.choose(
            (0.5, 1.0), (0.25, 0.32, 0.4, 0.5, 0.63, 0.8, 1.0) if number < 8000 else (0.32, 0.5, 0.8)
        ):
            rows += spectrum(number, PHI, "Hasimoto", xi)
    number = effort.choose(1000, 2000)
    for phi in effort.choose((0.05, 0.4), (0.02, 0.05, 0.1, 0.2, 0.3, 0.4)):
        rows += spectrum(number, phi, "Hasimoto", 0.5)
        rows += spectrum(number, phi, "Prolate", 0.25)
    for number in effort.choose((1000, 4000), (1000, 4000, 16000, 64000)):
        for split in splits():
            rows.append(iterations(number, PHI, split, 0.0, effort))
    for phi in effort.choose((0.4,), (0.02, 0.05, 0.1, 0.2, 0.3, 0.4)):
        for split in splits():
            rows.append(iterations(effort.choose(1000, 8000), phi, split, 0.5 if split == "Hasimoto" else 0.25, effort))
    return rows


def spectrum(number, phi, split, xi):
    """A row with the extreme eigenvalues of M_R from the independent matrix; none if its range exceeds half the box."""
    positions, length = scenes.suspension(number, phi)
    try:
        if split == "Hasimoto":
            M = realhalf.matrix(positions, length, realhalf.hasimoto(xi))
        else:
            if 1 / xi > length / scenes.RADIUS / 2:
                return []
            M = realhalf.matrix(positions, length, realhalf.prolate(BANDWIDTH, 1 / xi), cutoff=1 / xi)
    except ValueError:
        return []
    smallest, largest = realhalf.extremes(M)
    return [
        {
            "what": "spectrum",
            "particles": number,
            "phi": phi,
            "split": split,
            "xi_a": xi,
            "smallest": smallest,
            "largest": largest,
            "condition": largest / smallest,
            "iterations": "",
        }
    ]


def iterations(number, phi, split, xi, effort):
    """A row with the iterations of the library for noise of relative error LANCZOS."""
    positions, length = scenes.suspension(number, phi)
    parameters = {"split": split, "xi": xi / scenes.RADIUS, "lanczosTolerance": LANCZOS}
    _, integrator = scenes.hydrodynamic(
        scenes.makeSystem(number, length), positions, threads=effort.threads, parameters=parameters
    )
    integrator.sampleBrownianDisplacements(2)
    used = integrator.getNumericalParameters()
    return {
        "what": "iterations",
        "particles": number,
        "phi": phi,
        "split": split,
        "xi_a": xi or "automatic",
        "smallest": "",
        "largest": "",
        "condition": "",
        "iterations": used["lanczosIterations"],
    }


def draw(rows, path):
    with plt.rc_context(STYLE):
        figure, (left, middle, right) = panels(3, width=12.5)
        _conditionNumber(left, where(rows, what="spectrum", phi=PHI, split="Hasimoto"))
        _eigenvalues(middle, where(rows, what="spectrum", particles=_particles(rows)))
        _iterations(right, where(rows, what="iterations"))
        for axes in (left, middle, right):
            axes.legend(loc="upper right" if axes is left else "upper left", fontsize=8.5)
        save(figure, path)


def _conditionNumber(axes, rows):
    for colour, marker, number in zip((BLUE, ORANGE, GREEN), "osD", distinct(rows, "particles")):
        mine = sorted(where(rows, particles=number), key=lambda row: row["xi_a"])
        if len(mine) > 1:
            style = {"color": colour, "marker": marker, "alpha": 0.85, "label": f"{number:,.0f} particles"}
            axes.plot(values(mine, "xi_a"), values(mine, "condition"), **style)
    axes.set(xscale="log", yscale="log", title=rf"Hasimoto split, $\phi$ = {PHI:g}")
    axes.set(xlabel=r"splitting parameter $\xi a$", ylabel="condition number of the real half")
    plainTicks(axes.xaxis, subs=(1, 2, 3, 5, 7))
    plainTicks(axes.yaxis)


def _eigenvalues(axes, rows):
    for split, xi, name in (("Hasimoto", 0.5, r"Hasimoto, $\xi a$ = 0.5"), ("Prolate", 0.25, "Prolate, R = 4 a")):
        colour, marker = SPLIT_STYLE[split]
        mine = sorted(where(rows, split=split, xi_a=xi), key=lambda row: row["phi"])
        for key, ls, face in (("smallest", "-", colour), ("largest", "--", "white")):
            style = {"color": colour, "marker": marker, "ls": ls, "mfc": face, "label": f"{name}: {key}"}
            axes.plot(values(mine, "phi"), values(mine, key), **style)
    axes.set(xscale="log", yscale="log", title="Both splits")
    axes.set(xlabel=r"volume fraction $\phi$", ylabel=r"eigenvalue, in $1/(6\pi\eta a)$")
    plainTicks(axes.xaxis)
    plainTicks(axes.yaxis)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.6)


def _iterations(axes, rows):
    for split in distinct(rows, "split"):
        colour, marker = SPLIT_STYLE[split]
        mine = where(rows, split=split, phi=PHI, xi_a="automatic")
        style = {"color": colour, "marker": marker, "label": f"{split}, automatic parameters"}
        axes.plot(values(mine, "particles"), values(mine, "iterations"), **style)
    axes.set(xscale="log", xlabel="particles", ylabel="Lanczos iterations")
    axes.set(ylim=(0, 1.6 * max(values(rows, "iterations"))), title=rf"Iterations, $\phi$ = {PHI:g}, to {LANCZOS:g}")
    plainTicks(axes.xaxis, subs=(1,))


def _particles(rows):
    """Particles of the rows against volume fraction."""
    return where(rows, what="spectrum", split="Prolate")[0]["particles"]


def table(rows):
    lines = [
        [
            "spectrum",
            count(r["particles"]),
            f"{r['phi']:g}",
            r["split"],
            f"{r['xi_a']:g}",
            f"{r['smallest']:.3f}",
            f"{r['largest']:.2f}",
            f"{r['condition']:.1f}",
            "",
        ]
        for r in where(rows, what="spectrum")
        if r["xi_a"] in (0.25, 0.32, 0.5, 1.0)
    ]
    lines += [
        [
            "iterations",
            count(r["particles"]),
            f"{r['phi']:g}",
            r["split"],
            r["xi_a"] if isinstance(r["xi_a"], str) else f"{r['xi_a']:g}",
            "",
            "",
            "",
            f"{r['iterations']:.0f}",
        ]
        for r in where(rows, what="iterations")
    ]
    return markdown(
        [
            "",
            "particles",
            "phi",
            "split",
            "xi a (Prolate: a/R)",
            "smallest eigenvalue",
            "largest",
            "condition number",
            "Lanczos iterations",
        ],
        lines,
    )
