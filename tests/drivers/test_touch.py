"""Touches of stops whose force jumps: where they are, and the branches that begin there."""

from pathlib import Path

import numpy as np
import pytest
from branches import RIGID, follow, labels, multipliers, oscillator, points
from scipy.linalg import expm
from scipy.optimize import brentq

PLASTIC = "law='rigid', restitution=0.0, side='both'"
ELASTIC = "side='upper', stiffness=1.0"
# Spring of 1 N/m from the wall on: the force jumps by 0.1 N where the stop closes.
JUMP = "law='switched_spring', stiffness=0.1"
# Friction of 0.1 N on a belt, only while the stop is closed.
RUBBED = "side='upper', stiffness=1.0 /\n&friction name='belt', between='m','frame', static_coefficient=0.1, "
RUBBED += "normal_load=1.0, belt_speed=-9.0, only_with='stop'"
AMPLITUDE = "parameter='load%amplitude', first=0.05, last=0.3"
FREQUENCY = "parameter='load%angular_frequency', first=0.3, last=1.5"


@pytest.mark.parametrize(
    ("turn", "first", "last"), [(90, 1.0, 0.09), (100, 1.0, 0.09), (300, 1.0, 0.09), (90, 1.2, 0.02)]
)
def test_fold_next_to_the_first_impact(turn, first, last):
    """Impacts go on below A = 0.1 to a fold, and back; from the touch on the motion without impacts is followed."""
    load = f"amplitude=1.0, angular_frequency=1.0, phase={turn}.0"
    with oscillator(RIGID, load, f"parameter='load%amplitude', first={first}, last={last}") as file:
        assert points(file, "LP") == pytest.approx([0.0999707536283], rel=1e-11)
        assert points(file, "GR") == pytest.approx([0.1], rel=1e-12)
        assert [label for label, _ in labels(file, 1)] == ["LP", "GR"]
        assert labels(file, 2) == [("EP", last)]
        without = file["point/branch"][:] == 2
        assert not file["point/events"][:][without].any()
        state = file["point/state"][:][without][-1]
    # At the resonance of the linear machine x' is a quarter of a turn ahead of x.
    assert np.hypot(*state) == pytest.approx(last / 0.1, rel=1e-11)


@pytest.mark.parametrize("omega", [0.5, 1.0, 1.3])
def test_first_touch_of_a_rigid_stop(omega):
    """The motion without impacts has the amplitude 1 there, and motions that hit the stop lead on."""
    touch = np.hypot(1 - omega**2, 0.1 * omega)
    load = f"amplitude=0.05, angular_frequency={omega}"
    with oscillator(RIGID, load, "parameter='load%amplitude', first=0.05, last=1.0") as file:
        assert labels(file, 1) == [("GR", pytest.approx(touch, rel=1e-12))]
        assert file["special/contact"].asstr()[0] == "stop"
        assert [label for label, _ in labels(file, 2)] == ["LP", "EP"]
        mine = file["point/branch"][:] == 2
        assert (file["point/events"][:][mine] == 1).all() and file["point/correction"][:][mine].max() < 1e-9
        first = file["point/load.amplitude"][:][mine][0]
    assert first == pytest.approx(touch, rel=2e-3)


@pytest.mark.parametrize("stop", [RIGID, JUMP, RUBBED])
def test_resonance_over_a_stop(stop):
    """Up to the touch, over the resonance with impacts, and down to the touch on its other side, from one start."""
    with oscillator(stop, "amplitude=0.3, angular_frequency=0.3", FREQUENCY) as file:
        # (1 - w^2)^2 + 0.01 w^2 = 0.09
        touches = np.sqrt((1.99 + np.array([-1, 1]) * np.sqrt(1.99**2 - 4 * 0.91)) / 2)
        found = {branch: labels(file, branch) for branch in np.unique(file["special/branch"])}
    assert found[1] == [("GR", pytest.approx(touches[0], rel=1e-12))]
    assert found[2][-1] == ("GR", pytest.approx(touches[1], rel=1e-12))
    assert [("EP", 1.5)] in found.values()


def test_touch_of_a_stop_whose_force_jumps():
    """From both sides the same touch, at A = 0.1, and the fold between."""
    with oscillator(JUMP, "amplitude=0.05, angular_frequency=1.0", AMPLITUDE) as file:
        assert labels(file, 1) == [("GR", pytest.approx(0.1, rel=1e-12))]
        ((fold, value), end) = labels(file, 2)
    assert (fold, end[0]) == ("LP", "EP")
    with oscillator(JUMP, "amplitude=0.05, angular_frequency=1.0", AMPLITUDE + ", from=0.3", "back") as file:
        assert labels(file, 1) == [
            ("LP", pytest.approx(value, rel=1e-11)),
            ("GR", pytest.approx(0.1, rel=1e-12)),
        ]


def test_touch_of_the_edge_from_within():
    """A load keeps the stop closed until the motion comes to its edge, where the spring lets go at once."""
    touch = (1.5 / 1.1 - 1.0) * np.hypot(1.1 - 0.5**2, 0.1 * 0.5)
    load = "value=1.5, amplitude=0.2, angular_frequency=0.5"
    with oscillator(JUMP, load, "parameter='load%amplitude', first=0.2, last=0.5") as file:
        assert labels(file, 1) == [("GR", pytest.approx(touch, rel=1e-12))]
        endings = [labels(file, branch)[-1] for branch in np.unique(file["special/branch"])]
    # From there on motions leave the stop, and come back at the touch of another.
    assert ("EP", 0.5) in endings and "MX" not in [label for label, _ in endings]


def test_two_periods_end_at_a_touch_of_one():
    """A multiplier jumps past -1 as a damped stop is touched: motions of two periods end where that of one has GR."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /"]
    text += ["&spring between='m','frame', stiffness=1.0, damping=0.05 /"]
    for side in ("upper", "lower"):
        text += [
            f"&stop name='{side}', between='m','frame', side='{side}', clearance=1.0, stiffness=100.0, damping=1.0 /"
        ]
    text += ["&load on='m', value=-0.5, amplitude=0.5, angular_frequency=0.3 /", "&motion t_end=1200.0, start='zero' /"]
    text += ["&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load%angular_frequency', first=0.3, last=0.385, doublings=1 /"]
    Path("halves.nml").write_text("\n".join(text) + "\n")
    with follow(Path("halves.nml")) as file:
        (touch,) = (value for label, value in labels(file, 1) if label == "GR")
        assert labels(file, 2)[-1] == ("EP", pytest.approx(touch, rel=1e-10))
        assert file["branch/ending"].asstr()[1] == "a motion of half the period, as that touches a stop"


def test_curve_of_first_touches():
    """Of a rigid stop in closed form, with the resonant grazings, where x there does not feel x' a period before."""
    over = "parameter='load%amplitude', first=0.05, last=0.3 /\n"
    over += "&follow parameter='load%angular_frequency', first=0.9, last=1.1"
    with oscillator(RIGID, "amplitude=0.05, angular_frequency=1.05", over) as file:
        assert file["curve/label"].asstr()[0] == "GR" and file["curve/contact"].asstr()[0] == "stop"
        mine = file["curve_point/curve"][:] == 1
        omega = file["curve_point/load.angular_frequency"][:][mine]
        assert omega.size > 30 and omega[[0, -1]] == pytest.approx([0.9, 1.1], rel=1e-12)
        amplitude = np.hypot(1 - omega**2, 0.1 * omega)
        assert file["curve_point/load.amplitude"][:][mine] == pytest.approx(amplitude, rel=1e-11)
        resonant = file["junction/label"].asstr()[:] == "RG"
        assert file["junction/curve"][:][resonant].tolist() == [1]
        found = file["junction/load.angular_frequency"][:][resonant]
    assert found == pytest.approx([np.sqrt(1 - 0.0025)], rel=1e-8)


def test_curve_where_a_stop_no_longer_holds():
    """A mass that does not bounce rests on its walls in turn, until it leaves them as it comes, in closed form."""

    def frequency(stiffness, load):
        """Where half a period after it left one wall with no force left it is at the other."""

        def beyond(omega):
            phase = np.arcsin(-stiffness / load)
            matrix = np.array([[0, 1, 0, 0], [-stiffness, -0.1, load, 0], [0, 0, 0, omega], [0, 0, -omega, 0]])
            return (expm(np.pi / omega * matrix) @ [-1.0, 0.0, np.sin(phase), np.cos(phase)])[0] - 1

        return brentq(beyond, 2.7, 3.0, xtol=1e-14)

    over = "parameter='load%angular_frequency', first=2.6, last=3.0, sensitivities='load%amplitude' /\n"
    over += "&follow parameter='spring%stiffness', first=0.8, last=1.2"
    with oscillator(PLASTIC, "amplitude=5.0, angular_frequency=2.6", over) as file:
        assert points(file, "GR") == pytest.approx([frequency(1.0, 5.0)], rel=1e-11)
        places = zip(file["curve_point/load.angular_frequency"], file["curve_point/spring.stiffness"], strict=True)
        found = np.array(list(places))
        slope = (frequency(1.0, 5.001) - frequency(1.0, 4.999)) / 0.002
        assert file["sensitivity/load.amplitude"][0] == pytest.approx(slope, rel=1e-6)
    assert found[[0, -1], 1] == pytest.approx([0.8, 1.2], rel=1e-12)
    assert found[::10, 0] == pytest.approx([frequency(k, 5.0) for k in found[::10, 1]], rel=1e-11)


def test_an_impact_before_a_stop_stays_closed_is_new():
    """Bounces without end bring a mass to rest on a stop; where one of the impacts before is lost, that is a touch."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=0.885 /"]
    text += ["&spring between='m','frame', stiffness=241.3, damping=0.818 /"]
    text += ["&stop name='s', between='m','frame', side='both', clearance=0.001845, law='rigid', restitution=0.3 /"]
    text += ["&load on='m', amplitude=1.18, angular_frequency=10.0, phase=191 /", "&load on='m', value=-0.2886 /"]
    text += ["&motion t_end=40.0, start='zero' /", "&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load(1)%angular_frequency', first=10.05, last=11.5 /"]
    Path("rest.nml").write_text("\n".join(text) + "\n")
    with follow(Path("rest.nml")) as file:
        label, value = file["special/label"].asstr()[:], file["special/parameter"][:]
        events, over = file["point/events"][:], file["point/load(1).angular_frequency"][:]
        assert label[-1] == "EP" and value[-1] == 11.5 and "GR" in label and "MX" not in label
    with follow(Path("rest.nml"), "--force", follow__first=11.5, follow__last=10.05) as file:
        (last,) = points(file, "GR")
    # The gap of what opens again is no touch.
    assert value[label == "GR"][-1] == pytest.approx(last, rel=1e-11)
    for touch in value[label == "GR"]:
        beside = [events[np.abs(over - near).argmin()] for near in (touch - 1e-3, touch + 1e-3)]
        assert beside[0] == beside[1] + 1


def test_rounding_of_stiff_contacts_ends_no_branch():
    """Forces that jump by 1000 N as a gap of a millimetre closes make rounding of 1e-11: the fold is beyond it."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.6 /"]
    text += ["&spring between='m','frame', stiffness=137.0, damping=1.46 /"]
    text += ["&stop name='s', between='m','frame', side='both', clearance=0.00087, law='switched_spring',"]
    text += ["stiffness=1.1e6, separation='zero_force' /"]
    text += ["&stop name='t', between='m','frame', side='both', clearance=0.0021, law='kelvin_voigt',"]
    text += ["stiffness=12300.0, damping=845.0 /", "&load on='m', amplitude=0.34, angular_frequency=9.09 /"]
    text += ["&motion t_end=44.0, start='zero' /", "&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load%angular_frequency', first=9.09, last=12.7 /"]
    Path("stiff.nml").write_text("\n".join(text) + "\n")
    with follow(Path("stiff.nml")) as file:
        assert [label for label, _ in labels(file, 1)] == ["LP", "EP"]
        assert (file["point/correction"][:] < 1e-9).all()


def test_two_equal_masses_that_stick_together():
    """The friction has half of the load; both masses rest where a period begins, and part at twice the limit."""
    text = ["&scene kind='lumped' /", "&mass name='a', value=1.0 /", "&mass name='b', value=1.0 /"]
    text += [f"&spring between='{name}','frame', stiffness=1.0, damping=0.1 /" for name in "ab"]
    text += ["&friction name='f', between='a','b', static_coefficient=1.0, kinetic_coefficient=1.0, normal_load=1.0 /"]
    text += ["&load on='a', amplitude=1.0, angular_frequency=1.0 /", "&motion t_end=200.0, start='zero' /"]
    text += ["&record observable='displacement', of='a', what='extrema' /"]
    text += ["&follow parameter='load%amplitude', first=1.0, last=2.5 /"]
    Path("equal.nml").write_text("\n".join(text) + "\n")
    with follow(Path("equal.nml")) as file:
        assert labels(file, 1) == [("ST", pytest.approx(2.0, rel=1e-10)), ("EP", 2.5)]
        stuck = file["point/load.amplitude"][:] < 2.0
        assert (file["point/events"][stuck] == 0).all()


def test_impact_at_half_of_four_periods():
    """As an impact passes the half, what the motion misses there jumps; it is no motion of half the period."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /"]
    text += ["&spring between='m','frame', stiffness=4.0, damping=0.1 /"]
    text += ["&stop name='s', between='m','frame', side='upper', clearance=0.5, law='rigid', restitution=0.9 /"]
    text += ["&load on='m', amplitude=0.2, angular_frequency=2.0, phase=270 /", "&load on='m', value=-0.5 /"]
    text += ["&motion t_end=1200.0, start='zero' /", "&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load(1)%angular_frequency', first=2.0, last=2.1, doublings=1 /"]
    Path("half.nml").write_text("\n".join(text) + "\n")
    with follow(Path("half.nml")) as file:
        label, value = file["special/label"].asstr()[:], file["special/parameter"][:]
    assert "MX" not in label and value[label == "EP"].tolist() == [2.0]


def test_sticking_that_begins_earlier_at_once():
    """Where the speed comes to 0 at an earlier turn and static friction holds it, the sequence stays, the map jumps."""
    text = ["&scene kind='lumped' /", "&mass name='a', value=1.0 /", "&mass name='b', value=1.0 /"]
    text += [
        f"&spring between={pair}, stiffness=1.0, damping=0.05 /" for pair in ("'a','frame'", "'b','frame'", "'a','b'")
    ]
    text += ["&friction name='rub', between='b','frame', normal_load=1.0,"]
    text += ["static_coefficient=0.2, kinetic_coefficient=0.1 /", "&load on='a', value=0.5 /"]
    text += ["&load on='a', amplitude=0.5, angular_frequency=0.5 /", "&motion t_end=1200.0, start='zero' /"]
    text += ["&record observable='displacement', of='a', what='extrema' /"]
    text += ["&follow parameter='load(2)%angular_frequency', first=0.5, last=1.0 /"]
    Path("earlier.nml").write_text("\n".join(text) + "\n")
    with follow(Path("earlier.nml")) as file:
        (end,) = labels(file, 1)
        contact = file["special/contact"].asstr()[0]
    assert (end[0], contact) == ("CH", "rub")


def test_a_cascade_of_impacts_to_motions_that_grow_a_thousandfold():
    """Newton's method over all periods at once ends where what grows in them leaves nothing but rounding."""
    text = ["&mass name='m', value=1.0 /", "&load on='m', angular_frequency=4.5, amplitude=1.0 /"]
    text += ["&spring between='m','frame', damping=0.1, stiffness=1.0 /"]
    text += ["&stop name='s', between='m','frame', side='upper', clearance=0.0, law='rigid', restitution=0.8 /"]
    text += ["&motion t_end=400.0, start='zero' /", "&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load%angular_frequency', first=4.5, last=2.0, doublings=3 /"]
    Path("cascade.nml").write_text("\n".join(text) + "\n")
    with follow(Path("cascade.nml")) as file:
        label = file["special/label"].asstr()[:]
        doublings = [points(file, "PD", branch)[0] for branch in (3, 4, 5, 6)]
        branch, periods = file["point/branch"][:], file["point/multiplicity"][:]
        last = file["special/point"][:][(label == "GR") & (file["special/branch"][:] == 6)][-1]
        assert np.abs(multipliers(file, last)).max() > 1e5
        assert [periods[branch == i][0] for i in (3, 4, 5, 6)] == [2, 4, 8, 16]
    assert "MX" not in label and "CH" not in label
    # Feigenbaum's constant, 4.669, from the third ratio on to a few per cent.
    first, second, third = np.diff(doublings)
    assert second / third == pytest.approx(4.6692, rel=0.02)
    assert first / second == pytest.approx(4.6692, rel=0.1)


def test_a_stop_that_closes_as_friction_beside_it_begins_to_slide():
    """What sticks at an open stop without a gap slides onto it: how far off it stuck is forgotten."""
    text = ["&scene kind='lumped' /", "&mass name='a', value=0.5 /", "&mass name='b', value=0.5 /"]
    text += ["&stop name='s', between='a','b', side='upper', clearance=0.001, law='rigid', restitution=0.5 /"]
    rub = "static_coefficient=1.0, kinetic_coefficient=1.0, normal_load=1.0"
    text += [f"&friction name='f', between='a','b', {rub} /"]
    text += [f"&friction name='belt', between='a','frame', {rub}, belt_speed=1.0 /"]
    text += ["&spring between='a','frame', stiffness=1.15, damping=0.15 /"]
    text += ["&spring between='b','frame', stiffness=0.15, damping=0.05 /"]
    text += ["&load on='a', value=1.5, amplitude=1.5, angular_frequency=1.0, phase=180.0 /"]
    text += ["&motion t_end=400.0, start='zero' /", "&record observable='displacement', of='a', what='extrema' /"]
    text += ["&follow parameter='load%amplitude', first=1.5, last=1.6, doublings=0 /"]
    Path("onto.nml").write_text("\n".join(text) + "\n")
    with follow(Path("onto.nml")) as file:
        assert labels(file, 1)[-1] == ("EP", 1.6)
        assert (abs(file["point/multiplier"][0, 0]) < 0.9).all()


def test_what_a_shorter_step_begins_with_after_touches_were_looked_for():
    """Motions that begin at another phase than the branch's last point go on from there."""
    text = ["&scene kind='lumped' /"] + [f"&mass name='{name}', value=2.0 /" for name in "abc"]
    text += ["&spring between='a','b', stiffness=10000.0, damping=10.0 /"]
    text += ["&stop name='s', between='b','c', side='upper', law='rigid', restitution=1.0 /"]
    rub = "static_coefficient=1.0, kinetic_coefficient=1.0"
    text += [f"&friction name='f', between='b','c', {rub}, normal_load=2.0 /"]
    text += [f"&friction name='g', between='a','frame', {rub}, normal_load=5.0, belt_speed=1.0 /"]
    text += ["&spring between='a','frame', stiffness=0.15, damping=0.1 /"]
    text += ["&spring between='b','frame', stiffness=0.15, damping=0.1 /"]
    text += ["&spring between='c','frame', stiffness=1.15, damping=0.1 /"]
    text += ["&load on='a', amplitude=1.5, angular_frequency=0.5 /", "&motion t_end=800.0, start='zero' /"]
    text += ["&record observable='displacement', of='a', what='extrema' /"]
    text += ["&follow parameter='load%amplitude', first=1.5, last=3.0, doublings=0, max_points=30 /"]
    Path("phase.nml").write_text("\n".join(text) + "\n")
    with follow(Path("phase.nml")) as file:
        label, value = labels(file, 1)[-1]
    assert label == "EP" and value > 1.8


def test_a_touch_that_a_branch_has_crept_up_to():
    """A multiplier of 1542: the gap there is rounding, and no motion nearer to the touch is found."""
    text = ["&scene kind='lumped' /", "&mass name='a', value=0.5 /", "&mass name='b', value=2.0 /"]
    text += ["&stop name='s', between='a','b', side='both', clearance=0.001, law='rigid', restitution=1.0 /"]
    text += ["&stop name='t', between='a','frame', side='both', clearance=0.0, stiffness=100.0 /"]
    text += ["&load on='a', amplitude=2.0, angular_frequency=10.0 /"]
    text += ["&spring between='a','frame', stiffness=15.0, damping=0.5 /"]
    text += ["&spring between='b','frame', stiffness=60.0, damping=2.0 /"]
    text += ["&motion t_end=40.0, start='zero' /", "&record observable='displacement', of='a', what='extrema' /"]
    text += ["&follow parameter='load%amplitude', first=2.0, last=4.0, doublings=0, max_points=80 /"]
    Path("crept.nml").write_text("\n".join(text) + "\n")
    with follow(Path("crept.nml")) as file:
        assert labels(file, 1)[-1][0] == "GR"


def test_a_change_that_motions_jump_at_is_known_to_the_jump():
    """One bounce more before a stop stays closed: over other ranges it comes elsewhere, by no more than its error."""
    text = ["&scene kind='lumped' /", "&mass name='a', value=8.2 /", "&mass name='b', value=0.35 /"]
    text += ["&spring between='a','frame', stiffness=439800.0, damping=201.0 /"]
    text += ["&spring between='b','a', stiffness=28870.0, damping=0.0 /"]
    text += ["&spring between='b','frame', stiffness=5314.0, damping=7.9 /"]
    text += ["&stop name='s', between='a','b', side='upper', clearance=0.00094, law='rigid', restitution=0.3 /"]
    rub = "static_coefficient=0.36, kinetic_coefficient=0.14, normal_load=350.0"
    text += [f"&friction name='f', between='a','frame', {rub} /"]
    text += [
        "&load on='b', amplitude=110.0, angular_frequency=224.0, phase=258.0 /",
        "&motion t_end=1.8, start='zero' /",
    ]
    text += ["&record observable='displacement', of='a', what='extrema' /"]
    found = []
    for last in (280.0, 340.0):
        group = f"&follow parameter='load%angular_frequency', first=224.0, last={last}, doublings=0, max_points=60 /"
        Path(f"jump_{last}.nml").write_text("\n".join([*text, group]) + "\n")
        with follow(Path(f"jump_{last}.nml")) as file:
            here = file["special/label"].asstr()[:] == "CH"
            found.append((file["special/parameter"][here], file["special/error"][here]))
    (one, its_error), (other, their_error) = found
    assert (abs(one - other) <= its_error + their_error).all()
    assert (its_error > 1e-8).all() and (its_error < 1e-5 * one).all()


@pytest.mark.parametrize(("first", "last"), [(0.05, 0.2), (0.2, 0.05)])
def test_a_touch_by_steps(first, last):
    """A Runge-Kutta method tells it from both sides, to its tolerance: the linear motion is as large as the gap."""
    steps = ", integrator='dop853', relative_tolerance=1e-11"
    amplitude = f"parameter='load%amplitude', first={first}, last={last}"
    with oscillator(ELASTIC, "amplitude=0.05, angular_frequency=1.0", amplitude, method=steps) as file:
        assert list(file["special/label"].asstr()) == ["GR", "EP"]
        assert file["point/load.amplitude"][file["special/point"][0]] == pytest.approx(0.1, rel=1e-9)


def test_a_touch_at_the_end_of_the_range():
    """The range ends at 0.1, where the linear motion is as large as the gap: a touch all the same."""
    upper = "side='upper', " + RIGID
    with oscillator(upper, "amplitude=0.05, angular_frequency=1.0", AMPLITUDE.replace("0.3", "0.1")) as file:
        assert list(file["special/label"].asstr()) == ["GR", "LP", "EP"]
