#!/usr/bin/env python3
"""Rotors of many coordinates and the Campbell diagram of the reduced gearbox: report in bench/report/rotor.md.

    cmake --build build --target measure_modes && bench/rotor.py --razy-bin build/bin

The 50 lowest modes of a pinned shaft by ARPACK, from 600 to 100,002 coordinates, with their errors against theory;
processor time and the largest resident set of the process. 200 speeds of the test gearbox reduced to 48
coordinates, mesh closed.
"""

import argparse
import datetime
import subprocess
import sys
from pathlib import Path

from run import BENCH, machine, versions

ELEMENTS = [100, 1000, 4000, 16667]
SPEEDS = 200

# Runs the program from a process that starts nothing else, whose children's largest resident set is the program's.
RUN = (
    "import resource, subprocess, sys\n"
    "subprocess.run(sys.argv[1:], check=True)\n"
    "print('memory', 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of measure_modes")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "rotor.md", help="file to write")
    return parser.parse_args()


def measured(options, *words):
    command = [sys.executable, "-c", RUN, str(options.razy_bin / "measure_modes"), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return {key: float(value) for key, value in (line.split() for line in done.stdout.splitlines())}


def markdown(options, place, shafts, campbell):
    lines = [
        "# Rotors",
        "",
        f"Made by `bench/rotor.py` on {datetime.date.today().isoformat()}. {place['cpu']}, {place['cores']} cores, "
        f"load at the start {place['load']:.1f}; {versions(options.razy_bin).get('razy')}. "
        "Times are processor times of one core.",
        "",
        "## Lowest 50 modes of a pinned shaft",
        "Errors are the largest of the natural frequencies against theory: the Rayleigh beam, and bars in tension and "
        "torsion. Up to 4000 elements they are those of the discretisation (order 4 and 2).",
        "",
        "| coordinates | assembly, s | modes, s | memory, MB | bending | axial | torsion |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {s['coordinates']:.0f} | {s['assembly']:.3f} | {s['modes']:.2f} | {s['memory'] / 1e6:.0f} "
        f"| {s['bending_error']:.1e} | {s['axial_error']:.1e} | {s['torsional_error']:.1e} |"
        for s in shafts
    ]
    lines += [
        "",
        "## Campbell diagram of the reduced gearbox",
        f"{SPEEDS} speeds, 48 coordinates, mesh closed, circulatory matrix, eigenvalues and shapes: {campbell:.2f} s.",
        "",
    ]
    return "\n".join(lines)


def main():
    options = arguments()
    options.razy_bin = options.razy_bin.resolve()
    place = machine()
    shafts = [measured(options, elements) for elements in ELEMENTS]
    campbell = measured(options, "campbell", SPEEDS)["campbell"]
    options.report.parent.mkdir(parents=True, exist_ok=True)
    options.report.write_text(markdown(options, place, shafts, campbell), encoding="utf-8")
    print(options.report.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
