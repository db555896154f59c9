"""Speeds that change within a motion: against SciPy, Fresnel's integral and the constant speed; what refuses them."""

import numpy as np
import pytest
from programs import GEAR_PAIR, SOURCE, run, sets, start
from scipy.integrate import solve_ivp
from scipy.special import fresnel

MASS, STIFFNESS, DAMPING = 2.0, 2.0e4, 8.0
OSCILLATOR = """&scene kind='lumped' /
&mass name='m', value=2.0 /
&spring between='m','frame', stiffness=2.0e4 /
&damper between='m','frame', damping={damping} /
&inertia name='r', value=0.1 /
&rotation of='r', speed_rpm={speed}, acceleration_rpm_per_s={rate} /
{loads}
&motion t_end={t_end}, start='zero', relative_tolerance=1e-12, absolute_tolerance=1e-14 /
&record observable='displacement', of='m', what='trajectory','extrema', interval=0.001 /
"""


@pytest.mark.parametrize(("speed", "rate"), [(0.0, 200.0), (1500.0, -200.0)])
def test_oscillator_beside_scipy(folder, speed, rate):
    """Up from rest, and down through rest: a force of order 1, an unbalance of order 2 with its tangential part."""
    loads = (
        "&load on='m', amplitude=3.0, order=1.0, phase=30.0 /\n&load on='m', unbalance=1e-3, order=2.0, phase=10.0 /"
    )
    (folder / "up.nml").write_text(OSCILLATOR.format(damping=DAMPING, speed=speed, rate=rate, loads=loads, t_end=8.0))
    found = run("up.nml")
    omega, change = speed * np.pi / 30, rate * np.pi / 30

    def derivative(t, z):
        phase, turning = omega * t + change * t**2 / 2, omega + change * t
        force = 3.0 * np.sin(phase + np.pi / 6)
        # -d²/dt² of 1e-3 sin(2 phase + 10°).
        of_two = 2 * phase + np.pi / 18
        force += 1e-3 * (4 * turning**2 * np.sin(of_two) - 2 * change * np.cos(of_two))
        return [z[1], (force - DAMPING * z[1] - STIFFNESS * z[0]) / MASS]

    t = np.minimum(found["time"], 8.0)
    expected = solve_ivp(derivative, (0.0, 8.0), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-15, t_eval=t).y[0]
    np.testing.assert_allclose(found["observable/displacement.m"], expected, atol=1e-11 * np.max(np.abs(expected)))
    np.testing.assert_allclose(found["rotation/speed"], omega + change * np.array([0.0, 8.0]))
    np.testing.assert_allclose(found["rotation/time"], [0.0, 8.0])
    assert found["outcome/excitation_period"] == 0.0


def test_resonance_is_passed_later_and_lower_the_faster(folder):
    """Without damping the envelope near resonance is Fresnel's integral (F. M. Lewis, Trans. ASME 54 (1932))."""
    hertz = np.sqrt(STIFFNESS / MASS) / (2 * np.pi)
    s = np.linspace(0.0, 3.0, 3001)
    size = np.hypot(*(part + 0.5 for part in fresnel(s)))
    largest, where = size.max(), s[size.argmax()]
    peaks = []
    for rate in (15.0, 60.0):
        (folder / "up.nml").write_text(
            OSCILLATOR.format(damping=0.0, speed=0.0, rate=rate, loads="&load on='m', amplitude=1.0, order=1.0 /",
                              t_end=1400.0 / rate)
        )  # fmt: skip
        found = run("up.nml")
        h = rate / 60
        x, t = np.abs(found["extrema/displacement.m/value"]), found["extrema/displacement.m/time"]
        near = np.abs(h * t - hertz) < 3 * np.sqrt(h)
        # Maxima of the displacement are a little below those of its envelope.
        peaks.append(x[near].max() * STIFFNESS)
        assert peaks[-1] == pytest.approx(np.pi * hertz / np.sqrt(2 * h) * largest, rel=0.02)
        assert h * t[near][x[near].argmax()] - hertz == pytest.approx(where * np.sqrt(h / 2), abs=0.15 * np.sqrt(h))
    assert peaks[1] < 0.55 * peaks[0]


def test_rotor_without_acceleration_to_speak_of_is_that_of_a_constant_speed(folder):
    """Gyroscopic and circulatory matrices that change, and unbalance: 1e-9 rpm/s is no change; 6000 rpm/s is one."""
    case = SOURCE / "inputs" / "run_up.nml"
    options = sets(motion__t_end=0.1, rotation__speed_rpm=6000.0, motion__relative_tolerance=1e-11)
    still, slow, fast = (
        run(case, *options, *sets(rotation__acceleration_rpm_per_s=rate))["observable/displacement.rotor.7.v"]
        for rate in (0.0, 1e-9, 6000.0)
    )
    np.testing.assert_allclose(slow, still, atol=1e-7 * np.max(np.abs(still)))
    assert np.max(np.abs(fast - still)) > 0.1 * np.max(np.abs(still))


def test_a_rotor_rubs_in_its_run_up(folder):
    """The rim slides with the speed that the rotation has come to, and the rub is Coulomb's against that."""
    text = (SOURCE / "inputs" / "rotor_rub.nml").read_text()
    more = "".join(
        f"&record observable='velocity', of='rotor.3.{name}', what='trajectory', interval=1.0e-4 /\n"
        for name in ("w", "phi")
    )
    text = text.replace("speed_rpm=6000.0", "speed_rpm=4500.0, acceleration_rpm_per_s=5000.0")
    (folder / "rub.nml").write_text(text + more)
    found = run("rub.nml")
    time, slides = found["time"], found["observable/sliding_velocity.rub"]
    omega = np.pi / 30 * (4500.0 + 5000.0 * time)
    rim = -found["observable/velocity.rotor.3.w"] - 0.05 * (omega + found["observable/velocity.rotor.3.phi"])
    np.testing.assert_allclose(slides, rim, rtol=1e-10)
    stator, rub = found["observable/contact_force.stator"], found["observable/contact_force.rub"]
    assert (stator > 0).sum() > 40 and (stator[time < 0.1] == 0).all()
    np.testing.assert_allclose(rub, 0.2 * stator * np.sign(slides), atol=1e-10 * stator.max())


def test_gear_pair_goes_by_events(folder):
    """The mesh error's frequency grows, with backlash: methods agree on what happens while contact is lost."""
    options = sets(rotation__acceleration_rpm_per_s=20000.0, motion__t_end=0.02, motion__relative_tolerance=1e-12) + [
        "--set",
        "record%from=0.0",
    ]
    found = [run(GEAR_PAIR, *options, *sets(motion__integrator=f"'{name}'")) for name in ("dop853", "dormand_prince")]
    assert found[0]["event/time"].size == found[1]["event/time"].size > 20
    np.testing.assert_allclose(found[0]["event/time"], found[1]["event/time"], atol=1e-9)


@pytest.mark.parametrize(("speed", "rate"), [(0.0, 3000.0), (1500.0, -2400.0)])
def test_teeth_that_switch_beside_scipy(folder, speed, rate):
    """One or two pairs in mesh, in a run-up from rest and a run-down: pieces between moments from the phase."""
    inertia, radius, k, damping, torque, ratio, share = 0.01, 0.08, 1e6, 300.0, 5.0, 1.7, 0.6
    (folder / "up.nml").write_text(f"""&inertia name='a', value={inertia} /
&inertia name='b', value={inertia} /
&gear_mesh name='mesh', between='a','b', radius={radius},{radius}, teeth=20,20, stiffness={k}, damping={damping},
           backlash=1e-3, contact_ratio={1 + share}, pair_ratio={ratio}, mesh_phase=70.0 /
&load on='a', value={torque} /
&load on='b', value={-torque} /
&rotation of='a', speed_rpm={speed}, acceleration_rpm_per_s={rate} /
&motion t_end=0.5, start='static', relative_tolerance=1e-12, absolute_tolerance=1e-16 /
&record observable='mesh_deformation', what='trajectory', interval=1e-3 /
""")
    found = run("up.nml")
    f, r, p = 20 * speed / 60, 20 * rate / 60, 70.0 / 360
    # Whole turns m and m + share, the moments that come before the end.
    turns = np.sort(np.concatenate([np.arange(1, 400) - p, np.arange(400) + share - p]))
    square = f**2 + 2 * r * turns
    at = (np.sqrt(square[square > 0]) - f) / r
    at = np.concatenate(([0.0], at[at < 0.5], [0.5]))
    assert len(at) > 60
    np.testing.assert_allclose(found["event/time"], at[1:-1], rtol=1e-12)
    low = k / (1 + share * (ratio - 1))
    # d'' = 2 r T/J - 2 r² F/J, the force with stiffness and damping of the pairs in mesh.
    z, t = np.array([torque / radius / k, 0.0]), found["time"]
    expected = []
    for i in range(len(at) - 1):
        middle = (at[i] + at[i + 1]) / 2
        more = ratio if (f * middle + r * middle**2 / 2 + p) % 1 < share else 1.0
        many = more * low

        def rate_of(_, z, many=many):
            push = many * (z[0] + damping / k * z[1])
            return [z[1], 2 * radius * torque / inertia - 2 * radius**2 / inertia * push]

        now = t[(t >= at[i]) & (t < at[i + 1])]
        done = solve_ivp(
            rate_of, (at[i], at[i + 1]), z, method="DOP853", rtol=1e-12, atol=1e-17, t_eval=[*now, at[i + 1]]
        )
        expected.extend(done.y[0, :-1])
        z = done.y[:, -1]
    d = found["observable/mesh_deformation"][: len(expected)]
    assert d.min() > 0
    np.testing.assert_allclose(d, expected, rtol=0, atol=1e-9 * np.max(np.abs(d)))


RAMP = ("rotation__acceleration_rpm_per_s", "10.0")


@pytest.mark.parametrize(
    ("program", "case", "more", "message"),
    [
        ("razy-run", "torsional_gear_pair", {"motion__integrator": "'exact'"}, "&motion%integrator = 'exact'"),
        ("razy-run", "torsional_gear_pair", {"motion__lyapunov": 1}, "&motion%lyapunov = 1: 0 where &rotation has an"),
        (
            "razy-run", "mesh_stiffness", {"motion__integrator": "'dop853'", "rotation__acceleration_rpm_per_s": -3e5},
            "contact_ratio = 1.6: left out where &rotation turns back",
        ),
        ("razy-sweep", "torsional_gear_pair", {"sweep__direction": "'up'"}, "'independent' where &rotation has an"),
    ],
)  # fmt: skip
def test_refused_in_one_line(folder, program, case, more, message):
    values = dict([RAMP]) | ({"motion__integrator": "'dop853'"} | more)
    text = (SOURCE / "inputs" / f"{case}.nml").read_text()
    (folder / "case.nml").write_text(text)
    done = start(program, "case.nml", *sets(**values), "--output", "no.h5")
    assert done.returncode == 2 and message in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr
