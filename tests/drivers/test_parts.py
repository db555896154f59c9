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


def test_a_held_body_is_a_mass_or_an_inertia(both, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    held = IN_PLANE.replace("inertia=0.02", "inertia=0.02, held='x','y'").replace(
        "inertia=1.0, ", "inertia=1.0, HELD, "
    )
    held = held.replace("HELD", "held='x','phi'", 1).replace("HELD", "held='y','phi'", 1)
    held = re.sub(r"&spring between='motor','frame', direction[^\n]*\n", "", held)
    (tmp_path / "held.nml").write_text(held + REST.format(**NAMES))
    succeed("razy-run", "held.nml")
    succeed("razy-run", both / "mixed.nml")
    with h5py.File("mixed.h5") as mixed, h5py.File("held.h5") as found:
        assert mixed["outcome/events"][()] == found["outcome/events"][()]
        for one, two in zip(sorted(mixed["observable"]), sorted(found["observable"]), strict=True):
            right = mixed[f"observable/{one}"][:]
            np.testing.assert_allclose(found[f"observable/{two}"][:], right, rtol=0, atol=1e-9 * abs(right).max())


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
        (
            "&body name='b', mass=1.0, inertia=1.0, held='x','phi' /\n"
            "&spring between='b','frame', direction=1.0,0.0, stiffness=1.0 /",
            "with an end that can move there, which is not held",
        ),
        ("&load on='hammer.x', value=1.0 /", "a coordinate, or, not in &initial, a point of a body"),
        (
            "&shaft name='s', young_modulus=1.0, shear_modulus=1.0, density=1.0 /",
            "a part of a planar scene, and this scene is rotor",
        ),
    ],
)
def test_what_is_refused(both, tmp_path, more, complaint):
    path = tmp_path / "case.nml"
    path.write_text((both / "mixed.nml").read_text() + more + "\n")
    done = start("razy-run", path)
    assert done.returncode == 2
    assert complaint in done.stderr
    assert done.stderr.count("\n") == 1


SHAFTS = """
&shaft name='one', young_modulus=2.1e11, shear_modulus=8.0e10, density=0.0 /
&section shaft='one', length=0.4, outer_diameter=0.03 /
&shaft name='two', young_modulus=2.1e11, shear_modulus=8.0e10, density=0.0, speed_ratio=1.0 /
&section shaft='two', length=0.5, outer_diameter=0.02 /
"""
DISK = "&disk shaft='{}', node={}, mass={}, polar_inertia={}, diametral_inertia={} /\n"
DISKS = "".join(
    DISK.format(*each)
    for each in (
        ("one", 1, 2.0, 0.01, 0.006), ("one", 2, 3.0, 0.02, 0.01),
        ("two", 1, 1.0, 0.004, 0.003), ("two", 2, 4.0, 0.03, 0.02),
    )
)  # fmt: skip
ON_BEARINGS = "".join(
    f"&bearing shaft='{shaft}', node={node}, kind='matrix', stiffness=2.0e7,0.0,0.0,2.0e7, "
    "damping_matrix=90.0,0.0,0.0,90.0 /\n"
    for shaft in ("one", "two")
    for node in (1, 2)
)


def test_torsion_of_shafts_with_springs_and_an_inertia_by_hand(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.nml").write_text(SHAFTS + DISKS + """
&freedom axial=.false., bending=.false. /
&inertia name='motor', value=0.05 /
&spring between='motor','one.1', twist=.true., stiffness=7.0e3, damping=1.0 /
&spring name='coupling', between='two.1','one.2', twist=.true., stiffness=3.0e3, damping_factor=1.0e-4 /
&damper between='frame','two.2', twist=.true., damping=0.7 /
&spring between='two.2','frame', twist=.true., stiffness=50.0 /
&load on='motor', amplitude=3.0, frequency=20.0 /
&record observable='displacement', of='motor', what='trajectory', interval=1.0e-3 /
&record observable='connection_force', of='coupling', what='trajectory', interval=1.0e-3 /
&motion t_end=0.3, start='zero' /
&modes count=5 /
""")  # fmt: skip
    succeed("razy-run", "case.nml")
    succeed("razy-modes", "case.nml", "--output", "modes.h5")
    # motor, one.1, one.2, two.1, two.2
    mass = np.diag([0.05, 0.01, 0.02, 0.004, 0.03])
    stiffness, damping = np.zeros((5, 5)), np.zeros((5, 5))
    twist = [8.0e10 * np.pi * diameter**4 / 32 / length for diameter, length in ((0.03, 0.4), (0.02, 0.5))]
    for i, k, b in ((0, 7e3, 1.0), (1, twist[0], 0), (2, 3e3, 0.3), (3, twist[1], 0), (4, 50.0, 0.7)):
        row = np.zeros(5)
        row[i] = 1
        if i < 4:
            row[i + 1] = -1
        stiffness += k * np.outer(row, row)
        damping += b * np.outer(row, row)
    with h5py.File("modes.h5") as file:
        right = np.sqrt(eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)
        np.testing.assert_allclose(np.ravel(file["frequency"])[:5], right, rtol=1e-12)
    whole, omega = np.zeros((12, 12)), 40 * np.pi
    whole[:5, 5:10] = np.eye(5)
    whole[5:10, :10] = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
    whole[5, 11] = 3.0 / 0.05
    whole[10:, 10:] = omega * np.array([[0, -1], [1, 0]])
    step, state = expm(whole * 1e-3), np.array([0.0] * 10 + [1, 0])
    states = np.array([state := step @ state if i else state for i in range(301)])
    with h5py.File("case.h5") as file:
        for name, right in (
            ("displacement.motor", states[:, 0]),
            ("connection_force.coupling", 3e3 * (states[:, 3] - states[:, 2]) + 0.3 * (states[:, 8] - states[:, 7])),
        ):
            np.testing.assert_allclose(file[f"observable/{name}"][:], right, rtol=0, atol=1e-11 * abs(right).max())


LONG_HAND = """
&housing name='foot', mass=12.0 /
&support shaft='foot', node=1, held='u','w' /
&housing name='motor', mass=1.0, inertia=0.05,0.0, turns=.true. /
&support shaft='motor', node=1, held='u','v','w' /
&bearing shaft='foot', node=1, kind='matrix', stiffness=8.0e5,0.0,0.0,0.0, damping_matrix=30.0,0.0,0.0,0.0 /
&bearing shaft='one', node=2, to='foot', kind='matrix', stiffness=3.6e5,4.8e5,4.8e5,6.4e5,
  damping_matrix=18.0,24.0,24.0,32.0 /
&bearing shaft='one', node=1, to='motor', kind='matrix', stiffness=0.0,0.0,0.0,7.0e3,0.0,0.0,
  damping_matrix=0.0,0.0,0.0,1.0,0.0,0.0 /
"""
SHORT_HAND = """
&mass name='foot', value=12.0 /
&inertia name='motor', value=0.05 /
&spring between='foot','frame', direction=0.0,1.0,0.0, stiffness=8.0e5, damping=30.0 /
&spring between='foot','one.2', direction=0.0,0.3,0.4, stiffness=1.0e6, damping=50.0 /
&spring between='one.1','motor', twist=.true., stiffness=7.0e3, damping=1.0 /
"""
TABLES = re.sub(
    r"stiffness=([0-9.e]+), damping=([0-9.]+)",
    r"law='table', displacement=-1.0,1.0, force=-\1,\1, line_damping=\2",
    SHORT_HAND,
)
AROUND = """
&freedom axial=.false. /
&unbalance shaft='one', node=2, moment=1.0e-3 /
&rotation speed_rpm=1800.0, of='one' /
&support shaft='two', node=1, held='phi' /
&stop name='guard', between='foot{}','two.1', direction=0.0,1.0,0.0, side='both', clearance=1.0e-5,
  stiffness=3.0e6, damping=200.0 /
&friction name='clutch', between='one.2','two.2', twist=.true., normal_load=2.0, static_coefficient=0.5,
  belt_speed=1.0 /
&load on='foot.1.v', amplitude=90.0, frequency=17.0 /
&load on='motor.1.phi', amplitude=4.0, frequency=13.0 /
&motion t_end=0.3, start='zero' /
&record observable='state', what='trajectory', interval=1.0e-3 /
&campbell first_rpm=0.0, last_rpm=3000.0, points=4, damped=.true. /
&modes count=12 /
"""


def test_masses_inertias_and_springs_beside_shafts(tmp_path, monkeypatch):
    """They are the housings and bearings that stand for them; a table of one line is a linear spring."""
    monkeypatch.chdir(tmp_path)
    results = []
    for name, parts, node in (("long", LONG_HAND, ".1"), ("short", SHORT_HAND, ""), ("tables", TABLES, "")):
        (tmp_path / f"{name}.nml").write_text(SHAFTS + DISKS + ON_BEARINGS + parts + AROUND.format(node))
        succeed("razy-run", f"{name}.nml")
        with h5py.File(f"{name}.h5") as file:
            assert file["outcome/events"][()] > 20
            names = file["state/coordinate"][:].tolist()
            results.append(file["state/displacement"][:][:, np.argsort(names)])
        if name == "tables":
            continue
        succeed("razy-modes", f"{name}.nml", "--output", f"modes_{name}.h5")
    long, short, tables = results
    largest = abs(long).max(axis=0) + 1e-30
    assert (abs(short - long) / largest).max() < 1e-10
    assert (abs(tables - long) / largest).max() < 1e-8
    with h5py.File("modes_long.h5") as long, h5py.File("modes_short.h5") as short:
        np.testing.assert_allclose(short["eigenvalue"][:], long["eigenvalue"][:], rtol=1e-9, atol=1e-6)
    assert plot("short.h5", "--kind", "machine", "--save", tmp_path / "short.png").returncode == 0


@pytest.mark.parametrize(
    ("more", "complaint"),
    [
        ("&body name='b', mass=1.0, inertia=1.0 /", "a part of a planar scene, and this scene is rotor"),
        (
            "&spring between='one.1','frame', stiffness=1.0 /",
            "3 numbers that are not all zero, such as 0.0, 0.0, 1.0 for z, or twist = .true. instead",
        ),
        ("&stop name='s', between='one.1','frame', clearance=0.1, stiffness=1.0 /", "for z, or twist = .true. instead"),
        ("&spring between='one.1','frame', direction=0.0,1.0, stiffness=1.0 /", "3 numbers that are not all zero"),
        ("&spring between='one.1','one.2', twist=.true., stiffness=1.0 /", "nodes of two different shafts"),
        (
            "&spring between='one.1','frame','one.2','frame', twist=.true., stiffness=1.0 /",
            "two places, not several pairs",
        ),
        ("&spring between='one.1','frame', twist=.true., law='table' /", "displacement"),
        ("&mass name='m', value=1.0, direction=0.0,1.0,1.0 /", "that of x, y or z beside shafts"),
        ("&mass name='m', value=1.0, direction=1.0,0.0,0.0 /", "a body with a motion that &freedom leaves"),
        ("&spring between='one.1','nowhere', twist=.true., stiffness=1.0 /", "shaft and node"),
    ],
)
def test_what_is_refused_beside_shafts(tmp_path, more, complaint):
    path = tmp_path / "case.nml"
    path.write_text(SHAFTS + DISKS + ON_BEARINGS + SHORT_HAND + AROUND.format("") + more + "\n")
    done = start("razy-run", path)
    assert done.returncode == 2
    assert complaint in done.stderr
    assert done.stderr.count("\n") == 1
