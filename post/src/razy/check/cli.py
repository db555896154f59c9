"""The command ``razy-check``: an independent proof of motions of razy-follow and razy-run."""

import math
import sys
import time
from argparse import Namespace
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from razy.errors import Parser, ResultError, one_line
from razy.read import FollowResult, RunResult, open_result
from razy.read.check import digest
from razy.read.file import making_sense_of
from razy.target import check_output, replacing_hdf5
from razy.version import __version__

if TYPE_CHECKING:
    from razy.check.verdict import Verdict

PROGRAM = "razy-check"
CHUNK = 8
"""Motions that a process is given at a time."""
PATIENCE = 10.0
"""Seconds between lines of progress."""


def parser() -> Parser:
    """Return the parser of the command line."""
    result = Parser(
        prog=PROGRAM,
        description="Prove periodic motions of razy-follow, or enclose a motion of razy-run, from the input alone.",
        epilog="Exit code: 0 all proved, 1 some not, 2 bad input or usage.",
        allow_abbrev=False,
    )
    result.add_argument("file", metavar="FILE.h5", type=Path, help="file of razy-follow or razy-run")
    result.add_argument(
        "--output", metavar="FILE.h5", type=Path, help="write the verdicts (/verdict, /reason, /radius)"
    )
    result.add_argument("--force", action="store_true", help="overwrite that file if it exists")
    result.add_argument("--jobs", metavar="N", type=int, default=1, help="processes (%(default)s)")
    result.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    return result


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    given = parser().parse_args(arguments)
    try:
        return _check(given)
    except ResultError as error:
        print(f"{PROGRAM}: error: {one_line(str(error))}", file=sys.stderr)
        return error.exit_code


def _check(given: Namespace) -> int:
    if not 1 <= given.jobs <= 1024:
        raise ResultError(f"--jobs {given.jobs}: a whole number from 1 to 1024")
    with open_result(given.file) as result:
        run, name = isinstance(result, RunResult), result.program
        if not run and not isinstance(result, FollowResult):
            raise ResultError(f"{given.file}: a file of {name}; {PROGRAM} takes those of razy-follow and razy-run")
    if run:
        return _check_start(given)
    with making_sense_of(given.file), h5py.File(given.file) as data:
        count = data["point/state"].shape[0]
    if given.output is not None:
        check_output(given.output, [given.file], given.force)
    _need_flint()
    from razy.check.machine import NotCovered
    from razy.check.verdict import KINDS

    found: list[Verdict] = []
    said = time.monotonic()
    with making_sense_of(given.file):
        try:
            for part in _parts(given.file, count, given.jobs):
                found += part
                if time.monotonic() - said > PATIENCE:
                    said = time.monotonic()
                    print(f"{len(found)} of {count} motions", file=sys.stderr, flush=True)
        except NotCovered as reason:
            raise ResultError(f"{given.file}: {reason}: not covered") from reason
    for number, verdict in enumerate(found, 1):
        if verdict.kind != "proved":
            print(f"motion {number}: {verdict.kind}: {verdict.reason}")
    kinds = Counter(verdict.kind for verdict in found)
    radius = max((verdict.radius for verdict in found if verdict.kind == "proved"), default=0.0)
    stable = Counter(verdict.stable for verdict in found if verdict.kind == "proved")
    others = "".join(f", {kinds[kind]} {kind}" for kind in KINDS[1:] if kinds[kind])
    others = f", {stable[True]} stable, {stable[False]} unstable{others}"
    print(f"{kinds['proved']} of {count} motions proved, largest radius {radius:.1e}{others}")
    specials = dict(sorted((k, special) for verdict in found for k, special in verdict.specials.items()))
    for k, special in specials.items():
        if special.kind != "proved":
            print(f"special point {k + 1}: {special.kind}: {special.reason}")
    sound = sum(special.kind == "proved" for special in specials.values())
    print(f"{sound} of {len(specials)} special points proved")
    if given.output is not None:
        _write(given.output, given.file, found, specials, KINDS)
        print(f"wrote {given.output}", file=sys.stderr)
    return int(kinds["proved"] != count or sound != len(specials))


def _counted(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _need_flint() -> None:
    try:
        import flint  # noqa: F401
    except ImportError as cause:
        raise ResultError(f"{PROGRAM} needs the package python-flint (pip install python-flint): {cause}") from cause


def _check_start(given: Namespace) -> int:
    """Enclose the motion of a file of razy-run from its start, or prove the one that it has settled to."""
    if given.output is not None:
        raise ResultError("--output: the verdict on a motion from a start is one line, there is no file of it")
    with making_sense_of(given.file), h5py.File(given.file) as data:
        integrator = str(data.attrs["integrator"])
    _need_flint()
    from razy.check.machine import NotCovered
    from razy.check.start import enclose_file, settled

    said = time.monotonic()

    def progress(now: float, end: float, events: int) -> None:
        nonlocal said
        if time.monotonic() - said > PATIENCE:
            said = time.monotonic()
            print(f"{now:.6g} of {end:.6g} s, {events} events", file=sys.stderr, flush=True)

    with making_sense_of(given.file):
        try:
            if (end := settled(given.file)) is not None:
                periods, stable, away = end
                says = {True: "stable", False: "unstable", None: "undecided whether stable"}[stable]
                many = _counted(periods, "period")
                print(f"settled: the last state is within {away:.1e} of a proved motion of {many}, {says}")
            if integrator != "exact":
                if end is None:
                    reason = f"a motion by '{integrator}' that has not settled; enclosures are for those by 'exact'"
                    raise ResultError(f"{given.file}: {reason}")
                return 0
            found = enclose_file(given.file, progress)
        except NotCovered as reason:
            raise ResultError(f"{given.file}: {reason}: not covered") from reason
    until = f"{found.until:.10g} of {found.end:.10g} s, {_counted(found.events, 'event')}, {found.bits} bits"
    print(f"enclosed until {until}" + f": {found.reason}" * bool(found.reason))
    if found.states:
        print(f"{found.states} stored states are within {found.farthest:.1e} of it, over the largest")
    if found.parted < math.inf:
        print(f"refused: the file has another motion from {found.parted:.10g} s on")
    return int(found.parted < math.inf or bool(found.reason))


def _parts(file: Path, count: int, jobs: int) -> Iterator[list["Verdict"]]:
    """Return the verdicts on a few motions after the other, in their order."""
    from razy.check.verdict import verdicts

    chunks = [range(first, min(first + CHUNK, count)) for first in range(0, count, CHUNK)]
    if jobs == 1:
        yield from (verdicts(file, chunk) for chunk in chunks)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(verdicts, [file] * len(chunks), chunks)


def _write(
    target: Path, file: Path, found: list["Verdict"], specials: dict[int, "Verdict"], kinds: tuple[str, ...]
) -> None:
    """Write the verdicts beside the numbers of motions and special points; the file appears complete or not at all."""
    with replacing_hdf5(target) as data:
        data.attrs["program"], data.attrs["razy_version"], data.attrs["checked"] = PROGRAM, __version__, str(file)
        with open_result(file) as result:
            data.attrs["states"] = digest(result.states)
        _write_columns(data, found, kinds, "the state")
        stable = [-1 if one.stable is None else int(one.stable) for one in found]
        data.create_dataset("stable", data=np.array(stable, np.int32))
        data["stable"].attrs["flag_values"] = np.arange(-1, 2, dtype=np.int32)
        data["stable"].attrs["flag_meanings"] = "undecided unstable stable"
        special = data.create_group("special")
        special["special"] = np.array(list(specials), np.int32)
        special["special"].attrs["long_name"] = "row of /special, from 0"
        _write_columns(special, list(specials.values()), kinds, "the parameter")


def _write_columns(group: h5py.Group, found: list["Verdict"], kinds: tuple[str, ...], what: str) -> None:
    column = group.create_dataset("verdict", data=np.array([kinds.index(one.kind) for one in found], np.int32))
    column.attrs["flag_values"] = np.arange(len(kinds), dtype=np.int32)
    column.attrs["flag_meanings"] = " ".join(kind.replace(" ", "_") for kind in kinds)
    group.create_dataset("reason", data=[one.reason for one in found], dtype=h5py.string_dtype())
    radius = group.create_dataset("radius", data=np.array([one.radius for one in found], float))
    radius.attrs["long_name"] = f"radius of the ball that holds one of them, over the scales of {what}"
