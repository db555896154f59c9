#!/usr/bin/env python3
"""The vibropress by razy's exact propagator, heyoka and SUNDIALS: report in bench/report/press.md.

    bench/press.py --razy-bin FOLDER [--frequencies 40 45 50 55 60]

The machine is that of inputs/thesis/fig_4_30.nml with weight: nine coordinates, six contacts that open and close at
zero gap, 2 s of motion from static equilibrium. Its matrices are written down here from the lists in the input, not
taken from razy. Every peer locates each crossing of each gap and goes on from there: heyoka (adaptive Taylor series) by
terminal events, one for left and right together, as these meet at the same time here and it misses one of two; CVODE
(Adams, fixed-point iteration) by root finding and restart. Times are processor times of the integration alone, the
least of three runs; compiling and setting up are left out. For razy the time of the whole sweep of 401 frequencies,
less that of the same command with --check, is divided: with machines, extrema of three forces, period of each motion,
checkpoint and result file.
The error is that of the mould's height over the last 0.1 s, against razy's, of its largest value.
"""

import argparse
import datetime
import os
import resource
import subprocess
import tempfile
import time
from pathlib import Path

import h5py
import heyoka as hy
import numpy as np

BENCH = Path(__file__).resolve().parent
CASE = BENCH.parent / "inputs" / "thesis" / "fig_4_30.nml"
GRAVITY, T_END, POINTS, FORCE, ALPHA, KC = 9.81, 2.0, 400, 2e4, 3e-3, 1e7
MASS = np.array([1020.0, 1020.0, 30.60, 100.0, 100.0, 9.795, 425.0, 425.0, 29.269])
CLEARANCE = np.array([5e-5, 5e-5, 1e-5, 1e-5, 0.0, 0.0])
MOULD_Y = 7


def stiffness():
    k1, kx, a1, a3, h1, h2 = 5e7, 2e8, 0.71, 0.8868, 0.3, 0.1
    k = np.diag([kx, k1, k1 * a1**2 + kx * h1**2, kx, 0.0, 0.0, kx, 1e8, 1e8 * a3**2 + kx * h2**2])
    k[0, 2] = k[2, 0] = kx * h1
    k[6, 8] = k[8, 6] = -kx * h2
    return k


def gaps():
    """Rows of the gaps: table-pallet, pallet-mould, bars-pallet, left and right."""
    w = np.zeros((6, 9))
    for side, sign in enumerate((-1.0, 1.0)):
        w[side, [4, 5, 1, 2]] = 1.0, sign * 0.4434, -1.0, -sign * 0.4434
        w[2 + side, [7, 8, 4, 5]] = 1.0, sign * 0.4434, -1.0, -sign * 0.4434
        w[4 + side, [4, 5]] = 1.0, sign * 0.33
    return w


K, W = stiffness(), gaps()
B = ALPHA * K


def weight():
    f = np.zeros(9)
    f[[1, 4, 7]] = -GRAVITY * MASS[[1, 4, 7]]
    return f


def equilibrium():
    """Positions at rest, and which contacts are closed there."""
    closed = np.ones(6, dtype=bool)
    for _ in range(64):
        k = K + KC * W[closed].T @ W[closed]
        y = np.linalg.solve(k, weight() - KC * W[closed].T @ CLEARANCE[closed])
        found = W @ y + CLEARANCE < 0.0
        if np.array_equal(found, closed):
            return y, closed
        closed = found
    raise RuntimeError("no equilibrium")


def times():
    return np.linspace(T_END - 0.1, T_END, POINTS)


class Heyoka:
    """Compiled once; contacts are runtime parameters, the frequency too."""

    def __init__(self, tolerance):
        x = [hy.expression(f"x{i}") for i in range(9)]
        v = [hy.expression(f"v{i}") for i in range(9)]
        gap = [sum(W[j, i] * x[i] for i in range(9) if W[j, i]) + CLEARANCE[j] for j in range(6)]
        exciter = FORCE / 50.0**2 * (hy.par[6] / (2 * np.pi)) ** 2 * hy.sin(hy.par[6] * hy.time)
        system = [(x[i], v[i]) for i in range(9)]
        for i in range(9):
            force = hy.expression(weight()[i]) + (exciter if i == 1 else 0.0)
            force -= sum(K[i, j] * (x[j] + ALPHA * v[j]) for j in range(9) if K[i, j])
            force -= sum(KC * W[j, i] * hy.par[j] * gap[j] for j in range(6) if W[j, i])
            system.append((v[i], force / MASS[i]))
        self.events = 0
        watched = [hy.t_event(gap[j] + gap[j + 1], callback=self.flip(j)) for j in (0, 2, 4)]
        options = {"tol": tolerance} if tolerance > 0 else {}
        self.integrator = hy.taylor_adaptive(system, [0.0] * 18, pars=[0.0] * 7, t_events=watched, **options)

    def flip(self, j):
        def callback(integrator, sign):
            integrator.pars[j : j + 2] = 1.0 if sign < 0 else 0.0
            self.events += 2
            return True

        return callback

    def run(self, frequency):
        y, closed = equilibrium()
        integrator, self.events = self.integrator, 0
        integrator.time = 0.0
        integrator.reset_cooldowns()
        integrator.state[:] = np.concatenate((y, np.zeros(9)))
        integrator.pars[:] = [*closed.astype(float), 2 * np.pi * frequency]
        begun = time.process_time()
        outcome = integrator.propagate_grid(np.concatenate(([0.0], times())))
        return time.process_time() - begun, self.events, outcome[-1][1:, MOULD_Y]


class Sundials:
    def __init__(self, tolerance, folder):
        self.tolerance, self.program = tolerance, folder / "press_cvode"
        libraries = ["-lsundials_cvode", "-lsundials_nvecserial", "-lsundials_sunnonlinsolfixedpoint", "-lm"]
        source = BENCH / "peers" / "press_cvode.c"
        subprocess.run(["gcc", "-O3", "-march=native", "-o", self.program, source, *libraries], check=True)

    def run(self, frequency):
        y, closed = equilibrium()
        numbers = np.concatenate(
            [[2 * np.pi * frequency, FORCE / 50.0**2 * frequency**2, self.tolerance, KC], MASS, weight(), K.ravel(),
             B.ravel(), W.ravel(), CLEARANCE, closed.astype(float), y, [POINTS], times()]
        )  # fmt: skip
        text = " ".join(f"{number:.17e}" for number in numbers)
        done = subprocess.run([self.program], input=text, capture_output=True, text=True, check=True)
        values = [float(word) for word in done.stdout.split()]
        return values[0], int(values[1]), np.array(values[2:])


def razy_motion(folder, frequency, place):
    """Events and the height of the mould by razy-run."""
    output = place / "one.h5"
    record = "&record observable='displacement', of='mould.y', what='trajectory', interval={}, from={} /\n"
    text = CASE.read_text() + record.format(0.1 / (POINTS - 1), T_END - 0.1)
    case = place / "one.nml"
    case.write_text(text)
    command = [folder / "razy-run", case, "--output", output, "--force", "--set", f"exciter%frequency={frequency}"]
    subprocess.run([*command, "--set", f"gravity%acceleration={GRAVITY}"], check=True, capture_output=True)
    with h5py.File(output) as file:
        return file["event/time"].shape[0], file["time"][()], file["observable/displacement.mould.y"][()]


def razy_time(folder, place):
    """Processor time of a point of the sweep of 401 frequencies without the start of the program, s."""
    command = [folder / "razy-sweep", CASE, "--output", place / "all.h5", "--force", "--set", "sweep%step=0.05"]
    command += [word for i in (1, 2, 3) for word in ("--set", f"record({i})%what='extrema'")]
    command += ["--set", f"gravity%acceleration={GRAVITY}"]
    return (process_time(command) - process_time([*command, "--check"])) / 401


def process_time(command):
    """Processor time of a command, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of the programs")
    parser.add_argument("--frequencies", type=float, nargs="+", default=[40.0, 45.0, 50.0, 55.0, 60.0])
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "press.md", help="file to write")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        ours = min(razy_time(options.razy_bin, place) for _ in range(3))
        motions = {f: razy_motion(options.razy_bin, f, place) for f in options.frequencies}
        rows.append(f"| razy exact | - | {1000 * ours:.2f} | 1 | {sum(m[0] for m in motions.values())} | 0 |")
        peers = [("heyoka", f"{tolerance:g}", Heyoka(tolerance)) for tolerance in (0.0, 1e-12, 1e-9)]
        peers += [("CVODE Adams", f"{tolerance:g}", Sundials(tolerance, place)) for tolerance in (1e-12, 1e-9)]
        for peer, tolerance, solver in peers:
            spent, events, error = 0.0, 0, 0.0
            for frequency, (_, moments, expected) in motions.items():
                seconds, count, height = min((solver.run(frequency) for _ in range(3)), key=lambda run: run[0])
                same = np.interp(times(), moments, expected)
                error = max(error, np.max(np.abs(height - same)) / np.max(np.abs(expected)))
                spent, events = spent + seconds / len(motions), events + count
            rows.append(f"| {peer} | {tolerance} | {1000 * spent:.1f} | {spent / ours:.2g} | {events} | {error:.1e} |")
            print(rows[-1], flush=True)
    about = __doc__.split("\n\n")
    lines = [
        "# The vibropress beside other codes",
        "",
        f"Made by `bench/press.py` on {datetime.date.today().isoformat()}, load {os.getloadavg()[0]:.1f} on "
        f"{os.cpu_count()} cores; heyoka {hy.__version__}. Frequencies: {', '.join(map(str, options.frequencies))} Hz.",
        "",
        *about[2:],
        "| code | tolerance | processor time of a frequency, ms | times razy | events | error |",
        "|---|---|---|---|---|---|",
        *rows,
        "",
    ]
    options.report.write_text("\n".join(lines), encoding="utf-8")
    print(options.report.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
