"""Files of razy-follow: what is read, and which curve stands where in the picture."""

import csv
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.text import Text
from pictures import drawn, line
from samples import ragged, write_sweep

from razy.plot import PlotNote
from razy.plot.cli import main
from razy.read import FollowResult, ResultError, open_result
from razy.tools.cli import csv_main


def test_read(follow):
    with open_result(follow) as result:
        assert isinstance(result, FollowResult)
        assert result.parameters == ("load.frequency",)
        assert result.parameter().units == "Hz"
        assert (result.n_points, result.observables) == (186, ("displacement",))
        assert result.multiplier.shape == (186, 2)
        assert result.largest_multiplier[30] == 1.0
        assert result.special.label.tolist() == ["GR", "LP", "LP", "PD", "EP", "EP"]
        assert result.special.contact.tolist() == ["stop", "", "", "", "", ""]
        np.testing.assert_allclose(result.special.parameter[1:3], [8.0, 12.0])
        assert np.flatnonzero(result.labels == "PD").tolist() == [150]
        assert result.endings == ("the end of the range", "the most points")
        assert result.parents.tolist() == [0, 1]
        assert result.extrema("displacement").point(185).value == pytest.approx([6.9e-3, -5.9e-3, 5.9e-3, -6.9e-3])


def test_curves_are_full_where_stable_and_dashed_elsewhere(follow):
    (axes,) = drawn(follow).axes
    x, y = line(axes, "period 1, unstable")
    inner = np.abs(np.abs(y) - 5.0) <= 1.0 + 1e-9
    assert np.all(inner | (np.abs(y) >= 6.4 - 1e-9) | np.isnan(y))
    x, y = line(axes, "period 1, stable")
    a = np.abs(y[np.isfinite(y)]) - 5.0
    assert np.all((np.abs(a) >= 1.0 - 1e-9) & (a <= 1.4 + 1e-9))
    np.testing.assert_allclose(x[np.isfinite(x)], 10.0 + 3.0 * a - a**3)
    assert np.count_nonzero(np.isnan(x)) == 3  # Four pieces: below and above the folds, of maxima and of minima.
    x, y = line(axes, "period 2, stable")
    at = np.flatnonzero(x == x[-1])
    assert sorted(y[at]) == pytest.approx([-6.9, -5.9, 5.9, 6.9])
    assert axes.get_ylabel() == "displacement of block (mm)"
    assert axes.get_xlabel() == "frequency of the load (Hz)"
    dashes = {item.get_label(): item.get_linestyle() for item in axes.get_lines()}
    assert dashes["period 1, stable"] == "-" and dashes["period 1, unstable"] == "--"


def test_what_is_undecided_is_drawn_apart(follow):
    with h5py.File(follow, "r+") as file:
        file["point/stable"][100:120] = -1
    (axes,) = drawn(follow).axes
    _, y = line(axes, "period 1, undecided")
    assert np.nanmax(np.abs(y)) < 6.0 and np.isfinite(y).sum() >= 40
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend[:4] == ["period 1", "period 2", "unstable", "undecided"]


def test_each_extremum_has_a_curve_of_its_own(follow):
    """No curve steps from one maximum to another where two motions have theirs in another order."""
    with h5py.File(follow, "r+") as file:
        offset = file["extrema/displacement/offset"][()]
        for name in ("value", "time"):
            data = file[f"extrema/displacement/{name}"][()]
            for point in range(161, 186, 2):
                part = slice(offset[point], offset[point + 1])
                data[part] = np.roll(data[part], 2)
            file[f"extrema/displacement/{name}"][...] = data
    _, y = line(drawn(follow).axes[0], "period 2, stable")
    steps = np.diff(y)
    assert np.count_nonzero(np.isnan(y)) == 3
    assert np.abs(steps[np.isfinite(steps)]).max() == pytest.approx(0.02)


def test_an_extremum_that_appears_or_is_far_off_begins_a_curve(follow):
    with h5py.File(follow, "r+") as file:
        group = file["extrema/displacement"]
        last = int(group["offset"][185])
        for name, more in (("value", [1e-3, -1e-3]), ("time", [0.031, 0.032]), ("kind", [1, -1])):
            data = np.append(group[name][()], more)
            del group[name]
            group[name] = data
        group["value"].attrs["units"] = "m"
        group["offset"][186] = last + 6
        group["value"][int(group["offset"][184]) + 2] = 0.5e-3
    _, y = line(drawn(follow).axes[0], "period 2, stable")
    assert np.nanmax(np.abs(np.diff(y))) < 0.03


def test_special_points_are_marked_and_labelled(follow):
    (axes,) = drawn(follow).axes
    x, y = line(axes, "LP")
    np.testing.assert_allclose(sorted(zip(x, y, strict=True)), [(8.0, 4.0), (12.0, 6.0)])
    np.testing.assert_allclose(line(axes, "PD"), [[11.456], [6.4]])
    np.testing.assert_allclose(line(axes, "GR"), [[10.0 - 3 * 1.3 + 1.3**3], [3.7]])
    assert sorted(text.get_text() for text in axes.texts) == ["LP 12", "LP 8", "PD 11.456"]
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend == ["period 1", "period 2", "unstable", "LP fold", "PD period doubling", "GR grazing"]


def test_no_labels_where_there_are_too_many(follow):
    with h5py.File(follow, "r+") as file:
        at = np.arange(0, 161, 2, dtype=np.int32)
        for name, data in (
            ("label", ["LP"] * at.size),
            ("parameter", file["point/load.frequency"][()][at]),
            ("branch", np.ones(at.size, dtype=np.int32)),
            ("point", at),
            ("contact", [""] * at.size),
        ):
            del file[f"special/{name}"]
            file[f"special/{name}"] = data
    with pytest.warns(PlotNote, match=r"no room for the labels of \d+ points"):
        (axes,) = drawn(follow).axes
    assert len(axes.texts) == 0 and line(axes, "LP")[0].size == at.size


def test_exponents_stand_beneath_all_motions(follow):
    parameter, exponent = np.array([8.0, 9.0, 12.0]), np.array([-1.0, 2.0, -0.5])
    with h5py.File(follow, "r+") as file:
        file["sample/load.frequency"], file["sample/lyapunov"] = parameter, exponent
        file["sample/unsettled"] = np.zeros(3, dtype=np.int32)
        file["basin/sample"] = np.array([0, 2, 2], dtype=np.int32)
        file["basin/branch"] = np.array([1, 1, 2], dtype=np.int32)
        file["basin/starts"] = np.array([9, 4, 5], dtype=np.int32)
    with open_result(follow) as result:
        samples = result.samples
        assert samples.starts.tolist() == [9, 4, 5] and samples.sample.tolist() == [0, 2, 2]
    _, below = drawn(follow).axes
    np.testing.assert_allclose(line(below, "Lyapunov exponent 1"), [parameter, exponent])


def test_labels_do_not_overlap(follow):
    with h5py.File(follow, "r+") as file:
        at = np.arange(0, 161, 6, dtype=np.int32)
        p = file["point/load.frequency"][()]
        for name, data in (
            ("label", ["LP"] * at.size),
            ("parameter", p[at]),
            ("branch", np.ones(at.size, dtype=np.int32)),
            ("point", at),
            ("contact", [""] * at.size),
        ):
            del file[f"special/{name}"]
            file[f"special/{name}"] = data
    with pytest.warns(PlotNote, match=r"no room for the labels of \d+ points; --from and --to"):
        figure = drawn(follow, size=(8.0, 6.0))
    (axes,) = figure.axes
    figure.draw_without_rendering()
    boxes = [Text.get_window_extent(text).shrunk(0.98, 0.7) for text in axes.texts]
    assert 5 < len(boxes) < at.size
    assert {text.get_text() for text in axes.texts} == {"LP"}
    assert not any(box.overlaps(other) for i, box in enumerate(boxes) for other in boxes[:i])
    frame = axes.get_window_extent()
    assert all(frame.x0 < box.x0 and box.x1 < frame.x1 and frame.y0 < box.y0 and box.y1 < frame.y1 for box in boxes)


def test_shared_points_are_marked_once(follow):
    with h5py.File(follow, "r+") as file:
        file["special/label"][4] = "LP"
        file["special/point"][4] = 30
    assert line(drawn(follow).axes[0], "LP")[0].size == 2


@pytest.mark.parametrize(("quantity", "wanted"), [("largest", 6.9), ("smallest", -6.9), ("multiplier", 0.5)])
def test_quantities(follow, quantity, wanted):
    (axes,) = drawn(follow, quantity=quantity).axes
    x, y = line(axes, "period 2, stable")
    assert (x.size, y[-1]) == (25, pytest.approx(wanted))
    label = "largest |multiplier|" if quantity == "multiplier" else f"{quantity} displacement of block (mm)"
    assert axes.get_ylabel() == label


def test_without_extrema_multipliers_are_drawn(follow):
    with h5py.File(follow, "r+") as file:
        del file["extrema"]
    assert drawn(follow).axes[0].get_ylabel() == "largest |multiplier|"
    with pytest.raises(ResultError, match="holds no extrema: &record what='extrema' asks for them"):
        drawn(follow, quantity="largest")


def test_range(follow):
    (axes,) = drawn(follow, start=7.9, stop=9.0).axes
    assert axes.get_xlim() == pytest.approx((7.99, 9.01))
    assert [text.get_text() for text in axes.texts] == ["LP 8"]
    with pytest.raises(ResultError, match=r"no motion of load.frequency from 20 on \(the file has 8 to 12"):
        drawn(follow, start=20.0)


def swept(path, name="load.frequency"):
    write_sweep(path, np.linspace(7.0, 13.0, 50), {"displacement": ragged(50)})
    with h5py.File(path, "r+") as file:
        for group in ("axis", "point"):
            file.move(f"{group}/rotation.speed_rpm", f"{group}/{name}")
    return path


def test_points_of_a_sweep_below(tmp_path, follow):
    with open_result(swept(tmp_path / "sweep.h5")) as sweep:
        (axes,) = drawn(follow, sweep=sweep, start=8.0).axes
        table = sweep.table("displacement")
        x, y = line(axes, "sweep")
        low, high = axes.get_xlim()
        keep = (table.parameter >= low) & (table.parameter <= high)
        np.testing.assert_allclose(x, table.parameter[keep])
        np.testing.assert_allclose(y, 1e3 * table.value[keep])
        (axes,) = drawn(follow, sweep=sweep, quantity="largest").axes
        x, y = line(axes, "sweep")
        low, high = axes.get_xlim()
        assert x.size == np.unique(table.parameter[(table.parameter >= low) & (table.parameter <= high)]).size
        assert y[0] == pytest.approx(1e3 * table.value[table.parameter == x[0]].max())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{follow}", "{other}"], "sweeps over load.value; the branches of {follow} are over load.frequency"),
        (["{other}", "{follow}"], "sweeps over load.value; the branches of {follow} are over load.frequency"),
        (["{follow}", "{follow}"], "a file of razy-follow; beside branches goes one of razy-sweep"),
        (["{sweep}", "{sweep}", "--quantity", "largest"], "--quantity goes with branches of razy-follow alone"),
        (["{sweep}", "--quantity", "largest"], "--quantity goes with branches of razy-follow alone"),
        (["{follow}", "--quantity", "size"], "invalid choice"),
        (["{follow}", "{sweep}", "--quantity", "multiplier"], "multipliers belong to no observable"),
        (["{follow}", "--coordinate", "block"], "no coordinates"),
        (["{follow}", "--observable", "force"], "no observable 'force'"),
        (
            ["{follow}", "--kind", "map"],
            "no map picture of a file of razy-follow (has: branches, curves, sensitivity, machine, law)",
        ),
    ],
)
def test_what_does_not_fit_is_one_line(tmp_path, follow, capsys, arguments, message):
    places = {"follow": follow, "sweep": swept(tmp_path / "s.h5"), "other": swept(tmp_path / "o.h5", "load.value")}
    words = [word.format(**places) for word in arguments]
    try:
        code = main([*words, "--save", str(tmp_path / "p.png")])
    except SystemExit as stop:
        code = stop.code
    said = capsys.readouterr().err
    assert code == 2
    assert said.count("\n") == 1 and message.format(**places) in said


def test_damaged_files(follow):
    with h5py.File(follow, "r+") as file:
        file["special/point"][0] = 186
    with pytest.raises(ResultError, match="names motions that are not there"):
        drawn(follow)
    with h5py.File(follow, "r+") as file:
        file["special/point"][0] = 0
        del file["point/multiplier"]
        file["point/multiplier"] = np.zeros(186)
    with pytest.raises(ResultError, match=r"shape \(186,\), expected \(186, 2, multipliers\)"):
        drawn(follow)


def test_csv(follow, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert csv_main([str(follow)]) == 0
    with Path("follow.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 186
    assert (rows[150]["label"], rows[150]["load.frequency [Hz]"][:6]) == ("PD", "11.456")
    assert (rows[185]["multiplicity"], rows[185]["branch"], rows[185]["stable"]) == ("2", "2", "1")
    assert csv_main([str(follow), "--observable", "displacement", "--output", "e.csv"]) == 0
    with Path("e.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) == 2 * 161 + 4 * 25
