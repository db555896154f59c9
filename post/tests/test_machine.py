"""The picture of a machine, and the geometry it is drawn from."""

import h5py
import numpy as np
import pytest
from pictures import drawn, inside
from samples import write_scene

from razy_post.cli import main
from razy_post.errors import ResultError
from razy_post.read import open_result
from razy_post.read.scene import read_scene


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
