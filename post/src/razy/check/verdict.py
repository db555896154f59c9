"""What is proved of the motions of a file of razy-follow."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from flint import arb, arb_mat, ctx

from razy.check.machine import NotCovered, build, put, read_groups
from razy.check.motion import System
from razy.check.proof import Course, Disproved, Undecided
from razy.read.file import check_storage

KINDS = ("proved", "undecided", "refused", "not covered")
FAR = 1e-7
"""A state farther off than this, over its size, is refused also near a fold, where corrections say little."""


COLUMNS = ("state", "multiplicity", "events", "stable", "multiplier", "period", "correction")


@dataclass(frozen=True)
class Verdict:
    """Of a motion: one of `KINDS`, why it is not proved, the radius of the proof over the scales of the state."""

    kind: str
    reason: str = ""
    radius: float = math.nan


def verdicts(file: str | Path, points: Sequence[int]) -> list[Verdict]:
    """Return the verdicts on the motions with these numbers, counted from 0."""
    ctx.prec = 212
    with h5py.File(file) as data:
        groups = read_groups(data.attrs["input"])
        follow = groups["follow"][0]
        if isinstance(follow["parameter"], list) or len(groups["follow"]) > 1:
            raise NotCovered("more than one parameter")
        parameter = _read(data, "point/" + follow["parameter"].replace("%", "."))
        point = {name: _read(data, f"point/{name}") for name in COLUMNS}
        # Files of versions before have all states at phase 0.
        phase = _read(data, "point/phase") if "phase" in data["point"] else np.zeros(parameter.size)
        special = set(_read(data, "special/point").tolist())
    result = []
    for i in points:
        put(groups, follow["parameter"], float(parameter[i]))
        row = {name: column[i] for name, column in point.items()}
        try:
            result.append(Verdict("proved", radius=_check(System(build(groups), float(phase[i])), row)))
        except Disproved as reason:
            result.append(
                Verdict(*(("undecided", f"special point: {reason}") if i in special else ("refused", str(reason))))
            )
        except (Undecided, ZeroDivisionError, ValueError) as reason:
            result.append(Verdict("undecided", str(reason)))
        except NotCovered as reason:
            result.append(Verdict("not covered", str(reason)))
    return result


def _read(data: h5py.File, name: str) -> np.ndarray:
    """Return a dataset, unless it claims to be larger than what is stored can be."""
    check_storage(data[name])
    return data[name][:]


def _check(system: System, row: dict) -> float:
    n, m = len(row["state"]) // 2, system.m
    q = arb_mat(n, 2, [arb(float(row["state"][i + j * n])) for i in range(n) for j in (0, 1)])
    felt = system.to_felt * q
    y = [felt[i, 0] for i in range(m)] + [felt[i, 1] / system.omega for i in range(m)]
    periods = int(row["multiplicity"])
    if abs(2 * arb.pi() * periods / system.omega / float(row["period"]) - 1) > 1e-12:
        raise Disproved("its period is not that of the excitation times its multiplicity")
    course = Course(system, y, periods)
    if course.events != row["events"]:
        raise Disproved(f"it has {course.events} events, not {row['events']}")
    proof = course.prove(y)
    allowed = max(1e-11, 10 * float(row["correction"]))
    for stored, proved, scale in zip(y, proof.state, course.scales, strict=True):
        if abs(stored - proved) > max(allowed, FAR) * scale:
            raise Disproved("its state is farther from the proved one than its correction allows")
        if not abs(stored - proved) < allowed * scale:
            raise Undecided("a proved motion is near, but farther than the correction allows: a fold may be near")
    if proof.stable is not None and row["stable"] >= 0 and proof.stable != bool(row["stable"]):
        raise Disproved("its stability is not the proved one")
    left = list(proof.multipliers)
    for real, imaginary in row["multiplier"].T:
        nearest = min(left, key=lambda z: abs(complex(z.mid()) - complex(real, imaginary)), default=None)
        if nearest is None or abs(complex(nearest.mid()) - complex(real, imaginary)) > 1e-6 * max(
            1.0, *(abs(complex(z.mid())) for z in proof.multipliers)
        ):
            raise Disproved("its multipliers are not the proved ones")
        left.remove(nearest)
    return proof.radius
