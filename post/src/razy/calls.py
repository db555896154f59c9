"""Run razy's programs: ``run``, ``sweep``, ``modes``, ``tune``, ``duel``, ``follow``."""

import shutil
from collections.abc import Mapping
from typing import Any

import xarray

from razy.arguments import checked
from razy.errors import ResultError
from razy.programs.case import Case
from razy.programs.compute import compute
from razy.results import open_result

# More ranks than any cluster has: a slip that would fill this computer's memory.
MOST_RANKS = 1_000_000


def run(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> xarray.Dataset:
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
    return open_result(compute("razy-run", case, values, **options))


@checked
def sweep(
    case: Case, values: Mapping[str, Any] | None = None, *, ranks: int | None = None, **options: Any
) -> xarray.Dataset:
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
    return open_result(compute("razy-sweep", case, values, launcher, **options))


def modes(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> xarray.Dataset:
    """Compute natural frequencies and shapes by ``razy-modes``, of rotors over the speed; otherwise as `run`."""
    return open_result(compute("razy-modes", case, values, **options))


def tune(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> xarray.Dataset:
    """Find the value of a parameter that gives a natural frequency by ``razy-tune``; otherwise as `run`."""
    return open_result(compute("razy-tune", case, values, **options))


def duel(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> xarray.Dataset:
    """Compute one motion by several methods by ``razy-duel``; otherwise as `run`."""
    return open_result(compute("razy-duel", case, values, **options))


def follow(case: Case, values: Mapping[str, Any] | None = None, **options: Any) -> xarray.Dataset:
    """Follow periodic motions over a parameter by ``razy-follow``; otherwise as `run`."""
    return open_result(compute("razy-follow", case, values, **options))
