"""Bodies on pins: beside machines by hand and closed forms of pendulums."""

import h5py
import numpy as np
import pytest
from programs import start, succeed
from scipy.linalg import eigh

PINS = """&scene kind='planar' /
&body name='cart', mass=3.0, inertia=1.0, held='y','phi' /
&point name='hook', body='cart', position=0.2,-0.1 /
&body name='rod', mass=2.0, inertia=0.3, centre=0.2,-0.6, pin='hook' /
&point name='tip', body='rod', position=0.1,-0.4 /
&body name='bob', mass=0.7, inertia=0.05, centre=0.5,-1.2, pin='tip' /
&point name='end', body='bob', position=0.1,0.3 /
&spring between='cart','frame', direction=1.0,0.0, stiffness=500.0 /
&spring between='cart','rod', stiffness=60.0, twist=.true. /
&spring between='rod','bob', stiffness=20.0, twist=.true. /
&spring between='end','frame', direction=0.6,0.8, stiffness=90.0 /
&load on='end.y', value=4.0 /
&gravity acceleration=9.81, direction=0.6,-0.8 /
&initial on='bob.phi', displacement=0.02 /
&motion t_end=0.5, start='given' /
&record observable='state', what='trajectory', interval=0.05 /
"""


def test_bodies_on_pins_by_hand(tmp_path, monkeypatch):
    """A cart, a rod on it, a bob on the rod: coordinates x and the angles of both, which the weights right."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pins.nml").write_text(PINS)
    # From the hook the rod's centre is at (0, -0.5), its tip at (0.1, -0.9); from that the bob's centre at (0.2, -0.2),
    # its point at (0.3, 0.1).
    rod = np.array([[1, 0.5, 0], [0, 0, 0]])
    bob, end = (np.array([[1, 0.9, -y], [0, 0.1, x]]) for x, y in ((0.2, -0.2), (0.3, 0.1)))
    mass = np.diag([3, 0.3, 0.05]) + 2 * rod.T @ rod + 0.7 * bob.T @ bob
    along = np.array([0.6, 0.8]) @ end
    stiffness = np.diag([500.0, 60, 0]) + 20 * np.outer([0, 1, -1], [0, 1, -1]) + 90 * np.outer(along, along)
    # Along the weight, tip and rod's centre are lower than the hook by these, and bob's centre than the tip.
    stiffness += 9.81 * np.diag([0, 2 * 0.4 + 0.7 * 0.78, 0.7 * 0.28])
    force = 4 * end[1] + 9.81 * np.array([0.6, -0.8]) @ (2 * rod + 0.7 * bob) + 9.81 * 0.6 * 3 * np.array([1, 0, 0])
    succeed("razy-run", "pins.nml", "--output", "pins.h5")
    with h5py.File("pins.h5") as file:
        time, found = file["state/time"][:], file["state/displacement"][:]
        assert [name.decode() for name in file["state/coordinate"]] == ["cart.x", "rod.phi", "bob.phi"]
    rest = np.linalg.solve(stiffness, force)
    squares, shapes = eigh(stiffness, mass)
    begun = shapes.T @ mass @ (np.array([0, 0, 0.02]) - rest)
    right = rest + (np.cos(np.outer(time, np.sqrt(squares))) * begun) @ shapes.T
    assert found == pytest.approx(right, rel=0, abs=1e-13)


PENDULUM = """&scene kind='planar' /
&gravity acceleration=10.0 /
&point name='top', body='frame', position=0.3,1.0 /
&body name='bob', mass=2.0, inertia=3.0, centre=0.3,{height}, pin='top' /
&initial on='bob.phi', displacement=0.01 /
&motion t_end=3.0, start='given' /
&record observable='displacement', of='bob.phi', what='extrema','trajectory', interval=0.5 /
"""


@pytest.mark.parametrize("arm", [1.0, -1.0])
def test_its_weight_rights_a_pendulum_or_topples_it(tmp_path, arm):
    (tmp_path / "pendulum.nml").write_text(PENDULUM.format(height=1.0 - arm))
    done = succeed("razy-run", tmp_path / "pendulum.nml", "--output", tmp_path / "pendulum.h5")
    assert ("that of small motion" in done.stderr) is (arm < 0)
    with h5py.File(tmp_path / "pendulum.h5") as file:
        found = file["observable/displacement.bob.phi"][:]
    # m g a = 20 N m, J + m a² = 5 kg m².
    right = 0.01 * (np.cos if arm > 0 else np.cosh)(2.0 * 0.5 * np.arange(7))
    assert found == pytest.approx(right, rel=1e-13, abs=1e-15)


DOUBLE = """&scene kind='planar' /
&gravity acceleration=9.81 /
&point name='top', body='frame', position=0.0,0.0 /
&body name='upper', mass=1.5, inertia=1.0e-9, centre=0.0,-0.8, pin='top' /
&point name='ball', body='upper', position=0.0,0.0 /
&body name='lower', mass=0.5, inertia=1.0e-9, centre=0.0,-1.3, pin='ball' /
&modes count=2 /
"""


def test_a_double_pendulum(tmp_path):
    """Two balls on two rods without mass: the frequencies of textbooks."""
    (tmp_path / "double.nml").write_text(DOUBLE)
    succeed("razy-modes", tmp_path / "double.nml", "--output", tmp_path / "modes.h5")
    (m, n), (a, b), g = (1.5, 0.5), (0.8, 0.5), 9.81
    # m a b x² - (m + n) g (a + b) x + (m + n) g² = 0 for the squares x.
    squares = np.sort(np.roots([m * a * b, -(m + n) * g * (a + b), (m + n) * g**2]))
    with h5py.File(tmp_path / "modes.h5") as file:
        assert np.ravel(file["frequency"]) == pytest.approx(np.sqrt(squares) / (2 * np.pi), rel=1e-7)


DRIVEN = """&damper between='bob','frame', twist=.true., damping=2.0 /
&load on='bob.phi', amplitude=0.1, angular_frequency=2.0 /
&sweep parameter='gravity%acceleration', first=5.0, last=15.0, points=11 /
&follow parameter='gravity%acceleration', first=5.0, last=15.0 /
"""


def test_a_driven_pendulum_over_its_gravity(tmp_path, monkeypatch):
    """Sweep and branch through its resonance: the machine is made anew where the weight is another."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "driven.nml").write_text(PENDULUM.format(height=0.0).replace("t_end=3.0", "t_end=160.0") + DRIVEN)
    succeed("razy-sweep", "driven.nml", "--output", "sweep.h5")
    succeed("razy-follow", "driven.nml", "--output", "branch.h5")
    for name in ("sweep.h5", "branch.h5"):
        with h5py.File(name) as file:
            group, gravity = file["extrema/displacement.bob.phi"], file["point/gravity.acceleration"][:]
            # The last extremum of each motion.
            found = np.abs(group["value"][:][group["offset"][1:] - 1])
        assert gravity.size > 10
        right = 0.1 / np.abs(2.0 * gravity - 5.0 * 4.0 + 2.0j * 2.0)
        assert found == pytest.approx(right, rel=1e-9)


@pytest.mark.parametrize("pin", ["hok", "end", "tip"])
def test_a_pin_on_no_body_before_is_refused(tmp_path, pin):
    (tmp_path / "pins.nml").write_text(PINS.replace("pin='hook'", f"pin='{pin}'"))
    done = start("razy-run", tmp_path / "pins.nml", "--check")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert "&body(2) pin" in done.stderr and "a &point of the frame or of a &body before this one" in done.stderr


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("centre=0.5,-1.2", "centre=1e30,-1.2"),
        ("position=0.1,0.3", "position=0.1,-1e30"),
        ("centre=0.5,", "centre=nan,"),
    ],
)
def test_places_beyond_their_range_are_refused(tmp_path, old, new):
    assert PINS.count(old) == 1
    (tmp_path / "pins.nml").write_text(PINS.replace(old, new))
    done = start("razy-run", tmp_path / "pins.nml")
    assert done.returncode == 2 and "from -1.0e9 to 1.0e9 in m" in done.stderr and done.stderr.count("\n") == 1
