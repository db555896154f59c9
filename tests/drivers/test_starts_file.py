"""Starts from a file: the same sweep as from a list, and one line for each mistake."""

import os
import random
from pathlib import Path

import h5py
import numpy as np
import pytest
from faults import CHECKPOINT, Sweep, kill_all
from programs import datasets, start, succeed

STOPS = """
&scene   kind='lumped', title='Mass between two stops' /
&mass    name='block', value=1.0 /
&spring  between='block','frame', stiffness=1.0e4, damping=4.0 /
&stop    name='stops', between='block','frame', side='both', clearance=1.0e-3, stiffness=3.0e4 /
&load    on='block', amplitude=2.0, frequency=20.0 /
&motion  t_end=3.0, start='zero' /
&record  observable='displacement', what='extrema', from=2.5 /
&sweep   parameter='load%frequency', first=20.0, last=26.0, points=3 /
"""
X, V = [0.0, 5.0e-3, -1.0e-3, 2.0e-3], [0.0, 0.5, -0.25, 1.0e-1]
RANGES = "&start_range coordinate='block'{} /\n&start_range coordinate='block', quantity='velocity'{} /\n"


def case(starts, *keys, name="case.nml"):
    Path(name).write_text(f"{STOPS}&starts {starts} /\n" + RANGES.format(*(keys or ("", ""))))
    return name


def from_list():
    case("method='list'", *(f", values={', '.join(map(repr, values))}" for values in (X, V)), name="list.nml")
    succeed("razy-sweep", "list.nml", "--force")
    return {name: value for name, value in datasets("list.h5").items() if not name.startswith("scene")}


def expect_list(path):
    expected = from_list()
    assert {name: value for name, value in datasets(path).items() if not name.startswith("scene")} == expected


def write_csv(*lines):
    rows = lines or [f"{i},{v!r},{x!r}" for i, (x, v) in enumerate(zip(X, V, strict=True))]
    header = [] if lines else ['number, "block.Velocity [m/s]", block.displacement [m]']
    Path("starts.csv").write_text("\n".join(["# three columns", "", *header, *rows, ""]))


def test_rows_of_a_text():
    write_csv()
    case("method='file', file='starts.csv'")
    succeed("razy-sweep", "case.nml")
    expect_list("case.h5")


def test_columns_of_hdf5_such_as_the_result_of_a_sweep():
    from_list()
    with h5py.File("list.h5") as file:
        assert file["point/start.block.velocity"].shape == (12,)
    with h5py.File("given.h5", "w") as file:
        file["x"] = np.array(X)
        file["inner/v"] = np.array(V)
    case("method='file', file='given.h5'", ", column='x'", ", column='inner/v'")
    succeed("razy-sweep", "case.nml")
    expect_list("case.h5")
    columns = (", column='point/start.block.displacement'", ", column='/point/start.block.velocity'")
    case("method='file', file='list.h5'", *columns, name="again.nml")
    succeed("razy-sweep", "again.nml", ranks=2)
    with h5py.File("again.h5") as file:
        assert file["point/start"].shape == (36,)
        assert file["point/start.block.velocity"][0::9].tolist() == V


@pytest.mark.parametrize("direction", ["independent", "both"])
def test_bits_do_not_depend_on_ranks(direction):
    write_csv()
    case("method='file', file='starts.csv'")
    for ranks in (1, 2, 3, 4):
        options = ["--set", f"sweep%direction='{direction}'", "--output", f"{ranks}.h5"]
        succeed("razy-sweep", "case.nml", *options, ranks=ranks)
        assert Path(f"{ranks}.h5").read_bytes() == Path("1.h5").read_bytes()


def test_a_changed_file_is_noticed():
    rng = np.random.default_rng(1)
    states = rng.uniform(-1e-3, 1e-3, (4000, 2)).tolist()
    rows = ["block.displacement,block.velocity", *(f"{x!r},{v!r}" for x, v in states)]
    write_csv(*rows)
    sweep = Sweep(case("method='file', file='starts.csv'"))
    process = sweep.begin(400000)
    kill_all(process)
    write_csv(*rows[:-1], "0.0,0.0")
    done = sweep.start()
    assert done.returncode == 2 and "contents_of_file" in done.stderr and done.stderr.count("\n") == 1
    assert Path(CHECKPOINT).exists()
    write_csv(*rows)
    done = sweep.start(ranks=2)
    assert done.returncode == 0, done.stderr
    sweep.expect_whole()


GOOD = "block.displacement,block.velocity"
MISTAKES = [
    ((GOOD, "0.0,1.0", "0.0"), "starts.csv:5: 1 values, but the first line names 2 columns"),
    ((GOOD, "0.0,1.0", "0.0,fast"), "starts.csv:5: column 'block.velocity' has 'fast'"),
    ((GOOD, "0.0,nan"), "starts.csv:4: column 'block.velocity' has 'nan'"),
    ((GOOD, "0.0,"), "starts.csv:4: column 'block.velocity' has ''"),
    (("block.displacement,block.velocitty", "0.0,1.0"), "starts.csv:3: no column 'block.velocity'; did you mean"),
    ((GOOD + ",block.velocity", "0.0,1.0,2.0"), "starts.csv:3: two columns 'block.velocity'"),
    ((GOOD,), "starts.csv: has no rows"),
]


@pytest.mark.parametrize(("lines", "says"), MISTAKES)
def test_mistakes_in_a_text(lines, says):
    write_csv(*lines)
    refuse(case("method='file', file='starts.csv'"), says)


def refuse(name, says):
    done = start("razy-sweep", name, timeout=20)
    assert done.returncode == 2
    assert says in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr
    assert not Path(CHECKPOINT).exists()


def test_other_mistakes():
    refuse(case("method='file'"), "&starts file: required for method = 'file'")
    refuse(case("method='file', file='none.csv'"), "none.csv: there is no such file")
    refuse(case("method='file', file='none.h5'"), "none.h5: there is no such file")
    Path("text.h5").write_text("no HDF5")
    refuse(case("method='file', file='text.h5'"), "text.h5: is neither text (.csv, .txt) nor an HDF5 file")
    with h5py.File("some.h5", "w") as file:
        file["flat"], file["two"] = np.zeros(3), np.zeros((2, 2))
        file["short"], file["holes"] = np.zeros(2), np.array([0.0, np.nan, 0.0])
    refuse(case("method='file', file='some.h5'"), "has no dataset 'block.displacement'")
    for name, says in (
        ("two", "has not one dimension"),
        ("a/b", "has no dataset 'a/b'"),
        ("short", "unequal lengths"),
        ("holes", "is not finite at place 1, from 0"),
    ):
        refuse(case("method='file', file='some.h5'", ", column='flat'", f", column='{name}'"), says)


@pytest.mark.parametrize(
    ("dataset", "says"),
    [
        ({"shape": (2**31,), "dtype": "f8"}, "has more than 1e8 values"),
        ({"shape": (2**40,), "dtype": "f8", "chunks": (1024,)}, "has more than 1e8 values"),
        ({"data": 3.0}, "has not one dimension"),
        ({"data": np.zeros((2, 3))}, "has not one dimension"),
        ({"data": "three"}, "cannot be read as real numbers"),
        ({"data": ["a", "b"]}, "cannot be read as real numbers"),
        ({"data": np.zeros(3, dtype=[("a", "f8"), ("b", "i4")])}, "cannot be read as real numbers"),
        (None, "is no dataset"),
    ],
)
def test_datasets_that_are_no_starts(dataset, says):
    with h5py.File("bad.h5", "w") as file:
        file["good"] = np.zeros(3)
        file.create_group("bad") if dataset is None else file.create_dataset("bad", **dataset)
    refuse(case("method='file', file='bad.h5'", ", column='bad'", ", column='good'"), says)


def test_damaged_files():
    with h5py.File("good.h5", "w") as file:
        file["x"], file["v"] = np.array(X), np.array(V)
    good, choice = Path("good.h5").read_bytes(), random.Random(int(os.environ.get("RAZY_HOSTILE_SEED", "18")))
    name = case("method='file', file='bad.h5'", ", column='x'", ", column='v'")
    codes = []
    for number in range(int(os.environ.get("RAZY_HOSTILE_FILES", "6"))):
        content = bytearray(good[: choice.randrange(len(good)) if number % 4 == 0 else None])
        for _ in range(choice.choice((1, 10, 100)) if number % 4 else 0):
            content[choice.randrange(len(content))] = choice.choice((0, 1, 255, choice.randrange(256)))
        Path("bad.h5").write_bytes(content)
        done = start("razy-sweep", name, "--check", timeout=20)
        codes.append(done.returncode)
        assert done.returncode in (0, 2), done.stderr
        assert (len(done.stderr.splitlines()), "bad.h5" in done.stderr) == (
            (1, True) if done.returncode else (0, False)
        )
    assert codes.count(2) > 1
