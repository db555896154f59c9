"""Basins of attraction: which attractor each start leads to, over two numbers of the start, at one point of a sweep."""

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.units import axis_label, scale_for
from razy.read import SweepResult

COLOURS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#bbbbbb", "#994455", "#6699cc", "#eecc66")
NOT_PERIODIC = "black"
FAILED = "white"


def draw(result: SweepResult, figure: Figure, options: PlotOptions) -> None:
    """Draw the starts at the first grid point in the range asked for, each in the colour of its attractor."""
    names = result.start_quantities
    if len(names) < 2:
        raise ResultError(
            f"{result.path}: a picture of basins needs &starts that vary two numbers, it has {len(names)}"
        )
    point = _first_point(result, options)
    starts = result.basin(point)
    x, y = (starts.value[name] for name in names[:2])
    scales = [
        scale_for(result.start_quantity(name).units, float(np.abs(starts.value[name]).max())) for name in names[:2]
    ]
    x, y = x * scales[0].factor, y * scales[1].factor

    style.set_size(figure, options, 14.0, 11.0)
    style.set_footer(figure, result, options)
    axes = figure.subplots()
    most = max(int(starts.attractor.max()), 1)
    colours = [FAILED, NOT_PERIODIC, *(COLOURS[k % len(COLOURS)] for k in range(most))]
    norm = BoundaryNorm(np.arange(-1.5, most + 1), len(colours))
    grid = _as_grid(x, y)
    if grid is None:
        axes.scatter(x, y, c=starts.attractor, cmap=ListedColormap(colours), norm=norm, s=9, linewidths=0)
    else:
        axes.pcolormesh(
            *grid[:2],
            starts.attractor[grid[2]],
            cmap=ListedColormap(colours),
            norm=norm,
            shading="nearest",
            rasterized=True,
        )
    for axis, name, scale in zip((axes.set_xlabel, axes.set_ylabel), names[:2], scales, strict=True):
        axis(axis_label(result.start_quantity(name), scale))
    found = [k for k in range(-1, most + 1) if np.any(starts.attractor == k)]
    handles = [Line2D([], [], marker="s", linestyle="", color=colours[k + 1], markeredgecolor="0.5") for k in found]
    axes.legend(
        handles, [_label(starts.attractor, starts.period, k) for k in found], loc="upper left", bbox_to_anchor=(1, 1)
    )
    title = options.title
    if title is None:
        at = ", ".join(
            f"{name} = {result.grid(name)[point]:g} {result.parameter(name).units}" for name in result.parameters
        )
        title = f"{result.title}: {at}" if result.title else at
    if title:
        axes.set_title(title)


def _first_point(result: SweepResult, options: PlotOptions) -> int:
    values = result.grid(result.outer_parameter)[: result.n_grid]
    inside = np.full(values.shape, True)
    if options.start is not None:
        inside &= values >= options.start
    if options.stop is not None:
        inside &= values <= options.stop
    if not np.any(inside):
        raise ResultError(f"{result.path}: no point {options.range_text()}")
    return int(np.flatnonzero(inside)[0])


def _as_grid(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Return the values of x and of y, and the start of each pair, if the starts are a grid."""
    columns, column = np.unique(x, return_inverse=True)
    rows, row = np.unique(y, return_inverse=True)
    if columns.size * rows.size != x.size or columns.size < 2 or rows.size < 2:
        return None
    start = np.full((rows.size, columns.size), -1)
    start[row, column] = np.arange(x.size)
    return (columns, rows, start) if np.all(start >= 0) else None


def _label(attractor: np.ndarray, period: dict[int, int], number: int) -> str:
    share = 100 * np.count_nonzero(attractor == number) / attractor.size
    if number == -1:
        return f"failed, {share:.3g} %"
    if number == 0:
        return f"not periodic, {share:.3g} %"
    return f"{number}: period {period[number]}, {share:.3g} %"
