"""Statistics of contacts, periods and maps of two parameters: what is read and what is drawn where."""

import h5py
import numpy as np
import pytest
from pictures import drawn
from samples import SPEEDS, dataset, ragged, write_grid, write_sweep

from razy.plot import periods
from razy.read import ResultError, open_result


@pytest.fixture
def grid(tmp_path):
    return write_grid(tmp_path / "grid.h5")


def test_reading(grid):
    with open_result(grid) as sweep:
        assert sweep.parameters == ("rotation.speed_rpm", "load(1).value")
        assert sweep.contacts == ("mesh", "stop")
        assert sweep.period.tolist() == [1, 2, 3, 5, 0, -1]
        assert sweep.touched["mesh"].tolist() == [True, False, True, False, True, False]
        assert sweep.touched["stop"].tolist() == [False, True, True, False, False, False]
        assert sweep.contact_value("mesh", "largest_force")[3] == 11060.0
        with pytest.raises(ResultError, match="largest_force"):
            sweep.contact_value("mesh", "largest")
        assert sweep.to_xarray()["mesh.largest_force"].attrs["units"] == "N"


def test_map_shows_each_point_in_its_cell(grid):
    figure = drawn(grid)
    force, period = figure.axes[:2]
    mesh = force.collections[0]
    shown = mesh.get_array()
    assert shown.shape == (2, 3)
    np.testing.assert_allclose(shown[0], 1e-3 * (10 * SPEEDS + 50))
    assert np.ma.getmaskarray(np.ma.masked_invalid(shown)).tolist() == [[False, False, False], [False, False, True]]
    edges = mesh.get_coordinates()
    np.testing.assert_allclose(edges[0, :, 0], [950.0, 1050.0, 1200.0, 1400.0])
    np.testing.assert_allclose(edges[:, 0, 1], [45.0, 55.0, 65.0])
    assert period.collections[0].get_array().tolist() == [[0, 2, 6], [1, 4, 7]]
    assert force.get_ylabel().startswith("load")
    assert period.get_xlabel() == "speed (rpm)"


def test_map_of_a_part_and_of_what_is_not_there(grid):
    (axes, _bar) = drawn(grid, observables=("stop.largest_force",), start=1050.0).axes
    assert axes.collections[0].get_array().shape == (2, 2)
    for wrong in ("stop.impulse", "mash.largest_force", "largest_force"):
        with pytest.raises(ResultError):
            drawn(grid, observables=(wrong,))
    with pytest.raises(ResultError, match="map"):
        drawn(grid, kind="contacts")


def test_classes():
    found = periods.classes_of(np.array([1, 2, 3, 4, 5, 8, 9, 32, 0, -1]))
    assert [periods.CLASSES[i][0] for i in found] == [
        "1", "2", "3", "4", "5 to 8", "5 to 8", "9 to 32", "9 to 32", "not periodic", "not determined",
    ]  # fmt: skip


def test_lines_and_band_of_one_parameter(tmp_path):
    speed = np.linspace(1000.0, 1490.0, 50)
    path = write_sweep(tmp_path / "line.h5", speed, {"mesh_deformation": ragged(50)})
    with h5py.File(path, "r+") as file:
        dataset(file, "point/period", np.repeat([1, 2], 25).astype(np.int32))
        dataset(file, "contact/mesh/largest_force", speed**2, "N", "mesh: largest force")
        dataset(file, "contact/stop/largest_force", speed, "N", "stop: largest force")
    diagram, band = drawn(path).axes
    assert band.collections[0].get_array().tolist() == [[0] * 25 + [1] * 25]
    assert band.get_xlim() == diagram.get_xlim()
    (axes,) = drawn(path, kind="contacts", start=1100.0).axes
    lines = {line.get_label(): line.get_ydata() for line in axes.lines}
    np.testing.assert_allclose(lines["mesh"], 1e-6 * speed[speed >= 1100.0] ** 2)
    np.testing.assert_allclose(lines["stop"], 1e-6 * speed[speed >= 1100.0])
    # Where the motion failed its statistics are those of a part of it, such as no force before the recording began.
    with h5py.File(path, "r+") as file:
        file["point/status"][10:12] = 3
    (axes,) = drawn(path, kind="contacts").axes
    lines = {line.get_label(): line for line in axes.lines}
    assert np.flatnonzero(np.isnan(lines["mesh"].get_ydata())).tolist() == [10, 11]
    marks = [line for label, line in lines.items() if "(2)" in label]
    assert [line.get_xdata().tolist() for line in marks] == [speed[10:12].tolist()]
    (axes,) = drawn(path, kind="column", observables=("mesh.largest_force",)).axes
    assert np.flatnonzero(np.isnan(axes.lines[0].get_ydata())).tolist() == [10, 11]
    with pytest.raises(ResultError, match="statistics"):
        drawn(write_sweep(tmp_path / "none.h5", speed, {"x": ragged(50)}), kind="contacts")


def test_map_of_an_amplitude(grid):
    """Half the distance from the smallest to the largest extremum; nothing where there is none or the point failed."""
    with h5py.File(grid, "r+") as file:
        group = file.create_group("extrema/deflection")
        dataset(group, "offset", np.array([0, 2, 4, 5, 5, 7, 9]))
        dataset(
            group, "value", np.array([-1.0, 3.0, 0.0, 0.5, 2.0, -4.0, 4.0, 9.0, -9.0]), "m", "extrema of deflection"
        )
        del file["contact"]
    amplitude, period = drawn(grid).axes[:2]
    shown = np.ma.filled(np.ma.masked_invalid(amplitude.collections[0].get_array()), np.nan).T.ravel()
    np.testing.assert_array_equal(shown, [2.0, 0.25, 0.0, np.nan, 4.0, np.nan])
    assert period.collections[0].get_array().tolist() == [[0, 2, 6], [1, 4, 7]]
    figure = drawn(grid, observables=("deflection",))
    assert [axes.get_ylabel() for axes in figure.axes][1] == "amplitude of deflection (m)"
    with pytest.raises(ResultError, match="no observable 'deflections'; did you mean 'deflection'"):
        drawn(grid, observables=("deflections",))
