#!/usr/bin/env python3
"""Rotors of many coordinates and the Campbell diagram of the reduced gearbox: report in bench/report/rotor.md.

    cmake --build build --target programs measure_modes && bench/rotor.py --razy-bin build/bin [--ross-python PYTHON]

The 50 lowest modes of a pinned shaft by ARPACK, from 600 to 100,002 coordinates, with their errors against theory;
processor time and the largest resident set of the process. 200 speeds of the test gearbox reduced to 48
coordinates, mesh closed, by the library and by razy-modes from its input to its file. One shaft of the gearbox in ROSS
(`bench/peers/ross_shaft.py`, in a Python that has it) and here: a Campbell diagram, and a time response.
"""

import argparse
import datetime
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
from run import BENCH, machine, versions

PEER_KEYS = ("campbell", "response", "displacement")
ELEMENTS = [100, 1000, 4000, 16667]
SPEEDS = 200
REPEATS = 3
ROSS_SPEEDS, END, STEP = 10, 0.02, 1e-5

# The shaft of `bench/peers/ross_shaft.py`.
SHAFT = """&scene kind='rotor' /
&shaft name='a', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0 /
&section shaft='a', length=0.06, outer_diameter=0.03, elements=2 /
&section shaft='a', length=0.26, outer_diameter=0.04, elements=10 /
&section shaft='a', length=0.06, outer_diameter=0.03, elements=2 /
&disk shaft='a', node=8, mass=2.3675, polar_inertia=8.0495e-3, diametral_inertia=4.0753e-3 /
&bearing shaft='a', node=3,  kind='matrix', stiffness=3e7,1.75e8,1.75e8,0.0,0.0,0.0,
         damping_matrix=0.0,2e3,2e3,0.0,0.0,0.0 /
&bearing shaft='a', node=13, kind='matrix', stiffness=0.0,7e8,7e8,0.0,0.0,0.0, damping_matrix=0.0,2e3,2e3,0.0,0.0,0.0 /
&unbalance shaft='a', node=8, moment=1e-4 /
&rotation speed_rpm=2864.7889756541161, of='a' /
&modes count=20 /
&campbell last_rpm=57295.779513, points=10, orders=1.0, damped=.true. /
&motion t_end=0.02, start='zero' /
&record observable='displacement', of='a.8.v', what='trajectory', interval=1e-5 /
"""

# A shaft on rolling bearings without reduction: elements, wheel and bearings are filled in.
UNREDUCED = """&scene kind='rotor' /
&shaft name='s', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0, damping_ratio=0.005, damping='nodal' /
&section shaft='s', length=1.0, outer_diameter=0.05, elements={elements} /
&disk shaft='s', node={middle}, mass=10.0, polar_inertia=0.1, diametral_inertia=0.05 /
&bearing shaft='s', node={first}, elements=8, radial_stiffness=4.375e7, axial_stiffness=3.75e6 /
&bearing shaft='s', node={last}, elements=4, radial_stiffness=3.5e7 /
&support shaft='s', node=1, held='phi' /
&rotation speed_rpm=3000.0, of='s', circulatory={damped} /
&modes count=10 /
"""
DIAGRAM = "&campbell last_rpm=20000.0, points=50, damped={damped} /\n"
RESPONSE = """&unbalance shaft='s', node={middle}, moment=1e-4 /
&record observable='displacement', of='s.{middle}.v', what='extrema' /
&response parameter='rotation%speed_rpm', first=100.0, last=20000.0, points=401 /
"""

# Runs the program from a process that starts nothing else, whose children's largest resident set is the program's.
RUN = (
    "import resource, subprocess, sys\n"
    "subprocess.run(sys.argv[1:], check=True)\n"
    "print('memory', 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of measure_modes")
    parser.add_argument("--ross-python", type=Path, help="a Python that has ROSS; without it ROSS is left out")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "rotor.md", help="file to write")
    return parser.parse_args()


def measured(options, *words):
    command = [sys.executable, "-c", RUN, str(options.razy_bin / "measure_modes"), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return {key: float(value) for key, value in (line.split() for line in done.stdout.splitlines())}


def timed(command, folder):
    """Wall and processor time of a program, s: the least of some runs."""
    walls, processors = [], []
    for _ in range(REPEATS):
        wall, processor = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*map(str, command), "--force"], cwd=folder, capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        walls.append(time.perf_counter() - wall)
        processors.append(after.ru_utime + after.ru_stime - processor.ru_utime - processor.ru_stime)
    return min(walls), min(processors)


def programs(options):
    """Lines of the table of razy-modes on the gearbox."""
    case = BENCH.parent / "inputs" / "thesis" / "fig_4_13.nml"
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for compare in ("none", "asked"):
            points = ["--set", f"campbell%points={SPEEDS}", "--set", f"reduction%compare={compare}"]
            wall, processor = timed([options.razy_bin / "razy-modes", case, *points, "--output", "m.h5"], folder)
            words = "diagram, critical speeds, limit" + (", error of the reduction" if compare == "asked" else "")
            lines.append(f"| {words} | {wall:.2f} | {processor:.2f} |")
    return lines


def unreduced(options):
    """Lines of the table of rotors without reduction."""
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for elements in (40, 80, 166):
            times = []
            for text, damped in ((DIAGRAM, ".false."), (DIAGRAM, ".true."), (RESPONSE, ".false.")):
                first = 1 + elements // 10
                numbers = {
                    "elements": elements,
                    "middle": 1 + elements // 2,
                    "first": first,
                    "last": elements + 2 - first,
                }
                case = Path(folder) / "shaft.nml"
                case.write_text((UNREDUCED + text).format(**numbers, damped=damped), encoding="utf-8")
                times.append(timed([options.razy_bin / "razy-modes", case, "--output", "m.h5"], folder)[1])
            lines.append(f"| {elements} | {6 * elements + 5} | " + " | ".join(f"{time:.2f}" for time in times) + " |")
    return lines


def beside_ross(options):
    """Lines of the table beside ROSS; empty without it."""
    if options.ross_python is None:
        return []
    script = BENCH / "peers" / "ross_shaft.py"
    command = [options.ross_python, script, ROSS_SPEEDS, END, STEP]
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([*map(str, command)], cwd=folder, capture_output=True, text=True, check=True)
        found = [line.split() for line in done.stdout.splitlines()]
        ross = {line[0]: float(line[1]) for line in found if len(line) == 2 and line[0] in PEER_KEYS}
        case = Path(folder) / "shaft.nml"
        case.write_text(SHAFT, encoding="utf-8")
        _, campbell = timed([options.razy_bin / "razy-modes", case, "--output", "m.h5"], folder)
        lines = [f"| Campbell diagram, s a speed | {ross['campbell']:.3f} | {campbell / ROSS_SPEEDS:.4f} | - |"]
        for integrator in ("exact", "dop853"):
            chosen = ["--set", f"motion%integrator={integrator}", "--output", "r.h5"]
            _, response = timed([options.razy_bin / "razy-run", case, *chosen], folder)
            with h5py.File(Path(folder) / "r.h5") as file:
                path = np.abs(file["observable/displacement.a.8.v"][()])
            apart = path[len(path) // 2 :].max() / ross["displacement"] - 1
            lines.append(
                f"| response by `{integrator}`, {END} s, s | {ross['response']:.2f} | {response:.3f} | {apart:.1e} |"
            )
    return lines


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
        f"{SPEEDS} speeds, 48 coordinates, mesh closed, circulatory matrix, eigenvalues and shapes by the library: "
        f"{campbell:.2f} s. `razy-modes inputs/thesis/fig_4_13.nml` with as many speeds, from the input to the file, "
        f"the least of {REPEATS} runs:",
        "",
        "| razy-modes | wall, s | processor, s |",
        "|---|---|---|",
        *programs(options),
        "",
    ]
    lines += [
        "## Rotors without reduction",
        "One shaft on two bearings, 10 modes, from the input to the file, s: Campbell diagrams of 50 speeds with "
        "critical speeds and stability limit, undamped, and with damping and circulatory matrix; the response to an "
        "unbalance at 401 speeds.",
        "",
        "| elements | coordinates | undamped | damped | response |",
        "|---|---|---|---|---|",
        *unreduced(options),
        "",
    ]
    peers = beside_ross(options)
    if peers:
        lines += [
            "## Beside ROSS 2.3.0",
            "One shaft of the gearbox with wheel and damped bearings, 90 coordinates, unreduced. The response to an "
            f"unbalance from rest is Newmark's method with {STEP:g} s in ROSS; here by razy-run to the file. "
            "The last column is the relative difference of the largest displacement in the second half.",
            "",
            "| | ROSS | razy | difference |",
            "|---|---|---|---|",
            *peers,
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
