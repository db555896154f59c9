"""`import razy` with the programs, its tutorials, and the page on it."""

import ast
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray
from matplotlib.text import Text
from programs import BUILD, GEAR_PAIR, SOURCE, TWO_SIDED_STOP

sys.path.insert(0, str(SOURCE / "post" / "src"))

import razy

NOTEBOOKS = sorted((SOURCE / "docs" / "notebooks").glob("*.ipynb"))
BLOCK = {
    "scene": {"kind": "lumped", "title": "it's a block"},
    "mass": {"name": "block", "value": np.float64(2.0)},
    "spring": {"between": ("block", "frame"), "stiffness": 2e4, "damping": 8},
    "load": [{"on": "block", "amplitude": 30.0, "frequency": 14.0}, {"on": "block", "value": np.int64(3)}],
    "motion": {"t_end": 1.0, "start": "zero"},
    "record": {"observable": "displacement", "what": ["trajectory", "extrema"], "interval": 1e-3},
    "modes": {"contacts": "open"},
    "tune": {"parameter": "spring%stiffness", "first": 1e4, "last": 4e4, "frequency": 20.0, "mode": 1},
}


@pytest.fixture(autouse=True)
def programs(monkeypatch):
    monkeypatch.setenv("RAZY_BIN", str(BUILD / "bin"))
    for name in ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_rmaps_base_oversubscribe"):
        monkeypatch.setenv(name, "1")
    monkeypatch.setenv("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")


def execute(code, known):
    """Execute code as a notebook does a cell; return what its last line is, if that is an expression."""
    tree = ast.parse(code)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), known)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), known) if last else None


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(path, monkeypatch):
    monkeypatch.chdir(path.parent)
    known, pictures = {}, 0
    for cell in json.loads(path.read_text())["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None
            shown = execute("".join(cell["source"]), known)
            pictures += hasattr(shown, "_repr_png_") and shown._repr_png_().startswith(b"\x89PNG")
    assert pictures >= 2


def test_page():
    page = (SOURCE / "docs" / "python.md").read_text()
    known = {}
    for name in ("torsional_gear_pair.nml", "rotor_rub.nml"):
        Path(name).symlink_to(SOURCE / "inputs" / name)
    for code in re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL):
        execute(code, known)


def test_case_as_file_text_and_dict(tmp_path):
    file = razy.write_case(BLOCK, "block.nml")
    results = [razy.run(case, progress=False) for case in (file, "block.nml", file.read_text(), BLOCK)]
    for data in results:
        np.testing.assert_array_equal(data.displacement, results[0].displacement)
        assert data.attrs["input"] == results[0].attrs["input"]
        assert data.title == "it's a block"
    assert results[0].displacement.attrs["units"] == "m"
    changed = razy.run(BLOCK, {"load(2)%value": -3.0, "record%what": ["extrema"], "scene%title": "isn't it"})
    assert changed.title == "isn't it" and "displacement" not in changed
    assert [item.name for item in tmp_path.iterdir()] == ["block.nml"]
    with pytest.raises(razy.Error, match=r"block.nml: exists already"):
        razy.write_case(BLOCK, "block.nml")


def test_period_of_the_excitation():
    short = {"motion%t_end": 0.01, "record%from": 0.0}
    assert float(razy.run(GEAR_PAIR, short)["outcome.excitation_period"]) == pytest.approx(1e-3)
    assert float(razy.run(BLOCK, {"load(1)%amplitude": 0.0})["outcome.excitation_period"]) == 0.0


def test_other_programs():
    assert float(razy.modes(BLOCK).natural_frequency[0]) == pytest.approx(100.0 / (2 * np.pi))
    tuned = razy.tune(BLOCK)
    assert float(tuned.optimum) == pytest.approx(2.0 * (40 * np.pi) ** 2, rel=1e-6)
    assert float(razy.open(tuned.source).goal) == 20.0
    assert "tuning" in dir(tuned.razy.plot)


def test_sweep_shows_progress_and_ranks_agree(capsys):
    one = razy.sweep(GEAR_PAIR, {"sweep%step": 100.0}, output="one.h5")
    assert re.search(r"17 of 17 points", capsys.readouterr().err)
    two = razy.sweep(GEAR_PAIR, {"sweep%step": 100.0}, ranks=2, progress=False)
    assert capsys.readouterr().err == ""
    np.testing.assert_array_equal(one.mesh_deformation, two.mesh_deformation)
    with pytest.raises(razy.Error, match=r"one\.h5"):
        razy.sweep(GEAR_PAIR, output="one.h5")
    assert razy.sweep(GEAR_PAIR, {"sweep%step": 200.0}, output="one.h5", force=True).sizes["point"] == 9


@pytest.mark.parametrize("ranks", [None, 2])
def test_mistakes_are_one_line(ranks):
    with pytest.raises(razy.Error) as caught:
        razy.sweep(GEAR_PAIR, {"rotation%sped": 1500}, ranks=ranks)
    assert str(caught.value).startswith("--set: &rotation%sped = 1500: there is no such key; known keys: speed_rpm, ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("case", "line"),
    [
        ("&scene kind='lumped' /\n&mas name='a' /", "case.nml:2: &mas: there is no such group; did you mean 'mass'?"),
        ("none.nml", "none.nml: there is no such file in the current folder"),
        ({"scene": 3}, "group 'scene': a dict of its keys or a list of such, not int"),
        ({"scene": {"kind": None}}, "None: a value is a number, a text, true or false, or a list of such"),
    ],
)
def test_bad_cases(case, line):
    with pytest.raises(razy.Error) as caught:
        razy.run(case)
    assert str(caught.value) == line


def test_program_that_is_not_there(monkeypatch):
    with pytest.raises(razy.Error, match="there is no program razy-run in this folder"):
        razy.run(TWO_SIDED_STOP, programs=".")
    Path("razy-run").touch()
    with pytest.raises(razy.Error, match=r"razy-run: cannot be run: .*Permission denied"):
        razy.run(TWO_SIDED_STOP, programs=".")
    monkeypatch.delenv("RAZY_BIN")
    monkeypatch.setenv("PATH", str(BUILD / "bin"))
    assert razy.run(TWO_SIDED_STOP, progress=False).program == "razy-run"


def test_motion_that_fails():
    with pytest.raises(razy.Error) as caught:
        razy.run(TWO_SIDED_STOP, {"motion%max_events": 1}, progress=False)
    assert "event" in str(caught.value)


class Unspeakable:
    def __repr__(self):
        raise RuntimeError("no words")


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda: razy.run(3), "case=3"),
        (lambda: razy.run(GEAR_PAIR, [1]), r"values=\[1\]"),
        (lambda: razy.run(GEAR_PAIR, outputs="x.h5"), "outputs"),
        (lambda: razy.open(b"x"), "file=b'x'"),
        (lambda: razy.sweep(GEAR_PAIR, ranks=10**9), "ranks=1000000000: a whole number from 1 to"),
        (lambda: razy.sweep(GEAR_PAIR, ranks=-1), "ranks=-1"),
        (lambda: razy.write_case(BLOCK, ""), "is a folder"),
        (lambda: razy.import_ross(None, "x.nml"), "file=None"),
        (lambda: razy.write_case(BLOCK, 5000 * "x"), "File name too long"),
        (lambda: razy.run("\n"), "no such file"),
        (lambda: razy.run(GEAR_PAIR, output="a\0b"), "cannot be run"),
        (lambda: razy.run({"scene": {"kind": "lumped"}, 3: {}}), "case=.*key 3 is"),
        (lambda: razy.run({"scene": {"kind": "lumped", Path("x"): 1}}), "group 'scene'.* key PosixPath"),
        (lambda: razy.run(Unspeakable()), "case=<Unspeakable instance"),
        (lambda: razy.run({"scene": {"kind": Unspeakable()}}), "<Unspeakable instance"),
        (lambda: xarray.Dataset(attrs={"source": 1.5}).razy.plot(), "was not opened by razy.open"),
    ],
)
def test_odd_calls_are_one_line_that_names_the_argument(call, line):
    with pytest.raises(razy.Error, match=line) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_odd_pictures_blame_the_argument_and_names_are_drawn_as_they_are():
    name = "a$b_{"
    odd = {
        "scene": {"kind": "lumped", "title": r"$\frac{1$"},
        "mass": {"name": name, "value": 1.0},
        "spring": {"between": (name, "frame"), "stiffness": 1e4},
        "load": {"on": name, "amplitude": 20.0, "frequency": 12.0},
        "stop": {"name": r"$\undefined{x}$", "between": (name, "frame"), "clearance": 1e-3, "stiffness": 3e4},
        "motion": {"t_end": 1.0, "start": "zero"},
        "record": {"observable": "displacement", "of": name, "what": "trajectory", "interval": 1e-3},
    }
    data = razy.run(odd, progress=False)
    for options in (
        {"dpi": 0},
        {"dpi": "x"},
        {"size": "x"},
        {"size": (1.0, 1e9)},
        {"start": []},
        {"period": float("nan")},
        {"no": 1},
    ):
        with pytest.raises(razy.Error) as caught:
            data.razy.plot(**options)
        assert next(iter(options)) in str(caught.value) and "damaged" not in str(caught.value)
    for kind in ("time", "spectrum", "pattern"):
        figure = data.razy.plot(kind)
        assert figure._repr_png_()
        assert any("a$b" in text.get_text() or "undefined" in text.get_text() for text in figure.findobj(Text))


def test_whatever_was_recorded_is_in_the_dataset(tmp_path):
    """Each dataset of the file is a variable, under its own name, or among those of its observable."""
    case = {
        "scene": {"kind": "lumped"},
        "mass": {"name": "block", "value": 1.0},
        "spring": {"between": ["block", "frame"], "stiffness": 400.0, "damping": 2.0},
        "stop": {"name": "wall", "between": ["block", "frame"], "clearance": 1.0e-2, "stiffness": 4.0e3},
        "load": {"on": "block", "amplitude": 30.0, "frequency": 2.0},
        "motion": {"t_end": 4.0, "lyapunov": 1, "lyapunov_periods": 10},
        "record": {"observable": "displacement", "what": ["trajectory", "extrema", "strobe", "averages"], "from": 2.0},
        "sweep": {"parameter": "load%amplitude", "first": 10.0, "last": 30.0, "points": 3},
    }
    motion, sweep = razy.run(case, output=tmp_path / "run.h5"), razy.sweep(case, output=tmp_path / "sweep.h5")
    assert motion.displacement_strobe_time.values == pytest.approx([2.0, 2.5, 3.0, 3.5, 4.0])
    at = motion.displacement.interp(time=3.0).item()
    assert motion.displacement_strobe[2].item() == pytest.approx(at, abs=1e-4)
    assert motion["displacement.rms"].item() > 0.0
    for name in ("displacement_strobe", "displacement.rms", "lyapunov.exponent"):
        last = sweep[name][sweep["displacement_strobe_point"] == 2] if "strobe" in name else sweep[name][2]
        np.testing.assert_allclose(np.squeeze(last), np.squeeze(motion[name]), rtol=1e-12, err_msg=name)
        assert sweep[name].attrs["units"] == motion[name].attrs["units"]
    assert sweep["lyapunov.exponent"].dims[0] == "point"
    assert sweep["displacement_strobe_load.amplitude"].values.tolist() == np.repeat([10.0, 20.0, 30.0], 5).tolist()
