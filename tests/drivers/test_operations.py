"""What a user of a queue asks of a sweep: how long it will take, how it went, and what failed, to be run alone."""

import re
import shlex
import signal
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from faults import Sweep, stop
from programs import BUILD, GEAR_PAIR, PATIENCE, SOURCE, left, sets, start, succeed

BASINS = SOURCE / "inputs" / "basins.nml"
HYSTERESIS = SOURCE / "inputs" / "hysteresis.nml"


def megabytes(text, what):
    return float(re.search(what + r": ([\d.]+) MB", text)[1])


@pytest.mark.parametrize("ranks", [None, 2])
def test_dry_run_says_what_the_sweep_takes_and_leaves_nothing(ranks):
    done = succeed("razy-sweep", BASINS, "--dry-run", ranks=ranks)
    assert done.stdout.startswith("5043 points: 3 of the grid, 1681 starts each\n")
    assert ("on 2 ranks" if ranks else "on 1 rank ") in done.stdout and left() == []
    succeed("razy-sweep", BASINS, "--output", "case.h5")
    assert megabytes(done.stdout, "result file") == pytest.approx(Path("case.h5").stat().st_size / 1e6, rel=0.1)


def test_dry_run_of_chains():
    done = succeed("razy-sweep", HYSTERESIS, "--dry-run")
    assert "2 chains of 241 points that follow each other" in done.stdout


def run_again(line, *more):
    """Run the command of a line of the log as a shell would."""
    words = shlex.split(line[line.index("razy-run") :])
    words[0] = str(BUILD / "bin" / "razy-run")
    return words[-1], subprocess.run([*words, *more], capture_output=True, text=True, timeout=PATIENCE)


def test_failures_are_told_with_the_command_that_repeats_them():
    options = [*sets(motion__max_events=400), "--set", "start_range(1)%points=5", "--set", "start_range(2)%points=5"]
    options += ["--set", "scene%title='it is'"]
    done = succeed("razy-sweep", BASINS, *options, "--output", "case.h5", "--log", "log.txt")
    assert "failed point" not in done.stderr
    lines = Path("log.txt").read_text().splitlines()
    with h5py.File("case.h5") as file:
        status = file["point/status"][:]
        offset = file["extrema/displacement/offset"][:]
        value = file["extrema/displacement/value"][:]
        events = file["point/events"][:]
    failed = [line for line in lines if line.startswith("failed point")]
    assert [int(re.match(r"failed point (\d+): event limit reached: ", line)[1]) for line in failed] == list(
        np.flatnonzero(status)
    )
    slow = [line for line in lines if line.startswith("slow point")]
    times = [float(re.match(r"slow point \d+: ([\d.]+) ms", line)[1]) for line in slow]
    assert len(times) == 10 and times == sorted(times, reverse=True)
    for line in (failed[1], slow[0]):
        point = int(line.split()[2][:-1])
        output, again = run_again(line)
        assert again.returncode == (1 if status[point] else 0), again.stderr
        with h5py.File(output) as file:
            assert file["event/time"].size == events[point]
            found = file["extrema/displacement/value"][:]
        np.testing.assert_allclose(found, value[offset[point] : offset[point + 1]], rtol=0, atol=1e-13)


def test_few_failures_are_told_without_a_log():
    done = succeed("razy-sweep", BASINS, *sets(motion__max_events=300), "--output", "case.h5")
    assert done.stderr.count("failed point") == 3
    assert re.search(r"\n\d+ more points failed; --log FILE tells all\n", done.stderr)
    assert succeed("razy-sweep", GEAR_PAIR, *sets(sweep__step=100)).stderr.count("failed point") == 0


def test_log_of_an_interrupted_sweep_goes_on():
    sweep = Sweep(GEAR_PAIR, *sets(sweep__step=4, motion__t_end=0.9))
    sweep.arguments += ["--log", "log.txt"]
    process = sweep.begin(20000)
    assert stop(process, signal.SIGTERM) == 3
    sweep.start(ranks=2)
    sweep.expect_whole()
    text = Path("log.txt").read_text()
    marks = re.findall(r"(?m)^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d[+-]\d{4} (start|stopped|end): (.*)$", text)
    assert [mark for mark, _ in marks] == ["start", "stopped", "start", "end"]
    assert marks[0][1].endswith("1 rank, 401 points, 0 done before")
    first, second = (int(marks[k][1].split()[0]) for k in (1, 3))
    assert marks[2][1].endswith(f"2 ranks, 401 points, {first} done before") and first + second == 401


def test_log_that_cannot_be_written_is_refused_at_once():
    done = start("razy-sweep", GEAR_PAIR, "--log", "nowhere/log.txt")
    assert done.returncode == 2 and "nowhere/log.txt: the log cannot be written" in done.stderr
    assert not Path("torsional_gear_pair.h5").exists()


def test_a_log_on_the_error_channel():
    short = sets(sweep__last=1004.0, motion__t_end=0.3)
    said = succeed("razy-sweep", GEAR_PAIR, *short, "--log", "-").stderr
    assert "rank, 2 points, 0 done before\n" in said and " end: 2 points in " in said
    assert sorted(left()) == ["torsional_gear_pair.h5"]
