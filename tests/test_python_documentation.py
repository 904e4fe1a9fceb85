# SPDX-License-Identifier: MIT
"""The Python face of the library tells of itself: every method of the header, documented, with examples that run."""

import inspect
import re
from pathlib import Path

import openmmpse
from openmmpse import PSEBrownianIntegrator

ROOT = Path(__file__).resolve().parents[1]


def publicMethodsOfTheHeader():
    header = (ROOT / "openmmapi/include/openmmpse/PSEBrownianIntegrator.h").read_text(
        encoding="utf-8"
    )
    public = header[
        header.index("class OPENMM_EXPORT_PSE PSEBrownianIntegrator") : header.index("protected:")
    ]
    code = re.sub(r"/\*.*?\*/|//[^\n]*", "", public, flags=re.DOTALL)
    return sorted(set(re.findall(r"\b([a-z]\w*)\([^)]*\)\s*(?:const|override)?\s*[;{]", code)))


def testPythonHasEveryMethodOfTheHeader():
    methods = publicMethodsOfTheHeader()
    assert {
        "step",
        "applyMobility",
        "getGridDimensions",
        "setNumericalParameters",
        "describe",
    } <= set(methods)
    assert [name for name in methods if not hasattr(PSEBrownianIntegrator, name)] == []


def testEveryMethodIsDocumented():
    for name in publicMethodsOfTheHeader():
        text = getattr(PSEBrownianIntegrator, name).__doc__
        assert text and len(text.split()) >= 5, name
        if name.startswith("set"):
            assert "Raises" in text and "Parameters" in text, name
    assert "Pa s" in PSEBrownianIntegrator.__init__.__doc__
    assert PSEBrownianIntegrator.__module__ == "openmmpse"
    assert openmmpse.__all__ == ["HydrodynamicsReporter", "PSEBrownianIntegrator"]


def exampleIn(text):
    """The first block of lines indented by four spaces that starts with an import."""
    lines = text.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("    from openmm"))
    return "\n".join(
        line[4:]
        for line in lines[start:][
            : next(
                (i for i, line in enumerate(lines[start:]) if line and not line.startswith("    ")),
                None,
            )
        ]
    )


def testTheExampleOfTheDocstringRuns(capsys):
    example = exampleIn(inspect.getdoc(PSEBrownianIntegrator))
    assert len(example.strip().splitlines()) <= 15
    scope = {}
    exec(compile(example, "docstring", "exec"), scope)
    assert "603.4 Da/(nm ps)" in capsys.readouterr().out
    assert scope["context"].getStepCount() == 100


def testTheExampleOfTheReadmeRuns(capsys):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", readme, flags=re.DOTALL)
    scope = {}
    exec(compile(example, "README.md", "exec"), scope)
    assert scope["context"].getStepCount() == 1000
    assert "periodic" in capsys.readouterr().out
