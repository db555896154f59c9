"""Motions without excitation that razy-follow follows: bodies on belts and whirling rotors, to rest."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from branches import follow, labels, multipliers
from programs import SOURCE, start, succeed
from scipy.optimize import brentq


def test_a_closed_motion_over_its_belt_speed():
    """Without excitation, by steps: the period grows as sticking ends; no step becomes tiny."""
    with follow(SOURCE / "inputs" / "belt_oscillator.nml") as file:
        speed, period = file["point/friction.belt_speed"][:], file["point/period"][:]
        assert speed[[0, -1]] == pytest.approx([0.2, 0.6], rel=1e-12)
        assert speed.size < 400 and file["point/stable"][:].all()
    # It sticks for most of the way from where slip ends to x = 1.
    assert (np.diff(period) < 0.0).all() and period[0] > 2 * np.pi


BELT = """
&scene    kind='lumped' /
&mass     name='m', value=1.0 /
&spring   between='m','frame', stiffness=1.0, damping=0.05 /
&friction name='belt', between='m','frame', static_coefficient=0.3, kinetic_coefficient=0.1, decay=2.0, decay_law='{}',
          normal_load=1.0, belt_speed={} /
&motion   t_end=300.0, start='zero', relative_tolerance=1e-12, absolute_tolerance=1e-14 /
&record   observable='displacement', what='extrema' /
&follow   parameter='friction%belt_speed', first={}, last=3.0 /
"""


@pytest.mark.parametrize(
    ("law", "slips", "rest", "force"),
    [
        ("hyperbolic", 1.3695938793710, (np.sqrt(8.0) - 1.0) / 2.0, 0.1 + 0.2 / np.sqrt(8.0)),
        ("exponential", 1.5562530359, np.log(8.0) / 2.0, 0.1 + 0.2 / 8.0),
    ],
)
def test_a_motion_on_a_belt_ends_to_stick_and_shrinks_to_rest(law, slips, rest, force):
    """From where sticking ends (by SciPy) it goes on unstable, back to where friction's slope takes up the damping."""
    Path("belt.nml").write_text(BELT.format(law, 0.4, 0.4))
    with follow(Path("belt.nml")) as file:
        assert file["special/label"].asstr()[:].tolist() == ["ST", "HB"]
        assert file["special/parameter"][0] == pytest.approx(slips, abs=5e-6)
        assert file["special/parameter"][1] == pytest.approx(rest, abs=1e-9)
        assert file["special/error"][1] < 1e-6
        assert file["branch/ending"].asstr()[0] == "the motion shrinks to rest"
        assert file["point/period"][-1] == pytest.approx(2.0 * np.pi, rel=1e-9)
        assert file["point/state"][-1] == pytest.approx([force, 0.0], abs=1e-9)
        turn, speed = file["special/point"][0], file["point/friction.belt_speed"][:]
        assert (np.diff(speed[:turn]) > 0.0).all() and (np.diff(speed[turn + 2 :]) < 0.0).all()
        # One is left without that along the motion: 0 as long as it sticks.
        assert file["point/multiplier"].shape == (speed.size, 2, 1)
        real = file["point/multiplier"][:, 0, 0]
        assert np.abs(real[:turn]).max() < 1e-9 and (real[turn + 1 : -1] > 1.0).all()
        assert real[-1] == pytest.approx(1.0, abs=1e-6) and file["point/stable"][-1] == -1


def test_beside_a_corner_differences_stay_on_their_side():
    """A step that crosses the end of sticking was shortened until its difference was one of errors (MX)."""
    text = BELT.format("hyperbolic", 0.2, 0.2).replace("value=1.0", "value=0.5").replace("load=1.0", "load=2.0")
    text = text.replace("stiffness=1.0, damping=0.05", "stiffness=2.0, damping=0.1").replace("decay=2.0", "decay=3.0")
    Path("belt.nml").write_text(text)
    with follow(Path("belt.nml")) as file:
        assert file["special/label"].asstr()[:].tolist() == ["ST", "HB"]
        # 2 (0.3 - 0.1) 3/(1 + 3 v)² is the damping.
        assert file["special/parameter"][1] == pytest.approx((np.sqrt(12.0) - 1.0) / 3.0, abs=1e-9)


COULOMB = """
&scene    kind='lumped' /
&mass     name='m', value=1.0 /
&spring   between='m','frame', stiffness=1.0, damping={} /
&friction name='belt', between='m','frame', static_coefficient=0.3, kinetic_coefficient={}, normal_load=1.0,
          belt_speed=0.1 /
&motion   t_end=300.0, start='zero' /
&record   observable='displacement', what='extrema' /
&follow   parameter='friction%belt_speed', first=0.1, last=6.0 /
"""


def test_sticking_ends_where_a_body_does_not_come_to_the_speed_of_its_belt_again():
    """Then it slides for ever, and comes to rest: the branch ends."""
    damping, static, kinetic = 0.1, 0.3, 0.15
    turn = np.sqrt(1.0 - damping**2 / 4.0)

    def missed(belt):
        # From the end of sticking: x about the middle, exp(-d t)(a cos + b sin), and the next largest velocity.
        a = static - damping * belt - kinetic
        b = (belt + damping / 2.0 * a) / turn
        time = np.linspace(4.0, 8.0, 9)
        c, s = b * turn - damping / 2.0 * a, a * turn + damping / 2.0 * b
        speed = lambda t: np.exp(-damping / 2.0 * t) * (c * np.cos(turn * t) - s * np.sin(turn * t))  # noqa: E731
        rate = lambda t: (  # noqa: E731
            -damping * speed(t) - np.exp(-damping / 2.0 * t) * (a * np.cos(turn * t) + b * np.sin(turn * t))
        )
        first = np.flatnonzero((rate(time[:-1]) > 0.0) & (rate(time[1:]) <= 0.0))[0]
        return speed(brentq(rate, *time[first : first + 2], xtol=1e-15)) - belt

    Path("belt.nml").write_text(COULOMB.format(damping, kinetic))
    with follow(Path("belt.nml")) as file:
        assert file["special/label"].asstr()[:].tolist() == ["ST"]
        assert file["special/parameter"][0] == pytest.approx(brentq(missed, 0.1, 0.3, xtol=1e-15), abs=1e-11)
        assert file["branch/ending"].asstr()[0] == "the motion jumps where its contacts change"
        assert np.abs(file["point/multiplier"][:, :, 0]).max() < 1e-9


TWO_BELTS = """
&scene    kind='lumped' /
&mass     name='a', value=1.0 /
&mass     name='b', value=0.5 /
&spring   between='a','frame', stiffness=1.0, damping=0.05 /
&spring   between='b','frame', stiffness=1.0, damping=0.1 /
&spring   between='b','a', stiffness=1.0, damping=0.05 /
&friction name='first', between='a','frame', static_coefficient=0.3, kinetic_coefficient=0.1, decay=1.0,
          normal_load=2.0, belt_speed={0} /
&friction name='second', between='b','frame', static_coefficient=0.3, kinetic_coefficient=0.15, decay=3.0,
          normal_load=2.0, belt_speed={0} /
&motion   t_end=300.0, start='zero', relative_tolerance=1e-12, absolute_tolerance=1e-14 /
&record   observable='displacement', of='a', what='extrema' /
&follow   parameter='friction(1)%belt_speed','friction(2)%belt_speed', factor=1.0,1.0, first={0}, last={1},
          doublings=1 /
"""


def test_a_motion_on_belts_doubles_its_period():
    """The branch of twice the period begins there, and one that is found by itself ends there."""
    Path("belts.nml").write_text(TWO_BELTS.format(0.23, 0.215))
    with follow(Path("belts.nml")) as file:
        period, times = file["point/period"][:], file["point/multiplicity"][:]
        assert file["special/label"].asstr()[:].tolist()[:2] == ["PD", "EP"] and set(times) == {1, 2}
        doubling = file["special/point"][0]
        assert file["special/parameter"][0] == pytest.approx(0.2239764829, abs=1e-9)
        assert np.abs(multipliers(file, doubling) + 1.0).min() < 1e-6
        assert period[times == 2][0] == pytest.approx(2.0 * period[doubling], rel=1e-2)
        row = np.flatnonzero(times == 2)[5]
    text = TWO_BELTS.format(0.22, 0.23).replace("doublings=1", f"doublings=0, start_file='belts.h5', start_point={row}")
    Path("below.nml").write_text(text)
    with follow(Path("below.nml")) as file:
        # One way it comes to its doubling, the other way to the end of the range.
        ends = file["branch/ending"].asstr()[:].tolist()
        back = ends.index("a doubling of a motion of half the period") + 1
        assert labels(file, back)[-1] == ("EP", pytest.approx(0.2239764829, abs=1e-9))


def test_a_motion_on_a_belt_has_its_own_period():
    """The time after which it comes back is seen by samples, and that of twice the motion may come nearer to one."""
    text = BELT.format("hyperbolic", 0.2, 0.2).replace("last=3.0", "last=0.21").replace("value=1.0", "value=0.5")
    text = text.replace("stiffness=1.0, damping=0.05", "stiffness=2.0, damping=0.1").replace("load=1.0", "load=2.0")
    Path("belt.nml").write_text(text.replace("kinetic_coefficient=0.1", "kinetic_coefficient=0.15"))
    with follow(Path("belt.nml")) as file:
        assert file["point/events"][:].tolist() == [2] * file["point/events"].size
        assert file["point/period"][0] == pytest.approx(3.364354949699473, rel=1e-9)


def test_a_machine_that_comes_to_rest_has_no_closed_motion():
    Path("belt.nml").write_text(BELT.format("hyperbolic", 2.0, 2.0).replace("t_end=300.0", "t_end=200.0"))
    done = start("razy-follow", "belt.nml")
    assert done.returncode == 1 and "the machine comes to rest" in done.stderr
    # Half of what is left of the vibration comes back to itself nearly.
    Path("belt.nml").write_text(COULOMB.format(0.02, 0.1))
    done = start("razy-follow", "belt.nml")
    assert done.returncode == 1 and "the machine comes to rest" in done.stderr


SHAFT = """
&scene     kind='rotor' /
&shaft     name='r', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0, damping_ratio=0.02 /
&section   shaft='r', length=0.5, outer_diameter=0.02, elements=2 /
&disk      shaft='r', node=3, mass=5.0, polar_inertia=5.0e-3, diametral_inertia=2.5e-3 /
&bearing   shaft='r', node=1, kind='matrix', stiffness=1.0e8,5.0e6,1.0e6,0.0,0.0,0.0,
           damping_matrix=100.0,100.0,100.0,0.0,0.0,0.0 /
&bearing   shaft='r', node=3, kind='matrix', stiffness=0.0,1.0e6,5.0e6,0.0,0.0,0.0,
           damping_matrix=0.0,100.0,100.0,0.0,0.0,0.0 /
&bearing   name='seal', shaft='r', node=2, kind='matrix', stiffness=0.0,{0},-{0},0.0,
           damping_matrix=50.0,0.0,0.0,50.0 /
&support   shaft='r', node=1, held='phi' /
&rotation  speed_rpm=3000.0 /
"""
RUBS = """
&stop      name='s', between='r.2','frame', direction=0.0,1.0,0.0, clearance=1.0e-4, stiffness=1.0e6, damping=50.0,
           separation='zero_force' /
&friction  name='rub', between='r.2','frame', normal_contact='s', radius=0.02, static_coefficient=0.1 /
&gravity   direction=0.0,-1.0,0.0 /
&initial   on='r.2.v', displacement=5.0e-5 /
&motion    t_end=2.0, start='given' /
&record    observable='displacement', of='r.2.v', what='extrema' /
&follow    parameter='bearing(3)%stiffness(2)','bearing(3)%stiffness(3)', factor=1.0,-1.0, first={0}, last=5.0e4 /
"""


def test_a_rotor_that_whirls_and_rubs_comes_to_rest_where_it_loses_its_stability():
    """Off the stop it is linear: motions of every size at the limit, where eigenvalues cross the axis; no fold."""
    Path("whirl.nml").write_text(SHAFT.format(1.5e5) + RUBS.format(1.5e5))
    with follow(Path("whirl.nml")) as file:
        assert file["special/label"].asstr()[:].tolist() == ["GR", "HB"]
        touch, rest = file["special/parameter"][:]
        assert touch == pytest.approx(rest, rel=1e-10)
        # Motions of the shaft's high modes are gone within a period.
        assert np.isnan(file["point/determinant_error"][:]).all()
    sweep = "&campbell first_rpm=3000.0, last_rpm=3001.0, points=2, damped=.true. /\n"
    growth = []
    for seal in (touch * (1.0 - 1e-6), touch * (1.0 + 1e-6)):
        Path("limit.nml").write_text(SHAFT.format(repr(float(seal))) + sweep)
        succeed("razy-modes", "limit.nml", "--force")
        with h5py.File("limit.h5") as file:
            growth.append(file["eigenvalue"][0].reshape(-1, 2)[:, 0].max())
    assert growth[0] < 0.0 < growth[1] and abs(sum(growth)) < 1e-3 * growth[1]
