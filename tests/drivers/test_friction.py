"""Friction in scenes of all kinds: the same block as a point and as a body, and rubbing rotors against closed forms."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from branches import follow, labels
from programs import SOURCE, start, succeed
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

INPUTS = SOURCE / "inputs"
MOTION = "&motion t_end=0.6, start='given', integrator='dop853' /\n"
RECORD = "&record observable='state', what='trajectory', interval=0.01 /\n"
SLIP = "static_coefficient=0.5, kinetic_coefficient=0.4"
ROTOR = """
&scene kind='rotor' /
&shaft name='rotor', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0 /
&section shaft='rotor', length=0.4, outer_diameter=0.04, elements=2 /
&disk shaft='rotor', node=2, mass=2.0, polar_inertia=2.5e-3, diametral_inertia=1.25e-3 /
&bearing shaft='rotor', node=1, kind='matrix', stiffness=1e6,1e6,1e6,0,0,0 /
&bearing shaft='rotor', node=3, kind='matrix', stiffness=0,1e6,1e6,0,0,0 /
&rotation speed_rpm=3000.0 /
&motion t_end=0.02, start='zero', integrator='dop853', relative_tolerance=1e-11, absolute_tolerance=1e-15 /
"""


def run(path, text):
    path.write_text(text)
    succeed("razy-run", path)
    return h5py.File(path.with_suffix(".h5").name)


def test_block_moves_as_a_body_as_it_does_as_a_point(tmp_path):
    # Pressed by its weight through a stop, and pushed off it at first so that the normal force varies.
    lumped = (
        "&scene kind='lumped' /\n&mass name='x', value=2.0 /\n&mass name='y', value=2.0 /\n"
        "&stop name='floor', between='y','frame', side='lower', clearance=0.0, stiffness=1e5, damping=50.0 /\n"
        f"&friction name='slip', between='x','frame', normal_contact='floor', {SLIP} /\n"
        "&load on='x', value=-5.0 /\n&load on='y', value=-18.0 /\n"
        "&initial on='x', velocity=2.0 /\n&initial on='y', velocity=-0.1 /\n"
    )
    planar = (
        "&scene kind='planar' /\n&body name='block', mass=2.0, inertia=0.02 /\n"
        "&stop name='floor', between='block','frame', direction=0,1, clearance=0.0, stiffness=1e5, damping=50.0 /\n"
        f"&friction name='slip', between='block','frame', normal_contact='floor', {SLIP} /\n"
        "&load on='block.x', value=-5.0 /\n&load on='block.y', value=-18.0 /\n"
        "&initial on='block.x', velocity=2.0 /\n&initial on='block.y', velocity=-0.1 /\n"
    )
    with (
        run(tmp_path / "point.nml", lumped + MOTION + RECORD) as a,
        run(tmp_path / "body.nml", planar + MOTION + RECORD) as b,
    ):
        point, body = a["state/displacement"][:], b["state/displacement"][:]
        assert a["event/state"][:].tolist() == b["event/state"][:].tolist()
    # The third coordinate, which rests, only changes the order of sums.
    assert np.abs(point - body[:, :2]).max() <= 1e-13 * np.abs(point).max()
    assert not body[:, 2].any()


@pytest.mark.parametrize("method", ["exact", "dop853", "radau5", "moreau_jean"])
def test_a_body_at_the_limit_of_its_friction_rests(method, tmp_path):
    # 0.3 * 9.81 is less than 2.943 by rounding: by time steps the body slid, with the kinetic coefficient from then on.
    text = (
        "&scene kind='lumped' /\n&mass name='m', value=1.0 /\n&load on='m', value=2.943 /\n"
        "&friction name='f', between='m','frame', static_coefficient=0.3, kinetic_coefficient=0.2, normal_load=9.81 /\n"
        f"&motion t_end=2.0, start='zero', integrator='{method}'{', step=1e-3' * (method == 'moreau_jean')} /\n"
    )
    with run(tmp_path / "rests.nml", text + RECORD) as file:
        assert file["outcome/events"][0] == 0
        assert abs(file["state/displacement"][:]).max() <= 1e-15


@pytest.mark.parametrize("method", ["exact", "dop853", "radau5", "moreau_jean"])
def test_a_clutch_at_its_limit_holds(method, tmp_path):
    # 10 N on the first of two equal bodies: 5 N go through the clutch, as much as it holds, and both move 10 m.
    text = (
        "&scene kind='lumped' /\n&mass name='a', value=1.0 /\n&mass name='b', value=1.0 /\n&load on='a', value=10.0 /\n"
        "&friction name='f', between='a','b', static_coefficient=0.5, kinetic_coefficient=0.4, normal_load=10.0 /\n"
        f"&motion t_end=2.0, start='zero', integrator='{method}'{', step=1e-5' * (method == 'moreau_jean')} /\n"
    )
    # Not the state: in coordinates that contacts feel the product of normal load and coefficient rounds otherwise.
    text += "".join(f"&record observable='displacement', of='{x}', what='trajectory', interval=2.0 /\n" for x in "ab")
    with run(tmp_path / "clutch.nml", text) as file:
        assert [file[f"observable/displacement.{x}"][-1] for x in "ab"] == pytest.approx([10.0, 10.0], rel=1e-9)


@pytest.mark.parametrize("step, error", [(1e-4, 1e-2), (1e-5, 1e-3)])
def test_friction_that_turns_round_may_stick(step, error, tmp_path):
    # In the step in which it turns it was held by no more than the kinetic coefficient: by the step a body stuck or
    # did not, and results came to none as steps became shorter (27 % off with 1e-5 s).
    grip = "static_coefficient=0.4, kinetic_coefficient=0.2, normal_load=10.0"
    text = (
        "&scene kind='lumped' /\n&mass name='a', value=1.0 /\n&mass name='b', value=1.0 /\n"
        "&spring between='a','b', stiffness=100.0 /\n&load on='a', amplitude=10.0, angular_frequency=5.0 /\n"
        f"&friction name='fa', between='a','frame', {grip} /\n"
        f"&friction name='fb', between='b','frame', {grip} /\n"
    )
    motion = "&motion t_end=5.0, start='zero', integrator="
    with run(tmp_path / "exact.nml", text + motion + "'exact' /\n" + RECORD) as file:
        right = file["state/displacement"][-1]
    with run(tmp_path / "steps.nml", f"{text}{motion}'moreau_jean', step={step} /\n{RECORD}") as file:
        assert file["state/displacement"][-1] == pytest.approx(right, rel=error)


def test_feet_of_a_block_share_the_friction(tmp_path):
    # While both feet slide, m x'' = -g_x m - mu N and I phi'' = -h mu N + a (N_front - N_rear): at rest in y and phi
    # the sum of both normal forces is m g_y, and the front foot carries (m g_y + mu h/a m g_y)/2.
    succeed("razy-run", INPUTS / "planar_incline.nml")
    with h5py.File("planar_incline.h5") as file:
        time, x = file["time"][:], file["state/displacement"][:, 0]
        phi, velocity = file["state/displacement"][:, 2], file["state/velocity"][:, 0]
        front = file["observable/contact_force.front_foot"][:]
    weight, mu = 9.81 * 0.93969262, 0.4
    slides = (time > 0.2) & (velocity > 0.05)
    settled = np.abs(np.diff(front[slides])).max() / weight
    assert settled < 1e-3
    assert front[slides].mean() == pytest.approx(weight * (1 + mu * 0.05 / 0.1) / 2, rel=1e-3)
    assert phi[slides].mean() == pytest.approx(-mu * weight * 0.05 / (2 * 0.1**2 * 1e5), rel=1e-3)
    slope = np.polyfit(time[slides], velocity[slides], 1)[0]
    assert slope == pytest.approx(-9.81 * 0.34202014 - mu * weight, rel=1e-4)
    assert np.ptp(x[time > 0.5]) < 1e-9


def test_rubbing_is_a_constant_force_and_moment(tmp_path):
    # Under a given normal force N the rim slides backward all the time: -(mu N) acts as loads would.
    friction = (
        "&friction name='rub', between='rotor.2','frame', direction=0,0,1, radius=0.05, normal_load=400.0, "
        "static_coefficient=0.25 /\n"
    )
    loads = "&load on='rotor.2.w', value=100.0 /\n&load on='rotor.2.phi', value=-5.0 /\n"
    with (
        run(tmp_path / "rub.nml", ROTOR + friction + RECORD) as a,
        run(tmp_path / "load.nml", ROTOR + loads + RECORD) as b,
    ):
        rub, load = a["state/displacement"][-1], b["state/displacement"][-1]
        velocity, names = a["state/velocity"][-1], a["state/coordinate"].asstr()[:]
    assert np.abs(rub - load).max() < 1e-9 * np.abs(load).max()
    # The angular momentum of a free shaft about its axis, J/4 (1, 2, 1) at the nodes and the disk, falls by
    # R mu N a second.
    shaft = 7850.0 * 0.4 * np.pi * 0.04**4 / 32
    spin = velocity[[i for i, name in enumerate(names) if name.endswith("phi")]]
    assert len(spin) == 3
    momentum = shaft / 4 * (spin[0] + 2 * spin[1] + spin[2]) + 2.5e-3 * spin[1]
    assert momentum == pytest.approx(-0.05 * 100.0 * 0.02, rel=1e-9)


def test_rub_force_follows_the_stator(tmp_path):
    succeed("razy-run", INPUTS / "rotor_rub.nml")
    with h5py.File("rotor_rub.h5") as file:
        stator, rub = file["observable/contact_force.stator"][:], file["observable/contact_force.rub"][:]
        speed, v = file["observable/sliding_velocity.rub"][:], file["observable/displacement.rotor.3.v"][:]
    assert stator.max() > 100
    # The rim, 31.4 m/s, is faster than any motion of the disk, and slides backward along t = e_x x n.
    assert speed.max() < -10
    assert np.abs(rub + 0.2 * np.maximum(stator, 0)).max() < 1e-12 * stator.max()
    closed = v > 1.0e-4
    assert (stator[~closed] == 0).all() and closed.any()


def test_rub_in_closed_form(tmp_path):
    for method in ("exact", "dop853"):
        tight = ["motion%relative_tolerance=1e-12", "motion%absolute_tolerance=1e-14"] if method == "dop853" else []
        options = [word for item in (f"motion%integrator='{method}'", *tight) for word in ("--set", item)]
        succeed("razy-run", INPUTS / "rotor_rub.nml", "--output", f"{method}.h5", *options)
    with h5py.File("exact.h5") as exact, h5py.File("dop853.h5") as steps:
        assert len(exact["event/time"]) == len(steps["event/time"]) > 50
        assert exact["event/time"][:] == pytest.approx(steps["event/time"][:], abs=1e-12)
        for name in ("contact_force.stator", "contact_force.rub", "displacement.rotor.3.v"):
            x, y = exact[f"observable/{name}"][:], steps[f"observable/{name}"][:]
            assert np.abs(x - y).max() < 1e-10 * np.abs(y).max(), name


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("'rotor.3','frame', normal", "'rotor.9','frame', normal", "a node from 1 to 5"),
        ("'rotor.3','frame', normal", "'rotor','frame', normal", "shaft and node, such as 'rotor.1'"),
        ("'rotor.3','frame', normal", "'rotor.3','rotor.4', normal", "nodes of two different shafts"),
        ("'rotor.3','frame', normal", "'frame','frame', normal", "nodes of two different shafts"),
        ("direction=0.0,-1.0,0.0", "direction=0.0,0.0,0.0", "3 numbers that are not all zero"),
        ("direction=0.0,-1.0,0.0, ", "", "&stop direction: required, such as 0.0, 0.0, 1.0 for z, or twist"),
        ("direction=0.0,-1.0,0.0", "direction=1.0,0.0,0.0", "where no stop across the axis gives it"),
        ("normal_contact='stator'", "normal_contact='stater'", "did you mean 'stator'?"),
        ("normal_contact='stator'", "normal_load=1.0", "where no stop across the axis gives it"),
    ],
)
def test_mistakes_of_rubbing_rotors(tmp_path, old, new, message):
    text = (INPUTS / "rotor_rub.nml").read_text()
    assert text.count(old) == 1
    path = tmp_path / "case.nml"
    path.write_text(text.replace(old, new))
    done = start("razy-run", path)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("viscous", [0.0, 0.4])
def test_sliding_to_rest_under_stribecks_friction(tmp_path, viscous):
    """With e^(δv) the equation v' = -g μ(v) is linear where nothing is viscous; without Stribeck's part it is in v."""
    gravity, static, kinetic, decay, start_at = 9.81, 0.5, 0.3, 2.0, 1.5
    text = f"""&scene kind='lumped' /
&mass name='m', value=2.0 /
&friction name='f', between='m','frame', normal_load={2 * gravity!r}, static_coefficient={static}, decay={decay},
          decay_law='exponential', kinetic_coefficient={static if viscous else kinetic}, viscous_coefficient={viscous} /
&initial on='m', velocity={start_at} /
&motion t_end=0.6, start='given', integrator='dop853', relative_tolerance=1e-13, absolute_tolerance=1e-16 /
&record observable='velocity', of='m', what='trajectory', interval=0.05 /
"""
    with run(tmp_path / "slide.nml", text) as file:
        v = np.ravel(file["observable/velocity.m"][()])
    t = 0.05 * np.arange(len(v))
    if viscous:
        expected = (start_at + static / viscous) * np.exp(-gravity * viscous * t) - static / viscous
    else:
        c = (static - kinetic) / kinetic
        expected = (
            np.log(np.maximum((np.exp(decay * start_at) + c) * np.exp(-kinetic * gravity * decay * t) - c, 1.0)) / decay
        )
    expected = np.maximum(expected, 0.0)
    assert expected[-1] == 0.0 < expected[3]
    np.testing.assert_allclose(v, expected, atol=1e-9)


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_friction_that_depends_on_the_direction_lets_a_shaken_body_walk(tmp_path, method):
    """Coefficients 0.2 forward and 0.5 backward under 10 N: their mean, and half of their difference as a load."""
    forward, backward, normal, force = 0.2, 0.5, 10.0, 4.0
    text = f"""&mass name='m', value=1.0 /
&friction name='f', between='m','frame', normal_load={normal}, static_coefficient={(forward + backward) / 2!r} /
&load on='m', value={(backward - forward) / 2 * normal!r}, amplitude={force}, angular_frequency=1.0 /
&motion t_end={16 * np.pi!r}, start='zero', integrator='{method}', relative_tolerance=1e-12, absolute_tolerance=1e-14 /
&record observable='displacement', of='m', what='trajectory', interval={2 * np.pi!r} /
"""
    with run(tmp_path / "walk.nml", text) as file:
        x, time = np.ravel(file["observable/displacement.m"][()]), file["event/time"][()]
    slides = np.arcsin(forward * normal / force)
    stops = brentq(
        lambda t: force * (np.cos(slides) - np.cos(t)) - forward * normal * (t - slides),
        np.pi / 2,
        2 * np.pi,
        xtol=1e-15,
    )
    step = (
        force * (np.cos(slides) * (stops - slides) - np.sin(stops) + np.sin(slides))
        - forward * normal * (stops - slides) ** 2 / 2
    )
    np.testing.assert_allclose(x[: 8 + 1], step * np.arange(9), rtol=0, atol=1e-10)
    expected = np.sort(np.concatenate((slides + 2 * np.pi * np.arange(8), stops + 2 * np.pi * np.arange(8))))
    np.testing.assert_allclose(time, expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize(
    ("push", "method", "error"),
    [
        (0.0, "'exact'", 1e-12),
        (0.1, "'exact'", 1e-12),
        (0.0, "'dop853'", 1e-12),
        (0.0, "'moreau_jean', step=1e-3", 2e-3),
    ],
)
def test_what_nothing_presses_does_not_stick(tmp_path, push, method, error):
    """A body on the floor sticks until 0.5 (1 - 2 sin(pi t/6)) falls to what pushes it, or it is lifted."""
    path = tmp_path / "lifted.nml"
    path.write_text(f"""
&scene kind='planar' /
&body name='body', mass=1.0, inertia=1.0 /
&stop name='floor', between='body','frame', direction=0,1, law='rigid', restitution=0.0 /
&friction name='sole', between='body','frame', direction=1,0, normal_contact='floor', static_coefficient=0.5 /
&load on='body.x', value={push} /
&load on='body.y', value=-1.0 /
&load on='body.y', amplitude=2.0, angular_frequency={np.pi / 6!r} /
&motion t_end=2.0, start='zero', integrator={method} /
&record observable='contact_force', of='all', what='statistics' /
""")
    succeed("razy-run", path, "--output", tmp_path / "lifted.h5")
    with h5py.File(tmp_path / "lifted.h5") as file:
        sticks = np.arcsin(0.5 - push) * 3 / np.pi
        assert abs(file["contact/sole/sticking_share"][()] - sticks) < error
        assert abs(file["contact/floor/closed_share"][()] - 0.5) < error


def test_jerks_of_a_machine_table_beside_scipy(tmp_path):
    """The table slides until it has the speed of the ways, and sticks until the spring has the static friction."""
    with run(tmp_path / "stribeck.nml", (SOURCE / "inputs" / "stribeck.nml").read_text()) as file:
        found, events = np.ravel(file["observable/displacement"][()]), file["event/time"][()]
        at = file["observable/time"][()]
    mass, k, b, normal, belt = 80.0, 2e6, 400.0, 800.0, 5e-3

    def rate(t, z):
        v = max(belt - z[1], 0.0)
        push = normal * (0.1 + 0.1 * np.exp(-200.0 * v) + 0.5 * v)
        return [z[1], (push - k * z[0] - b * z[1]) / mass]

    def sticks(t, z):
        return belt - z[1]

    sticks.terminal, sticks.direction = True, -1
    t, z, right, times = 0.0, np.zeros(2), np.zeros_like(at), []
    while t < 1.0:
        part = solve_ivp(rate, (t, 1.0), z, "DOP853", rtol=1e-12, atol=1e-16, events=sticks, dense_output=True)
        inside = (at >= t) & (at <= part.t[-1])
        right[inside] = part.sol(at[inside])[0]
        t, z = part.t[-1], part.y[:, -1]
        if part.status == 1:
            leaves = t + ((0.2 * normal - b * belt) / k - z[0]) / belt
            times += [t, leaves]
            inside = (at >= t) & (at <= leaves)
            right[inside] = z[0] + belt * (at[inside] - t)
            # It leaves with no acceleration; a push of one part in 1e9 parts the two.
            t, z = leaves, np.array([z[0] + belt * (leaves - t), belt])
            z[1] -= 1e-9 * belt
    assert len(times) > 30
    np.testing.assert_allclose(events, [time for time in times if time <= 1.0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(found, right, rtol=0, atol=1e-5 * abs(right).max())


SLIDER_BESIDE_A_ROW = """&mass name='slider', value=0.5 /
&mass name='b1', value=3.0 /
&mass name='b2', value=1.0 /
&mass name='b3', value=3.0 /
&stop name='s1', between='b1','slider', side='lower', clearance=0.5, law='rigid', restitution=1.0 /
&stop name='s2', between='b2','b1', side='lower', clearance=0.5, law='rigid', restitution=1.0 /
&stop name='s3', between='b3','b2', side='lower', clearance=0.0, law='rigid', restitution=1.0 /
&stop name='s4', between='b3','frame', side='upper', clearance=0.0, law='rigid', restitution=1.0 /
&friction name='pad', between='slider','frame', static_coefficient=0.5, normal_load=1.0 /
&load on='b3', value=2.0 /
&initial on='slider', velocity=-0.5 /
&initial on='b1', velocity=-0.5 /
&initial on='b2', velocity=2.0 /
&motion t_end=0.75, start='given', impacts='in_turn', integrator='exact' /
&record observable='displacement', of='slider', what='trajectory', interval=0.25 /
"""


def test_a_slider_stops_where_a_step_of_the_search_ends(tmp_path):
    """Its speed is a rounding beyond 0 there, at 0.5 s: it stopped at 0.25 s, with half of its speed."""
    (tmp_path / "row.nml").write_text(SLIDER_BESIDE_A_ROW)
    succeed("razy-run", tmp_path / "row.nml", "--output", tmp_path / "row.h5")
    with h5py.File(tmp_path / "row.h5") as file:
        assert file["observable/displacement.slider"][:] == pytest.approx([0.0, -0.09375, -0.125, -0.125], rel=1e-12)


def test_smoothing_knows_a_pad_that_acts_with_its_stop(folder):
    """Without the pad, or with one that rubs all the time, the body would be elsewhere by a tenth of its way."""
    case = INPUTS / "thesis" / "fig_3_5_friction.nml"
    smooth = (
        "--set",
        "motion%integrator='dop853'",
        "--set",
        "motion%treatment='smoothing'",
        "--set",
        "motion%sharpness=1e6",
    )
    paths = []
    for more in ((), smooth):
        succeed("razy-run", case, "--set", "motion%t_end=10", "--output", "case.h5", "--force", *more)
        with h5py.File("case.h5") as file:
            paths.append(file["state/displacement"][:, 0])
    assert np.abs(paths[1] - paths[0]).max() < 0.02 * np.abs(paths[0]).max()


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_a_stop_that_pulls_presses_as_it_does_when_it_pushes(folder, integrator):
    """A body leaves a damped stop where it touched it: from F = 0 on it is pulled, and |F| rubs all the time."""
    mass, k, b, speed, mu = 2.0, 1.0e4, 150.0, 0.1, 0.3
    (folder / "case.nml").write_text(
        f"&mass name='x', value=1.0 /\n&mass name='y', value={mass} /\n"
        f"&stop name='floor', between='y','frame', side='lower', stiffness={k}, damping={b},"
        " separation='zero_deformation' /\n"
        f"&friction name='slip', between='x','frame', normal_contact='floor', static_coefficient={mu} /\n"
        f"&initial on='x', velocity=1.0 /\n&initial on='y', velocity=-{speed} /\n"
        f"&motion t_end=0.1, start='given', integrator='{integrator}', relative_tolerance=1e-12,"
        " absolute_tolerance=1e-14 /\n"
        "&record observable='velocity', of='x', what='trajectory', interval=0.1 /\n"
    )
    succeed("razy-run", "case.nml")
    with h5py.File("case.h5") as file:
        found = file["observable/velocity.x"][-1]
    decay, omega = b / (2 * mass), np.sqrt(k / mass - (b / (2 * mass)) ** 2)

    def deformation(t):
        return speed / omega * np.exp(-decay * t) * np.sin(omega * t)

    def rate(t):
        return speed * np.exp(-decay * t) * (np.cos(omega * t) - decay / omega * np.sin(omega * t))

    zero = brentq(lambda t: k * deformation(t) + b * rate(t), 0.5 * np.pi / omega, np.pi / omega)
    # Impulses are the changes of the speed, pushed until F = 0 and pulled back after it.
    pushed, pulled = -(rate(zero) - speed) * mass, (rate(np.pi / omega) - rate(zero)) * mass
    assert pulled > 0.05 * pushed
    assert found == pytest.approx(1.0 - mu * (pushed + pulled), abs=1e-10)


@pytest.mark.parametrize("method", ["exact", "dop853"])
@pytest.mark.parametrize("amplitude", [0.7, 3.3, 5.0])
def test_a_load_that_just_comes_to_the_limit_moves_nothing(folder, method, amplitude):
    """It comes there as its rise ends: what the force does beyond a break is not what it does before."""
    text = "&scene kind='lumped' /\n&mass name='a', value=2.0 /\n"
    text += "&friction name='f', between='a','frame', static_coefficient=0.5, kinetic_coefficient=0.3, "
    text += f"normal_load={2 * amplitude} /\n"
    text += f"&load on='a', shape='pulse', amplitude={amplitude}, duration=1.3, rise=0.4, delay=0.2 /\n"
    text += f"&motion t_end=20.0, start='zero', integrator='{method}' /\n"
    text += "&record observable='displacement', of='a', what='extrema' /\n"
    (folder / "pulse.nml").write_text(text)
    assert "\n0 events" in "\n" + succeed("razy-run", "pulse.nml").stdout


def test_where_a_damper_begins_to_slip():
    """A body that friction holds all the time: beyond the load at which it slides there is no motion beside."""
    stiffness, damping = 2.0, 0.3
    text = "&mass name='m', value=1.0 /\n&mass name='held', value=1.0 /\n"
    text += f"&spring between='m','held', stiffness={stiffness}, damping={damping} /\n"
    text += "&spring between='held','frame', stiffness=1.0 /\n"
    text += "&friction name='damper', between='held','frame', static_coefficient=0.5, normal_load=1.0 /\n"
    text += "&load on='m', value=0.1, amplitude=0.02, angular_frequency=1.0 /\n&motion t_end=500.0, start='zero' /\n"
    text += "&record observable='displacement', of='m', what='extrema' /\n"
    text += "&follow parameter='load%amplitude', first=0.02, last=1.0, sensitivities='mass(1)%value' /\n"
    Path("damper.nml").write_text(text + "&follow parameter='load%angular_frequency', first=0.8, last=1.8 /\n")

    def slips(speed, mass=1.0):
        """The load at which the force of spring and damper comes to what the constant one leaves of friction."""
        return 0.4 * abs((stiffness - mass * speed**2 + 1j * damping * speed) / (stiffness + 1j * damping * speed))

    with follow(Path("damper.nml")) as file:
        assert labels(file, 1) == [("SL", pytest.approx(slips(1.0), rel=1e-10))]
        slope = file["sensitivity/mass(1).value"][0]
        curve = file["curve_point"]
        speed, load = curve["load.angular_frequency"][:], curve["load.amplitude"][:]
    assert slope == pytest.approx((slips(1.0, 1 + 1e-5) - slips(1.0, 1 - 1e-5)) / 2e-5, rel=1e-6)
    assert min(speed) == pytest.approx(0.8)
    assert max(speed) == pytest.approx(1.8)
    assert load == pytest.approx(slips(speed), rel=1e-9)
