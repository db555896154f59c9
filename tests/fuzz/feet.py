"""Planar bodies of round numbers that fall, stand, slide and bounce on two feet with friction, one on the other.

A scene is a list of groups (name, keys), as in rounds.py.
"""

import random

END, POINTS = 1.0, 40


def scene_of(seed):
    draw = random.Random(seed)
    n = draw.choice([1, 1, 2])
    groups = [
        ("body", {"name": f"b{i}", "mass": draw.choice([1.0, 2.0]), "inertia": draw.choice([1.0, 0.5, 2.0])})
        for i in range(n)
    ]
    law = {"law": "rigid", "restitution": draw.choice([0.0, 0.0, 0.5, 1.0])}
    if draw.random() < 0.67:
        law = {"law": "kelvin_voigt", "stiffness": draw.choice([100.0, 1e4]), "damping": draw.choice([0.0, 1.0, 10.0])}
    height, width, farther = draw.choice([1.0, 0.5]), draw.choice([1.0, 0.5, 2.0]), draw.choice([1.0, 1.0, 1.0, 2.0])
    if law.get("restitution", 0.0) > 0.0:
        # Which of two unlike feet hits first, by rounding of the flight before, decides where the body bounces.
        farther = 1.0
    static, clearance = draw.choice([0.5, 1.0, 0.25]), draw.choice([0.0, 0.0, 0.1])
    friction = {"static_coefficient": static, "kinetic_coefficient": static * draw.choice([1.0, 0.5])}
    slides = draw.random() < 0.7
    for i in range(n):
        for side, x in (("l", -width), ("r", farther * width)):
            foot, stop, place = f"p{i}{side}", f"s{i}{side}", "frame" if i == 0 else f"q{i}{side}"
            groups.append(("point", {"name": foot, "body": f"b{i}", "position": (x, -height)}))
            if i > 0:
                groups.append(("point", {"name": place, "body": f"b{i - 1}", "position": (x, height)}))
            gap = {"direction": (0.0, 1.0), "clearance": clearance if i == 0 else 0.0}
            groups.append(("stop", {"name": stop, "between": (foot, place)} | gap | law))
            if slides:
                keys = {"name": f"f{i}{side}", "between": (foot, place), "normal_contact": stop}
                groups.append(("friction", keys | friction))
    groups += forces_of(n, draw)
    groups.append(("gravity", {"acceleration": 10.0, "direction": (0.0, -1.0)}))
    start = "given" if any(name == "initial" for name, _ in groups) else "zero"
    motion = {"t_end": END, "start": start, "integrator": "exact", "max_events": 4000, "max_seconds": 8.0}
    groups.append(("motion", motion))
    for of in [f"b{i}.{way}" for i in range(n) for way in "xy"]:
        keys = {"observable": "displacement", "of": of, "what": "trajectory", "interval": END / POINTS}
        groups.append(("record", keys))
    return groups


def forces_of(n, draw):
    found, on = [], f"b{draw.randrange(n)}.x"
    kind, size = draw.choice(["constant", "harmonic", "none"]), draw.choice([1.0, 5.0, 10.0, 2.5])
    if kind == "constant":
        found.append(("load", {"on": on, "value": size}))
    if kind == "harmonic":
        keys = {
            "amplitude": size,
            "angular_frequency": draw.choice([1.0, 2.0, 10.0]),
            "phase": draw.choice([0.0, 90.0]),
        }
        found.append(("load", {"on": on} | keys))
    if draw.random() < 0.5:
        found += [("initial", {"on": f"b{i}.x", "velocity": draw.choice([0.0, 1.0, -1.0, 0.1])}) for i in range(n)]
    return found


def mirrored(groups):
    """The same machine seen from behind; what it does along x has the other sign."""
    changed = []
    for name, keys in groups:
        keys = dict(keys)
        if name == "point":
            keys["position"] = (-keys["position"][0], keys["position"][1])
        if name in ("load", "initial"):
            keys |= {key: -keys[key] for key in ("value", "amplitude", "velocity") if key in keys}
        changed.append((name, keys))
    return changed
