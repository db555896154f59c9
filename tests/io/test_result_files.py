"""Result files as h5py and xarray see them, without any help from this project."""

import os
import re
import shutil
import subprocess
import sys
import warnings
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

FOLDER = Path(os.environ["RAZY_SAMPLES"])
SWEEPS = ["sample_sweep.h5"]
RUNS = ["sample_run.h5", "sample_empty_run.h5", "sample_extrema_only.h5"]
TUNES = ["sample_tune.h5"]
ENGINES = ["h5netcdf", "netcdf4"]


def objects(path, kind):
    found = []
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.append("/" + name) if isinstance(item, kind) else None)
    return found


@pytest.mark.parametrize("name", SWEEPS + RUNS + TUNES)
def test_every_dataset_has_units_and_long_name(name):
    datasets = objects(FOLDER / name, h5py.Dataset)
    assert len(datasets) >= 4
    with h5py.File(FOLDER / name) as file:
        for dataset in datasets:
            for attribute in ("units", "long_name"):
                value = file[dataset].attrs[attribute]
                assert isinstance(value, str) and value.strip(), (dataset, attribute)


@pytest.mark.parametrize("name", SWEEPS + RUNS + TUNES)
def test_every_dimension_has_one_scale_in_reach(name):
    with h5py.File(FOLDER / name) as file:
        for path in objects(FOLDER / name, h5py.Dataset):
            dataset = file[path]
            if dataset.is_scale:
                continue
            for dimension, length in zip(dataset.dims, dataset.shape, strict=True):
                assert len(dimension) == 1, path
                assert dimension[0].shape == (length,)
                assert dataset.parent.name.startswith(dimension[0].parent.name), path


@pytest.mark.parametrize("name", SWEEPS + RUNS + TUNES)
def test_nothing_is_chunked_and_dimensions_take_no_room(name):
    with h5py.File(FOLDER / name) as file:
        for path in objects(FOLDER / name, h5py.Dataset):
            assert file[path].chunks is None
            if "dimension only" in file[path].attrs["long_name"]:
                assert file[path].id.get_storage_size() == 0


@pytest.mark.parametrize("name", SWEEPS + RUNS[:2] + TUNES)
def test_root_attributes(name):
    with h5py.File(FOLDER / name) as file:
        assert set(file.attrs) == {"razy_version", "git_commit", "program", "title", "integrator", "treatment", "input"}
        assert all(isinstance(value, str) for value in file.attrs.values())
        program = "sweep" if name in SWEEPS else "tune" if name in TUNES else "run"
        assert file.attrs["program"] == f"razy-{program}"
        assert file.attrs["title"] == "R\u00e1zy"
        assert h5py.check_string_dtype(file.attrs.get_id("title").dtype) == ("utf-8", None)
        line = "&disk name='d' /\n"
        assert file.attrs["input"] == (line * 20000)[:300000]
        assert file.attrs["razy_version"].count(".") == 2


def test_empty_root_attributes_are_strings():
    with h5py.File(FOLDER / "sample_extrema_only.h5") as file:
        assert file.attrs["title"] == "" and file.attrs["input"] == ""


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", SWEEPS + RUNS + TUNES)
def test_xarray_opens_every_group(name, engine):
    path = FOLDER / name
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for group in ["/", *objects(path, h5py.Group)]:
            with xarray.open_dataset(path, engine=engine, group=group) as dataset:
                dataset.load()
                assert not any(str(dimension).startswith("phony") for dimension in dataset.sizes)
                for variable in dataset.variables.values():
                    assert isinstance(variable.attrs["units"], str) and isinstance(variable.attrs["long_name"], str)
        with xarray.open_datatree(path, engine=engine) as tree:
            tree.load()
        groups = xarray.open_groups(path, engine=engine)
        assert set(groups) == {"/"} | set(objects(path, h5py.Group))
        for dataset in groups.values():
            dataset.close()


@pytest.mark.parametrize("engine", ENGINES)
def test_sweep_through_xarray(engine):
    with xarray.open_datatree(FOLDER / "sample_sweep.h5", engine=engine) as tree:
        point = tree["point"].to_dataset()
        assert point["status"].dims == ("point",)
        assert "rotation.speed_rpm" in point.coords
        np.testing.assert_array_equal(point["rotation.speed_rpm"], [1000, 1004, 1008])
        np.testing.assert_array_equal(point["status"], [0, 2, 0])
        np.testing.assert_array_equal(point["events"], [1, 2, 5_000_000_003])
        assert point["multiplier"].dims == ("point", "number") and point["multiplier"].shape == (3, 3)
        assert point["events"].dtype == "int64" and point["status"].dtype == "int32"
        assert point["status"].attrs["meanings"] == "0 = ok, 1 = too many events, 2 = chatter"
        assert point["status"].attrs["flag_meanings"] == "ok too_many_events chatter"
        np.testing.assert_array_equal(point["status"].attrs["flag_values"], [0, 1, 2])
        np.testing.assert_array_equal(tree["axis"]["rotation.speed_rpm"], [1000, 1004, 1008])
        assert tree["axis"]["rotation.speed_rpm"].attrs["units"] == "rpm"
        extrema = tree["extrema/mesh_deformation"]
        offset = extrema["offset"].values
        assert [list(extrema["value"].values[a:b]) for a, b in pairwise(offset)] == [[1.5e-4, -0.5e-4], [], [2.5e-4]]
        assert extrema["kind"].dtype == "int8"
        np.testing.assert_array_equal(extrema["kind"], [1, -1, 1])
        assert extrema["value"].attrs["units"] == "m" and extrema["time"].attrs["units"] == "s"


@pytest.mark.parametrize("engine", ENGINES)
def test_run_through_xarray(engine):
    with xarray.open_datatree(FOLDER / "sample_run.h5", engine=engine) as tree:
        state = tree["state"]
        assert state["displacement"].dims == ("time", "coordinate")
        np.testing.assert_allclose(state["displacement"].sel(coordinate="rotor", time=0.1), 4.0)
        np.testing.assert_array_equal(state["velocity"], -state["displacement"])
        assert list(state["displacement"].attrs["names"]) == ["slider", "rotor"]
        assert state["displacement"].attrs["units"] == "mixed"
        assert list(state["displacement"].attrs["coordinate_units"]) == ["m", "rad"]
        assert list(state["velocity"].attrs["coordinate_units"]) == ["m/s", "rad/s"]
        assert float(tree["observable/gap"].sel(time=0.3)) == pytest.approx(0.1)
        np.testing.assert_array_equal(tree["time"], [0.0, 0.1, 0.2, 0.3])
        event = tree["event"]
        assert [event["contact"].attrs["names"][i - 1] for i in event["contact"].values] == ["right", "left"]
        assert event["state"].attrs["meanings"] == "0 = open, 1 = closed"
        np.testing.assert_array_equal(event["time"], [0.11, 0.22])
        np.testing.assert_array_equal(tree["extrema/mesh_deformation/time"], [0.26, 0.27, 0.28])


@pytest.mark.parametrize("engine", ENGINES)
def test_tune_through_xarray(engine):
    with xarray.open_dataset(FOLDER / "sample_tune.h5", engine=engine) as data:
        assert data["frequency"].dims == ("parameter", "mode")
        assert float(data["frequency"].sel(parameter=3.0, mode=1)) == 3.0
        assert data["eigenvalue"].dims == ("single", "mode", "complex") and data["frequency_after"].dims == ("order",)
        assert data["optimum"].dims == () and float(data["optimum"]) == 2.0
        assert data["optimum"].attrs["units"] == data["parameter"].attrs["units"] == "N/m"
        assert data["optimum"].attrs["mode"] == "the mode that is mostly table"


def test_members_come_in_the_order_of_writing():
    with h5py.File(FOLDER / "sample_run.h5", track_order=True) as file:
        assert list(file) == ["sample", "time", "state", "observable", "event", "extrema"]


def test_documented_examples_run(tmp_path):
    shutil.copy(FOLDER / "sample_sweep.h5", tmp_path / "sweep.h5")
    shutil.copy(FOLDER / "sample_run.h5", tmp_path / "run.h5")
    page = Path(__file__).parents[2] / "docs" / "file_format.md"
    examples = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(examples) == 2
    printed = ""
    for example in examples:
        command = [sys.executable, "-c", example]
        printed += subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    assert "2 maxima, rpm against m" in printed
    assert "0.11 right" in printed and "0.22 left" in printed
