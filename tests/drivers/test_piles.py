"""Impacts in turn of bodies that touch: beside sums of single impacts, closed forms and machines that do the same."""

from itertools import product

import h5py
import numpy as np
import pytest
from programs import SOURCE, start, succeed

CRADLE = SOURCE / "inputs" / "field" / "cradle.nml"
TOUCHING = [f"--set=stop({i})%clearance=0.0" for i in range(1, 5)]
IN_TURN = "--set=motion%impacts='in_turn'"


def strike(mass, speed, kept, rows):
    """Return the speeds after the impact of what `rows` join: those that push, if any, are found by trying."""
    before = rows @ speed
    for pushes in product([False, True], repeat=len(rows)):
        d = rows[list(pushes)]
        impulse = np.linalg.solve(d / mass @ d.T, -(1 + kept) * before[list(pushes)]) if any(pushes) else np.zeros(0)
        after = speed + impulse @ d / mass
        if np.all(impulse >= 0) and np.all(rows @ after + kept * before >= -1e-15):
            return after
    raise AssertionError("no impulses obey the laws")


def in_turn(mass, speed, kept):
    """Return the speeds after impacts in turn of a row of bodies that touch."""
    rows = np.diff(np.eye(mass.size), axis=0)
    for _ in range(1000):
        hit = rows @ speed < -1e-15
        if not any(hit):
            return speed
        speed = strike(mass, speed, kept, rows[hit])
    return speed


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
@pytest.mark.parametrize(
    ("mass", "kept"),
    [
        ([1.0, 1.0, 1.0, 1.0, 1.0], 1.0),
        ([1.0, 1.0, 1.0, 1.0, 1.0], 0.0),
        ([1.0, 1.0, 1.0, 1.0, 1.0], 0.7),
        ([3.0, 1.0, 2.0, 0.5, 4.0], 1.0),
        ([3.0, 1.0, 2.0, 0.5, 4.0], 0.4),
        ([0.2, 1.0, 30.0, 0.5, 100.0], 0.9),
    ],
)
def test_a_row_of_bodies(tmp_path, integrator, mass, kept):
    changes = [f"--set=mass({i + 1})%value={value}" for i, value in enumerate(mass)]
    changes += [f"--set=stop({i})%restitution={kept}" for i in range(1, 5)]
    path = tmp_path / "found.h5"
    succeed(
        "razy-run", CRADLE, *TOUCHING, IN_TURN, *changes, f"--set=motion%integrator='{integrator}'", "--output", path
    )
    with h5py.File(path) as file:
        found = file["state/velocity"][11]
        assert file["event/time"][:] == pytest.approx(0.01, rel=1e-12)
        assert sorted(file["event/contact"][:]) == [1, 2, 3, 4]
    assert found == pytest.approx(in_turn(np.array(mass), np.eye(5)[0], kept), rel=0, abs=1e-13)


TWO_BALLS = """&mass name='heavy', value=0.6 /
&mass name='light', value=0.06 /
&stop name='floor', between='heavy','frame', side='lower', law='rigid', restitution=0.9 /
&stop name='balls', between='light','heavy', side='lower', law='rigid', restitution=0.8 /
&gravity acceleration=10.0 /
&initial on='heavy', displacement=0.8 /
&initial on='light', displacement=0.8 /
&motion t_end=0.41, start='given', impacts='in_turn' /
&record observable='state', what='trajectory', interval=0.001 /
"""


def test_a_light_ball_on_a_heavy_one(tmp_path):
    """They fall together with 4 m/s, the floor turns the heavy one round, and that the light one."""
    (tmp_path / "balls.nml").write_text(TWO_BALLS)
    succeed("razy-run", tmp_path / "balls.nml", "--output", tmp_path / "balls.h5")
    with h5py.File(tmp_path / "balls.h5") as file:
        found = file["state/velocity"][-1]
    closing = 0.9 * 4.0 + 4.0
    light = -4.0 + 1.8 * 0.6 / 0.66 * closing
    assert found == pytest.approx(np.array([3.6 - 1.8 * 0.06 / 0.66 * closing, light]) - 0.1, rel=1e-12)


WALL = """&mass name='a', value=1.0 /
&mass name='b', value=2.0 /
&spring between='a','frame', stiffness=1.0, damping=0.2 /
&load on='a', amplitude=1.0, angular_frequency=2.2, phase=90.0 /
&load on='b', value=5.0 /
&stop name='ab', between='a','b', side='upper', law='rigid', restitution=0.6 /
&stop name='wall', between='b','frame', side='upper', law='rigid', restitution=0.0 /
&initial on='a', displacement=-0.5 /
&motion t_end=100, start='given', impacts='in_turn' /
&record observable='displacement', of='a', what='extrema' /
&follow parameter='load(1)%angular_frequency', first=2.2, last=3.0, doublings=0, values=2.3,2.5,2.7,2.9 /
"""


def test_a_branch_of_impacts_in_turn(tmp_path, monkeypatch):
    """A body of 2 kg that is pressed to a wall takes the blow for it: together a wall with the restitution 1/15."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pile.nml").write_text(WALL)
    lines = [line for line in WALL.splitlines() if not any(part in line for part in ("name='b'", "on='b'", "'wall'"))]
    single = "\n".join(lines).replace("'a','b'", "'a','frame'").replace("=0.6 /", "=0.06666666666666667 /")
    (tmp_path / "single.nml").write_text(single)
    found = []
    for name in ("pile", "single"):
        succeed("razy-follow", f"{name}.nml")
        with h5py.File(f"{name}.h5") as file:
            at = file["special/point"][:]
            labels = file["special/label"][:].tolist()
            found.append((labels, file["point/state"][:][at][:, [0, 2 if name == "pile" else 1]]))
            found.append((labels, np.abs(file["point/multiplier"][:][at])[:, :, :2].max(axis=(1, 2))))
    assert found[0][0].count(b"UZ") == 4 and b"PD" in found[0][0]
    for (labels, state), (others, right) in zip(found[:2], found[2:], strict=True):
        assert labels == others
        assert state == pytest.approx(right, rel=1e-8, abs=1e-9)


OPENING = """&mass name='inner', value=1.0 /
&mass name='outer', value=1.0 /
&stop name='wall', between='inner','frame', side='upper', law='rigid', restitution=1.0 /
&stop name='pair', between='outer','inner', side='upper', law='rigid', restitution=0.5 /
&friction name='pad', between='inner','frame', static_coefficient=2.0, normal_load=1.0 /
&initial on='inner', velocity=-1.0 /
&initial on='outer', velocity=0.5 /
&motion t_end=1.0, start='given' /
&record observable='state', what='trajectory', interval=0.25 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
@pytest.mark.parametrize("way", ["at_once", "in_turn"])
def test_what_opens_is_driven_back_to_its_stop(tmp_path, integrator, way):
    """A body that leaves its wall is hit there, comes to it with 1/8 m/s and leaves it, until friction stops it."""
    keys = f"impacts='{way}', integrator='{integrator}', start="
    (tmp_path / "walls.nml").write_text(OPENING.replace("start=", keys))
    succeed("razy-run", tmp_path / "walls.nml", "--output", tmp_path / "walls.h5")
    with h5py.File(tmp_path / "walls.h5") as file:
        assert list(zip(file["event/contact"][:], file["event/time"][:], strict=True))[:2] == [(1, 0.0), (2, 0.0)]
        assert file["state/displacement"][-1] == pytest.approx([-(0.125**2) / 4, -0.625], rel=1e-11)


PRESS = """&scene kind='planar' /
&point name='fl', body='frame', position=-0.2764,-0.1 /
&point name='fr', body='frame', position=0.48913,-0.1 /
&body name='b0', mass=5.288, inertia=3.0649, centre=0.0,0.0 /
&point name='l0', body='b0', position=-0.41459,0.0 /
&point name='tl0', body='b0', position=-0.2764,0.1 /
&point name='dl0', body='b0', position=-0.2764,-0.1 /
&spring between='l0','frame', direction=0.0,1.0, stiffness=736.23, damping=6.2395 /
&spring between='l0','frame', direction=1.0,0.0, stiffness=1002.8, damping=7.2819 /
&point name='r0', body='b0', position=0.73369,0.0 /
&point name='tr0', body='b0', position=0.48913,0.1 /
&point name='dr0', body='b0', position=0.48913,-0.1 /
&spring between='r0','frame', direction=0.0,1.0, stiffness=792.92, damping=64.753 /
&spring between='r0','frame', direction=1.0,0.0, stiffness=4647.5, damping=156.77 /
&body name='b1', mass=0.38584, inertia=0.017461, centre=0.0,0.5 /
&point name='l1', body='b1', position=-0.41459,0.0 /
&point name='tl1', body='b1', position=-0.2764,0.1 /
&point name='dl1', body='b1', position=-0.2764,-0.1 /
&spring between='l1','frame', direction=1.0,0.3, stiffness=385.17, damping=0 /
&point name='r1', body='b1', position=0.73369,0.1 /
&point name='tr1', body='b1', position=0.48913,0.1 /
&point name='dr1', body='b1', position=0.48913,-0.1 /
&spring between='r1','frame', direction=0.0,1.0, stiffness=248.01, damping=0.97822 /
&spring between='r1','frame', direction=1.0,0.3, stiffness=153.5, damping=0.7696 /
&body name='b2', mass=43.32, inertia=0.50218, centre=0.0,1.0 /
&point name='dl2', body='b2', position=-0.2764,-0.1 /
&point name='r2', body='b2', position=0.73369,0.0 /
&point name='dr2', body='b2', position=0.48913,-0.1 /
&spring between='r2','frame', direction=1.0,0.0, stiffness=12041, damping=0 /
&stop name='sl0', between='dl0','fl', direction=0.0,1.0, clearance=0, law='rigid', restitution=0.5 /
&stop name='sr0', between='dr0','fr', direction=0.0,1.0, clearance=0.00032418, law='rigid', restitution=0.5 /
&stop name='sl1', between='dl1','tl0', direction=0.0,1.0, clearance=4.6719e-05, law='rigid', restitution=0.7 /
&stop name='sr1', between='dr1','tr0', direction=0.0,1.0, clearance=0, law='rigid', restitution=0.3 /
&stop name='sl2', between='dl2','tl1', direction=0.0,1.0, clearance=0.00014654, law='rigid', restitution=0.5 /
&stop name='sr2', between='dr2','tr1', direction=0.0,1.0, clearance=0, law='rigid', restitution=0.5 /
&gravity acceleration=0.036075, direction=0.0,-1.0 /
&initial on='b0.y', velocity=-0.0051666 /
&initial on='b0.x', velocity=0.0010656 /
&initial on='b0.phi', velocity=-0.0019728 /
&initial on='b1.y', velocity=-0.0035246 /
&initial on='b1.x', velocity=0.0036155 /
&initial on='b1.phi', velocity=0.0063681 /
&initial on='b2.y', velocity=-0.0060963 /
&initial on='b2.x', velocity=0.0066454 /
&initial on='b2.phi', velocity=-0.0048948 /
&motion t_end=0.03, start='given', impacts='at_once' /
&record observable='state', what='trajectory', interval=0.03 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_what_is_squeezed_between_squeezed_bodies_comes_to_rest(tmp_path, integrator):
    """Sequences of impacts within others that are part of a third: five contacts close at one time, then all tilt.

    Both methods agree on these speeds to 1e-10, and did with a code of 40 digits before lengths were rounded here.
    """
    (tmp_path / "press.nml").write_text(PRESS.replace("start=", f"integrator='{integrator}', start="))
    accurate = ["--set=motion%relative_tolerance=1e-13", "--set=motion%absolute_tolerance=1e-18"]
    succeed("razy-run", tmp_path / "press.nml", *accurate, "--output", tmp_path / "press.h5")
    with h5py.File(tmp_path / "press.h5") as file:
        tilts = pytest.approx([-0.00335792070, -0.01214877243] * 3, rel=1e-8)
        assert file["state/velocity"][-1][[1, 2, 4, 5, 7, 8]] == tilts


STACK = """&mass name='m1', value=2.0 /
&mass name='m2', value=2.0 /
&mass name='m3', value=0.5 /
&stop name='s1', between='m1','frame', side='lower', law='rigid', restitution=0.5 /
&stop name='s2', between='m2','m1', side='lower', law='rigid', restitution=0.3 /
&stop name='s3', between='m3','m2', side='lower', law='rigid', restitution=0.7 /
&gravity acceleration=10.0 /
&initial on='m1', displacement=0.8 /
&initial on='m2', displacement=0.8 /
&initial on='m3', displacement=0.8 /
&motion t_end=3.0, start='given', impacts='in_turn' /
&record observable='state', what='trajectory', interval=0.05 /
"""


def test_a_stack_falls_and_comes_to_rest(tmp_path):
    """All its accumulations end, although each impact throws up what rests."""
    (tmp_path / "stack.nml").write_text(STACK)
    found = []
    for integrator in ("exact", "dop853"):
        path = tmp_path / f"{integrator}.h5"
        succeed("razy-run", tmp_path / "stack.nml", f"--set=motion%integrator='{integrator}'", "--output", path)
        with h5py.File(path) as file:
            assert file["outcome/accumulations"][()] >= 3
            found.append(file["state/displacement"][:])
            assert file["state/velocity"][-1] == pytest.approx(0, abs=1e-14)
            assert file["state/displacement"][-1] == pytest.approx(0, abs=1e-14)
    assert found[0] == pytest.approx(found[1], abs=1e-9)


CARRIED = """&mass name='a', value=0.5 /
&mass name='b', value=2.0 /
&mass name='c', value=0.5 /
&stop name='ab', between='a','b', side='lower', clearance=1.0e-3, law='rigid', restitution=0.5 /
&stop name='ba', between='a','b', side='upper', clearance=1.0e-3, law='rigid', restitution=0.0 /
&stop name='bc', between='b','c', side='lower', clearance=1.0e-2, law='rigid', restitution=0.5 /
&stop name='cb', between='b','c', side='upper', clearance=1.0e-3, law='rigid', restitution=0.0 /
&friction name='under_a', between='a','frame', static_coefficient=0.2, normal_load=1.0 /
&friction name='under_b', between='b','frame', static_coefficient=0.5, normal_load=1.0 /
&load on='a', value=2.0 /
&load on='b', value=1.0 /
&load on='c', value=1.0 /
&motion t_end=5.0, start='zero' /
&record observable='state', what='trajectory', interval=0.25 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_impacts_in_turn_change_no_momentum(tmp_path, integrator):
    """Loads less friction move the centre: of two contacts in turn the impacts of one throw the other up."""
    (tmp_path / "carried.nml").write_text(CARRIED)
    accurate = ["--set=motion%relative_tolerance=1e-13", "--set=motion%absolute_tolerance=1e-16"]
    way = f"--set=motion%integrator='{integrator}'"
    succeed("razy-run", tmp_path / "carried.nml", way, *accurate, "--output", tmp_path / "carried.h5")
    with h5py.File(tmp_path / "carried.h5") as file:
        centre = file["state/displacement"][:] @ [0.5, 2.0, 0.5] / 3.0
        np.testing.assert_allclose(centre, 0.55 * file["time"][:] ** 2, rtol=1e-12, atol=1e-14)


RESTING = """&mass name='b0', value=2 /
&mass name='b1', value=1 /
&mass name='b2', value=2 /
&mass name='b3', value=1 /
&stop name='s0upper', between='b0','b1', side='upper', clearance=0, law='rigid', restitution=0.5 /
&stop name='s1lower', between='b1','b2', side='lower', clearance=0.1, law='rigid', restitution=0 /
&stop name='s1upper', between='b1','b2', side='upper', clearance=0, law='rigid', restitution=0.3 /
&stop name='s2lower', between='b2','b3', side='lower', clearance=0.1, law='rigid', restitution=0.8 /
&stop name='s2upper', between='b2','b3', side='upper', clearance=0.1, law='rigid', restitution=0 /
&spring between='b0','frame', stiffness=1.0, damping=1.0 /
&friction name='f0', between='b0','frame', static_coefficient=0.2, normal_load=1.0 /
&load on='b0', amplitude=1.0, angular_frequency=1.0 /
&spring between='b1','frame', stiffness=4.0 /
&stop name='w1', between='b1','frame', side='upper', clearance=0.5, law='rigid', restitution=0.5 /
&friction name='f1', between='b1','frame', static_coefficient=0.2, normal_load=1.0 /
&load on='b1', amplitude=1.0, angular_frequency=1.0, value=0.5 /
&stop name='w2', between='b2','frame', side='lower', clearance=0.1, law='rigid', restitution=0.5 /
&friction name='f2', between='b2','frame', static_coefficient=0.5, normal_load=1.0 /
&load on='b2', amplitude=1.0, angular_frequency=2.0, phase=90 /
&stop name='w3', between='b3','frame', side='lower', clearance=0.5, law='rigid', restitution=0 /
&load on='b3', value=-1.0 /
&motion t_end=5.9868, start='zero', impacts='in_turn' /
&record observable='state', what='trajectory', interval=1.0e-4, from=5.9864 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_what_is_hit_in_turn_keeps_its_speeds(tmp_path, integrator):
    """1 kg hits 2 kg with restitution 0.3, and that 1 kg beside it with 0; both rested at a wall: no sequence."""
    (tmp_path / "resting.nml").write_text(RESTING)
    way = f"--set=motion%integrator='{integrator}'"
    succeed("razy-run", tmp_path / "resting.nml", way, "--output", tmp_path / "resting.h5")
    with h5py.File(tmp_path / "resting.h5") as file:
        speed = file["state/velocity"][:, 1:]
        hit = np.argmax(speed[:, 1] > 1e-3)
        after = speed[hit - 1, 0] * np.array([1 - 1.3 * 2 / 3, 1.3 / 3 * 2 / 3, 1.3 / 3 * 2 / 3])
        np.testing.assert_allclose(speed[hit], after, atol=1e-4)


PRESSED = """&mass name='a', value=0.5 /
&mass name='b', value=1.0 /
&mass name='c', value=2.0 /
&mass name='d', value=0.5 /
&stop name='ab', between='a','b', side='upper', clearance=0.0, law='rigid', restitution=0.0 /
&stop name='bc', between='b','c', side='lower', clearance=0.0, law='rigid', restitution=0.0 /
&stop name='cd', between='c','d', side='lower', clearance=0.0, law='rigid', restitution=0.0 /
&stop name='wall', between='b','frame', side='upper', clearance=0.0, law='rigid', restitution=0.0 /
&friction name='fa', between='a','frame', static_coefficient=0.1, normal_load=1.0 /
&friction name='fd', between='d','frame', static_coefficient=0.1, normal_load=1.0 /
&load on='a', amplitude=1.0, angular_frequency=2.0, phase=90.0 /
&load on='b', value=1.0 /
&load on='c', value=0.5 /
&load on='d', value=0.5 /
&motion t_end=8.0, start='zero' /
&record observable='state', what='trajectory', interval=0.05 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_a_row_is_pressed_to_a_wall_beside_friction(tmp_path, integrator):
    """Friction bears its limit, stops the rest, though least forces would pull at one; a leaves as cos 2t < -0.1."""
    (tmp_path / "pressed.nml").write_text(PRESSED)
    way = f"--set=motion%integrator='{integrator}'"
    succeed("razy-run", tmp_path / "pressed.nml", way, "--output", tmp_path / "pressed.h5")
    with h5py.File(tmp_path / "pressed.h5") as file:
        x, v, t = file["state/displacement"][:], file["state/velocity"][:], file["time"][:]
    assert max(np.max(np.abs(x[:, 1:])), np.max(np.abs(v[:, 1:]))) < 1e-15
    left = np.arccos(-0.1) / 2
    right = np.where(t > left, np.sin(2 * t) - np.sin(2 * left) + 0.2 * (t - left), 0.0)
    np.testing.assert_allclose(v[t < 1.5, 0], right[t < 1.5], atol=1e-9)


LOCKED = """&mass name='a', value=0.5 /
&mass name='b', value=0.5 /
&stop name='left', between='a','b', side='lower', clearance=0.0, law='rigid', restitution=0.0 /
&stop name='right', between='a','b', side='upper', clearance=0.0, law='rigid', restitution=0.5 /
&stop name='walls', between='b','frame', side='both', clearance=0.0, law='rigid', restitution=0.5 /
&friction name='floor', between='a','frame', static_coefficient=0.2, normal_load=1.0 /
&friction name='joint', between='b','a', static_coefficient=0.2, normal_load=1.0 /
&load on='a', amplitude=1.0, angular_frequency=2.0 /
&load on='b', value=0.5 /
&motion t_end=6.0, start='zero' /
&record observable='state', what='trajectory', interval=0.01 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_what_two_stops_and_friction_hold_stays(tmp_path, integrator):
    """Which of four holds a is open: none pulls, no friction bears more than its limit, and they carry the load."""
    names = ("left", "right", "walls", "floor", "joint")
    of = "".join(
        f"&record observable='contact_force', of='{name}', what='trajectory', interval=0.01 /\n" for name in names
    )
    (tmp_path / "locked.nml").write_text(LOCKED + of)
    way = f"--set=motion%integrator='{integrator}'"
    succeed("razy-run", tmp_path / "locked.nml", way, "--output", tmp_path / "locked.h5")
    with h5py.File(tmp_path / "locked.h5") as file:
        assert np.max(np.abs(file["state/displacement"][:])) < 1e-15
        force = {name: file[f"observable/contact_force.{name}"][:] for name in names}
        t = file["observable/time"][:]
    assert min(force["left"].min(), force["right"].min()) > -1e-12
    assert max(np.abs(force["floor"]).max(), np.abs(force["joint"]).max()) < 0.2 * (1 + 1e-12)
    on_a = np.sin(2 * t) + force["left"] - force["right"] - force["floor"] + force["joint"]
    np.testing.assert_allclose(on_a, 0.0, atol=1e-12)


BETWEEN_WALLS = """&mass name='a', value=2.0 /
&mass name='b', value=0.5 /
&mass name='c', value=2.0 /
&mass name='d', value=0.5 /
&stop name='ab', between='a','b', side='upper', clearance=0.0, law='rigid', restitution=0.5 /
&stop name='bc', between='b','c', side='upper', clearance=0.0, law='rigid', restitution=0.0 /
&stop name='left', between='c','d', side='lower', clearance=0.0, law='rigid', restitution=0.5 /
&stop name='right', between='c','d', side='upper', clearance=0.0, law='rigid', restitution=0.0 /
&stop name='walls', between='b','frame', side='both', clearance=0.0, law='rigid', restitution=0.0 /
&stop name='wall', between='c','frame', side='upper', clearance=0.0, law='rigid', restitution=0.5 /
&spring between='c','frame', stiffness=1.0 /
&load on='a', value=0.5 /
&load on='b', value=1.0 /
&load on='c', amplitude=1.0, angular_frequency=2.0, phase=90 /
&load on='d', value=0.5 /
&motion t_end=6.0, start='zero' /
&record observable='state', what='trajectory', interval=0.05 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_what_is_jammed_stays(tmp_path, integrator):
    """As the load on c turns, c leans on b: speeds that are rounding are no impact that nothing can stop."""
    (tmp_path / "row.nml").write_text(BETWEEN_WALLS)
    way = [f"--set=motion%integrator='{integrator}'", "--set=motion%absolute_tolerance=1e-16"]
    succeed(
        "razy-run",
        tmp_path / "row.nml",
        *way,
        "--set=motion%relative_tolerance=1e-13",
        "--output",
        tmp_path / "row.h5",
    )
    with h5py.File(tmp_path / "row.h5") as file:
        assert np.max(np.abs(file["state/displacement"][:])) < 1e-15


GALPERIN = """&mass name='heavy', value={mass} /
&mass name='light', value=1.0 /
&stop name='between', between='heavy','light', law='rigid', restitution=1.0 /
&stop name='wall', between='light','frame', law='rigid', restitution=1.0 /
&initial on='heavy', displacement=-0.01, velocity=1.0 /
&motion t_end=0.02, start='given', impacts='in_turn' /
&record observable='state', what='trajectory', interval=0.001 /
"""


@pytest.mark.parametrize(("mass", "hits"), [("1.0", 3), ("1.0e2", 31), ("1.0e4", 314), ("1.0e6", 3141)])
def test_a_heavy_body_counts_to_pi(tmp_path, mass, hits):
    """It hits a light one before a wall: in scaled speeds each impact, the wall too, is a reflection (Galperin)."""
    (tmp_path / "pi.nml").write_text(GALPERIN.format(mass=mass))
    succeed("razy-run", tmp_path / "pi.nml", "--output", tmp_path / "pi.h5")
    turned = 2 * np.arctan(1 / np.sqrt(float(mass))) * ((hits + 1) // 2)
    right = np.cos(turned), abs(np.sin(turned)) * np.sqrt(float(mass))
    with h5py.File(tmp_path / "pi.h5") as file:
        found = file["state/velocity"][-1]
    assert found[0] == pytest.approx(right[0], abs=1e-11)
    assert abs(found[1]) == pytest.approx(right[1], abs=1e-8)


def test_what_comes_to_no_end_is_told(tmp_path):
    (tmp_path / "pi.nml").write_text(GALPERIN.format(mass="1.0e10"))
    done = start("razy-run", tmp_path / "pi.nml", "--output", tmp_path / "pi.h5")
    assert done.returncode == 1 and "no admissible contact forces" in done.stderr


def test_time_stepping_has_no_impacts_in_turn(tmp_path):
    done = start("razy-run", CRADLE, IN_TURN, "--set=motion%integrator='moreau_jean'", "--set=motion%step=1e-4")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "&motion%integrator = 'moreau_jean': 'exact' or a Runge-Kutta method" in done.stderr
