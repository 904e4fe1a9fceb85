# SPDX-License-Identifier: MIT
"""Measure the targets of speed and memory of the CPU platform, each as a ratio inside one run, and judge them.

Everything: tolerance 1e-3, kT > 0, volume fraction 0.1, two threads, unless the row says otherwise; dt D0/a^2 = 1e-3,
as real runs have: OpenMM's own neighbour list does not last long then. Contenders take turns in rounds; a row is the median of the ratios
of the rounds, with the smallest and largest beside it. "Others" is the share of the machine's processors that other
processes took meanwhile. Above 10 % a verdict carries a question mark: times on the wall say little, and "by CPU", the
same from the processor time of all threads, says more (it knows nothing of threads that wait for each other).

The hydrodynamic part of a step is timed as a step whose only Force pulls on one particle: the fluid does all its work,
and the Force costs nothing. Particle indices are shuffled, as in a suspension that has been stirred; the row "step, in
order" has neighbours in space next to each other in memory, as a program that has just built a lattice.
"""
import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

import openmm
from spheres import DRAG, MASS, RADIUS, STEP, TEMPERATURE, VISCOSITY, context, lattice, makeSystem

from openmmpse import PSEBrownianIntegrator

SMALL, LARGE = 16000, 1000000
BUSY = 0.1  # share of the processors that others take from which on times on the wall are doubtful
PROGRAM = Path(__file__).resolve().parents[1]/"build"/"venv"/"bench_stages"


# ---------------------------------------------------------------- scenes

def pse(tolerance, model=PSEBrownianIntegrator.RotnePragerYamakawa):
    integrator = PSEBrownianIntegrator(TEMPERATURE, VISCOSITY, RADIUS, STEP)
    integrator.setErrorTolerance(tolerance)
    integrator.setMobilityModel(model)
    integrator.setFluidBoundary(PSEBrownianIntegrator.Periodic)
    integrator.setRandomNumberSeed(1)
    return integrator


class Contender:
    """A Context whose steps are timed. `count` particles, `steps` per visit; `model` of the fluid, if there is one."""

    def __init__(self, count=SMALL, phi=0.1, tolerance=1e-3, threads=2, repulsion=False, fluid=True, shuffled=True,
                 steps=None, model=PSEBrownianIntegrator.RotnePragerYamakawa, radii=(), grid=None):
        positions, length = lattice(count, phi, shuffled)
        system = makeSystem(count, length, repulsion)
        if repulsion:  # contacts as the dynamics leaves them
            before = openmm.BrownianIntegrator(TEMPERATURE, DRAG/MASS, STEP)
            settled = context(system, positions, before, 2)
            before.step(50)
            positions = settled.getState(positions=True).getPositions(asNumpy=True)
            del settled
        integrator = pse(tolerance, model) if fluid else openmm.BrownianIntegrator(TEMPERATURE, DRAG/MASS, STEP)
        for i in range(count if radii else 0):
            integrator.setParticleRadius(i, radii[i % len(radii)])
        if grid is not None:
            integrator.setGridDimensions(*grid)
        self.context = context(system, positions, integrator, threads)
        self.count = count
        self.steps = steps or 10
        self.integrator = integrator
        integrator.step(2)

    def visit(self, times):
        """Add the seconds per step of a few steps to the times."""
        wall, cpu = time.perf_counter(), time.process_time()
        self.integrator.step(self.steps)
        times.add((time.perf_counter() - wall)/self.steps, (time.process_time() - cpu)/self.steps)


class Times:
    """Seconds of each round, on the wall and of all processors."""

    def __init__(self):
        self.wall, self.cpu = [], []

    def add(self, wall, cpu):
        self.wall.append(wall)
        self.cpu.append(cpu)

    def __str__(self):
        return f"{1e3*statistics.median(self.wall):.1f} ms (CPU {1e3*statistics.median(self.cpu):.1f})"


def takeTurns(contenders, rounds):
    """The Times per step of each contender."""
    taken = [Times() for _ in contenders]
    for _ in range(rounds):
        for times, contender in zip(taken, contenders):
            contender.visit(times)
    return taken


# ---------------------------------------------------------------- rows

class Result:
    """A measured row: one value per round, and a note.

    name     key of TARGETS
    formula  from one time of each contender to the value; used for times on the wall, and for CPU times
    """

    def __init__(self, name, formula, contenders, note, cpu=True):
        self.name, self.note = name, note
        self.values = [formula(*times) for times in zip(*(each.wall for each in contenders))]
        self.byCpu = [formula(*times) for times in zip(*(each.cpu for each in contenders))] if cpu else None


def ratio(above, below):
    return above/below


def rowStep(options):
    results = []
    for shuffled, name in ((True, "step"), (False, "step, in order")):
        both = [Contender(repulsion=True, fluid=fluid, shuffled=shuffled) for fluid in (True, False)]
        fluid, plain = takeTurns(both, options.rounds)
        results.append(Result(name, ratio, (fluid, plain), f"{fluid} against {plain}"))
    return results


def rowDraining(options):
    freely = PSEBrownianIntegrator.FreeDraining
    results = []
    for repulsion, name in ((False, "draining"), (True, "draining, WCA")):
        both = [Contender(repulsion=repulsion, fluid=fluid, steps=100, model=freely) for fluid in (True, False)]
        draining, plain = takeTurns(both, options.rounds)
        results.append(Result(name, ratio, (draining, plain), f"{draining} against {plain}"))
    return results


def benchmarkTimes(options, pattern, *arguments):
    """Times of the benchmarks of bench_stages that match: {name without arguments: Times}, and errors."""
    scene = f"--scene={SMALL},100,3,2"
    command = [options.program, scene, f"--benchmark_filter={pattern}", "--benchmark_format=json", *arguments]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    times, errors = {}, {}
    for entry in report["benchmarks"]:
        name = entry["name"].split("/N:")[0]
        if entry.get("error_occurred"):
            errors[name] = entry["error_message"]
        elif entry["run_type"] == "iteration":
            times.setdefault(name, Times()).add(1e-3*entry["real_time"], 1e-3*entry["cpu_time"])
    return times, errors


def rowRadii(options):
    """Five radii of one volume against one radius on the grid that the five have chosen."""
    five = [0.6, 0.8, 1.0, 1.2, 1.4]
    unit = RADIUS*(sum(a**3 for a in five)/len(five))**(-1/3)
    mixed = Contender(radii=[unit*a for a in five])
    grid = mixed.integrator.getNumericalParameters()["gridDimensions"]
    results = takeTurns([mixed, Contender(grid=grid), Contender()], options.rounds)
    note = "{} against {} on the same grid, {} on its own".format(*results)
    return [Result("radii", ratio, results[:2], note)]


def rowFft(options):
    times, errors = benchmarkTimes(options, "^(six FFTs|fluid)/", f"--benchmark_repetitions={options.rounds}",
                                   "--benchmark_min_time=0.5", "--benchmark_enable_random_interleaving=true")
    fluid, ffts = times["fluid/Hasimoto"], min((times["six FFTs/pool"], times["six FFTs/FFTW threads"]),
                                               key=lambda each: statistics.median(each.wall))
    prolate = times.get("fluid/prolate") or f"refused ({errors['fluid/prolate'][:60]}...)"
    return [Result("fft", ratio, (fluid, ffts), f"{fluid} against {ffts}; prolate: {prolate}")]


def rowPtps(options):
    contender = Contender()
    times, = takeTurns([contender], 2*options.rounds)
    note = f"{times}; absolute: needs an idle machine"
    result = Result("ptps", lambda seconds: contender.count/seconds, (times,), note)
    result.byCpu = [2*value for value in result.byCpu]  # as if both threads had a processor each, all the time
    return [result]


def rowLarge(options):
    count = LARGE//10 if options.quick else LARGE
    large, small = takeTurns([Contender(count, steps=4), Contender(steps=20)], 1 if options.quick else 2)
    return [Result("large", lambda a, b: (count/a)/(SMALL/b), (large, small),
                   f"N = {count:,}: {large}, N = {SMALL:,}: {small}")]


def rowPhi(options):
    fractions = (0.01, 0.05, 0.1, 0.2, 0.4)
    taken = takeTurns([Contender(phi=phi) for phi in fractions], options.rounds)
    note = ", ".join(f"{phi:g}: {times}" for phi, times in zip(fractions, taken))
    return [Result("phi", lambda *seconds: min(seconds)/max(seconds), taken, note)]


def rowTolerance(options):
    tolerances = {"1e-3": 1e-3, "1e-5": 1e-5, "1e-6": 1e-6}
    contenders = [Contender(tolerance=tolerance) for tolerance in tolerances.values()]
    precisions = [contender.integrator.getNumericalParameters()["precision"] for contender in contenders]
    loose, *tight = takeTurns(contenders, options.rounds)
    return [Result(f"tolerance {name}", ratio, (times, loose), f"{times}, {precision}, against {loose}")
            for name, times, precision in zip(list(tolerances)[1:], tight, precisions[1:])]


def rowThreads(options):
    one, two = takeTurns([Contender(threads=1), Contender(threads=2)], options.rounds)
    return [Result("threads", ratio, (one, two), f"{one} on one, {two} on two", cpu=False)]


def peakAlone(options, name, count):
    """The peak memory (bytes) of a process that runs one benchmark of bench_stages, and nothing else."""
    command = [options.program, f"--scene={count},100,3,2", f"--benchmark_filter=^{name}/N",
               "--benchmark_min_time=0.001", "--benchmark_format=json"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    entry, = report["benchmarks"]
    return entry["peak bytes"]


def rowMemory(options):
    """A Context and a few steps with PSEBrownianIntegrator, less the same with BrownianIntegrator."""
    count = LARGE//10 if options.quick else LARGE
    fluid, plain = (peakAlone(options, f"step/{name}", count)
                    for name in ("PSEBrownianIntegrator", "BrownianIntegrator"))
    result = Result("memory", None, (), f"N = {count:,}: {fluid/1e6:,.0f} MB against {plain/1e6:,.0f} MB", cpu=False)
    result.values = [(fluid - plain)/count]
    return [result]


def rowCreation(options):
    positions, length = lattice(SMALL, 0.1)
    system = makeSystem(SMALL, length, True)
    fluid, plain = Times(), Times()
    for _ in range(options.rounds):
        for times in (fluid, plain):
            integrator = pse(1e-3) if times is fluid else openmm.BrownianIntegrator(TEMPERATURE, DRAG/MASS, STEP)
            wall, cpu = time.perf_counter(), time.process_time()
            made = context(system, positions, integrator, 2)
            times.add(time.perf_counter() - wall, time.process_time() - cpu)
            del made, integrator
    return [Result("creation", lambda seconds: seconds, (fluid,), f"{fluid}, of which OpenMM's own {plain}")]


ROWS = {"step": rowStep, "draining": rowDraining, "radii": rowRadii, "fft": rowFft, "ptps": rowPtps, "large": rowLarge, "phi": rowPhi,
        "tolerance": rowTolerance, "threads": rowThreads, "memory": rowMemory, "creation": rowCreation}
NEED_PROGRAM = {"fft", "memory"}
# name: what, must, aim, whether less is better
TARGETS = {
    "step": ("step of 16,000 WCA spheres / BrownianIntegrator's", 8, 4, True),
    "step, in order": ("the same, indices in the order of space", 8, 4, True),
    "draining": ("step with FreeDraining / BrownianIntegrator's", 1.15, 1, True),
    "draining, WCA": ("the same with a repulsion between the spheres", 1.15, 1, True),
    "radii": ("five radii / equal radii on the same grid", 1.5, 1.2, True),
    "fft": ("hydrodynamic part (Hasimoto) / its six 3-D FFTs", 6, 4, True),
    "ptps": ("hydrodynamic part, particle-steps per second", 1e6, 2e6, False),
    "large": ("PTPS at N = 1,000,000 / at 16,000", 0.6, 0.8, False),
    "phi": ("PTPS over phi = .01 .. .4, worst / best", 0.4, 0.6, False),
    "tolerance 1e-5": ("time at tolerance 1e-5 / 1e-3", 2.5, 2, True),
    "tolerance 1e-6": ("time at tolerance 1e-6 / 1e-3", 8, 5, True),
    "threads": ("speed on two threads / on one", 1.6, 1.85, False),
    "memory": ("peak bytes per particle beyond OpenMM's, N = 1,000,000", 1000, 600, True),
    "creation": ("creation of a Context, s", 2, 0.5, True),
}


# ---------------------------------------------------------------- verdicts

def verdict(value, must, aim, lessIsBetter):
    """"aim", "must" or "MISSED": which target a value meets."""
    meets = (lambda target: value <= target) if lessIsBetter else (lambda target: value >= target)
    return "aim" if meets(aim) else "must" if meets(must) else "MISSED"


def judged(result, others):
    """One row of the table, as it is written to the JSON file."""
    what, must, aim, lessIsBetter = TARGETS[result.name]
    measured = statistics.median(result.values)
    return {"row": result.name, "what": what, "must": must, "aim": aim, "measured": measured,
            "lowest": min(result.values), "highest": max(result.values), "rounds": len(result.values),
            "byCpu": statistics.median(result.byCpu) if result.byCpu else None,
            "verdict": verdict(measured, must, aim, lessIsBetter), "others": others, "doubtful": others > BUSY,
            "note": result.note}


def number(value):
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def line(row):
    spread = f"{number(row['lowest'])} .. {number(row['highest'])}"
    byCpu = "-" if row["byCpu"] is None else number(row["byCpu"])
    meets = row["verdict"] + ("?" if row["doubtful"] else "")
    return (f"{row['what']:<56}{number(row['must']):>10}{number(row['aim']):>10}{number(row['measured']):>10}  "
            f"{spread:<20}{meets:<7}{byCpu:>10}{row['others']:>8.0%}  {row['note']}")


HEADER = (f"{'what':<56}{'must':>10}{'aim':>10}{'measured':>10}  {'spread':<20}{'meets':<7}{'by CPU':>10}"
          f"{'others':>8}  note")


class Processors:
    """The share of the processors' time that other processes took since this was made."""

    def __init__(self):
        self.before = self.now()

    @staticmethod
    def now():
        """Seconds since the start: of all processors, of those neither idle nor waiting, and of this process."""
        fields = [int(field) for field in Path("/proc/stat").read_text(encoding="ascii").split("\n", 1)[0].split()[1:9]]
        ticks = os.sysconf("SC_CLK_TCK")
        own = sum(usage.ru_utime + usage.ru_stime
                  for usage in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))
        return sum(fields)/ticks, (sum(fields) - fields[3] - fields[4])/ticks, own

    def others(self):
        total, busy, own = (b - a for a, b in zip(self.before, self.now()))
        return max(0.0, busy - own)/total if total > 0 else 0.0


def measured(name, options):
    """The judged rows of one of ROWS."""
    processors = Processors()
    results = ROWS[name](options)
    others = processors.others()
    return [judged(result, others) for result in results]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=list(ROWS), metavar="ROW",
                        help=f"of {', '.join(ROWS)}")
    parser.add_argument("--quick", action="store_true", help="fewer rounds; 100,000 particles for 1,000,000")
    parser.add_argument("--program", type=Path, default=PROGRAM, help="bench_stages (default: %(default)s)")
    parser.add_argument("--output", type=Path, help="write the table here, too, as JSON")
    options = parser.parse_args()
    options.rounds = 3 if options.quick else 9
    if not options.program.exists() and NEED_PROGRAM & set(options.rows):
        parser.error(f"{options.program} is missing; build it with ./run bench, or choose other --rows")
    rows = []
    print(HEADER)
    for name in options.rows:
        for row in measured(name, options):
            rows.append(row)
            print(line(row), flush=True)
    if options.output:
        options.output.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    missed = [row["row"] + ("?" if row["doubtful"] else "") for row in rows if row["verdict"] == "MISSED"]
    print(f"Missed: {', '.join(missed)}" if missed else "All that must be is met.")
    return int(any(row["verdict"] == "MISSED" and not row["doubtful"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
