"""Inputs of the gallery for rotors by trade: what their pages say of them, beside another way to compute it."""

import re

import h5py
import numpy as np
import pytest
from programs import SOURCE, sets, succeed, values_of

PEDESTAL = SOURCE / "inputs" / "loose_pedestal.nml"
COAXIAL = SOURCE / "inputs" / "coaxial_shafts.nml"


def phasors(path, at):
    """Return the phasors of `&response` at a point of its grid, and their angular frequencies."""
    succeed("razy-modes", path, "--output", "response.h5", "--force")
    with h5py.File("response.h5") as file:
        group = file["response"]
        found = {name: group["phasor"][name][at] @ [1, 1j] for name in group["phasor"]}
        return found, 2 * np.pi * group["frequency"][at]


def test_pedestal_stands_and_lifts(folder):
    """At low speed it shakes as one that the foot holds both ways; above, the foot lifts until the bolts hold it."""
    text = "".join(
        line
        for line in PEDESTAL.read_text().splitlines(True)
        if not line.startswith(("&record", "&stop      name='bolts'"))
    )
    case = folder / "stands.nml"
    case.write_text(
        text
        + "&record observable='displacement', of='pedestal.1.v', what='extrema', from=9.9 /\n"
        + "&response parameter='rotation%speed_rpm', first=1000.0, last=1500.0, points=3 /\n"
    )
    found, _ = phasors(case, 2)
    succeed("razy-run", case, *sets(rotation__speed_rpm=1500.0, motion__t_end=10.0))
    value = values_of("stands.h5")["extrema/displacement.pedestal.1.v/value"]
    amplitude = abs(found["displacement.pedestal.1.v"][0])
    assert (value.max() - value.min()) / 2 == pytest.approx(amplitude, rel=1e-6)
    # Half of the weight of the rotor, and its own, over the stiffness of the foot.
    weight = 9.81 * ((7850 * np.pi / 4 * 0.04**2 * 0.5 + 10.0) / 2 + 6.0)
    assert (value.max() + value.min()) / 2 == pytest.approx(-weight / 5e7, rel=1e-9)
    succeed("razy-run", PEDESTAL, "--output", "lifts.h5")
    lifts = values_of("lifts.h5")
    assert lifts["contact/foot/impacts"] > 10
    assert lifts["contact/bolts/impacts"] > 10
    # Over time both carry the weight together.
    carried = lifts["contact/foot/mean_force"] - lifts["contact/bolts/mean_force"]
    assert carried == pytest.approx(weight, rel=0.05)


def test_coaxial_shafts_answer_both_unbalances(folder):
    """After long the motion is the sum of the responses to both, each at its own frequency."""
    text = re.sub(r"(?m)^&record.*\n|^&response.*\n", "", COAXIAL.read_text())
    places = ("inner.7.v", "outer.5.w")
    case = folder / "coaxial.nml"
    case.write_text(
        text
        + "".join(
            f"&record observable='displacement', of='{of}', what='trajectory', from=3.9, interval=1e-4 /\n"
            for of in places
        )
        + "&response parameter='rotation%speed_rpm', first=4000.0, last=5000.0, points=3 /\n"
    )
    found, omega = phasors(case, 2)
    assert np.sort(omega) == pytest.approx(5000 * np.pi / 30 * np.array([1.0, 1.4]), rel=1e-12)
    succeed("razy-run", case, *sets(motion__t_end=4.0))
    seen = values_of("coaxial.h5")
    for of in places:
        right = sum(
            (phasor * np.exp(1j * w * seen["observable/time"])).real
            for phasor, w in zip(found[f"displacement.{of}"], omega, strict=True)
        )
        assert abs(seen[f"observable/displacement.{of}"] - right).max() < 1e-8 * abs(right).max()


def test_balls_carry_in_turn(folder):
    """The weight passes from ball to ball: that frequency is the strongest in how high the shaft lies."""
    succeed("razy-run", SOURCE / "inputs" / "ball_bearing.nml", "--output", "balls.h5")
    found = values_of("balls.h5")
    height = found["observable/displacement.rotor.1.v"]
    assert 5.0e-6 < -height.max() < -height.min() < 1.0e-5
    spectrum = abs(np.fft.rfft((height - height.mean()) * np.hanning(height.size)))
    spacing = 1 / (height.size * 1e-4)
    passing = 8 * 50.0 * (1 - 0.0119 / 0.052) / 2
    strongest = np.argmax(spectrum) * spacing
    assert abs(strongest - passing) < 1.5 * spacing
