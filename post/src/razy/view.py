"""The command ``razy-view``: a sweep's diagram in a browser, with the motion at each point that is clicked."""

import argparse
import re
import shutil
import signal
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from razy.programs import find_program, run
from razy_post import __version__, read
from razy_post.errors import Parser, ResultError, one_line
from razy_post.read import SweepResult
from razy_post.read.description import read_description, values_of
from razy_post.read.file import making_sense_of
from razy_post.target import check_output, write_text

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
        data = run(self._case(point), values, programs=self.programs, progress=False)
        label = ", ".join(f"{name} = {value:g}" for (name, _), value in zip(self.axes, self.grid[point], strict=True))
        return Motion(label, data.attrs["source"], data.attrs["input"])

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


def parser() -> Parser:
    """Return the parser of the command line."""
    result = Parser(
        prog=PROGRAM,
        description="Show a sweep in a browser: a click on its diagram computes the motion there and shows it, "
        "the last two beside each other.",
        epilog="Exit code: 0 done, 2 bad input or usage, 1 anything else.",
        allow_abbrev=False,
    )
    result.add_argument("file", metavar="FILE.h5", type=Path, help="file of razy-sweep")
    result.add_argument(
        "--at", metavar="X[,Y]", action="append", default=[], help="value of the parameter(s); repeat for several"
    )
    result.add_argument("--save", metavar="PAGE.html", type=Path, help="write a page to send to others, and stop")
    result.add_argument(
        "--input", metavar="CASE.nml", type=Path, help="write the input of the motion --at one point, and stop"
    )
    result.add_argument("--force", action="store_true", help="overwrite the page or the input if it exists")
    result.add_argument("--programs", metavar="FOLDER", type=Path, help="folder of razy's programs")
    result.add_argument("--port", metavar="N", type=int, default=0, help="port of the page; by default a free one")
    result.add_argument("--no-browser", action="store_true", help="only print the address")
    result.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    return result


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    given = parser().parse_args(arguments)
    # Whoever ends it, what it computed goes.
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _interrupt)
    try:
        _view(given)
    except ResultError as error:
        return _fail(str(error), 2)
    except KeyboardInterrupt:
        return 0
    except Exception as error:
        return _fail(f"{type(error).__name__}: {error}", 1)
    return 0


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _view(given: argparse.Namespace) -> None:
    sweep = Sweep(given.file, given.programs)
    points = [sweep.nearest(_values(text)) for text in given.at]
    target = given.input or given.save
    if target is not None:
        check_output(target, [given.file], given.force)
        if not target.parent.is_dir():
            raise ResultError(f"{target}: no folder '{target.parent}'")
    if given.input is not None:
        if len(points) != 1 or given.save is not None:
            raise ResultError("--input goes with one --at, and without --save")
        write_text(target, sweep.motion(points[0]).case)
        return
    try:
        from razy import page
    except ImportError as cause:
        raise ResultError(f"{PROGRAM} needs the package bokeh (pip install bokeh): {cause}") from cause
    if given.save is None:
        page.serve(sweep, points, given.port, not given.no_browser)
    else:
        write_text(target, page.static(sweep, points))


def _values(text: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ResultError(f"--at {text}: a number, or two with a comma between") from None


def _fail(message: str, code: int) -> int:
    print(f"{PROGRAM}: error: {one_line(message)}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
