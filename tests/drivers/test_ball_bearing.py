"""Bearings with clearance: rolling elements one by one, which turn with the cage, against closed forms and SciPy."""

import h5py
import numpy as np
import pytest
from programs import SOURCE, sets, start, succeed, values_of
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

MASS, BALLS, K, CLEARANCE = 4.0, 8, 1.3e10, 5e-6
# A rigid body of MASS that moves across the axis alone: of its modes without bearings the two that do not bend it.
RIGID = """&scene kind='rotor' /
&shaft name='r', young_modulus=2.1e11, poisson_ratio=0.3, density=1e-6 /
&section shaft='r', length=0.2, outer_diameter=0.1, elements=1 /
&disk shaft='r', node=1, mass=4.0, polar_inertia=0.0, diametral_inertia=1.0 /
&support shaft='r', node=1, held='theta','psi' /
&support shaft='r', node=2, held='theta','psi' /
&freedom axial=.false., torsion=.false. /
&reduction modes=2 /
&rotation speed_rpm=3000.0, gyroscopic=.false. /
"""
BALL = (
    "&bearing name='front', shaft='r', node=1, kind='ball', elements=8, clearance=5e-6, contact_stiffness=1.3e10, "
    "cage_ratio=0.4, first_angle=10.0, hysteresis={alpha} /\n"
)
LOADS = "&load on='r.1.v', value=-200.0 /\n&unbalance shaft='r', node=1, moment=2e-5 /\n"
TIGHT = "relative_tolerance=1e-12, absolute_tolerance=1e-14"
PLACE = "".join(
    f"&record observable='displacement', of='r.1.{axis}', what='trajectory', interval=1e-3 /\n" for axis in "vw"
)


def force(angle, d, v, turning, alpha, clearance=CLEARANCE, n=1.5, k=K):
    """Sum of the elements' forces on the shaft, the first element at `angle`, the cage turning at `turning` rad/s."""
    at = angle + 2 * np.pi * np.arange(BALLS) / BALLS
    out, round_ = np.array([np.cos(at), np.sin(at)]), np.array([-np.sin(at), np.cos(at)])
    p, rate = d @ out - clearance, v @ out + turning * (d @ round_)
    press = np.where(p > 0, k * np.maximum(p, 0) ** n * np.maximum(1 + 1.5 * alpha * rate, 0), 0)
    return -out @ press


def follow(t_end, times, angle, turning, load, alpha, z0):
    """Return displacements (times, 2) of the rigid body by SciPy, from z0."""

    def field(t, z):
        push = force(angle(t), z[:2], z[2:], turning(t), alpha)
        return np.concatenate([z[2:], (push + load(t)) / MASS])

    done = solve_ivp(field, (0.0, t_end), z0, "DOP853", rtol=1e-12, atol=1e-16, t_eval=times, max_step=5e-5)
    return done.y.T


def unbalance(phase, rate, change=0.0):
    """Force of the unbalance at a phase that turns at this rate, and the weight."""
    turn = np.exp(1j * phase) * (rate**2 - 1j * change) * 2e-5
    return np.array([turn.real - 200.0, turn.imag])


def place_of(path):
    found = values_of(path)
    return np.stack([found[f"observable/displacement.r.1.{axis}"] for axis in "vw"], 1)


@pytest.mark.parametrize(
    ("bearing", "n", "k"),
    [
        (BALL.format(alpha=0.0), 1.5, K),
        (BALL.format(alpha=0.0).replace("'ball'", "'roller'").replace("1.3e10", "4e8"), 10 / 9, 4e8),
        (
            BALL.format(alpha=0.0)
            .replace("'ball'", "'rolling'")
            .replace("contact_stiffness=1.3e10", "radial_stiffness=5e7"),
            1,
            5e7,
        ),
    ],
)
def test_rest_on_the_elements(folder, bearing, n, k):
    """Loaded along an element, which then carries with its two neighbours: one equation for the deflection."""
    case = folder / "rest.nml"
    bearing = bearing.replace("first_angle=10.0", "first_angle=180.0")
    case.write_text(RIGID + bearing + "&load on='r.1.v', value=-9e3 /\n&motion t_end=1e-3, start='static' /\n" + PLACE)
    succeed("razy-run", case)

    def missing(q):
        return sum(k * max(q * c - CLEARANCE, 0) ** n * c for c in np.cos(np.pi / 4 * np.arange(-1, 2))) - 9e3

    right = brentq(missing, CLEARANCE, 1e-3, xtol=1e-20, rtol=1e-14)
    assert right * np.cos(np.pi / 4) > CLEARANCE
    assert place_of("rest.h5")[0] == pytest.approx([-right, 0.0], rel=1e-10, abs=1e-15)


@pytest.mark.parametrize(("clearance", "deflection"), [(0.0, 15.1101e-6), (5e-6, 21.223e-6)])
def test_deflection_of_a_published_bearing(folder, clearance, deflection):
    """Seven balls of 11.5 mm under 1 kN on one: what MASTA finds after ISO/TS 16281, with 10 um all in all.

    The numbers are those of the tests of github.com/minzhun/ISO16281.
    """
    bearing = (
        f"&bearing name='b', shaft='r', node=1, kind='ball', elements=7, clearance={clearance}, ball_diameter=0.0115, "
        "pitch_diameter=0.0435, inner_groove=0.00598, outer_groove=0.006095, "
        "young_modulus=2.1e11, poisson_ratio=0.3 /\n"
    )
    case = folder / "published.nml"
    case.write_text(RIGID + bearing + "&load on='r.1.v', value=1e3 /\n&motion t_end=1e-3, start='static' /\n" + PLACE)
    succeed("razy-run", case)
    assert place_of("published.h5")[0] == pytest.approx([deflection, 0.0], rel=1.2e-5, abs=1e-12)


def test_rest_with_preload(folder):
    """A negative clearance presses all elements; they share the load."""
    case = folder / "preload.nml"
    bearing = BALL.format(alpha=1.0).replace("clearance=5e-6", "clearance=-3e-6").replace("angle=10.0", "angle=0.0")
    case.write_text(RIGID + bearing + "&load on='r.1.v', value=500.0 /\n&motion t_end=1e-3, start='static' /\n" + PLACE)
    succeed("razy-run", case)

    def missing(q):
        return sum(K * max(q * c + 3e-6, 0) ** 1.5 * c for c in np.cos(np.pi / 4 * np.arange(BALLS))) - 500.0

    right = brentq(missing, 0.0, 1e-3, xtol=1e-20, rtol=1e-14)
    assert place_of("preload.h5")[0] == pytest.approx([right, 0.0], rel=1e-10, abs=1e-15)


def test_motion_against_scipy(folder):
    case = folder / "motion.nml"
    more = f"&motion t_end=0.05, start='zero', {TIGHT} /\n"
    case.write_text(RIGID + BALL.format(alpha=2.0) + LOADS + more + PLACE)
    succeed("razy-run", case)
    omega = 3000 * np.pi / 30
    times = np.arange(51) * 1e-3
    right = follow(
        0.05, times, lambda t: np.radians(10.0) + 0.4 * omega * t, lambda t: 0.4 * omega,
        lambda t: unbalance(omega * t, omega), 2.0, np.zeros(4),
    )  # fmt: skip
    size = abs(right[:, :2]).max()
    assert size > CLEARANCE
    assert abs(place_of("motion.h5") - right[:, :2]).max() < 1e-7 * size
    found = values_of("motion.h5")
    assert found["outcome/events"][0] > 50
    assert found["outcome/residual"][0] < 1e-9


def test_run_up_and_a_ring_that_turns(folder):
    """The cage follows the speed, here between a shaft and one that turns the other way at half its speed."""
    outer = """&shaft name='o', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0, speed_ratio=-0.5 /
&section shaft='o', length=0.2, outer_diameter=0.3, inner_diameter=0.2, elements=1 /
&support shaft='o', node=1, held='v','w','theta','psi' /
"""
    case = folder / "up.nml"
    case.write_text(
        RIGID.replace("modes=2", "modes=2,1").replace(
            "gyroscopic=.false.", "gyroscopic=.false., acceleration_rpm_per_s=20000.0"
        )
        + outer
        + BALL.format(alpha=2.0).replace("node=1,", "node=1, to='o.1',")
        + LOADS
        + f"&motion t_end=0.05, start='zero', {TIGHT} /\n"
        + PLACE
    )
    succeed("razy-run", case)
    omega, change, cage = 100 * np.pi, 20000 * np.pi / 30, 0.4 - 0.6 * 0.5
    times = np.arange(51) * 1e-3
    right = follow(
        0.05, times, lambda t: np.radians(10.0) + cage * (omega * t + change * t * t / 2),
        lambda t: cage * (omega + change * t),
        lambda t: unbalance(omega * t + change * t * t / 2, omega + change * t, change), 2.0, np.zeros(4),
    )  # fmt: skip
    assert abs(place_of("up.h5") - right[:, :2]).max() < 1e-7 * abs(right[:, :2]).max()


STILL = """&shaft name='o', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0, speed_ratio=0.0 /
&section shaft='o', length=0.2, outer_diameter=0.3, inner_diameter=0.2, elements=1 /
&support shaft='o', node=1, held='v','w','theta','psi' /
"""
RUB = (
    "&friction name='rub', between='r.1',{}, direction=0.0,0.0,1.0, radius=0.05,0.15, "
    "normal_load=100.0, static_coefficient=0.2 /\n"
)


def test_a_ring_that_is_said_to_stand_still(folder):
    """A shaft of speed_ratio 0 has a known speed: the cage and friction are those of a ring on the frame."""
    found = []
    for name, outer, to, end in (("frame", "", "", "'frame'"), ("still", STILL, " to='o.1',", "'o.1'")):
        case = folder / f"{name}.nml"
        rigid = RIGID.replace("modes=2", "modes=2,1") if outer else RIGID
        ball = BALL.format(alpha=2.0).replace("node=1,", "node=1," + to)
        more = "&unbalance shaft='o', node=1, moment=1.0 /\n" if outer else ""
        end_of = f"&motion t_end=0.02, start='zero', {TIGHT} /\n"
        case.write_text(rigid + outer + ball + RUB.format(end) + LOADS + more + end_of + PLACE)
        succeed("razy-run", case)
        found.append(place_of(f"{name}.h5"))
    assert abs(found[1] - found[0]).max() < 1e-8 * abs(found[0]).max() > 0
    geared = "".join(f"&disk shaft='{s}', node=2, mass=1.0, polar_inertia=1.0, diametral_inertia=1.0 /\n" for s in "ro")
    mesh = "&gear_mesh name='m', between='r','o', node=2,2, radius=0.1,0.1, teeth=20,20, stiffness=1e7 /\n"
    case.write_text(case.read_text() + geared + mesh)
    assert "numbers with which the speeds of both agree" in start("razy-run", case, "--check").stderr


def test_energy_while_the_cage_stands(folder):
    """Without rotation and damping: kinetic energy, Hertz's energy and that of the weight."""
    records = PLACE + PLACE.replace("displacement", "velocity")
    case = folder / "still.nml"
    case.write_text(
        RIGID.replace("3000.0", "0.0") + BALL.format(alpha=0.0) + f"&load on='r.1.v', value=-200.0 /\n"
        f"&motion t_end=0.05, start='zero', {TIGHT} /\n" + records
    )  # fmt: skip
    succeed("razy-run", case)
    found = values_of("still.h5")
    d, v = (
        np.stack([found[f"observable/{kind}.r.1.{axis}"] for axis in "vw"]) for kind in ("displacement", "velocity")
    )
    at = np.radians(10.0) + 2 * np.pi * np.arange(BALLS) / BALLS
    p = np.maximum(np.cos(at)[:, None] * d[0] + np.sin(at)[:, None] * d[1] - CLEARANCE, 0)
    energy = MASS / 2 * (v**2).sum(0) + K * (p**2.5).sum(0) / 2.5 + 200.0 * d[0]
    assert found["outcome/events"][0] > 10
    assert abs(energy).max() < 1e-9 * (MASS / 2 * (v**2).sum(0)).max()


def test_follow_and_ball_pass(folder):
    """The weight passes from element to element: the motion, its period and its multipliers beside SciPy's."""
    case = folder / "pass.nml"
    case.write_text(
        RIGID + BALL.format(alpha=20.0) + "&load on='r.1.v', value=-200.0 /\n"
        "&motion t_end=0.2, start='static', relative_tolerance=1e-10, absolute_tolerance=1e-13 /\n"
        "&record observable='displacement', of='r.1.v', what='extrema' /\n"
        "&follow parameter='load(1)%value', first=-200.0, last=-201.0, max_points=3 /\n"
    )  # fmt: skip
    succeed("razy-follow", case, "--output", "branch.h5")
    with h5py.File("branch.h5") as file:
        multipliers = [1, 1j] @ file["point/multiplier"][0]
        period = file["point/period"][0]
        extrema = file["extrema/displacement.r.1.v/value"][slice(*file["extrema/displacement.r.1.v/offset"][:2])]
    omega = 0.4 * 100 * np.pi
    assert period == pytest.approx(2 * np.pi / omega)

    def passed(z, times):
        return follow(
            times[-1], times, lambda t: np.radians(10.0) + omega * t, lambda t: omega,
            lambda t: np.array([-200.0, 0.0]), 20.0, z,
        )  # fmt: skip

    z, scale = np.array([-1e-5, 0.0, 0.0, 0.0]), np.array([1e-6, 1e-6, 1e-3, 1e-3])
    pass_time, slope = period / BALLS, np.eye(4)
    for _ in range(3):
        step = 1e-3 * scale
        there = [passed(z + sign * e, [pass_time])[-1] for e in np.diag(step) for sign in (1, -1)]
        slope = np.array([(a - b) / (2 * h) for a, b, h in zip(there[::2], there[1::2], step, strict=True)]).T
        z = z + np.linalg.solve(np.eye(4) - slope, passed(z, [pass_time])[-1] - z)
    path = passed(z, np.linspace(0.0, pass_time, 20001))
    assert abs((path[-1] - z) / scale).max() < 1e-8
    assert [extrema.min(), extrema.max()] == pytest.approx([path[:, 0].min(), path[:, 0].max()], rel=1e-7)
    right = np.linalg.eigvals(slope) ** BALLS
    assert np.sort(abs(multipliers)) == pytest.approx(np.sort(abs(right)), rel=1e-4, abs=1e-8)


def test_the_cage_turns_on_in_a_chain(folder):
    """The second of two motions with the same values goes on as one that lasts twice as long."""
    lines = (SOURCE / "inputs/ball_bearing.nml").read_text().splitlines()
    text = "\n".join(line for line in lines if not line.startswith(("&record", "&sweep", "&motion")))
    found = []
    for program, end, first, more in (
        ("razy-run", 0.1, 0.05, ""),
        (
            "razy-sweep",
            0.05,
            0.0,
            f"&sweep parameter='disk(1)%mass', first=6.0, last={6 + 1e-14!r}, points=2, direction='up' /",
        ),
    ):
        text_of = f"{text}\n&motion t_end={end}, start='static' /\n{more}\n"
        text_of += f"&record observable='displacement', of='rotor.1.w', what='extrema', from={first} /\n"
        (folder / "chain.nml").write_text(text_of)
        succeed(program, "chain.nml", "--output", f"{program}.h5")
        with h5py.File(f"{program}.h5") as file:
            extrema = file["extrema/displacement.rotor.1.w"]
            rows = slice(*extrema["offset"][1:3]) if "offset" in extrema else slice(None)
            found.append(extrema["value"][rows])
    assert len(found[0]) > 15
    np.testing.assert_allclose(found[1], found[0], atol=1e-8 * abs(found[0]).max())


def test_modes_with_the_stiffness_at_a_load(folder):
    """razy-modes takes the stiffness of elements at `element_load`."""
    ball = BALL.format(alpha=0.0).replace(", hysteresis=0.0", "")
    per_element = 1.5 * K ** (2 / 3) * 50.0 ** (1 / 3)
    case = folder / "modes.nml"
    case.write_text(RIGID + ball.replace(", clear", ", element_load=50.0, clear") + "&modes count=2 /\n")
    succeed("razy-modes", case)
    found = values_of("modes.h5")["natural_frequency"]
    assert 2 * np.pi * found == pytest.approx(2 * [np.sqrt(4 * per_element / MASS)], rel=1e-9)
    with case.open("a") as file:
        file.write("&unbalance shaft='r', node=1, moment=1e-5 /\n")
        file.write("&response parameter='rotation%speed_rpm', first=1.0, last=9.0, points=3 /\n" + PLACE)
    done = start("razy-modes", case)
    assert done.returncode == 2
    assert "&bearing clearance = 5e-6: left out with &response" in done.stderr


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("cage_ratio=0.4, ", "", "&bearing cage_ratio: required with a clearance, where ball_diameter"),
        ("cage_ratio=0.4, ", "ball_diameter=0.02, pitch_diameter=0.01, ", "and a larger pitch_diameter do not give it"),
        ("contact_stiffness=1.3e10, ", "", "&bearing ball_diameter: required by kind = 'ball'"),
        ("'ball'", "'rolling'", "&bearing contact_stiffness = 1.3e10: left out with kind = 'rolling'"),
        ("clearance=5e-6, ", "element_load=9.0, ", "&bearing contact_stiffness = 1.3e10: only with a clearance"),
        ("'ball'", "'matrix', stiffness=1e6,0,0,1e6", "&bearing clearance = 5e-6: left out with kind = 'matrix'"),
        ("t_end=1.0", "t_end=1.0, integrator='exact'", "a bearing with clearance: what happens in it is not linear"),
        (
            "&motion",
            "&record observable='connection_force', of='front.v', what='extrema' /\n&motion",
            "such as 'front.1'",
        ),
    ],
)
def test_refusals(folder, old, new, said):
    text = RIGID + BALL.format(alpha=0.0) + "&motion t_end=1.0 /\n"
    assert text.count(old) == 1
    (folder / "bad.nml").write_text(text.replace(old, new))
    done = start("razy-run", "bad.nml")
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_bits_of_a_sweep_are_those_of_a_run(folder):
    case = folder / "sweep.nml"
    case.write_text(
        RIGID + BALL.format(alpha=2.0) + LOADS + "&motion t_end=0.05 /\n"
        "&record observable='displacement', of='r.1.w', what='extrema' /\n"
        "&sweep parameter='rotation%speed_rpm', first=0.0, last=3000.0, points=3 /\n"
    )  # fmt: skip
    succeed("razy-sweep", case)
    swept = values_of("sweep.h5")
    name = "extrema/displacement.r.1.w/"
    for point, speed in enumerate((0.0, 1500.0, 3000.0)):
        succeed("razy-run", case, "--output", "one.h5", "--force", *sets(rotation__speed_rpm=speed))
        at = slice(*swept[name + "offset"][point : point + 2])
        assert (swept[name + "value"][at] == values_of("one.h5")[name + "value"]).all()
