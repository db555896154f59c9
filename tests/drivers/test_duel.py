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
