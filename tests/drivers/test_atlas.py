"""razy-follow over two parameters, and all motions that it finds."""

import re
import signal
import subprocess
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from branches import HYSTERESIS, PAIR_MAP, follow, points
from faults import wait_for
from programs import GEAR_PAIR, SOURCE, command, datasets, left, plot, sets, start, succeed
from scipy.optimize import fsolve

DUFFING = SOURCE / "inputs" / "duffing.nml"
ALL = sets(follow__motions="'all'", follow__samples=6)


def test_curve_over_two_parameters():
    """At its end the curve of the doubling has the speed that a branch finds at that torque."""
    speed = {"follow(1)%first": 2420, "follow(1)%last": 2330, "follow(1)%doublings": 0}
    narrow = [word for key, value in speed.items() for word in ("--set", f"{key}={value}")]
    torque = ["--set", "follow(2)%first=99", "--set", "follow(2)%last=101"]
    succeed("razy-follow", PAIR_MAP, *narrow, *torque, "--output", "curve.h5")
    balanced = ["--set", "load(1)%value=101", "--set", "load(2)%value=-101", "--set", "follow(2)%first=100"]
    succeed("razy-follow", PAIR_MAP, *narrow, *balanced, "--output", "branch.h5")
    with h5py.File("curve.h5") as file:
        assert file["curve/label"].asstr()[:].tolist() == ["PD"]
        curve = file["curve_point"]
        last = np.argmax(curve["load(1).value"][:])
        assert curve["load(1).value"][last] == pytest.approx(101, rel=1e-12)
        found = curve["rotation.speed_rpm"][last]
        assert curve["largest_multiplier"][:] == pytest.approx(1.0, abs=1e-7)
    with h5py.File("branch.h5") as file:
        (doubling,) = points(file, "PD")
    assert found == pytest.approx(doubling, rel=1e-11)
    done = plot("curve.h5", "--kind", "curves", "--save", "curves.png")
    assert (done.returncode, done.stderr) == (0, "")


def test_where_a_doubling_ends_in_a_grazing():
    """The grazing has a multiplier -1 where the curve of the doubling has no next point."""
    near = {
        "follow(1)%first": 1574,
        "follow(1)%last": 1584,
        "follow(1)%doublings": 0,
        "follow(2)%first": 98.8,
        "follow(2)%last": 100.4,
    }
    words = [word for key, value in near.items() for word in ("--set", f"{key}={value}")]
    done = succeed("razy-follow", PAIR_MAP, *words, "--output", "curve.h5")
    assert "GRPD at rotation%speed_rpm 1576.8252592" in done.stderr
    with h5py.File("curve.h5") as file:
        labels = file["curve/label"].asstr()[:].tolist()
        assert file["junction/label"].asstr()[:].tolist() == ["GRPD"]
        assert labels[file["junction/curve"][0] - 1] == "GR"
        points = file["curve_point/curve"][:] == 1 + labels.index("PD")
        for name in ("rotation.speed_rpm", "load(1).value"):
            end = file[f"curve_point/{name}"][:][points].min()
            assert file[f"junction/{name}"][0] == pytest.approx(end, rel=1e-7)
    done = plot("curve.h5", "--kind", "curves", "--save", "curves.svg")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("damping", "cubic", "last", "most", "guess"),
    [(0.1, 0.04, 2.5, 1.2, (0.7, 2.2, 1.09, 0.257)), (0.5, 1.0, 4.0, 3.0, (0.5, 0.8, 1.52, 0.94))],
)
def test_folds_of_duffing_meet_in_a_cusp(damping, cubic, last, most, guess):
    """Below that load no speed has two motions; by harmonic balance. The second begins close to the cusp."""
    text = (SOURCE / "inputs/duffing.nml").read_text().replace("0.04, damping=0.1", f"{cubic}, damping={damping}")
    lines = [line for line in text.splitlines() if not line.startswith(("&sweep", "&follow"))]
    lines += [f"&follow parameter='load%angular_frequency', first=0.5, last={last} /"]
    lines += [f"&follow parameter='load%amplitude', first=0.2, last={most} /"]
    Path("duffing.nml").write_text("\n".join(lines) + "\n")
    done = succeed("razy-follow", "duffing.nml", "--output", "duffing.h5")
    assert done.stderr.count("a cusp: two folds meet") == 2
    with h5py.File("duffing.h5") as file:
        assert file["junction/label"].asstr()[:].tolist() == ["CP", "CP"]
        place = [file[f"junction/load.{name}"][:] for name in ("angular_frequency", "amplitude")]
    assert pytest.approx(np.tile(cusp_of_duffing(damping, cubic, guess), (2, 1)), rel=2e-8) == np.array(place).T
    assert plot("duffing.h5", "--kind", "curves", "--save", "curves.svg").returncode == 0


WHIRLER = """
&scene kind='rotor' /
&shaft name='r', young_modulus=2.1e11, poisson_ratio=0.3, density=1e-6 /
&section shaft='r', length=0.2, outer_diameter=0.1, elements=1 /
&disk shaft='r', node=1, mass=4.0, polar_inertia=0.0, diametral_inertia=1.0 /
&support shaft='r', node=1, held='theta','psi' /
&support shaft='r', node=2, held='theta','psi' /
&freedom axial=.false., torsion=.false. /
&reduction modes=2 /
&rotation speed_rpm=4200.0, gyroscopic=.false. /
&bearing name='seal', shaft='r', node=1, kind='matrix', stiffness=4e4,700.0,-700.0,4e4, damping_matrix=8.0,0.0,0.0,8.0 /
&unbalance shaft='r', node=1, moment=2e-5 /
&motion t_end=10.0, start='zero' /
&record observable='displacement', of='r.1.v', what='extrema' /
&follow parameter='bearing(1)%stiffness(2)','bearing(1)%stiffness(3)', factor=1.0,-1.0, first=700.0, last=900.0 /
&follow parameter='rotation%speed_rpm', first=2500.0, last=4300.0 /
"""


def test_a_curve_of_tori_and_its_resonances():
    """Forward whirl of 100 rad/s grows from a cross stiffness of damping times that on, whatever the unbalance does."""
    Path("whirler.nml").write_text(WHIRLER)
    with follow(Path("whirler.nml")) as file:
        assert points(file, "TR") == pytest.approx([800.0], rel=1e-9)
        assert file["curve/label"].asstr()[:].tolist() == ["TR"]
        kind, rpm = file["junction/label"].asstr()[:].tolist(), file["junction/rotation.speed_rpm"][:]
        assert file["junction/bearing(1).stiffness(2)"][:] == pytest.approx([800.0, 800.0], rel=1e-9)
    # The excitation is four and three times as fast as the whirl.
    assert dict(zip(kind, rpm, strict=True)) == pytest.approx({"R4": 12000 / np.pi, "R3": 9000 / np.pi}, rel=1e-9)


def cusp_of_duffing(damping, cubic, guess, harmonics=16):
    """Frequency and load where residual, its null vector's test function and the second derivative along it vanish.

    `guess`: first harmonic (cosine, sine), frequency, load.
    """
    order = 2 * np.arange(harmonics) + 1
    turn = np.outer(2 * np.pi * np.arange(8 * harmonics) / (8 * harmonics), order)
    wave = np.hstack([np.cos(turn), np.sin(turn)])
    back = wave.T / (4 * harmonics)
    border = np.eye(2 * harmonics)[0]

    def missed(unknowns):
        x, omega, load = unknowns[:-2], *unknowns[-2:]
        stiffness, turned = np.diag(1 - (omega * order) ** 2), np.diag(damping * omega * order)
        linear = np.block([[stiffness, turned], [-turned, stiffness]])
        time = wave @ x
        residual = linear @ x + cubic * back @ time**3 - load * border
        jacobian = linear + 3 * cubic * (back * time**2) @ wave
        square = np.block([[jacobian, border[:, None]], [border[None, :], np.zeros((1, 1))]])
        one = np.eye(2 * harmonics + 1)[-1]
        right, left = np.linalg.solve(square, one), np.linalg.solve(square.T, one)
        bend = 6 * cubic * back @ (time * (wave @ right[:-1]) ** 2)
        return [*residual, right[-1], left[:-1] @ bend]

    start = np.zeros(2 * harmonics + 2)
    start[[0, harmonics, -2, -1]] = guess
    found, _, flag, message = fsolve(missed, start, full_output=True, xtol=1e-13)
    assert flag == 1, message
    return found[-2:]


def test_second_parameter_has_to_hold_its_value():
    done = start("razy-follow", PAIR_MAP, "--set", "follow(2)%first=150")
    assert done.returncode == 2
    assert "&follow number 2" in done.stderr or "follow(2)" in done.stderr
    assert "a range that holds 100" in done.stderr and done.stderr.count("\n") == 1


def test_all_motions_are_pieced_together():
    """Cells of the range give the one branch, with both its folds, that goes through it."""
    with follow(HYSTERESIS) as file:
        folds, ends = points(file, "LP"), file["special/label"].asstr()[-1]
    done = succeed("razy-follow", HYSTERESIS, *ALL, "--output", "all.h5")
    with h5py.File("all.h5") as file:
        assert file["branch/parent"][:].tolist() == [0]
        assert np.sort(points(file, "LP")) == pytest.approx(np.sort(folds), rel=1e-12)
        assert file["special/label"].asstr()[-1] == ends == "EP"
        parameter = file["point/load.frequency"][:]
        assert (parameter[0], parameter[-1]) == (12.0, 36.0)
        # No motion stands twice where two pieces meet, and they meet smoothly.
        step = np.linalg.norm(
            np.diff(file["point/state"][:] / np.abs(file["point/state"][:]).max(axis=0), axis=0), axis=1
        )
        assert step.min() > 0.0
        # States of neighbours are near each other where they stand at the same phase.
        assert step[np.diff(file["point/phase"][:]) == 0.0].max() < 0.05
        started = np.zeros(6, dtype=int)
        np.add.at(started, file["basin/sample"][:], file["basin/starts"][:])
        assert (started + file["sample/unsettled"][:] == 9).all()
        assert (file["sample/lyapunov"][:] < 0.0).all()
        unsettled = file["sample/unsettled"][:].sum()
    lines = done.stdout.splitlines()
    assert f"  of 54 starts {started.sum()} settle to these, {unsettled} to no motion of such a period" in lines
    (beside,) = [line for line in lines if "beside each other" in line]
    assert re.findall(r"[\d.]+", beside)[:3] == [f"{folds.min():.5f}", f"{folds.max():.5f}", "2"]
    assert sum("ends in a fold" in line for line in lines) == 2
    assert plot("all.h5", "--save", "picture.png").returncode == 0


def test_values_are_marked_at_borders_and_in_the_middle_of_cells():
    """Between the folds at 17.4 and 26.4 Hz there are three motions."""
    succeed("razy-follow", HYSTERESIS, *ALL, *sets(follow__values="20.0,22.0,23.0"), "--output", "u.h5")
    with h5py.File("u.h5") as file:
        assert np.sort(points(file, "UZ")) == pytest.approx(np.repeat([20.0, 22.0, 23.0], 3), rel=1e-14)


def test_a_start_at_a_value_is_marked():
    with follow(HYSTERESIS, **{"follow__from": 15.0, "follow__values": "15.0"}) as file:
        assert points(file, "UZ").tolist() == [15.0]


def test_all_motions_by_runge_kutta():
    """The places where they change have errors, as those of one motion."""
    cut = sets(follow__first=1.2, follow__last=1.6, follow__samples=2, follow__starts=4, follow__period=1)
    done = succeed("razy-follow", DUFFING, *cut, *sets(follow__motions="'all'"), "--output", "d.h5")
    with h5py.File("d.h5") as file, follow(DUFFING) as one:
        assert points(file, "LP") == pytest.approx(points(one, "LP"), rel=1e-9) and len(points(file, "LP")) > 0
        of_folds = file["special/label"].asstr()[:] == "LP"
        assert (file["special/error"][:][of_folds] > 0.0).all() and file["special/error"][:].max() < 1e-6
    assert "ends in a fold" in done.stdout


def test_no_motion_counts_as_one_of_more_periods():
    """With the settings of the input one branch of period 1 is all there is, at every cell of the range."""
    succeed("razy-follow", HYSTERESIS, *sets(follow__motions="'all'"), "--output", "h.h5")
    with h5py.File("h.h5") as file:
        assert file["branch/parent"][:].tolist() == [0]
        assert (file["point/multiplicity"][:] == 1).all()


def test_three_periods_stay_three():
    """Where the branch turns back, a step can end on the motion of one period, which closes after three as well."""
    with follow(GEAR_PAIR, follow__period=3, follow__doublings=0, follow__from=1650) as file:
        assert (file["point/multiplicity"][:] == 3).all()
        assert file["point/rotation.speed_rpm"][:].max() < 1720.0


def test_all_motions_of_a_gear_pair():
    """Motions that no start settles to, whose branches are apart from that of the machine's own."""
    succeed(
        "razy-follow",
        GEAR_PAIR,
        *ALL,
        *sets(follow__first=1600, follow__last=1640, follow__samples=2),
        "--output",
        "g.h5",
    )
    with h5py.File("g.h5") as file:
        parent, multiplicity = file["branch/parent"][:], file["point/multiplicity"][:]
        special = file["special/label"].asstr()[:], file["special/parameter"][:]
        stable = file["point/stable"][:] == 1
    assert (parent == 0).sum() > 1 and set(multiplicity) >= {1, 2, 4, 8} and not stable.all()
    for label, speed in (("PD", 1625.3511), ("LP", 1607.8222)):
        assert np.abs(special[1][special[0] == label] - speed).min() < 1e-4


@pytest.mark.parametrize(("middle", "width", "fold"), [(1920, 16, 1905.259859498728), (1840, 32, 1810.5197566260385)])
def test_closed_branches_of_four_periods_are_found(middle, width, fold):
    """No other branch leads to them: an older search found both, a later one neither."""
    there = sets(follow__first=middle + width, follow__last=middle - width, follow__samples=1, follow__doublings=0)
    succeed("razy-follow", GEAR_PAIR, "--set", "follow%motions='all'", *there, "--output", "i.h5")
    with h5py.File("i.h5") as file:
        folds = file["special/parameter"][:][file["special/label"].asstr()[:] == "LP"]
    assert np.abs(folds / fold - 1).min() < 1e-11


def test_all_motions_do_not_depend_on_ranks_or_an_end_in_between():
    case = (GEAR_PAIR, *ALL, *sets(follow__first=1520, follow__last=1600))
    said = succeed("razy-follow", *case, "--output", "one.h5").stdout
    # What there is of many motions fits on a page.
    assert said.count("branch") < 40 and re.search(r"\n  and \d+ over shorter ranges", said)
    succeed("razy-follow", *case, "--output", "three.h5", ranks=3)
    assert datasets("three.h5") == datasets("one.h5")
    process = subprocess.Popen(command("razy-follow", *case, "--output", "again.h5"), stderr=subprocess.PIPE)
    checkpoint = Path("again.h5.checkpoint")
    wait_for(lambda: checkpoint.exists() and checkpoint.stat().st_size > 5000, "no cell in the checkpoint")
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 3 and b"goes on from there" in said
    assert "going on" in succeed("razy-follow", *case, "--output", "again.h5").stderr
    assert datasets("again.h5") == datasets("one.h5")
    assert "again.h5.checkpoint" not in left()


NONE = """\
&scene   kind='lumped' /
&mass    name='block', value=1.0 /
&spring  between='block','frame', stiffness=1.0e4, damping=1.0e7 /
&stop    name='stops', between='block','frame', side='both', clearance=1.0e-3, stiffness=3.0e4 /
&load    on='block', amplitude=2.0, frequency=12.0 /
&motion  t_end=1.0, start='zero' /
&record  observable='contact_force', what='extrema' /
&follow  parameter='load%frequency', first=14.0, last=20.0, motions='all', samples=2, starts=1, settle=30 /
"""


@pytest.mark.parametrize("ranks", [None, 2])
def test_not_one_motion(ranks):
    Path("none.nml").write_text(NONE)
    done = succeed("razy-follow", "none.nml", ranks=ranks)
    assert "from 14.000000 to 20.000000 Hz: none of up to" in done.stdout
    with h5py.File("none.h5") as file:
        assert file["point/load.frequency"].shape == (0,) and file["point/multiplier"].ndim == 3
        assert file["sample/load.frequency"].shape == (2,)
    assert left() == ["none.h5", "none.nml"]
    done = plot("none.h5", "--save", "none.png")
    assert done.returncode == 2 and "no motion of load.frequency in the file" in done.stderr


UNDAMPED = """\
&mass   name='m', value=1.0 /
&spring between='m','frame', stiffness=1.0 /
&load   on='m', amplitude=0.5, angular_frequency=1.0 /
&motion t_end=100.0, start='zero' /
&record observable='displacement', what='extrema' /
&follow parameter='load%angular_frequency', first=2.0, last=3.0, motions='all', samples=4 /
"""


@pytest.mark.parametrize("method", ["exact", "dop853"])
def test_what_nothing_damps_is_not_chaotic(method):
    Path("undamped.nml").write_text(UNDAMPED)
    done = succeed("razy-follow", "undamped.nml", *sets(motion__integrator=f"'{method}'"))
    assert "was found" in done.stdout and "chaotic" not in done.stdout


STUCK = """\
&mass     name='a', value=1.0 /
&mass     name='b', value=1.0 /
&spring   between='a','frame', stiffness=1.0, damping=0.1 /
&spring   between='a','b', stiffness=1.0 /
&friction name='f', between='a','frame', static_coefficient=1.0, kinetic_coefficient=1.0, normal_load=1.0 /
&friction name='g', between='b','frame', static_coefficient=1.0, kinetic_coefficient=1.0, normal_load=1.0 /
&load     on='a', amplitude=0.5, angular_frequency=1.0 /
&motion   t_end=100.0, start='zero' /
&record   of='a', observable='displacement', what='extrema' /
&follow   parameter='load%amplitude', first=0.1, last=0.5, motions='all', samples=2 /
"""


def test_what_friction_holds_is_one_motion():
    """There is one for each place; a cell follows that to which the machine's own start leads."""
    Path("stuck.nml").write_text(STUCK)
    succeed("razy-follow", "stuck.nml")
    with h5py.File("stuck.h5") as file:
        assert 1 <= len(file["branch/parent"]) <= 2
        assert file["basin/starts"][:].sum() == 18 and (file["sample/unsettled"][:] == 0).all()


@pytest.mark.parametrize("ranks", [None, 2])
def test_what_begins_nowhere_is_said_once(ranks):
    """Without a word on the start it is the static one, which a rigid stop does not have."""
    Path("rigid.nml").write_text(
        NONE.replace(", start='zero'", "").replace("stiffness=3.0e4", "law='rigid', restitution=0.8")
    )
    done = start("razy-follow", "rigid.nml", ranks=ranks)
    assert done.returncode == 1 and done.stderr.count("is a rigid stop") == 1
    assert left() == ["rigid.nml"]


def test_what_was_killed_with_its_file_there_ends_when_it_is_called_again():
    """Between the naming of the file and the end of the checkpoint a kill leaves both."""
    words = (HYSTERESIS, *ALL, "--output", "out.h5")
    succeed("razy-follow", *words)
    whole = Path("out.h5").read_bytes()
    Path("out.h5").rename("whole.h5")
    process = subprocess.Popen(command("razy-follow", *words, "--checkpoint-points", "1"), stderr=subprocess.DEVNULL)
    checkpoint = Path("out.h5.checkpoint")
    wait_for(lambda: checkpoint.exists() and checkpoint.stat().st_size > 20000, "nothing is recorded")
    process.kill()
    process.wait()
    Path("whole.h5").rename("out.h5")
    Path("out.h5.partial").write_text("unfinished")
    succeed("razy-follow", *words)
    assert Path("out.h5").read_bytes() == whole and left() == ["out.h5"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGUSR1])
@pytest.mark.parametrize("options", [(), ("--dry-run",), ALL, (*ALL, "--dry-run")])
def test_a_signal_stops_every_run(number, options):
    """A million periods are followed before anything is looked for."""
    long = sets(follow__first=1500, follow__last=1640, follow__settle=10**6)
    words = command("razy-follow", GEAR_PAIR, *long, *options, "--output", "out.h5")
    with subprocess.Popen(words, stderr=subprocess.PIPE) as process:
        time.sleep(1)
        assert process.poll() is None
        process.send_signal(number)
        try:
            _, said = process.communicate(timeout=5)
        finally:
            process.kill()
    assert process.returncode == 3 and b"stopped: " in said
    assert left() == (["out.h5.checkpoint"] if options == ALL else [])


@pytest.mark.parametrize("options", [(), ALL])
def test_time_of_a_motion_that_is_run_in_parts(options):
    long = sets(follow__first=1500, follow__last=1640, follow__settle=10**6, motion__max_seconds=0.2)
    done = start("razy-follow", GEAR_PAIR, *long, *options, "--output", "out.h5", timeout=30)
    assert done.returncode == 1 and "the motion from the start of &motion does not come through" in done.stderr


def test_a_dry_run_says_what_it_takes():
    done = succeed("razy-follow", HYSTERESIS, *ALL, "--dry-run", ranks=2)
    assert re.search(r"6 cells, in each 9 starts\n.*\ntime: [\d.]+ s of one core; on 2 ranks [\d.]+ s", done.stdout)
    assert "starts: at 6 values, of motions of up to 4 periods\n" in done.stdout
    assert left() == []


def test_a_dry_run_says_what_would_be_followed():
    asked = sets(follow__sensitivities="'stop%clearance'", follow__values="20,21", follow__doublings=3)
    done = succeed("razy-follow", HYSTERESIS, *asked, "--dry-run")
    assert done.stdout.splitlines()[:-2] == [
        "parameter: load%frequency from 12.0 to 36.0 Hz",
        "starts: at 12.0, with what the machine settles to",
        "branches: of at most 2000 points, doublings followed 3 times in a row",
        "values: 2 at which motions are stored",
        "sensitivities: to stop%clearance",
    ]
    assert done.stdout.splitlines()[-2].startswith("timed: the first motion")
    assert left() == []
    done = succeed("razy-follow", PAIR_MAP, "--dry-run")
    assert re.match(
        r"parameter: rotation%speed_rpm from 2600.0 to 1850.0 rpm\n"
        r"parameter: load\(1\)%value from 50.0 to 200.0 N or N m\n +with load\(2\)%value, -1.0 times it\n",
        done.stdout,
    )
    succeed("razy-follow", HYSTERESIS, "--output", "first.h5")
    begun = sets(follow__start_file="'first.h5'", follow__start_label="'EP1'")
    done = succeed("razy-follow", HYSTERESIS, *begun, "--dry-run")
    assert re.search(r"starts: at 36.0, with point \d+ of first.h5, of period 1\n", done.stdout)


def test_what_is_short_says_nothing_of_itself():
    assert "period" not in succeed("razy-follow", HYSTERESIS, "--force").stderr.partition("branch")[0]


@pytest.mark.parametrize("options", [[], ALL])
def test_progress_of_one_motion(options):
    """A first motion that takes long, also that of a cell, is spoken of ever more seldom."""
    words = command("razy-follow", GEAR_PAIR, *sets(follow__settle=10**6), *options, "--output", "out.h5")
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
        try:
            first, second = process.stderr.readline(), process.stderr.readline()
        finally:
            process.kill()
    times = []
    for line in (first, second):
        said = re.fullmatch(r"first motion: period (\d+), rotation%speed_rpm [\d.]+, ([\d.]+) s\n", line)
        assert said, line
        times.append(float(said[2]))
    assert 2.0 <= times[0] < 3.0 and 4.0 <= times[1] < 6.0
