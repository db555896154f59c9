"""Sweeps of neighbouring ranges in one file, and text for other programs."""

import csv

import h5py
import numpy as np
import pytest
import xarray
from samples import dataset, ragged, write_basins, write_sweep

from razy.read import open_result
from razy.tools.cli import csv_main, merge_main

SPEEDS = np.linspace(1000.0, 1490.0, 50)
NAME = "mesh_deformation"


def part(path, first, last):
    """Write the points first to last - 1 of one and the same sweep."""
    values, kinds = ragged(50)
    write_sweep(path, SPEEDS[first:last], {NAME: (values[first:last], kinds[first:last])})
    with h5py.File(path, "r+") as file:
        file["point/events"][...] = np.arange(first, last)
        file.attrs["input"] = f"&scene\n   kind = 'lumped'\n/\n&sweep\n   first = {SPEEDS[first]}\n/\n"
    return str(path)


@pytest.fixture
def parts(tmp_path):
    return [part(tmp_path / f"{name}.h5", *span) for name, *span in (("c", 31, 50), ("a", 0, 15), ("b", 14, 31))]


def contents(path):
    found = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    return found


def test_merged_parts_are_the_whole(tmp_path, parts):
    whole, merged = part(tmp_path / "whole.h5", 0, 50), tmp_path / "merged.h5"
    assert merge_main([*parts, "--output", str(merged)]) == 0
    expected, found = contents(whole), contents(merged)
    assert expected.keys() == found.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values, err_msg=name)
    with h5py.File(merged) as file, h5py.File(whole) as model:
        assert file.attrs["merged"] == "a.h5, b.h5, c.h5"
        assert file["point/status"].attrs["meanings"] == model["point/status"].attrs["meanings"]
        assert file[f"extrema/{NAME}/value"].attrs["units"] == "m"
    for engine in ("h5netcdf", "netcdf4"):
        with xarray.open_datatree(merged, engine=engine) as tree:
            assert dict(tree["point"].sizes) == {"point": 50}
            assert tree[f"extrema/{NAME}/offset"].dims == ("boundary",)


def test_falling_ranges_keep_their_order(tmp_path):
    paths = []
    for name, values in (("low", [3.0, 2.0, 1.0]), ("high", [5.0, 4.0, 3.0])):
        extrema = {NAME: ([np.array([value]) for value in values], [np.array([1])] * 3)}
        paths.append(str(write_sweep(tmp_path / f"{name}.h5", np.array(values), extrema)))
    assert merge_main([*paths, "--output", str(tmp_path / "all.h5")]) == 0
    with open_result(tmp_path / "all.h5") as result:
        assert result.axis().tolist() == [5, 4, 3, 2, 1]
        assert result.table(NAME).value.tolist() == [5, 4, 3, 2, 1]


def changed_input(path):
    with h5py.File(path, "r+") as file:
        file.attrs["input"] = "&scene\n   kind = 'planar'\n/\n"


def other_commit(path):
    with h5py.File(path, "r+") as file:
        file.attrs["git_commit"] = "other"


def chains(path):
    with h5py.File(path, "r+") as file:
        dataset(file["point"], "direction", np.ones(19, dtype=np.int8))


@pytest.mark.parametrize(
    ("change", "says"), [(changed_input, "another input"), (other_commit, "git_commit"), (chains, "direction")]
)
def test_what_does_not_belong_together_is_refused(tmp_path, parts, capsys, change, says):
    change(parts[0])
    assert merge_main([*parts, "--output", str(tmp_path / "all.h5")]) == 2
    message = capsys.readouterr().err
    assert says in message and message.count("\n") == 1
    assert not (tmp_path / "all.h5").exists() and not (tmp_path / "all.h5.partial").exists()


def test_overlaps_and_existing_files_are_refused(tmp_path, parts, capsys):
    overlap = part(tmp_path / "overlap.h5", 10, 20)
    assert merge_main([parts[1], overlap, "--output", str(tmp_path / "all.h5")]) == 2
    assert "overlaps" in capsys.readouterr().err
    assert merge_main([*parts, "--output", parts[0]]) == 2
    assert merge_main([*parts, "--output", parts[0], "--force"]) == 2


def test_csv(tmp_path, monkeypatch, parts):
    monkeypatch.chdir(tmp_path)
    assert csv_main([parts[1], "--observable", NAME, "--output", "extrema.csv"]) == 0
    assert csv_main([parts[1]]) == 0
    assert csv_main([parts[1]]) == 2
    with (tmp_path / "extrema.csv").open() as file:
        header, *rows = csv.reader(file)
    assert header == ["point", "rotation.speed_rpm [rpm]", f"{NAME} [m]", "kind"]
    with open_result(parts[1]) as result:
        table = result.table(NAME)
    assert [float(row[1]) for row in rows] == table.parameter.tolist()
    assert [float(row[2]) for row in rows] == table.value.tolist()
    assert [int(row[3]) for row in rows] == table.kind.tolist()
    with (tmp_path / "a.csv").open() as file:
        header, *rows = csv.reader(file)
    assert header == ["point", "rotation.speed_rpm [rpm]", "events", "status"]
    assert [int(row[2]) for row in rows] == list(range(15))


def test_basins(tmp_path):
    from matplotlib.figure import Figure

    from razy.plot import PlotOptions, draw

    with open_result(write_basins(tmp_path / "basins.h5")) as result:
        assert (result.n_grid, result.n_starts, result.n_points) == (2, 6, 12)
        basin = result.basin(1)
        assert basin.attractor.tolist() == [1, 1, 2, 2, 2, 0]
        assert basin.period == {1: 1, 2: 2, 0: 0}
        assert basin.value["block.displacement"].tolist() == [-1, -1, 0, 0, 1, 1]
        figure = Figure()
        draw(result, figure, PlotOptions(start=0.5))
        axes = figure.axes[0]
        assert axes.collections[0].get_array().tolist() == [[1, 1, 2], [1, 2, -1]]
        assert [text.get_text() for text in axes.get_legend().get_texts()] == [
            "failed, 16.7 %", "1: period 1, 50 %", "2: period 3, 33.3 %",
        ]  # fmt: skip
        data = result.to_xarray()
        assert data["attractor"].dims == ("point",) and data["start.block.velocity"].units == "m/s"
    with open_result(write_sweep(tmp_path / "plain.h5", np.array([1.0, 2.0]), {})) as result:
        assert result.n_starts == 1 and result.start_quantities == ()
