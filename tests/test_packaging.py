# SPDX-License-Identifier: MIT
"""What is handed out: one version everywhere, complete sources, and the licences of what a wheel carries."""

import importlib.util
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

import openmmpse

try:
    import tomllib
except ImportError:  # before Python 3.11
    import tomli as tomllib

yaml = pytest.importorskip("yaml")

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
#: what conda-forge calls otherwise
CONDA = {"matplotlib": "matplotlib-base"}


def loadRepair():
    specification = importlib.util.spec_from_file_location("repair", ROOT / "packaging" / "repair.py")
    module = importlib.util.module_from_spec(specification)
    sys.modules["repair"] = module
    specification.loader.exec_module(module)
    return module


repair = loadRepair()


def requirements(texts):
    """{name: condition} of lists such as "openmm>=8.6.1,<8.7" or, with conda, "openmm >=8.6.1,<8.7"."""
    return {match[1]: match[2] for match in (re.match(r"([\w-]+)\s*(.*)", text) for text in texts)}


# ---------------------------------------------------------------- version and dependencies


def testTheVersionIsEverywhereTheSame():
    version = PROJECT["project"]["version"]
    assert openmmpse.__version__ == version
    headings = re.findall(r"^## (.+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert version in headings[:2] and set(headings[: headings.index(version)]) <= {"Unreleased"}
    recipe = yaml.safe_load((ROOT / "packaging/conda/recipe/recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["context"]["version"] == version


def testTheCondaRecipeAsksForTheSame():
    recipe = yaml.safe_load((ROOT / "packaging/conda/recipe/recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["package"]["name"] == PROJECT["project"]["name"]
    needed = requirements(PROJECT["project"]["dependencies"])
    expected = {CONDA.get(name, name): condition for name, condition in needed.items()}
    expected["python"] = PROJECT["project"]["requires-python"]
    assert requirements(recipe["requirements"]["run"]) == expected
    build = requirements(PROJECT["build-system"]["requires"])
    assert build.pop("swig") == "~=4.5.0" and "swig 4.5.*" in recipe["requirements"]["build"]
    host = requirements(recipe["requirements"]["host"])
    assert {name: host[name] for name in build} == build
    tools = requirements(line for line in recipe["requirements"]["build"] if not line.startswith("$"))
    assert tools["cmake"] == PROJECT["tool"]["scikit-build"]["cmake"]["version"]
    assert recipe["about"]["license"] == PROJECT["project"]["license"]


def testTheCitationFile():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["cff-version"] == "1.2.0" and citation["license"] == PROJECT["project"]["license"]
    assert citation["authors"] == PROJECT["project"]["authors"]
    assert "version" not in citation  # there is one place for it
    assert {reference["doi"] for reference in citation["references"]} == {
        "10.1063/1.4978242", "10.1021/acs.jpcb.3c06662"}  # fmt: skip


def testTypesAreInstalled():
    folder = Path(openmmpse.__file__).parent
    assert (folder / "py.typed").exists() and (folder / "binding.pyi").exists()


# ---------------------------------------------------------------- sources


def testTheSourceArchiveIsComplete(tmp_path):
    """All tracked files but those that pyproject.toml leaves out, with their contents, and no others."""
    backend = pytest.importorskip("scikit_build_core.build")
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a checkout")
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    left = tuple(PROJECT["tool"]["scikit-build"]["sdist"]["exclude"])
    tracked = {name for name in listed if name and (ROOT / name).exists()}
    tracked = {name for name in tracked if not f"/{name}".startswith(left)}
    code = "import sys; from scikit_build_core.build import build_sdist; print(build_sdist(sys.argv[1]))"
    done = subprocess.run([sys.executable, "-c", code, tmp_path], cwd=ROOT, capture_output=True, text=True, check=True)
    assert backend and done.stdout
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as file:
        names = {member.name.partition("/")[2] for member in file.getmembers() if not member.isdir()}
        untracked = names - tracked - {"PKG-INFO"}
        status = subprocess.run(["git", "status", "--porcelain", "--untracked-files=all"], cwd=ROOT,
                                capture_output=True, text=True, check=True).stdout  # fmt: skip
        assert tracked - names == set()
        assert all(f"?? {name}" in status for name in untracked)  # new files of a developer, no products of a build
        for name in ("CMakeLists.txt", "python/openmmpse.i", "numerics/Plan.cpp", "packaging/cuda13/LICENSE"):
            member = next(m for m in file.getmembers() if m.name.endswith(f"/{name}"))
            assert file.extractfile(member).read() == (ROOT / name).read_bytes()


# ---------------------------------------------------------------- licences of a wheel


def testLicencesOfWhatIsInside():
    names = ["libfftw3-01234567.so.3.6.10", "libfftw3f-89abcdef.so.3.6.10", "libhwy-00000000.so.1.0.3"]
    parts = repair.partsOf(names)
    assert [part.name for part in parts] == ["Eigen", "FFTW", "Highway"]
    assert repair.expressionOf(parts) == "MIT AND MPL-2.0 AND GPL-2.0-or-later AND Apache-2.0"
    assert repair.expressionOf(repair.partsOf([])) == "MIT AND MPL-2.0"  # FFTW linked by the user, from elsewhere
    with pytest.raises(repair.RepairError, match="libmystery-1.so.*licence is not known"):
        repair.partsOf([*names, "libmystery-1.so"])


def testTextsOfLicences(tmp_path):
    part = repair.COPIED_IN["libfftw3"]
    with pytest.raises(repair.RepairError, match="no licence text of FFTW.*libfftw3"):
        repair.textsOf(part, tmp_path)
    copyright = tmp_path / "usr/share/doc/libfftw3-double3/copyright"
    copyright.parent.mkdir(parents=True)
    copyright.write_text("GPL-2+, see /usr/share/common-licenses/GPL-2")
    with pytest.raises(repair.RepairError, match="GPL-2 does not exist"):
        repair.textsOf(part, tmp_path)
    common = tmp_path / "usr/share/common-licenses"
    common.mkdir()
    (common / "GPL-2").write_text("the whole text")
    assert repair.textsOf(part, tmp_path) == {"FFTW.txt": copyright.read_text(), "GPL-2.txt": "the whole text"}


def testMetadataOfAWheel(tmp_path):
    folder = tmp_path / "openmm_pse-0.1.0"
    information, libraries = folder / "openmm_pse-0.1.0.dist-info", folder / "openmm_pse.libs"
    for path in (information / "licenses", libraries):
        path.mkdir(parents=True)
    metadata = "Metadata-Version: 2.4\nName: openmm-pse\nLicense-Expression: MIT\nLicense-File: LICENSE\n\nLong\n\ntext\n"
    (information / "METADATA").write_text(metadata)
    (libraries / "libhwy-00000000.so.1").touch()
    try:
        expression = repair.addLicences(folder)
    except repair.RepairError as error:
        pytest.skip(str(error))  # no texts of Eigen and Highway here
    text = (information / "METADATA").read_text()
    head, _, body = text.partition("\n\n")
    named = re.findall(r"^License-File: (.+)$", head, re.MULTILINE)
    assert f"\nLicense-Expression: {expression}\n" in text and expression == "MIT AND MPL-2.0 AND Apache-2.0"
    assert body == "Long\n\ntext\n" and {"LICENSE", "Eigen.txt", "Highway.txt"} <= set(named)
    assert all((information / "licenses" / name).stat().st_size > 100 for name in named if name != "LICENSE")
    assert repair.withLicence("Name: x\nLicense-Expression: MIT\n", "MIT AND MPL-2.0", ["a.txt"]) == (
        "Name: x\nLicense-Expression: MIT AND MPL-2.0\nLicense-File: a.txt\n")  # without a long description
    with pytest.raises(repair.RepairError, match="0 lines"):
        repair.withLicence("Name: x\n\n", "MIT", [])
