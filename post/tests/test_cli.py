"""The command: exit codes, one-line messages, files left behind, working without a display."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import matplotlib.figure
import numpy as np
import pytest
from matplotlib.image import imread

import razy
from razy.plot.cli import main

SOURCE = Path(razy.__file__).parents[1]


def command(*arguments, **environment):
    """Run the command in a process of its own without a display."""
    inherited = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return subprocess.run(
        [sys.executable, "-m", "razy.plot.cli", *map(str, arguments)],
        env={**inherited, "PYTHONPATH": str(SOURCE), **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def code(*arguments) -> int:
    """Run the command in this process; return its exit code."""
    try:
        return main([str(item) for item in arguments])
    except SystemExit as stop:
        return int(stop.code or 0)


def test_picture_is_saved_and_not_blank(diagram, tmp_path):
    target = tmp_path / "picture.png"
    done = command(diagram, "--save", target)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    picture = imread(target)[..., :3]
    assert picture.shape[1] == pytest.approx(16.0 / 2.54 * 300, abs=1)
    assert 0.005 < np.mean(picture.min(axis=2) < 0.7) < 0.5
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("suffix", "start"), [(".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml"), (".JPG", b"\xff\xd8")]
)
def test_format_follows_the_suffix(diagram, tmp_path, suffix, start):
    target = tmp_path / f"picture{suffix}"
    assert code(diagram, "--save", target) == 0
    assert target.read_bytes().startswith(start)


def test_existing_picture_is_overwritten_if_asked(diagram, tmp_path, capsys):
    target = tmp_path / "picture.png"
    target.write_text("old")
    assert code(diagram, "--save", target) == 2
    assert capsys.readouterr().err == f"razy-plot: error: {target}: exists already; --force overwrites it\n"
    assert target.read_text() == "old"
    assert code(diagram, "--save", target, "--size", "10x6", "--dpi", "100", "--force") == 0
    assert imread(target).shape[:2] == (int(6 / 2.54 * 100), int(10 / 2.54 * 100))


def test_options_reach_the_picture(run, tmp_path, monkeypatch):
    figures = []
    plain = matplotlib.figure.Figure.savefig
    monkeypatch.setattr(
        matplotlib.figure.Figure, "savefig", lambda figure, *a, **k: (figures.append(figure), plain(figure, *a, **k))
    )
    arguments = ["--kind", "time", "--coordinate", "y", "--from", "0.1", "--to", "0.2", "--title", "Mine", "--footer"]
    assert code(run, "--save", tmp_path / "p.svg", *arguments) == 0
    (axes,) = figures[0].axes
    assert axes.get_xlim() == pytest.approx((0.1, 0.2), abs=2e-4)
    assert axes.get_ylabel() == "displacement of y (mm)"
    assert axes.get_title(loc="left") == "Mine"
    assert "run.h5 · razy-run · razy 0.1.0 (0123456789ab)" in figures[0].get_supxlabel()


def test_failure_leaves_the_old_picture_and_nothing_else(diagram, tmp_path, monkeypatch, capsys):
    target = tmp_path / "out" / "picture.png"
    target.parent.mkdir()
    target.write_text("old")

    def broken(name, _content):
        name.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", broken)
    assert code(diagram, "--save", target, "--force") == 1
    assert target.read_text() == "old"
    assert list(target.parent.iterdir()) == [target]
    assert capsys.readouterr().err == f"razy-plot: error: {target}: No space left on device\n"


def bad_file(tmp_path):
    path = tmp_path / "bad.h5"
    path.write_text("not HDF5\n")
    return path


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{bad}", "--save", "{out}.png"], "not an HDF5 file"),
        (["{bad}x", "--save", "{out}.png"], "no such file"),
        (["{good}", "--save", "{out}.xyz"], "unknown kind of picture '.xyz'"),
        (["{good}", "--save", "{out}"], "unknown kind of picture ''"),
        (["{good}", "--save", "{out}/none/p.png"], "no folder"),
        (["{good}", "--save", "{out}.png", "--observable", "mesh"], "no observable 'mesh'"),
        (["{good}", "--save", "{out}.png", "--coordinate", "x"], "no coordinates"),
        (["{good}", "--save", "{out}.png", "--kind", "phase"], "no phase picture"),
        (["{good}", "--save", "{out}.png", "--kind", "guess"], "invalid choice"),
        (["{good}", "--save", "{out}.png", "--from", "x"], "argument --from"),
        (["{good}", "--save", "{out}.png", "--from", "nan"], "not a number"),
        (["{good}", "--save", "{out}.png", "--from", "1e9"], "no point of rotation.speed_rpm"),
        (["{good}", "--save", "{out}.png", "--size", "16"], "not WIDTHxHEIGHT"),
        (["{good}", "--save", "{out}.png", "--size", "1x1"], "3 to 200 cm"),
        (["{good}", "--save", "{out}.png", "--dpi", "0"], "whole number"),
        (["{good}", "--sav", "{out}.png"], "unrecognized arguments"),
        (
            ["{good}", "--save", "{out}.png", "--top", "5"],
            "--top goes with pictures of the kinds campbell, eigenvalues, spectrum",
        ),
        ([], "FILE.h5"),
    ],
)
def test_bad_usage_is_one_line_and_exit_code_2(diagram, tmp_path, capsys, arguments, message):
    places = {"bad": bad_file(tmp_path), "good": diagram, "out": tmp_path / "out"}
    before = sorted(tmp_path.iterdir())
    assert code(*(item.format(**places) for item in arguments)) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("razy-plot: error: ")
    assert said.err.count("\n") == 1
    assert message in said.err
    assert sorted(tmp_path.iterdir()) == before


def test_missing_dataset(diagram, tmp_path):
    with h5py.File(diagram, "r+") as file:
        del file["axis"]
    done = command(diagram, "--save", tmp_path / "p.png")
    assert done.returncode == 2
    assert done.stderr == f"razy-plot: error: {diagram}: missing dataset '/axis/<parameter>'\n"


def test_unexpected_error_is_exit_code_1(diagram, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("razy.plot.cli.draw_files", lambda *_: {}["a\nb"])
    assert code(diagram, "--save", tmp_path / "p.png") == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_without_display_or_save(diagram):
    done = command(diagram)
    assert done.returncode == 2
    assert done.stderr == "razy-plot: error: no display to show the picture on: use --save FILE.png\n"


def test_display_without_toolkit(diagram):
    done = command(diagram, DISPLAY=":99", MPLBACKEND="agg")
    assert done.returncode == 2
    assert "use --save FILE.png" in done.stderr
    assert done.stderr.count("\n") == 1


def test_notes_are_one_line(run, tmp_path, capsys):
    with h5py.File(run, "r+") as file:
        for number in range(5):
            file[f"observable/o{number}"] = np.arange(2000.0)
    assert code(run, "--save", tmp_path / "p.png", "--kind", "time", "--dpi", "50") == 0
    said = capsys.readouterr().err
    assert said.startswith("razy-plot: note: drawing mesh_deformation, o0, o1, o2; choose others")
    assert said.count("\n") == 1


def test_help_and_version():
    done = command("--help")
    assert done.returncode == 0
    for word in ("--save", "--kind", "--observable", "--from", "--to", "--coordinate", "--title", "--dpi", "--size"):
        assert word in done.stdout
    assert command("--version").stdout == f"razy-plot {razy.__version__}\n"
