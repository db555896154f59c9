"""The picture of a machine, and the geometry it is drawn from."""

import h5py
import numpy as np
import pytest
from pictures import drawn, inside
from samples import dataset

from razy_post.cli import main
from razy_post.errors import ResultError
from razy_post.read import open_result
from razy_post.read.scene import read_scene


def add_scene(path, with_elements=True):
    """Add a block on the ground: a spring below it, a stop above, an exciter on it."""
    with h5py.File(path, "r+") as file:
        group = file.create_group("scene")
        dataset(group, "axis", ["x", "y"])
        dataset(group, "body", ["block", "cover"])
        dataset(group, "centre", np.array([[0.0, 0.5], [0.0, 1.5]]), "m")
        dataset(group, "size", np.array([[1.0, 0.6], [1.0, 0.4]]), "m")
        dataset(group, "point", ["foot", "top", "under"])
        dataset(group, "point_body", np.array([1, 1, 2], dtype=np.int32))
        dataset(group, "position", np.array([[0.3, 0.2], [0.0, 0.8], [0.0, 1.3]]), "m")
        if not with_elements:
            return path
        dataset(group, "element", ["support", "lid", "shaker", "load 1"])
        kinds = "1 = spring, 2 = damper, 3 = stop, 4 = exciter, 5 = load"
        dataset(group, "kind", np.array([1, 3, 4, 5], dtype=np.int32), meanings=kinds)
        dataset(group, "first_body", np.array([1, 2, 1, 1], dtype=np.int32))
        dataset(group, "second_body", np.array([0, 1, 1, 0], dtype=np.int32))
        dataset(group, "first", np.array([[0.3, 0.2], [0.0, 1.3], [-0.2, 0.5], [0.0, 0.8]]), "m")
        dataset(group, "second", np.array([[0.3, 0.2], [0.0, 0.8], [0.2, 0.5], [0.0, 0.8]]), "m")
        dataset(group, "direction", np.array([[0.0, 1.0], [0.0, 1.0], [0.0, 1.0], [0.0, 0.0]]))
    return path


def test_scene_is_read(run):
    with open_result(add_scene(run)) as result:
        scene = read_scene(result)
    assert [body.name for body in scene.bodies] == ["block", "cover"]
    assert scene.points[2].body == 2
    assert [element.kind for element in scene.elements] == ["spring", "stop", "exciter", "load"]
    assert scene.elements[0].bodies == (1, 0)
    assert scene.elements[1].second.tolist() == [0.0, 0.8]


def test_picture_shows_bodies_and_elements(run):
    figure = drawn(add_scene(run), "machine")
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
    assert len(drawn(add_scene(sweep, with_elements=False), "machine").axes[0].patches) == 2


def test_file_without_geometry(run, capsys):
    assert main([str(run), "--kind", "machine", "--save", str(run.with_suffix(".png"))]) == 2
    assert "holds no geometry of the machine" in capsys.readouterr().err


def test_incomplete_geometry(run):
    with h5py.File(add_scene(run), "r+") as file:
        del file["scene/centre"]
    with open_result(run) as result, pytest.raises(ResultError, match="geometry of the machine is incomplete"):
        read_scene(result)
