"""What razy-duel computes and writes."""

import h5py
import numpy as np
import pytest
from programs import SOURCE, start, succeed

CASE = """
&scene  kind='lumped', title='Mass against a stop' /
&mass   name='block', value=2.0 /
&spring between='block','frame', stiffness=2.0e4, damping=8.0 /
&stop   name='bumper', between='block','frame', clearance=1.0e-3, stiffness=1.0e6, damping=50.0 /
&load   on='block', amplitude=30.0, frequency=14.0 /
&motion t_end=1.0, start='zero' /
&duel   integrator='exact' /
&duel   integrator='dop853', treatment='event', tolerance=1e-6,1e-8,1e-10 /
&duel   integrator='dormand_prince', treatment='switching', tolerance=1e-6,1e-8 /
"""


@pytest.fixture
def case(folder):
    path = folder / "case.nml"
    path.write_text(CASE)
    return path


def test_errors_fall_with_the_tolerance(case):
    succeed("razy-duel", case)
    with h5py.File("case.h5") as file:
        method = file["method"].asstr()[:]
        error, cost = file["error"][:], file["cpu_time"][:]
        assert method.tolist() == ["exact"] + 3 * ["dop853"] + 2 * ["dormand_prince"]
        assert file["treatment"].asstr()[4] == "switching"
        assert file["reference/error"].attrs["reference"] == "exact"
        assert 0 < file["reference/error"][0] < 1e-9
        assert np.all(file["status"][:] == 0) and np.all(file["event_surplus"][:4] == 0)
        assert file["event_time_error"][3] < 1e-9
        assert np.all(file["rhs_evaluations"][1:] > 100)
    assert error[0] == 0.0
    assert error[1] > 10 * error[2] > 100 * error[3] > 0
    assert np.all(cost > 0)


@pytest.mark.parametrize(
    ("setting", "words"),
    [("duel(1)%treatment='smoothing'", "leave out the treatment"), ("duel(2)%step=1e-4", "either tolerances or steps")],
)
def test_methods_that_do_not_fit_are_refused(case, setting, words):
    done = start("razy-duel", case, "--set", setting)
    assert done.returncode == 2
    assert "&duel" in done.stderr and words in done.stderr
    assert len(done.stderr.splitlines()) == 1


# Left and right swing in opposition, and nothing but rounding moves the mass in the middle.
SYMMETRIC = """
&scene  kind='lumped', title='Two masses in opposition, one between them' /
&mass   name='left', value=1.0 /
&mass   name='middle', value=0.7 /
&mass   name='right', value=1.0 /
&spring between='left','frame', stiffness=3.3e3 /
&spring between='left','middle', stiffness=1.1e3, damping=0.3 /
&spring between='middle','right', stiffness=1.1e3, damping=0.3 /
&spring between='right','frame', stiffness=3.3e3 /
&stop   name='a', between='left','frame', clearance=5.0e-4, stiffness=1.7e4 /
&stop   name='b', between='right','frame', side='lower', clearance=5.0e-4, stiffness=1.7e4 /
&initial on='left', displacement=1.0e-3 /
&initial on='right', displacement=-1.0e-3 /
&motion t_end=1.0, start='given' /
&record observable='state', what='trajectory', interval=1e-3 /
&duel   integrator='dop853', treatment='event', tolerance=1e-6,1e-9 /
"""


def test_a_coordinate_of_rounding_is_no_error(folder):
    path = folder / "symmetric.nml"
    path.write_text(SYMMETRIC)
    succeed("razy-run", path, "--output", "motion.h5")
    with h5py.File("motion.h5") as file:
        left, middle, _ = np.abs(file["state/displacement"][:]).max(axis=0)
        assert 0 < middle < 1e-9 * left
    succeed("razy-duel", path)
    with h5py.File("symmetric.h5") as file:
        assert file["reference/error"][0] < 1e-10
        assert np.all(file["error"][:] < [1e-3, 1e-5])
        assert np.all(file["velocity_error"][:] < [1e-3, 1e-5])
        assert np.all(file["error"][:] > 0)
        for name in ("error", "velocity_error"):
            assert "1e-9" in file[name].attrs["relative_to"]


def test_a_small_coordinate_counts(folder):
    # A light mass that moves by 1e-6 of the other is no rounding: relative to its own motion it is followed worse.
    path = folder / "small.nml"
    path.write_text(SYMMETRIC.replace("value=0.7", "value=0.07").replace("=-1.0e-3", "=-0.999999e-3"))
    succeed("razy-duel", path)
    with h5py.File("small.h5") as file:
        assert file["error"][0] > 1e-3


def test_inputs_of_the_thesis_are_valid():
    for path in sorted((SOURCE / "inputs" / "thesis").glob("table_4_1.nml")):
        succeed("razy-duel", path, "--check")


def test_radau_keeps_the_motion_at_a_loose_tolerance(tmp_path):
    # Its first step, chosen at rest in contact, is longer than a period of the mesh: the error estimate has to say so.
    text = (SOURCE / "inputs" / "thesis" / "table_4_1.nml").read_text()
    kept = "\n".join(line for line in text.splitlines() if not line.startswith("&duel"))
    path = tmp_path / "loose.nml"
    path.write_text(kept + "\n&duel integrator='radau5', treatment='event', tolerance=1e-4 /\n")
    succeed("razy-duel", path, "--set", "motion%t_end=0.02")
    with h5py.File("loose.h5") as file:
        assert file["event_surplus"][0] == 0
        assert file["error"][0] < 1e-3
