#!/usr/bin/env python3
"""Cost of a motion against the number of contacts (1 to 64) and of coordinates (2 to 200): report/contacts.md.

A chain of equal masses and springs between two walls, driven at one end, with elastic stops of one side at evenly
spaced masses. `razy-duel` computes each case by `exact` and by DOP853 with events; both must find the same events.
"""

import argparse
import itertools
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py

ROOT = Path(__file__).resolve().parent
END = 2.0


def case(coordinates, contacts):
    """Return the input of a chain."""
    lines = ["&scene kind='lumped', title='Chain' /"]
    lines += [f"&mass name='m{i}', value=1.0 /" for i in range(1, coordinates + 1)]
    ends = ["frame", *(f"m{i}" for i in range(1, coordinates + 1)), "frame"]
    lines += [f"&spring between='{a}','{b}', stiffness=4.0e4, damping=2.0 /" for a, b in itertools.pairwise(ends)]
    for j in range(contacts):
        body = 1 + (j * coordinates) // contacts
        lines.append(
            f"&stop name='s{j + 1}', between='m{body}','frame', clearance=1.0e-3, stiffness=1.0e6, damping=20.0 /"
        )
    lines += [
        "&load on='m1', amplitude=400.0, frequency=20.0 /",
        f"&motion t_end={END}, start='zero' /",
        "&duel integrator='exact' /",
        "&duel integrator='dop853', treatment='event', tolerance=1e-8 /",
    ]
    return "\n".join(lines) + "\n"


def measure(duel, coordinates, contacts, folder):
    """Return a row of the table."""
    path = folder / f"chain_{coordinates}_{contacts}.nml"
    path.write_text(case(coordinates, contacts), encoding="utf-8")
    result = path.with_suffix(".h5")
    subprocess.run([duel, path, "--output", result, "--force"], check=True, stdout=subprocess.DEVNULL)
    with h5py.File(result) as file:
        exact, dop853 = file["cpu_time"][:]
        events = file["events"][:]
        return (
            coordinates,
            contacts,
            int(events[0]),
            int(file["event_surplus"][1]),
            1e3 * exact,
            1e3 * dop853,
            int(file["rhs_evaluations"][1]),
            1e9 * dop853 / file["rhs_evaluations"][1],
            file["error"][1],
        )


def main():
    """Measure all cases and write the report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--razy-bin", type=Path, default=ROOT.parent / "build" / "bin")
    parser.add_argument("--report", type=Path, default=ROOT / "report" / "contacts.md")
    options = parser.parse_args()
    duel = options.razy_bin / "razy-duel"
    cases = [(64, contacts) for contacts in (1, 2, 4, 8, 16, 32, 64)]
    cases += [(coordinates, 2) for coordinates in (2, 5, 10, 20, 50, 100, 200)]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for coordinates, contacts in cases:
            rows.append(measure(duel, coordinates, contacts, Path(folder)))
            print(*rows[-1], file=sys.stderr)
    lines = [
        "# Cost against contacts and coordinates",
        "",
        f"A driven chain with stops, {END:g} s of motion (`bench/contacts.py`); processor time of one core of a shared",
        "machine. The time of `exact` is that with modes known from the first of several runs, as in a sweep. *Error*:",
        "DOP853 at 1e-8 against `exact`; where it is large, the motion is sensitive.",
        "",
        "| coordinates | contacts | events | DOP853: too many | exact, ms | DOP853, ms | right-hand sides | "
        "ns each, all told | error |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {n} | {c} | {events} | {surplus} | {exact:.2f} | {dop853:.2f} | {rhs} | {ns:.0f} | {error:.0e} |"
        for n, c, events, surplus, exact, dop853, rhs, ns, error in rows
    ]
    options.report.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
