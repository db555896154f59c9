"""Mesh stiffness and contact ratio from the data of teeth: beside the geometry of involutes, and ISO 6336-1 again."""

import re

import numpy as np
import pytest
from programs import start, succeed
from scipy.optimize import brentq

PAIR = """&inertia name='one', value=0.01 /
&inertia name='two', value=0.05 /
&gear_mesh name='mesh', between='one','two', radius={0},{1}, teeth={0},{1}, width=0.02, pairs=.true., {2} /
&rotation of='one', speed_rpm=600.0 /
&motion t_end=0.01, start='zero' /
&record observable='displacement', of='one', what='extrema' /
"""
SHAFTS = """&shaft name='one', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0 /
&section shaft='one', length=0.1, outer_diameter=0.05 /
&shaft name='two', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0 /
&section shaft='two', length=0.1, outer_diameter=0.05 /
&gear_mesh name='mesh', between='one','two', node=1,1, radius=0.05,0.1, teeth=20,40, width=0.02, {0} /
&motion t_end=0.01, start='zero' /
"""


def found(path, text):
    """Return the numbers of the mesh that the program makes of its data."""
    path.write_text(text)
    shown = succeed("razy-run", path, "--check").stdout
    assert "width" not in shown and "profile_shift" not in shown
    return {key: float(value) for key, value in re.findall(r"(stiffness|contact_ratio|pair_ratio) = (\S+)", shown)}


def path_of_contact(teeth, shift, alpha):
    """Return the contact ratio of spur gears of the module 1: the line of action is cut with both tip circles."""

    def involute(angle):
        return np.tan(angle) - angle

    base = np.array(teeth) / 2 * np.cos(alpha)

    def overlap(distance):
        """Return the thickness of both teeth on the working circles, less the pitch there."""
        working = np.arccos(base.sum() / distance)
        radius = base / np.cos(working)
        thick = 0.0
        for z, x, r in zip(teeth, shift, radius, strict=True):
            thick += r * ((np.pi + 4 * x * np.tan(alpha)) / z + 2 * (involute(alpha) - involute(working)))
        return thick - 2 * np.pi * radius[0] / teeth[0]

    distance = brentq(overlap, base.sum() * (1 + 1e-9), sum(teeth))
    # Points of the line of action by their distance from where it touches circle 1.
    length = np.sqrt(distance**2 - base.sum() ** 2)
    tip = np.array(teeth) / 2 + 1 + np.array(shift)
    last = brentq(lambda s: np.hypot(base[0], s) - tip[0], 0, 2 * length)
    first = brentq(lambda s: np.hypot(base[1], length - s) - tip[1], -length, length)
    return (last - first) / (np.pi * np.cos(alpha))


@pytest.mark.parametrize(
    ("teeth", "shift", "alpha"),
    [
        ((20, 40), (0.0, 0.0), 20),
        ((17, 50), (0.4, 0.1), 20),
        ((35, 24), (0.0, 0.3), 22.5),
        ((60, 60), (0.0, 0.0), 15),
        ((40, 40), (0.1, 0.3), 20),
    ],
)
def test_spur_gears(tmp_path, teeth, shift, alpha):
    data = f"profile_shift={shift[0]},{shift[1]}, pressure_angle={alpha}"
    mesh = found(tmp_path / "pair.nml", PAIR.format(*teeth, data))
    ratio = path_of_contact(teeth, shift, np.radians(alpha))
    assert mesh["contact_ratio"] == pytest.approx(ratio, rel=1e-10)
    (z, x), (w, y) = sorted(zip(teeth, shift, strict=True), key=lambda gear: (gear[0], -gear[1]))
    soft = 0.04723 + 0.15551 / z + 0.25791 / w - 0.00635 * x - 0.11654 * x / z - 0.00193 * y - 0.24188 * y / w
    single = 0.8 * 0.975 * (1 - 0.02 * (20 - alpha)) / (soft + 0.00529 * x**2 + 0.00182 * y**2)
    # That of usual gears is about 14 N/(mm um) by the same standard.
    assert 10 < single < 16
    assert mesh["stiffness"] == pytest.approx(single * (0.75 * ratio + 0.25) * 0.02e9, rel=1e-10)
    # k pairs have 0.75 k + 0.25 of c'.
    pairs = int(ratio)
    assert mesh["pair_ratio"] == pytest.approx((0.75 * pairs + 1) / (0.75 * pairs + 0.25), rel=1e-14)
    few = mesh["stiffness"] / (1 + (ratio - pairs) * (mesh["pair_ratio"] - 1))
    assert few == pytest.approx((0.75 * pairs + 0.25) * single * 0.02e9, rel=1e-10)


def test_textbook_contact_ratio(tmp_path):
    """20 and 40 teeth, 20 degrees: 1.64, as tables have it."""
    assert found(tmp_path / "pair.nml", PAIR.format(20, 40, ""))["contact_ratio"] == pytest.approx(1.64, abs=0.006)


def test_helical_gears_beside_shafts(tmp_path):
    """Teeth are those of z/cos³β, and the deformation beside shafts is along the normal of the flanks."""
    beta, alpha = np.radians(25), np.radians(20)
    mesh = found(tmp_path / "shafts.nml", SHAFTS.format("helix_angle=25.0"))
    transverse = np.arctan(np.tan(alpha) / np.cos(beta))
    base = np.array([10, 20]) * np.cos(transverse)
    tip = np.array([10, 20]) + np.cos(beta)
    ratio = np.sqrt(tip**2 - base**2).sum() - 30 * np.sin(transverse)
    ratio /= np.pi * np.cos(transverse)
    soft = 0.04723 + (0.15551 / 20 + 0.25791 / 40) * np.cos(beta) ** 3
    right = 0.78 * np.cos(beta) / soft * (0.75 * ratio + 0.25) * 0.02e9
    along = np.cos(np.arctan(np.tan(beta) * np.cos(transverse)))
    assert mesh["stiffness"] == pytest.approx(right / along**2, rel=1e-10)
    assert "contact_ratio" not in mesh


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        ("stiffness=1e8", "&gear_mesh width = 0.02: given with width, instead of stiffness"),
        ("profile_shift=-0.1,0.1", "that of the gear with fewer teeth not below the other"),
        ("profile_shift=1.5,1.0", "a sum from -0.5 to 2.0"),
        ("pressure_angle=30.0", "pressure angles from 15 to 25"),
        ("kind='internal'", "left out with kind = 'internal'"),
    ],
)
def test_refused(tmp_path, data, complaint):
    path = tmp_path / "pair.nml"
    path.write_text(PAIR.format(20, 40, data))
    done = start("razy-run", path)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and complaint in done.stderr


@pytest.mark.parametrize(
    ("key", "message"),
    [("width", "no data of teeth, which become the stiffness"), ("helix_angle", "left out without shafts")],
)
def test_what_is_gone_does_not_vary(tmp_path, key, message):
    path = tmp_path / "pair.nml"
    path.write_text(
        PAIR.format(20, 40, "") + f"&sweep parameter='gear_mesh%{key}', first=0.01, last=0.02, points=2 /\n"
    )
    done = start("razy-sweep", path, "--output", tmp_path / "sweep.h5")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert f"&gear_mesh {key} = 0.01: {message}" in done.stderr
