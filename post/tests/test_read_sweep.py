"""Reading sweeps: values, ragged offsets, parts, absent and damaged datasets."""

import h5py
import numpy as np
import pytest
from samples import ragged, root, write_sweep

from razy.read import ResultError, SweepResult, open_result


def opened(path) -> SweepResult:
    result = open_result(path)
    assert isinstance(result, SweepResult)
    return result


def test_attributes_and_quantities(sweep):
    with opened(sweep) as result:
        assert result.program == "razy-sweep"
        assert result.title == "Torsional gear pair"
        assert result.razy_version == "0.1.0"
        assert result.parameters == ("rotation.speed_rpm",)
        assert result.parameter().units == "rpm"
        assert result.observables == ("mesh_deformation",)
        assert result.extrema("mesh_deformation").quantity.units == "m"
        np.testing.assert_array_equal(result.axis(), np.linspace(1000.0, 1490.0, 50))
        np.testing.assert_array_equal(result.axis("rotation%speed_rpm"), result.axis())
        assert result.status_meanings == {0: "ok", 1: "too many events", 2: "overflow"}
        np.testing.assert_array_equal(result.events, np.arange(50))
        assert result.steps is None
        assert result.near_misses is None


def test_near_misses_are_read_where_a_file_has_them(sweep):
    with h5py.File(sweep, "a") as file:
        file["point/near_misses"] = np.arange(50)[::-1]
    with opened(sweep) as result:
        np.testing.assert_array_equal(result.near_misses, np.arange(50)[::-1])
        np.testing.assert_array_equal(result.to_xarray()["near_misses"], result.near_misses)


def test_each_point_has_its_own_extrema(sweep):
    values, kinds = ragged(50)
    with opened(sweep) as result:
        extrema = result.extrema("mesh_deformation")
        assert len(extrema) == sum(map(len, values))
        for index in range(50):
            read = extrema.point(index)
            np.testing.assert_array_equal(read.value, values[index])
            np.testing.assert_array_equal(read.kind, kinds[index])
            np.testing.assert_allclose(read.time, 0.25 + 1e-4 * np.arange(len(values[index])))
        assert extrema.point(0).value.size == 0
        with pytest.raises(IndexError):
            extrema.point(50)
        with pytest.raises(IndexError):
            extrema.point(-1)


@pytest.mark.parametrize("size", [1, 2, 3, 7, 10_000])
def test_parts_join_to_the_whole(sweep, size):
    values, kinds = ragged(50)
    owner = np.repeat(np.arange(50), [len(point) for point in values])
    with opened(sweep) as result:
        chunks = list(result.extrema("mesh_deformation").chunks(size=size))
    assert max(chunk.value.size for chunk in chunks) <= size
    np.testing.assert_array_equal(np.concatenate([chunk.value for chunk in chunks]), np.concatenate(values))
    np.testing.assert_array_equal(np.concatenate([chunk.kind for chunk in chunks]), np.concatenate(kinds))
    np.testing.assert_array_equal(np.concatenate([chunk.point for chunk in chunks]), owner)


@pytest.mark.parametrize("size", [2, 10_000])
def test_parts_of_selected_points(sweep, size):
    values, _ = ragged(50)
    selected = np.zeros(50, dtype=bool)
    selected[[0, 3, 4, 5, 20, 49]] = True
    with opened(sweep) as result:
        chunks = list(result.extrema("mesh_deformation").chunks(selected, size))
    points = np.flatnonzero(selected)
    np.testing.assert_array_equal(
        np.concatenate([chunk.value for chunk in chunks]), np.concatenate([values[point] for point in points])
    )
    owner = np.repeat(points, [len(values[point]) for point in points])
    np.testing.assert_array_equal(np.concatenate([chunk.point for chunk in chunks]), owner)


def test_no_part_reads_more_than_it_holds(sweep, monkeypatch):
    read = []
    plain = h5py.Dataset.__getitem__

    def counted(self, key, *more):
        value = plain(self, key, *more)
        if self.name.endswith(("/value", "/kind", "/time")):
            read.append(np.size(value))
        return value

    monkeypatch.setattr(h5py.Dataset, "__getitem__", counted)
    with opened(sweep) as result:
        extrema = result.extrema("mesh_deformation")
        assert read == []
        list(extrema.chunks(size=5))
        assert max(read) == 5
        read.clear()
        extrema.point(7)
        assert max(read) <= 6


def test_table(sweep):
    values, kinds = ragged(50)
    speed = np.repeat(np.linspace(1000.0, 1490.0, 50), [len(point) for point in values])
    kind = np.concatenate(kinds)
    with opened(sweep) as result:
        table = result.table("mesh_deformation")
        maxima = result.table("mesh_deformation", kind=1)
    np.testing.assert_array_equal(table.parameter, speed)
    np.testing.assert_array_equal(table.value, np.concatenate(values))
    np.testing.assert_array_equal(maxima.parameter, speed[kind == 1])
    np.testing.assert_array_equal(maxima.value, np.concatenate(values)[kind == 1])


def test_xarray(sweep):
    values, _ = ragged(50)
    with opened(sweep) as result:
        data = result.to_xarray()
    assert data.attrs["program"] == "razy-sweep"
    assert data["mesh_deformation"].attrs["units"] == "m"
    at_point_3 = data["mesh_deformation"][data["mesh_deformation_point"] == 3]
    np.testing.assert_array_equal(at_point_3, values[3])
    assert data["status"].dims == ("point",)


def test_optional_datasets_may_be_absent(sweep):
    with h5py.File(sweep, "r+") as file:
        del file["point"]
        del file["extrema/mesh_deformation/time"]
        del file["extrema/mesh_deformation/kind"]
        del file.attrs["title"]
        del file.attrs["git_commit"]
    with opened(sweep) as result:
        assert result.title == ""
        assert not np.any(result.status)
        assert result.status_meanings == {}
        assert result.events is None
        assert result.grid().size == 50
        read = result.extrema("mesh_deformation").all()
        assert np.all(np.isnan(read.time))
        assert not np.any(read.kind)
        assert "mesh_deformation_kind" not in result.to_xarray()


def test_text_of_fixed_length(sweep):
    with h5py.File(sweep, "r+") as file:
        file.attrs["program"] = np.bytes_("razy-sweep   ")
        file.attrs["title"] = np.bytes_("T\u00e9st ".encode())
        file["extrema/mesh_deformation/value"].attrs["units"] = np.array([b"mm "])
    with opened(sweep) as result:
        assert result.title == "T\u00e9st"
        assert result.extrema("mesh_deformation").quantity.units == "mm"


def test_two_parameters(tmp_path):
    path = tmp_path / "two.h5"
    with root(path, "razy-sweep") as file:
        file["axis/b"], file["axis/a"] = [1.0, 2.0], [10.0, 20.0, 30.0]
        file["point/b"], file["point/a"] = np.repeat([1.0, 2.0], 3), np.tile([10.0, 20.0, 30.0], 2)
    with opened(path) as result:
        assert result.n_points == 6
        np.testing.assert_array_equal(result.grid("b"), [1, 1, 1, 2, 2, 2])
        np.testing.assert_array_equal(result.grid("a"), [10, 20, 30, 10, 20, 30])
        with pytest.raises(ResultError, match="several parameters, name one of: a, b"):
            result.axis()


@pytest.mark.parametrize(
    ("dataset", "data"),
    [
        ("offset", np.arange(50)),
        ("offset", np.zeros(51, dtype=int)),
        ("offset", np.concatenate(([1] * 50, [130]))),
        ("offset", np.concatenate(([0], [5], [3] * 48, [130]))),
        ("kind", np.zeros(3, dtype=np.int8)),
        ("time", np.zeros((2, 2))),
    ],
)
def test_datasets_that_do_not_fit_together(sweep, dataset, data):
    with h5py.File(sweep, "r+") as file:
        group = file["extrema/mesh_deformation"]
        total = group["value"].shape[0]
        del group[dataset]
        group[dataset] = np.where(data == 130, total, data)
    with opened(sweep) as result, pytest.raises(ResultError, match=r"case\.h5.*(offset|kind|time)"):
        result.extrema("mesh_deformation")


def test_missing_dataset_and_unknown_name(sweep):
    with h5py.File(sweep, "r+") as file:
        del file["extrema/mesh_deformation/value"]
    with opened(sweep) as result:
        with pytest.raises(ResultError, match="missing dataset 'extrema/mesh_deformation/value'"):
            result.extrema("mesh_deformation")
        with pytest.raises(ResultError, match="no observable 'mesh_deformatio'; did you mean 'mesh_deformation'"):
            result.extrema("mesh_deformatio")


def test_sweep_without_points(tmp_path):
    path = write_sweep(tmp_path / "one.h5", np.array([1.0]), {"d": ([np.empty(0)], [np.empty(0)])})
    with opened(path) as result:
        assert list(result.extrema("d").chunks()) == []
        assert result.table("d").value.size == 0


def test_files_that_are_not_results(tmp_path):
    plain = tmp_path / "plain.h5"
    plain.write_text("no HDF5")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1
    with root(tmp_path / "strange.h5", "razy-guess"):
        pass
    cases = {
        plain: "not an HDF5 file",
        tmp_path / "other.h5": "not a razy result file",
        tmp_path / "strange.h5": "program 'razy-guess'",
        tmp_path / "absent.h5": "no such file",
        tmp_path: "is a folder",
    }
    for path, message in cases.items():
        with pytest.raises(ResultError, match=message):
            open_result(path)


def test_incomplete_file(sweep):
    whole = sweep.read_bytes()
    sweep.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ResultError, match="damaged or incomplete"):
        open_result(sweep)
