# SPDX-License-Identifier: MIT
"""The shipped device kernels compile for CUDA and keep all registers: proved without a GPU.

Of all programs that the tests needed on OpenCL, with the defines that a GPU gets for the same scene,
those are compiled that it takes to see every define, and one of each kind for every architecture
(nvrtc.py); a few scenes are run here in any case.
"""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import nvrtc
import scenes
from openmmpse import PSEBrownianIntegrator
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


def recordScenes():
    """Run small scenes on OpenCL that between them use every kernel."""
    suspensions = [
        scenes.randomSuspension(20, 0.1, scenes.cube(1), 0.5, 3),
        scenes.randomSuspension(20, 0.1, scenes.tilted(1), 0.5, 3),
    ]
    splits = (PSEBrownianIntegrator.Prolate, PSEBrownianIntegrator.Hasimoto)
    runs = [(scene, split, 1e-3) for scene, split in zip(suspensions, splits)]
    for precision in nvrtc.PRECISIONS:
        loosest = (suspensions[0], PSEBrownianIntegrator.AutomaticSplit, 1e-1)
        tightest = (*loosest[:2], 1e-6 if precision == "double" else 1e-4)
        for scene, split, tolerance in [*runs, loosest, tightest]:
            runOnOpenCL(scene, precision, tolerance, lambda it: it.setSplit(split))
        for scene, tolerance in unequalSpheres():
            runOnOpenCL(scene, precision, tolerance, lambda it: None)
            unbounded = PSEBrownianIntegrator.Unbounded
            runOnOpenCL(scene, precision, tolerance, lambda it: it.setFluidBoundary(unbounded))
        runOnOpenCL(suspensions[0], precision, 1e-3, lambda it: it.setFluidBoundary(unbounded))
        gaussian = PSEBrownianIntegrator.ForceCoupling
        runOnOpenCL(suspensions[0], precision, 1e-3, unboundedGaussian)
        runOnOpenCL(suspensions[0], precision, 1e-2, lambda it: it.setMobilityModel(gaussian))
        freely = PSEBrownianIntegrator.FreeDraining
        runOnOpenCL(suspensions[0], precision, 1e-3, lambda it: it.setMobilityModel(freely))


def unboundedGaussian(integrator):
    integrator.setFluidBoundary(PSEBrownianIntegrator.Unbounded)
    integrator.setMobilityModel(PSEBrownianIntegrator.ForceCoupling)


def unequalSpheres():
    """Classes and interpolated radii; one box needs images, one is tilted."""
    few, many = np.where(np.arange(20) % 5 == 0, 1.0, 0.4), np.linspace(0.4, 0.9, 20)
    small = scenes.mixture(few, 0.1, scenes.cube(1), 4)
    return [
        (small, 1e-3),
        (scenes.mixture(many, 0.1, scenes.tilted(1), 5), 1e-2),
        (scenes.Scene(small.positions[:5], scenes.cube(3.0), 0.4, few[:5]), 1e-3),
    ]


def runOnOpenCL(scene, precision, tolerance, configure):
    """Let the library do all it can at a scene."""
    context, integrator = scenes.makeContext(
        scene, f"OpenCL-{precision}", 300, tolerance=tolerance, configure=configure
    )
    integrator.step(2)
    integrator.sampleBrownianDisplacements(1)
    assert np.all(np.isfinite(integrator.applyMobility(scenes.randomForces(scene))))


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
        recordScenes()
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
