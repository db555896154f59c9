"""`razy.open` of every kind of file: units, names, provenance, what is read when; pictures as in `razy-plot`."""

import h5py
import numpy as np
import pytest
from samples import (
    dataset,
    ragged,
    write_duel,
    write_follow,
    write_grid,
    write_modes,
    write_run,
    write_sweep,
    write_tune,
)

import razy
from razy.plot import PICTURES


def test_every_kind(tmp_path):
    for program, write in {
        "razy-run": write_run, "razy-modes": write_modes, "razy-tune": write_tune, "razy-duel": write_duel,
        "razy-follow": write_follow, "razy-sweep": write_grid,
    }.items():  # fmt: skip
        path = write(tmp_path / f"{program}.h5")
        data = razy.open(path)
        assert (data.program, data.source) == (program, str(path))
        assert any("units" in variable.attrs for variable in data.variables.values())
        kinds = [picture.kind.replace("-", "_") for picture in PICTURES if picture.program == program]
        assert dir(data.razy.plot) == sorted(kinds)
        assert data.razy.plot(dpi=50)._repr_png_().startswith(b"\x89PNG")
        with data.razy.open() as result:
            assert result.program == program


def test_datasets_of_other_programs_have_the_names_of_the_file(tmp_path):
    data = razy.open(write_modes(tmp_path / "modes.h5"))
    with h5py.File(data.source) as file:
        for name in ("frequency", "branch", "critical_speed", "stability_limit"):
            np.testing.assert_array_equal(data[name], file[name])
            assert data[name].units == file[name].attrs["units"]
    labels = razy.open(write_follow(tmp_path / "follow.h5"))["special.label"]
    assert set(labels.values) == {"GR", "LP"} or all(isinstance(label, str) for label in labels.values)


def test_large_variables_are_read_in_parts(tmp_path, monkeypatch):
    speed = np.linspace(1000.0, 1490.0, 50)
    values, kinds = ragged(50)
    data = razy.open(write_sweep(tmp_path / "sweep.h5", speed, {"mesh_deformation": (values, kinds)}))
    taken, real = [], h5py.Dataset.__getitem__

    def counted(item, key):
        found = real(item, key)
        taken.append(np.size(found))
        return found

    monkeypatch.setattr(h5py.Dataset, "__getitem__", counted)
    joined, at = np.concatenate(values), np.repeat(speed, [len(row) for row in values])
    part = data.isel(mesh_deformation_extremum=slice(3, 40, 2))
    np.testing.assert_array_equal(part.mesh_deformation, joined[3:40:2])
    assert max(taken) == 19
    np.testing.assert_array_equal(part["mesh_deformation_rotation.speed_rpm"], at[3:40:2])
    for key in (
        5,
        -1,
        [4, 1, 1],
        slice(None, None, -3),
        np.array([True, False] * (joined.size // 2) + [True] * (joined.size % 2)),
    ):
        for name, whole in (("mesh_deformation", joined), ("mesh_deformation_rotation.speed_rpm", at)):
            np.testing.assert_array_equal(data[name][key], whole[key])


def test_state_beside_an_observable_of_its_name(tmp_path):
    path = write_run(tmp_path / "run.h5")
    with h5py.File(path, "r+") as file:
        dataset(file, "observable/displacement", file["time"][()], "m")
    data = razy.open(path)
    assert data.displacement.dims == ("time",)
    assert data["state.displacement"].dims == ("time", "coordinate")


def test_pictures(tmp_path):
    data = razy.open(write_run(tmp_path / "run.h5"))
    data.razy.plot.phase(coordinate="x", save=tmp_path / "phase.pdf")
    with pytest.raises(razy.Error, match="exists"):
        data.razy.plot.phase(coordinate="x", save=tmp_path / "phase.pdf")
    with pytest.raises(razy.Error, match="unexpected keyword argument 'colour'"):
        data.razy.plot(colour="red")
    with pytest.raises(razy.Error, match="no map picture of a file of razy-run"):
        data.razy.plot.map()
    with pytest.raises(AttributeError, match="no picture of the kind 'pie'"):
        data.razy.plot.pie()
    with pytest.raises(razy.Error, match="was not opened by"):
        data.drop_attrs().razy.plot()
    assert len(data.razy.plot.time(coordinate="x", beside=data, labels=["a", "b"]).axes[0].lines) == 2
    sweep = razy.open(write_sweep(tmp_path / "sweep.h5", np.linspace(1e3, 2e3, 50), {"d": ragged(50)}))
    with pytest.raises(razy.Error):
        data.razy.plot(beside=sweep)


def test_files_that_are_none(tmp_path):
    with pytest.raises(razy.Error, match="no such file"):
        razy.open(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("text")
    with pytest.raises(razy.Error, match="not an HDF5 file"):
        razy.open(tmp_path / "text.h5")
