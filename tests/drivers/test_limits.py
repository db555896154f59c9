"""Motions that would not end, and numbers that no machine has: each ends at once, right or with what is wrong."""

import re
import shlex
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
import pytest
from faults import kill_all, points_done, processes_of, wait_for
from programs import SOURCE, command, folder_of_openblas, sets, start, succeed

CASE = """
&scene   kind='lumped', title='Mass against a stop' /
&mass    name='block', value=2.0 /
&spring  between='block','frame', stiffness=2.0e4, damping=8.0 /
&stop    name='bumper', between='block','frame', clearance=1.0e-3, stiffness=1.0e6, damping=50.0 /
&load    on='block', amplitude=30.0, frequency=14.0 /
&motion  t_end=4.0, start='zero' /
&record  observable='displacement', what='extrema', from=3.0 /
&sweep   parameter='load%frequency', first=8.0, last=30.0, points=5 /
"""
LONG = sets(load__frequency=1e6, motion__max_steps=2000000000)
AT_ONCE = 20
WITH_OPENBLAS = pytest.mark.skipif(folder_of_openblas() is None, reason="no OpenBLAS beside the BLAS of this machine")


@pytest.fixture
def case(folder):
    path = folder / "case.nml"
    path.write_text(CASE)
    return path


def single(path, name):
    with h5py.File(path) as file:
        return file[name][()].reshape(-1)[0]


@pytest.mark.parametrize("mass", [1e-12, 1e-20, 1e-30])
def test_a_body_almost_without_mass_is_followed(case, mass):
    succeed("razy-run", case, *sets(mass__value=mass), timeout=AT_ONCE)
    with h5py.File("case.h5") as file:
        extrema = file["extrema/displacement/value"][:]
    # Without inertia the force of spring and dampers is that of the load.
    reach = 30.0 / np.hypot(2.0e4, 8.0 * 2 * np.pi * 14.0)
    assert extrema.min() == pytest.approx(-reach, rel=1e-6)


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({"mass__value": 1e-308}, "mass%value = 1e-308: is less than 1e-30"),
        ({"load__amplitude": 1e200}, "load%amplitude = 1e+200: is beyond 1e30"),
        ({"load__frequency": 1e300}, "load%frequency = 1e+300: is beyond 1e30"),
        (
            {"record__interval": 1e-300, "record__what": "'trajectory'"},
            "interval = 1e-300: longer: the trajectory would",
        ),
        ({"record__interval": 1e-9, "record__what": "'trajectory'"}, "interval = 1e-09: longer: the trajectory would"),
    ],
)
def test_numbers_that_no_machine_has_are_refused(case, values, key):
    done = start("razy-run", case, *sets(**values), timeout=AT_ONCE)
    assert done.returncode == 2 and key in done.stderr and len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("values", [{"load__frequency": 1e12}, {"load__frequency": 1e18}, {"spring__stiffness": 1e25}])
def test_a_motion_too_fast_to_reach_its_end_says_so_at_once(case, values):
    done = start("razy-run", case, *sets(**values), timeout=AT_ONCE)
    assert done.returncode == 1 and "step limit reached" in done.stderr


@pytest.mark.parametrize("integrator", ["exact", "dop853", "moreau_jean"])
def test_steps_and_time_are_limited(case, integrator):
    method = {"motion__integrator": f"'{integrator}'", "load__frequency": 1e5}
    if integrator == "moreau_jean":
        method["motion__step"] = 1e-7
    done = start("razy-run", case, *sets(**method, motion__max_steps=2000), timeout=AT_ONCE)
    assert done.returncode == 1 and "step limit reached" in done.stderr
    assert single("case.h5", "outcome/steps") <= 2000
    done = start(
        "razy-run", case, "--force", *sets(**method, motion__t_end=4000, motion__max_seconds=0.3), timeout=AT_ONCE
    )
    assert done.returncode == 1 and "time limit reached" in done.stderr


def test_a_stiff_damper_ends_an_explicit_method_early(case):
    values = {"motion__integrator": "'dop853'", "stop__damping": 1e12, "motion__max_steps": 8000000}
    done = start("razy-run", case, *sets(**values), timeout=AT_ONCE)
    assert done.returncode == 1 and "step limit reached" in done.stderr
    assert single("case.h5", "outcome/steps") < 1000000


# An mpirun that gets SIGTERM kills its ranks.
@pytest.mark.parametrize(("ranks", "number"), [(None, signal.SIGTERM), (None, signal.SIGUSR1), (2, signal.SIGUSR1)])
@pytest.mark.parametrize("threads", [False, pytest.param(True, marks=WITH_OPENBLAS)])
def test_a_signal_ends_a_sweep_in_the_middle_of_a_motion(case, ranks, number, threads, monkeypatch):
    if threads:
        monkeypatch.setenv("LD_LIBRARY_PATH", str(folder_of_openblas()))
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", "4")
    words = command(
        "razy-sweep", case, *LONG, *sets(sweep__first=1e6, sweep__last=1.1e6, motion__t_end=400), ranks=ranks
    )
    with Path("log").open("w") as log:
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
    try:
        wait_for(lambda: Path("case.h5.checkpoint").exists(), "the sweep does not begin")
        time.sleep(0.5)
        assert len(processes_of(process.pid)) == (ranks or 1)
        process.send_signal(number)
        assert process.wait(timeout=AT_ONCE) == 3
        assert points_done(Path("log").read_text()) == 0
    finally:
        kill_all(process)


SLOW = [*LONG, *sets(sweep__first=1e6, sweep__last=1.1e6, motion__t_end=400)]


def test_a_signal_ends_a_forecast(case):
    words = command("razy-sweep", case, "--dry-run", *SLOW)
    with subprocess.Popen(
        words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        assert process.stdout.readline() == "measuring up to 16 points, for 10 s at most\n"
        process.send_signal(signal.SIGTERM)
        assert process.communicate(timeout=AT_ONCE)[0] == ""
        assert process.returncode == 3


def test_a_forecast_takes_ten_seconds_and_says_what_it_does_not_know(case):
    done = succeed("razy-sweep", case, "--dry-run", *SLOW, timeout=AT_ONCE)
    assert done.stdout.startswith(
        "5 points: 5 of the grid, 1 start each\ntimed: no point, the first takes longer: time"
    )
    assert re.search(r"^memory: [\d.]+ MB each rank", done.stdout, re.M) and "result file: " not in done.stdout
    some = sets(sweep__first=20, sweep__last=1e6, motion__max_steps=2000000000, motion__t_end=400)
    done = succeed("razy-sweep", case, "--dry-run", *some, timeout=AT_ONCE)
    assert re.search(r"^timed: 1 point, 0 failed", done.stdout, re.M)
    assert "what follows is the least\ntime: " in done.stdout


def test_a_forecast_of_branches_takes_ten_seconds(case):
    path = case.with_name("slow.nml")
    path.write_text(case.read_text() + "&follow parameter='load%frequency', first=1e-5, last=1.1e-5 /\n")
    method = sets(load__frequency=1e-5, motion__integrator="'dop853'", motion__max_steps=2000000000)

    def forecast(motions):
        more = sets(follow__motions=f"'{motions}'")
        return succeed("razy-follow", path, "--dry-run", *method, *more, timeout=AT_ONCE)

    # Side by side: both take their ten seconds.
    with ThreadPoolExecutor() as pool:
        for done in pool.map(forecast, ("one", "all")):
            assert "timed: nothing, " in done.stdout and done.stderr == "measuring for 10 s at most\n"


def test_more_starts_than_a_sweep_has_room_for_are_refused(case):
    case.write_text(
        case.read_text()
        + "&starts method='box', samples=1000000000 /\n&start_range coordinate='block', first=-1e-3, last=1e-3 /\n"
    )
    done = start("razy-sweep", case, timeout=AT_ONCE)
    assert done.returncode == 2 and "&starts: at most 200000000 starts of each of 5 points" in done.stderr


def test_more_values_than_the_plan_of_all_motions_has_room_for_are_refused(case):
    case.write_text(case.read_text() + "&follow parameter='load%frequency', first=14.0, last=20.0, motions='all' /\n")
    done = start("razy-follow", case, *sets(follow__samples=2001), timeout=AT_ONCE)
    assert done.returncode == 2 and "samples = 2001: must be an integer from 1 to 2000" in done.stderr


def test_a_damping_ratio_beyond_sense_is_refused():
    path = SOURCE / "inputs" / "thesis" / "fig_4_21.nml"
    done = start("razy-sweep", path, "--set", "shaft(1)%damping_ratio=1e20", timeout=AT_ONCE)
    assert done.returncode == 2 and "must be a real number from 0.0 to 1000000.0" in done.stderr


@pytest.mark.parametrize("law", ["damping=50.0", "law='hunt_crossley', hysteresis=0.5"])
def test_a_bumper_does_not_pull(case, law):
    case.write_text(
        case.read_text().replace("damping=50.0", law).replace("observable='displacement'", "observable='contact_force'")
    )
    succeed("razy-run", case, timeout=AT_ONCE)
    with h5py.File("case.h5") as file:
        force = file["extrema/contact_force/value"][:]
    assert force.max() > 1.0 and force.min() >= -1e-9 * force.max()


ELASTIC = """
&scene   kind='lumped' /
&mass    name='ball', value=1.0 /
&stop    name='floor', between='ball','frame', side='lower', clearance=0.0, law='rigid', restitution=1.0 /
&load    on='ball', value=-2.0 /
&initial on='ball', displacement=1.0e-3 /
&motion  t_end=3.0, start='given' /
&record  observable='state', what='trajectory', interval=0.01 /
"""


@pytest.mark.parametrize("integrator", ["exact", "dop853"])
def test_bounces_that_drag_alone_slows_end_with_a_status(folder, integrator):
    path = folder / "drag.nml"
    path.write_text(ELASTIC + "&damper between='ball','frame', damping=70.0 /\n")
    done = start("razy-run", path, *sets(motion__integrator=f"'{integrator}'"), timeout=2 * AT_ONCE)
    assert done.returncode == 1 and "event limit reached" in done.stderr


def test_a_long_list_of_events_needs_no_stack(folder):
    path = folder / "elastic.nml"
    path.write_text(ELASTIC)
    words = command("razy-run", path, *sets(initial__displacement=1e-9, motion__t_end=12.0))
    script = f"ulimit -s 1024; exec {shlex.join(words)}"
    done = subprocess.run(["bash", "-c", script], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    with h5py.File("elastic.h5") as file:
        assert file["event/time"].size > 150000


def test_long_texts_take_no_time(case):
    case.write_text(case.read_text().replace("Mass against a stop", 300000 * "x"))
    succeed("razy-run", case, timeout=5)
    names = ",".join(["block.displacement", *(f"c{number}" for number in range(100000))])
    Path("wide.csv").write_text(f"{names}\n{','.join(100001 * ['0.0'])}\n")
    starts = "&starts method='file', file='wide.csv' /\n&start_range coordinate='block' /\n"
    Path("wide.nml").write_text(CASE + starts)
    succeed("razy-sweep", "wide.nml", timeout=5)


@pytest.fixture
def rattlers(folder):
    """A row of 20 bodies that rattle between stops: a motion that comes to ever new combinations of contacts."""
    lines = ["&scene kind='lumped', title='Rattlers' /"]
    for i in range(20):
        lines += [
            f"&mass name='m{i}', value=1.0 /",
            f"&spring between='m{i}','frame', stiffness={1e4 + 700 * i}, damping=4.0 /",
            f"&stop name='s{i}', between='m{i}','frame', side='both', clearance=1e-3, stiffness=3e4 /",
            f"&load on='m{i}', amplitude=20.0, frequency={15 + 1.37 * (i % 5)} /",
        ]
    lines += [
        "&motion t_end=0.4, start='zero' /",
        "&record observable='displacement', of='m0', what='extrema', from=0.2 /",
        "&sweep parameter='stop(1)%clearance', first=0.9e-3, last=1.0e-3, points=3 /",
    ]
    path = folder / "rattlers.nml"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_where_closed_forms_do_not_pay_automatic_is_dop853(rattlers):
    succeed("razy-run", rattlers, "--output", "automatic.h5")
    succeed("razy-run", rattlers, "--output", "dop853.h5", *sets(motion__integrator="'dop853'"))
    succeed("razy-sweep", rattlers, "--output", "sweep.h5")
    name = "extrema/displacement.m0/value"
    with h5py.File("automatic.h5") as automatic, h5py.File("dop853.h5") as dop853, h5py.File("sweep.h5") as sweep:
        assert automatic["outcome/integrator"][()] == dop853["outcome/integrator"][()]
        assert np.array_equal(automatic[name][:], dop853[name][:])
        assert np.all(sweep["point/integrator"][:] == dop853["outcome/integrator"][()])


def test_memory_of_closed_forms_changes_no_bit(rattlers):
    names = "extrema/displacement.m0/value", "extrema/displacement.m0/time", "point/residual"
    for name, memory in ("large.h5", 256), ("small.h5", 1):
        values = sets(motion__integrator="'exact'", motion__memory_mb=memory)
        succeed("razy-sweep", rattlers, "--output", name, *values)
    with h5py.File("large.h5") as large, h5py.File("small.h5") as small:
        assert all(np.array_equal(large[name][:], small[name][:]) for name in names)
