"""What razy-sweep computes and writes."""

import re

import f90nml
import h5py
import numpy as np
import pytest
import xarray
from programs import GEAR_PAIR, SOURCE, attribute, changed, datasets, names, sets, succeed

COARSE = sets(sweep__step=100)


def test_axis_ascends_and_points_are_those_of_single_runs():
    succeed("razy-sweep", GEAR_PAIR, *COARSE, "--output", "sweep.h5")
    with h5py.File("sweep.h5") as file:
        speeds = file["axis/rotation.speed_rpm"][:]
        extrema = file["extrema/mesh_deformation"]
        offset, stored = extrema["offset"][:], {key: extrema[key][:] for key in ("value", "time", "kind")}
        events = file["point/events"][:]
    assert np.array_equal(speeds, 1000.0 + 100.0 * np.arange(17))
    for k in (0, 6, 9, 16):
        output = f"run_{k}.h5"
        succeed("razy-run", GEAR_PAIR, *sets(rotation__speed_rpm=speeds[k]), "--output", output)
        with h5py.File(output) as file:
            for key, values in stored.items():
                assert np.array_equal(file[f"extrema/mesh_deformation/{key}"][:], values[offset[k] : offset[k + 1]]), (
                    key
                )
            assert file["event/time"].size == events[k]


def test_descending_sweep_is_the_ascending_one_backwards():
    succeed("razy-sweep", GEAR_PAIR, *COARSE, "--output", "up.h5")
    succeed(
        "razy-sweep", GEAR_PAIR, *sets(sweep__first=2600, sweep__last=1000, sweep__step=-100), "--output", "down.h5"
    )
    with h5py.File("up.h5") as up, h5py.File("down.h5") as down:
        assert np.array_equal(up["axis/rotation.speed_rpm"][:][::-1], down["axis/rotation.speed_rpm"][:])
        assert np.array_equal(up["point/events"][:][::-1], down["point/events"][:])
        pieces = [
            np.split(f["extrema/mesh_deformation/value"], f["extrema/mesh_deformation/offset"][1:-1])
            for f in (up, down)
        ]
    for one, other in zip(pieces[0], reversed(pieces[1]), strict=True):
        assert np.array_equal(one, other)


def test_value_without_a_machine_is_passed_over():
    case = SOURCE / "inputs/mesh_stiffness.nml"
    values = sets(sweep__first=20.0, sweep__last=-20.0, sweep__step=-20.0, motion__t_end=0.5, record__from=0.4)
    succeed("razy-sweep", case, *values, "--output", "turned.h5")
    with h5py.File("turned.h5") as file:
        assert file["point/status"][:].tolist() == [0, 5, 0]


def test_points_instead_of_step(folder):
    case = changed(folder / "case.nml", GEAR_PAIR.read_text(), ("step=4.0", "points=17"))
    succeed("razy-sweep", case, "--output", "points.h5")
    succeed("razy-sweep", GEAR_PAIR, *COARSE, "--output", "step.h5")
    assert datasets("points.h5") == datasets("step.h5")
    succeed("razy-sweep", GEAR_PAIR, *sets(sweep__step=0, sweep__points=17), "--output", "set.h5")
    assert datasets("set.h5") == datasets("step.h5")


@pytest.mark.parametrize(
    ("parameter", "first", "last", "units"),
    [
        ("gear_mesh%backlash", 6e-6, 0.0, "m"),
        ("load(1)%amplitude", 0.0, 20.0, "N or N m"),
        ("spring(2)%damping_factor", 1e-4, 1e-3, "s"),
        ("gear_mesh%error_sine(1)", 1e-5, 5e-5, "m"),
        ("record%from", 0.1, 0.25, "s"),
        ("motion%t_end", 0.28, 0.3, "s"),
    ],
)
def test_any_real_value_can_be_varied(folder, parameter, first, last, units):
    case = changed(
        folder / "case.nml", GEAR_PAIR.read_text(), ("(?m)^&sweep.*$", ""), ("value=100.0", "value=100.0, order=40"),
        ("speed_rpm=1500.0", "speed_rpm=1560.0"),
    )  # fmt: skip
    text = case.read_text() + f"&sweep parameter='{parameter}', first={first}, last={last}, points=4 /\n"
    case.write_text(text)
    succeed("razy-sweep", case)
    axis = parameter.replace("%", ".")
    with h5py.File("case.h5") as file:
        values = file[f"axis/{axis}"][:]
        assert file[f"axis/{axis}"].attrs["units"] == units
        offset, found = file["extrema/mesh_deformation/offset"][:], file["extrema/mesh_deformation/value"][:]
        assert not file["point/status"][:].any()
    np.testing.assert_allclose(values, np.linspace(first, last, 4), rtol=1e-15, atol=1e-20)
    assert values[0] == first and values[-1] == last
    pieces = [found[offset[k] : offset[k + 1]] for k in range(4)]
    for k in (1, 3):
        succeed("razy-run", case, "--set", f"{parameter}={float(values[k])!r}", "--output", "run.h5", "--force")
        with h5py.File("run.h5") as file:
            assert np.array_equal(file["extrema/mesh_deformation/value"][:], pieces[k])
    assert len({piece.tobytes() for piece in pieces}) == 4


def test_no_trajectory_and_no_state_in_the_file():
    succeed("razy-sweep", GEAR_PAIR, *COARSE)
    assert {name.split("/")[0] for name in names("torsional_gear_pair.h5")} == {"axis", "point", "extrema"}


def test_effective_input_reads_back_to_the_same_bytes(folder):
    succeed("razy-sweep", GEAR_PAIR, *COARSE, "--output", "first.h5")
    text = attribute("first.h5", "input")
    assert text == succeed("razy-sweep", GEAR_PAIR, *COARSE, "--check").stdout
    assert f90nml.reads(text)["sweep"]["parameter"] == "rotation%speed_rpm"
    (folder / "again.nml").write_text(text)
    succeed("razy-sweep", "again.nml", "--output", "second.h5")
    assert attribute("second.h5", "input") == text
    assert datasets("second.h5") == datasets("first.h5")


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_reads_the_file_alone(engine):
    succeed("razy-sweep", GEAR_PAIR, *COARSE)
    with xarray.open_dataset("torsional_gear_pair.h5", engine=engine, group="point") as point:
        assert point["status"].dims == point["rotation.speed_rpm"].dims
        assert point["rotation.speed_rpm"].attrs["units"] == "rpm"
        assert (point["status"] == 0).all()
        assert point["rotation.speed_rpm"].values[1] == 1100.0
    with xarray.open_dataset("torsional_gear_pair.h5", engine=engine, group="extrema/mesh_deformation") as extrema:
        assert extrema["value"].attrs["units"] == "m"
        assert extrema["value"].dims == extrema["time"].dims == extrema["kind"].dims
        assert extrema["offset"].values[-1] == extrema["value"].size


@pytest.mark.parametrize("name", ["torsional_gear_pair", "planar_incline", "rotor_rub"])
def test_kind_left_out_is_that_of_the_parts(folder, name):
    """With the group &scene as a comment, on every rank; the input that the file holds names the kind."""
    text = (SOURCE / "inputs" / f"{name}.nml").read_text()
    sweeps = "&sweep" in text
    program, options = ("razy-sweep", {"ranks": 2}) if sweeps else ("razy-run", {})
    found = []
    for case in (text, re.sub("(?m)^&scene ", "!", text)):
        (folder / "case.nml").write_text(case)
        succeed(program, "case.nml", "--force", *(sets(sweep__step=400) if sweeps else ()), **options)
        found.append(datasets("case.h5"))
        assert "kind = 'lumped'" in attribute("case.h5", "input") or name != "torsional_gear_pair"
    assert found[0] == found[1]
