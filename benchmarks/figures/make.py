# SPDX-License-Identifier: MIT
"""Measure and draw the figures of docs/accuracy-and-speed.md.

python benchmarks/figures/make.py [NAME ...] --full    writes docs/figures/*.csv and *.png and the tables of the text
python benchmarks/figures/make.py [NAME ...] --quick   small scenes, into another folder; the text stays as it is
python benchmarks/figures/make.py [NAME ...] --redraw  pictures and tables again, from the CSV files that are there
"""

import argparse
import os
import platform
import sys
import time
from pathlib import Path

import baseline
import common
import conditioning
import effects
import error
import grid
import scaling
import splitting
import targets
import texts
from tqdm import tqdm

FIGURES = {module.NAME: module for module in (error, grid, effects, scaling, splitting, baseline, conditioning, targets)}
ROOT = Path(__file__).resolve().parents[2]
TEXT = ROOT / "docs" / "accuracy-and-speed.md"


def main(argv=None):
    """Run with command-line arguments; returns the exit status."""
    options = _parse(argv)
    folder = options.output or (ROOT / "build" / "figures" if options.quick else ROOT / "docs" / "figures")
    folder.mkdir(parents=True, exist_ok=True)
    bar = tqdm(options.names, bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}")
    try:
        for name in bar:
            bar.set_description_str(name)
            if not options.redraw:
                measure(FIGURES[name], folder, common.Effort(options.quick, options.threads))
            picture(FIGURES[name], folder)
            if not options.quick and options.output is None:
                fill(TEXT, name, common.readRows(folder / f"{name}.csv"))
    except KeyboardInterrupt:
        print("interrupted; figures that were finished are written", file=sys.stderr)
        return 130
    print(f"{', '.join(options.names)} in {folder}")
    return 0


def _parse(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(FIGURES)}; default: all")
    mode = parser.add_mutually_exclusive_group(required=True)
    for name in ("quick", "full", "redraw"):
        mode.add_argument(f"--{name}", action="store_true")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--output", type=Path, help="another folder; the text stays as it is")
    options = parser.parse_args(argv)
    unknown = [name for name in options.names if name not in FIGURES]
    if unknown:
        parser.error(f"unknown figure {unknown[0]!r}; known are {', '.join(FIGURES)}")
    options.names = options.names or list(FIGURES)
    return options


def measure(module, folder, effort):
    """Write the CSV file of one figure, and beside it how it was made."""
    start = time.perf_counter()
    rows = module.measure(effort)
    common.writeRows(folder / f"{module.NAME}.csv", rows)
    seconds = time.perf_counter() - start
    (folder / f"{module.NAME}.txt").write_text(
        f"{platform.machine()}, {os.cpu_count()} processors, {effort.threads} threads, {seconds:.0f} s\n",
        encoding="utf-8",
    )


def picture(module, folder):
    """Draw one figure from its CSV file."""
    module.draw(common.readRows(folder / f"{module.NAME}.csv"), folder / f"{module.NAME}.png")


def fill(path, name, rows):
    """Put the table of a figure between its markers in the text."""
    texts.fill(path, name, FIGURES[name].table(rows))


if __name__ == "__main__":
    sys.exit(main())
