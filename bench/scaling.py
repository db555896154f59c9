#!/usr/bin/env python3
"""What an event costs over coordinates, contacts and modes kept, and a point over the points of a sweep.

    bench/scaling.py --razy-bin build/bin        needs valgrind; report in bench/report/scaling.md, with a picture

Instructions are counted by callgrind, so that other load on the computer changes nothing. A motion of `razy-run` is run
to one time and to twice that time: the first half makes the closed forms (*cold*), the second half finds nearly all of
them made (*warm*); what starts the program is taken off with a motion of a thousandth of it. An exponent is the slope
of the cost over the number, both as logarithms, between the two last rows.
"""

import argparse
import datetime
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import matplotlib as mpl
from contacts import ELASTIC, case
from run import BENCH, machine, versions

mpl.use("Agg")
import matplotlib.pyplot as plt

COORDINATES = (2, 5, 10, 20, 50, 100, 200)
CONTACTS = (1, 2, 5, 10)
MODES = (4, 8, 12, 24, 48)
POINTS = (100, 1000, 10000, 100000, 1000000)
# Half a motion of the chain, and of the gearbox, s.
HALF, HALF_OF_GEARBOX = 1.0, 0.1
METHODS = {"exact": [], "DOP853": ["motion%integrator='dop853'", "motion%relative_tolerance=1e-9"]}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-run")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "scaling.md", help="file to write")
    parser.add_argument("--points", type=int, default=POINTS[-1], help="most points of a sweep")
    return parser.parse_args()


def motion(options, path, settings):
    """Instructions of a motion, and its events."""
    result = path.with_suffix(".h5")
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={path.with_suffix('.out')}"]
    command += [options.razy_bin / "razy-run", path, "--force", "--output", result]
    for setting in settings:
        command += ["--set", setting]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    with h5py.File(result) as file:
        return int(re.search(r"Collected : (\d+)", done.stderr)[1]), int(file["outcome/events"][0])


def halves(options, path, half, settings):
    """Instructions an event of the first half of a motion and of the second, and the events of both."""
    start, _ = motion(options, path, [*settings, f"motion%t_end={1e-3 * half!r}"])
    first, early = motion(options, path, [*settings, f"motion%t_end={half!r}"])
    both, events = motion(options, path, [*settings, f"motion%t_end={2 * half!r}"])
    return (first - start) / max(early, 1), (both - first) / max(events - early, 1), events


def chain(options, folder, coordinates, contacts):
    """A row of the table: cold and warm by `exact`, and by DOP853 in the second half."""
    path = folder / "chain.nml"
    text = re.sub("&duel.*", "", case(coordinates, contacts, ELASTIC, []))
    path.write_text(text + "&record observable='displacement', of='m1', what='extrema' /\n", encoding="utf-8")
    cold, warm, events = halves(options, path, HALF, ["motion%integrator='exact'"])
    _, other, _ = halves(options, path, HALF, METHODS["DOP853"])
    return events, cold, warm, other


def gearbox(options, folder, modes):
    """A row of the table of the test gearbox, errors ten times the printed ones."""
    path = folder / "gearbox.nml"
    text = (BENCH.parent / "inputs" / "test_gearbox.nml").read_text(encoding="utf-8")
    path.write_text(re.sub("from=[0-9.]+", "from=0.0", text), encoding="utf-8")
    errors = "gear_mesh%error_sine=5e-5,2.5e-5,1.6666666666666667e-5"
    settings = [f"reduction%modes={modes}", errors]
    cold, warm, events = halves(options, path, HALF_OF_GEARBOX, settings)
    return events, cold, warm, None


def sweep(options, folder, points):
    """Processor time a point, s, and the largest resident set, MB."""
    path = folder / "sweep.nml"
    last = 1.0 + 1.0 * (points - 1) / points
    path.write_text(
        "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0, damping=0.1 /\n"
        "&stop name='s', between='m','frame', clearance=1.0, stiffness=100.0 /\n&load on='m', amplitude=1.0, "
        "angular_frequency=1.0 /\n&motion t_end=20.0, start='zero' /\n&record observable='displacement', "
        f"what='extrema', from=15.0 /\n&sweep parameter='load%amplitude', first=1.0, last={last!r}, "
        f"step={1.0 / points!r} /\n",
        encoding="utf-8",
    )
    code = (
        "import resource, subprocess, sys\nsubprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL, "
        "stderr=subprocess.DEVNULL)\nused = resource.getrusage(resource.RUSAGE_CHILDREN)\n"
        "print(used.ru_utime + used.ru_stime, used.ru_maxrss)"
    )
    command = [options.razy_bin / "razy-sweep", path, "--force", "--output", path.with_suffix(".h5")]
    done = subprocess.run([sys.executable, "-c", code, *command], capture_output=True, text=True, check=True)
    seconds, size = done.stdout.split()
    return float(seconds) / points, int(size) / 1024


def exponent(numbers, costs):
    """Slope between the last two."""
    return math.log(costs[-1] / costs[-2]) / math.log(numbers[-1] / numbers[-2])


def table(title, text, numbers, rows):
    """Lines of a section, with the exponents."""
    names = ["cold", "warm"] + (["DOP853"] if rows[0][3] else [])
    lines = [f"## {title[0].upper()}{title[1:]}", text, "", f"| {title} | events | " + " | ".join(names) + " |"]
    lines.append("|" + "---|" * (2 + len(names)))
    for number, row in zip(numbers, rows, strict=True):
        lines.append(
            f"| {number} | {row[0]} | " + " | ".join(f"{value / 1e3:.1f}" for value in row[1:] if value) + " |"
        )
    slopes = [f"{name} {exponent(numbers, [row[1 + k] for row in rows]):.1f}" for k, name in enumerate(names)]
    return [*lines, "", f"Exponents between the last two: {', '.join(slopes)}.", ""]


def draw(path, sections):
    """Costs over numbers, on logarithmic axes."""
    figure, axes = plt.subplots(1, len(sections), figsize=(11, 3.6), layout="constrained", sharey=True)
    for axis, (title, numbers, rows) in zip(axes, sections, strict=True):
        for k, (name, mark) in enumerate((("exact, cold", "o--"), ("exact, warm", "o-"), ("DOP853", "s-"))):
            costs = [row[1 + k] for row in rows]
            if costs[0]:
                axis.loglog(numbers, [cost / 1e3 for cost in costs], mark, label=name)
        axis.set_xticks(numbers, labels=[str(number) for number in numbers])
        axis.minorticks_off()
        axis.set_xlabel(title)
        axis.grid(visible=True, which="both", alpha=0.3)
    axes[0].set_ylabel("instructions an event, thousands")
    axes[0].legend()
    figure.savefig(path, dpi=110)


def main():
    options = arguments()
    place = machine()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sections = [
            ("coordinates", COORDINATES, [chain(options, folder, number, 2) for number in COORDINATES]),
            ("contacts", CONTACTS, [chain(options, folder, 50, number) for number in CONTACTS]),
            ("modes of each shaft", MODES, [gearbox(options, folder, number) for number in MODES]),
        ]
        counts = [number for number in POINTS if number <= options.points]
        points = [sweep(options, folder, number) for number in counts]
    said = {
        "coordinates": "A driven chain with elastic stops at two of its masses.",
        "contacts": "A driven chain of 50 masses; of many contacts new combinations come in the second half, too.",
        "modes of each shaft": "The test gearbox, two shafts, errors ten times the printed ones.",
    }
    lines = [
        "# What an event and a point cost",
        "",
        f"Made by `bench/scaling.py` on {datetime.date.today().isoformat()}; {versions(options.razy_bin).get('razy')}.",
        "Thousands of instructions an event: *cold*, with the closed forms made on the way, *warm*, with nearly all of",
        "them at hand, and by DOP853 with events at 1e-9.",
        "",
        "![cost over coordinates, contacts and modes](scaling.png)",
        "",
    ]
    for title, numbers, rows in sections:
        lines += table(title, said[title], numbers, rows)
    lines += [
        "## Points of a sweep",
        "An oscillator with a stop, 20 s of motion a point, one rank.",
        f"Processor time of the program over the points ({place['cpu']}, "
        f"load at the start {place['load']:.1f}), and the largest resident set.",
        "",
        "| points | a point, us | memory, MB |",
        "|---|---|---|",
        *(
            f"| {number} | {1e6 * seconds:.0f} | {size:.0f} |"
            for number, (seconds, size) in zip(counts, points, strict=True)
        ),
        "",
    ]
    options.report.write_text("\n".join(lines), encoding="utf-8")
    draw(options.report.with_suffix(".png"), sections)


if __name__ == "__main__":
    main()
