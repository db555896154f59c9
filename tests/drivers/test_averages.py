"""Means, root mean squares and values once in each period: against closed forms, and in sweeps as in runs."""

import h5py
import numpy as np
import pytest
from programs import SOURCE, changed, plot, run, start, succeed

CAPSULE = SOURCE / "inputs" / "field" / "capsule.nml"
HALVES = """&scene kind='lumped' /
&mass name='a', value=1.0 /
&mass name='fast', value=1.0 /
&spring between='a','frame', stiffness=4.0 /
&spring between='fast','frame', stiffness=1e6 /
&stop name='wall', between='a','frame', side='upper', clearance=0.0, stiffness=12.0 /
&initial on='a', velocity=3.0 /
&initial on='fast', displacement=2.0 /
&motion t_end={t_end!r}, start='given', integrator='{integrator}', relative_tolerance=1e-13, absolute_tolerance=1e-16 /
&record observable='displacement', of='a', what='averages' /
&record observable='velocity', of='a', what='averages' /
&record observable='contact_force', of='wall', what='averages' /
&record observable='displacement', of='fast', what='averages' /
"""
DRIVEN = """&scene kind='lumped' /
&mass name='a', value=2.0 /
&damper between='a','frame', damping=3.0 /
&spring between='a','frame', stiffness=50.0 /
&load on='a', amplitude=1.0, angular_frequency=4.0 /
&load on='a', value=5.0 /
&motion t_end=100.0, start='static' /
&record observable='displacement', what='averages','strobe', from={start!r} /
&record observable='velocity', what='strobe', from={start!r} /
&sweep parameter='load(1)%angular_frequency', first=4.0, last=6.0, points=3 /
"""


@pytest.mark.parametrize(("integrator", "bound"), [("exact", 1e-12), ("dop853", 1e-9)])
def test_averages_of_two_halves_of_sines(folder, integrator, bound):
    """3/4 sin 4t against the wall, 3/2 sin 2t away from it; what no contact feels is far faster, 2 cos 1000t."""
    t_end = np.pi / 4 + np.pi / 2
    (folder / "halves.nml").write_text(HALVES.format(t_end=t_end, integrator=integrator))
    found = run("halves.nml")
    right = {
        "displacement.a": (2 * 0.75 / 4 - 2 * 1.5 / 2, 0.75**2 * np.pi / 8 + 1.5**2 * np.pi / 4),
        "velocity.a": (0.0, 9.0 * t_end / 2),
        "contact_force.wall": (12 * 2 * 0.75 / 4, (12 * 0.75) ** 2 * np.pi / 8),
        "displacement.fast": (2e-3 * np.sin(1e3 * t_end), 2 * t_end + np.sin(2e3 * t_end) / 1e3),
    }
    for name, (integral, square) in right.items():
        rms = np.sqrt(square / t_end)
        assert found[f"average/{name}/rms"] == pytest.approx(rms, rel=bound), name
        assert found[f"average/{name}/mean"] == pytest.approx(integral / t_end, abs=bound * rms), name


def test_a_sweep_has_the_steady_response_once_in_each_period(folder):
    """At the phase of the excitation at 0, whatever the start of recording; a run has the same bits."""
    (folder / "driven.nml").write_text(DRIVEN.format(start=50.3))
    succeed("razy-sweep", "driven.nml")
    with h5py.File("driven.h5") as file:
        found = {f"{group}/{name}": item[()] for group in ("strobe", "average") for name, item in items(file[group])}
    omega = np.array([4.0, 5.0, 6.0])
    response = -1j / (50.0 - 2.0 * omega**2 + 3j * omega)
    offset = found["strobe/displacement/offset"]
    for i, w in enumerate(omega):
        part = slice(offset[i], offset[i + 1])
        turns = np.arange(np.ceil(50.3 * w / (2 * np.pi)), np.floor(100.0 * w / (2 * np.pi)) + 1)
        assert found["strobe/displacement/time"][part] == pytest.approx(turns * 2 * np.pi / w, rel=1e-14)
        assert found["strobe/displacement/value"][part] == pytest.approx(0.1 + response[i].real, rel=1e-12)
        assert found["strobe/velocity/value"][part] == pytest.approx((1j * w * response[i]).real, rel=1e-12)
        succeed("razy-run", "driven.nml", "--set", f"load(1)%angular_frequency={w}", "--output", "run.h5", "--force")
        with h5py.File("run.h5") as file:
            assert np.array_equal(file["strobe/displacement/value"][:], found["strobe/displacement/value"][part])
            assert file["average/displacement/rms"][()] == found["average/displacement/rms"][i]


def items(group):
    found = []
    group.visititems(lambda name, item: found.append((name, item)) if isinstance(item, h5py.Dataset) else None)
    return found


def test_a_capsule_drifts_by_its_mean_velocity(folder):
    found = run(CAPSULE)
    drift = np.ravel(found["observable/displacement.capsule"])
    period = 2 * np.pi
    mean = found["average/velocity.capsule/mean"]
    assert mean == pytest.approx((drift[-1] - drift[0]) / (100 * period), rel=1e-10)
    assert abs(mean) > 0.01
    assert found["average/contact_force.plate/mean"] == pytest.approx(found["contact/plate/mean_force"], rel=1e-11)
    # Values at the periods' beginnings are those of a trajectory there.
    assert found["strobe/velocity.capsule/time"] == pytest.approx(np.arange(100, 201) * period, rel=1e-14)


def test_a_strobe_of_a_load_that_begins_at_0_has_its_period(folder):
    """At an amplitude of 0 nothing has a period, but for what the user says: a sweep from 0 was refused."""
    text = DRIVEN.format(start=50.3).replace(
        "load(1)%angular_frequency', first=4.0, last=6.0", "load(1)%amplitude', first=0.0, last=1.0"
    )
    (folder / "from_0.nml").write_text(text)
    succeed("razy-sweep", "from_0.nml")
    with h5py.File("from_0.h5") as file:
        strobe = {name: item[()] for name, item in file["strobe/displacement"].items()}
    turns = np.arange(33, 64)[:, None] * [1.0, 1.0, 1.0]
    assert strobe["time"].reshape(3, -1) == pytest.approx(turns.T * np.pi / 2, rel=1e-14)
    response = 1 / (50 - 2 * 4.0**2 + 3j * 4.0)
    right = 0.1 + np.array([0.0, 0.5, 1.0]) * response.imag
    assert strobe["value"].reshape(3, -1) == pytest.approx(np.repeat(right, 31).reshape(3, -1), rel=1e-12)


def test_pictures_of_averages_and_strobes(folder):
    case = changed(folder / "capsule.nml", CAPSULE.read_text(), ("points=26", "points=3"))
    two = changed(
        folder / "two.nml", case.read_text() + "&sweep parameter='stop%clearance', first=0.0, last=0.1, points=2 /\n"
    )
    for name in (case, two):
        succeed("razy-sweep", name)
    for arguments in (
        ["capsule.h5", "--kind", "poincare"],
        ["capsule.h5", "--kind", "column", "--observable", "velocity.capsule.mean"],
        ["two.h5", "--observable", "velocity.capsule.mean"],
        ["two.h5", "--observable", "contact_force.plate.rms"],
    ):
        done = plot(*arguments, "--save", "picture.svg", "--force")
        assert done.returncode == 0, done.stderr
    done = plot("two.h5", "--observable", "velocity.capsule.rsm", "--save", "no.svg")
    assert done.returncode != 0 and "rms" in done.stderr


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("'strobe'", "'strobe' where the excitation has a period"),
        ("'averages'", "from = 2.0: the same for all averages"),
    ],
)
def test_what_cannot_be_recorded_is_refused(folder, what, said):
    text = HALVES.format(t_end=1.0, integrator="exact")
    (folder / "no.nml").write_text(text + f"&record observable='velocity', of='fast', what={what}, from=2.0 /\n")
    done = start("razy-run", "no.nml")
    assert done.returncode == 2 and said in done.stderr
