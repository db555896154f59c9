"""Result files that the tests share."""

from pathlib import Path

import numpy as np
import pytest
from samples import logistic, ragged, write_follow, write_run, write_sweep, write_tune


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    """Return a sweep of 50 points with 0 to 6 extrema each, the first with none."""
    return write_sweep(tmp_path / "case.h5", np.linspace(1000.0, 1490.0, 50), {"mesh_deformation": ragged(50)})


@pytest.fixture
def diagram(tmp_path: Path) -> Path:
    """Return a sweep of 200 points that looks like a bifurcation diagram, 40 extrema each."""
    return write_sweep(
        tmp_path / "diagram.h5", np.linspace(1000.0, 2600.0, 200), {"mesh_deformation": logistic(200, 40)}
    )


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Return a motion with trajectory, observable, events and extrema."""
    return write_run(tmp_path / "run.h5")


@pytest.fixture
def tuning(tmp_path: Path) -> Path:
    """Return a tuning whose mode passes from one curve to another at 4 N/m."""
    return write_tune(tmp_path / "tune.h5")


@pytest.fixture
def follow(tmp_path: Path) -> Path:
    """Return branches with two folds, a doubling and a grazing."""
    return write_follow(tmp_path / "follow.h5")
