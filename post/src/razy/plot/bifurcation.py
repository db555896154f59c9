"""Bifurcation diagram: extrema of an observable over the swept parameter, maxima grey and minima black.

Of a sweep up and down, both ways in one picture, each in its own colour: where they differ is hysteresis.
Lyapunov exponents, if the file has them, stand below.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import density, periods, style
from razy.plot.options import PlotNote, PlotOptions
from razy.plot.units import LABEL_WIDTH, Scale, axis_label, scale_for
from razy.read import DOWN, UP, ExtremaFile, SweepExtrema, SweepResult
from razy.read.extrema import UNKNOWN

MOST_PANELS = 3
LYAPUNOV_HEIGHT = 0.45


@dataclass(frozen=True)
class Panel:
    """What one pair of axes shows: the extrema of the selected points of a sweep.

    Attributes
    ----------
    parameter
        Parameter at each point in the unit of the axis, shape (points,).
    selected
        The points in the range asked for, shape (points,).
    y_scale
        From the units of the file to those of the axis.
    layers
        Labels and colours of what is drawn, each with the key that `parts` gives.
    direction
        Direction of each point, shape (points,), where both ways are shown; else None.
    """

    extrema: SweepExtrema
    parameter: NDArray[np.float64]
    selected: NDArray[np.bool_]
    y_scale: Scale
    layers: dict[int, tuple[str, str]]
    direction: NDArray[np.int8] | None

    @property
    def count(self) -> int:
        """Number of extrema at the selected points."""
        return int(self.extrema.counts[self.selected].sum())

    def parts(self) -> Iterator[tuple[int, NDArray[np.float64], NDArray[np.float64]]]:
        """Read (layer, parameter, value) in parts, in the units of the axes."""
        for chunk in self.extrema.chunks(self.selected):
            finite = np.isfinite(chunk.value)
            layer_of = chunk.kind if self.direction is None else self.direction[chunk.point]
            for layer in self.layers:
                keep = finite & (layer_of == layer)
                yield layer, self.parameter[chunk.point[keep]], chunk.value[keep] * self.y_scale.factor


def draw_strobes(result: SweepResult, figure: Figure, options: PlotOptions) -> None:
    """Draw the values once in each period of the excitation over the parameter: Poincaré points."""
    if options.period is not None:
        raise ResultError(f"{result.path}: --period goes with one motion; of a sweep the points were recorded")
    draw(result, figure, options, strobes=True)


def draw(result: SweepResult, figure: Figure, options: PlotOptions, *, strobes: bool = False) -> None:
    """Draw the diagram of each observable asked for, one above the other: of its extrema, or of its strobes."""
    if options.coordinates:
        raise ResultError(f"{result.path}: a sweep holds extrema of observables, no coordinates")
    if len(result.parameters) > 1:
        raise ResultError(
            f"{result.path}: sweeps over {' and '.join(result.parameters)}; a bifurcation diagram needs one parameter"
        )
    observables = observables_of(result, options, strobes=strobes)
    grid = result.grid()
    selected = _selected(result, grid, options)
    quantity = result.parameter()
    shown = grid[selected]
    x_scale = scale_for(quantity.units, float(np.abs(shown).max()))
    x_limits = style.limits(shown.min() * x_scale.factor, shown.max() * x_scale.factor, 0.01)

    height = 9.5 if len(observables) == 1 else 5.0 * len(observables) + 1.5
    style.set_size(figure, options, 16.0, height)
    style.set_footer(figure, result, options)
    stripes = (
        0 if result.period is None else 1 if result.direction is None else np.unique(result.direction[selected]).size
    )
    exponents = result.lyapunov
    below = [LYAPUNOV_HEIGHT * len(observables)] if exponents is not None else []
    ratios = [1.0] * len(observables) + below + ([0.05 * stripes * len(observables)] if stripes else [])
    column = figure.subplots(len(ratios), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    column[-1].set_xlabel(axis_label(quantity, x_scale))
    if result.period is not None:
        _draw_periods(result, column[-1], grid * x_scale.factor, selected)
        column = column[:-1]
    if exponents is not None:
        draw_exponents(column[-1], grid[selected] * x_scale.factor, exponents[selected])
        style.set_axis(column[-1].xaxis, *x_limits, space_cm=figure.get_figwidth() / style.CM - 2.0)
        column = column[:-1]
    width = figure.get_figwidth() / style.CM - 2.0
    style.set_axis(column[-1].xaxis, *x_limits, space_cm=width)
    column[-1].set_xlim(x_limits)

    panels = []
    for axes, name in zip(column, observables, strict=True):
        points = result.strobe(name) if strobes else result.extrema(name)
        panel = _prepare(result, axes, points, grid * x_scale.factor, selected, options)
        if strobes and panel.direction is None:
            panel = replace(panel, layers={UNKNOWN: ("once in each period of the excitation", style.BLACK)})
        panels.append(panel)
    failed = mark_failed(result, column, grid * x_scale.factor, selected)
    drawn = {look: None for panel in panels for look in panel.layers.values()}
    handles = [style.point_handle(*look) for look in drawn] + failed
    style.set_heading(figure, (column[0], column[0]), style.title_of(result, options), handles)
    for axes, panel in zip(column, panels, strict=True):
        if panel.count > options.point_limit:
            _draw_density(figure, axes, panel)
        else:
            _draw_points(axes, panel)


def draw_exponents(axes: Axes, parameter: NDArray[np.float64], exponents: NDArray[np.float64]) -> None:
    """Draw the largest exponent of each motion black, the others grey; exponents of -inf are left out."""
    finite = np.isfinite(exponents)
    shown = exponents[finite] if np.any(finite) else np.zeros(1)
    y_limits = style.limits(min(float(shown.min()), 0.0), max(float(shown.max()), 0.0), 0.08)
    axes.axhline(0.0, color=style.GREY, linewidth=0.5)
    size = style.marker_size(exponents.size)
    for number in reversed(range(exponents.shape[1])):
        keep = finite[:, number]
        look = {"color": style.GREY if number else style.BLACK, "label": f"Lyapunov exponent {number + 1}"}
        axes.plot(parameter[keep], exponents[keep, number], "o", markersize=size, markeredgewidth=0.0, **look)
    axes.set_ylabel("exponent (1/s)")
    style.set_axis(axes.yaxis, *y_limits)
    axes.set_ylim(y_limits)


def _draw_periods(result: SweepResult, axes: Axes, parameter: NDArray[np.float64], selected: NDArray[np.bool_]) -> None:
    """Draw the period of the motions as a band of colours; of a sweep in both directions one for each way."""
    chosen = [("period", selected)]
    if result.direction is not None and np.unique(result.direction[selected]).size == 2:
        chosen = [
            (f"period {words}", selected & (result.direction == way)) for way, words in ((UP, "up"), (DOWN, "down"))
        ]
    periods.band(axes, [(words, parameter[keep], result.period[keep]) for words, keep in chosen])


def observables_of(result: ExtremaFile, options: PlotOptions, *, strobes: bool = False) -> tuple[str, ...]:
    """Return the observables asked for, else those of the file, as many as go into one picture."""
    names = options.observables or (result.strobes if strobes else result.observables)
    if not names:
        what = "strobe" if strobes else "extrema"
        raise ResultError(f"{result.path}: holds no {what}: &record what='{what}' asks for them")
    if not options.observables and len(names) > MOST_PANELS:
        warnings.warn(
            f"drawing {', '.join(names[:MOST_PANELS])}; choose others with --observable: "
            f"{', '.join(names[MOST_PANELS:])}",
            PlotNote,
            stacklevel=2,
        )
        names = names[:MOST_PANELS]
    return names


def _selected(result: SweepResult, grid: NDArray[np.float64], options: PlotOptions) -> NDArray[np.bool_]:
    selected = np.isfinite(grid)
    if options.start is not None:
        selected &= grid >= options.start
    if options.stop is not None:
        selected &= grid <= options.stop
    if not np.any(selected):
        has = f"the file has {grid.min():g} to {grid.max():g}" if grid.size else "the file has none"
        raise ResultError(f"{result.path}: no point of {result.parameters[0]} {options.range_text()} ({has})")
    return selected


def _prepare(
    result: SweepResult,
    axes: Axes,
    extrema: SweepExtrema,
    parameter: NDArray[np.float64],
    selected: NDArray[np.bool_],
    options: PlotOptions,
) -> Panel:
    """Read all extrema once and choose unit and limits of the vertical axis."""
    quantity = extrema.quantity
    low, high, kinds = np.inf, -np.inf, set()
    for chunk in extrema.chunks(selected):
        value = chunk.value[np.isfinite(chunk.value)]
        if value.size:
            low, high = min(low, float(value.min())), max(high, float(value.max()))
            kinds.update(np.unique(chunk.kind).tolist())
    if low > high:
        status = result.status[selected]
        failed = f"; {np.count_nonzero(status)} of {status.size} points failed" if np.any(status) else ""
        raise ResultError(f"{result.path}: no extrema of '{quantity.name}' {options.range_text()}{failed}")
    scale = scale_for(quantity.units, max(abs(low), abs(high)))
    y_limits = style.limits(low * scale.factor, high * scale.factor, 0.04)
    axes.set_ylabel(axis_label(quantity, scale, LABEL_WIDTH))
    style.set_axis(axes.yaxis, *y_limits)
    axes.set_ylim(y_limits)
    direction = result.direction
    if direction is not None and np.unique(direction[selected]).size == 2:
        return Panel(extrema, parameter, selected, scale, {way: style.DIRECTIONS[way] for way in (UP, DOWN)}, direction)
    layers = {kind: look for kind, look in style.EXTREMA.items() if kind in kinds}
    return Panel(extrema, parameter, selected, scale, layers, None)


def mark_failed(
    result: SweepResult, column: NDArray, parameter: NDArray[np.float64], selected: NDArray[np.bool_]
) -> list[Line2D]:
    """Mark failed points at the lower edge; return the legend's entries, one for each status."""
    status = np.where(selected, result.status, 0)
    handles = []
    for index, value in enumerate(np.unique(status[status != 0])):
        at = parameter[status == value]
        label = f"{result.status_meanings.get(int(value), f'failed, status {value}')} ({at.size})"
        look: dict[str, Any] = {
            "linestyle": "none",
            "marker": "x+1234"[index % 6],
            "markersize": 3.5,
            "markeredgewidth": 0.8,
        }
        for axes in column:
            low = np.full(at.shape, 0.02)
            axes.plot(at, low, transform=axes.get_xaxis_transform(), color=style.RED, label=label, zorder=5, **look)
        handles.append(Line2D([], [], color=style.RED, label=label, **look))
    return handles


def _draw_points(axes: Axes, panel: Panel) -> None:
    layers: dict[int, list[density.Part]] = {layer: [] for layer in panel.layers}
    for layer, x, y in panel.parts():
        layers[layer].append((x, y))
    for layer, parts in layers.items():
        x, y = (np.concatenate(values) for values in zip(*parts, strict=True))
        label, colour = panel.layers[layer]
        # Where both ways agree, the first shows around the second.
        size = style.marker_size(panel.count) * (1.8 if panel.direction is not None and layer == UP else 1.0)
        axes.plot(
            x,
            y,
            linestyle="none",
            marker="o",
            markersize=size,
            markeredgewidth=0.0,
            color=colour,
            label=label,
            rasterized=panel.count > style.RASTER_ABOVE,
        )


def _draw_density(figure: Figure, axes: Axes, panel: Panel) -> None:
    rows, columns = density.cells(figure, axes)
    at = panel.parameter[panel.selected]
    x_range, columns = _columns(np.unique(at), axes.get_xlim(), columns)
    motions = density.Density(x_range, (0.0, 1.0), (1, columns))
    motions.add(at, np.zeros(at.size))
    layers = {key: density.Density(x_range, axes.get_ylim(), (rows, columns)) for key in panel.layers}
    for key, x, y in panel.parts():
        layers[key].add(x, y)
    for key, layer in layers.items():
        density.show(axes, layer, layer.image(panel.layers[key][1], weight=motions.counts[0].astype(np.float64)))


def _columns(values: NDArray[np.float64], view: tuple[float, float], most: int) -> tuple[tuple[float, float], int]:
    """Return ends and number of the columns of a density image.

    Fewer evenly spaced parameter values than cells get one column each, so that no empty stripes are left between.
    """
    steps = np.diff(values)
    if 1 < values.size < most and np.ptp(steps) <= 1e-6 * steps.max():
        half = 0.5 * (values[-1] - values[0]) / (values.size - 1)
        return (float(values[0] - half), float(values[-1] + half)), values.size
    return view, most
