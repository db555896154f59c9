"""The motion from a start, enclosed piece by piece in balls of growing precision, beside what razy-run stored of it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from flint import arb, arb_mat, ctx

from razy.check.machine import NotCovered, build, common, read_groups, value_of
from razy.check.motion import System
from razy.check.proof import Course, Disproved, Piece, Pieces, Undecided
from razy.read.file import check_storage

PRECISIONS = (212, 424, 848, 1696, 3392, 6784)
"""Bits, one after the other until no ball becomes too large."""
STATES = 200
"""At most so many of the stored states are compared, the last among them."""
AGREES = 1e-7
"""A stored state or event farther off than this, over the largest or over the time, is not that of the motion."""

SETTLED = 1e-6
"""A run has settled if its last state returns, and lies to a proved motion, within this of the largest."""
PERIODS = 16
"""Of the excitation, in the longest period that is looked for."""


@dataclass
class Enclosed:
    """How far a motion was enclosed (s), with how many bits, why no farther, and what the file has of it."""

    until: float
    end: float
    events: int
    bits: int
    reason: str = ""
    turned: int = 0
    """Frictions that impacts turned round, which are events of their own in the file."""
    states: int = 0
    farthest: float = 0.0
    """Largest difference of a stored state, over the largest displacement or velocity."""
    parted: float = math.inf
    """Time from which the file is farther off than `AGREES`, s."""


class _Stored:
    """What a file of razy-run holds."""

    def __init__(self, file: str | Path):
        with h5py.File(file) as data:
            self.groups = read_groups(data.attrs["input"])
            self.reached = float(data["outcome/time"][0])
            self.time, self.state = np.zeros(0), np.zeros((0, 0))
            names = ("state/displacement", "state/velocity", "time", "event/time", "event/contact")
            for name in names:
                if name in data:
                    check_storage(data[name])
            if "state/displacement" in data:
                self.time = data["time"][:]
                self.state = np.hstack([data["state/displacement"][:], data["state/velocity"][:]])
            self.events, self.contacts = data["event/time"][:], data["event/contact"][:]

    def start(self) -> list[float]:
        """Return displacements and velocities of all bodies at the start."""
        motion = self.groups["motion"][0]
        names = build(self.groups).names
        state = [0.0] * (2 * len(names))
        if motion.get("start", "static") == "static":
            if not (self.time.size and self.time[0] == 0):
                raise NotCovered("a start in static equilibrium that is not recorded (observable='state', from 0)")
            return self.state[0].tolist()
        for given in self.groups.get("initial", []) if motion["start"] == "given" else []:
            i = names.index(given["on"].lower())
            state[i], state[len(names) + i] = given.get("displacement", 0.0), given.get("velocity", 0.0)
        return state


def enclose_file(file: str | Path, progress: Callable[[float, float, int], None]) -> Enclosed:
    """Enclose the motion of a file of razy-run; progress is told time, end and events now and then."""
    stored = _Stored(file)
    best = None
    for bits in PRECISIONS:
        ctx.prec = bits
        found = Motion(stored, bits, progress).enclose()
        stuck = best is not None and found.until <= best.until * (1 + 1e-12)
        best = found
        if not found.reason or found.reason.startswith("not covered") or stuck:
            break
    return best


def settled(file: str | Path) -> tuple[int, bool | None, float] | None:
    """Prove the periodic motion that a run has come to.

    Return its periods of the excitation, whether it is stable, and how far off the last stored state is, over the
    largest displacement or velocity of it.
    """
    stored = _Stored(file)
    machine = build(stored.groups)
    if not (stored.time.size and machine.frequencies()):
        return None
    ctx.prec = PRECISIONS[0]
    turns = arb(float(stored.time[-1])) * value_of(common(machine.frequencies())) / (2 * arb.pi())
    system = System([machine], float(turns - turns.floor()))
    y = system.felt(stored.state[-1])
    for periods in range(1, PERIODS + 1):
        try:
            course = Course(system, y, periods)
            if course.distance(course.end, y) < SETTLED:
                proof = course.prove(y)
                away = course.distance(proof.state, y)
                return (periods, proof.stable, away) if away < SETTLED else None
        except (Undecided, Disproved, NotCovered, ArithmeticError, ValueError):
            continue
    return None


class Motion:
    """The motion from its start."""

    def __init__(self, stored: _Stored, bits: int, progress: Callable[[float, float, int], None]):
        self.stored, self.progress = stored, progress
        machine = build(stored.groups)
        self.system = system = System([machine])
        y = system.felt(stored.start())
        end = stored.reached
        scales = self._scales(y)
        # Which event comes next and what keeps off its bounds needs few bits.
        with ctx.workprec(PRECISIONS[0]):
            self.pieces = Pieces(System([build(stored.groups)]), scales)
        self.x = system.state(y)
        self.found = Enclosed(0.0, end, 0, bits)
        self.row = 0

    def _scales(self, y: list[arb]) -> list[float]:
        """Return scales of y: the largest stored, or those of the start and of its acceleration."""
        m = self.system.m
        rows = [self.system.felt(state) for state in self.stored.state[:: max(1, len(self.stored.state) // 50)]]
        if not rows:
            x = self.system.state(y)
            rate = self.system.generator(self.system.mode_at(x)) * x
            rows = [y, [rate[i, 0] for i in range(2 * m)], [rate[m + i, 0] for i in range(m)] * 2]
        sizes = [max(abs(float(row[i + k].mid())) for row in rows for i in range(m)) for k in (0, m)]
        return [sizes[0] or 1.0] * m + [max(sizes[1], sizes[0]) or 1.0] * m

    def enclose(self) -> Enclosed:
        """Go from event to event until the end, or until a ball is too large."""
        system, found = self.system, self.found
        end = arb(found.end) * system.omega
        gone, edge = arb(0), self._edge(arb(0), 0, end)
        try:
            piece = Piece(system.mode_at(self.x), None, 0.0, None)
            while True:
                with ctx.workprec(PRECISIONS[0]):
                    piece.guard, time, _ = self.pieces.follow(piece, self.x, float(edge - gone))
                duration = edge - gone
                if piece.guard is not None:
                    duration, x = self._event(piece, arb(time))
                    if not duration < edge - gone:
                        piece.guard, duration = None, edge - gone
                piece.duration = float(duration.mid())
                with ctx.workprec(PRECISIONS[0]):
                    self.pieces.keep_off(piece, self.x * arb(1), duration * 1)
                self._compare_states(piece.mode, gone, gone + duration)
                guard, gone = piece.guard, gone + duration
                if guard is None and not edge < end:
                    found.until = found.end
                    break
                if guard is None:
                    x = system.exponential(piece.mode, self.pieces.sizes).at(duration) * self.x
                piece, more = self.pieces.next(piece, x.mid())
                if guard is None:
                    self.x = system.state([x[i, 0] for i in range(2 * system.m)], piece.after)
                    gone, edge = edge, self._edge(edge, piece.after, end)
                    found.turned += more
                    continue
                self.x = system.impact(guard.contact) * x if guard.target == "impact" else x
                found.events += 1
                found.until = float((gone / system.omega).mid())
                self._compare_event(guard.contact, gone)
                found.turned += more
                self.progress(found.until, found.end, found.events)
        except (Undecided, Disproved, ZeroDivisionError, ValueError) as reason:
            found.reason = str(reason)
        except NotCovered as reason:
            found.reason = f"not covered: {reason}"
        if found.reason and found.parted > found.until - AGREES * found.end:
            # Of impacts that accumulate the file has the first and the sum of all others.
            found.parted = math.inf
        return found

    def _edge(self, gone: arb, after: int, end: arb) -> arb:
        """Return the phase of the next break of an excitation that is no sine, or of the end."""
        edge = gone + self.system.span(after) if self.system.waves else end
        return edge if edge < end else end

    def _event(self, piece: Piece, time: arb) -> tuple[arb, arb_mat]:
        """Enclose the time at which a guard is zero, and the state there, by Newton's method of intervals."""
        g, row = self.system.generator(piece.mode), self.system.form(piece.mode, piece.guard)
        flow = self.system.exponential(piece.mode, self.pieces.sizes)
        least, change = arb(2) ** (20 - ctx.prec), arb(1)
        for _ in range(16):
            x = flow.at(time) * self.x
            value, rate = (row * x)[0, 0], (row * (g * x))[0, 0]
            if abs(change) < least:
                break
            change = (value / rate).mid()
            time = (time - change).mid()
        half = (2 * abs(value / rate)).upper() + least
        rates = (row * (g * (flow.at(arb(0, half)) * x)))[0, 0]
        if rates.contains(0):
            raise Undecided(
                f"a grazing of {self.system.machine.contacts[piece.guard.contact].name}, or balls too large"
            )
        change = -value / rates
        if not arb(0, half).contains_interior(change):
            raise Undecided("an event is not enclosed: balls are too large")
        return time + change, flow.at(change) * x

    def _compare_states(self, mode, begin: arb, end: arb) -> None:
        """Compare stored states in this piece."""
        stored, found = self.stored, self.found
        skip = max(1, math.ceil(stored.time.size / STATES))
        while self.row < stored.time.size and arb(float(stored.time[self.row])) * self.system.omega <= end:
            time = float(stored.time[self.row])
            # At an event itself the stored state may be that before or after it.
            inside = arb(time) * self.system.omega - begin
            if inside >= 0 and float(inside) > 1e-9 and float((end - begin - inside).mid()) > 1e-9:
                x = self.system.exponential(mode, self.pieces.sizes).at(inside) * self.x
                y = self.system.felt(stored.state[self.row])
                away = max(
                    float(abs(a - x[i, 0]).upper()) / scale
                    for i, (a, scale) in enumerate(zip(y, self.pieces.scales, strict=True))
                )
                found.states, found.farthest = found.states + 1, max(found.farthest, away)
                if away > AGREES:
                    found.parted = min(found.parted, time)
            last = stored.time.size - 1
            self.row = min(self.row + skip, last) if self.row < last else last + 1

    def _compare_event(self, contact: int, phase: arb) -> None:
        """Compare an event with the stored one of its number."""
        i, time = self.found.events - 1 + self.found.turned, phase / self.system.omega
        stored = self.stored
        same = i < stored.events.size and stored.contacts[i] == contact + 1
        if not (same and abs(arb(float(stored.events[i])) - time) <= AGREES * max(self.found.end, 1e-300)):
            self.found.parted = min(self.found.parted, float(time.mid()))
