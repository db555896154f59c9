"""A mistake in the input is one line, `file:line: &group key = value: what is allowed`, and nothing is left behind."""

import re
from pathlib import Path

import pytest
from programs import GEAR_PAIR, SOURCE, changed, left, plot, start, succeed

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
    ("between='motor','pinion'", "between='moto','pinion'", 8, "no body or point is named moto; did you mean 'motor'?"),
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
    expected = "bad.nml:15: &record what = 'trajectory': more than a 'trajectory' of at least one observable"
    assert done.stderr.startswith(expected)


@pytest.mark.parametrize(("text", "says"), [("", "the file is empty"), ("! nothing\n", "no namelist group")])
def test_file_without_a_group(text, says):
    Path("bad.nml").write_text(text)
    done = start("razy-run", "bad.nml")
    assert done.returncode == 2
    assert done.stderr == f"bad.nml: {done.stderr[9:]}"
    assert says in done.stderr and done.stderr.count("\n") == 1


LONG = 100000 * "x"
# what is changed in the input, with LONG for the long text
PLANAR, ROTOR = SOURCE / "inputs" / "vibropress.nml", SOURCE / "inputs" / "rotor_rub.nml"
STARTS = "&starts method='file', file='starts.csv' /\n&start_range coordinate='motor' /\n"
LONG_TEXTS = {
    "group": (("&rotation", "&LONG"),),
    "group that is not closed": (("error_sine=5e-5 /", "error_sine=5e-5 &LONG"),),
    "key": (("teeth=40,40", "LONG=40"),),
    "number": (("value=-100.0", "value=LONG"),),
    "many numbers": (("value=-100.0", "value=5000*1.25"),),
    "choice": (("kind='lumped'", "kind='LONG'"),),
    "name": (("name='motor',", "name='LONG',"),),
    "body": (("between='motor',", "between='LONG',"),),
    "body of a load": (("on='motor'", "on='LONG'"),),
    "text between groups": (("&rotation", "LONG &rotation"),),
    "subscript": (("teeth=40,40", "teeth(LONG)=40"),),
    "path of a sweep": (("'rotation%speed_rpm', first=1000.0", "'rotation%LONG', first=1000.0"),),
    "coordinate of a start": ((r"\Z", STARTS.replace("motor", "LONG")),),
    "file of starts": ((r"\Z", STARTS.replace("starts", "LONG")),),
    "hdf5 file of starts": ((r"\Z", STARTS.replace("starts.csv", "LONG.h5")),),
    "column": ((r"\Z", STARTS.replace("coordinate", "column='LONG', coordinate")),),
    "header of starts": ((r"\Z", STARTS),),
    "word of starts": ((r"\Z", STARTS),),
}  # fmt: skip
STARTS_FILES = {"header of starts": "LONG, LONG1\n1, 2\n", "word of starts": "motor.angle\nLONG\n"}


def expect_short_quotes(done, code=2):
    assert done.returncode == code, done.stderr[-500:]
    assert done.stderr.count("\n") == 1 and len(done.stderr) < 4096
    assert "x" * 81 not in done.stderr and 20 * "1.25, " not in done.stderr


@pytest.mark.parametrize("place", LONG_TEXTS)
def test_messages_quote_few_characters(place):
    changes = [(old, new.replace("LONG", LONG)) for old, new in LONG_TEXTS[place]]
    changed(Path("bad.nml"), GEAR_PAIR.read_text(), *changes)
    Path("starts.csv").write_text(STARTS_FILES.get(place, "motor.rotation\n0.1\n").replace("LONG", LONG))
    expect_short_quotes(start("razy-sweep", "bad.nml", timeout=20))


@pytest.mark.parametrize(
    "words",
    [
        ["--set", "LONG"], ["--set", "LONG%key=1"], ["--set", "motion%LONG=1"], ["--set", "motion%t_end=LONG"],
        ["--set", "sweep%parameter=LONG"], ["--set", "record%of=LONG"],
        ["--LONG"], ["--checkpoint", "LONG"], ["--checkpoint-points", "LONG"], ["--output", "LONG.h5"],
        ["--output", "LONG/a.h5"], ["--log", "LONG"], ["LONG.nml"],
    ],
)  # fmt: skip
def test_messages_quote_few_characters_of_options(words):
    words = [word.replace("LONG", LONG) for word in words]
    expect_short_quotes(start("razy-sweep", GEAR_PAIR, *words, timeout=20))
    if words[0].endswith(".nml"):
        expect_short_quotes(start("razy-run", *words, timeout=20))


@pytest.mark.parametrize(
    ("source", "old", "new"),
    [(PLANAR, "body='[^']+'", "body='LONG'"), (ROTOR, "shaft='[^']+'", "shaft='LONG'")],
)
def test_messages_quote_few_characters_of_names(source, old, new):
    text, count = re.subn(old, new.replace("LONG", LONG), source.read_text(), count=1)
    assert count == 1
    Path("bad.nml").write_text(text)
    expect_short_quotes(start("razy-run", "bad.nml", timeout=20))


@pytest.mark.parametrize(
    "words",
    [["LONG.h5"], ["a.h5", "--LONG"], ["a.h5", "--kind", "LONG"], ["a.h5", "--dpi", "LONG"],
     ["a.h5", "--observable", "LONG", "--save", "a.png"], ["a.h5", "--size", "LONG"],
     ["a.h5", "--save", "LONG.png"], ["a.h5", "--save", "LONG"]],
)  # fmt: skip
def test_pictures_quote_few_characters(words):
    succeed("razy-run", GEAR_PAIR, "--set", "motion%t_end=0.01", "--set", "record(1)%from=0", "--output", "a.h5")
    done = plot(*(word.replace("LONG", LONG) for word in words))
    expect_short_quotes(done, done.returncode)
    assert done.returncode in (1, 2)
