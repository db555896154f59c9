"""Bifurcation diagrams: which points stand where, the change to density images, failed points."""

import tracemalloc

import h5py
import numpy as np
import pytest
from pictures import drawn, inside, line, near
from samples import dataset, logistic, ragged, write_sweep

from razy.plot import PlotNote
from razy.read import ResultError


def test_exponents_stand_below(tmp_path):
    path = write_sweep(tmp_path / "s.h5", np.linspace(1000.0, 2000.0, 3), {"mesh_deformation": ragged(3)})
    with h5py.File(path, "r+") as file:
        dataset(file, "lyapunov/exponent", np.array([[-1.0, -2.0], [3.0, -2.0], [-np.inf, -np.inf]]), "1/s")
    _, axes = drawn(path).axes[:2]
    lines = {item.get_label(): item for item in axes.get_lines()}
    assert lines["Lyapunov exponent 1"].get_xdata().tolist() == [1000.0, 1500.0]
    assert lines["Lyapunov exponent 1"].get_ydata().tolist() == [-1.0, 3.0]
    assert axes.get_ylim()[0] < -2.0 and axes.get_ylim()[1] > 3.0


def test_each_extremum_is_a_point_of_its_kind(sweep):
    values, kinds = ragged(50)
    speed = np.repeat(np.linspace(1000.0, 1490.0, 50), [len(point) for point in values])
    value, kind = np.concatenate(values), np.concatenate(kinds)
    (axes,) = drawn(sweep).axes
    for label, sign in (("maxima", 1), ("minima", -1)):
        x, y = line(axes, label)
        np.testing.assert_array_equal(x, speed[kind == sign])
        np.testing.assert_allclose(y, 1e6 * value[kind == sign])
    assert axes.get_ylabel() == "mesh deformation (µm)"
    assert axes.get_xlabel() == "speed (rpm)"
    assert axes.get_title(loc="left") == "Torsional gear pair"


@pytest.mark.parametrize("limit", [10**6, 0])
def test_maxima_are_grey_and_minima_black(diagram, limit):
    figure = drawn(diagram, dpi=200, point_limit=limit)
    picture = inside(figure, figure.axes[0])
    middle = picture.shape[0] // 2
    assert picture[: middle - 20].min() == pytest.approx(0x8A, abs=2)
    assert picture[middle + 20 :].min() < 10


def test_range_of_the_parameter(sweep):
    _, kinds = ragged(50)
    (axes,) = drawn(sweep, start=1100.0, stop=1200.0).axes
    wanted = sum(np.count_nonzero(kind == 1) for kind in kinds[10:21])
    assert line(axes, "maxima")[0].size == wanted
    low, high = axes.get_xlim()
    assert 1098.0 < low < 1100.0
    assert 1200.0 < high < 1202.0


def test_non_finite_values_are_left_out(sweep):
    with h5py.File(sweep, "r+") as file:
        value = file["extrema/mesh_deformation/value"]
        kind = file["extrema/mesh_deformation/kind"][()]
        value[np.flatnonzero(kind == 1)[:3]] = [np.nan, np.inf, -np.inf]
    (axes,) = drawn(sweep).axes
    assert line(axes, "maxima")[0].size == np.count_nonzero(kind == 1) - 3
    assert np.all(np.isfinite(axes.get_ylim()))


def test_kinds_that_mean_nothing_here_are_drawn_too(sweep):
    with h5py.File(sweep, "r+") as file:
        file["extrema/mesh_deformation/kind"][:5] = [0, 2, -2, 100, -128]
        total = file["extrema/mesh_deformation/value"].size
    (axes,) = drawn(sweep).axes
    assert line(axes, "extrema")[0].size == 5
    assert sum(line(axes, label)[0].size for label in ("maxima", "minima", "extrema")) == total


def test_extrema_of_unknown_kind(sweep):
    with h5py.File(sweep, "r+") as file:
        del file["extrema/mesh_deformation/kind"]
        total = file["extrema/mesh_deformation/value"].size
    (axes,) = drawn(sweep).axes
    assert line(axes, "extrema")[0].size == total


def test_failed_points_are_marked(tmp_path):
    speed = np.linspace(1000.0, 1490.0, 50)
    status = np.zeros(50, dtype=int)
    status[[4, 5]], status[30] = 1, 7
    path = write_sweep(tmp_path / "case.h5", speed, {"d": ragged(50)}, status=status)
    (axes,) = drawn(path).axes
    np.testing.assert_array_equal(line(axes, "too many events (2)")[0], speed[[4, 5]])
    np.testing.assert_array_equal(line(axes, "failed, status 7 (1)")[0], speed[[30]])
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == ["maxima", "minima", "too many events (2)", "failed, status 7 (1)"]
    (axes,) = drawn(path, stop=1100.0).axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["maxima", "minima", "too many events (2)"]


def test_all_points_failed(tmp_path):
    nothing = [np.empty(0)] * 3
    path = write_sweep(tmp_path / "case.h5", np.arange(3.0), {"d": (nothing, nothing)}, status=np.ones(3, dtype=int))
    with pytest.raises(ResultError, match="no extrema of 'd' in the file; 3 of 3 points failed"):
        drawn(path)


def test_change_to_density_above_the_limit(diagram):
    assert len(drawn(diagram, point_limit=8000).axes[0].images) == 0
    (axes,) = drawn(diagram, point_limit=7999).axes
    assert len(axes.images) == 2
    assert not [item for item in axes.get_lines() if item.get_label() in ("maxima", "minima")]


def test_default_limit_is_a_million_points(tmp_path):
    for each, images in ((1000, 0), (1002, 2)):
        path = write_sweep(tmp_path / f"{each}.h5", np.linspace(0.0, 1.0, 1000), {"d": logistic(1000, each)})
        assert len(drawn(path).axes[0].images) == images


def test_density_covers_what_points_cover(diagram):
    figures = [drawn(diagram, dpi=100), drawn(diagram, dpi=100, point_limit=0)]
    limits = [(figure.axes[0].get_xlim(), figure.axes[0].get_ylim()) for figure in figures]
    assert limits[0] == limits[1]
    points, density = (inside(figure, figure.axes[0]).min(axis=2) < 250 for figure in figures)
    assert np.count_nonzero(density) > 0.3 * np.count_nonzero(points)
    assert not np.any((density & ~near(points))[5:-5, 5:-5])


def test_density_image_is_not_flat(diagram):
    (axes,) = drawn(diagram, point_limit=0).axes
    for image in axes.images:
        opacity = image.get_array()[..., 3]
        assert 0.005 < np.mean(opacity > 0.0) < 0.5
        assert len(np.unique(np.round(opacity[opacity > 0.0], 2))) > 5
        assert opacity.max() == 1.0


def test_no_empty_stripes_between_evenly_spaced_points(diagram):
    (axes,) = drawn(diagram, point_limit=0, dpi=300).axes
    opacity = axes.images[0].get_array()[..., 3]
    assert opacity.shape[1] == 200
    assert np.all(opacity.max(axis=0) > 0.0)
    left, right, _, _ = axes.images[0].get_extent()
    assert (left, right) == pytest.approx((1000.0 - 800.0 / 199, 2600.0 + 800.0 / 199))


def test_memory_does_not_grow_with_the_points(tmp_path):
    path = tmp_path / "large.h5"
    write_sweep(path, np.linspace(0.0, 1.0, 2000), {"d": ([np.empty(0)] * 2000, [np.empty(0)] * 2000)})
    each, total = 4000, 8_000_000
    with h5py.File(path, "r+") as file:
        group = file["extrema/d"]
        for name in ("offset", "value", "kind", "time"):
            del group[name]
        group["offset"] = np.arange(0, total + 1, each)
        group.create_dataset("value", data=np.sin(np.arange(total)))
        group.create_dataset("kind", data=np.ones(total, dtype=np.int8))
    drawn(path, stop=0.01)
    tracemalloc.start()
    drawn(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 * total


def test_observables_one_above_the_other(tmp_path):
    speed = np.linspace(1000.0, 1490.0, 50)
    names = ("a", "b", "c", "d")
    path = write_sweep(tmp_path / "case.h5", speed, {name: ragged(50, seed) for seed, name in enumerate(names)})
    with pytest.warns(PlotNote, match="drawing a, b, c; choose others with --observable: d"):
        figure = drawn(path)
    assert [axes.get_ylabel() for axes in figure.axes] == ["a (µm)", "b (µm)", "c (µm)"]
    figure = drawn(path, observables=("d", "b"))
    assert [axes.get_ylabel() for axes in figure.axes] == ["d (µm)", "b (µm)"]


def test_two_parameters_are_refused(sweep):
    with h5py.File(sweep, "r+") as file:
        file["axis/load"] = np.ones(1)
    with pytest.raises(ResultError, match=r"sweeps over load and rotation\.speed_rpm"):
        drawn(sweep, kind="bifurcation")


@pytest.mark.parametrize(("start", "stop", "words"), [(2e3, None, "from 2000 on"), (1101.0, 1109.0, "between")])
def test_empty_range(sweep, start, stop, words):
    with pytest.raises(ResultError, match=rf"no point of rotation\.speed_rpm {words}.*1000 to 1490"):
        drawn(sweep, start=start, stop=stop)


def both_ways(path, points=40):
    """Turn a sweep of 2n points into one of n parameters, up and down."""
    with h5py.File(path, "r+") as file:
        name = "rotation.speed_rpm"
        speed = file[f"axis/{name}"][: points // 2]
        del file[f"axis/{name}"], file[f"point/{name}"]
        file[f"axis/{name}"] = speed
        file[f"point/{name}"] = np.tile(speed, 2)
        for item in (file[f"axis/{name}"], file[f"point/{name}"]):
            item.attrs.update({"units": "rpm", "long_name": name})
        file["point/direction"] = np.repeat(np.array([1, -1], dtype=np.int8), points // 2)
    return path


@pytest.mark.parametrize("limit", [10**6, 0])
def test_both_ways_stand_in_one_picture(tmp_path, limit):
    values, kinds = ragged(40)
    speed = np.linspace(1000.0, 1390.0, 40)
    path = both_ways(write_sweep(tmp_path / "both.h5", speed, {"mesh_deformation": (values, kinds)}))
    figure = drawn(path, point_limit=limit)
    (axes,) = figure.axes
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["upwards", "downwards"]
    if limit == 0:
        return
    for label, half in (("upwards", slice(0, 20)), ("downwards", slice(20, 40))):
        x, y = line(axes, label)
        np.testing.assert_array_equal(x, np.repeat(speed[:20], [len(point) for point in values[half]]))
        np.testing.assert_allclose(y, 1e6 * np.concatenate(values[half]))


def test_band_of_periods_has_both_ways(tmp_path):
    values, kinds = ragged(40)
    path = both_ways(write_sweep(tmp_path / "both.h5", np.arange(40.0), {"mesh_deformation": (values, kinds)}))
    with h5py.File(path, "r+") as file:
        file["point/period"] = np.repeat([1, 2], 20).astype(np.int32)
    _, band = drawn(path).axes
    assert band.get_ylabel() == "period up\nperiod down"
    stripes = {mesh.get_coordinates()[0, 0, 1]: mesh.get_array().tolist() for mesh in band.collections}
    assert stripes == {1.0: [[0] * 20], 0.0: [[1] * 20]}


def test_directions_of_wrong_number_are_refused(tmp_path):
    values, kinds = ragged(40)
    path = both_ways(write_sweep(tmp_path / "both.h5", np.arange(40.0), {"mesh_deformation": (values, kinds)}))
    with h5py.File(path, "r+") as file:
        del file["point/direction"]
        file["point/direction"] = np.ones(7, dtype=np.int8)
    with pytest.raises(ResultError, match="point/direction"):
        drawn(path)
