"""Rotors with free motions: verdicts of razy-modes beside an assembly of its own, and beside twins of the rotor."""

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import turning

FIRST, LAST = (int(number) for number in os.environ.get("RAZY_FUZZ_SEEDS", "0:20").split(":"))
MODES = Path(os.environ["RAZY_BUILD"]) / "bin" / "razy-modes"
POINTS = 7
STABLE, UNSTABLE, UNDECIDED, NEUTRAL, ABSENT = 1, 0, -1, 2, -2
# Rigid motion of the assembly errs by the root of rounding, rad/s; the least share of damping that it can tell.
RIGID, LEAST = 3.0, 1e-8
# Real parts that are rounding, as a part of the highest frequency.
ROUNDING = 3e-15
# Eigenvalues that are as close as this share their shapes.
CLOSE = 1e-4
# Shafts that move across the line of action of a damped mesh: what the mesh does there was undecided, by its terms.
# The last: a motion that nothing feels at rest, and that decays before it grows, put the limit at 0.
ACROSS = [91112, 30326, 30470, 670001]


def modes(folder, lines):
    (folder / "rotor.nml").write_text("\n".join(lines) + "\n")
    command = [MODES, folder / "rotor.nml", "--force", "--output", folder / "rotor.h5"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    with h5py.File(folder / "rotor.h5") as file:
        found = {name: item[()] for name, item in file.items() if isinstance(item, h5py.Dataset)}
        found["meaning"] = file["stability_limit"].attrs["meaning"]
    return found


def wrong_verdicts(rotor, found):
    """What razy-modes says of modes and of the limit that the other assembly does not."""
    parts, wrong, unstable = turning.matrices(rotor), [], []
    crossed = any(bearing[3] for shaft in rotor.shafts for bearing in shaft.bearings)
    for speed, values, verdicts in zip(found["speed"], found["eigenvalue"], found["stable"], strict=True):
        other = turning.eigenvalues(parts, speed)
        free = other[np.abs(other) > RIGID]
        unstable.append(bool((free.real > LEAST * np.abs(free)).any()))
        for (real, imaginary), verdict in zip(values, verdicts, strict=True):
            if verdict in (ABSENT, NEUTRAL) and not real:
                continue
            value = complex(real, imaginary)
            nearest = other[np.argmin(np.abs(other - value))]
            if abs(nearest - value) > 1e-5 * abs(value):
                # Motion along the axis, which is never driven.
                wrong += [] if verdict in (STABLE, NEUTRAL) else [("axial", speed, value, verdict)]
                continue
            said = STABLE if nearest.real < 0 else UNSTABLE
            # What is damped or driven by rounding is neutral, or undecided where a cross coupling acts on it.
            rounding = abs(nearest.real) <= ROUNDING * np.abs(other).max()
            if rounding and not (verdict == said and abs(nearest.real - real) < abs(real)):
                said = NEUTRAL
            # The energies of razy-modes tell less damping than eigenvalues do, or say that they do not, as where shapes
            # turn to those of a neighbour by rounding of frequencies a million times as high.
            close = np.partition(np.abs(other - nearest), 1)[1] <= CLOSE * abs(nearest)
            least = rounding or close or abs(nearest.real) <= LEAST * abs(nearest)
            if crossed and verdict == UNDECIDED and least:
                said = UNDECIDED
            wrong += [] if verdict == said else [("mode", speed, value, nearest, int(verdict))]
    at = unstable.index(True) if True in unstable else POINTS
    meaning = "none up to the last speed" if at == POINTS else "found" if at else "unstable at the first speed already"
    # High modes of a shaft without dampers, which a mesh joins to damped ones, may be damped by less than rounding.
    if found["meaning"] == "undecided" and at == POINTS and rotor.meshes:
        return wrong
    if found["meaning"] != meaning:
        wrong.append(("limit", found["meaning"], meaning, unstable))
    elif meaning == "found":
        if not found["speed"][at - 1] <= found["stability_limit"] <= found["speed"][at]:
            wrong.append(("limit", found["stability_limit"]))
        other = turning.eigenvalues(parts, found["stability_limit"])
        if not (np.abs(other.real) < 1e-7 * np.abs(other)).any():
            wrong.append(("limit", found["stability_limit"], other))
    # Slower modes than the assembly can tell from rigid motion are those of soft supports that razy-modes lists.
    sizes = np.hypot(*found["eigenvalue"][0].T)
    if (found["critical_speed"] < min(RIGID, 0.5 * sizes[sizes > 0].min(initial=np.inf))).any():
        wrong.append(("critical", found["critical_speed"]))
    return wrong


def twin_of(rotor, kind):
    """The same rotor with a second one beside it, its groups in another order, or its shafts in the other order."""
    if kind == "equal":
        names = {s.name: s.name + "2" for s in rotor.shafts}
        more = tuple(replace(s, name=names[s.name]) for s in rotor.shafts)
        meshes = tuple((names[a], m, r, names[b], *rest) for a, m, r, b, *rest in rotor.meshes)
        return replace(rotor, shafts=rotor.shafts + more, meshes=rotor.meshes + meshes)
    if kind == "apart":
        other = turning.Shaft("o", 0.3, 0.02, 3, ratio=0.0, bearings=((1, 1e6, 1e6, 0.0, 0.0), (4, 1e6, 1e6, 0.0, 0.0)))
        return replace(rotor, shafts=(other, *rotor.shafts))
    return replace(rotor, shafts=tuple(reversed(rotor.shafts)))


@pytest.mark.parametrize("other", [turning.Shaft("o", 0.3, 0.02, 3), turning.Shaft("o", 0.02, 0.05, 10)])
def test_a_shaft_beside_changes_no_verdict(other, tmp_path):
    """Errors of a motion come from what moves in it, whether matrices are dense or, as beside this shaft, banded."""
    rotor = turning.rotor_of(20210)
    ends = tuple((node, 1e6, 1e6, 0.0, 0.0) for node in (1, other.elements + 1))
    alone = modes(tmp_path, turning.groups(rotor, POINTS))
    with_it = replace(rotor, shafts=(replace(other, ratio=0.0, bearings=ends), *rotor.shafts))
    beside = modes(tmp_path, turning.groups(with_it, POINTS))
    assert beside["meaning"] == "found" and np.isnan(beside["undecided_from"])
    assert beside["stability_limit"] == pytest.approx(alone["stability_limit"], rel=1e-7)


def test_something_begins_to_grow_at_the_limit(tmp_path):
    """Not at a speed at which a branch was taken for another."""
    rotor = turning.rotor_of(20016)
    limit, parts = float(modes(tmp_path, turning.groups(rotor, POINTS))["stability_limit"]), turning.matrices(rotor)
    below, above = (max(turning.eigenvalues(parts, (1 + part) * limit).real) for part in (-1e-4, 1e-4))
    assert below < 0 < above


@pytest.mark.parametrize("seed", [*range(FIRST, LAST), *ACROSS])
def test_verdicts(seed, tmp_path):
    rotor = turning.rotor_of(seed)
    lines = turning.groups(rotor, POINTS)
    found = modes(tmp_path, lines)
    assert not wrong_verdicts(rotor, found)
    kind = ("equal", "apart", "order")[seed % 3 if len(rotor.shafts) == 1 else seed // 3 % 3]
    lines = turning.groups(twin_of(rotor, kind), POINTS)
    if kind == "order":
        body = [line for line in lines if not line.startswith("&scene")]
        lines = [lines[0], *np.random.default_rng(seed).permutation(body)]
    twin = modes(tmp_path, lines)
    # Two rotors may be banded where one is dense, and errors are larger then: slow growth is undecided.
    beyond = found["speed"][found["speed"] >= np.nan_to_num(found["stability_limit"], nan=0.0)].min()
    if kind == "equal" and twin["undecided_from"] <= beyond:
        return
    assert twin["meaning"] == found["meaning"]
    # Where growth hardly rises with the speed, an error of 1e-8 of the eigenvalue is one of 1e-5 of the limit.
    np.testing.assert_allclose(twin["stability_limit"], found["stability_limit"], rtol=3e-5)
    for speed in found["critical_speed"]:
        assert np.abs(twin["critical_speed"] / speed - 1).min() < 1e-6
    assert np.isnan(twin["undecided_from"]) == np.isnan(found["undecided_from"])
