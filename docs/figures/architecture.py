# SPDX-License-Identifier: MIT
"""Writes architecture.svg, the picture of the layers: python docs/figures/architecture.py"""

from pathlib import Path
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 960, 640
FONT = "Helvetica, Arial, sans-serif"
COLOURS = {"user": "#FFFFFF", "api": "#DCEBF7", "shared": "#FBE9D7", "platform": "#DDF1E7", "physics": "#F3E3EE"}
INK = "#222222"


def text(x, y, words, size=13, weight="normal", anchor="middle"):
    return (
        f'<text x="{x}" y="{y}" font-family="{FONT}" font-size="{size}" font-weight="{weight}" '
        f'text-anchor="{anchor}" fill="{INK}">{escape(words)}</text>'
    )


def box(x, y, width, height, kind, title, *lines):
    """A rectangle with a bold title and lines of small text, centred."""
    parts = [
        f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="6" fill="{COLOURS[kind]}" '
        f'stroke="{INK}" stroke-width="1.2"/>'
    ]
    top = y + height / 2 - 8.5 * len(lines) + 5
    parts.append(text(x + width / 2, top, title, 14, "bold"))
    parts += [text(x + width / 2, top + 18 * (n + 1), line, 12.5) for n, line in enumerate(lines)]
    return "\n".join(parts)


def arrow(x1, y1, x2, y2, words="", side=8):
    """From who calls to who is called."""
    line = f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{INK}" stroke-width="1.4" marker-end="url(#tip)"/>'
    return line + (text((x1 + x2) / 2 + side, (y1 + y2) / 2 + 4, words, 11.5, anchor="start") if words else "")


def picture():
    tip = '<path d="M0,0 L9,4 L0,8 z" fill="' + INK + '"/>'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}">',
        f'<defs><marker id="tip" markerWidth="10" markerHeight="8" refX="9" refY="4" orient="auto">{tip}</marker></defs>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        box(20, 20, 620, 60, "user", "your script", "openmm.app, Forces, reporters; integrator.step(n)"),
        box(20, 114, 300, 70, "api", "python/", "SWIG interface with units;", "openmmpse.accuracy and the rest"),
        box(340, 114, 300, 70, "api", "serialization/", "XML, copies"),
        box(20, 218, 620, 70, "api", "openmmapi/", "PSEBrownianIntegrator: settings and their checks",
            "makeScene: which effects are on, and why"),
        box(20, 332, 620, 70, "shared", "platforms/base/", "PlannedStepKernel: the Plan and its renewal, keys of the noise,",
            "checkpoints, stress, words of refusals"),
        box(20, 436, 300, 70, "shared", "platforms/host/", "HostStepKernel: a step on arrays of the host", "MobilityEngine: what differs"),
        box(340, 436, 300, 70, "shared", "platforms/common/", "CommonStepKernel, DeviceEngine;", "kernels/*.cc: one text for all devices"),
        box(20, 540, 140, 82, "platform", "reference/", "direct sums in", "double: the oracle"),
        box(180, 540, 140, 82, "platform", "cpu/", "threads, FFTW, SIMD", "chosen at run time"),
        box(340, 540, 140, 82, "platform", "opencl/", "registration"),
        box(500, 540, 140, 82, "platform", "cuda/", "registration"),
        box(700, 218, 240, 404, "physics", "numerics/", "all physics, once, in double,", "without OpenMM", "",
            "Rpy, ForceCoupling: pair tensors", "Split, Envelope: M = M_R + M_W", "Window, WaveFactors: the grid",
            "RealTable, MixtureTable: pairs", "Plan: from the tolerance", "to everything numerical", "Lanczos: the root of M_R",
            "Noise: by counters", "Stress, ShearFlow"),
        arrow(170, 80, 170, 110),
        arrow(490, 80, 490, 110),
        arrow(170, 184, 170, 214),
        arrow(490, 184, 490, 214),
        arrow(330, 288, 330, 328, "IntegratePSEStepKernel (PSEKernels.h)"),
        arrow(170, 402, 170, 432),
        arrow(490, 402, 490, 432),
        arrow(90, 506, 90, 536),
        arrow(250, 506, 250, 536),
        arrow(410, 506, 410, 536),
        arrow(570, 506, 570, 536),
        *(arrow(640, y, 696, y) for y in (253, 367, 471)),
        text(820, 60, "Arrows: who calls whom.", 12.5),
        text(820, 80, "Data go down as a Plan;", 12.5),
        text(820, 100, "nothing calls up. reference/ and", 12.5),
        text(820, 120, "cpu/ use numerics/ as well.", 12.5),
        "</svg>\n",
    ]
    return "\n".join(parts)


if __name__ == "__main__":
    Path(__file__).with_suffix(".svg").write_text(picture(), encoding="utf-8")
