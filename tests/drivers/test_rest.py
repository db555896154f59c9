"""Branches where friction comes to rest or ends to be: dry friction, a belt, a mass that sticks."""

from pathlib import Path

import numpy as np
import pytest
from branches import follow, labels
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve


def dry(*follow_groups):
    """x'' + x + 0.2 sgn x' = A cos omega t."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /", "&spring between='m','frame', stiffness=1.0 /"]
    text += [
        "&friction name='rub', between='m','frame', static_coefficient=0.2, kinetic_coefficient=0.2, normal_load=1 /"
    ]
    text += ["&load on='m', amplitude=1.0, angular_frequency=0.45 /", "&motion t_end=600.0, start='zero' /"]
    text += ["&record observable='displacement', what='extrema' /", *(f"&follow {group} /" for group in follow_groups)]
    Path("dry.nml").write_text("\n".join(text) + "\n")
    return follow(Path("dry.nml"))


@pytest.mark.parametrize(("first", "last"), [(0.42, 0.6), (0.6, 0.42)])
def test_branch_of_dry_friction_turns_where_rest_ends(first, last):
    """At the corner the branch turns by more than a right angle, and goes on."""
    with dry(f"parameter='load%angular_frequency', first={first}, last={last}") as file:
        assert labels(file, 1) == [("ST", pytest.approx(speed_touches_zero(0.2), rel=1e-11)), ("EP", last)]
        assert file["point/events"][:].max() == 6 and file["point/events"][:].min() == 2


def test_curve_of_where_rest_ends():
    """Over the amplitude of the load; how friction moves the point; the motion that the curve begins with."""
    frequency = "parameter='load%angular_frequency', first=0.42, last=0.44, sensitivities='friction%normal_load'"
    with dry(frequency, "parameter='load%amplitude', first=0.9, last=1.05") as file:
        assert file["curve/label"].asstr()[:].tolist() == ["ST"]
        curve = {name: item[:] for name, item in file["curve_point"].items()}
        slope = file["sensitivity/friction.normal_load"][:]
        (place,) = file["special/point"][:][file["special/label"].asstr()[:] == "ST"]
        state, phase = file["point/state"][place], file["point/phase"][place]
    amplitude, omega = curve["load.amplitude"], curve["load.angular_frequency"]
    assert [amplitude.min(), amplitude.max()] == pytest.approx([0.9, 1.05], rel=1e-12)
    for i in range(0, amplitude.size, 10):
        assert omega[i] == pytest.approx(speed_touches_zero(0.2 / amplitude[i]), rel=1e-11)
    begun = np.abs(amplitude - 1.0).argmin()
    assert curve["state"][begun] == pytest.approx(state, rel=1e-12) and curve["phase"][begun] == phase
    step = 1e-5
    assert slope == pytest.approx(
        [(speed_touches_zero(0.2 + step) - speed_touches_zero(0.2 - step)) / (10 * step)], rel=1e-6
    )


def speed_touches_zero(friction):
    """The frequency at which the motion that slides all the time stops for a moment on its way, by half a period.

    From a standstill on x = c cos t + d sin t - friction + cos(omega t + phase)/(1 - omega^2); at s x' touches 0.
    """

    def missed(unknowns):
        omega, phase, c, d, s = unknowns

        def motion(t):
            load = np.exp(1j * (omega * t + phase)) / (1 - omega**2)
            free = (c - 1j * d) * np.exp(1j * t)
            both = [free * 1j**k + load * (1j * omega) ** k for k in range(3)]
            return np.real(both) - [friction, 0.0, 0.0]

        start, end, touch = motion(0.0), motion(np.pi / omega), motion(s)
        return [start[1], end[1], start[0] + end[0], touch[1], touch[2]]

    found, _, flag, message = fsolve(missed, [0.4283, 2.92, 0.2, 0.12, 0.79], full_output=True, xtol=1e-13)
    assert flag == 1, message
    return found[0]


@pytest.mark.parametrize(("static", "ending"), [(0.2, "the end of"), (0.3, "the motion jumps")])
def test_sliding_on_a_belt_that_comes_to_stick(static, ending):
    """Where x' of what slides all the time touches the belt's speed; what sticks longer is no neighbour of it."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /"]
    text += ["&spring between='m','frame', stiffness=1.0, damping=0.1 /"]
    text += [f"&friction name='f', between='m','frame', static_coefficient={static}, kinetic_coefficient=0.2, "]
    text += ["normal_load=1.0, belt_speed=1.0 /", "&load on='m', amplitude=0.3, angular_frequency=0.5 /"]
    text += ["&initial on='m', displacement=0.2, velocity=0.0 /", "&motion t_end=600.0, start='given' /"]
    text += ["&record observable='displacement', what='extrema', from=500.0 /"]
    text += ["&follow parameter='load%amplitude', first=0.3, last=1.6 /"]
    Path("belt.nml").write_text("\n".join(text) + "\n")
    with follow(Path("belt.nml")) as file:
        assert labels(file, 1)[0] == ("ST", pytest.approx(np.hypot(1 - 0.5**2, 0.05) / 0.5, rel=1e-9))
        assert file["special/contact"].asstr()[0] == "f"
        assert file["branch/ending"].asstr()[0].startswith(ending)


def test_a_jump_that_steps_find():
    """Within the errors of a method of steps: where the force at a turn is the static friction, the mass stops."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /"]
    text += ["&spring between='m','frame', stiffness=1.0, damping=0.1 /"]
    text += [
        "&stop name='w', between='m','frame', clearance=0.5, law='hunt_crossley', stiffness=10.0, hysteresis=0.2 /"
    ]
    text += [
        "&friction name='f', between='m','frame', normal_load=1.0, kinetic_coefficient=0.1, static_coefficient=0.15 /"
    ]
    text += ["&load on='m', value=0.2, amplitude=0.5, angular_frequency=0.5 /", "&motion t_end=200.0, start='zero' /"]
    text += ["&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load%angular_frequency', first=0.5, last=0.8 /"]
    Path("steps.nml").write_text("\n".join(text) + "\n")
    with follow(Path("steps.nml")) as file:
        assert labels(file, 1)[-1][0] == "SL" and file["special/contact"].asstr()[-1] == "f"
        assert file["point/phase"][-1] == 0.0
        state, omega = file["point/state"][-1], labels(file, 1)[-1][1]

    def force(t, x):
        depth, rate = max(x[0] - 0.5, 0.0), x[1]
        return 0.2 + 0.5 * np.sin(omega * t) - x[0] - 10.0 * depth**1.5 * (1.0 + 1.5 * 0.2 * rate)

    def turn(t, x):
        return x[1]

    turn.terminal = True
    time = 0.0
    for _ in range(3):
        way = np.sign(state[1])
        moved = solve_ivp(
            lambda t, x, way=way: [x[1], force(t, x) - 0.1 * x[1] - 0.1 * way],
            (time, time + 20.0),
            state,
            events=turn,
            rtol=1e-11,
            atol=1e-12,
            first_step=1e-3,
        )
        time, state = moved.t[-1], moved.y[:, -1]
        state[1] = 1e-12 * np.sign(force(time, state))
        if abs(abs(force(time, state)) - 0.15) < 1e-5:
            return
    pytest.fail("no turn at the limit of the friction")


def stuck(static, displacement):
    """A mass that sticks where the load is small, at any displacement up to static/stiffness, m."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /"]
    text += ["&spring between='m','frame', stiffness=1.0, damping=0.1 /"]
    text += [f"&friction name='f', between='m','frame', static_coefficient={static}, kinetic_coefficient=0.2, "]
    text += ["normal_load=1.0 /", "&load on='m', amplitude=0.1, angular_frequency=0.5 /"]
    text += [f"&initial on='m', displacement={displacement} /", "&motion t_end=200.0, start='given' /"]
    text += ["&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load%amplitude', first=0.1, last=0.5 /"]
    Path("stuck.nml").write_text("\n".join(text) + "\n")
    return Path("stuck.nml")


@pytest.mark.parametrize("static", [0.2, 0.3])
def test_what_sticks_all_the_time_is_followed_where_it_stands(static):
    """There is a motion for each place; each ends where the load and the spring together reach the friction."""
    with follow(stuck(static, 0.05)) as file:
        assert labels(file, 1) == [("SL", pytest.approx(static - 0.05, rel=1e-12))]
        assert file["special/contact"].asstr()[0] == "f"
        assert (file["point/state"][:, 0] == pytest.approx(0.05, rel=1e-14)) and (file["point/stable"][:] == 1).all()


def test_what_sticks_in_the_middle_slides_both_ways():
    """At rest until the load is the friction; where static friction is larger the motion jumps."""
    with follow(stuck(0.2, 0.0)) as file:
        first, parameter = file["special/label"].asstr()[0], file["special/parameter"][:]
        assert first == "ST" and parameter[0] == pytest.approx(0.2, rel=1e-9) and parameter[-1] == 0.5
    with follow(stuck(0.3, 0.0), "--force") as file:
        assert labels(file, 1) == [("ST", pytest.approx(0.3, rel=1e-12))]
