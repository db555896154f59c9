"""Thirty kills at random moments, of all ranks, one rank, or the writer; after each the sweep is started again."""

import os
import random
import signal
import time
from pathlib import Path

import pytest
from faults import Sweep, kill_all, processes_of, rank_of
from programs import GEAR_PAIR, SOURCE, sets

KILLS = 30
CASES = {
    "points": (GEAR_PAIR, *sets(sweep__step=0.5, motion__t_end=0.9)),
    "chains": (SOURCE / "inputs" / "hysteresis.nml", *sets(sweep__points=4001, motion__t_end=24)),
}


@pytest.mark.parametrize("case", CASES)
def test_random_kills(case):
    sweep = Sweep(*CASES[case])
    choice = random.Random(20261121)
    kills, unfinished = 0, 0
    while kills < KILLS:
        process = sweep.begin(ranks=choice.choice([1, 2, 3, 4]))
        time.sleep(choice.uniform(0.0, 0.8))
        found = processes_of(process.pid)
        victim = choice.choice(["all", "one", "writer"])
        if victim == "all" or not found:
            kill_all(process)
        else:
            chosen = [number for number in found if rank_of(number) == 0] if victim == "writer" else found
            os.kill(choice.choice(chosen or found), signal.SIGKILL)
            time.sleep(0.05)
            kill_all(process)
        kills += 1
        if process.returncode == 0:
            sweep.expect_whole()
            Path("case.h5").unlink()
        else:
            unfinished += 1
    assert unfinished > KILLS // 2
    done = sweep.start("--force", timeout=900)
    assert done.returncode == 0, done.stderr
    sweep.expect_whole()
