"""Motions that settle: what has a period and what is on its way; tuned machines; time of points."""

import h5py
import numpy as np
import pytest
from programs import SOURCE, sets, start, succeed

NOT_SETTLED = -2
# A linear machine whose transient dies away to near the tolerance by the end of the motion.
LINEAR = """&scene kind='lumped', title='linear' /
&mass name='block', value=1.0 /
&spring between='block','frame', stiffness=1.0e5, damping_factor=1.4e-4 /
&load on='block', amplitude=1.0, frequency=310.0 /
&motion t_end=2.0, start='zero' /
&record observable='displacement', what='extrema', from=1.9 /
&sweep parameter='load%frequency', first=290.0, last=340.0, step=0.5 /
"""


def swept(case, *arguments):
    succeed("razy-sweep", case, "--output", "swept.h5", "--force", *arguments)
    with h5py.File("swept.h5") as file:
        return {name: file["point"][name][()] for name in file["point"] if file["point"][name].ndim == 1}


@pytest.fixture
def linear(folder):
    path = folder / "linear.nml"
    path.write_text(LINEAR)
    return path


def test_a_transient_is_no_period(linear):
    """From 296 to 306.5 Hz it repeats itself within the tolerance after six periods."""
    assert set(swept(linear)["period"]) == {NOT_SETTLED}


def test_a_motion_is_followed_until_it_is_periodic(linear):
    longer = sets(sweep__until_periodic=True, motion__t_end=8.0, record__from=7.9)
    point = swept(linear, *longer)
    assert set(point["period"]) == {1}
    assert 2.0 < point["duration"].max() < 8.0


def test_the_extrema_are_those_of_the_end_of_the_motion(linear):
    swept(linear, *sets(sweep__until_periodic=True, motion__t_end=8.0, record__from=7.9))
    with h5py.File("swept.h5") as file:
        times, offset = file["extrema/displacement/time"][:], file["extrema/displacement/offset"][:]
        duration = file["point/duration"][:]
    first, last = times[offset[:-1]], times[offset[1:] - 1]
    assert np.all(first >= duration - 0.1)
    assert np.all(last <= duration)


def test_gear_pair_has_its_periods_and_no_others_before_teeth_part():
    case = SOURCE / "inputs/thesis/fig_4_3.nml"
    point = swept(case, *sets(sweep__last=1400.0, sweep__step=50.0))
    assert set(point["period"]) <= {1, NOT_SETTLED}


def test_until_periodic_needs_the_kind_of_motion(linear):
    done = start("razy-sweep", linear, "--check", *sets(sweep__until_periodic=True, sweep__kind_of_motion=False))
    assert done.returncode == 2
    assert "until_periodic = True: only with kind_of_motion" in done.stderr


def test_a_transient_that_beats_is_no_motion_without_period(folder):
    """It shrinks from half to half of the periods looked at, but not from eighth to eighth, as each beat takes two."""
    path = folder / "beat.nml"
    path.write_text("""&scene kind='lumped' /
&mass name='a', value=1.0 /
&mass name='b', value=1.0 /
&spring name='hard', between='a','frame', law='polynomial', coefficients=1.0, 0.0, 1.0e-9, damping=0.015 /
&spring between='b','frame', stiffness=1.0, damping=0.015 /
&spring between='a','b', stiffness=0.122253 /
&load on='a', amplitude=1.0, angular_frequency=1.618034 /
&motion t_end=538.0, start='zero' /
&record observable='displacement', of='a', what='extrema', from=500.0 /
&sweep parameter='load%angular_frequency', first=1.618034, last=1.618034, points=1 /
""")
    assert swept(path)["period"].tolist() == [NOT_SETTLED]


def test_the_press_is_tuned_at_each_frequency():
    case = SOURCE / "inputs/thesis/fig_4_30.nml"
    few = sets(sweep__step=10.0, motion__t_end=0.3, tune__apply=True)
    few += [word for i in (1, 2, 3) for word in ("--set", f"record({i})%from=0.2")]
    tuned = swept(case, *few)["tuned"]
    for frequency, value in zip((40.0, 50.0, 60.0), tuned, strict=True):
        alone = ["--set", f"tune%frequency={frequency}", "--output", "tuned.h5", "--force"]
        succeed("razy-tune", case, *alone)
        with h5py.File("tuned.h5") as file:
            assert file["optimum"][()] == pytest.approx(value, rel=1e-9)
    assert "tuned" not in swept(case, *few, *sets(tune__apply=False))


def test_time_of_points_is_stored_when_asked(linear):
    assert "processor_time" not in swept(linear)
    assert np.all(swept(linear, *sets(sweep__processor_time=True))["processor_time"] >= 0.0)


def test_a_cycle_without_excitation_has_a_time_of_its_own(folder):
    path = folder / "free.nml"
    path.write_text("""
&scene   kind='lumped', title='Free vibration' /
&mass    name='block', value=1.0 /
&mass    name='other', value=4.0 /
&spring  between='block','frame', stiffness=400.0 /
&spring  between='other','frame', stiffness=400.0 /
&motion  t_end=10.0, start='given' /
&initial on='block', displacement=1.0e-3 /
&record  observable='displacement', of='block', what='extrema', from=2.0 /
&sweep   parameter='spring(1)%stiffness', first=400.0, last=1600.0, points=3 /
""")
    point = swept(path)
    np.testing.assert_allclose(point["cycle_time"], 2 * np.pi / np.sqrt([400.0, 1000.0, 1600.0]), rtol=1e-9)
    assert set(point["period"]) == {-1}
    assert np.all(np.isnan(swept(path, "--set", "spring(1)%damping=0.1")["cycle_time"]))


# An inner mass shakes a capsule over the ground: periodic in all but the place of both.
CAPSULE = """&scene kind='lumped' /
&mass name='inner', value=1.0 /
&mass name='capsule', value=3.0 /
&spring between='inner','capsule', stiffness=1.0, damping=0.02 /
&stop name='stop', between='inner','capsule', clearance=0.02, stiffness=15.0, separation='zero_deformation' /
&friction name='ground', between='capsule','frame', static_coefficient=0.4, normal_load=1.0 /
&load on='inner', amplitude=1.6, angular_frequency=1.0 /
&motion t_end=1256.6370614359173, start='zero' /
&record observable='relative_displacement', of='stop', what='extrema', from=1193.8 /
&sweep parameter='load%angular_frequency', first=0.9, last=1.4, points=6 /
"""


def test_a_motion_is_periodic_but_for_its_drift(folder):
    """Drift by an own DOP853 with events; the extrema of the capsule say the same."""
    (folder / "capsule.nml").write_text(CAPSULE)
    point = swept("capsule.nml", *sets(sweep__first=1.0, sweep__last=1.0, sweep__points=1))
    assert point["period"].tolist() == [1]
    np.testing.assert_allclose(point["drift"], 1.05617104, atol=1e-8)
    assert swept("capsule.nml")["period"][[0, 3, 4, 5]].tolist() == [1, 2, 1, 1]
    succeed("razy-run", "capsule.nml", "--output", "run.h5")
    with h5py.File("run.h5") as file:
        assert file["outcome/period"][0] == 1
        np.testing.assert_allclose(file["outcome/drift"], point["drift"])
        assert file["outcome/drift"].attrs["units"] == "m"


def test_starts_that_drift_at_different_places_are_one_attractor(folder):
    start = "&starts method='grid' /\n&start_range coordinate='capsule', first=0.0, last=3.0, points=2 /\n"
    start += "&start_range coordinate='capsule', quantity='velocity', first=0.0, last=0.4, points=2 /\n"
    (folder / "capsule.nml").write_text(CAPSULE + start)
    point = swept("capsule.nml", *sets(sweep__first=1.0, sweep__last=1.0, sweep__points=1))
    assert set(point["attractor"]) == {1}


# A follower that its spring keeps on a cam; its gap is rounding.
FOLLOWER = """&scene kind='lumped' /
&mass name='f', value=1.0 /
&spring between='f','frame', stiffness=1400.0 /
&load on='f', value=-100.0 /
&stop name='cam', between='f','frame', side='lower', clearance=0.0, law='rigid', restitution=0.8, motion_amplitude=0.02,
  motion_angular_frequency=50.0 /
&motion t_end=20.0, start='zero' /
&record observable='displacement', what='extrema', from=15.0 /
&sweep parameter='stop%motion_angular_frequency', first=40.0, last=70.0, points=31 /
"""


def test_a_follower_that_stays_on_its_cam_has_settled(folder):
    (folder / "follower.nml").write_text(FOLLOWER)
    assert set(swept("follower.nml")["period"]) == {1}
