"""Reading motions: state, observables, events, extrema, windows."""

import h5py
import numpy as np
import pytest
from samples import write_run

from razy.read import ResultError, RunResult, open_result
from razy.read.file import branch_of


def opened(path) -> RunResult:
    result = open_result(path)
    assert isinstance(result, RunResult)
    return result


def test_state_and_observables(run):
    with opened(run) as result:
        time = result.time
        assert result.coordinates == ("x", "y")
        assert result.observables == ("mesh_deformation",)
        np.testing.assert_allclose(result.displacement("y"), 2e-3 * np.cos(100 * time))
        np.testing.assert_allclose(result.velocity("y"), -0.2 * np.sin(100 * time))
        np.testing.assert_allclose(result.observable("mesh_deformation"), 1e-3 * np.sin(100 * time))
        assert result.coordinate_quantity("x").units == "m"
        assert result.observable_quantity("mesh_deformation").long_name == "mesh deformation"


def test_units_of_each_coordinate(run):
    with h5py.File(run, "r+") as file:
        state = file["state/displacement"]
        state.attrs["units"] = "mixed"
        state.attrs["coordinate_units"] = ["m", "rad"]
    with opened(run) as result:
        assert [result.coordinate_quantity(name).units for name in ("x", "y")] == ["m", "rad"]


def test_window(run):
    with opened(run) as result:
        part = result.window(0.1, 0.2)
        inside = result.time[part]
        assert inside[0] >= 0.1
        assert inside[-1] <= 0.2
        assert inside.size == np.count_nonzero((result.time >= 0.1) & (result.time <= 0.2))
        np.testing.assert_array_equal(result.displacement("x", part), result.displacement("x")[part])
        assert result.window() == slice(0, result.time.size)


def test_events_and_extrema(run):
    with opened(run) as result:
        assert result.events is not None
        np.testing.assert_allclose(result.events.time, np.pi / 100 * np.arange(1, 8))
        np.testing.assert_array_equal(result.events.state, [1, 2, 1, 2, 1, 2, 1])
        assert result.contacts == ("mesh",)
        assert result.state_meanings(1)[1] == "open" and result.state_meanings(1)[2] == "closed (upper side)"
        np.testing.assert_allclose(result.extrema("mesh_deformation").value, [1e-3, -1e-3] * 4)


def test_xarray(run):
    with opened(run) as result:
        data = result.to_xarray()
    assert data["displacement"].dims == ("time", "coordinate")
    np.testing.assert_allclose(data["displacement"].sel(coordinate="x"), data["mesh_deformation"])
    assert data["mesh_deformation"].attrs == {"units": "m", "long_name": "mesh deformation"}
    np.testing.assert_array_equal(data["event_state"], [1, 2, 1, 2, 1, 2, 1])
    assert data.sizes == {"time": 2000, "coordinate": 2, "event": 7, "mesh_deformation_extremum": 8}


def test_xarray_without_trajectory(tmp_path):
    with opened(write_run(tmp_path / "run.h5", trajectory=False)) as result:
        data = result.to_xarray()
    assert data.sizes == {"event": 7, "mesh_deformation_extremum": 8}
    np.testing.assert_allclose(data["mesh_deformation_extremum_time"], np.pi / 100 * (np.arange(8) + 0.5))


def test_absent_parts(tmp_path):
    path = write_run(tmp_path / "run.h5", trajectory=False)
    with h5py.File(path, "r+") as file:
        del file["event"]
    with opened(path) as result:
        assert not result.has_trajectory
        assert result.coordinates == ()
        assert result.observables == ()
        assert result.events is None
        assert result.contacts == ()
        with pytest.raises(ResultError, match="missing dataset 'time'"):
            _ = result.time
        with pytest.raises(ResultError, match="missing dataset 'state/displacement'"):
            result.displacement("x")


def test_shapes_that_do_not_fit(run):
    with h5py.File(run, "r+") as file:
        del file["observable/mesh_deformation"]
        file["observable/mesh_deformation"] = np.zeros(5)
    with opened(run) as result, pytest.raises(ResultError, match=r"shape \(5,\), expected shape \(2000,\)"):
        result.observable("mesh_deformation")


def test_states_of_a_mesh_with_one_and_two_pairs_of_teeth_have_names(run):
    with open_result(run) as result:
        meanings = result.state_meanings(1)
    assert meanings[2] == "closed (upper side)" and meanings[7] == "closed (upper side), 1 pair in mesh"
    assert branch_of(meanings[13]) == "closed (lower side)" and len(meanings) == 9
