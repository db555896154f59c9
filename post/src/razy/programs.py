"""Run razy's programs: ``run``, ``sweep``, ``modes``, ``tune``, ``duel``, ``follow``."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from razy.case import Case, is_file, override, text_of
from razy.results import open_result
from razy_post.arguments import checked
from razy_post.errors import ResultError

if TYPE_CHECKING:
    import xarray

INTERRUPTED = 3
# More ranks than any cluster has: a slip that would fill this computer's memory.
MOST_RANKS = 1_000_000
PROGRESS = re.compile(r"\d+ of \d+ points, ")
# Results without a file of their own stand here until Python ends.
_scratch: list[tempfile.TemporaryDirectory] = []


def run(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> "xarray.Dataset":
    """Compute one motion by ``razy-run``.

    Parameters
    ----------
    case
        Path of a namelist file, the text of a namelist, or a dict of groups (see `razy.write_case`).
    values
        Changes of the case, such as ``{"rotation%speed_rpm": 1500, "load(2)%value": -50.0}``.
    **options
        ``output``: file for the result; without it the result is there until Python ends. ``force``: whether to
        overwrite that file. ``progress``: whether to pass on what the program says of its progress, default True.
        ``programs``: folder of razy's programs; otherwise the environment variable ``RAZY_BIN``, the search path
        ``PATH``, the folder of this Python, ``build/bin`` of a clone of razy, and ``bin`` of an installation, in this
        order.

    Returns
    -------
    xarray.Dataset
        The result with units and long names, see `razy.open`.

    Raises
    ------
    razy.Error
        What the program said, in one line, or that there is no such program.
    """
    return _compute("razy-run", case, values, **options)


@checked
def sweep(
    case: Case, values: Mapping[str, Any] | None = None, *, ranks: int | None = None, **options: Any
) -> "xarray.Dataset":
    """Compute a sweep by ``razy-sweep``, with ``ranks`` by ``mpirun -n ranks``; otherwise as `run`.

    A sweep with an ``output`` that was interrupted goes on when it is called again.
    """
    launcher: list[str] = []
    if ranks is not None and not 1 <= ranks <= MOST_RANKS:
        raise ResultError(f"ranks={ranks}: a whole number from 1 to {MOST_RANKS}")
    if ranks is not None:
        found = shutil.which("mpirun")
        if found is None:
            raise ResultError("ranks: there is no program mpirun on PATH")
        launcher = [found, "-n", str(ranks)]
    return _compute("razy-sweep", case, values, launcher, **options)


def modes(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> "xarray.Dataset":
    """Compute natural frequencies and shapes by ``razy-modes``, of rotors over the speed; otherwise as `run`."""
    return _compute("razy-modes", case, values, **options)


def tune(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> "xarray.Dataset":
    """Find the value of a parameter that gives a natural frequency by ``razy-tune``; otherwise as `run`."""
    return _compute("razy-tune", case, values, **options)


def duel(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> "xarray.Dataset":
    """Compute one motion by several methods by ``razy-duel``; otherwise as `run`."""
    return _compute("razy-duel", case, values, **options)


def follow(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> "xarray.Dataset":
    """Follow periodic motions over a parameter by ``razy-follow``; otherwise as `run`."""
    return _compute("razy-follow", case, values, **options)


def find_program(name: str, folder: str | Path | None = None) -> Path:
    """Return the path of a program of razy; see `run` for where it is looked for."""
    chosen = folder or os.environ.get("RAZY_BIN")
    if chosen:
        if not (Path(chosen) / name).is_file():
            raise ResultError(f"{chosen}: there is no program {name} in this folder")
        return Path(chosen) / name
    # The package lies in post/src of a clone, or in share/razy/python below the prefix of an installation.
    above = Path(__file__).resolve().parents
    beside = (Path(sys.executable).parent, above[3] / "build" / "bin", above[4] / "bin")
    found = shutil.which(name) or shutil.which(name, path=os.pathsep.join(map(str, beside)))
    if found is None:
        raise ResultError(f"there is no program {name} on PATH; name its folder by programs= or RAZY_BIN")
    return Path(found)


@checked
def _compute(
    program: str,
    case: Case,
    values: Mapping[str, Any] | None,
    launcher: list[str] | None = None,
    *,
    output: str | Path | None = None,
    force: bool = False,
    progress: bool = True,
    programs: str | Path | None = None,
) -> "xarray.Dataset":
    words = [*(launcher or []), str(find_program(program, programs))]
    folder = Path(tempfile.mkdtemp(dir=_folder()))
    given = Path(case) if is_file(case) else folder / "case.nml"
    if not is_file(case):
        given.write_text(text_of(case), encoding="utf-8")
    result = folder / f"{given.stem}.h5" if output is None else Path(output)
    words += [str(given), "--output", str(result), *(["--force"] if force else [])]
    words += [word for key, value in (values or {}).items() for word in ("--set", override(key, value))]
    code, said = _listen(words, progress)
    said = [line.replace(f"{folder}{os.sep}", "") for line in said]
    if code != 0:
        problem = said[-1].strip() if said else f"{program}: exit code {code}"
        raise ResultError(problem + (" (the same call goes on)" if code == INTERRUPTED and output is not None else ""))
    if progress and said:
        print("\n".join(said), file=sys.stderr)
    return open_result(result)


def _folder() -> str:
    """Return the folder of results that nobody gave a name; it goes when Python ends."""
    if not _scratch:
        _scratch.append(tempfile.TemporaryDirectory(prefix="razy-"))
    return _scratch[0].name


def _listen(words: list[str], progress: bool) -> tuple[int, list[str]]:
    """Run a command, pass on its progress; return its exit code and the other lines on its error channel."""
    said: list[str] = []
    with subprocess.Popen(
        words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace"
    ) as process:
        try:
            for line in process.stderr or ():
                if PROGRESS.match(line):
                    if progress:
                        print(line.rstrip(), file=sys.stderr, flush=True)
                elif line.strip() and not line.startswith("wrote "):
                    said.append(line.rstrip())
        except BaseException:
            process.terminate()
            raise
    # Below such a line mpirun says at length that the program has ended.
    ended = next((number for number, line in enumerate(said) if line.startswith("-----")), len(said))
    return process.returncode, said[:ended]
