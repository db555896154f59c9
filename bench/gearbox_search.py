#!/usr/bin/env python3
"""What of the test gearbox is not printed, searched for the source's words on figure 4.17: report/gearbox_search.md.

    bench/gearbox_search.py --razy-bin build/bin

Sweeps of inputs/thesis/fig_4_17.nml (50 N m, 1000 to 3000 rpm in steps of 10) over [0, 0.05] s from static equilibrium,
as the source has it, for all combinations of size of the errors, stiffness and damping of the bearings, and damping of
the mesh; then around the best of these.

Measure: shares between 0 and 1. Looked at are the maxima of the mesh deformation in the second half
of each motion, as an eye sees them in the diagram: in groups that are more than a hundredth of the diagram's height
apart. A motion of at most four groups, none higher than three hundredths, counts as periodic.

- periodic below 1080 rpm: share of these motions;
- doubling near 1100 rpm: 1 if a motion in 1080 to 1120 rpm has twice as many groups as that at 1060 rpm, else 0;
- chaos: share of motions in 1130 to 1860, 2000 to 2490 and 2670 to 2890 rpm that are not periodic;
- windows: share of motions in 1880 to 1980 and 2510 to 2650 rpm that are periodic;
- periodic above 2900 rpm: share of these motions.

Agreement is the mean of two halves: the share of chaos, and the mean of the other four. Where all is periodic, or all
chaotic, it is at most a half.

Beside it stands, for each stiffness of the bearings, how near the ten deformations of table 4.2 are: the root mean
square of the relative differences between each and the nearest one of the model, none of which is taken twice.
"""

import argparse
import itertools
import resource
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
from run import BENCH

INPUTS = BENCH.parent / "inputs" / "thesis"
# Errors and stiffness of the bearings as multiples of those of the input, damping of the bearings in s, of the mesh in
# N s/m.
ERRORS = (1.0, 1.5, 2.0, 3.0, 10.0)
STIFFNESSES = (0.5, 1.0, 2.0)
BEARING_DAMPING = (0.0, 1e-4)
MESH_DAMPING = (500.0, 2000.0, 8000.0)
AROUND = ((0.85, 1.0, 1.15), (0.8, 1.0, 1.25), (1.0,), (0.7, 1.0, 1.4))
CHOSEN = (1.0, 1.0, 0.0, 2000.0)
RADIAL, AXIAL = (4.375e7, 3.5e8, 4.375e7, 3.5e8), {1: 3.75e6, 3: 3.75e6}
TABLE_4_2 = (0.7869, 0.4656, 0.4653, 0.2200, 0.1872, 0.1805, 0.1799, 0.1765, 0.1761, 0.1637)
AS_THE_SOURCE = (
    "motion%t_end=0.05", "record%from=0.025", "sweep%until_periodic=.false.", "sweep%kind_of_motion=.false.",
    "sweep%step=10",
)  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--razy-bin", type=Path, default=BENCH.parent / "build" / "bin", help="folder of razy-sweep")
    parser.add_argument("--jobs", type=int, default=2, help="sweeps at a time (%(default)s)")
    parser.add_argument("--report", type=Path, default=BENCH / "report" / "gearbox_search.md", help="file to write")
    options = parser.parse_args()
    grid = list(itertools.product(ERRORS, STIFFNESSES, BEARING_DAMPING, MESH_DAMPING))
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.jobs) as pool:
        scores = list(pool.map(lambda values: scored(options.razy_bin, Path(folder), values), grid))
        best = grid[int(np.argmax([agreement(score) for score in scores]))]
        near = [tuple(np.multiply(best, factors).tolist()) for factors in itertools.product(*AROUND)]
        near = [values for values in near if values not in grid]
        scores += pool.map(lambda values: scored(options.razy_bin, Path(folder), values), near)
        tables = {
            factor: distance(run(options.razy_bin, "razy-modes", "table_4_2.nml", Path(folder), bearings(factor, None)))
            for factor in STIFFNESSES
        }
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    options.report.write_text(report(grid + near, scores, tables, used.ru_utime + used.ru_stime), encoding="utf-8")
    print(f"wrote {options.report}")


def bearings(factor, damping):
    """Settings of all bearings: stiffness times a factor, damping in proportion to it."""
    words = [f"bearing({i})%radial_stiffness={factor * k:.6g}" for i, k in enumerate(RADIAL, 1)]
    words += [f"bearing({i})%axial_stiffness={factor * k:.6g}" for i, k in AXIAL.items()]
    return words if damping is None else words + [f"bearing({i})%damping_factor={damping:g}" for i in range(1, 5)]


def settings(values):
    """What a point of the grid sets in the input."""
    error, stiffness, bearing_damping, mesh_damping = values
    sines = ",".join(f"{error * 5e-6 / k:.10g}" for k in (1, 2, 3))
    return [
        f"gear_mesh%error_sine={sines}",
        f"gear_mesh%damping={mesh_damping:g}",
        *bearings(stiffness, bearing_damping),
    ]


def run(folder_of_programs, program, case, folder, words):
    output = folder / f"{abs(hash((case, *words)))}.h5"
    command = [folder_of_programs / program, INPUTS / case, "--output", output]
    for word in words:
        command += ["--set", word]
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL, capture_output=True)
    return output


def scored(folder_of_programs, folder, values):
    """The five shares of one sweep."""
    output = run(folder_of_programs, "razy-sweep", "fig_4_17.nml", folder, [*AS_THE_SOURCE, *settings(values)])
    with h5py.File(output) as file:
        speed = file["point/rotation.speed_rpm"][:]
        extrema = file["extrema/mesh_deformation"]
        offset, value, kind = (extrema[name][:] for name in ("offset", "value", "kind"))
    output.unlink()
    grain = np.ptp(value) / 100
    maxima = [value[a:b][kind[a:b] > 0] for a, b in itertools.pairwise(offset)]
    groups = [group(points, grain) for points in maxima]
    count = np.array([len(one) for one in groups])
    widest = np.array([max((np.ptp(points) for points in one), default=0.0) for one in groups])
    periodic = (count <= 4) & (widest <= 3 * grain)

    def within(*ranges):
        return np.any([(speed >= low) & (speed <= high) for low, high in ranges], axis=0)

    near = within((1080, 1120))
    doubles = np.any(periodic[near] & (count[near] >= 2 * count[np.argmin(np.abs(speed - 1060))]))
    return (
        periodic[within((1000, 1079))].mean(),
        float(doubles),
        1.0 - periodic[within((1130, 1860), (2000, 2490), (2670, 2890))].mean(),
        periodic[within((1880, 1980), (2510, 2650))].mean(),
        periodic[within((2901, 3000))].mean(),
    )


def agreement(score):
    """Half the share of chaos, half the mean of the other shares."""
    below, doubles, chaos, windows, above = score
    return 0.5 * chaos + 0.125 * (below + doubles + windows + above)


def group(points, grain):
    """Points in groups that are more than a grain apart."""
    points = np.sort(points)
    return np.split(points, np.flatnonzero(np.diff(points) > grain) + 1) if points.size else []


def distance(file):
    """How far the values of table 4.2 are from the nearest of the model's."""
    with h5py.File(file) as modes:
        left = list(np.abs(modes["mesh_deformation"][:].ravel()))
    errors = []
    for printed in TABLE_4_2:
        nearest = min(left, key=lambda value: abs(value - printed))
        left.remove(nearest)
        errors.append((nearest - printed) / printed)
    return float(np.sqrt(np.mean(np.square(errors))))


def report(grid, scores, tables, seconds):
    means = np.array([agreement(score) for score in scores])
    order = np.argsort(-means, kind="stable")
    first = len(list(itertools.product(ERRORS, STIFFNESSES, BEARING_DAMPING, MESH_DAMPING)))
    lines = [
        "# The gearbox at 50 N m: what is not printed, searched",
        "",
        *(__doc__.split("\n\n", 2)[2]).splitlines(),
        "",
    ]
    heads = ("errors times", "bearings times", "bearing damping, s", "mesh damping, N s/m", "below 1080", "doubling")
    head = "| " + " | ".join((*heads, "chaos", "windows", "above 2900", "agreement")) + " |"
    lines += [
        f"{len(grid)} sweeps of 201 motions, {seconds:.0f} s of one processor. The best ten, and the input as it is:",
        "",
        head,
    ]
    lines += ["|" + "---|" * 10]
    for number in (*order[:10], grid.index(CHOSEN)):
        cells = [f"{value:.4g}" for value in grid[number]] + [
            f"{value:.2f}" for value in (*scores[number], means[number])
        ]
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        f"Best agreement for each value among the first {first}, the others free:",
        "",
        "| what | value | agreement |",
        "|---|---|---|",
    ]
    names = ("errors times", "bearings times", "bearing damping, s", "mesh damping, N s/m")
    for place, (name, values) in enumerate(
        zip(names, (ERRORS, STIFFNESSES, BEARING_DAMPING, MESH_DAMPING), strict=True)
    ):
        for value in values:
            best = max(mean for mean, point in zip(means[:first], grid[:first], strict=True) if point[place] == value)
            lines.append(f"| {name} | {value:g} | {best:.2f} |")
    lines += ["", "Table 4.2:", "", "| bearings times | relative difference |", "|---|---|"]
    lines += [f"| {factor:g} | {error:.3f} |" for factor, error in tables.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
