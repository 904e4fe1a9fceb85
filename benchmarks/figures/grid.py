# SPDX-License-Identifier: MIT
"""Grid points of the Force Coupling Method against Positively Split Ewald (Fiore et al. 2017, Fig. 3): formulas and Plans.

FCM is not implemented here. Its grid follows from that paper's estimate (27) of the self mobility that is lost beyond a
cut-off k: (2a/pi) Int_k^inf s^2 dk, with s^2 = exp(-k^2 a^2/pi): erfc(k a/sqrt(pi)); or from the rule of practice, a
spacing of a/3. The same estimate with s^2 = sinc^2(ka) (1 + q) exp(-q), q = k^2/4xi^2, gives the published curves.
"""

import numpy as np
from common import BLACK, CYCLE, SPLIT_STYLE, STYLE, markdown, panels, plt, save, scenes, splits, values, where
from scipy.integrate import cumulative_simpson
from scipy.special import erfcinv

NAME = "grid"
XI = (0.3, 0.5, 0.8, np.sqrt(np.pi) / 2)
PHIS = (0.1, 0.01)
COUNT = 8000


def cutoffOfPse(tolerance, xi):
    """k a at which the estimate (27) of PSE is the tolerance, and xi a is given; relative error below 1e-3."""
    k = np.linspace(1e-6, 14 * max(xi, 0.2), 40001)
    q = (k / (2 * xi)) ** 2
    weight = np.sinc(k / np.pi) ** 2 * (1 + q) * np.exp(-q)
    beyond = 2 / np.pi * (np.trapezoid(weight, k) - cumulative_simpson(weight, x=k, initial=0))
    return k[np.argmax(beyond <= tolerance)]


def cutoffOfFcm(tolerance):
    """k a of FCM by the same estimate."""
    return np.sqrt(np.pi) * erfcinv(tolerance)


def measure(effort):
    rows = []
    for tolerance in 10.0 ** -np.arange(1, 6.1, 0.25):
        fcm = cutoffOfFcm(tolerance)
        for xi in XI:
            rows.append(
                {
                    "what": "formula",
                    "split": "Hasimoto",
                    "xi_a": float(xi),
                    "phi": "",
                    "tolerance": float(tolerance),
                    "fcm_over_pse": float((fcm / cutoffOfPse(tolerance, xi)) ** 3),
                    "points_per_particle": "",
                }
            )
    for phi in PHIS:
        positions, length = scenes.lattice(COUNT, phi)
        system = scenes.makeSystem(COUNT, length)
        volume = 4 * np.pi / 3 / phi  # of a particle, in radii cubed
        for tolerance in 10.0 ** -np.arange(1, 6.1, 1):
            choices = {
                "FCM, formula": ("", (cutoffOfFcm(tolerance) / np.pi) ** 3 * volume),
                "FCM, a/3": ("", 27 * volume),
            }
            for split in splits():
                _, integrator = scenes.hydrodynamic(system, positions, tolerance, threads=effort.threads, split=split)
                used = integrator.getNumericalParameters()
                choices[f"Plan, {split}"] = (used["xi"] * scenes.RADIUS, np.prod(used["gridDimensions"]) / COUNT)
            for what, (xi, points) in choices.items():
                rows.append(
                    {
                        "what": what,
                        "split": what.partition(", ")[2] if "Plan" in what else "",
                        "xi_a": xi,
                        "phi": phi,
                        "tolerance": float(tolerance),
                        "fcm_over_pse": "",
                        "points_per_particle": float(points),
                    }
                )
    return rows


def draw(rows, path):
    with plt.rc_context(STYLE):
        figure, (left, middle, right) = panels(3, width=12.5)
        formula = where(rows, what="formula")
        for colour, xi in zip(CYCLE, sorted(set(values(formula, "xi_a")))):
            mine = where(formula, xi_a=xi)
            label = rf"$\xi a$ = {xi:.2g}" + (r" = $\sqrt{\pi}/2$" if abs(xi - XI[-1]) < 1e-3 else "")
            left.plot(values(mine, "tolerance"), values(mine, "fcm_over_pse"), color=colour, label=label)
        left.axhline(1, color=BLACK, lw=0.8)
        left.set(ylabel=r"$(k_{FCM}/k_{PSE})^3$", title="Estimate of the paper")
        for axes, phi in zip((middle, right), PHIS):
            for what in dict.fromkeys(values(where(rows, phi=phi), "what")):
                mine = where(rows, what=what, phi=phi)
                split = mine[0]["split"]
                colour, marker = SPLIT_STYLE.get(split, (BLACK, "^" if "formula" in what else "v"))
                label = (
                    f"PSE here, {split} split"
                    if split
                    else ("FCM, same estimate" if "formula" in what else "FCM, h = a/3")
                )
                axes.plot(
                    values(mine, "tolerance"),
                    values(mine, "points_per_particle"),
                    color=colour,
                    marker=marker,
                    ls="-" if split else "--",
                    label=label,
                )
            axes.set(ylabel="grid points per particle", title=rf"Grids, $\phi$ = {phi:g}")
        for axes in (left, middle, right):
            axes.set(xscale="log", yscale="log", xlabel="tolerance")
            axes.invert_xaxis()
            low, high = axes.get_ylim()
            axes.set_ylim(low, high * (high / low) ** 0.45)
            axes.legend(loc="upper left" if axes is not left else "upper right")
        save(figure, path)


def table(rows):
    lines = []
    for phi in PHIS:
        for tolerance in (1e-2, 1e-3, 1e-4, 1e-6):
            mine = {
                row["what"]: row for row in rows if row["phi"] == phi and abs(row["tolerance"] / tolerance - 1) < 1e-3
            }
            plans = [what for what in mine if what.startswith("Plan")]
            lines.append(
                [
                    f"{phi:g}",
                    f"{tolerance:.0e}",
                    *(f"{mine[w]['points_per_particle']:.1f}" for w in plans),
                    f"{mine['FCM, formula']['points_per_particle']:.0f}",
                    f"{mine['FCM, a/3']['points_per_particle']:.0f}",
                ]
            )
    plans = list(dict.fromkeys(row["what"] for row in rows if row["what"].startswith("Plan")))
    return markdown(
        [
            "phi",
            "tolerance",
            *(f"PSE here, {w.removeprefix('Plan, ')}" for w in plans),
            "FCM by the same estimate",
            "FCM, h = a/3",
        ],
        lines,
    )
