# SPDX-License-Identifier: MIT
"""What unequal radii cost: a thermal step of five radii in units of one of equal spheres.

The random spheres of effect_costs.py, with the Plans that are automatic and with those of grids prescribed to both, each
with its best range there. Both Contexts live in one process and take single steps in turn, each first every other time; the
figure is the median of the ratios of such pairs of steps, in processor time on one thread.
"""
import argparse
import time

import numpy as np

import effect_costs
from openmmpse.accuracy import stages


def scenesOf(count, points):
    """Equal spheres and the mixture, on a grid of so many points per axis, or each on its own: 0."""
    scenes = effect_costs.randomSpheres(count)[:2]
    for scene in scenes:
        scene.points = points
    return scenes


def ratios(scenes, rounds):
    """Of times of single steps taken in turn."""
    for scene in scenes:
        scene.integrator.step(5)
        scene.integrator.getStageTimes()
    for turn in range(rounds):
        for scene in scenes if turn % 2 == 0 else scenes[::-1]:
            start = time.process_time()
            scene.integrator.step(1)
            scene.seconds.append(time.process_time() - start)
    return np.array(scenes[1].seconds)/np.array(scenes[0].seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=int, default=16000)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--grids", type=int, nargs="*", default=[0, 56, 60, 64], help="points per axis; 0: automatic")
    parser.add_argument("--stages", action="store_true", help="and where the time goes, in ms per step")
    arguments = parser.parse_args()
    print("| grid asked for | grid of the equal spheres | of the mixture | ms | ms | mixture / equal | middle half |")
    print("|---|---|---|---:|---:|---:|---|")
    for points in arguments.grids:
        scenes = scenesOf(arguments.particles, points)
        for scene in scenes:
            scene.start(arguments.threads)
        found = ratios(scenes, arguments.rounds)
        cells = [f"{points}³" if points else "automatic"]
        cells += ["x".join(map(str, scene.integrator.getNumericalParameters()["gridDimensions"])) for scene in scenes]
        cells += [f"{1e3*np.median(scene.seconds):.1f}" for scene in scenes]
        cells += [f"{np.median(found):.3f}", "{:.2f} to {:.2f}".format(*np.percentile(found, [25, 75]))]
        print("| " + " | ".join(cells) + " |", flush=True)
        if arguments.stages:
            for scene in scenes:
                print(scene.name, {part: round(cell, 2) for part, cell in scene.row()[1].items()},
                      scene.integrator.getNumericalParameters(), scene.integrator.getStageTimes())


if __name__ == "__main__":
    main()
