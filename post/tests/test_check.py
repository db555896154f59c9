"""The independent proof of periodic motions."""

import math
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

flint = pytest.importorskip("flint")

from razy.check import special  # noqa: E402
from razy.check.dual import Dual, between, family  # noqa: E402
from razy.check.exponential import Exponential  # noqa: E402
from razy.check.machine import NotCovered, build, put, read_groups  # noqa: E402
from razy.check.motion import System  # noqa: E402
from razy.check.proof import Course, Disproved, Undecided, Watched, krawczyk  # noqa: E402
from razy.check.special import Point, prove  # noqa: E402
from razy.check.start import Motion  # noqa: E402

CASE = """
&scene kind='lumped' /
&mass name='body', value=1.0 /
&spring between='body','frame', stiffness=1.0, damping=0.2 /
&stop name='wall', between='body','frame', side='upper', clearance={clearance}, law='kelvin_voigt', stiffness=3.0 /
&load on='body', amplitude=1.0, angular_frequency=2.0, phase=90.0 /
"""


@pytest.fixture(autouse=True)
def precision():
    flint.ctx.prec = 212


def course(clearance: float, y: tuple[float, float], periods: int = 1) -> Course:
    system = System([build(read_groups(CASE.format(clearance=clearance)))])
    return Course(system, [flint.arb(value) for value in y], periods)


def test_linear_motion_is_the_closed_form():
    # x = Re(e^{2it}/(1 - 4 + 0.4i)); the derivative is by the phase 2t.
    response = 1 / (-3 + 0.4j)
    y = [flint.arb(response.real), flint.arb(-response.imag)]
    proof = course(1.0, (response.real, -response.imag)).prove(y)
    assert proof.stable is True
    assert proof.events == 0
    assert abs(float(proof.state[0].mid()) - response.real) < 1e-15


def test_motion_that_begins_at_another_phase():
    response = 1 / (-3 + 0.4j) * (0.8 + 0.6j)
    system = System([build(read_groups(CASE.format(clearance=1.0)))], math.acos(0.8) / (2 * math.pi))
    y = [flint.arb(response.real), flint.arb(-response.imag)]
    proof = Course(system, y, 1).prove(y)
    assert abs(float(proof.state[0].mid()) - response.real) < 1e-15


def test_motion_through_a_stop_is_not_proved():
    response = 1 / (-3 + 0.4j)
    y = [flint.arb(response.real), flint.arb(-response.imag)]
    free = course(1.0, (response.real, -response.imag))
    free.system = System([build(read_groups(CASE.format(clearance=0.2)))])
    with pytest.raises(Disproved, match="passes through wall"):
        free.prove(y)


def test_motion_that_just_touches_a_stop_is_undecided():
    # x = 3 cos(2t)/(1 - 4) without damping, whose largest value is exactly the clearance.
    text = CASE.replace("damping=0.2", "damping=0.0").replace("amplitude=1.0", "amplitude=3.0")
    system = System([build(read_groups(text.format(clearance=1.0)))], 0.25)
    y = [flint.arb(0), flint.arb(1)]
    with pytest.raises(Undecided, match="a grazing"):
        Course(system, y, 1).prove(y)


def test_period_that_is_not_the_least_is_refused():
    response = 1 / (-3 + 0.4j)
    y = [flint.arb(response.real), flint.arb(-response.imag)]
    with pytest.raises(Disproved, match="not the least"):
        course(1.0, (response.real, -response.imag), 2).prove(y)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("stiffness=1.0, damping=0.2", "law='polynomial', coefficients=1.0,0.0,1.0", "the law 'polynomial'"),
        ("amplitude=1.0,", "amplitude=1.0, file='load.csv',", "a load from a file"),
        ("angular_frequency=2.0, phase=90.0", "shape='ramp', duration=0.1", "comes once"),
        ("phase=90.0", "shape='ramp', duration=0.1", "times of a shape beside an angular_frequency"),
        ("stiffness=3.0", "stiffness=3.0, motion_shape='square', motion_amplitude=1.0", "the motion of wall"),
        ("law='kelvin_voigt', stiffness=3.0", "law='hertz', stiffness=3.0", "the law 'hertz'"),
        ("&load", "&friction name='f', decay=1.0, kinetic_coefficient=0.0, {} / &load", "falls with the speed, f"),
        ("&load", "&friction name='f', only_with='wall', {} / &load", "only_with of f"),
    ],
)
def test_what_is_not_covered_says_so(old, new, says):
    new = new.format("between='body','frame', static_coefficient=0.1, normal_load=1.0")
    with pytest.raises(NotCovered, match=says):
        build(read_groups(CASE.format(clearance=1.0).replace(old, new)))


TABLE = """
&scene kind='lumped' /
&mass name='ball', value=1.0 /
&load on='ball', value=-1.0 /
&stop name='table', between='ball','frame', side='lower', clearance=0.0, law='rigid', restitution=0.5,
      motion_amplitude=1.0, motion_angular_frequency=1.0 /
"""
FOLD = math.pi / 3
"""A w^2 / g = pi (1 - e)/(1 + e) of a ball that hits a table A sin wt once a period, in closed form."""
DOUBLING = math.hypot(FOLD, 2 * 1.25 / 1.5**2)
"""The same where its period doubles: also + 4 (1 + e^2)^2/(1 + e)^4 under the root."""


def point(label: str, text: str, parameter: str, value: float, state: tuple[float, float], phase: float) -> Point:
    groups = read_groups(text)
    put(groups, parameter, value)
    y = [flint.arb(number) for number in state]
    course = Course(System([build(groups)], phase), y, 1)
    return prove(label, course, y, family(groups, parameter, value), value, "")


def ball(amplitude: float) -> tuple[float, float]:
    """Return the state at 0.3 of the period of the motion that hits where the table rises less and less."""
    hit = math.acos(min(FOLD / amplitude, 1.0))
    time = 0.6 * math.pi - hit
    return amplitude * math.sin(hit) + math.pi * time - time**2 / 2, math.pi - time


def test_fold_of_the_bouncing_ball_is_the_closed_form():
    value = FOLD * (1 + 1e-14)
    found = point("LP", TABLE, "stop%motion_amplitude", value, ball(FOLD * (1 + 1e-9)), 0.3)
    assert abs(found.beyond + flint.arb(value) - flint.arb.pi() / 3) < 1e-30


def test_doubling_of_the_bouncing_ball_is_the_closed_form():
    value = DOUBLING * (1 + 1e-12)
    found = point("PD", TABLE, "stop%motion_amplitude", value, ball(value), 0.3)
    exact = ((flint.arb.pi() / 3) ** 2 + (flint.arb("2.5") / flint.arb("2.25")) ** 2).sqrt()
    assert abs(found.beyond + flint.arb(value) - exact) < 1e-30


def test_exponential_holds_that_of_flint():
    random = np.random.default_rng(1)
    g, slope = (flint.arb_mat(5, 5, [flint.arb(x) for x in random.standard_normal(25)]) for _ in range(2))
    s, p = flint.arb(1.5, 1e-20), flint.arb(2) ** -100
    flow = Exponential(Dual(g, slope), np.array([1.0, 1e-3, 1e2, 1.0, 1.0])).at(s)
    one, two = ((g * s.mid()).exp(), ((g + p * slope) * s.mid()).exp())
    rate = (two - one) / p
    for held, exact, allowed in ((flow.value, one, 1e-17), (flow.slope, rate, 1e-17)):
        for ball, number in zip(held.entries(), exact.entries(), strict=True):
            assert abs(ball - number) < allowed
            assert ball.overlaps(number)
    exact = Exponential(g, np.ones(5)).at(s.mid())
    assert all(ball.overlaps(number) for ball, number in zip(exact.entries(), one.entries(), strict=True))
    assert max(float(ball.rad()) for ball in exact.entries()) < 1e-58
    for far in ("inf", "nan", "1e400"):
        assert not any(x.is_finite() for x in Exponential(g, np.ones(5)).at(flint.arb(far)).entries())


def test_guards_and_their_derivatives_lie_where_their_polynomials_say():
    flow = Exponential(flint.arb_mat([[0, 1], [-1, 0]]), np.ones(2), [flint.arb_mat([[1, 0]])])
    h = flint.arb(flow.step)
    ((a, rest),) = flow.polynomials(flint.arb_mat([[1], [0]]), h)
    guard = Watched(a, rest, h, "cosine")
    for order, exact in enumerate((h.cos(), -h.sin(), -h.cos(), h.sin())):
        assert guard(order, h).contains(exact) and guard(order, h).rad() < 1e-17
    assert rest < 1e-24


def test_krawczyk_takes_no_box_of_two_zeros():
    # x^2 = 1e-8
    def image(middle, radius):
        u, box = flint.arb_mat([[middle]]), flint.arb_mat([[flint.arb(middle, radius)]])
        return krawczyk(flint.arb_mat([[u[0, 0] ** 2 - 1e-8]]), 2 * box, u, box)

    assert image(1.001e-4, 1e-6)[0, 0].contains(1e-4)
    for middle, radius in ((5e-4, 1e-3), (3e-4, 1e-5)):
        with pytest.raises(Undecided, match="into itself"):
            image(middle, radius)


@pytest.mark.parametrize("law", ["'kelvin_voigt', stiffness=3.0", "'rigid', restitution=0.5"])
@pytest.mark.parametrize("side", [1 - 1e-13, 1.0, 1 + 1e-13])
def test_grazing_is_the_closed_form(law, side):
    # |x| = A / |1 - 4 + 0.4i| reaches the clearance 1 at A = sqrt(9.16) if damping is 0.2 as a double.
    damping = flint.arb(0.2)
    exact = (9 + (2 * damping) ** 2).sqrt()
    value = float(exact.mid()) * side
    response = value / (-3 + 0.4j)
    text = CASE.format(clearance=1.0).replace("'kelvin_voigt', stiffness=3.0", law)
    found = point("GR", text, "load%amplitude", value, (response.real, -response.imag), 0.0)
    assert abs(found.beyond + flint.arb(value) - exact) < 1e-30


FREE = CASE.format(clearance=1.0).replace("=2.0", "=3.0") + "&damper between='body','frame', damping=-0.2 /"
"""Its motion is -cos(3t)/8 where the spring's damping is 0.2; a pair of multipliers is on the unit circle then."""


def test_a_pair_on_the_unit_circle_is_the_closed_form():
    value = 0.2 * (1 + 1e-14)
    found = point("TR", FREE, "spring%damping", value, (-1 / 8, 0.0), 0.0)
    assert abs(found.beyond + flint.arb(value) - flint.arb(0.2)) < 1e-30


@pytest.mark.parametrize("label", ["LP", "PD", "TR", "GR"])
def test_beside_a_point_there_is_no_change_of_sign(monkeypatch, label):
    # 1e-14 of the parameter is far more than the length of the curve.
    monkeypatch.setattr(special, "_locate", lambda _, curve, v: curve.at(v, v[curve.direction, 0]))
    graze = CASE.format(clearance=1.0), "load%amplitude", math.sqrt(9.16) * (1 + 1e-13)
    response = graze[2] / (-3 + 0.4j)
    text, parameter, value, state, phase = {
        "LP": (TABLE, "stop%motion_amplitude", FOLD * (1 + 1e-14), ball(FOLD * (1 + 1e-9)), 0.3),
        "PD": (TABLE, "stop%motion_amplitude", DOUBLING * (1 + 1e-12), ball(DOUBLING * (1 + 1e-12)), 0.3),
        "TR": (FREE, "spring%damping", 0.2 * (1 + 1e-14), (-1 / 8, 0.0), 0.0),
        "GR": (*graze, (response.real, -response.imag), 0.0),
    }[label]
    with pytest.raises(Undecided, match=f"no change of sign is proved at {label}"):
        point(label, text, parameter, value, state, phase)


def resting(amplitude: float) -> Course:
    """Return the course of a ball that begins at rest on a table A sin t and leaves it where A sin t = g = 1."""
    text = TABLE.replace("restitution=0.5", "restitution=0.0")
    groups = read_groups(text.replace("motion_amplitude=1.0", f"motion_amplitude={amplitude}"))
    return Course(System([build(groups)]), [flint.arb(0), flint.arb(amplitude)], 1)


def test_a_ball_that_rests_on_a_table_is_thrown_where_it_falls_faster():
    course = resting(2.0)
    leave = math.pi / 6
    land, late = 1.0, 6.0
    for _ in range(60):
        t = (land + late) / 2
        flies = 2 * (math.sin(t) - 0.5 - math.sqrt(0.75) * (t - leave)) + (t - leave) ** 2 / 2 < 0
        land, late = (t, late) if flies else (land, t)
    modes, durations = zip(*((piece.mode, piece.duration) for piece in course.pieces), strict=True)
    assert modes == (("edge 0 closed",), ("line 0",), ("edge 0 closed",))
    assert durations == pytest.approx((leave, land - leave, 2 * math.pi - land), rel=1e-12)
    y = [flint.arb(1e-16), flint.arb(2.0 + 1e-15)]
    proof = course.prove(y)
    assert proof.stable is True and proof.radius < 1e-30
    assert abs(proof.state[0]) < 1e-30 and abs(proof.state[1] - 2) < 1e-30
    assert max(abs(complex(z.mid())) for z in proof.multipliers) < 1e-30


def test_the_enclosure_of_an_impact_holds_the_closed_form():
    # From about the height 1 it falls for sqrt(2), and leaves with half its speed.
    text, none = TABLE.split(",\n      motion")[0] + " /", np.zeros(0)
    stored = SimpleNamespace(
        groups=read_groups(text), reached=2.0, start=lambda: [1.0, 0.0], events=none, contacts=none
    )
    stored.time, stored.events, stored.contacts, stored.state = none, none, none, np.zeros((0, 2))
    motion = Motion(stored, 212, lambda *_: None)
    motion.x = motion.system.state([flint.arb(1, 1e-20), flint.arb(0)])
    assert motion.enclose().events == 1
    for height in (1 - flint.arb("0.9e-20"), 1 + flint.arb("0.9e-20")):
        for ball, exact in zip(motion.x.entries(), (flint.arb(0), (2 * height).sqrt() / 2), strict=False):
            assert ball.overlaps(exact) and ball.rad() < 1e-19


def test_what_rests_for_ever_is_not_alone():
    course = resting(0.9)
    assert course.events == 0
    with pytest.raises(Undecided, match="the derivative is singular"):
        course.prove([flint.arb(0), flint.arb(0.9)])


def test_a_machine_over_its_parameter_is_that_at_each_value():
    text = CASE.format(clearance=1.0).replace("amplitude=1.0, angular_frequency=2.0", "unbalance=0.5, frequency=1.0")
    tone = between(family(read_groups(text), "load%frequency", 1.0), flint.arb(0.25), True).loads[0][1]
    rate = 0.5 * (2 * flint.arb.pi()) ** 2
    assert abs(tone.cosine.value - rate * 1.25**2) < 1e-30 and abs(tone.cosine.slope - 2 * rate * 1.25) < 1e-30


def test_what_no_point_is_near_is_refused():
    value = 1.5
    state = (1.5 / (-3 + 0.4j)).real, -(1.5 / (-3 + 0.4j)).imag
    for label, reason in (("LP", "near 1"), ("PD", "near -1"), ("TR", "complex"), ("GR", "no contact grazes")):
        with pytest.raises(Disproved, match=f"no {label}: .*{reason}"):
            point(label, CASE.format(clearance=1.0), "load%amplitude", value, state, 0.0)


def settled(side: str) -> list[float]:
    """Return where the motion of the case with the clearance 0.25 comes back to, by Runge and Kutta."""

    def rate(t, x):
        push = max(x[0] - 0.25, 0.0) * (side != "lower") + min(x[0] + 0.25, 0.0) * (side != "upper")
        return np.array([x[1], math.cos(2 * t) - 0.2 * x[1] - x[0] - 3 * push])

    x, h = np.zeros(2), math.pi / 100
    for i in range(100 * 60):
        k = [rate(i * h, x)]
        for part in (0.5, 0.5, 1.0):
            k.append(rate((i + part) * h, x + part * h * k[-1]))
        x = x + h / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
    return [x[0], x[1] / 2]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("law='kelvin_voigt', stiffness=3.0", "law='table', displacement=0.0,0.01,0.5, force=0.0,0.03,1.5"),
        ("law='kelvin_voigt', stiffness=3.0", "law='table', displacement=0.0,1.0, force=0.0,3.0, line_damping=0.0"),
        (
            "stiffness=1.0, damping=0.2",
            "law='table', displacement=-1.0,-0.1,0.05,1.0, force=-1.0,-0.1,0.05,1.0, line_damping=0.2",
        ),
    ],
)
@pytest.mark.parametrize("side", ["upper", "lower", "both"])
def test_a_table_of_one_slope_is_the_law_without_a_table(old, new, side):
    text = CASE.format(clearance=0.25).replace("side='upper'", f"side='{side}'")
    y = [flint.arb(value) for value in settled(side)]
    found = []
    for each in (text, text.replace(old, new)):
        assert each is text or each != text
        system = System([build(read_groups(each))])
        found.append(Course(system, y, 1).prove(y))
    # Decimals of a table are the doubles next to them, so its slopes are not quite those of the other law.
    assert all(abs(one - two) < 1e-14 for one, two in zip(*(proof.state for proof in found), strict=True))
    assert found[1].events >= found[0].events > 0


def test_friction_that_slides_is_the_closed_form():
    # Den Hartog 1931: A^2 = V^2 - (F U)^2, V = 1/(1 - b^2), U = sin(pi/b)/(b (1 + cos(pi/b))), frequency b, friction F.
    b, force = 0.75, 0.125
    u = math.sin(math.pi / b) / (b * (1 + math.cos(math.pi / b)))
    amplitude = math.sqrt(1 / (1 - b * b) ** 2 - (force * u) ** 2)
    # At its maximum at the time 0 the load is cos(phi), with V cos(phi) = A, V sin(phi) = -F U.
    phase = math.atan2(-force * u, amplitude)
    text = f"""
&scene kind='lumped' /
&mass name='body', value=1.0 /
&spring between='body','frame', stiffness=1.0 /
&friction name='floor', between='body','frame', static_coefficient=0.25, normal_load=0.5 /
&load on='body', amplitude=1.0, angular_frequency={b}, phase={90 + math.degrees(phase):.17g} /
"""
    # It comes to rest at 0 and at half a period; the state is taken at a quarter, by the closed form of the way down.
    time = math.pi / 2 / b
    v = 1 / (1 - b * b)
    rest = amplitude - force - v * math.cos(phase), v * b * math.sin(phase)
    x = rest[0] * math.cos(time) + rest[1] * math.sin(time) + v * math.cos(b * time + phase) + force
    rate = -rest[0] * math.sin(time) + rest[1] * math.cos(time) - v * b * math.sin(b * time + phase)
    y = [flint.arb(x), flint.arb(rate / b)]
    course = Course(System([build(read_groups(text))], 0.25), y, 1)
    proof = course.prove(y)
    assert proof.events == 2 and [piece.mode[0] for piece in course.pieces] == ["backward", "forward", "backward"]
    assert abs(float(proof.state[0].mid()) - x) < 1e-14 and abs(float(proof.state[1].mid()) - rate / b) < 1e-14
    weak = text.replace("static_coefficient=0.25", "static_coefficient=4.0, kinetic_coefficient=0.25")
    course.system = System([build(read_groups(weak))], 0.25)
    with pytest.raises(Undecided, match="whether friction sticks"):
        course.prove(y)


NUMBERS = np.arange(1, 40001)


def lines(points: list[tuple[float, float]]) -> tuple[float, np.ndarray]:
    """Return the mean and Fourier's coefficients of straight lines between points; two at one time are a jump.

    Points are parts of the period and values.
    """
    k, mean, c = -2j * math.pi * NUMBERS, 0.0, np.zeros(NUMBERS.size, complex)
    for (a, u), (b, v) in pairwise(points):
        if b > a:
            c += (v * np.exp(k * b) - u * np.exp(k * a)) / k - (v - u) / (b - a) * (
                np.exp(k * b) - np.exp(k * a)
            ) / k**2
            mean += (u + v) / 2 * (b - a)
    return mean, c


def half_sine(part: float) -> tuple[float, np.ndarray]:
    """Return those of a half sine of this part of the period."""
    a, b = math.pi / part, 2 * math.pi * NUMBERS
    return 2 * part / math.pi, a * (1 + np.exp(-1j * b * part)) / (a**2 - b**2)


def is_the_series(shape: str, mean: float, c: np.ndarray, phase: float) -> None:
    """Compare the motion of the case without its wall under a shape of 4 s with its series of sines."""
    n, w = NUMBERS, math.pi / 2
    d = c / (1 - (n * w) ** 2 + 0.2j * n * w) * np.exp(2j * math.pi * n * phase)
    x, rate = mean + 2 * d.sum().real, 2 * (1j * n * d).sum().real
    text = CASE.format(clearance=9.0).replace("angular_frequency=2.0, phase=90.0", f"frequency=0.25, {shape}")
    y = [flint.arb(x), flint.arb(rate)]
    proof = Course(System([build(read_groups(text))], phase), y, 1).prove(y)
    # The terms of the displacement fall as 1/n^3 at least, those of the velocity as 1/n^2.
    assert abs(float(proof.state[0].mid()) - x) < 1e-9
    assert abs(float(proof.state[1].mid()) - rate) < 2e-5
    assert proof.stable is True


@pytest.mark.parametrize(
    ("shape", "points"),
    [
        ("shape='square', duty=0.25", [(0, 1), (0.25, 1), (0.25, -1), (1, -1)]),
        ("shape='square', delay=0.5", [(0, -1), (0.125, -1), (0.125, 1), (0.625, 1), (0.625, -1), (1, -1)]),
        ("shape='ramp', duration=1.0", [(0, 0), (0.25, 1), (1, 1)]),
        ("shape='pulse', duration=2.0", [(0, 1), (0.5, 1), (0.5, 0), (1, 0)]),
        ("shape='pulse', duration=2.0, rise=0.5", [(0, 0), (0.125, 1), (0.375, 1), (0.5, 0), (1, 0)]),
        ("shape='pulse', duration=4.0, rise=2.0", [(0, 0), (0.5, 1), (1, 0)]),
    ],
)
@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_loads_of_straight_lines_are_their_series(shape, points, phase):
    is_the_series(shape, *lines(points), phase)


def test_loads_of_half_sines_are_their_series():
    is_the_series("shape='half_sine', duration=1.2", *half_sine(0.3), 0.1)
    is_the_series("shape='half_sine', duration=4.0", *half_sine(1.0), 0.6)


@pytest.mark.parametrize("side", ["upper", "both"])
def test_a_table_that_is_not_to_be_left(side):
    law = "law='table', displacement=0.0,0.01,{}, force=0.0,0.03,{}, beyond='refuse'"
    text = CASE.format(clearance=0.25).replace("'upper'", f"'{side}'")
    y = [flint.arb(value) for value in settled(side)]
    for reach in (0.9, 0.05):
        table = text.replace("law='kelvin_voigt', stiffness=3.0", law.format(reach, 3 * reach))
        system = System([build(read_groups(table))])
        if reach == 0.9:
            assert Course(system, y, 1).prove(y).events >= 4
        else:
            with pytest.raises(Disproved, match="it leaves the table of wall"):
                Course(system, y, 1)


def test_an_error_over_time_is_one_of_the_teeth():
    """The same sine, said by the order of the shaft."""
    text = """
&scene kind='lumped' /
&inertia name='a', value=1.0 /
&inertia name='b', value=2.0 /
&gear_mesh name='mesh', between='a','b', radius=0.1,0.2, teeth=10,20, stiffness=2.0, backlash=0.0, {} /
&rotation speed_rpm=60.0, of='a' /
"""
    said = "error_sine=1.0e-3", "motion_amplitude=1.0e-3, motion_order=10.0"
    tones = [build(read_groups(text.format(error))).contacts[0].tones for error in said]
    assert len(tones[0]) == 1
    assert repr(tones[0]) == repr(tones[1])
    with pytest.raises(NotCovered, match="the motion of mesh"):
        build(read_groups(text.format("motion_amplitude=1.0e-3, motion_shape='half_sine', motion_duration=0.1")))
