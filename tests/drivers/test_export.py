"""razy-export: results for MATLAB, ParaView and as animations, read back by programs of others."""

import re
import subprocess
import sys
from pathlib import Path
from resource import RLIMIT_FSIZE, setrlimit

import numpy as np
import pytest
from PIL import Image
from programs import GEAR_PAIR, SOURCE, TWO_SIDED_STOP, sets, succeed

sys.path.insert(0, str(SOURCE / "post" / "src"))

import razy
from razy.tools.cli import export_main

ROTOR = SOURCE / "inputs" / "rotor_rub.nml"


def code(*arguments):
    try:
        return export_main([str(word) for word in arguments])
    except SystemExit as stop:
        return int(stop.code)


def modes():
    succeed("razy-modes", ROTOR, "--output", "rotor.h5")
    return razy.open("rotor.h5")


def motion():
    text = re.sub(r"(?m)^&(record|sweep|motion|reduction)\b.*$", "", ROTOR.read_text())
    text += "&motion t_end=0.02, start='zero', integrator='dop853' /\n"
    text += "&record observable='state', what='trajectory', interval=1e-3 /\n"
    Path("motion.nml").write_text(text)
    succeed("razy-run", "motion.nml")
    return razy.open("motion.h5")


def test_matlab_reads_a_sweep():
    mat73 = pytest.importorskip("mat73")
    succeed("razy-sweep", GEAR_PAIR, "--output", "gear.h5", *sets(sweep__step=400.0))
    assert code("gear.h5", "--output", "gear.mat") == 0
    raw = Path("gear.mat").read_bytes()
    assert raw.startswith(b"MATLAB 7.3 MAT-file") and raw[124:128] == b"\x00\x02IM" and raw[512:516] == b"\x89HDF"
    found, data = mat73.loadmat("gear.mat"), razy.open("gear.h5")
    np.testing.assert_array_equal(found["axis"]["rotation_speed_rpm"], [1000.0, 1400.0, 1800.0, 2200.0, 2600.0])
    np.testing.assert_array_equal(found["extrema"]["mesh_deformation"]["value"], data.mesh_deformation)
    assert found["extrema"]["mesh_deformation"]["offset"].dtype == np.int64
    assert found["units"]["extrema"]["mesh_deformation"] == {"time": "s", "value": "m"}
    assert data.razy.export("again.mat").read_bytes() == raw
    with pytest.raises(razy.Error, match=r"again\.mat: exists already"):
        data.razy.export("again.mat")
    assert found["about"]["program"] == "razy-sweep" and found["about"]["input"] == data.input


def test_matlab_reads_shapes_texts_and_what_is_empty():
    mat73 = pytest.importorskip("mat73")
    data = modes()
    assert code("rotor.h5", "--output", "rotor.mat") == 0
    found = mat73.loadmat("rotor.mat")
    assert found["shape"].shape == data["shape"].shape
    np.testing.assert_array_equal(found["shape"], data["shape"])
    assert np.ravel(found["coordinate"]).tolist() == data.coordinate.values.tolist()
    succeed("razy-run", TWO_SIDED_STOP, "--output", "short.h5", *sets(motion__t_end=1e-5))
    assert code("short.h5", "--output", "short.mat") == 0
    assert mat73.loadmat("short.mat")["event"]["time"] is None


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".xdmf"])
def test_shapes_in_space(suffix):
    meshio = pytest.importorskip("meshio")
    data = modes()
    assert code("rotor.h5", "--output", f"rotor{suffix}") == 0
    found = meshio.read(f"rotor{suffix}")
    assert len(found.point_data) == data.sizes["mode"]
    name = next(name for name in found.point_data if name.startswith("mode_2_"))
    assert name == f"mode_2_{float(data.natural_frequency[1]):.3f}_Hz"
    values = dict(zip(data.coordinate.values, data["shape"].values[1], strict=True))
    nodes = sorted({int(c.split(".")[1]) for c in values})
    expected = [[values.get(f"rotor.{node}.{way}", 0.0) for way in "uvw"] for node in nodes]
    shown = found.point_data[name]
    np.testing.assert_allclose(shown[: len(nodes)], expected, atol=1e-12)
    assert np.all(np.diff(found.points[: len(nodes), 0]) > 0.0)
    assert sorted(p.suffix for p in Path().iterdir()) == sorted([".h5", suffix])


def test_a_motion_over_time():
    meshio = pytest.importorskip("meshio")
    data = motion()
    assert code("motion.h5", "--output", "motion.xdmf") == 0
    with meshio.xdmf.TimeSeriesReader("motion.xdmf") as reader:
        reader.read_points_cells()
        assert reader.num_steps == data.sizes["time"]
        time, points, _ = reader.read_data(7)
    assert time == pytest.approx(float(data.time[7]))
    assert np.abs(points["displacement"]).max() == pytest.approx(
        float(np.abs(data.displacement.sel(coordinate=[c for c in data.coordinate.values if c[-1] in "uvw"])[7]).max())
    )
    assert code("motion.h5", "--output", "motion.vtk") == 2


def test_a_motion_of_reduced_coordinates_has_no_shape(capsys):
    motion()
    text = Path("motion.nml").read_text() + re.search(r"(?m)^&reduction\b.*$", ROTOR.read_text())[0] + "\n"
    Path("reduced.nml").write_text(text)
    succeed("razy-run", "reduced.nml")
    for target in ("motion.gif", "motion.xdmf"):
        assert code("reduced.h5", "--output", target) == 2
        assert "compute it without &reduction" in capsys.readouterr().err


def test_animations():
    modes()
    assert code("rotor.h5", "--output", "mode.gif", "--mode", 2) == 0
    with Image.open("mode.gif") as picture:
        assert picture.n_frames == 36
        first = np.asarray(picture.convert("L"), dtype=float)
        picture.seek(18)
        assert np.abs(np.asarray(picture.convert("L"), dtype=float) - first).mean() > 0.5
    motion()
    assert code("motion.h5", "--output", "motion.html", "--from", 0.01) == 0
    assert len(re.findall(r"data:image/png", Path("motion.html").read_text())) == 11


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["rotor.h5", "--output", "a.stl"], "a.stl: unknown kind of file '.stl' (can: .mat, .vtk, "),
        (["rotor.h5", "--output", "a.gif", "--mode", "99"], "rotor.h5: no mode 99 (has 1 to "),
        (["rotor.h5", "--output", "no/a.mat"], "no/a.mat: no folder 'no'"),
        (["rotor.h5", "--output", "rotor.h5"], "rotor.h5: is the file that is read"),
        (["gear.h5", "--output", "a.vtk"], "gear.h5: there are no shafts with sections"),
        (["none.h5", "--output", "a.mat"], "none.h5: no such file"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(words, line, capsys):
    modes()
    succeed("razy-modes", GEAR_PAIR, "--output", "gear.h5")
    assert code(*words) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"razy-export: error: {line}") and said.count("\n") == 1
    assert not list(Path().glob(".*"))


@pytest.mark.parametrize("size", [100, 600, 4000, 20000])
def test_a_full_disk_is_one_line_and_leaves_nothing(size):
    succeed("razy-run", TWO_SIDED_STOP, "--output", "stop.h5")
    Path("stop.mat").write_text("older")
    words = f"import sys; sys.path.insert(0, {str(SOURCE / 'post' / 'src')!r})\n"
    words += "from razy.tools.cli import export_main; sys.exit(export_main(sys.argv[1:]))"
    command = [sys.executable, "-c", words, "stop.h5", "--output", "stop.mat", "--force"]
    done = subprocess.run(
        command, capture_output=True, text=True, preexec_fn=lambda: setrlimit(RLIMIT_FSIZE, (size, size))
    )
    assert (done.returncode, done.stderr.splitlines()) == (
        1, ["razy-export: error: stop.mat: File too large"]
    ), done.stderr  # fmt: skip
    assert sorted(path.name for path in Path().iterdir()) == ["stop.h5", "stop.mat"]
    assert Path("stop.mat").read_text() == "older"
