"""Machines of round numbers, each from its seed: equal bodies, forces exactly at a limit, contacts that act together.

A scene is a list of groups (name, keys), so that twins can be made of it: the same machine said in another way.
"""

import random
import re

MASSES, STIFFNESSES, DAMPINGS = [1.0, 2.0, 0.5, 3.0], [1.0, 100.0, 1e4], [0.0, 0.0, 0.1, 10.0]
CLEARANCES, RESTITUTIONS = [0.0, 0.0, 1.0, 1e-3], [0.0, 0.5, 1.0]
FORCES, SPEEDS = [0.0, 1.0, 2.0, 1.5, -1.0], [1.0, 2.0, 10.0, 0.5]
# What may stand between two bodies.
JOINTS = [
    ["spring"], ["damper"], ["stop"], ["friction"], ["spring", "stop"], ["damper", "stop"], ["spring", "friction"],
    ["damper", "friction"], ["stop", "stop"], ["stop", "friction"],
]  # fmt: skip
HOLDS = [["spring"], ["spring"], ["spring", "stop"], ["spring", "friction"], ["friction"], ["stop"]]
POINTS = 40


def scene_of(seed):
    """One to four bodies in a row, the first and perhaps the last held by the frame; every third one is symmetric."""
    return row_of(seed, True)


def free_scene_of(seed):
    """The same without the frame: two to four bodies that nothing but friction and stops between them holds."""
    return row_of(seed, False)


def row_of(seed, held):
    draw = random.Random(2 * seed + held)
    n, symmetric = draw.randint(1 if held else 2, 4), draw.random() < 0.33
    equal = symmetric or draw.random() < 0.4
    first = draw.choice(MASSES)
    groups = [("mass", {"name": f"b{i}", "value": first if equal else draw.choice(MASSES)}) for i in range(n)]
    ends = [(f"b{i}", f"b{i + 1}") for i in range(n - 1)]
    if held:
        ends.append(("b0", "frame"))
        if n > 1 and (symmetric or draw.random() < 0.5):
            ends.append((f"b{n - 1}", "frame"))
    joints = {}
    for between in ends:
        # Of a symmetric machine the other end has the same.
        key = between[1] == "frame" if symmetric else between
        if key not in joints:
            kinds = draw.choice(HOLDS if between[1] == "frame" else JOINTS)
            joints[key] = [(kind, keys_of(kind, draw)) for kind in kinds]
        for kind, keys in joints[key]:
            if symmetric and between == (f"b{n - 1}", "frame") and keys.get("side") in ("upper", "lower"):
                keys = keys | {"side": {"upper": "lower", "lower": "upper"}[keys["side"]]}
            names = {} if kind in ("spring", "damper") else {"name": f"c{len(groups)}"}
            groups.append((kind, names | {"between": between} | keys))
    groups += loads_of(n, symmetric, draw)
    starts = []
    if draw.random() < 0.4:
        for i in range(n):
            # A start beyond a rigid stop is refused.
            x = draw.choice([0.0, 0.0, 0.0, 1e-3]) if all(keys.get("law") != "rigid" for _, keys in groups) else 0.0
            v = draw.choice([0.0, 1.0, -1.0, 1.0])
            starts.append(("initial", {"on": f"b{i}", "displacement": x, "velocity": v}))
    groups += starts
    largest = max([keys["stiffness"] for _, keys in groups if "stiffness" in keys], default=1.0)
    end = 10.0 if largest <= 1 else 5.0 if largest <= 100 else 2.0
    motion = {"t_end": end, "start": "given" if starts else "zero", "integrator": "exact", "max_seconds": 8.0}
    groups.append(("motion", motion | {"max_events": 4000}))
    # Not the state: what no contact and no record feels is not followed then, as in a sweep.
    for i in range(n) if draw.random() < 0.4 else [draw.randrange(n)]:
        groups.append(("record", record_of(f"b{i}", end)))
    return groups


def shaped_scene_of(seed):
    """The same with loads of other shapes, sliders, springs of several lines, moving walls, friction under stops."""
    draw = random.Random(seed)
    groups = [(name, dict(keys)) for name, keys in row_of(seed, draw.random() < 0.5)]
    stops = [keys["name"] for name, keys in groups if name == "stop"]
    for i, (name, keys) in enumerate(groups):
        rigid = keys.get("law") == "rigid"
        if name == "load" and "amplitude" in keys and draw.random() < 0.7:
            del keys["angular_frequency"], keys["phase"]
            keys |= shape_of(draw)
        elif name == "spring" and draw.random() < 0.3:
            keys |= {"name": f"j{i}", "law": "jenkins", "slip_force": draw.choice([0.5, 1.0, 2.0])}
        elif name == "spring" and draw.random() < 0.4:
            del keys["damping"]
            gap, k = draw.choice([(1.0, 0.0), (0.5, 0.0), (1.0, 2.0)]), keys.pop("stiffness")
            inner, outer = gap[1] * k * gap[0], (gap[1] + 1) * k * gap[0]
            keys |= {"law": "table", "displacement": (-2 * gap[0], -gap[0], gap[0], 2 * gap[0])}
            keys |= {"force": (-outer, -inner, inner, outer)}
        elif name == "stop" and rigid and "frame" in keys["between"] and draw.random() < 0.5:
            keys |= {
                "motion_amplitude": draw.choice([1.0, 0.5, 1e-3]),
                "motion_angular_frequency": draw.choice([1.0, 2.0]),
            }
        elif name == "friction" and stops and draw.random() < 0.3:
            keys["normal_contact"] = draw.choice(stops)
    return groups


def shape_of(draw):
    shape, length = draw.choice(["square", "half_sine", "ramp", "pulse", "ramp", "pulse"]), draw.choice([0.5, 1.0, 2.0])
    if shape == "square":
        return {"shape": shape, "frequency": draw.choice([0.25, 0.5, 1.0])}
    keys = {"shape": shape, "duration": length}
    if draw.random() < 0.3:
        keys["frequency"] = 0.5 / length
    if shape == "pulse":
        keys["rise"] = draw.choice([0.0, 0.25 * length, 0.5 * length])
    return keys | ({"delay": draw.choice([0.5, 1.0])} if draw.random() < 0.5 else {})


def record_of(body, end):
    return {"observable": "displacement", "of": body, "what": "trajectory", "interval": end / POINTS}


def keys_of(kind, draw):
    if kind == "spring":
        return {"stiffness": draw.choice(STIFFNESSES), "damping": draw.choice(DAMPINGS)}
    if kind == "damper":
        return {"damping": draw.choice([0.1, 1.0, 10.0])}
    if kind == "friction":
        static = draw.choice([0.5, 1.0])
        keys = {"static_coefficient": static, "kinetic_coefficient": draw.choice([static, 0.5 * static])}
        return keys | {"normal_load": draw.choice([1.0, 2.0, 1.0, 10.0]), "belt_speed": draw.choice([0.0] * 5 + [1.0])}
    keys = {"side": draw.choice(["upper", "lower", "both"]), "clearance": draw.choice(CLEARANCES)}
    if draw.random() < 0.5:
        return keys | {"law": "rigid", "restitution": draw.choice(RESTITUTIONS)}
    keys |= {"law": "kelvin_voigt", "stiffness": draw.choice(STIFFNESSES), "damping": draw.choice(DAMPINGS)}
    return keys | {"separation": draw.choice(["zero_force", "zero_deformation"])}


def loads_of(n, symmetric, draw):
    found = []
    for i in [0] if symmetric or draw.random() < 0.6 else range(n):
        keys, kind = {"on": f"b{i}"}, draw.choice(["constant", "harmonic", "both"])
        if kind != "harmonic":
            keys["value"] = draw.choice(FORCES)
        if kind != "constant":
            keys |= {"amplitude": draw.choice([1.0, 2.0, 1.5]), "angular_frequency": draw.choice(SPEEDS)}
            keys["phase"] = draw.choice([0.0, 0.0, 90.0, 180.0, 270.0])
        found.append(("load", keys))
    if symmetric and n > 1 and draw.random() < 0.7:
        found.append(("load", found[0][1] | {"on": f"b{n - 1}"}))
    return found


def text_of(groups):
    def said(value):
        if isinstance(value, tuple):
            return ",".join(map(said, value))
        return f"'{value}'" if isinstance(value, str) else repr(value)

    lines = [f"&scene kind='{'planar' if any(name == 'body' for name, _ in groups) else 'lumped'}' /"]
    for name, keys in groups:
        lines.append(f"&{name} " + ", ".join(f"{key}={said(value)}" for key, value in keys.items()) + " /")
    return "\n".join(lines) + "\n"


def reordered(groups, seed):
    """The same groups in another order; masses too, so that coordinates have other numbers."""
    return random.Random(seed).sample(groups, len(groups))


def halved(groups):
    """Every spring and damper as two halves in parallel."""
    halves = []
    for name, keys in groups:
        if name in ("spring", "damper"):
            keys = {key: value / 2 if key in ("stiffness", "damping") else value for key, value in keys.items()}
            halves.append((name, keys))
        halves.append((name, keys))
    return halves


def accompanied(groups):
    """With a second machine beside it that it has nothing to do with: a body that bounces between two others."""
    more = [("mass", {"name": name, "value": value}) for name, value in (("u", 0.7), ("v", 1.9))]
    more.append(("spring", {"between": ("u", "frame"), "stiffness": 37.0, "damping": 0.3}))
    more.append(
        (
            "stop",
            {
                "name": "uv",
                "between": ("u", "v"),
                "side": "both",
                "clearance": 0.013,
                "law": "rigid",
                "restitution": 0.7,
            },
        )
    )
    more.append(("load", {"on": "u", "amplitude": 3.1, "angular_frequency": 4.7}))
    return more + groups


def turned(groups):
    """Every load a whole turn later in its phase."""
    return [(name, keys | {"phase": keys["phase"] + 360.0} if "phase" in keys else keys) for name, keys in groups]


# Powers of 2 of mass, length and time in what a key says.
UNITS = {
    "value": None, "stiffness": (1, 0, -2), "damping": (1, 0, -1), "clearance": (0, 1, 0), "normal_load": (1, 1, -2),
    "belt_speed": (0, 1, -1), "amplitude": (1, 1, -2), "angular_frequency": (0, 0, -1), "displacement": (0, 1, 0),
    "velocity": (0, 1, -1), "t_end": (0, 0, 1), "interval": (0, 0, 1),
}  # fmt: skip


def scaled(groups, units=(3, -5, 4)):
    """In units of mass, length and time that are these powers of 2 as large."""
    changed = []
    for name, keys in groups:
        new = dict(keys)
        for key, value in keys.items():
            if key in UNITS:
                powers = UNITS[key] or ((1, 0, 0) if name == "mass" else (1, 1, -2))
                new[key] = value * 2.0 ** sum(p * u for p, u in zip(powers, units, strict=True))
        changed.append((name, new))
    return changed


def planar(groups):
    """The same along x in a plane, or nothing where a stop has two edges in one place."""
    changed = []
    for name, keys in groups:
        keys = dict(keys)
        if name == "mass":
            changed.append(("body", {"name": keys["name"], "mass": keys["value"], "inertia": 1.0}))
            continue
        for key in ("on", "of"):
            if key in keys:
                keys[key] += ".x"
        side = keys.pop("side", None)
        if side == "both" and keys["clearance"] == 0:
            return None
        if "between" in keys:
            keys["direction"] = (-1.0 if side == "upper" else 1.0, 0.0)
        changed.append((name, keys))
        if side == "both":
            changed.append((name, keys | {"name": keys["name"] + "_u", "direction": (-1.0, 0.0)}))
    return changed


def shaken(text, part=1e-12):
    """The text with the first number of a load, start or gravity that is not 0 changed by a part of itself.

    So are the amplitudes of given motions: what one of them touches at its very end it may touch or not.
    """
    more = 1 + part
    text = re.sub(r"(?<=motion_amplitude=)[-+.0-9e]+", lambda found: f"{float(found[0]) * more:.17g}", text)
    for group in re.finditer(r"^&(?:load|initial|gravity) .*", text, re.MULTILINE):
        for found in re.finditer(r"(?:value|amplitude|velocity|acceleration)=([-+.0-9e]+)", group[0]):
            if float(found[1]) != 0:
                first, last = (group.start() + found.start(1), group.start() + found.end(1))
                return f"{text[:first]}{float(found[1]) * more:.17g}{text[last:]}"
    return text
