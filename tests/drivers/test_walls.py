"""Motions between two walls, or two sides of a stop, that are touched at once."""

from pathlib import Path

import numpy as np
import pytest
from branches import RIGID, follow, labels, oscillator
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar


def walls(stops, omega, last, first=0.05):
    """The same between two walls: a symmetric motion touches both, half a period apart, at the same amplitude."""
    return oscillator(
        f"{RIGID}, side={stops[0]} /\n&stop name='other', between='m','frame', clearance=1.0, {RIGID}, side={stops[1]}"
        if len(stops) == 2
        else f"{RIGID}, side={stops[0]}",
        f"amplitude={first}, angular_frequency={omega}",
        f"parameter='load%amplitude', first={first}, last={last}",
        f"walls_{first}",
    )


@pytest.mark.parametrize("stops", [("'upper'", "'lower'"), ("'both'",)])
def test_symmetric_motion_between_walls(stops):
    """From the touch of both at once motions that hit both lead on, to the fold of half a period with one impact."""
    with walls(stops, 1.0, 0.5) as file:
        assert labels(file, 1) == [("GR", pytest.approx(0.1, rel=1e-12))]
        (label, fold), (end, value) = labels(file, 2)
        assert (label, end, value) == ("LP", "EP", 0.5)
        mine = file["point/branch"][:] == 2
        assert (file["point/events"][:][mine] == 2).all()
    assert fold == pytest.approx(half_period_fold(1.0), rel=1e-9)


def test_symmetric_motion_on_the_way_back():
    with walls(("'both'",), 1.0, 0.05, first=0.5) as file:
        there, (label, value) = labels(file, 1)
    assert there == ("LP", pytest.approx(half_period_fold(1.0), rel=1e-9))
    # So steep there, at multipliers of 1e4, that rounding decides whether the branch comes near enough.
    assert label in ("GR", "MX") and value == pytest.approx(0.1, rel=1e-12 if label == "GR" else 1e-4)


def symmetric_motion(omega, v, restitution, damping):
    """Amplitude of the load for a symmetric motion with one impact of speed v on each wall, and det(Q' + 1).

    x(0) = 1 and x'(0) = -e v after an impact, x(T/2) = -1 and x'(T/2) = -v: two linear equations for the parts of the
    load in phase and out of phase. Q leads from an impact to the next one, seen in a mirror; where it has the
    eigenvalue -1 every second impact may become stronger.
    """
    d = damping / 2
    w = np.sqrt(1 - d * d)
    t = np.pi / omega
    c, s = np.cos(w * t), np.sin(w * t)
    flow = np.exp(-d * t) * np.array([[c + d / w * s, s / w], [-s / w, c - d / w * s]])
    # z = h + p with p(t + T/2) = -p(t): F (z(0) - p0) = z(T/2) + p0.
    after, before = np.array([1, -restitution * v]), np.array([-1, -v])
    p0 = np.linalg.solve(flow + np.eye(2), flow @ after - before)
    amplitude = np.hypot(p0[0], p0[1] / omega) * np.hypot(1 - omega**2, damping * omega)
    # The load at the impact is what its part of the motion asks for; half a period on it is the opposite.
    load = p0[0] * (1 - omega**2) + damping * p0[1]
    leaves, arrives = load - 1 - damping * after[1], -load + 1 - damping * before[1]
    change = flow @ np.array([[-after[1], 0.0], [-leaves, 1.0]])
    later = -change[0] / before[1]
    slope = np.array([later, restitution * (change[1] + arrives * later)])
    return amplitude, np.linalg.det(slope + np.eye(2))


def half_period_fold(omega, restitution=0.8, damping=0.1):
    """Least amplitude of symmetric motions with one impact on each wall, by the closed form of half a period."""
    v = np.geomspace(1e-6, 10, 4001)
    values = np.array([symmetric_motion(omega, x, restitution, damping)[0] for x in v])
    k = int(values.argmin())
    low, high = v[max(k - 1, 0)], v[min(k + 1, v.size - 1)]
    found = minimize_scalar(
        lambda x: symmetric_motion(omega, x, restitution, damping)[0], bounds=(low, high), options={"xatol": 1e-10}
    )
    return found.fun


@pytest.mark.parametrize(("omega", "last"), [(1.2, 1.6), (2.0, 3.2), (3.0, 8.02)])
def test_symmetric_motion_of_strong_impacts(omega, last):
    """From the touch of both walls, where each impact is the root of the one before, to the broken symmetry."""
    with walls(("'upper'", "'lower'"), omega, last) as file:
        touch = np.hypot(1 - omega**2, 0.1 * omega)
        assert labels(file, 1) == [("GR", pytest.approx(touch, rel=1e-12))]
        names, values = zip(*labels(file, 2), strict=True)
        begins = file["branch/parent"][:].tolist()
    v = brentq(lambda x: symmetric_motion(omega, x, 0.8, 0.1)[1], 0.5 * omega, 2 * omega, xtol=1e-14)
    assert names[:2] == ("LP", "BP") and names[-1] == "EP"
    assert values[0] == pytest.approx(half_period_fold(omega), rel=1e-10)
    assert values[1] == pytest.approx(symmetric_motion(omega, v, 0.8, 0.1)[0], rel=1e-11)
    assert begins.count(2) == 2


@pytest.mark.parametrize("restitution", [1.0, 0.0])
def test_symmetric_motion_of_round_numbers(restitution):
    """Mass, spring, damper, clearance and frequency of 1: the touch at A = 1, and the fold of half a period."""
    stop = f"law='rigid', restitution={restitution}, side='both'"
    text = "parameter='load%amplitude', first=0.5, last=1.2"
    with oscillator(stop, "amplitude=0.5, angular_frequency=1.0", text, damping=1.0) as file:
        assert labels(file, 1) == [("GR", pytest.approx(1.0, rel=1e-12))]
        assert labels(file, 2)[0] == ("LP", pytest.approx(half_period_fold(1.0, restitution, 1.0), rel=1e-9))


def test_symmetry_is_broken_between_walls():
    """Where the symmetric motion loses its stability two mirror images begin, and each comes to touch a wall again."""
    with walls(("'upper'", "'lower'"), 1.1, 1.6, first=1.2) as file:
        assert [label for label, _ in labels(file, 1)] == ["BP", "EP"]
        ends = [labels(file, branch) for branch in (2, 3)]
        states = [file["point/multiplier"][:][file["point/branch"][:] == branch] for branch in (1, 2)]
    assert ends[0] == [("GR", pytest.approx(ends[1][0][1], rel=1e-10))] and len(ends[1]) == 1
    assert states[1][:, 0].max() < 1.0 < states[0][:, 0].max()


def test_touch_where_friction_turns_round():
    """x'' + 0.2 x' + x + 0.1 sgn x' turns at the wall as friction does; -z(0) = z(T/2) gives the load for that."""
    omega, damping, friction = 0.8, 0.2, 0.1
    half = expm(np.array([[0.0, 1.0], [-1.0, -damping]]) * np.pi / omega)
    turn, constant = np.array([1.0, 0.0]), np.array([friction, 0.0])
    load = turn + np.linalg.solve(half + np.eye(2), (np.eye(2) - half) @ constant)
    touch = np.hypot(load[0], load[1] / omega) * np.abs(1 - omega**2 + 1j * damping * omega)
    text = "&friction name='f', between='m','frame', static_coefficient=0.1, kinetic_coefficient=0.1, normal_load=1.0 /"
    stop = f"{RIGID} /\n{text}\n&stop name='lower', between='m','frame', side='lower', clearance=1.0, {RIGID}"
    load = f"amplitude=0.4, angular_frequency={omega}"
    with oscillator(stop, load, "parameter='load%amplitude', first=0.4, last=0.6", damping=damping) as file:
        assert labels(file, 1) == [("GR", pytest.approx(touch, rel=1e-12))]
        assert [labels(file, branch)[-1][0] for branch in np.unique(file["special/branch"])].count("MX") == 0
        assert ("EP", 0.6) in [labels(file, branch)[-1] for branch in np.unique(file["special/branch"])]


def test_branch_folds_back_at_a_touch_of_both_sides():
    """Motions with contacts begin at the touch and go back, nearly the way that those without came."""
    mass, damping, stiffness = np.diag([0.5, 2.0]), np.diag([0.05, 0.05]), np.array([[1.0, -1.0], [-1.0, 2.0]])

    def gap(omega):
        x = np.linalg.solve(stiffness + 1j * omega * damping - omega**2 * mass, [0.5, 0.0])
        return 1.0 - np.abs(x[0] - x[1])

    touch = brentq(gap, 0.5, 0.6, xtol=1e-15)
    text = ["&scene kind='lumped' /", "&mass name='a', value=0.5 /", "&mass name='b', value=2.0 /"]
    text += ["&damper between='a','frame', damping=0.05 /", "&spring between='a','b', stiffness=1.0 /"]
    text += ["&spring between='b','frame', stiffness=1.0, damping=0.05 /"]
    text += ["&stop name='s', between='a','b', side='both', clearance=1.0, stiffness=10.0, damping=1.0 /"]
    text += ["&load on='a', amplitude=0.5, angular_frequency=0.5, phase=90 /", "&motion t_end=1200.0, start='zero' /"]
    text += ["&record observable='displacement', of='a', what='extrema' /"]
    found = []
    for first, last in [(0.5, 0.56), (0.5475, 0.5)]:
        follow_group = f"&follow parameter='load%angular_frequency', first={first}, last={last} /"
        Path("fold.nml").write_text("\n".join([*text, follow_group]) + "\n")
        with follow(Path("fold.nml"), "--force") as file:
            found.append(labels(file, 1))
    ahead, back = found
    assert [label for label, _ in ahead][:2] == ["GR", "LP"] and [label for label, _ in back] == ["LP", "GR", "EP"]
    assert [ahead[0][1], back[1][1]] == pytest.approx([touch, touch], rel=1e-11)
    assert ahead[1][1] == pytest.approx(back[0][1], rel=1e-11)


@pytest.mark.parametrize(("stiffness", "damping"), [(20.0, 5.0), (400.0, 20.0)])
def test_a_damped_stop_touched_on_both_sides_at_once(stiffness, damping):
    """Beside the touch motions hit both sides, one or none; none of the three branches ends with MX."""
    touch = np.hypot(1 - 0.8**2, 0.08)
    stop = f"side='both', stiffness={stiffness}, damping={damping}, separation='zero_force'"
    load = f"amplitude={touch}, angular_frequency=0.8"
    followed = f"parameter='load%amplitude', first={3 * touch}, last={0.8 * touch}, doublings=0"
    with oscillator(stop, load, followed) as file:
        ends = [labels(file, branch)[-1] for branch in (1, 2, 3)]
        assert file["point/branch"][:].max() == 3
    assert [label for label, _ in ends] == ["GR", "GR", "EP"]
    assert [at for _, at in ends] == pytest.approx([touch, touch, 0.8 * touch], rel=1e-11)
