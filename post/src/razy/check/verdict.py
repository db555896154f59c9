"""What is proved of the motions and special points of a file of razy-follow."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from flint import arb, arb_mat, ctx

from razy.check.dual import family
from razy.check.machine import NotCovered, build, put, read_groups
from razy.check.motion import System
from razy.check.proof import TOGETHER, Course, Disproved, Proof, Undecided
from razy.check.special import LABELS, near_fold, prove
from razy.read.file import check_storage

KINDS = ("proved", "undecided", "refused", "not covered")
PRECISIONS = (128, 212, 424, 848)
"""Bits, one after the other until there is a verdict."""
CLOSE = 1e-11
"""How far a state may be off over its size, and the parameter of a special point over its own."""
FAR = 1e-7
"""A state farther off than this is refused whatever its correction, and also near a fold."""
ALLOWED = 1e-6
"""How far stored multipliers may be off, over the largest."""
ROUNDED = 2e-15
"""How far rounding puts a state off, over its scales, at its start and at each event."""
CHANGES = ("GR", "ST", "SL", "CH")
"""Labels of motions between neighbours with other sequences of events."""
UNCOVERED = {
    "BP": "a branch point, where motions have no single curve",
    "HB": "the rest that a motion shrinks to",
    "ST": "a beginning or end of sticking",
    "SL": "a beginning, an end or a turn of sliding",
    "CH": "a change of contacts that is no single touch",
}
"""Labels of points that are not proved."""
COLUMNS = ("state", "multiplicity", "events", "stable", "multiplier", "period", "correction")


@dataclass(frozen=True)
class Verdict:
    """One of `KINDS`, why it is not proved, and the radius of the proof over the scales of state or parameter."""

    kind: str
    reason: str = ""
    radius: float = math.nan
    stable: bool | None = None
    """Of a proved motion, if that is proved, too."""
    specials: dict[int, "Verdict"] = field(default_factory=dict)
    """Of a motion: the verdicts on the special points that are at it, by their row in /special."""


def verdicts(file: str | Path, points: Sequence[int]) -> list[Verdict]:
    """Return the verdicts on the motions with these numbers, counted from 0."""
    with h5py.File(file) as data:
        groups = read_groups(data.attrs["input"])
        follow = groups["follow"][0]
        if isinstance(follow["parameter"], list) or len(groups["follow"]) > 1:
            raise NotCovered("more than one parameter")
        parameter = _read(data, "point/" + follow["parameter"].replace("%", "."))
        point = {name: _read(data, f"point/{name}") for name in COLUMNS}
        # Files of versions before have all states at phase 0.
        point["phase"] = _read(data, "point/phase") if "phase" in data["point"] else np.zeros(parameter.size)
        # Beside a grazing rounding changes multipliers without bound: the file says by how much.
        known = "multiplier_error" in data["point"]
        point["multiplier_error"] = _read(data, "point/multiplier_error") if known else np.zeros((parameter.size, 1))
        special = {name: _read(data, f"special/{name}").tolist() for name in ("point", "label", "contact", "parameter")}
    result = []
    for i in points:
        row = {name: column[i] for name, column in point.items()}
        labels = {
            k: (special["label"][k].decode(), special["contact"][k].decode(), special["parameter"][k])
            for k, at in enumerate(special["point"])
            if at == i
        }
        result.append(_Row(groups, follow["parameter"], float(parameter[i]), row).verdict(labels))
    return result


def _read(data: h5py.File, name: str) -> np.ndarray:
    """Return a dataset, unless it claims to be larger than what is stored can be."""
    check_storage(data[name])
    return data[name][:]


def _judged(judge: Callable[..., Verdict], *arguments: Any) -> Verdict:
    """Return the verdict of a judge that says why there is no proof, if so.

    It has more bits where it cannot decide: balls grow with the norm of the machine.
    """
    for bits in PRECISIONS:
        ctx.prec = bits
        try:
            return judge(*arguments)
        except Disproved as reason:
            return Verdict("refused", str(reason))
        except NotCovered as reason:
            return Verdict("not covered", str(reason))
        except (Undecided, ArithmeticError, ValueError) as reason:
            undecided = Verdict("undecided", str(reason))
    return undecided


class _Row:
    """A motion of the file."""

    def __init__(self, groups: dict, parameter: str, value: float, row: dict):
        self.groups, self.parameter, self.value, self.row = groups, parameter, value, row
        self.phase, self.periods = float(row["phase"]), int(row["multiplicity"])
        self.size = abs(value) or 1.0

    def verdict(self, labels: dict[int, tuple[str, str, float]]) -> Verdict:
        """Return what is proved of the motion, and of the special points at it (label, contact, parameter)."""
        specials = {k: _judged(self._special, *label) for k, label in labels.items() if label[0] in LABELS}
        specials |= {k: Verdict("not covered", UNCOVERED[of]) for k, (of, *_) in labels.items() if of in UNCOVERED}
        result = _judged(self._motion, any(label in CHANGES for label, *_ in labels.values()))
        if result.kind != "proved" and self.periods % 2 == 0 and "EP" in (label for label, *_ in labels.values()):
            # A doubled branch ends in the doubling of the motion of half its period.
            doubling = _judged(self._special, "PD", "", self.value, self.periods // 2)
            result = doubling if doubling.kind == "proved" else result
        for verdict in specials.values():
            if result.kind != "proved" and verdict.kind in ("proved", "refused"):
                # On the point itself a motion has no sequence, or no neighbourhood, of its own.
                result = verdict
        return replace(result, specials=specials)

    def _start(self) -> tuple[System, list[arb]]:
        put(self.groups, self.parameter, self.value)
        machine = build(self.groups)
        if not machine.frequencies():
            raise NotCovered("a machine without excitation")
        system = System([machine], self.phase)
        return system, system.felt(self.row["state"])

    def _special(self, label: str, contact: str, parameter: float, periods: int = 0) -> Verdict:
        if parameter != self.value:
            raise Disproved(f"the parameter of {label} is not that of its motion")
        if label == "GR" and not periods:
            # A branch may come to the touch of motions of a part of its period.
            for part in (k for k in range(1, self.periods) if self.periods % k == 0):
                found = _judged(self._special, label, contact, parameter, part)
                if found.kind == "proved":
                    return found
        system, y = self._start()
        course = Course(system, y, periods or self.periods)
        point = prove(label, course, y, self._family(), self.size, contact)
        away = abs(point.beyond) / self.size
        if away > FAR:
            raise Disproved(f"the parameter of {label} is farther from the proved one than 1e-7 of it")
        if not away < CLOSE:
            raise Undecided(f"the parameter of {label} is farther from the proved one than 1e-11 of it")
        if self._farther(system, y, point.state, FAR):
            raise Disproved(f"its state is farther from that of {label} than 1e-7 of it")
        return Verdict("proved", radius=point.radius)

    def _family(self) -> list:
        return family(self.groups, self.parameter, self.value)

    @staticmethod
    def _farther(system: System, y: list[arb], proved: list[arb], allowed: float) -> bool:
        """Return whether what contacts and observables see of two states differs by more than allowed of its size."""
        m, largest = system.m, 0.0
        for half in (slice(0, m), slice(m, 2 * m)):
            stored, other = (system.seen * arb_mat(m, 1, values[half]) for values in (y, proved))
            largest = max(largest, *(abs(float(x.mid())) for x in stored.entries())) or 1.0
            if any(abs(x) > allowed * largest for x in (stored - other).entries()):
                return True
        return False

    def _motion(self, changes: bool) -> Verdict:
        row = self.row
        system, y = self._start()
        if abs(2 * arb.pi() * self.periods / system.omega / float(row["period"]) - 1) > 1e-12:
            raise Disproved("its period is not that of the excitation times its multiplicity")
        course = Course(system, y, self.periods)
        # By rounding what rests where the motion begins may be hit there.
        resting = sum(branch.endswith("closed") for branch in course.pieces[0].mode)
        if not course.changes <= row["events"] <= course.changes + resting:
            if changes:
                raise Undecided("its sequence of events changes there")
            raise Disproved(f"it has {course.changes} events, not {row['events']}")
        allowed = min(max(CLOSE, 10 * float(row["correction"])), FAR)
        try:
            proof = course.prove(y)
            near = self._farther(system, y, proof.state, allowed)
            reason = "a proved motion is near, but farther than the correction allows: a fold may be near"
        except Undecided as why:
            proof, near, reason = None, True, str(why)
        if near:
            far = False
            if proof is not None:
                rounded = min(ROUNDED * (1 + course.events) * course.sway(y), FAR)
                far = self._farther(system, y, proof.state, max(allowed, rounded))
            try:
                # Beside a fold or a doubling another motion may be what Newton's method came to.
                proof, moved = near_fold(course, y, self._family(), self.size)
                near = not self._farther(system, y, proof.state, allowed) and bool(abs(moved) < allowed * self.size)
            except Undecided:
                moved = near = None
            if not near and far:
                raise Disproved("its state is farther from the proved one than its correction allows")
            if not near and moved is None:
                raise Undecided(reason)
            if not near:
                # Both are proved, and more bits would move neither.
                return Verdict("undecided", reason)
        self._compare(proof, changes or course.shortest < TOGETHER)
        return Verdict("proved", radius=proof.radius, stable=proof.stable)

    def _compare(self, proof: Proof, changes: bool) -> None:
        if proof.stable is not None and self.row["stable"] >= 0 and proof.stable != bool(self.row["stable"]):
            raise (Undecided if changes else Disproved)("its stability is not the proved one")
        stored = [complex(*pair) for pair in self.row["multiplier"].T]
        proved = [complex(z.mid()) for z in proof.multipliers]
        allowed = max(ALLOWED * max(1.0, *map(abs, proved)), *map(float, self.row["multiplier_error"]))
        if _apart(stored, proved) <= allowed:
            return
        if any(max(float(z.real.rad()), float(z.imag.rad())) > allowed for z in proof.multipliers):
            raise Undecided("its multipliers are not enclosed well enough")
        if changes:
            raise Undecided("its multipliers are other ones on its two sides, where the sequence of events changes")
        raise Disproved("its multipliers are not the proved ones")


def _apart(some: list[complex], others: list[complex]) -> float:
    """Return the largest distance between multipliers and those of others that are nearest, each for one."""
    left, apart = list(others), [0.0]
    for one in some:
        nearest = min(left, key=lambda z: abs(z - one), default=math.inf)
        apart.append(abs(nearest - one))
        left = [z for z in left if z is not nearest]
    return math.inf if any(map(math.isnan, apart)) else max(apart)
