"""A result file for other programs, by the suffix of what is written."""

from pathlib import Path

from razy.arguments import checked
from razy.errors import ResultError
from razy.read import ResultFile
from razy.target import replacing
from razy.tools.mat import write_mat
from razy.tools.shape import animate, write_shapes

SHAPES, ANIMATIONS = (".vtk", ".vtu", ".xdmf"), (".gif", ".html")
SUFFIXES = (".mat", *SHAPES, *ANIMATIONS)


@checked
def export(
    result: ResultFile, target: Path, mode: int = 1, start: float | None = None, stop: float | None = None
) -> str:
    """Write a result to `target`, replacing what is there; return in words how much.

    Parameters
    ----------
    result
        Open result file.
    target
        ``.mat``: all datasets; ``.vtk``, ``.vtu``, ``.xdmf``: shapes of rotors; ``.gif``, ``.html``: these animated.
    mode
        Mode that is animated, from 1.
    start, stop
        Range of times of a motion that is animated, s.
    """
    if target.suffix not in SUFFIXES:
        raise ResultError(f"{target}: unknown kind of file '{target.suffix}' (can: {', '.join(SUFFIXES)})")
    if not target.parent.is_dir():
        raise ResultError(f"{target}: no folder '{target.parent}'")
    if target.suffix == ".mat":
        return f"{write_mat(result, target)} datasets"
    with replacing(target) as partial:
        if target.suffix in SHAPES:
            return write_shapes(result, partial)
        return animate(result, partial, mode, start, stop)
