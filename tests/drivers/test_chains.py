"""Chains of motions: each starts where the one before ended, with the excitation going on; up, down, both."""

from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pytest
from faults import Sweep, kill_all, points_done
from programs import SOURCE, changed, datasets, sets, start, succeed

HYSTERESIS = SOURCE / "inputs" / "hysteresis.nml"


def extrema(path):
    """Extrema of each point of a sweep as (values, times), and its datasets of points."""
    with h5py.File(path) as file:
        group = file["extrema/displacement"]
        offset = group["offset"][:]
        pieces = [(group["value"][a:b], group["time"][a:b]) for a, b in pairwise(offset)]
        return pieces, {name: item[:] for name, item in file["point"].items()}


def test_a_chain_whose_parameter_changes_nothing_is_one_long_motion(folder):
    """Three motions of 0.3, 0.4 and 0.5 s, one after the other: state and phase of the excitation go on."""
    text = HYSTERESIS.read_text()
    case = changed(
        folder / "case.nml", text, ("(?m)^&sweep.*$", ""), ("t_end=6.0", "t_end=0.3"), ("from=5.0", "from=0.0"),
        ("frequency=12.0", "frequency=17.3"),
    )  # fmt: skip
    case.write_text(case.read_text() + "&load on='block', amplitude=1.0, frequency=29.1 /\n")
    chain = "&sweep parameter='motion%t_end', first=0.3, last=0.5, points=3, direction='{}' /\n"
    (folder / "up.nml").write_text(case.read_text() + chain.format("up"))
    (folder / "down.nml").write_text(case.read_text() + chain.format("down"))
    succeed("razy-run", case, *sets(motion__t_end=1.2), "--output", "long.h5")
    with h5py.File("long.h5") as file:
        value, time = file["extrema/displacement/value"][:], file["extrema/displacement/time"][:]
        events = file["event/time"].size
    assert value.size > 30 and events > 20
    for name, starts in (("up", [0.0, 0.3, 0.7]), ("down", [0.9, 0.5, 0.0])):
        succeed("razy-sweep", f"{name}.nml")
        pieces, points = extrema(f"{name}.h5")
        order = np.argsort(starts)
        found = np.concatenate([pieces[k][0] for k in order])
        when = np.concatenate([pieces[k][1] + starts[k] for k in order])
        assert points["direction"].tolist() == [1 if name == "up" else -1] * 3
        assert points["events"].sum() == events
        np.testing.assert_allclose(when, time, rtol=0, atol=1e-12)
        np.testing.assert_allclose(found, value, rtol=0, atol=1e-15)


def amplitudes(path):
    pieces, points = extrema(path)
    return np.array([value.max() for value, _ in pieces]), points


def test_hysteresis():
    """Between the jumps the way up has the large motion and the way down the small one; elsewhere they agree."""
    # Longer than in the input, so that the motion after a jump has died away too.
    succeed("razy-sweep", HYSTERESIS, *sets(motion__t_end=9, record__from=8))
    amplitude, points = amplitudes("hysteresis.h5")
    assert points["direction"].tolist() == [1] * 241 + [-1] * 241
    up, down = amplitude[:241], amplitude[241:]
    frequency = points["load.frequency"]
    assert np.array_equal(frequency[:241], frequency[241:])
    frequency = frequency[:241]
    differ = up > 1.2 * down
    assert 17.0 < frequency[differ].min() < 18.0 and 26.0 < frequency[differ].max() < 27.0
    assert np.all(differ == ((frequency >= frequency[differ].min()) & (frequency <= frequency[differ].max())))
    np.testing.assert_allclose(up[~differ], down[~differ], rtol=1e-3)
    # Below the stops the motion is that of a linear oscillator.
    small = down[differ & (frequency > 19)]
    omega = 2 * np.pi * frequency[differ & (frequency > 19)]
    np.testing.assert_allclose(small, 2.0 / np.hypot(1.0e4 - omega**2, 4.0 * omega), rtol=1e-3)


def test_one_direction_is_that_half_of_both():
    coarse = sets(sweep__points=25, motion__t_end=5.5)
    succeed("razy-sweep", HYSTERESIS, *coarse, "--output", "both.h5")
    both, points = extrema("both.h5")
    for name, half in (("up", both[:25]), ("down", both[25:])):
        succeed("razy-sweep", HYSTERESIS, *coarse, "--set", f"sweep%direction='{name}'", "--output", f"{name}.h5")
        pieces, own = extrema(f"{name}.h5")
        assert set(own["direction"]) == {1 if name == "up" else -1}
        for one, other in zip(pieces, half, strict=True):
            assert np.array_equal(one, other)
    assert np.all(np.diff(points["load.frequency"][:25]) > 0)


def test_ranks():
    coarse = sets(sweep__points=25, motion__t_end=5.5)
    succeed("razy-sweep", HYSTERESIS, *coarse, "--output", "alone.h5")
    for ranks in (1, 2, 3, 4):
        succeed("razy-sweep", HYSTERESIS, *coarse, "--output", f"{ranks}.h5", ranks=ranks)
        assert Path(f"{ranks}.h5").read_bytes() == Path("alone.h5").read_bytes()


def test_after_a_failed_point_the_chain_begins_anew():
    options = [*sets(sweep__points=25, motion__t_end=5.5), "--set", "sweep%direction='up'"]
    succeed("razy-sweep", HYSTERESIS, *options, "--output", "whole.h5")
    _, points = extrema("whole.h5")
    limit = int(np.sort(points["events"])[-3])
    succeed("razy-sweep", HYSTERESIS, *options, *sets(motion__max_events=limit), "--output", "limited.h5")
    pieces, limited = extrema("limited.h5")
    failed = np.flatnonzero(limited["status"])
    assert failed.size > 0 and failed[0] < 24
    after = failed[np.flatnonzero(np.append(np.diff(failed) > 1, True))[0]] + 1
    frequency = limited["load.frequency"][after]
    single = sets(load__frequency=frequency, motion__t_end=5.5)
    succeed("razy-run", HYSTERESIS, *single, "--output", "run.h5")
    with h5py.File("run.h5") as file:
        np.testing.assert_allclose(pieces[after][0], file["extrema/displacement/value"][:], rtol=0, atol=1e-13)


@pytest.mark.parametrize("ranks", [None, 1, 2, 3])
def test_killed_chains_go_on_in_the_middle(ranks):
    sweep = Sweep(HYSTERESIS, *sets(sweep__points=961, motion__t_end=5.5))
    size = 0
    for again in (2, 3, None):
        process = sweep.begin(size + 40000, ranks=again)
        kill_all(process)
        size = Path("case.h5.checkpoint").stat().st_size
    done = sweep.start(ranks=ranks)
    assert done.returncode == 0, done.stderr
    assert 0 < points_done(done.stderr) < 2 * 961
    sweep.expect_whole()


def test_a_direction_that_is_none_is_refused():
    done = start("razy-sweep", HYSTERESIS, "--set", "sweep%direction='sideways'")
    assert done.returncode == 2
    assert "&sweep%direction" in done.stderr and "'both'" in done.stderr


def test_points_alone_have_no_direction():
    succeed("razy-sweep", HYSTERESIS, *sets(sweep__points=5), "--set", "sweep%direction='independent'")
    assert "point/direction" not in datasets("hysteresis.h5")
