"""The sweep that ``razy-view`` shows, and the motions at its points, computed anew."""

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from razy import read
from razy.errors import ResultError
from razy.programs import find_program
from razy.programs.compute import compute
from razy.read import SweepResult
from razy.read.description import read_description, values_of
from razy.read.file import making_sense_of

PROGRAM = "razy-view"
# Stored times of a motion.
TIMES = 4000
# Motions whose files are kept; one that went is computed again.
MOST_MOTIONS = 32
# Groups that say what several motions are, or what is kept of one.
NOT_OF_ONE_MOTION = ("sweep", "starts", "start_range", "follow", "record")


@dataclass(frozen=True)
class Motion:
    """The motion at a point of a sweep: its values in words, its result file, the case that repeats it."""

    label: str
    file: str
    case: str


class Sweep:
    """A sweep whose motions can be computed anew.

    Parameters
    ----------
    file
        File of razy-sweep.
    programs
        Folder of razy's programs; see `razy.run`.
    """

    def __init__(self, file: Path, programs: Path | None = None) -> None:
        result = read.open_result(file)
        if not isinstance(result, SweepResult):
            raise ResultError(f"{file}: a file of {result.program}; {PROGRAM} looks into files of razy-sweep")
        self.result, self.file, self.programs = result, file, programs
        self._motions: dict[int, Motion] = {}
        find_program("razy-run", programs)
        with making_sense_of(file):
            self.axes = [(name, result.axis(name)) for name in result.parameters]
            self.grid = np.stack([result.grid(name) for name in result.parameters], axis=1)
            self.groups = read_description(result)

    @property
    def note(self) -> str:
        """What a motion computed anew has not in common with that of the sweep; empty if nothing."""
        if self.result.direction is not None:
            return "Motions of this sweep began where the one before ended; one computed here begins as &motion says."
        return "" if self.result.n_starts == 1 else "A motion computed here begins as &motion says, not as &starts."

    def nearest(self, values: list[float]) -> int:
        """Return the number of the point nearest to values of the parameters, counted from 0."""
        if len(values) != len(self.axes):
            names = ",".join(name for name, _ in self.axes)
            raise ResultError(f"{self.file}: a point has {len(self.axes)} value(s), {names}, not {len(values)}")
        distance = np.zeros(len(self.grid))
        for value, (name, axis), column in zip(values, self.axes, self.grid.T, strict=True):
            if not axis.min() <= value <= axis.max():
                raise ResultError(f"{self.file}: {name} = {value:g} is outside: {axis.min():g} to {axis.max():g}")
            distance += ((column - value) / (np.ptp(axis) or 1.0)) ** 2
        return int(np.argmin(distance))

    def motion(self, point: int) -> Motion:
        """Return the motion at a point, computed by razy-run where it is not there from before."""
        found = self._motions.pop(point, None) or self._compute(point)
        self._motions[point] = found
        if len(self._motions) > MOST_MOTIONS:
            oldest = self._motions.pop(next(iter(self._motions)))
            shutil.rmtree(Path(oldest.file).parent, ignore_errors=True)
        return found

    def _compute(self, point: int) -> Motion:
        values = {}
        for value, group in zip(self.grid[point].tolist(), self.groups["sweep"], strict=True):
            parameters = values_of(group, "parameter")
            factors = values_of(group, "factor") or [1.0] * len(parameters)
            numbers = [value * factor for factor in factors]
            values |= {name: int(n) if n.is_integer() else n for name, n in zip(parameters, numbers, strict=True)}
        file = compute("razy-run", self._case(point), values, programs=self.programs, progress=False)
        label = ", ".join(f"{name} = {value:g}" for (name, _), value in zip(self.axes, self.grid[point], strict=True))
        with read.open_result(file) as motion, making_sense_of(file):
            return Motion(label, str(file), motion.input)

    def command(self, point: int, case: str = "motion.nml") -> str:
        """Return the commands that repeat a motion."""
        at = ",".join(f"{value:.15g}" for value in self.grid[point])
        return f"{PROGRAM} {self.file} --at {at} --input {case}\nrazy-run {case}"

    def _case(self, point: int) -> str:
        """Return the input of a motion, over the time that the sweep recorded: states, forces, what it recorded."""
        groups = re.findall(r"^&(\w+)\n.*?^/$\n?", self.result.input, flags=re.MULTILINE | re.DOTALL)
        texts = re.findall(r"^&\w+\n.*?^/$\n?", self.result.input, flags=re.MULTILINE | re.DOTALL)
        kept = "".join(text for name, text in zip(groups, texts, strict=True) if name not in NOT_OF_ONE_MOTION)
        records = self.groups.get("record", [])
        end = self.groups["motion"][0]["t_end"]
        length = end - min((record.get("from", 0.0) for record in records), default=0.0)
        if "duration" in self.result.columns:
            end = float(self.result.column("duration")[point])
            kept = re.sub(r"(?m)^(\s*t_end = ).*$", rf"\g<1>{end!r}", kept)
        wanted = {(record["observable"], record.get("of", "")) for record in records} - {("contact_force", "all")}
        wanted |= {("contact_force", name) for name in self.result.contacts}
        for observable, of in sorted(wanted):
            place = f"of='{of}', " if of else ""
            kept += (
                f"&record observable='{observable}', {place}what='trajectory', "
                f"from={end - length!r}, interval={length / TIMES!r} /\n"
            )
        return kept
