"""Branches of motions with friction that sticks, slides, or turns round with each bounce of a stop."""

from pathlib import Path

import numpy as np
import pytest
from branches import follow, labels, points


def test_what_sticks_at_the_phase_of_the_state_has_no_speed():
    """One of rounding would make it slide at once, with derivatives of any size (the branch ended by them)."""
    Path("stuck.nml").write_text(
        "&scene kind='lumped' /\n&mass name='a', value=2.0 /\n&mass name='b', value=3.0 /\n"
        "&spring between='a','frame', stiffness=100.6, damping=0.3 /\n"
        "&spring between='b','frame', stiffness=1.9, damping=0.4 /\n&damper between='a','b', damping=0.1 /\n"
        "&stop name='stop', between='a','b', side='upper', clearance=0.0, stiffness=100.0, damping=0.1 /\n"
        "&friction name='moves', between='a','frame', static_coefficient=0.5, kinetic_coefficient=0.25, "
        "normal_load=1.0 /\n&friction name='holds', between='b','frame', static_coefficient=1.0, normal_load=1.0 /\n"
        "&load on='a', value=1.0, amplitude=1.5, angular_frequency=1.0 /\n"
        "&motion t_end=400.0, start='zero' /\n&record observable='displacement', of='a', what='extrema' /\n"
        "&follow parameter='load%amplitude', first=1.5, last=1.6 /\n"
    )
    with follow(Path("stuck.nml")) as file:
        assert list(file["special/label"].asstr()) == ["EP"]
        assert (file["point/stable"][:] == 1).all()
        assert file["point/multiplier_error"][:].max() < 1e-3


def test_what_sticks_at_the_phase_has_no_speed_of_rounding_either():
    """Its rows of the derivative are 0: stiff springs leave rounding there, by which speeds came to be."""
    friction = "static_coefficient={}, kinetic_coefficient=0.5, normal_load={}"
    text = "&scene kind='lumped' /\n" + "".join(f"&mass name='b{i}', value=3.0 /\n" for i in range(3))
    for i, stiffness in enumerate((10000.225, 0.225, 10000.225)):
        text += f"&spring between='b{i}','frame', stiffness={stiffness}, damping=0.15 /\n"
    for i in range(2):
        ends = f"between='b{i}','b{i + 1}'"
        text += f"&stop name='s{i}', {ends}, side='lower', clearance=1.0, stiffness=100.0, "
        text += f"separation='zero_deformation' /\n&friction name='f{i}', {ends}, {friction.format(0.5, 1.0)} /\n"
    text += f"&friction name='f2', between='b0','frame', {friction.format(1.0, 2.0)} /\n"
    text += f"&friction name='f3', between='b2','frame', {friction.format(1.0, 2.0)} /\n"
    text += "&load on='b0', value=-1.0, amplitude=2.0, angular_frequency=0.5 /\n&load on='b2', value=-1.0 /\n"
    text += "&motion t_end=800.0, start='zero' /\n&record observable='displacement', of='b0', what='extrema' /\n"
    text += "&follow parameter='load(1)%angular_frequency', first=0.5, last=0.75, max_points=12 /\n"
    Path("held.nml").write_text(text)
    with follow(Path("held.nml")) as file:
        assert "MX" not in set(file["special/label"].asstr())


def test_one_label_a_place():
    """Friction on a stop turns round within each touch and comes to stick, or slides either way, as the stop opens."""
    text = "&mass name='a', value=1.0 /\n&spring between='a','frame', stiffness=1.0, damping=0.1 /\n"
    text += "&stop name='s', between='a','frame', side='upper', clearance=1.0, stiffness=10.0 /\n"
    text += "&mass name='c', value=1.0 /\n&spring between='c','frame', stiffness=1.0, damping=0.1 /\n"
    text += "&friction name='f', between='c','a', static_coefficient=0.5, normal_contact='s' /\n"
    text += "&load on='a', amplitude=1.0, angular_frequency=1.0 /\n&motion t_end=100.0, start='zero' /\n"
    text += "&follow parameter='load%amplitude', first=0.05, last=1.0 /\n"
    Path("rubs.nml").write_text(text)
    with follow(Path("rubs.nml")) as file:
        assert file["special/label"].asstr()[:].tolist() == ["GR", "ST", "SL", "EP"]
        assert file["special/contact"].asstr()[:].tolist() == ["s", "f", "f", ""]
        assert points(file, "GR") == pytest.approx(0.1, rel=1e-12)
        # Friction slides one way or the other for no time before the stop opens.
        last = file["event/offset"][file["special/point"][2] :][:2]
        assert np.diff(file["event/time"][last[0] : last[1]])[-1] < 1e-11


def test_what_sticks_stays_where_it_is():
    """A body on a belt hits one that sticks all the time, whose place differences of the parameter move by rounding."""
    text = "&mass name='a', value=2.0 /\n&mass name='b', value=2.0 /\n"
    text += "&spring between='a','frame', stiffness=2.4, damping=0.4 /\n"
    text += "&spring between='b','frame', stiffness=2.4, damping=0.4 /\n&damper between='a','b', damping=10.0 /\n"
    text += "&stop name='s', between='a','b', side='upper', clearance=0.001, stiffness=1e4 /\n"
    text += "&friction name='belt', between='a','frame', static_coefficient=1.0, normal_load=1.0, belt_speed=1.0 /\n"
    text += "&friction name='f', between='b','frame', normal_load=10.0, "
    text += "static_coefficient=0.5, kinetic_coefficient=0.25 /\n"
    text += "&load on='a', amplitude=1.5, angular_frequency=2.0 /\n&load on='b', value=1.5 /\n"
    text += "&motion t_end=200.0, start='zero' /\n"
    text += "&follow parameter='load(1)%angular_frequency', first=2.0, last=2.3, doublings=0 /\n"
    Path("held.nml").write_text(text)
    with follow(Path("held.nml")) as file:
        place = file["point/state"][:, 1]
        assert place.size > 20
        assert np.abs(place - place[0]).max() < 1e-13


def rubs_and_bounces(damping, stop, load, followed):
    """A body of a spring that rubs on the frame and comes to rest on a rigid stop, by as many bounces as there are."""
    text = f"&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0, damping={damping} /\n"
    text += f"&stop name='wall', between='m','frame', law='rigid', {stop} /\n{load}"
    text += "&friction name='rub', between='m','frame', static_coefficient=0.1, normal_load=1.0 /\n"
    text += "&motion t_end=2500.0, start='zero' /\n&record observable='displacement', what='extrema' /\n"
    Path("rub.nml").write_text(text + f"&follow {followed} /\n")
    return follow(Path("rub.nml"))


def test_friction_that_turns_round_with_each_bounce():
    """Rounding says how many bounces there are, and so how often it does: neither is a change of the motion."""
    load = "&load on='m', amplitude=1.0, angular_frequency=0.35 /\n"
    stop = "clearance=0.5, restitution=0.6"
    with rubs_and_bounces(0.57, stop, load, "parameter='stop%clearance', first=0.5, last=0.75, max_points=80") as file:
        assert labels(file, 1) == [("EP", pytest.approx(0.75))]
        events = file["point/events"][:]
    # So there were such changes.
    assert events[0] > events[-1] > 20


def test_motions_beside_a_touch_are_told_once():
    """Where the motion that ends at a touch goes on at both sides of it, one of them is that which has come there."""
    load = "&load on='m', amplitude=0.5, angular_frequency=1.0, shape='square', duty=0.25 /\n"
    load += "&load on='m', amplitude=0.5, angular_frequency=1.0 /\n"
    stop = "side='both', clearance=0.2, restitution=0.5"
    with rubs_and_bounces(0.1, stop, load, "parameter='load(1)%amplitude', first=0.25, last=0.18") as file:
        label, value = file["special/label"].asstr()[:], file["special/parameter"][:]
        assert list(label).count("SL") > 2
    slips = np.sort(value[label == "SL"])
    assert np.all(np.diff(slips) > 1e-6)
