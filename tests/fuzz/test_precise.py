"""Stiff, damped stops: `exact` is right to 1e-11 of the motion's tangent map, beside arithmetic of 140 bits."""

import os
import re

import compare
import numpy as np
import precise
import pytest

import scenes

FIRST, LAST = (int(number) for number in os.environ.get("RAZY_FUZZ_SEEDS", "0:3").split(":"))
# Hops on a stop whose force jumps: what is rounding of a gap there is more of a speed. They were 1e-9 of that map off.
HOPS = [180, 217]
# Flights of some ns within a step of that arithmetic, which it missed where it looked in eight places: 1e-9 and 1e-3
# off. With another BLAS exact is 4e-11 off in the second, where rounding of a gap is millions of times that of a speed.
FLIGHTS = [59, 226]


@pytest.mark.parametrize("seed", [*range(FIRST, LAST), *HOPS, *FLIGHTS])
def test_stiff_stops_keep_their_digits(seed, tmp_path):
    text = scenes.stiff_text_of(seed)
    times, ours, end, _ = compare.run_razy(tmp_path, text, "exact", [])
    assert not end
    right, scale, norm, _ = precise.follow(text, times)
    n = ours.shape[1]
    if norm > 1e6:
        pytest.skip("a change of rounding parts the motion")
    most = 3e-10 if seed in FLIGHTS else 1e-11
    assert np.max(np.abs(ours - right[:, :n])) < most * norm * scale[0]


def test_depths_keep_their_digits_beside_clearances(tmp_path):
    # A stop 0.3 mm away into which the body comes some nm: closed forms count from its edge. They were 5e-11 off.
    text = re.sub(r"t_end=[0-9.]+", "t_end=0.4", scenes.stiff_text_of(161))
    text = re.sub(r"interval=[0-9.]+", "interval=0.02", text)
    times, ours, end, _ = compare.run_razy(tmp_path, text, "exact", [])
    assert not end
    right, scale, norm, _ = precise.follow(text, times)
    assert np.max(np.abs(ours - right[:, : ours.shape[1]])) < 1e-13 * norm * scale[0]
