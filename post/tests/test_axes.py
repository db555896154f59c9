"""Text of the axes: SI prefixes, powers of ten, names, ticks without offset."""

from itertools import pairwise

import numpy as np
import pytest
from pictures import drawn
from samples import ragged, write_sweep

from razy.plot.units import per_second, pretty, readable_name, scale_for
from razy.read import Quantity


@pytest.mark.parametrize(
    ("units", "largest", "unit", "factor"),
    [
        ("m", 1.2e-4, "µm", 1e6),
        ("m", 9.99e-4, "mm", 1e3),
        ("m", 0.05, "mm", 1e3),
        ("m", 0.3, "m", 1.0),
        ("m", 5e4, "m", 1.0),
        ("m", 1e-20, "pm", 1e12),
        ("N", 2.4e4, "kN", 1e-3),
        ("N m", 5e6, "MN m", 1e-6),
        ("rad/s", 0.002, "mrad/s", 1e3),
        ("m^2", 4e-6, "10⁻⁶ m²", 1e6),
        ("rpm", 2600.0, "rpm", 1.0),
        ("rpm", 4e6, "10⁶ rpm", 1e-6),
        ("mm", 2e-4, "10⁻⁶ mm", 1e6),
        ("1", 3e-7, "10⁻⁹", 1e9),
        ("1", 0.5, "", 1.0),
        ("", 0.0, "", 1.0),
        ("s", 0.3, "s", 1.0),
        ("m or rad", 2e-3, "m or rad", 1.0),
        ("m or rad", 2e-4, "10⁻⁶ m or rad", 1e6),
    ],
)
def test_scale(units, largest, unit, factor):
    scale = scale_for(units, largest)
    assert scale.unit == unit
    assert scale.factor == pytest.approx(factor)


def test_units_as_printed():
    assert pretty("kg*m^2") == "kg·m²"
    assert pretty("m s^-2") == "m s⁻²"
    assert pretty("m**(-1)") == "m⁻¹"
    assert per_second("m") == "m/s"
    assert per_second("1") == "1/s"
    assert per_second("m/s") == "m/s^2"


def test_names():
    assert readable_name(Quantity("rotation.speed_rpm", "rpm", "rotation%speed_rpm")) == "speed"
    assert readable_name(Quantity("load(1).value", "N m", "load(1).value")) == "load"
    assert readable_name(Quantity("d", "m", "mesh deformation")) == "mesh deformation"


@pytest.mark.parametrize(("first", "last"), [(1580.4601, 1580.4642), (0.0, 1e-3), (99990.0, 100000.0), (-5.0, 5.0)])
def test_ticks_are_the_numbers_themselves(tmp_path, first, last):
    path = write_sweep(tmp_path / "case.h5", np.linspace(first, last, 50), {"d": ragged(50)})
    figure = drawn(path)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    for axis in (axes.xaxis, axes.yaxis):
        assert axis.get_offset_text().get_text() == ""
    low, high = axes.get_xlim()
    shown = [label for label in axes.get_xticklabels() if low <= label.get_position()[0] <= high]
    assert len(shown) >= 2
    for label in shown:
        assert float(label.get_text().replace("\N{MINUS SIGN}", "-")) == pytest.approx(
            label.get_position()[0], abs=1e-9
        )
    boxes = [label.get_window_extent() for label in shown]
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))
