"""Sensitivities of special points: what is read, and how long the bars are."""

import h5py
import numpy as np
import pytest
from pictures import drawn
from samples import add_sensitivities

from razy.read import ResultError, open_result


@pytest.fixture
def moved(follow):
    """Return a file whose first two special points move by 2 and -3, and by 0.5 and not known, for each unit."""
    return add_sensitivities(follow)


def test_read(moved):
    with open_result(moved) as result:
        found = result.sensitivities
    assert found.names.tolist() == ["damper.damping", "stop.clearance"]
    assert found.slope[0].tolist() == [2.0, -3.0] and found.error.shape == (2, 2)
    assert found.special.tolist() == [0, 1] and found.values.tolist() == [4.0, 0.1]


def test_bars(moved):
    """A hundredth of value times derivative."""
    (axes,) = drawn(moved, "sensitivity").axes
    first, second = ([bar.get_width() for bar in bars] for bars in axes.containers)
    with open_result(moved) as result:
        special = result.special
    # The axis is in thousandths.
    factor = first[0] / 0.08
    assert first == pytest.approx([0.08 * factor, -0.12 * factor])
    assert second[0] == pytest.approx(0.0005 * factor) and np.isnan(second[1])
    for value, text in zip(special.parameter, axes.get_yticklabels(), strict=False):
        assert f"{value:.8g}" in text.get_text()
    assert axes.get_xlabel().startswith("change of ") and "for +1 %" in axes.get_xlabel()


def test_range(moved):
    with open_result(moved) as result:
        at = result.special.parameter
    (axes,) = drawn(moved, "sensitivity", start=at[0] - 1e-3, stop=at[0] + 1e-3).axes
    assert len(axes.get_yticklabels()) == 1
    with pytest.raises(ResultError, match="no special point with a sensitivity"):
        drawn(moved, "sensitivity", start=at.max() + 1.0)


def test_what_has_none(follow):
    with open_result(follow) as result:
        assert result.sensitivities is None
    with pytest.raises(ResultError, match="sensitivities="):
        drawn(follow, "sensitivity")


def test_points_that_are_not_there(moved):
    with h5py.File(moved, "r+") as file:
        file["sensitivity/special"][1] = 99
    with pytest.raises(ResultError, match="names points that are not there"):
        drawn(moved, "sensitivity")
