"""Several files in one picture, numbers of points over the parameter, and eigenvalues."""

from contextlib import ExitStack

import h5py
import numpy as np
import pytest
from matplotlib.figure import Figure
from pictures import drawn, line
from samples import dataset, write_modes, write_run, write_sweep

from razy.errors import ResultError
from razy.plot import PlotOptions, draw_several
from razy.plot.cli import main
from razy.plot.style import BLACK, GREY
from razy.read import open_result


def together(paths, kind, arrange="overlay", labels=(), **options) -> Figure:
    figure = Figure(dpi=100)
    with ExitStack() as stack:
        results = [stack.enter_context(open_result(path)) for path in paths]
        draw_several(results, figure, PlotOptions(**options), kind, labels, arrange)
    return figure


def test_of_two_motions_the_first_is_grey_the_second_black(run, tmp_path):
    other = write_run(tmp_path / "other.h5")
    (axes,) = together((run, other), "phase", labels=("before", "after"), coordinates=("y",)).axes
    assert [(one.get_label(), one.get_color()) for one in axes.lines] == [("before", GREY), ("after", BLACK)]
    np.testing.assert_allclose(np.ptp(line(axes, "after")[0]), 4.0, rtol=1e-5)


def test_difference_is_second_less_first(run, tmp_path):
    other = write_run(tmp_path / "other.h5")
    with h5py.File(other, "r+") as file:
        file["state/displacement"][:, 1] += 1e-3
    upper, lower = together((run, other), "time", "difference", coordinates=("y",)).axes
    assert len(upper.lines) == 2
    np.testing.assert_allclose(lower.lines[0].get_ydata(), 1.0, rtol=1e-9)


def test_panels_stand_side_by_side(run, tmp_path):
    other = write_run(tmp_path / "other.h5")
    axes = together((run, other), "phase", "panels", ("one", "two"), coordinates=("x",)).axes
    assert [one.get_title() for one in axes] == ["one", "two"]
    assert all(len(one.lines) == 1 for one in axes)


def test_what_does_not_fit_is_refused(run, sweep):
    with pytest.raises(ResultError, match="different programs"):
        together((run, sweep), "time")
    with pytest.raises(ResultError, match="no column picture"):
        together((run, run), "column")
    with pytest.raises(ResultError, match="1 labels for 2 files"):
        together((run, run), "time", labels=("one",))
    with pytest.raises(ResultError, match="a difference"):
        together((run, run, run), "time", "difference")


def test_numbers_of_points_over_the_parameter(sweep):
    axes = drawn(sweep, "column", observables=("events",)).axes[0]
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), np.arange(50))


def test_coordinates_that_are_rounding_are_drawn_by_name_only(tmp_path):
    path = write_run(tmp_path / "run.h5", observable=False)
    with h5py.File(path, "r+") as file:
        file["state/displacement"][:, 0] *= 1e-16
    axes = drawn(path, "time").axes
    assert [one.get_ylabel() for one in axes] == ["displacement of y (mm)"]
    assert len(drawn(path, "time", coordinates=("x", "y")).axes) == 2


def test_real_and_imaginary_parts(tmp_path):
    path = write_modes(tmp_path / "modes.h5")
    with h5py.File(path, "r+") as file:
        parts = np.stack((-1.0 + 0.0 * file["frequency"][:], 2 * np.pi * file["frequency"][:]), axis=-1)
        dataset(file, "eigenvalue", parts, "1/s")
    upper, lower = drawn(path, "eigenvalues").axes
    assert np.all(line(upper, "branch 1")[1] == -1.0)
    np.testing.assert_allclose(
        line(lower, "branch 2")[1], 2 * np.pi * (10.0 + 0.02 * np.linspace(0.0, 100.0, 11)), rtol=1e-12
    )
    assert any("unstable above 80.0 rad/s" in text.get_text() for text in upper.texts)


def test_command_takes_several_files(run, tmp_path):
    target = tmp_path / "both.png"
    arguments = [str(run), str(run), "--kind", "time", "--label", "a", "--label", "b", "--save", str(target)]
    assert main(arguments) == 0
    assert target.read_bytes().startswith(b"\x89PNG")


def test_largest_extremum_over_the_parameter_or_the_other_way_round(tmp_path):
    parameter = np.array([0.1, 0.2, 0.3])
    values = [np.array([1e-3, -5e-3, 2e-3]), np.array([]), np.array([3e-3])]
    path = write_sweep(tmp_path / "sweep.h5", parameter, {"d": (values, [np.sign(v) for v in values])})
    for swap in (False, True):
        (axes,) = drawn(path, kind="column", observables=("d",), swap=swap).axes
        x, y = axes.lines[0].get_data()
        if swap:
            x, y = y, x
        np.testing.assert_array_equal(x, parameter)
        np.testing.assert_allclose(y, [2.0, np.nan, 3.0])
    with pytest.raises(ResultError, match="--swap goes with pictures of the kind column alone"):
        drawn(path, swap=True)
