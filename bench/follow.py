#!/usr/bin/env python3
"""What periodic motions cost: branches, Lyapunov exponents, and the period map with its derivative beside heyoka's.

    bench/follow.py [--razy-bin FOLDER] [--rounds N]     report in bench/report/follow.md

razy's times are processor times of whole programs, start and result file with them, the least of the rounds. Those of
the map are differences of runs with and without tangents, over so many periods that the rest does not count; the start
of the program is taken off those of the motion. The peer is peers/heyoka_variational.py.
"""

import argparse
import datetime
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

BENCH = Path(__file__).resolve().parent
INPUTS = BENCH.parent / "inputs"
PAIR, GEARBOX = INPUTS / "torsional_gear_pair.nml", INPUTS / "test_gearbox.nml"
SPEED, PERIODS = 2500.0, 4000


def call(program, case, output, **settings):
    """Processor time, s, of a program with these settings."""
    command = [program, case, "--output", output, "--force"]
    command += [word for key, value in settings.items() for word in ("--set", f"{key.replace('__', '%')}={value!r}")]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def branch(folder, case, output, rounds, **settings):
    """Least processor time, s, of razy-follow, and its motions and special points."""
    seconds = min(call(folder / "razy-follow", case, output, **settings) for _ in range(rounds))
    with h5py.File(output) as file:
        return seconds, len(file["point/branch"]), len(file["special/label"])


def motion(folder, output, rounds, periods, exponents):
    """Least processor time, s, of razy-run: `periods` to settle, as many for the exponents."""
    t_end = periods * 60.0 / 40 / SPEED
    settings = {"rotation__speed_rpm": SPEED, "motion__t_end": t_end, "record__from": 0.999 * t_end}
    if exponents:
        settings |= {"motion__lyapunov": exponents, "motion__lyapunov_periods": periods}
    # No program overwrites what another one wrote.
    output = output.with_name("motion.h5")
    return min(call(folder / "razy-run", PAIR, output, **settings) for _ in range(rounds))


def peer(rounds):
    """Least processor times, s, of the motion and with its derivative, and the moduli of the multipliers."""
    command = [sys.executable, str(BENCH / "peers" / "heyoka_variational.py"), str(SPEED), str(PERIODS)]
    found = []
    for _ in range(rounds):
        lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
        found.append({name: [float(word) for word in words] for name, *words in map(str.split, lines)})
    return *(min(one[name][0] for one in found) for name in ("motion", "derivative")), np.array(found[0]["moduli"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin")
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    folder, rounds = arguments.razy_bin, arguments.rounds
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory() as temporary:
        output = Path(temporary) / "output.h5"
        rows = [
            ("gear pair, period 1 over 1000 to 2600 rpm", branch(folder, PAIR, output, rounds, follow__doublings=0)),
            ("the same with the branches of period 2", branch(folder, PAIR, output, rounds)),
            ("test gearbox, 48 coordinates, 1700 to 1850 rpm", branch(folder, GEARBOX, output, 1)),
        ]
        start = motion(folder, output, rounds, 10, 0)
        razy = {n: motion(folder, output, rounds, PERIODS, n) for n in (0, 1, 4)}
        theirs = peer(rounds)
        call(folder / "razy-follow", PAIR, output, follow__first=SPEED, follow__last=SPEED - 1.0)
        with h5py.File(output) as file:
            moduli = np.sort(np.hypot(*file["point/multiplier"][0]))
    per = 1e6 / PERIODS
    plain, derivative = (razy[0] - start) * per, (razy[4] - start) * per - (razy[0] - start) * per
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=BENCH, capture_output=True, text=True, check=True
    )
    lines = [
        "# Periodic motions: what they cost",
        "",
        f"`bench/follow.py`, {datetime.date.today().isoformat()}, commit {commit.stdout.strip()}, one core, "
        f"least of {rounds} rounds.",
        "",
        "| branches | motions | points located | processor time, s | ms a motion |",
        "|---|---|---|---|---|",
        *(f"| {name} | {n} | {special} | {s:.2f} | {1e3 * s / n:.1f} |" for name, (s, n, special) in rows),
        "",
        f"One period of the excitation of the gear pair at {SPEED:.0f} rpm, mean over {PERIODS}:",
        "",
        "| what | razy, µs | heyoka, µs | ratio |",
        "|---|---|---|---|",
        f"| the motion | {plain:.2f} | {theirs[0] * per:.2f} | {theirs[0] * per / plain:.1f} |",
        f"| the motion and its derivative, four columns | {derivative:.2f} | {theirs[1] * per:.2f} | "
        f"{theirs[1] * per / derivative:.1f} |",
        f"| the motion and one tangent | {(razy[1] - razy[0]) * per:.2f} | | |",
        "",
        "Beside the plain run, one that goes on for as many periods with tangents takes "
        f"{razy[1] / razy[0]:.2f} times as long for the largest Lyapunov exponent, {razy[4] / razy[0]:.2f} times "
        "for all four;",
        f"a period with one tangent takes {(razy[1] - razy[0]) * per / plain:.2f} times one without.",
        f"The moduli of the Floquet multipliers by both differ by at most {np.abs(moduli - theirs[2]).max():.1e}.",
    ]
    (BENCH / "report" / "follow.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
