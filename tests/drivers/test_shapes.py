"""Loads and given motions that are no sines: squares, ramps, pulses, half sines and tables, against closed forms."""

import h5py
import numpy as np
import pytest
from programs import start, succeed
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

OSCILLATOR = """&scene kind='lumped' /
&mass name='body', value=1.0 /
&spring between='body','frame', stiffness={k}, damping={c} /
&load on='body', {load} /
&motion t_end={t_end}, integrator='{method}', relative_tolerance=1e-12, start='given' /
&initial on='body', displacement=0.0 /
&record observable='displacement', what='trajectory','extrema', interval=0.05 /
"""
SHAPES = {
    "shape='square', amplitude=1.5, frequency=0.3, duty=0.3": (1 / 0.3, [(0, 1, 0), (0.3 / 0.3, -1, 0)]),
    "shape='ramp', amplitude=1.5, duration=1.7": (None, [(0, 0, 1 / 1.7), (1.7, 1, 0)]),
    "shape='ramp', amplitude=1.5, duration=1.7, frequency=0.4": (2.5, [(0, 0, 1 / 1.7), (1.7, 1, 0)]),
    "shape='pulse', amplitude=1.5, duration=3.0, rise=0.4, delay=0.25": (
        None,
        [(0.25, 0, 2.5), (0.65, 1, 0), (2.85, 1, -2.5), (3.25, 0, 0)],
    ),
    "shape='pulse', amplitude=1.5, duration=2.0, rise=1.0, frequency=0.4": (2.5, [(0, 0, 1), (1, 1, -1), (2, 0, 0)]),
}


def run(path, text, *options, name="case"):
    path = path / f"{name}.nml"
    path.write_text(text)
    succeed("razy-run", path, "--force", *options)
    with h5py.File(f"{name}.h5") as file:
        return {key: file[key][:] for key in ("observable/time", "observable/displacement")}


def repeated(period, pieces, t_end):
    """Return the pieces (start, value, slope) of all periods."""
    return [
        (n * period + t, u, s) for n in range(int(t_end / period) + 1) for t, u, s in pieces
    ] if period else pieces  # fmt: skip


def line_response(k, c, z, u, s, t):
    """Return (y, y') of y'' + c y' + k y = u + s t from z at t = 0, less than critically damped, or free."""
    if k == 0 and c == 0:
        return z[0] + z[1] * t + u * t**2 / 2 + s * t**3 / 6, z[1] + u * t + s * t**2 / 2
    rate, omega = c / 2, np.sqrt(k - c**2 / 4)
    a = z[0] - (u / k - c * s / k**2)
    b = (z[1] - s / k + rate * a) / omega
    e, cos, sin = np.exp(-rate * t), np.cos(omega * t), np.sin(omega * t)
    y = e * (a * cos + b * sin) + (u + s * t) / k - c * s / k**2
    return y, e * ((b * omega - rate * a) * cos - (a * omega + rate * b) * sin) + s / k


def response(k, c, pieces, time, amplitude=1.0):
    """Return y at the times, from rest, under straight lines of force."""
    y = np.zeros_like(time)
    z = (0.0, 0.0)
    for (t, u, s), after in zip(pieces, [*pieces[1:], (np.inf, 0, 0)], strict=True):
        inside = (time >= t) & (time < after[0])
        y[inside] = line_response(k, c, z, amplitude * u, amplitude * s, time[inside] - t)[0]
        if np.isfinite(after[0]):
            z = line_response(k, c, z, amplitude * u, amplitude * s, after[0] - t)
    return y


@pytest.mark.parametrize("load", SHAPES)
@pytest.mark.parametrize(("k", "c"), [(4.0, 0.0), (4.0, 0.2), (0.0, 0.0), (0.01, 0.001)])
def test_straight_lines_are_followed_in_closed_form(tmp_path, load, k, c):
    seen = run(tmp_path, OSCILLATOR.format(k=k, c=c, load=load, t_end=20.0, method="exact"))
    period, pieces = SHAPES[load]
    y = response(k, c, repeated(period, pieces, 20.0), seen["observable/time"], 1.5)
    np.testing.assert_allclose(seen["observable/displacement"], y, rtol=0, atol=1e-12 * abs(y).max())


@pytest.mark.parametrize("load", SHAPES)
def test_runge_kutta_does_not_step_over_a_break(tmp_path, load):
    seen = run(tmp_path, OSCILLATOR.format(k=4.0, c=0.2, load=load, t_end=20.0, method="dop853"))
    period, pieces = SHAPES[load]
    y = response(4.0, 0.2, repeated(period, pieces, 20.0), seen["observable/time"], 1.5)
    np.testing.assert_allclose(seen["observable/displacement"], y, rtol=0, atol=1e-10 * abs(y).max())


@pytest.mark.parametrize("load", SHAPES)
def test_time_stepping_ends_a_step_at_a_break(tmp_path, load):
    """Its order is then 2, as where nothing breaks; over a break it would be 1."""
    error = []
    period, pieces = SHAPES[load]
    for step in (0.013, 0.00325):
        text = OSCILLATOR.format(k=4.0, c=0.2, load=load, t_end=20.0, method="moreau_jean")
        seen = run(tmp_path, text, "--set", f"motion%step={step}")
        y = response(4.0, 0.2, repeated(period, pieces, 20.0), seen["observable/time"], 1.5)
        error.append(abs(seen["observable/displacement"] - y).max())
    assert error[1] < 3e-4
    assert error[0] / error[1] == pytest.approx(16.0, rel=0.25)


def shock(beta):
    """Return the largest static factor under a half sine whose frequency is beta < 1 times that of the oscillator."""
    return np.sin(2 * np.pi * beta / (1 + beta)) / (1 - beta)


def test_shock_response_spectrum_of_a_half_sine(tmp_path):
    grid = np.linspace(0.4, 0.9, 100001)
    worst = grid[shock(grid).argmax()]
    assert shock(worst) == pytest.approx(1.7685, abs=5e-5)
    for beta in (0.4, worst, 0.9):
        duration = np.pi / (2.0 * beta)
        load = f"shape='half_sine', amplitude=4.0, duration={float(duration)!r}"
        run(tmp_path, OSCILLATOR.format(k=4.0, c=0.0, load=load, t_end=20.0, method="exact"))
        with h5py.File("case.h5") as file:
            largest = abs(file["extrema/displacement/value"][:])
            time = file["extrema/displacement/time"][:]
        assert largest[time < duration].max() == pytest.approx(shock(beta), rel=1e-12)
        # What is left is a free vibration, with the same amplitude for ever.
        rest = 2 * beta / (beta**2 - 1) * np.cos(np.pi / (2 * beta))
        np.testing.assert_allclose(largest[time > duration], abs(rest), rtol=1e-11)


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_table_of_a_thousand_lines(tmp_path, method):
    random = np.random.default_rng(5)
    time = np.concatenate([[0.0], np.cumsum(random.uniform(0.005, 0.035, 999))])
    value = np.cumsum(random.normal(size=1000))
    (tmp_path / "table.csv").write_text(
        "time [s], value [N]\n" + "".join(f"{float(t)!r}, {float(v)!r}\n" for t, v in zip(time, value, strict=True))
    )
    tolerance = {"exact": 1e-12, "dop853": 1e-10}[method]
    for options, period, slopes, last in (
        ("beyond='hold'", None, np.diff(value) / np.diff(time), value[-1]),
        ("beyond='zero', interpolation='held'", None, np.zeros(999), 0.0),
        ("beyond='periodic'", time[-1], np.diff(value) / np.diff(time), None),
    ):
        pieces = list(zip(time[:-1], value[:-1], slopes, strict=True)) + ([] if last is None else [(time[-1], last, 0)])
        load = f"file='{tmp_path / 'table.csv'}', amplitude=0.5, {options}"
        seen = run(tmp_path, OSCILLATOR.format(k=9.0, c=0.3, load=load, t_end=45.0, method=method))
        y = response(9.0, 0.3, repeated(period, pieces, 45.0), seen["observable/time"], 0.5)
        np.testing.assert_allclose(seen["observable/displacement"], y, rtol=0, atol=tolerance * abs(y).max())


def walls(k, c, gap, wall, force, half, t_end):
    """Return times at which a body comes to two springy walls and leaves them, under a square force; by bisection."""
    t, z, sign, where, found = 0.0, (0.0, 0.0), 1, 0, []
    step = 0.002
    while t < t_end:
        stop, end = t, (np.floor(t / half + 1e-9) + 1) * half
        stiff = k + wall * (where != 0)
        sign = 1 if round(end / half) % 2 else -1
        u = sign * force + wall * gap * where
        grid = np.append(np.arange(step, end - stop, step), end - stop)
        y = line_response(stiff, c, z, u, 0.0, grid)[0]
        out = np.flatnonzero(abs(y) > gap if where == 0 else where * y < gap)
        if out.size == 0:
            z, t = line_response(stiff, c, z, u, 0.0, end - stop), end
            continue
        low, high = (grid[out[0] - 1] if out[0] else 0.0), grid[out[0]]
        for _ in range(60):
            middle = 0.5 * (low + high)
            y = line_response(stiff, c, z, u, 0.0, middle)[0]
            beyond = abs(y) > gap if where == 0 else where * y < gap
            low, high = (low, middle) if beyond else (middle, high)
        z, t = line_response(stiff, c, z, u, 0.0, high), stop + high
        where = int(np.sign(z[0])) if where == 0 else 0
        found.append(t)
    return np.array(found)


WALLS = """&scene kind='lumped' /
&mass name='body', value=1.0 /
&spring between='body','frame', stiffness=1.0, damping=0.1 /
&stop name='walls', between='body','frame', side='both', clearance=0.7, stiffness=30.0 /
&load on='body', shape='square', amplitude=1.0, frequency=0.17 /
&motion t_end=60.0, integrator='exact', start='given' /
&initial on='body', displacement=0.0 /
&record observable='displacement', what='trajectory','extrema', interval=0.1 /
"""


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_square_force_between_walls_against_an_independent_code(tmp_path, method):
    text = WALLS.replace("'exact'", f"'{method}', relative_tolerance=1e-12")
    run(tmp_path, text)
    with h5py.File("case.h5") as file:
        time = file["event/time"][:]
    expected = walls(1.0, 0.1, 0.7, 30.0, 1.0, 0.5 / 0.17, 60.0)
    expected = expected[expected < 60.0]
    assert expected.size > 30
    np.testing.assert_allclose(time, expected, rtol=0, atol=1e-9)


FRICTION = """&scene kind='lumped' /
&mass name='block', value=1.0 /
&friction name='floor', between='block','frame', static_coefficient=1.0, normal_load=1.0 /
&load on='block', shape='pulse', amplitude=3.0, duration=1.0, rise=0.0, delay=0.5 /
&motion t_end=5.0, integrator='{method}', start='given' /
&initial on='block', displacement=0.0 /
&record observable='displacement', what='trajectory', interval=0.5 /
"""


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_what_sticks_slides_when_the_force_jumps(tmp_path, method):
    seen = run(tmp_path, FRICTION.format(method=method))
    with h5py.File("case.h5") as file:
        time = file["event/time"][:]
    # Accelerated by 3 - 1 for 1 s, then braked by 1 for 2 s.
    np.testing.assert_allclose(time[:2], [0.5, 3.5], atol=1e-10)
    y = np.interp(seen["observable/time"], [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5], [0, 0.25, 1, 1.875, 2.5, 2.875, 3])
    np.testing.assert_allclose(seen["observable/displacement"], y, atol=1e-10)


STOP = """&scene kind='lumped' /
&mass name='body', value=1.0 /
&stop name='floor', between='body','frame', side='lower', clearance=0.0, law='rigid', restitution=0.5 /
&load on='body', shape='square', amplitude=-2.0, frequency=0.25 /
&motion t_end=4.0, integrator='{method}', start='given' /
&initial on='body', displacement=0.0 /
&record observable='displacement', what='trajectory', interval=0.25 /
"""


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_what_is_held_leaves_when_the_force_jumps(tmp_path, method):
    seen = run(tmp_path, STOP.format(method=method))
    with h5py.File("case.h5") as file:
        assert file["event/time"][0] == pytest.approx(2.0, abs=1e-12)
    t = seen["observable/time"]
    np.testing.assert_allclose(seen["observable/displacement"], np.where(t > 2, (t - 2) ** 2, 0), atol=1e-10)


def test_sweep_and_run_agree_bit_for_bit(tmp_path):
    case = tmp_path / "case.nml"
    case.write_text(WALLS + "&sweep parameter='load%frequency', first=0.1, last=0.3, points=5 /\n")
    succeed("razy-sweep", case, "--output", "sweep.h5")
    with h5py.File("sweep.h5") as file:
        offset = file["extrema/displacement/offset"][:]
        value = file["extrema/displacement/value"][:]
        frequency = file["axis/load.frequency"][:]
    for i, f in enumerate(frequency):
        succeed("razy-run", case, "--force", "--set", f"load%frequency={float(f)!r}")
        with h5py.File("case.h5") as file:
            assert (file["extrema/displacement/value"][:] == value[offset[i] : offset[i + 1]]).all()


BAD = {
    "amplitude=1.0, frequency=1.0, duty=0.3": "load%duty",
    "shape='square', amplitude=1.0": "load%shape",
    "shape='half_sine', amplitude=1.0": "load%duration",
    "shape='half_sine', amplitude=1.0, duration=2.0, frequency=1.0": "load%duration",
    "shape='pulse', amplitude=1.0, duration=1.0, rise=0.6": "load%rise",
    "shape='ramp', amplitude=1.0, duration=1.0, phase=10.0": "load%phase",
    "shape='ramp', unbalance=1.0, duration=1.0": "load%unbalance",
    "shape='ramp', amplitude=1.0, duration=1.0, beyond='hold'": "load%beyond",
    "file='{}', shape='ramp', duration=1.0": "load%shape",
    "file='{}', frequency=1.0": "load%file",
    "file='{}'": "load%beyond",
}


@pytest.mark.parametrize("load", BAD)
def test_bad_shapes_are_refused_in_one_line(tmp_path, load):
    (tmp_path / "table.csv").write_text("time [s], value [N]\n0, 1\n1, 2\n")
    check_refusal(tmp_path, load.format(tmp_path / "table.csv"), BAD[load].split("%")[1])


@pytest.mark.parametrize(
    ("table", "word"),
    [
        ("time, force\n0, 1\n1, 2\n", "value"),
        ("time, value\n0, 1\n", "two rows"),
        ("time, value\n0.5, 1\n1, 2\n", "first time"),
        ("time, value\n0, 1\n1, 2\n1, 3\n", "rises"),
        ("time, value\n0, 1\n1, nan\n", "nan"),
        ("time, value\n0, 1\n1, -1e31\n", "'-1e31', which is no real number up to 1e30"),
        ("time, value\n0, 1\n1\n", "1 values"),
    ],
)
def test_bad_tables_are_refused_in_one_line(tmp_path, table, word):
    (tmp_path / "table.csv").write_text(table)
    check_refusal(tmp_path, f"file='{tmp_path / 'table.csv'}', beyond='hold'", word)


def check_refusal(path, load, word):
    (path / "case.nml").write_text(OSCILLATOR.format(k=1.0, c=0.0, load=load, t_end=5.0, method="exact"))
    done = start("razy-run", path / "case.nml", "--check")
    assert done.returncode == 2
    assert word in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_branch_and_exponents_under_a_square_force(tmp_path):
    case = tmp_path / "case.nml"
    text = WALLS.replace("t_end=60.0", "t_end=61.0, lyapunov=2, lyapunov_periods=50")
    case.write_text(text + "&follow parameter='load%frequency', first=0.17, last=0.172 /\n")
    succeed("razy-follow", case, "--output", "branch.h5")
    with h5py.File("branch.h5") as file:
        multiplier, period = file["point/multiplier"][:], file["point/period"][:]
    # Of damping alone: exp(-c T).
    product = np.prod(multiplier[:, 0] + 1j * multiplier[:, 1], axis=1)
    np.testing.assert_allclose(product, np.exp(-0.1 * period), rtol=1e-10)
    succeed("razy-run", case, "--force")
    with h5py.File("case.h5") as file:
        assert file["lyapunov/exponent"][:].sum() == pytest.approx(-0.1, abs=1e-9)


MOVED = """&scene kind='{kind}' /
{body}
&stop name='table', between='body','frame', {stop}, motion_amplitude=0.2{motion} /
&motion t_end=6.0, integrator='{method}', start='given', relative_tolerance=1e-13 /
&record observable='displacement'{of}, what='trajectory', interval=0.05 /
"""
LUMPED = {"kind": "lumped", "body": "&mass name='body', value=1.0 /", "of": ""}
PLANAR = {"kind": "planar", "body": "&body name='body', mass=1.0, inertia=1.0 /", "of": ", of='body.y'"}
BOTH = "side='both', clearance=0.0, stiffness=9.0"


@pytest.mark.parametrize("method", ["exact", "dop853"])
@pytest.mark.parametrize(
    ("scene", "stop"), [(LUMPED, BOTH), (PLANAR, "direction=0.0,1.0, stiffness=9.0, clearance=-1.0")]
)
def test_a_body_on_a_stop_that_moves_by_a_ramp(tmp_path, method, scene, stop):
    """What a stop on both sides, or one pressed against it, does to a mass is what a spring does whose end moves."""
    motion = ", motion_shape='ramp', motion_duration=1.7"
    text = MOVED.format(**scene, stop=stop, motion=motion, method=method)
    if scene is PLANAR:
        text += "&load on='body.y', value=-9.0 /\n"
    (tmp_path / "moved.nml").write_text(text)
    succeed("razy-run", tmp_path / "moved.nml", "--force")
    with h5py.File("moved.h5") as file:
        t, found = file["time"][:], file["observable"][f"displacement{'.body.y' if scene is PLANAR else ''}"][:]
    expected = response(9.0, 0.0, [(0, 0, 9 * 0.2 / 1.7), (1.7, 9 * 0.2, 0)], t)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 if method == "exact" else 1e-11)


@pytest.mark.parametrize("method", ["exact", "dop853"])
@pytest.mark.parametrize("shape", [list(SHAPES)[k] for k in (1, 3, 4)])
def test_an_error_of_teeth_over_time(tmp_path, method, shape):
    """Without backlash x = q1 - q2 obeys x'' + 2 c x' + 2 k x = -2 (k u + c u') for equal wheels of radius 1."""
    k, c = 2.0, 0.3
    shape = shape.replace("duration=3.0", "duration=3.0, motion_rise=0.4").replace(", rise=0.4", "")
    error = ", ".join("motion_" + part.removeprefix("motion_") for part in shape.split(", "))
    text = f"""&scene kind='lumped' /
&inertia name='a', value=1.0 /
&inertia name='b', value=1.0 /
&gear_mesh name='teeth', between='a','b', radius=1.0,1.0, teeth=20,20, stiffness={k}, damping={c},
           separation='zero_deformation', {error} /
&motion t_end=20.0, integrator='{method}', relative_tolerance=1e-12, start='given' /
&initial on='a', displacement=0.0 /
&record observable='displacement', of='a', what='trajectory', interval=0.05 /
"""
    (tmp_path / "teeth.nml").write_text(text)
    succeed("razy-run", tmp_path / "teeth.nml", "--force")
    with h5py.File("teeth.h5") as file:
        time, x = file["observable/time"][:], 2 * file["observable/displacement.a"][:]
    period, pieces = SHAPES[shape.replace("duration=3.0, motion_rise=0.4", "duration=3.0, rise=0.4")]
    forces = [(t, -2 * (k * u + c * s), -2 * k * s) for t, u, s in repeated(period, pieces, 20.0)]
    y = response(2 * k, 2 * c, forces, time, 1.5)
    np.testing.assert_allclose(np.ravel(x), y, rtol=0, atol=(1e-12 if method == "exact" else 1e-10) * abs(y).max())


def test_a_table_moves_a_stop_as_a_ramp_does(tmp_path):
    (tmp_path / "ramp.csv").write_text("time [s], value [m]\n0, 0\n1.7, 0.2\n")
    found = []
    for motion in ("shape='ramp', motion_duration=1.7", f"file='{tmp_path}/ramp.csv', motion_beyond='hold'"):
        text = MOVED.format(**LUMPED, stop=BOTH, motion=f", motion_{motion}", method="exact")
        text = text.replace("=0.2", "=1.0") if "file" in motion else text
        found.append(run(tmp_path, text)["observable/displacement"])
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("stop", "motion", "word"),
    [
        (BOTH, ", motion_shape='square', motion_frequency=1.0", "one without jumps"),
        (BOTH, ", motion_shape='pulse', motion_duration=1.0", "one without jumps"),
        (BOTH, ", motion_file='{path}/jump.csv', motion_beyond='periodic'", "one without jumps"),
        (
            BOTH,
            ", motion_file='{path}/jump.csv', motion_interpolation='held', motion_beyond='hold'",
            "one without jumps",
        ),
        (BOTH, ", motion_file='{path}/unit.csv', motion_beyond='hold'", "column 'value' is in mm, not in m or rad"),
        (
            "law='rigid', restitution=0.5, clearance=1.0",
            ", motion_shape='ramp', motion_duration=1.0",
            "one that gives way",
        ),
    ],
)
def test_what_cannot_move_a_stop_is_refused(tmp_path, stop, motion, word):
    (tmp_path / "jump.csv").write_text("time [s], value [m]\n0, 0\n1.7, 0.2\n")
    (tmp_path / "unit.csv").write_text("time [s], value [mm]\n0, 0\n1.7, 0.2\n")
    text = MOVED.format(**LUMPED, stop=stop, motion=motion.format(path=tmp_path), method="exact")
    (tmp_path / "bad.nml").write_text(text)
    done = start("razy-run", tmp_path / "bad.nml")
    assert done.returncode == 2 and word in done.stderr and done.stderr.count("\n") == 1, done.stderr


def test_what_acts_once_has_no_branch(tmp_path):
    text = OSCILLATOR.format(k=1.0, c=0.1, load="shape='ramp', amplitude=1.0, duration=1.0", t_end=5.0, method="exact")
    (tmp_path / "case.nml").write_text(text + "&follow parameter='load%amplitude', first=1.0, last=2.0 /\n")
    done = start("razy-follow", tmp_path / "case.nml")
    assert done.returncode == 2
    assert "once" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def table(path, time, value, unit="N"):
    rows = "".join(f"{t!r}, {u!r}\n" for t, u in np.transpose([time, value]).tolist())
    path.write_text(f"time [s], value [{unit}]\n{rows}")


@pytest.mark.parametrize(("ends", "beyond"), [("natural", "hold"), ("natural", "zero"), ("periodic", "periodic")])
def test_a_cubic_table_beside_scipy(tmp_path, ends, beyond):
    """y'' = u, twice integrated by SciPy's spline, whose antiderivatives are exact."""
    time = np.array([0.0, 0.7, 1.0, 1.9, 2.2, 3.1, 4.0])
    value = np.array([1.0, -0.4, 0.3, 2.0, 1.1, -0.7, 1.0])
    table(tmp_path / "u.csv", time, value)
    load = f"file='{tmp_path / 'u.csv'}', amplitude=1.5, interpolation='cubic', beyond='{beyond}'"
    seen = run(tmp_path, OSCILLATOR.format(k=0.0, c=0.0, load=load, t_end=11.0, method="dop853"))
    spline = CubicSpline(time, value, bc_type=ends)
    t, last = seen["observable/time"], time[-1]
    if beyond == "periodic":
        y, z = np.zeros_like(t), np.zeros(2)
        for n in range(3):
            inside = (t >= n * last) & (t < (n + 1) * last + 1e-12)
            y[inside] = z[0] + z[1] * (t[inside] - n * last) + spline.antiderivative(2)(t[inside] - n * last)
            z = z + [z[1] * last + spline.antiderivative(2)(last), spline.antiderivative()(last)]
    else:
        over = np.maximum(t - last, 0.0)
        y = spline.antiderivative(2)(np.minimum(t, last)) + spline.antiderivative()(last) * over
        y += (beyond == "hold") * value[-1] * over**2 / 2
    np.testing.assert_allclose(np.ravel(seen["observable/displacement"]), 1.5 * y, rtol=0, atol=1e-11 * abs(y).max())
    refused = start("razy-run", tmp_path / "case.nml", "--force", "--set", "motion%integrator='exact'")
    assert refused.returncode == 2
    assert "where a table has interpolation = 'cubic'" in refused.stderr
    # By itself it takes another method.
    succeed("razy-run", tmp_path / "case.nml", "--force", "--set", "motion%integrator='automatic'")


def test_a_cubic_motion_of_a_stop_beside_scipy(tmp_path):
    """A damped stop that holds both ways: k s + c s', s = y - u, so that the rate of the table acts too."""
    time, k, c = np.linspace(0.0, 5.0, 11), 9.0, 0.4
    value = 0.1 * np.sin(2 * time) * time
    table(tmp_path / "u.csv", time, value, "m or rad")
    text = f"""&scene kind='lumped' /
&mass name='body', value=1.0 /
&stop name='hold', between='body','frame', side='both', clearance=0.0, stiffness={k}, damping={c},
      separation='zero_deformation', motion_file='{tmp_path / "u.csv"}', motion_amplitude=1.0,
      motion_interpolation='cubic' /
&motion t_end=5.0, integrator='dop853', relative_tolerance=1e-12, start='given' /
&initial on='body', displacement=0.0 /
&record observable='displacement', what='trajectory', interval=0.05 /
"""
    seen = run(tmp_path, text)
    u = CubicSpline(time, value, bc_type="natural")
    right = solve_ivp(
        lambda t, z: [z[1], k * (u(t) - z[0]) + c * (u(t, 1) - z[1])],
        (0, 5),
        [0, 0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
        max_step=0.01,
        t_eval=np.minimum(seen["observable/time"], 5.0),
    ).y[0]
    np.testing.assert_allclose(np.ravel(seen["observable/displacement"]), right, rtol=0, atol=1e-9 * abs(right).max())


def test_a_cubic_period_ends_as_it_begins(tmp_path):
    table(tmp_path / "u.csv", [0.0, 1.0, 2.0], [0.0, 1.0, 0.5])
    load = f"file='{tmp_path / 'u.csv'}', amplitude=1.0, interpolation='cubic', beyond='periodic'"
    check_refusal(tmp_path, load, "whose last value")


def test_a_damped_stop_that_moves_in_straight_lines(folder):
    """Its damper feels the speed of the lines: extrema of force and depth by the closed form and step by step."""
    (folder / "case.nml").write_text(
        "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=100.0, damping=1.0 /\n"
        "&stop name='s', between='m','frame', clearance=0.01, stiffness=1e4, damping=50.0, motion_shape='pulse',"
        " motion_amplitude=-0.05, motion_duration=0.5, motion_rise=0.2 /\n&motion t_end=1.0, start='zero' /\n"
        "&record observable='contact_force', what='extrema' /\n"
        "&record observable='relative_displacement', what='extrema' /\n"
    )
    found = []
    steps = ("--set", "motion%relative_tolerance=1e-12", "--set", "motion%absolute_tolerance=1e-14")
    for integrator in ("exact", "dop853"):
        succeed("razy-run", "case.nml", "--force", "--set", f"motion%integrator='{integrator}'", *steps)
        with h5py.File("case.h5") as file:
            found.append([file[f"extrema/{name}/value"][:] for name in ("contact_force", "relative_displacement")])
    for closed, stepped in zip(*found, strict=True):
        np.testing.assert_allclose(closed, stepped, rtol=0, atol=1e-8 * np.abs(stepped).max())
