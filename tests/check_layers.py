# SPDX-License-Identifier: MIT
"""Which layer may include what: checks every #include of the C++ sources against the table below.

Run as a script (exit status 1 and one line per violation) or by pytest.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
STANDARD = r"[a-z_0-9]+"  # no folder, no suffix
POSIX = r"(unistd|sched|sys/[a-z]+|pthread)\.h"
EIGEN = r"Eigen/\w+"
OWN_API = r"openmmpse/.+\.h"
OPENMM = r"(OpenMM\.h|openmm/.+\.h)"
OPENMM_PUBLIC = r"(OpenMM\.h|openmm/\w+\.h|openmm/(internal|serialization)/\w+\.h)"
NUMERICS = r"numerics/\w+\.h"
# the headers of these folders
BASE, HOST, COMMON = "platforms/base", "platforms/host", "platforms/common"

# folder: what it may include, as patterns of the whole name between quotes or brackets. A header of
# the same folder is always allowed, and so is the C++ standard library.
ALLOWED = {
    "numerics": [EIGEN, NUMERICS],
    "openmmapi/include": [OPENMM_PUBLIC, OWN_API],
    "openmmapi/src": [OPENMM_PUBLIC, OWN_API, r"numerics/Plan\.h"],
    "serialization": [OPENMM_PUBLIC, OWN_API],
    "platforms/base": [OPENMM_PUBLIC, OWN_API, NUMERICS, POSIX],
    "platforms/host": [OPENMM_PUBLIC, r"openmm/reference/\w+\.h", OWN_API, NUMERICS, BASE],
    "platforms/reference": [
        OPENMM_PUBLIC,
        r"openmm/reference/\w+\.h",
        OWN_API,
        NUMERICS,
        BASE,
        HOST,
    ],
    "platforms/cpu": [
        OPENMM_PUBLIC,
        r"openmm/(reference|cpu)/\w+\.h",
        OWN_API,
        NUMERICS,
        BASE,
        HOST,
        r"hwy/.+\.h",
        r"fftw3\.h",
    ],
    "platforms/common": [
        OPENMM_PUBLIC,
        r"openmm/common/\w+\.h",
        OWN_API,
        NUMERICS,
        BASE,
        r"KernelSources\.h",
    ],
    "platforms/opencl": [OPENMM_PUBLIC, r"openmm/opencl/\w+\.h", OWN_API, COMMON],
    "platforms/cuda": [OPENMM_PUBLIC, r"openmm/cuda/\w+\.h", OWN_API, COMMON],
    "python": [OPENMM, r"OpenMM(Amoeba|Drude)\.h", OWN_API, r"Python\.h", r"bindingSupport\.h"],
}
INCLUDE = re.compile(r'^\s*#\s*include\s*(?:<([^>]+)>|"([^"]+)")', re.MULTILINE)


def namesOfHeaders(folder):
    """Patterns of the headers of a folder, as its own files and the layers above write them."""
    return [
        rf"({re.escape(folder)}/)?{re.escape(path.name)}" for path in (ROOT / folder).glob("*.h")
    ]


def patternsOf(folder):
    """All patterns that a folder may include."""
    patterns = [STANDARD, *namesOfHeaders(folder)]
    for pattern in ALLOWED[folder]:
        patterns += namesOfHeaders(pattern) if pattern in (BASE, HOST, COMMON) else [pattern]
    return patterns


def sources(folder):
    """The C++ and SWIG files of a layer."""
    return sorted(
        path for path in (ROOT / folder).rglob("*") if path.suffix in (".h", ".cpp", ".i")
    )


def isAllowed(folder, name):
    """Whether a file of the folder may include the header."""
    return any(re.fullmatch(pattern, name) for pattern in patternsOf(folder))


def violations():
    """One line for every include that the table forbids, and for every layer without sources."""
    found = [f"{folder} has no sources" for folder in ALLOWED if not sources(folder)]
    for folder in ALLOWED:
        for path in sources(folder):
            for match in INCLUDE.finditer(path.read_text(encoding="utf-8")):
                name = match[1] or match[2]
                if not isAllowed(folder, name):
                    found.append(
                        f"{path.relative_to(ROOT)} includes {name}, which {folder} may not"
                    )
    return found


def testLayersAreRespected():
    assert violations() == []


def testForbiddenIncludesAreNoticed():
    forbidden = {
        "numerics": ["openmm/Vec3.h", "openmmpse/PSEKernels.h", "hwy/highway.h", "iostream.h"],
        "openmmapi/include": ["numerics/Plan.h", "openmm/reference/ReferencePlatform.h"],
        "serialization": ["numerics/Plan.h"],
        "platforms/base": ["HostStepKernel.h", "openmm/reference/ReferencePlatform.h"],
        "platforms/host": ["CpuEngine.h", "openmm/cpu/CpuPlatform.h"],
        "platforms/common": [
            "HostStepKernel.h",
            "openmm/reference/ReferencePlatform.h",
            "openmm/opencl/OpenCLContext.h",
        ],
        "platforms/opencl": ["openmm/cuda/CudaPlatform.h", "StepKernel.h", "numerics/Plan.h"],
        "platforms/cuda": ["openmm/opencl/OpenCLPlatform.h", "StepKernel.h", "numerics/Plan.h"],
        "platforms/reference": [
            "CpuEngine.h",
            "platforms/cpu/CpuEngine.h",
            "fftw3.h",
            "openmm/cpu/CpuPlatform.h",
        ],
        "platforms/cpu": ["ReferenceEngine.h", "platforms/reference/ReferenceEngine.h"],
    }
    assert [
        name for folder, names in forbidden.items() for name in names if isAllowed(folder, name)
    ] == []


if __name__ == "__main__":
    lines = violations()
    print("\n".join(lines) if lines else "the layers are respected")
    sys.exit(1 if lines else 0)
