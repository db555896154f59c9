"""Pictures of a duel: error of the displacements and of the event times against processor time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from razy.plot import style
from razy.plot.options import PlotOptions
from razy.read.duel import DuelResult, Series

MARKERS = "osD^v<>pP*X"
# Errors below this are drawn at it, so that a logarithmic axis can show them.
LEAST_ERROR = 1e-17


def draw(result: DuelResult, figure: Figure, options: PlotOptions) -> None:
    """Draw work against precision: error, and error of the event times, over processor time."""
    style.set_size(figure, options, 18.0, 10.5)
    left, right = figure.subplots(1, 2)
    series = result.series
    _panel(left, series, [one.error for one in series], "largest relative error of a displacement")
    if result.reference_error > 0:
        left.axhline(result.reference_error, color=style.GREY, linestyle=":", linewidth=0.8, label="error of exact")
    _panel(right, series, [one.event_time_error for one in series], "largest error of an event time, s")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=7)
    style.set_footer(figure, result, options)
    style.set_heading(figure, (left, right), style.title_of(result, options), [])


def _panel(axes: Axes, series: list[Series], errors: list[NDArray[np.float64]], label: str) -> None:
    colours = (style.BLACK, *style.EVENT_COLOURS)
    for i, (one, error) in enumerate(zip(series, errors, strict=True)):
        colour = colours[i % len(colours)]
        if one.name == "exact" and not np.any(error > 0.0):
            # It is the reference itself, so it has no measured error.
            continue
        good = np.isfinite(error)
        whole = good & (one.event_surplus == 0)
        line = {"color": colour, "marker": MARKERS[i % len(MARKERS)], "markersize": 3.5, "linewidth": 0.7}
        axes.plot(one.cpu_time[good], np.maximum(error[good], LEAST_ERROR), label=one.name, **line)
        # Rows with another number of events than the reference are hollow.
        wrong = good & ~whole
        axes.plot(
            one.cpu_time[wrong],
            np.maximum(error[wrong], LEAST_ERROR),
            **{**line, "linestyle": "none", "markerfacecolor": "white"},
        )
    axes.set(xscale="log", yscale="log", xlabel="processor time, s", ylabel=label)
    for axis in (axes.xaxis, axes.yaxis):
        style.set_log_axis(axis)
