"""Motions that nothing holds, damps or drives: which are free, overdamped, neutral or unstable."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from programs import modes, sets, start, succeed


def modes_of(lines, *options):
    """What razy-modes says of a case of these lines, and its data."""
    Path("case.nml").write_text("\n".join(lines) + "\n")
    return modes("case.nml", *options)


def rotor(seed):
    """A rotor on bearings with damping and cross-coupling, free to turn and to move along its axis; round numbers."""
    draw = np.random.default_rng(seed)
    elements = int(draw.integers(3, 17))
    k, c = 10.0 ** draw.integers(5, 8), 10.0 ** draw.integers(2, 5)
    cross = draw.choice([0.0, 0.1, 0.5]) * k
    matrix = f"{k},{cross},{-cross},{draw.choice([0.8, 1.0]) * k}"
    inner = draw.choice(["", ", damping_ratio=0.001, damping='nodal'"])
    lines = [
        "&scene kind='rotor' /",
        f"&shaft name='s', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0{inner} /",
        f"&section shaft='s', length={draw.choice([0.5, 1.0, 1.5])}, outer_diameter=0.05, elements={elements} /",
        f"&rotation speed_rpm=1000.0, circulatory={'.true.' if inner else '.false.'} /",
        "&campbell last_rpm=6000.0, points=13, damped=.true. /",
        "&modes count=8 /",
    ]
    lines += [
        f"&bearing shaft='s', node={node}, kind='matrix', stiffness={matrix}, damping_matrix={c},0.0,0.0,{c} /"
        for node in (1, elements + 1)
    ]
    node = int(draw.integers(1, elements + 2))
    lines.append(f"&disk shaft='s', node={node}, mass=30.0, polar_inertia=0.3, diametral_inertia=0.17 /")
    return lines


@pytest.mark.parametrize("seed", range(8))
def test_free_rotors_are_judged_as_held_ones(seed):
    """Rigid motion is 0 Hz, no instability and no critical speed; a shaft that turns apart changes nothing."""
    lines = rotor(seed)
    apart = [
        "&shaft name='t', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0, speed_ratio=0.0 /",
        "&section shaft='t', length=1.0, outer_diameter=0.04, elements=3 /",
    ]
    found = []
    for more in (["&freedom axial=.false., torsion=.false. /"], [], apart):
        found.append(modes_of(lines + more))
    (_, held), (said, free), (_, beside) = found
    assert "free to turn and to move along the axis" in said
    np.testing.assert_array_equal(free["rigid"][:3], [1, 1, 0])
    assert (free["natural_frequency"][:2] == 0.0).all() and (free["frequency"][:, :2] == 0.0).all()
    for data in (free, beside):
        np.testing.assert_allclose(data["stability_limit"], held["stability_limit"], rtol=1e-6)
        for speed in held["critical_speed"]:
            assert np.abs(data["critical_speed"] / speed - 1).min() < 1e-7
        assert (data["critical_speed"] > 1.0).all()


GEARS = """
&scene kind='rotor' /
&shaft name='a', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0 /
&section shaft='a', length=0.5, outer_diameter=0.04, elements=1 /
&shaft name='b', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0 /
&section shaft='b', length=0.5, outer_diameter=0.02, elements=2 /
&bearing shaft='a', node=1, kind='matrix', stiffness=1e6,0,0,1e6 /
&bearing shaft='a', node=2, kind='matrix', stiffness=1e6,0,0,1e6 /
&bearing shaft='b', node=1, kind='matrix', stiffness=1e6,0,0,1e6 /
&bearing shaft='b', node=3, kind='matrix', stiffness=1e6,0,0,1e6 /
&support shaft='a', node=1, held='u' /
&support shaft='b', node=1, held='u' /
&gear_mesh name='m', between='a','b', node=1,1, radius=0.04,0.114, teeth=20,57, centre_line=90.0, stiffness=4e8 /
&rotation speed_rpm=1000.0 /
&modes count=4 /
"""


SHAFT = """
&scene kind='rotor' /
&shaft name='s', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0, damping_ratio=0.005, damping='nodal' /
&section shaft='s', length=1.0, outer_diameter=0.05, elements=24 /
&disk shaft='s', node=13, mass=10.0, polar_inertia=0.1, diametral_inertia=0.05 /
&bearing shaft='s', node=3, kind='matrix', stiffness=3e7,1e6,-1e6,3.5e7, damping_matrix=2e3,0,0,3e3 /
&bearing shaft='s', node=22, elements=4, radial_stiffness=2e7, axial_stiffness=3.75e6 /
&rotation speed_rpm=3000.0 /
&modes count=8 /
&campbell last_rpm=20000.0, points=9, orders=0.5,1.0 /
"""


def test_banded_and_dense_diagrams_agree(folder):
    """Modal damping fills the matrices, so that the problem is dense; in an undamped diagram it is the same problem."""
    (folder / "shaft.nml").write_text(SHAFT)
    (folder / "modal.nml").write_text(SHAFT.replace("'nodal'", "'modal'"))
    (_, banded), (_, dense) = modes("shaft.nml"), modes("modal.nml")
    np.testing.assert_allclose(banded["eigenvalue"], dense["eigenvalue"], rtol=1e-6, atol=1e-5)
    np.testing.assert_allclose(banded["critical_speed"], dense["critical_speed"], rtol=1e-7)
    np.testing.assert_array_equal(banded["critical_order"], dense["critical_order"])


def test_what_the_stability_limit_is_a_statement_about(folder):
    (folder / "shaft.nml").write_text(SHAFT)
    checks = []
    for more in ([], ["--set", "bearing(1)%damping_matrix=0,0,0,0"], ["--set", "bearing(1)%stiffness=3e7,0,0,3.5e7"]):
        assert start("razy-modes", "shaft.nml", "--force", "--output", "shaft.h5", *more).returncode == 0
        with h5py.File("shaft.h5") as file:
            checks.append(file["stability_limit"].attrs["check"])
    # The cross coupling over the damping at its place, and a quarter more.
    radius = 1.25e6 / 6e6**0.5
    assert checks[0] == f"all eigenvalues with moduli up to {radius:.3f} rad/s, beyond which none can be unstable"
    assert checks[1] == "all eigenvalues"
    assert checks[2] == "nothing can drive whirl: no cross coupling, no circulation"


def test_accumulating_overdamped_motions(folder):
    """Proportional damping of a shaft on soft bearings: dozens of real eigenvalues gather within the radius."""
    (folder / "soft.nml").write_text("""
&scene kind='rotor' /
&shaft name='s', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0, damping_ratio=0.005, damping='proportional' /
&section shaft='s', length=0.5, outer_diameter=0.03, elements=33 /
&disk shaft='s', node=18, mass=30.0, polar_inertia=0.1, diametral_inertia=0.17 /
&bearing shaft='s', node=1, kind='matrix', stiffness=1e5,5e4,-5e4,1e5 /
&bearing shaft='s', node=34, kind='matrix', stiffness=1e5,5e4,-5e4,8e4 /
&freedom axial=.false., torsion=.false. /
&rotation speed_rpm=1000.0 /
&modes count=14 /
&campbell first_rpm=10000.0, last_rpm=20000.0, points=2, orders=2.0, damped=.true. /
""")
    _, found = modes("soft.nml")
    assert found["eigenvalue"].shape == (2, 14, 2) and np.isfinite(found["eigenvalue"]).all()
    assert (np.hypot(*np.moveaxis(found["eigenvalue"], 2, 0)) < 1e4).all()


def test_reductions_of_gears_that_are_free_to_turn():
    """With all modes kept there is no error; Craig and Bampton's reduction without modes has one. Nothing is static."""
    for reduction, wrong in (("modes=11,17", False), ("method='craig_bampton', modes=0", True)):
        with open("gears.nml", "w") as file:
            file.write(f"{GEARS}&reduction {reduction} /\n")
        succeed("razy-modes", "gears.nml", "--output", "gears.h5", "--force")
        with h5py.File("gears.h5") as file:
            error = file["reduction/error"][0]
        assert np.isnan(error[0]) and np.isfinite(error[1:]).all()
        assert (error[1:].max() > 1e-3) == wrong and (wrong or error[1:].max() < 1e-6)


def test_overdamped_motions_are_no_critical_speeds():
    at = {1: "1e5,0.0,0.0,1e5", 2: "1e5,2e3,-2e3,1e5"}
    case = [
        "&scene kind='rotor' /",
        "&shaft name='a', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0, element='rayleigh' /",
        "&section shaft='a', length=0.2, outer_diameter=0.02, elements=1 /",
        *(f"&bearing shaft='a', node={n}, kind='matrix', stiffness={k}, damping_matrix=1e4,0.0,0.0,1e4 /"
          for n, k in at.items()),
        "&freedom axial=.false., torsion=.false. /",
        "&rotation speed_rpm=1000.0 /",
        "&campbell last_rpm=7000.0, points=13, damped=.true. /",
        "&modes count=8 /",
    ]  # fmt: skip
    _, data = modes_of(case)
    assert data["critical_speed"].size == 0


def test_a_free_train_of_very_unequal_wheels_has_0_hz():
    """The rigid motion follows from the elements, whose stiffnesses differ by 1e10."""
    inertia = [5e-7, 5e-7, 3e-5, 1e-8, 3e-5]
    lines = ["&scene kind='lumped' /", *(f"&inertia name='j{i}', value={v} /" for i, v in enumerate(inertia))]
    lines += [
        "&spring between='j0','j1', stiffness=1e4 /",
        "&gear_mesh name='m', between='j1','j2', radius=0.02,0.057, teeth=20,57, stiffness=1e9 /",
        "&gear_mesh name='n', between='j2','j3', radius=0.02,0.02, teeth=20,20, stiffness=1e12 /",
        "&spring between='j3','j4', stiffness=100.0, damping=1e-6 /",
        "&modes contacts='closed' /",
    ]
    _, data = modes_of(lines)
    np.testing.assert_array_equal(data["natural_frequency"] == 0.0, [True, False, False, False, False])
    np.testing.assert_array_equal(data["rigid"], [1, 0, 0, 0, 0])
    assert (data["eigenvalue"][0, 0] == 0.0).all() and (data["eigenvalue"][0, 1:, 1] > 0.0).all()


@pytest.mark.parametrize("elements", [4, 16])
def test_proportional_damping_is_that_of_the_shaft(elements):
    """Pinned ends: D in the first bending mode, D times the ratio of frequencies in others, whatever the elements."""
    lines = [
        "&scene kind='rotor' /",
        "&shaft name='s', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0, damping_ratio=0.001 /",
        f"&section shaft='s', length=1.5, outer_diameter=0.05, elements={elements} /",
        "&support shaft='s', node=1, held='u','v','w','phi' /",
        f"&support shaft='s', node={elements + 1}, held='v','w' /",
        "&rotation speed_rpm=1000.0 /",
        "&campbell first_rpm=0.0, last_rpm=6000.0, points=3, damped=.true. /",
        "&modes count=8 /",
    ]
    _, data = modes_of(lines)
    ratio = data["natural_frequency"] / data["natural_frequency"][0]
    np.testing.assert_allclose(data["damping_ratio"][0], 1e-3 * ratio, rtol=1e-8)
    free = [line for line in lines if not line.startswith("&support")]
    _, data = modes_of(free, *sets(modes__count=12))
    assert data["rigid"].sum() == 6
    vibrates = data["eigenvalue"][0, :, 1] > 1.0
    lowest = data["natural_frequency"][6]
    ratio = np.hypot(*data["eigenvalue"][0, vibrates].T) / (2 * np.pi) / lowest
    assert ratio[0] == pytest.approx(1.0, rel=1e-6)
    np.testing.assert_allclose(data["damping_ratio"][0, vibrates], 1e-3 * ratio, rtol=1e-6)


def test_free_motions_are_damped_in_proportion_to_masses():
    """Turning and moving along the axis have the eigenvalues 0 and -alpha each."""
    lines = [
        "&scene kind='rotor' /",
        "&shaft name='s', young_modulus=2.1e11, shear_modulus=8.0e10, density=7800.0, mass_damping=0.5 /",
        "&section shaft='s', length=1.0, outer_diameter=0.05, elements=4 /",
        "&bearing shaft='s', node=1, kind='matrix', stiffness=1e6,0.0,0.0,1e6 /",
        "&bearing shaft='s', node=5, kind='matrix', stiffness=1e6,0.0,0.0,1e6 /",
        "&rotation speed_rpm=1000.0 /",
        "&campbell last_rpm=3000.0, points=3, damped=.true. /",
        "&modes count=8 /",
    ]
    value = modes_of(lines)[1]["eigenvalue"]
    np.testing.assert_allclose(value[:, :4, 0], np.tile([-0.5, -0.5, 0.0, 0.0], (3, 1)), atol=1e-9)
    assert (value[:, :4, 1] == 0.0).all()


def test_a_shaft_on_one_bearing_is_free_to_tilt_only():
    lines = [
        "&scene kind='rotor' /",
        "&shaft name='s', young_modulus=2.0e11, poisson_ratio=0.25, density=8000.0 /",
        "&section shaft='s', length=1.0, outer_diameter=0.1, elements=4 /",
        "&bearing shaft='s', node=3, kind='matrix', stiffness=1e6,0.0,0.0,1e6 /",
        "&modes count=6 /",
    ]
    said, data = modes_of(lines)
    assert "free to turn, to move along the axis and to tilt" in said.splitlines()
    np.testing.assert_array_equal(data["rigid"], [1, 1, 1, 1, 0, 0])


def test_stable_neutral_and_undecided_motions():
    """Torsion beside bearings that damp across is neutral; a bearing that drives as much as it damps is undecided."""
    lines = [
        "&scene kind='rotor' /",
        "&shaft name='s', young_modulus=2.1e11, shear_modulus=8.0e10, density=7800.0 /",
        "&section shaft='s', length=1.0, outer_diameter=0.05, elements=4 /",
        "&bearing shaft='s', node=1, kind='matrix', stiffness=1e6,0.0,0.0,1e6, damping_matrix=1e3,0.0,0.0,1e3 /",
        "&bearing shaft='s', node=5, kind='matrix', stiffness=1e6,{0},-{0},1e6, damping_matrix=1e3,0.0,0.0,1e3 /",
        "&rotation speed_rpm=1000.0 /",
        "&campbell last_rpm=3000.0, points=3, damped=.true. /",
        "&modes count=20 /",
    ]
    said, data = modes_of(line.format("1e4") for line in lines)
    assert "stability limit: none up to the last speed" in said
    with h5py.File("modes.h5") as file:
        assert file["stable"].attrs["flag_meanings"] == "stable unstable undecided neutral absent"
        assert list(file["stable"].attrs["flag_values"]) == [1, 0, -1, 2, -2]
    torsion = np.isclose(data["frequency"], data["natural_frequency"][data["energy_share"][:, 1] > 0.99][1], rtol=1e-9)
    assert torsion.sum() == 3 and (data["stable"][torsion] == 2).all() and (data["eigenvalue"][torsion, 0] == 0.0).all()
    assert (data["stable"][:, :2] == 2).all() and (data["stable"][data["eigenvalue"][..., 0] < 0.0] == 1).all()
    assert f"neutral, nothing damps or drives them: {data['frequency'][torsion][0]:.3f}" in said
    # Round bearings at rest: whirl at ω is driven by the cross coupling c ω as much as it is damped.
    omega = 2 * np.pi * data["natural_frequency"][2]
    lines[3] = lines[3].replace("1e6,0.0,0.0,1e6", "1e6,{0},-{0},1e6")
    said, data = modes_of(line.format(repr(float(1e3 * omega))) for line in lines)
    assert (data["stable"][0] == -1).sum() == 1 and data["undecided_from"] == 0.0
    assert "undecided from 0.000 rad/s = 0.00 rpm on: the error of an eigenvalue covers the bound" in said


def test_equal_motions_of_a_lumped_machine():
    """The middle of three equal bodies in a row has the one damper: the motion in which it rests is neutral."""
    for order in ("abc", "cba", "bca"):
        lines = ["&scene kind='lumped' /", *(f"&mass name='{name}', value=0.3 /" for name in order)]
        lines += [f"&spring between='{one}','{other}', stiffness=0.7e4 /" for one, other in ("ab", "bc")]
        lines += [f"&spring between='{name}','frame', stiffness=1.1e4 /" for name in "abc"]
        lines += ["&damper between='b','frame', damping=7.0 /", "&modes contacts='open' /"]
        said, data = modes_of(lines)
        np.testing.assert_array_equal(data["stable"][0], [1, 2, 1])
        assert f"neutral, nothing damps or drives them: {np.sqrt(1.8e4 / 0.3) / (2 * np.pi):.3f} Hz" in said
    said, data = modes_of(line for line in lines if not line.startswith("&damper"))
    assert (data["stable"] == 2).all() and "neutral" not in said
