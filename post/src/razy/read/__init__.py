"""Result files as objects, opened lazily: ``with open_result("case.h5") as result: ...``.

What a file holds follows from its root attribute ``program``. A further kind of file is one more module here with a
class derived from `ResultFile`, entered in `READERS`.
"""

from pathlib import Path

from razy.errors import ResultError
from razy.read.duel import DuelResult, Series
from razy.read.extrema import Chunk, Extrema, ExtremaFile, SweepExtrema
from razy.read.file import Quantity, ResultFile, making_sense_of, open_hdf5, program_of
from razy.read.follow import FollowResult, Special
from razy.read.modes import ModesResult
from razy.read.run import Events, RunResult
from razy.read.sweep import DOWN, UP, SweepResult
from razy.read.tune import TuneResult

__all__ = [
    "DOWN",
    "READERS",
    "UP",
    "Chunk",
    "DuelResult",
    "Events",
    "Extrema",
    "ExtremaFile",
    "FollowResult",
    "ModesResult",
    "Quantity",
    "ResultError",
    "ResultFile",
    "RunResult",
    "Series",
    "Special",
    "SweepExtrema",
    "SweepResult",
    "TuneResult",
    "open_result",
]

READERS: dict[str, type[ResultFile]] = {
    "razy-sweep": SweepResult,
    "razy-run": RunResult,
    "razy-modes": ModesResult,
    "razy-tune": TuneResult,
    "razy-duel": DuelResult,
    "razy-follow": FollowResult,
}


def open_result(path: str | Path) -> ResultFile:
    """Open a result file; only its attributes are read.

    Parameters
    ----------
    path
        HDF5 file written by one of razy's programs.

    Returns
    -------
    ResultFile
        A `SweepResult`, `RunResult`, `ModesResult`, `TuneResult`, `DuelResult` or `FollowResult`; close it, or use it
        in a ``with`` statement.

    Raises
    ------
    ResultError
        The file does not exist, is not HDF5, was not written by razy, or by a program that has no reader.
    """
    file = open_hdf5(path)
    try:
        with making_sense_of(path):
            program = program_of(file)
            if program not in READERS:
                known = ", ".join(READERS)
                raise ResultError(f"{path}: cannot read files of program '{program}' (can: {known})")
            return READERS[program](file)
    except BaseException:
        file.close()
        raise
