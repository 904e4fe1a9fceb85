# SPDX-License-Identifier: MIT
"""What unequal radii cost: a thermal step of five radii in units of one of equal spheres.

The random spheres of effect_costs.py in one box, with the Plans that are automatic and with those of grids prescribed to both, each
with its best range there. Both Contexts live in one process and take single steps in turn, each first every other time; the
figure is the median of the ratios of such pairs of steps, in processor time on one thread.
"""
import argparse
import time

import numpy as np

import effect_costs


def variantsOf(count, points):
    """Equal spheres and the mixture, on a grid of so many points per axis, or each on its own: 0."""
    scene = effect_costs.Scene(*effect_costs.randomSpheres(count), radii=())
    return [effect_costs.Variant(scene, radii, points=points) for radii in (effect_costs.EQUAL, effect_costs.FIVE)]


def ratios(variants, rounds):
    """Of times of single steps taken in turn."""
    for variant in variants:
        variant.integrator.step(5)
    for turn in range(rounds):
        for variant in variants if turn % 2 == 0 else variants[::-1]:
            start = time.process_time()
            variant.integrator.step(1)
            variant.seconds.append(time.process_time() - start)
    return np.array(variants[1].seconds)/np.array(variants[0].seconds)


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
        variants = variantsOf(arguments.particles, points)
        for variant in variants:
            variant.start(arguments.threads)
        found = ratios(variants, arguments.rounds)
        cells = [f"{points}³" if points else "automatic"]
        cells += ["x".join(map(str, v.integrator.getNumericalParameters()["gridDimensions"])) for v in variants]
        cells += [f"{v.milliseconds:.1f}" for v in variants]
        cells += [f"{np.median(found):.3f}", "{:.2f} to {:.2f}".format(*np.percentile(found, [25, 75]))]
        print("| " + " | ".join(cells) + " |", flush=True)
        if arguments.stages:
            for variant in variants:
                print(variant.radii, variant.integrator.getNumericalParameters(), variant.integrator.getStageTimes())


if __name__ == "__main__":
    main()
