"""Sweeps that are killed, stopped, started twice, or run out of disk: nothing computed is lost, the end is the same."""

import os
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from faults import CHECKPOINT, Sweep, kill_all, points_done, processes_of, rank_of, resume, stop
from programs import GEAR_PAIR, datasets, left, plot, sets, start, succeed

LONG = [GEAR_PAIR, *sets(sweep__step=8, motion__t_end=0.9)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Files of an undisturbed sweep, computed once."""
    folder = tmp_path_factory.mktemp("whole")
    before = Path.cwd()
    os.chdir(folder)
    sweep = Sweep(*LONG)
    os.chdir(before)
    sweep.file = folder / "whole.h5"
    return sweep


@pytest.fixture
def sweep(whole, folder):
    (folder / "whole.h5").write_bytes(whole.file.read_bytes())
    return whole


def begin_checkpoint(sweep, size=40000, ranks=None):
    """Leave the checkpoint of a killed sweep."""
    process = sweep.begin(size, ranks=ranks)
    kill_all(process)
    return Path(CHECKPOINT).read_bytes()


@pytest.mark.parametrize(("before", "ranks"), [(None, None), (None, 2), (None, 3), (8, 4)])
def test_killed_sweep_goes_on_with_any_number_of_ranks(sweep, before, ranks):
    begin_checkpoint(sweep, ranks=before)
    assert not Path("case.h5").exists()
    done = sweep.start(ranks=ranks)
    assert done.returncode == 0, done.stderr
    # Several ranks may be through while the writer is on its way to the pause.
    assert 0 < points_done(done.stderr) < (201 if before is None else 202)
    sweep.expect_whole()


@pytest.mark.parametrize("rank", [0, 1, 2])
def test_one_rank_is_killed(sweep, rank):
    process = sweep.begin(20000, ranks=3)
    os.kill(next(number for number in processes_of(process.pid) if rank_of(number) == rank), signal.SIGKILL)
    kill_all(process)
    done = sweep.start(ranks=2)
    assert points_done(done.stderr) > 0
    sweep.expect_whole()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR1])
def test_signal_to_a_single_process_stops_it_with_its_own_code(sweep, number):
    process = sweep.begin(20000)
    assert stop(process, number) == 3
    stopped = points_done(Path("log").read_text())
    assert not Path("case.h5").exists()
    done = sweep.start()
    assert points_done(done.stderr) == stopped
    sweep.expect_whole()


@pytest.mark.parametrize("rank", [None, 0, 1, 2])
def test_signal_to_all_ranks_or_to_one_stops_all(sweep, rank):
    process = sweep.begin(20000, ranks=3)
    assert stop(process, signal.SIGUSR1 if rank is None else signal.SIGTERM, rank) == 3
    stopped = points_done(Path("log").read_text())
    done = sweep.start(ranks=2)
    assert points_done(done.stderr) == stopped
    sweep.expect_whole()


def test_changed_input_is_refused_and_the_key_named(sweep):
    before = begin_checkpoint(sweep)
    done = sweep.start(*sets(motion__t_end=0.8))
    assert done.returncode == 2
    assert "&motion t_end = 0.8" in done.stderr and "there: 0.9" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert Path(CHECKPOINT).read_bytes() == before
    assert sweep.start("--anew", *sets(motion__t_end=0.4)).returncode == 0
    assert datasets("case.h5") != datasets("whole.h5")
    assert sweep.start("--force").returncode == 0
    sweep.expect_whole()


@pytest.mark.parametrize("ranks", [None, 2])
def test_what_was_killed_with_its_file_there_ends_when_it_is_called_again(sweep, ranks):
    """Between the naming of the file and the end of the checkpoint a kill leaves both."""
    begin_checkpoint(sweep)
    Path("case.h5").write_bytes(Path("whole.h5").read_bytes())
    refused = sweep.start("--anew")
    assert refused.returncode == 2 and "case.h5: exists already" in refused.stderr
    done = sweep.start(ranks=ranks)
    assert done.returncode == 0 and points_done(done.stderr) > 0
    sweep.expect_whole()
    assert left() == ["case.h5", "log", "whole.h5"]


def test_a_checkpoint_beside_the_file_of_another_input_stays(sweep):
    begin_checkpoint(sweep)
    succeed("razy-sweep", *LONG, *sets(motion__t_end=0.4), "--output", "case.h5.other")
    Path("case.h5.other").rename("case.h5")
    before = Path("case.h5").read_bytes()
    refused = sweep.start()
    assert refused.returncode == 2 and "case.h5: exists already" in refused.stderr
    assert Path("case.h5").read_bytes() == before and CHECKPOINT in left()


@pytest.mark.parametrize("content", [b"precious", b"short", b"razychkp", b"\0" * 4096])
def test_foreign_checkpoint_is_refused_and_kept(content):
    Path(CHECKPOINT).write_bytes(content)
    done = start("razy-sweep", *LONG, "--output", "case.h5")
    assert done.returncode == 2
    assert CHECKPOINT in done.stderr and len(done.stderr.splitlines()) == 1
    assert left() == [CHECKPOINT]
    assert Path(CHECKPOINT).read_bytes() == content


def test_truncated_checkpoint_loses_its_last_record_only(sweep):
    full = begin_checkpoint(sweep, 100000)
    for size in (len(full) - 1, len(full) - 8, len(full) // 3):
        Path(CHECKPOINT).write_bytes(full[:size])
        done = sweep.start()
        assert done.returncode == 0, done.stderr
        assert points_done(done.stderr) > 0
        sweep.expect_whole()
        Path("case.h5").unlink()


def test_what_is_behind_damage_is_computed_again(sweep):
    process = sweep.begin(40000)
    assert stop(process, signal.SIGTERM) == 3
    full = Path(CHECKPOINT).read_bytes()
    for place in (len(full) - 200, len(full) // 2):
        Path(CHECKPOINT).write_bytes(full[:place] + bytes([full[place] ^ 1]) + full[place + 1 :])
        done = sweep.start()
        assert done.returncode == 0, done.stderr
        assert "behind its last whole record is dropped" in done.stderr
        sweep.expect_whole()
        Path("case.h5").unlink()
    Path(CHECKPOINT).write_bytes(full[:30] + bytes([full[30] ^ 1]) + full[31:])
    done = sweep.start()
    assert done.returncode == 2
    assert "damaged" in done.stderr and len(done.stderr.splitlines()) == 1
    assert left() == sorted([CHECKPOINT, "log", "whole.h5"])


def test_two_runs_at_once_are_refused(sweep):
    process = sweep.begin(1000, ranks=2)
    done = sweep.start()
    assert done.returncode == 2
    assert "another run is at work on this output" in done.stderr
    assert sweep.start("--anew").returncode == 2
    resume(process)
    assert process.wait(timeout=60) == 0
    sweep.expect_whole()


def test_full_disk_is_said_and_what_is_safe_stays(sweep):
    disk = Path("disk")
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(disk)], capture_output=True, text=True
    )
    if mounted.returncode != 0:
        pytest.skip(f"a small tmpfs cannot be mounted here: {mounted.stderr.strip()}")
    try:
        arguments = [*LONG, "--output", disk / "case.h5"]
        done = start("razy-sweep", *arguments)
        assert done.returncode == 1
        assert "No space left on device" in done.stderr and "safe in" in done.stderr
        assert [path.name for path in disk.iterdir()] == [CHECKPOINT]
        again = start("razy-sweep", *arguments)
        assert again.returncode == 1
        kept = points_done(again.stderr)
        assert kept > 10
        subprocess.run(["mount", "-o", "remount,size=10m", str(disk)], check=True)
        third = start("razy-sweep", *arguments, ranks=2)
        assert third.returncode == 1, "room for the checkpoint, but not for the file besides"
        assert points_done(third.stderr) >= kept
        assert "No space left on device" in third.stderr
        assert [path.name for path in disk.iterdir()] == [CHECKPOINT]
        subprocess.run(["mount", "-o", "remount,size=40m", str(disk)], check=True)
        last = start("razy-sweep", *arguments)
        assert last.returncode == 0, last.stderr
        assert points_done(last.stderr) == 201
        assert (disk / "case.h5").read_bytes() == Path("whole.h5").read_bytes()
        assert [path.name for path in disk.iterdir()] == ["case.h5"]
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_results_reach_the_disk_in_the_time_asked_for():
    done = start("razy-sweep", *LONG, "--output", "case.h5", "--checkpoint", "-1")
    assert done.returncode == 2 and "--checkpoint -1" in done.stderr
    done = start("razy-sweep", *LONG, "--output", "case.h5", "--checkpoint-points", "0")
    assert done.returncode == 2 and "--checkpoint-points 0" in done.stderr
    started = time.monotonic()
    succeed("razy-sweep", *LONG, "--output", "often.h5", "--checkpoint", "0")
    assert time.monotonic() - started < 100
    assert left() == ["often.h5"]


def ends_of_results(checkpoint):
    """Bytes of a checkpoint up to the end of each result in it (docs/file_format.md)."""
    words = np.frombuffer(checkpoint[: len(checkpoint) // 8 * 8], dtype="<i8")
    place, found = 4 + int(words[2]) + 1, []
    while place < words.size:
        place += int(words[place]) + 2
        found.append(8 * place)
    return found


def test_results_are_flushed_after_a_number_of_points(sweep, monkeypatch):
    monkeypatch.setenv("RAZY_TEST_FLUSHES", "flushes")
    process = sweep.begin(400000, options=["--checkpoint", "1000", "--checkpoint-points", "5"])
    kill_all(process)
    flushed = [int(line) for line in Path("flushes").read_text().split()]
    ends = ends_of_results(Path(CHECKPOINT).read_bytes())
    assert len(flushed) > 3 and flushed == ends[4 : 5 * len(flushed) : 5] and len(ends) <= 5 * len(flushed) + 5
    done = sweep.start()
    assert done.returncode == 0, done.stderr
    sweep.expect_whole()


def test_a_sweep_under_way_has_a_picture(sweep):
    """A copy of its checkpoint becomes a file in which the points that are missing say so; the sweep itself goes on."""
    now = [*sweep.arguments[:-1], "now.h5", "--so-far"]
    refused = start("razy-sweep", *now)
    assert refused.returncode == 2 and "now.h5.checkpoint: there is no such file" in refused.stderr
    process = sweep.begin(40000)
    try:
        Path("now.h5.checkpoint").write_bytes(Path(CHECKPOINT).read_bytes())
        done = succeed("razy-sweep", *now)
    finally:
        resume(process)
    assert process.wait(timeout=120) == 0
    sweep.expect_whole()
    with h5py.File("now.h5") as file, h5py.File("whole.h5") as whole:
        status = file["point/status"]
        there = status[:] == 0
        assert 0 < there.sum() < there.size and set(status[:][~there]) == {11}
        assert "11 = not computed yet" in status.attrs["meanings"]
        assert f"wrote now.h5: {there.sum()} of {there.size} points" in done.stderr
        lists = []
        for one in (file, whole):
            offset, value = (one[f"extrema/mesh_deformation/{name}"][:] for name in ("offset", "value"))
            lists.append(np.split(value, offset[1:-1]))
        assert all(np.array_equal(a, b if here else []) for a, b, here in zip(*lists, there, strict=True))
    assert "now.h5.checkpoint" not in left()
    drawn = plot("now.h5", "--save", "now.png", "--dpi", "50")
    assert drawn.returncode == 0, drawn.stderr
