#!/usr/bin/env python3
"""Where the test gearbox changes its motion against the modes kept of each shaft: figure 4.19 of the source, located.

    bench/gearbox_modes.py [--razy-bin FOLDER] [--seconds N]     report in bench/report/gearbox_modes.md and .png

Two places by razy-follow, on the branch of period 1: where contact is first lost at 150 N m with the errors of the
teeth as printed, and where the period first doubles at 50 N m with these doubled. What takes longer than so many
seconds is left out, and said.
"""

import argparse
import datetime
import subprocess
import tempfile
from pathlib import Path

import h5py
from matplotlib.figure import Figure

BENCH = Path(__file__).resolve().parent
INPUTS = BENCH.parent / "inputs"
MODES = (8, 10, 12, 14, 16, 18, 20, 24, 28, 32)
DOUBLED = "gear_mesh%error_sine=1e-5,5e-6,3.3333333333333e-6"
PLACES = {
    "contact first lost, 150 N m": ("test_gearbox.nml", "GR", []),
    "first doubling, 50 N m, errors doubled": ("thesis/fig_4_19.nml", "PD", [DOUBLED]),
}


def locate(folder, place, modes, seconds):
    """Speed, rpm, of the first such point, or None."""
    case, label, settings = PLACES[place]
    with tempfile.TemporaryDirectory() as temporary:
        output = Path(temporary) / "output.h5"
        command = [folder / "razy-follow", INPUTS / case, "--output", output, "--set", f"reduction%modes={modes}"]
        command += [word for setting in settings for word in ("--set", setting)]
        try:
            subprocess.run([str(word) for word in command], check=True, capture_output=True, timeout=seconds)
        except subprocess.TimeoutExpired:
            return None
        with h5py.File(output) as file:
            found = file["special/parameter"][:][file["special/label"].asstr()[:] == label]
    return float(found[0]) if found.size else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin")
    parser.add_argument("--seconds", type=float, default=240.0)
    arguments = parser.parse_args()
    rows = {modes: [locate(arguments.razy_bin, place, modes, arguments.seconds) for place in PLACES] for modes in MODES}
    figure = Figure(figsize=(6.0, 4.5), layout="constrained")
    for axes, place, k in zip(figure.subplots(2, 1, sharex=True), PLACES, range(2), strict=True):
        known = [(modes, row[k]) for modes, row in rows.items() if row[k] is not None]
        axes.plot(*zip(*known, strict=True), "k.-", linewidth=0.7)
        axes.set_title(place, fontsize="small", loc="left")
        axes.set_ylabel("speed (rpm)")
    axes.set_xlabel("modes kept of each shaft")
    figure.savefig(BENCH / "report" / "gearbox_modes.png", dpi=150)
    lines = [
        "# The test gearbox: where the motion changes, against the modes kept",
        "",
        f"`bench/gearbox_modes.py`, {datetime.date.today().isoformat()}. Points of the branch of period 1, in rpm, "
        "located by `razy-follow`.",
        f"A dash: no such point, or longer than {arguments.seconds:.0f} s.",
        "",
        f"| modes | {' | '.join(PLACES)} |",
        "|---|" + "---|" * len(PLACES),
    ]
    for modes, row in rows.items():
        lines.append(f"| {modes} | " + " | ".join("–" if speed is None else f"{speed:.6f}" for speed in row) + " |")
    lines += ["", "![The same as a picture](gearbox_modes.png)"]
    (BENCH / "report" / "gearbox_modes.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
