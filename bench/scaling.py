#!/usr/bin/env python3
"""What an event costs over coordinates, contacts and modes kept, and a point over the points of a sweep.

    bench/scaling.py --razy-bin build/bin        needs valgrind; report in bench/report/scaling.md, with a picture

Instructions are counted by callgrind, so that other load on the computer changes nothing. A motion of `razy-run` is run
to a time and to four and eight times that time: the first eighth makes the closed forms (*cold*), the second half finds
nearly all of them made (*warm*); what starts the program is taken off with a motion of a thousandth of it. Counts do
not see the caches, and the forms of large chains take long to count: these and many contacts are timed, by `razy-duel`
(bench/contacts.py), *warm* with the forms of a run before. An exponent is the slope of the cost over the number, both
as logarithms, between the two last rows.
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
from contacts import ELASTIC, case, measure
from run import BENCH, machine, versions

mpl.use("Agg")
import matplotlib.pyplot as plt

COORDINATES = (2, 5, 10, 20, 50)
TIMED = (20, 50, 100, 200, 400)
CONTACTS = (1, 2, 5, 10, 20, 50)
MODES = (4, 8, 12, 24)
POINTS = (100, 1000, 10000, 100000, 1000000)
# An eighth of a motion of the chain, and of the gearbox, s.
EIGHTH, EIGHTH_OF_GEARBOX = 0.25, 0.0125
EXACT = ["motion%integrator='exact'"]
DOP853 = ["motion%integrator='dop853'", "motion%relative_tolerance=1e-9"]
METHODS = ["integrator='exact'", "integrator='dop853', treatment='event', tolerance=1e-9"]
COUNTED = ("thousands of instructions an event", 1e3, ("exact, cold", "exact, warm", "automatic", "DOP853"))
SPENT = ("processor time of an event, ms", 1e-3, ("exact, warm", "DOP853"))
MARKS = {"exact, cold": "C0o--", "exact, warm": "C0o-", "automatic": "C2x-", "DOP853": "C3s-"}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-run")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "scaling.md", help="file to write")
    parser.add_argument("--points", type=int, default=POINTS[-1], help="most points of a sweep")
    parser.add_argument("--timed", type=int, default=TIMED[-1], help="most coordinates of the chain that is timed")
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


def costs(options, path, eighth, settings):
    """Instructions an event: cold, warm, of the whole motion by `automatic` and by DOP853; the events of the whole."""

    def to(method, share):
        return motion(options, path, [*method, *settings, f"motion%t_end={share * eighth!r}"])

    start, _ = to(EXACT, 1e-3)
    (first, early), (half, middle), (whole, events) = (to(EXACT, share) for share in (1, 4, 8))
    others = [(count - start) / found for count, found in (to(method, 8) for method in ([], DOP853))]
    return events, (first - start) / max(early, 1), (whole - half) / max(events - middle, 1), *others


def chain(options, folder, coordinates):
    """A row of the table of the chain."""
    path = folder / f"chain_{coordinates}.nml"
    text = re.sub("&duel.*", "", case(coordinates, 2, ELASTIC, []))
    path.write_text(text + "&record observable='displacement', of='m1', what='extrema' /\n", encoding="utf-8")
    return costs(options, path, EIGHTH, [])


def timed(options, folder, coordinates, contacts):
    """Events, and the processor time of one by `exact` and by DOP853, s."""
    rows = measure(options.razy_bin / "razy-duel", coordinates, contacts, ELASTIC, METHODS, folder)
    return rows[0]["events"], *(row["cpu_time"] / row["events"] for row in rows)


def gearbox(options, folder, modes):
    """A row of the table of the test gearbox, errors ten times the printed ones."""
    path = folder / f"gearbox_{modes}.nml"
    text = (BENCH.parent / "inputs" / "test_gearbox.nml").read_text(encoding="utf-8")
    path.write_text(re.sub("from=[0-9.]+", "from=0.0", text), encoding="utf-8")
    errors = "gear_mesh%error_sine=5e-5,2.5e-5,1.6666666666666667e-5"
    return costs(options, path, EIGHTH_OF_GEARBOX, [f"reduction%modes={modes}", errors])


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
    command = [options.razy_bin / "razy-sweep", path, "--force", "--output", path.with_suffix(".h5")]
    code = (
        "import resource, subprocess, sys\nsubprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL, "
        "stderr=subprocess.DEVNULL)\nused = resource.getrusage(resource.RUSAGE_CHILDREN)\n"
        "print(used.ru_utime + used.ru_stime, used.ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", code, *command], capture_output=True, text=True, check=True)
    seconds, size = done.stdout.split()
    return float(seconds) / points, int(size) / 1024


def exponent(numbers, costs):
    """Slope between the last two."""
    return math.log(costs[-1] / costs[-2]) / math.log(numbers[-1] / numbers[-2])


def table(title, text, numbers, rows, unit):
    """Lines of a section, with the exponents."""
    name, size, columns = unit
    lines = [f"## {title[0].upper()}{title[1:]}", f"{text} {name[0].upper()}{name[1:]}:", ""]
    lines += [f"| {title} | events | " + " | ".join(columns) + " |", "|" + "---|" * (2 + len(columns))]
    for number, row in zip(numbers, rows, strict=True):
        lines.append(f"| {number} | {row[0]} | " + " | ".join(f"{value / size:.3g}" for value in row[1:]) + " |")
    slopes = [f"{column} {exponent(numbers, [row[1 + k] for row in rows]):.1f}" for k, column in enumerate(columns)]
    return [*lines, "", f"Exponents between the last two: {'; '.join(slopes)}.", ""]


def draw(path, sections, counts, points):
    """Costs over numbers, on logarithmic axes."""
    figure, axes = plt.subplots(1, len(sections) + 1, figsize=(17, 3.8), layout="constrained")
    for axis, (title, _, numbers, rows, (name, size, columns)) in zip(axes, sections, strict=False):
        for k, column in enumerate(columns):
            slope = exponent(numbers, [row[1 + k] for row in rows])
            axis.loglog(numbers, [row[1 + k] / size for row in rows], MARKS[column], label=f"{column}: {slope:.1f}")
        axis.set(xlabel=title, ylabel=name)
        axis.set_xticks(numbers, labels=[str(number) for number in numbers])
    seconds, sizes = zip(*points, strict=True)
    total = [number * second for number, second in zip(counts, seconds, strict=True)]
    axes[-1].loglog(counts, total, "o-", label=f"processor time, s: {exponent(counts, total):.2f}")
    axes[-1].loglog(counts, sizes, "s-", label=f"memory, MB: {exponent(counts, sizes):.2f}")
    axes[-1].set(xlabel="points of a sweep")
    for axis in axes:
        axis.minorticks_off()
        axis.grid(visible=True, which="both", alpha=0.3)
        axis.legend(title="exponents", fontsize="small", title_fontsize="small")
    figure.savefig(path, dpi=110)


def main():
    options = arguments()
    place = machine()
    large = [number for number in TIMED if number <= options.timed]
    counts = [number for number in POINTS if number <= options.points]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sections = [
            (
                "coordinates",
                "A driven chain with elastic stops at two of its masses.",
                COORDINATES,
                [chain(options, folder, number) for number in COORDINATES],
                COUNTED,
            ),
            (
                "coordinates, timed",
                "The same chain.",
                large,
                [timed(options, folder, number, 2) for number in large],
                SPENT,
            ),
            (
                "contacts",
                "A driven chain of 50 masses.",
                CONTACTS,
                [timed(options, folder, 50, number) for number in CONTACTS],
                SPENT,
            ),
            (
                "modes of each shaft",
                "The test gearbox, two shafts, errors ten times the printed ones.",
                MODES,
                [gearbox(options, folder, number) for number in MODES],
                COUNTED,
            ),
        ]
        points = [sweep(options, folder, number) for number in counts]
    lines = [
        "# What an event and a point cost",
        "",
        f"Made by `bench/scaling.py` on {datetime.date.today().isoformat()}; {versions(options.razy_bin).get('razy')}; "
        f"{place['cpu']}, load at the start {place['load']:.1f}.",
        "*Cold*: in the first eighth of the motion, with the closed forms made on the way; *warm*: with nearly all of",
        "them at hand; and of the whole motion by `automatic` and by DOP853 with events at 1e-9.",
        "Instructions do not hang on the load, processor times do, somewhat; ratios and exponents are what to look at.",
        "",
        "![cost over coordinates, contacts, modes and points](scaling.png)",
        "",
    ]
    for section in sections:
        lines += table(*section)
    lines += [
        "## Points of a sweep",
        "An oscillator with a stop, 20 s of motion a point, one rank.",
        "Processor time of the program over the points, and the largest resident set.",
        "",
        "| points | a point, us | memory, MB |",
        "|---|---|---|",
        *(
            f"| {number} | {1e6 * seconds:.0f} | {size:.0f} |"
            for number, (seconds, size) in zip(counts, points, strict=True)
        ),
        "",
        "Exponents between the last two: time of the sweep "
        f"{1 + exponent(counts, [seconds for seconds, _ in points]):.2f}, "
        f"memory {exponent(counts, [size for _, size in points]):.2f}.",
        "",
    ]
    options.report.write_text("\n".join(lines), encoding="utf-8")
    draw(options.report.with_suffix(".png"), sections, counts, points)


if __name__ == "__main__":
    main()
