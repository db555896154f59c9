"""The picture of a duel and its reader, on a file made by hand."""

import h5py
import numpy as np
import pytest
from matplotlib.figure import Figure
from samples import dataset, root

from razy_post.plot import PlotOptions, draw
from razy_post.read import DuelResult, open_result


@pytest.fixture
def duel(tmp_path):
    path = tmp_path / "duel.h5"
    with root(path, "razy-duel", "Two methods") as file:
        dataset(file, "series", np.array([1, 1, 2], dtype=np.int32))
        text = h5py.string_dtype()
        dataset(file, "method", np.array(["dop853", "dop853", "exact"], dtype=object).astype(text))
        dataset(file, "treatment", np.array(["event", "event", "event"], dtype=object).astype(text))
        dataset(file, "sharpness", np.zeros(3))
        dataset(file, "setting_is_step", np.zeros(3, dtype=np.int32))
        dataset(file, "setting", np.array([1e-6, 1e-9, 1e-9]))
        dataset(file, "error", np.array([1e-5, np.nan, 0.0]))
        dataset(file, "event_time_error", np.array([1e-7, np.nan, 0.0]), "s")
        dataset(file, "cpu_time", np.array([1e-3, 2e-3, 1e-4]), "s")
        dataset(file, "rhs_evaluations", np.array([1000, 2000, 0]))
        dataset(file, "event_surplus", np.array([1, 0, 0]))
        dataset(file, "status", np.array([0, 6, 0], dtype=np.int32))
        dataset(file, "reference/error", np.array([1e-12]), reference="exact", check="dop853")
    return path


def test_series_are_the_groups_of_the_input(duel):
    with open_result(duel) as result:
        assert isinstance(result, DuelResult)
        assert [one.name for one in result.series] == ["dop853, event", "exact"]
        assert result.series[0].setting.tolist() == [1e-6, 1e-9]
        assert (result.reference, result.reference_error) == ("exact", 1e-12)


def test_failed_rows_are_left_out_and_wrong_counts_hollow(duel):
    figure = Figure()
    with open_result(duel) as result:
        draw(result, figure, PlotOptions())
    left = figure.axes[0]
    solid, hollow = left.lines[0], left.lines[1]
    assert solid.get_xdata().tolist() == [1e-3]
    assert hollow.get_xdata().tolist() == [1e-3]
    assert hollow.get_markerfacecolor() == "white"
    assert [line.get_label() for line in left.lines[2:]] == ["error of exact"]
