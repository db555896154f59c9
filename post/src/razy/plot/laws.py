"""The laws of an input: stops, rings, meshes and springs over displacement, friction and dampers over velocity.

Forces are those without damping; what they are of varying meshes is the mean.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from razy.errors import ResultError
from razy.plot import style
from razy.plot.options import PlotOptions
from razy.plot.units import LABEL_WIDTH, axis_label, in_words, scale_for
from razy.read import Quantity, ResultFile
from razy.read.description import Group, read_description, values_of
from razy.read.file import choose

Array = NDArray[np.float64]
MOST_PANELS, POINTS = 8, 801
# Beyond the last corner of a law, this part of what is drawn of it.
MARGIN = 0.25


@dataclass(frozen=True)
class Law:
    """A law: name, what it is over, units of both, what is drawn of it, force as a function or as a path itself.

    A path may go up, as where a rigid stop holds with any force, without a unit, and back, as where a slider gives way.
    """

    name: str
    over: Quantity
    unit: str
    low: float
    high: float
    force: Callable[[Array], Array] | None = None
    path: tuple[Array, Array] | None = None

    def points(self, low: float, high: float) -> tuple[Array, Array]:
        """Return displacements and forces of the line that is drawn between two displacements."""
        if self.path is not None:
            return self.path
        x = np.linspace(low, high, POINTS)
        return x, np.asarray(self.force(x) if self.force is not None else 0.0 * x)


def draw(result: ResultFile, figure: Figure, options: PlotOptions) -> None:
    """Draw a panel for each law, or for those that are named as coordinates."""
    found = {law.name: law for law in laws_of(read_description(result))}
    if not found:
        raise ResultError(f"{result.path}: the input has no stop, ring, mesh, friction, or curved spring or damper")
    for name in options.coordinates:
        choose(name, tuple(found), "contact", result.path)
    chosen = [found[name] for name in options.coordinates or list(found)[:MOST_PANELS]]
    across = min(len(chosen), 2)
    down = -(-len(chosen) // across)
    style.set_size(figure, options, 10.0 if across == 1 else 16.0, 1.5 + 6.5 * down)
    style.set_footer(figure, result, options)
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for axes in grid[len(chosen) :]:
        axes.remove()
    for axes, law in zip(grid, chosen, strict=False):
        _panel(axes, law, options)
    style.set_heading(figure, (grid[0], grid[across - 1]), style.title_of(result, options), [])


def _panel(axes: Axes, law: Law, options: PlotOptions) -> None:
    low = law.low if options.start is None else options.start
    high = law.high if options.stop is None else options.stop
    if not low < high:
        raise ResultError(f"{law.name}: nothing {options.range_text()}")
    x, force = law.points(low, high)
    x_scale = scale_for(law.over.units, max(abs(low), abs(high)))
    force_scale = scale_for(law.unit, float(np.abs(force[np.isfinite(force)]).max(initial=0.0)))
    axes.axhline(0.0, color="0.8", linewidth=0.6)
    axes.axvline(0.0, color="0.8", linewidth=0.6)
    axes.plot(x * x_scale.factor, force * force_scale.factor, color="black")
    axes.set_xlim(low * x_scale.factor, high * x_scale.factor)
    axes.set_xlabel(axis_label(law.over, x_scale))
    what = "coefficient of" if law.unit == "1" else "force of"
    axes.set_ylabel(axis_label(Quantity("force", law.unit, f"{what} {in_words(law.name)}"), force_scale, LABEL_WIDTH))
    if not law.unit:
        axes.set_yticks([0.0])


def laws_of(description: dict[str, list[Group]]) -> list[Law]:
    """Return the laws of an effective input, in the order of its groups."""
    turning = {str(group.get("name")) for group in description.get("inertia", [])}
    laws = []
    for kind in ("stop", "ring", "gear_mesh", "spring", "damper", "friction"):
        for number, group in enumerate(description.get(kind, []), start=1):
            name = str(group.get("name") or f"{kind} {number}")
            ends = set(map(str, values_of(group, "between")))
            turns = bool(ends & turning) and kind != "gear_mesh"
            units = ("rad", "N m") if turns else ("m", "N")
            if kind == "friction":
                laws.append(_friction(name, group, units))
            elif kind == "gear_mesh":
                laws.append(_mesh(name, group))
            elif kind == "spring":
                laws += _spring(name, group, units)
            elif kind == "damper":
                laws += _damper(name, group, units)
            else:
                laws.append(_gap(name, group, units, kind))
    return laws


def _friction(name: str, group: Group, units: tuple[str, str]) -> Law:
    """Coefficient of friction over the velocity, as a force where its normal force is constant alone."""
    static = float(group["static_coefficient"])
    kinetic = float(group.get("kinetic_coefficient", static))
    decay, viscous = float(group.get("decay") or 0.0), float(group.get("viscous_coefficient") or 0.0)
    constant = "normal_load" in group and "normal_contact" not in group
    normal = float(group["normal_load"]) if constant else 1.0
    high = 4.0 / decay if decay > 0.0 else 1.0
    v = np.linspace(0.0, high, POINTS)
    falls = np.exp(-decay * v) if group.get("decay_law") == "exponential" else 1.0 / (1.0 + decay * v)
    slides = normal * (kinetic + viscous * v + (static - kinetic) * falls * (decay > 0.0))
    sticks = normal * np.array([-static, static])
    path = np.concatenate((-v[::-1], [0.0, 0.0], v)), np.concatenate((-slides[::-1], sticks, slides))
    over = Quantity("velocity", f"{units[0]}/s", "velocity of sliding")
    return Law(name, over, units[1] if constant else "1", -high, high, path=path)


def _mesh(name: str, group: Group) -> Law:
    stiffness, backlash = float(group["stiffness"]), float(group.get("backlash") or 0.0)
    back, slope = float(group.get("back_stiffness") or stiffness), float(group.get("slope_in_backlash") or 0.0)

    def force(d: Array) -> Array:
        behind = back * (d + backlash) - slope * stiffness * backlash
        return np.where(d > 0.0, stiffness * d, np.where(d < -backlash, behind, slope * stiffness * d))

    size = backlash or 1.0
    over = Quantity("deformation", "m", "mesh deformation")
    return Law(name, over, "N", -backlash - 0.5 * size, 0.5 * size, force)


def _spring(name: str, group: Group, units: tuple[str, str]) -> list[Law]:
    over = Quantity("displacement", units[0], "displacement")
    law = group.get("law", "linear")
    if law == "table":
        return [_table(name, group, over, units[1])]
    if law == "polynomial":
        factor = np.array([0.0, *values_of(group, "coefficients")], dtype=float)
        powers = np.flatnonzero(factor)
        size = 1.0
        if powers.size > 1:
            size = abs(factor[powers[0]] / factor[powers[-1]]) ** (1.0 / (powers[-1] - powers[0]))
        return [Law(name, over, units[1], -1.5 * size, 1.5 * size, lambda s: np.polyval(factor[::-1], s))]
    if law == "jenkins":
        limit, edge = float(group["slip_force"]), float(group["slip_force"]) / float(group["stiffness"])
        path = edge * np.array([0.0, 1.0, 3.0, 1.0, -3.0, -1.0, 3.0]), limit * np.array([0, 1, 1, -1, -1, 1, 1.0])
        return [Law(name, over, units[1], -3.5 * edge, 3.5 * edge, path=path)]
    return []


def _damper(name: str, group: Group, units: tuple[str, str]) -> list[Law]:
    over = Quantity("velocity", f"{units[0]}/s", "velocity")
    return [_table(name, group, over, units[1])] if "velocity" in group else []


def _table(name: str, group: Group, over: Quantity, unit: str) -> Law:
    place, force = (np.array(values_of(group, key), dtype=float) for key in (over.name, "force"))
    more = MARGIN * (place[-1] - place[0]) * (group.get("beyond") != "refuse")
    return Law(name, over, unit, place[0] - more, place[-1] + more, lambda s: _through(place, force, s))


def _through(place: Array, force: Array, at: Array) -> Array:
    """Return the lines through points of a table, of which the first and the last go on."""
    line = np.clip(np.searchsorted(place, at, side="right") - 1, 0, place.size - 2)
    slope = np.diff(force) / np.diff(place)
    return np.asarray(force[line] + slope[line] * (at - place[line]))


def _gap(name: str, group: Group, units: tuple[str, str], kind: str) -> Law:
    """Force of a stop or ring over the displacement; on the lower side alone it counts as results have it."""
    clearance, law = float(group["clearance"]), str(group.get("law", "kelvin_voigt"))
    lower = kind == "stop" and group.get("side") in ("lower", "both")
    upper = not lower or group.get("side") == "both"
    size = float(values_of(group, "displacement")[-1]) if law == "table" else abs(clearance) or 1.0
    shut, open_end = max(clearance, 0.0) + size, min(clearance, 0.0) - size
    ends = -shut if lower else open_end, shut if upper else -open_end
    over = Quantity("displacement", units[0], "displacement" if kind == "stop" else "distance from the centre")
    sign = -1.0 if upper else 1.0
    if law == "rigid":
        # The line goes up where the stop is, as far as it likes.
        left = [(-clearance, sign), (-clearance, 0.0)] if lower else [(ends[0], 0.0)]
        right = [(clearance, 0.0), (clearance, 1.0)] if upper else [(ends[1], 0.0)]
        x, force = np.array(left + right).T
        return Law(name, over, "", *ends, path=(x, force))
    pressed = _pressed(group, law)

    def force_at(s: Array) -> Array:
        return upper * pressed(s, clearance) + lower * sign * pressed(-s, clearance)

    return Law(name, over, units[1], 0.0 if kind == "ring" else ends[0], ends[1], force_at)


def _pressed(group: Group, law: str) -> Callable[[Array, float], Array]:
    """Return the force of a closed side at s, which closes at an edge; 0 before."""
    if law == "table":
        place, table = (np.array(values_of(group, key), dtype=float) for key in ("displacement", "force"))
        return lambda s, edge: np.where(s > edge, _through(place, table, s - edge), 0.0)
    if law == "switched_spring":
        return lambda s, edge: np.where(s > edge, float(group["stiffness"]) * s, 0.0)
    exponent = {"hertz": 1.5, "hunt_crossley": float(group.get("exponent") or 1.5)}.get(law, 1.0)
    stiffness = float(group.get("stiffness") or 0.0) or _hertz(group)
    return lambda s, edge: stiffness * np.maximum(s - edge, 0.0) ** exponent


def _hertz(group: Group) -> float:
    """Stiffness of two spheres, one of which may be flat, N/m^1.5."""
    radius = values_of(group, "radius")
    modulus, ratio = (2 * values_of(group, key) for key in ("young_modulus", "poisson_ratio"))
    soft = sum((1 - nu**2) / e for e, nu in zip(modulus[:2], ratio[:2], strict=True))
    return float(4 / 3 / soft / np.sqrt(sum(1 / r for r in radius)))
