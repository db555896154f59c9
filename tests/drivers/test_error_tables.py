"""Transmission errors of gears as measured tables over a turn: against the harmonics that they are sampled from."""

import h5py
import numpy as np
import pytest
from programs import start, succeed

TEETH, SPEED = (20, 30), 900.0
CASE = """&scene kind='lumped' /
&inertia name='a', value=0.01 /
&inertia name='b', value=0.03 /
&gear_mesh name='mesh', between='a','b', radius=0.06,0.09, teeth=20,30, stiffness=1e8, damping=500.0,
           backlash=1e-5, {errors} /
{rotation}
&load on='a', value=20.0 /
&load on='b', value=-30.0 /
&motion t_end=0.2, start='static' /
&record observable='mesh_deformation', what='trajectory', interval=1e-3 /
"""
ROTATION = "&rotation speed_rpm=900.0, of='a' /"


def case(folder, errors, rotation=ROTATION):
    (folder / "case.nml").write_text(CASE.format(errors=errors, rotation=rotation))
    return "case.nml"


def table(path, angle, error):
    lines = "\n".join(f"{a!r}, {e!r}" for a, e in zip(angle.tolist(), error.tolist(), strict=True))
    path.write_text("# measured\nangle_deg, error [m]\n" + lines + "\n")


def deformation(folder, errors, rotation=ROTATION):
    succeed("razy-run", case(folder, errors, rotation), "--output", "run.h5", "--force")
    with h5py.File("run.h5") as file:
        return np.ravel(file["observable/mesh_deformation"][()]), file["outcome/excitation_period"][0]


def test_table_of_two_harmonics_is_these_harmonics(folder):
    """Orders 20 and 40 of the first gear are the tooth frequency and its double; the table may begin anywhere."""
    expected, _ = deformation(folder, "error_sine=3e-6,0.0, error_cosine=1e-6,2e-6")
    scale = np.ptp(expected)
    for first in (0.0, 0.7):
        angle = first + np.arange(128) * (360 / 128)
        turned = np.radians(angle)
        table(
            folder / "a.csv",
            angle,
            3e-6 * np.sin(20 * turned) + 1e-6 * np.cos(20 * turned) + 2e-6 * np.cos(40 * turned),
        )
        found, period = deformation(folder, "error_file='a.csv'")
        assert period == pytest.approx(60 / SPEED / TEETH[0])
        np.testing.assert_allclose(found, expected, atol=1e-10 * scale)
    some, _ = deformation(folder, "error_file='a.csv', error_harmonics=30")
    assert np.max(np.abs(some - expected)) > 0.05 * scale


def test_errors_pass_in_the_sense_of_rotation(folder):
    """Whichever gear says how fast both turn, and in whichever sense: tables ran backwards at negative speeds."""
    errors = "error_sine=3e-6, error_cosine=1e-6, error_file='a.csv','b.csv'"
    for name, values in (("a.csv", [0.0, 2e-6, -1e-6]), ("b.csv", [0.0, 3e-6, 1e-6, -2e-6, 1e-6])):
        table(folder / name, np.arange(len(values)) * (360 / len(values)), np.array(values))
    expected, _ = deformation(folder, errors)
    for speed, gear in ((-900.0, "a"), (600.0, "b"), (-600.0, "b")):
        found, _ = deformation(folder, errors, f"&rotation speed_rpm={speed}, of='{gear}' /")
        np.testing.assert_allclose(found, expected, atol=1e-10 * np.ptp(expected))


def test_each_gear_has_its_own_turn(folder):
    """Order 30 of the second gear is the tooth frequency; eccentricities repeat after three turns of the first."""
    expected, _ = deformation(folder, "error_sine=3e-6")
    angle = np.arange(100) * 3.6
    table(folder / "b.csv", angle, 3e-6 * np.sin(30 * np.radians(angle)))
    found, _ = deformation(folder, "error_file='','b.csv'")
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.ptp(expected))
    table(folder / "once.csv", angle, 2e-6 * np.sin(np.radians(angle)))
    _, period = deformation(folder, "error_file='once.csv','once.csv'")
    assert period == pytest.approx(3 * 60 / SPEED)


@pytest.mark.parametrize(
    ("text", "rotation", "message"),
    [
        ("angle_deg, error\n0, 1e-6\n90, 0\n90, 0\n270, 0\n", ROTATION, "rises from row to row; row 3 of"),
        ("angle_deg, error\n0, 1\n120, 0\n240, 0\n360, 1\n", ROTATION, "round in equal steps, 90.000 with 4 rows"),
        ("angle_deg, error\n0, 1e-6\n60, 0\n120, 0\n", ROTATION, "once round in equal steps, 120.000 with 3 rows"),
        ("angle_deg, error\n0, 1e-6\n180, 0\n", ROTATION, "a file with 3 to 10000 rows"),
        ("angle, error\n0, 1e-6\n120, 0\n240, 0\n", ROTATION, "angle_deg"),
        ("angle_deg, error\n0, 1e-6\n120, 0\n240, 0\n", "", "an error needs &rotation"),
    ],
)  # fmt: skip
def test_what_is_no_table_of_a_turn_is_refused_in_one_line(folder, text, rotation, message):
    (folder / "a.csv").write_text(text)
    done = start("razy-run", case(folder, "error_file='a.csv'", rotation), "--output", "no.h5")
    assert done.returncode == 2 and message in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr
