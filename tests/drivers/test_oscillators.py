"""The oscillators of chapters 2 and 3 of the source: their inputs are accepted, and closed forms come out."""

import h5py
import numpy as np
import pytest
from programs import SOURCE, succeed

INPUTS = SOURCE / "inputs"
NAMES = (
    "listing_oscillator", "belt_oscillator", "bouncing_ball", "bouncing_ball_table", "drop_test", "block_on_belt",
    "incline", "filippov", "two_sided_stop", "shock_on_stop", "square_wave_walls",
)  # fmt: skip
OPEN, LOWER = 1, 3
FORWARD, BACKWARD, STICKING = 1, 2, 3
GRAVITY = 9.81


def run(name):
    succeed("razy-run", INPUTS / f"{name}.nml")
    return h5py.File(f"{name.split('/')[-1]}.h5")


def events(file):
    return file["event/time"][:], file["event/state"][:]


@pytest.mark.parametrize("name", NAMES)
def test_input_is_accepted(name):
    succeed("razy-run", INPUTS / f"{name}.nml", "--check")


def test_bouncing_ball_comes_to_rest_at_the_accumulation_point():
    with run("bouncing_ball") as file:
        time, state = events(file)
        heights = file["extrema/displacement/value"][:][file["extrema/displacement/kind"][:] > 0]
        height, velocity = file["state/displacement"][-1, 0], file["state/velocity"][-1, 0]
    fall, e = np.sqrt(2 / GRAVITY), 0.8
    (rest,) = time[state == LOWER]
    assert rest == pytest.approx(fall * (1 + e) / (1 - e), abs=1e-10)
    bounces = np.arange(12)
    np.testing.assert_allclose(time[:12], fall * (1 + 2 * e * (1 - e**bounces) / (1 - e)), rtol=1e-12)
    np.testing.assert_allclose(heights[:12], e ** (2 * (bounces + 1)), rtol=1e-11)
    assert (height, velocity) == pytest.approx((0.0, 0.0), abs=1e-13)


def test_ball_leaves_the_table_where_it_falls_away_with_gravity():
    with run("bouncing_ball_table") as file:
        time, state = events(file)
    landed = np.flatnonzero(state == LOWER)
    landed = landed[landed < time.size - 1]
    assert landed.size > 3
    angular = 2 * np.pi * 6.0
    leaving = time[landed + 1]
    assert (state[landed + 1] == OPEN).all()
    np.testing.assert_allclose(0.01 * angular**2 * np.sin(angular * leaving), GRAVITY, rtol=1e-9)
    assert (np.cos(angular * leaving) > 0).all()


def test_drop_test_gives_the_restitution():
    with run("drop_test") as file:
        heights = file["extrema/displacement/value"][:][file["extrema/displacement/kind"][:] > 0]
    # Rebound speed u = e v of Hunt and Crossley: c v - ln(1 + c v) = -c u - ln(1 - c u).
    v, c = np.sqrt(2 * GRAVITY * 0.1), 0.15
    low, high = 0.0, v
    for _ in range(60):
        middle = 0.5 * (low + high)
        more = -c * middle - np.log1p(-c * middle) > c * v - np.log1p(c * v)
        low, high = (low, middle) if more else (middle, high)
    # Weight and mass are rounded in the input, and gravity acts during the contact.
    assert np.sqrt(heights[0] / 0.1) == pytest.approx(low / v, rel=2e-4)


def test_block_takes_the_speed_of_the_belt():
    with run("block_on_belt") as file:
        time, state = events(file)
        end = file["state/displacement"][-1, 0], file["state/velocity"][-1, 0]
    assert state.tolist() == [STICKING]
    assert time[0] == pytest.approx(0.5, abs=1e-12)
    assert end == pytest.approx((0.75, 1.0), abs=1e-12)


def test_body_sticks_on_the_incline():
    with run("incline") as file:
        time, state = events(file)
        end = file["state/displacement"][-1, 0], file["state/velocity"][-1, 0]
    slowing = 3.3552176 + 0.4 * 9.2183946
    assert state.tolist() == [STICKING]
    assert time[0] == pytest.approx(2 / slowing, abs=1e-12)
    assert end == pytest.approx((2 / slowing, 0.0), abs=1e-12)


def test_body_slides_back_on_a_smoother_incline():
    friction = ["--set", "friction%static_coefficient=0.3", "--set", "friction%kinetic_coefficient=0.2"]
    succeed("razy-run", INPUTS / "incline.nml", *friction)
    with h5py.File("incline.h5") as file:
        time, state = events(file)
        velocity = file["state/velocity"][-1, 0]
    turn = 2 / (3.3552176 + 0.2 * 9.2183946)
    assert state[-1] == BACKWARD
    np.testing.assert_allclose(time, turn, atol=1e-12)
    assert velocity == pytest.approx(-(3.3552176 - 0.2 * 9.2183946) * (0.6 - turn), abs=1e-12)


def test_filippov_slides():
    with run("filippov") as file:
        time, state = events(file)
        velocity = file["observable/velocity"][:]
        stored = file["time"][:]
    assert state.tolist() == [STICKING]
    assert time[0] == pytest.approx(3.0, abs=1e-12)
    np.testing.assert_allclose(velocity, np.maximum(3.0 - stored, 0.0), atol=1e-12)


def test_belt_lets_go_at_its_static_friction():
    with run("belt_oscillator") as file:
        time, state = events(file)
        stored, place = file["time"][:], file["state/displacement"][:, 0]
        velocity = file["state/velocity"][:, 0]
    slips, sticks = time[state == BACKWARD], time[state == STICKING]
    assert slips.size > 3
    np.testing.assert_allclose(np.diff(slips)[1:], np.diff(slips)[1], atol=1e-9)
    # A stick phase ends at x = 1 and is a straight line; all the limit cycle repeats.
    for stick, slip in zip(sticks, slips, strict=False):
        inside = (stored > stick) & (stored < slip)
        np.testing.assert_allclose(velocity[inside], 0.2, atol=1e-12)
        np.testing.assert_allclose(place[inside], 1.0 - 0.2 * (slip - stored[inside]), atol=1e-9)


def test_two_sided_stop_keeps_its_energy():
    with run("thesis/fig_2_5") as file:
        place, velocity = file["state/displacement"][:, 0], file["state/velocity"][:, 0]
    over = np.maximum(np.abs(place) - 7e-4, 0.0)
    energy = 0.5 * 3.5 * velocity**2 + 0.5e5 * place**2 + 0.5e6 * over**2
    np.testing.assert_allclose(energy, 0.07, rtol=1e-12)


def test_damped_stop_loses_energy():
    with run("thesis/fig_2_5_damped") as file:
        place, velocity = file["state/displacement"][:, 0], file["state/velocity"][:, 0]
    over = np.maximum(np.abs(place) - 7e-4, 0.0)
    energy = 0.5 * 3.5 * velocity**2 + 0.5e5 * place**2 + 0.5e6 * over**2
    assert (np.diff(energy) < 0).all()


def test_three_ways_through_the_listing():
    """Exact events, smoothing and switching at the tolerances of the thesis stay near one another."""
    paths = []
    for name in ("thesis/fig_3_9", "thesis/listing_a_1", "thesis/listing_a_2"):
        with run(name) as file:
            paths.append(file["state/displacement"][:3000, 0])
    for path in paths[1:]:
        assert np.abs(path - paths[0]).max() < 0.05
