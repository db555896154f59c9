"""Machines of bodies that turn, on lines and in a plane: beside an assembly by hand and beside bodies of the plane."""

import re

import h5py
import numpy as np
import pytest
from programs import SOURCE, plot, start, succeed
from scipy.linalg import eigh, expm

CASE = SOURCE / "inputs" / "table_with_absorber.nml"


def without(text, *groups):
    """Leave out these groups."""
    return re.sub(rf"&({'|'.join(groups)}) [^\n]*\n", "", text)


def by_hand(speed):
    """Return M, B, K of the case without friction, and its loads, cos and sin, of the orders 1 and 2.

    Coordinates: motor, absorber, slide, table x, y, phi, wheel x, y, phi.
    """
    mass = np.diag([0.02, 4.0, 3.0, 120.0, 120.0, 14.0, 10.0, 10.0, 0.08])
    damping, stiffness = np.zeros((9, 9)), np.zeros((9, 9))

    def add(k, b, **row):
        w = np.zeros(9)
        for name, value in row.items():
            w[["m", "a", "s", "x", "y", "f", "u", "v", "t"].index(name)] = value
        stiffness[:] += k * np.outer(w, w)
        damping[:] += b * np.outer(w, w)

    for arm in (-0.6, 0.6):
        add(6e5, 6e5 * 2e-4, y=1, f=arm)
        add(2e5, 2e5 * 2e-4, x=1, f=0.15)
    # The bearing of the wheel, at (-0.3, 0.62) from the centre of the table.
    add(2e7, 300, u=1, x=-1, f=0.62)
    add(2e7, 300, v=1, y=-1, f=0.3)
    add(900, 0.4, m=1, t=-1)
    add(3.5e4, 20, a=1, y=-1)
    add(0, 0.6, m=1)
    add(2e3, 0, s=1, x=-1, f=0.2)
    once, twice = np.zeros((2, 9)), np.zeros((2, 9))
    once[0, 6] = once[1, 7] = 0.012 * speed**2
    twice[1, 0] = 2
    return mass, damping, stiffness, once, twice


@pytest.fixture(scope="module")
def linear(tmp_path_factory):
    path = tmp_path_factory.mktemp("linear") / "linear.nml"
    path.write_text(
        without(CASE.read_text(), "friction", "record", "sweep")
        + """
&record observable='displacement', of='absorber', what='trajectory', interval=1.0e-3 /
&record observable='displacement', of='slide', what='trajectory', interval=1.0e-3 /
&record observable='displacement', of='top.x', what='trajectory', interval=1.0e-3 /
&record observable='connection_force', of='shaft', what='trajectory', interval=1.0e-3 /
"""
    )
    return path


ROWS = {
    "displacement.absorber": [0, 1, 0, 0, 0, 0, 0, 0, 0],
    "displacement.slide": [0, 0, 1, 0, 0, 0, 0, 0, 0],
    "displacement.top.x": [0, 0, 0, 1, 0, -0.2, 0, 0, 0],
    "connection_force.shaft": [900, 0, 0, 0, 0, 0, 0, 0, -900],
}


def test_natural_frequencies_by_hand(linear, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    succeed("razy-modes", linear)
    mass, _, stiffness, *_ = by_hand(0)
    right = np.sqrt(np.abs(eigh(stiffness, mass, eigvals_only=True))) / (2 * np.pi)
    with h5py.File("linear.h5") as file:
        np.testing.assert_allclose(file["frequency"][0, 1:9], right[1:], rtol=1e-12)
        assert file["frequency"][0, 0] == 0


def test_response_by_hand(linear, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    succeed("razy-modes", linear)
    with h5py.File("linear.h5") as file:
        speeds = file["response/parameter"][:] * np.pi / 30
        found = {name: file[f"response/phasor/{name}"][:] @ [1, 1j] for name in ROWS}
    rates = {"connection_force.shaft": np.array([0.4, 0, 0, 0, 0, 0, 0, 0, -0.4])}
    for i in range(0, len(speeds), 10):
        mass, damping, stiffness, *loads = by_hand(speeds[i])
        for tone, (cosine, sine) in enumerate(loads):
            omega = (1 + tone) * speeds[i]
            q = np.linalg.solve(stiffness - omega**2 * mass + 1j * omega * damping, cosine - 1j * sine)
            for name, row in ROWS.items():
                right = (np.array(row) + 1j * omega * rates.get(name, 0)) @ q
                largest = max(abs(np.array(row)) @ abs(q), 1e-30)
                assert abs(abs(found[name][i, tone]) - abs(right)) < 1e-11 * largest, (name, i, tone)


def test_motion_by_hand(linear, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    succeed("razy-run", linear, "--set", "motion%t_end=0.5")
    omega = 900 * np.pi / 30
    mass, damping, stiffness, *loads = by_hand(omega)
    one, zero = np.eye(9), np.zeros((9, 9))
    whole = np.zeros((22, 22))
    whole[:18, :18] = np.block([[zero, one], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    for tone, (cosine, sine) in enumerate(loads):
        at = slice(18 + 2 * tone, 20 + 2 * tone)
        whole[9:18, at] = np.linalg.solve(mass, np.stack([cosine, sine], axis=1))
        whole[at, at] = (1 + tone) * omega * np.array([[0, -1], [1, 0]])
    step, state = expm(whole * 1e-3), np.array([0.0] * 18 + [1, 0, 1, 0])
    states = [state := step @ state if i else state for i in range(501)]
    with h5py.File("linear.h5") as file:
        for name, row in ROWS.items():
            rates = [0.4, 0, 0, 0, 0, 0, 0, 0, -0.4] if name.startswith("connection") else np.zeros(9)
            right = np.array(states) @ np.concatenate([row, rates, np.zeros(4)])
            found = file[f"observable/{name}"][:]
            np.testing.assert_allclose(found, right, rtol=0, atol=1e-10 * abs(right).max(), err_msg=name)


MIXED = """&scene title='mixed' /
&inertia name='motor', value=0.02 /
&mass name='hammer', value=1.5, direction=0.0,2.0 /
&mass name='slide', value=3.0, direction=-1.0,0.0 /
"""
IN_PLANE = """&scene title='in the plane' /
&body name='motor', mass=1.0, inertia=0.02 /
&body name='hammer', mass=1.5, inertia=1.0, centre=0.2,1.0 /
&body name='slide', mass=3.0, inertia=1.0, centre=0.9,0.1 /
&point name='way', body='frame', position=0.2,2.0 /
&spring between='motor','frame', direction=1.0,0.0, stiffness=1.0e4 /
"""
REST = """&body name='table', mass=20.0, inertia=1.4 /
&point name='anvil', body='table', position=0.2,0.1 /
&point name='rail', body='table', position=0.5,0.1 /
&spring between='table','frame', direction=0.0,1.0, stiffness=2.0e5, damping=100.0 /
&spring between='table','frame', direction=1.0,0.0, stiffness=1.0e5, damping=50.0 /
&spring between='table','frame', twist=.true., stiffness=8.0e3, damping=3.0 /
&spring name='shaft', between='motor','table', twist=.true., stiffness=900.0, damping=0.4 /
&spring between='hammer','frame', direction=0.0,1.0, law='table', displacement=-1.0e-3,0.0,1.0e-3, force=-9.0,0.0,3.0 /
&damper between='slide','frame', direction=1.0,0.0, damping=4.0 /
&stop name='hit', between='hammer','anvil', direction=0.0,1.0, clearance=1.0e-4, stiffness=4.0e5, damping=60.0 /
&stop name='play', between='slide','rail', direction=1.0,0.0, side='both', clearance=2.0e-4, stiffness=3.0e5 /
&friction name='rub', between='slide','rail', direction=1.0,0.0, normal_load=3.0, static_coefficient=0.2 /
&stop name='coupling', between='motor','frame', twist=.true., side='both', clearance=0.02, stiffness=4.0e3 /
&gravity acceleration=1.0, direction=0.3,-1.0 /
&load on='table.x', amplitude=40.0, frequency=9.0 /
&load on='anvil.y', amplitude=30.0, frequency=18.0 /
&load on='{motor}', amplitude=4.0, frequency=9.0 /
&initial on='{hammer}', displacement=2.0e-4, velocity=0.1 /
&motion t_end=1.0, start='given' /
&record observable='contact_force', of='hit', what='trajectory','extrema', interval=1.0e-3 /
&record observable='contact_force', of='play', what='trajectory', interval=1.0e-3 /
&record observable='sliding_velocity', of='rub', what='trajectory', interval=1.0e-3 /
&record observable='displacement', of='{motor}', what='trajectory','extrema', interval=1.0e-3 /
&record observable='displacement', of='{hammer}', what='trajectory', interval=1.0e-3 /
&record observable='displacement', of='table.phi', what='trajectory','extrema', interval=1.0e-3 /
&sweep parameter='gravity%acceleration', first=0.5, last=1.5, points=3 /
&follow parameter='load(1)%amplitude', first=20.0, last=21.0, settle=400, values=20.5 /
"""
NAMES = {"motor": "motor.phi", "hammer": "hammer.y"}


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """The machine of all kinds, and the same of bodies in the plane, whose other coordinates nothing moves or feels."""
    folder = tmp_path_factory.mktemp("both")
    (folder / "mixed.nml").write_text(MIXED + REST.format(motor="motor", hammer="hammer"))
    (folder / "plane.nml").write_text(IN_PLANE + REST.format(**NAMES))
    return folder


def test_a_mixed_machine_moves_as_one_of_planar_bodies(both, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("mixed", "plane"):
        succeed("razy-run", both / f"{name}.nml")
    with h5py.File("mixed.h5") as mixed, h5py.File("plane.h5") as plane:
        assert mixed["outcome/events"][()] == plane["outcome/events"][()] > 100
        for name in mixed["observable"]:
            other = re.sub(r"(motor|hammer)$", lambda found: NAMES[found[0]], name)
            right = plane[f"observable/{other}"][:]
            np.testing.assert_allclose(mixed[f"observable/{name}"][:], right, rtol=0, atol=1e-10 * abs(right).max())
    assert plot("mixed.h5", "--kind", "machine", "--save", tmp_path / "mixed.png").returncode == 0
    assert plot("mixed.h5", "--save", tmp_path / "trajectory.png").returncode == 0


def test_a_sweep_of_a_mixed_machine(both, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("mixed", "plane"):
        succeed("razy-sweep", both / f"{name}.nml")
    with h5py.File("mixed.h5") as mixed, h5py.File("plane.h5") as plane:
        for one, two in zip(mixed["extrema"].values(), plane["extrema"].values(), strict=True):
            right = two["value"][:]
            np.testing.assert_allclose(one["value"][:], right, rtol=0, atol=1e-9 * abs(right).max())


def test_a_branch_of_a_mixed_machine(both, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("mixed", "plane"):
        text = without((both / f"{name}.nml").read_text(), "friction", "initial").replace("'given'", "'zero'")
        (tmp_path / f"{name}.nml").write_text(re.sub(r"&record [^\n]*rub[^\n]*\n", "", text))
        succeed("razy-follow", f"{name}.nml")
    points = []
    for name in ("mixed", "plane"):
        with h5py.File(f"{name}.h5") as file:
            row = file["special/point"][file["special/label"][:].tolist().index(b"UZ")]
            multiplier = file["point/multiplier"][row]
            points.append((np.sort(np.hypot(*multiplier)), file["point/events"][row], file["point/period"][row]))
    for one, two in zip(*points, strict=True):
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-8 * np.max(two))


def test_a_picture_of_the_input_with_all_parts(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    succeed("razy-run", CASE)
    assert plot("table_with_absorber.h5", "--kind", "machine", "--save", "machine.png").returncode == 0
    with h5py.File("table_with_absorber.h5") as file:
        assert file["scene/body"][:].tolist() == [b"motor", b"absorber", b"slide", b"table", b"wheel"]


@pytest.mark.parametrize(
    ("more", "complaint"),
    [
        ("&spring between='motor','hammer', stiffness=1.0 /", "no mass where the other end turns"),
        ("&spring between='hammer','table', twist=.true., stiffness=1.0 /", "no mass where the other end turns"),
        ("&spring between='motor','table', direction=1.0,0.0, stiffness=1.0 /", "left out where both ends turn"),
        ("&spring between='hammer','slide', stiffness=1.0 /", "one in which each mass can move that it acts on"),
        ("&spring between='hammer','frame', direction=1.0,0.0, stiffness=1.0 /", "one in which each mass can move"),
        ("&ring name='r', between='hammer','table', clearance=1.0e-3, stiffness=1.0 /", "a &body, a &point or 'frame'"),
        ("&point name='p', body='hammer', position=0.0,0.0 /", "the name of a &body, or 'frame'"),
        ("&exciter on='hammer', frequency=9.0, unbalance=1.0 /", "the name of a body or of a point of a body"),
        (
            "&gear_mesh name='g', between='motor','table', radius=1.0,1.0, teeth=20,20, stiffness=1.0 /",
            "two inertias, or two bodies in the plane",
        ),
        ("&load on='hammer.x', value=1.0 /", "a coordinate, or but for the start a point of a body"),
        ("&shaft name='s', young_modulus=1.0, shear_modulus=1.0, density=1.0 /", "a part of a rotor scene"),
    ],
)
def test_what_is_refused(both, tmp_path, more, complaint):
    path = tmp_path / "case.nml"
    path.write_text((both / "mixed.nml").read_text() + more + "\n")
    done = start("razy-run", path)
    assert done.returncode == 2
    assert complaint in done.stderr
    assert done.stderr.count("\n") == 1
