"""Mesh stiffness that switches or has harmonics: exact beside DOP853, Meissner's and Mathieu's equations."""

import numpy as np
import pytest
from programs import GEAR_PAIR, SOURCE, run, sets, start

# Two equal wheels without backlash, shafts or load: m d'' + k(t) d = 0 with m = I/(2 r²) and 40 teeth at 60 rpm, 40 Hz.
INERTIA, RADIUS, HERTZ = 0.01, 0.1, 40.0
MASS = INERTIA / (2 * RADIUS**2)
WHEELS = """&scene kind='lumped' /
&inertia name='a', value=0.01 /
&inertia name='b', value=0.01 /
&gear_mesh name='mesh', between='a','b', radius=0.1,0.1, teeth=40,40, stiffness={stiffness!r}, {variation} /
&rotation speed_rpm=60.0, of='a' /
&initial on='a', displacement=1e-6 /
&motion t_end=0.5, start='given', integrator='{integrator}', relative_tolerance=1e-13, absolute_tolerance=1e-20 /
&record observable='mesh_deformation', what='trajectory', interval=0.025 /
"""


def trace(folder, stiffness, variation, integrator):
    """The trace of the map of a period of the teeth: d(t + 2T) - trace d(t + T) + d(t) = 0."""
    text = WHEELS.format(stiffness=stiffness, variation=variation, integrator=integrator)
    (folder / "wheels.nml").write_text(text)
    found = run("wheels.nml")
    assert found["outcome/excitation_period"] == pytest.approx(1 / HERTZ)
    d = np.ravel(found["observable/mesh_deformation"])
    assert len(d) == 21
    return np.dot(d[2:] + d[:-2], d[1:-1]) / np.dot(d[1:-1], d[1:-1])


def meissner(stiffness, share, ratio):
    """The same with two pairs for a share of the period and `ratio` times the stiffness of one; its mean is given."""
    one = stiffness / (1 + share * (ratio - 1))
    w1, w2 = np.sqrt(one / MASS), np.sqrt(ratio * one / MASS)
    a, b = w1 * (1 - share) / HERTZ, w2 * share / HERTZ
    return 2 * np.cos(a) * np.cos(b) - (w1 / w2 + w2 / w1) * np.sin(a) * np.sin(b)


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_meissner(folder, integrator):
    """Stable and unstable sides of the first two tongues (van der Pol and Strutt, Phil. Mag. 5 (1928))."""
    share, ratio = 0.6, 1.8
    first = MASS * (np.pi * HERTZ) ** 2
    sides = set()
    for part in (0.6, 0.98, 1.05, 1.6, 3.5, 4.05, 9.3):
        expected = meissner(part * first, share, ratio)
        sides.add(int(expected > 2) - int(expected < -2))
        found = trace(
            folder, part * first, f"contact_ratio={1 + share}, pair_ratio={ratio}, mesh_phase=70.0", integrator
        )
        assert found == pytest.approx(expected, abs=1e-9), part
    assert {-1, 0} <= sides
    # Two pairs and three: the stiffness of one pair each, unless said.
    expected = meissner(0.98 * first, 0.3, 1.5)
    for given in ("contact_ratio=2.3", "contact_ratio=2.3, pair_ratio=1.5", "contact_ratio=1.3, pair_ratio=1.5"):
        assert trace(folder, 0.98 * first, given, integrator) == pytest.approx(expected, abs=1e-9)
    # At the edges of the first tongue with equal halves the trace is -2.
    for low, high in ((0.7, 1.0), (1.0, 1.5)):
        inside = abs(meissner(low * first, 0.5, 3.0)) > 2
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if (abs(meissner(middle * first, 0.5, 3.0)) > 2) == inside else (low, middle)
        found = trace(folder, middle * first, "contact_ratio=1.5, pair_ratio=3.0", integrator)
        assert found == pytest.approx(-2.0, abs=1e-9)


@pytest.mark.parametrize("edge", [3.917024772998471, 4.371300982735086])
def test_mathieu(folder, edge):
    """The second tongue of Mathieu's equation at q = 1 lies between b_2 and a_2 (DLMF, 28.6; SciPy)."""
    # With the half phase z of the teeth d_zz + (a - 2 q cos 2z) d = 0.
    traces = []
    for a in (edge - 1e-3, edge, edge + 1e-3):
        stiffness = a * MASS * (np.pi * HERTZ) ** 2
        traces.append(trace(folder, stiffness, f"stiffness_cosine={-2 / a!r}", "dop853"))
    assert traces[1] == pytest.approx(2.0, abs=1e-8)
    within, out = (traces[2], traces[0]) if edge < 4 else (traces[0], traces[2])
    assert within > 2 + 1e-4 and out < 2 - 1e-4


def test_a_file_is_its_harmonics(folder):
    """A table that begins anywhere, by its two harmonics; its mean does not count, mesh_phase does."""
    angle = np.radians(7.5 + 15.0 * np.arange(24))
    values = 3e5 * (1 + 0.2 * np.sin(angle) - 0.1 * np.cos(2 * angle) + 0.05 * np.sin(2 * angle))
    rows = "\n".join(f"{a}, {k}" for a, k in zip(np.degrees(angle), values, strict=True))
    (folder / "teeth.csv").write_text(f"angle_deg, stiffness [N/m]\n{rows}\n")
    found = []
    for variation in (
        "stiffness_file='teeth.csv'",
        "stiffness_sine=0.2,0.05, stiffness_cosine=0.0,-0.1",
        "stiffness_sine=0.2,0.05, stiffness_cosine=0.0,-0.11",
    ):
        text = WHEELS.format(stiffness=4e5, variation=f"{variation}, mesh_phase=40.0", integrator="dop853")
        (folder / "wheels.nml").write_text(text)
        found.append(run("wheels.nml")["observable/mesh_deformation"])
    scale = np.max(np.abs(found[0]))
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-9 * scale)
    assert np.max(np.abs(found[2] - found[0])) > 1e-4 * scale
    values[3] *= -20
    rows = "\n".join(f"{a}, {k}" for a, k in zip(np.degrees(angle), values, strict=True))
    (folder / "teeth.csv").write_text(f"angle_deg, stiffness\n{rows}\n")
    for more, says in (("", "amplitudes whose sum is less than 1"), (", contact_ratio=1.5", "harmonics from a file")):
        (folder / "wheels.nml").write_text(
            WHEELS.format(stiffness=4e5, variation="stiffness_file='teeth.csv'" + more, integrator="dop853")
        )
        done = start("razy-run", "wheels.nml")
        assert done.returncode == 2 and says in done.stderr, done.stderr


def of_rows(folder, angle, values):
    rows = "\n".join(f"{a!r}, {k!r}" for a, k in zip(angle, values, strict=True))
    (folder / "teeth.csv").write_text(f"angle_deg, stiffness [N/m]\n{rows}\n")
    return "stiffness_file='teeth.csv', stiffness_course='held'"


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_a_held_file_is_hills_equation_in_pieces(folder, integrator):
    """Each row lasts up to the next: the map of a period is a product of closed ones, wherever the table begins."""
    first = MASS * (np.pi * HERTZ) ** 2
    rows = np.array([1.0, 2.5, 2.5, 0.4, 1.7])
    for part in (0.98, 1.6, 4.05):
        whole = np.eye(2)
        for k in part * first * rows / rows.mean():
            w = np.sqrt(k / MASS)
            c, s = np.cos(w / HERTZ / 5), np.sin(w / HERTZ / 5)
            whole = np.array([[c, s / w], [-w * s, c]]) @ whole
        for start_at in (0.0, 31.0):
            variation = of_rows(folder, (start_at + 72.0 * np.arange(5)).tolist(), (7e3 * rows).tolist())
            found = trace(folder, part * first, f"{variation}, mesh_phase=200.0", integrator)
            assert found == pytest.approx(np.trace(whole), abs=1e-9), part


def test_two_held_rows_in_three_are_a_contact_ratio(folder):
    values = {}
    for variation in (
        of_rows(folder, [0.0, 120.0, 240.0], [3.0, 3.0, 2.0]) + ", mesh_phase=25.0",
        f"contact_ratio={5 / 3!r}, pair_ratio=1.5, mesh_phase=25.0",
    ):
        (folder / "wheels.nml").write_text(WHEELS.format(stiffness=4e5, variation=variation, integrator="exact"))
        values[variation[:4]] = run("wheels.nml")["observable/mesh_deformation"]
    one, other = values.values()
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * np.max(np.abs(one)))


def test_whole_periods_of_the_phase_do_not_count(folder):
    found = []
    for phase in (25.0, 25.0 + 360.0e6, 1e30 % 360.0, 1e30):
        variation = f"contact_ratio=1.5, mesh_phase={phase!r}"
        (folder / "wheels.nml").write_text(WHEELS.format(stiffness=4e5, variation=variation, integrator="exact"))
        found.append(run("wheels.nml")["observable/mesh_deformation"])
    np.testing.assert_array_equal(found[::2], found[1::2])


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ([1.0, 2.0, 0.0], "at most 360 rows, all above 0"),
        ([1.0] * 361, "at most 360 rows, all above 0"),
        ([1.0, 2.0], "a file with 3 to"),
        ([], "'held' with a stiffness_file"),
    ],
)
def test_held_files_refused(folder, values, says):
    variation = of_rows(folder, [360.0 * i / len(values) for i in range(len(values))], values)
    if not values:
        variation = "stiffness_course='held'"
    (folder / "wheels.nml").write_text(WHEELS.format(stiffness=4e5, variation=variation, integrator="exact"))
    done = start("razy-run", "wheels.nml")
    assert done.returncode == 2 and says in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr


def test_exact_and_dop853(folder):
    """A gear pair with backlash that loses contact, at a speed where its motion settles."""
    options = sets(
        gear_mesh__contact_ratio=1.6, gear_mesh__pair_ratio=1.7, gear_mesh__error_sine=1e-5, rotation__speed_rpm=2400.0,
        motion__t_end=0.1,
    )  # fmt: skip
    options += ["--set", "record%from=0.08"]
    exact = run(GEAR_PAIR, *options, *sets(motion__integrator="'exact'"))
    other = run(
        GEAR_PAIR,
        *options,
        *sets(motion__integrator="'dop853'", motion__relative_tolerance=1e-13, motion__absolute_tolerance=1e-16),
    )
    values, beside = (found["extrema/mesh_deformation/value"] for found in (exact, other))
    assert len(values) == len(beside) > 20
    np.testing.assert_allclose(beside, values, rtol=0, atol=1e-9 * np.abs(values).max())


@pytest.mark.parametrize("ratio", [1.0, 2.0, 3.0])
def test_as_many_pairs_all_the_time_are_a_constant_stiffness(folder, ratio):
    found = []
    for variation in (f"contact_ratio={ratio}", "mesh_phase=0.0"):
        (folder / "wheels.nml").write_text(WHEELS.format(stiffness=1e6, variation=variation, integrator="exact"))
        found.append(run("wheels.nml")["observable/mesh_deformation"])
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("contact_ratio=1.5, stiffness_sine=0.1", "left out where the stiffness has harmonics"),
        ("stiffness_sine=0.6, stiffness_cosine=0.5", "amplitudes whose sum is less than 1"),
        ("stiffness_sine=0.6", "'exact' needs laws that are linear"),
        ("contact_ratio=10.5", "from 1.0 to 10.0"),
    ],
)
def test_refused(folder, change, says):
    (folder / "wheels.nml").write_text(WHEELS.format(stiffness=1e6, variation=change, integrator="exact"))
    done = start("razy-run", "wheels.nml")
    assert done.returncode == 2 and says in done.stderr and done.stderr.count("\n") == 1, done.stderr
    text = WHEELS.format(stiffness=1e6, variation="contact_ratio=1.5", integrator="dop853")
    (folder / "wheels.nml").write_text(text)
    done = start("razy-run", "wheels.nml", *sets(motion__treatment="'smoothing'"))
    assert "'event': a mesh stiffness switches" in done.stderr


def test_rotor(folder):
    """The gearbox of two shafts by finite elements."""
    options = sets(gear_mesh__contact_ratio=1.4, reduction__modes=8, motion__t_end=0.004)
    options += ["--set", "record(1)%from=0.0"]
    gearbox = SOURCE / "inputs" / "test_gearbox.nml"
    exact = run(gearbox, *options, *sets(motion__integrator="'exact'"))
    other = run(gearbox, *options, *sets(motion__integrator="'dop853'", motion__relative_tolerance=1e-12))
    names = [name for name in exact if name.startswith("extrema/") and name.endswith("/value")]
    assert names
    for name in names:
        assert len(exact[name]) == len(other[name]) > 5
        np.testing.assert_allclose(other[name], exact[name], rtol=0, atol=1e-7 * np.abs(exact[name]).max())


def test_tangents(folder):
    """Derivatives pass a switch as they are: without damping the two exponents add up to nothing."""
    stiffness = 0.98 * MASS * (np.pi * HERTZ) ** 2
    growth = np.arccosh(abs(meissner(stiffness, 0.6, 1.8)) / 2) * HERTZ
    found = []
    for integrator in ("exact", "dop853"):
        text = WHEELS.format(stiffness=stiffness, variation="contact_ratio=1.6, pair_ratio=1.8", integrator=integrator)
        (folder / "wheels.nml").write_text(text)
        found.append(
            np.ravel(run("wheels.nml", *sets(motion__lyapunov=2, motion__lyapunov_periods=400))["lyapunov/exponent"])
        )
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-7 * growth)
    assert abs(found[0].sum()) < 1e-9 * growth
    assert found[0][0] == pytest.approx(growth, rel=0.1)
