#!/usr/bin/env python3
"""A sweep on 256 to 4096 ranks, simulated event by event: report in bench/report/cluster.md.

    bench/cluster.py --razy-bin FOLDER

The protocol is that of src/sweep: rank 0 only manages, serves one message after the other, hands out chunks of what
remains divided by (8 x ranks), and, of short points, at least as many as keep a rank busy for 10 us x ranks, but no
more than what remains divided by (2 x ranks); a worker asks for its next chunk when it begins one, and sends results
every 0.1 s or when they fill 32 KB. Up to 32 ranks rank 0 computes points too, which is left out here.

Measured here, between two ranks on two cores, by bench/messages.c: what rank 0 spends on taking and on posting a
message, and on each word of a longer one; through shared memory, taken for a network whose card moves messages, and
through TCP on the loopback device. A result costs rank 0 the checkpoint besides (bench/README.md): of 2.9 KB, as of
the gear pair, 2.2 us; of 0.5 KB, as of a mass between stops, 0.5 us. The spread of costs is that of the gear pair:
the processor time of each of 401 speeds, the least of several runs, in their order, each repeated, and scaled to the
mean asked for; so costly points stand side by side. `random` are the same costs in random order.

Assumptions: a message is under way for 2 us (InfiniBand) or 30 us (TCP); these costs hold whatever the number of ranks
and the load of the network; no rank is slower than another; all start at once. A network between machines was not
measured.
"""

import argparse
import datetime
import heapq
import itertools
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

BENCH = Path(__file__).resolve().parent
SEND_INTERVAL = 0.1
PACKET_WORDS = 4096
LARGEST_CHUNK = 1024
SHARES = 8
REQUEST_TIME = 10e-6
NETWORKS = {"InfiniBand": ("vader", 2e-6), "TCP": ("tcp", 30e-6)}
# Words of a result, and what the checkpoint spends on it, s.
RESULTS = {"2.9 KB": (370, 2.2e-6), "0.5 KB": (60, 0.5e-6)}
SWEEPS = ((100_000, 0.020), (1_000_000, 0.020), (1_000_000, 0.001))


@dataclass(frozen=True)
class Costs:
    """What a message costs: rank 0 takes one, each word of it, rank 0 posts one, and it is under way, s."""

    take: float
    word: float
    post: float
    latency: float


def simulate(costs, ranks, messages, result, request_time):
    """Return the time from start to the last result on rank 0, s, and the share of it in which rank 0 is at work."""
    total = np.concatenate(([0.0], np.cumsum(costs))).tolist()
    points, following = costs.size, 0
    words, checkpoint = result
    collect = checkpoint + words * messages.word
    idle_from, ready, held, sent, unit = 0.0, [0.0] * ranks, [0] * ranks, [0.0] * ranks, [0.0] * ranks
    served, end, latency = 0.0, 0.0, messages.latency
    queue = [(latency, 0, worker, 0.0, 0) for worker in range(1, ranks)]
    heapq.heapify(queue)
    while queue:
        time, kind, worker, first, count = heapq.heappop(queue)
        if kind == 0:
            idle_from = max(time, idle_from) + messages.take + messages.post
            served += messages.take + messages.post
            left = points - following
            share = left // (SHARES * ranks)
            if first > 0:
                share = max(share, min(left // (2 * ranks), int(request_time * ranks / first)))
            count = min(left, max(1, min(LARGEST_CHUNK, share)))
            heapq.heappush(queue, (idle_from + latency, 1, worker, following, count))
            following += count
        elif kind == 1:
            begin = max(time, ready[worker])
            if count == 0:
                heapq.heappush(queue, (begin + latency, 2, worker, held[worker], 0))
                continue
            heapq.heappush(queue, (begin + latency, 0, worker, unit[worker], 0))
            ready[worker] = begin + total[first + count] - total[first]
            unit[worker] = (ready[worker] - begin) / count
            held[worker] += count
            if ready[worker] - sent[worker] >= SEND_INTERVAL or held[worker] * words >= PACKET_WORDS:
                heapq.heappush(queue, (ready[worker] + latency, 2, worker, held[worker], 0))
                held[worker], sent[worker] = 0, ready[worker]
        else:
            idle_from = max(time, idle_from) + messages.take + first * collect
            served += messages.take + first * collect
            end = max(end, idle_from)
    return end, served / end


def measured_costs(folder, rounds=9):
    """Processor time of each speed of the gear pair, s, the least of several runs."""
    return np.min([times_of_a_run(folder) for _ in range(rounds)], axis=0)


def times_of_a_run(folder):
    """Processor time of each point, s."""
    with tempfile.TemporaryDirectory() as place:
        output = Path(place) / "pair.h5"
        case = BENCH.parent / "inputs" / "torsional_gear_pair.nml"
        command = [folder / "razy-sweep", case, "--set", "sweep%processor_time=.true.", "--output", output]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with h5py.File(output) as file:
            return file["point/processor_time"][:]


def measured_messages(network, rounds):
    """Costs of a message on rank 0."""
    transport, latency = NETWORKS[network]
    with tempfile.TemporaryDirectory() as place:
        program = Path(place) / "messages"
        subprocess.run(["mpicc", "-O2", "-o", program, BENCH / "messages.c"], check=True)
        command = ["mpirun", "-n", "2", "--mca", "btl", f"{transport},self", program, str(rounds)]
        allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        done = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ | allow)
    found = {name: float(value) for name, value in (line.split() for line in done.stdout.splitlines())}
    word = max(0.0, found["serve_4096"] - found["serve_2"]) / 4094
    return Costs(found["serve_2"], word, found["send_2"], latency)


def table(spread, costs):
    lines = [
        "| network | points | mean, ms | result | order | ranks | efficiency, % | rank 0, % | single points, % |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for network, (points, mean), result in itertools.product(costs, SWEEPS, RESULTS):
        values = np.repeat(spread, -(-points // spread.size))[:points]
        values *= mean / values.mean()
        for order in ("measured", "random"):
            if order == "random":
                values = np.random.default_rng(1).permutation(values)
            for ranks in (256, 1000, 4096):
                end, work = simulate(values, ranks, costs[network], RESULTS[result], REQUEST_TIME)
                before, _ = simulate(values, ranks, costs[network], RESULTS[result], 0.0)
                row = [network, points, f"{1000 * mean:g}", result, order, ranks]
                shares = (values.sum() / (ranks * end), work, values.sum() / (ranks * before))
                row += [f"{100 * value:.1f}" for value in shares]
                lines.append(f"| {' | '.join(map(str, row))} |")
                print(lines[-1], flush=True)
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-sweep")
    parser.add_argument("--rounds", type=int, default=200, help="messages of each of 50 batches")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "cluster.md", help="file to write")
    options = parser.parse_args()
    costs = {network: measured_messages(network, options.rounds) for network in NETWORKS}
    spread = measured_costs(options.razy_bin.resolve())
    about = __doc__.split("\n\n")
    lines = [
        "# Sweeps on many ranks, simulated",
        "",
        f"Made by `bench/cluster.py` on {datetime.date.today().isoformat()}, load {os.getloadavg()[0]:.1f} on "
        f"{os.cpu_count()} cores. No run on a cluster is behind this.",
        "",
        *about[2:],
        "| network | taken by rank 0, us | each word of it, ns | posted by rank 0, us | under way, us (assumed) |",
        "|---|---|---|---|---|",
        *(
            f"| {name} | {1e6 * cost.take:.2f} | {1e9 * cost.word:.2f} | {1e6 * cost.post:.2f} | "
            f"{1e6 * cost.latency:g} |"
            for name, cost in costs.items()
        ),
        "",
        f"The costliest point took {1000 * spread.max():.3f} ms, the cheapest {1000 * spread.min():.3f} ms, "
        f"the mean {1000 * spread.mean():.3f} ms: {spread.max() / spread.mean():.1f} and "
        f"{spread.min() / spread.mean():.2f} times the mean.",
        "Efficiency counts all ranks, rank 0 too;",
        "`single points` is that of the protocol without the 10 us, in which short points are handed out one by one "
        "at the end.",
        "",
        *table(spread, costs),
        "",
    ]
    options.report.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main()
