"""Points that fail, and programs that are killed."""

import fcntl
import os
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
from programs import GEAR_PAIR, PATIENCE, command, left, sets, succeed


def test_failed_points_are_recorded_and_the_sweep_goes_on():
    everything = sets(sweep__step=50, record__from=0)
    succeed("razy-sweep", GEAR_PAIR, *everything, "--output", "whole.h5")
    with h5py.File("whole.h5") as file:
        events = file["point/events"][:]
    limit = int(np.median(events)) + 1
    while limit in events:
        limit += 1
    done = succeed("razy-sweep", GEAR_PAIR, *everything, *sets(motion__max_events=limit), "--output", "limited.h5")
    fails = events > limit
    assert 3 < fails.sum() < events.size - 3
    assert f"{events.size} points, {fails.sum()} failed" in done.stderr
    with h5py.File("whole.h5") as whole, h5py.File("limited.h5") as limited:
        status = limited["point/status"]
        assert np.array_equal(status[:] != 0, fails)
        code = np.unique(status[:][fails])
        assert code.size == 1
        assert f"{code[0]} = event limit reached" in status.attrs["meanings"]
        assert np.all(limited["point/events"][:][fails] == limit)
        extrema = [file["extrema/mesh_deformation"] for file in (whole, limited)]
        values = [np.split(group["value"][:], group["offset"][1:-1]) for group in extrema]
    for k, failed in enumerate(fails):
        if failed:
            assert np.array_equal(values[1][k], values[0][k][: values[1][k].size])
            assert values[1][k].size < values[0][k].size
        else:
            assert np.array_equal(values[1][k], values[0][k])


def start_and_kill(program, *arguments, until=None):
    """Kill the program when it has computed for a while and the file `until` is there; it must not be at its end."""
    with subprocess.Popen(command(program, *arguments), stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL) as process:
        time.sleep(1.0)
        for _ in range(PATIENCE):
            if until is None or Path(until).exists():
                break
            time.sleep(0.5)
        assert process.poll() is None
        process.kill()
    assert process.returncode == -9


def test_killed_run_leaves_no_file_of_the_final_name():
    start_and_kill("razy-run", GEAR_PAIR, *sets(motion__t_end=1e7, record__from=1e6))
    assert left() == []


def test_killed_sweep_leaves_no_file_of_the_final_name_and_keeps_an_older_one():
    endless = sets(sweep__step=1e-4, motion__t_end=3)
    start_and_kill("razy-sweep", GEAR_PAIR, *endless, until="torsional_gear_pair.h5.checkpoint")
    assert left() == ["torsional_gear_pair.h5.checkpoint"]
    succeed("razy-sweep", GEAR_PAIR, *sets(sweep__step=400), "--anew")
    before = Path("torsional_gear_pair.h5").read_bytes()
    start_and_kill("razy-sweep", GEAR_PAIR, *endless, "--force")
    assert Path("torsional_gear_pair.h5").read_bytes() == before


def test_what_a_killed_run_left_goes_with_the_next_unless_another_is_writing():
    """Writing is told by a shared lock of the folder, which a kill drops."""
    unfinished = [Path("torsional_gear_pair.h5.partial"), Path("torsional_gear_pair.h5.2.partial")]
    other = Path("other.h5.partial")
    for file in (*unfinished, other):
        file.write_text("unfinished")
    folder = os.open(".", os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_SH)
    succeed("razy-sweep", GEAR_PAIR, *sets(sweep__step=400))
    assert [file.read_text() for file in unfinished] == ["unfinished"] * 2
    os.close(folder)
    succeed("razy-sweep", GEAR_PAIR, *sets(sweep__step=400), "--force")
    assert left() == ["other.h5.partial", "torsional_gear_pair.h5"]
