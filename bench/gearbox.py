#!/usr/bin/env python3
"""Motions of the test gearbox by the exact propagator and by DOP853 with events: report in bench/report/gearbox.md.

    bench/gearbox.py --razy-bin build/bin

Sweeps of inputs/test_gearbox.nml over the speed, gyroscopic matrix included, 0.3 s of motion each. The time of a point
is the processor time of a sweep less that of its first point alone, over the other points, so that starting the program
is not in it. The errors are those of the extrema of the mesh deformation at the speeds that both methods ran, relative
to the largest.
"""

import argparse
import datetime
import resource
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np
from run import BENCH, machine, versions

FIRST, LAST = 1500.0, 3000.0
TEN_TIMES = "gear_mesh%error_sine=5e-5,2.5e-5,1.6666666666666667e-5"
# what, further settings, points by exact, points by DOP853 (0: not run)
CASES = [
    ("48 coordinates, errors as printed", [], 31, 3),
    ("48 coordinates, errors ten times", [TEN_TIMES], 31, 3),
    ("the same with circulatory matrix", [TEN_TIMES, "rotation%circulatory=.true."], 31, 3),
    ("the same, shafts not equal", [TEN_TIMES, "section(5)%length=0.25"], 31, 3),
    ("178 coordinates, no reduction, errors ten times", [TEN_TIMES, "reduction%method='none'"], 4, 0),
]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-sweep")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "gearbox.md", help="file to write")
    return parser.parse_args()


def sweep(options, folder, integrator, settings, points):
    """Processor time of a sweep over so many points, s, and its file."""
    text = (BENCH.parent / "inputs" / "test_gearbox.nml").read_text(encoding="utf-8")
    last = FIRST + 1e-9 if points == 1 else LAST
    step = (LAST - FIRST) / max(points - 1, 1)
    text += f"&sweep parameter='rotation%speed_rpm', first={FIRST}, last={last}, step={step} /\n"
    case = folder / "case.nml"
    case.write_text(text, encoding="utf-8")
    output = folder / f"{integrator}.h5"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [options.razy_bin / "razy-sweep", case, "--force", "--output", output]
    for word in [f"motion%integrator='{integrator}'", *settings]:
        command += ["--set", word]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime, output


def time_of_point(options, folder, integrator, settings, points):
    alone = min(sweep(options, folder, integrator, settings, 1)[0] for _ in range(3 if points > 4 else 1))
    whole = min(sweep(options, folder, integrator, settings, points)[0] for _ in range(3 if points > 4 else 1))
    return (whole - alone) / (points - 1)


def extrema(output):
    with h5py.File(output) as file:
        offset = file["extrema/mesh_deformation/offset"][:]
        value = file["extrema/mesh_deformation/value"][:]
        speed = np.round(file["axis/rotation.speed_rpm"][:], 6)
        events = file["point/events"][:]
    return {s: value[offset[i] : offset[i + 1]] for i, s in enumerate(speed)}, events


def error(first, second):
    """Largest difference of extrema at the speeds that both have; nan if their numbers differ."""
    worst = 0.0
    for speed in set(first) & set(second):
        a, b = first[speed], second[speed]
        worst = max(worst, np.abs(a - b).max() / np.abs(b).max()) if len(a) == len(b) else np.nan
    return worst


def row(options, folder, what, settings, points, fewer):
    exact = time_of_point(options, folder, "exact", settings, points)
    found, events = extrema(folder / "exact.h5")
    start = f"| {what} | {events.min()}–{events.max()} | {1e3 * exact:.1f} |"
    if fewer == 0:
        return f"{start} | | |"
    other = time_of_point(options, folder, "dop853", settings, fewer)
    reference, _ = extrema(folder / "dop853.h5")
    return f"{start} {1e3 * other:.0f} | {other / exact:.0f} | {error(found, reference):.1e} |"


def main():
    options = arguments()
    options.razy_bin = options.razy_bin.resolve()
    place = machine()
    with tempfile.TemporaryDirectory() as name:
        rows = [row(options, Path(name), *case) for case in CASES]
    lines = [
        "# Motions of the test gearbox",
        "",
        f"Made by `bench/gearbox.py` on {datetime.date.today().isoformat()}. {place['cpu']}, {place['cores']} cores, "
        f"load at the start {place['load']:.1f}; {versions(options.razy_bin).get('razy')}. "
        f"\n0.3 s of motion a point, {FIRST:.0f} to {LAST:.0f} rpm, processor time of one core;\nDOP853 with events at "
        "its default tolerance of 1e-9.",
        "",
        "| case | events a point | `exact`, ms | DOP853, ms | ratio | difference of the extrema |",
        "|---|---|---|---|---|---|",
        *rows,
        "",
    ]
    options.report.parent.mkdir(parents=True, exist_ok=True)
    options.report.write_text("\n".join(lines), encoding="utf-8")
    print(options.report.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
