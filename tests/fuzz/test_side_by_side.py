"""Frictions side by side between the same bodies move them as one with the sum of their limits does, in any order."""

import os
import random

import numpy as np
import pytest
import rounds
from test_rounds import FAST, run

FIRST, LAST = (int(number) for number in os.environ.get("RAZY_FUZZ_SEEDS", "0:20").split(":"))


def scene_of(seed):
    """Groups with each friction in parts, and with one for the parts between the same bodies."""
    draw = random.Random(seed)
    n = draw.choice([1, 1, 2, 3])
    bodies = [("mass", {"name": f"b{i}", "value": draw.choice([1.0, 2.0, 0.5])}) for i in range(n)]
    rest, parts, sums = [], [], []
    for i in range(n):
        others = ["frame"] + [f"b{j}" for j in range(i)]
        if i == 0 or draw.random() < 0.8:
            between = {"between": (f"b{i}", draw.choice(others))}
            drawn = [frictions(draw) for _ in range(draw.choice([2, 2, 3]))]
            parts += [("friction", {"name": f"f{i}_{k}"} | between | keys) for k, keys in enumerate(drawn)]
            whole = {
                name: sum(keys[name] * keys["normal_load"] for keys in drawn)
                for name in ("static_coefficient", "kinetic_coefficient")
            }
            sums.append(("friction", {"name": f"f{i}", "normal_load": 1.0} | between | whole))
        if draw.random() < 0.5:
            keys = {"stiffness": draw.choice([1.0, 10.0, 100.0]), "damping": draw.choice([0.0, 0.1])}
            rest.append(("spring", {"between": (f"b{i}", draw.choice(others))} | keys))
    for _ in range(draw.choice([1, 2])):
        keys = {"on": f"b{draw.randrange(n)}", "value": draw.choice([0.0, 0.0, 1.0, -1.0, 3.0])}
        keys |= {"amplitude": draw.choice([2.0, 5.0, 10.0, 4.0]), "angular_frequency": draw.choice([1.0, 2.0, 0.5])}
        rest.append(("load", keys | {"phase": draw.choice([0.0, 90.0, 180.0])}))
    rest.append(("motion", {"t_end": 8.0, "start": "zero", "integrator": "exact", "max_events": 4000}))
    rest += [("record", rounds.record_of(f"b{i}", 8.0)) for i in range(n)]
    return bodies + parts + rest, bodies + sums + rest


def frictions(draw):
    static = draw.choice([1.0, 0.5, 1.0, 2.0])
    kinetic = static * draw.choice([1.0, 0.5, 0.25, 0.0])
    return {
        "static_coefficient": static,
        "kinetic_coefficient": kinetic,
        "normal_load": draw.choice([1.0, 2.0, 3.0, 0.5]),
    }


@pytest.mark.parametrize("seed", range(FIRST, LAST))
def test_frictions_side_by_side_are_their_sum(seed, tmp_path):
    parts, sums = scene_of(seed)
    right, end, _ = run(tmp_path, rounds.text_of(sums))
    assert not end
    size = max(1e-4, np.max(np.abs(right)))
    for part in (1e-12, -1e-12):
        shaken = run(tmp_path, rounds.shaken(rounds.text_of(sums), part))[0]
        if np.max(np.abs(shaken - right)) > 1e-6 * size:
            pytest.skip("a change of 1e-12 parts the motion")
    for groups in (parts, rounds.reordered(parts, 1)):
        assert run(tmp_path, rounds.text_of(groups))[0] == pytest.approx(right, abs=1e-8 * size)
    assert run(tmp_path, rounds.text_of(parts), FAST)[0] == pytest.approx(
        run(tmp_path, rounds.text_of(sums), FAST)[0], abs=1e-7 * size
    )
