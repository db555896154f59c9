"""Branches of random machines: nothing that razy-follow calls a motion or special point is disproved by razy-check."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import h5py
import pytest

import scenes

pytest.importorskip("flint")
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "post" / "src"))

from razy.check.verdict import verdicts

BIN = Path(os.environ["RAZY_BUILD"]) / "bin"
FIRST, LAST = (int(number) for number in os.environ.get("RAZY_FUZZ_SEEDS", "0:8").split(":"))
PATIENCE = 200
EACH = 15
"""About so many motions of a branch are checked, and as many of those at special points."""

MOST = 40
"""Motions with more events take minutes."""


@pytest.mark.parametrize("seed", range(FIRST, LAST))
def test_nothing_is_disproved(seed, tmp_path, monkeypatch):
    # Those of odd seeds have rigid stops and friction.
    monkeypatch.chdir(tmp_path)
    text, _, tone, load = scenes.driven_text_of(seed)
    text += f"&motion t_end={400 / tone:.17g}, start='zero', integrator='exact', max_seconds=5.0 /\n"
    text += "&record observable='displacement', of='b0', what='extrema' /\n"
    text += f"&follow parameter='load({load})%angular_frequency', first={tone:.17g}, last={1.4 * tone:.17g}, "
    Path("follow.nml").write_text(text + "doublings=1, max_points=60 /\n")
    command = [BIN / "razy-follow", "follow.nml", "--output", "follow.h5"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    if done.returncode == 1 and ("no motion" in done.stderr or "does not come through" in done.stderr):
        return
    assert done.returncode == 0, done.stderr
    with h5py.File("follow.h5") as file:
        count, special = file["point/state"].shape[0], sorted(set(file["special/point"][:].tolist()))
        events = file["point/events"][:]
    points = sorted({*range(0, count, max(1, count // EACH)), *special[:: max(1, len(special) // EACH)]})
    points = [i for i in points if events[i] <= MOST]
    found = [(f"motion {i + 1}", verdict) for i, verdict in zip(points, verdicts("follow.h5", points), strict=True)]
    found += [(f"special point {k + 1}", one) for _, motion in found for k, one in motion.specials.items()]
    print(seed, Counter(verdict.kind for _, verdict in found), Counter(v.reason for _, v in found if v.reason))
    assert not [(what, verdict.reason) for what, verdict in found if verdict.kind == "refused"]
