"""razy-sweep under mpirun: the same results on any number of ranks, one message for a mistake."""

import os
from pathlib import Path

import h5py
import numpy as np
import pytest
from programs import GEAR_PAIR, SOURCE, attribute, changed, datasets, folder_of_openblas, left, sets, start, succeed

RANKS = [1, 2, 3]
VIBROPRESS = SOURCE / "inputs" / "vibropress.nml"


def test_results_do_not_depend_on_the_number_of_ranks():
    succeed("razy-sweep", GEAR_PAIR, *sets(sweep__step=8), "--output", "alone.h5")
    alone = datasets("alone.h5")
    for ranks in [*RANKS, 8]:
        succeed("razy-sweep", GEAR_PAIR, *sets(sweep__step=8), "--output", f"{ranks}.h5", ranks=ranks)
        assert datasets(f"{ranks}.h5") == alone
        assert attribute(f"{ranks}.h5", "input") == attribute("alone.h5", "input")
        assert Path(f"{ranks}.h5").read_bytes() == Path("alone.h5").read_bytes()


def test_more_ranks_than_points_and_failed_points():
    options = sets(sweep__first=1800, sweep__last=1900, sweep__step=100, motion__max_events=100)
    assert start("razy-sweep", GEAR_PAIR, *options, "--output", "alone.h5").returncode == 1
    for ranks in (3, 8):
        done = start("razy-sweep", GEAR_PAIR, *options, "--output", f"{ranks}.h5", ranks=ranks)
        assert done.returncode == 1 and "2 points, 2 failed" in done.stderr
        assert datasets(f"{ranks}.h5") == datasets("alone.h5")


def ours(done, word):
    return [line for line in (done.stdout + done.stderr).splitlines() if word in line]


@pytest.mark.parametrize("ranks", RANKS)
def test_bad_input_is_one_message_and_exit_code_2(ranks):
    changed(Path("bad.nml"), GEAR_PAIR.read_text(), ("what='extrema'", "what='extremes'"))
    done = start("razy-sweep", "bad.nml", ranks=ranks, timeout=30)
    assert done.returncode == 2
    assert len(ours(done, "bad.nml:15: &record what = 'extremes'")) == 1
    assert left() == ["bad.nml"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([GEAR_PAIR, "--frce"], "--frce: no such option"),
        ([GEAR_PAIR, "--output", "no/x.h5"], "no/x.h5"),
        ([], "no input"),
    ],
)
def test_wrong_usage_is_one_message_and_exit_code_2(arguments, says):
    done = start("razy-sweep", *arguments, ranks=3, timeout=30)
    assert done.returncode == 2
    assert len(ours(done, says)) == 1


def test_existing_file_is_refused():
    Path("torsional_gear_pair.h5").write_text("precious")
    done = start("razy-sweep", GEAR_PAIR, ranks=3, timeout=30)
    assert done.returncode == 2
    assert len(ours(done, "is no result of razy, and is not overwritten")) == 1
    assert Path("torsional_gear_pair.h5").read_text() == "precious"


def test_help_version_and_check_are_printed_once():
    assert len(ours(succeed("razy-sweep", "--help", ranks=3), "usage:")) == 1
    assert len(ours(succeed("razy-sweep", "--version", ranks=3), os.environ["RAZY_VERSION"])) == 1
    assert len(ours(succeed("razy-sweep", GEAR_PAIR, "--check", ranks=3), "&scene")) == 1
    assert left() == []


@pytest.mark.skipif(folder_of_openblas() is None, reason="no OpenBLAS beside the BLAS of this machine")
def test_threads_of_the_library_change_no_bit(monkeypatch):
    monkeypatch.setenv("LD_LIBRARY_PATH", str(folder_of_openblas()))
    for name, threads in (("one", 1), ("two", 2), ("four", 4)):
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", str(threads))
        succeed("razy-sweep", VIBROPRESS, *sets(sweep__step=4), "--output", f"{name}.h5")
        succeed("razy-modes", VIBROPRESS, "--output", f"{name}_modes.h5")
    assert datasets("two.h5") == datasets("one.h5") == datasets("four.h5")
    assert datasets("two_modes.h5") == datasets("one_modes.h5") == datasets("four_modes.h5")


@pytest.mark.skipif(folder_of_openblas() is None, reason="no OpenBLAS beside the BLAS of this machine")
@pytest.mark.parametrize(
    ("case", "step", "observable"), [(GEAR_PAIR, 100, "mesh_deformation"), (VIBROPRESS, 4, "displacement.table.y")]
)
def test_periodic_motions_are_those_of_any_library(case, step, observable, monkeypatch):
    found = []
    for name in ("usual", "other"):
        succeed("razy-sweep", case, *sets(sweep__step=step), "--output", f"{name}.h5")
        with h5py.File(f"{name}.h5") as file:
            extrema = file[f"extrema/{observable}"]
            found.append((file["point/period"][:] > 0, np.split(extrema["value"][:], extrema["offset"][1:-1])))
        monkeypatch.setenv("LD_LIBRARY_PATH", str(folder_of_openblas()))
    (regular, usual), (same, other) = found
    assert np.array_equal(regular, same) and regular.sum() > regular.size // 2
    for i in np.flatnonzero(regular):
        assert abs(usual[i] - other[i]).max() < 1e-12 * abs(usual[i]).max()
