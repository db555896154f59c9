"""Symbols of schemes: springs, dampers, the frame, arrows, values with their units."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from razy.plot import style
from razy.plot.units import scale_for

BLUE, GREEN, OCHRE = style.EVENT_COLOURS[1:4]
COILS = 4
DARK, FACE = "0.3", "0.93"


def across(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the direction turned by a right angle."""
    return np.array([direction[1], -direction[0]])


def coils(first: NDArray[np.float64], second: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Return the path of a spring between two places, shape (points, 2)."""
    line = second - first
    along = np.concatenate(([0.0, 0.2], 0.2 + 0.6 * (np.arange(2 * COILS) + 0.5) / (2 * COILS), [0.8, 1.0]))
    aside = np.concatenate(([0.0, 0.0], np.tile([1.0, -1.0], COILS), [0.0, 0.0])) * width / 2
    normal = across(line / max(float(np.hypot(*line)), 1e-300))
    return first + np.outer(along, line) + np.outer(aside, normal)


def dashpot(first: NDArray[np.float64], second: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Return the path of a damper between two places: rod, piston, cylinder; NaN between its strokes."""
    line = second - first
    normal = across(line / max(float(np.hypot(*line)), 1e-300)) * width / 2
    at = first + np.outer([0.0, 0.45, 0.45, 0.45, np.nan, 0.3, 0.6, 0.6, 0.3, np.nan, 0.6, 1.0], line)
    aside = np.outer([0.0, 0.0, 0.7, -0.7, np.nan, 1.0, 1.0, -1.0, -1.0, np.nan, 0.0, 0.0], normal)
    return at + aside


def draw_ground(
    axes: Axes, place: NDArray[np.float64], direction: NDArray[np.float64], half: float, depth: float | None = None
) -> None:
    """Draw a piece of the frame of length 2 `half` at a place: a line with hatches behind it, against `direction`."""
    depth = half / 2 if depth is None else depth
    count = max(4, round(2 * half / depth))
    face, back = across(direction) * half, -direction * depth
    lines = [place - face, place + face]
    for step in np.linspace(-1.0, 1.0, count, endpoint=False):
        lines += [np.full(2, np.nan), place + step * face, place + (step + 1.6 / count) * face + back]
    axes.plot(*np.array(lines).T, color="0.35", linewidth=0.8, zorder=2)


def draw_turn(axes: Axes, centre: tuple[float, float], radius: float, positive: bool, colour: str) -> None:
    """Draw the arrow of a moment or rotation about an axis in the plane: an arc seen from the side."""
    angles = np.radians(np.linspace(30.0, 150.0, 25))
    x, y = centre[0] + radius * np.cos(angles), centre[1] + 0.5 * radius * np.sin(angles)
    if positive:
        x = x[::-1]
    axes.plot(x, y, color=colour, linewidth=1.2, zorder=4)
    arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.2, "mutation_scale": 8, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (x[-1], y[-1]), (x[-4], y[-4]), arrowprops=arrow, zorder=4)


def draw_arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], colour: str) -> None:
    """Draw a straight arrow."""
    arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.2, "mutation_scale": 8, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=arrow, zorder=4)


def quantity(value: float, units: str) -> str:
    """Return a value with its unit as text: ``100 kN/m``."""
    scale = scale_for(units, abs(value))
    number = f"{value * scale.factor:.4g}".replace("-", "\N{MINUS SIGN}")
    power, _, unit = scale.unit.partition(" ") if scale.unit.startswith("10") else ("", "", scale.unit)
    return f"{number}·{power} {unit}".strip() if power else f"{number} {unit}".strip()


def load_text(load: dict[str, Any], units: str) -> str:
    """Return what a group ``&load`` says in words: ``5 N + 15 N at 2 Hz``."""
    parts = []
    if load.get("value"):
        parts.append(quantity(load["value"], units))
    if load.get("amplitude"):
        rates = (("frequency", "Hz"), ("angular_frequency", "rad/s"), ("order", "times the speed"))
        rate = next((f" at {load[key]:g} {words}" for key, words in rates if load.get(key)), "")
        parts.append(quantity(load["amplitude"], units) + rate)
    return " + ".join(parts)
