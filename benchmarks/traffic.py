# SPDX-License-Identifier: MIT
"""Bytes and operations of a step on a device, kernel by kernel, and the time that they take at least.

    python benchmarks/traffic.py [--particles 64000] [--phi 0.1] [--tolerance 1e-3]

Counted from the kernels of platforms/common in single precision; nothing is measured. The Plan is that of the CPU
platform, which is that of all platforms. Of a kernel the largest of four times counts: bytes of its arrays over the
bandwidth of the memory, bytes that its threads ask for over that of the second-level cache, requests (lines of 128 bytes
that a warp asks its first-level cache or local memory for) over one per clock and core, and instructions over what all
cores issue. DEVICE is an H100 (SXM) by its data sheet, with the share of the bandwidths that streaming kernels reach.
"""

import argparse
from typing import NamedTuple

import spheres

REAL, VECTOR, INDEX, FIXED = 4, 16, 4, 8  # bytes: a real, a real4 or a place, an int, a fixed-point number
SECTOR = 32  # bytes: the least that a lone access moves


class Device(NamedTuple):
    name: str
    memory: float  # bytes/s
    cache: float  # bytes/s
    requests: float  # lines of a warp per second
    issue: float  # instructions of one thread per second


DEVICE = Device("H100 (SXM)", 0.85 * 3.35e12, 5.5e12, 132 * 1.7e9, 132 * 128 * 1.7e9)

# Instructions per item: of the compiled single-precision kernels for compute capability 9.0, loops counted through.
CANDIDATE, POLYNOMIAL, PAIR = 22, 2, 55  # a distance tested; a coefficient; what else a neighbour costs in a product
PARTICLE_NOISE, MODE_NOISE, MODE = 204, 353, 90
BLOCK, WARP = (8, 8, 32), 32  # grid points of a work group; threads of a warp, and of a tile
STAGED_WEIGHT, COLLECTED, TOUCHED = 14, 32, 46  # a weight in local memory; a particle's bits; a tile adds a particle
GATHER_LINE = 12  # per line of the window and lane
FFT_PASSES = 3  # over the grid, each reading and writing all of it
# Lines that the threads of a warp ask for at once: places of a walk through common cells, places of their own neighbours
WALK_LINES, NEIGHBOUR_LINES = 8, 16
TOUCHED_REQUESTS = 8  # to local memory, of a tile that adds a particle
WINDOW_LINES = 1.25  # of a row of grid points


class Kernel(NamedTuple):
    name: str
    memory: float  # bytes per particle, from and to the memory of the device
    cache: float  # bytes per particle that threads ask for
    requests: float  # lines per particle
    instructions: float  # per particle


class Scene(NamedTuple):
    """What the counts depend on."""

    grid: float  # points per particle
    support: int
    neighbours: float
    candidates: float  # distances tested per particle
    degrees: int  # coefficients of both polynomials
    iterations: int
    waste: float  # particles staged over those that touch a block
    cell: float  # grid points along the edge of a column of cells


def sceneOf(numParticles, phi, tolerance):
    """The Scene of a suspension, from its Plan and a thermal step."""
    positions, length = spheres.suspension(numParticles, phi)
    context, integrator = spheres.hydrodynamic(spheres.makeSystem(numParticles, length), positions, tolerance)
    integrator.step(2)
    plan = integrator.getNumericalParameters()
    del context
    points = plan["gridDimensions"]
    support, range_ = plan["windowSupport"], plan["realCutoff"]
    density = numParticles / length**3
    # cells of about one range along x and y, a quarter along z
    cells = [max(1, int(k * length / range_)) for k in (1, 1, 4)]
    width = [length / n for n in cells]
    searched = [2 * range_ + w for w in width]  # mean extent of the cells that the range meets
    spacing = length / points[0]
    near = [(b + support) * spacing for b in BLOCK]
    waste = 1.0
    for extent, w in zip(near, width):
        waste *= min(extent + w, length) / min(extent, length)
    return Scene(
        grid=points[0] * points[1] * points[2] / numParticles,
        support=support,
        neighbours=density * 4 / 3 * 3.14159 * range_**3,
        candidates=density * searched[0] * searched[1] * searched[2],
        degrees=2 * (support + 6),
        iterations=plan["lanczosIterations"],
        waste=waste,
        cell=width[0] / spacing,
    )


def overlap(support, points):
    """How many pieces of so many grid points a window touches along an axis, on average."""
    return (points + support - 1) / points


def kernels(s):
    """All kernels of a thermal step with forces, the transforms among them."""
    P, n, g = s.support, s.neighbours, s.grid
    product = (
        n * INDEX + INDEX + 2 * VECTOR,
        n * 2 * VECTOR,
        n * (2 * NEIGHBOUR_LINES + 1 + s.degrees) / WARP,
        n * (PAIR + POLYNOMIAL * s.degrees),
    )
    blocks = overlap(P, BLOCK[0]) * overlap(P, BLOCK[1]) * overlap(P, BLOCK[2])
    staged, points = s.waste * blocks, sum(BLOCK)
    tiles = overlap(P, 4) * overlap(P, 8) * overlap(P, 8)  # that a particle touches
    weights = 3 * P * REAL
    lanes = 4 if P <= 4 else (8 if P <= 8 else 16)
    # What the particles of a work group ask for together: a column of cells, and a window around it
    together = 256 / lanes
    width, depth = s.cell + P, together * g / s.cell**2 + P
    rows = 3 * P * P
    m = s.iterations
    return [
        Kernel("sorting by cells", 52 + 64 + 92, 0, 6, 460),
        Kernel("window weights", 2 * VECTOR + weights, 3 * P * VECTOR, 3 * P / 4, 3 * P * (20 + POLYNOMIAL * (P + 3))),
        Kernel(
            "neighbours",
            VECTOR + n * INDEX,
            s.candidates * VECTOR,
            s.candidates * WALK_LINES / WARP,
            s.candidates * CANDIDATE,
        ),
        Kernel("forces and positions", 9 * SECTOR + VECTOR, 0, 8, 60),
        Kernel("real-space velocities", *product),
        Kernel(
            "real-space noise (Lanczos)",
            3 * VECTOR + m * (product[0] + 4 * VECTOR) + (m + 2) * VECTOR,
            m * product[1],
            m * (product[2] + 1),
            PARTICLE_NOISE + m * (product[3] + 40),
        ),
        Kernel(
            "spreading",
            weights + 2 * VECTOR + 3 * REAL * g,
            staged * (points * REAL + 2 * VECTOR),
            staged * 3 * points / WARP + tiles * TOUCHED_REQUESTS,
            staged * (points * STAGED_WEIGHT + COLLECTED) + tiles * WARP * TOUCHED,
        ),
        Kernel("Fourier transforms (six)", 6 * FFT_PASSES * 2 * REAL * g, 0, 0, 6 * 2.5 * 24 * g / 2),
        Kernel("waves (noise and scaling)", (6 * REAL + REAL / 2) * g, 0, 0.25 * g, (MODE_NOISE + MODE) * g / 2),
        Kernel(
            "gathering",
            weights + 3 * VECTOR + 3 * REAL * g,
            3 * REAL * width**2 * depth / together + weights,
            rows * WINDOW_LINES + rows / 3 * lanes / WARP,
            lanes * P * P * GATHER_LINE,
        ),
    ]


def timeOf(kernel, device=DEVICE):
    """The least time per particle (s), and what sets it."""
    times = {
        "memory": kernel.memory / device.memory,
        "cache": kernel.cache / device.cache,
        "requests": kernel.requests / device.requests,
        "instructions": kernel.instructions / device.issue,
    }
    bound = max(times, key=times.get)
    return times[bound], bound


def table(scene, device=DEVICE):
    """A Markdown table, and three lines about its sums."""
    rows = [(kernel, *timeOf(kernel, device)) for kernel in kernels(scene)]
    total = sum(row[1] for row in rows)
    transforms = next(row[1] for row in rows if row[0].name.startswith("Fourier"))
    lines = [
        "| kernels | bytes of memory per particle | per grid point | of the cache | requests | instructions |"
        " least time, ps per particle | set by | share |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for kernel, seconds, bound in rows:
        lines.append(
            f"| {kernel.name} | {kernel.memory:.0f} | {kernel.memory / scene.grid:.0f} | {kernel.cache:.0f} |"
            f" {kernel.requests:.0f} | {kernel.instructions:.0f} | {1e12 * seconds:.0f} | {bound} | {100 * seconds / total:.0f} % |"
        )
    lines += [
        "",
        f"Grid points per particle {scene.grid:.1f}, support {scene.support}, neighbours {scene.neighbours:.0f} of "
        f"{scene.candidates:.0f} distances tested, {scene.iterations} Lanczos iterations, {scene.waste:.1f} particles "
        f"staged for one that touches a block. On a {device.name} a step takes at least {1e12 * total:.0f} ps per "
        f"particle: {1e-6 / total:.0f} million particle-steps per second at most, {total / transforms:.1f} times the "
        f"six transforms, which are {100 * transforms / total:.0f} % of it.",
    ]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--particles", type=int, default=64000)
    parser.add_argument("--phi", type=float, default=0.1)
    parser.add_argument("--tolerance", type=float, default=1e-3)
    arguments = parser.parse_args()
    print(table(sceneOf(arguments.particles, arguments.phi, arguments.tolerance)))


if __name__ == "__main__":
    main()
