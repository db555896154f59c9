"""Where the parts of a machine act: rows w of the coordinates that give the displacement between their ends."""

import math
from fractions import Fraction
from typing import Any

Groups = dict[str, list[dict[str, Any]]]
Row = list[Fraction]
Vector = tuple[Fraction, Fraction]


class Places:
    """Bodies that turn, on lines and in a plane, and what acts between them or their points.

    Each coordinate shifts its body in a direction or turns it. Directions are the doubles next to vectors of length 1.
    """

    def __init__(self, groups: Groups):
        """Take bodies, in the order of the results, and points."""
        zero = Fraction(0), Fraction(0)
        self.names: list[str] = []
        self.mass: list[Fraction] = []
        # Of each coordinate: the body it moves and the direction; none where it turns that.
        self.moves: list[tuple[int, Vector | None]] = []
        # Number of the body (none: the frame), place from its centre, place; of 'frame' itself there is no place.
        self.points: dict[str, tuple[int | None, Vector, Vector | None]] = {"frame": (None, zero, None)}
        self.kinds: dict[int | None, str] = {}
        one = Fraction(1)
        for kind in ("inertia", "mass", "body"):
            for group in groups.get(kind, []):
                name, body = group["name"].lower(), len(self.kinds)
                self.kinds[body] = kind
                self.points[name] = body, zero, _pair(group.get("centre", [0.0, 0.0]))
                if kind == "inertia":
                    self._add(name, group["value"], body, None)
                elif kind == "mass":
                    self._add(name, group["value"], body, direction(group.get("direction", [0.0, 1.0])))
                else:
                    held = group.get("held", [])
                    held = [held] if isinstance(held, str) else held
                    for axis, mass, along in (
                        ("x", group["mass"], (one, Fraction(0))),
                        ("y", group["mass"], (Fraction(0), one)),
                        ("phi", group["inertia"], None),
                    ):
                        if axis not in held:
                            self._add(f"{name}.{axis}", mass, body, along)
        for point in groups.get("point", []):
            body, _, centre = self.points[point["body"].lower()]
            arm = _pair(point["position"])
            self.points[point["name"].lower()] = body, arm, _sum(centre or zero, arm)

    def _add(self, name: str, mass: float, body: int, along: Vector | None) -> None:
        self.names.append(name)
        self.mass.append(Fraction(mass))
        self.moves.append((body, along))

    def coordinate(self, name: str) -> Row:
        """Return the row of a coordinate or of .x or .y of a point."""
        if name.lower() in self.names:
            return [Fraction(name.lower() == other) for other in self.names]
        point, _, axis = name.lower().rpartition(".")
        body, arm, _ = self.points[point]
        return self.motion(body, arm, (Fraction(axis == "x"), Fraction(axis == "y")))

    def angle(self, body: int | None) -> Row:
        """Return the row of the angle of a body."""
        return [Fraction(of == body and shift is None) for of, shift in self.moves]

    def wheels(self, between: list[str], radii: Vector) -> Row:
        """Return the row of two inertias that mesh."""
        one, two = (self.angle(self.points[name.lower()][0]) for name in between)
        return [radii[0] * a - radii[1] * b for a, b in zip(one, two, strict=True)]

    def motion(self, body: int | None, arm: Vector, along: Vector) -> Row:
        """Return the row of the motion of a point of a body in a direction."""
        moment = arm[0] * along[1] - arm[1] * along[0]
        rows = [moment if shift is None else shift[0] * along[0] + shift[1] * along[1] for _, shift in self.moves]
        return [x if of == body else Fraction(0) for x, (of, _) in zip(rows, self.moves, strict=True)]

    def pairs(self, part: dict[str, Any]) -> list[Row]:
        """Return the row of each pair of ends of a part."""
        ends = part["between"]
        return [self._row(part, ends[i], ends[i + 1]) for i in range(0, len(ends), 2)]

    def _kinds(self, ends: list[str]) -> list[str]:
        return [self.kinds.get(self.points[end.lower()][0], "frame") for end in ends]

    def turns(self, part: dict[str, Any]) -> bool:
        """Return whether a part acts on angles."""
        return bool(part.get("twist")) or "inertia" in self._kinds(part["between"])

    def side(self, stop: dict[str, Any]) -> str:
        """Return the side of a stop: where none is given, lower in the plane or with a direction, else upper."""
        upper = "direction" not in stop and (self.turns(stop) or "mass" in self._kinds(stop["between"]))
        return str(stop.get("side") or ("upper" if upper else "lower"))

    def sliding(self, part: dict[str, Any]) -> Row:
        """Return the row along which friction slides, in the place of its first end."""
        return self._row(part, *part["between"], here=True)

    def _row(self, part: dict[str, Any], first: str, second: str, here: bool = False) -> Row:
        (body, arm, place), (other, other_arm, other_place) = self.points[first.lower()], self.points[second.lower()]
        kinds = self._kinds([first, second])
        if self.turns(part):
            return [a - b for a, b in zip(self.angle(body), self.angle(other), strict=True)]
        both = place is not None and other_place is not None and "mass" not in kinds
        line = _sum(place, other_place, -1) if both else None
        if "direction" in part:
            along = direction(part["direction"])
        elif "mass" in kinds:
            moved = body if kinds[0] == "mass" else other
            along = next(shift for of, shift in self.moves if of == moved)
        else:
            along = direction(line)
        if here and both:
            behind = line[0] * along[0] + line[1] * along[1]
            other_arm = _sum(other_arm, _sum(line, along, -behind))
        one, two = self.motion(body, arm, along), self.motion(other, other_arm, along)
        return [a - b for a, b in zip(one, two, strict=True)]

    def axes_of(self, exciter: dict[str, Any]) -> list[tuple[Row, Row]]:
        """Return, of both rotors of an exciter, the rows along and across the direction of its resultant."""
        body, arm, _ = self.points[exciter["on"].lower()]
        along = direction(exciter.get("direction", [0.0, 1.0]))
        middle, across = _sum(arm, _pair(exciter.get("position", [0.0, 0.0]))), (along[1], -along[0])
        half = Fraction(exciter.get("arm", 0.0))
        rows = [(self.motion(body, _sum(middle, across, side * half), along), side) for side in (-1, 1)]
        turned = [self.motion(body, _sum(middle, across, side * half), across) for side in (-1, 1)]
        # The second rotor turns the other way.
        return [(row, [-side * x for x in other]) for (row, side), other in zip(rows, turned, strict=True)]


def direction(vector: Any) -> Vector:
    """Return the direction of a vector with length 1."""
    x, y = (float(number) for number in vector)
    size = math.hypot(x, y)
    return Fraction(x / size), Fraction(y / size)


def _pair(numbers: Any) -> Vector:
    return Fraction(numbers[0]), Fraction(numbers[1])


def _sum(one: Vector, two: Vector, factor: Fraction | int = 1) -> Vector:
    return one[0] + factor * two[0], one[1] + factor * two[1]
