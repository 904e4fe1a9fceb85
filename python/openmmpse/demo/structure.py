# SPDX-License-Identifier: MIT
"""Finds the structure file of T4 lysozyme in an installed package and reads its C-alpha atoms.

The file is data of other packages (both MIT): openmm-systems, small, or openmmtools, where it comes from. They are
located without being imported, so none of their own dependencies matters.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import NamedTuple

import numpy as np
from openmm import app, unit

PACKAGES = ("openmm_systems", "openmmtools")
FILE = Path("data") / "T4-lysozyme-L99A-implicit" / "receptor.pdb"


class Protein(NamedTuple):
    """One bead per residue."""

    topology: app.Topology  #: the C-alpha atoms of one chain, without bonds
    positions: np.ndarray  #: (N, 3), nm, mean at the origin
    source: str  #: package and file name, for the report


def find():
    """Path of the structure file and the name of the package that ships it."""
    for package in PACKAGES:
        spec = importlib.util.find_spec(package)
        for folder in (spec.submodule_search_locations or []) if spec else []:
            path = Path(folder) / FILE
            if path.is_file():
                return path, package.replace("_", "-")
    raise FileNotFoundError(
        "the demo reads T4 lysozyme from the package openmm-systems, which is not installed; "
        "install it with: pip install openmm-systems"
    )


def read(path, package):
    """The C-alpha atoms of the first chain that has any."""
    pdb = app.PDBFile(str(path))
    positions = np.asarray(pdb.getPositions(asNumpy=True).value_in_unit(unit.nanometer))
    for chain in pdb.topology.chains():
        atoms = [atom for atom in chain.atoms() if atom.name == "CA" and len(list(atom.residue.atoms())) > 1]
        if atoms:
            topology = app.Topology()
            copy = topology.addChain(chain.id)
            for atom in atoms:
                residue = topology.addResidue(atom.residue.name, copy, atom.residue.id)
                topology.addAtom("CA", atom.element, residue)
            beads = positions[[atom.index for atom in atoms]]
            return Protein(topology, beads - beads.mean(axis=0), f"{package}: {FILE.parent.name}/{FILE.name}")
    raise ValueError(f"{path} holds no protein chain: no C-alpha atom found")


def load():
    """The protein of the demo."""
    return read(*find())
