#!/usr/bin/env python3
"""Forces that are not piecewise linear: DOP853 with events beside GSL, Boost.odeint and SUNDIALS, at equal error.

Two motions: the gear pair with Hertz flanks (peers/gear_pair.h), an oscillator between Hunt-Crossley stops
(peers/hunt_crossley.h). Every code and tolerance in turn, several rounds; the least processor time of each counts.
Every code gets the machine in the coordinates that a user types (four of the gear pair).
The reference is GSL's rk8pd at 1e-13; razy at 1e-13 says how far it can be trusted.

bench/smooth.py [--rounds N]     report in bench/report/smooth.md
"""

import argparse
import datetime
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from harness import programs

BENCH = Path(__file__).resolve().parent
CASES = {
    "hertz": (3000, "full", "gear pair, Hertz flanks"),
    "hunt_crossley": (300, "relative", "oscillator, Hunt–Crossley stops"),
}
TOLERANCES = [f"{digit}e-{power}" for power in range(6, 14) for digit in (3, 1)]
METHODS = {
    "razy, DOP853 with events": None,
    "GSL, rk8pd": ("gsl", "rk8pd:{form}:{tolerance}"),
    "Boost.odeint, fehlberg78": ("odeint", "fehlberg78:{form}:{tolerance}"),
    "Boost.odeint, dopri5": ("odeint", "dopri5:{form}:{tolerance}"),
    "ARKODE, dopri5": ("sundials", "dopri5:{form}:events:{tolerance}"),
    "CVODE, Adams": ("sundials", "adams:{form}:events:{tolerance}"),
}
BOUNDS = (1e-5, 1e-6, 1e-7, 1e-8)


def run(build, method, case, tolerance, output):
    """Processor time, s, number of events, and d at 2001 times."""
    speed, form = str(CASES[case][0]), CASES[case][1]
    if METHODS[method] is None:
        command = [build / "smooth", case, tolerance, speed, output]
    else:
        program, setting = METHODS[method]
        command = [
            build / f"{program}_{case}",
            "p2",
            setting.format(form=form, tolerance=tolerance),
            speed,
            speed,
            "1",
            output,
        ]
    subprocess.run([str(word) for word in command], check=True)
    words = [line.split() for line in Path(output).read_text(encoding="utf-8").splitlines()]
    facts = {word[1]: float(word[2]) for word in words if word[0] == "#"}
    return facts["cpu"], int(facts["events"]), np.array([float(word[2]) for word in words if word[0] == "d"])


def measure(build, case, rounds):
    """Least time, error and events of every method and tolerance; the difference of razy from the reference."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "output"
        _, events, reference = run(build, "GSL, rk8pd", case, "1e-13", output)
        for _ in range(rounds):
            for tolerance in TOLERANCES:
                for method in METHODS:
                    cpu, count, d = run(build, method, case, tolerance, output)
                    error = np.abs(d - reference).max() / np.abs(reference).max()
                    least = min(cpu, found.get((method, tolerance), (np.inf,))[0])
                    found[method, tolerance] = (least, error, count)
    return found, events, found["razy, DOP853 with events", "1e-13"][1]


def table(found):
    """For each method the least time, ms, with an error of at most each bound, and how many times razy's that is."""
    head = "| code | " + " | ".join(f"error ≤ {bound:.0e}" for bound in BOUNDS) + " |"
    lines = [head, "|---|" + "---|" * len(BOUNDS)]
    best = {}
    for method in METHODS:
        cells = []
        for bound in BOUNDS:
            fit = [row[0] for (name, _), row in found.items() if name == method and row[1] <= bound]
            best[method, bound] = min(fit, default=np.nan)
            ratio = best[method, bound] / best["razy, DOP853 with events", bound]
            cells.append(f"{1e3 * best[method, bound]:.1f} ms, {ratio:.2f}" if fit else "–")
        lines.append(f"| {method} | " + " | ".join(cells) + " |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--build", type=Path, default=BENCH.parent / "build" / "bench")
    options = parser.parse_args()
    build = options.build.resolve()
    if missing := programs.make("smooth", build):
        sys.exit(missing)
    lines = ["# Contact forces that are not piecewise linear", ""]
    lines += [f"Made by `bench/smooth.py` on {datetime.date.today().isoformat()}, load {os.getloadavg()[0]:.0f}."]
    lines += ["Least processor time of each code with a largest error of d, over the largest |d|, below a bound;"]
    lines += ["behind it how many times razy's that is."]
    for case, (*_, title) in CASES.items():
        found, events, trust = measure(build, case, options.rounds)
        lines += ["", f"## {title[0].upper()}{title[1:]}, {events} events", "", *table(found), ""]
        lines += [f"razy at 1e-13 differs from the reference, GSL at 1e-13, by {trust:.0e}."]
    (BENCH / "report" / "smooth.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
