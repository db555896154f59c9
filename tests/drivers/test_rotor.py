"""Rotors from their inputs: reductions beside the unreduced model, cross-coupled bearings, growth above the limit."""

import re
from itertools import pairwise

import h5py
import numpy as np
import pytest
from programs import SOURCE, changed, sets, start, succeed

GEARBOX = SOURCE / "inputs" / "test_gearbox.nml"
THESIS = SOURCE / "inputs" / "thesis"
ALL_KINDS = sets(reduction__compare="all", reduction__kept=24, reduction__modes=24, campbell__points=2)

# A disk between two bearings whose oil drives forward whirl, on a shaft with internal damping.
JEFFCOTT = """&scene kind='rotor' /
&shaft name='a', young_modulus=2.1e11, poisson_ratio=0.3, density=7850.0, damping_ratio=1e-3, damping='nodal' /
&section shaft='a', length=0.4, outer_diameter=0.03, elements=4 /
&disk shaft='a', node=3, mass=8.0, polar_inertia=0.03, diametral_inertia=0.016 /
&bearing shaft='a', node=1, kind='matrix', stiffness=4e6,{cross},-{cross},4e6, damping_matrix=400.0,0.0,0.0,400.0 /
&bearing shaft='a', node=5, kind='matrix', stiffness=4e6,{cross},-{cross},4e6, damping_matrix=400.0,0.0,0.0,400.0 /
&freedom axial=.false., torsion=.false. /
&rotation speed_rpm=3000.0, of='a', circulatory=.true. /
&modes count=6 /
&initial on='a.3.v', displacement=1e-6 /
&motion t_end=1.0, start='given', integrator='dop853', relative_tolerance=1e-9 /
&record observable='displacement', of='a.3.v', what='extrema', from=0.6 /
"""
CAMPBELL = "&campbell first_rpm=0.0, last_rpm=60000.0, points=31, damped=.true. /\n"


def modes(case, *options):
    done = succeed("razy-modes", case, *options, "--output", "modes.h5", "--force")
    return done.stdout


@pytest.mark.parametrize("lost", [r"(?m)^&support.*", r"(?m)^&support +shaft='input'.*"])
def test_a_shaft_that_is_free_to_turn_has_no_static_compliance(lost, folder):
    case = folder / "free.nml"
    case.write_text(re.sub(lost, "", GEARBOX.read_text()))
    said = modes(case)
    assert said.count("static mesh compliance none: the shaft is free to turn, ") == 2
    with h5py.File("modes.h5") as file:
        error = file["reduction/error"][:]
        assert np.isnan(error[:, 0]).all() and np.isfinite(error[:, 1:]).all()
        assert (
            np.isnan(file["reduction/compliance"][:]).all()
            and np.isnan(file["reduction/unreduced_compliance"][:]).all()
        )


def test_reductions_beside_the_unreduced_model():
    said = modes(GEARBOX, *ALL_KINDS)
    with h5py.File("modes.h5") as file:
        table = {name: item[()] for name, item in file["reduction"].items()}
    kinds = [name.decode() for name in table["kind"]]
    assert kinds[:2] == ["modal synthesis", "modal synthesis, static correction"]
    assert "modal synthesis, level B by signed d" in kinds and "Craig-Bampton" in kinds and len(kinds) == 12
    assert sum(line.count("errors against the unreduced model") for line in said.splitlines()) == 12
    exact = table["unreduced_response"][:, 0] + 1j * table["unreduced_response"][:, 1]
    found = table["response"][..., 0] + 1j * table["response"][..., 1]
    moves = table["moves_mesh"] == 1
    for k, kind in enumerate(kinds):
        compliance, frequency, response = table["error"][k]
        assert compliance == pytest.approx(
            np.abs(table["compliance"][k] / table["unreduced_compliance"] - 1).max(), rel=1e-9
        )
        apart = np.abs(table["frequency"][k] / table["unreduced_frequency"] - 1)[moves].max()
        assert frequency == pytest.approx(apart, rel=1e-9)
        assert response == pytest.approx(np.abs(found[k] - exact).max() / np.abs(exact).max(), rel=1e-9)
        assert ("static correction" in kind or "Craig" in kind) == (compliance < 1e-9), kind
    error = dict(zip(kinds, table["error"], strict=True))
    # By |d| neither level loses what the mesh needs; by the signed d level B loses its stiffest mode.
    for level in "AB":
        assert error[f"modal synthesis, level {level} by |d|"].max() < 0.01
    assert error["modal synthesis, level B by signed d"][0] > 0.5
    assert error["Craig-Bampton"][1] < error["modal synthesis"][1]


def test_shafts_of_many_elements_need_no_stack(tmp_path):
    """Their matrices of megabytes do not lie on the stack, neither in a reduction nor without one."""
    changed(
        tmp_path / "long.nml",
        GEARBOX.read_text(),
        (r"shaft='output', length=0\.26,(.*)elements=10", r"shaft='output', length=0.26,\1elements=2500"),
    )
    modes(tmp_path / "long.nml", *sets(campbell__points=2))
    rub = (SOURCE / "inputs" / "rotor_rub.nml").read_text()
    rub = changed(
        tmp_path / "rub.nml", rub, ("elements=4", "elements=80"), ("node=5", "node=81"), ("modes=8", "method='none'")
    )
    succeed("razy-run", rub, *sets(motion__integrator="'exact'", motion__t_end=1e-5))


def test_nothing_to_compare():
    assert "errors against" not in modes(GEARBOX, *sets(reduction__compare="none", campbell__points=2))
    with h5py.File("modes.h5") as file:
        assert "reduction" not in file
    assert "errors against" not in modes(THESIS / "table_4_2.nml", *sets(reduction__method="none"))


def limit(case):
    modes(case)
    with h5py.File("modes.h5") as file:
        return float(file["stability_limit"][()]), file["eigenvalue"][()], file["speed"][()]


@pytest.mark.parametrize("cross", [0.0, 2.0e5])
def test_motion_grows_above_the_limit(tmp_path, cross):
    """When other motions have died away, the amplitude grows at the rate that is the real part of the eigenvalue."""
    case = tmp_path / "jeffcott.nml"
    case.write_text(JEFFCOTT.format(cross=cross) + CAMPBELL)
    speed, _, _ = limit(case)
    assert np.isfinite(speed)
    for share in (0.95, 1.05):
        rpm = share * speed * 30 / np.pi
        near = sets(campbell__first_rpm=0.999999 * rpm, campbell__last_rpm=rpm, campbell__points=2)
        modes(case, *near)
        with h5py.File("modes.h5") as file:
            growth = np.nanmax(file["eigenvalue"][-1, :, 0])
        succeed("razy-run", case, *sets(rotation__speed_rpm=rpm), "--output", "run.h5", "--force")
        with h5py.File("run.h5") as file:
            extrema = file["extrema/displacement.a.3.v"]
            time, value = extrema["time"][()], np.abs(extrema["value"][()])
        rate = np.polyfit(time, np.log(value), 1)[0]
        assert (growth > 0) == (share > 1)
        assert rate == pytest.approx(growth, rel=1e-3)


def test_oil_lowers_the_limit(tmp_path):
    limits = []
    for cross in (0.0, 2.0e5, 4.0e5):
        case = tmp_path / "jeffcott.nml"
        case.write_text(JEFFCOTT.format(cross=cross) + CAMPBELL)
        limits.append(limit(case)[0])
    assert limits[0] > limits[1] > limits[2]


def test_undamped_modes_leave_cross_coupling_out(tmp_path):
    found = []
    for cross in (0.0, 4.0e5):
        case = tmp_path / "jeffcott.nml"
        case.write_text(JEFFCOTT.format(cross=cross) + CAMPBELL.replace("damped=.true.", "damped=.false."))
        modes(case)
        with h5py.File("modes.h5") as file:
            found.append(file["frequency"][()])
    np.testing.assert_array_equal(*found)


def test_critical_speeds_do_not_depend_on_the_modes_asked_for():
    found = []
    for count in (4, 24):
        modes(GEARBOX, *sets(modes__count=count, campbell__points=7, reduction__compare="none"))
        with h5py.File("modes.h5") as file:
            found.append(file["critical_speed"][()])
    np.testing.assert_allclose(*found, rtol=1e-9)


def test_number_of_modes_as_an_axis():
    case = THESIS / "fig_4_19.nml"
    axes = ("sweep(1)%first=10", "sweep(1)%last=12", "sweep(1)%step=1", "sweep(2)%first=1000", "sweep(2)%last=1000")
    short = sets(motion__t_end=0.004, record__from=0.002) + [word for value in axes for word in ("--set", value)]
    succeed("razy-sweep", case, *short, "--output", "sweep.h5", "--force")
    with h5py.File("sweep.h5") as file:
        np.testing.assert_array_equal(file["axis/reduction.modes"][()], [10, 11, 12])
        assert np.all(file["point/status"][()] == 0)
    done = start("razy-sweep", case, *short, "--set", "sweep(1)%step=0.5", "--output", "half.h5")
    assert done.returncode == 2 and "step = 0.5: a whole number, as reduction%modes is" in done.stderr


def test_slope_in_the_backlash_by_two_integrators():
    """The exact propagator and DOP853 agree where contacts act while open."""
    found = []
    short = sets(reduction__modes=10, motion__t_end=0.01, record__from=0.005, rotation__speed_rpm=2200)
    for integrator in ("exact", "dop853"):
        chosen = sets(motion__integrator=integrator, gear_mesh__slope_in_backlash=0.1)
        succeed("razy-run", GEARBOX, *short, *chosen, "--output", "slope.h5", "--force")
        with h5py.File("slope.h5") as file:
            found.append(file["extrema/mesh_deformation/value"][()])
    assert found[0].min() < -1e-6
    np.testing.assert_allclose(*found, rtol=0, atol=1e-9 * np.abs(found[0]).max())


def test_reduced_motion_beside_the_unreduced_one():
    """Extrema of the mesh deformation, teeth in contact and parting, with 24 modes of each shaft and with all."""
    short = sets(sweep__first=1400, sweep__last=2000, sweep__step=600, motion__t_end=0.02, record__from=0.01)
    extrema = []
    for name, reduction in (("reduced", {}), ("full", {"reduction__method": "none"})):
        succeed("razy-sweep", THESIS / "fig_4_15.nml", *short, *sets(**reduction), "--output", f"{name}.h5", "--force")
        with h5py.File(f"{name}.h5") as file:
            offset, value = file["extrema/mesh_deformation/offset"], file["extrema/mesh_deformation/value"]
            extrema.append([value[first:last] for first, last in pairwise(offset[()])])
    for reduced, full in zip(*extrema, strict=True):
        assert len(reduced) == len(full)
        # Modes of 24 a shaft end near 50 kHz; the 40th harmonic of rotation and its multiples lie below 6 kHz.
        np.testing.assert_allclose(reduced, full, rtol=0, atol=5e-3 * (full.max() - full.min()))
    assert extrema[1][0].min() > 0 > extrema[1][1].min()
