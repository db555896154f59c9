"""Files of ``razy-check``: what is proved of the motions of a file of razy-follow."""

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.read.file import check_storage, making_sense_of, open_hdf5, program_of, text
from razy.read.follow import FollowResult


def digest(states: NDArray[np.float64]) -> str:
    """Return a checksum of states, by which a file of verdicts says which motions it is of."""
    return hashlib.sha256(np.ascontiguousarray(states, dtype="<f8").tobytes()).hexdigest()


def proved(path: str | Path, result: FollowResult) -> NDArray[np.bool_]:
    """Return whether each motion of `result` is proved by the file of verdicts, shape (motions,)."""
    with open_hdf5(path) as file, making_sense_of(path):
        if program_of(file) != "razy-check":
            raise ResultError(f"{path}: a file of {program_of(file)}, not of razy-check")
        check_storage(file["verdict"])
        verdict = np.asarray(file["verdict"][()])
        if text(file.attrs["states"]) != digest(result.states) or verdict.shape != (result.n_points,):
            raise ResultError(f"{path}: verdicts on other motions than those of {result.path}")
        return verdict == 0
