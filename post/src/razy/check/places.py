"""Where the parts of a machine act: rows w of the coordinates that give the displacement between their ends."""

import math
from fractions import Fraction
from typing import Any

Groups = dict[str, list[dict[str, Any]]]
Row = list[Fraction]
Vector = tuple[Fraction, Fraction]


class Axes:
    """Bodies with one coordinate each."""

    def __init__(self, groups: Groups):
        """Take the bodies in the order of the results."""
        bodies = groups.get("inertia", []) + groups.get("mass", [])
        self.names = [body["name"].lower() for body in bodies]
        self.mass = [Fraction(body["value"]) for body in bodies]

    def coordinate(self, name: str) -> Row:
        """Return the row of a coordinate; that of the frame is zero."""
        return [Fraction(name.lower() == other) for other in self.names]

    def pairs(self, part: dict[str, Any]) -> list[Row]:
        """Return the row of each pair of ends of a part."""
        return [self.wheels(part["between"], (Fraction(1), Fraction(1)))]

    def wheels(self, between: list[str], radii: Vector) -> Row:
        """Return the row of two wheels that mesh, or of two ends with radii of 1."""
        one, two = (self.coordinate(name) for name in between)
        return [radii[0] * a - radii[1] * b for a, b in zip(one, two, strict=True)]

    def sliding(self, part: dict[str, Any]) -> Row:
        """Return the row along which friction slides."""
        return self.pairs(part)[0]


class Plane:
    """Rigid bodies in a plane, with x, y and phi each, and what acts between their points in a direction.

    Directions are the doubles next to vectors of length 1.
    """

    def __init__(self, groups: Groups):
        """Take bodies and points."""
        bodies = groups.get("body", [])
        self.names = [f"{body['name'].lower()}.{axis}" for body in bodies for axis in ("x", "y", "phi")]
        self.mass = [Fraction(body[key]) for body in bodies for key in ("mass", "mass", "inertia")]
        zero = Fraction(0), Fraction(0)
        # Number of the body (none: the frame), place from its centre, place; of 'frame' itself there is no place.
        self.points: dict[str, tuple[int | None, Vector, Vector | None]] = {"frame": (None, zero, None)}
        for i, body in enumerate(bodies):
            self.points[body["name"].lower()] = i, zero, _pair(body.get("centre", [0.0, 0.0]))
        for point in groups.get("point", []):
            body, _, centre = self.points[point["body"].lower()]
            arm = _pair(point["position"])
            self.points[point["name"].lower()] = body, arm, _sum(centre or zero, arm)

    def coordinate(self, name: str) -> Row:
        """Return the row of a coordinate or of .x or .y of a point."""
        if name.lower() in self.names:
            return [Fraction(name.lower() == other) for other in self.names]
        point, _, axis = name.lower().rpartition(".")
        body, arm, _ = self.points[point]
        return self.motion(body, arm, (Fraction(axis == "x"), Fraction(axis == "y")))

    def motion(self, body: int | None, arm: Vector, along: Vector) -> Row:
        """Return the row of the motion of a point of a body in a direction."""
        row = [Fraction(0)] * len(self.names)
        if body is not None:
            row[3 * body : 3 * body + 3] = [*along, arm[0] * along[1] - arm[1] * along[0]]
        return row

    def pairs(self, part: dict[str, Any]) -> list[Row]:
        """Return the row of each pair of ends of a part."""
        ends = part["between"]
        return [self._row(part, ends[i], ends[i + 1]) for i in range(0, len(ends), 2)]

    def sliding(self, part: dict[str, Any]) -> Row:
        """Return the row along which friction slides, in the place of its first end."""
        return self._row(part, *part["between"], here=True)

    def _row(self, part: dict[str, Any], first: str, second: str, here: bool = False) -> Row:
        (body, arm, place), (other, other_arm, other_place) = self.points[first.lower()], self.points[second.lower()]
        both = place is not None and other_place is not None
        line = _sum(place, other_place, -1) if both else None
        along = direction(part["direction"]) if "direction" in part else direction(line)
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
