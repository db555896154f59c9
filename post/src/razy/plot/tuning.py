"""Objective and natural frequencies over the tuned parameter."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.units import axis_label, scale_for
from razy.read import TuneResult


def draw(result: TuneResult, figure: Figure, options: PlotOptions) -> None:
    """Draw the objective above, the frequencies below; the mode tuned is black, the tuned value a vertical line."""
    if options.observables or options.coordinates:
        raise ResultError(f"{result.path}: a file of razy-tune holds no observables and no coordinates")
    parameter = result.parameter
    low = -np.inf if options.start is None else options.start
    high = np.inf if options.stop is None else options.stop
    keep = (parameter >= low) & (parameter <= high)
    if not np.any(keep):
        extent = f"the file has {parameter.min():g} to {parameter.max():g}"
        raise ResultError(f"{result.path}: no value of the parameter {options.range_text()}; {extent}")
    quantity = result.quantity("parameter")
    scale = scale_for(quantity.units, float(np.abs(parameter[keep]).max()))
    x = parameter[keep] * scale.factor
    style.set_size(figure, options, 16.0, 12.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1, 2))
    joined = _joined(result.tuned_place[keep], result.frequency[keep], result.tuned_frequency[keep])
    upper.plot(*_broken(x, result.objective[keep], joined), color=style.BLACK, label="objective")
    upper.set_ylabel("objective ψ")
    for number, curve in enumerate(result.frequency[keep].T, start=1):
        lower.plot(x, curve, color=style.GREY, label=f"mode {number}")
    lower.plot(*_broken(x, result.tuned_frequency[keep], joined), color=style.BLACK, linewidth=1.2, label="tuned")
    lower.axhline(result.goal, color=style.RED, linewidth=0.5, linestyle=(0, (6, 4)), label="goal")
    lower.plot([result.optimum * scale.factor], [result.goal], "o", markersize=4, color=style.RED, label="tuned value")
    lower.set_ylabel("natural frequency (Hz)")
    lower.set_ylim(bottom=0.0)
    for axes in (upper, lower):
        axes.axvline(result.reference * scale.factor, color=style.GREY, linewidth=0.5, linestyle=(0, (1, 3)))
        axes.axvline(result.optimum * scale.factor, color=style.RED, linewidth=0.5)
    _limit(lower, x)
    lower.set_xlabel(axis_label(quantity, scale))
    handles = [
        Line2D([], [], color=style.BLACK, linewidth=1.2, label=result.mode or "mode tuned"),
        Line2D([], [], color=style.GREY, label="other modes"),
        Line2D(
            [],
            [],
            color=style.RED,
            linewidth=0.5,
            label=f"{result.goal:g} Hz at {result.optimum * scale.factor:.6g} {scale.unit}",
        ),
    ]
    style.set_footer(figure, result, options)
    style.set_heading(figure, (upper, upper), style.title_of(result, options), handles)


def _limit(axes: Axes, x: NDArray[np.float64]) -> None:
    low, high = style.limits(float(x.min()), float(x.max()), 0.0)
    axes.set_xlim(low, high)
    style.set_axis(axes.xaxis, low, high, space_cm=13.0)


def _joined(place: NDArray, frequency: NDArray, tuned: NDArray) -> NDArray[np.bool_]:
    """Return for each interval whether the mode tuned is one curve there; where it changes to another, it has a gap."""
    on_curve = np.isclose(frequency, tuned[:, None], rtol=1e-12, atol=0.0)
    stays = np.any(on_curve[:-1] & on_curve[1:], axis=1)
    # A mode that is beyond those stored is told by its place alone.
    stored = np.any(on_curve[:-1], axis=1) & np.any(on_curve[1:], axis=1)
    return np.where(stored, stays, place[:-1] == place[1:])


def _broken(x: NDArray, y: NDArray, joined: NDArray[np.bool_]) -> tuple[NDArray, NDArray]:
    """Return the curve with a gap in every interval that is not joined."""
    at = np.flatnonzero(~joined) + 1
    return np.insert(x, at, x[at - 1]), np.insert(y, at, np.nan)
