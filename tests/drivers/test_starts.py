"""Several starts of each point: attractors, basin fractions, bits that depend on neither ranks nor interruptions."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from faults import Sweep, kill_all, points_done
from programs import SOURCE, changed, sets, start, succeed
from scipy.integrate import solve_ivp

BASINS = SOURCE / "inputs" / "basins.nml"
COARSE = ["--set", "start_range(1)%points=7", "--set", "start_range(2)%points=5"]


def read(path):
    """Datasets of the points and of the attractors."""
    with h5py.File(path) as file:
        return [{name: item[:] for name, item in file[group].items()} for group in ("point", "attractor")]


def final_state(frequency, displacement, velocity, t_end):
    """The block between its stops by an independent code."""
    omega = 2 * np.pi * frequency

    def rate(t, z):
        beyond = max(abs(z[0]) - 1.0e-3, 0.0) * np.sign(z[0])
        return [z[1], 2.0 * np.sin(omega * t) - 4.0 * z[1] - 1.0e4 * z[0] - 3.0e4 * beyond]

    return solve_ivp(rate, (0, t_end), [displacement, velocity], "DOP853", rtol=1e-10, atol=1e-13, max_step=5e-4).y[
        :, -1
    ]


def test_attractors_and_their_basins():
    succeed("razy-sweep", BASINS, *COARSE, "--output", "case.h5")
    point, attractor = read("case.h5")
    assert point["start"].tolist() == [k for k in range(1, 36) for _ in range(3)]
    x, v = point["start.block.displacement"], point["start.block.velocity"]
    assert np.array_equal(x[::3], np.repeat(np.linspace(-6e-3, 6e-3, 7), 5))
    assert np.allclose(v[::3], np.tile(np.linspace(-0.8, 0.8, 5), 7), rtol=1e-15, atol=0)
    rows = [slice(a, b) for a, b in zip(attractor["offset"][:-1], attractor["offset"][1:], strict=True)]
    omega = 2 * np.pi * np.array([20.0, 23.0, 26.0])
    linear = -2j / (1.0e4 - omega**2 + 4j * omega)
    for k, part in enumerate(rows):
        found = point["attractor"][k::3]
        for number, starts in zip(attractor["number"][part], attractor["starts"][part], strict=True):
            assert np.count_nonzero(found == number) == starts
        np.testing.assert_allclose(attractor["fraction"][part].sum(), 1.0, rtol=1e-15)
        np.testing.assert_allclose(attractor["fraction"][part], attractor["starts"][part] / 35)
        assert attractor["strobe_period"][part][0] == pytest.approx(2 * np.pi / omega[k], rel=1e-14)
        # Of the motion without impacts the state is known.
        z = linear[k] * np.exp(1j * omega[k] * 8.0)
        near = np.abs(attractor["velocity"][part, 0] - (1j * omega[k] * z).real) < 1e-4
        assert np.count_nonzero(near) == 1 and attractor["period"][part][near][0] == 1
        np.testing.assert_allclose(attractor["displacement"][part, 0][near], z.real, rtol=0, atol=1e-7)
        assert part.stop - part.start >= 2
    for index in (0, 31, 52, 73, 104):
        state = final_state(point["load.frequency"][index], x[index], v[index], 8.0)
        row = rows[index % 3].start + list(attractor["number"][rows[index % 3]]).index(point["attractor"][index])
        if attractor["number"][row] == 0:
            continue
        # One period: the state at the end is the same whenever the motion settled.
        assert attractor["period"][row] == 1
        np.testing.assert_allclose(
            state, [attractor["displacement"][row, 0], attractor["velocity"][row, 0]], rtol=0, atol=1e-4
        )


def test_each_start_is_the_motion_of_razy_run():
    succeed("razy-sweep", BASINS, *COARSE, "--output", "case.h5")
    point, _ = read("case.h5")
    index = 46
    text = BASINS.read_text() + "&initial on='block', displacement={!r}, velocity={!r} /\n".format(
        *(float(point[f"start.block.{quantity}"][index]) for quantity in ("displacement", "velocity"))
    )
    changed(Path("one.nml"), text, ("start='zero'", "start='given'"), (r"frequency=20\.0", "frequency=23.0"))
    succeed("razy-run", "one.nml")
    with h5py.File("case.h5") as many, h5py.File("one.h5") as one:
        offset = many["extrema/displacement/offset"][index : index + 2]
        value = many["extrema/displacement/value"][slice(*offset)]
        np.testing.assert_allclose(value, one["extrema/displacement/value"][:], rtol=0, atol=1e-13)


def box(folder, samples=40, seed=1):
    text = re.sub(r", points=41", "", BASINS.read_text())
    return changed(folder / "box.nml", text, ("method='grid'", f"method='box', samples={samples}, seed={seed}"))


def test_samples_lie_in_the_box_and_depend_on_seed_and_point_only(folder):
    succeed("razy-sweep", box(folder), "--output", "1.h5")
    point, _ = read("1.h5")
    x, v = (point[f"start.block.{quantity}"] for quantity in ("displacement", "velocity"))
    assert np.all(np.abs(x) <= 6e-3) and np.all(np.abs(v) <= 0.8)
    assert np.unique(x).size == 120 and np.ptp(x) > 9e-3 and np.ptp(v) > 1.2
    succeed("razy-sweep", box(folder, samples=15), "--output", "fewer.h5")
    fewer, _ = read("fewer.h5")
    assert np.array_equal(fewer["start.block.velocity"], v[:45]), "more samples are those of before and others"
    assert np.array_equal(fewer["events"], point["events"][:45])
    succeed("razy-sweep", box(folder, seed=2), "--output", "2.h5")
    assert not np.any(np.isin(read("2.h5")[0]["start.block.velocity"], v))
    for ranks in (1, 2, 3, 4):
        succeed("razy-sweep", box(folder), "--output", "ranks.h5", "--force", ranks=ranks)
        assert Path("ranks.h5").read_bytes() == Path("1.h5").read_bytes()


@pytest.mark.parametrize("direction", ["independent", "both"])
def test_killed_sweep_goes_on(folder, direction):
    case = box(folder, samples=300)
    sweep = Sweep(case, "--set", f"sweep%direction='{direction}'")
    process = sweep.begin(60000, ranks=2)
    kill_all(process)
    done = sweep.start(ranks=3)
    assert done.returncode == 0, done.stderr
    assert 0 < points_done(done.stderr) < 900 * (2 if direction == "both" else 1)
    sweep.expect_whole()


def test_list_of_starts_and_chains(folder):
    text = re.sub(r"first=-6.*points=41", "values=0.0, 5.0e-3", BASINS.read_text())
    text = re.sub(r"first=-0.8.*points=41", "values=0.0, 0.5", text)
    changed(folder / "list.nml", text, ("method='grid'", "method='list'"))
    succeed("razy-sweep", "list.nml", *sets(sweep__points=4), "--set", "sweep%direction='up'")
    point, attractor = read("list.h5")
    assert point["start.block.velocity"].tolist() == [0.0] * 4 + [0.5] * 4
    assert point["direction"].tolist() == [1] * 8
    assert attractor["offset"].tolist()[-1] == attractor["number"].size and attractor["offset"].size == 5


MISTAKES = [
    (r"(?m)^&start_range.*\n", "", "&start_range coordinate: required beside &starts"),
    (r"(?m)^&starts .*\n", "", "&starts method: required beside &start_range"),
    (r"coordinate='block', quantity='d", "coordinate='blok', quantity='d", "did you mean 'block'?"),
    (r"points=41 /\n&", "/\n&", "&start_range(1) points: required for &starts method = 'grid'"),
    ("method='grid'", "method='box'", "&starts samples: required"),
    ("method='grid'", "method='list'", "&start_range(1) values: required"),
    ("t_end=8.0", "t_end=0.7", "&record from"),
    ("method='grid'", "method='grid', longest_period=500", "twice as many periods"),
    ("(?m)^&load.*$", "", "period"),
]


@pytest.mark.parametrize(("old", "new", "says"), MISTAKES)
def test_mistakes(folder, old, new, says):
    text = re.sub(old, new, BASINS.read_text())
    if "&load" in old:
        text = text.replace("load%frequency', first=20.0, last=26.0", "motion%t_end', first=8.0, last=9.0")
    if "from" in says:
        says = "from"
    Path("bad.nml").write_text(text)
    done = start("razy-sweep", "bad.nml", timeout=20)
    assert done.returncode == 2
    assert says in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr
