"""Springs and stops of many lines, and polynomial ones: closed forms, laws that say the same, and what is refused."""

import h5py
import numpy as np
import pytest
from programs import SOURCE, datasets, start, succeed, values_of
from razy.plot.laws import laws_of
from razy.read import open_result
from razy.read.description import read_description
from scipy.integrate import trapezoid
from scipy.special import ellipk

INPUTS = SOURCE / "inputs"
# Displacement and force of a spring that hardens, then softens, and falls at last.
PLACE, FORCE = np.array([0.0, 0.5, 1.0, 2.0, 3.0]), np.array([0.0, 0.4, 1.6, 2.0, 1.7])
ODD = np.concatenate((-PLACE[:0:-1], PLACE)), np.concatenate((-FORCE[:0:-1], FORCE))


def numbers(values):
    return ", ".join(repr(float(value)) for value in values)


def table(place, force):
    return f"law='table', displacement={numbers(place)}, force={numbers(force)}"


def scene(tmp_path, *groups, t_end=20.0, start="given", method="'exact'", record=True, name="case"):
    path = tmp_path / f"{name}.nml"
    records = "&record observable='state', what='trajectory', interval=0.1 /" if record else ""
    path.write_text("\n".join((
        "&scene kind='lumped', title='springs' /", *groups,
        f"&motion t_end={t_end}, start='{start}', integrator={method} /", records,
    )) + "\n")  # fmt: skip
    return path


def end_of(path, *options):
    succeed("razy-run", path, "--force", *options)
    with h5py.File(f"{path.stem}.h5") as file:
        return file["state/displacement"][:], file["state/velocity"][:], file["event/time"][:], file["event/state"][:]


def crossings(mass, amplitude):
    """Times at which the odd spring, released at rest from `amplitude`, comes to the points of its table, down to 0."""
    time, x, v = 0.0, amplitude, 0.0
    found = []
    for line in range(len(PLACE) - 2, -1, -1):
        if PLACE[line] >= amplitude:
            continue
        slope = (FORCE[line + 1] - FORCE[line]) / (PLACE[line + 1] - PLACE[line])
        middle = PLACE[line] - FORCE[line] / slope
        root = np.sqrt(complex(slope / mass))
        # x = middle + a cos(root t) + b sin(root t)/root, for falling lines with imaginary root.
        target, low, high = PLACE[line] - middle, 0.0, 20.0 / abs(root)
        a, b = x - middle, v
        high = next(
            t
            for t in np.linspace(0, high, 4001)[1:]
            if (a * np.cos(root * t) + b * np.sin(root * t) / root).real < target
        )
        for _ in range(200):
            t = 0.5 * (low + high)
            low, high = (t, high) if (a * np.cos(root * t) + b * np.sin(root * t) / root).real > target else (low, t)
        time += t
        x, v = PLACE[line], (-a * root * np.sin(root * t) + b * np.cos(root * t)).real
        found.append(time)
    return np.array(found)


@pytest.mark.parametrize("amplitude", [0.75, 1.5, 2.75])
def test_free_vibration_comes_to_each_line_in_closed_form(tmp_path, monkeypatch, amplitude):
    monkeypatch.chdir(tmp_path)
    path = scene(
        tmp_path, "&mass name='m', value=2.0 /", f"&spring between='m','frame', {table(*ODD)} /",
        f"&initial on='m', displacement={amplitude} /",
    )  # fmt: skip
    x, v, time, _ = end_of(path)
    quarter = crossings(2.0, amplitude)
    expected = np.concatenate((quarter, (2 * quarter[-1] - quarter[:-1])[::-1]))
    np.testing.assert_allclose(time[: expected.size], expected, rtol=1e-12)
    energy = 0.5 * 2.0 * v[:, 0] ** 2
    for i, s in enumerate(np.abs(x[:, 0])):
        at = np.concatenate((PLACE[s > PLACE], [s]))
        energy[i] += trapezoid(np.interp(at, PLACE, FORCE), at)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-12)


DRIVEN = (
    "&mass name='m', value=1.0 /",
    "&damper between='m','frame', damping=0.1 /",
    "&load on='m', amplitude=1.2, angular_frequency=0.8 /",
)


@pytest.mark.parametrize("method", ["'dop853'", "'radau5'"])
def test_damped_lines_agree_with_runge_kutta(tmp_path, monkeypatch, method):
    monkeypatch.chdir(tmp_path)
    damping = numbers([0.3, 0.0, 0.2, 0.1, 0.1, 0.2, 0.0, 0.3])
    spring = f"&spring between='m','frame', {table(*ODD)}, line_damping={damping} /"
    tight = ", relative_tolerance=1e-12, absolute_tolerance=1e-13"
    exact = end_of(scene(tmp_path, *DRIVEN, spring, start="zero"))
    other = end_of(scene(tmp_path, *DRIVEN, spring, start="zero", method=method + tight, name="other"))
    assert exact[3].tolist() == other[3].tolist() and exact[3].size > 10
    np.testing.assert_allclose(exact[0], other[0], atol=3e-9)


def test_a_table_is_two_stops_in_parallel(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    spring = "&spring between='m','frame', stiffness=1.0 /"
    one = f"&stop name='s', between='m','frame', side='both', clearance=0.5, {table([0, 0.25, 0.5], [0, 0.5, 2.0])} /"
    two = (
        "&stop name='a', between='m','frame', side='both', clearance=0.5, stiffness=2.0 /",
        "&stop name='b', between='m','frame', side='both', clearance=0.75, stiffness=4.0 /",
    )
    first = end_of(scene(tmp_path, *DRIVEN, spring, one, start="zero"))
    second = end_of(scene(tmp_path, *DRIVEN, spring, *two, start="zero", name="two"))
    np.testing.assert_allclose(first[2], second[2], rtol=1e-11)
    np.testing.assert_allclose(first[0], second[0], atol=1e-11)
    upper = (
        "&stop name='s', between='m','frame', side='{}', clearance=0.0, " + table([0, 0.25, 0.5], [0, 0.5, 2.0]) + " /"
    )
    one_sided = end_of(
        scene(
            tmp_path, *DRIVEN, spring, upper.format("upper"), upper.format("lower").replace("'s'", "'t'"), start="zero"
        )
    )
    both = end_of(scene(tmp_path, *DRIVEN, spring, upper.format("both"), start="zero", name="both"))
    np.testing.assert_allclose(one_sided[0], both[0], atol=1e-11)


@pytest.mark.parametrize("amplitude", [0.5, 3.0])
def test_duffing_has_the_period_of_its_elliptic_function(tmp_path, monkeypatch, amplitude):
    monkeypatch.chdir(tmp_path)
    path = scene(
        tmp_path, "&mass name='m', value=1.0 /",
        "&spring between='m','frame', law='polynomial', coefficients=1.0, 0.0, 0.7 /",
        f"&initial on='m', displacement={amplitude} /",
        method="'dop853', relative_tolerance=1e-12, absolute_tolerance=1e-14", record=False,
    )  # fmt: skip
    square = 1.0 + 0.7 * amplitude**2
    period = 4 * ellipk(0.35 * amplitude**2 / square) / np.sqrt(square)
    path.write_text(
        path.read_text().replace("t_end=20.0", f"t_end={float(10 * period)!r}")
        + "&record observable='state', what='trajectory', interval=1000.0 /\n"
    )
    succeed("razy-run", path, "--force")
    with h5py.File("case.h5") as file:
        assert file["state/displacement"][-1, 0] == pytest.approx(amplitude, abs=1e-9)


def test_rest_is_found_where_springs_soften(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    beam = "&spring name='beam', between='m','frame', " + table([-2, -0.5, 0.5, 2], [-1, 0.5, -0.5, 1]) + " /"
    cubic = "&spring name='beam', between='m','frame', law='polynomial', coefficients=-1.0, 0.0, 0.25 /"
    for spring, rest, method in ((beam, 1.0, "'exact'"), (cubic, 2.0, "'dop853'")):
        x = end_of(scene(tmp_path, "&mass name='m', value=1.0 /", spring, start="static", method=method))[0]
        np.testing.assert_allclose(x, rest, rtol=1e-9)
        down = "&load on='m', value=-0.1 /"
        x = end_of(scene(tmp_path, "&mass name='m', value=1.0 /", spring, down, start="static", method=method))[0]
        assert (x < -rest).all() and np.ptp(x) < 1e-8


def test_modes_are_those_of_the_line_at_rest(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    groups = "&mass name='m', value=1.0 /", "&load on='m', value=1.2 /", "&modes count=1, contacts='{}' /"
    for spring, choice, stiffness in (
        (f"&spring between='m','frame', {table(*ODD)} /", "equilibrium", 2.4),
        (f"&spring between='m','frame', {table(*ODD)} /", "open", 0.8),
        ("&spring between='m','frame', law='polynomial', coefficients=1.0, 0.0, 0.2 /", "equilibrium", 1.6),
        ("&spring between='m','frame', law='polynomial', coefficients=1.0, 0.0, 0.2 /", "open", 1.0),
    ):
        path = scene(
            tmp_path,
            groups[0],
            spring,
            groups[1],
            groups[2].format(choice),
            record=False,
            start="zero",
            method="'dop853'",
        )
        succeed("razy-modes", path, "--force")
        with h5py.File("case.h5") as file:
            assert file["frequency"][0] == pytest.approx(np.sqrt(stiffness) / (2 * np.pi), rel=1e-12)


@pytest.mark.parametrize(("contacts", "stiffness", "damping"), [("equilibrium", 2.4, 0.25), ("open", 0.8, 0.15)])
def test_response_is_that_of_the_line_at_rest(tmp_path, monkeypatch, contacts, stiffness, damping):
    """Beside a load of 1.2 N the spring rests in its second line, without it in the first, each with its damping."""
    monkeypatch.chdir(tmp_path)
    lines = numbers([0.3, 0.0, 0.2, 0.1, 0.1, 0.2, 0.0, 0.3])
    path = scene(
        tmp_path, "&mass name='m', value=1.0 /", "&damper between='m','frame', damping=0.05 /",
        f"&spring between='m','frame', {table(*ODD)}, line_damping={lines} /",
        "&load on='m', value=1.2, amplitude=0.01, angular_frequency=1.0 /", f"&modes count=1, contacts='{contacts}' /",
        "&record observable='displacement', what='extrema' /",
        "&response parameter='load%angular_frequency', first=0.5, last=2.5, points=9 /", record=False, start="zero",
    )  # fmt: skip
    succeed("razy-modes", path)
    with h5py.File("case.h5") as file:
        omega, found = file["response/parameter"][:], file["response/phasor/displacement"][:, 0]
    # A load is a sine, the imaginary part of e^(i omega t), which is the real part of -i e^(i omega t).
    expected = -0.01j / (stiffness - omega**2 + 1j * damping * omega)
    np.testing.assert_allclose(found[:, 0] + 1j * found[:, 1], expected, rtol=1e-12)


def test_damping_of_lines_is_what_is_lost(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = scene(
        tmp_path, "&mass name='m', value=1.0 /",
        f"&spring name='s', between='m','frame', {table(*ODD)}, line_damping=0.05 /",
        "&initial on='m', displacement=2.5 /", "&record observable='contact_force', of='s', what='statistics' /",
    )  # fmt: skip
    x, v, *_ = end_of(path)
    with h5py.File("case.h5") as file:
        lost = file["contact/s/dissipated_energy"][()]
        assert file["contact/s/closed_share"][()] == 1.0

    def stored(s):
        at = np.concatenate((PLACE[abs(s) > PLACE], [abs(s)]))
        return trapezoid(np.interp(at, PLACE, FORCE), at)

    assert lost == pytest.approx(stored(2.5) - stored(x[-1, 0]) - 0.5 * v[-1, 0] ** 2, rel=1e-11)


@pytest.mark.parametrize(
    "method", ["'exact'", "'dop853'", "'moreau_jean', step=1e-3", "'dop853', treatment='smoothing', sharpness=1e4"]
)
def test_a_motion_that_leaves_its_table_says_so(tmp_path, monkeypatch, method):
    monkeypatch.chdir(tmp_path)
    spring = "&spring between='m','frame', " + table([-1, 0, 1], [-1, 0, 2]) + ", beyond='refuse' /"
    path = scene(tmp_path, "&mass name='m', value=1.0 /", spring, "&initial on='m', velocity={} /", method=method)
    text = path.read_text()
    path.write_text(text.replace("{}", "0.9"))
    assert "beyond" not in succeed("razy-run", path, "--force").stdout
    path.write_text(text.replace("{}", "1.1"))
    done = start("razy-run", path, "--force")
    assert done.returncode == 1 and "beyond the table of a law" in done.stdout + done.stderr


AT_ITS_END = """&scene kind='lumped' /
&mass name='a', value=1.0 /
&mass name='b', value=1.0 /
&spring between='a','frame', stiffness=1.0 /
&stop name='wall', between='b','a', side='lower', clearance=-0.5, law='table', displacement=0.0,0.5,2.5,
    force=0.0,0.5,8.5, line_damping=0.5 /
&spring name='table', between='b','frame', law='table', displacement=-1.0,0.0, force=1.0,0.5, beyond='refuse' /
&initial on='a', velocity=-1.0 /
&initial on='b', velocity={} /
&motion t_end=20.0, start='given', integrator={} /
"""


@pytest.mark.parametrize("method", ["'exact'", "'dop853', relative_tolerance=1e-12, absolute_tolerance=1e-14"])
def test_a_motion_that_begins_at_the_end_of_its_table(tmp_path, monkeypatch, method):
    """At rest there it is drawn inwards, whatever the rounding of its speed: by a matrix exponential."""
    monkeypatch.chdir(tmp_path)
    for speed, time in ((0.0, 1.851946872094), (1e-9, 0.0)):
        (tmp_path / "end.nml").write_text(AT_ITS_END.format(speed, method))
        done = start("razy-run", "end.nml", "--force")
        assert done.returncode == 1 and "beyond the table of a law" in done.stderr
        assert values_of("end.h5")["outcome/time"] == pytest.approx(time, rel=1e-11)
    with h5py.File("end.h5") as file:
        wall, spring = file["event/state"].attrs["meanings"]
    assert wall == "1 = line 1, 2 = line 2, 3 = open"
    assert spring == "1 = line 1, 2 = outside the table, 3 = outside the table"


def test_time_stepping_and_smoothing_come_near(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    spring = f"&spring between='m','frame', {table(*ODD)} /"
    exact = end_of(scene(tmp_path, *DRIVEN, spring, start="zero", t_end=8.0))[0]
    for method, near in (("'moreau_jean', step=1e-4", 1e-3), ("'dop853', treatment='smoothing', sharpness=1e5", 1e-3),
                         ("'dop853', treatment='switching'", 1e-6)):  # fmt: skip
        other = end_of(scene(tmp_path, *DRIVEN, spring, start="zero", t_end=8.0, method=method, name="other"))[0]
        np.testing.assert_allclose(other, exact, atol=near)


BAD = (
    ("law='table'", "displacement"),
    ("law='table', displacement=0.0, 1.0", "force"),
    ("law='table', displacement=0.0, 0.0, force=0.0, 1.0", "rise"),
    ("law='table', displacement=0.0, 1.0, force=0.0, 1.0, 2.0", "2 values"),
    ("law='table', displacement=0.0, 1.0, 2.0, force=0.0, 1.0, 2.0, line_damping=1.0, 1.0, 1.0", "or 2"),
    ("law='table', displacement=0.0, 1.0, force=0.0, 1.0, stiffness=2.0", "'linear'"),
    ("law='polynomial'", "coefficients"),
    ("law='polynomial', coefficients=1.0, damping_factor=1.0", "'linear'"),
    ("stiffness=1.0, coefficients=1.0", "'polynomial'"),
    ("damping=1.0", "stiffness"),
)


@pytest.mark.parametrize(("keys", "word"), BAD)
def test_what_a_spring_cannot_be_is_one_line(tmp_path, monkeypatch, keys, word):
    monkeypatch.chdir(tmp_path)
    path = scene(tmp_path, "&mass name='m', value=1.0 /", f"&spring between='m','frame', {keys} /", start="zero")
    done = start("razy-run", path)
    assert done.returncode == 2 and word in done.stderr and len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert "&spring" in done.stderr


@pytest.mark.parametrize(
    ("keys", "word"),
    [("displacement=0.1, 1.0, force=0.0, 1.0", "0 at the first"),
     ("displacement=0.0, 1.0, force=0.0, -1.0", "does not pull"),
     ("displacement=0.0, 1.0, force=1.0, 1.0", "0 at the first"), ("stiffness=1.0", "another law")],
)  # fmt: skip
def test_what_a_stop_cannot_be_is_one_line(tmp_path, monkeypatch, keys, word):
    monkeypatch.chdir(tmp_path)
    stop = f"&stop name='s', between='m','frame', clearance=0.0, law='table', {keys} /"
    done = start("razy-run", scene(tmp_path, "&mass name='m', value=1.0 /", stop, start="zero"))
    assert done.returncode == 2 and word in done.stderr and len(done.stderr.strip().splitlines()) == 1, done.stderr


def test_planar_springs_have_laws_too(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "planar.nml"
    path.write_text(f"""&scene kind='planar', title='springs' /
&body name='b', mass=2.0, inertia=1.0 /
&spring between='b','frame', direction=1.0, 0.0, {table(*ODD)} /
&spring between='b','frame', direction=0.0, 1.0, stiffness=3.0 /
&initial on='b.x', displacement=1.5 /
&motion t_end=20.0, start='given', integrator='exact' /
&record observable='state', what='trajectory', interval=0.1 /
""")
    x = end_of(path)[0][:, 0]
    line = scene(
        tmp_path, "&mass name='m', value=2.0 /", f"&spring between='m','frame', {table(*ODD)} /",
        "&initial on='m', displacement=1.5 /",
    )  # fmt: skip
    np.testing.assert_allclose(x, end_of(line)[0][:, 0], atol=1e-11)
    path.write_text(
        path.read_text().replace("between='b','frame', direction=1.0", "between='b','frame','b','frame', direction=1.0")
    )
    done = start("razy-run", path)
    assert done.returncode == 2 and "one pair" in done.stderr


@pytest.mark.parametrize(
    "name",
    [
        "duffing",
        "snap_through",
        "two_rate_coupling",
        "shock_on_stop",
        "square_wave_walls",
        "torsional_gear_pair",
        "planetary",
    ],
)
def test_effective_input_is_the_input(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    succeed("razy-run", INPUTS / f"{name}.nml", "--output", "first.h5")
    with h5py.File("first.h5") as file:
        (tmp_path / "again.nml").write_text(file.attrs["input"])
    succeed("razy-run", "again.nml")
    assert datasets("first.h5") == datasets("again.h5")


@pytest.mark.parametrize("side", ["lower", "upper", "both"])
def test_friction_under_a_table_without_a_gap(tmp_path, monkeypatch, side):
    """Its one line presses as an elastic stop does, on whichever side."""
    monkeypatch.chdir(tmp_path)
    found = []
    for law in ("stiffness=1.0", table([0, 1], [0, 1])):
        path = scene(
            tmp_path, "&mass name='a', value=1.0 /", "&mass name='b', value=1.0 /",
            "&spring between='b','frame', stiffness=1.0 /", "&spring between='a','frame', stiffness=1.0 /",
            f"&stop name='w', between='a','frame', side='{side}', clearance=0.0, {law} /",
            "&friction name='f', between='b','frame', static_coefficient=0.5, normal_contact='w' /",
            "&load on='a', amplitude=1.0, angular_frequency=2.0 /",
            "&load on='b', amplitude=1.0, angular_frequency=1.0 /", start="zero",
        )  # fmt: skip
        found.append(end_of(path)[0])
    np.testing.assert_allclose(found[1], found[0], atol=1e-11)


def test_laws_that_are_drawn_are_those_that_act(tmp_path, monkeypatch):
    """Each law of `razy-plot --kind law` at the displacements of a motion that presses all of them."""
    monkeypatch.chdir(tmp_path)
    ends = "between='m','frame'"
    groups = (
        f"&spring name='table', {ends}, {table(*ODD)} /",
        f"&spring name='cubic', {ends}, law='polynomial', coefficients=-1.0, 0.0, 0.7 /",
        f"&stop name='both', {ends}, side='both', clearance=0.4, stiffness=7.0 /",
        f"&stop name='lower', {ends}, side='lower', clearance=0.1, law='hunt_crossley', stiffness=3.0, hysteresis=0 /",
        f"&stop name='pressed', {ends}, clearance=-0.2, law='table', displacement=0.0,0.5,1.0, force=0.0,1.0,4.0 /",
        f"&stop name='jumps', {ends}, clearance=0.3, law='switched_spring', stiffness=2.0 /",
    )
    names = [group.split("'")[1] for group in groups]
    path = scene(
        tmp_path, "&mass name='m', value=2.0 /", *groups, "&initial on='m', velocity=1.5 /",
        *(f"&record observable='contact_force', of='{name}', what='trajectory', interval=0.1 /" for name in names),
        "&record observable='displacement', of='m', what='trajectory', interval=0.1 /", method="'dop853'", record=False,
    )  # fmt: skip
    succeed("razy-run", path)
    with open_result("case.h5") as result:
        found = {law.name: law for law in laws_of(read_description(result))}
        x = result.file["observable/displacement.m"][:]
        assert x.min() < -0.6 and x.max() > 0.6
        for name in names:
            # Where a force jumps rounding decides.
            clear = np.abs(x - 0.3) > 1e-9
            force = result.file[f"observable/contact_force.{name}"][:]
            np.testing.assert_allclose(found[name].force(x)[clear], force[clear], rtol=0, atol=1e-12)
