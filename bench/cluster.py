#!/usr/bin/env python3
"""A sweep on 16 to 4096 ranks, simulated event by event: report in bench/report/cluster.md.

    bench/cluster.py --razy-bin FOLDER [--message SECONDS] [--collect SECONDS] [--latency SECONDS]

The protocol is that of src/sweep: rank 0 only manages, serves one message after the other, hands out chunks of what
remains divided by (shares x ranks); a worker asks for its next chunk when it begins one, and sends results every 0.1 s.
Up to 32 ranks rank 0 computes points too, which is left out here.

Assumptions: a message costs rank 0 `message` on each of receiving and sending, a result `collect` besides, and is under
way for `latency`, whatever the number of ranks and the load of the network; no rank is slower than another; all start
at once. The spread of costs is that of the gear pair: steps of the search at each of 401 speeds, in their order, each
repeated, and scaled to the mean asked for; so costly points stand side by side. `random` are the same costs in random
order. What a message and a result cost was measured on a shared machine with two cores (bench/README.md); the latency
is a guess for a network.
"""

import argparse
import datetime
import heapq
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np

BENCH = Path(__file__).resolve().parent
SEND_INTERVAL = 0.1
LARGEST_CHUNK = 1024


def simulate(costs, ranks, shares, message, collect, latency, ahead=True):
    """Return the time from start to the last result on rank 0, s, and the share of it in which rank 0 is at work."""
    total = np.concatenate(([0.0], np.cumsum(costs)))
    points, following = costs.size, 0
    idle_from, ready, held, sent = 0.0, [0.0] * ranks, [0] * ranks, [0.0] * ranks
    served, end = 0.0, 0.0
    queue = [(latency, 0, worker, 0, 0) for worker in range(1, ranks)]
    heapq.heapify(queue)
    while queue:
        time, kind, worker, first, count = heapq.heappop(queue)
        if kind == 0:
            idle_from = max(time, idle_from) + 2 * message
            served += 2 * message
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
            idle_from = max(time, idle_from) + message + first * collect
            served += message + first * collect
            end = max(end, idle_from)
    return end, served / end


def measured_costs(folder):
    """Steps of the search at each speed of the gear pair."""
    with tempfile.TemporaryDirectory() as place:
        output = Path(place) / "pair.h5"
        case = BENCH.parent / "inputs" / "torsional_gear_pair.nml"
        subprocess.run([folder / "razy-sweep", case, "--output", output], check=True, capture_output=True)
        with h5py.File(output) as file:
            return file["point/steps"][()].astype(float)


def table(spread, options):
    lines = [
        "| points | mean, ms | order | ranks | shares | efficiency, % | rank 0 at work, % | bound, % |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for points, mean in ((100_000, 0.020), (1_000_000, 0.001)):
        costs = np.repeat(spread, -(-points // spread.size))[:points]
        costs *= mean / costs.mean()
        for order in ("measured", "random"):
            values = costs if order == "measured" else np.random.default_rng(1).permutation(costs)
            for ranks in (16, 64, 256, 1000, 4096):
                bound = min(1.0, values.sum() / (ranks * max(values.max(), values.sum() / (ranks - 1))))
                for shares in (8, 32):
                    end, work = simulate(values, ranks, shares, options.message, options.collect, options.latency)
                    efficiency = 100 * values.sum() / (ranks * end)
                    row = [points, f"{1000 * mean:g}", order, ranks, shares]
                    row += [f"{value:.1f}" for value in (efficiency, 100 * work, 100 * bound)]
                    lines.append(f"| {' | '.join(map(str, row))} |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-sweep")
    parser.add_argument("--message", type=float, default=2e-6, help="cost of a message on rank 0, s")
    parser.add_argument("--collect", type=float, default=6e-6, help="cost of a result on rank 0, s")
    parser.add_argument("--latency", type=float, default=5e-6, help="time that a message is under way, s")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "cluster.md", help="file to write")
    options = parser.parse_args()
    spread = measured_costs(options.razy_bin.resolve())
    about = __doc__.split("\n\n")
    lines = [
        "# Sweeps on many ranks, simulated",
        "",
        f"Made by `bench/cluster.py` on {datetime.date.today().isoformat()}: message {1e6 * options.message:g} us, "
        f"result {1e6 * options.collect:g} us, latency {1e6 * options.latency:g} us. "
        "No run on a cluster is behind this.",
        "",
        *about[2:],
        f"The costliest point takes {spread.max() / spread.mean():.1f} times the mean, the cheapest "
        f"{spread.min() / spread.mean():.2f} times. Efficiency counts all ranks, rank 0 too; "
        "the bound is what the longest point and a rank 0 that does not compute allow.",
        "",
        *table(spread, options),
        "",
    ]
    options.report.write_text("\n".join(lines), encoding="utf-8")
    print(options.report.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
