"""A mistake in the input is one line, `file:line: &group key = value: what is allowed`, and nothing is left behind."""

import re
from pathlib import Path

import pytest
from programs import GEAR_PAIR, changed, left, start

SHAPE = re.compile(r"bad\.nml(:\d+)?: (&\w+(\(\d+\))?( \w+( = .+?)?)?: )?\S.*\n")

# what is changed, the line and the words of the message
MISTAKES = [
    ("kind='lumped'", "kind='lumpd'", 3, "&scene kind = 'lumpd': must be one of 'lumped'"),
    ("&inertia   name='motor'", "&inertai name='motor'", 4, "&inertai: there is no such group; did you mean 'inertia'"),
    ("name='motor',  value", "name='motor', valu", 4, "&inertia(1) valu = 0.1: there is no such key; did you mean"),
    ("name='motor',  value=0.1", "name='motor', value=abc", 4, "&inertia(1) value = abc: must be a positive real"),
    ("name='motor',  value=0.1", "name='motor', value=-0.1", 4, "&inertia(1) value = -0.1: must be a positive real"),
    ("name='motor',  value=0.1", "name='motor'", 4, "&inertia(1) value: is required"),
    ("name='pinion'", "name='motor'", 5, "&inertia(2) name = 'motor': the name must be unique, &inertia(1) has it"),
    ("name='pinion', value=0.00794", "name='pinion', value=1.0, value=2.0", 5, "given twice"),
    ("between='motor','pinion'", "between='moto','pinion'", 8, "no body is named moto; did you mean 'motor'?"),
    ("teeth=40,40", "teeth=40", 10, "&gear_mesh teeth = 40: must be 2 positive integers"),
    ("teeth=40,40", "teeth=40,40.5", 10, "teeth"),
    ("error_sine=5e-5 /", "error_sine=5e-5", 10, "&gear_mesh: this group is not closed by /"),
    ("&load      on='motor'", "junk &load on='motor'", 11, "found 'junk' outside of a group"),
    ("start='static'", "start='statc'", 14, "did you mean 'static'?"),
    ("value=-100.0", "value=-99.0", 14, "no equilibrium"),
    ("what='extrema'", "what='extremes'", 15, "did you mean 'extrema'?"),
    ("(?m)^&record.*$", "&scene kind='lumped' /", 15, "allowed once"),
    ("(?m)^&motion.*\n", "", None, "&motion t_end: required"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "says"), MISTAKES)
@pytest.mark.parametrize("program", ["razy-run", "razy-sweep"])
def test_mistake(program, old, new, line, says):
    changed(Path("bad.nml"), GEAR_PAIR.read_text(), (old, new))
    done = start(program, "bad.nml", timeout=20)
    assert done.returncode == 2
    assert done.stdout == ""
    assert SHAPE.fullmatch(done.stderr), done.stderr
    assert done.stderr.startswith("bad.nml: " if line is None else f"bad.nml:{line}: "), done.stderr
    assert says in done.stderr
    assert left() == ["bad.nml"]


SWEEP_MISTAKES = [
    ("first=1000.0", "first=3000.0", "must have the sign of last - first"),
    ("step=4.0", "step=0.0", "one of step and points"),
    (", step=4.0", "", "one of step and points"),
    ("step=4.0", "step=4.0, points=3", "one of step and points"),
    ("step=4.0", "points=0", "must be a positive integer"),
    ("rotation%speed_rpm", "rotation%speed", "did you mean"),
    ("rotation%speed_rpm", "load%value", "load(1)%value to load(2)%value"),
    ("rotation%speed_rpm", "load(3)%value", "must be 1 to 2"),
    ("rotation%speed_rpm", "gear_mesh%radius", "gear_mesh%radius(1) to gear_mesh%radius(2)"),
    (
        "rotation%speed_rpm', first=1000.0, last=2600.0, step=4.0",
        "gear_mesh%teeth(1)', first=20.0, last=30.0, step=0.5",
        "a whole number",
    ),
    ("rotation%speed_rpm", "sweep%first", "another group"),
    ("rotation%speed_rpm', first=1000", "gear_mesh%backlash', first=-1", "must be a nonnegative real number in m"),
]


@pytest.mark.parametrize(("old", "new", "says"), SWEEP_MISTAKES)
def test_mistake_in_the_sweep(old, new, says):
    without_follow = re.sub(r"&follow.*\n", "", GEAR_PAIR.read_text())
    changed(Path("bad.nml"), without_follow, (re.escape(old), new))
    done = start("razy-sweep", "bad.nml", timeout=20)
    assert done.returncode == 2
    assert SHAPE.fullmatch(done.stderr), done.stderr
    assert done.stderr.startswith("bad.nml:16: &sweep "), done.stderr
    assert says in done.stderr
    assert left() == ["bad.nml"]


def test_sweep_needs_its_group_and_extrema():
    changed(Path("bad.nml"), GEAR_PAIR.read_text(), ("(?m)^&sweep.*$", ""))
    assert "&sweep parameter: required" in start("razy-sweep", "bad.nml").stderr
    changed(Path("bad.nml"), GEAR_PAIR.read_text(), ("what='extrema'", "what='trajectory'"))
    done = start("razy-sweep", "bad.nml")
    assert done.returncode == 2
    expected = "bad.nml:15: &record what = 'trajectory': 'extrema' or 'statistics' of at least one observable"
    assert done.stderr.startswith(expected)


@pytest.mark.parametrize(("text", "says"), [("", "the file is empty"), ("! nothing\n", "no namelist group")])
def test_file_without_a_group(text, says):
    Path("bad.nml").write_text(text)
    done = start("razy-run", "bad.nml")
    assert done.returncode == 2
    assert done.stderr == f"bad.nml: {done.stderr[9:]}"
    assert says in done.stderr and done.stderr.count("\n") == 1
