#!/usr/bin/env python3
"""Cost of a motion against contacts (1 to 64) and coordinates (2 to 200), and of a stop that is never touched.

The figures are in report/contacts.md.

A chain of equal masses and springs between two walls, driven at one end, with stops of one side at evenly spaced
masses, elastic or rigid. `razy-duel` computes each case by `exact` and by DOP853 with events, with rigid stops by
Moreau-Jean time stepping as well.
"""

import argparse
import itertools
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py

ROOT = Path(__file__).resolve().parent
END, STEP = 2.0, 1e-4
ELASTIC = "stiffness=1.0e6, damping=20.0"
RIGID = "law='rigid', restitution=0.5"


def case(coordinates, contacts, law, methods):
    """Return the input of a chain."""
    lines = ["&scene kind='lumped', title='Chain' /"]
    lines += [f"&mass name='m{i}', value=1.0 /" for i in range(1, coordinates + 1)]
    ends = ["frame", *(f"m{i}" for i in range(1, coordinates + 1)), "frame"]
    lines += [f"&spring between='{a}','{b}', stiffness=4.0e4, damping=2.0 /" for a, b in itertools.pairwise(ends)]
    for j in range(contacts):
        body = 1 + (j * coordinates) // contacts
        lines.append(f"&stop name='s{j + 1}', between='m{body}','frame', clearance=1.0e-3, {law} /")
    lines += [
        "&load on='m1', amplitude=400.0, frequency=20.0 /",
        f"&motion t_end={END}, start='zero' /",
        *(f"&duel {method} /" for method in methods),
    ]
    return "\n".join(lines) + "\n"


def measure(duel, coordinates, contacts, law, methods, folder):
    """Return what razy-duel measured: for each method the values of some of its datasets."""
    path = folder / "chain.nml"
    path.write_text(case(coordinates, contacts, law, methods), encoding="utf-8")
    result = path.with_suffix(".h5")
    subprocess.run([duel, path, "--output", result, "--force"], check=True, stdout=subprocess.DEVNULL)
    names = ("cpu_time", "events", "event_surplus", "rhs_evaluations", "steps", "error", "status")
    with h5py.File(result) as file:
        columns = [file[name][:] for name in names]
    rows = [dict(zip(names, values, strict=True)) for values in zip(*columns, strict=True)]
    failed = [method for method, row in zip(methods, rows, strict=True) if row["status"] != 0]
    if failed:
        raise RuntimeError(f"{coordinates} coordinates, {contacts} contacts: {', '.join(failed)} failed")
    return rows


def elastic_row(exact, dop853):
    """Cells of the table of elastic stops."""
    return [
        f"{exact['events']}",
        f"{dop853['event_surplus']}",
        f"{1e3 * exact['cpu_time']:.2f}",
        f"{1e3 * dop853['cpu_time']:.2f}",
        f"{dop853['rhs_evaluations']}",
        f"{1e9 * dop853['cpu_time'] / dop853['rhs_evaluations']:.0f}",
        f"{dop853['error']:.0e}",
    ]


def rigid_row(exact, dop853, moreau):
    """Cells of the table of rigid stops."""
    return [
        f"{exact['events']}",
        f"{dop853['event_surplus']}",
        f"{1e3 * exact['cpu_time']:.2f}",
        f"{1e3 * dop853['cpu_time']:.2f}",
        f"{dop853['error']:.0e}",
        f"{1e3 * moreau['cpu_time']:.1f}",
        f"{1e6 * moreau['cpu_time'] / moreau['steps']:.1f}",
        f"{moreau['error']:.0e}",
    ]


KINDS = {
    "Elastic stops": (
        ELASTIC,
        ["integrator='exact'", "integrator='dop853', treatment='event', tolerance=1e-8"],
        elastic_row,
        ["events", "DOP853: too many", "exact, ms", "DOP853, ms", "right-hand sides", "ns each, all told", "error"],
    ),
    "Rigid stops, restitution 0.5": (
        RIGID,
        [
            "integrator='exact'",
            "integrator='dop853', treatment='event', tolerance=1e-8",
            f"integrator='moreau_jean', step={STEP}",
        ],
        rigid_row,
        [
            "events",
            "DOP853: too many",
            "exact, ms",
            "DOP853, ms",
            "its error",
            "Moreau-Jean, ms",
            "us a step",
            "its error",
        ],
    ),
}
CASES = [(64, contacts) for contacts in (1, 2, 4, 8, 16, 32, 64)]
CASES += [(coordinates, 2) for coordinates in (2, 5, 10, 20, 50, 100, 200)]


def untouched(duel, folder):
    """Processor times of the gear pair alone, with a far elastic and with a far rigid stop, by `exact`, s."""
    text = (ROOT.parent / "inputs" / "torsional_gear_pair.nml").read_text(encoding="utf-8")
    machine = [
        line for line in text.splitlines() if re.match(r"&(scene|inertia|spring|gear_mesh|load|rotation)\b", line)
    ]
    times = []
    for law in (None, "stiffness=1e5", "law='rigid', restitution=0.8"):
        stop = f"&stop name='far', between='motor','pinion', side='upper', clearance=100.0, {law} /"
        run = ["&motion t_end=5.0, start='zero' /", "&duel integrator='exact' /"]
        path = folder / "far.nml"
        path.write_text("\n".join([*machine, *([stop] if law else []), *run]) + "\n", encoding="utf-8")
        result = path.with_suffix(".h5")
        subprocess.run([duel, path, "--output", result, "--force"], check=True, stdout=subprocess.DEVNULL)
        with h5py.File(result) as file:
            times.append((file["cpu_time"][0], file["events"][0]))
    return times


def version(duel):
    return subprocess.run([duel, "--version"], check=True, capture_output=True, text=True).stdout.strip()


def main():
    """Measure all cases and write the report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--razy-bin", type=Path, default=ROOT.parent / "build" / "bin")
    parser.add_argument("--report", type=Path, default=ROOT / "report" / "contacts.md")
    options = parser.parse_args()
    duel = options.razy_bin / "razy-duel"
    lines = [
        "# Cost against contacts and coordinates",
        "",
        f"A driven chain with stops, {END:g} s of motion (`bench/contacts.py`, {version(duel)}); processor",
        "time of one core of a shared machine. The time of `exact` is that with modes known from the first of several",
        "runs, as in a sweep. *Error*: of the displacements against `exact`, relative to the motion; DOP853 with",
        f"events at 1e-8, Moreau-Jean with steps of {1e3 * STEP:g} ms. Where DOP853's is large,",
        "the motion is sensitive. Events of rigid stops are impacts, their accumulation, rest and its end; *too many*",
        "is negative where there are too few, and where the error is small those were impacts too weak to matter.",
        "",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for title, (law, methods, cells, titles) in KINDS.items():
            head = ["coordinates", "contacts", *titles]
            lines += [f"## {title}", "", f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
            for coordinates, contacts in CASES:
                rows = measure(duel, coordinates, contacts, law, methods, Path(folder))
                row = [str(coordinates), str(contacts), *cells(*rows)]
                print(title, *row, file=sys.stderr)
                lines.append(f"| {' | '.join(row)} |")
            lines.append("")
        lines += [
            "## A stop that is never touched",
            "",
            "The torsional gear pair, 5 s of motion by `exact`, with a stop 100 rad away between motor and pinion.",
            "",
            "| stop | events | exact, ms | ratio |",
            "|---|---|---|---|",
        ]
        times = untouched(duel, Path(folder))
        for stop, (time, events) in zip(("none", "elastic", "rigid"), times, strict=True):
            lines.append(f"| {stop} | {events} | {1e3 * time:.2f} | {time / times[1][0]:.2f} |")
        lines.append("")
    options.report.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
