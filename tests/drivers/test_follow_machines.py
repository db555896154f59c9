"""Machines that razy-follow follows: modes that change, equal halves, closed branches, springs that are no lines."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from branches import follow, labels, multipliers, points
from programs import GEAR_PAIR, SOURCE, start
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve


def test_nothing_that_is_felt_is_nothing_to_follow():
    text = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=4.0, damping=0.1 /\n"
    text += "&load on='m', amplitude=1.0, frequency=0.2 /\n&motion t_end=10.0 /\n"
    text += "&record observable='state', what='trajectory' /\n"
    Path("linear.nml").write_text(text + "&follow parameter='load(1)%amplitude', first=1.0, last=2.0 /\n")
    done = start("razy-follow", "linear.nml")
    assert done.returncode == 2
    assert "record a displacement" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("key", ["disk(1)%mass", "bearing(2)%radial_stiffness"])
def test_modes_that_change_with_the_parameter(key):
    """Shafts bend alike in two planes: in modal coordinates the motion is followed all the same."""
    text = (SOURCE / "inputs" / "thesis" / "fig_4_16.nml").read_text()
    text += "&follow parameter='{}', first={}, last={}, settle=300 /\n"
    ends = {"disk(1)%mass": (2.3, 2.4), "bearing(2)%radial_stiffness": (3.5e8, 3.6e8)}[key]
    Path("modes.nml").write_text(text.format(key, *ends))
    with follow(Path("modes.nml")) as file:
        assert file["special/label"].asstr()[-1] == "EP"
        assert file["special/parameter"][-1] == ends[1]


DUFFING = """
&scene   kind='lumped' /
&mass    name='body', value=1.0 /
&spring  between='body','frame', stiffness=1.0, damping=0.1 /
&stop    name='cubic', between='body','frame', side='both', clearance=0.0, law='hunt_crossley', stiffness=0.05,
         exponent=3.0, hysteresis=0.0 /
&load    on='body', amplitude=1.0, angular_frequency=1.0, phase=90.0 /
&motion  t_end=100.0, start='zero', integrator='dop853', relative_tolerance=1e-12, absolute_tolerance=1e-14 /
&record  observable='displacement', what='extrema' /
&follow  parameter='load%angular_frequency', first=1.1, last=1.7, doublings=0 /
"""


def duffing_fold(unknowns, phase):
    """x'' + 0.1 x' + x + 0.05 x³ = cos(ωt) by SciPy: 0 for a periodic motion with a multiplier 1."""
    x, v, omega = unknowns

    def rates(t, y):
        field = np.array([[0.0, 1.0], [-1.0 - 0.15 * y[0] ** 2, -0.1]])
        force = np.cos(omega * t) - y[0] - 0.05 * y[0] ** 3 - 0.1 * y[1]
        return np.concatenate(([y[1], force], (field @ y[2:].reshape(2, 2)).ravel()))

    start = [x, v, 1.0, 0.0, 0.0, 1.0]
    end = solve_ivp(
        rates, np.array([phase, phase + 1.0]) * 2 * np.pi / omega, start, method="DOP853", rtol=1e-13, atol=1e-14
    ).y[:, -1]
    return [end[0] - x, end[1] - v, np.linalg.det(end[2:].reshape(2, 2) - np.eye(2))]


def test_folds_of_the_duffing_oscillator():
    Path("duffing.nml").write_text(DUFFING)
    with follow(Path("duffing.nml")) as file:
        folds = file["special/point"][:][file["special/label"].asstr()[:] == "LP"]
        assert folds.size == 2
        for fold in folds:
            omega = file["point/load.angular_frequency"][fold]
            found = fsolve(
                duffing_fold, [*file["point/state"][fold], omega * 1.0001], (file["point/phase"][fold],), xtol=1e-13
            )
            assert omega == pytest.approx(found[2], rel=1e-11)


ISOLA = """
&scene kind='lumped' /
&mass name='m', value=1.0 /
&spring between='m','frame', stiffness=1.0, damping=0.1 /
&stop name='st', between='m','frame', side='both', clearance=1.0, stiffness=20.0 /
&load on='m', amplitude=3.0, angular_frequency=2.2, phase=90.0 /
&record observable='displacement', what='extrema' /
&initial on='m', displacement=-1.04145, velocity=0.35183 /
&motion t_end=600.0, start='given' /
&follow parameter='load%angular_frequency', first=0.8, last=4.5, from=2.2, period=2, doublings=0 /
"""


def test_a_closed_branch_goes_round_once():
    Path("isola.nml").write_text(ISOLA)
    with follow(Path("isola.nml")) as file:
        assert file["special/label"].asstr()[:].tolist() == ["PD", "PD", "LP", "GR", "GR", "LP", "EP"]
        assert file["special/parameter"][-1] == pytest.approx(2.2, rel=1e-14)
        assert file["branch/ending"].asstr()[:].tolist() == ["the first motion again: the branch is closed"]
        first, last = file["point/state"][0], file["point/state"][-1]
        stable = file["point/stable"][:]
    # Two periods of the excitation round, or at once.
    assert np.allclose(first, last, rtol=1e-9) or stable[0] == stable[-1]


def test_a_machine_that_only_a_damper_holds():
    """Its place is free, so its motion is one of three unknowns; multipliers are those of the linear machine."""
    Path("driveline.nml").write_text("""
&scene   kind='lumped', title='driveline' /
&mass    name='motor', value=1.0 /
&mass    name='load', value=2.0 /
&spring  between='motor','load', stiffness=3.0, damping=0.2 /
&damper  between='load','frame', damping=0.4 /
&stop    name='far', between='motor','load', side='both', clearance=5.0, stiffness=10.0 /
&load    on='motor', amplitude=0.1, angular_frequency=1.5 /
&motion  t_end=10.0, start='zero' /
&record  observable='relative_displacement', what='extrema' /
&follow  parameter='load%angular_frequency', first=1.5, last=1.7 /
""")
    mass, damping = np.diag([1.0, 2.0]), np.array([[0.2, -0.2], [-0.2, 0.6]])
    stiffness = 3.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    system = np.block(
        [[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]]
    )
    rates = np.linalg.eigvals(system)
    rates = rates[np.abs(rates) > 1e-9]
    assert rates.size == 3
    with follow(Path("driveline.nml")) as file:
        omega = file["point/load.angular_frequency"][:]
        assert omega[-1] == 1.7 and len(omega) < 60 and list(file["special/label"].asstr()[:]) == ["EP"]
        for point in (0, len(omega) - 1):
            expected = np.sort_complex(np.exp(rates * 2 * np.pi / omega[point]))
            assert multipliers(file, point) == pytest.approx(expected, abs=1e-11)


def test_equal_halves():
    """A gear pair of equal halves feels fewer coordinates than one whose springs differ: branches go through it."""
    half = 62905.0
    over = {"follow__parameter": "'spring(1)%stiffness'", "follow__last": 66000.0, "follow__settle": 300}
    with follow(GEAR_PAIR, follow__first=60000.0, follow__values=half, **over) as file:
        assert file["special/label"].asstr()[:].tolist() == ["UZ", "EP"]
        at = file["special/point"][0]
        whole = file["point/multiplier"][at], file["point/state"][at]
    with follow(GEAR_PAIR, "--force", follow__first=half, **over) as file:
        assert file["special/label"].asstr()[:].tolist() == ["EP"]
        assert file["point/multiplier"][0] == pytest.approx(whole[0], abs=1e-9)
        assert file["point/state"][0] == pytest.approx(whole[1], rel=1e-8)


def test_equal_halves_move_a_fold_alike():
    """What one of two equal springs moves, so does the other."""
    keys = "'spring(1)%stiffness','spring(2)%stiffness'"
    with follow(
        GEAR_PAIR, follow__first=2600.0, follow__last=2370.0, follow__doublings=0, follow__sensitivities=keys
    ) as file:
        one, other = (file[f"sensitivity/spring({i}).stiffness"][:] for i in (1, 2))
    assert np.isfinite(one).any()
    assert one == pytest.approx(other, rel=1e-4, nan_ok=True)


@pytest.mark.parametrize("stop", ["law='rigid', restitution=1.0", "stiffness=10.0"])
def test_a_motion_for_every_energy(stop):
    """Without damping and excitation closed motions are not alone, which is said."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /", "&spring between='m','frame', stiffness=1.0 /"]
    text += [f"&stop name='wall', between='m','frame', clearance=0.5, {stop} /"]
    text += ["&initial on='m', velocity=1.0 /", "&motion t_end=100.0, start='given' /"]
    text += ["&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='stop%clearance', first=0.4, last=0.6, from=0.5 /"]
    Path("free.nml").write_text("\n".join(text) + "\n")
    done = start("razy-follow", "free.nml")
    assert done.returncode == 1 and "one for every energy" in done.stderr and done.stderr.count("\n") == 1


def test_at_rest():
    """Two pairs of teeth all the time do not excite the pair: it stays where it starts, but for rounding."""
    text = (SOURCE / "inputs" / "mesh_stiffness.nml").read_text().replace("contact_ratio=1.6", "contact_ratio=2.0")
    Path("rest.nml").write_text(text + "&follow parameter='rotation%speed_rpm', first=1050.0, last=1950.0 /\n")
    done = start("razy-follow", "rest.nml")
    assert done.returncode == 1 and "at rest" in done.stderr and done.stderr.count("\n") == 1


def test_a_body_that_rides_along():
    """What friction alone holds on another body may lie anywhere on it: it holds no motion, and slides in one."""
    text = "&mass name='table', value=0.5 /\n&mass name='load', value=1.0 /\n"
    text += "&spring between='table','frame', stiffness=100.0, damping=1.0 /\n"
    text += "&friction name='slip', between='table','load', static_coefficient=1.0, normal_load=1.0 /\n"
    text += "&load on='table', amplitude=20.0, angular_frequency=2.0 /\n&motion t_end=900.0, start='zero' /\n"
    text += "&record observable='displacement', of='table', what='extrema' /\n"
    Path("rides.nml").write_text(text + "&follow parameter='load(1)%amplitude', first=20.0, last=26.0 /\n")
    with follow(Path("rides.nml")) as file:
        assert list(file["special/label"].asstr()[[0, -1]]) == ["ST", "EP"]
        # The load sticks up to m a = 1 N, a = 4 X, X = A/|100 - 1.5 4 + 2i|.
        response = 1 / (94.0 + 2.0j)
        limit = 0.25 / abs(response)
        assert file["special/parameter"][0] == pytest.approx(limit, rel=1e-9)
        amplitude = file["point/load(1).amplitude"][:]
        # Multipliers of the load's speed, 0, and of the table with the load on it.
        decay = np.exp((-1.0 / 3.0) * np.pi)
        for i in np.flatnonzero(amplitude < 0.999 * limit):
            state = [amplitude[i] * response.imag, 2 * amplitude[i] * response.real]
            found = file["point/state"][i].reshape(2, 2)
            assert [found[0, 0], found[1, 0], found[1, 1]] == pytest.approx([state[0], *state[1:] * 2], rel=1e-9)
            assert np.sort(np.abs(multipliers(file, i))) == pytest.approx([0.0, decay, decay], abs=1e-9)
            assert file["point/stable"][i] == 1


@pytest.mark.parametrize("shape", ["square", "ramp"])
def test_an_impact_that_meets_a_jump_of_the_load(shape):
    """The branch has a corner there, beside the motion in closed form, and goes on around it."""
    text = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0, damping=0.1 /\n"
    text += "&stop name='wall', between='m','frame', side='upper', clearance=0.0, law='rigid', restitution=0.8 /\n"
    text += "&motion t_end=400.0, start='zero' /\n"
    if shape == "square":
        text += "&load on='m', shape='square', amplitude=1.0, angular_frequency=4.5 /\n"
        text += "&follow parameter='load%angular_frequency', first=4.5, last=3.5 /\n"
        guess = [1.9, 4.0]
    else:
        text += "&load on='m', shape='ramp', amplitude=2.0, duration=0.9, frequency=0.5 /\n&load on='m', value=-1.0 /\n"
        text += "&follow parameter='load(1)%frequency', first=0.6, last=0.35 /\n"
        guess = [-1.0, 0.4]
    Path("jump.nml").write_text(text)
    matrix = np.array([[0.0, 1.0], [-1.0, -0.1]])

    def line(x, force, rate, time):
        """The state after this time under a force that rises with this rate."""
        rest = np.array([force - 0.1 * rate, rate])
        return rest + [rate * time, 0.0] + expm(matrix * time) @ (x - rest)

    def miss(unknowns):
        x = np.array([0.0, unknowns[0]])
        if shape == "square":
            for i in range(4):
                x = line(x, (-1.0) ** i, 0.0, np.pi / unknowns[1])
        else:
            x = line(line(x, -1.0, 2.0 / 0.9, 0.9), 1.0, 0.0, 1.0 / unknowns[1] - 0.9)
        return [x[0], -0.8 * x[1] - unknowns[0]]

    corner = fsolve(miss, guess, xtol=1e-13)[1]
    with follow(Path("jump.nml")) as file:
        assert points(file, "CH") == pytest.approx([corner], rel=1e-11)
        assert "MX" not in file["special/label"].asstr()[:]
        (at,) = file["special/point"][:][file["special/label"].asstr()[:] == "CH"]
        assert np.count_nonzero(file["point/branch"][at:] == 1) > 10


def test_a_fold_where_an_impact_meets_a_jump_that_turns_the_branch_by_little():
    """Of a motion that grows two-hundredfold both sides of the fold lie side by side."""
    text = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0, damping=0.1 /\n"
    text += "&stop name='wall', between='m','frame', side='upper', clearance=0.0, law='rigid', restitution=0.8 /\n"
    text += "&load on='m', shape='ramp', amplitude=2.0, duration=1.0, frequency=0.5 /\n&load on='m', value=-1.0 /\n"
    text += "&motion t_end=400.0, start='zero' /\n&follow parameter='load(1)%frequency', doublings=0,"
    Path("one.nml").write_text(text + " first=0.58, last=0.57 /\n")
    follow(Path("one.nml")).close()
    # A motion of four periods among those that motions='all' finds.
    with h5py.File("one.h5", "r+") as file:
        for name, value in {
            "load(1).frequency": 0.6825555087071256,
            "phase": 0.26340349422684683,
            "multiplicity": 4,
            "period": 4 / 0.6825555087071256,
            "state": [-0.21681939, -0.59103828],
        }.items():
            file[f"point/{name}"][0] = value
    Path("fold.nml").write_text(text + " first=0.684, last=0.68, start_file='one.h5', start_point=0 /\n")
    with follow(Path("fold.nml")) as file:
        assert points(file, "CH") == pytest.approx([0.68228282078], rel=1e-10)
        ends = file["point/load(1).frequency"][:][file["point/branch"][:] == 1][[0, -1]]
        assert ends.max() == 0.684
        assert "MX" not in file["special/label"].asstr()[:]


@pytest.mark.parametrize("phase", [200, 300])
def test_stops_of_a_symmetric_machine_that_close_at_once(phase):
    """Which of them is first is rounding, and no change of contacts."""
    with follow(SOURCE / "inputs" / "vibropress.nml", exciter__phase=phase) as file:
        assert [label for label, _ in labels(file, 1)] == ["PD", "PD", "EP"]


def test_a_line_of_a_table_is_touched_where_another_holds_under_load():
    """The force at rest is no jump: the branch goes on past the touch, whose derivative jumps by the line's damping."""
    case = SOURCE / "inputs" / "two_rate_coupling.nml"
    places = {}
    for phase in (0, 37):
        settings = {"load(1)%phase": phase, "follow%first": 11.3, "follow%last": 10.1, "follow%doublings": 0}
        options = [part for key, value in settings.items() for part in ("--set", f"{key}={value}")]
        with follow(case, "--force", *options) as file:
            assert file["branch/ending"].asstr()[:].tolist() == ["the end of the range"]
            found, places[phase] = zip(*labels(file, 1), strict=True)
            assert found == ("LP", "LP", "GR", "PD", "EP")
    assert places[37] == pytest.approx(places[0], rel=1e-12)


def test_an_undamped_start_that_comes_back_to_nothing_near():
    """The motion of the undamped oscillator on a stop without a gap is found from 1.8 rad/s as well as from 2.2."""
    doubling = []
    for first in (1.8, 2.2):
        text = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0 /\n"
        text += "&stop name='s', between='m','frame', side='upper', clearance=0.0, stiffness=3.0 /\n"
        text += "&load on='m', amplitude=1.0, angular_frequency=1.0 /\n"
        text += "&motion t_end=1.0, start='zero', integrator='exact' /\n"
        text += f"&follow parameter='load%angular_frequency', first={first}, last=2.3, doublings=0 /\n"
        Path("bilinear.nml").write_text(text)
        with follow(Path("bilinear.nml"), "--force") as file:
            doubling += points(file, "PD").tolist()
    assert len(doubling) == 2
    assert doubling[0] == pytest.approx(doubling[1], rel=1e-11)


# Friction that acts while a stop is closed; a spring that a gap switches on, which motions touch at several places; a
# motion of two periods that becomes one of one where this touches a stop; impacts that become soft between two others;
# a pitchfork, where Newton's method comes to motions of either branch.
LOADED = {
    "friction": """
&mass name='b0', value=1.2 /
&spring between='b0','frame', stiffness=1.0, damping=0.14 /
&mass name='b1', value=1.9 /
&spring between='b1','b0', stiffness=2.0, damping=0.12 /
&stop name='s', between='b1','frame', side='upper', clearance=0.0, stiffness=20.0, damping=0.1 /
&mass name='c', value=0.5 /
&spring between='c','frame', stiffness=1.0, damping=0.1 /
&friction name='f', between='c','b1', static_coefficient=0.3, normal_contact='s' /
&load on='b0', value=-0.5, amplitude=1.1, angular_frequency=1.5, phase={0} /
&motion t_end=200, start='zero' /
&follow parameter='load%angular_frequency', first=1.605, last=1.65 /
""",
    "switched spring": """
&mass name='b0', value=1.5 /
&spring between='b0','frame', stiffness=0.8, damping=0.12 /
&mass name='b1', value=1.8 /
&spring between='b1','b0', stiffness=2.4, damping=0.09 /
&stop name='s', between='b1','frame', side='both', clearance=0.5, law='switched_spring', stiffness=1.2 /
&load on='b0', value=0.2, amplitude=1.4, angular_frequency=1.8, phase={0} /
&motion t_end=200, start='zero' /
&follow parameter='load%angular_frequency', first=1.8, last=2.12 /
""",
    "halves": """
&mass name='b0', value=0.5 /
&spring between='b0','frame', stiffness=0.8, damping=0.12 /
&stop name='s', between='b0','frame', side='upper', clearance=0.1, stiffness=20.0, damping=0.1 /
&mass name='c', value=0.5 /
&spring between='c','frame', stiffness=1.0, damping=0.1 /
&friction name='f', between='c','b0', static_coefficient=0.3, normal_contact='s' /
&load on='b0', value=0.3, amplitude=1.0, angular_frequency=1.2, phase={0} /
&motion t_end=250, start='zero' /
&follow parameter='load%angular_frequency', first=1.2, last=1.5, doublings=1 /
""",
    "soft impact": """
&mass name='b0', value=0.9 /
&spring between='b0','frame', stiffness=1.0, damping=0.04 /
&mass name='b1', value=1.8 /
&spring between='b1','b0', stiffness=1.9, damping=0.05 /
&stop name='s', between='b1','frame', side='upper', clearance=0.4, law='rigid', restitution=0.8 /
&load on='b0', value=0.1, amplitude=0.4, angular_frequency=1.0, phase={0} /
&load on='b0', amplitude=1.0, angular_frequency=2.0, phase={1} /
&motion t_end=300, start='zero' /
&follow parameter='load(1)%angular_frequency','load(2)%angular_frequency', factor=1.0,2.0,
        first=1.0, last=1.4, doublings=1 /
""",
    "pitchfork": """
&mass name='b0', value=4.7 /
&mass name='b1', value=1.5 /
&mass name='b2', value=0.6 /
&spring between='b0','frame', stiffness=470, damping=0.471 /
&spring between='b1','frame', stiffness=1.09e+03, damping=4.04 /
&spring between='b0','frame', stiffness=393, damping=7.86 /
&spring between='b1','frame', stiffness=125, damping=2.5 /
&spring between='b2','frame', stiffness=50.9, damping=1.02 /
&spring between='b1','b0', stiffness=92.5, damping=0.118 /
&stop name='s0', between='b1','b2', side='lower', clearance=0.00171, law='switched_spring',
      stiffness=160.0, damping=3.96 /
&stop name='s1', between='b1','frame', side='lower', clearance=0.0041, law='rigid', restitution=0.0 /
&stop name='s2', between='b1','b0', side='both', clearance=0.000904, law='rigid', restitution=0.3 /
&load on='b0', amplitude=0.614, angular_frequency=16.67, phase={0} /
&load on='b2', value=-0.22 /
&motion t_end=24.0, start='zero' /
&follow parameter='load(1)%angular_frequency', first=16.67, last=23.3, doublings=1 /
""",
}


@pytest.mark.parametrize("machine", LOADED)
def test_labels_do_not_say_where_time_begins(machine):
    """An open stop has no friction; beyond a touch motions with the impact go on beside those without it."""
    found = []
    for phase in (0, 137):
        Path("begun.nml").write_text(LOADED[machine].format(phase, (236 + 2 * phase) % 360))
        with follow(Path("begun.nml"), "--force") as file:
            special = file["special"]
            place = [f"{value:.11g}" for value in special["parameter"]]
            found.append(sorted(zip(special["label"].asstr()[:], place, strict=True)))
    assert found[0] == found[1]
    assert len(found[0]) > 4


PAIR = """&mass     name='box', value=2.0 /
&mass     name='ball', value=0.5 /
&stop     name='walls', between='ball','box', side='both', clearance=0.01, law='rigid', restitution=0.6 /
&load     on='box', amplitude=1.0, frequency=5.0 /
&motion   t_end=40.0, start='zero' /
&record   observable='relative_displacement', of='walls', what='extrema' /
&follow   parameter='load%amplitude', first=15.0, last=1.0 /
"""


def half_of_a_pair(load):
    """Half a period of the symmetric motion in which the ball hits both walls: det(∂H + 1)."""
    rate, half, impact = 10 * np.pi, 0.1, 0.6
    push, lean = load / 2, np.pi / 2 * (1 + impact) / (1 - impact)
    phase = np.pi - np.arcsin(-0.01 * rate**2 / push / np.hypot(1, lean)) - np.arctan(lean)
    arrives, leaves = np.array([-2.0, -2 * impact]) / (1 - impact) * push / rate * np.cos(phase)
    later = -np.array([push * np.sin(phase) * half - leaves, half]) / arrives
    speed = impact * (push * np.sin(phase) * (later + [1.0, 0.0]) + [0.0, 1.0])
    return np.linalg.det(np.array([later, speed]) + np.eye(2))


def test_a_lost_symmetry_comes_back():
    """From a motion that hits one wall harder to one that hits both alike, in closed form, and to its fold."""
    Path("pair.nml").write_text(PAIR)
    with follow(Path("pair.nml")) as file:
        broken = labels(file, 1)
        crossing = brentq(half_of_a_pair, 14.0, 15.0, xtol=1e-14)
        assert broken == [("BP", pytest.approx(crossing, rel=1e-11)), ("EP", 15.0)]
        assert not file["branch/unexplained"][:].any()
        least = 0.02 * (10 * np.pi) ** 2 / np.hypot(1, 2 * np.pi)
        assert [points(file, "LP", branch).tolist() for branch in (2, 3)] == [[], [pytest.approx(least, rel=1e-11)]]
