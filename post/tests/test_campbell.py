"""Files of razy-modes: what is read, and what the Campbell diagram shows."""

import h5py
import numpy as np
import pytest
from pictures import drawn, line
from samples import dataset, root, write_modes

from razy.read import ModesResult, ResultError, open_result


def test_branches_go_through_crossings(tmp_path):
    axes = drawn(write_modes(tmp_path / "modes.h5")).axes[0]
    for number, slope in ((1, -0.02), (2, 0.02)):
        x, y = line(axes, f"branch {number}")
        np.testing.assert_allclose(y, 10.0 + slope * x * np.pi / 30, rtol=1e-12)
    assert np.all(line(axes, "branch 3")[1] == 11.0)
    colours = {handle.get_label(): handle.get_color() for handle in axes.lines}
    assert len({colours[f"branch {number}"] for number in (1, 2, 3)}) == 3


def test_excitation_and_limits(tmp_path):
    axes = drawn(write_modes(tmp_path / "modes.h5")).axes[0]
    x, y = line(axes, "order 1")
    np.testing.assert_allclose(y, x / 60.0)
    assert line(axes, "critical speeds")[0] == pytest.approx([60.0 * 30 / np.pi])
    assert line(axes, "stability limit")[0][0] == pytest.approx(80.0 * 30 / np.pi)
    axes = drawn(write_modes(tmp_path / "stable.h5", np.nan)).axes[0]
    assert "stability limit" not in [handle.get_label() for handle in axes.lines]


def test_verdicts_are_drawn_apart(tmp_path):
    path = write_modes(tmp_path / "modes.h5")
    with h5py.File(path, "r+") as file:
        stable = np.where(file["branch"][:] == 3, -1, 1)
        stable[6:][file["branch"][6:] == 1] = 0
        file["stable"] = stable
    lines = [(handle.get_label(), handle.get_linestyle()) for handle in drawn(path).axes[0].lines]
    assert [style for label, style in lines if label == "branch 1"] == ["-", "--"]
    assert [style for label, style in lines if label == "branch 2"] == ["-"]
    assert [style for label, style in lines if label == "branch 3"] == [":"]


def test_modes_without_speeds(tmp_path):
    with root(tmp_path / "modes.h5", "razy-modes", "Press") as file:
        dataset(file, "speed", np.array([0.0]), "rad/s")
        dataset(file, "frequency", np.array([[1.0, 2.0]]), "Hz")
    with open_result(tmp_path / "modes.h5") as result:
        assert isinstance(result, ModesResult) and not result.is_campbell
    axes = drawn(tmp_path / "modes.h5").axes[0]
    assert [bar.get_height() for bar in axes.patches] == [1.0, 2.0]
    assert all(place == int(place) for place in axes.get_xticks())


def test_refused(tmp_path):
    path = write_modes(tmp_path / "modes.h5")
    with pytest.raises(ResultError, match="holds no observables"):
        drawn(path, observables=("d",))


def test_vertical_axis_ends_above_the_lines_of_excitation(tmp_path):
    path = write_modes(tmp_path / "modes.h5")
    with h5py.File(path, "r+") as file:
        high = np.full((11, 1), 500.0)
        for name, column in (("frequency", high), ("branch", high / 125.0), ("direction", 0.0 * high)):
            values, attributes = np.hstack((file[name][:], column)), dict(file[name].attrs)
            del file[name]
            file[name] = values
            file[name].attrs.update(attributes)
    # The line of the order 1 reaches 100 rad/s over 2 pi.
    assert drawn(path).axes[0].get_ylim()[1] == pytest.approx(1.25 * 100.0 / (2 * np.pi))
    assert drawn(path, top=600.0).axes[0].get_ylim() == (0.0, 600.0)
    assert drawn(write_modes(tmp_path / "low.h5")).axes[0].get_ylim()[1] == pytest.approx(1.05 * 12.0)
    with h5py.File(path, "r+") as file:
        for name in ("critical_speed", "critical_order", "critical_frequency"):
            del file[name]
            file[name] = np.zeros(0)
    assert drawn(path).axes[0].get_ylim()[1] == pytest.approx(1.05 * 500.0)


def test_names_of_orders_are_clear_of_marks_and_frame(tmp_path):
    figure = drawn(write_modes(tmp_path / "modes.h5"))
    axes = figure.axes[0]
    figure.draw_without_rendering()
    names = [text for text in axes.texts if text.get_text().endswith("\N{MULTIPLICATION SIGN}")]
    assert [text.get_text() for text in names] == ["1\N{MULTIPLICATION SIGN}"]
    frame, marks = axes.get_window_extent(), axes.transData.transform(np.transpose(line(axes, "critical speeds")))
    for text in names:
        box = text.get_window_extent()
        assert frame.contains(box.x0, box.y0) and frame.contains(box.x1, box.y1)
        assert not any(box.contains(*mark) for mark in marks)
