"""Check the motions of a file of razy-follow: ``python -m razy.check FILE.h5``."""

import sys
from collections import Counter
from pathlib import Path

import h5py
from flint import arb, arb_mat, ctx

from razy.check.machine import NotCovered, build, put, read_groups
from razy.check.motion import System
from razy.check.proof import Course, Disproved, Undecided

FAR = 1e-7
"""A state farther off than this, over its size, is refused also near a fold, where corrections say little."""


def verdicts(file: str | Path) -> list[str]:
    """Return for each motion 'proved', or 'refused', 'undecided' or 'not covered' with the reason."""
    ctx.prec = 212
    with h5py.File(file) as data:
        groups = read_groups(data.attrs["input"])
        follow = groups["follow"][0]
        if isinstance(follow["parameter"], list) or len(groups["follow"]) > 1:
            raise NotCovered("more than one parameter")
        parameter = data["point/" + follow["parameter"].replace("%", ".")][:]
        point = {name: data[f"point/{name}"][:] for name in
                 ("state", "multiplicity", "events", "stable", "multiplier", "period", "correction")}  # fmt: skip
        special = set(data["special/point"][:].tolist())
    result = []
    for i, value in enumerate(parameter):
        put(groups, follow["parameter"], float(value))
        try:
            _check(System(build(groups)), {name: column[i] for name, column in point.items()})
            result.append("proved")
        except Disproved as reason:
            result.append(f"undecided: special point: {reason}" if i in special else f"refused: {reason}")
        except (Undecided, ZeroDivisionError, ValueError) as reason:
            result.append(f"undecided: {reason}")
        except NotCovered as reason:
            result.append(f"not covered: {reason}")
    return result


def _check(system: System, row: dict) -> None:
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
    if proof.stable is not None and proof.stable != bool(row["stable"]):
        raise Disproved("its stability is not the proved one")
    left = list(proof.multipliers)
    for real, imaginary in row["multiplier"].T:
        nearest = min(left, key=lambda z: abs(complex(z.mid()) - complex(real, imaginary)), default=None)
        if nearest is None or abs(complex(nearest.mid()) - complex(real, imaginary)) > 1e-6 * max(
            1.0, *(abs(complex(z.mid())) for z in proof.multipliers)
        ):
            raise Disproved("its multipliers are not the proved ones")
        left.remove(nearest)


def main() -> int:
    """Print what is not proved and a summary; return 0 if all is proved, 1 if not."""
    found = verdicts(sys.argv[1])
    for i, verdict in enumerate(found):
        if verdict != "proved":
            print(f"motion {i}: {verdict}")
    kinds = Counter(verdict.partition(":")[0] for verdict in found)
    print(", ".join(f"{number} {kind}" for kind, number in kinds.items()) + f" of {len(found)} motions")
    return int(kinds["proved"] != len(found))


if __name__ == "__main__":
    sys.exit(main())
