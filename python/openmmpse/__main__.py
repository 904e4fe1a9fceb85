# SPDX-License-Identifier: MIT
"""Command line: python -m openmmpse doctor | demo | accuracy | plot."""

import argparse
import sys


def _doctor(arguments):
    from openmmpse import doctor

    return doctor.main(arguments)


def _demo(arguments):
    from openmmpse import demo

    return demo.main(arguments)


def _accuracy(arguments):
    from openmmpse import accuracy

    return accuracy.main(arguments)


def _plot(arguments):
    from openmmpse import plot

    return plot.main(arguments)


COMMANDS = {
    "doctor": (_doctor, "check the installation on every platform"),
    "demo": (_demo, "simulate a protein and a polymer in water and compare with theory"),
    "accuracy": (_accuracy, "measure error against time for your own scene and recommend a tolerance"),
    "plot": (_plot, "draw what HydrodynamicsReporter wrote"),
}


def main(argv=None):
    """Run one subcommand with the arguments that follow it and return its exit status."""
    parser = argparse.ArgumentParser(
        prog="python -m openmmpse",
        description="Brownian dynamics with hydrodynamic interactions for OpenMM.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog="commands:\n"
        + "\n".join(f"  {name:9} {text}" for name, (_, text) in COMMANDS.items()),
    )
    parser.add_argument("command", choices=COMMANDS)
    parser.add_argument(
        "arguments", nargs=argparse.REMAINDER, help="passed to the command; try --help there"
    )
    options = parser.parse_args(argv)
    return COMMANDS[options.command][0](options.arguments)


if __name__ == "__main__":
    sys.exit(main())
