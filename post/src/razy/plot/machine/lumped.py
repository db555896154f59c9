"""The scheme of a lumped machine: bodies on a line in the order of the input, what acts between them, and the frame.

All lengths are in cm of the picture. Gear meshes join lines of bodies, one below the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

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
    quantity,
)
from razy.plot.options import PlotOptions
from razy.plot.units import in_words
from razy.read import ResultFile
from razy.read.description import Group, values_of

# Half a body, the room between bodies, the visible gap of a stop, the radius of the largest wheel.
HALF = {"mass": 0.8, "inertia": 0.22}
ROOM, GAP, RADIUS = 3.4, 0.35, 1.25
SYMBOL, HATCH, LINE = 0.36, 0.18, 0.27
SMALL = 7.0
FRAME = "frame"


@dataclass
class Body:
    """A mass or inertia: its group, half width and height, place, and the lanes on its left and right."""

    group: Group
    kind: str
    half: float
    height: float
    x: float = 0.0
    y: float = 0.0

    @property
    def name(self) -> str:
        """Name in the input."""
        return str(self.group.get("name", ""))


@dataclass
class Link:
    """What acts between two bodies, or, with one of them None, between a body and the frame."""

    kind: str
    text: str
    first: str | None
    second: str | None
    side: str = ""
    rigid: bool = False


def draw(result: ResultFile, description: dict[str, list[Group]], figure: Figure, options: PlotOptions) -> None:
    """Draw the scheme of a machine."""
    bodies = _bodies(description)
    links = _links(description, {body.name.lower(): body for body in bodies})
    lines = _lines(bodies, links)
    lane = 0.75 + LINE * max((link.text.count("\n") + 1 for link in links), default=1)
    meshes = description.get("gear_mesh", [])
    _grow(lines, links, meshes, lane)
    _place(lines, meshes)
    lanes = _lanes(lines, links, lane)
    axes = figure.add_subplot()
    for drawn in lanes:
        _draw_lane(axes, *drawn, lane)
    for body in bodies:
        _draw_body(axes, body, bodies, description)
    for mesh in description.get("gear_mesh", []):
        _draw_mesh(axes, bodies, mesh)
    for friction in _frictions_on_frame(description):
        _draw_friction(axes, bodies, friction)
    for link in _far(lines, links):
        _draw_far(axes, bodies, link)
    if "mass" in description:
        low = min(body.y - body.height / 2 for body in bodies) - (1.2 if description.get("friction") else 0.5)
        draw_arrow(axes, (bodies[0].x - 0.6, low), (bodies[0].x + 0.6, low), DARK)
        axes.text(
            bodies[0].x, low - 0.08, "positive displacement", fontsize=SMALL - 0.5, ha="center", va="top", color=DARK
        )
    _fit(result, figure, axes, options)


def _bodies(description: dict[str, list[Group]]) -> list[Body]:
    return [
        Body(group, kind, HALF[kind], {"mass": 1.3, "inertia": 1.9}[kind])
        for kind in ("inertia", "mass")
        for group in description.get(kind, [])
    ]


def _links(description: dict[str, list[Group]], bodies: dict[str, Body]) -> list[Link]:
    """Return all elements but gear meshes and the friction of a body on the frame."""
    links = []
    for kind in ("spring", "damper", "stop", "friction"):
        for group in description.get(kind, []):
            ends = [str(name).lower() for name in values_of(group, "between")]
            if len(ends) != 2 or any(end != FRAME and end not in bodies for end in ends):
                raise ResultError(f"&{kind} between {ends}: no such bodies")
            first, second = (None if end == FRAME else end for end in ends)
            turns = bodies[first or second].kind == "inertia"
            name = in_words(str(group.get("name", "")))
            if kind == "friction":
                if first and second:
                    links.append(Link(kind, _friction_text(group), first, second))
                continue
            for part, text in _parts(kind, group, turns):
                text = f"{name}: {text}" if name and kind != "spring" else text
                side = str(group.get("side", "upper")).strip()
                for one in ("lower", "upper") if side == "both" and None in (first, second) else (side,):
                    links.append(Link(part, text, first, second, one, group.get("law") == "rigid"))
    return links


def _parts(kind: str, group: Group, turns: bool) -> list[tuple[str, str]]:
    """Return what is drawn of a group: kinds of symbol and their texts."""
    stiffness, damping = ("N m/rad", "N m s/rad") if turns else ("N/m", "N s/m")
    if kind == "damper":
        return [("damper", quantity(group["damping"], damping) if "damping" in group else "table")]
    if kind == "spring":
        law = str(group.get("law", "linear"))
        text = quantity(group["stiffness"], stiffness) if "stiffness" in group else law
        parts = [("spring", f"Jenkins, {text}" if law == "jenkins" else text)]
        if group.get("damping"):
            parts.append(("damper", quantity(group["damping"], damping)))
        if group.get("damping_factor"):
            parts.append(("damper", f"{quantity(group['damping_factor'], 's')} times stiffness"))
        return parts
    clearance = group["clearance"]
    size = quantity(abs(clearance), "rad" if turns else "m") if clearance else "0"
    texts = [f"{'preload' if clearance < 0 else 'clearance'} {size}"]
    law = str(group.get("law", ""))
    if law == "rigid":
        texts.append(f"rigid, restitution {group.get('restitution', 0.0):g}")
    elif law == "hertz" and group.get("stiffness"):
        texts.append(f"Hertz, {quantity(group['stiffness'], 'N/m^1.5')}")
    elif law == "hunt_crossley" and group.get("stiffness"):
        texts.append(f"Hunt-Crossley, {quantity(group['stiffness'], 'N/m^' + format(group.get('exponent', 1.5), 'g'))}")
    elif group.get("stiffness"):
        texts.append(quantity(group["stiffness"], stiffness))
        if group.get("damping"):
            texts[-1] += f", {quantity(group['damping'], damping)}"
    if group.get("motion_amplitude"):
        texts.append(f"moved by {quantity(group['motion_amplitude'], 'm')}")
    return [("stop", "\n".join(texts))]


def _lines(bodies: list[Body], links: list[Link]) -> list[list[Body]]:
    """Return the bodies that elements join, in the order of the input, as lines."""
    known = {body.name.lower(): number for number, body in enumerate(bodies)}
    group = list(range(len(bodies)))
    for link in links:
        if link.first and link.second:
            one, two = group[known[link.first]], group[known[link.second]]
            group = [one if number == two else number for number in group]
    return [[b for b, g in zip(bodies, group, strict=True) if g == number] for number in dict.fromkeys(group)]


def _place(lines: list[list[Body]], meshes: Sequence[Group]) -> None:
    """Give bodies their places: a line to the right, below it the lines that its gears drive."""
    for line in lines:
        x = 0.0
        for body in line:
            body.x = x + body.half
            x = body.x + body.half + ROOM
    placed, waiting = [lines[0]], lines[1:]
    while waiting:
        found = _driven(placed, waiting, meshes)
        line = found[0] if found else waiting[0]
        if found:
            _, wheel, pinion = found
            shift, y = pinion.x - wheel.x, pinion.y - (pinion.height + wheel.height) / 2
        else:
            shift, y = 0.0, min(b.y - b.height / 2 for one in placed for b in one) - 2.6
        for body in line:
            body.x, body.y = body.x + shift, y
        placed.append(line)
        waiting = [one for one in waiting if one is not line]


def _driven(placed: list[list[Body]], waiting: list[list[Body]], meshes: Sequence[Group]):
    """Return a line with a wheel that meshes with one that has its place, the wheel and that one; None without any."""
    known = {body.name.lower(): body for line in placed for body in line}
    for mesh in meshes:
        names = [str(name).lower() for name in values_of(mesh, "between")]
        for one, other in (names, names[::-1]):
            for line in waiting:
                for body in line:
                    if body.name.lower() == other and one in known:
                        return line, body, known[one]
    return None


def _near(line: list[Body], link: Link) -> tuple[int, int] | None:
    """Return the places in a line of the ends of an element, in ascending order; -1 is the frame; None if not in it."""
    names = [body.name.lower() for body in line]
    ends = [names.index(end) for end in (link.first, link.second) if end in names]
    if not ends:
        return None
    if None in (link.first, link.second):
        return -1, ends[0]
    return (min(ends), max(ends)) if len(ends) == 2 else None


def _far(lines: list[list[Body]], links: list[Link]) -> list[Link]:
    """Return the elements that pass over bodies."""
    return [
        link
        for line in lines
        for link in links
        for at in [_near(line, link)]
        if at and at[0] >= 0 and at[1] > at[0] + 1
    ]


def _rooms(line: list[Body], links: list[Link]) -> dict[int, list[tuple[Link, int]]]:
    """Return what stands beside the bodies of a line: in each room elements, and the body of one to the frame or -1.

    Rooms are numbered by the body on their right; an element to the frame is on the side where it closes.
    """
    rooms: dict[int, list[tuple[Link, int]]] = {}
    for link in links:
        at = _near(line, link)
        if at is None or (at[0] >= 0 and at[1] > at[0] + 1):
            continue
        room = at[1] if at[0] >= 0 else at[1] + _right_of(at[1], len(line), link)
        rooms.setdefault(room, []).append((link, -1 if at[0] >= 0 else at[1]))
    return rooms


def _grow(lines: list[list[Body]], links: list[Link], meshes: Sequence[Group], lane: float) -> None:
    """Give bodies the height that the elements beside them need; wheels that of their radii, to one scale."""
    for line in lines:
        for room, found in _rooms(line, links).items():
            for body in (line[number] for number in (room - 1, room) if 0 <= number < len(line)):
                body.height = max(body.height, (len(found) - 1) * lane + 1.0)
    known = {body.name.lower(): body for line in lines for body in line}
    wheels = [
        (known[str(name).lower()], radius)
        for mesh in meshes
        for name, radius in zip(values_of(mesh, "between"), values_of(mesh, "radius"), strict=True)
    ]
    largest = max((radius for _, radius in wheels), default=1.0)
    for body, _ in wheels:
        body.height = max(body.height - 0.9, 0.9)
    scale = max((body.height * largest / radius for body, radius in wheels), default=0.0)
    for body, radius in wheels:
        body.height = min(max(scale, 2 * RADIUS), 7.0) * radius / largest


def _lanes(
    lines: list[list[Body]], links: list[Link], lane: float
) -> list[tuple[Link, float, float, float, bool, bool]]:
    """Return for each element its ends from left to right, its height, and whether each end is the frame's.

    Elements of a room stand one below the other, `lane` apart.
    """
    lanes = []
    for line in lines:
        for room, found in _rooms(line, links).items():
            for place, (link, owner) in enumerate(found):
                y = line[0].y + ((len(found) - 1) / 2 - place) * lane
                if owner < 0:
                    left, right = line[room - 1], line[room]
                    lanes.append((link, left.x + left.half, right.x - right.half, y, False, False))
                    continue
                length = ROOM / 2 if 0 < room < len(line) else ROOM
                body = line[owner]
                if owner == room:
                    lanes.append((link, body.x - body.half - length, body.x - body.half, y, True, False))
                else:
                    lanes.append((link, body.x + body.half, body.x + body.half + length, y, False, True))
    return lanes


def _right_of(place: int, count: int, link: Link) -> int:
    """Return 1 if an element between a body and the frame stands on the right of the body, else 0."""
    if link.kind == "stop":
        upper = link.side == "upper"
        return int(upper if link.first else not upper)
    return int(place == count - 1 and count > 1)


def _draw_lane(
    axes: Axes, link: Link, left: float, right: float, y: float, wall_left: bool, wall_right: bool, lane: float
) -> None:
    first, second = np.array([left, y]), np.array([right, y])
    if wall_left:
        draw_ground(axes, first, np.array([1.0, 0.0]), lane / 2, HATCH)
    if wall_right:
        draw_ground(axes, second, np.array([-1.0, 0.0]), lane / 2, HATCH)
    text_at = (left + right) / 2
    if right - left < 0.6 * ROOM:
        text_at = left if wall_left else right
    if link.kind == "spring":
        axes.plot(*coils(first, second, SYMBOL).T, color=BLUE, linewidth=1.1, zorder=3)
    elif link.kind == "damper":
        axes.plot(*dashpot(first, second, SYMBOL).T, color=GREEN, linewidth=1.1, zorder=3)
    elif link.kind == "friction":
        middle = (left + right) / 2
        axes.plot([left, middle + 0.5], [y + 0.04, y + 0.04], color=OCHRE, linewidth=1.6, zorder=3)
        axes.plot([middle - 0.5, right], [y - 0.04, y - 0.04], color=OCHRE, linewidth=1.6, zorder=3)
    else:
        _draw_stop(axes, link, first, second, wall_left)
    white = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
    axes.text(
        text_at, y + 0.26, link.text, fontsize=SMALL, ha="center", va="bottom", linespacing=1.05, zorder=5, bbox=white
    )


def _draw_stop(axes: Axes, link: Link, first: np.ndarray, second: np.ndarray, wall_left: bool) -> None:
    """Draw a stop: from the frame or the second body a spring with a face, which a gap parts from the body."""
    base, body = (first, second) if wall_left else (second, first)
    face = body + np.sign(base - body) * np.array([GAP, 0.0])
    ends = np.array([np.subtract(face, (0.0, 0.3)), np.add(face, (0.0, 0.3))])
    axes.plot(*ends.T, color=style.RED, linewidth=2.2, zorder=4)
    if link.rigid:
        axes.plot(*np.array([face, base]).T, color=style.RED, linewidth=2.2, zorder=3)
    else:
        axes.plot(*coils(face, base, SYMBOL).T, color=style.RED, linewidth=1.1, zorder=3)


def _draw_body(axes: Axes, body: Body, bodies: list[Body], description: dict[str, list[Group]]) -> None:
    corner = (body.x - body.half, body.y - body.height / 2)
    axes.add_patch(
        Rectangle(corner, 2 * body.half, body.height, facecolor=FACE, edgecolor=DARK, linewidth=1.0, zorder=2)
    )
    turns = body.kind == "inertia"
    text = f"{in_words(body.name)}\n{quantity(body.group['value'], 'kg m^2' if turns else 'kg')}"
    rotation = next(iter(description.get("rotation", [])), {})
    top = body.y + body.height / 2
    loads = [load for load in description.get("load", []) if str(load.get("on", "")).lower() == body.name.lower()]
    loads = [load for load in loads if load.get("value") or load.get("amplitude")]
    below = turns and _is_lower_wheel(body, bodies, description)
    if turns:
        if str(rotation.get("of", "")).lower() == body.name.lower():
            text += f"\n{rotation['speed_rpm']:g} rpm"
        y, va = (corner[1] - 0.1, "top") if below else (top + 0.1, "bottom")
        axes.text(body.x, y, text, fontsize=SMALL, ha="center", va=va, linespacing=1.05, zorder=5)
    else:
        axes.text(body.x, body.y, text, fontsize=SMALL + 0.5, ha="center", va="center", zorder=5)
    if not loads:
        return
    words = " + ".join(load_text(load, "N m" if turns else "N") for load in loads)
    positive = loads[0].get("value") or loads[0].get("amplitude")
    if turns:
        y = corner[1] - 0.55 if not below else top + 0.1
        draw_turn(axes, (body.x, y), 0.55, positive > 0, OCHRE)
        axes.text(
            body.x,
            y - 0.05 if not below else y + 0.4,
            words,
            fontsize=SMALL,
            ha="center",
            va="top" if not below else "bottom",
        )
        return
    reach = 0.6 if positive > 0 else -0.6
    draw_arrow(axes, (body.x - reach, top + 0.2), (body.x + reach, top + 0.2), OCHRE)
    axes.text(body.x, top + 0.3, words, fontsize=SMALL, ha="center", va="bottom", zorder=5)


def _is_lower_wheel(body: Body, bodies: list[Body], description: dict[str, list[Group]]) -> bool:
    """Return whether a body is a wheel that meshes with one above it."""
    height = {one.name.lower(): one.y for one in bodies}
    for mesh in description.get("gear_mesh", []):
        names = [str(name).lower() for name in values_of(mesh, "between")]
        if body.name.lower() in names and any(height[name] > body.y for name in names):
            return True
    return False


def _draw_mesh(axes: Axes, bodies: list[Body], mesh: Group) -> None:
    """Draw where two wheels touch, and what the mesh is."""
    first, second = (
        next(body for body in bodies if body.name.lower() == str(name).lower()) for name in values_of(mesh, "between")
    )
    upper, lower = (first, second) if first.y >= second.y else (second, first)
    y = upper.y - upper.height / 2
    x = (upper.x + lower.x) / 2
    axes.plot([x - 0.34, x + 0.34], [y, y], color=style.RED, linewidth=2.2, zorder=4)
    teeth = "/".join(str(number) for number in values_of(mesh, "teeth"))
    texts = [f"{in_words(str(mesh.get('name', 'mesh')))}: {teeth} teeth", quantity(mesh["stiffness"], "N/m")]
    if mesh.get("damping"):
        texts.append(quantity(mesh["damping"], "N s/m"))
    texts.append(f"backlash {quantity(mesh.get('backlash', 0.0), 'm')}")
    side = -1 if any(b.x > x + 1 and b.y == lower.y for b in bodies) else 1
    axes.text(x + 0.5 * side, y - 0.12, "\n".join(texts), fontsize=SMALL, va="top", ha="right" if side < 0 else "left")


def _frictions_on_frame(description: dict[str, list[Group]]) -> list[Group]:
    return [
        group
        for group in description.get("friction", [])
        if FRAME in [str(name).lower() for name in values_of(group, "between")]
    ]


def _friction_text(group: Group) -> str:
    parts = [f"friction {group['static_coefficient']:g}"]
    kinetic = group.get("kinetic_coefficient")
    if kinetic is not None and kinetic != group["static_coefficient"]:
        parts[0] += f" falling to {kinetic:g}" if group.get("decay") else f", {kinetic:g} while sliding"
    if group.get("normal_load"):
        parts.append(f"pressed by {quantity(group['normal_load'], 'N')}")
    if group.get("normal_contact"):
        parts.append(f"pressed by {in_words(str(group['normal_contact']))}")
    if group.get("only_with"):
        parts.append(f"only with {in_words(str(group['only_with']))}")
    return ", ".join(parts)


def _draw_friction(axes: Axes, bodies: list[Body], group: Group) -> None:
    """Draw the surface of the frame, or the belt, under a body."""
    names = [str(name).lower() for name in values_of(group, "between")]
    body = next(body for body in bodies if body.name.lower() in names)
    y = body.y - body.height / 2 - 0.05
    reach = body.half + 0.5
    text = _friction_text(group)
    if group.get("belt_speed"):
        text += f"\nbelt: {quantity(group['belt_speed'], 'm/s' if body.kind == 'mass' else 'rad/s')}"
        axes.plot([body.x - reach, body.x + reach], [y, y], color=OCHRE, linewidth=1.6, zorder=3)
        ahead = 0.5 if group["belt_speed"] > 0 else -0.5
        draw_arrow(axes, (body.x - ahead, y - 0.18), (body.x + ahead, y - 0.18), OCHRE)
    else:
        axes.plot([body.x - body.half, body.x + body.half], [y, y], color=OCHRE, linewidth=1.6, zorder=3)
        draw_ground(axes, np.array([body.x, y - 0.03]), np.array([0.0, 1.0]), reach, HATCH)
    axes.text(body.x, y - 0.32, text, fontsize=SMALL, ha="center", va="top", linespacing=1.05)


def _draw_far(axes: Axes, bodies: list[Body], link: Link) -> None:
    """Draw an element between bodies that others stand between, above these."""
    first, second = sorted(
        (body for body in bodies if body.name.lower() in (link.first, link.second)), key=lambda body: body.x
    )
    y = max(b.y + b.height / 2 for b in bodies if first.x <= b.x <= second.x) + 1.4
    ends = [first.x + first.half / 2, second.x - second.half / 2]
    for body, x in zip((first, second), ends, strict=True):
        axes.plot([x, x], [body.y + body.height / 2, y], color=DARK, linewidth=0.9, zorder=1)
    _draw_lane(axes, link, *ends, y, False, False, 1.0)


def _fit(result: ResultFile, figure: Figure, axes: Axes, options: PlotOptions) -> None:
    """Give the figure the size of what was drawn, so that a unit of the axes is 1 cm; a wide one is scaled down."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    figure.set_size_inches(16 * style.CM, 12 * style.CM)
    axes.autoscale_view()
    x, y = axes.get_xlim(), axes.get_ylim()
    texts = [
        (text.get_position(), text.get_text(), text.get_ha(), text.get_va()) for text in axes.texts if text.get_text()
    ]
    for (at_x, at_y), text, ha, va in texts:
        width = 0.13 * max(len(line) for line in text.splitlines())
        height = 0.32 * len(text.splitlines())
        left = {"center": at_x - width / 2, "left": at_x, "right": at_x - width}[ha]
        bottom = {"center": at_y - height / 2, "bottom": at_y, "top": at_y - height}[va]
        x = min(x[0], left), max(x[1], left + width)
        y = min(y[0], bottom), max(y[1], bottom + height)
    axes.set_xlim(x[0] - 0.1, x[1] + 0.1)
    axes.set_ylim(y[0] - 0.1, y[1] + 0.1)
    style.set_size(figure, options, max(x[1] - x[0], 5.0) + 0.6, y[1] - y[0] + 1.2)
    style.set_footer(figure, result, options)
    style.set_heading(figure, (axes, axes), style.title_of(result, options), [])
