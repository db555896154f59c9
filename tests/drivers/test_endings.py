"""Why branches of razy-follow end and none begins: motions that grow without bound, hidden touches, friction."""

from pathlib import Path

import numpy as np
import pytest
from branches import follow, points
from programs import start
from scipy.linalg import expm

GEARS = """
&inertia name='pinion', value=1.0 /
&inertia name='wheel', value={wheel} /
&spring between='pinion','frame', stiffness={springs[0]}, damping={dampers[0]} /
&spring between='wheel','frame', stiffness={springs[1]}, damping={dampers[1]} /
&gear_mesh name='mesh', between='pinion','wheel', radius=1.0,1.0, teeth=20,20,
           stiffness=10.0, contact_ratio=1.3, {mesh} /
&load on='pinion', value={load} /
&load on='wheel', value=-0.5 /
&load on='wheel', amplitude=0.6, order=20, phase={phase} /
&motion t_end=600.0, start='zero' /
&rotation speed_rpm={first}, of='pinion' /
&follow parameter='rotation%speed_rpm', first={first}, last={last}, doublings=1 /
"""


def ending(file, branch):
    return file["branch/ending"].asstr()[:][branch - 1]


@pytest.mark.parametrize("first", [1.8, 0.8])
def test_a_motion_that_grows_without_bound(first):
    """Far from its gap an undamped one-sided oscillator has one period: halves with its stop and without."""
    text = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0 /\n"
    text += "&stop name='wall', between='m','frame', side='upper', clearance=0.5, stiffness=3.0 /\n"
    text += f"&load on='m', amplitude=1.0, angular_frequency={first} /\n&motion t_end=400.0, start='zero' /\n"
    text += f"&follow parameter='load%angular_frequency', first={first}, last={2.8 - first}, doublings=0 /\n"
    Path("grows.nml").write_text(text)
    with follow(Path("grows.nml")) as file:
        assert ending(file, 1) == "the motion grows without bound"
        assert file["special/label"].asstr()[-1] == "EP"
        value = file["point/load.angular_frequency"][:]
        assert value[-1] == pytest.approx(2 * np.pi / (np.pi + np.pi / 2), rel=1e-6)
        assert value.size < 1000


@pytest.mark.parametrize(
    ("what", "first", "last", "stop", "expected"),
    [
        ("load%amplitude", 0.0, 0.2, "side='upper', clearance=1.0, law='rigid', restitution=0.8", ["GR", "LP", "EP"]),
        ("load%amplitude", 0.05, 0.0, "side='upper', clearance=1.0, law='rigid', restitution=0.8", ["EP"]),
        ("stop%clearance", 2.0, 0.0, "side='both', clearance=1.0, stiffness=1.0", ["GR", "EP"]),
    ],
)
def test_a_range_from_or_to_zero(what, first, last, stop, expected):
    """At an amplitude of 0 a load keeps its period, and a range may end where what is allowed does."""
    text = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0, damping=0.1 /\n"
    text += f"&stop name='s', between='m','frame', {stop} /\n&load on='m', amplitude=0.1, angular_frequency=1.0 /\n"
    text += "&motion t_end=2000.0, start='zero' /\n&record observable='displacement', of='m', what='extrema' /\n"
    text += f"&follow parameter='{what}', first={first}, last={last} /\n"
    Path("zero.nml").write_text(text)
    with follow(Path("zero.nml")) as file:
        assert list(file["special/label"].asstr()) == expected
        value = file["point"][what.replace("%", ".")][:]
        assert value[0] == first
        assert value[-1] == last
        assert ending(file, len(file["branch/ending"])) == "the end of the range"
        if "GR" in expected:
            # The linear motion is as large as the clearance.
            at = file["special/point"][0]
            assert value[at] == pytest.approx(0.1 if first == 0.0 else 1.0, rel=1e-11)


def test_motions_of_any_size_at_one_speed():
    """Without backlash a mesh of one and two pairs of teeth is linear: nothing limits what grows."""
    text = GEARS.format(
        wheel=1.0,
        springs=[1.0, 1.0],
        dampers=[0.02, 0.1],
        load=1.0,
        phase=90,
        first=0.95493,
        last=0.87,
        mesh="backlash=0.0, pair_ratio=1.7",
    )
    Path("linear.nml").write_text(text)
    with follow(Path("linear.nml")) as file:
        assert ending(file, 2) == "the motion grows without bound"
        speed = file["point/rotation.speed_rpm"][:][file["point/branch"][:] == 2]
    assert speed.size < 1000 and np.ptp(speed) <= 1e-11 * speed[0]
    low, period = 10.0 / (0.7 + 0.3 * 1.7), 60.0 / 20 / speed[-1]

    def motion(stiffness, time):
        mesh = stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return expm(time * np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2) - mesh, -np.diag([0.02, 0.1])]]))

    multiplier = np.linalg.eigvals(motion(low, 0.7 * period) @ motion(1.7 * low, 0.3 * period))
    assert np.abs(multiplier + 1.0).min() < 1e-9


def test_a_touch_next_to_which_motions_without_it_are_far_away():
    """Their multiplier is near 1, and they are found where the gap of the soft impact opens."""
    text = GEARS.format(
        wheel=2.0,
        springs=[1.0, 0.5],
        dampers=[0.05, 0.02],
        load=0.2,
        phase=90,
        first=0.668451,
        last=0.334225,
        mesh="backlash=0.0, pair_ratio=2.0, separation='zero_deformation'",
    )
    text += "&stop name='wall', between='wheel','frame', side='upper', clearance=0.1, law='rigid', restitution=0.8 /\n"
    Path("touch.nml").write_text(text.replace("doublings=1", "doublings=0"))
    with follow(Path("touch.nml")) as file:
        assert {ending(file, 1), ending(file, 2)} == {"a stop whose force jumps is touched with no speed"}
        # Beyond the touch of motions that hit the wall ever more softly others go on without it.
        assert file["branch/parent"].size > 2
        assert "MX" not in file["special/label"].asstr()[:]


def test_friction_that_comes_to_stick_at_its_limit():
    """It slides on beyond, with its kinetic force: the motion jumps, by little."""
    text = GEARS.format(
        wheel=1.0,
        springs=[0.5, 1.0],
        dampers=[0.02, 0.05],
        load=0.5,
        phase=45,
        first=0.334225,
        last=0.501338,
        mesh="backlash=1.0, pair_ratio=1.5, damping=0.1",
    )
    text += "&friction name='rub', between='wheel','frame', static_coefficient=0.3, kinetic_coefficient=0.2,"
    text += " normal_load=0.3 /\n"
    Path("limit.nml").write_text(text)
    with follow(Path("limit.nml")) as file:
        assert ending(file, 1) == "the motion jumps where its contacts change"
        speed = file["point/rotation.speed_rpm"][:][file["point/branch"][:] == 1]
        assert speed[-1] == points(file, "SL")[-1]


def test_no_branch_begins_right_beside_a_touch():
    """The start creeps up to a stop that is touched with no speed: all that is found there has a multiplier of 5e4."""
    text = ["&scene kind='lumped' /", "&mass name='a', value=0.5 /"]
    text += ["&mass name='b', value=1.0 /", "&mass name='c', value=1.0 /"]
    text += ["&stop name='s', between='a','b', side='lower', clearance=0.001, law='rigid', restitution=1.0 /"]
    text += ["&spring between='b','c', stiffness=100.0, damping=0.1 /"]
    text += ["&friction name='f', between='b','c', static_coefficient=1.0, kinetic_coefficient=0.5, normal_load=1.0 /"]
    text += [
        "&friction name='g', between='c','frame', static_coefficient=1.0, kinetic_coefficient=0.5, normal_load=10.0 /"
    ]
    text += ["&spring between='a','frame', stiffness=100.6, damping=0.1 /"]
    text += ["&spring between='b','frame', stiffness=1.2, damping=0.2 /"]
    text += ["&spring between='c','frame', stiffness=10000.0 /"]
    text += ["&load on='a', value=1.0, amplitude=2.0, angular_frequency=2.0, phase=180.0 /"]
    text += ["&motion t_end=200.0, start='zero' /", "&record observable='displacement', of='a', what='extrema' /"]
    text += ["&follow parameter='load%amplitude', first=2.0, last=4.0, doublings=0, max_points=80 /"]
    Path("beside.nml").write_text("\n".join(text) + "\n")
    done = start("razy-follow", "beside.nml")
    assert done.returncode == 1 and done.stderr.startswith("no motion of period 1 was found within 300 periods")


@pytest.mark.parametrize("phase", [0, 137])
def test_what_sticks_begins_to_slide_where_it_has_stuck(phase):
    """Three bodies, each on its own spring: where they came to stick says when friction is at its limit."""
    text = "".join(f"&mass name='b{i}', value=2.0 /\n" for i in range(3))
    for i, stiffness in enumerate([10000.15, 0.15, 10000.15]):
        text += f"&spring between='b{i}','frame', stiffness={stiffness}, damping=0.1 /\n"
    text += "&friction name='f', between='b0','b1', static_coefficient=0.5, normal_load=2.0 /\n"
    text += "&friction name='g', between='b1','b2', static_coefficient=0.5, normal_load=2.0 /\n"
    text += f"&load on='b0', value=2.0, amplitude=1.0, angular_frequency=0.5, phase={phase} /\n"
    text += "&motion t_end=800.0, start='zero' /\n"
    text += "&follow parameter='load%amplitude', first=1.0, last=2.0, doublings=0 /\n"
    Path("sticks.nml").write_text(text)
    with follow(Path("sticks.nml")) as file:
        assert ending(file, 1) == "friction that has stuck all the time begins to slide"
        later = np.exp(1j * (2 * np.pi * file["point/phase"][0] + np.deg2rad(phase)))
        together = 1 / (20000.45 - 6.0 * 0.25 + 0.5j * 0.3)
        stuck = file["point/state"][0, :3] - (file["point/load.amplitude"][0] * together * later).imag
        carried = (10000.15 - 2.0 * 0.25 + 0.5j * 0.1) * together
        limit = (1.0 - abs(10000.15 * stuck[2])) / abs(carried)
        assert points(file, "SL") == pytest.approx(limit, rel=1e-11)
