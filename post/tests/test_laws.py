"""Pictures of laws: what is drawn beside closed forms."""

import numpy as np
import pytest
from pictures import drawn
from samples import LAWS, with_input

from razy.errors import ResultError
from razy.plot.laws import laws_of
from razy.read import open_result
from razy.read.description import read_description


def laws(run, text=LAWS):
    with open_result(with_input(run, text)) as result:
        return {law.name: law for law in laws_of(read_description(result))}


def at(law, *places):
    return law.force(np.array(places))


def test_forces_are_those_of_the_pages(run):
    found = laws(run)
    assert list(found) == ["wall", "ball", "preload", "mesh", "table", "cubic", "slider", "rub"]
    assert at(found["table"], -2.0, -0.5, 0.0, 1.0, 3.0) == pytest.approx([-4.0, -1.0, 0.0, 0.5, 1.5])
    assert at(found["cubic"], 2.0) == pytest.approx([2.0])
    assert at(found["preload"], -0.2, 0.1) == pytest.approx([0.0, 4.0])
    # Two balls of 10 and 30 mm: 4/3 E* sqrt(R), of the lower side, which results count positive.
    stiffness = 4 / 3 * 2e11 / (2 * (1 - 0.09)) * np.sqrt(0.0075)
    assert at(found["ball"], 0.0, -3e-3) == pytest.approx([0.0, stiffness * 2e-3**1.5])
    flanks = [4e8 * 1e-5, -0.1 * 4e8 * 5e-5, -0.1 * 4e8 * 1e-4 - 3e8 * 1e-5]
    assert at(found["mesh"], 1e-5, -5e-5, -1.1e-4) == pytest.approx(flanks)
    x, force = found["wall"].points(-1.0, 1.0)
    assert x.tolist() == [-0.6, -0.6, 0.6, 0.6] and force.tolist() == [-1.0, 0.0, 0.0, 1.0]
    v, force = found["rub"].points(-1.0, 1.0)
    assert np.interp(0.5, v, force) == pytest.approx(10 * (0.2 + 0.2 * np.exp(-1.5) + 0.05), rel=1e-5)
    assert force[v == 0.0].tolist() == [-4.0, -4.0, 4.0, 4.0]
    # The loop of a slider takes 4 F (A - F/k).
    x, force = found["slider"].points(-1.0, 1.0)
    loop = 0.5 * np.sum((force[2:-1] + force[3:]) * np.diff(x[2:]))
    assert abs(loop) == pytest.approx(4 * 0.5 * (0.75 - 0.25))
    assert found["slider"].unit == "N m" and found["cubic"].unit == "N"


def test_picture_has_a_panel_for_each(run):
    figure = drawn(with_input(run, LAWS), "law")
    assert [axes.get_ylabel() for axes in figure.axes][:3] == [
        "force of wall",
        "force of ball (kN)",
        "force of preload (N)",
    ]
    assert len(figure.axes) == 8
    (axes,) = drawn(run, "law", coordinates=("slider",), start=-0.5, stop=0.5).axes
    assert axes.get_xlim() == (-0.5, 0.5) and axes.get_xlabel() == "displacement (rad)"


def test_what_is_not_there(run):
    with pytest.raises(ResultError, match="has no stop, ring, mesh"):
        drawn(run, "law")
    with pytest.raises(ResultError, match="contact"):
        drawn(with_input(run, LAWS), "law", coordinates=("well",))
    with pytest.raises(ResultError, match="nothing between 2 and 1"):
        drawn(run, "law", start=2.0, stop=1.0)
