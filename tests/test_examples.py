# SPDX-License-Identifier: MIT
"""
The scripts of examples/ in their short form: each prints its table, writes its picture, and finds the
numbers it expects, on the CPU platform alone.
"""
import importlib
import importlib.util
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from scenes import FALSE_ALARM

FOLDER = Path(__file__).resolve().parents[1]/"examples"
LONGEST = 120


@pytest.fixture(autouse=True, scope="module")
def found():
    """The examples as modules, which a script finds because it lies beside them."""
    sys.path.insert(0, str(FOLDER))
    yield
    sys.path.remove(str(FOLDER))


def shipped(package, path):
    """A file of a package that is installed, or the test is skipped."""
    spec = importlib.util.find_spec(package)
    if spec is None:
        pytest.skip(f"needs the package {package}")
    return Path(spec.submodule_search_locations[0])/path


def rowsOf(name, folder, *arguments):
    """The rows of an example, once they were found as expected; they share the allowance for false alarms."""
    module = importlib.import_module(name)
    rows = module.main(module.run, module.__doc__, ["--short", "--output", str(folder), *arguments],
                       getattr(module, "OPTIONS", ()))
    assert (folder/f"{name}.png").stat().st_size > 5000
    limit = FALSE_ALARM/len(rows)
    for row in (row for row in rows if not math.isnan(row.expected)):
        excess = max(abs(row.value - row.expected) - row.slack, 0.0)
        chance = 2*stats.t.sf(excess/row.error, row.degrees) if row.error > 0 else float(excess == 0)
        assert chance > limit, f"{row.quantity}: {row.value} +- {row.error}, expected {row.expected}"
    return rows


def chanceBelow(bound, mean, scatter, seeds):
    """
    Probability that a positive number is below a bound, by the mean and the standard deviation of its logarithm over
    runs with other seeds: Student's distribution of one more.
    """
    return stats.t.sf((mean - math.log(bound))/(scatter*math.sqrt(1 + 1/seeds)), seeds - 1)


def testZimmAndRouse(tmp_path):
    """Each chain and each exponent; Zimm chains of 10 diffuse four times as fast as Rouse's."""
    rows = {row.quantity: row for row in rowsOf("zimm_and_rouse", tmp_path)}
    assert rows["Zimm, N = 10: D/D0"].value > 4*rows["Rouse, N = 10: D/D0"].value


def testSedimentation(tmp_path):
    rowsOf("sedimentation", tmp_path)


def testCollapse(tmp_path):
    """Hydrodynamic interactions make it faster; the scatter is that of 12 chains, here are 40."""
    assert chanceBelow(1, 0.742, 0.181*math.sqrt(12/40), 20) < FALSE_ALARM
    assert rowsOf("collapse", tmp_path)[1].value > 1


def testShearedDna(tmp_path):
    """Flow stretches; the scatter is that of runs two thirds as long."""
    assert chanceBelow(1, 0.685, 0.137*math.sqrt(2/3), 45) < FALSE_ALARM
    rows = {row.quantity: row.value for row in rowsOf("sheared_dna", tmp_path)}
    assert rows["DNA, Wi = 3: stretch"] > rows["DNA, Wi = 0: stretch"]


def testGel(tmp_path):
    """Spheres aggregate in both solvents; the scatter is that of the one with fewer contacts at the end."""
    assert chanceBelow(4, 2.334, 0.109, 20) < FALSE_ALARM
    start, *ends = rowsOf("gel", tmp_path)
    for end in (row for row in ends if row.quantity.startswith("contacts")):
        assert end.value > 4*start.value


def testStructureOfAGel():
    """Three spheres in a row through a face of the box, a pair, and one alone."""
    gel = importlib.import_module("gel")
    x = np.array([[9.0, 1, 1], [1.1, 1, 1], [3.2, 1, 1], [5, 7, 5], [5, 5, 5], [8, 8, 8]])
    contacts, labels = gel.structure(x, 10.0)
    assert contacts.tolist() == [1, 2, 1, 1, 1, 0]
    assert labels.tolist() == [0, 0, 0, 3, 3, 5]


def testProteinDiffusion(tmp_path):
    """A structure file given by its path, of a small protein."""
    rowsOf("protein_diffusion", tmp_path, str(shipped("OpenSMOG", "share/tests/PDBs/2ci2.adj.pdb")))


def testSavedSystem(tmp_path):
    shipped("OpenSMOG", "")
    rowsOf("saved_system", tmp_path)
    assert "<System" in (tmp_path/"system.xml").read_text()


@pytest.mark.parametrize("name", sorted(path.name for path in FOLDER.glob("*.py")))
def testAnExampleIsShort(name):
    assert len((FOLDER/name).read_text().splitlines()) < LONGEST
