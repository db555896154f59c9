"""How special points of razy-follow move with values of the machine."""

from pathlib import Path

import h5py
import matplotlib.image
import numpy as np
import pytest
from branches import HYSTERESIS, IMPACT, NORMAL_FORM, follow, points
from programs import GEAR_PAIR, attribute, plot, sets, start, succeed


def asked(*values):
    return sets(follow__sensitivities=",".join(f"'{value}'" for value in values))


def slopes(file, name):
    """Derivatives by a value, with their errors, of the points that move."""
    return file[f"sensitivity/{name}"][:], file[f"sensitivity/{name}_error"][:]


@pytest.mark.parametrize(("omega", "side"), [(0.5, "upper"), (1.0, "upper"), (1.3, "upper"), (1.3, "both")])
def test_first_touch_in_closed_form(omega, side):
    """x'' + 0.1 x' + x = A cos ωt comes to a rigid stop at c where A² = c² ((1 - ω²)² + 0.01 ω²)."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /"]
    text += ["&spring between='m','frame', stiffness=1.0, damping=0.1 /"]
    text += [f"&stop name='stop', between='m','frame', clearance=1.0, law='rigid', restitution=1.0, side='{side}' /"]
    text += [f"&load on='m', amplitude=0.05, angular_frequency={omega} /"]
    text += ["&motion t_end=600.0, start='zero' /", "&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load%amplitude', first=0.05, last=1.0,"]
    text += ["  sensitivities='load%angular_frequency','stop%clearance','spring%damping','stop%restitution' /"]
    Path("touch.nml").write_text("\n".join(text) + "\n")
    with follow(Path("touch.nml")) as file:
        # The fold of the motions that hit the stop has its own.
        assert file["special/label"].asstr()[:].tolist()[0] == "GR" and file["sensitivity/special"][0] == 0
        amplitude = np.hypot(1 - omega**2, 0.1 * omega)
        known = {
            "load.angular_frequency": (-2 * omega * (1 - omega**2) + 0.01 * omega) / amplitude,
            "stop.clearance": amplitude,
            "spring.damping": 0.1 * omega**2 / amplitude,
            "stop.restitution": 0.0,
        }
        assert file["sensitivity/name"].asstr()[:].tolist() == list(known)
        assert file["sensitivity/value"][:].tolist() == [omega, 1.0, 0.1, 1.0]
        for name, slope in known.items():
            found, error = (values[0] for values in slopes(file, name))
            assert found == pytest.approx(slope, rel=1e-8, abs=1e-8)
            assert abs(found - slope) <= 2 * error < 1e-6
        assert file["sensitivity/spring.damping"].attrs["units"] == "(N or N m)/(N s/m or N m s/rad)"


def test_touch_by_steps_that_pass_it():
    """From motions without impacts dop853 steps to those that hit the stop; the change between them is the touch."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=1.0 /"]
    text += ["&spring between='m','frame', stiffness=1.0, damping=0.1 /"]
    text += ["&stop name='stop', between='m','frame', side='upper', clearance=1.0, law='rigid', restitution=0.8 /"]
    text += ["&load on='m', amplitude=0.05, angular_frequency=1.3 /"]
    text += ["&motion t_end=300.0, start='zero', integrator='dop853',"]
    text += ["  relative_tolerance=1e-11, absolute_tolerance=1e-12 /"]
    text += ["&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load%amplitude', first=0.05, last=1.2, sensitivities='spring%damping' /"]
    text += ["&follow parameter='stop%clearance', first=0.8, last=1.2 /"]
    Path("passed.nml").write_text("\n".join(text) + "\n")
    amplitude = np.hypot(1 - 1.3**2, 0.13)
    with follow(Path("passed.nml")) as file:
        assert points(file, "GR") == pytest.approx([amplitude] * len(points(file, "GR")), rel=1e-6)
        slope, _ = slopes(file, "spring.damping")
        touches = file["special/label"].asstr()[:][file["sensitivity/special"][:]] == "GR"
        assert touches.any() and slope[touches] == pytest.approx([0.1 * 1.3**2 / amplitude] * touches.sum(), rel=1e-6)
        clearance = file["curve_point/stop.clearance"][:]
        assert file["curve_point/load.amplitude"][:] == pytest.approx(clearance * amplitude, rel=1e-6)
    assert (clearance.min(), clearance.max()) == pytest.approx((0.8, 1.2))


def test_dimensions_of_the_normal_form():
    """Loads and clearance together only scale the motion: folds and grazings stay where they are."""
    done = succeed("razy-follow", NORMAL_FORM, *asked("load%value", "load%amplitude", "stop%clearance"))
    assert done.stderr.count("+1 % of load%value moves it by") == 4
    with h5py.File("gear_normal_form.h5") as file:
        total = sum(
            slopes(file, name)[0] * value
            for name, value in zip(file["sensitivity/name"].asstr()[:], file["sensitivity/value"][:], strict=True)
        )
        assert np.abs(total).max() < 1e-7 and np.abs(slopes(file, "load.value")[0]).min() > 1.0
        labels = file["special/label"].asstr()[:][file["sensitivity/special"][:]]
        assert labels.tolist() == ["GR", "LP", "LP", "GR"]


def test_beside_runs_with_another_value():
    found = {}
    for change in (-1, 0, 1):
        values = sets(spring__damping=repr(4.0 * (1 + 1e-4 * change)))
        options = asked("spring%damping") if change == 0 else []
        with follow(HYSTERESIS, "--force", *values, *options) as file:
            found[change] = np.concatenate([points(file, "LP"), points(file, "GR")])
            if change == 0:
                labels = file["special/label"].asstr()[:][file["sensitivity/special"][:]]
                slope = slopes(file, "spring.damping")[0]
                slope = np.concatenate([slope[labels == "LP"], slope[labels == "GR"]])
    assert slope == pytest.approx((found[1] - found[-1]) / 8e-4, rel=1e-6)


def test_by_steps_of_a_runge_kutta_method():
    with follow(HYSTERESIS, *asked("stop%clearance"), motion__integrator="'dop853'") as file:
        found, error = slopes(file, "stop.clearance")
    with follow(HYSTERESIS, *asked("stop%clearance"), "--force") as file:
        known, _ = slopes(file, "stop.clearance")
    assert found == pytest.approx(known, rel=1e-5)
    assert (np.abs(found - known) < 10 * error).all()


def test_points_next_to_each_other():
    """Both torques change together; folds, doublings and grazings of the gear pair lie within hundredths of a rpm."""
    short = sets(follow__last=1800, follow__doublings=0)
    with follow(GEAR_PAIR, *short, *asked("load(1)%value+load(2)%value")) as file:
        places = file["sensitivity/special"][:]
        slope, error = slopes(file, "load(1).value+load(2).value")
    beside = []
    for torque in (100.001, 99.999):
        changed = ["--set", f"load(1)%value={torque}", "--set", f"load(2)%value={-torque}"]
        with follow(GEAR_PAIR, *short, *changed, "--force") as file:
            beside.append(file["special/parameter"][:][places])
    assert slope.size >= 7
    assert slope == pytest.approx((beside[0] - beside[1]) / 0.002, rel=1e-6)
    assert (error < 1e-3 * np.abs(slope)).all()


def test_a_value_at_its_bound():
    """There is no coefficient of restitution above 1: the difference is to one side."""
    with follow(IMPACT, *asked("stop%restitution"), motion__t_end=400, follow__last=2.7, follow__doublings=0) as file:
        (slope,), (error,) = slopes(file, "stop.restitution")
        (before,) = points(file, "PD")
    less = {"stop__restitution": 1.0 - 1e-4, "motion__t_end": 400, "follow__last": 2.7, "follow__doublings": 0}
    with follow(IMPACT, "--force", **less) as file:
        (after,) = points(file, "PD")
    assert slope == pytest.approx((before - after) / 1e-4, rel=1e-3)
    assert error < 1e-5


def test_picture():
    succeed("razy-follow", HYSTERESIS, *asked("spring%damping", "load%amplitude"))
    done = plot("hysteresis.h5", "--kind", "sensitivity", "--save", "picture.png")
    assert (done.returncode, done.stderr) == (0, "")
    assert min(matplotlib.image.imread("picture.png").shape[:2]) > 300


REFUSED = {
    "unknown": (["stop%clearence"], "there is no such value"),
    "zero": (["load%phase"], "values that the input gives and that are not 0"),
    "followed": (["load%frequency"], "each value once, and none that &follow varies"),
    "twice": (["stop%clearance", "stop%clearance"], "each value once"),
    "no machine": (["motion%t_end"], "real values that the machine has"),
    "of a joint value": (["stop%clearance+motion%t_end"], "real values that the machine has"),
}


@pytest.mark.parametrize(("values", "said"), REFUSED.values(), ids=REFUSED.keys())
def test_refused(values, said):
    done = start("razy-follow", HYSTERESIS, "--check", *asked(*values))
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "&follow%sensitivities" in done.stderr and said in done.stderr


def test_not_of_all_motions():
    done = start("razy-follow", HYSTERESIS, *asked("stop%clearance"), *sets(follow__motions="'all'"))
    assert done.returncode == 2 and "not with motions='all'" in done.stderr


def test_none_without_the_key():
    succeed("razy-follow", NORMAL_FORM, *sets(follow__last=1.2))
    assert attribute("gear_normal_form.h5", "program") == "razy-follow"
    with h5py.File("gear_normal_form.h5") as file:
        assert "sensitivity" not in file


def test_corner():
    """Where friction begins to hold the branch turns by a right angle; not far from there it does so once more."""
    text = ["&scene kind='lumped' /", "&mass name='m', value=2.0 /"]
    text += ["&spring between='m','frame', stiffness=1.0, damping=0.4 /"]
    text += ["&stop name='wall', between='m','frame', law='rigid', restitution=0.5 /"]
    text += ["&friction name='f', between='m','frame', static_coefficient=0.1, normal_load=1.0 /"]
    text += ["&load on='m', amplitude=2.0, angular_frequency=1.95 /", "&motion t_end=1675.5, start='zero' /"]
    text += ["&record observable='displacement', what='extrema' /"]
    text += ["&follow parameter='load%angular_frequency', first=1.95, last=2.26, doublings=0 /"]
    Path("corner.nml").write_text("\n".join(text) + "\n")
    place = []
    for damping in (0.399, 0.401):
        with follow(Path("corner.nml"), "--force", *sets(spring__damping=damping)) as file:
            place.append(points(file, "ST"))
    with follow(Path("corner.nml"), "--force", *asked("spring%damping")) as file:
        special = file["sensitivity/special"][:]
        sticks = (file["special/label"].asstr()[:] == "ST") & (file["special/branch"][:] == 1)
        slope = slopes(file, "spring.damping")[0][sticks[special]]
    assert slope == pytest.approx((place[1] - place[0]) / 0.002, rel=1e-4)
