# SPDX-License-Identifier: MIT
"""Particle-steps per second against N and phi, for suspensions and gels (Fiore et al. 2017, Figs 7 and 8, Table I)."""

import numpy as np
from common import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    STYLE,
    count,
    markdown,
    panels,
    plainTicks,
    plt,
    realShare,
    rounded,
    save,
    scenes,
)
from common import millions, splits, values, where

NAME = "scaling"
TOLERANCE, PHI = 1e-3, 0.1
# Seed paper, Table I: one NVIDIA Tesla K40, phi = 0.1, xi a = 0.5, relative tolerance 1e-3, in 1e6 particle-steps/s.
PUBLISHED = {
    16: (5.2, 0.9),
    32: (5.5, 1.0),
    64: (6.1, 1.4),
    128: (5.6, 1.6),
    256: (5.9, 2.2),
    512: (6.2, 2.8),
    1024: (6.2, 3.3),
}


def measure(effort):
    rows = []
    thousands = effort.choose((1, 4, 16), (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024))
    for thousand in thousands:
        rows.append(one("suspension", 1000 * thousand, PHI, None, effort))
    number = 16000
    for phi in effort.choose((0.01, 0.1), (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4)):
        rows += [one("suspension", number, phi, split, effort) for split in splits()]
    for phi in effort.choose((0.02, 0.1), (0.01, 0.02, 0.05, 0.1)):
        rows += [one("gel", 16000, phi, split, effort) for split in splits()]
    for number in effort.choose((), (2000, 128000)):
        rows.append(one("gel", number, 0.02, None, effort))
    return rows


def one(kind, number, phi, split, effort):
    """A row: steps with and without noise in turns, no Forces."""
    positions, length = (scenes.gel if kind == "gel" else scenes.suspension)(number, phi)
    system = scenes.makeSystem(number, length)
    pair = [
        scenes.hydrodynamic(system, positions, TOLERANCE, temperature, effort.threads, split)
        for temperature in (scenes.TEMPERATURE, 0.0)
    ]
    steps = int(np.clip(30_000 // number, 1, 20))
    rounds = 2 if number > 200_000 else 4 if number > 40_000 else 10
    thermal, deterministic = scenes.secondsPerStep([x for _, x in pair], steps, rounds)
    _, first = pair[0]
    used = first.getNumericalParameters()
    return {
        "kind": kind,
        "particles": number,
        "phi": phi,
        "split": used["split"],
        "asked": split or "automatic",
        "thermal_ptps": number / thermal,
        "deterministic_ptps": number / deterministic,
        "real_share": realShare(first),
        "xi_a": used["xi"] * scenes.RADIUS,
        "grid": used["gridDimensions"][0],
        "cutoff_over_a": used["realCutoff"] / scenes.RADIUS,
        "iterations": used["lanczosIterations"],
    }


def draw(rows, path):
    with plt.rc_context(STYLE):
        figure, (left, middle, right) = panels(3, width=12.5)
        _againstNumber(left, rows)
        _againstDensity(middle, right, [row for row in rows if row["asked"] != "automatic"])
        for axes, room in ((left, 0.6), (middle, 0.5)):
            axes.set(yscale="log", ylabel="million particle-steps per second")
            plainTicks(axes.yaxis)
            low, high = axes.get_ylim()
            axes.set_ylim(low / 1.2, high * (high / low) ** room)
        for axes in (left, middle, right):
            axes.legend(loc="upper left", fontsize=8.5)
        save(figure, path)


def _againstNumber(axes, rows):
    """Suspensions, gels and the published numbers against N."""
    mine, gels = where(rows, kind="suspension", phi=PHI, asked="automatic"), where(rows, kind="gel", asked="automatic")
    paper = [1000 * n for n in PUBLISHED]
    without, noise = zip(*PUBLISHED.values())
    number = values(mine, "particles")
    curves = [
        (number, millions(mine, "deterministic_ptps"), BLUE, "--", "^", "suspension, without noise"),
        (number, millions(mine, "thermal_ptps"), BLUE, "-", "o", "suspension, with noise"),
        (values(gels, "particles"), millions(gels, "thermal_ptps"), GREEN, "-", "D", r"gel, $\phi$ = 0.02, with noise"),
    ]
    for x, y, colour, ls, marker, label in curves:
        if x:
            axes.plot(x, y, color=colour, ls=ls, marker=marker, label=label)
    for y, ls, marker, what in ((without, "--", "^", "without noise"), (noise, "-", "o", "with noise")):
        axes.plot(paper, y, color=BLACK, ls=ls, marker=marker, mfc="white", lw=1, label=f"published: K40 GPU, {what}")
    axes.set(xscale="log", xlabel="particles", title=rf"Against N ($\phi$ = {PHI:g}, tolerance 1e-3)")
    plainTicks(axes.xaxis, subs=(1,))


def _againstDensity(speed, share, rows):
    """Speed and share of the real half against volume fraction, for both kinds of scenes and all splits."""
    shapes = (
        ("suspension", "Hasimoto", BLUE, "o"),
        ("suspension", "Prolate", ORANGE, "s"),
        ("gel", "Hasimoto", GREEN, "D"),
        ("gel", "Prolate", PURPLE, "v"),
    )
    for kind, split, colour, marker in shapes:
        mine = where(rows, kind=kind, asked=split)
        if mine:
            style = {"color": colour, "marker": marker, "label": f"{kind}, {split} split"}
            speed.plot(values(mine, "phi"), millions(mine, "thermal_ptps"), **style)
            share.plot(values(mine, "phi"), [100 * x for x in values(mine, "real_share")], **style)
    speed.set(title=rf"Against $\phi$ ({rows[0]['particles']:,.0f} spheres, noise)")
    share.set(ylabel="real half, % of the step", ylim=(0, 100), title="Share of the real half")
    for axes in (speed, share):
        axes.set(xscale="log", xlabel=r"volume fraction $\phi$")
        plainTicks(axes.xaxis)


def table(rows):
    lines = []
    for row in where(rows, kind="suspension", phi=PHI, asked="automatic"):
        published = PUBLISHED.get(row["particles"] / 1000)
        lines.append(
            [
                count(row["particles"]),
                rounded(row["deterministic_ptps"]),
                rounded(row["thermal_ptps"]),
                f"{row['thermal_ptps'] / row['deterministic_ptps']:.2f}",
                *(
                    (f"{1e6 * published[0]:,.0f}", f"{1e6 * published[1]:,.0f}", f"{published[1] / published[0]:.2f}")
                    if published
                    else ("", "", "")
                ),
            ]
        )
    first = markdown(
        [
            "particles",
            "without noise",
            "with noise",
            "with / without",
            "published (K40 GPU), without noise",
            "published (K40 GPU), with noise",
            "with / without",
        ],
        lines,
    )
    lines = [
        [
            row["kind"],
            f"{row['phi']:g}",
            row["split"],
            rounded(row["thermal_ptps"]),
            f"{100 * row['real_share']:.0f} %",
            f"{row['xi_a']:.3g}",
            f"{row['cutoff_over_a']:.1f}",
            f"{row['grid']:.0f}³",
            f"{row['iterations']:.0f}",
        ]
        for row in rows
        if row["asked"] != "automatic"
    ]
    return [
        *first,
        "",
        *markdown(
            ["scene", "phi", "split", "with noise", "real half", "xi a", "cut-off / a", "grid", "Lanczos iterations"],
            lines,
        ),
    ]
