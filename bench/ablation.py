#!/usr/bin/env python3
"""What each part of razy costs and what it buys: variants of the library side by side on the sweep P3.

    bench/ablation.py            report in bench/report/ablation.md
    bench/ablation.py --only native --rounds 5 --report FILE
    bench/ablation.py --check      whether the patches fit the sources, and nothing else

The variants are copies of src/ with small patches (harness/variants.py); a patch that does not fit the sources any more
is an error. All are built first, then run in turn, so that each round gives a ratio of times that lie side by side.
"""

import argparse
import datetime
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from harness import cases, measure, programs, variants
from run import BENCH, machine, versions

CASE = BENCH.parent / "inputs" / "torsional_gear_pair.nml"


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", help="variants to run beside the library as it is, separated by commas")
    parser.add_argument("--check", action="store_true", help="say which patches do not fit the sources, and stop")
    parser.add_argument("--rounds", type=int, default=9, help="runs of each variant, in turn")
    parser.add_argument("--sweeps", type=int, default=2, help="timed sweeps in each run")
    parser.add_argument("--build", type=Path, default=BENCH.parent / "build" / "bench", help="folder of the reference")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "ablation.md", help="file to write")
    return parser.parse_args()


def run(program, sweeps, output="-"):
    """Run a variant; return events and steps by speed, and the times of its sweeps, s."""
    done = subprocess.run([program, CASE, str(sweeps), output], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{program}: {done.stderr}")
    points, times = {}, []
    for line in done.stdout.splitlines():
        mark, *words = line.split()
        if mark == "point":
            points[float(words[0])] = (int(words[1]), int(words[2]))
        else:
            times.append(float(words[0]))
    return points, times


def judge(points, output, present, reference):
    """Errors of a variant, and at how many regular speeds it has more or fewer events than the library as it is."""
    row = cases.score_p3(output, reference, cases.P3_SPEEDS)
    regular = [speed for speed in points if cases.regular(speed)]
    row["unlike"] = sum(points[speed][0] != present[speed][0] for speed in regular)
    row["missing"] = sum(max(present[speed][0] - points[speed][0], 0) for speed in regular)
    row["events"] = sum(events for events, _ in points.values())
    row["steps"] = sum(steps for _, steps in points.values())
    return row


def measure_all(programs_by_name, reference, rounds, sweeps, folder):
    rows, present = {}, None
    for name, program in programs_by_name.items():
        path = str(Path(folder) / "extrema.txt")
        points, _ = run(program, 0, path)
        present = present or points
        rows[name] = judge(points, cases.read_output(path), present, reference) | {"times": []}
    for _ in range(rounds):
        for name, program in programs_by_name.items():
            rows[name]["times"].append(min(run(program, sweeps)[1]))
    first = rows[variants.PRESENT.name]["times"]
    for row in rows.values():
        ratios = sorted(time / base for time, base in zip(row["times"], first, strict=True))
        row["time"] = statistics.median(row["times"])
        row["ratio"] = statistics.median(ratios)
        row["low"], row["high"] = ratios[len(ratios) // 4], ratios[-1 - len(ratios) // 4]
    return rows


def conclusion(rows):
    """What the proof and the generality cost, each by itself; of the variants that were run."""
    lines = []
    if "proof twice" in rows:
        lines.append(f"The arithmetic of the proof costs {rows['proof twice']['ratio'] - 1:.0%} of the time.")
    for name in (name for name in rows if name.startswith("signs")):
        row = rows[name]
        lines.append(
            f"The {name} take {row['ratio']:.2f} of the time and get {row['compared'] - row['right']} "
            f"of {row['compared']} regular speeds wrong."
        )
    if "nothing rare" in rows:
        lines.append(f"That rare cases are provided for costs {1 - rows['nothing rare']['ratio']:.0%}.")
    return " ".join(lines)


def markdown(chosen, rows, options, place):
    commit = subprocess.run(
        ["git", "-C", str(BENCH), "describe", "--always", "--dirty", "--abbrev=12"],
        capture_output=True,
        text=True,
        check=False,
    )
    lines = [
        "# What each part costs, and what it buys",
        "",
        f"Made by `bench/ablation.py` on {datetime.date.today().isoformat()} "
        f"from {commit.stdout.strip() or 'unknown'}. "
        f"{place['cpu']}, {place['cores']} cores, load at the start {place['load']:.1f}; "
        f"gcc {versions(None).get('gcc', 'unknown')}.",
        "",
        "The sweep P3 (401 speeds), processor time of one core without start-up and writing. "
        f"{options.rounds} rounds in which every variant runs once, the faster of {options.sweeps} sweeps each; the "
        "median, and the median of the ratios to the library as it is in the same round (in brackets the quartiles).",
        "",
        conclusion(rows),
        "",
        "*Steps* are those of the search for changes of contact. *Differ*: regular speeds at which the number of "
        "changes of contact is another than with the library as it is, and how many are missing there in all. *Right*, "
        "*lost* and *worst error* of the extrema as in the [report](report.md), against the reference in quadruple "
        "precision.",
        "",
        "| variant | CPU, s | to as it is | steps | events | differ | missing | right | lost | worst error |",
        "|" + "---|" * 10,
    ]
    for variant in chosen:
        row = rows[variant.name]
        cells = [variant.name, f"{row['time']:.3f}", f"{row['ratio']:.2f} ({row['low']:.2f} to {row['high']:.2f})"]
        cells += [str(row[key]) for key in ("steps", "events", "unlike", "missing")]
        cells += [f"{row['right']} of {row['compared']}", str(row["lost"]), f"{row['worst']:.1e}"]
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", *(f"- **{variant.name}**: {variant.meaning}" for variant in chosen), ""]
    return "\n".join(lines)


def main():
    options = arguments()
    if options.check:
        sys.exit("\n".join(variants.misfits()) or None)
    place = machine()
    missing = programs.missing_module("numpy") or programs.make("reference", options.build.resolve())
    if missing:
        sys.exit(f"the benchmark itself needs: {missing}")
    chosen = variants.VARIANTS
    if options.only:
        wanted = {name.strip() for name in options.only.split(",")}
        unknown = wanted - {variant.name for variant in chosen}
        if unknown:
            sys.exit(f"unknown variant {', '.join(sorted(unknown))}: {', '.join(variant.name for variant in chosen)}")
        chosen = [variant for variant in chosen if variant is variants.PRESENT or variant.name in wanted]
    reference = measure.reference(options.build.resolve(), "quad", "p3", cases.P3_SPEEDS)
    with tempfile.TemporaryDirectory() as folder:
        built = {}
        for variant in chosen:
            print(f"building: {variant.name}", flush=True)
            try:
                built[variant.name] = variants.build(variant, folder)
            except variants.PatchError as exc:
                sys.exit(str(exc))
        rows = measure_all(built, reference, options.rounds, options.sweeps, folder)
    options.report.parent.mkdir(parents=True, exist_ok=True)
    options.report.write_text(markdown(chosen, rows, options, place), encoding="utf-8")
    print(options.report.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
