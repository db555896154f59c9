"""Damaged result files: whatever is wrong with one, each command says so in a line that names it, and exits with 2."""

import os
import random
import shutil
import warnings
from contextlib import suppress

import h5py
import numpy as np
import pytest
import samples
from matplotlib.figure import Figure
from pictures import drawn

from razy.check.cli import main as check_main
from razy.errors import ResultError
from razy.plot.cli import main
from razy.read.file import making_sense_of
from razy.tools.cli import csv_main, merge_main

SPEED = np.linspace(1000.0, 1490.0, 20)
SOUND = {
    "sweep": lambda path: samples.write_sweep(path, SPEED, {"mesh_deformation": samples.ragged(20)}),
    "diagram": lambda path: samples.write_sweep(path, SPEED, {"mesh_deformation": samples.logistic(20, 4)}),
    "grid": samples.write_grid,
    "run": lambda path: samples.write_scene(samples.write_run(path, times=50)),
    "tune": lambda path: samples.write_tune(path, points=21),
    "follow": samples.write_follow,
    "modes": samples.write_modes,
    "duel": samples.write_duel,
}
KINDS = {
    "sweep": ("contacts", "column"),
    "grid": ("contacts",),
    "run": ("time", "phase", "machine"),
    "modes": ("eigenvalues",),
}
# A longer attack is one with more files of each kind, or with other seeds.
ATTACK = "RAZY_HOSTILE_FILES" in os.environ
FILES = int(os.environ.get("RAZY_HOSTILE_FILES", "3"))
SEED = int(os.environ.get("RAZY_HOSTILE_SEED", "18"))
WORDS = (b"", b"\xff\xfe", "a\nb", np.float64(3.0), np.array([1, 2]), "1 = 2 = 3,,", h5py.Empty("S1"))
NUMBERS = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, -1.0, 0.0, 2.0**31, 2.0**62)


def flip(path, choice):
    content = bytearray(path.read_bytes())
    for _ in range(choice.choice((1, 3, 30, 300))):
        # Most of a small file are headers; zeros are as likely as anything else.
        content[choice.randrange(len(content))] = choice.choice((0, 1, 127, 255, choice.randrange(256)))
    path.write_bytes(content)


def cut(path, choice):
    with path.open("r+b") as file:
        file.truncate(choice.randrange(path.stat().st_size))


def members(file):
    found = []
    file.visit(found.append)
    return found


def remove(file, choice):
    del file[choice.choice(members(file))]


def reshape(file, choice):
    """Put another dataset, or a group, in the place of one."""
    name = choice.choice(members(file))
    old = file[name]
    shape, data = getattr(old, "shape", (3,)), None
    attributes = {key: value for key, value in old.attrs.items() if key not in ("REFERENCE_LIST", "DIMENSION_LIST")}
    length = min(shape[0], 1000) if shape else 1
    del file[name]
    what = choice.randrange(8)
    if what == 0:
        new = file.create_group(name)
    elif what == 1:
        new = file.create_dataset(name, shape=choice.choice(((2**31,), (2**40,), (2**20, 2**20))), dtype="f8")
    elif what == 2:
        new = file.create_dataset(name, shape=(2**31,), dtype="f8", chunks=(1024,))
        new[:1024] = 1.0
    else:
        data = (
            np.zeros((length, 2, 2)), np.zeros(length + 1), np.array([b"no number"] * length), 3.0,
            np.zeros(length, dtype=[("a", "f8"), ("b", "i4")]),
        )[what - 3]  # fmt: skip
        new = file.create_dataset(name, data=data)
    new.attrs.update(attributes)


def revalue(file, choice):
    """Put numbers that no result has into a dataset."""
    items = [file[name] for name in members(file) if isinstance(file[name], h5py.Dataset) and file[name].size]
    item = choice.choice([item for item in items if item.dtype.kind in "fi" and item.id.get_storage_size()])
    values = np.asarray(item[()])
    with np.errstate(all="ignore"):
        number = np.array(choice.choice(NUMBERS)).astype(item.dtype)
    if choice.random() < 0.5:
        values = np.full_like(values, number)
    else:
        values.flat[choice.randrange(values.size)] = number
    item[...] = values


def reword(file, choice):
    """Take an attribute away, or put something else in its place."""
    item = choice.choice([file, *(file[name] for name in members(file))])
    names = [name for name in item.attrs if name not in ("REFERENCE_LIST", "DIMENSION_LIST")]
    if names:
        name = choice.choice(names)
        del item.attrs[name]
        if choice.random() < 0.7:
            item.attrs[name] = choice.choice(WORDS)


def damage(path, choice):
    change = choice.choice((flip, cut, remove, remove, reshape, reshape, reshape, revalue, revalue, reword, reword))
    if change in (flip, cut):
        change(path, choice)
        return change.__name__
    with h5py.File(path, "r+") as file:
        for _ in range(choice.choice((1, 1, 2))):
            change(file, choice)
    return change.__name__


@pytest.mark.parametrize("kind", SOUND)
def test_damaged_file(kind, tmp_path, capsys, monkeypatch):
    if not ATTACK:
        # The layout is found when the picture is drawn; to write it takes as long again.
        monkeypatch.setattr(Figure, "savefig", lambda _figure, _content, **_: None)
    choice = random.Random(f"{SEED} {kind}")
    sound, path, target = SOUND[kind](tmp_path / "sound.h5"), tmp_path / "bad.h5", tmp_path / "new"
    pictures = (None, *KINDS.get(kind, ()))
    refused = 0
    for number in range(FILES):
        shutil.copy(sound, path)
        done = damage(path, choice)
        picture = pictures[number % len(pictures)]
        words = [str(path), "--save", f"{target}.png", "--dpi", "30"] + (["--kind", picture] if picture else [])
        calls = [(main, "razy-plot", words), (csv_main, "razy-csv", [str(path), "--output", f"{target}.csv"])]
        if kind == "sweep":
            calls.append((merge_main, "razy-merge", [str(sound), str(path), "--output", f"{target}.h5"]))
        if kind == "follow":
            calls.append((check_main, "razy-check", [str(path)]))
        for program, name, arguments in calls:
            code = program(arguments)
            said = capsys.readouterr().err
            assert code in (0, 2) or (code, name) == (1, "razy-check"), (number, done, name, said)
            if code == 2:
                refused += 1
                assert said.count("\n") == 1 and said.startswith(f"{name}: error: ") and ".h5: " in said, (number, said)
            for left in tmp_path.glob("new*"):
                left.unlink()
        assert sorted(item.name for item in tmp_path.iterdir()) == ["bad.h5", "sound.h5"]
    assert refused > 0


@pytest.mark.parametrize("number", [1e308, 1e-320])
@pytest.mark.parametrize("kind", ["modes", "follow"])
def test_a_number_that_no_result_has_is_drawn_or_refused(kind, number, tmp_path):
    sound, path = SOUND[kind](tmp_path / "sound.h5"), tmp_path / "bad.h5"
    with h5py.File(sound) as file:
        items = [file[name] for name in members(file) if isinstance(file[name], h5py.Dataset)]
        names = [item.name for item in items if item.dtype == np.float64 and item.id.get_storage_size()]
    assert len(names) > 5
    for name in names:
        shutil.copy(sound, path)
        with h5py.File(path, "r+") as file:
            file[name][...] = np.full_like(file[name], number)
        with warnings.catch_warnings(record=True) as said, suppress(ResultError), making_sense_of(path):
            warnings.simplefilter("always")
            drawn(path)
        assert not [(name, str(one.message)) for one in said if issubclass(one.category, RuntimeWarning)]
