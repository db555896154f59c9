"""Extrema of one motion over time, for files that hold no trajectory."""

import numpy as np
from matplotlib.figure import Figure

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.units import LABEL_WIDTH, axis_label, scale_for
from razy.read import RunResult

MOST_PANELS = 4


def draw(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw maxima grey and minima black over time, one observable above the other."""
    if options.coordinates:
        raise ResultError(f"{result.path}: holds extrema of observables only, no coordinates")
    names = options.observables or result.extrema_observables[:MOST_PANELS]
    style.set_size(figure, options, 16.0, 2.2 + 4.3 * len(names))
    column = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    handles = {}
    for axes, name in zip(column, names, strict=True):
        extrema = result.extrema(name)
        low = -np.inf if options.start is None else options.start
        high = np.inf if options.stop is None else options.stop
        keep = np.isfinite(extrema.value) & (extrema.time >= low) & (extrema.time <= high)
        if not np.any(keep):
            raise ResultError(f"{result.path}: no extrema of '{name}' with a time {options.range_text()}")
        quantity = result.extrema_quantity(name)
        scale = scale_for(quantity.units, float(np.abs(extrema.value[keep]).max()))
        for kind, (label, colour) in style.EXTREMA.items():
            chosen = keep & (extrema.kind == kind)
            if np.any(chosen):
                look = {"linestyle": "none", "marker": "o", "markeredgewidth": 0.0, "color": colour, "label": label}
                time, value = extrema.time[chosen], extrema.value[chosen] * scale.factor
                axes.plot(
                    time,
                    value,
                    markersize=style.marker_size(time.size),
                    rasterized=time.size > style.RASTER_ABOVE,
                    **look,
                )
                handles[kind] = style.point_handle(label, colour)
        axes.set_ylabel(axis_label(quantity, scale, LABEL_WIDTH))
        style.set_axis(axes.yaxis, *axes.get_ylim())
    column[-1].set_xlabel("time (s)")
    low, high = column[-1].get_xlim()
    style.set_axis(column[-1].xaxis, low, high, space_cm=10.0)
    style.set_footer(figure, result, options)
    style.set_heading(figure, (column[0], column[0]), style.title_of(result, options), list(handles.values()))
