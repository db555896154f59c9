"""Dampers and motors whose force is given over velocity by a table: closed forms, and SciPy beside."""

import numpy as np
import pytest
from branches import follow
from programs import SOURCE, run, start
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

INPUTS = SOURCE / "inputs"
MOTOR = ([0.0, 30.0, 80.0, 100.0, 110.0], [-50.0, -35.0, -90.0, -20.0, 30.0])
ODD = ([-1.0, -0.2, 0.1, 0.5, 1.5], [-3.0, -1.0, 0.2, 1.5, 2.0])


def table(points):
    return "velocity=" + ", ".join(map(str, points[0])) + ", force=" + ", ".join(map(str, points[1]))


def force(points, v):
    """Return the force over velocity; the first and the last line go on."""
    x, f = map(np.array, points)
    k = np.clip(np.searchsorted(x, v, side="right") - 1, 0, len(x) - 2)
    return f[k] + (f[k + 1] - f[k]) / (x[k + 1] - x[k]) * (v - x[k])


def case(folder, *groups, motion):
    path = folder / "case.nml"
    path.write_text("\n".join((*groups, f"&motion {motion} /")) + "\n")
    return path


def motor(folder, method="exact", inertia="&inertia name='m', value=0.3 /", ends="'m','frame'", more=""):
    return case(
        folder, inertia, f"&damper name='t', between={ends}, {table(MOTOR)} {more} /",
        "&record observable='velocity', of='m', what='trajectory', interval=0.01 /",
        motion=f"t_end=1.5, start='zero', integrator='{method}', relative_tolerance=1e-12, absolute_tolerance=1e-14",
    )  # fmt: skip


@pytest.mark.parametrize(("method", "close"), [("exact", 1e-12), ("dop853", 1e-10), ("radau5", 1e-10)])
def test_a_motor_gets_faster_as_its_torque_lets_it(folder, method, close):
    """On each line the speed goes exponentially, from v1 to v2 in J (v2 - v1)/(T2 - T1) ln(T2/T1)."""
    found = run(motor(folder, method))
    v, torque = np.array(MOTOR[0]), -np.array(MOTOR[1])
    slope = np.diff(torque) / np.diff(v)
    times = np.cumsum(0.3 / slope[:3] * np.log(torque[1:4] / torque[:3]))
    assert found["event/time"] == pytest.approx(times, rel=close)
    t = found["observable/time"]
    line = np.searchsorted(times, t)
    right = v[line] + torque[line] / slope[line] * np.expm1(slope[line] / 0.3 * (t - np.append(0.0, times)[line]))
    assert np.ravel(found["observable/velocity.m"]) == pytest.approx(right, rel=close, abs=close * 100)


def test_shafts_have_the_same_motor(folder):
    shaft = """&shaft name='s', young_modulus=2.1e11, shear_modulus=8.0e10, density=0.0 /
&section shaft='s', length=0.5, outer_diameter=0.03 /
&disk shaft='s', node=1, mass=1.0, polar_inertia=0.1, diametral_inertia=0.0 /
&disk shaft='s', node=2, mass=1.0, polar_inertia=0.2, diametral_inertia=0.0 /
&freedom axial=.false., bending=.false. /"""
    lumped = f"""&inertia name='end', value=0.1 /
&inertia name='m', value=0.2 /
&spring between='end','m', stiffness={8.0e10 * np.pi * 0.03**4 / 32 / 0.5} /"""
    path = motor(folder, inertia=shaft, ends="'s.2','frame', twist=.true.")
    path.write_text(path.read_text().replace("of='m'", "of='s.2.phi'"))
    seen = np.ravel(run(path)["observable/velocity.s.2.phi"])
    assert seen == pytest.approx(np.ravel(run(motor(folder, inertia=lumped))["observable/velocity.m"]), abs=1e-8)


def test_starts_of_a_motor_beside_scipy(folder):
    path = INPUTS / "motor_start.nml"
    own = ([0.0, 20.0, 50.0, 90.0, 125.0, 140.0, 150.0, 157.08, 170.0],
           [-48.0, -38.0, -25.0, -60.0, -95.0, -84.0, -40.0, 0.0, 60.0])  # fmt: skip
    fan = ([-40.0, 0.0, 40.0, 80.0, 120.0, 160.0], [-2.5, 0.0, 2.5, 10.0, 22.5, 40.0])

    def rate(t, z):
        s, ds = z[0] - z[1], z[2] - z[3]
        side = np.sign(s) * (abs(s) > 0.0175)
        torque = 9e3 * (s - 0.0175 * side) * abs(side) + 4.0 * ds * abs(side)
        torque = side * max(side * torque, 0.0)
        return [z[2], z[3], (-force(own, z[2]) - torque) / 0.05, (torque - force(fan, z[3])) / 0.4]

    found = run(path)
    t, seen = found["observable/time"], np.ravel(found["observable/velocity.fan"])
    right = solve_ivp(rate, (0.0, t[-1]), np.zeros(4), "DOP853", t, rtol=1e-12, atol=1e-13).y[3]
    assert seen == pytest.approx(right, rel=0, abs=1e-8 * np.abs(right).max())
    stuck = run(path, "--set", "load%value=-30.0", "--set", "motion%t_end=60.0")["observable/velocity.fan"]
    assert np.ravel(stuck)[-1] == pytest.approx(50.0 / 3 / (13.0 / 30 + 0.0625), rel=1e-9)


def test_a_car_over_a_bump_beside_scipy(folder):
    found = run(INPUTS / "quarter_car.nml")
    absorber = ([-2.0, -0.39, -0.13, 0.0, 0.13, 0.39, 2.0], [-700.0, -400.0, -230.0, 0.0, 480.0, 950.0, 1900.0])

    def rate(t, z):
        on = 0.1 < t < 0.14
        road = 0.06 * np.sin(np.pi * (t - 0.1) / 0.04) * on
        moves = 0.06 * np.pi / 0.04 * np.cos(np.pi * (t - 0.1) / 0.04) * on
        tyre = max(0.0, 1.9e5 * (road - z[1]) + 120.0 * (moves - z[3])) * (road > z[1])
        joint = 1.8e4 * (z[0] - z[1]) + force(absorber, z[2] - z[3])
        return [z[2], z[3], -joint / 280.0 - 9.81, (joint + tyre) / 36.0 - 9.81]

    rest = -316.0 * 9.81 / 1.9e5
    t = found["observable/time"]
    z, right = np.array([rest - 280.0 * 9.81 / 1.8e4, rest, 0.0, 0.0]), []
    for low, high in ((0.0, 0.1), (0.1, 0.14), (0.14, 2.0)):
        inside = t[(t >= low) & (t < high)] if high < 2.0 else t[t >= low]
        part = solve_ivp(rate, (low, high), z, "DOP853", dense_output=True, rtol=1e-12, atol=1e-14)
        right.append(part.sol(inside))
        z = part.y[:, -1]
    right = np.hstack(right)
    for name, row in (("body", 0), ("wheel", 1)):
        seen = np.ravel(found[f"observable/displacement.{name}"])
        assert seen == pytest.approx(right[row], rel=0, abs=1e-9)


def test_periodic_motions_are_followed(folder):
    """A motion under a sine, and its multipliers, beside shooting with SciPy."""
    path = case(
        folder, "&mass name='m', value=1.0 /", "&spring between='m','frame', stiffness=1.0 /",
        f"&damper name='d', between='m','frame', {table(ODD)} /",
        "&load on='m', amplitude=2.0, angular_frequency=1.1 /",
        "&follow parameter='load%angular_frequency', first=1.1, last=1.3, values=1.2 /",
        motion="t_end=10.0, start='zero'",
    )  # fmt: skip

    def rate(t, z):
        return [z[1], 2.0 * np.sin(1.2 * t) - z[0] - force(ODD, z[1])]

    def after(z):
        return solve_ivp(rate, (0, 2 * np.pi / 1.2), z, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]

    with follow(path) as file:
        at = np.argmin(np.abs(file["point/load.angular_frequency"][:] - 1.2))
        state, multipliers = file["point/state"][at], file["point/multiplier"][at]
    own = fsolve(lambda z: after(z) - z, state, xtol=1e-13)
    assert own == pytest.approx(state, abs=1e-8)
    step = 4e-5
    slopes = np.array([(after(own + d) - after(own - d)) / (2 * step) for d in step * np.eye(2)]).T
    right = np.linalg.eigvals(slopes)
    assert np.sort_complex([1, 1j] @ multipliers) == pytest.approx(np.sort_complex(right), abs=1e-6)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("damping=1.0, velocity=0.0, 1.0, force=0.0, 1.0", "damping = 1.0: left out beside a table"),
        ("", "damping: required: viscous damping in N s/m or N m s/rad, or a table of velocity and force"),
        ("damping=1.0, force=0.0, 1.0", "velocity: required: a value for each point of the table"),
        ("velocity=0.0, 1.0", "force: required: a value for each point of the table"),
        ("velocity=0.0, 0.0, force=0.0, 1.0", "velocity = 0.0, 0.0: values that rise from point to point"),
        ("velocity=0.0, 1.0, force=0.0, 1.0, 2.0", "2 values, one for each velocity"),
    ],
)
def test_refusals(folder, keys, said):
    damper = f"&damper between='m','frame', {keys} /"
    path = case(folder, "&mass name='m', value=1.0 /", damper, motion="t_end=1.0, start='zero'")
    done = start("razy-run", path)
    assert done.returncode == 2 and said in done.stderr.replace("\n", " "), done.stderr


def test_a_table_that_is_not_to_be_left(folder):
    done = start("razy-run", motor(folder, more=", beyond='refuse'"))
    assert done.returncode == 0
    path = motor(folder, more=", beyond='refuse'")
    path.write_text(path.read_text() + "&load on='m', value=100.0 /\n")
    done = start("razy-run", path, "--force")
    assert done.returncode == 1 and "beyond the table of a law" in done.stderr
