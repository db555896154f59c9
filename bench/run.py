#!/usr/bin/env python3
"""Benchmark of the torsional gear pair: razy and its peers, cost beside error, in one run.

bench/run.py --quick     some minutes; report in the build folder
bench/run.py --full      half an hour; report in bench/report
bench/run.py --full --only razy --keep     measure razy again, keep the other codes of the last full run
"""

import argparse
import datetime
import importlib.metadata
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from harness import cases, measure, programs

BENCH = Path(__file__).resolve().parent
VERSION_HEADERS = (
    ("SUNDIALS", "sundials/sundials_config.h", "SUNDIALS_VERSION"),
    ("GSL", "gsl/gsl_version.h", "GSL_VERSION"),
    ("Boost", "boost/version.hpp", "BOOST_LIB_VERSION"),
)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    mode = parser.add_mutually_exclusive_group(required=True)
    mode.add_argument("--quick", action="store_true", help="few settings, slow codes on a sample of speeds")
    mode.add_argument("--full", action="store_true", help="all settings")
    parser.add_argument("--only", help="codes to run, separated by commas")
    parser.add_argument("--keep", action="store_true", help="with --only: take the other codes from the last report")
    parser.add_argument(
        "--razy-bin", type=Path, help="folder of razy-run and razy-sweep (default: build/bin, else PATH)"
    )
    parser.add_argument("--build", type=Path, default=BENCH.parent / "build" / "bench", help="folder for what is built")
    parser.add_argument("--report", type=Path, help="folder for the report")
    options = parser.parse_args()
    if options.keep and not options.only:
        parser.error("--keep goes with --only")
    options.build = options.build.resolve()
    if options.report is None:
        options.report = BENCH / "report" if options.full else options.build / "report"
    if options.razy_bin is None and (BENCH.parent / "build" / "bin" / "razy-sweep").exists():
        options.razy_bin = BENCH.parent / "build" / "bin"
    return options


def machine():
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        found = re.search(r"model name\s*:\s*(.*)", info.read_text(encoding="utf-8"))
        name = found.group(1).strip() if found else name
    return {"cpu": name, "cores": os.cpu_count(), "load": os.getloadavg()[0]}


def first_line(*command):
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return done.stdout.strip().splitlines()[0]


def versions(razy_bin):
    razy = first_line(str(Path(razy_bin) / "razy-sweep") if razy_bin else "razy-sweep", "--version")
    found = {"razy": razy, "gcc": first_line("gcc", "-dumpfullversion"), "Python": platform.python_version()}
    for name in ("scipy", "heyoka", "numpy"):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    for name, header, define in VERSION_HEADERS:
        path = Path("/usr/include") / header
        match = re.search(rf'{define} "([^"]+)"', path.read_text(encoding="utf-8")) if path.exists() else None
        found[name] = match.group(1).replace("_", ".") if match else None
    found["Octave"] = first_line("octave-cli", "--eval", "disp(version)")
    return {name: version for name, version in found.items() if version}


def earlier_run(old, row):
    """Say when a row of an earlier report was measured."""
    if "run" in row:
        return row["run"]
    if row["code"] in old["codes"] or "kept" not in old:
        return f"{old['date']}, load {old['machine']['load']:.1f}"
    return old["kept"].removeprefix("measured in the run of ").replace("load at the start", "load")


def keep(old, data, measured, order):
    """Take from an earlier report what was not measured now; it has to come from the same machine and mode."""
    for key in ("mode", "reference"):
        if old[key] != data[key]:
            sys.exit(f"--keep: the last report has another {key}")
    if any(old["machine"][key] != data["machine"][key] for key in ("cpu", "cores")):
        sys.exit("--keep: the last report is from another machine")
    data["rows"] += [row | {"run": earlier_run(old, row)} for row in old["rows"] if row["code"] not in measured]
    data["rows"].sort(key=lambda row: order.index(row["code"]))
    data["versions"] = old["versions"] | data["versions"]
    data["missing"] |= {code: words for code, words in old["missing"].items() if code not in measured}
    data["failed"] += [words for words in old["failed"] if words.partition(" p")[0] not in measured]


def run_all(codes, references, data):
    p2, p3 = references
    with tempfile.TemporaryDirectory() as folder:
        for code, missing in codes:
            if missing:
                data["missing"][code.name] = missing
                print(f"{code.name}: not measured, missing {missing}", file=sys.stderr)
                continue
            tasks = [("p2", setting, cases.P2_SPEEDS, p2) for setting in code.p2]
            tasks += [("p3", setting, cases.P3_SPEEDS, p3) for setting in code.p3]
            tasks += [("p3", setting, cases.P3_SAMPLE, p3) for setting in code.p3_sample]
            for case, setting, speeds, reference in tasks:
                label = f"{code.name} {case} {setting}"
                try:
                    row = measure.measure(code, case, setting, speeds, reference, folder)
                except measure.ProgramError as exc:
                    data["failed"].append(f"{label}: {exc}")
                    print(f"{label}: {exc}", file=sys.stderr)
                    continue
                data["rows"].append(row | {"run": f"{data['date']}, load {data['machine']['load']:.1f}"})
                error = row["error"] if case == "p2" else row["worst"]
                right = "" if case == "p2" else f", {row['right']} of {row['compared']} right"
                print(f"{label}: {row['cpu']:.4g} s, error {error:.2e}{right}", flush=True)


def main():
    options = arguments()
    missing = programs.missing_module("numpy", "matplotlib") or programs.make("reference", options.build)
    if missing:
        sys.exit(f"the benchmark itself needs: {missing} (apt install gcc make)")
    from harness import plot, table

    data = {
        "mode": "full" if options.full else "quick",
        "date": datetime.date.today().isoformat(),
        "machine": machine(),
        "versions": versions(options.razy_bin),
        "missing": {},
        "failed": [],
        "rows": [],
    }
    print("reference (some minutes when it is not cached) ...", flush=True)
    references = measure.references(options.build, options.full)
    data["reference"] = references[2] | {"chaotic": cases.chaotic_statistics(references[1])}
    codes = programs.all_codes(options.full, options.build, options.razy_bin)
    order = [code.name for code, _ in codes]
    if options.only:
        wanted = {name.strip().lower() for name in options.only.split(",")}
        unknown = wanted - {name.lower() for name in order}
        if unknown:
            sys.exit(f"unknown code {', '.join(sorted(unknown))}: {', '.join(order)}")
        codes = [pair for pair in codes if pair[0].name.lower() in wanted]
    absent = [f"{code.name}: missing {missing}" for code, missing in codes if missing]
    if options.keep and absent:
        sys.exit("\n".join(["--keep would lose the rows of what cannot be measured:", *absent]))
    data["codes"] = [code.name for code, _ in codes]
    run_all(codes, references[:2], data)
    if not data["rows"]:
        sys.exit("nothing could be measured")

    results = options.report / "results.json"
    if options.keep:
        keep(json.loads(results.read_text(encoding="utf-8")), data, {code.name for code, _ in codes}, order)
    options.report.mkdir(parents=True, exist_ok=True)
    results.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (options.report / "report.md").write_text(table.markdown(data), encoding="utf-8")
    plot.work_precision(data, options.report / "report.png")
    print(f"report: {options.report / 'report.md'}")
    sys.exit(1 if data["failed"] else 0)


if __name__ == "__main__":
    main()
