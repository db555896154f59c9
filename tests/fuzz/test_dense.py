"""`motions='all'` finds what Newton's method from a dense grid finds, nothing that is no motion, none twice."""

import copy
import os
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from dense import Cubic, Lines, is_same, motions, states_after

BIN = Path(os.environ["RAZY_BUILD"]) / "bin"
LOAD = "&mass name='m', value=1.0 /\n&load on='m', angular_frequency=1.0, "
SPRING = "&spring between='m','frame', damping="
UPPER, BOTH = (f"&stop name='s', between='m','frame', side='{side}', clearance=" for side in ("upper", "both"))
# The oscillator, its input, the range of frequencies and the box of states.
OSCILLATORS = {
    "impacts": (
        Lines([(1, 0.1, 0)], [0.5], 1.0, 0.8),
        f"{LOAD} amplitude=1.0 /\n{SPRING}0.1, stiffness=1.0 /\n{UPPER}0.5, law='rigid', restitution=0.8 /\n",
        (2.0, 3.2),
        (4.0, 6.0),
    ),
    "one elastic stop": (
        Lines([(1, 0.08, 0), (21, 0.08, 10)], [0.5], 1.0),
        f"{LOAD} amplitude=1.0 /\n{SPRING}0.08, stiffness=1.0 /\n{UPPER}0.5, stiffness=20.0 /\n",
        (1.6, 3.6),
        (4.0, 6.0),
    ),
    "backlash": (
        Lines([(1, 0.06, -0.7), (0, 0.06, 0.3), (1, 0.06, 1.3)], [-1, 1], 0.4),
        f"{LOAD} value=0.3, amplitude=0.4 /\n{SPRING}0.06, stiffness=0.0 /\n{BOTH}1.0, stiffness=1.0 /\n",
        (0.4, 1.6),
        (6.0, 6.0),
    ),
    "two wells": (
        Cubic(-1.0, 1.0, 0.25, 0.35),
        f"{LOAD} amplitude=0.35 /\n{SPRING}0.25, law='polynomial', coefficients=-1.0,0.0,1.0 /\n",
        (0.6, 1.6),
        (2.5, 2.5),
    ),
}


def followed(file, oscillator, value):
    """The states after each period of the motions stored at a value; all come back, by the oscillator's own code."""
    oscillator = copy.copy(oscillator)
    # What comes back by so many periods of steps has to err by less than what the grid is searched with.
    oscillator.steps *= 4
    special, point = file["special"], file["point"]
    at = special["point"][:][(special["label"].asstr()[:] == "UZ") & (np.abs(special["parameter"][:] - value) < 1e-9)]
    found = []
    for i in at:
        state = point["state"][i]
        if point["phase"][i] > 0:
            state = np.concatenate(oscillator.flow(value, *state[:, None], 1, point["phase"][i]))
        states = states_after(oscillator, value, state, round(point["period"][i] * value / (2 * np.pi)))
        assert states[-1] == pytest.approx(state, abs=1e-8 * (1 + np.abs(point["multiplier"][i]).max()))
        found.append(states[:-1])
    return found


@pytest.mark.parametrize("name", OSCILLATORS)
def test_all_motions_are_those_of_a_dense_grid(name, tmp_path):
    oscillator, text, (first, last), box = OSCILLATORS[name]
    values = first + (last - first) * np.array([0.08, 0.29, 0.5, 0.71, 0.92])
    case = tmp_path / "case.nml"
    case.write_text(
        f"{text}&motion t_end=400.0, start='zero' /\n&record observable='displacement', what='extrema' /\n"
        f"&follow parameter='load%angular_frequency', first={first}, last={last}, motions='all', "
        f"values={', '.join(repr(float(value)) for value in values)} /\n"
    )
    subprocess.run(
        [BIN / "razy-follow", case, "--output", tmp_path / "case.h5"],
        check=True,
        capture_output=True,
    )
    own = missing = 0
    with h5py.File(tmp_path / "case.h5") as file:
        for value in values:
            found = followed(file, oscillator, value)
            for i, one in enumerate(found):
                assert not any(is_same(one, other) for other in found[:i]), one
            for motion in motions(oscillator, value, box):
                own += 1
                missing += not any(is_same(motion, other, 1e-4) for other in found)
    assert missing <= 0.05 * own, f"{missing} of {own}"
