"""Near misses of the points of a sweep: in the file, in the closing line, and however the sweep came to its end."""

import signal
import struct
from pathlib import Path

import h5py
import numpy as np
import pytest
from faults import CHECKPOINT, Sweep, points_done, stop
from programs import SOURCE, changed, sets, succeed
from test_merge import merge

MASK = (1 << 64) - 1
# Amplitude of the oscillator: the stops are grazed where the clearance is as large, and nowhere else among the points.
AMPLITUDE = 0.2 * np.sqrt(3.5 / 1e5)
GRAZED = 2


@pytest.fixture
def case(folder):
    """101 clearances in steps of half a percent of the amplitude; point 2 grazes."""
    text = (SOURCE / "inputs" / "two_sided_stop.nml").read_text()
    first, last = (float(share * AMPLITUDE) for share in (1.01, 0.51))
    sweep = f"&sweep parameter='stop%clearance', first={first!r}, last={last!r}, points=101 /\n"
    motion = ("integrator='exact'", "integrator='dop853', absolute_tolerance=1e-12, relative_tolerance=1e-9")
    return changed(folder / "graze.nml", text + sweep, motion, ("t_end=0.1", "t_end=5.0"))


def near_misses(path):
    with h5py.File(path) as file:
        item = file["point/near_misses"]
        assert (
            item.attrs["units"] == "1"
            and item.attrs["long_name"] == "switching functions that turned nearer to a bound than resolved"
        )
        assert item.attrs["coordinates"] == file["point/status"].attrs["coordinates"]
        return item[()]


def test_the_point_that_grazes_has_near_misses_and_the_closing_line_says_so(case):
    done = succeed("razy-sweep", case, "--output", "case.h5")
    found = near_misses("case.h5")
    assert found.dtype == np.int64 and found.shape == (101,)
    assert np.flatnonzero(found).tolist() == [GRAZED]
    assert done.stderr.splitlines()[-1].endswith(" %, near misses at 1 point")
    with h5py.File("case.h5") as file:
        clearance = file["axis/stop.clearance"][GRAZED]
    succeed("razy-run", case, *sets(stop__clearance=repr(float(clearance))), "--output", "alone.h5")
    with h5py.File("alone.h5") as file:
        assert file["outcome/near_misses"][0] == found[GRAZED] > 20
    exact = sets(motion__integrator="'exact'")
    succeed("razy-sweep", case, *exact, "--output", "exact.h5")
    # One for each of the touches of both stops in 5 s.
    by_exact = near_misses("exact.h5")
    assert np.flatnonzero(by_exact).tolist() == [GRAZED]
    assert by_exact[GRAZED] == pytest.approx(5.0 * np.sqrt(1e5 / 3.5) / np.pi, abs=4.0)


TOUCH = """&scene kind='lumped' /
&mass name='a', value=1.0 /
&mass name='b', value=2.0 /
&spring between='a','frame', stiffness=1.0 /
&stop name='w', between='a','b', side='upper', clearance=2.0, law='rigid', restitution=0.5 /
&load on='a', value=1.0 /
&motion t_end=40.0, start='zero' /
&record observable='displacement', of='a', what='extrema' /
"""


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_a_body_that_comes_to_another_without_speed_nearly_hits_it(folder, method):
    """1 - cos t, of which the body at 2 is touched six times."""
    (folder / "touch.nml").write_text(TOUCH)
    done = succeed("razy-run", folder / "touch.nml", *sets(motion__integrator=f"'{method}'"), "--output", "touch.h5")
    with h5py.File("touch.h5") as file:
        assert file["outcome/events"][0] == 0 and 6 <= file["outcome/near_misses"][0] <= 7
    assert "near misses: " in done.stderr


def test_ranks_and_an_interrupted_sweep_give_the_same_near_misses(case):
    sweep = Sweep(case)
    assert np.count_nonzero(near_misses("whole.h5")) == 1
    for ranks in (1, 2, 3):
        done = sweep.start(ranks=ranks)
        assert "near misses at 1 point" in done.stderr
        sweep.expect_whole()
        Path("case.h5").unlink()
    # Beyond the point that grazes: its near misses come out of the checkpoint.
    assert interrupted(sweep) > GRAZED
    assert sweep.start(ranks=2).returncode == 0
    sweep.expect_whole()


def interrupted(sweep, recorded=32000):
    """Stop the sweep when so many bytes are in its checkpoint; return how many points are done."""
    process = sweep.begin(recorded)
    assert stop(process, signal.SIGTERM) == 3
    return points_done(Path("log").read_text())


def test_merged_parts_have_the_near_misses_of_the_whole(case):
    succeed("razy-sweep", case, "--output", "whole.h5")
    with h5py.File("whole.h5") as file:
        values = file["axis/stop.clearance"][()]
    for name, part in (("a.h5", slice(0, 60)), ("b.h5", slice(60, 101))):
        ends = {f"sweep__{end}": repr(float(values[part][k])) for end, k in (("first", 0), ("last", -1))}
        options = sets(**ends, sweep__points=len(values[part]))
        succeed("razy-sweep", case, *options, "--output", name)
    done = merge("a.h5", "b.h5", "--output", "all.h5")
    assert done.returncode == 0, done.stderr
    assert near_misses("all.h5").tolist() == near_misses("a.h5").tolist() + near_misses("b.h5").tolist()
    assert np.flatnonzero(near_misses("all.h5")).tolist() == [GRAZED]
    with h5py.File("all.h5") as file, h5py.File("whole.h5") as whole:
        assert file["point/near_misses"].dims[0][0].name == whole["point/near_misses"].dims[0][0].name


def test_checkpoint_of_a_layout_without_near_misses_is_refused_and_kept(case):
    sweep = Sweep(case)
    interrupted(sweep, 20000)
    complete = Path(CHECKPOINT).read_bytes()
    Path(CHECKPOINT).write_bytes(without_fourth_column(complete))
    before = Path(CHECKPOINT).read_bytes()
    done = sweep.start()
    assert done.returncode == 2
    assert "does not belong to this sweep" in done.stderr and len(done.stderr.splitlines()) == 1
    assert Path(CHECKPOINT).read_bytes() == before
    Path(CHECKPOINT).write_bytes(complete)
    assert sweep.start().returncode == 0
    sweep.expect_whole()


def without_fourth_column(checkpoint):
    """Return a checkpoint (docs/file_format.md) with rows as they were without near misses, without marks."""
    words = list(struct.unpack(f"<{len(checkpoint) // 8}q", checkpoint[: len(checkpoint) // 8 * 8]))
    place = 4 + words[2] + 1
    kept = words[:place]
    assert signed(checksum(kept[:-1])) == kept[-1]
    while place < len(words):
        n = words[place]
        if n < 0:
            place += 3
            continue
        point, status, events, steps, _, *others = words[place + 1 : place + 1 + n]
        record = [n - 1, point, status, events, steps, *others]
        kept += [*record, signed(checksum(record))]
        place += n + 2
    return struct.pack(f"<{len(kept)}q", *kept)


def checksum(words):
    total = 7640891576956012809
    for word in words:
        total ^= word & MASK
        total ^= total << 13 & MASK
        total ^= total >> 7
        total ^= total << 17 & MASK
    return total


def signed(word):
    return word - (1 << 64) if word >> 63 else word
