"""Frictions side by side between the same bodies move them as one with the sum of their limits does, in any order.

So do those under the feet of a body on the floor: together they hold what one under its weight does.
"""

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


def on_feet(seed):
    """A body on two or three rigid feet, and a mass with one friction under its weight."""
    draw = random.Random(seed)
    mass, height = draw.choice([1.0, 2.0]), draw.choice([0.0, 0.1, 0.5])
    keys = {"static_coefficient": draw.choice([0.5, 0.3, 0.6])}
    keys["kinetic_coefficient"] = keys["static_coefficient"] * draw.choice([0.5, 0.8, 0.0, 1.0])
    feet = [("body", {"name": "b", "mass": mass, "inertia": draw.choice([1.0, 0.5])})]
    for i, place in enumerate([-1.0, draw.choice([1.0, 3.0]), draw.choice([0.25, 0.0, -0.25])][: draw.choice([2, 3])]):
        ends = {"between": (f"p{i}", "frame")}
        feet.append(("point", {"name": f"p{i}", "body": "b", "position": (place, -height)}))
        stop = {"name": f"s{i}", "direction": (0.0, 1.0), "clearance": 0.0, "law": "rigid", "restitution": 0.0}
        feet += [("stop", stop | ends), ("friction", {"name": f"f{i}", "normal_contact": f"s{i}"} | ends | keys)]
    feet.append(("gravity", {"acceleration": 10.0, "direction": (0.0, -1.0)}))
    one = [("mass", {"name": "b", "value": mass})]
    one.append(("friction", {"name": "f", "between": ("b", "frame"), "normal_load": 10.0 * mass} | keys))
    load = {"value": draw.choice([0.0, 0.0, 1.0]), "angular_frequency": draw.choice([1.0, 2.0, 0.5])}
    load["amplitude"] = 10.0 * mass * keys["static_coefficient"] * draw.choice([1.2, 1.5, 2.0, 0.9])
    if draw.random() < 0.5:
        spring = {"between": ("b", "frame"), "stiffness": 1.0}
        feet.append(("spring", spring | {"direction": (1.0, 0.0)}))
        one.append(("spring", spring))
    motion = ("motion", {"t_end": 10.0, "start": "zero", "integrator": "exact", "max_events": 4000})
    return (
        groups + [("load", {"on": way} | load), motion, ("record", rounds.record_of(way, 10.0))]
        for groups, way in ((feet, "b.x"), (one, "b"))
    )


@pytest.mark.parametrize("seed", range(FIRST, LAST))
def test_feet_hold_what_the_weight_does(seed, tmp_path):
    feet, one = on_feet(seed)
    right, _, _ = run(tmp_path, rounds.text_of(one))
    for settings in ([], FAST):
        found, _, _ = run(tmp_path, rounds.text_of(feet), settings)
        assert found == pytest.approx(right, abs=1e-8 * max(1e-4, np.max(np.abs(right))))
