"""Gear trains of round numbers: two to four wheels in a row with one mesh, and shafts or clutches between the others.

A scene is a list of groups (name, keys), as in rounds.py.
"""

import random

import rounds

END = 5.0


def scene_of(seed):
    draw = random.Random(seed)
    n, equal, inertia = draw.choice([2, 2, 3, 4]), draw.random() < 0.5, draw.choice([1.0, 2.0, 0.5])
    groups = [
        ("inertia", {"name": f"b{i}", "value": inertia if equal else draw.choice([1.0, 2.0, 0.5, 3.0])})
        for i in range(n)
    ]
    mesh = draw.randrange(n - 1)
    for i in range(n - 1):
        between = (f"b{i}", f"b{i + 1}")
        if i == mesh:
            groups.append(("gear_mesh", {"name": "mesh", "between": between} | mesh_of(draw)))
        elif draw.random() < 0.67:
            keys = {"stiffness": draw.choice([1.0, 100.0]), "damping": draw.choice([0.0, 0.1])}
            groups.append(("spring", {"between": between} | keys))
        else:
            groups.append(("friction", {"name": f"f{i}", "between": between} | clutch_of(draw)))
    if draw.random() < 0.4:
        groups.append(("spring", {"between": ("b0", "frame"), "stiffness": draw.choice([1.0, 100.0])}))
    if draw.random() < 0.3:
        groups.append(("friction", {"name": "brake", "between": (f"b{n - 1}", "frame")} | clutch_of(draw)))
    keys = {"on": "b0", "value": draw.choice([0.0, 1.0, -1.0])}
    if draw.random() < 0.6:
        keys |= {"amplitude": draw.choice([1.0, 2.0]), "angular_frequency": draw.choice([1.0, 2.0, 10.0])}
        keys["phase"] = draw.choice([0.0, 90.0, 180.0])
    groups.append(("load", keys))
    if draw.random() < 0.5:
        groups.append(("load", {"on": f"b{n - 1}", "value": draw.choice([1.0, -1.0, 2.0])}))
    given = draw.random() < 0.4
    for i in range(n if given else 0):
        groups.append(("initial", {"on": f"b{i}", "displacement": 0.0, "velocity": draw.choice([0.0, 1.0, -1.0])}))
    groups.append(("rotation", {"speed_rpm": draw.choice([3.0, 6.0, 30.0]), "of": f"b{mesh}"}))
    motion = {"t_end": END, "start": "given" if given else "zero", "integrator": "exact"}
    groups.append(("motion", motion | {"max_events": 4000, "max_seconds": 8.0}))
    for i in range(n) if draw.random() < 0.4 else [draw.randrange(n)]:
        groups.append(("record", rounds.record_of(f"b{i}", END)))
    return groups


def clutch_of(draw):
    keys = {"static_coefficient": 1.0, "kinetic_coefficient": draw.choice([1.0, 0.5])}
    return keys | {"normal_load": draw.choice([1.0, 2.0])}


def mesh_of(draw):
    radius = draw.choice([(1.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.1, 0.3)])
    keys = {"radius": radius, "teeth": tuple(round(20 * r / radius[0]) for r in radius)}
    keys |= {"stiffness": draw.choice([1.0, 100.0, 1e4]), "backlash": draw.choice([0.0, 0.0, 1.0, 1e-3, 2.0])}
    keys["damping"] = draw.choice([0.0, 0.0, 0.1, 10.0])
    if keys["damping"] and draw.random() < 0.7:
        keys["damping_acts"] = draw.choice(["in_contact", "always", "limited"])
    if keys["damping"] and keys.get("damping_acts", "in_contact") == "in_contact" and draw.random() < 0.5:
        keys["separation"] = draw.choice(["zero_force", "zero_deformation"])
    if draw.random() < 0.3:
        return keys | {"contact_ratio": draw.choice([1.5, 1.25, 2.0, 2.5])}
    return keys | ({"error_sine": draw.choice([1e-3, 0.5])} if draw.random() < 0.4 else {})
