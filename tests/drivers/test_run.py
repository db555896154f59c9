"""What razy-run computes and writes."""

import f90nml
import h5py
import numpy as np
import pytest
from programs import GEAR_PAIR, SOURCE, TWO_SIDED_STOP, attribute, changed, datasets, left, names, sets, start, succeed


def test_extrema_alone_store_no_trajectory():
    succeed("razy-run", GEAR_PAIR)
    stored = names("torsional_gear_pair.h5")
    assert "extrema/mesh_deformation/value" in stored
    assert not {"time", "state", "observable", "sample"} & {name.split("/")[0] for name in stored}


def test_trajectory_alone_stores_no_extrema():
    succeed("razy-run", GEAR_PAIR, *sets(record__what="'trajectory'", record__interval=1e-3, motion__t_end=0.3))
    assert not [name for name in names("torsional_gear_pair.h5") if name.startswith(("extrema", "state"))]


def test_extrema_and_trajectory_agree(folder):
    case = changed(
        folder / "case.nml", GEAR_PAIR.read_text(),
        ("what='extrema', from=0.25", "what='extrema','trajectory', from=0.28, interval=1e-6"),
        ("speed_rpm=1500.0", "speed_rpm=1900.0"),
    )  # fmt: skip
    succeed("razy-run", case)
    with h5py.File("case.h5") as file:
        time = file["time"][:]
        deformation = file["observable/mesh_deformation"][:]
        extrema = file["extrema/mesh_deformation"]
        value, when, kind = extrema["value"][:], extrema["time"][:], extrema["kind"][:]
    np.testing.assert_allclose(time, 0.28 + 1e-6 * np.arange(time.size), rtol=1e-14)
    assert time.size in (20000, 20001)
    inside = (when > time[1]) & (when < time[-2])
    sampled = np.sign(np.diff(deformation))
    turns = np.flatnonzero(sampled[1:] * sampled[:-1] < 0) + 1
    assert turns.size == inside.sum() > 20
    assert np.array_equal(sampled[turns - 1], kind[inside])
    assert np.all(np.abs(time[turns] - when[inside]) <= 1e-6)
    sampled_error = value[inside] - deformation[turns]
    assert np.all(sampled_error * kind[inside] >= -1e-18)
    assert np.abs(sampled_error).max() < 1e-7


def test_natural_times_hold_the_events(folder):
    case = changed(
        folder / "case.nml", GEAR_PAIR.read_text(), ("what='extrema', from=0.25", "what='trajectory', from=0.25"),
        ("speed_rpm=1500.0", "speed_rpm=1900.0"),
    )  # fmt: skip
    succeed("razy-run", case)
    with h5py.File("case.h5") as file:
        time, event = file["time"][:], file["event/time"][:]
    assert np.all(np.diff(time) >= 0)
    assert 0.25 <= time[0] < 0.2505 and time[-1] == 0.3
    event = event[event > 0.25]
    assert event.size > 20
    after = np.clip(np.searchsorted(time, event), 1, time.size - 1)
    nearest = np.minimum(np.abs(time[after] - event), np.abs(time[after - 1] - event))
    assert np.all(nearest <= 2 * np.spacing(0.3))


def test_static_start_is_the_equilibrium_under_the_constant_loads():
    record = sets(record__what="'trajectory'", record__from=0, record__interval=1e-3, gear_mesh__error_sine=0)
    succeed("razy-run", GEAR_PAIR, *record, "--output", "static.h5")
    with h5py.File("static.h5") as file:
        assert file["event/time"].size == 0
        np.testing.assert_allclose(file["observable/mesh_deformation"][:], 100.0 / 0.08 / 8e8, rtol=1e-9)
    succeed("razy-run", GEAR_PAIR, *record, *sets(motion__start="'zero'"), "--output", "zero.h5")
    with h5py.File("zero.h5") as file:
        deformation = file["observable/mesh_deformation"][:]
    assert abs(deformation[0]) < 1e-18
    assert np.ptp(deformation) > 1e-6


def test_two_sided_stop_against_its_closed_form():
    succeed("razy-run", TWO_SIDED_STOP)
    mass, inner, outer, clearance = 3.5, 1e5, 1e6, 7e-4
    with h5py.File("two_sided_stop.h5") as file:
        x, v = file["state/displacement"][:], file["state/velocity"][:]
        force, event = file["extrema/contact_force/value"][:], file["event/time"][:]
        branch = file["event/state"][:]
        assert list(file["state/displacement"].attrs["names"]) == ["body"]
        axis = 0 if x.shape[0] == 1 else 1
    x, v = x.squeeze(axis), v.squeeze(axis)
    assert x.size == 1001 and x[0] == 0.0
    np.testing.assert_allclose(v[0], 0.2, rtol=1e-14)
    beyond = np.maximum(np.abs(x) - clearance, 0.0)
    energy = 0.5 * (mass * v**2 + inner * x**2 + outer * beyond**2)
    np.testing.assert_allclose(energy, 0.07, rtol=1e-12)
    # deepest penetration p: inner (clearance + p)^2 + outer p^2 = mass v0^2
    depth = np.roots([inner + outer, 2 * inner * clearance, inner * clearance**2 - mass * 0.2**2]).max()
    np.testing.assert_allclose(np.abs(force), outer * depth, rtol=1e-12)
    assert np.array_equal(np.sign(force), np.resize([1, -1], force.size))
    omega = np.sqrt(inner / mass)
    np.testing.assert_allclose(event[0], np.arcsin(clearance * omega / 0.2) / omega, rtol=1e-13)
    assert branch[:4].tolist() == [2, 1, 3, 1]


def test_effective_input_reads_back_to_the_same_bytes(folder):
    options = sets(rotation__speed_rpm=1712.3456789, motion__t_end="0.1", record__from=0.05)
    succeed("razy-run", GEAR_PAIR, *options, "--output", "first.h5")
    text = attribute("first.h5", "input")
    assert text == succeed("razy-run", GEAR_PAIR, *options, "--check").stdout
    groups = f90nml.reads(text)
    assert groups["rotation"]["speed_rpm"] == 1712.3456789
    assert groups["gear_mesh"]["teeth"] == [40, 40]
    assert groups["gear_mesh"]["damping"] == 0.0
    assert [inertia["name"] for inertia in groups["inertia"]] == ["motor", "pinion", "wheel", "output"]
    assert groups["motion"]["max_events"] > 0
    (folder / "again.nml").write_text(text)
    succeed("razy-run", "again.nml", "--output", "second.h5")
    assert attribute("second.h5", "input") == text
    assert datasets("second.h5") == datasets("first.h5")


def test_motion_that_ends_early_is_stored_and_exit_code_1():
    done = start("razy-run", GEAR_PAIR, *sets(rotation__speed_rpm=1900, motion__max_events=100, record__from=0))
    assert done.returncode == 1
    assert "event limit reached" in done.stderr
    assert left() == ["torsional_gear_pair.h5"]
    with h5py.File("torsional_gear_pair.h5") as file:
        assert file["event/time"].size == 100
        reached = file["extrema/mesh_deformation/time"][:].max()
    assert 0 < reached < 0.3
    succeed("razy-run", GEAR_PAIR, *sets(rotation__speed_rpm=1900, record__from=0), "--output", "whole.h5")
    with h5py.File("torsional_gear_pair.h5") as part, h5py.File("whole.h5") as whole:
        n = part["extrema/mesh_deformation/value"].size
        assert n > 50
        for name in ("extrema/mesh_deformation/value", "extrema/mesh_deformation/time"):
            assert np.array_equal(part[name][:], whole[name][:n])
        assert np.array_equal(part["event/time"][:], whole["event/time"][:100])


@pytest.mark.parametrize("separation", ["zero_deformation", "zero_force"])
def test_separation_of_a_damped_stop(separation):
    options = sets(stop__damping=100, stop__separation=f"'{separation}'")
    succeed(
        "razy-run", TWO_SIDED_STOP, *options, *sets(**{"record(2)__what": "'trajectory'", "record(2)__interval": 1e-4})
    )
    with h5py.File("two_sided_stop.h5") as file:
        x = file["state/displacement"][:].ravel()
        force = file["observable/contact_force"][:]
    adhesive = force * np.sign(x) < -1e-9
    assert adhesive.any() == (separation == "zero_deformation")


def test_no_given_time_is_lost_between_steps():
    case = SOURCE / "inputs" / "belt_oscillator.nml"
    options = sets(motion__integrator="'moreau_jean'", motion__step=1e-3, motion__t_end=6.0)
    succeed("razy-run", case, *options, "--set", "record(1)%interval=0.06")
    with h5py.File("belt_oscillator.h5") as file:
        np.testing.assert_allclose(file["time"][:], 0.06 * np.arange(101), rtol=1e-14)


def test_counters_and_status_are_stored():
    succeed("razy-run", TWO_SIDED_STOP, *sets(motion__integrator="'dop853'"))
    with h5py.File("two_sided_stop.h5") as file:
        outcome = file["outcome"]
        assert outcome["status"][0] == 0
        assert outcome["status"].attrs["meanings"][0] == "ok"
        assert outcome["rhs_evaluations"][0] > 11 * outcome["steps"][0] > 0
        assert outcome["events"][0] == file["event/time"].size
        assert file.attrs["treatment"] == "event"


DROP = """
&scene   kind='planar', title='Body dropped on a rigid floor' /
&body    name='block', mass=2.0, inertia=0.1, centre=0.0,0.0 /
&stop    name='floor', between='block','frame', direction=0.0,1.0, clearance=0.1, law='rigid', restitution=0.5 /
&gravity acceleration=10.0 /
&motion  t_end=0.4, start='zero' /
&record  observable='contact_force', what='extrema' /
"""


def test_planar_stops_take_all_laws(folder):
    case = folder / "drop.nml"
    case.write_text(DROP)
    succeed("razy-run", case)
    fall = np.sqrt(0.02)
    with h5py.File("drop.h5") as file:
        bounces = fall * (1 + 2 * (1 - 0.5 ** np.arange(4)))
        np.testing.assert_allclose(file["event/time"][:], bounces, rtol=1e-10)
        assert file["outcome/impacts"][0] == 4
    done = start("razy-run", case, "--set", "stop(1)%law='hertz'", "--force")
    assert done.returncode == 2 and "law = 'hertz' takes stiffness" in done.stderr


def test_a_run_says_what_it_found_and_a_start_what_is_not_balanced(folder):
    said = succeed("razy-run", GEAR_PAIR, "--output", "found.h5").stdout
    with h5py.File("found.h5") as file:
        value, events = file["extrema/mesh_deformation/value"][:], file["outcome/events"][0]
    assert " ".join(said.split()) == f"mesh_deformation: {value.min():.6E} to {value.max():.6E} m {events} events"
    assert succeed("razy-run", SOURCE / "inputs" / "block_on_belt.nml").stdout == "1 event\n"
    refused = start("razy-run", GEAR_PAIR, *sets(**{"load(2)__value": -99.9}))
    assert refused.returncode == 2
    assert "the constant loads are in no equilibrium" in refused.stderr and "N or N m are left at '" in refused.stderr


AT_THE_END = """&mass name='ball', value=1.0 /
&stop name='wall', between='ball','frame', side='upper', clearance=1.0, law='rigid', restitution=0.5 /
&initial on='ball', velocity=1.0 /
&motion t_end=1.0, start='given' /
&record observable='displacement', of='ball', what='trajectory', interval=0.25 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_an_event_at_the_very_end_leaves_the_last_sample(tmp_path, integrator):
    (tmp_path / "ball.nml").write_text(AT_THE_END)
    method = f"--set=motion%integrator='{integrator}'"
    succeed("razy-run", tmp_path / "ball.nml", method, "--output", tmp_path / "ball.h5")
    with h5py.File(tmp_path / "ball.h5") as file:
        assert file["observable/displacement.ball"][:] == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0], rel=1e-12)


@pytest.mark.parametrize("state", [False, True])
@pytest.mark.parametrize("excited", [False, True])
def test_exponents_of_a_linear_oscillator(folder, state, excited):
    """Of m s'' + b s' + k s both have the real part -b/2m, whatever excites it, stands beside or is recorded."""
    text = "&mass name='m', value=2.0 /\n&spring between='m','frame', stiffness=800.0, damping=4.0 /\n"
    text += "&mass name='other', value=1.0 /\n&spring between='other','frame', stiffness=100.0, damping=7.0 /\n"
    text += "&motion t_end=10.0, start='zero', lyapunov=2, lyapunov_periods=200 /\n"
    text += "&record observable='displacement', of='m', what='extrema' /\n"
    text += "&load on='m', amplitude=1.0, frequency=2.0 /\n" if excited else ""
    text += "&record observable='state', what='trajectory', interval=0.1 /\n" if state else ""
    (folder / "case.nml").write_text(text)
    succeed("razy-run", "case.nml")
    with h5py.File("case.h5") as file:
        found, whole = file["lyapunov/exponent"][()], file["lyapunov/sum_rule"][()]
    assert whole == pytest.approx(-2.0, rel=1e-12) and found.sum() == pytest.approx(-2.0, rel=1e-9)
    np.testing.assert_allclose(found, -1.0, atol=0.2)


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_an_impact_without_restitution_loses_an_exponent(integrator, folder):
    """Disturbances of before are all one after it; what is left of the second is rounding, and no exponent."""
    text = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=0.5, damping=0.1 /\n"
    text += "&stop name='s', between='m','frame', side='upper', clearance=0.0, law='rigid', restitution=0.0 /\n"
    text += "&load on='m', amplitude=1.0, angular_frequency=2.0 /\n"
    text += f"&motion t_end=600.0, start='zero', integrator='{integrator}', lyapunov=2, lyapunov_periods=100 /\n"
    text += "&record observable='displacement', of='m', what='extrema' /\n"
    (folder / "case.nml").write_text(text + "&follow parameter='load%amplitude', first=1.0, last=1.1, max_points=1 /\n")
    succeed("razy-run", "case.nml")
    succeed("razy-follow", "case.nml", "--output", "branch.h5")
    with h5py.File("case.h5") as file, h5py.File("branch.h5") as branch:
        found, whole = file["lyapunov/exponent"][()], file["lyapunov/sum_rule"][()]
        multiplier, period = np.hypot(*branch["point/multiplier"][0]).max(), branch["point/period"][0]
    assert 1e-3 < multiplier < 1.0
    assert found[0] == pytest.approx(np.log(multiplier) / period, rel=0.02)
    assert found[1] == whole == -np.inf


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_a_contact_is_hit_once_where_it_closes(integrator, folder):
    """A stop without restitution is left again once in a period, which is no impact of no speed."""
    text = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=1.0, damping=0.2 /\n"
    text += "&stop name='wall', between='m','frame', clearance=0.1, law='rigid', restitution=0.0 /\n"
    text += "&load on='m', amplitude=1.0, angular_frequency=1.5 /\n"
    text += f"&motion t_end={202 * np.pi / 1.5!r}, start='zero', integrator='{integrator}' /\n"
    text += f"&record observable='contact_force', what='statistics', from={182 * np.pi / 1.5!r} /\n"
    (folder / "hit.nml").write_text(text)
    succeed("razy-run", "hit.nml")
    with h5py.File("hit.h5") as file:
        (wall,) = file["contact"].values()
        assert wall["impacts"][()] == 10
        assert wall["impacts_per_period"][()] == pytest.approx(1)
        assert wall["mean_impact_speed"][()] == pytest.approx(wall["impact_speed"][()], rel=1e-6)
        assert wall["impact_speed"][()] > 0.1
