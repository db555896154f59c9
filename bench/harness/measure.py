"""Run one program at one setting: its output, its CPU time, the reference it is compared with."""

import hashlib
import resource
import subprocess
from pathlib import Path

from harness import cases
from harness.programs import BENCH

TIME_LIMIT = 3600.0
REPEAT_BUDGET = 10.0
"""CPU time, s, up to which a short run is repeated, at most four times more; the smallest time counts."""


class ProgramError(Exception):
    """A program ended with an error, or wrote what cannot be compared."""


def run_program(command, case, setting, speeds, path):
    """Run once; return output, CPU time of the computation and of the whole process, s."""
    words = [*command, case, setting, *(repr(x) for x in speeds), str(path)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=TIME_LIMIT)
    except subprocess.TimeoutExpired as exc:
        raise ProgramError(f"not finished after {TIME_LIMIT:g} s") from exc
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        message = done.stderr.strip().splitlines()
        raise ProgramError(message[-1] if message else f"exit code {done.returncode}")
    output = cases.read_output(path)
    process = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return output, output.header["cpu"], output.header.get("process", process)


def measure(code, case, setting, speeds, reference, folder):
    """Run a code, repeated when it is quick, and score its last output."""
    path = Path(folder) / "output.txt"
    output, cpu, process = run_program(code.command, case, setting, speeds, path)
    spent, runs = cpu, 1
    while runs < 5 and spent < REPEAT_BUDGET:
        output, again, process_again = run_program(code.command, case, setting, speeds, path)
        cpu, process = min(cpu, again), min(process, process_again)
        spent += process_again
        runs += 1
    row = {"code": code.name, "case": case, "setting": setting, "speeds": cases.count(speeds), "runs": runs}
    row |= {"cpu": cpu, "process": process, "events": output.header.get("events")}
    try:
        if case == "p2":
            row |= cases.score_p2(output, reference)
        else:
            row |= cases.score_p3(output, reference, speeds)
            row["chaotic"] = cases.chaotic_statistics(output)
            row["cpu_all"] = cpu * cases.count(cases.P3_SPEEDS) / cases.count(speeds)
    except (ValueError, KeyError) as exc:
        raise ProgramError(str(exc)) from exc
    return row


def reference(build, precision, case, speeds, order=40, reach=2.0):
    """Compute a reference, or take it from the build folder when the same program has written it before."""
    source = (BENCH / "reference" / "reference.c").read_bytes()
    key = hashlib.sha256(source + repr((precision, case, speeds, order, reach)).encode()).hexdigest()[:12]
    path = Path(build) / f"reference_{case}_{precision}_{key}.txt"
    if not path.exists():
        partial = path.with_suffix(".partial")
        command = [str(Path(build) / f"reference_{precision}"), case, *(repr(x) for x in speeds)]
        subprocess.run([*command, str(order), repr(reach), str(partial)], check=True)
        partial.rename(path)
    output = cases.read_output(path)
    if output.header["undecided"] != 0:
        raise ProgramError(f"{path.name}: a root could not be decided")
    return output


def references(build, full):
    """The references of P2 and P3 and their errors, relative to the largest |d|, against a tighter computation."""
    p2 = reference(build, "quad", "p2", cases.P2_SPEEDS)
    p2_tight = reference(build, "quad", "p2", cases.P2_SPEEDS, order=32, reach=1.0)
    errors = {"p2": cases.score_p2(p2_tight, p2)["error"]}
    if full:
        p3 = reference(build, "quad", "p3", cases.P3_SPEEDS)
        check, speeds = reference(build, "quad", "p3", cases.P3_SPEEDS, order=32, reach=1.0), cases.P3_SPEEDS
    else:
        p3 = reference(build, "long", "p3", cases.P3_SPEEDS)
        check, speeds = reference(build, "quad", "p3", cases.P3_SAMPLE), cases.P3_SAMPLE
    score = cases.score_p3(check, p3, speeds)
    if score["lost"]:
        raise ProgramError(f"the reference disagrees with itself at {score['wrong_speeds']} rpm")
    errors |= {"p3": score["worst"], "p3_speeds": score["compared"], "p3_precision": "quad" if full else "long"}
    return p2, p3, errors
