"""Files of razy-tune: what is read, and what the picture shows."""

import h5py
import numpy as np
import pytest
from pictures import drawn, line
from samples import write_tune

from razy.read import ResultError, TuneResult, open_result


def test_read(tuning):
    with open_result(tuning) as result:
        assert isinstance(result, TuneResult)
        assert result.mode == "the mode that is mostly a"
        assert (result.goal, result.optimum, result.reference) == (2.7, 7.21, 1.0)
        assert result.frequency.shape == (101, 2)
        assert result.quantity("parameter").units == "N/m"
        np.testing.assert_array_equal(result.frequency_before, [1.0, 2.0])
        np.testing.assert_array_equal(result.frequency_after, [2.0, 2.7])


def test_curves(tuning):
    upper, lower = drawn(tuning).axes
    with open_result(tuning) as result:
        for number in (1, 2):
            x, y = line(lower, f"mode {number}")
            np.testing.assert_array_equal(x, result.parameter)
            np.testing.assert_array_equal(y, result.frequency[:, number - 1])
        x, y = line(upper, "objective")
        np.testing.assert_allclose(y[np.isfinite(y)], result.objective)
    assert line(lower, "tuned value")[0] == [7.21] and line(lower, "tuned value")[1] == [2.7]
    assert np.all(line(lower, "goal")[1] == 2.7)
    assert lower.get_xlabel() == "stiffness of the spring (N/m)"
    assert lower.get_ylabel() == "natural frequency (Hz)"
    assert upper.get_legend().get_texts()[0].get_text() == "the mode that is mostly a"
    assert upper.get_title(loc="left") == "Two masses"


def test_gap_where_the_mode_passes_to_another_curve(tuning):
    upper, lower = drawn(tuning).axes
    for axes, label in ((lower, "tuned"), (upper, "objective")):
        x, y = line(axes, label)
        (at,) = np.flatnonzero(np.isnan(y))
        assert x[at] <= 4.0 < x[at + 1]


def test_no_gap_where_curves_cross(tmp_path):
    path = write_tune(tmp_path / "cross.h5", points=100, gap=0.0)
    with h5py.File(path, "r+") as file:
        k = file["parameter"][:]
        file["frequency"][:] = np.stack((np.sqrt(k), np.full(k.size, 2.0)), axis=1)
        file["tuned_frequency"][:] = np.sqrt(k)
    upper, lower = drawn(path).axes
    assert np.all(np.isfinite(line(lower, "tuned")[1])) and np.all(np.isfinite(line(upper, "objective")[1]))


def test_mode_that_is_not_stored(tuning):
    with h5py.File(tuning, "r+") as file:
        file["tuned_frequency"][:] = 5.0 + file["tuned_place"][:]
    (at,) = np.flatnonzero(np.isnan(line(drawn(tuning).axes[1], "tuned")[1]))
    assert at == 38


def test_range(tuning):
    lower = drawn(tuning, start=2.0, stop=6.0).axes[1]
    assert lower.get_xlim() == pytest.approx((2.04, 5.96))
    with pytest.raises(ResultError, match="no value of the parameter from 20 on; the file has 1 to 9"):
        drawn(tuning, start=20.0)


def test_what_does_not_fit(tuning):
    with pytest.raises(ResultError, match="no observables and no coordinates"):
        drawn(tuning, observables=("d",))
    with pytest.raises(ResultError, match="no bifurcation picture of a file of razy-tune"):
        drawn(tuning, kind="bifurcation")
    with h5py.File(tuning, "r+") as file:
        del file["objective"]
        file["objective"] = np.ones(3)
    with pytest.raises(ResultError, match=r"dataset 'objective' has shape \(3,\), expected \(101,\)"):
        drawn(tuning)
