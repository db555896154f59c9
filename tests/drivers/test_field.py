"""Machines that people asked about in public, `inputs/field`: each beside its right value."""

import shutil

import numpy as np
import pytest
import woodpecker
from branches import follow, points
from programs import SOURCE, run
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, fsolve

FIELD = SOURCE / "inputs" / "field"


def test_a_thrown_ball_comes_to_rest_on_the_floor(folder):
    found = run(FIELD / "thrown_ball.nml")
    end = {name.decode(): i for i, name in enumerate(found["state/coordinate"])}
    x, v = found["state/displacement"][-1], found["state/velocity"][-1]
    assert [x[end["ball.x"]], x[end["ball.y"]]] == pytest.approx([2.0, -1.0], rel=1e-12)
    assert [v[end["ball.x"]], v[end["ball.y"]]] == pytest.approx([1.0, 0.0], abs=1e-12)


def test_a_ball_never_falls_through_the_floor(folder):
    found = run(FIELD / "ball_for_ever.nml")
    fall = np.sqrt(2 * 50.0 / 9.8)
    value, kind, time = (found[f"extrema/displacement.ball/{name}"] for name in ("value", "kind", "time"))
    assert time[kind == -1] == pytest.approx((2 * np.arange(1, 79) - 1) * fall, rel=1e-12)
    assert value[kind == 1] == pytest.approx(50.0, rel=1e-12)


def test_a_box_brakes_and_stays(folder):
    found = run(FIELD / "braking_box.nml")
    assert found["event/time"] == pytest.approx([10.0 / (0.3 * 9.8)], rel=1e-13)
    assert found["state/displacement"][-50:] == pytest.approx(100.0 / (2 * 0.3 * 9.8), rel=1e-13)
    assert np.all(found["state/velocity"][-50:] == 0.0)


def test_dry_friction_has_the_amplitude_of_den_hartog(folder):
    for ratio in (0.7, 0.8, 1.3):
        case = ("--set", f"load%angular_frequency={ratio}")
        found = run(FIELD / "den_hartog.nml", *case)["extrema/displacement.body/value"]
        v, u = 1 / (1 - ratio**2), np.sin(np.pi / ratio) / (ratio * (1 + np.cos(np.pi / ratio)))
        assert np.abs(found) == pytest.approx(np.sqrt(v**2 - (0.3 * u) ** 2), rel=1e-9), ratio


def test_a_shaft_hangs_through_under_its_weight(folder):
    found = np.ravel(run(FIELD / "shaft_weight.nml")["observable/displacement.shaft.5.v"])
    area, inertia, nu = np.pi * 0.05**2 / 4, np.pi * 0.05**4 / 64, 2.1e11 / (2 * 8.0e10) - 1
    weight, shear = 7850.0 * area * 9.81, 6 * (1 + nu) / (7 + 6 * nu) * 8.0e10 * area
    sag = 5 * weight * 2.0**4 / (384 * 2.1e11 * inertia) + weight * 2.0**2 / (8 * shear)
    assert found == pytest.approx(-sag, rel=1e-9)


def test_a_pulled_block_slips_when_it_must(folder):
    found = run(FIELD / "pulled_block.nml")
    slips = found["event/time"][::2]
    assert slips[0] == pytest.approx(0.73575, rel=1e-12)
    assert np.diff(slips) == pytest.approx(0.6676913710791837, rel=1e-11)
    assert found["event/time"][1::2] - slips[: len(found["event/time"][1::2])] == pytest.approx(0.1771913710791838)


def test_two_velocities_become_one(folder):
    found = run(FIELD / "two_velocities.nml")
    assert found["event/time"] == pytest.approx([1 / 7], rel=1e-13)
    assert found["state/velocity"][-1] == pytest.approx([31 / 34, 31 / 34], rel=1e-13)


def test_two_masses_rub_for_a_long_time(folder):
    assert run(FIELD / "two_masses_rub.nml")["outcome/events"] == 107


def test_a_block_on_a_shaken_table_slides_as_fast_as_it_must(folder):
    """It slides from where 5 sin(10 t) is 0.3 g, and is fastest where that falls to 0.3 g again."""
    found = run(FIELD / "shaken_table.nml")["extrema/velocity.block/value"]
    first = np.arcsin(0.3 * 9.81 / 5.0)
    largest = 0.5 * 2 * np.cos(first) - 0.3 * 9.81 * (np.pi - 2 * first) / 10.0
    assert np.max(found) == pytest.approx(largest, rel=1e-11)
    assert np.min(found) == pytest.approx(-largest, rel=1e-11)


def test_a_shaft_with_play_beside_scipy(folder):
    found = run(FIELD / "shaft_with_play.nml")
    half = 0.0017453292519943296

    def derivative(t, z):
        s, rate = z[0] - z[1], z[2] - z[3]
        torque = np.sign(s) * max(500.0 * (abs(s) - half) + 0.8 * np.sign(s) * rate, 0.0) if abs(s) > half else 0.0
        return [z[2], z[3], (1.0 + 2.0 * np.sin(6 * np.pi * t) - torque) / 0.01, (torque - 0.1 * z[3]) / 0.05]

    right = solve_ivp(derivative, (0.0, 3.0), np.zeros(4), rtol=1e-9, atol=1e-12, max_step=1e-4).y[:, -1]
    end = np.concatenate([found["state/displacement"][-1], found["state/velocity"][-1]])
    np.testing.assert_allclose(end, right, atol=1e-6 * np.max(np.abs(right)))


@pytest.mark.parametrize(
    ("name", "label", "right"),
    [
        ("clearance_jumps", "GR", [1.407088466023, 0.820631087712]),
        ("clearance_jumps", "LP", [0.7080316187218, 0.8284639843882]),
        ("cubic_folds", "LP", [1.10337783769, 1.10015503508]),
    ],
)
def test_resonances_jump_where_they_must(folder, name, label, right):
    case = folder / f"{name}.nml"
    shutil.copy(FIELD / case.name, case)
    with follow(case, "--force") as file:
        found = points(file, label)
    for value in right:
        assert np.min(np.abs(found - value)) < 1e-10 * value, found


def test_a_follower_leaves_its_cam(folder):
    limit = np.sqrt((1430.8 + 100.0 / 0.02) / 1.221)
    assert points(follow(FIELD / "cam.nml"), "CH") == pytest.approx([limit], rel=1e-11)
    for speed, events in ((0.99 * limit, 0), (1.01 * limit, 100)):
        found = run(FIELD / "cam.nml", "--set", f"stop%motion_angular_frequency={speed}")
        assert np.sum(found["event/time"] > 10.0) >= events if events else found["event/time"].max() < 10.0


@pytest.mark.parametrize("method", ["exact", "dop853", "radau5"])
def test_a_bit_is_driven(folder, method):
    found = run(FIELD / "hammer.nml", "--set", f"motion%integrator={method}")
    assert found["observable/displacement.bit"][-1] == pytest.approx(1.85453525, abs=1e-8)


def test_a_block_rocks_as_housner_says(folder):
    """Half the width b, half the height h: the moment of the weight is m g (b - h phi) about the edge."""
    found = run(FIELD / "rocking_block.nml")
    inertia = 0.08666666666666667 + 0.26
    rate, kept = np.sqrt(9.81 * 0.5 / inertia), 1 - 2 * 0.1**2 / inertia
    share, time, times, turned = 0.5, np.arccosh(2.0) / np.sqrt(9.81 * 0.5 / inertia), [], []
    for _ in range(9):
        times.append(time)
        share = 1 - np.sqrt(1 - kept**2 * (1 - (1 - share) ** 2))
        turned.append(0.2 * share)
        time += 2 * np.arccosh(1 / (1 - share)) / rate
    assert found["event/time"] == pytest.approx(np.repeat(times, 4), rel=1e-11)
    kind, value = (found[f"extrema/displacement.block.phi/{name}"] for name in ("kind", "value"))
    assert np.abs(value[kind != 0][:8]) == pytest.approx(turned[:8], rel=1e-11)


def test_the_last_ball_of_a_cradle_leaves(folder):
    found = run(FIELD / "cradle.nml")
    assert found["state/velocity"][-1] == pytest.approx([0.0, 0.0, 0.0, 0.0, 1.0], abs=1e-14)
    assert found["event/time"] == pytest.approx(0.01 + 1e-6 * np.arange(1, 5), rel=1e-12)
    found = run(FIELD / "cradle.nml", *(f"--set=stop({i})%clearance=0.0" for i in range(1, 5)))
    assert found["state/velocity"][-1] == pytest.approx([-0.6, 0.4, 0.4, 0.4, 0.4], abs=1e-14)


def test_a_woodpecker_pecks_beside_an_independent_code(folder):
    """Its sleeve jams, sticks and slides on the bar; each state of its contacts is found by trying them all."""
    found = run(FIELD / "woodpecker.nml", "--set", "motion%t_end=0.3")
    moved = np.hstack([found["state/displacement"], found["state/velocity"]])
    begun = [0.0, -0.0006 / 0.0058, -0.2788, -0.3411, 0.0, -7.4583]
    right, events = woodpecker.follow(begun, found["state/time"])
    assert len(events) > 15
    assert moved == pytest.approx(right, rel=0, abs=1e-10 * np.abs(right).max())
    seen = np.unique(found["event/time"])
    assert all(np.abs(seen - time).min() < 1e-12 for time in events if time < 0.299)


def test_buildings_pound(folder):
    (folder / "inputs" / "field").mkdir(parents=True)
    shutil.copy(FIELD / "ground.csv", folder / "inputs" / "field")
    found = run(FIELD / "pounding.nml")
    times, ground = np.loadtxt(FIELD / "ground.csv", delimiter=",", skiprows=1).T
    times, ground = np.append(times, 10.0), np.append(ground, 0.0)
    stiffness, damping, mass = np.array([4.5e6, 7.0e5]), np.array([3.5e4, 1.3e4]), np.array([3.0e4, 2.5e4])

    def gap(_, z):
        return 0.02 - z[0] + z[1]

    gap.terminal, gap.direction = True, -1.0
    z, hits = np.zeros(4), []
    for k in range(times.size - 1):
        t, slope = times[k], (ground[k + 1] - ground[k]) / (times[k + 1] - times[k])

        def field(t, z, k=k, slope=slope):
            a = ground[k] + slope * (t - times[k])
            return np.concatenate([z[2:], -(stiffness * z[:2] + damping * z[2:]) / mass - a])

        while t < times[k + 1]:
            part = solve_ivp(field, (t, times[k + 1]), z, "DOP853", events=gap, rtol=1e-12, atol=1e-15)
            t, z = part.t[-1], part.y[:, -1]
            if part.status == 1:
                hits.append(t)
                mean = mass @ z[2:] / mass.sum()
                z[2:] = mean + 0.65 * (mean - z[2:])
    assert found["event/time"] == pytest.approx(hits, rel=1e-9) and len(hits) == 11
    end = np.concatenate([found["state/displacement"][-1], found["state/velocity"][-1]])
    assert end == pytest.approx(z, abs=1e-9)


def test_a_body_is_held_at_walls(folder):
    found = run(FIELD / "held_at_walls.nml")
    flight = np.sqrt(2 * 1.2 / 1.5)
    turns = 2.0 * np.arange(1, 20)
    impacts = np.array([np.abs(found["event/time"] - time).min() for time in turns + flight])
    assert impacts.max() < 1e-13 * 40
    speed = np.abs(found["extrema/velocity/value"])
    assert speed.max() == pytest.approx(1.5 * flight, rel=1e-13)
    assert np.abs(found["extrema/contact_force.walls/value"]).max() == pytest.approx(3.0, rel=1e-13)


def test_a_clutch_of_three_stages_comes_to_rest(folder):
    """Each swing ends where the springs have stored what they had, less the work of friction."""
    found = run(FIELD / "clutch.nml")["extrema/displacement/value"]

    def torque(q):
        return np.interp(q, [-0.5, -0.25, -0.05, 0.05, 0.25, 0.5], [-240, -90, -10, 10, 90, 240])

    def energy(q):
        a, total = abs(q), 0.0
        for low, high in ((0.0, 0.05), (0.05, 0.25), (0.25, 0.5)):
            end = min(a, high)
            if end > low:
                total += (end - low) * (torque(low) + torque(end)) / 2
        return total

    right, q = [0.45], 0.45
    while torque(q) > 6.0:
        # Beyond 0.03 rad, where the springs are as strong as friction, the body gets faster.
        end = brentq(lambda x, q=q: energy(q) - energy(x) - 6.0 * (q - x), -q, 0.03, xtol=1e-15)
        right.append(np.sign(right[-1]) * end)
        q = abs(end)
    assert len(right) > 5
    assert found[: len(right) - 1] == pytest.approx(right[1:], rel=1e-11)


def mesh_motion(t_end, static, k, error, damping, backlash, push):
    """Return d + e of d'' = push - (k(t) g(d + e) + c (d' + e'))/2, the wheels' masses being 3 and 6 kg."""

    def rate(t, z):
        x, v = z[0] + error(t)[0], z[1] + error(t)[1]
        return [z[1], push - (k(t) * (x - np.clip(x, -backlash, 0.0)) + damping * v) / 2]

    touch = [lambda t, z, at=at: z[0] + error(t)[0] + at for at in (0.0, backlash)]
    for event in touch:
        event.terminal = True
    t, z, pieces = 0.0, np.array([static, 0.0]), []
    while t < t_end:
        piece = solve_ivp(rate, (t, t_end), z, "DOP853", rtol=1e-12, atol=1e-18, events=touch, dense_output=True)
        pieces.append((t, piece.sol))
        t, z = piece.t[-1], piece.y[:, -1]
        # Off the edge, which the next piece begins on.
        if t < t_end:
            step = solve_ivp(rate, (t, t + 1e-9), z, "DOP853", rtol=1e-12, atol=1e-18, dense_output=True)
            pieces.append((t, step.sol))
            t, z = step.t[-1], step.y[:, -1]
    return lambda time: np.array(
        [next(sol for start, sol in reversed(pieces) if start <= t)(t)[0] + error(t)[0] for t in time]
    )


@pytest.mark.parametrize("name", ["parametric_gears", "gears_of_ten_harmonics"])
def test_gears_whose_stiffness_varies_beside_scipy(folder, name):
    """The torques balance; one coordinate is left, and the gears' inertias over their squared radii are 3 and 6 kg."""
    found = run(FIELD / f"{name}.nml")
    time, seen = found["observable/time"], np.ravel(found["observable/mesh_deformation"])
    if name == "parametric_gears":
        omega = 2 * np.pi * 3200.0
        parts = ([0.3], [0.0]), ([0.0], [0.0])
        damping, push = 1200.0, 4000.0 / 2
    else:
        omega = 2 * np.pi * 1500.0
        parts = (([0.10, -0.05, 0.02, 0.01, 0.0, 0.004], [0.15, 0.04, 0.0, -0.02, 0.008, 0.0]),
                 ([8e-6, 0.0, -2e-6, 1e-6], [5e-6, 3e-6, 0.0, -1e-6]))  # fmt: skip
        damping, push = 2400.0, 2000.0 / 2

    def series(cosine, sine, t):
        n = omega * np.arange(1, len(cosine) + 1)
        c, s = np.cos(n * t), np.sin(n * t)
        return np.dot(cosine, c) + np.dot(sine, s), np.dot(n * np.array(sine), c) - np.dot(n * np.array(cosine), s)

    right = mesh_motion(time[-1], 2 * push / 2e8, lambda t: 2e8 * (1 + series(*parts[0], t)[0]),
                        lambda t: series(*parts[1], t), damping, 1e-4, push)(time)  # fmt: skip
    assert right.min() < 0.0
    assert seen == pytest.approx(right, rel=0, abs=1e-9 * abs(right).max())


def test_a_chain_with_cubic_springs_beside_scipy(folder):
    """The motion, and its folds: there shooting with SciPy finds a periodic motion and a multiplier 1."""
    mass, forced = np.array([1.0, 1.0, 0.5]), np.array([0.2, 0.0, 0.0])
    stretch = np.array([[1.0, 0, 0], [1, -1, 0], [0, 1, -1]])
    first, second, third = np.array([1.0, 1.5, 1.0]), np.array([0, 0, 0.1]), np.array([0.2, 0.5, 0.3])
    damping = np.array([0.04, 0.03, 0.02])

    def rate(t, z, omega):
        s, v = stretch @ z[:3], stretch @ z[3:6]
        force = first * s + second * s**2 + third * s**3 + damping * v
        dz = np.concatenate([z[3:6], (forced * np.sin(omega * t) - stretch.T @ force) / mass])
        if len(z) == 6:
            return dz
        slope = stretch.T @ np.diag(first + 2 * second * s + 3 * third * s**2) @ stretch
        x = z[6:].reshape(6, 6)
        lower = -(slope @ x[:3] + stretch.T @ np.diag(damping) @ stretch @ x[3:]) / mass[:, None]
        return np.concatenate([dz, np.concatenate([x[3:], lower]).ravel()])

    def moved(z, omega, time):
        return solve_ivp(rate, (0, time[-1]), z, "DOP853", time, args=(omega,), rtol=1e-12, atol=1e-14).y

    found = run(FIELD / "cubic_chain.nml")
    time = np.minimum(found["observable/time"], 60.0)
    right = moved(np.zeros(6), 0.6, time)
    for body, at in (("a", 0), ("c", 2)):
        seen = np.ravel(found[f"observable/displacement.{body}"])
        assert seen == pytest.approx(right[at], rel=0, abs=1e-9 * np.abs(right).max())

    with follow(FIELD / "cubic_chain.nml") as file:
        folds, states, all_of = points(file, "LP"), file["point/state"][:], file["point/load.angular_frequency"][:]
    assert len(folds) == 2

    def residual(u):
        end = moved(np.concatenate([u[:6], np.eye(6).ravel()]), u[6], np.array([0.0, 2 * np.pi / u[6]]))[:, -1]
        return np.append(end[:6] - u[:6], np.linalg.det(end[6:].reshape(6, 6) - np.eye(6)))

    for fold in folds:
        near = states[np.argmin(np.abs(all_of - fold))]
        own = fsolve(residual, np.append(near, fold), xtol=1e-13)
        assert own[6] == pytest.approx(fold, rel=1e-9)


def test_a_valve_floats_over_a_cam_given_by_points(folder):
    """The table is a periodic spline, as that of SciPy; the motion between touches is integrated piece by piece."""
    (folder / "inputs" / "field").mkdir(parents=True, exist_ok=True)
    shutil.copy(FIELD / "cam_profile.csv", folder / "inputs" / "field")
    found = run(FIELD / "cam_profile.nml")
    lift = CubicSpline(*np.loadtxt(FIELD / "cam_profile.csv", delimiter=",", skiprows=1).T, bc_type="periodic")

    def gap(t, z, closed):
        return z[0] - lift(t)

    def rate(t, z, closed):
        return [z[1], (-1e3 * z[0] - 2 * z[1] - 15.0 - closed * 1e6 * (z[0] - lift(t))) / 0.3]

    gap.terminal = True
    time, seen = found["observable/time"], np.ravel(found["observable/displacement"])
    t, z, right, closed = 0.0, np.array([-15.0 / (1e3 + 1e6), 0.0]), np.zeros_like(time), True
    while t < time[-1]:
        gap.direction = 1.0 if closed else -1.0
        piece = solve_ivp(rate, (t, time[-1]), z, "DOP853", args=(closed,), rtol=1e-12, atol=1e-15, events=gap,
                          dense_output=True, max_step=2.5e-4)  # fmt: skip
        inside = (time >= t) & (time <= piece.t[-1])
        right[inside] = piece.sol(time[inside])[0]
        t, z, closed = piece.t[-1], piece.y[:, -1], not closed
    assert np.sum(right > lift(time) + 1e-6) > 10
    assert seen == pytest.approx(right, rel=0, abs=1e-9 * abs(right).max())


@pytest.mark.parametrize("name", ["field/pitch_error", "damaged_tooth"])
def test_gears_with_errors_of_their_teeth_beside_scipy(folder, name):
    """The torques balance; the teeth stay closed, so what is left is m d'' = push - k (d + e) - c (d' + e')."""
    if name == "field/pitch_error":
        (folder / "inputs" / "field").mkdir(parents=True)
        shutil.copy(FIELD / "pitch_error.csv", folder / "inputs" / "field")
    found = run(SOURCE / "inputs" / f"{name}.nml")
    time, seen = found["observable/time"], np.ravel(found["observable/mesh_deformation"])
    mass, push, k, c, turn = 1 / (0.05**2 / 0.004 + 0.075**2 / 0.012), 60.0 / 0.05, 2e8, 2e3, 2 * np.pi * 25.0

    if name == "damaged_tooth":
        # 20 um deep for a 24th of each turn, 10 ms after it begins; 2 um with each tooth.
        def error(t):
            since = np.mod(t - 0.01, 0.04)
            inside, rate = since < 0.04 / 24, np.pi * 24 / 0.04
            dip, slope = -2e-5 * inside * np.array([np.sin(rate * since), rate * np.cos(rate * since)])
            return dip + 2e-6 * np.sin(24 * turn * t), slope + 2e-6 * 24 * turn * np.cos(24 * turn * t)

        breaks = np.sort(np.concatenate([0.01 + 0.04 * np.arange(5), 0.01 + 0.04 * (np.arange(5) + 1 / 24)]))
    else:
        # The harmonics below half of the number of points, as of a discrete Fourier transform.
        measured = np.loadtxt(FIELD / "pitch_error.csv", delimiter=",", skiprows=1)[:, 1]
        parts = 2 * np.fft.rfft(measured) / measured.size
        parts[0] /= 2
        parts[-1] /= 2
        order = 1j * turn * np.arange(parts.size)

        def error(t):
            at = parts * np.exp(order * t)
            return at.sum().real, (order * at).sum().real

        breaks = np.array([])

    def rate(t, z):
        e, slope = error(t)
        return [z[1], (push - k * (z[0] + e) - c * (z[1] + slope)) / mass]

    # It begins at rest under the load without the error of the teeth in motion.
    z, ends, right = np.array([seen[0] - error(0.0)[0], 0.0]), [*breaks[breaks < time[-1]], time[-1]], []
    t = 0.0
    for end in ends:
        piece = solve_ivp(rate, (t, end), z, "DOP853", rtol=1e-12, atol=1e-17, dense_output=True, max_step=2e-4)
        inside = time[(time >= t) & (time < end)]
        right += [piece.sol(at)[0] + error(at)[0] for at in inside]
        t, z = end, piece.y[:, -1]
    right = np.array(right)
    assert right.min() > 0.0
    assert seen[: right.size] == pytest.approx(right, rel=0, abs=1e-9 * right.max())


def test_a_body_walks_where_friction_is_less(folder):
    """It slides forward alone: from where 4 sin t is 2 N, to where what that gave it is used up."""
    found = run(SOURCE / "inputs" / "walking_body.nml")
    begins = np.arcsin(0.5)
    ends = brentq(lambda t: 4 * (np.cos(begins) - np.cos(t)) - 2 * (t - begins), np.pi / 2, 2 * np.pi, xtol=1e-15)
    step = 4 * (np.cos(begins) * (ends - begins) - np.sin(ends) + np.sin(begins)) - (ends - begins) ** 2
    right = np.sort(np.concatenate([at + 2 * np.pi * np.arange(8) for at in (begins, ends)]))
    right = right[right < 50.0]
    assert found["event/time"] == pytest.approx(right, rel=1e-12)
    rests = found["observable/time"] > ends + 2 * np.pi * 6
    rests &= found["observable/time"] < begins + 2 * np.pi * 7
    assert np.ravel(found["observable/displacement"])[rests] == pytest.approx(7 * step, rel=1e-12)


def test_a_clamp_closes_beside_scipy(folder):
    """The workpiece pushes with its spring and damper while these do not pull."""
    found = run(SOURCE / "inputs" / "clamp.nml")
    time, seen = found["observable/time"], np.ravel(found["observable/displacement"])

    def push(z):
        return 5e6 * (z[0] - 1e-3) + 800.0 * z[1]

    def rate(t, z, closed):
        return [z[1], (400.0 * min(t / 0.02, 1.0) - 4e4 * z[0] - 60.0 * z[1] - closed * push(z)) / 0.8]

    def touch(t, z, closed):
        return push(z) if closed else z[0] - 1e-3

    touch.terminal = True
    t, z, closed, right, touches = 0.0, np.zeros(2), False, np.zeros_like(time), 0
    while t < time[-1]:
        touch.direction = -1.0 if closed else 1.0
        end = 0.02 if t < 0.02 else time[-1]
        piece = solve_ivp(rate, (t, end), z, "DOP853", args=(closed,), rtol=1e-12, atol=1e-16, events=touch,
                          dense_output=True, max_step=1e-4)  # fmt: skip
        inside = (time >= t) & (time <= piece.t[-1])
        right[inside] = piece.sol(time[inside])[0]
        t, z = piece.t[-1], piece.y[:, -1]
        if piece.status == 1:
            closed, touches = not closed, touches + 1
    assert touches > 2
    assert seen == pytest.approx(right, rel=0, abs=1e-9 * right.max())
    # What swings on, also below a rounding of where it comes to rest, does so in equal times.
    swings = np.diff(found["extrema/displacement/time"][20:50])
    assert swings == pytest.approx(swings[0], rel=1e-9)
