"""The picture of a rotor to scale: shafts along their axes with nodes, disks, gears in mesh, bearings and supports.

Shafts that mesh are turned into one plane: their axes stand as far apart as they are, one below the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle

from razy.errors import ResultError
from razy.plot import style
from razy.plot.machine.symbols import (
    BLUE,
    DARK,
    FACE,
    GREEN,
    OCHRE,
    coils,
    dashpot,
    draw_arrow,
    draw_ground,
    draw_turn,
    load_text,
)
from razy.plot.options import PlotOptions
from razy.plot.units import in_words
from razy.read import ResultFile
from razy.read.description import Group, values_of

SMALL = 6.5
MOST_NUMBERS = 40
DISK = "#d9d2c3"


@dataclass
class Shaft:
    """A shaft: sections as (length, outer and inner diameters at their ends, elements), and its first node, m."""

    name: str
    sections: list[tuple[float, np.ndarray, np.ndarray, int]]
    x: float = 0.0
    y: float = 0.0

    @property
    def nodes(self) -> np.ndarray:
        """Places of the nodes along x."""
        lengths = [length / count for length, _, _, count in self.sections for _ in range(count)]
        return self.x + np.concatenate(([0.0], np.cumsum(lengths)))

    def radius_at(self, node: int) -> float:
        """Return the larger radius of the sections that meet at a node; 0 of a wheel."""
        if not self.sections:
            return 0.0
        parts = [np.linspace(*outer / 2, count + 1) for _, outer, _, count in self.sections]
        left, right = (np.concatenate([part[ends] for part in parts]) for ends in (slice(-1), slice(1, None)))
        return float(max([*right[node - 2 : node - 1], *left[node - 1 : node]]))


def draw(result: ResultFile, description: dict[str, list[Group]], figure: Figure, options: PlotOptions) -> None:
    """Draw the shafts of a machine and what is on them."""
    shafts, heights = placed_shafts(result, description)
    meshes = description.get("gear_mesh", [])
    extent = max(max(shaft.nodes[-1] for shaft in shafts.values()) - min(s.x for s in shafts.values()), 1e-9)
    style.set_size(figure, options, 17.0, 12.0)
    axes = figure.add_subplot()
    handles: dict[str, Line2D] = {}
    for shaft in shafts.values():
        _draw_shaft(axes, shaft, extent)
    for disk in description.get("disk", []):
        _draw_disk(axes, shafts, disk, meshes, extent, handles)
    for mesh in meshes:
        _draw_gears(axes, shafts, mesh, description.get("disk", []), extent, handles)
    for bearing in description.get("bearing", []):
        _draw_bearing(axes, shafts, bearing, extent, handles)
    for support in description.get("support", []):
        _draw_support(axes, shafts, support, description.get("bearing", []), extent, handles)
    for kind in ("spring", "damper"):
        for part in description.get(kind, []):
            _draw_connection(axes, shafts, part, kind, extent, handles)
    for stop in description.get("stop", []):
        _draw_stop(axes, shafts, stop, heights, extent, handles)
    for ring in description.get("ring", []):
        # Above and below, as the section of a ring is seen.
        for side in (-1.0, 1.0):
            _draw_stop(axes, shafts, {**ring, "direction": [0.0, side, 0.0]}, heights, extent, handles, "ring")
    for unbalance in description.get("unbalance", []):
        _draw_unbalance(axes, shafts, unbalance, handles, heights)
    for load in description.get("load", []):
        _draw_load(axes, shafts, load, heights, extent, handles)
    _finish(result, figure, axes, options, list(handles.values()))


def placed_shafts(
    result: ResultFile, description: dict[str, list[Group]]
) -> tuple[dict[str, Shaft], dict[tuple[str, int], float]]:
    """Return the shafts at their places, and the radius up to which something stands on a node, by shaft and node."""
    shafts = _shafts(description) if "shaft" in description else {}
    if not shafts:
        raise ResultError(f"{result.path}: there are no shafts with sections")
    heights = _heights(shafts, description)
    _place(shafts, description.get("gear_mesh", []), heights)
    return shafts, heights


def _shafts(description: dict[str, list[Group]]) -> dict[str, Shaft]:
    shafts = {}
    for group in description["shaft"]:
        name = str(group["name"])
        sections = [
            (one["length"], _ends(one, "outer_diameter"), _ends(one, "inner_diameter"), one.get("elements", 1))
            for one in description.get("section", [])
            if str(one["shaft"]).lower() == name.lower() and not one.get("first_node")
        ]
        if sections:
            shafts[name.lower()] = Shaft(name, sections)
    # A wheel has one node and no section.
    wheels = [str(group["name"]) for group in description.get("housing", []) if group.get("turns")]
    return shafts | {name.lower(): Shaft(name, []) for name in wheels} if shafts else {}


def _ends(section: Group, key: str) -> np.ndarray:
    """Return a diameter of a section at both of its ends."""
    return np.array([section.get(key, 0.0), section.get(f"{key}_end", section.get(key, 0.0))])


def _equivalent(disk: Group) -> tuple[float, float]:
    """Return radius and width of the cylinder that has the mass and the moments of inertia of a disk, m."""
    mass, polar = disk.get("mass", 0.0), disk.get("polar_inertia", 0.0)
    if mass <= 0.0:
        return 0.0, 0.0
    radius = np.sqrt(2 * polar / mass)
    return float(radius), float(np.sqrt(max(12 * (disk["diametral_inertia"] - polar / 2) / mass, 0.0)))


def _heights(shafts: dict[str, Shaft], description: dict[str, list[Group]]) -> dict[tuple[str, int], float]:
    """Return the radius up to which something stands on a node, by shaft and node."""
    heights: dict[tuple[str, int], float] = {}
    for name, shaft in shafts.items():
        for node in range(1, len(shaft.nodes) + 1):
            heights[name, node] = shaft.radius_at(node)
    for disk in description.get("disk", []):
        at = str(disk["shaft"]).lower(), disk["node"]
        heights[at] = max(heights.get(at, 0.0), _equivalent(disk)[0])
    for mesh in description.get("gear_mesh", []):
        for name, node, radius in _gears(mesh):
            heights[name, node] = radius
    return heights


def _gears(mesh: Group) -> list[tuple[str, int, float]]:
    names = [str(name).lower() for name in values_of(mesh, "between")]
    return list(zip(names, values_of(mesh, "node"), values_of(mesh, "radius"), strict=True))


def _place(shafts: dict[str, Shaft], meshes: Sequence[Group], heights: dict[tuple[str, int], float]) -> None:
    """Put each shaft where its gears mesh with those of one that has its place; others below all."""
    names = list(shafts)
    placed = names[:1]
    while len(placed) < len(names):
        for mesh in meshes:
            first, second = _gears(mesh)
            for one, other in ((first, second), (second, first)):
                if one[0] in placed and other[0] not in placed and other[0] in shafts:
                    on, moved = shafts[one[0]], shafts[other[0]]
                    offsets = values_of(mesh, "offset") or [0.0, 0.0]
                    ahead = offsets[0] - offsets[1] if one is first else offsets[1] - offsets[0]
                    moved.x = on.nodes[one[1] - 1] + ahead - moved.nodes[other[1] - 1]
                    moved.y = on.y - (one[2] + other[2])
                    placed.append(other[0])
        alone = [name for name in names if name not in placed]
        if alone and not any(
            {g[0] for g in _gears(mesh)} & set(placed) and {g[0] for g in _gears(mesh)} & set(alone) for mesh in meshes
        ):
            reach = [max(h for (n, _), h in heights.items() if n == name) for name in (placed[-1], alone[0])]
            shafts[alone[0]].y = min(shafts[name].y for name in placed) - 1.6 * sum(reach)
            placed.append(alone[0])


def _draw_shaft(axes: Axes, shaft: Shaft, extent: float) -> None:
    x = shaft.x
    for length, outer, inner, _ in shaft.sections:
        left, right = outer / 2
        corners = [(x, -left), (x + length, -right), (x + length, right), (x, left)]
        outline = Polygon(
            [(x, shaft.y + y) for x, y in corners], facecolor=FACE, edgecolor=DARK, linewidth=0.9, zorder=2
        )
        axes.add_patch(outline)
        if inner.max() > 0.0:
            for side in (-0.5, 0.5):
                axes.plot([x, x + length], shaft.y + side * inner, "--", color=DARK, linewidth=0.6, zorder=3)
        x += length
    nodes = shaft.nodes
    overhang = 0.03 * extent
    axes.plot([nodes[0] - overhang, nodes[-1] + overhang], [shaft.y] * 2, "-.", color="0.45", linewidth=0.6, zorder=5)
    axes.plot(nodes, np.full(nodes.size, shaft.y), "o", color="black", markersize=2.2, zorder=6)
    every = -(-nodes.size // MOST_NUMBERS)
    for number in range(1, nodes.size + 1, every):
        axes.annotate(
            str(number), (nodes[number - 1], shaft.y), (0, -3), textcoords="offset points", fontsize=SMALL - 0.5,
            ha="center", va="top", zorder=6,
        )  # fmt: skip
    axes.annotate(
        in_words(shaft.name), (nodes[0] - overhang, shaft.y), (-3, 0), textcoords="offset points", fontsize=8.5,
        ha="right", va="center",
    )  # fmt: skip


def _at(shafts: dict[str, Shaft], group: Group) -> tuple[Shaft, float, float] | None:
    """Return the shaft of a part, its place along x, and the radius of the shaft there; None if it names no node."""
    shaft = shafts.get(str(group.get("shaft", "")).lower())
    node = group.get("node", 0)
    if shaft is None or not 1 <= node <= shaft.nodes.size:
        return None
    offset = group.get("offset", 0.0)
    return shaft, float(shaft.nodes[node - 1]) + (offset if isinstance(offset, float) else 0.0), shaft.radius_at(node)


def _draw_disk(axes, shafts, disk: Group, meshes, extent: float, handles: dict[str, Line2D]) -> None:
    at = _at(shafts, disk)
    radius, width = _equivalent(disk)
    if at is None or radius <= 0.0:
        return
    shaft, x, _ = at
    gears = [
        r for mesh in meshes for name, node, r in _gears(mesh) if (name, node) == (shaft.name.lower(), disk["node"])
    ]
    radius = min([radius, *gears])
    width = max(width, 0.012 * extent)
    axes.add_patch(
        Rectangle(
            (x - width / 2, shaft.y - radius),
            width,
            2 * radius,
            facecolor=DISK,
            edgecolor=DARK,
            linewidth=0.9,
            zorder=3,
        )
    )
    label = "disk (cylinder of the same inertia)"
    handles.setdefault(label, _patch_handle(label, DISK))


def _draw_gears(axes, shafts, mesh: Group, disks, extent: float, handles: dict[str, Line2D]) -> None:
    gears = _gears(mesh)
    offsets = values_of(mesh, "offset") or [0.0, 0.0]
    ends = []
    for (name, node, radius), offset, teeth in zip(gears, offsets, values_of(mesh, "teeth"), strict=True):
        at = _at(shafts, {"shaft": name, "node": node, "offset": offset})
        if at is None:
            return
        shaft, x, _ = at
        widths = [_equivalent(d)[1] for d in disks if (str(d["shaft"]).lower(), d["node"]) == (name, node)]
        width = max([*widths, 0.012 * extent])
        axes.add_patch(
            Rectangle(
                (x - width / 2, shaft.y - radius),
                width,
                2 * radius,
                facecolor="none",
                edgecolor=BLUE,
                linewidth=1.2,
                zorder=4,
            )
        )
        ends.append((shaft, x, radius, width, teeth))
    upper, lower = sorted(ends, key=lambda end: -end[0].y)
    meet = upper[0].y - upper[2]
    half = max(upper[3], lower[3]) / 2 + 0.004 * extent
    line = axes.plot([upper[1] - half, upper[1] + half], [meet, meet], color=style.RED, linewidth=2.4, zorder=5)[0]
    for (shaft, x, radius, width, teeth), side in ((upper, 1), (lower, -1)):
        axes.annotate(
            f"{teeth} teeth", (x + width / 2, shaft.y + side * 0.8 * radius), (4, 0), textcoords="offset points",
            fontsize=SMALL, va="center",
        )  # fmt: skip
    handles.setdefault("gear, pitch radius", _patch_handle("gear, pitch radius", "none", BLUE))
    line.set_label("gear mesh")
    handles.setdefault("gear mesh", line)


def _draw_bearing(axes, shafts, bearing: Group, extent: float, handles: dict[str, Line2D]) -> None:
    at = _at(shafts, bearing)
    if at is None:
        return
    shaft, x, radius = at
    size = 0.026 * extent
    if str(bearing.get("kind", "rolling")) == "matrix":
        path = coils(np.array([x, shaft.y - radius]), np.array([x, shaft.y - radius - 2.4 * size]), size)
        line = axes.plot(*path.T, color=GREEN, linewidth=1.0, zorder=4, label="bearing, matrices")[0]
        draw_ground(axes, path[-1], np.array([0.0, 1.0]), size)
        handles.setdefault("bearing, matrices", line)
        return
    for side in (1.0, -1.0):
        low = shaft.y + (radius if side > 0 else -radius - size)
        axes.add_patch(
            Rectangle((x - size / 2, low), size, size, facecolor="white", edgecolor=GREEN, linewidth=1.0, zorder=4)
        )
        for corner in (1.0, -1.0):
            axes.plot(
                [x - size / 2, x + size / 2], [low + (0.5 - corner / 2) * size, low + (0.5 + corner / 2) * size],
                color=GREEN, linewidth=0.9, zorder=4,
            )  # fmt: skip
        draw_ground(axes, np.array([x, shaft.y + side * (radius + size)]), np.array([0.0, -side]), 0.9 * size)
    handles.setdefault("bearing", _patch_handle("bearing", "white", GREEN))


def _draw_connection(axes, shafts, part: Group, kind: str, extent: float, handles: dict[str, Line2D]) -> None:
    """Draw a spring or damper above its first end on a shaft, with the name of its other end."""
    ends = [str(end) for end in values_of(part, "between")]
    for end, other in (ends, ends[::-1]):
        on, _, node = end.lower().rpartition(".")
        at = _at(shafts, {"shaft": on, "node": int(node) if node.isdecimal() else 0})
        if at is None:
            continue
        shaft, x, radius = at
        size = 0.026 * extent
        draw = coils if kind == "spring" else dashpot
        path = draw(np.array([x, shaft.y + radius]), np.array([x, shaft.y + radius + 2.4 * size]), size)
        line = axes.plot(*path.T, color=BLUE if kind == "spring" else GREEN, linewidth=1.0, zorder=4, label=kind)[0]
        axes.annotate(other, path[-1], (0, 2), textcoords="offset points", fontsize=SMALL, ha="center")
        handles.setdefault(kind, line)
        return


def _draw_support(axes, shafts, support: Group, bearings, extent: float, handles: dict[str, Line2D]) -> None:
    at = _at(shafts, support)
    if at is None:
        return
    shaft, x, radius = at
    size = 0.016 * extent
    if any(str(b["shaft"]).lower() == shaft.name.lower() and b["node"] == support["node"] for b in bearings):
        x += 2.5 * size if x < shaft.nodes.mean() else -2.5 * size
    corners = np.array([[0.0, 0.0], [-size, -1.5 * size], [size, -1.5 * size], [0.0, 0.0]])
    triangle = np.add(corners, (x, shaft.y - radius))
    axes.plot(*triangle.T, color="black", linewidth=0.9, zorder=4)
    draw_ground(axes, np.array([x, shaft.y - radius - 1.5 * size]), np.array([0.0, 1.0]), 1.2 * size)
    signs = {"phi": "φ", "theta": "ϑ", "psi": "ψ"}
    held = ", ".join(signs.get(str(name), str(name)) for name in values_of(support, "held"))
    axes.annotate(
        held, (x + size, shaft.y - radius - 0.6 * size), (2, 0), textcoords="offset points", fontsize=SMALL, va="center"
    )
    handles.setdefault("held", _patch_handle("held by the frame", "none", "black", "^"))


def _draw_stop(axes, shafts, stop: Group, heights, extent: float, handles: dict[str, Line2D], name="stop") -> None:
    """Draw a stop as a face beside the first node, in the direction against which it pushes."""
    on, _, node = str(values_of(stop, "between")[0]).lower().rpartition(".")
    if not node.isdecimal() or (on, int(node)) not in heights:
        return
    shaft, radius = shafts[on], heights[on, int(node)]
    direction = [*values_of(stop, "direction"), 0.0, 0.0, 0.0]
    side = 1.0 if direction[1] < 0.0 or direction[2] < 0.0 else -1.0
    x, y = float(shaft.nodes[int(node) - 1]), shaft.y + side * (radius + 0.012 * extent)
    line = axes.plot([x - 0.02 * extent, x + 0.02 * extent], [y, y], color=style.RED, linewidth=2.2, zorder=4)[0]
    draw_ground(axes, np.array([x, y + side * 0.006 * extent]), np.array([0.0, -side]), 0.02 * extent)
    line.set_label(name)
    handles.setdefault(name, line)


def _draw_unbalance(axes, shafts, unbalance: Group, handles: dict[str, Line2D], heights) -> None:
    at = _at(shafts, unbalance)
    if at is None:
        return
    shaft, x, _ = at
    y = shaft.y + 0.8 * heights[shaft.name.lower(), unbalance["node"]]
    line = axes.plot([x], [y], "o", color=style.RED, markersize=5, zorder=6, label="unbalance")[0]
    handles.setdefault("unbalance", line)


def _draw_load(axes, shafts, load: Group, heights, extent: float, handles: dict[str, Line2D]) -> None:
    parts = str(load.get("on", "")).lower().rsplit(".", 2)
    if len(parts) != 3 or not parts[1].isdecimal() or (parts[0], int(parts[1])) not in heights:
        return
    shaft, node = shafts[parts[0]], int(parts[1])
    turning = parts[2] in ("phi", "theta", "psi")
    text = load_text(load, "N m" if turning else "N")
    if not text:
        return
    value = load.get("value") or load.get("amplitude")
    x = float(shaft.nodes[node - 1])
    below = shaft.y < -1e-12
    side = -1.0 if below else 1.0
    y = shaft.y + side * (heights[parts[0], node] + 0.02 * extent)
    if turning:
        draw_turn(axes, (x, y - (0.02 * extent if below else 0.0)), 0.03 * extent, value > 0, OCHRE)
    else:
        along = {"u": (0.05 * extent, 0.0), "v": (0.0, 0.05 * extent)}.get(parts[2], (0.03 * extent, 0.03 * extent))
        sign = 1.0 if value > 0 else -1.0
        draw_arrow(axes, (x, y), (x + sign * along[0], y + sign * along[1]), OCHRE)
    axes.annotate(
        text, (x, y + side * 0.018 * extent), (0, 3 * side), textcoords="offset points", fontsize=SMALL + 0.5,
        ha="center", va="top" if below else "bottom",
    )  # fmt: skip
    handles.setdefault("load", Line2D([], [], color=OCHRE, linewidth=1.2, label="load"))


def _patch_handle(label: str, face: str, edge: str = DARK, marker: str = "s") -> Line2D:
    return Line2D(
        [], [], linestyle="none", marker=marker, markersize=7, markerfacecolor=face, markeredgecolor=edge, label=label
    )


def _finish(result: ResultFile, figure: Figure, axes: Axes, options: PlotOptions, handles: list[Line2D]) -> None:
    axes.set_aspect("equal")
    axes.autoscale_view()
    x, y = axes.get_xlim(), axes.get_ylim()
    x = x[0] - 0.12 * (x[1] - x[0]), x[1] + 0.02 * (x[1] - x[0])
    y = y[0] - 0.05 * (y[1] - y[0]), y[1] + 0.05 * (y[1] - y[0])
    axes.set_xlim(x)
    axes.set_ylim(y)
    width = 17.0
    style.set_size(figure, options, width, min(max((y[1] - y[0]) / (x[1] - x[0]) * (width - 2.0) + 3.2, 5.0), 24.0))
    axes.set_xlabel("x (m)")
    axes.set_ylabel("distance from the first axis (m)")
    style.set_axis(axes.xaxis, *x, space_cm=width - 2.0)
    style.set_axis(axes.yaxis, *y)
    style.set_footer(figure, result, options)
    style.set_heading(figure, (axes, axes), style.title_of(result, options), handles)
