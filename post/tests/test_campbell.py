"""Files of razy-modes: what is read, and what the Campbell diagram shows."""

from pathlib import Path

import numpy as np
import pytest
from pictures import drawn, line
from samples import dataset, dimension_only, root

from razy_post.read import ModesResult, ResultError, open_result

SPEED = np.linspace(0.0, 100.0, 11)


def write_modes(path: Path, limit: float = 80.0) -> Path:
    """Write a forward and a backward branch, and a branch without whirl that crosses the forward one at 50 rad/s."""
    curves = np.stack((10.0 - 0.02 * SPEED, 10.0 + 0.02 * SPEED, np.full(11, 11.0)), axis=1)
    order = np.argsort(curves, axis=1, kind="stable")
    with root(path, "razy-modes", "Rotor") as file:
        dataset(file, "speed", SPEED, "rad/s")
        dataset(file, "frequency", np.take_along_axis(curves, order, axis=1), "Hz")
        dataset(file, "branch", order + 1.0)
        dataset(file, "direction", np.array([-1.0, 1.0, 0.0])[order])
        dimension_only(file, "critical", 1)
        dataset(file, "critical_speed", np.array([60.0]), "rad/s")
        dataset(file, "critical_order", np.array([1.0]))
        dataset(file, "critical_frequency", np.array([60.0 / (2 * np.pi)]), "Hz")
        dataset(file, "stability_limit", limit, "rad/s")
    return path


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


def test_modes_without_speeds(tmp_path):
    with root(tmp_path / "modes.h5", "razy-modes", "Press") as file:
        dataset(file, "speed", np.array([0.0]), "rad/s")
        dataset(file, "frequency", np.array([[1.0, 2.0]]), "Hz")
    with open_result(tmp_path / "modes.h5") as result:
        assert isinstance(result, ModesResult) and not result.is_campbell
    assert [bar.get_height() for bar in drawn(tmp_path / "modes.h5").axes[0].patches] == [1.0, 2.0]


def test_refused(tmp_path):
    path = write_modes(tmp_path / "modes.h5")
    with pytest.raises(ResultError, match="holds no observables"):
        drawn(path, observables=["d"])
