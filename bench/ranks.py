#!/usr/bin/env python3
"""Two ranks beside one, and memory beside the number of points: report in bench/report/ranks.md.

    bench/ranks.py --razy-bin FOLDER

A sweep of 16001 speeds runs on one rank and on two in turn. Elapsed time is what razy-sweep prints; wall time is that
of the whole command, with the start of mpirun and MPI, and the result file; a sweep of two points tells how much of it
the start takes. Memory is the largest resident set of the process, of 401 and of 16001 speeds, beside the size of the
result.
"""

import argparse
import datetime
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from run import BENCH, machine, versions

CASE = BENCH.parent / "inputs" / "torsional_gear_pair.nml"
SPEEDS = {401: "4.0", 16001: "0.1"}
FEWEST = {2: "1600.0"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-sweep")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each number of ranks, in turn")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "ranks.md", help="file to write")
    return parser.parse_args()


def sweep(options, points, output, ranks):
    """Run a sweep; return the elapsed time that it prints, its wall time, and the CPU time of all its processes, s."""
    command = [str(options.razy_bin / "razy-sweep"), str(CASE), "--set", f"sweep%step={(SPEEDS | FEWEST)[points]}"]
    command = ["mpirun", "-n", str(ranks), *command, "--output", str(output), "--force"]
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | allow)
    wall = time.perf_counter() - begun
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = re.search(r": (\d+) points, 0 failed, ([\d.]+) s", done.stdout + done.stderr)
    if done.returncode != 0 or not words or int(words[1]) != points:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout[-500:]}{done.stderr[-500:]}")
    return float(words[2]), wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


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


def markdown(options, place, times, walls, starts, cpu, memory, size):
    ratios = [one / two for one, two in zip(times[1], times[2], strict=True)]
    one, two = (statistics.median(times[ranks]) for ranks in (1, 2))
    wall, begun, spent = (
        {ranks: statistics.median(found[ranks]) for ranks in (1, 2)} for found in (walls, starts, cpu)
    )
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
        "| ranks | elapsed, s | fastest, s | CPU of all processes, s | times one rank | wall, s | two points, s |",
        "|---|---|---|---|---|---|---|",
        f"| 1 | {one:.3f} | {min(times[1]):.3f} | {spent[1]:.3f} | 1 | {wall[1]:.3f} | {begun[1]:.3f} |",
        f"| 2 | {two:.3f} | {min(times[2]):.3f} | {spent[2]:.3f} | {one / two:.2f} | {wall[2]:.3f} | {begun[2]:.3f} |",
        "",
        f"The ratio in each round: {each}.",
        "Other load on the cores takes from two ranks what one does not need: the times count only where the load at "
        "the start is near 0.",
        "By CPU time, which other load hardly changes, two ranks on two free cores are at most "
        f"{2 * spent[1] / spent[2]:.2f} times one rank.",
        "",
        f"By wall time two ranks are {wall[1] / wall[2]:.2f} times one rank: what a sweep of two points takes is the "
        "start of mpirun and MPI, which no number of ranks shortens.",
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
    times, walls, starts, cpu = ({1: [], 2: []} for _ in range(4))
    memory, size = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "result.h5"
        for points in SPEEDS:
            memory[points] = peak_memory(options, points, output)
            size[points] = output.stat().st_size
        for _ in range(options.rounds):
            for ranks, found in times.items():
                elapsed, wall, spent = sweep(options, 16001, output, ranks)
                found.append(elapsed)
                walls[ranks].append(wall)
                starts[ranks].append(sweep(options, 2, output, ranks)[1])
                cpu[ranks].append(spent)
                print(f"{ranks} ranks: {elapsed:.3f} s, CPU {spent:.3f} s, load {os.getloadavg()[0]:.1f}", flush=True)
    options.report.parent.mkdir(parents=True, exist_ok=True)
    options.report.write_text(markdown(options, place, times, walls, starts, cpu, memory, size), encoding="utf-8")
    print(options.report.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
