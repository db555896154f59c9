"""Pictures of one motion: time histories with contact events, phase paths, and both side by side."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import density, extrema_over_time, style
from razy.plot.events import Marks, event_marks
from razy.plot.options import PlotOptions
from razy.plot.signals import Pair, Signal, force_loop, loop, signals
from razy.plot.units import Scale, axis_label, scale_for
from razy.read import Quantity, RunResult

MOST_PANELS = 4
# Letters in a line beside a panel of this module.
LONGEST_LABEL = 32


@dataclass(frozen=True)
class Motion:
    """The part of a motion that is drawn.

    Attributes
    ----------
    time
        All stored times in s, shape (times,).
    part
        The stored times in the range asked for.
    time_scale
        From s to the unit of the axis.
    marks
        Events to mark.
    """

    time: NDArray[np.float64]
    part: slice
    time_scale: Scale
    marks: list[Marks]

    @property
    def count(self) -> int:
        """Number of stored times in the range."""
        return self.part.stop - self.part.start


def draw_time(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw time histories, one above the other; of a motion without a trajectory, its extrema over time."""
    if not result.has_trajectory and result.extrema_observables:
        extrema_over_time.draw(result, figure, options)
        return
    chosen = signals(result, options, MOST_PANELS)
    motion = _motion(result, options)
    style.set_size(figure, options, 16.0, 2.2 + 4.3 * len(chosen) + 0.3 * len(motion.marks))
    column = figure.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0]
    _time_column(figure, column, chosen, motion, options)
    _finish(figure, result, (column[0], column[0]), motion, options)


def draw_phase(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw phase paths side by side; those of forces, which jump, only if named."""
    chosen = signals(result, options, MOST_PANELS)
    if not options.observables:
        chosen = [signal for signal in chosen if not signal.is_force] or chosen
    motion = replace(_motion(result, options), marks=[])
    across = min(len(chosen), 2)
    down = -(-len(chosen) // across)
    style.set_size(figure, options, 9.0 if across == 1 else 16.0, (8.0 if across == 1 else 7.0) * down)
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for axes in grid[len(chosen) :]:
        axes.remove()
    for axes, signal in zip(grid, chosen, strict=False):
        _phase(figure, axes, signal, motion, options, 0.8 / across)
    _finish(figure, result, (grid[0], grid[across - 1]), motion, options)


def draw_loop(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw one observable over another, such as the force of a contact over its deformation."""
    signal = force_loop(result, options)
    motion = replace(_motion(result, options), marks=[])
    style.set_size(figure, options, 10.0, 8.0)
    axes = figure.subplots()
    _phase(figure, axes, signal, motion, options, 0.8)
    _finish(figure, result, (axes, axes), motion, options)


def draw_overview(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw for each signal its time history and, beside it, its phase path; without a trajectory, extrema over time.

    Beside a force stands the force over the first signal that is none.
    """
    if not result.has_trajectory and result.extrema_observables:
        extrema_over_time.draw(result, figure, options)
        return
    chosen = signals(result, options, MOST_PANELS)
    motion = _motion(result, options)
    style.set_size(figure, options, 17.0, 1.6 + 5.0 * len(chosen) + 0.3 * len(motion.marks))
    grid = figure.subplots(len(chosen), 2, squeeze=False, width_ratios=(1.8, 1.0))
    for axes in grid[:-1, 0]:
        axes.sharex(grid[-1, 0])
        axes.tick_params(labelbottom=False)
    _time_column(figure, grid[:, 0], chosen, motion, options)
    smooth = [signal for signal in chosen if not signal.is_force]
    for axes, signal in zip(grid[:, 1], chosen, strict=True):
        beside = loop(smooth[0], signal) if smooth and signal.is_force else signal
        _phase(figure, axes, beside, motion, options, 0.3)
    _finish(figure, result, (grid[0, 0], grid[0, 1]), motion, options)


def _motion(result: RunResult, options: PlotOptions) -> Motion:
    time = result.time
    part = result.window(options.start, options.stop)
    if part.stop - part.start < 2:
        has = f"the file has {time[0]:g} to {time[-1]:g} s" if time.size else "the file has none"
        raise ResultError(f"{result.path}: fewer than two stored times {options.range_text()} ({has})")
    first, last = float(time[part.start]), float(time[part.stop - 1])
    scale = scale_for(result.time_quantity.units or "s", max(abs(first), abs(last)))
    return Motion(time, part, scale, event_marks(result, first, last))


def _finish(figure: Figure, result: RunResult, top: tuple[Axes, Axes], motion: Motion, options: PlotOptions) -> None:
    style.set_footer(figure, result, options)
    style.set_heading(figure, top, style.title_of(result, options), [mark.handle() for mark in motion.marks])


def _time_column(figure: Figure, column: NDArray, chosen: list[Signal], motion: Motion, options: PlotOptions) -> None:
    factor = motion.time_scale.factor
    first, last = motion.time[motion.part.start] * factor, motion.time[motion.part.stop - 1] * factor
    bottom = column[-1]
    bottom.set_xlabel(f"time ({motion.time_scale.unit})")
    style.set_axis(bottom.xaxis, first, last, space_cm=0.6 * figure.get_figwidth() / style.CM)
    bottom.set_xlim(first, last)
    for axes, signal in zip(column, chosen, strict=True):
        (_, (low, high)) = _bounds(signal, signal.over_time(motion.time, motion.part))
        scale = _label(axes.yaxis, signal.value, low, high, 0.06)
        if motion.count > options.point_limit:
            _envelope(figure, axes, signal, motion, scale)
            curve = None
        else:
            time, value = _joined(signal.over_time(motion.time, motion.part))
            curve = time, value * scale.factor
            axes.plot(time * factor, curve[1], color=style.BLACK)
        for mark in motion.marks:
            mark.draw(axes, factor, None if signal.is_force else curve)


def _envelope(figure: Figure, axes: Axes, signal: Signal, motion: Motion, scale: Scale) -> None:
    """Fill, for each column of the picture, the range that the signal passes through."""
    _, columns = density.cells(figure, axes)
    edges = np.linspace(motion.time[motion.part.start], motion.time[motion.part.stop - 1], columns + 1)
    low, high = np.full(columns, np.inf), np.full(columns, -np.inf)
    for time, value in signal.over_time(motion.time, motion.part):
        column = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, columns - 1)
        starts = np.flatnonzero(np.diff(column, prepend=-1))
        touched = column[starts]
        low[touched] = np.fmin(low[touched], np.fmin.reduceat(value, starts))
        high[touched] = np.fmax(high[touched], np.fmax.reduceat(value, starts))
    hit = low <= high
    middle = (0.5 * (edges[1:] + edges[:-1]) * motion.time_scale.factor)[hit]
    low, high = low[hit] * scale.factor, high[hit] * scale.factor
    axes.fill_between(middle, low, high, color=style.BLACK, linewidth=0.3, label=signal.value.name)


def _phase(figure: Figure, axes: Axes, signal: Signal, motion: Motion, options: PlotOptions, share: float) -> None:
    """Draw a phase path into axes that take about `share` of the width of the figure."""
    x_ends, y_ends = _bounds(signal, signal.path(motion.time, motion.part))
    x_scale = _label(axes.xaxis, signal.value, *x_ends, 0.05, space_cm=share * figure.get_figwidth() / style.CM)
    y_scale = _label(axes.yaxis, signal.rate, *y_ends, 0.05)
    if motion.count <= options.point_limit:
        value, rate = _joined(signal.path(motion.time, motion.part))
        axes.plot(value * x_scale.factor, rate * y_scale.factor, color=style.BLACK, linewidth=0.6)
        return
    counted = density.Density(axes.get_xlim(), axes.get_ylim(), density.cells(figure, axes))
    parts = signal.path(motion.time, motion.part)
    density.fill(counted, ((value * x_scale.factor, rate * y_scale.factor) for value, rate in parts))
    density.show(axes, counted, counted.image(style.BLACK))


def _label(
    axis: Axis, quantity: Quantity, low: float, high: float, margin: float, space_cm: float | None = None
) -> Scale:
    """Choose unit, limits and label of an axis for values from `low` to `high` (units of the file)."""
    scale = scale_for(quantity.units, max(abs(low), abs(high)))
    ends = style.limits(low * scale.factor, high * scale.factor, margin)
    style.set_axis(axis, *ends, space_cm=space_cm)
    axis.set_label_text(axis_label(quantity, scale, LONGEST_LABEL))
    set_limits = axis.axes.set_xlim if axis is axis.axes.xaxis else axis.axes.set_ylim
    set_limits(ends)
    return scale


def _bounds(signal: Signal, parts: Iterable[Pair]) -> tuple[tuple[float, float], tuple[float, float]]:
    ends = density.bounds(parts)
    if ends is None:
        raise ResultError(f"'{signal.value.name}' has no finite value in the range asked for")
    return ends


def _joined(parts: Iterable[Pair]) -> Pair:
    first, second = zip(*parts, strict=True)
    return np.concatenate(first), np.concatenate(second)
