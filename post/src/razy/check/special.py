"""The proof of special points: a short curve of motions on which a test function has opposite signs at both ends."""

from copy import copy
from dataclasses import dataclass

import numpy as np
from flint import acb, acb_mat, arb, arb_mat

from razy.check.machine import Machine, NotCovered
from razy.check.motion import Guard, System
from razy.check.proof import (
    TOGETHER,
    Course,
    Disproved,
    Look,
    Proof,
    Undecided,
    krawczyk,
    monodromy,
    newton,
    part,
    proof_of,
)
from razy.check.touch import SHORT, without_touch

HALF, THIN = 0.54, 0.63
"""Half the length of the curve over the scale of its unknown, half the side of boxes at its ends: parts of the bits."""
LABELS = ("LP", "PD", "TR", "GR")
NEAR = 1e-3
"""A multiplier farther from that of a special point than this is none of it."""


@dataclass
class Point:
    """A special point: parameter beyond the stored value, the state, radius of the parameter over its size."""

    beyond: arb
    state: list[arb]
    radius: float


class Curve:
    """Motions with one sequence over the parameter: unknowns v = (state, times of events, parameter)."""

    def __init__(self, course: Course, machines: list[Machine], size: float):
        """Begin at a course; machines at the stored value of the parameter, whose size is `size`, and beyond it."""
        self.course, self.machines, self.phase = copy(course), machines, course.system.phase
        self.scales = [*course.scales, *[1.0] * course.events, size]
        self.n, self.last = 2 * course.system.m, len(self.scales) - 1
        self.direction = 0

    def look(self, v: arb_mat) -> Look:
        """Return F and its derivatives."""
        system = System(self.machines, self.phase, v[self.last, 0], slopes=True)
        if system.m * 2 != self.n:
            raise NotCovered("a parameter that changes what contacts feel")
        u = arb_mat(self.last, 1, [v[i, 0] for i in range(self.last)])
        return self.course.equations(u, system)

    def begin(self, y: list[arb]) -> arb_mat:
        """Return v at a stored motion; the curve is then taken over the state or parameter that changes most."""
        u = self.course.unknowns(y)
        v = arb_mat(self.last + 1, 1, [*(u[i, 0] for i in range(self.last)), arb(0)])
        df = self.look(v).df
        a = np.array([[float(df[i, j].mid()) * s for j, s in enumerate(self.scales)] for i in range(self.last)])
        tangent = abs(np.linalg.svd(a)[2][-1])
        tangent[self.n : self.last] = 0.0
        self.direction = int(np.argmax(tangent))
        return v

    def square(self, look: Look) -> tuple[arb_mat, arb_mat]:
        """Return F and its derivatives by all unknowns, and an equation that leaves the one of the curve as it is."""
        size = self.last + 1
        f = arb_mat(size, 1, [*look.f.entries(), arb(0)])
        df = arb_mat(size, size, [*look.df.entries(), *[arb(0)] * size])
        df[self.last, self.direction] = arb(1)
        return f, df

    def at(self, v: arb_mat, s: arb) -> arb_mat:
        """Return the motion of the curve where its own unknown is s, as midpoints."""
        start = arb_mat(v)
        start[self.direction, 0] = s
        return newton(lambda v: self.square(self.look(v)), start, self.scales)

    def rates(self, look: Look) -> arb_mat:
        """Return dv/ds."""
        right = arb_mat(self.last + 1, 1)
        right[self.last, 0] = arb(1)
        return self.square(look)[1].solve(right)

    def enclose(self, v: arb_mat, half: arb) -> tuple[arb_mat, Look]:
        """Enclose all motions of the curve for s within `half` of v's, and only those; v is on the curve."""
        look = self.look(v)
        rates = self.rates(look)
        reach = [2 * half * abs(rates[i, 0].mid()) + part(THIN) * scale for i, scale in enumerate(self.scales)]
        box = arb_mat(self.last + 1, 1, [arb(v[i, 0], r) for i, r in enumerate(reach)])
        f = self.square(look)[0]
        f[self.last, 0] = arb(0, half)
        image = krawczyk(f, self.square(self.look(box))[1], v, box)
        return image, self.look(image)

    def prove(self, v: arb_mat) -> tuple[arb_mat, Look]:
        """Prove the motion of the curve with its own unknown as in v."""
        box, look = self.enclose(self.at(v, v[self.direction, 0]), arb(0))
        self.admit(box, look)
        return box, look

    def admit(self, box: arb_mat, look: Look) -> None:
        """Show that the motions in a box keep off all bounds but where their events and touches are."""
        course = copy(self.course)
        course.system = System(self.machines, self.phase, box[self.last, 0])
        course.admit(look, box)


def prove(label: str, course: Course, y: list[arb], machines: list[Machine], size: float, contact: str) -> Point:
    """Prove a point LP, PD, TR or GR near a stored motion."""
    grazing = without_touch(course, contact) if label == "GR" else course
    try:
        if grazing is None:
            raise Undecided("no contact grazes there")
        curve = Curve(grazing, machines, size)
        box, look = _between(label, curve, curve.begin(y))
        curve.admit(box, look)
    except Undecided as reason:
        _refuse(label, Curve(course, machines, size), y, grazing is None)
        raise Undecided(str(reason)) from None
    beyond = box[curve.last, 0]
    return Point(beyond, [box[i, 0] for i in range(curve.n)], float(beyond.rad()) / size)


def _refuse(label: str, curve: Curve, y: list[arb], apart: bool) -> None:
    """Refuse a label if the motion there is proved and nothing of it is near what the label says."""
    try:
        box, look = curve.prove(curve.begin(y))
        values = proof_of(look, box, curve.course).multipliers
    except (Undecided, ZeroDivisionError, ValueError):
        return
    if curve.course.shortest < TOGETHER:
        # What comes first is not decided, and the multipliers are those of one order.
        return
    if label == "GR":
        if apart and curve.course.shortest > SHORT:
            raise Disproved("it is no GR: no contact grazes there")
        return
    away = {
        "LP": lambda z: abs(z - 1),
        "PD": lambda z: abs(z + 1),
        "TR": lambda z: abs(abs(z) - 1) if not z.imag.contains(0) else acb(1),
    }[label]
    if all(abs(away(z)) > NEAR for z in values):
        where = "complex and near the unit circle" if label == "TR" else f"near {1 if label == 'LP' else -1}"
        raise Disproved(f"it is no {label}: no multiplier is {where}")


def near_fold(course: Course, y: list[arb], machines: list[Machine], size: float) -> tuple[Proof, arb]:
    """Prove a motion that has one number of the state as in y, and return by how much its parameter differs."""
    curve = Curve(course, machines, size)
    v = curve.begin(y)
    if curve.direction >= curve.n:
        raise Undecided("a proved motion is near, but farther than the correction allows")
    box, look = curve.prove(v)
    return proof_of(look, box, course), box[curve.last, 0]


def _between(label: str, curve: Curve, v: arb_mat) -> tuple[arb_mat, Look]:
    """Return the box of a short curve that holds the point, and what belongs to it."""
    v = _locate(label, curve, v)
    half = part(HALF) * curve.scales[curve.direction]
    s = v[curve.direction, 0]
    box, look = curve.enclose(v, half)
    ends = [curve.enclose(curve.at(v, end), arb(0))[1] for end in (s - half, s + half)]
    if label == "TR":
        outside = [_outside(curve, end) for end in ends]
        real = [_determinant(curve, look, sign) for sign in (1, -1)]
        proved = abs(outside[0] - outside[1]) == 2 and not any(value.contains(0) for value in real)
    elif label == "GR":
        # The least of the gaps passes through zero, as several contacts may touch at once by symmetry.
        gaps = [_gaps(curve, end) for end in ends]
        proved = any(all(gap > 0 for gap in one) and any(gap < 0 for gap in two) for one, two in (gaps, reversed(gaps)))
    else:
        first, second = (_test(label, curve, end) for end in ends)
        proved = bool(first * second < 0)
    if not proved:
        raise Undecided(f"no change of sign is proved at {label}")
    return box, look


def _locate(label: str, curve: Curve, v: arb_mat) -> arb_mat:
    """Return the zero of the test function near v by secants."""
    scale = curve.scales[curve.direction]
    v = curve.at(v, v[curve.direction, 0])
    before, value = v[curve.direction, 0], _test(label, curve, curve.look(v)).mid()
    s = before + 1e-9 * scale
    for _ in range(40):
        v = curve.at(v, s)
        now = _test(label, curve, curve.look(v)).mid()
        if now == value:
            break
        step = (-now * (s - before) / (now - value)).mid()
        before, value, s = s, now, (s + step).mid()
        if abs(s - v[curve.direction, 0]) > 0.1 * scale:
            break
        if abs(step) < part(0.6) * scale:
            return curve.at(v, s)
    raise Undecided(f"{label} is not found near it")


def _test(label: str, curve: Curve, look: Look) -> arb:
    """Return what vanishes at a point of this kind."""
    if label == "LP":
        return curve.rates(look)[curve.last, 0]
    if label == "GR":
        return _gaps(curve, look)[0]
    if label == "PD":
        return _determinant(curve, look, -1)
    values = acb_mat(monodromy(look.df, curve.n)).eig(multiple=True)
    pairs = [abs(z) - 1 for z in values if not z.imag.contains(0)]
    if not pairs:
        raise Undecided("no pair of multipliers is complex")
    return min(pairs, key=lambda size: abs(float(size.mid())))


def _gaps(curve: Curve, look: Look) -> list[arb]:
    """Return how far the contacts are from their bounds at the touches."""
    return [
        (curve.course.system.form(piece.mode, Guard(piece.started[0], None, "", piece.started[1])) * start)[0, 0]
        for piece, start in zip(curve.course.pieces, look.starts, strict=True)
        if piece.touched
    ]


def _determinant(curve: Curve, look: Look, sign: int) -> arb:
    p = monodromy(look.df, curve.n)
    for i in range(curve.n):
        p[i, i] -= sign
    return p.det()


def _outside(curve: Curve, look: Look) -> int:
    sizes = [abs(z) for z in acb_mat(monodromy(look.df, curve.n)).eig(multiple=True)]
    if not all(size > 1 or size < 1 for size in sizes):
        raise Undecided("a multiplier is on the unit circle at both ends")
    return sum(bool(size > 1) for size in sizes)
