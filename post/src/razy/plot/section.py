"""Poincaré sections, and orbits of shaft nodes and planar places in their rings, with a mark in each revolution."""

from dataclasses import replace

import f90nml
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.sampled import EVEN, Course, strobe
from razy.plot.signals import observable, signals
from razy.plot.units import axis_label, scale_for
from razy.read import RunResult
from razy.read.description import read_description, values_of

MOST_PANELS = 4


def draw_poincare(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw value and rate of signals once in each period of the excitation, in a run-up in each turn, from 0 on."""
    chosen = signals(result, options, MOST_PANELS)
    if not options.observables:
        chosen = [signal for signal in chosen if not signal.is_force] or chosen
    times = (revolutions if result.rotation is not None else strobe)(result, options)
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
            axis.set_label_text(axis_label(quantity, scale, 40))
        axes.plot(value, rate, "o", markersize=max(1.6, style.marker_size(times.size)), color=style.BLACK,
                  markeredgewidth=0.0, label=signal.value.name)  # fmt: skip
    style.set_footer(figure, result, options)
    style.set_heading(figure, (grid[0], grid[-1]), style.title_of(result, options), [])


def draw_orbit(result: RunResult, figure: Figure, options: PlotOptions) -> None:
    """Draw paths of shaft nodes or planar places in their rings, with a mark in each turn and an arrow at the end."""
    nodes = _nodes(result, options)
    rings = _rings(result)
    marks = revolutions(result, options)
    grid = _panels(figure, options, len(nodes), 8.0)
    for axes, node in zip(grid, nodes, strict=True):
        ways = _ways(result, node)
        v, w = (Course(result, observable(result, f"displacement.{node}.{way}"), options) for way in ways)
        scale = scale_for("m", float(max(np.abs(v.value).max(), np.abs(w.value).max())))
        path = np.column_stack((v.value, w.value)) * scale.factor
        axes.plot(*path.T, color=style.BLACK, linewidth=0.6, label=node)
        moves = np.flatnonzero(np.any(path[1:] != path[:-1], axis=1))
        if moves.size:
            # Where it moves to: forward or backward whirl.
            tail, tip = path[moves[-1] : moves[-1] + 2]
            look = {"arrowstyle": "-|>", "color": style.BLACK, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", tip, tail, arrowprops=look)
        if marks is not None:
            axes.plot(v.at(marks) * scale.factor, w.at(marks) * scale.factor, "o", markersize=3.0, color=style.RED,
                      markeredgewidth=0.0, zorder=3, label="once per revolution")  # fmt: skip
        for centre, radius in rings.get(node.lower(), []):
            look = {"fill": False, "edgecolor": style.BLUE, "linewidth": 1.2, "zorder": 4, "label": "ring"}
            axes.add_patch(Circle(tuple(centre * scale.factor), radius * scale.factor, **look))
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.08)
        axes.autoscale_view()
        first, second = "yz" if ways == "vw" else ways
        axes.set_xlabel(f"{node}: displacement along {first} ({scale.unit})")
        axes.set_ylabel(f"along {second} ({scale.unit})")
    handles = [] if marks is None else [style.point_handle("once per revolution", style.RED)]
    if any(node.lower() in rings for node in nodes):
        handles.append(Line2D([], [], color=style.BLUE, linewidth=1.2, label="ring"))
    style.set_footer(figure, result, options)
    style.set_heading(figure, (grid[0], grid[-1]), style.title_of(result, options), handles)


def _rings(result: RunResult) -> dict[str, list[tuple[NDArray[np.float64], float]]]:
    """Return centre and radius, m, of the rings in the frame around each node such as ``rotor.3``."""
    rings: dict[str, list[tuple[NDArray[np.float64], float]]] = {}
    for ring in read_description(result).get("ring", []):
        ends = [str(end).lower() for end in values_of(ring, "between")]
        if ends.count("frame") != 1:
            continue
        centre = np.array([*values_of(ring, "offset"), 0.0, 0.0][:2], dtype=float)
        node, centre = (ends[0], centre) if ends[1] == "frame" else (ends[1], -centre)
        rings.setdefault(node, []).append((centre, float(ring["clearance"])))
    return rings


def shaft_nodes(result: RunResult) -> list[str]:
    """Return the nodes of which both displacements across the axis are stored, and planar places of which both are."""
    names = [name.removeprefix("displacement.") for name in result.observables if name.startswith("displacement.")]
    return list(dict.fromkeys(name[:-2] for name in names if "." in name and _ways(result, name[:-2])))


def _ways(result: RunResult, node: str) -> str:
    """Return the names of both displacements of a node or place that are stored; '' if they are not."""
    for ways in ("vw", "xy"):
        if all(f"displacement.{node}.{way}" in result.observables for way in ways):
            return ways
    return ""


def _nodes(result: RunResult, options: PlotOptions) -> list[str]:
    """Return the nodes asked for, such as ``rotor.3``, else the first whose displacements are stored."""
    both = shaft_nodes(result)
    asked = [name.removeprefix("displacement.") for name in (*options.observables, *options.coordinates)]
    for node in asked:
        if node not in both:
            raise ResultError(f"{result.path}: no orbit of '{node}' (the file has: {', '.join(both) or 'none'})")
    if not both:
        raise ResultError(
            f"{result.path}: no orbit: it needs &record observable='displacement' of SHAFT.NODE.v and "
            "of SHAFT.NODE.w, or of PLACE.x and PLACE.y"
        )
    return asked or both[:MOST_PANELS]


def revolutions(result: RunResult, options: PlotOptions) -> NDArray[np.float64] | None:
    """Return the times in the range at which a revolution begins, s; the first begins at 0. None without a speed."""
    if options.period is not None or result.rotation is None:
        speed = f90nml.reads(result.input).get("rotation", {}).get("speed_rpm", 0.0)
        if options.period is None and not speed:
            return None
        return strobe(result, replace(options, period=options.period or 60.0 / abs(speed)))
    part = result.window(options.start, options.stop)
    begin, end = result.time[part][[0, -1]]
    at, speed = result.rotation
    change = (speed[1] - speed[0]) / (at[1] - at[0])
    # Where the rotation turns back the angle is largest or smallest.
    time = np.array([begin, end, np.clip(at[0] - speed[0] / change, begin, end)]) - at[0]
    turns = (speed[0] * time + change * time**2 / 2) / (2 * np.pi)
    angle = 2 * np.pi * np.arange(np.ceil(turns.min() - EVEN), np.floor(turns.max() + EVEN) + 1)
    # Both roots of the angle, formed without cancellation.
    root = speed[0] + np.copysign(np.sqrt(np.maximum(speed[0] ** 2 + 2 * change * angle, 0.0)), speed[0])
    times = at[0] + np.unique(np.concatenate((2 * angle / root, -root / change)))
    slack = EVEN * (end - begin)
    return np.clip(times[(times >= begin - slack) & (times <= end + slack)], begin, end)


def _panels(figure: Figure, options: PlotOptions, count: int, side: float) -> list:
    across = min(count, 2)
    down = -(-count // across)
    style.set_size(figure, options, (side + 1.0) * across, side * down)
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for axes in grid[count:]:
        axes.remove()
    return list(grid[:count])
