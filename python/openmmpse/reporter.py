# SPDX-License-Identifier: MIT
"""A reporter for openmm.app.Simulation: what the fluid costs, how well it is solved, and its stress."""

from __future__ import annotations

import csv
import os
from io import StringIO
from pathlib import Path
from typing import IO, Any

import openmm
from openmm import unit

from openmmpse import PSEBrownianIntegrator
from openmmpse.accuracy import stages
from openmmpse.conversion import STRESS_UNIT, integer

ALWAYS = ("step", "time_ps", "lanczos_iterations", "predicted_error")
SHARES = tuple(f"share: {part}" for part in stages.PARTS)
STRESS = ("osmotic_pressure_kJ_per_mol_nm3", "shear_stress_xy_kJ_per_mol_nm3")
STRAIN = ("strain",)


class HydrodynamicsReporter:
    """Write a line of numbers about the fluid at regular intervals, as comma-separated values.

        simulation.reporters.append(HydrodynamicsReporter("fluid.csv", 1000, progress=True, totalSteps=100000))
        simulation.step(100000)

    `python -m openmmpse plot fluid.csv` makes a picture of it. The columns, named in the first line:

    step                             steps of the Context so far
    time_ps                          time of the Context (in ps)
    lanczos_iterations               of the last thermal step; 0 without noise or hydrodynamics
    predicted_error                  of M f, relative to |f/(6 pi eta a)|; 0 without hydrodynamics
    share: positions ... share: free draining
                                     part of the time of all steps so far, without the Forces, from 0 to 1; together 1.
                                     A part whose effect is not active has 0. "positions": sorting, neighbours; "pairs"
                                     and "pair noise": the real-space half of M, or all pairs of an unbounded fluid;
                                     "grid": spreading, transforms, gathering; "waves": scaling and noise of the waves;
                                     "moving box": their factors made anew for it. Empty before anything was measured
    osmotic_pressure_kJ_per_mol_nm3  with stress=True: -trace/3 of computeStress(), of the particles alone
    shear_stress_xy_kJ_per_mol_nm3   with stress=True: xy entry of computeStress(); tension is positive, so that over the
                                     shear rate it is the viscosity that the particles add, in Da/(nm ps)
    strain                           with strain=True: of all sheared steps so far (dimensionless)

    1 kJ/(mol nm^3) is 1.66054 MPa. Each line is written at once and flushed: what interrupts a run leaves whole lines,
    and the Simulation can go on.
    """

    def __init__(
        self,
        file: str | os.PathLike[str] | IO[str],
        reportInterval: int,
        stress: bool = False,
        strain: bool = False,
        groups: int | set[int] = -1,
        append: bool = False,
        progress: bool = False,
        totalSteps: int | None = None,
    ) -> None:
        """Create a reporter for one Simulation at a time.

        Parameters
        ----------
        file : str, os.PathLike or open text file
            where to write; a file that is given open stays open
        reportInterval : int
            steps between two lines, > 0
        stress : bool
            whether to add the osmotic pressure and the shear stress: 24 energies for each line
        strain : bool
            whether to add the strain
        groups : int or set of int
            force groups that count in the stress, as bits or as a set; default all that the integrator uses
        append : bool
            whether to continue a file. Lines from the step of the first new one on, which a run that was cut off left
            beyond its last checkpoint, are replaced. To an open file no header is written
        progress : bool
            whether to show a progress bar; it moves with each line
        totalSteps : int
            step at which the bar is full, as in openmm.app.StateDataReporter; default: the bar has no end

        Raises
        ------
        TypeError
            if reportInterval, totalSteps or groups are of the wrong kind
        ValueError
            if reportInterval is not positive, or a file to be continued has other columns
        """
        self._interval = integer(reportInterval, "reportInterval")
        if self._interval <= 0:
            raise ValueError(f"reportInterval: expected a positive number of steps, got {reportInterval!r}")
        self._total = None if totalSteps is None else integer(totalSteps, "totalSteps")
        self._stress, self._strain, self._groups = bool(stress), bool(strain), groups
        self._progress: Any = bool(progress)
        self._bar: Any = None
        self._checked: Any = None
        self._old: list[tuple[int, int]] = []  # step and place of each line of a file that is continued
        self._owned = isinstance(file, (str, os.PathLike))
        self._out: Any = self._open(Path(os.fspath(file)), append) if self._owned else file  # type: ignore[arg-type]
        if not self._owned and not append:
            self._write(self.columns)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, with their units."""
        return ALWAYS + SHARES + (STRESS if self._stress else ()) + (STRAIN if self._strain else ())

    def describeNextReport(self, simulation: openmm.app.Simulation) -> dict[str, Any]:
        """Tell a Simulation in how many steps a line is due. It needs nothing of the State but the time.

        Raises TypeError, naming it, for an integrator that has no fluid.
        """
        if self._checked is not simulation:  # before the first step, not after a thousand
            self._integratorOf(simulation)
            if self._stress:
                self._stressOf(simulation)
            self._checked = simulation
        self._showProgress(simulation.currentStep)
        return {"steps": self._interval - simulation.currentStep % self._interval, "periodic": None, "include": []}

    def report(self, simulation: openmm.app.Simulation, state: openmm.State) -> None:
        """Write one line about the present state of a Simulation."""
        integrator = self._integratorOf(simulation)
        used = integrator.getNumericalParameters()
        shares = stages.partsOf(integrator.getStageTimes())
        row = [simulation.currentStep, state.getTime().value_in_unit(unit.picosecond), used["lanczosIterations"],
               used["predictedError"], *(shares.get(part, "") for part in stages.PARTS)]  # fmt: skip
        if self._stress:
            row += self._stressOf(simulation)
        if self._strain:
            row.append(integrator.getStrain())
        self._replaceFrom(simulation.currentStep)
        self._write(row)
        self._showProgress(simulation.currentStep, used["lanczosIterations"])

    def close(self) -> None:
        """Close the progress bar, and the file if it was given as a path. Nothing can be reported after it."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        if self._owned:
            self._out.close()

    def __enter__(self) -> HydrodynamicsReporter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_out", None) is not None:
            self.close()

    def _integratorOf(self, simulation):
        integrator = simulation.integrator
        if not PSEBrownianIntegrator.isinstance(integrator):
            raise TypeError(
                f"HydrodynamicsReporter reports about PSEBrownianIntegrator, but this Simulation has "
                f"{type(integrator).__name__}; take the reporter out of simulation.reporters"
            )
        return PSEBrownianIntegrator.cast(integrator)

    def _stressOf(self, simulation):
        """Osmotic pressure and shear stress, in kJ/(mol nm^3)."""
        integrator = self._integratorOf(simulation)
        stress = integrator.computeStress(integrator.TotalStress, self._groups).value_in_unit(STRESS_UNIT)
        return [-stress.trace().item() / 3, stress[0, 1].item()]

    def _open(self, path, append):
        """The file at a path, with its header; of one to be continued the places of its lines are kept."""
        if not (append and path.exists() and path.stat().st_size > 0):
            out = path.open("w", encoding="utf-8", newline="")
            out.write(_line(self.columns))
            out.flush()
            return out
        with path.open("rb") as old:
            header, place = old.readline(), old.tell()
            if header != _line(self.columns).encode():
                raise ValueError(
                    f"{path} cannot be continued: its columns are {header.decode(errors='replace').strip()}, not "
                    f"{_line(self.columns).strip()}; give the arguments it was begun with, or another file"
                )
            for line in old:
                step = line.partition(b",")[0]
                whole = line.endswith(b"\n") and step.isdigit()
                self._old.append((int(step) if whole else -1, place))
                place += len(line)
        return path.open("a", encoding="utf-8", newline="")

    def _replaceFrom(self, step):
        """Cut off the lines of a continued file from this step on, and from one that is not whole."""
        if not self._old:
            return
        late = [place for old, place in self._old if old >= step or old < 0]
        if late and late[0] == self._old[0][1] and self._old[0][0] >= 0:
            raise ValueError(
                f"{self._out.name} begins at step {self._old[0][0]}, and the next line is of step {step}: it belongs to "
                "another run; give another file, or set simulation.currentStep to where that run ended"
            )
        if late:
            os.truncate(self._out.name, late[0])
        self._old = []

    def _write(self, row):
        self._out.write(_line(row))
        if hasattr(self._out, "flush"):
            self._out.flush()

    def _showProgress(self, step, iterations=None):
        if not self._progress:
            return
        if self._bar is None:
            from tqdm import tqdm

            self._bar = tqdm(total=self._total, initial=step, unit=" steps", unit_scale=True, mininterval=0)
        if iterations is not None:
            self._bar.set_postfix_str(f"{iterations} Lanczos iterations", refresh=False)
        self._bar.update(step - self._bar.n)
        if self._total is not None and step >= self._total:
            self._bar.close()
            self._bar, self._progress = None, False


def _line(row):
    """A line of comma-separated values; numbers with all their digits."""
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerow(row)
    return text.getvalue()
