"""A hundred kills at random moments, under OpenBLAS with threads where there is one; after each the sweep goes on.

A signal goes to mpirun, one rank, the writer, or all ranks. Only what comes before the end, to ranks that have all
started, counts. Files are those of an undisturbed sweep, byte for byte.
"""

import contextlib
import os
import random
import re
import signal
import time
from pathlib import Path

import pytest
from faults import CHECKPOINT, Sweep, kill_all, processes_of, rank_of
from programs import GEAR_PAIR, SOURCE, folder_of_openblas, left, sets

KILLS = 25
CASES = {
    "points": (GEAR_PAIR, *sets(sweep__step=0.5, motion__t_end=0.9)),
    "chains": (SOURCE / "inputs" / "hysteresis.nml", *sets(sweep__points=4001, motion__t_end=24)),
}
STOPPED = 3
SIGNALS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGKILL)


def holds(process, number):
    """Whether the process has a handler for the signal."""
    with contextlib.suppress(OSError):
        caught = re.search(r"SigCgt:\s*(\w+)", Path(f"/proc/{process}/status").read_text())[1]
        return bool(int(caught, 16) >> (number - 1) & 1)
    return False


def strike(process, ranks, choice):
    """Send a signal to some of a sweep; return the exit codes that may follow, none if not all ranks had started."""
    number, victim = choice.choice(SIGNALS), choice.choice(["mpirun", "one", "writer", "all"])
    found = processes_of(process.pid)
    with contextlib.suppress(ProcessLookupError, FileNotFoundError):
        if len(found) == ranks and all(holds(one, signal.SIGUSR1) for one in found):
            targets = {"mpirun": [process.pid], "one": [choice.choice(found)], "all": found}
            for target in targets.get(victim, [one for one in found if rank_of(one) == 0]):
                os.kill(target, number)
            # An mpirun that gets SIGTERM gives its ranks a second.
            sudden = number == signal.SIGKILL or (victim == "mpirun" and number == signal.SIGTERM)
            if number == signal.SIGKILL:
                time.sleep(0.05)
                kill_all(process)
            return range(-9, 256) if sudden else {STOPPED}
    kill_all(process)
    return None


@pytest.mark.parametrize("ranks", [2, 3])
@pytest.mark.parametrize("case", CASES)
def test_random_kills(case, ranks, monkeypatch):
    if folder_of_openblas() is not None:
        monkeypatch.setenv("LD_LIBRARY_PATH", str(folder_of_openblas()))
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    sweep = Sweep(*CASES[case])
    before = time.monotonic()
    process = sweep.begin(ranks=ranks)
    process.wait()
    duration = time.monotonic() - before
    sweep.expect_whole()
    Path("case.h5").unlink()
    choice = random.Random(20261121)
    kills = 0
    while kills < KILLS:
        process = sweep.begin(ranks=ranks)
        time.sleep(choice.uniform(0.0, duration / 2))
        allowed = strike(process, ranks, choice)
        code = process.wait(timeout=60)
        kill_all(process)
        if code == 0:
            sweep.expect_whole()
            assert left() == ["case.h5", "log", "whole.h5"]
        elif allowed is not None:
            assert code in allowed, (code, Path("log").read_text())
            kills += 1
        # Also of a sweep that was killed after its last word.
        if Path("case.h5").exists():
            Path("case.h5").unlink()
            Path(CHECKPOINT).unlink(missing_ok=True)
    done = sweep.start(ranks=ranks, timeout=900)
    assert done.returncode == 0, done.stderr
    sweep.expect_whole()
    assert left() == ["case.h5", "log", "whole.h5"]
