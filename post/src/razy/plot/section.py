"""Poincaré sections, and orbits of shaft nodes with a mark once in each revolution."""

from dataclasses import replace

import f90nml
import numpy as np
from matplotlib.figure import Figure

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.sampled import Course, strobe
from razy.plot.signals import observable, signals
from razy.plot.units import axis_label, scale_for
from razy.read import RunResult

MOST_PANELS = 4


def draw_poincare(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw value and rate of signals once in each period of the excitation, beginning at time 0."""
    chosen = signals(result, options, MOST_PANELS)
    if not options.observables:
        chosen = [signal for signal in chosen if not signal.is_force] or chosen
    times = strobe(result, options)
    grid = _panels(figure, options, len(chosen), 8.0)
    for axes, signal in zip(grid, chosen, strict=True):
        course = Course(result, signal, options)
        value, rate = course.at(times), course.rate_at(times)
        for axis, quantity, numbers in ((axes.xaxis, signal.value, value), (axes.yaxis, signal.rate, rate)):
            scale = scale_for(quantity.units, float(np.abs(numbers).max()))
            numbers *= scale.factor
            ends = style.limits(float(numbers.min()), float(numbers.max()), 0.08)
            style.set_axis(axis, *ends, space_cm=6.0 if axis is axes.xaxis else None)
            (axes.set_xlim if axis is axes.xaxis else axes.set_ylim)(ends)
            axis.set_label_text(axis_label(quantity, scale))
        axes.plot(value, rate, "o", markersize=max(1.6, style.marker_size(times.size)), color=style.BLACK,
                  markeredgewidth=0.0, label=signal.value.name)  # fmt: skip
    style.set_footer(figure, result, options)
    style.set_heading(figure, (grid[0], grid[-1]), style.title_of(result, options), [])


def draw_orbit(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw the path of shaft nodes in the plane yz, with a point where a revolution of the shaft begins."""
    nodes = _nodes(result, options)
    turn = _turn(result, options)
    marks = None if turn is None else strobe(result, turn)
    grid = _panels(figure, options, len(nodes), 8.0)
    for axes, node in zip(grid, nodes, strict=True):
        v, w = (Course(result, observable(result, f"displacement.{node}.{way}"), options) for way in "vw")
        scale = scale_for("m", float(max(np.abs(v.value).max(), np.abs(w.value).max())))
        axes.plot(v.value * scale.factor, w.value * scale.factor, color=style.BLACK, linewidth=0.6, label=node)
        if marks is not None:
            axes.plot(v.at(marks) * scale.factor, w.at(marks) * scale.factor, "o", markersize=3.0, color=style.RED,
                      markeredgewidth=0.0, zorder=3, label="once per revolution")  # fmt: skip
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.08)
        axes.set_xlabel(f"{node}: displacement along y ({scale.unit})")
        axes.set_ylabel(f"along z ({scale.unit})")
    handles = [] if marks is None else [style.point_handle("once per revolution", style.RED)]
    style.set_footer(figure, result, options)
    style.set_heading(figure, (grid[0], grid[-1]), style.title_of(result, options), handles)


def _nodes(result: RunResult, options: PlotOptions) -> list[str]:
    """Return the nodes asked for, such as ``rotor.3``, else the first whose displacements are stored."""
    names = [name.removeprefix("displacement.") for name in result.observables if name.startswith("displacement.")]
    both = [name[:-2] for name in names if name.endswith(".v") and f"{name[:-2]}.w" in names]
    asked = [name.removeprefix("displacement.") for name in (*options.observables, *options.coordinates)]
    for node in asked:
        if node not in both:
            raise ResultError(f"{result.path}: no orbit of '{node}' (the file has: {', '.join(both) or 'none'})")
    if not both:
        raise ResultError(
            f"{result.path}: no orbit: it needs &record observable='displacement' of SHAFT.NODE.v and of SHAFT.NODE.w"
        )
    return asked or both[:MOST_PANELS]


def _turn(result: RunResult, options: PlotOptions) -> PlotOptions | None:
    """Return the options with the period of a revolution, if one is asked for or the input has a speed."""
    if options.period is not None:
        return options
    speed = f90nml.reads(result.input).get("rotation", {}).get("speed_rpm", 0.0)
    return replace(options, period=60.0 / speed) if speed else None


def _panels(figure: Figure, options: PlotOptions, count: int, side: float) -> list:
    across = min(count, 2)
    down = -(-count // across)
    style.set_size(figure, options, (side + 1.0) * across, side * down)
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.remove()
    return list(grid[:count])
