"""The picture of a machine, and the geometry it is drawn from."""

import h5py
import numpy as np
import pytest
from pictures import drawn, inside, pixels
from samples import write_scene

from razy.errors import ResultError
from razy.plot.cli import main
from razy.read import open_result
from razy.read.scene import read_scene


def test_scene_is_read(run):
    with open_result(write_scene(run)) as result:
        scene = read_scene(result)
    assert [body.name for body in scene.bodies] == ["block", "cover"]
    assert scene.points[2].body == 2
    assert [element.kind for element in scene.elements] == ["spring", "stop", "exciter", "load"]
    assert scene.elements[0].bodies == (1, 0)
    assert scene.elements[1].second.tolist() == [0.0, 0.8]


def test_picture_shows_bodies_and_elements(run):
    figure = drawn(write_scene(run), "machine")
    (axes,) = figure.axes
    boxes = [(patch.get_xy(), patch.get_width(), patch.get_height()) for patch in axes.patches]
    assert np.allclose(boxes[0][0], (-0.5, 0.2)) and boxes[0][1:] == (1.0, 0.6)
    lines = {line.get_label(): line for line in axes.get_lines()}
    # The spring goes from the foot to the frame below it, against its direction.
    spring = np.asarray(lines["spring"].get_xydata())
    assert spring[0].tolist() == [0.3, 0.2]
    assert spring[-1][0] == pytest.approx(0.3) and spring[-1][1] < 0.15
    assert (inside(figure, axes).min(axis=2) < 128).any()
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["spring", "stop", "exciter", "load"]


def test_machine_of_a_sweep_and_without_elements(sweep):
    assert len(drawn(write_scene(sweep, with_elements=False), "machine").axes[0].patches) == 2


def test_file_without_geometry(run, capsys):
    assert main([str(run), "--kind", "machine", "--save", str(run.with_suffix(".png"))]) == 2
    assert "holds no geometry of the machine" in capsys.readouterr().err


def test_incomplete_geometry(run):
    with h5py.File(write_scene(run), "r+") as file:
        del file["scene/centre"]
    with open_result(run) as result, pytest.raises(ResultError, match="geometry of the machine is incomplete"):
        read_scene(result)


LUMPED = """&scene kind='lumped' /
&mass name='left', value=2.0 /
&mass name='right', value=300.0 /
&spring between='left','frame', stiffness=1e5 /
&spring between='left','right', stiffness=2e3, damping=5.0 /
&stop name='bumper', between='right','frame', side='upper', clearance=7e-4, stiffness=1e6 /
&stop name='hook', between='right','frame', side='both', clearance=1e-3, law='rigid', restitution=0.5 /
&friction name='belt', between='left','frame', static_coefficient=0.1, normal_load=10.0, belt_speed=0.2 /
&load on='right', value=-5.0 /
"""
GEARS = """&scene kind='lumped' /
&inertia name='motor', value=0.1 /
&inertia name='pinion', value=0.01 /
&inertia name='wheel', value=0.04 /
&spring between='motor','pinion', stiffness=6e4 /
&gear_mesh name='mesh', between='pinion','wheel', radius=0.04,0.08, teeth=20,40, stiffness=8e8, backlash=1e-4 /
&rotation speed_rpm=1500.0, of='pinion' /
"""
ROTOR = """&scene kind='rotor' /
&shaft name='input', young_modulus=2.1e11 /
&shaft name='output', young_modulus=2.1e11 /
&section shaft='input', length=0.1, outer_diameter=0.03, elements=2 /
&section shaft='input', length=0.2, outer_diameter=0.04, outer_diameter_end=0.03, elements=2 /
&section shaft='output', length=0.2, outer_diameter=0.05, inner_diameter=0.02, elements=4 /
&disk shaft='input', node=4, mass=2.0, polar_inertia=1e-2, diametral_inertia=5.6e-3 /
&bearing shaft='input', node=1, kind='rolling', elements=8, radial_stiffness=1e7 /
&bearing shaft='output', node=5, kind='matrix', stiffness=1e7,0.0,0.0,1e7 /
&support shaft='input', node=1, held='phi' /
&gear_mesh name='mesh', between='input','output', node=3,2, radius=0.08,0.04, teeth=40,20, stiffness=4e8 /
&stop name='stator', between='input.5','frame', direction=0.0,-1.0,0.0, clearance=1e-4, stiffness=1e7 /
&unbalance shaft='input', node=4, moment=1e-4 /
&load on='input.3.phi', value=150.0 /
"""


def with_input(path, text):
    with h5py.File(path, "r+") as file:
        file.attrs["input"] = text
    return path


def texts(axes):
    return [text.get_text() for text in axes.texts if text.get_text()]


def test_scheme_of_masses_shows_what_acts_on_which_side(run):
    figure = drawn(with_input(run, LUMPED), "machine")
    (axes,) = figure.axes
    left, right = axes.patches
    assert left.get_x() + left.get_width() < right.get_x()
    said = texts(axes)
    assert "left\n2 kg" in said and "right\n300 kg" in said
    assert {"100 kN/m", "2 kN/m", "5 N s/m", "bumper: clearance 700 µm\n1 MN/m"} <= set(said)
    assert said.count("hook: clearance 1 mm\nrigid, restitution 0.5") == 2
    assert "friction 0.1, pressed by 10 N\nbelt: 0.2 m/s" in said and "\N{MINUS SIGN}5 N" in said
    spring = next(text for text in axes.texts if text.get_text() == "100 kN/m")
    bumper = next(text for text in axes.texts if text.get_text().startswith("bumper"))
    assert spring.get_position()[0] < left.get_x()
    assert bumper.get_position()[0] > right.get_x() + right.get_width()
    assert (pixels(figure).min(axis=2) < 128).any()


def test_scheme_of_gears_puts_the_wheel_under_its_pinion_to_scale(run):
    (axes,) = drawn(with_input(run, GEARS), "machine").axes
    motor, pinion, wheel = axes.patches
    assert wheel.get_height() == pytest.approx(2 * pinion.get_height())
    assert wheel.get_y() + wheel.get_height() == pytest.approx(pinion.get_y())
    assert wheel.get_x() == pytest.approx(pinion.get_x()) and motor.get_x() < pinion.get_x()
    assert "mesh: 20/40 teeth\n800 MN/m\nbacklash 100 µm" in texts(axes)


def test_rotor_has_true_lengths_and_axes_as_far_apart_as_pitch_circles(run):
    figure = drawn(with_input(run, ROTOR), "machine")
    (axes,) = figure.axes
    boxes = [p.get_path().get_extents(p.get_transform() - axes.transData).bounds for p in axes.patches]
    for box in ((0.0, -0.015, 0.1, 0.03), (0.1, -0.02, 0.2, 0.04), (0.05, -0.145, 0.2, 0.05)):
        assert any(np.allclose(box, other) for other in boxes)
    cone = [(0.1, -0.02), (0.3, -0.015), (0.3, 0.015), (0.1, 0.02)]
    assert any(np.allclose(p.get_path().vertices[:4], cone) for p in axes.patches if len(p.get_path().vertices) == 5)
    # The cylinder of 2 kg, 1e-2 and 5.6e-3 kg m^2 has a radius of 0.1 m and is sqrt(12 * 3e-4) = 0.06 m wide.
    assert any(np.allclose((0.2 - 0.03, -0.1, 0.06, 0.2), other) for other in boxes)
    assert any(np.allclose(other[1::2], (-0.08, 0.16)) for other in boxes)
    assert axes.get_aspect() == 1.0
    said = texts(axes)
    assert said.count("5") == 2 and {"input", "output", "40 teeth", "20 teeth", "φ", "150 N m"} <= set(said)
    kinds = [text.get_text() for text in axes.get_legend().get_texts()]
    assert kinds == [
        "disk (cylinder of the same inertia)", "gear, pitch radius", "gear mesh", "bearing", "bearing, matrices",
        "held by the frame", "stop", "unbalance", "load",
    ]  # fmt: skip
    assert (pixels(figure).min(axis=2) < 128).any()


@pytest.mark.parametrize(
    "text", ["&mass name='a', value=1.0 /\n&spring between='a','b', stiffness=1.0 /", "&shaft name='a' /", "no / &name"]
)
def test_input_that_makes_no_machine_is_one_line(run, capsys, text):
    assert main([str(with_input(run, text)), "--kind", "machine", "--save", str(run.with_suffix(".png"))]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
