"""Round numbers, by which several contacts come to their bounds together: `exact` and Runge-Kutta methods are right.

The state is not recorded, as in a sweep: the way through events is another where it is.
"""

import math
import os
import subprocess
from pathlib import Path

import h5py
import pytest

RUN = Path(os.environ["RAZY_BUILD"]) / "bin" / "razy-run"
FOLDER = Path(__file__).parent / "data" / "coincidences"
# Two bounces: falls of 0.1 m, and half turns at 100 rad/s about the place where the stops carry the body.
FLIGHT = 1.0 - 5 * math.sqrt(0.02) - 6 * (math.pi - math.atan(10 * math.sqrt(2))) / 100
# Events, and the last value of the record, by closed forms or an independent code.
RIGHT = {
    # A body on its stop that its load, at rest at first, presses and pulls: as with the amplitude -1 and no phase.
    "phase_180": (15, 0.0151886174359572),
    # Two bodies whose loads let them go from their walls at the same moment.
    "walls_left_together": (2, -0.1531144390757335),
    # Two stops between the same bodies open together; then b is free: 10 pi/(3 w^2) + 20/(3 w) (1 - 1/22), w = 22 pi.
    "stops_side_by_side": (2, 0.09426532442081957),
    # Two clutches at their limits together: one slips, with less friction, and the other holds on.
    "clutches_slip_together": (3, 7.58878119016937),
    # Friction slips from rest: rate and acceleration of sliding are 0 there.
    "friction_from_rest": (32, 1.50447104025837),
    # Gap, rate and acceleration are 0 at first.
    "resting_on_sprung_table": (7, 0.29235070836815),
    # Both stops of a symmetric press close together: as one body with their mass on one stop.
    "symmetric_press": (6, 0.2938191405203905),
    # Frictions far below their limits, under a load of the size of rounding: all bodies move together.
    "frictions_in_series": (0, 1e-16 * 2 / 3),
    # From t = 0.385 s on all move as one, 1/6 m at the end, with what the springs were then.
    "frictions_at_rest_together": (2, 1 / 6 + 0.0075),
    # As one body with their mass: sin t - t, two stops for two at each sign of the force.
    "edges_on_both_sides": (12, -10.54402111088937),
    # As one body, 9 x'' + 20 x' + 2 x = sin t.
    "no_clearance": (2, 0.03462847730373899),
    # Stops on both sides without clearance take the speed of one to the other at once: 3 m/s of 1 kg are 1 m/s of 3 kg.
    "speed_between_edges": (2, 1.0),
    # Two frictions that weaken come to their limits together, sin t = 0.75: the one next to the load slides.
    "frictions_weaken_together": (1, 0.49124657760176416),
    # Two frictions of one body hold the sum of their static limits, 4 N, and slide with 2 N: x'' = t - 2 from then on.
    "frictions_side_by_side": (3, 1 + 1 / 6),
    # Equal clutches in series come to their limits, 2 N, together: the one next to the load slides, with 1 N.
    "clutches_in_series": (1, 2 + 8 / 6),
    # Two bodies are pulled off a third with equal forces beyond the limits: it stays, and both slide.
    "pulled_apart": (0, 4.0),
    # Friction at its limit from the start, under a load that grows by less than a damper beside takes:
    # 2 x'' + x' + x = 2 + sin(t)/2.
    "damper_holds_friction": (0, 1.449571395425005),
    # Bodies that move alike, their stop closed by a load: 5 x'' = 2.
    "moving_alike": (0, 10.0),
    # Friction slides after each impact of a sequence and sticks before the next, to its end.
    "friction_sticks_in_each_flight": (54, -0.92694610106),
    # Friction that weakens as it slides and friction that does not come to their limits together: the former slides.
    "frictions_of_both_kinds": (8, 1.7077169650578),
    # A stop without clearance between bodies that friction joins as well: its gap is 0 as long as that sticks.
    "stop_beside_friction": (29, 0.621444946275),
    # The same, beside friction on a belt and hundreds of impacts.
    "stop_held_by_friction": (611, -0.99999979769514),
    # Friction that slides and sticks again stays where it sticks anew.
    "friction_sticks_anew": (51, 19.84245394984976),
    # Two bodies rattle in others, which friction joins between impacts: each flight is 3 % of the one before.
    "rattlers_joined_by_friction": (157, -6.55159065604741),
    # Gap, rate and two more derivatives are 0 at first, as are the loads: what drives it comes with its own rounding.
    "loads_begin_at_zero": (38, 3.0345362872966),
    # Nothing moves; one friction after the other comes to its limit.
    "frictions_at_their_limits": (6, 0.0),
    # Friction comes to its limit as a stop opens, and no further: -3 ** 0.5 t - t ** 2 / 2 from pi / 3 on.
    "stop_opens_at_the_limit": (1, -(3**0.5) * (2 - math.pi / 3) - (2 - math.pi / 3) ** 2 / 2),
    # A ramp ends at the limit of friction: what comes after it decides.
    "ramp_to_the_limit": (0, 0.0),
    # Both sides of a mesh part and are limited: five switching functions at one time (Runge-Kutta's value).
    "limited_without_backlash": (753, -15.4795288419412),
    # Friction beyond its limit since a further pair of teeth came in slides from then on: Runge-Kutta was late.
    "teeth_come_in": (22, -6.24840115760284),
    # Friction that nothing presses at first, under a load that grows sooner: x'' = 5 sin t - 5 (1 - cos 10t).
    "pressed_from_zero": (1, 5.67520010364179e-6),
    # Forces of feet that come to rest are beyond their limits: both feet of a body hold their sum (an own code).
    "beyond_the_limit_as_it_sticks": (92, 0.00052807466276),
    # An impact as friction comes to its limit: the rider was taken along as if it stuck, 0.8 mm less.
    "hit_at_the_limit": (2, 0.004983057503699689),
    # Bodies at rest on bounds until they are pushed by one on which a load acts; a matrix exponential.
    "rest_beside_a_pushed_body": (3, 0.0112156361701477),
}
# The same where forces are not unique, and so how often contacts change is not.
VALUES = {
    "row_between_walls": 0.0,
    # As one body with their mass, whose mean speed is 0.5 m/s at first.
    "forces_vanish_together": 0.4 * 5 + math.sin(50) / 100,
    "lands_on_jammed_bodies": ((1 - math.cos(1)) / 4 + 0.5 - math.sin(0.5) - 0.5**3) / 12 - 0.001 / 4,
    "rest_in_company": -0.0008,
    # Bodies at rest on a bound, without a load, beside a machine that they have nothing to do with.
    "rest_beside_motion": 0.0,
    # A stop opens as friction sticks; an impact of another one comes before its gap is more than rounding.
    "drawn_away_by_rounding": 3.12634374421,
    # What presses friction is 0 at first, and its sign was chosen anew without end by Runge-Kutta.
    "pressed_from_rest": 0.0,
    # A stop without gap rests until the row is pushed: the modes of the row feel rounding of the load (dop853's value).
    "rest_beside_a_square_load": 1.39096874999999,
    # Friction exactly at its limit beside a stiff slider, whose force rounds: both move on as one body.
    "limit_beside_a_stiff_slider": -0.5,
    # A brake exactly at its limit, beside another friction that turns round: Runge-Kutta let both go.
    "brake_at_its_limit": 0.0,
    # Both feet land while those above bear nothing yet: which friction slides went round (three methods agree).
    "lower_feet_land": -0.0030301034306471,
    # Feet slide towards each other, the lines of their forces through the centre of mass: both press alike, x'' = 1.
    "feet_through_the_centre": 0.075,
    # Feet without gap or force close at once: their friction is in play, though the stops are open at first.
    "feet_press_from_zero": -8.0814914791595e-5,
    # A light body squeezed without clearance: one gap opens at a rate that is rounding as another flies for 1e-12 s.
    "squeezed_at_the_start": 0.0,
    # Squeezed between a stop that loses speed and one that does not: the latter bounced on within rounding for ever.
    "squeezed_without_loss": 2.50148410623793,
    # Which way a stop presses was told by rounding of its force: friction at the wall slid by dop853, 3 % more.
    "corner_turned_round": 0.10232572232391993,
    # A body bounces on two feet with friction, whose forces vanish as the stops open: one flies as if it had one foot.
    "feet_leave_together": -0.1 + math.sqrt(2) * FLIGHT - 5 * FLIGHT**2,
}
TIGHT = ["motion%relative_tolerance=1e-12", "motion%absolute_tolerance=1e-15"]


def run(folder, path, integrator, settings=()):
    """The number of events, and the record's last value."""
    words = [word for setting in (f"motion%integrator='{integrator}'", *settings) for word in ("--set", setting)]
    result = folder / f"{integrator}.h5"
    done = subprocess.run(
        [RUN, path, "--output", result, *words], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    with h5py.File(result) as file:
        (record,) = (values for name, values in file["observable"].items() if name != "time")
        return int(file["outcome/events"][0]), record[-1]


@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5"])
@pytest.mark.parametrize("name", sorted(RIGHT))
def test_what_comes_together_is_decided_together(name, integrator, tmp_path):
    events, value = run(tmp_path, FOLDER / f"{name}.nml", integrator, [] if integrator == "exact" else TIGHT)
    right_events, right_value = RIGHT[name]
    assert events == right_events
    assert value == pytest.approx(right_value, rel=1e-8, abs=1e-15 if right_value == 0 else 1e-18)


@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5"])
@pytest.mark.parametrize("name", sorted(VALUES))
def test_what_is_jammed_or_rests_stays(name, integrator, tmp_path):
    _, value = run(tmp_path, FOLDER / f"{name}.nml", integrator, [] if integrator == "exact" else TIGHT)
    assert value == pytest.approx(VALUES[name], rel=1e-10 if integrator == "radau5" else 1e-11, abs=1e-15)


def test_frictions_side_by_side_by_switching(tmp_path):
    path = FOLDER / "frictions_side_by_side.nml"
    _, value = run(tmp_path, path, "dop853", ["motion%treatment='switching'", *TIGHT])
    assert value == pytest.approx(RIGHT["frictions_side_by_side"][1], rel=1e-5)


@pytest.mark.parametrize("integrator", ["exact", "dop853", "radau5"])
def test_rounding_of_a_load_that_is_held_moves_nothing(integrator, tmp_path):
    assert run(tmp_path, FOLDER / "rest_beside_a_held_load.nml", integrator) == (0, 0.0)


def test_rounding_of_a_load_that_changes_sides_moves_nothing(tmp_path):
    assert run(tmp_path, FOLDER / "no_force_beside_a_held_load.nml", "exact") == (1, 0.0)


def test_the_matrix_exponential_gives_solutions(tmp_path):
    # Nothing but dampers and loads: the residual was measured by displacements without a mode of their own.
    _, value = run(tmp_path, FOLDER / "dampers_alone.nml", "exact")
    assert value == pytest.approx(-0.495662868239, rel=1e-8)


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_gaps_that_open_together_do_so(integrator, tmp_path):
    # After an impact of both feet the gap of one is below 0 by rounding: it opens with 0.46 m/s, and nothing stops it.
    _, value = run(tmp_path, FOLDER / "gaps_open_together.nml", integrator, [] if integrator == "exact" else TIGHT)
    assert value == pytest.approx(0.0036, rel=1e-9)


def test_flights_that_are_rounding_end(tmp_path):
    # A flight of 20 roundings of the gap is less than what the terms of the closed form give it: its end has no time.
    # The value is that of dop853, with 137 impacts.
    _, value = run(tmp_path, FOLDER / "flights_of_rounding.nml", "exact")
    assert value == pytest.approx(1.3317979901607, rel=1e-11)


def test_flights_end_as_they_do_alone(tmp_path):
    # A machine beside, which moves farther, does not measure what is rounding: the value is that without it.
    _, value = run(tmp_path, FOLDER / "flights_beside_motion.nml", "exact")
    assert value == pytest.approx(0.000182220150797, rel=1e-10)


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
@pytest.mark.parametrize(
    "name, value",
    [
        # A clutch grips as the load begins that it can just carry: 1 m/s, and 1 m/s^2 from then on.
        ("clutch_grips_as_load_begins", 6.5),
        ("ramp_on_bodies_alike", 1 - math.sin(8) + math.sin(7)),
    ],
)
def test_what_no_contact_feels_sees_breaks_of_loads(name, value, integrator, tmp_path):
    # The closed form of the state beside went on as before the break.
    result = tmp_path / "result.h5"
    settings = ["--set", f"motion%integrator='{integrator}'", "--set", "motion%relative_tolerance=1e-12"]
    subprocess.run([RUN, FOLDER / f"{name}.nml", "--output", result, *settings], check=True, timeout=60)
    with h5py.File(result) as file:
        assert file["state/displacement"][-1, 0] == pytest.approx(value, rel=1e-9)
        assert file["outcome/residual"][0] < 1e-8


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_a_machine_beside_shares_no_forces_anew(integrator, tmp_path):
    # A stop and friction between the same bodies share a force, and that of the stop presses another friction: the
    # motion depends on the share, and impacts of a body that has nothing to do with them changed it.
    text = (FOLDER / "shared_forces.nml").read_text()
    (tmp_path / "beside.nml").write_text(
        text + "&mass name='u', value=0.7 /\n&spring between='u','frame', stiffness=37.0, damping=0.3 /\n"
        "&stop name='w', between='u','frame', clearance=0.013, law='rigid', restitution=0.7 /\n"
        "&load on='u', amplitude=3.1, angular_frequency=4.7 /\n"
    )
    _, alone = run(tmp_path, FOLDER / "shared_forces.nml", integrator, [] if integrator == "exact" else TIGHT)
    (tmp_path / f"{integrator}.h5").unlink()
    events, beside = run(tmp_path, tmp_path / "beside.nml", integrator, [] if integrator == "exact" else TIGHT)
    assert events > 20
    assert beside == pytest.approx(alone, rel=1e-10)


def test_two_rigid_contacts_collapse_together(tmp_path):
    # A body between two others, one contact without restitution: impacts without end take both gap rates to 0 at one
    # moment, and leave the momentum of the three bodies as it is.
    path = FOLDER / "collapse.nml"
    result = tmp_path / "collapse.h5"
    subprocess.run([RUN, path, "--output", result], check=True, timeout=60)
    with h5py.File(result) as file:
        time, velocity = file["state/time"][:], file["state/velocity"][:, :3]
        last, contact = file["event/time"][-1], file["event/contact"][-1]
    assert last == pytest.approx(0.01465318190074, abs=1e-14)
    assert contact == 4
    momentum = velocity @ [0.8807166840270142, 0.43719652406475296, 2.3471545174064397]
    before, after = (time < last).nonzero()[0][-2:], (time > last).nonzero()[0][:2]
    at = [extrapolated(time[i] - last, values[i]) for i in (before, after) for values in (momentum, velocity)]
    assert at[2] == pytest.approx(at[0], rel=1e-10)
    assert at[3][1] - at[3][0] == pytest.approx(0.0, abs=1e-11)
    assert abs(at[1][1] - at[1][0]) > 1e-8


@pytest.mark.parametrize("integrator", ["dop853", "radau5"])
def test_adaptive_methods_collapse_too(integrator, tmp_path):
    # Gaps of the last impacts are rounding. Were one of the rates not 0 then, impacts of 1 mm/s would follow.
    last = []
    for method in ("exact", integrator):
        settings = [
            f"motion%integrator='{method}'",
            "motion%t_end=0.03",
            "record%from=0.0",
            "record%interval=0.001",
            *TIGHT,
        ]
        words = [word for setting in settings for word in ("--set", setting)]
        result = tmp_path / f"{method}.h5"
        subprocess.run([RUN, FOLDER / "collapse.nml", "--output", result, *words], check=True, timeout=60)
        with h5py.File(result) as file:
            last.append(file["state/displacement"][-1])
    assert last[1] == pytest.approx(last[0], rel=1e-10)


def extrapolated(time, values):
    """Values at the time 0 of a line through two points."""
    return values[0] - time[0] * (values[1] - values[0]) / (time[1] - time[0])
