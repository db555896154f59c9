#!/usr/bin/env python3
"""Two ranks beside one, and memory beside the number of points: report in bench/report/ranks.md.

    bench/ranks.py --razy-bin FOLDER

A sweep of 16001 speeds runs on one rank and on two in turn; the time is what razy-sweep prints. Memory is the largest
resident set of the process, of 401 and of 16001 speeds, beside the size of the result.
"""

import argparse
import datetime
import os
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from run import BENCH, machine, versions

CASE = BENCH.parent / "inputs" / "torsional_gear_pair.nml"
SPEEDS = {401: "4.0", 16001: "0.1"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-sweep")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each number of ranks, in turn")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "ranks.md", help="file to write")
    return parser.parse_args()


def sweep(options, points, output, ranks):
    """Run a sweep; return the elapsed time that it prints, s, and how busy its ranks were, %."""
    command = [str(options.razy_bin / "razy-sweep"), str(CASE), "--set", f"sweep%step={SPEEDS[points]}"]
    command = ["mpirun", "-n", str(ranks), *command, "--output", str(output), "--force"]
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | allow)
    words = re.search(r": (\d+) points, 0 failed, ([\d.]+) s, ranks busy ([\d.]+) %", done.stdout + done.stderr)
    if done.returncode != 0 or not words or int(words[1]) != points:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout[-500:]}{done.stderr[-500:]}")
    return float(words[2]), float(words[3])


def peak_memory(options, points, output):
    """The largest resident set of one rank, bytes, seen by a process that starts nothing else."""
    command = [str(options.razy_bin / "razy-sweep"), str(CASE), "--set", f"sweep%step={SPEEDS[points]}"]
    command += ["--output", str(output), "--force"]
    code = (
        "import resource, subprocess, sys\n"
        "subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)\n"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", code, *command], capture_output=True, text=True, check=True)
    return 1024 * int(done.stdout)


def markdown(options, place, times, busy, memory, size):
    ratios = [one / two for one, two in zip(times[1], times[2], strict=True)]
    one, two = (statistics.median(times[ranks]) for ranks in (1, 2))
    growth = (memory[16001] - memory[401]) / (size[16001] - size[401])
    each = ", ".join(f"{ratio:.2f}" for ratio in ratios)
    lines = [
        "# Ranks and memory",
        "",
        f"Made by `bench/ranks.py` on {datetime.date.today().isoformat()}. {place['cpu']}, {place['cores']} cores, "
        f"load at the start {place['load']:.1f}; {versions(options.razy_bin).get('razy')}.",
        "",
        "## Two ranks",
        f"The gear pair at 16001 speeds, 1000 to 2600 rpm. Elapsed time as razy-sweep prints it, median of "
        f"{options.rounds} runs of each in turn, without start-up and writing.",
        "",
        "| ranks | elapsed, s | fastest, s | busy, % | to one rank |",
        "|---|---|---|---|---|",
        f"| 1 | {one:.3f} | {min(times[1]):.3f} | {statistics.median(busy[1]):.1f} | 1 |",
        f"| 2 | {two:.3f} | {min(times[2]):.3f} | {statistics.median(busy[2]):.1f} | {one / two:.2f} |",
        "",
        f"The ratio in each round: {each}. Other load on the two cores weighs on two ranks more than on one.",
        "",
        "## Memory",
        "",
        "| points | largest resident set, MB | result file, MB |",
        "|---|---|---|",
        *(f"| {points} | {memory[points] / 1e6:.1f} | {size[points] / 1e6:.1f} |" for points in SPEEDS),
        "",
        f"Memory grows by {growth:.2f} bytes for each byte of the result.",
        "",
    ]
    return "\n".join(lines)


def main():
    options = arguments()
    options.razy_bin = options.razy_bin.resolve()
    place = machine()
    times, busy, memory, size = {1: [], 2: []}, {1: [], 2: []}, {}, {}
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "result.h5"
        for points in SPEEDS:
            memory[points] = peak_memory(options, points, output)
            size[points] = output.stat().st_size
        for _ in range(options.rounds):
            for ranks, found in times.items():
                elapsed, share = sweep(options, 16001, output, ranks)
                found.append(elapsed)
                busy[ranks].append(share)
                print(f"{ranks} ranks: {elapsed:.3f} s, busy {share:.1f} %, load {os.getloadavg()[0]:.1f}", flush=True)
    options.report.parent.mkdir(parents=True, exist_ok=True)
    options.report.write_text(markdown(options, place, times, busy, memory, size), encoding="utf-8")
    print(options.report.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
