"""Pictures of one motion: time histories, events, phase paths, and their forms for very many samples."""

import h5py
import numpy as np
import pytest
from pictures import drawn, inside, near
from samples import write_run

from razy.plot import PlotNote
from razy.plot.options import PlotOptions
from razy.plot.signals import signals
from razy.read import ResultError, open_result


def curve(axes):
    longest = max(axes.get_lines(), key=lambda item: len(item.get_xdata()))
    return np.asarray(longest.get_xdata()), np.asarray(longest.get_ydata())


def test_overview(run):
    history, phase = drawn(run).axes
    time = np.linspace(0.0, 0.25, 2000)
    x, y = curve(history)
    np.testing.assert_allclose(x, time)
    np.testing.assert_allclose(y, np.sin(100 * time), atol=1e-12)
    assert history.get_ylabel() == "mesh deformation (mm)"
    value, rate = curve(phase)
    np.testing.assert_allclose(value, np.sin(100 * time), atol=1e-12)
    np.testing.assert_allclose(rate[1:-1], 0.1 * np.cos(100 * time)[1:-1], atol=1e-5)
    assert phase.get_ylabel() == "rate of mesh deformation (m/s)"


def test_events_are_marked_on_the_curve(run):
    (history,) = drawn(run, kind="time").axes
    marks = {item.get_label(): item for item in history.get_lines() if item.get_label().startswith("mesh")}
    opened, closed = marks["mesh: open"], marks["mesh: closed (upper side)"]
    np.testing.assert_allclose(opened.get_xdata(), np.pi / 100 * np.array([1, 3, 5, 7]))
    np.testing.assert_allclose(closed.get_xdata(), np.pi / 100 * np.array([2, 4, 6]))
    np.testing.assert_allclose(opened.get_ydata(), 0.0, atol=1e-4)
    assert opened.get_markerfacecolor() == "white"
    (history,) = drawn(run, kind="time", start=0.05, stop=0.08).axes
    assert [item.get_label() for item in history.get_lines()][1:] == ["mesh: closed (upper side)"]


def test_branches_differ_in_shape(run):
    with h5py.File(run, "r+") as file:
        file["event/contact"][:] = [1, 1, 2, 2, 2, 2, 2]
        file["event/contact"].attrs["names"] = ["stop", "pad"]
        file["event/state"][:] = [2, 1, 1, 3, 2, 3, 1]
        friction = "1 = sliding forward, 2 = sliding backward, 3 = sticking"
        file["event/state"].attrs["meanings"] = ["1 = open, 2 = closed (upper side)", friction]
    (history,) = drawn(run, kind="time").axes
    looks = {
        item.get_label(): (item.get_color(), item.get_marker(), item.get_markerfacecolor() == "white")
        for item in history.get_lines()[1:]
    }
    assert set(looks) == {
        "stop: open",
        "stop: closed (upper side)",
        "pad: sliding forward",
        "pad: sliding backward",
        "pad: sticking",
    }
    assert len(set(looks.values())) == 5
    assert len({look[0] for look in looks.values()}) == 2
    assert [label for label, look in looks.items() if look[2]] == ["stop: open"]


def test_impacts_of_a_rigid_stop(run):
    with h5py.File(run, "r+") as file:
        file["event/state"][:] = [1, 1, 1, 1, 1, 2, 1]
    (history,) = drawn(run, kind="time").axes
    labels = [item.get_label() for item in history.get_lines()[1:]]
    assert labels == ["mesh: impact or lift-off", "mesh: closed (upper side)"]


def test_very_many_events_become_ticks(run):
    with h5py.File(run, "r+") as file:
        del file["event"]
        file["event/time"] = np.linspace(0.0, 0.25, 500)
    (history,) = drawn(run, kind="time").axes
    (ticks,) = [item for item in history.get_lines() if item.get_marker() == "|"]
    assert len(ticks.get_xdata()) == 500
    assert ticks.get_label() == "event"


def test_coordinates_against_their_velocity(run):
    (axes,) = drawn(run, kind="phase", coordinates=("y",)).axes
    time = np.linspace(0.0, 0.25, 2000)
    value, rate = curve(axes)
    np.testing.assert_allclose(value, 2 * np.cos(100 * time), atol=1e-12)
    np.testing.assert_allclose(rate, -0.2 * np.sin(100 * time), atol=1e-12)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("displacement of y (mm)", "velocity of y (m/s)")


def test_force_over_deformation(run):
    with h5py.File(run, "r+") as file:
        force = np.linspace(0.0, 5.0, 2000)
        file["observable/contact_force"] = force
        file["observable/contact_force"].attrs["units"] = "N"
        file["observable/contact_force"].attrs["long_name"] = "contact force"
    (axes,) = drawn(run, kind="loop").axes
    over, drawn_force = curve(axes)
    np.testing.assert_allclose(over, np.sin(100 * np.linspace(0.0, 0.25, 2000)), atol=1e-12)
    np.testing.assert_allclose(drawn_force, force)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("mesh deformation (mm)", "contact force (N)")
    (axes,) = drawn(run, kind="loop", observables=("contact_force", "mesh_deformation")).axes
    np.testing.assert_allclose(curve(axes)[0], force)
    with pytest.raises(ResultError, match="two observables"):
        drawn(run, kind="loop", observables=("contact_force",))


def test_a_force_jumps_at_events(run):
    """Its events are marked at the lower edge; beside it stands no rate but the force over the deformation."""
    with h5py.File(run, "r+") as file:
        file["observable/contact_force"] = np.linspace(0.0, 5.0, 2000)
        file["observable/contact_force"].attrs.update({"units": "N", "long_name": "contact force"})
    axes = {item.get_ylabel(): item for item in drawn(run, observables=("mesh_deformation", "contact_force")).axes}
    assert set(axes) == {"mesh deformation (mm)", "rate of mesh deformation (m/s)", "contact force (N)"}
    history, path = [item for item in drawn(run).axes if item.get_ylabel() == "contact force (N)"]
    assert path.get_xlabel() == "mesh deformation (mm)"
    marks = [item for item in history.get_lines() if item.get_label().startswith("mesh")]
    assert len(marks) == 2
    assert all(np.all(item.get_ydata() == 0.03) and item.get_marker() != "|" for item in marks)
    assert [item.get_xlabel() for item in drawn(run, kind="phase").axes] == ["mesh deformation (mm)"]


def test_coordinates_where_there_are_no_observables(tmp_path):
    figure = drawn(write_run(tmp_path / "run.h5", observable=False), kind="time")
    assert [axes.get_ylabel() for axes in figure.axes] == ["displacement of x (mm)", "displacement of y (mm)"]


def test_at_most_four_signals_unless_asked(run):
    with h5py.File(run, "r+") as file:
        for number in range(2, 7):
            file[f"observable/o{number}"] = np.arange(2000.0)
    with pytest.warns(PlotNote, match="choose others with --observable: o5, o6"):
        assert len(drawn(run, kind="time").axes) == 4
    assert len(drawn(run, kind="phase", observables=("o2", "o3", "o4", "o5", "o6")).axes) == 5


def test_rate_by_differences_with_times_stored_twice(run):
    time = np.sort(np.concatenate((np.linspace(0.0, 1.0, 500) ** 1.2, [0.3, 0.3, 0.7, 0.7])))
    with h5py.File(run, "r+") as file:
        for name in ("time", "observable", "state"):
            del file[name]
        file["time"], file["observable/o"] = time, np.where(time < 0.5, time**2, 0.25 - (time - 0.5))
    with open_result(run) as result:
        (signal,) = signals(result, PlotOptions(), 4)
        ((value, rate),) = signal.path(time, slice(0, time.size))
    assert value.size == time.size - 2
    at = np.unique(time)
    exact = np.where(at < 0.5, 2 * at, -1.0)
    smooth = (np.abs(at - 0.5) > 0.01) & (at > 0.01) & (at < 0.99)
    np.testing.assert_allclose(rate[smooth], exact[smooth], atol=1e-9)


def test_parts_join_without_seams(run, monkeypatch):
    with open_result(run) as result:
        time = result.time
        (signal,) = signals(result, PlotOptions(), 4)
        whole = [np.concatenate(parts) for parts in zip(*signal.path(time, slice(0, 2000)), strict=True)]
        monkeypatch.setattr("razy.plot.signals.CHUNK_TIMES", 7)
        parts = [np.concatenate(parts) for parts in zip(*signal.path(time, slice(0, 2000)), strict=True)]
    np.testing.assert_array_equal(whole[0], parts[0])
    np.testing.assert_allclose(whole[1], parts[1], rtol=1e-12, atol=1e-15)


def test_many_samples_look_like_few(run):
    few, many = drawn(run), drawn(run, point_limit=100)
    history, phase = many.axes
    assert len(history.collections) == 1
    assert len(phase.images) == 1
    for left, right in zip(few.axes, many.axes, strict=True):
        assert left.get_xlim() == right.get_xlim()
        assert left.get_ylim() == right.get_ylim()
    for old, new in zip(few.axes, many.axes, strict=True):
        a, b = inside(few, old).min(axis=2) < 200, inside(many, new).min(axis=2) < 200
        assert np.count_nonzero(b) > 0.3 * np.count_nonzero(a)
        assert np.count_nonzero(b & ~near(a)) <= 0.02 * np.count_nonzero(b)


@pytest.mark.parametrize("sample", range(777, 783))
def test_envelope_keeps_a_spike_of_one_sample(run, sample):
    with h5py.File(run, "r+") as file:
        file["observable/mesh_deformation"][sample] = 0.05
        time = file["time"][sample]
    (history,) = drawn(run, kind="time", point_limit=100).axes
    vertices = history.collections[0].get_paths()[0].vertices
    top = vertices[np.argmax(vertices[:, 1])]
    assert top[1] == pytest.approx(50.0)
    assert top[0] == pytest.approx(time, abs=0.25 / 300)


def test_motion_without_trajectory(tmp_path):
    path = write_run(tmp_path / "run.h5", trajectory=False)
    (axes,) = drawn(path).axes
    points = {item.get_label(): item for item in axes.get_lines()}
    np.testing.assert_allclose(points["maxima"].get_ydata(), 1.0)
    assert len(points["minima"].get_xdata()) == 4
    (axes,) = drawn(path, stop=0.1).axes
    assert len(axes.get_lines()[0].get_xdata()) == 2
    with pytest.raises(ResultError, match="missing dataset '/time'"):
        drawn(path, kind="phase")
    with pytest.raises(ResultError, match="no coordinates"):
        drawn(path, coordinates=("x",))


def test_unknown_names_and_empty_window(run):
    with pytest.raises(ResultError, match="no observable 'mesh_defrmation'; did you mean 'mesh_deformation'"):
        drawn(run, observables=("mesh_defrmation",))
    with pytest.raises(ResultError, match=r"no coordinate 'z' \(the file has: x, y\)"):
        drawn(run, coordinates=("z",))
    with pytest.raises(ResultError, match=r"from 3 on \(the file has 0 to 0\.25 s\)"):
        drawn(run, start=3.0)
    with pytest.raises(ResultError, match="no bifurcation picture of a file of razy-run"):
        drawn(run, kind="bifurcation")


def test_signal_without_finite_values(run):
    with h5py.File(run, "r+") as file:
        file["observable/mesh_deformation"][...] = np.nan
    with pytest.raises(ResultError, match="no finite value"):
        drawn(run)


def test_legend_without_title_is_within_the_picture(run):
    figure = drawn(run, "time", title="")
    figure.draw_without_rendering()
    legend = figure.axes[0].get_legend().get_window_extent()
    assert legend.y0 >= 0.0 and legend.y1 <= figure.bbox.height
