"""A picture of a planar machine to scale: bodies, points, and what acts between them."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from razy.plot import style
from razy.plot.machine.symbols import BLUE, GREEN, OCHRE, across, coils, dashpot, draw_ground
from razy.plot.options import PlotOptions
from razy.read import ResultFile
from razy.read.description import read_description, values_of
from razy.read.scene import Element, Scene, read_scene

STUB = 0.09
MARK = 0.028


def draw(result: ResultFile, figure: Figure, options: PlotOptions) -> None:
    """Draw the geometry that a result file holds; names stand at bodies, kinds in the legend.

    Parameters
    ----------
    result
        Open result file.
    figure
        Empty figure.
    options
        Title, size and footer are used.

    Raises
    ------
    ResultError
        The file holds no geometry.
    """
    scene = read_scene(result)
    style.set_size(figure, options, 16.0, 12.0)
    axes = figure.add_subplot()
    scale = _scale(scene)
    for body in scene.bodies:
        corner = body.centre - body.size / 2
        axes.add_patch(Rectangle(corner, *body.size, facecolor="0.93", edgecolor="0.35", linewidth=1.0, zorder=1))
        axes.plot(*body.centre, "+", color="0.35", markersize=6, zorder=2)
        axes.annotate(body.name, body.centre, (5, 4), textcoords="offset points", color="0.25", zorder=5)
    if scene.points:
        axes.plot(*np.array([point.position for point in scene.points]).T, ".", color="0.3", markersize=3.5, zorder=4)
    handles: dict[str, Line2D] = {}
    for element in scene.elements:
        line = _draw_element(axes, element, scale)
        line.set_label(element.kind)
        handles.setdefault(element.kind, line)
    for place in _rings(result, scene):
        look = {"color": style.BLUE, "markerfacecolor": "none", "markersize": 11, "zorder": 4, "label": "ring"}
        handles["ring"] = axes.plot(*place, "o", linestyle="none", **look)[0]
    axes.set_aspect("equal")
    axes.margins(0.06)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    style.set_footer(figure, result, options)
    style.set_heading(figure, (axes, axes), style.title_of(result, options), list(handles.values()))


def _rings(result: ResultFile, scene: Scene) -> list[NDArray[np.float64]]:
    """Return the place of each round hole, whose clearance is too small to be seen to scale."""
    known = {body.name.lower(): body.centre for body in scene.bodies}
    known |= {point.name.lower(): point.position for point in scene.points}
    ends = [values_of(ring, "between") for ring in read_description(result).get("ring", [])]
    return [next(known[str(end).lower()] for end in pair if str(end).lower() in known) for pair in ends]


def _scale(scene: Scene) -> float:
    """Return the extent of the machine in m, 1 for a single place."""
    places = [corner for body in scene.bodies for corner in (body.centre - body.size / 2, body.centre + body.size / 2)]
    places += [point.position for point in scene.points]
    places += [end for element in scene.elements for end in (element.first, element.second)]
    extent = float(np.ptp(np.array(places), axis=0).max()) if places else 0.0
    return extent if extent > 0.0 else 1.0


def _draw_element(axes: Axes, element: Element, scale: float) -> Line2D:
    """Draw one element and return its line for the legend."""
    if element.kind == "exciter":
        return _draw_exciter(axes, element, scale)
    if element.kind == "load":
        return _draw_arrow(axes, element.first, element.direction, scale, style.RED)
    first, second = element.first, element.second
    if math.dist(first, second) < 1e-9 * scale:
        # An end in the frame that has no place of its own, or a closed gap.
        second = first - STUB * scale * element.direction if 0 in element.bodies else second
        if 0 in element.bodies:
            draw_ground(axes, second, element.direction, MARK * scale)
    if element.kind == "stop":
        return _draw_stop(axes, element.first, element.second, element.direction, scale)
    if element.kind == "damper":
        colour, path = GREEN, dashpot(first, second, MARK * scale)
    else:
        colour, path = BLUE, coils(first, second, MARK * scale)
    return axes.plot(*path.T, color=colour, linewidth=1.0, zorder=3)[0]


def _draw_stop(
    axes: Axes,
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    direction: NDArray[np.float64],
    scale: float,
) -> Line2D:
    """Draw the two faces of a contact, across its direction."""
    face = across(direction) * MARK * scale
    for place in (first, second):
        handle = axes.plot(*np.array([place - face, place + face]).T, color=style.RED, linewidth=2.0, zorder=4)[0]
    return handle


def _draw_exciter(axes: Axes, element: Element, scale: float) -> Line2D:
    """Draw the axes of both rotors as circles, and the resultant as an arrow between them."""
    middle = (element.first + element.second) / 2
    _draw_arrow(axes, middle, element.direction, scale, OCHRE)
    both = np.array([element.first, element.second])
    return axes.plot(*both.T, "o", color=OCHRE, markerfacecolor="white", markersize=9, zorder=4)[0]


def _draw_arrow(
    axes: Axes, place: NDArray[np.float64], direction: NDArray[np.float64], scale: float, colour: str
) -> Line2D:
    """Draw a force; a moment, which has no direction in the plane, as a ring."""
    if not np.any(direction):
        return axes.plot(*place, "o", color=colour, markerfacecolor="none", markersize=8, zorder=4)[0]
    tip = place + STUB * scale * direction
    axes.annotate("", tip, place, arrowprops={"arrowstyle": "->", "color": colour, "linewidth": 1.3}, zorder=4)
    return axes.plot(*np.array([place, tip]).T, color=colour, linewidth=1.3, zorder=3)[0]
