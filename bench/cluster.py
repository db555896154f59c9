#!/usr/bin/env python3
"""A sweep on 16 to 4096 ranks, simulated event by event: report in bench/report/cluster.md.

    bench/cluster.py --razy-bin FOLDER [--collect SECONDS]

The protocol is that of src/sweep: rank 0 only manages, serves one message after the other, hands out chunks of what
remains divided by (shares x ranks); a worker asks for its next chunk when it begins one, and sends results every 0.1 s.
Up to 32 ranks rank 0 computes points too, which is left out here.

Measured here, between two ranks on two cores, by bench/messages.c: what rank 0 spends on taking and on posting a
message of two words, and how long one is under way; once through shared memory and once through TCP on the loopback
device, as a fast network and a slow one. A result costs rank 0 `collect` besides: unpacking and the checkpoint
(bench/README.md). The spread of costs is that of the gear pair: seconds that each of 401 speeds took, the least of
several runs, in their order, each repeated, and scaled to the mean asked for; so costly points stand side by side.
`random` are the same costs in random order.

Assumptions: these costs hold whatever the number of ranks and the load of the network; no rank is slower than another;
all start at once. A network between machines was not measured.
"""

import argparse
import datetime
import heapq
import itertools
import os
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

BENCH = Path(__file__).resolve().parent
SEND_INTERVAL = 0.1
LARGEST_CHUNK = 1024
SHARES = 8
# Of the checkpoint: a mark; words of a record before the number of the point, and before its time in ns.
MARK = -7070701
PLACE_OF_POINT, PLACE_OF_TIME = 5 + 3, 5 + 4
TRANSPORTS = {"vader": "shared memory", "tcp": "TCP"}


@dataclass(frozen=True)
class Costs:
    """What a message costs: rank 0 takes one, posts one, and it is under way, s."""

    take: float
    post: float
    latency: float


def simulate(costs, ranks, shares, messages, collect, ahead=True):
    """Return the time from start to the last result on rank 0, s, and the share of it in which rank 0 is at work."""
    total = np.concatenate(([0.0], np.cumsum(costs)))
    points, following = costs.size, 0
    idle_from, ready, held, sent = 0.0, [0.0] * ranks, [0] * ranks, [0.0] * ranks
    served, end, latency = 0.0, 0.0, messages.latency
    queue = [(latency, 0, worker, 0, 0) for worker in range(1, ranks)]
    heapq.heapify(queue)
    while queue:
        time, kind, worker, first, count = heapq.heappop(queue)
        if kind == 0:
            idle_from = max(time, idle_from) + messages.take + messages.post
            served += messages.take + messages.post
            count = min(points - following, max(1, min(LARGEST_CHUNK, (points - following) // (shares * ranks))))
            heapq.heappush(queue, (idle_from + latency, 1, worker, following, count))
            following += count
        elif kind == 1:
            begin = max(time, ready[worker])
            if count == 0:
                heapq.heappush(queue, (begin + latency, 2, worker, held[worker], 0))
                continue
            ready[worker] = begin + total[first + count] - total[first]
            held[worker] += count
            ask = begin if ahead else ready[worker]
            heapq.heappush(queue, (ask + latency, 0, worker, 0, 0))
            if ready[worker] - sent[worker] >= SEND_INTERVAL:
                heapq.heappush(queue, (ready[worker] + latency, 2, worker, held[worker], 0))
                held[worker], sent[worker] = 0, ready[worker]
        else:
            idle_from = max(time, idle_from) + messages.take + first * collect
            served += messages.take + first * collect
            end = max(end, idle_from)
    return end, served / end


def measured_costs(folder, rounds=9):
    """Seconds that each speed of the gear pair took, the least of several runs."""
    return np.min([times_of_a_run(folder) for _ in range(rounds)], axis=0)


def times_of_a_run(folder):
    """Seconds of each point, from the checkpoint, which can be read after it was deleted (docs/file_format.md)."""
    with tempfile.TemporaryDirectory() as place:
        output = Path(place) / "pair.h5"
        checkpoint = Path(f"{output}.checkpoint")
        case = BENCH.parent / "inputs" / "torsional_gear_pair.nml"
        command = [folder / "razy-sweep", case, "--output", output]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
            while not checkpoint.exists() and run.poll() is None:
                time.sleep(0.001)
            with checkpoint.open("rb") as file:
                run.wait()
                words = np.frombuffer(file.read(), dtype="<i8")
    times, place = {}, 4 + int(words[2]) + 1
    while place < words.size:
        if words[place] == MARK:
            place += 3
            continue
        point, nanoseconds = words[place + PLACE_OF_POINT], words[place + PLACE_OF_TIME]
        times[int(point)] = 1e-9 * nanoseconds
        place += int(words[place]) + 2
    return np.array([times[point] for point in sorted(times)])


def measured_messages(transport, rounds):
    """Costs of a message of two words on rank 0, taking and posting, and the time it is under way, s."""
    with tempfile.TemporaryDirectory() as place:
        program = Path(place) / "messages"
        subprocess.run(["mpicc", "-O2", "-o", program, BENCH / "messages.c"], check=True)
        command = ["mpirun", "-n", "2", "--mca", "btl", f"{transport},self", program, str(rounds)]
        allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        done = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ | allow)
    found = {name: float(value) for name, value in (line.split() for line in done.stdout.splitlines())}
    return Costs(found["serve_2"], found["send_2"], found["trip_2"])


def table(spread, costs, options):
    lines = [
        "| messages | points | mean, ms | order | ranks | efficiency, % | rank 0 at work, % | bound, % |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for transport, (points, mean) in itertools.product(costs, ((100_000, 0.020), (1_000_000, 0.001))):
        values = np.repeat(spread, -(-points // spread.size))[:points]
        values *= mean / values.mean()
        for order in ("measured", "random"):
            if order == "random":
                values = np.random.default_rng(1).permutation(values)
            for ranks in (16, 64, 256, 1000, 4096):
                bound = min(1.0, values.sum() / (ranks * max(values.max(), values.sum() / (ranks - 1))))
                end, work = simulate(values, ranks, SHARES, costs[transport], options.collect)
                row = [TRANSPORTS[transport], points, f"{1000 * mean:g}", order, ranks]
                row += [f"{100 * value:.1f}" for value in (values.sum() / (ranks * end), work, bound)]
                lines.append(f"| {' | '.join(map(str, row))} |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-sweep")
    parser.add_argument("--collect", type=float, default=6e-6, help="cost of a result on rank 0, s")
    parser.add_argument("--rounds", type=int, default=200, help="messages of each of 50 batches")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "cluster.md", help="file to write")
    options = parser.parse_args()
    costs = {transport: measured_messages(transport, options.rounds) for transport in TRANSPORTS}
    spread = measured_costs(options.razy_bin.resolve())
    about = __doc__.split("\n\n")
    lines = [
        "# Sweeps on many ranks, simulated",
        "",
        f"Made by `bench/cluster.py` on {datetime.date.today().isoformat()}, load {os.getloadavg()[0]:.1f} on "
        f"{os.cpu_count()} cores. No run on a cluster is behind this.",
        "",
        *about[2:],
        "| messages | taken by rank 0, us | posted by rank 0, us | under way, us | a result, us |",
        "|---|---|---|---|---|",
        *(
            f"| {TRANSPORTS[name]} | {1e6 * cost.take:.2f} | {1e6 * cost.post:.2f} | {1e6 * cost.latency:.2f} | "
            f"{1e6 * options.collect:g} |"
            for name, cost in costs.items()
        ),
        "",
        f"The costliest point took {1000 * spread.max():.3f} ms, the cheapest {1000 * spread.min():.3f} ms, "
        f"the mean {1000 * spread.mean():.3f} ms: {spread.max() / spread.mean():.1f} and "
        f"{spread.min() / spread.mean():.2f} times the mean. Efficiency counts all ranks, rank 0 too; "
        "the bound is what the longest point and a rank 0 that does not compute allow.",
        "",
        *table(spread, costs, options),
        "",
    ]
    options.report.write_text("\n".join(lines), encoding="utf-8")
    print(options.report.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
