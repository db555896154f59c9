"""The independent proof of periodic motions."""

import math

import pytest

flint = pytest.importorskip("flint")

from razy.check.machine import NotCovered, build, read_groups  # noqa: E402
from razy.check.motion import System  # noqa: E402
from razy.check.proof import Course, Disproved  # noqa: E402

CASE = """
&scene kind='lumped' /
&mass name='body', value=1.0 /
&spring between='body','frame', stiffness=1.0, damping=0.2 /
&stop name='wall', between='body','frame', side='upper', clearance={clearance}, law='kelvin_voigt', stiffness=3.0 /
&load on='body', amplitude=1.0, angular_frequency=2.0, phase=90.0 /
"""


def course(clearance: float, y: tuple[float, float], periods: int = 1) -> Course:
    flint.ctx.prec = 212
    system = System(build(read_groups(CASE.format(clearance=clearance))))
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
    flint.ctx.prec = 212
    system = System(build(read_groups(CASE.format(clearance=1.0))), math.acos(0.8) / (2 * math.pi))
    y = [flint.arb(response.real), flint.arb(-response.imag)]
    proof = Course(system, y, 1).prove(y)
    assert abs(float(proof.state[0].mid()) - response.real) < 1e-15


def test_motion_through_a_stop_is_not_proved():
    response = 1 / (-3 + 0.4j)
    y = [flint.arb(response.real), flint.arb(-response.imag)]
    free = course(1.0, (response.real, -response.imag))
    free.system = System(build(read_groups(CASE.format(clearance=0.2))))
    with pytest.raises(Disproved, match="passes through wall"):
        free.prove(y)


def test_period_that_is_not_the_least_is_refused():
    response = 1 / (-3 + 0.4j)
    y = [flint.arb(response.real), flint.arb(-response.imag)]
    with pytest.raises(Disproved, match="not the least"):
        course(1.0, (response.real, -response.imag), 2).prove(y)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("stiffness=1.0, damping=0.2", "law='table', displacement=0.0,1.0, force=0.0,1.0", "the law 'table'"),
        ("amplitude=1.0,", "amplitude=1.0, shape='square',", "no sine"),
        ("amplitude=1.0,", "amplitude=1.0, file='load.csv',", "no sine"),
        ("law='kelvin_voigt', stiffness=3.0", "law='table'", "the law 'table'"),
    ],
)
def test_what_is_not_covered_says_so(old, new, says):
    with pytest.raises(NotCovered, match=says):
        build(read_groups(CASE.format(clearance=1.0).replace(old, new)))
