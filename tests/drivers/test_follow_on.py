"""Branches that begin with a motion of an earlier file of razy-follow."""

import re
import shlex
import shutil
import signal
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from branches import HYSTERESIS, IMPACT, NORMAL_FORM, PAIR_MAP, follow, multipliers, points
from programs import GEAR_PAIR, SOURCE, command, left, sets, start, succeed
from scipy.integrate import solve_ivp


def begin_with(point, file="first.h5"):
    """Options that begin with a label or a row of /point."""
    key, value = ("start_label", f"'{point}'") if isinstance(point, str) else ("start_point", point)
    return sets(**{"follow__start_file": f"'{file}'", f"follow__{key}": value})


def labels(file):
    return list(zip(file["special/label"].asstr()[:].tolist(), file["special/parameter"][:], strict=True))


def test_the_example_in_the_page():
    """With less damping the folds move to where a run from the machine's own start finds them."""
    page = (SOURCE / "docs/follow.md").read_text()
    (block,) = (text for text in re.findall(r"```\n(.*?)```", page, flags=re.DOTALL) if "start_label" in text)
    for line in block.replace("\\\n", " ").splitlines():
        program, case, *words = shlex.split(line)
        succeed(program, SOURCE / case, *words)
    with follow(NORMAL_FORM, damper__damping=0.09) as own, h5py.File("second.h5") as second:
        known = [pair for pair in labels(own) if pair[0] in ("LP", "GR")]
        found = [pair for pair in labels(second) if pair[0] in ("LP", "GR")]
        assert len(found) == 4
        for kind, value in found:
            assert any(kind == label and value == pytest.approx(at, rel=1e-10) for label, at in known)


@pytest.mark.parametrize("label", ["LP1", "lp2", "GR1", "EP1"])
def test_the_same_branch_from_any_of_its_points(label):
    """Also from a fold, where no plane across the parameter holds one motion; each point is located once."""
    succeed("razy-follow", NORMAL_FORM, "--output", "first.h5")
    with h5py.File("first.h5") as file:
        known = labels(file)[:-1]
        place = [f"{pair[0]}{1 + [other[0] for other in known[:k]].count(pair[0])}" for k, pair in enumerate(known)]
        row = file["special/point"][(place + ["EP1"]).index(label.upper())]
        state = file["point/state"][row]
    with follow(NORMAL_FORM, *begin_with(label)) as file:
        found = [pair for pair in labels(file) if pair[0] != "EP"]
        assert file["point/state"][0] == pytest.approx(state, rel=1e-6)
    assert sorted(kind for kind, _ in found) == ["GR", "GR", "LP", "LP"]
    for kind, value in found:
        assert any(kind == other and value == pytest.approx(at, rel=1e-10) for other, at in known)


def test_an_unstable_motion_over_its_damping():
    """No start settles to it; the file was followed over another parameter."""
    succeed("razy-follow", NORMAL_FORM, "--output", "first.h5")
    with h5py.File("first.h5") as file:
        low, high = file["special/point"][:][file["special/label"].asstr()[:] == "LP"]
        row = (low + high) // 2
        frequency, state = file["point/load.angular_frequency"][row], file["point/state"][row]
        assert not file["point/stable"][row]
    here = sets(load__angular_frequency=repr(float(frequency)), follow__parameter="'damper%damping'")
    with follow(NORMAL_FORM, *here, *begin_with(row), follow__first=0.1, follow__last=0.08) as file:
        assert file["point/damper.damping"][0] == pytest.approx(0.1, rel=1e-12)
        assert file["point/state"][0] == pytest.approx(state, rel=1e-9)
        assert not file["point/stable"][0]
        assert file["special/parameter"][-1] == pytest.approx(0.08, rel=1e-14)


HILLTOP = """
&scene kind='lumped' /
&mass name='b', value=1.0 /
&spring between='b','frame', law='polynomial', coefficients=1.0,0.0,1.0, damping=0.1 /
&load on='b', amplitude=0.1, angular_frequency=0.5 /
&motion t_end=500.0, start='zero', relative_tolerance=1e-10, absolute_tolerance=1e-12 /
&record observable='displacement', of='b', what='extrema' /
&follow parameter='spring%coefficients(1)', first=1.0, last=-1.3, max_points=330, doublings=0 /
"""


def test_a_motion_that_is_left_fast_does_not_creep():
    """On the top between two wells what is off grows ten thousandfold in a period: the map bends over short steps."""
    Path("hilltop.nml").write_text(HILLTOP)
    with follow(Path("hilltop.nml")) as file:
        stiffness = file["point/spring.coefficients(1)"][-1]
        state, found = file["point/state"][-1], multipliers(file, -1)
        assert file["point/phase"][-1] == 0.0
    # With columns of other motions, or of steps that bend, it was -0.62 after as many points.
    assert stiffness < -0.8

    def rates(t, y):
        slope = stiffness + 3 * y[0] ** 2
        force = 0.1 * np.sin(0.5 * t) - stiffness * y[0] - y[0] ** 3
        return [y[1], force - 0.1 * y[1], y[3], -slope * y[2] - 0.1 * y[3], y[5], -slope * y[4] - 0.1 * y[5]]

    end = solve_ivp(rates, (0, 4 * np.pi), [*state, 1, 0, 0, 1], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    np.testing.assert_allclose(end[:2], state, atol=1e-7)
    right = np.abs(np.linalg.eigvals(end[2:].reshape(2, 2))).max()
    assert np.abs(found).max() == pytest.approx(right, rel=1e-6)


def test_a_state_at_another_phase():
    """The wall is hit near phase 0 of the load: the stored state stands elsewhere."""
    turned = sets(load__phase=250, motion__t_end=400)
    succeed("razy-follow", IMPACT, *turned, "--output", "first.h5")
    with h5py.File("first.h5") as file:
        row = np.flatnonzero((file["point/phase"][:] > 0.0) & (file["point/stable"][:] == 1))[50]
        multiplier = file["point/multiplier"][row]
        omega = file["point/load.angular_frequency"][row]
    with follow(IMPACT, *turned, *begin_with(row)) as file:
        assert file["point/load.angular_frequency"][0] == pytest.approx(omega, rel=1e-12)
        assert np.abs(file["point/multiplier"][0][0]) == pytest.approx(np.abs(multiplier[0]), rel=1e-8)
        assert points(file, "PD") == pytest.approx([2.651807017026], rel=1e-11)


def test_two_periods():
    """A doubled branch goes on beyond the range of its file."""
    settled = sets(motion__t_end=400)
    succeed("razy-follow", IMPACT, *settled, *sets(follow__last=2.7), "--output", "first.h5")
    with h5py.File("first.h5") as file:
        ends = (file["special/label"].asstr()[:] == "EP").nonzero()[0]
        assert file["special/branch"][ends[1]] == 2
    with follow(IMPACT, *settled, *begin_with("EP2")) as file:
        assert (file["point/multiplicity"][:][file["point/branch"][:] == 1] == 2).all()
        assert points(file, "PD") == pytest.approx([2.713293439395], rel=1e-11)
    done = start("razy-follow", IMPACT, *begin_with("EP2"), *sets(follow__period=3), "--force")
    assert done.returncode == 2
    assert done.stderr == "--set: &follow%period = 3: not with start_file, or that of its motion, 2\n"


def test_a_closed_motion_without_excitation():
    belt = SOURCE / "inputs" / "belt_oscillator.nml"
    succeed("razy-follow", belt, *sets(follow__last=0.3), "--output", "first.h5")
    with h5py.File("first.h5") as file:
        speed, period = file["point/friction.belt_speed"][4], file["point/period"][4]
    with follow(belt, *begin_with(4), follow__last=0.3) as file:
        assert file["point/friction.belt_speed"][0] == pytest.approx(speed, rel=1e-7)
        assert file["point/period"][0] == pytest.approx(period, rel=1e-7)


def test_no_motion_near():
    """Of a machine with three times the damping there is none: one line, and nothing is left."""
    succeed("razy-follow", NORMAL_FORM, "--output", "first.h5")
    done = start("razy-follow", NORMAL_FORM, *begin_with("LP1"), *sets(damper__damping=0.3))
    assert done.returncode == 1
    with h5py.File("first.h5") as file:
        fold = file["special/point"][:][file["special/label"].asstr()[:] == "LP"][0]
    assert done.stderr.startswith(f"no motion of this machine is near point {fold} of first.h5: ")
    assert done.stderr.count("\n") == 1 and left() == ["first.h5"]


@pytest.fixture(scope="module")
def earlier(tmp_path_factory):
    """A file of razy-follow, one that is none, and one without numbers."""
    folder = tmp_path_factory.mktemp("earlier")
    succeed("razy-follow", NORMAL_FORM, *sets(follow__last=1.2), "--output", folder / "first.h5")
    succeed("razy-run", NORMAL_FORM, "--output", folder / "run.h5")
    shutil.copy(folder / "first.h5", folder / "hurt.h5")
    with h5py.File(folder / "hurt.h5", "a") as file:
        file["point/state"][3] = np.nan
        del file["special/label"]
    for name, left_out in (("short.h5", "point/state"), ("pairs.h5", "special/point")):
        shutil.copy(folder / "first.h5", folder / name)
        with h5py.File(folder / name, "a") as file:
            values = file[left_out][()].ravel()[:2]
            del file[left_out]
            file[left_out] = values[:1]
    return folder


REFUSED = {
    "nothing said": (["follow%start_file='first.h5'"], "with start_point or start_label, which say which motion of it"),
    "no file": (["follow%start_point=1"], "only with start_file, the file that has it"),
    "no file for a label": (["follow%start_label='EP1'"], "only with start_file, the file that has it"),
    "both": (
        ["follow%start_file='first.h5'", "follow%start_label='EP1'", "follow%start_point=1"],
        "one of start_point and start_label",
    ),
    "not there": (["follow%start_file='no.h5'", "follow%start_point=1"], "no.h5: there is no such file"),
    "another program": (["follow%start_file='run.h5'", "follow%start_point=1"], "a file of razy-follow"),
    "no such row": (["follow%start_file='first.h5'", "follow%start_point=999"], "a row of /point, from 0 to "),
    "no such label": (
        ["follow%start_file='first.h5'", "follow%start_label='PD1'"],
        "a label with its number in the file, which has GR1, EP1",
    ),
    "no number": (["follow%start_file='first.h5'", "follow%start_label='GR'"], "which has GR1, EP1"),
    "not finite": (["follow%start_file='hurt.h5'", "follow%start_point=3"], "whose numbers are finite"),
    "without labels": (["follow%start_file='hurt.h5'", "follow%start_label='EP1'"], "has no dataset '/special/label'"),
    "without states": (["follow%start_file='short.h5'", "follow%start_point=3"], "/point/state is not whole"),
    "labels of no points": (["follow%start_file='pairs.h5'", "follow%start_label='GR1'"], "/special is not whole"),
    "out of the range": (
        ["follow%start_file='first.h5'", "follow%start_label='EP1'", "follow%last=1.3"],
        "a motion between first and last; this one is at 1.2",
    ),
    "all": (["follow%start_file='first.h5'", "follow%start_point=1", "follow%motions='all'"], "not with motions='all'"),
}


@pytest.mark.parametrize(("values", "said"), REFUSED.values(), ids=REFUSED.keys())
@pytest.mark.parametrize("check", [[], ["--check"]])
def test_refused(earlier, monkeypatch, values, said, check):
    monkeypatch.chdir(earlier)
    before = left()
    done = start("razy-follow", NORMAL_FORM, *check, *(word for value in values for word in ("--set", value)))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and said in done.stderr and "&follow%" in done.stderr
    assert left() == before


def test_another_machine(earlier, monkeypatch):
    monkeypatch.chdir(earlier)
    done = start("razy-follow", GEAR_PAIR, *begin_with("EP1"))
    assert done.returncode == 2
    assert "a file of a machine with as many coordinates, 4; its has 1" in done.stderr


def test_the_file_is_not_overwritten(earlier, monkeypatch):
    monkeypatch.chdir(earlier)
    done = start("razy-follow", NORMAL_FORM, *begin_with("EP1"), "--output", "first.h5", "--force")
    assert done.returncode == 2 and "which this command needs for something else" in done.stderr


def test_only_in_the_first_group(earlier, monkeypatch):
    monkeypatch.chdir(earlier)
    done = start("razy-follow", PAIR_MAP, "--set", "follow(2)%start_point=1")
    assert done.returncode == 2 and "given in the first &follow only" in done.stderr


def test_curves_from_a_stored_fold():
    succeed("razy-follow", HYSTERESIS, "--output", "first.h5")
    text = re.sub(
        "(&follow .*) /", r"\1, start_file='first.h5', start_label='LP1', doublings=0 /", HYSTERESIS.read_text()
    )
    Path("two.nml").write_text(text + "&follow parameter='load%amplitude', first=1.9, last=2.1 /\n")
    with follow(Path("two.nml")) as file:
        assert sorted(file["curve/label"].asstr()[:].tolist()) == ["GR", "GR", "LP", "LP"]
        assert file["curve_point/load.amplitude"][:].max() == pytest.approx(2.1, rel=1e-14)


def test_digits_of_steps_that_hold():
    """Folds and multipliers of Duffing's oscillator are off by less than they say; no decimal beyond it is printed."""
    duffing, folds, errors, printed, multipliers, doubts = SOURCE / "inputs/duffing.nml", [], [], [], [], []
    for tolerance in (1e-9, 1e-7, 1e-4, 1e-12):
        tight = sets(motion__relative_tolerance=tolerance, motion__absolute_tolerance=tolerance)
        tight += sets(follow__values="0.6,1.45,2.0")
        said = succeed("razy-follow", duffing, *tight, "--force", "--output", "first.h5").stderr
        printed.append(re.findall(r" LP +(\S+)", said))
        with h5py.File("first.h5") as file:
            folds.append(points(file, "LP"))
            errors.append(file["special/error"][:][file["special/label"].asstr()[:] == "LP"])
            assert file["special/error"][-1] == 0
            values = file["special/point"][:][file["special/label"].asstr()[:] == "UZ"]
            real, imaginary = file["point/multiplier"][:][values].swapaxes(0, 1)
            multipliers.append(np.sort_complex(real + 1j * imaginary))
            doubts.append(file["point/multiplier_error"][:][values])
    for k in range(3):
        off = np.abs(np.array(folds[k]) - folds[3])
        assert (off < errors[k]).all() and (errors[k] < 100 * off).all()
        off = np.abs(multipliers[k] - multipliers[3]).max(axis=1)
        assert off.size == 5 and (off < doubts[k].max(axis=1)).all()
        assert all(
            10.0 ** -len(text.partition(".")[2]) >= error for text, error in zip(printed[k], errors[k], strict=False)
        )
    with follow(NORMAL_FORM) as exact:
        assert "error" not in exact["special"]


def test_what_was_followed_until_a_signal_is_written():
    """Of curves that take long the branches are there already."""
    words = command("razy-follow", PAIR_MAP, "--set", "follow(1)%last=1000", "--output", "first.h5")
    with subprocess.Popen(words, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
        said = next(line for line in process.stderr if line.startswith("curve"))
        process.send_signal(signal.SIGTERM)
        said += process.stderr.read()
    assert process.returncode == 3 and "start_file goes on from there" in said and "ends: it was stopped" in said
    with h5py.File("first.h5") as file:
        assert "the end of the range" in file["branch/ending"].asstr()[:]
