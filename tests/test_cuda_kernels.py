# SPDX-License-Identifier: MIT
"""The shipped device kernels compile for CUDA and keep all registers: proved without a GPU.

Of all programs that the tests needed on OpenCL, with the defines that a GPU gets for the same scene,
those are compiled that it takes to see every define, and one of each kind for every architecture
(nvrtc.py); those of devicescenes.py are run here in any case.
"""

import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

import devicescenes
import nvrtc
from platformnames import absence

ROOT = Path(__file__).resolve().parents[1]
KERNELS = ROOT / "platforms" / "common" / "kernels"
DIALECT = """
DEVICE real3 wrapped(real3 point, real4 periodicBoxSize, real4 invPeriodicBoxSize,
                     real4 periodicBoxVecX, real4 periodicBoxVecY, real4 periodicBoxVecZ) {
    APPLY_PERIODIC_TO_POS(point);
    APPLY_PERIODIC_TO_DELTA(point);
    APPLY_PERIODIC_TO_POS_WITH_CENTER(point, periodicBoxSize);
    return point;
}

KERNEL void dialect(GLOBAL real4* RESTRICT points, GLOBAL mm_ulong* RESTRICT sums,
                    GLOBAL mixed4* RESTRICT fine, int count, real4 size, real4 inverse, real4 x,
                    real4 y, real4 z) {
    LOCAL real shared[FACTOR*32];
    for (int i = GLOBAL_ID; i < count; i += GLOBAL_SIZE) {
        real3 p = wrapped(trimTo3(points[i]), size, inverse, x, y, z);
        real value = SQRT(p.x)+RSQRT(p.y)+RECIP(p.z)+EXP(p.x)+LOG(p.y)+POW(p.z, p.x)+COS(p.x)+
                     SIN(p.y)+TAN(p.z)+ACOS(p.x)+ASIN(p.y)+ATAN(p.z)+ERF(p.x)+ERFC(p.y)+FABS(p.z);
        shared[LOCAL_ID & 31] = FMA(value, p.x, p.y);
        SYNC_WARPS;
        ATOMIC_ADD(&sums[i], (mm_ulong) realToFixedPoint(shared[(LOCAL_ID+1) & 31]));
        points[i] = make_real4(p.x, p.y, p.z, 0)+make_real4(1);
        fine[i] = make_mixed4(p.x, p.y, p.z, 0);
        MEM_FENCE;
        SYNC_THREADS;
    }
}
"""
SPILLING = """
extern "C" __global__ void __launch_bounds__(1024) spilling(double* out, const double* in, int n) {
    double x[64];
#pragma unroll
    for (int i = 0; i < 64; i++)
        x[i] = in[i*n+threadIdx.x];
    for (int k = 0; k < n; k++) {
#pragma unroll
        for (int i = 0; i < 64; i++)
            x[i] = x[i]*x[(7*i+1)%64]+k;
    }
#pragma unroll
    for (int i = 0; i < 64; i++)
        out[i*n+threadIdx.x] = x[i];
}
"""


def compiled(jobs):
    """The Report on some jobs; skips if this machine cannot compile for CUDA."""
    try:
        return nvrtc.compileJobs(jobs)
    except nvrtc.MissingError as missing:
        pytest.skip(str(missing))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Every program that was compiled on OpenCL so far."""
    if absence("OpenCL"):
        pytest.skip(f"nothing to record programs with: {absence('OpenCL')}")
    folder = os.environ.get("OPENMMPSE_KERNEL_DUMP")
    if not folder:
        folder = str(tmp_path_factory.mktemp("kernels"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("OPENMMPSE_KERNEL_DUMP", folder)
        for precision in nvrtc.PRECISIONS:
            for scene in devicescenes.allFor(precision):
                devicescenes.runOnOpenCL(precision, *scene)
    return nvrtc.readPrograms(folder)


def programOf(source, precision="double", box="rectangular", defines="#define FACTOR 2"):
    return nvrtc.Program("own", precision, box, defines, source)


def testDialectCompilesInEveryPrecision():
    programs = [
        programOf(DIALECT, precision, box)
        for precision in nvrtc.PRECISIONS
        for box in ("rectangular", "triclinic")
    ]
    report = compiled(nvrtc.everyJob(programs))
    assert report.errors == []
    sizes = {precision: 4 if precision != "double" else 8 for precision in nvrtc.PRECISIONS}
    assert {key[2]: set(columns) for key, columns in report.usage.items()} == {
        precision: set(nvrtc.ARCHITECTURES) for precision in sizes
    }
    for (_, _, precision), columns in report.usage.items():
        for variants in columns.values():
            assert [u.shared for u in variants] == 2 * [64 * sizes[precision]]


def testOwnDefinesReplaceThoseOfOpenMM():
    text = programOf("", defines="#define RECIP(x) (1/(x))").text()
    assert re.findall(r"^#define RECIP\b.*", text, re.MULTILINE) == ["#define RECIP(x) (1/(x))"]


def testEveryProgramAndEveryDefineIsCovered():
    sizes = [programOf("", defines=f"#define A {a}\n#define B {b}") for a in "123" for b in "45"]
    sizes.append(programOf("", defines="#define A 1\n#define B 4\n#define C 2.5f"))
    sizes.append(programOf("", defines="#define A 1\n#define B 4\n#define C -3.5e-1f"))
    jobs = nvrtc.coveringJobs(sizes)
    count = {program.defines: 0 for program in sizes}
    for program, _ in jobs:
        count[program.defines] += 1
    assert list(count.values()) == [4, 1, 1, 0, 1, 0, 1, 0]
    assert len(set(jobs)) == len(jobs)
    others = [replace(program, precision="mixed") for program in sizes]
    assert nvrtc.coveringJobs(others + sizes)[len(jobs) :] == jobs


def testErrorsAndSpillsAreNoticed():
    good = programOf(DIALECT)
    bad = replace(good, source="KERNEL void bad(GLOBAL float3* p) { p[0].xy; }")
    report = compiled(nvrtc.everyJob([good, bad]))
    assert len(report.errors) == len(nvrtc.ARCHITECTURES)
    assert "FACTOR 2" in report.errors[0] and "xy" in report.errors[0]
    assert report.kernels() == {"dialect"} and report.spills() == []
    report = compiled(nvrtc.everyJob([replace(good, source=SPILLING)]))
    assert report.errors == []
    assert len(report.spills()) == len(nvrtc.ARCHITECTURES)


def testShippedKernelsCompileForCudaAndDoNotSpill(recorded, record_property):
    report = compiled(nvrtc.coveringJobs(recorded))
    record_property(nvrtc.TITLE, report.table())
    assert report.errors == []
    assert report.spills() == []
    sources = "\n".join(path.read_text(encoding="ascii") for path in KERNELS.glob("*.cc"))
    written = set(re.findall(r"\bKERNEL\s+void\s+(\w+)", sources))
    assert written and report.kernels() == written
    for precision in nvrtc.PRECISIONS:
        assert {kernel for _, kernel, p in report.usage if p == precision} == written
