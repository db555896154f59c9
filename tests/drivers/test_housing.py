"""Rotors that do not stand on the frame alone: housings, bearings between two places, and weight."""

import re

import h5py
import numpy as np
import pytest
from programs import SOURCE, plot, start, succeed
from scipy.linalg import eigvals

CASE = SOURCE / "inputs" / "rotor_in_housing.nml"
BEAM = """
&scene kind='rotor' /
&shaft name='rotor', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0 /
&section shaft='rotor', length=1.2, outer_diameter=0.03, elements=4 /
&freedom axial=.false., torsion=.false. /
"""


def rayleigh_beam(length, diameter, elements, young, density):
    """Return M and K of one plane of a beam, (v, v') at each node, and the gyroscopic matrix over the speed."""
    h = length / elements
    area, second = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    bending = np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                        [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])  # fmt: skip
    moved = np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                      [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])  # fmt: skip
    turned = np.array([[36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h],
                       [-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]])  # fmt: skip
    size = 2 * elements + 2
    mass, stiffness, spin = (np.zeros((size, size)) for _ in range(3))
    for e in range(elements):
        at = slice(2 * e, 2 * e + 4)
        rotary = density * second / (30 * h) * turned
        mass[at, at] += density * area * h / 420 * moved + rotary
        stiffness[at, at] += young * second / h**3 * bending
        spin[at, at] += 2 * rotary
    return mass, stiffness, spin


@pytest.mark.parametrize("speed", [0.0, 400.0])
def test_modes_of_a_rotor_in_a_housing(tmp_path, speed):
    # In z = v + i w and its slope, with the housing behind: M z'' + (B - i W G) z' + K z = 0.
    text = re.sub(r"damping_ratio=0.01 ", "", CASE.read_text())
    text = re.sub(r"&(campbell|sweep|record|rotation) [^\n]*\n", "", text)
    rpm = speed * 30 / np.pi
    text += (
        f"&rotation speed_rpm={rpm!r} /\n&campbell first_rpm={rpm!r}, last_rpm={rpm + 1!r}, points=2, damped=.true. /\n"
    )
    (tmp_path / "case.nml").write_text(text)
    succeed("razy-modes", tmp_path / "case.nml", "--output", tmp_path / "modes.h5")
    with h5py.File(tmp_path / "modes.h5") as file:
        found = file["eigenvalue"][0, :8]
    beam = rayleigh_beam(0.6, 0.03, 4, 2.1e11, 7850.0)
    mass, stiffness, spin, damping = (np.zeros((11, 11)) for _ in range(4))
    for whole, part in zip((mass, stiffness, spin), beam, strict=True):
        whole[:10, :10] = part
    mass[4, 4] += 8.0
    mass[5, 5] += 0.02
    spin[5, 5] += 0.04
    mass[10, 10] = 40.0
    for place, k, b in ((0, 2e7, 400.0), (8, 2e7, 400.0)):
        row = np.zeros(11)
        row[[place, 10]] = 1, -1
        stiffness += k * np.outer(row, row)
        damping += b * np.outer(row, row)
    stiffness[10, 10] += 4e6
    damping[10, 10] += 2e3
    # Time in ms, so that all entries are of one size.
    zero, one, ms = np.zeros((11, 11)), np.eye(11), 1e-3
    right = 1e3 * np.concatenate([
        eigvals(np.block([[zero, one], [-stiffness * ms**2, -(damping - 1j * turn * speed * spin) * ms]]),
                np.block([[one, zero], [zero, mass]]))
        for turn in (1, -1)
    ])  # fmt: skip
    for value in found[:, 0] + 1j * found[:, 1]:
        assert np.abs(right - value).min() < 1e-10 * abs(value)


@pytest.mark.parametrize("reduction", ["method='craig_bampton', modes=12", "modes=20", "frequency_limit=1.0e9"])
def test_reductions_keep_what_a_housing_has(tmp_path, reduction):
    # One number of modes is that of shafts: here all between the bearings, or all.
    found = []
    for name, line in (("whole", ""), ("reduced", f"&reduction {reduction} /\n")):
        (tmp_path / f"{name}.nml").write_text(CASE.read_text() + line)
        succeed("razy-modes", tmp_path / f"{name}.nml", "--output", tmp_path / f"{name}.h5")
        with h5py.File(tmp_path / f"{name}.h5") as file:
            found.append(file["natural_frequency"][:])
    assert found[0].size == 8
    assert np.abs(found[1] / found[0] - 1).max() < 1e-8


def test_weight_bends_a_beam_as_it_should(tmp_path):
    # Simply supported: 5 w L^4/(384 E I) in the middle; consistent loads make the nodes exact.
    held = "".join(f"&support shaft='rotor', node={node}, held='v','w' /\n" for node in (1, 5))
    text = BEAM + held + (
        "&gravity acceleration=9.81, direction=0.0,0.6,-0.8 /\n&motion t_end=0.1, start='static' /\n"
        "&record observable='state', what='trajectory', interval=0.05 /\n"
    )  # fmt: skip
    (tmp_path / "beam.nml").write_text(text)
    succeed("razy-run", tmp_path / "beam.nml")
    with h5py.File("beam.h5") as file:
        names = [name.decode() for name in file["state/coordinate"][:]]
        q = file["state/displacement"][:]
    load = 7850.0 * np.pi * 0.03**2 / 4 * 9.81
    sag = 5 * load * 1.2**4 / (384 * 2.1e11 * np.pi * 0.03**4 / 64)
    assert np.abs(q[:, names.index("rotor.3.v")] / (0.6 * sag) - 1).max() < 1e-9
    assert np.abs(q[:, names.index("rotor.3.w")] / (-0.8 * sag) - 1).max() < 1e-9


def test_everything_sinks_by_its_weight(tmp_path):
    # Without unbalance the housing sinks by all the weight, the rotor against it by its own.
    # Friction on a ring that is open does not stand in the way of a start at rest.
    text = re.sub(r"&(unbalance|sweep|campbell|modes) [^\n]*\n", "", CASE.read_text())
    text = text.replace("from=0.8", "from=0.0").replace("t_end=1.0", "t_end=0.1")
    (tmp_path / "still.nml").write_text(text)
    succeed("razy-run", tmp_path / "still.nml")
    rotor = 7850.0 * np.pi * 0.03**2 / 4 * 0.6 + 8.0
    with h5py.File("still.h5") as file:
        casing = file["extrema/displacement.casing.1.v/value"][:]
    assert np.abs(casing / (-9.81 * (rotor + 40.0) / 4e6) - 1).max() < 1e-9


def test_stop_between_rotor_and_housing_by_exact(tmp_path):
    text = re.sub(r"&(ring|friction|sweep|campbell|modes) [^\n]*\n", "", CASE.read_text())
    text = re.sub(r"&record[^\n]*seal[^\n]*\n", "", text)
    text += (
        "&stop name='seal', between='rotor.3','casing', direction=0.0,-1.0,0.0, clearance=5.0e-5, stiffness=2.0e7 /\n"
    )
    text += "&record observable='contact_force', of='seal', what='extrema' /\n"
    found = {}
    for method in ("exact", "dop853"):
        extra = ", relative_tolerance=1e-11, absolute_tolerance=1e-14"
        (tmp_path / "stop.nml").write_text(text.replace("integrator='radau5'", f"integrator='{method}'{extra}"))
        succeed("razy-run", tmp_path / "stop.nml", "--force")
        with h5py.File("stop.h5") as file:
            assert file["outcome/status"][()] == 0
            found[method] = file["event/time"][:], file["observable/displacement.rotor.3.v"][-200:]
    events = [found[method][0] for method in found]
    assert events[0].size > 10 and events[0].size == events[1].size
    assert np.abs(events[0] - events[1]).max() < 1e-8


def test_the_disk_rubs_on_its_seal(tmp_path):
    succeed("razy-run", CASE)
    with h5py.File("rotor_in_housing.h5") as file:
        assert file["extrema/relative_displacement.seal/value"][:].max() > 3e-4


def test_no_start_at_rest_under_friction(tmp_path):
    text = CASE.read_text().replace("clearance=3.0e-4", "clearance=1.0e-6")
    (tmp_path / "pressed.nml").write_text(text)
    done = start("razy-run", tmp_path / "pressed.nml")
    assert done.returncode == 2
    assert "'rub' is a rigid stop or dry friction" in done.stderr


def test_a_housing_has_coordinates_by_its_name_alone(tmp_path):
    (tmp_path / "case.nml").write_text(
        CASE.read_text() + "&record observable='displacement', of='casing.v', what='extrema', from=0.8 /\n"
    )
    succeed("razy-run", tmp_path / "case.nml", "--output", tmp_path / "case.h5")
    with h5py.File(tmp_path / "case.h5") as file:
        found = [file[f"extrema/displacement.{name}/value"][()] for name in ("casing.v", "casing.1.v")]
    assert found[0].size > 0
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("node=1, to='casing'", "node=1, to='rotor.2'", "&bearing(1) to = 'rotor.2': a place on another shaft"),
        ("node=1, to='casing'", "node=1, to='cover'", "&bearing(1) to = 'cover': "),
        ("of='rotor.3.v'", "of='cover.v'", "such as 'rotor.1.phi', or a housing and one of these"),
        ("name='casing'", "name='rotor'", "&housing name = 'rotor': the name must be unique"),
        ("&unbalance shaft='rotor', node=3", "&unbalance shaft='casing', node=1", "a shaft whose speed is known"),
        ("&section   shaft='rotor'", "&section   shaft='casing'", "&section shaft = 'casing': no shaft is named"),
        (
            "&gravity",
            "&body name='motor', mass=2.0, inertia=1.0 /\n&gravity",
            "&body: a part of a planar scene, and this scene is rotor",
        ),
        (
            "direction=0.0,-1.0,0.0 /",
            "direction=0.0,0.0,0.0 /",
            "&gravity direction = 0.0, 0.0, 0.0: 3 numbers that are not all zero",
        ),
    ],
)
def test_refusals(tmp_path, old, new, said):
    text = CASE.read_text()
    assert old in text
    (tmp_path / "bad.nml").write_text(text.replace(old, new, 1))
    done = start("razy-run", tmp_path / "bad.nml")
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


MOTOR = """&scene kind='rotor' /
&shaft name='rotor', young_modulus=2.1e11, shear_modulus=8.0e10, density=0.0 /
&section shaft='rotor', length=0.5, outer_diameter=0.03 /
&disk shaft='rotor', node=1, mass=1.0, polar_inertia=0.01, diametral_inertia=0.0 /
&disk shaft='rotor', node=2, mass=1.0, polar_inertia=0.04, diametral_inertia=0.0 /
&freedom axial=.false., bending=.false. /
&housing name='casing', mass=1.0 /
&housing name='motor', mass=5.0, inertia=0.002,0.0, turns=.true. /
&gear_mesh name='drive', between='motor','rotor', node=1,1, radius=0.02,0.06, teeth=20,60, pressure_angle=0.0,
           stiffness=3.0e6, damping=20.0, backlash=1.0e-4, error_sine=1.0e-5 /
&rotation speed_rpm=3000.0, of='motor' /
&load on='motor.1.phi', value=5.0, amplitude=20.0, frequency=40.0 /
&motion t_end=0.2, start='zero' /
&record observable='state', what='trajectory', interval=1.0e-3 /
&modes count=3 /
"""
LUMPED = """&scene kind='lumped' /
&inertia name='motor', value=0.002 /
&inertia name='pinion', value=0.01 /
&inertia name='end', value=0.04 /
&gear_mesh name='drive', between='motor','pinion', radius=0.02,0.06, teeth=20,60, stiffness=3.0e6, damping=20.0,
           backlash=1.0e-4, error_sine=1.0e-5 /
&spring between='pinion','end', stiffness={stiffness} /
&rotation speed_rpm=3000.0, of='motor' /
&load on='motor', value=5.0, amplitude=20.0, frequency=40.0 /
&motion t_end=0.2, start='zero' /
&record observable='state', what='trajectory', interval=1.0e-3 /
"""


def test_a_motor_of_one_inertia_drives_a_shaft_by_its_gear(tmp_path):
    """It rattles as the same machine of three inertias does, whose angles count in the sense of each wheel."""
    stiffness = 8.0e10 * np.pi * 0.03**4 / 32 / 0.5
    states = []
    for name, text in (("wheel", MOTOR), ("lumped", LUMPED.format(stiffness=stiffness))):
        (tmp_path / f"{name}.nml").write_text(text)
        succeed("razy-run", tmp_path / f"{name}.nml")
        with h5py.File(f"{name}.h5") as file:
            states.append(dict(zip(file["state/coordinate"][:], file["state/displacement"][:].T, strict=True)))
            assert file["outcome/events"][()] > 10
    assert plot("wheel.h5", "--kind", "machine", "--save", tmp_path / "wheel.png").returncode == 0
    wheel, lumped = states
    for name, right, sense in (
        (b"motor.1.phi", b"motor", 1),
        (b"rotor.1.phi", b"pinion", -1),
        (b"rotor.2.phi", b"end", -1),
    ):
        np.testing.assert_allclose(sense * wheel[name], lumped[right], rtol=0, atol=1e-10 * abs(lumped[right]).max())


TWO_ENDS = """
&support shaft='rotor', node=1, held='u','v','w','phi' /
&disk shaft='rotor', node=3, mass=5.0, polar_inertia=0.02, diametral_inertia=0.01 /
&motion t_end=0.05, start='zero' /
&rotation speed_rpm=600.0 /
"""


def test_the_frame_is_what_a_bearing_stands_on_anyway(tmp_path):
    found = []
    for to in ("", ", to='Frame'"):
        bearing = f"&bearing shaft='rotor', node=5, kind='matrix', stiffness=1e6,2e5,-2e5,1e6{to} /\n"
        (tmp_path / "case.nml").write_text(BEAM + bearing + TWO_ENDS)
        succeed("razy-modes", "case.nml", "--force")
        with h5py.File("case.h5") as file:
            found.append(file["natural_frequency"][:])
    assert found[0].tolist() == found[1].tolist()


def test_surfaces_of_a_shaft_in_a_housing_that_stands(tmp_path):
    """The shaft slides by -R1 W, whatever the housing; elements of a bearing without a name have its number."""
    (tmp_path / "case.nml").write_text(
        BEAM + TWO_ENDS + "&housing name='casing', mass=9.0 /\n"
        "&bearing shaft='casing', node=1, kind='matrix', stiffness=1e6,0,0,1e6 /\n"
        "&bearing shaft='rotor', node=3, to='casing', kind='rolling', elements=8, radial_stiffness=1e6, clearance=1e-3,"
        " cage_ratio=0.4 /\n"
        "&bearing shaft='rotor', node=5, kind='matrix', stiffness=1e6,0,0,1e6 /\n"
        "&friction name='rub', between='rotor.3','casing', direction=0.0,1.0,0.0, radius=0.05,-0.06,"
        " static_coefficient=0.0, normal_load=0.0 /\n"
        "&record observable='sliding_velocity', of='rub', what='trajectory', interval=0.01 /\n"
        "&record observable='contact_force', of='bearing 2.1', what='trajectory', interval=0.01 /\n"
    )
    succeed("razy-run", "case.nml")
    with h5py.File("case.h5") as file:
        np.testing.assert_allclose(file["observable/sliding_velocity.rub"][:], -0.05 * 20 * np.pi, rtol=1e-12)
        assert not file["observable/contact_force.bearing 2.1"][:].any()


def test_without_gyroscopic_moments_a_diagram_is_flat(tmp_path):
    text = (
        BEAM
        + TWO_ENDS
        + "&bearing shaft='rotor', node=5, kind='matrix', stiffness=1e6,0,0,2e6 /\n&campbell last_rpm=9e3 /\n"
    )
    (tmp_path / "case.nml").write_text(text)
    succeed("razy-modes", "case.nml", "--set", "rotation%gyroscopic=.false.")
    with h5py.File("case.h5") as file:
        frequency = file["frequency"][:]
    np.testing.assert_allclose(frequency, np.broadcast_to(frequency[0], frequency.shape), rtol=1e-9)
