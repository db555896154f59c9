"""Several result files in one picture: curves over one another, side by side, or with their difference.

Of two curves over one another the first is grey and the second black, as of a machine before and after a change.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.signals import force_loop, signals
from razy.plot.units import LABEL_WIDTH, axis_label, in_words, scale_for
from razy.read import Quantity, ResultFile, RunResult, SweepResult
from razy.read.file import quantity_of

ARRANGEMENTS = ("overlay", "panels", "difference")
MOST_SIGNALS = 4
COLOURS = (style.BLACK, *style.EVENT_COLOURS)


@dataclass(frozen=True)
class Curve:
    """A curve in the units of its file; `name` says what it is of, `label` of which file."""

    name: str
    label: str
    x: Quantity
    y: Quantity
    at: NDArray[np.float64]
    value: NDArray[np.float64]


@dataclass(frozen=True)
class Panel:
    """Curves in one pair of axes, with a title."""

    title: str
    curves: Sequence[Curve]


def draw(
    results: Sequence[ResultFile],
    figure: Figure,
    options: PlotOptions,
    kind: str,
    labels: Sequence[str] = (),
    arrange: str = "overlay",
) -> None:
    """Draw files of one program.

    Parameters
    ----------
    results
        Open files, all of razy-run or all of razy-sweep.
    kind
        ``time``, ``phase`` or ``loop`` of motions; ``column`` or ``contacts`` of sweeps over one parameter.
    labels
        Words for the files, in the legend or above the panels; one for each, or none.
    arrange
        One of `ARRANGEMENTS`; ``difference`` takes two files and no phase paths.
    """
    path = results[0].path
    if len({type(result) for result in results}) > 1:
        raise ResultError(f"{path}: files of different programs do not fit one picture")
    if labels and len(labels) != len(results):
        raise ResultError(f"{path}: {len(labels)} labels for {len(results)} files")
    paths = kind in ("phase", "loop")
    if arrange == "difference" and (len(results) != 2 or paths):
        raise ResultError(f"{path}: a difference is of two files, over time or over a parameter")
    texts = labels or [result.title or result.path for result in results]
    table = [_curves(result, text, kind, options) for result, text in zip(results, texts, strict=True)]
    names = [[curve.name for curve in row] for row in table]
    if any(row != names[0] for row in names):
        raise ResultError(f"{path}: the files do not hold the same quantities")
    if arrange == "panels":
        panels = [Panel(curve.label, [curve]) for row in table for curve in row]
    else:
        panels = [Panel(curves[0].name if kind == "contacts" else "", curves) for curves in zip(*table, strict=True)]
    if arrange == "difference":
        panels += [Panel("", [_difference(*curves)]) for curves in zip(*table, strict=True)]
    grid = _axes(figure, options, len(panels), paths)
    for axes, panel in zip(grid, panels, strict=True):
        _draw_panel(figure, axes, panel, paths)
    if not paths and _across(len(panels), paths) == 1:
        for axes in grid[:-1]:
            axes.set_xlabel("")
    colours = _colours(len(results))
    overlaid = arrange != "panels" and len(results) > 1
    handles = [Line2D([], [], color=c, label=text) for c, text in zip(colours, texts, strict=True)] if overlaid else []
    title = options.title if options.title is not None else ("" if len(results) > 1 else results[0].title)
    style.set_footer(figure, results[0], options)
    style.set_heading(figure, (grid[0], grid[min(len(grid), _across(len(panels), paths)) - 1]), title, handles)


def draw_column(result: SweepResult, figure: Figure, options: PlotOptions) -> None:
    """Draw single numbers of the points, such as their processor time, or the largest extremum of an observable."""
    draw([result], figure, options, "column")


def _curves(result: ResultFile, label: str, kind: str, options: PlotOptions) -> list[Curve]:
    if isinstance(result, RunResult) and kind in ("time", "phase", "loop"):
        return _motion_curves(result, label, kind, options)
    if isinstance(result, SweepResult) and kind in ("column", "contacts"):
        return _sweep_curves(result, label, kind, options)
    raise ResultError(f"{result.path}: no {kind} picture of several files of {result.program}")


def _motion_curves(result: RunResult, label: str, kind: str, options: PlotOptions) -> list[Curve]:
    chosen = [force_loop(result, options)] if kind == "loop" else signals(result, options, MOST_SIGNALS)
    time, part = result.time, result.window(options.start, options.stop)
    if part.stop - part.start < 2:
        raise ResultError(f"{result.path}: fewer than two stored times {options.range_text()}")
    curves = []
    for signal in chosen:
        parts = signal.over_time(time, part) if kind == "time" else signal.path(time, part)
        at, value = (np.concatenate(each) for each in zip(*parts, strict=True))
        x, y = (result.time_quantity, signal.value) if kind == "time" else (signal.value, signal.rate)
        curves.append(Curve(in_words(signal.value.name), label, x, y, at, value))
    return curves


def _sweep_curves(result: SweepResult, label: str, kind: str, options: PlotOptions) -> list[Curve]:
    if len(result.parameters) > 1:
        raise ResultError(f"{result.path}: sweeps over two parameters; its picture is of the kind map")
    keep = result.within(options.start, options.stop)
    if not np.any(keep):
        raise ResultError(f"{result.path}: no point of {result.parameters[0]} {options.range_text()}")
    x, at = result.parameter(), result.grid()[keep]
    if kind == "column":
        found = [_column(result, name) for name in options.observables or ("steps",)]
        if options.swap:
            return [Curve(in_words(y.name), label, y, x, v[keep], at) for v, y in found]
        return [Curve(in_words(y.name), label, x, y, at, v[keep]) for v, y in found]
    quantity = (options.observables or ("largest_force",))[0]
    contacts = options.coordinates or result.contacts
    if not contacts:
        raise ResultError(f"{result.path}: has no statistics of contacts (&record what='statistics')")
    curves = []
    for contact in contacts:
        described = result.contact_quantity(contact, quantity)
        y = Quantity(quantity, described.units, described.long_name.split(": ", 1)[-1])
        value = result.where_followed(result.contact_value(contact, quantity))
        curves.append(Curve(in_words(contact), label, x, y, at, value[keep]))
    return curves


def _column(result: SweepResult, name: str) -> tuple[NDArray[np.float64], Quantity]:
    """Return a number of each point, or the largest extremum there, NaN where there is none or the motion failed."""
    if name not in result.observables and "." in name:
        contact, _, quantity = name.rpartition(".")
        values = result.where_followed(result.contact_value(contact, quantity))
        return values, replace(result.contact_quantity(contact, quantity), name=name)
    if name not in result.observables:
        return np.asarray(result.column(name), dtype=np.float64), quantity_of(result.file[f"point/{name}"], name)
    extrema = result.extrema(name)
    largest = np.full(result.n_points, np.nan)
    for chunk in extrema.chunks():
        np.fmax.at(largest, chunk.point, chunk.value)
    described = extrema.quantity
    return result.where_followed(largest), Quantity(name, described.units, f"largest {described.long_name}")


def _difference(first: Curve, second: Curve) -> Curve:
    at, one, two = np.intersect1d(first.at, second.at, return_indices=True)
    if at.size < 2:
        raise ResultError(f"'{first.label}' and '{second.label}' have no places in common to take a difference at")
    name = f"difference in {first.y.long_name or first.y.name}"
    return Curve(first.name, "", first.x, Quantity(name, first.y.units, name), at, second.value[two] - first.value[one])


def _across(count: int, paths: bool) -> int:
    if paths:
        return min(count, 3)
    return 1 if count <= 4 else 2


def _axes(figure: Figure, options: PlotOptions, count: int, paths: bool) -> list[Axes]:
    across = _across(count, paths)
    down = -(-count // across)
    width = 9.0 if paths and across == 1 else 16.0
    height = (8.0, 6.8, 5.2)[across - 1] * down if paths else max(8.0, 2.0 + 4.0 * down)
    style.set_size(figure, options, width, height + 0.6)
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.remove()
    return list(grid[:count])


def _colours(count: int) -> list[str]:
    if count == 2:
        return [style.GREY, style.BLACK]
    return [COLOURS[index % len(COLOURS)] for index in range(count)]


def _draw_panel(figure: Figure, axes: Axes, panel: Panel, paths: bool) -> None:
    first = panel.curves[0]
    space = figure.get_figwidth() / style.CM / (2.8 if paths else 1.2)
    x_scale, x_limits = _scale(first.x, [curve.at for curve in panel.curves], 0.05 if paths else 0.0)
    y_scale, y_limits = _scale(first.y, [curve.value for curve in panel.curves], 0.05)
    for curve, colour in zip(panel.curves, _colours(len(panel.curves)), strict=True):
        axes.plot(curve.at * x_scale.factor, curve.value * y_scale.factor, color=colour, label=curve.label)
    style.set_axis(axes.xaxis, *x_limits, space_cm=space)
    style.set_axis(axes.yaxis, *y_limits)
    axes.set_xlim(x_limits)
    axes.set_ylim(y_limits)
    width = 36 if paths else LABEL_WIDTH
    axes.set_xlabel(axis_label(first.x, x_scale, width if paths else None))
    axes.set_ylabel(axis_label(first.y, y_scale, width))
    if panel.title:
        axes.set_title(panel.title, fontsize=8.5, pad=3.0)


def _scale(quantity: Quantity, values: Sequence[NDArray[np.float64]], margin: float):
    finite = [value[np.isfinite(value)] for value in values]
    finite = [value for value in finite if value.size]
    if not finite:
        raise ResultError(f"'{quantity.name}' has no finite value in the range asked for")
    low, high = min(float(v.min()) for v in finite), max(float(v.max()) for v in finite)
    scale = scale_for(quantity.units, max(abs(low), abs(high)))
    return scale, style.limits(low * scale.factor, high * scale.factor, margin)
