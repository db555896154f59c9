"""razy itself, through its installed programs `razy-run` and `razy-sweep`.

Setting: an integrator of razy (`exact`), or one with its relative tolerance (`dop853:1e-8`), by events. The programs
are looked for in the folder `RAZY_BIN`, else on the PATH; the case is `RAZY_CASE`, the package's own
inputs/torsional_gear_pair.nml. CPU time of the computation is that of the whole process less that of the same command
with `--check`, which starts, reads and validates but does not compute. One motion is over before a process has started:
its time is taken inside, by the program `RAZY_MOTION` (bench/motion.f90), with the same observers.
"""

import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np
from gear_pair import P2_END, P2_POINTS, P3_END, P3_FROM, Result

RUNS = 5
"""Of what is too short to be timed once; the smallest counts."""
OBSERVABLE = "mesh_deformation"


def program(name):
    folder = os.environ.get("RAZY_BIN")
    path = shutil.which(name, path=folder) if folder else shutil.which(name)
    if path is None:
        sys.exit(f"{name} not found: set RAZY_BIN to the folder of razy's programs")
    return path


def cpu_time(command):
    """Run `command`; return its CPU time, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def inside(arguments):
    """CPU time of one motion alone, s: the least of many."""
    case, *keys = (word for word in arguments if word != "--set")
    interval = str(P2_END / (P2_POINTS - 1))
    command = [os.environ["RAZY_MOTION"], case, "50", interval, *keys]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()[1])


def settings(case, integrator, first, last, step):
    """The keys in which the case of the benchmark may differ from the file."""
    name, _, tolerance = integrator.partition(":")
    keys = {"motion%integrator": f"'{name}'", "motion%start": "'static'"}
    if tolerance:
        keys |= {"motion%relative_tolerance": tolerance, "motion%absolute_tolerance": 1e-3 * float(tolerance)}
    if case == "p2":
        keys |= {
            "motion%t_end": P2_END,
            "rotation%speed_rpm": first,
            "record%what": "'trajectory'",
            "record%from": 0.0,
            "record%interval": P2_END / (P2_POINTS - 1),
        }
    else:
        keys |= {
            "motion%t_end": P3_END,
            "record%what": "'extrema'",
            "record%from": P3_FROM,
            "sweep%first": first,
            "sweep%last": last,
            "sweep%step": step,
        }
    return [word for key, value in keys.items() for word in ("--set", f"{key}={value}")]


def read(case, path):
    result = Result()
    with h5py.File(path) as file:
        if case == "p2":
            result.samples = list(zip(file["time"][:], file[f"observable/{OBSERVABLE}"][:], strict=True))
            result.events = list(file["event/time"][:])
            result.event_count = len(result.events)
            return result
        failed = np.count_nonzero(file["point/status"][:])
        if failed:
            sys.exit(f"{failed} points of the sweep failed")
        extrema = file[f"extrema/{OBSERVABLE}"]
        speed = np.repeat(file["axis/rotation.speed_rpm"][:], np.diff(extrema["offset"][:]))
        result.extrema = list(zip(speed, extrema["time"][:], extrema["value"][:], extrema["kind"][:], strict=True))
        result.event_count = int(file["point/events"][:].sum())
    return result


def main():
    if len(sys.argv) != 7 or sys.argv[1] not in ("p2", "p3"):
        sys.exit(f"usage: {sys.argv[0]} p2|p3 INTEGRATOR FIRST LAST STEP OUTPUT")
    case, integrator = sys.argv[1:3]
    first, last, step = (float(x) for x in sys.argv[3:6])
    default_case = Path(__file__).resolve().parents[2] / "inputs" / "torsional_gear_pair.nml"
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "result.h5"
        command = [
            program("razy-run" if case == "p2" else "razy-sweep"),
            os.environ.get("RAZY_CASE", str(default_case)),
            *settings(case, integrator, first, last, step),
        ]
        start_up = min(cpu_time([*command, "--check"]) for _ in range(RUNS))
        total = min(
            cpu_time([*command, "--output", str(output), "--force"]) for _ in range(RUNS if case == "p2" else 1)
        )
        result = read(case, output)
    result.cpu, result.process = max(total - start_up, 0.0), total
    if case == "p2":
        result.cpu = inside(command[1:])
    result.write(sys.argv[6])


if __name__ == "__main__":
    main()
