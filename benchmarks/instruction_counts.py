# SPDX-License-Identifier: MIT
"""Count the instructions of fixed small steps with callgrind and compare them with those kept in the repository.

Times vary with the machine and its other users; instructions do not: from run to run, ours and FFTW's are the same to
the last one, the total to 3e-4 (waiting for a thread). They depend on the instruction set, which is fixed to AVX2, and
on the compiler and the libraries, which are recorded beside the counts: where these differ, growth is reported without
failing. Each case counts five steps on one thread.
"""
import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

COUNTS = Path(__file__).resolve().parent/"instruction_counts.json"
GROWTH = 1.05  # a count above this multiple of the one kept is a failure
NOTED = 0.01  # a relative change that is told: far above what differs from run to run
TARGET = "AVX2"
OWNERS = {"ours": "OpenMMPSE", "FFTW": "fftw", "OpenMM": "libOpenMM"}  # part of a library's name; the first that fits
REST = "system"
JUDGED = ("total", "ours")  # ours too: others' share must not hide what grew


class BenchError(Exception):
    """What keeps the counts from being taken or compared, and what to do about it."""


def ownerOf(library):
    """Whose code a library holds."""
    name = Path(library).name
    return next((owner for owner, part in OWNERS.items() if part in name), REST)


def instructionsByOwner(profile):
    """Sum the self cost of a callgrind profile over the libraries of each owner; "total" is that of the file.

    profile  lines in callgrind's format: "ob=(id) name" opens a library (the name only the first time), then a line
             per source line, "position cost"; the line after "calls=" holds what the callee cost, counted there
    """
    names, counts = {}, dict.fromkeys(["total", *OWNERS, REST], 0)
    owner, skip = REST, False
    for line in profile:
        if match := re.match(r"c?ob=\((\d+)\)(?: (.*))?", line):
            names.setdefault(match[1], match[2])
            if not line.startswith("c"):
                owner = ownerOf(names[match[1]])
        elif line.startswith("calls="):
            skip = True
        elif match := re.match(r"[+\-*\d]\S* (\d+)$", line):
            counts[owner] += 0 if skip else int(match[1])
            skip = False
    counts["total"] = sum(counts.values())
    return counts


def judged(changes, limit):
    """Verdict on the relative changes of one case's counts, and whether one of them exceeds the limit."""
    told = ", ".join(f"{part} {change:+.1%}" for part, change in changes.items() if abs(change) > NOTED)
    if any(change > limit - 1 for change in changes.values()):
        return f"GREW: {told}", True
    if any(change < 1/limit - 1 for change in changes.values()):
        return f"shrank: {told}; keep it with --update", False
    return told or "ok", False


def compare(kept, measured, limit=GROWTH):
    """Compare two contents of the file of counts.

    Returns rows (case, total kept or None, total measured or None, verdict), notes about environments that differ, and
    whether the total or our own count grew beyond the limit although nothing but the sources differs.
    """
    notes = [f"{name}: kept {kept['environment'].get(name)}, here {measured['environment'].get(name)}"
             for name in sorted({*kept["environment"], *measured["environment"]})
             if kept["environment"].get(name) != measured["environment"].get(name)]
    rows, grown = [], False
    for case in [*measured["cases"], *(case for case in kept["cases"] if case not in measured["cases"])]:
        old, new = kept["cases"].get(case), measured["cases"].get(case)
        if old is None:
            verdict = "new: keep it with --update"
        elif new is None:
            verdict = "gone: drop it with --update"
        else:
            verdict, grew = judged({part: new[part]/old[part] - 1 for part in JUDGED}, limit)
            if grew and notes:
                verdict += ", but not only the sources differ"
            grown = grown or (grew and not notes)
        rows.append((case, old and old["total"], new and new["total"], verdict))
    return rows, notes, grown


def table(rows, measured):
    """The comparison as text: millions of instructions, and whose they are."""
    def millions(count):
        return "-" if count is None else f"{count/1e6:.2f}"
    lines = [f"{'case':<32}{'kept':>10}{'now':>10}{'ratio':>8}{'ours':>7}{'FFTW':>7}  verdict  (millions)"]
    for case, old, new, verdict in rows:
        ratio = f"{new/old:.3f}" if old and new else "-"
        counts = measured["cases"].get(case)
        shares = [f"{counts[owner]/counts['total']:.0%}" if counts else "-" for owner in ("ours", "FFTW")]
        lines.append(f"{case:<32}{millions(old):>10}{millions(new):>10}{ratio:>8}{shares[0]:>7}{shares[1]:>7}  "
                     f"{verdict}")
    return "\n".join(lines)


def load(path):
    """The counts kept in the repository."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BenchError(f"{path} is missing; write it with: ./run bench --update") from None
    except ValueError as error:
        raise BenchError(f"{path} is damaged ({error}); write it again with: ./run bench --update") from None


def output(*command):
    """What a command prints; BenchError with its errors if it fails or does not exist."""
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except FileNotFoundError:
        raise BenchError(f"{command[0]} was not found; ./run bench installs and builds what is needed") from None
    except subprocess.CalledProcessError as error:
        raise BenchError(f"{' '.join(map(str, command))} failed:\n{error.stderr[-2000:]}") from None


def environmentOf(program):
    """What the counts depend on besides the sources, as seen inside valgrind."""
    environment = json.loads(output("valgrind", "--quiet", "--tool=none", program, "--environment"))
    environment["valgrind"] = output("valgrind", "--version").strip()
    return environment


def measure(program, progress):
    """Run every case of the program under callgrind."""
    measured = {"environment": environmentOf(program), "cases": {}}
    if measured["environment"]["target"] != TARGET:
        return measured
    for case in output(program, "--list").splitlines():
        progress(f"counting: {case}")
        with tempfile.TemporaryDirectory() as folder:
            profile = Path(folder)/"profile"
            output("valgrind", "--quiet", "--tool=callgrind", "--instr-atstart=no", f"--callgrind-out-file={profile}",
                   program, case)
            with profile.open(encoding="utf-8", errors="replace") as lines:
                measured["cases"][case] = instructionsByOwner(lines)
        if measured["cases"][case]["total"] == 0:
            raise BenchError(f"no instruction of '{case}' was counted; was {program} built without valgrind's headers?")
    return measured


def main(arguments=None, measure=measure):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=Path, required=True, help="counted_steps (CMake: PSE_BUILD_BENCHMARKS=ON)")
    parser.add_argument("--file", type=Path, default=COUNTS, help="the counts to compare with (default: %(default)s)")
    parser.add_argument("--update", action="store_true", help="keep the counts measured now")
    options = parser.parse_args(arguments)
    try:
        try:
            kept = load(options.file)
        except BenchError:
            if not options.update:
                raise
            kept = {"environment": {}, "cases": {}}
        measured = measure(options.program, print)
        target = measured["environment"]["target"]
        if target != TARGET:
            print(f"Skipped: counts are kept for {TARGET}; the best instruction set under valgrind here is {target}.")
            return 0
        rows, notes, grown = compare(kept, measured)
        print(table(rows, measured))
        if options.update:
            options.file.write_text(json.dumps(measured, indent=1) + "\n", encoding="utf-8")
            print(f"Written: {options.file}")
            return 0
        if notes:
            print("Counted elsewhere with:", *notes, sep="\n  ")
        if grown:
            print(f"FAILED: a count grew by more than {GROWTH - 1:.0%}. Find out why (callgrind_annotate shows "
                  "functions). If it is worth it, say so in the commit and keep the counts with: ./run bench --update")
        return 1 if grown else 0
    except BenchError as error:
        print(f"bench: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
