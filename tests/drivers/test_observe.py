"""Statistics of contacts, kinds of motion and sweeps over two parameters, from the outside."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from faults import Sweep, kill_all, points_done
from programs import GEAR_PAIR, SOURCE, datasets, plot, sets, start, succeed

HYSTERESIS = SOURCE / "inputs" / "hysteresis.nml"
STATISTICS = "&record observable='contact_force', of='all', what='statistics', from=0.25 /\n"
SPEED = "&sweep parameter='rotation%speed_rpm', first=1400.0, last=2400.0, points=6 /\n"
TORQUE = "&sweep parameter='load(1)%value','load(2)%value', factor=1.0,-1.0, first=50.0, last=200.0, points=4 /\n"


# An overdamped body that comes out of two damped stops: the force of the second is largest soon after the start.
PRESSED = """
&mass name='m', value=1.0 /
&spring between='m','frame', stiffness=1706.81575, damping=82.6272533764 /
&stop name='deep', between='m','frame', side='upper', clearance=0.0005, stiffness=33096.691, damping=54.577488 /
&stop name='low', between='m','frame', side='lower', stiffness=7057.092, damping=168.013,
      separation='zero_deformation' /
&stop name='both', between='m','frame', side='both', clearance=0.0001, stiffness=18650.104, damping=273.13077,
      separation='zero_deformation' /
&initial on='m', displacement=0.001, velocity=-0.0561652 /
&motion t_end=1.2, start='given' /
&record observable='contact_force', of='both', what='statistics','extrema' /
"""


def without(text, *groups):
    lines = [line for line in text.splitlines() if not line.startswith(tuple("&" + group for group in groups))]
    return "\n".join(lines) + "\n"


@pytest.fixture
def grid(folder):
    """The gear pair over speed and torque."""
    (folder / "grid.nml").write_text(without(GEAR_PAIR.read_text(), "sweep") + STATISTICS + SPEED + TORQUE)
    return folder / "grid.nml"


def values(path, name):
    with h5py.File(path) as file:
        return file[name][()]


def test_a_run_has_what_a_point_of_the_grid_has(grid):
    succeed("razy-sweep", grid)
    at = {"rotation%speed_rpm": 2200, "load(1)%value": 150, "load(2)%value": -150}
    options = [word for key, value in at.items() for word in ("--set", f"{key}={value}")]
    succeed("razy-run", grid, *options, "--output", "run.h5")
    point = 4 * 4 + 2
    assert values("grid.h5", "point/rotation.speed_rpm")[point] == 2200
    assert values("grid.h5", "point/load(1).value")[point] == 150
    with h5py.File("run.h5") as run, h5py.File("grid.h5") as file:
        assert len(run["contact/mesh"]) == 13
        for name, item in run["contact/mesh"].items():
            assert item[()] == file["contact/mesh"][name][point]
            assert item.attrs["units"] == file["contact/mesh"][name].attrs["units"]
        assert run["contact/mesh/impacts"][()] > 20
        assert file["contact/mesh/largest_force"][point] >= 8e8 * file["extrema/mesh_deformation/value"][:].max() * 0.5
        assert file["point/touched"].attrs["names"] == ["mesh"]
        # Over whole periods the mesh carries the torque (radius 0.08 m); in motions that repeat themselves.
        period = 60 / 40 / file["point/rotation.speed_rpm"][:]
        mean = file["contact/mesh/impulse_per_period"][:] / period * 0.08 / file["point/load(1).value"][:]
    assert np.median(np.abs(mean - 1)) < 0.02


def test_largest_force_of_a_damped_stop_is_an_extremum(folder):
    (folder / "pressed.nml").write_text(PRESSED)
    succeed("razy-run", "pressed.nml")
    with h5py.File("pressed.h5") as file:
        force = file["extrema/contact_force.both/value"][:]
        largest = file["contact/both/largest_force"][()]
    assert largest == pytest.approx(np.max(np.abs(force)), rel=1e-12)
    assert largest == pytest.approx(5.1674306573747, rel=1e-11)


def test_largest_force_is_the_stiffness_times_the_largest_deformation(grid):
    succeed("razy-sweep", grid)
    with h5py.File("grid.h5") as file:
        offset, value = file["extrema/mesh_deformation/offset"][:], file["extrema/mesh_deformation/value"][:]
        deepest = [max(piece.max(), -1e-4 - piece.min()) for piece in np.split(value, offset[1:-1])]
        np.testing.assert_allclose(file["contact/mesh/largest_force"][:], 8e8 * np.array(deepest), rtol=1e-9)


def test_grid_does_not_depend_on_the_number_of_ranks(grid):
    succeed("razy-sweep", grid, "--output", "alone.h5")
    for ranks in (2, 3):
        succeed("razy-sweep", grid, "--output", f"{ranks}.h5", ranks=ranks)
        assert Path(f"{ranks}.h5").read_bytes() == Path("alone.h5").read_bytes()


@pytest.mark.parametrize("direction", ["independent", "both"])
def test_a_killed_grid_goes_on(grid, direction):
    case = grid.read_text().replace("points=6", f"points=40, direction='{direction}'").replace("t_end=0.3", "t_end=0.6")
    grid.write_text(case)
    sweep = Sweep(grid)
    process = sweep.begin(200000)
    kill_all(process)
    done = sweep.start(ranks=2)
    assert done.returncode == 0, done.stderr
    assert 0 < points_done(done.stderr) < 40 * 4 * (2 if direction == "both" else 1)
    sweep.expect_whole()


def test_chains_run_along_the_first_axis(folder):
    """Every chain of the grid is the chain of a sweep over the first parameter alone."""
    text = without(HYSTERESIS.read_text(), "sweep", "record")
    record = "&record observable='displacement', what='extrema', from=1.5 /\n"
    first = "&sweep parameter='load(1)%frequency', first=10.0, last=14.0, points=5, direction='both' /\n"
    second = "&sweep parameter='load(1)%amplitude', first={}, last={}, points={} /\n"
    (folder / "grid.nml").write_text(text + record + first + second.format(20.0, 40.0, 3))
    succeed("razy-sweep", "grid.nml", *sets(motion__t_end=2))
    shape = (2, 5, 3)
    both = values("grid.h5", "point/events").reshape(shape)
    for k, amplitude in enumerate((20.0, 30.0, 40.0)):
        (folder / "one.nml").write_text(text + record + first)
        options = [*sets(motion__t_end=2), "--set", f"load(1)%amplitude={amplitude}", "--output", f"{k}.h5"]
        succeed("razy-sweep", "one.nml", *options)
        assert values(f"{k}.h5", "point/events").tolist() == both[:, :, k].ravel().tolist()
        assert (
            values(f"{k}.h5", "point/steps").tolist()
            == values("grid.h5", "point/steps").reshape(shape)[:, :, k].ravel().tolist()
        )


def test_kind_of_motion_is_left_out_when_not_wanted():
    options = sets(sweep__step=400)
    succeed("razy-sweep", GEAR_PAIR, *options, "--output", "with.h5")
    succeed("razy-sweep", GEAR_PAIR, *options, *sets(sweep__kind_of_motion=".false."), "--output", "without.h5")
    more, less = datasets("with.h5"), datasets("without.h5")
    assert set(more) - set(less) == {"point/period", "point/drift", "point/touched"}
    assert all(more[name] == less[name] for name in less)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (TORQUE, TORQUE + TORQUE, "at most two &sweep groups"),
        (TORQUE, SPEED, "a value that the first &sweep does not vary"),
        ("factor=1.0,-1.0", "factor=1.0", "one factor for each parameter"),
        ("factor=1.0,-1.0", "factor=2.0,-1.0", "1 for the first parameter"),
        ("'load(2)%value'", "'load(1)%value'", "each value once"),
        ("points=4", "points=4, direction='up'", "given in the first &sweep only"),
        ("of='all', what='statistics'", "of='all', what='statistics','extrema'", "'all' for statistics alone"),
        ("of='all', what='statistics'", "of='mash', what='statistics'", "did you mean 'mesh'"),
        ("observable='contact_force', of='all'", "observable='velocity', of='motor'", "'contact_force' only"),
    ],
)  # fmt: skip
def test_bad_input(grid, old, new, said):
    assert grid.read_text().count(old) == 1
    grid.write_text(grid.read_text().replace(old, new))
    done = start("razy-sweep", grid)
    assert done.returncode == 2
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_pictures(grid):
    succeed("razy-sweep", grid)
    for options in ((), ("--observable", "period"), ("--observable", "mesh.dissipated_energy")):
        done = plot("grid.h5", "--force", "--save", "map.png", *options)
        assert done.returncode == 0, done.stderr
    for wrong in ("mesh.nothing", "nothing"):
        assert plot("grid.h5", "--save", "other.png", "--observable", wrong).returncode == 2
    (grid.parent / "line.nml").write_text(without(grid.read_text(), "sweep") + SPEED)
    succeed("razy-sweep", "line.nml")
    for options in (("--kind", "contacts"), ("--kind", "contacts", "--observable", "impulse"), ()):
        done = plot("line.h5", "--force", "--save", "line.png", *options)
        assert done.returncode == 0, done.stderr


BLOCKS = """&scene kind='lumped' /
&mass name='a', value=1.0 /
&mass name='b', value=2.0 /
&mass name='c', value=1.0 /
&stop name='floor', between='a','frame', side='lower', clearance=0.0, law='rigid', restitution=0.0 /
&stop name='lid', between='b','a', side='lower', clearance=5.0, law='rigid', restitution=0.0 /
&stop name='gap', between='c','b', side='lower', clearance=100.0, law='rigid', restitution=0.0 /
&load on='a', value=-10.0 /
&load on='b', value=-20.0 /
&motion t_end=2.0, start='zero' /
&record observable='contact_force', of='all', what='statistics' /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5"])
def test_a_contact_that_holds_passes_an_impulse_on(integrator, folder):
    # 2 kg fall 5 m on a block that rests: 20 N s go through both contacts, and 20 N s and 40 N s of weights.
    # The rate of the open gap jumps, too, but nothing hits there.
    (folder / "blocks.nml").write_text(BLOCKS)
    succeed("razy-run", folder / "blocks.nml", "--set", f"motion%integrator='{integrator}'")
    found = {
        name: [values("blocks.h5", f"contact/{contact}/{name}")[()] for contact in ("floor", "lid", "gap")]
        for name in ("impulse", "impacts", "dissipated_energy")
    }
    assert found["impulse"] == pytest.approx([60.0, 40.0, 0.0], rel=1e-9)
    assert found["impacts"] == [0, 1, 0]
    assert found["dissipated_energy"] == pytest.approx([0.0, 100.0, 0.0], rel=1e-9)


@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5"])
def test_the_force_at_rest_is_summed_at_the_pace_of_its_load(integrator, folder):
    # Steps of a machine that stands still are as long as they may be.
    case = BLOCKS.replace("clearance=5.0", "clearance=0.0").replace("t_end=2.0", "t_end=8.0")
    case = case.replace("on='b', value=-20.0", "on='b', value=-20.0, amplitude=10.0, frequency=1.0")
    (folder / "blocks.nml").write_text(case)
    succeed("razy-run", folder / "blocks.nml", "--set", f"motion%integrator='{integrator}'")
    assert values("blocks.h5", "contact/lid/mean_force")[()] == pytest.approx(20.0, rel=1e-9)
    assert values("blocks.h5", "contact/floor/largest_force")[()] == pytest.approx(40.0, rel=1e-6)


@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5"])
def test_a_force_that_has_come_to_zero_has_no_extrema_of_rounding(integrator, folder):
    # A damped contact parts at zero force: what the force was off there was a jump where the contact opened.
    (folder / "walls.nml").write_text(
        "&scene kind='lumped' /\n&mass name='a', value=1.0 /\n&spring between='a','frame', stiffness=1.0 /\n"
        "&stop name='s', between='a','frame', side='both', clearance=0.5, stiffness=100.0, damping=3.0 /\n"
        "&load on='a', amplitude=20.0, frequency=0.5 /\n&motion t_end=20.0, start='zero' /\n"
        "&record observable='contact_force', of='s', what='extrema' /\n"
    )
    succeed("razy-run", folder / "walls.nml", "--set", f"motion%integrator='{integrator}'")
    value = values("walls.h5", "extrema/contact_force.s/value")
    at = np.flatnonzero(np.abs(value[1:-1]) < 1e-9) + 1
    assert at.size > 0
    assert np.all(value[at - 1] * value[at + 1] > 0)


@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5"])
def test_a_motion_that_has_come_to_rest_misses_nothing(integrator, folder):
    # Of few steps the last alone may be looked at, where all terms are rounding.
    (folder / "brake.nml").write_text(
        "&scene kind='lumped' /\n&mass name='a', value=1.0 /\n&mass name='b', value=1.0 /\n"
        "&friction name='f', between='b','frame', static_coefficient=1.0, normal_load=1.0 /\n"
        "&stop name='s', between='a','b', side='upper', clearance=1.0, law='rigid', restitution=0.0 /\n"
        "&initial on='a', velocity=1.0 /\n&motion t_end=4.0, start='given' /\n"
        "&record observable='displacement', of='b', what='trajectory', interval=0.1 /\n"
    )
    succeed("razy-run", folder / "brake.nml", "--set", f"motion%integrator='{integrator}'")
    assert values("brake.h5", "outcome/residual")[0] < 1e-8
