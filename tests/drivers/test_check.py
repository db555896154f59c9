"""razy-check: what razy-follow finds is proved, what was altered is refused."""

import shutil
import sys

import h5py
import pytest
from programs import SOURCE, sets, start, succeed

sys.path.insert(0, str(SOURCE / "post" / "src"))
pytest.importorskip("flint")

from razy.check.cli import main

CASE = SOURCE / "inputs" / "impact_oscillator.nml"


@pytest.fixture(scope="module")
def branches(tmp_path_factory):
    file = tmp_path_factory.mktemp("check") / "branches.h5"
    start("razy-follow", CASE, "--output", file, *sets(follow__max_points=12))
    return file


def check(capsys, *words):
    code = main([str(word) for word in words])
    said = capsys.readouterr()
    return code, said.out, said.err


def test_motions_are_proved(branches, capsys):
    code, out, _ = check(capsys, branches, "--jobs", 2, "--output", "verdicts.h5")
    with h5py.File(branches) as data, h5py.File("verdicts.h5") as verdicts:
        proved = verdicts["verdict"][:] == 0
        special = data["special/point"][:]
        assert proved.size == data["point/state"].shape[0]
        assert proved.sum() >= proved.size - special.size and verdicts["radius"][:][proved].max() < 1e-30
    assert code == int(not proved.all()) and f"{proved.sum()} of {proved.size} motions proved" in out


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        ("state", lambda x: x * (1 + 1e-6), "state is farther"),
        ("multiplier", lambda x: x + 1e-3, "multipliers are not"),
        ("events", lambda x: x + 1, "events, not"),
        ("stable", lambda x: 1 - x, "stability is not"),
        ("period", lambda x: 2 * x, "its period"),
    ],
)
def test_what_was_altered_is_refused(branches, capsys, name, change, reason):
    shutil.copy(branches, "altered.h5")
    with h5py.File("altered.h5", "r+") as data:
        data[f"point/{name}"][...] = change(data[f"point/{name}"][...])
    code, out, _ = check(capsys, "altered.h5")
    refused = [line for line in out.splitlines() if ": refused: " in line]
    assert code == 1 and len(refused) > 5 and reason in out


def test_mistakes_are_one_line(branches, capsys):
    succeed("razy-run", SOURCE / "inputs" / "two_sided_stop.nml", "--output", "run.h5")
    for words, line in (
        (["none.h5"], "none.h5: no such file"),
        (["run.h5"], "run.h5: a file of razy-run; razy-check proves motions of razy-follow"),
        ([branches, "--jobs", "0"], "--jobs 0: a whole number from 1 to 1024"),
        ([branches, "--output", branches, "--force"], f"{branches}: is the file that is read"),
    ):
        code, out, err = check(capsys, *words)
        assert (code, out, err) == (2, "", f"razy-check: error: {line}\n")
