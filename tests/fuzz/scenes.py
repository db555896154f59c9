"""Random machines, each from its seed: of the lumped kind, some of them symmetric, in a plane, and rotors that turn.

No rigid stop or friction is in line with others, as one load may then be shared in many ways. Friction goes with
undamped compliant stops, in `bound_text_of` with others too: where it pulls open the stop that it needs, or presses a
damped one from parting to closed, no branch of the laws lasts.
"""

import re

import numpy as np


def bound_text_of(seed):
    """The same with friction that goes with damped and rigid stops too, also of its own bodies."""
    return text_of(2 * seed + 1, any_stop=True)


def text_of(seed, any_stop=False):
    """The text of an input: one to four bodies with stops, and for every other seed rigid ones and friction."""
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 5))
    mass = 10 ** random.uniform(-0.7, 1.0, n)
    speed = 10 ** random.uniform(1.0, 2.5)
    lines = ["&scene kind='lumped' /"]
    lines += [f"&mass name='b{i}', value={m:.17g} /" for i, m in enumerate(mass)]
    lines += springs(random, mass, speed)
    reach = 10 ** random.uniform(-4.0, -2.5)
    push = speed**2 * reach * float(np.mean(mass))
    tones = list(speed * 10 ** random.uniform(-0.5, 0.8, 2))
    stops, rigid, calm = stops_of(random, mass, speed, reach, tones, seed % 2 == 1)
    lines += stops
    if seed % 2 == 1:
        lines += frictions_of(random, n, push, speed * reach, rigid, stops if any_stop else calm)
    for _ in range(int(random.integers(1, 3))):
        body, amplitude = random.integers(n), push * random.uniform(0.2, 2.0)
        tone, angle = random.choice(tones), int(random.integers(360))
        load = f"amplitude={amplitude:.17g}, angular_frequency={tone:.17g}, phase={angle}"
        lines.append(f"&load on='b{body}', {load} /")
    if random.random() < 0.4:
        lines.append(f"&load on='b{random.integers(n)}', value={push * random.uniform(-1.0, 1.0):.17g} /")
    for i in range(n):
        lines.append(f"&initial on='b{i}', velocity={speed * reach * random.uniform(-2.0, 2.0):.17g} /")
    end = 60.0 / speed
    lines.append(f"&motion t_end={end:.17g}, start='given', integrator='exact', max_seconds=30.0 /")
    lines.append(f"&record observable='state', what='trajectory', interval={end / 60:.17g} /")
    return "\n".join(lines) + "\n"


def stiff_text_of(seed):
    """The same without rigid stops and friction; all stops are stiff and damped, some overdamped: ever lower hops."""
    random = np.random.default_rng([seed, 1])
    lines = []
    for line in text_of(2 * seed).splitlines():
        if line.startswith("&stop"):
            k = float(re.search(r" stiffness=(\S+?),", line)[1]) * 10 ** random.uniform(0.0, 2.0)
            b = 2 * np.sqrt(k) * 10 ** random.uniform(-1.5, 1.3)
            law = random.choice(["kelvin_voigt", "switched_spring"])
            line = re.sub(r"law=.*damping=[^, ]+", f"law='{law}', stiffness={k:.17g}, damping={b:.17g}", line)
        lines.append(line)
    return "\n".join(lines) + "\n"


def driven_text_of(seed):
    """The same machines driven by one tone and damped, without motion and record; bodies, tone, number of its load."""
    lines, tones = [], []
    for line in re.sub(r", motion_\w+=[^,/ ]+", "", text_of(seed)).splitlines():
        tone = re.search(r"angular_frequency=(\S+?)[, ]", line)
        if line.startswith(("&motion", "&record", "&initial")) or (tone and tones):
            continue
        lines.append(line)
        if tone:
            tones = [float(tone[1]), 1 + sum(other.startswith("&load") for other in lines[:-1])]
    mass = [float(m) for m in re.findall(r"&mass name='b\d', value=(\S+)", "\n".join(lines))]
    for i, m in enumerate(mass):
        k, b = 0.3 * m * tones[0] ** 2, 0.1 * m * tones[0]
        lines.append(f"&spring between='b{i}','frame', stiffness={k:.17g}, damping={b:.17g} /")
    return "\n".join(lines) + "\n", len(mass), *tones


def springs(random, mass, speed):
    lines = []
    for i, m in enumerate(mass):
        for other in ["frame"] * (i == 0 or random.random() < 0.4) + [f"b{i - 1}"] * (i > 0 and random.random() < 0.8):
            k = m * speed**2 * 10 ** random.uniform(-0.7, 0.7)
            ratio = random.choice([0.0, 0.005, 0.05, 3.0], p=[0.25, 0.35, 0.3, 0.1])
            lines.append(
                f"&spring between='b{i}','{other}', stiffness={k:.17g}, damping={2 * ratio * np.sqrt(k * m):.17g} /"
            )
    return lines


def pair(random, n):
    """Two bodies, or a body and the frame."""
    i = int(random.integers(n))
    others = ["frame"] + [f"b{j}" for j in range(n) if j != i]
    return f"b{i}", str(random.choice(others))


def independent(found, n, between):
    """The directions with one more, or None where it depends on them."""
    w = np.zeros(n)
    for name, sign in zip(between, (1.0, -1.0), strict=True):
        if name != "frame":
            w[int(name[1:])] += sign
    more = [*found, w]
    return more if np.linalg.matrix_rank(np.array(more)) == len(more) else None


def stops_of(random, mass, speed, reach, tones, may_be_rigid):
    lines, rigid, calm = [], [], []
    for i in range(int(random.integers(1, 4))):
        between = pair(random, len(mass))
        side = random.choice(["upper", "lower", "both"])
        start = f"&stop name='s{i}', between='{between[0]}','{between[1]}', side='{side}'"
        clearance = reach * 10 ** random.uniform(-0.7, 0.5)
        start += f", clearance={clearance:.17g}"
        if random.random() < 0.2:
            amplitude, angle = clearance * random.uniform(0.1, 0.9), int(random.integers(360))
            start += f", motion_amplitude={amplitude:.17g}, motion_phase={angle}"
            start += f", motion_angular_frequency={random.choice(tones):.17g}"
        more = independent(rigid, len(mass), between)
        if may_be_rigid and more is not None and random.random() < 0.7:
            rigid = more
            lines.append(f"{start}, law='rigid', restitution={random.choice([0.0, 0.3, 0.5, 0.8, 0.95, 1.0])} /")
            continue
        m = min(float(mass[int(name[1:])]) for name in between if name != "frame")
        k = m * speed**2 * 10 ** random.uniform(0.0, 4.0)
        b = 2 * np.sqrt(k * m) * random.choice([0.0, 0.02, 0.2, 3.0], p=[0.3, 0.3, 0.3, 0.1])
        law = random.choice(["kelvin_voigt", "switched_spring"], p=[0.8, 0.2])
        part = random.choice(["zero_force", "zero_deformation"])
        lines.append(f"{start}, law='{law}', stiffness={k:.17g}, damping={b:.17g}, separation='{part}' /")
        if b == 0:
            calm.append(lines[-1])
    return lines, rigid, calm


def frictions_of(random, n, push, speed, rigid, stops):
    lines = []
    for i in range(int(random.integers(0, 3))):
        between = pair(random, n)
        more = independent(rigid, n, between)
        if more is None:
            continue
        rigid = more
        static = random.uniform(0.1, 0.6)
        kinetic = static * random.choice([1.0, random.uniform(0.3, 1.0)])
        line = f"&friction name='f{i}', between='{between[0]}','{between[1]}', static_coefficient={static:.17g}"
        line += f", kinetic_coefficient={kinetic:.17g}, normal_load={push * 10 ** random.uniform(-1.0, 0.5):.17g}"
        line += f", belt_speed={random.choice([0.0, 0.0, speed * random.uniform(-1.0, 1.0)]):.17g}"
        if stops and random.random() < 0.5:
            stop = str(random.choice(stops))
            name = re.search("name='(.*?)'", stop)[1]
            line += f", only_with='{name}'"
        lines.append(line + " /")
    return lines


def symmetric_text_of(seed):
    """The text of a body between equal pairs of others, with stops that all meet at the same time in each pair."""
    random = np.random.default_rng(seed)
    pairs, speed = int(random.integers(1, 3)), 10 ** random.uniform(1.0, 2.5)
    mass = 10 ** random.uniform(-0.3, 0.7, pairs + 1)
    reach = 10 ** random.uniform(-4.0, -2.5)
    lines = ["&scene kind='lumped' /", f"&mass name='b0', value={mass[0]:.17g} /"]
    joints = [("b0", "frame", 0)]
    for i in range(1, pairs + 1):
        names = f"b{i}", f"c{i}"
        lines += [f"&mass name='{name}', value={mass[i]:.17g} /" for name in names]
        joints += [(name, other, i) for other in ("b0", "frame") for name in names]
    draws = {}
    for name, other, i in joints:
        # What joins the two of a pair to a body is equal.
        key = name[1:], other
        if key not in draws:
            k, c = mass[i] * speed**2 * 10 ** random.uniform(-0.7, 0.7, 2)
            gap, part = reach * 10 ** random.uniform(-0.7, 0.3), random.choice(["zero_force", "zero_deformation"])
            b, hard = 0.1 * k / speed, c * 10 ** random.uniform(0.5, 3.0)
            damping = hard / speed * random.choice([0.0, 0.01, 0.05])
            side = random.choice(["upper", "lower", "both"])
            draws[key] = k, b, side, gap, hard, damping, part
        k, b, side, gap, hard, damping, part = draws[key]
        lines.append(f"&spring between='{name}','{other}', stiffness={k:.17g}, damping={b:.17g} /")
        for j in range(2 if name == "b0" else 1):
            lines.append(
                f"&stop name='s{name}{other}{j}', between='{name}','{other}', side='{side}', clearance={gap:.17g}, "
                f"stiffness={hard * (1 + j):.17g}, damping={damping:.17g}, separation='{part}' /"
            )
    push = mass[0] * speed**2 * reach * random.uniform(1.0, 5.0)
    lines.append(f"&load on='b0', amplitude={push:.17g}, angular_frequency={speed * random.uniform(0.5, 3.0):.17g} /")
    lines.append(f"&initial on='b0', velocity={speed * reach * random.uniform(-2.0, 2.0):.17g} /")
    end = 60.0 / speed
    lines.append(f"&motion t_end={end:.17g}, start='given', integrator='exact', max_seconds=30.0 /")
    lines.append(f"&record observable='state', what='trajectory', interval={end / 60:.17g} /")
    return "\n".join(lines) + "\n"


def planar_text_of(seed):
    """The text of one to three bodies on top of each other, with stops at two points and friction that these press."""
    random = np.random.default_rng(seed)
    n, speed = int(random.integers(1, 4)), 10 ** random.uniform(1.0, 2.5)
    mass, reach = 10 ** random.uniform(-0.5, 1.0, n), 10 ** random.uniform(-4.0, -2.5)
    rigid, rough = random.choice([0.0, 0.4, 1.0]), random.choice([0.0, 0.6])
    place = {"l": -random.uniform(0.1, 0.6), "r": random.uniform(0.1, 0.6)}
    if random.random() < 0.2:
        place["r"] = -place["l"]
    lines = ["&scene kind='planar' /"]
    lines += [f"&point name='f{p}', body='frame', position={x:.17g},-0.1 /" for p, x in place.items()]
    for i in range(n):
        inertia = mass[i] * 10 ** random.uniform(-2.0, 0.0)
        lines.append(f"&body name='b{i}', mass={mass[i]:.17g}, inertia={inertia:.17g}, centre=0.0,{0.5 * i} /")
        for p, x in place.items():
            lines.append(f"&point name='{p}{i}', body='b{i}', position={1.5 * x:.17g},{random.choice([0.0, 0.1])} /")
            lines.append(f"&point name='t{p}{i}', body='b{i}', position={x:.17g},0.1 /")
            lines.append(f"&point name='d{p}{i}', body='b{i}', position={x:.17g},-0.1 /")
            lines += planar_springs(random, f"{p}{i}", mass[i], speed, i == 0)
    for i in range(n):
        for p in place:
            if random.random() < 0.8:
                ends = f"d{p}{i}", f"t{p}{i - 1}" if i > 0 else f"f{p}"
                lines += planar_stop(random, f"s{p}{i}", ends, mass[i], speed, reach, random.random() < rigid)
                if random.random() < rough:
                    lines.append(planar_friction(random, f"s{p}{i}", ends, speed * reach))
    push = speed**2 * reach
    lines.append(
        f"&gravity acceleration={push * random.uniform(0.0, 2.0):.17g}, direction={random.choice([0.0, 0.2])},-1.0 /"
    )
    for name, size in (("y", 1.0), ("x", 1.0), ("phi", 0.3)):
        if random.random() < 0.7:
            amplitude, angle = push * size * np.mean(mass) * random.uniform(0.2, 2.0), int(random.integers(360))
            tone = f"angular_frequency={speed * 10 ** random.uniform(-0.5, 0.8):.17g}, phase={angle}"
            lines.append(f"&load on='b{random.integers(n)}.{name}', amplitude={amplitude:.17g}, {tone} /")
    for i in range(n):
        for name in ("y", "x", "phi"):
            velocity = speed * reach * random.uniform(-2.0, 2.0)
            lines.append(f"&initial on='b{i}.{name}', velocity={velocity:.17g} /")
    end = 60.0 / speed
    lines.append(f"&motion t_end={end:.17g}, start='given', integrator='exact', max_seconds=30.0 /")
    lines.append(f"&record observable='state', what='trajectory', interval={end / 60:.17g} /")
    return "\n".join(lines) + "\n"


def planar_springs(random, point, mass, speed, always):
    """Springs between a point and the frame, upwards and across."""
    lines, ratio = [], random.choice([0.0, 0.005, 0.05, 0.5])
    for direction, chance in ("0.0,1.0", 1.0 if always else 0.6), (f"1.0,{random.choice([0.0, 0.3])}", 0.8):
        k = mass * speed**2 * 10 ** random.uniform(-0.7, 0.7)
        if random.random() < chance:
            stiffness = f"stiffness={k:.17g}, damping={2 * ratio * np.sqrt(k * mass):.17g}"
            lines.append(f"&spring between='{point}','frame', direction={direction}, {stiffness} /")
    return lines


def planar_stop(random, name, ends, mass, speed, reach, rigid):
    clearance = reach * random.choice([0.0, 10 ** random.uniform(-0.7, 0.5)])
    start = f"&stop name='{name}', between='{ends[0]}','{ends[1]}', direction=0.0,1.0, clearance={clearance:.17g}"
    if rigid:
        return [f"{start}, law='rigid', restitution={random.choice([0.0, 0.3, 0.5, 0.8, 0.95])} /"]
    k = mass * speed**2 * 10 ** random.uniform(0.0, 3.5)
    b = 2 * np.sqrt(k * mass) * random.choice([0.0, 0.0, 0.02, 0.2])
    part = random.choice(["zero_force", "zero_deformation"])
    return [f"{start}, stiffness={k:.17g}, damping={b:.17g}, separation='{part}' /"]


def planar_friction(random, stop, ends, speed):
    static = random.uniform(0.1, 0.6)
    kinetic, belt = (
        static * random.choice([1.0, random.uniform(0.4, 1.0)]),
        random.choice([0.0, 0.0, random.uniform(-1, 1)]),
    )
    coefficients = f"static_coefficient={static:.17g}, kinetic_coefficient={kinetic:.17g}"
    return (
        f"&friction name='f{stop}', between='{ends[0]}','{ends[1]}', {coefficients}, normal_contact='{stop}', "
        f"belt_speed={speed * belt:.17g} /"
    )


def turning_text_of(seed):
    """The text of a rotor with gyroscopic moments and bearings that drive it around, rigid stops and friction."""
    random = np.random.default_rng(seed)
    mass, speed = 10 ** random.uniform(-0.3, 0.7), 10 ** random.uniform(1.7, 2.7)
    turning = speed * 10 ** random.uniform(-0.3, 0.5)
    polar = mass * 10 ** random.uniform(-3.0, -1.5)
    reach = 10 ** random.uniform(-4.5, -3.5)
    push = mass * speed**2 * reach
    lines = [
        "&scene kind='rotor' /",
        "&freedom axial=.false., torsion=.false. /",
        "&shaft name='r', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0, damping_ratio=0.02, "
        "damping='nodal' /",
        f"&section shaft='r', length={random.uniform(0.2, 0.5):.17g}, outer_diameter=0.02, elements=1 /",
        f"&disk shaft='r', node=2, mass={mass:.17g}, polar_inertia={polar:.17g}, diametral_inertia={polar / 2:.17g} /",
        f"&rotation speed_rpm={turning * 30 / np.pi:.17g}, circulatory={random.choice(['.true.', '.false.'])} /",
        f"&unbalance shaft='r', node=2, moment={mass * reach * 10 ** random.uniform(-1.0, 0.3):.17g} /",
    ]
    for node in (1, 2):
        k = mass * speed**2 * 10 ** random.uniform(-0.3, 0.7, 2)
        cross = np.min(k) * random.choice([0.0, 0.05, 0.3])
        b = 2 * np.sqrt(np.min(k) * mass) * random.choice([0.005, 0.05, 0.3])
        lines.append(
            f"&bearing shaft='r', node={node}, kind='matrix', "
            f"stiffness={k[0]:.17g},{cross:.17g},{-cross:.17g},{k[1]:.17g}, damping_matrix={b:.17g},0.0,0.0,{b:.17g} /"
        )
    for node in (1, 2):
        angle = random.uniform(0.0, 2 * np.pi)
        for i in range(2):
            direction = f"direction=0.0,{np.cos(angle):.17g},{np.sin(angle):.17g}"
            kind = random.choice(["rigid", "friction", "none"], p=[0.4, 0.3, 0.3])
            if kind == "rigid":
                clearance, bounce = (
                    reach * 10 ** random.uniform(-0.7, 0.3),
                    random.choice([0.0, 0.3, 0.5, 0.8, 0.95, 1.0]),
                )
                lines.append(
                    f"&stop name='s{node}{i}', between='r.{node}','frame', {direction}, law='rigid', "
                    f"clearance={clearance:.17g}, restitution={bounce} /"
                )
            elif kind == "friction":
                load, drift = push * 10 ** random.uniform(-1.5, 0.3), speed * reach * random.choice([0.0, 0.5])
                lines.append(
                    f"&friction name='f{node}{i}', between='r.{node}','frame', {direction}, "
                    f"belt_speed={drift:.17g}, static_coefficient=0.3, "
                    f"kinetic_coefficient={random.choice([0.3, 0.2])}, normal_load={load:.17g} /"
                )
            angle += random.uniform(0.3, np.pi - 0.3)
    lines.append(f"&initial on='r.2.v', velocity={speed * reach * random.uniform(-1.0, 1.0):.17g} /")
    end = 60.0 / speed
    lines.append(f"&motion t_end={end:.17g}, start='given', integrator='exact', max_seconds=30.0 /")
    lines.append(f"&record observable='state', what='trajectory', interval={end / 60:.17g} /")
    return "\n".join(lines) + "\n"
