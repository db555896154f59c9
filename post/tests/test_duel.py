"""The picture of a duel and its reader, on a file made by hand."""

import pytest
from matplotlib.figure import Figure
from samples import write_duel

from razy.plot import PlotOptions, draw
from razy.read import DuelResult, open_result


@pytest.fixture
def duel(tmp_path):
    return write_duel(tmp_path / "duel.h5")


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
