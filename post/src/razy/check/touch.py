"""The sequence of a grazing motion: that of its neighbours without the contact, and a touch in its place."""

import math
from collections.abc import Callable
from copy import copy
from dataclasses import replace

import numpy as np
from flint import arb

from razy.check.motion import Guard
from razy.check.proof import Course, Piece, real_roots, same

SHORT = 1e-3
"""Duration, in phase, of contacts that a motion beside a grazing has and the grazing motion has not."""
SLOW = 1e-5
"""Speed of rigid impacts, over the velocities, of such a motion."""
ALSO = 1e-9
"""Other contacts nearer to their bounds than this, over the displacements, touch in the same grazing."""


def without_touch(course: Course, contact: str) -> Course | None:
    """Return the course without the short contacts or openings of a grazing, and touches in their place."""
    result, names = copy(course), [c.name for c in course.system.machine.contacts]

    def meant(guard: Guard | None) -> bool:
        return guard is not None and guard.target != "touch" and contact in ("", names[guard.contact])

    _without_slow_impacts(result, meant)
    i = 1
    while i < len(result.pieces) - 1:
        before = result.pieces[i - 1]
        # Of a contact that parts at zero force it takes two pieces.
        for j in (i + 1, i + 2):
            inner, after = result.pieces[i:j], result.pieces[j : j + 1]
            short = sum(piece.duration for piece in inner)
            contacts = {piece.guard.contact for piece in (before, *inner) if meant(piece.guard)}
            whole = all(meant(piece.guard) for piece in (before, *inner))
            if short < SHORT and after and before.mode == after[0].mode and whole and len(contacts) == 1:
                touched = _touched(replace(before, duration=before.duration + short / 2), after[0], before.guard)
                touched[1].duration += short / 2
                result.pieces = [*result.pieces[: i - 1], *touched, *result.pieces[j + 1 :]]
                break
        i += 1
    limit = ALSO if any(piece.touched for piece in result.pieces) else 1e-4
    while (found := _nearest(result, meant, limit)) is not None:
        i, guard, time = found
        piece, limit = result.pieces[i], ALSO
        after = replace(piece, duration=piece.duration - time)
        result.pieces = [
            *result.pieces[:i],
            *_touched(replace(piece, duration=time), after, guard),
            *result.pieces[i + 1 :],
        ]
    result.events = sum(piece.guard is not None for piece in result.pieces)
    return result if any(piece.touched for piece in result.pieces) else None


def _without_slow_impacts(course: Course, meant: Callable) -> None:
    """Put touches in the place of rigid impacts with hardly any speed, between pieces that are pieces of one."""
    x, pieces = course.start, list(course.pieces)
    for i, piece in enumerate(course.pieces):
        x = course.system.exponential(piece.mode, course.sizes).at(arb(piece.duration)) * x
        if meant(piece.guard) and piece.guard.target == "impact":
            touch = replace(piece.guard, target="touch")
            speed = (course.system.form(piece.mode, touch) * x)[0, 0]
            if abs(float(speed)) < SLOW * max(course.scales):
                pieces[i : i + 2] = _touched(pieces[i], pieces[i + 1], piece.guard)
        x = course.after(piece, x).mid()
    course.pieces = pieces


def _touched(before: Piece, after: Piece, guard: Guard) -> list[Piece]:
    """Return two pieces between which a bound is touched."""
    return [
        replace(before, guard=replace(guard, target="touch")),
        replace(after, started=(guard.contact, guard.bound), touched=True),
    ]


def _nearest(course: Course, meant: Callable, limit: float) -> tuple[int, Guard, float] | None:
    """Return the piece, guard and time at which a guard has its lowest minimum inside a piece, if below the limit."""
    best, lowest = None, limit
    x = course.start
    for number, piece in enumerate(course.pieces):
        steps = max(1, math.ceil(piece.duration / course.step(piece.mode)))
        h = piece.duration / steps
        flow = course.system.exponential(piece.mode, course.sizes)
        for step in range(steps):
            for guard, (a, _) in zip(course.system.guards(piece.mode), flow.polynomials(x, arb(h)), strict=True):
                if not meant(guard):
                    continue
                gap = np.polynomial.Polynomial([float(term) * h**k for k, term in enumerate(a)])
                for part in _minima(gap):
                    time = step * h + part * h
                    known = (guard.contact, guard.bound) == piece.started and time < SHORT
                    if piece.guard is not None and same(guard, piece.guard):
                        known |= piece.duration - time < SHORT
                    if not known and abs(gap(part)) / max(course.scales) < lowest:
                        best, lowest = (number, guard, time), abs(gap(part)) / max(course.scales)
            x = (flow.at(arb(h)) * x).mid()
        x = course.after(piece, x)
    return best


def _minima(form: np.polynomial.Polynomial) -> list[float]:
    rate = form.deriv()
    return [float(z) for z in real_roots(rate.coef, 1e-6) if rate.deriv()(z) > 0]
