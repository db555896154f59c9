"""Pictures of result files.

Which picture fits a file follows from the program that wrote it: the first entry of `PICTURES` for that program is its
default, the others are chosen by kind. A further kind of picture is one more module here with a function
``draw(result, figure, options)``, entered in `PICTURES`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from matplotlib.figure import Figure

from razy.errors import ResultError
from razy.plot import (
    basins,
    bifurcation,
    bode,
    branches,
    campbell,
    contacts,
    curves,
    damping,
    eigenvalues,
    laws,
    machine,
    maps,
    motion,
    pattern,
    section,
    sensitivity,
    several,
    spectrum,
    tuning,
    work_precision,
)
from razy.plot.options import QUANTITIES, PlotNote, PlotOptions
from razy.plot.several import ARRANGEMENTS
from razy.plot.style import look
from razy.read import FollowResult, ResultFile, RunResult, SweepResult
from razy.read.file import making_sense_of

__all__ = [
    "ARRANGEMENTS",
    "KINDS",
    "PICTURES",
    "QUANTITIES",
    "Picture",
    "PlotNote",
    "PlotOptions",
    "draw",
    "draw_files",
    "draw_several",
]


@dataclass(frozen=True)
class Picture:
    """A kind of picture of one program's files and the function that draws it."""

    program: str
    kind: str
    draw: Callable[[Any, Figure, PlotOptions], None]


PROGRAMS = ("razy-run", "razy-sweep", "razy-modes", "razy-tune", "razy-follow", "razy-duel")
PICTURES = (
    Picture("razy-sweep", "bifurcation", bifurcation.draw),
    Picture("razy-sweep", "basins", basins.draw),
    Picture("razy-sweep", "contacts", contacts.draw),
    Picture("razy-sweep", "map", maps.draw),
    Picture("razy-sweep", "column", several.draw_column),
    Picture("razy-sweep", "poincare", bifurcation.draw_strobes),
    Picture("razy-run", "overview", motion.draw_overview),
    Picture("razy-run", "time", motion.draw_time),
    Picture("razy-run", "phase", motion.draw_phase),
    Picture("razy-run", "loop", motion.draw_loop),
    Picture("razy-run", "spectrum", spectrum.draw_spectrum),
    Picture("razy-run", "spectrogram", spectrum.draw_spectrogram),
    Picture("razy-run", "ordermap", spectrum.draw_order_map),
    Picture("razy-run", "waterfall", lambda result, *rest: spectrum.draw_waterfall([result], *rest)),
    Picture("razy-run", "orders", lambda result, *rest: spectrum.draw_orders([result], *rest)),
    Picture("razy-run", "poincare", section.draw_poincare),
    Picture("razy-run", "orbit", section.draw_orbit),
    Picture("razy-run", "pattern", pattern.draw),
    Picture("razy-modes", "campbell", campbell.draw),
    Picture("razy-modes", "eigenvalues", eigenvalues.draw),
    Picture("razy-modes", "damping", damping.draw),
    Picture("razy-modes", "bode", bode.draw_bode),
    Picture("razy-modes", "polar", bode.draw_polar),
    Picture("razy-tune", "tuning", tuning.draw),
    Picture("razy-follow", "branches", branches.draw),
    Picture("razy-follow", "curves", curves.draw),
    Picture("razy-follow", "sensitivity", sensitivity.draw),
    Picture("razy-duel", "work-precision", work_precision.draw),
    *(Picture(program, "machine", machine.draw) for program in PROGRAMS),
    *(Picture(program, "law", laws.draw) for program in PROGRAMS),
)
OVER_MOTIONS = {"waterfall": spectrum.draw_waterfall, "orders": spectrum.draw_orders}
WITH_TOP = ("campbell", "eigenvalues", "spectrum", "spectrogram", "ordermap", "waterfall")
KINDS = tuple(dict.fromkeys(picture.kind for picture in PICTURES))


def draw(result: ResultFile, figure: Figure, options: PlotOptions, kind: str | None = None) -> None:
    """Draw the picture of a result file into an empty figure.

    Parameters
    ----------
    result
        Open result file.
    figure
        Figure to draw into; its resolution is used for density images, its size is set.
    options
        What the user asks for.
    kind
        One of `KINDS`; the default of the file if left out.

    Raises
    ------
    ResultError
        The file has no such picture, or lacks what the picture needs.
    """
    with making_sense_of(result.path):
        fitting = {picture.kind: picture for picture in PICTURES if picture.program == result.program}
        if kind is None:
            kind = _default_kind(result, next(iter(fitting)))
        if kind not in fitting:
            raise ResultError(
                f"{result.path}: no {kind} picture of a file of {result.program} (has: {', '.join(fitting)})"
            )
        if kind != "branches" and options.proved is not None:
            raise ResultError(f"{result.path}: --check goes with branches of razy-follow alone")
        if kind not in ("branches", "curves") and (options.quantity is not None or options.sweep is not None):
            raise ResultError(f"{result.path}: --quantity goes with branches of razy-follow alone")
        if kind not in WITH_TOP and options.top is not None:
            raise ResultError(f"{result.path}: --top goes with pictures of the kinds {', '.join(WITH_TOP)} alone")
        if kind not in ("poincare", "orbit", "spectrum", "orders") and options.period is not None:
            raise ResultError(
                f"{result.path}: --period goes with pictures of the kinds poincare, orbit, spectrum, orders alone"
            )
        _check_swap(kind, options)
        try:
            with look():
                fitting[kind].draw(result, figure, options)
        except ResultError as error:
            if result.path in str(error):
                raise
            raise ResultError(f"{result.path}: {error}") from error.__cause__


def draw_files(
    results: Sequence[ResultFile],
    figure: Figure,
    options: PlotOptions,
    kind: str | None = None,
    labels: Sequence[str] = (),
    arrange: str = "overlay",
) -> None:
    """Draw a file as `draw` does, branches with a sweep below them, or several files as `draw_several` does."""
    files = sorted(results, key=lambda result: not isinstance(result, FollowResult))
    if len(files) == 2 and isinstance(files[0], FollowResult):
        if not isinstance(files[1], SweepResult):
            raise ResultError(f"{files[1].path}: a file of {files[1].program}; beside branches goes one of razy-sweep")
        draw(files[0], figure, replace(options, sweep=files[1]), kind)
    elif len(files) == 1:
        draw(files[0], figure, options, kind)
    else:
        draw_several(results, figure, options, kind, labels, arrange)


def draw_several(
    results: Sequence[ResultFile],
    figure: Figure,
    options: PlotOptions,
    kind: str | None = None,
    labels: Sequence[str] = (),
    arrange: str = "overlay",
) -> None:
    """Draw several files in one picture; see `razy.plot.several.draw`."""
    if options.quantity is not None:
        raise ResultError("--quantity goes with branches of razy-follow alone")
    with making_sense_of(", ".join(result.path for result in results)), look():
        if kind is None:
            kind = "contacts" if isinstance(results[0], SweepResult) and results[0].contacts else "time"
        if kind in OVER_MOTIONS and all(isinstance(result, RunResult) for result in results):
            OVER_MOTIONS[kind](results, figure, options)
            return
        _check_swap(kind, options)
        several.draw(results, figure, options, kind, labels, arrange)


def _check_swap(kind: str, options: PlotOptions) -> None:
    if options.swap and kind != "column":
        raise ResultError("--swap goes with pictures of the kind column alone")


def _default_kind(result: ResultFile, first: str) -> str:
    """Return the kind of picture that shows what a file holds."""
    if isinstance(result, SweepResult) and len(result.parameters) > 1:
        return "map"
    if isinstance(result, SweepResult) and result.contacts and not result.observables:
        return "contacts"
    if isinstance(result, SweepResult) and len(result.start_quantities) > 1 and result.n_starts > result.n_grid:
        return "basins"
    return first
