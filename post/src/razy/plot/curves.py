"""Curves of special points of periodic motions over two parameters, with or without the map of a sweep below."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from razy.errors import ResultError
from razy.plot import maps, style
from razy.plot.branches import COLOURS, MARKS, MORE_COLOURS
from razy.plot.options import PlotOptions
from razy.plot.units import axis_label, scale_for
from razy.read import FollowResult

# One for each kind; a period above 1 is written beside it.
LINES = {"LP": COLOURS[4], "PD": COLOURS[2], "TR": COLOURS[3], "GR": MORE_COLOURS[0]}
ON_MAP = 1.4


def draw(result: FollowResult, figure: Figure, options: PlotOptions) -> None:
    """Draw the curves; the parameter of the first &follow is horizontal."""
    if options.observables or options.coordinates or options.quantity is not None:
        raise ResultError(f"{result.path}: curves over two parameters have no observables")
    curves = result.curves
    if curves is None:
        raise ResultError(f"{result.path}: was followed over one parameter; curves need a second &follow")
    names, sweep = curves.parameters, options.sweep
    if sweep is not None and sorted(sweep.parameters) != sorted(names):
        raise ResultError(f"{sweep.path}: sweeps over {' and '.join(sweep.parameters)}, not {' and '.join(names)}")
    style.set_size(figure, options, 16.0, 11.0)
    style.set_footer(figure, result, options)
    axes = figure.subplots()
    scales = [
        scale_for(quantity.units, float(np.abs(values).max(initial=0.0)))
        for quantity, values in zip(curves.quantities, curves.places, strict=True)
    ]
    if sweep is not None:
        edges = [maps.edges(sweep.axis(name)) * scale.factor for name, scale in zip(names, scales, strict=True)]
        shown = maps.default_names(sweep)[-1:]
        if not shown:
            raise ResultError(f"{sweep.path}: holds neither statistics of contacts nor the period of the motions")
        values = maps.values(sweep, shown[0]).reshape(-1, *(sweep.axis(name).size for name in sweep.parameters))[0]
        maps.fill(sweep, axes, shown[0], (edges[0], edges[1]), values if sweep.parameters == names else values.T)
    handles = {}
    for number, label in enumerate(curves.label, start=1):
        x, y = (
            values[curves.curve == number] * scale.factor for values, scale in zip(curves.places, scales, strict=True)
        )
        period = int(curves.multiplicity[number - 1])
        text = MARKS[label][0] + (f", period {period}" if period > 1 else "")
        look = {
            "color": LINES[label],
            "linewidth": 0.9 if sweep is None else ON_MAP,
            "linestyle": "-" if period == 1 else "--",
        }
        axes.plot(x, y, label=text, **look)
        handles[text] = Line2D([], [], label=text, **look)
    x, y = (values * scale.factor for values, scale in zip(curves.junctions, scales, strict=True))
    axes.plot(x, y, linestyle="none", marker="D", markersize=3.5, color="black", zorder=3)
    for text, *at in zip(curves.junction, x, y, strict=True):
        axes.annotate(text, at, xytext=(4, 4), textcoords="offset points", fontsize="x-small")
    axes.set_xlabel(axis_label(curves.quantities[0], scales[0]))
    axes.set_ylabel(axis_label(curves.quantities[1], scales[1]))
    low, high = axes.get_xlim()
    start, stop = (None if end is None else end * scales[0].factor for end in (options.start, options.stop))
    axes.set_xlim(low if start is None else start, high if stop is None else stop)
    style.set_heading(figure, (axes, axes), style.title_of(result, options), list(handles.values()))
