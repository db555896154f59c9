"""razy-follow: values that are known, what it leaves, the picture of it."""

import re
from pathlib import Path

import h5py
import matplotlib.image
import numpy as np
import pytest
from branches import HYSTERESIS, IMPACT, NORMAL_FORM, PAIR_MAP, follow, multipliers, points
from programs import GEAR_PAIR, SOURCE, attribute, left, plot, sets, start, succeed
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def test_doubling_of_the_gear_pair():
    """The square of the difference of maxima in docs/gear_pair.md is zero there."""
    with follow(GEAR_PAIR, follow__first=1570, follow__last=1584) as file:
        (doubling,) = points(file, "PD")
        assert file["extrema/mesh_deformation/value"].attrs["long_name"] == "extrema of mesh deformation"
    assert doubling == pytest.approx(1580.463, abs=5e-4)


def test_cascade_of_the_gear_pair():
    """Each doubling begins a branch, and what happens next to it is not leapt over."""
    known = [1580.46312641823, 1588.5238536236, 1590.603627690, 1591.230209522, 1591.354170383]
    with follow(SOURCE / "inputs/thesis/fig_4_7.nml") as file:
        for branch, doubling in enumerate(known, start=1):
            assert points(file, "PD", branch) == pytest.approx([doubling], rel=1e-11)
        # The doubled branch turns twice where it begins, at first beside a grazing that is 1.4e-4 rpm away.
        assert points(file, "LP", 2) == pytest.approx([1580.496644143, 1580.241570294], rel=1e-11)
        assert points(file, "GR", 2)[0] == pytest.approx(1580.496503697, rel=1e-11)


def test_tori_in_one_step_with_a_fold_or_a_doubling():
    """Their pairs become real before the step ends; with ten times as many steps they were found by themselves."""
    with follow(GEAR_PAIR, follow__last=1800.0, follow__doublings=2) as file:
        four = file["point/multiplicity"][:][file["special/point"][:]] == 4
        found = file["special/parameter"][:][four & (file["special/label"].asstr()[:] == "TR")]
    for torus in (1877.5605847873, 1931.6128501119):
        assert np.abs(found - torus).min() < 1e-8


def test_a_range_that_ends_just_beyond_a_fold():
    """It is 2.5e-10 of the parameter from the start, in a range of 2e-6; what lies beyond is no motion."""
    speed = 1720.3066037
    ends = {
        "motor": (0.0015940073801400043, 0.03225675769117786),
        "pinion": (4.007849860153679e-06, -2.3316901937857075),
    }
    ends |= {
        "wheel": (-4.00784986015368e-06, 2.331690193785708),
        "output": (-0.0015940073801400045, -0.03225675769117787),
    }
    text = GEAR_PAIR.read_text()
    for name, (displacement, velocity) in ends.items():
        text += f"&initial on='{name}', displacement={displacement!r}, velocity={velocity!r} /\n"
    Path("beyond.nml").write_text(text)
    values = {"rotation__speed_rpm": repr(speed), "motion__start": "'given'"}
    values |= {"follow__first": repr(speed), "follow__last": 1720.31, "follow__period": 2, "follow__settle": 20}
    with follow(Path("beyond.nml"), **values) as file:
        assert list(file["special/label"].asstr()[:]) == ["LP", "EP"]
        assert file["special/parameter"][:] == pytest.approx([1720.306604124594, speed], rel=1e-14)


def test_multipliers_of_the_gear_pair():
    with follow(GEAR_PAIR, follow__first=2500, follow__last=2510) as file:
        found = multipliers(file)
    assert np.abs(found) == pytest.approx([0.8202, 0.1133, 0.9096, 0.9096], abs=5e-5)
    # Both halves of the machine are alike, and the mesh, which has no damping, feels the twist of one shaft for both.
    damping = 5e-4 * 6.2905e4 * (1 / 0.1 + 1 / 0.00794)
    period = 60 / 2500 / 40
    assert np.prod(found) == pytest.approx(np.exp(-damping * period), rel=1e-9)


def test_impact_oscillator():
    """A rigid stop without loss: the closed form of the source gives the multipliers, the speed and the doubling."""
    with follow(IMPACT) as file:
        found = multipliers(file)
        (doubling,) = points(file, "PD")
        period, state = file["point/period"][0], file["point/state"][0]
    assert found == pytest.approx([0.59637 - 0.45737j, 0.59637 + 0.45737j], abs=5e-6)
    assert np.prod(found).real == pytest.approx(np.exp(-0.2 * period), rel=1e-10)
    assert doubling == pytest.approx(2.651807017, abs=5e-10)
    initial = {"initial__displacement": repr(float(state[0])), "initial__velocity": repr(float(state[1]))}
    trajectory = ["--set", "record(1)%what='trajectory'", "--set", "record(2)%what='trajectory'"]
    succeed("razy-run", IMPACT, "--output", "run.h5", *trajectory, *sets(motion__t_end=repr(float(period)), **initial))
    with h5py.File("run.h5") as file:
        (impact,) = file["event/time"][:]
        at = np.isclose(file["time"][:], impact, rtol=0.0, atol=1e-12)
        assert np.abs(file["observable/velocity"][:][at]) == pytest.approx(1.61640645845, abs=5e-11)
        end = file["observable/displacement"][-1], file["observable/velocity"][-1]
    assert end == pytest.approx(tuple(state), abs=1e-11)


def test_stop_that_stays_closed():
    """A mass held on a rigid stop: the other is a damped oscillator, and what is held has multipliers of 0."""
    text = ["&scene kind='lumped' /", "&mass name='free', value=1.0 /", "&mass name='held', value=1.0 /"]
    text += ["&spring between='free','frame', stiffness=100.0, damping=0.5 /"]
    text += ["&spring between='free','held', stiffness=50.0, damping=0.1 /"]
    text += ["&stop name='s', between='held','frame', side='lower', clearance=0.0, law='rigid', restitution=0.3 /"]
    text += ["&load on='held', value=-50.0 /", "&load on='free', amplitude=4.0, angular_frequency=8.0 /"]
    text += ["&motion t_end=40.0, start='zero', integrator='exact' /"]
    text += ["&record observable='displacement', of='free', what='extrema' /"]
    text += ["&follow parameter='load(2)%angular_frequency', first=8.0, last=9.0 /"]
    Path("held.nml").write_text("\n".join(text) + "\n")
    with follow(Path("held.nml")) as file:
        found, largest = multipliers(file), file["extrema/displacement.free/value"][0]
        period = file["point/period"][0]
    damped = np.exp((-0.3 + 1j * np.sqrt(150 - 0.09)) * period)
    assert found == pytest.approx(np.sort_complex([0, 0, damped, damped.conjugate()]), abs=1e-12)
    assert abs(largest) == pytest.approx(4 / np.hypot(150 - 64, 0.6 * 8), rel=1e-12)


def one_impact(omega, periods, damping=0.2):
    """Find the orbit x'' + 0.2 x' + x = cos(ωt) of one elastic impact with x <= 0 in so many periods, in closed form.

    Nobody asks whether it stays behind the wall between impacts. Return its highest place there, and 1 + tr + det of
    the derivative of its map, which is 0 at a doubling.
    """
    decay, duration = damping / 2, 2 * np.pi * periods / omega
    turn = np.sqrt(1 - decay**2)
    shrunk, c, s = np.exp(-decay * duration), np.cos(turn * duration), np.sin(turn * duration)
    response = 1 / (1 - omega**2 + 1j * damping * omega)
    # x = Re(p e^{iωt}) - r e^{-decay t} (cos - k sin), r = Re(p), from one impact to the next; v' at its ends over r
    k = (c - 1 / shrunk) / s
    first, last = decay + turn * k, shrunk * (decay * (c - k * s) + turn * (s + k * c))
    slope = -(first + last) / 2
    for side in (1, -1):
        r = side * abs(response) / np.hypot(1, slope / omega)
        p, after = r * (1 - 1j * slope / omega), (slope + first) * r
        if after < 0:
            break
    t = np.linspace(0, duration, 20001)[1:-1]
    place = (p * np.exp(1j * omega * t)).real - r * np.exp(-decay * t) * (np.cos(turn * t) - k * np.sin(turn * t))
    flight = shrunk * np.array([[c + decay / turn * s, s / turn], [-s / turn, c - decay / turn * s]])
    load = (p / response).real
    impact = np.array([[-1, 0], [-2 * load / after, -1]])
    matrix = impact @ flight
    top = 100 + place[100:-100].argmax()
    # The parabola through three places.
    low, middle, high = place[top - 1 : top + 2]
    highest = middle - (low - high) ** 2 / (8 * (low - 2 * middle + high))
    return highest, 1 + np.trace(matrix) + np.linalg.det(matrix)


def test_no_label_at_orbits_through_the_wall():
    """The orbit of one impact in two periods doubles in closed form where it passes the wall in between: not here."""
    doubling = brentq(lambda omega: one_impact(omega, 2)[1], 3.25, 3.4)
    grazing = brentq(lambda omega: one_impact(omega, 2)[0], 3.1, 3.25)
    false = [brentq(lambda omega: one_impact(omega, 2)[1], *ends) for ends in ((1.58, 1.66), (1.9, 1.96), (2.0, 2.06))]
    assert all(one_impact(omega, 2)[0] > 0.01 for omega in false)
    with follow(IMPACT, follow__first=4.0, follow__last=1.5, follow__period=2, follow__doublings=0) as file:
        # There it ends; motions that touch the wall in between are another branch.
        assert file["special/label"].asstr()[:2].tolist() == ["PD", "GR"] and points(file, "PD", 1) == pytest.approx(
            [doubling], rel=1e-11
        )
        assert points(file, "GR", 1) == pytest.approx([grazing], rel=1e-11)
        assert file["extrema/displacement/value"][:].max() < 1e-12


def test_gear_normal_form():
    with follow(NORMAL_FORM) as file:
        folds, grazings = points(file, "LP"), points(file, "GR")
        stable = file["point/stable"][:]
        at = file["special/point"][:][file["special/label"].asstr()[:] == "LP"]
        assert file["special/contact"].asstr()[:][file["special/label"].asstr()[:] == "GR"].tolist() == ["gap", "gap"]
    assert np.sort(grazings) == pytest.approx([0.71068737, 1.2185743569], abs=5e-9)
    assert 0.450 < folds.min() < 0.455 and 0.745 < folds.max() < 0.750
    # Both stable branches and the one between them; of a fold itself it cannot be said.
    first, second = at
    assert (stable[: first - 1] == 1).all() and (stable[second + 1 :] == 1).all()
    assert (stable[first + 1 : second] == 0).all() and (stable[at] == -1).all()


def test_where_nothing_damps_stability_is_undecided():
    Path("free.nml").write_text(
        "&scene kind='lumped' /\n&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0 /\n"
        "&stop name='s', between='m','frame', side='upper', clearance=0.01, stiffness=3.0 /\n"
        "&load on='m', amplitude=0.1, angular_frequency=3.0 /\n&motion t_end=100.0, start='zero' /\n"
        "&follow parameter='load%angular_frequency', first=3.0, last=3.4, settle=20, period=1 /\n"
    )
    with follow(Path("free.nml")) as file:
        sizes = np.hypot(*np.moveaxis(file["point/multiplier"][:], 1, 0))
        stable = file["point/stable"][:]
        assert file["point/stable"].attrs["flag_meanings"] == "stable unstable undecided"
        labels = file["special/label"].asstr()[:].tolist()
    on_circle = np.abs(sizes - 1.0).max(axis=1) < 1e-9
    assert on_circle.sum() > 5 and "TR" not in labels
    assert (stable[on_circle] == -1).all() and (stable[sizes.max(axis=1) > 1.01] == 0).all()


def test_grazings_are_where_the_linear_motion_just_reaches_the_edge():
    """With d the amplitude of x'' + 0.1 x' + x = 0.05 cos ωt about 1.1, contact is lost where d = 0.1."""
    with follow(NORMAL_FORM) as file:
        grazings = points(file, "GR")
    # ((1 - w)² + 0.01 w) 0.01 = 0.0025 for w = ω².
    w = np.roots([1.0, -1.99, 0.75])
    np.testing.assert_allclose(np.sort(grazings), np.sort(np.sqrt(w)), rtol=1e-11)


def test_folds_are_where_a_sweep_jumps():
    with follow(HYSTERESIS) as file:
        high, low = points(file, "LP")
        labels = file["special/label"].asstr()[:].tolist()
    assert labels == ["GR", "LP", "LP", "GR", "EP"]
    # A whole number of periods at each frequency, so that each motion goes on in phase.
    step, grid = 0.1, sets(sweep__first=12, sweep__last=27, sweep__points=151, motion__t_end=10, record__from=9)
    succeed("razy-sweep", HYSTERESIS, *grid, "--output", "sweep.h5")
    with h5py.File("sweep.h5") as file:
        frequency, offset = file["axis/load.frequency"][:], file["extrema/displacement/offset"][:]
        largest = np.maximum.reduceat(file["extrema/displacement/value"][:], offset[:-1]).reshape(2, -1)
    up, down = (np.argmax(np.abs(np.diff(way))) for way in largest)
    # Next to a fold a step of the parameter throws the motion off a little early; it leaves slowly just beyond.
    for jump, fold in ((up, high), (down, low)):
        assert frequency[jump] - step < fold < frequency[jump + 1] + step


def test_file():
    with follow(NORMAL_FORM, follow__first=1.3, follow__last=0.4) as file:
        count = file["point/branch"].size
        parameter = file["point/load.angular_frequency"][:]
        assert file.attrs["program"] == "razy-follow"
        for name in ("period", "multiplicity", "stable", "multiplier", "state", "events", "correction"):
            assert file[f"point/{name}"].shape[0] == count, name
        special = file["special/point"][:]
        np.testing.assert_array_equal(file["special/parameter"][:], parameter[special])
        assert (file["special/label"].asstr()[-1], special[-1]) == ("EP", count - 1)
        assert parameter[0] == 1.3 and parameter[-1] == pytest.approx(0.4, rel=1e-14)
        np.testing.assert_allclose(file["point/period"][:], 2 * np.pi / parameter, rtol=1e-14)
        assert file["extrema/displacement/offset"].size == count + 1
        assert file["branch/parent"][:].tolist() == [0]
        assert file["branch/ending"].asstr()[0] == "the end of the range"
    asked = sets(follow__first=1.3, follow__last=0.4)
    assert attribute("gear_normal_form.h5", "input") == succeed("razy-follow", NORMAL_FORM, *asked, "--check").stdout
    assert left() == ["gear_normal_form.h5"]


def test_special_points_are_said():
    done = succeed("razy-follow", NORMAL_FORM, *sets(follow__last=1.1))
    (line,) = [line for line in (done.stdout + done.stderr).splitlines() if " GR " in line]
    words = line.split()
    assert (words[2], words[4], words[6]) == ("GR", "1", "gap")
    assert re.fullmatch(r"1\.21857435\d{4}", words[3])


def test_a_second_run_gives_the_same_bytes():
    for name in ("a.h5", "b.h5"):
        succeed("razy-follow", NORMAL_FORM, "--output", name, *sets(follow__last=1.0))
    with h5py.File("a.h5") as a, h5py.File("b.h5") as b:
        for name in ("point/state", "point/multiplier", "special/parameter", "extrema/displacement/value"):
            np.testing.assert_array_equal(a[name][()], b[name][()])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"follow__parameter": "'motion%t_end'"}, "&follow%parameter = 'motion%t_end': a value that the machine has"),
        ({"follow__parameter": "'load%angular'"}, "&follow%parameter = 'load%angular'"),
        ({"follow__last": 1.5}, "&follow%last = 1.5: a value apart from first"),
        ({"follow__from": 2.0}, "&follow%from = 2.0: a value between first and last"),
        ({"motion__integrator": "'moreau_jean'", "motion__step": 1e-3}, "the method has no derivatives"),
        ({"follow__starts": 3}, "&follow%starts = 3: only with motions='all'"),
        ({"follow__motions": "'all'", "follow__from": 1.2}, "&follow%from = 1.2: not with motions='all'"),
        (
            {"follow__motions": "'all'", "follow__period": 11, "follow__settle": 20},
            "&follow%settle = 20: at least twice",
        ),
        ({"follow__motions": "'all'", "load__amplitude": 0.0}, "&follow%motions = 'all': 'one'"),
    ],
)
def test_what_it_refuses_is_one_line(changes, message):
    done = start("razy-follow", NORMAL_FORM, *sets(**changes))
    assert done.returncode == 2
    assert message in done.stderr and done.stderr.count("\n") == 1
    assert left() == []


@pytest.mark.parametrize("case", [NORMAL_FORM, PAIR_MAP])
def test_the_effective_input_reads_back(case):
    """It says the defaults of keys that stand only in the first &follow, or only with motions='all'."""
    text = succeed("razy-follow", case, "--check").stdout
    Path("again.nml").write_text(text)
    assert succeed("razy-follow", "again.nml", "--check").stdout == text


def test_two_parameters_that_are_one_are_refused_at_once():
    same = ["--set", "follow(2)%parameter='rotation%speed_rpm','load(2)%value'", "--set", "follow(2)%last=2000.0"]
    done = start("razy-follow", PAIR_MAP, *same, "--set", "follow(1)%settle=1000000")
    assert done.returncode == 2
    assert "a value that the first &follow does not vary" in done.stderr and done.stderr.count("\n") == 1


def test_no_motion_is_no_mistake_of_the_input():
    done = start("razy-follow", NORMAL_FORM, *sets(follow__period=7, follow__settle=20))
    assert done.returncode == 1
    assert "no motion of period 7 was found" in done.stderr and done.stderr.count("\n") == 1
    assert left() == []


def test_values_of_the_user():
    """A motion is stored at each value whenever the branch comes there, also between a fold and its neighbour."""
    with follow(NORMAL_FORM) as file:
        (low, high) = points(file, "LP")[:2]
        parameter = file["point/load.angular_frequency"][:]
    wanted = [0.5 * (low + high), 1.1, low + (1e-9 if low < high else -1e-9)]
    with follow(NORMAL_FORM, "--force", follow__values=",".join(map(repr, map(float, wanted)))) as file:
        found = points(file, "UZ")
        times = [np.sum(np.diff(parameter > value)) for value in wanted[:2]]
        for value, count in zip(wanted, [*times, 2], strict=True):
            assert np.sum(np.abs(found / value - 1) < 1e-15) >= count
        at = file["special/point"][:][file["special/label"].asstr()[:] == "UZ"]
        assert (file["point/correction"][:][at] < 1e-11).all()


def test_events_of_each_motion():
    with follow(IMPACT, follow__last=2.3) as file:
        begin, time, omega = file["event/offset"][:], file["event/time"][:], file["point/load.angular_frequency"][:]
        assert (np.diff(begin) == file["point/events"][:]).all() and begin[-1] == time.size
        phase, period = file["point/phase"][0], 2 * np.pi / omega[0]
        (impact,) = time[begin[0] : begin[1]]
        state = file["point/state"][0]
    assert phase * period < impact < (1 + phase) * period

    def coordinate(after):
        decay, own = 0.1, np.sqrt(1 - 0.01)
        forced = np.linalg.solve(
            [[1 - omega[0] ** 2, 0.2 * omega[0]], [-0.2 * omega[0], 1 - omega[0] ** 2]], [1.0, 0.0]
        )

        def drive(t):
            angle = omega[0] * t
            return forced @ [np.cos(angle), np.sin(angle)], omega[0] * forced @ [-np.sin(angle), np.cos(angle)]

        at, rate = drive(phase * period)
        free = state[0] - at, state[1] - rate
        wave = free[0] * np.cos(own * after) + (free[1] + decay * free[0]) / own * np.sin(own * after)
        return np.exp(-decay * after) * wave + drive(phase * period + after)[0]

    assert coordinate(impact - phase * period) == pytest.approx(0.0, abs=1e-11)


def one_period(frequency, state, phase):
    """Move the block of inputs/hysteresis.nml by SciPy: each contact state by itself, up to the event that ends it."""
    end, time, state = (1.0 + phase) / frequency, phase / frequency, np.array(state)
    side = int(np.sign(state[0])) if abs(state[0]) > 1e-3 else 0
    while time < end:
        edges = [edge for edge in (-1e-3, 1e-3) if side == 0 or edge * side > 0]

        def rates(t, z, side=side):
            contact = 3e4 * (z[0] - side * 1e-3) if side else 0.0
            return [z[1], 2.0 * np.sin(2.0 * np.pi * frequency * t) - 4.0 * z[1] - 1e4 * z[0] - contact]

        def to_edge(edge, side=side):
            def distance(t, z):
                return z[0] - edge

            distance.terminal, distance.direction = True, -side if side else np.sign(edge)
            return distance

        done = solve_ivp(
            rates, (time, end), state, "DOP853", events=[to_edge(e) for e in edges], rtol=1e-12, atol=1e-15
        )
        time, state = done.t[-1], done.y[:, -1]
        if done.status == 1:
            edge = next(e for e, times in zip(edges, done.t_events, strict=True) if times.size)
            side = 0 if side else int(np.sign(edge))
    return state


def test_independent_integrator():
    """Stable and unstable motions repeat themselves in SciPy, and finite differences there give the multipliers."""
    with follow(HYSTERESIS) as file:
        stable = file["point/stable"][:] == 1
        frequency, states = file["point/load.frequency"][:], file["point/state"][:]
        phases = file["point/phase"][:]
        touching = (file["point/events"][:] > 0) & (file["point/multiplicity"][:] == 1)
        located = np.isin(np.arange(stable.size), file["special/point"][:])
        chosen = [np.flatnonzero(kind & touching & ~located)[20] for kind in (stable, ~stable)]
        expected = [multipliers(file, point) for point in chosen]
    for point, known in zip(chosen, expected, strict=True):
        at, state, phase = frequency[point], states[point], phases[point]
        assert one_period(at, state, phase) == pytest.approx(state, rel=1e-8, abs=1e-11)
        columns = []
        for step in (np.array([1e-7, 0.0]), np.array([0.0, 1e-5])):
            change = one_period(at, state + step, phase) - one_period(at, state - step, phase)
            columns.append(change / (2.0 * step.max()))
        found = np.sort_complex(np.linalg.eigvals(np.transpose(columns)))
        assert found == pytest.approx(known, rel=1e-5)


def test_picture():
    succeed("razy-follow", NORMAL_FORM, *sets(follow__last=0.6))
    done = plot("gear_normal_form.h5", "--save", "picture.png")
    assert (done.returncode, done.stderr) == (0, "")
    pixels = matplotlib.image.imread("picture.png")[..., :3]
    assert min(pixels.shape[:2]) > 300
    assert (pixels.max(axis=2) < 0.1).sum() > 2000


def test_picture_with_a_sweep():
    succeed("razy-follow", HYSTERESIS, "--output", "f.h5")
    succeed("razy-sweep", HYSTERESIS, *sets(sweep__points=61), "--output", "s.h5")
    done = plot("f.h5", "s.h5", "--save", "picture.png")
    assert (done.returncode, done.stderr) == (0, "")
    pixels = matplotlib.image.imread("picture.png")[..., :3]
    grey = (pixels.min(axis=2) > 0.6) & (pixels.max(axis=2) < 0.8) & (np.ptp(pixels, axis=2) < 0.02)
    assert (pixels.max(axis=2) < 0.1).sum() > 2000 and grey.sum() > 500


def test_gear_pair_is_told_once():
    """A fold by an interval proof; each doubling begins one branch or ends one, at its own value."""
    with follow(GEAR_PAIR) as file:
        labels, branch = file["special/label"].asstr()[:], file["special/branch"][:]
        value, ending = file["special/parameter"][:], file["branch/ending"].asstr()[:]
        folds = value[labels == "LP"]
        correction = file["point/correction"][:]
        periods = file["point/multiplicity"][:][file["special/point"][:]]
        parents = file["branch/parent"][:]
    # Next to doublings and grazings rounding leaves more.
    assert np.mean(correction < 2e-13) > 0.99
    assert np.abs(folds - 1720.306604124594).min() < 1e-9
    doublings = value[(labels == "PD") & (branch == 1)]
    for number, (why, parent) in enumerate(zip(ending, parents, strict=True), start=1):
        if parent == 0:
            continue
        assert why == "a doubling of a motion of half the period", number
        (last,) = value[(labels == "EP") & (branch == number)]
        assert np.abs(doublings - last).min() < 1e-9, number
    assert (periods[branch > 1] == 2).all()
    # Two doublings for each doubled branch, its beginning and its end.
    assert doublings.size == 2 * (parents == 1).sum()


@pytest.mark.parametrize("turn", [0, 37, 90, 200, 300])
def test_labels_do_not_depend_on_where_time_begins(turn):
    """The load turned by any angle: an impact passes phase 0 on the branch at some of them."""
    with follow(IMPACT, load__phase=turn, motion__t_end=400, follow__doublings=1) as file:
        labels = list(zip(file["special/label"].asstr()[:], file["special/branch"][:], strict=True))
        found = file["special/parameter"][:]
        last = file["point/multiplier"][file["special/point"][-1]]
    assert labels == [("PD", 1), ("EP", 1), ("PD", 2), ("EP", 2)]
    assert found == pytest.approx([2.651807017026, 3.0, 2.713293439395, 3.0], rel=1e-11)
    assert np.hypot(*last).max() == pytest.approx(2.0357095, rel=1e-6)


def test_bounces_of_an_accumulation_are_no_changes():
    """A follower leaves its cam where the eccentric takes the force away; bounces come and go unsaid."""
    text = [
        "&scene kind='lumped' /",
        "&mass name='f', value=1.221 /",
        "&spring between='f','frame', stiffness=1430.8 /",
    ]
    text += ["&load on='f', value=-100.0 /"]
    text += ["&stop name='cam', between='f','frame', side='lower', clearance=0.0, law='rigid', restitution=0.8,"]
    text += ["  motion_amplitude=0.02, motion_angular_frequency=10.0 /"]
    text += ["&motion t_end=20.0, start='zero' /", "&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='stop%motion_angular_frequency', first=60.0, last=75.0 /"]
    Path("cam.nml").write_text("\n".join(text) + "\n")
    with follow(Path("cam.nml")) as file:
        assert file["special/label"].size == 2
        assert file["special/parameter"][0] == pytest.approx(np.sqrt((1430.8 + 100.0 / 0.02) / 1.221), rel=1e-11)
