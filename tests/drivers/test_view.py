"""razy-view: a sweep's diagram in a browser, with motions computed where it is clicked."""

import os
import re
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from resource import RLIMIT_FSIZE, getrlimit, setrlimit

import h5py
import numpy as np
import pytest
from browser import CHROMIUM, Browser
from programs import BUILD, GEAR_PAIR, SOURCE, sets, start, succeed

sys.path.insert(0, str(SOURCE / "post" / "src"))

pytest.importorskip("bokeh")

import razy
from bokeh.models import Div, PlainText, Select
from bokeh.plotting import figure
from razy.view.cli import main
from razy.view.page import View
from razy.view.sweep import Sweep

BIN = BUILD / "bin"


def gear_pair(file="gear.h5", **values):
    succeed("razy-sweep", GEAR_PAIR, "--output", file, *sets(sweep__step=100.0, **values))
    return Path(file)


ROTOR = """&scene kind='rotor' /
&shaft name='rotor', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0, damping_ratio=0.02 /
&section shaft='rotor', length=0.4, outer_diameter=0.02, elements=2 /
&disk shaft='rotor', node=2, mass=4.0, polar_inertia=1.0e-2, diametral_inertia=5.0e-3 /
&bearing shaft='rotor', node=1, kind='matrix', stiffness=1.0e7,0.0,0.0,1.0e7 /
&bearing shaft='rotor', node=3, kind='matrix', stiffness=1.0e7,0.0,0.0,1.0e7 /
&support shaft='rotor', node=1, held='u','phi' /
&unbalance shaft='rotor', node=2, moment=2.0e-5 /
&rotation speed_rpm=600.0 /
&motion t_end=2.0, start='zero' /
&record observable='displacement', of='rotor.2.v', what='extrema', from=1.8 /
&record observable='displacement', of='rotor.2.w', what='extrema', from=1.8 /
&sweep parameter='rotation%speed_rpm', first=600.0, last=1200.0, points=3 /
"""


def test_a_damaged_file_is_one_line(folder, capsys):
    with h5py.File(gear_pair(), "r+") as file:
        size = file["extrema/mesh_deformation/offset"].size
        del file["extrema/mesh_deformation/offset"]
        file["extrema/mesh_deformation/offset"] = np.zeros(size, dtype=[("a", "f8"), ("b", "i4")])
    assert code("gear.h5", "--save", "page.html") == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and said.startswith("razy-view: error: gear.h5: damaged"), said
    assert not Path("page.html").exists()


def test_orbits_of_a_rotor_have_a_mark_once_in_each_revolution(folder):
    Path("rotor.nml").write_text(ROTOR)
    succeed("razy-sweep", "rotor.nml", "--output", "rotor.h5")
    view = View(Sweep(Path("rotor.h5"), BIN), [0])
    choice = next(iter(view.motions.select({"type": Select})))
    assert choice.options[-1] == "orbit of rotor.2"
    plot = next(
        p for p in view.motions.select({"type": figure}) if p.xaxis[0].axis_label.text.startswith("rotor.2: along y")
    )
    path, marks = (item.data_source.data for item in plot.renderers)
    # At 600 rpm the disk whirls below its critical speed, two revolutions in 0.2 s: a circle.
    radius = np.hypot(path["x"], path["y"])
    assert np.ptp(radius) < 0.1 * radius.mean() and len(marks["x"]) in (2, 3)
    assert np.ptp(marks["x"]) < 0.1 * radius.mean()


def code(*arguments):
    try:
        return main([str(word) for word in (*arguments, "--programs", BIN)])
    except SystemExit as stop:
        return int(stop.code)


def test_a_point_becomes_its_motion_and_the_last_two_are_shown():
    view = View(Sweep(gear_pair(), BIN), [])
    assert "Click on the diagram" in view.status.text and not view.shown
    view.tap(1512.0, 1e-5)
    ((point, motion),) = view.shown
    assert (point, motion.label) == (5, "rotation.speed_rpm = 1500")
    same = razy.run(GEAR_PAIR, {"rotation%speed_rpm": 1500.0, "record%what": "trajectory", "record%interval": 1.25e-5},
                    programs=BIN, progress=False)  # fmt: skip
    found = razy.open(motion.file)
    np.testing.assert_allclose(found.mesh_deformation, same.mesh_deformation, atol=1e-12)
    assert "razy-view gear.h5 --at 1500 --input motion.nml" in view.commands.text
    for x in (1880.0, 1e9):
        view.tap(x, 0.0)
    assert [motion.label for _, motion in view.shown] == [f"rotation.speed_rpm = {n}" for n in (1900, 2600)]
    plots = list(view.motions.select({"type": figure}))
    assert sorted(plot.xaxis[0].axis_label.text.split(" (")[0] for plot in plots) == [
        "frequency", "mesh deformation", "time", "time", "time"
    ]  # fmt: skip
    assert sorted(len(plot.renderers) for plot in plots) == [1, 1, 2, 2, 2]


def test_a_click_shows_the_motion_that_was_clicked():
    # Chaotic: a motion that differs in one bit has other events soon. States are recorded for the click alone.
    file = gear_pair()
    sweep = Sweep(file, BIN)
    for point in (8, 10):
        with h5py.File(sweep.motion(point).file) as motion, h5py.File(file) as points:
            assert motion["event/time"].size == points["point/events"][point] > 1000


def test_the_command_repeats_the_motion(folder):
    sweep = Sweep(gear_pair(), BIN)
    commands = sweep.command(5).splitlines()
    environment = os.environ | {"PATH": f"{BIN}:{os.environ['PATH']}"}
    assert code(*commands[0].split()[1:]) == 0
    subprocess.run(commands[1].split(), check=True, env=environment, stderr=subprocess.DEVNULL)
    np.testing.assert_array_equal(
        razy.open("motion.h5").mesh_deformation, razy.open(sweep.motion(5).file).mesh_deformation
    )


def test_a_map_with_values_that_vary_together_and_forces_of_contacts():
    case = SOURCE / "inputs" / "gear_pair_map.nml"
    succeed("razy-sweep", case, "--output", "map.h5", *sets(**{"sweep(1)__step": 800.0, "sweep(2)__step": 90.0}))
    sweep = Sweep(Path("map.h5"), BIN)
    view = View(sweep, [])
    view.tap(1820.0, 95.0)
    ((point, motion),) = view.shown
    assert sweep.grid[point].tolist() == [1800.0, 100.0]
    found = razy.open(motion.file)
    assert "value = -100.0" in found.input and "contact_force.mesh" in found
    assert float(found["contact_force.mesh"].max()) == pytest.approx(
        razy.open("map.h5")["mesh.largest_force"].values[point], rel=1e-2
    )


def test_a_motion_that_was_followed_until_periodic_is_as_long():
    sweep = Sweep(gear_pair(sweep__until_periodic=".true.", motion__t_end=1.0, record__from=0.95), BIN)
    point = int(np.argmin(sweep.result.column("duration")))
    found = razy.open(sweep.motion(point).file)
    assert float(found.time[-1]) == pytest.approx(sweep.result.column("duration")[point])
    extrema = sweep.result.extrema("mesh_deformation").point(point).value
    assert float(found.mesh_deformation.max()) == pytest.approx(extrema.max(), rel=1e-2)


def test_chains_are_said_to_begin_otherwise():
    case = SOURCE / "inputs" / "hysteresis.nml"
    succeed("razy-sweep", case, "--output", "chain.h5", *sets(sweep__points=5))
    assert "began where the one before ended" in View(Sweep(Path("chain.h5"), BIN), [0]).status.text


def test_a_page_to_send(capsys):
    file = gear_pair()
    assert code(file, "--at", 1500, "--at", 1900, "--at", 2600, "--save", "page.html") == 0, capsys.readouterr()
    page = Path("page.html").read_text()
    assert "Torsional gear pair" in page and "rotation.speed_rpm = 1900" in page
    assert not re.search(r"<(script|link|img)[^>]*=\s*.http", page)
    assert code(file, "--save", "page.html") == 2
    assert "page.html: exists already; --force overwrites it" in capsys.readouterr().err
    before = getrlimit(RLIMIT_FSIZE)
    setrlimit(RLIMIT_FSIZE, (len(page) // 2, before[1]))
    try:
        assert code(file, "--save", "page.html", "--force") == 1
    finally:
        setrlimit(RLIMIT_FSIZE, before)
    assert capsys.readouterr().err.splitlines()[-1] == "razy-view: error: page.html: File too large"
    assert Path("page.html").read_text() == page
    assert not list(Path().glob(".*partial*"))


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["gear.h5", "--at", "9000"], "gear.h5: rotation.speed_rpm = 9000 is outside: 1000 to 1100"),
        (["gear.h5", "--at", "1500,2"], "gear.h5: a point has 1 value(s), rotation.speed_rpm, not 2"),
        (["gear.h5", "--at", "fast"], "--at fast: a number, or two with a comma between"),
        (["run.h5"], "run.h5: a file of razy-run; razy-view looks into files of razy-sweep"),
        (["none.h5"], "none.h5: no such file"),
        (["gear.h5", "--input", "motion.nml"], "--input goes with one --at, and without --save"),
        (["gear.h5", "--save", "no/page.html"], "no/page.html: no folder 'no'"),
    ],
)
def test_mistakes_are_one_line(words, line, capsys):
    gear_pair(sweep__first=1000.0, sweep__last=1100.0)
    succeed("razy-run", GEAR_PAIR, "--output", "run.h5", *sets(motion__t_end=0.01, record__from=0.0))
    assert code(*words) == 2
    assert capsys.readouterr().err == f"razy-view: error: {line}\n"


def test_a_motion_that_fails_is_said_and_the_page_stays():
    start("razy-sweep", GEAR_PAIR, "--output", "gear.h5", *sets(sweep__step=800.0, motion__max_events=1))
    view = View(Sweep(Path("gear.h5"), BIN), [])
    view.tap(2600.0, 0.0)
    assert "event" in view.status.text and not view.shown


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium (Debian: apt-get install chromium)")
def test_clicks_in_a_browser(folder):
    file = gear_pair()
    environment = os.environ | {"PYTHONPATH": str(SOURCE / "post" / "src")}
    server = subprocess.Popen(
        [sys.executable, "-m", "razy.view.cli", file, "--no-browser", "--programs", BIN],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, env=environment,
    )  # fmt: skip
    try:
        address = server.stdout.readline().split()[0]
        with Browser(address, folder / "browser") as page:
            ((left, top, width, height),) = page.wait(page.plots)
            page.click(left + 0.3 * width, top + 0.5 * height)
            page.wait(lambda: "To repeat" in page.text())
            page.click(left + 0.8 * width, top + 0.5 * height)
            page.wait(lambda: page.text().count("# rotation.speed_rpm") == 2)
            assert len(page.wait(lambda: page.plots()[1:])) == 5
    finally:
        server.terminate()
        server.wait()
    assert code(file, "--at", 1500, "--save", "page.html") == 0
    with Browser(f"file://{folder / 'page.html'}", folder / "other") as page:
        assert len(page.wait(page.plots)) == 5
        assert "rotation.speed_rpm = 1500" in page.text()


def test_titles_and_names_are_no_formulas():
    """TeX between $$ would become a link in the page, also in one that is sent to others."""
    trap = r"$$\href{javascript:alert(1)}{click}$$"
    view = View(Sweep(gear_pair(scene__title=f"'{trap}'"), BIN), [0])
    divs = list(view.layout.select({"type": Div}))
    assert any(trap in div.text for div in divs) and all(div.disable_math for div in divs)
    labels = [axis.axis_label for plot in view.layout.select({"type": figure}) for axis in (*plot.xaxis, *plot.yaxis)]
    assert labels and all(isinstance(label, PlainText) for label in labels)


def asked(address, host=None):
    """What a plain client gets: code, length of the answer."""
    request = urllib.request.Request(address, headers={"Host": host} if host else {})
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, len(answer.read())
    except urllib.error.HTTPError as error:
        return error.code, 0


def test_only_who_has_the_address_gets_the_page_and_each_motion_is_computed_once(folder):
    file, scratch = gear_pair(), folder / "scratch"
    scratch.mkdir()
    environment = os.environ | {"PYTHONPATH": str(SOURCE / "post" / "src"), "TMPDIR": str(scratch)}
    server = subprocess.Popen(
        [sys.executable, "-m", "razy.view.cli", file, "--at", "1500", "--no-browser", "--programs", BIN],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, env=environment,
    )  # fmt: skip
    try:
        address = server.stdout.readline().split()[0]
        root = address[: address.index("/", len("http://")) + 1]
        assert asked(root) == (404, 0)
        assert asked(address, host="elsewhere.example") == (404, 0)
        assert asked(address)[0] == asked(address)[0] == 200
        assert len([*scratch.rglob("*.h5")]) == 1
    finally:
        server.terminate()
        assert server.wait(timeout=30) == 0
    assert not [*scratch.iterdir()]


def test_files_of_motions_are_bounded(monkeypatch):
    monkeypatch.setattr("razy.view.sweep.MOST_MOTIONS", 2)
    sweep = Sweep(gear_pair(), BIN)
    files = [Path(sweep.motion(point).file) for point in (0, 1, 2)]
    assert [file.exists() for file in files] == [False, True, True]
    assert Path(sweep.motion(0).file).exists()
