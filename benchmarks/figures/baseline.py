# SPDX-License-Identifier: MIT
"""Brownian displacements by Positively Split Ewald against Lanczos on the full mobility (Fiore et al. 2017, Figs 5 and 6)."""

import time

import numpy as np
from common import BLUE, ORANGE, STYLE, count, distinct, markdown, panels, plainTicks, plt, save, scenes, values, where
from lanczos import squareRoot

NAME = "baseline"
PHI = 0.1
TOLERANCES = (1e-3, 1e-5)


def best(function, rounds=3):
    """Shortest time of a call, in seconds."""
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def measure(effort):
    rows = []
    for number in effort.choose((500, 2000), (500, 1000, 2000, 4000, 8000, 16000, 32000)):
        positions, length = scenes.suspension(number, PHI)
        system = scenes.makeSystem(number, length)
        for tolerance in TOLERANCES[: 2 if number <= 16000 else 1]:
            made, integrator = scenes.hydrodynamic(system, positions, tolerance, threads=effort.threads)
            z = np.random.default_rng(2).normal(size=3 * number)
            forces = z.reshape(-1, 3)
            integrator.applyMobility(forces)
            integrator.sampleBrownianDisplacements(1)
            start = time.perf_counter()
            _, iterations, _ = squareRoot(
                lambda v: integrator.applyMobility(v.reshape(-1, 3)).ravel() * scenes.DRAG, z, tolerance
            )
            full = time.perf_counter() - start
            product = best(lambda: integrator.applyMobility(forces))
            split = best(lambda: integrator.sampleBrownianDisplacements(1))
            rows.append(
                {
                    "particles": number,
                    "phi": PHI,
                    "tolerance": tolerance,
                    "product_s": product,
                    "split_s": split,
                    "full_lanczos_s": full,
                    "full_iterations": iterations,
                    "real_iterations": integrator.getNumericalParameters()["lanczosIterations"],
                }
            )
    return rows


def draw(rows, path):
    with plt.rc_context(STYLE):
        figure, (left, middle, right) = panels(3, width=12.5)
        for tolerance, ls in zip(distinct(rows, "tolerance"), ("-", "--")):
            mine = where(rows, tolerance=tolerance)
            N = values(mine, "particles")
            text = f"tolerance {tolerance:.0e}"
            left.plot(
                N, values(mine, "full_iterations"), ls=ls, color=ORANGE, marker="s", label=f"full mobility, {text}"
            )
            left.plot(N, values(mine, "real_iterations"), ls=ls, color=BLUE, marker="o", label=f"real half, {text}")
            middle.plot(
                N,
                [r["full_lanczos_s"] / r["product_s"] for r in mine],
                ls=ls,
                color=ORANGE,
                marker="s",
                label=f"Lanczos on all of M, {text}",
            )
            middle.plot(
                N, [r["split_s"] / r["product_s"] for r in mine], ls=ls, color=BLUE, marker="o", label=f"split, {text}"
            )
            right.plot(N, [r["full_lanczos_s"] / r["split_s"] for r in mine], ls=ls, color=BLUE, marker="o", label=text)
        left.set(ylabel="iterations", title="Lanczos iterations")
        middle.set(ylabel="time / time of one product M f", title="Time of one vector of noise")
        right.set(ylabel="time of Lanczos / time of the split", title="Speed-up by the split")
        for axes in (left, middle, right):
            axes.set(xscale="log", yscale="log", xlabel="particles")
            plainTicks(axes.xaxis, subs=(1,))
            plainTicks(axes.yaxis)
            low, high = axes.get_ylim()
            axes.set_ylim(low * 0.8, high * (high / low) ** 0.5)
            axes.legend(loc="upper left")
        save(figure, path)


def table(rows):
    return markdown(
        [
            "particles",
            "tolerance",
            "iterations, all of M",
            "iterations, real half",
            "Lanczos on all of M / product",
            "split / product",
            "speed-up",
        ],
        [
            [
                count(r["particles"]),
                f"{r['tolerance']:.0e}",
                f"{r['full_iterations']:.0f}",
                f"{r['real_iterations']:.0f}",
                f"{r['full_lanczos_s'] / r['product_s']:.1f}",
                f"{r['split_s'] / r['product_s']:.2f}",
                f"{r['full_lanczos_s'] / r['split_s']:.1f}",
            ]
            for r in rows
        ],
    )
