# SPDX-License-Identifier: MIT
"""Compiles recorded device programs as OpenMM's CUDA platform would, on a machine without a GPU.

A program is recorded when OPENMMPSE_KERNEL_DUMP names a folder (CONTRIBUTING.md): its precision, its
defines as GPUs get them, and its source. OpenMM puts a text of its own in front of
it; that text is taken from its library libOpenMMCUDA.so, and the defines between the two are those
of OpenMM 8.6 for the precision and shape of box. NVRTC then makes code for real architectures, which
tells the registers and the memory of each kernel.

As a script: `python tests/nvrtc.py FOLDER` prints the table and fails as the test does.
"""

import concurrent.futures
import ctypes
import functools
import importlib.util
import multiprocessing
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import openmm.version

ARCHITECTURES = (75, 80, 90, 120)
PRECISIONS = ("single", "mixed", "double")
TITLE = "CUDA: registers/static shared/stack/spilled bytes, the most of any variant"
OPTIONS = ("--use_fast_math",)  # OpenMM's own
FLOAT = re.compile(r"(?<![\w.])-?\d+\.\d+(e[+-]?\d+)?f?", re.IGNORECASE)
DOUBLE4 = "--diag-suppress=1444"  # CUDA 13 deprecates double4, which OpenMM's text uses


class MissingError(Exception):
    """Something that compiling needs is not installed; the text says what."""


# --- what OpenMM would compile ------------------------------------------------------------------


@functools.cache
def openmmText(mark):
    """The text inside libOpenMMCUDA.so that contains the mark."""
    library = Path(openmm.version.openmm_library_path) / "plugins" / "libOpenMMCUDA.so"
    if not library.exists():
        raise MissingError(
            "OpenMM's CUDA platform is not installed "
            f"(pip install --no-deps openmm-cuda-13=={openmm.version.short_version})"
        )
    data = library.read_bytes()
    place = data.find(mark)
    if place < 0:
        raise ValueError(f"{library} has no text with {mark!r}: is it another version than 8.6?")
    return data[data.rfind(b"\0", 0, place) + 1 : data.find(b"\0", place)].decode("ascii")


def commonText():
    """What OpenMM puts before every CUDA program: KERNEL, GLOBAL_ID, realToFixedPoint..."""
    return openmmText(b'#define KERNEL extern "C" __global__')


def vectorText():
    """What it puts before programs in the Common dialect: operators of vectors, trimTo3..."""
    return openmmText(b"inline __device__ float2 operator+(float2")


def mathDefines(precision):
    """The functions that OpenMM names in capitals, and the constructors of vectors."""
    real = "double" if precision == "double" else "float"
    mixed = "float" if precision == "single" else "double"
    suffix = "" if real == "double" else "f"
    functions = "sqrt rsqrt exp log pow cos sin tan acos asin atan erf erfc fma fabs".split()
    defines = {name.upper(): name + suffix for name in functions}
    defines["RECIP"] = f"1.0{suffix}/"
    for kind, name in (("real", real), ("mixed", mixed)):
        defines |= {f"make_{kind}{n}": f"make_{name}{n}" for n in (2, 3, 4)}
    if precision != "single":
        defines[f"USE_{precision.upper()}_PRECISION"] = "1"
    return defines


def boxDefines(triclinic):
    """The macros of OpenMM that depend on the shape of the box."""
    start = b"{real scale3 = floor(%s*" if triclinic else b"{%s -= floor(%s*"
    marks = {
        "APPLY_PERIODIC_TO_DELTA(delta)": (b"delta.z", b"delta.x", b"delta.x"),
        "APPLY_PERIODIC_TO_POS(pos)": (b"pos.z", b"pos.x", b"pos.x"),
        "APPLY_PERIODIC_TO_POS_WITH_CENTER(pos, center)": (
            b"(pos.z-center.z)",
            b"pos.x",
            b"(pos.x-center.x)",
        ),
    }
    return {
        macro: openmmText(start % (names[:1] if triclinic else names[1:]))
        for macro, names in marks.items()
    }


def typedefs(precision):
    """The types of the dialect."""
    names = {
        "real": "double" if precision == "double" else "float",
        "mixed": "float" if precision == "single" else "double",
    }
    lines = [f"typedef {c}{n} {kind}{n};" for kind, c in names.items() for n in ("", 2, 3, 4)]
    return "\n".join([*lines, "typedef unsigned int tileflags;", ""])


@dataclass(frozen=True)
class Program:
    """A recorded program; `defines` are the lines as the preprocessor gets them."""

    name: str
    precision: str
    box: str
    defines: str
    source: str

    @classmethod
    def read(cls, path):
        head, defines, source = path.read_text(encoding="ascii").split("\n\n", 2)
        keys = dict(line.split(" ", 1) for line in head.splitlines())
        return cls(keys["program"], keys["precision"], keys["box"], defines, source)

    def text(self):
        """All that NVRTC gets."""
        own = set(re.findall(r"^#define (\w+)", self.defines, re.MULTILINE))
        defines = {
            "SYNC_WARPS": "__syncwarp();",
            "SHFL(var, srcLane)": "__shfl_sync(0xffffffff, var, srcLane);",
            "BALLOT(var)": "__ballot_sync(0xffffffff, var);",
            **mathDefines(self.precision),
            **boxDefines(self.box == "triclinic"),
        }
        lines = [f"#define {k} {v}" for k, v in sorted(defines.items()) if k not in own]
        parts = ["\n".join(lines), typedefs(self.precision), commonText(), self.defines]
        return "\n".join([*parts, vectorText() + self.source, ""])


def readPrograms(folder):
    """Every program recorded in a folder."""
    return [Program.read(path) for path in sorted(Path(folder).glob("*.txt"))]


# --- NVRTC --------------------------------------------------------------------------------------


def nvrtcPlaces():
    """Where NVRTC may be: toolkits, then the wheel nvidia-cuda-nvrtc."""
    toolkits = [os.environ.get("CUDA_PATH"), os.environ.get("CUDA_HOME"), "/usr/local/cuda"]
    folders = [Path(toolkit) / "lib64" for toolkit in toolkits if toolkit]
    wheel = importlib.util.find_spec("nvidia")
    if wheel is not None:
        folders += [Path(place) / "cu13" / "lib" for place in wheel.submodule_search_locations]
    return [path for folder in folders for path in sorted(folder.glob("libnvrtc.so.[0-9]*"))]


@functools.cache
def nvrtc():
    """The library, if it knows all the architectures."""
    for path in nvrtcPlaces():
        library = ctypes.CDLL(str(path))
        count = ctypes.c_int()
        library.nvrtcGetNumSupportedArchs(ctypes.byref(count))
        known = (ctypes.c_int * count.value)()
        library.nvrtcGetSupportedArchs(known)
        if set(ARCHITECTURES) <= set(known):
            return library
    wanted = ", ".join(f"{a / 10}" for a in ARCHITECTURES)
    raise MissingError(
        f"no NVRTC that makes code for compute capability {wanted}: install a CUDA 13 toolkit, or "
        "pip install 'nvidia-cuda-nvrtc>=13,<14'"
    )


def compileText(text, architecture):
    """Return whether NVRTC and its assembler accepted the text, and what they said."""
    library, program, size = nvrtc(), ctypes.c_void_p(), ctypes.c_size_t()
    if library.nvrtcCreateProgram(ctypes.byref(program), text.encode(), b"", 0, None, None) != 0:
        return False, "nvrtcCreateProgram failed"
    options = [f"-arch=sm_{architecture}", *OPTIONS, DOUBLE4, "--ptxas-options=-v"]
    array = (ctypes.c_char_p * len(options))(*(option.encode() for option in options))
    status = library.nvrtcCompileProgram(program, len(options), array)
    library.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    library.nvrtcGetProgramLog(program, log)
    library.nvrtcDestroyProgram(ctypes.byref(program))
    return status == 0, log.value.decode(errors="replace")


# --- what each kernel needs ---------------------------------------------------------------------


@dataclass(frozen=True)
class Usage:
    """What one kernel needs on one architecture; memory in bytes, spills of stores and loads."""

    registers: int
    shared: int
    stack: int
    spills: int


def readUsage(log):
    """{kernel: Usage} from what the assembler says."""
    usage, kernel, stack, spills = {}, None, 0, 0
    for line in log.splitlines():
        if match := re.search(r"Compiling entry function '(\w+)'", line):
            kernel, stack, spills = match[1], 0, 0
        elif match := re.search(
            r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads", line
        ):  # of the kernel, and of each function that it calls
            stack += int(match[1])
            spills += int(match[2]) + int(match[3])
        elif match := re.search(r"Used (\d+) registers", line):
            shared = re.search(r"(\d+) bytes smem", line)
            usage[kernel] = Usage(int(match[1]), int(shared[1]) if shared else 0, stack, spills)
    return usage


@dataclass
class Report:
    """The outcome of many compilations: usage[program, kernel, precision][architecture] is a list
    with one Usage for every variant (shape of box, defines)."""

    usage: dict
    errors: list

    def kernels(self):
        """The names of all kernels that were compiled."""
        return {kernel for _, kernel, _ in self.usage}

    def spills(self):
        """One line for every kernel that keeps registers in local memory."""
        return [
            f"{' '.join(key)} on {architecture / 10}: {max(u.spills for u in variants)} bytes spilled"
            for key, columns in self.usage.items()
            for architecture, variants in columns.items()
            if any(u.spills > 0 for u in variants)
        ]

    def table(self):
        """What TITLE says, for each kernel and architecture."""
        width = max((len(" ".join(key)) for key in self.usage), default=0)
        heads = "".join(f"{f'{a / 10}':>20}" for a in ARCHITECTURES)
        lines = [f"{'program kernel precision':{width}} variants{heads}"]
        for key, columns in sorted(self.usage.items()):
            cells = [
                "/".join(
                    str(max((getattr(u, name) for u in columns.get(a, [])), default="-"))
                    for name in ("registers", "shared", "stack", "spills")
                )
                for a in ARCHITECTURES
            ]
            count = max(len(variants) for variants in columns.values())
            lines.append(f"{' '.join(key):{width}} {count:8}" + "".join(f"{c:>20}" for c in cells))
        return "\n".join(lines)


def everyJob(programs):
    """Each program for each architecture."""
    return [(program, architecture) for program in programs for architecture in ARCHITECTURES]


def coveringJobs(programs):
    """
    The first program of a name, precision and shape of box for every architecture; of the others
    those with a line of defines that no earlier one had, for one architecture each, in turn.
    Floating point numbers count as one, for they change no more than a constant.
    """
    seen, jobs, single = set(), [], 0
    for program in programs:
        kind = (program.name, program.precision, program.source)
        lines = {(kind, line) for line in FLOAT.sub("1.0", program.defines).splitlines()}
        if (kind, program.box) not in seen:
            jobs += everyJob([program])
        elif lines - seen:
            jobs.append((program, ARCHITECTURES[single % len(ARCHITECTURES)]))
            single += 1
        seen |= {(kind, program.box)} | lines
    return jobs


def compileJobs(jobs):
    """Compile pairs of a program and an architecture, on all cores."""
    report = Report({}, [])
    nvrtc()  # what is missing is told here, once
    # Processes: within one, NVRTC compiles one program after the other.
    with concurrent.futures.ProcessPoolExecutor(
        len(os.sched_getaffinity(0)), multiprocessing.get_context("spawn")
    ) as pool:
        outcomes = pool.map(compileText, *zip(*[(program.text(), a) for program, a in jobs]))
        for (program, architecture), (succeeded, log) in zip(jobs, outcomes):
            if not succeeded:
                report.errors.append(
                    f"{program.name} {program.precision} {program.box} on {architecture / 10} with\n"
                    f"{program.defines}\n{log}"
                )
            for kernel, usage in readUsage(log).items():
                columns = report.usage.setdefault((program.name, kernel, program.precision), {})
                columns.setdefault(architecture, []).append(usage)
    return report


def main(folder):
    """Print the table of a folder's programs; return 0 if all compile and none spills, else 1."""
    report = compileJobs(everyJob(readPrograms(folder)))
    print(f"{TITLE}\n{report.table()}")
    print("\n".join(report.errors + report.spills()))
    return 1 if report.errors or report.spills() or not report.usage else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
