"""Bearings and seals with coefficients over the speed: in motions, the Campbell diagram and the response."""

import h5py
import numpy as np
import pytest
from programs import sets, start, succeed, values_of
from scipy.integrate import solve_ivp
from scipy.interpolate import PchipInterpolator

RPM = 30.0 / np.pi
COLUMNS = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy")
HEADER = "speed_rpm, kxx [N/m], kxy [N/m], kyx [N/m], kyy [N/m], cxx [N s/m], cxy [N s/m], cyx [N s/m], cyy [N s/m]"
SPEEDS = (1000.0, 2000.0, 4000.0)
ROWS = (
    (8e6, 2e6, -6e6, 9e6, 9e3, 1e2, 3e2, 8e3),
    (9e6, 3e6, -7e6, 8e6, 8e3, 2e2, 2e2, 9e3),
    (7e6, 5e6, -9e6, 6e6, 5e3, 4e2, 1e2, 4e3),
)
ROTOR = """&scene kind='rotor' /
&shaft name='a', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0 /
&section shaft='a', length=0.4, outer_diameter=0.03, elements=4 /
&disk shaft='a', node=3, mass=8.0, polar_inertia=0.03, diametral_inertia=0.016 /
&freedom axial=.false., torsion=.false. /
&rotation speed_rpm=2000.0 /
&modes count=6 /
&unbalance shaft='a', node=3, moment=2e-4 /
&record observable='displacement', of='a.3.v', what='extrema' /
&record observable='displacement', of='a.3.w', what='extrema' /
"""
TABLES = "".join(f"&bearing shaft='a', node={node}, kind='table', file='oil.csv' /\n" for node in (1, 5))
# A rigid body on one bearing: m v'' + k(speed) v = 0, and no tilting.
RIGID = """&scene kind='rotor' /
&shaft name='a', young_modulus=2.1e11, poisson_ratio=0.3, density=1e-6 /
&section shaft='a', length=0.2, outer_diameter=0.1, elements=1 /
&disk shaft='a', node=1, mass=5.0, polar_inertia=0.0, diametral_inertia=1.0 /
&support shaft='a', node=1, held='theta','psi' /
&freedom axial=.false., torsion=.false. /
&modes count=2 /
&bearing shaft='a', node=1, kind='table', file='oil.csv' /
&campbell first_rpm=1000.0, last_rpm=4000.0, points=4 /
"""


def write_table(folder, rows=ROWS, speeds=SPEEDS, header=HEADER):
    lines = [", ".join(map(repr, (speed, *row))) for speed, row in zip(speeds, rows, strict=True)]
    (folder / "oil.csv").write_text("# an oil film\n" + "\n".join([header, *lines]) + "\n")


def matrices(row):
    k, c = (",".join(map(repr, part)) for part in (row[:4], row[4:]))
    return "".join(
        f"&bearing shaft='a', node={node}, kind='matrix', stiffness={k}, damping_matrix={c} /\n" for node in (1, 5)
    )


def modes(text):
    with open("case.nml", "w") as file:
        file.write(text)
    said = succeed("razy-modes", "case.nml", "--output", "modes.h5", "--force").stdout
    return said, values_of("modes.h5")


def test_campbell_at_the_speeds_of_the_table(folder):
    write_table(folder)
    _, found = modes(ROTOR + TABLES + "&campbell first_rpm=1000.0, last_rpm=4000.0, points=4, damped=.true. /\n")
    for speed, row, at in zip(SPEEDS, ROWS, (0, 1, 3), strict=True):
        campbell = f"&campbell first_rpm={speed}, last_rpm={speed + 1.0}, points=2, damped=.true. /\n"
        _, given = modes(ROTOR + matrices(row) + campbell)
        np.testing.assert_allclose(found["eigenvalue"][at], given["eigenvalue"][0], rtol=1e-9, atol=1e-6)
    # Undamped, the symmetric part of the stiffness alone.
    _, found = modes(ROTOR + TABLES + "&campbell first_rpm=2000.0, last_rpm=4000.0, points=2 /\n")
    even = (9e6, -2e6, -2e6, 8e6, *4 * (0.0,))
    _, given = modes(ROTOR + matrices(even) + "&campbell first_rpm=2000.0, last_rpm=4000.0, points=2 /\n")
    np.testing.assert_allclose(found["frequency"][0], given["frequency"][0], rtol=1e-9)


def test_critical_speed_in_closed_form(folder):
    """With k = k0 + k1 speed the critical speed is the root of m speed² - k1 speed - k0 = 0."""
    k0, k1, mass = 1.0e5, 800.0, 5.0
    speeds = (1000.0, 1700.0, 2900.0, 4000.0)
    rows = [(k, 0.0, 0.0, k, *4 * (0.0,)) for k in (k0 + k1 * speed / RPM for speed in speeds)]
    write_table(folder, rows, speeds)
    said, found = modes(RIGID)
    expected = (k1 + np.sqrt(k1**2 + 4 * mass * k0)) / (2 * mass)
    assert len(found["critical_speed"]) == 2, said
    np.testing.assert_allclose(found["critical_speed"], expected, rtol=1e-6)


def test_stability_between_two_ranges_of_instability(folder):
    """With k, cross coupling q and damping c in both directions the rigid body is unstable where q > c sqrt(k/m)."""
    k, mass = 1.0e5, 5.0
    least = float(2.0e3 / np.sqrt(k / mass))
    speeds = np.linspace(1000.0, 6000.0, 6)
    rows = [(k, 2.0e3, -2.0e3, k, c * least, 0.0, 0.0, c * least) for c in (0.5, 0.5, 1.5, 1.5, 0.5, 0.5)]
    write_table(folder, rows, speeds.tolist())
    case = RIGID.replace("density=1e-6", "density=0.0")
    said, found = modes(case.replace("last_rpm=4000.0, points=4", "last_rpm=6000.0, points=6, damped=.true."))
    # Between flat ends the cubic is half-way in its middle, at 4500 rpm.
    words = "unstable at the first speed already, no more at 3000.00 rpm, "
    words += "again above 471.239 rad/s = 4500.00 rpm, 22.508 Hz"
    assert "stability limit: " + words in said
    with h5py.File("modes.h5") as file:
        assert words == ", ".join(file["stability_limit"].attrs[name] for name in ("meaning", "then"))
    assert np.isnan(found["stability_limit"])
    np.testing.assert_allclose(found["stability_frequency"], np.sqrt(k / mass) / (2 * np.pi), rtol=1e-9)


def test_response_and_run(folder):
    """At a speed of the table as with the matrices; the long run ends in the response."""
    write_table(folder)
    over = "&response parameter='rotation%speed_rpm', first={}, last=4000.0, points=3 /\n"
    _, found = modes(ROTOR + TABLES + over.format(2000.0))
    _, given = modes(ROTOR + matrices(ROWS[1]) + over.format(2000.0))
    name = "response/phasor/displacement.a.3.v"
    names = [key for key in found if key.startswith("response/phasor/")]
    assert name in names, names
    for key in names:
        np.testing.assert_allclose(found[key][0], given[key][0], rtol=1e-9)
    case = folder / "run.nml"
    case.write_text(
        ROTOR.replace("'extrema'", "'extrema', from=3.5")
        + TABLES
        + "&motion t_end=4.0, start='zero', integrator='exact' /\n"
    )
    succeed("razy-run", case, "--output", "run.h5")
    with h5py.File("run.h5") as file:
        largest = np.abs(file["extrema/displacement.a.3.v/value"][()]).max()
    amplitude = np.hypot(*found[name][0, 0])
    assert largest == pytest.approx(amplitude, rel=1e-9)


def test_connection_force(folder):
    """In a motion, the response and a sweep over the speed: K(speed) q + C(speed) q', at the speeds of the table."""
    write_table(folder)
    record = "&record observable='{}', of='{}.{}', what='{}' /\n"
    text = ROTOR.replace(" node=3, moment", " node=2, moment").split("&record")[0] + TABLES.replace(
        "&bearing", "&bearing name='film',", 1
    )
    kinds = (("displacement", "a.1"), ("velocity", "a.1"), ("connection_force", "film"))

    def write(what, more):
        records = "".join(record.format(kind, of, axis, what) for kind, of in kinds for axis in "vw")
        (folder / "case.nml").write_text(text + records + more)

    def check(found, of, row, omega=None):
        q, v, force = (np.array([found[of.format(f"{kind}.{at}.{axis}")] for axis in "vw"]) for kind, at in kinds)
        if omega is not None:
            v = 1j * omega * q
        right = np.reshape(row[:4], (2, 2)) @ q + np.reshape(row[4:], (2, 2)) @ v
        assert abs(right).max() > 1.0
        np.testing.assert_allclose(force, right, rtol=1e-9, atol=1e-9 * abs(right).max())

    write("trajectory", "&motion t_end=0.2 /\n")
    for speed, row in zip(SPEEDS, ROWS, strict=True):
        succeed("razy-run", "case.nml", "--output", "run.h5", "--force", *sets(rotation__speed_rpm=speed))
        check(values_of("run.h5"), "observable/{}", row)
    over = "parameter='rotation%speed_rpm', first=1000.0, last=4000.0, points=4 /\n"
    write("extrema", f"&response {over}&motion t_end=0.2 /\n&sweep {over}")
    _, found = modes((folder / "case.nml").read_text())
    for speed, row, at in zip(SPEEDS, ROWS, (0, 1, 3), strict=True):
        here = {name: value[at, 0] @ [1, 1j] for name, value in found.items() if name.startswith("response/phasor/")}
        check(here, "response/phasor/{}", row, speed / RPM)
    succeed("razy-sweep", "case.nml", "--output", "sweep.h5")
    swept = values_of("sweep.h5")
    text = ROTOR.replace(" node=3, moment", " node=2, moment").split("&record")[0]
    for speed, row, at in zip(SPEEDS, ROWS, (0, 1, 3), strict=True):
        text_of_row = text + matrices(row).replace("&bearing", "&bearing name='film',", 1) + "&motion t_end=0.2 /\n"
        records = "".join(record.format("connection_force", "film", axis, "extrema") for axis in "vw")
        (folder / "given.nml").write_text(text_of_row + records)
        succeed("razy-run", "given.nml", "--output", "given.h5", "--force", *sets(rotation__speed_rpm=speed))
        given = values_of("given.h5")
        for axis in "vw":
            name = f"extrema/connection_force.film.{axis}/"
            ours = swept[name + "value"][slice(*swept[name + "offset"][at : at + 2])]
            np.testing.assert_allclose(ours, given[name + "value"], rtol=1e-7, atol=1e-7 * abs(ours).max())


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"speeds": (1000.0, 3000.0, 2000.0)}, "rises from row to row; row 3 has 2000.000"),
        ({"header": HEADER.replace("kyx", "kux")}, "oil.csv:2: no column 'kyx'"),
        ({"rows": ROWS[:1], "speeds": SPEEDS[:1]}, "a file with at least two speeds"),
    ],
)
def test_tables_refused(folder, change, says):
    write_table(folder, **change)
    (folder / "case.nml").write_text(ROTOR + TABLES)
    done = start("razy-modes", "case.nml")
    assert done.returncode == 2 and says in done.stderr and done.stderr.count("\n") == 1, done.stderr


def test_speeds_outside_refused(folder):
    write_table(folder)
    (folder / "case.nml").write_text(
        ROTOR + TABLES + "&campbell first_rpm=0.0, last_rpm=4000.0 /\n&motion t_end=0.1 /\n"
    )
    done = start("razy-modes", "case.nml")
    assert done.returncode == 2, done.stderr
    assert "&campbell first_rpm = 0.0" in done.stderr and "1000.0 to 4000.0 rpm" in done.stderr
    done = start("razy-run", "case.nml", *sets(rotation__speed_rpm=4100.0))
    assert done.returncode == 2, done.stderr
    assert "&rotation%speed_rpm = 4100.0" in done.stderr and "1000.0 to 4000.0 rpm" in done.stderr


def test_run_up_beside_scipy(folder):
    """An element on an oil film, with disk and unbalance at its other end: it has the coefficients of each moment."""
    write_table(folder)
    length, inertia, line = 0.4, np.pi * 0.03**4 / 64, 7850.0 * np.pi * 0.03**2 / 4
    text = f"""&scene kind='rotor' /
&shaft name='a', young_modulus=2.1e11, shear_modulus=8e10, density=7850.0, rotary_inertia=.false. /
&section shaft='a', length={length}, outer_diameter=0.03 /
&disk shaft='a', node=2, mass=3.0, polar_inertia=0.0, diametral_inertia=0.01 /
&freedom axial=.false., torsion=.false. /
&bearing shaft='a', name='film', node=1, kind='table', file='oil.csv' /
&bearing shaft='a', node=2, kind='matrix', stiffness=1e6,0.0,0.0,2e6, damping_matrix=50.0,0.0,0.0,50.0 /
&unbalance shaft='a', node=2, moment=1e-3 /
&rotation speed_rpm=1000.0, acceleration_rpm_per_s=3e4, gyroscopic=.false. /
&motion t_end=0.1, start='zero', relative_tolerance=1e-11, absolute_tolerance=1e-14 /
"""
    text += "".join(
        f"&record observable='displacement', of='a.{place}', what='trajectory', interval=0.01 /\n"
        for place in ("1.v", "1.w", "2.v", "2.w")
    )
    (folder / "up.nml").write_text(text)
    succeed("razy-run", "up.nml")
    found = values_of("up.h5")
    a, b = np.array([12, 6, -12, 6.0]), np.array([6, 4, -6, 2.0])
    stiffness = np.array([a, b, -a, [6, 2, -6, 4]]) * 2.1e11 * inertia / length**3
    mass = (
        np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4.0]]) * line * length / 420
    )
    size = np.array([1, length, 1, length])
    stiffness, mass = stiffness * np.outer(size, size), mass * np.outer(size, size)
    mass[[2, 3], [2, 3]] += [3.0, 0.01]
    inverse = np.linalg.inv(mass)
    film = PchipInterpolator(np.array(SPEEDS) / RPM, np.array(ROWS))

    def derivative(t, z):
        q, rate = z[:8].reshape(2, 4), z[8:].reshape(2, 4)
        speed, change = 1000.0 / RPM + 3e4 / RPM * t, 3e4 / RPM
        turned = 1000.0 / RPM * t + change * t**2 / 2
        force = -q @ stiffness
        k, c = film(speed).reshape(2, 2, 2)
        force[:, 0] -= k @ q[:, 0] + c @ rate[:, 0]
        force[:, 2] -= np.array([1e6, 2e6]) * q[:, 2] + 50.0 * rate[:, 2]
        cos, sin = np.cos(turned), np.sin(turned)
        force[:, 2] += 1e-3 * (speed**2 * np.array([cos, sin]) + change * np.array([sin, -cos]))
        return np.concatenate([z[8:], (force @ inverse).ravel()])

    at = np.minimum(found["time"], 0.1)
    right = solve_ivp(derivative, (0.0, 0.1), np.zeros(16), method="DOP853", rtol=1e-10, atol=1e-14, t_eval=at).y
    for row, place in zip((0, 4, 2, 6), ("1.v", "1.w", "2.v", "2.w"), strict=True):
        scale = np.max(np.abs(right[row]))
        np.testing.assert_allclose(found[f"observable/displacement.a.{place}"], right[row], atol=1e-7 * scale)
    for change, complaint in (
        (
            ("speed_rpm=1000.0", "speed_rpm=1500.0"),
            "&rotation speed_rpm = 1500.0: such that the shaft of bearing 1 turns",
        ),
        (("'displacement', of='a.1.v'", "'connection_force', of='film.v'"), "a bearing without a table"),
    ):
        (folder / "bad.nml").write_text(text.replace(*change))
        done = start("razy-run", "bad.nml")
        assert done.returncode == 2
        assert complaint in done.stderr


def test_a_table_at_a_node_that_is_held_one_way(folder):
    """A diagram of few modes is solved in bands, one of many dense: both have what is left to the bearing."""
    (folder / "film.csv").write_text(
        "speed_rpm, kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy\n"
        "0, 1e6, 0, 0, 1e6, 1e3, 0, 0, 1e3\n10000, 3e6, 4e5, -4e5, 2e6, 5e2, 0, 0, 5e2\n"
    )
    (folder / "case.nml").write_text(
        "&shaft name='r', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0 /\n"
        "&section shaft='r', length=1.5, outer_diameter=0.05, elements=30 /\n"
        "&bearing shaft='r', node=1, kind='table', file='film.csv' /\n"
        "&bearing shaft='r', node=31, kind='matrix', stiffness=1e6,0,0,8e5, damping_matrix=1e3,0,0,1e3 /\n"
        "&support shaft='r', node=1, held='u','phi','v' /\n&rotation speed_rpm=1000.0 /\n"
        "&campbell last_rpm=9000.0, points=5, damped=.true. /\n"
    )
    found = []
    for count in (6, 70):
        succeed("razy-modes", "case.nml", "--set", f"modes%count={count}", "--force")
        with h5py.File("case.h5") as file:
            found.append(file["eigenvalue"][..., 0] + 1j * file["eigenvalue"][..., 1])
    for banded, dense in zip(*found, strict=True):
        for value in banded:
            assert np.abs(dense - value).min() < 1e-8 * abs(value)
