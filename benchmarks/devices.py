# SPDX-License-Identifier: MIT
"""Particle-steps per second on a device, with and without noise, beside its Fourier transforms and published values.

    python benchmarks/devices.py --platform CUDA --precision mixed --output devices.csv [--quick]

Suspensions at tolerance 1e-3 without Forces but one on a single sphere. Each row: the best of several rounds, in which
the Contexts with and without noise take turns; the share of the six transforms is that of getStageTimes(), whose measured
steps wait for the device after each stage. The device's name is written with the numbers.
"""

import argparse
import csv
import sys

import openmm
import spheres

from openmmpse.accuracy.stages import shares

sys.path.insert(0, str(spheres.__file__).rsplit("/", 1)[0] + "/figures")
from scaling import PUBLISHED  # noqa: E402

FULL = ((16, 32, 64, 128, 256, 512, 1024, 2048), (0.1, 0.2, 0.4))  # thousands of particles, volume fractions
QUICK = ((1, 4), (0.1,))
COLUMNS = (
    "platform",
    "precision",
    "device",
    "particles",
    "phi",
    "grid",
    "iterations",
    "without noise",
    "with noise",
    "transforms",
    "largest other stage",
    "published without noise",
    "published with noise",
)


def measure(platform, precision, thousands, phi, steps, rounds):
    """One row."""
    number = 1000 * thousands
    positions, length = spheres.suspension(number, phi)
    system = spheres.makeSystem(number, length)
    pairs = [
        spheres.hydrodynamic(system, positions, temperature=temperature, device=(platform, precision))
        for temperature in (0.0, spheres.TEMPERATURE)
    ]
    seconds = spheres.secondsPerStep([integrator for _, integrator in pairs], steps, rounds)
    context, integrator = pairs[1]
    parameters = integrator.getNumericalParameters()
    stages = shares(integrator.getStageTimes())
    transforms = sum(share for name, share in stages.items() if "Fourier" in name)
    others = {name: share for name, share in stages.items() if "Fourier" not in name}
    worst = max(others, key=others.get)
    published = PUBLISHED.get(thousands, ("", "")) if phi == 0.1 else ("", "")
    device = openmm.Platform.getPlatformByName(platform).getPropertyValue(context, "DeviceName")
    grid = " x ".join(str(points) for points in parameters["gridDimensions"])
    values = (
        platform,
        precision,
        device,
        number,
        phi,
        grid,
        parameters["lanczosIterations"],
        round(number / seconds[0]),
        round(number / seconds[1]),
        round(transforms, 2),
        f"{worst} {others[worst]:.2f}",
        *published,
    )
    return dict(zip(COLUMNS, values))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--platform", default="CUDA")
    parser.add_argument("--precision", default="mixed", choices=("single", "mixed", "double"))
    parser.add_argument("--output", default="devices.csv")
    parser.add_argument("--quick", action="store_true", help="small scenes, few steps")
    arguments = parser.parse_args()
    numbers, fractions = QUICK if arguments.quick else FULL
    steps, rounds = (3, 2) if arguments.quick else (50, 5)
    with open(arguments.output, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for phi in fractions:
            for thousands in numbers:
                row = measure(arguments.platform, arguments.precision, thousands, phi, steps, rounds)
                writer.writerow(row)
                file.flush()
                print(", ".join(f"{name} {value}" for name, value in row.items() if value != ""), flush=True)


if __name__ == "__main__":
    main()
