"""Curves of special points over two parameters: what is read, and what stands where in the picture."""

import numpy as np
import pytest
from pictures import drawn
from samples import add_curves, ragged, write_sweep

from razy.read import ResultError, open_result


@pytest.fixture
def curves(follow):
    """Return a file with a fold p = 10 + q and a doubling of period 2, p = 12."""
    return add_curves(follow)


def test_read(curves):
    with open_result(curves) as result:
        found = result.curves
    assert found.parameters == ("load.frequency", "damping.value")
    assert found.label.tolist() == ["LP", "PD"]
    assert found.places[0][found.curve == 2].tolist() == [12.0] * 5
    assert found.junction.tolist() == ["LP+PD"] and [at.tolist() for at in found.junctions] == [[12.0], [2.0]]


def test_picture(curves):
    (axes,) = drawn(curves, "curves").axes
    lines = {item.get_label(): item for item in axes.get_lines() if not item.get_label().startswith("_")}
    assert set(lines) == {"fold", "period doubling, period 2"}
    np.testing.assert_allclose(lines["fold"].get_xdata(), 10 + lines["fold"].get_ydata())
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("frequency of the load (Hz)", "damping value (N s/m)")


def test_what_has_none(follow):
    with pytest.raises(ResultError, match="second &follow"):
        drawn(follow, "curves")


def test_sweep_over_something_else(curves, tmp_path):
    other = write_sweep(tmp_path / "s.h5", np.linspace(7.0, 13.0, 9), {"displacement": ragged(9)})
    with open_result(other) as sweep, pytest.raises(ResultError, match="sweeps over"):
        drawn(curves, "curves", sweep=sweep)
