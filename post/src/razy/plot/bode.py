"""The linear response over a parameter: amplitude and phase above one another, or as a polar plot."""

from collections.abc import Sequence
from dataclasses import replace

import f90nml
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import style
from razy.plot.labels import Room, write
from razy.plot.options import PlotOptions
from razy.plot.units import Scale, axis_label, in_words, readable_name, scale_for
from razy.read import ModesResult, Quantity
from razy.read.file import choose

COLOURS = (style.BLACK, *style.EVENT_COLOURS)
MOST_LINES = 6
# Values of the parameter along the curves of a polar diagram, of all together.
MOST_MARKS = 10
# Peaks lower than this share of the highest are not marked.
NAMED = 0.02


def draw_bode(result: ModesResult, figure: Figure, options: PlotOptions) -> None:
    """Draw amplitude and phase of observables, peaks with amplification factors, and the operating range."""
    lines, scale, quantity = _lines(result, options)
    keep = _range(result, options)
    parameter = result.response_parameter
    at = result.response_grid[keep]
    style.set_size(figure, options, 16.0, 12.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
    handles, peaks = [], []
    largest = max(float(np.nanmax(np.abs(value[keep]))) for *_, value in lines) * scale.factor
    for colour, (name, tone, label, value) in zip(COLOURS, lines, strict=False):
        size, phase = np.abs(value[keep]) * scale.factor, _phase(value[keep])
        upper.plot(at, size, color=colour, label=label)
        lower.plot(at, phase, color=colour, label=label)
        handles.append(Line2D([], [], color=colour, label=label))
        for place, height, factor in result.response_peaks(name, tone):
            if not at[0] <= place <= at[-1] or height * scale.factor < NAMED * largest:
                continue
            upper.plot(place, height * scale.factor, "o", markersize=3.0, color=colour, label="peak")
            words = f"{place:.5g}" + (f", AF {factor:.1f}" if np.isfinite(factor) else "")
            peaks.append((words, (place, height * scale.factor)))
    upper.set_ylim(0.0, None)
    upper.margins(y=0.1)
    operating = f90nml.reads(result.input).get("response", {}).get("operating")
    for axes in (upper, lower):
        if operating:
            axes.axvspan(*operating, color=style.GREY, alpha=0.2, linewidth=0.0, label="in operation")
    upper.set_ylabel(axis_label(replace(quantity, long_name=f"amplitude of {readable_name(quantity)}"), scale, 40))
    lower.set_ylabel("phase (°)")
    lower.yaxis.set_major_locator(_degrees(lower))
    lower.set_xlabel(axis_label(parameter, Scale(1.0, parameter.units)))
    lower.set_xlim(at[0], at[-1])
    style.set_footer(figure, result, options)
    style.set_heading(figure, (upper, upper), style.title_of(result, options), handles)
    _name(figure, upper, sorted(peaks, key=lambda peak: -peak[1][1]))


def draw_polar(result: ModesResult, figure: Figure, options: PlotOptions) -> None:
    """Draw amplitude over phase, with some values of the parameter."""
    lines, scale, quantity = _lines(result, options)
    keep = _range(result, options)
    at = result.response_grid[keep]
    style.set_size(figure, options, 12.0, 12.5)
    axes = figure.add_subplot(projection="polar")
    handles, marks = [], []
    for colour, (_, _, label, value) in zip(COLOURS, lines, strict=False):
        seen = value[keep]
        axes.plot(np.angle(seen), np.abs(seen) * scale.factor, color=colour, label=label)
        handles.append(Line2D([], [], color=colour, label=label))
        for index in _marks(seen, max(3, MOST_MARKS // len(lines))):
            place = np.angle(seen[index]), np.abs(seen[index]) * scale.factor
            axes.plot(*place, "o", markersize=2.5, color=colour, label="mark")
            marks.append((f"{at[index]:.5g}", place))
    axes.minorticks_off()
    axes.grid(linewidth=0.3)
    axes.set_thetagrids(range(0, 360, 60))
    axes.set_rlabel_position(20)
    unit = result.response_parameter.units
    axes.set_xlabel(
        f"amplitude of {axis_label(quantity, scale)} over phase; numbers: "
        + readable_name(result.response_parameter) + (f" ({unit})" if unit else "")
    )  # fmt: skip
    style.set_footer(figure, result, options)
    style.set_heading(figure, (axes, axes), style.title_of(result, options), handles)
    _name(figure, axes, marks, [tick.label1 for tick in axes.yaxis.get_major_ticks()])


def _name(
    figure: Figure, axes: Axes, marks: list[tuple[str, tuple[float, float]]], others: Sequence[Text] = ()
) -> None:
    """Write texts beside their marks, those named first where there is not room for all; none over `others`."""
    style.lay_out(figure)
    room = Room(axes, [at for _, at in marks], [curve.get_data() for curve in axes.lines], others)
    write(axes, [place for place in room.places(*zip(*marks, strict=True)) if place is not None] if marks else [])


def _lines(
    result: ModesResult, options: PlotOptions
) -> tuple[list[tuple[str, int, str, NDArray[np.complex128]]], Scale, Quantity]:
    """Return name, tone, label and phasors (points,) of each line, and the scale and words of all."""
    known = result.response_observables
    if not known:
        raise ResultError(f"{result.path}: has no response (&response)")
    if options.coordinates:
        raise ResultError(f"{result.path}: a response is of observables: use --observable")
    names = [choose(name, known, "observable", result.path) for name in options.observables]
    if not names:
        first = result.phasor_quantity(known[0]).units
        names = [name for name in known if result.phasor_quantity(name).units == first]
    units = {result.phasor_quantity(name).units for name in names}
    if len(units) > 1:
        raise ResultError(f"{result.path}: observables of one picture have one unit, not {', '.join(sorted(units))}")
    found = []
    for name in names:
        phasor = result.phasor(name)
        largest = np.nanmax(np.abs(phasor), initial=0.0)
        for tone in range(phasor.shape[1]):
            # A tone that does not move this observable is left out.
            if np.nanmax(np.abs(phasor[:, tone]), initial=0.0) > 1e-9 * largest:
                several = f", tone {tone + 1}" if phasor.shape[1] > 1 else ""
                found.append((name, tone, in_words(name) + several, phasor[:, tone]))
    if not found:
        raise ResultError(f"{result.path}: nothing responds")
    found = found[:MOST_LINES]
    scale = scale_for(units.pop(), max(float(np.nanmax(np.abs(value))) for *_, value in found))
    quantity = result.phasor_quantity(names[0])
    words = quantity.long_name.split(",")[0] if len(names) == 1 else names[0].split(".")[0]
    return found, scale, Quantity(names[0], quantity.units, words)


def _range(result: ModesResult, options: PlotOptions) -> NDArray[np.bool_]:
    grid = result.response_grid
    keep = (grid >= (-np.inf if options.start is None else options.start)) & (
        grid <= (np.inf if options.stop is None else options.stop)
    )
    if keep.sum() < 2:
        raise ResultError(f"{result.path}: fewer than two points {options.range_text()}")
    return keep


def _phase(value: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Return the phase in degrees without jumps, from -180 to 180 where it begins."""
    phase = np.full(value.shape, np.nan)
    known = np.isfinite(value)
    phase[known] = np.degrees(np.unwrap(np.angle(value[known])))
    return phase


def _degrees(axes) -> object:
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_ylim()
    return MultipleLocator(next(step for step in (5, 15, 45, 90, 180, 360, 1e9) if (high - low) / step <= 6))


def _marks(value: NDArray[np.complex128], count: int) -> NDArray[np.int64]:
    """Return `count` points that follow each other at about equal lengths of the curve."""
    known = np.flatnonzero(np.isfinite(value))
    length = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(value[known])))))
    wanted = np.linspace(0.0, length[-1], count + 1)[1:]
    return np.unique(known[np.minimum(np.searchsorted(length, wanted), known.size - 1)])
