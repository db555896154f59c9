#!/usr/bin/env python3
"""What a build for a newer processor gains over the default one: report in bench/report/widths.md.

    bench/widths.py [--folder build/widths] [--rounds 5]

razy-sweep is built with the default flags, which every x86-64 processor runs, and for the levels v3 (AVX2) and v4
(AVX-512) without contraction. The builds take turns; the least processor time of each counts, of the whole program.
"""

import argparse
import datetime
import os
import resource
import subprocess
from pathlib import Path

import h5py
import numpy as np

BENCH = Path(__file__).resolve().parent
INPUTS = BENCH.parent / "inputs"
LEVELS = {
    "default": "",
    "x86-64-v3": "-march=x86-64-v3 -ffp-contract=off",
    "x86-64-v4": "-march=x86-64-v4 -ffp-contract=off",
}
# input, what is added to it, settings
CASES = {
    "gear pair, 401 speeds (P3)": (INPUTS / "torsional_gear_pair.nml", "", []),
    "press, 101 frequencies": (INPUTS / "thesis" / "fig_4_30.nml", "", ["sweep%step=0.2"]),
    "test gearbox, errors ten times, 16 speeds": (
        INPUTS / "test_gearbox.nml",
        "&sweep parameter='rotation%speed_rpm', first=1500.0, last=3000.0, step=100.0 /\n",
        ["gear_mesh%error_sine=5e-5,2.5e-5,1.6666666666666667e-5"],
    ),
}


def build(folder, flags):
    """The program razy-sweep for these flags."""
    command = [
        "cmake",
        "-S",
        BENCH.parent,
        "-B",
        folder,
        "-G",
        "Ninja",
        "-DCMAKE_BUILD_TYPE=Release",
        "-DRAZY_TESTS=OFF",
    ]
    subprocess.run([*command, f"-DCMAKE_Fortran_FLAGS={flags}"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder, "--target", "razy-sweep"], check=True, stdout=subprocess.DEVNULL)
    return folder / "bin" / "razy-sweep"


def run(program, case, settings, output):
    """Processor time of one sweep, s."""
    command = [program, case, "--force", "--output", output]
    for word in settings:
        command += ["--set", word]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def values(path):
    """All extrema of a sweep's file."""
    found = []

    def take(name, item):
        if isinstance(item, h5py.Dataset) and name.startswith(("extrema", "statistics")) and item.dtype.kind == "f":
            found.append(item[()])

    with h5py.File(path) as file:
        file.visititems(take)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=BENCH.parent / "build" / "widths")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    load = os.getloadavg()[0]
    programs = {name: build(options.folder / name, flags) for name, flags in LEVELS.items()}
    lines = [
        "# Builds for newer processors",
        "",
        f"Made by `bench/widths.py` on {datetime.date.today()}, load {load:.1f} on {os.cpu_count()} cores.",
        "Processor time of the whole program, the least of several runs that take turns.",
        "",
        "| case | " + " | ".join(f"{name}, s" for name in LEVELS) + " | default to the fastest | same bits |",
        "|---" * (len(LEVELS) + 3) + "|",
    ]
    path = options.folder / "case.nml"
    for case, (source, added, settings) in CASES.items():
        path.write_text(source.read_text(encoding="utf-8") + added, encoding="utf-8")
        times = dict.fromkeys(LEVELS, float("inf"))
        for _ in range(options.rounds):
            for name, program in programs.items():
                times[name] = min(times[name], run(program, path, settings, options.folder / f"{name}.h5"))
        first, *others = [values(options.folder / f"{name}.h5") for name in LEVELS]
        same = all(np.array_equal(a, b, equal_nan=True) for other in others for a, b in zip(first, other, strict=True))
        ratio = times["default"] / min(times.values())
        lines.append(
            f"| {case} | "
            + " | ".join(f"{t:.3f}" for t in times.values())
            + f" | {ratio:.2f} | {'yes' if same else 'no'} |"
        )
    report = BENCH / "report" / "widths.md"
    report.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
