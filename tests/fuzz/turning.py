"""Random rotors with free motions, as input and as matrices of an assembly of its own.

Beams of Euler and Bernoulli with rotary inertia, in (v, v', w, w', phi) of each node.
Motion along the axis is left out.
"""

from dataclasses import dataclass, field, replace

import numpy as np

YOUNG, SHEAR, DENSITY = 2.1e11, 8.0e10, 7800.0
# Of gears, deg: the base circles count. On round bearings the direction of the line of action makes no difference.
PRESSURE = 20.0


@dataclass(frozen=True)
class Shaft:
    """A uniform shaft; disks are (node, m, J_p, J_d), bearings (node, k_yy, k_zz, k_cross, c)."""

    name: str
    length: float
    diameter: float
    elements: int
    ratio: float = 1.0
    damping: float = 0.0
    held: bool = False
    disks: tuple = ()
    bearings: tuple = ()


@dataclass(frozen=True)
class Rotor:
    """Shafts, and meshes (shaft, node, radius, shaft, node, radius, k, b)."""

    shafts: tuple
    last: float
    meshes: tuple = ()
    order: tuple = field(default=())

    @property
    def circulatory(self):
        return any(shaft.damping > 0 for shaft in self.shafts)


def shaft_of(draw, name, round_bearings=False):
    """Draw a shaft on two bearings in round numbers."""
    elements = int(draw.integers(3, 9))
    k, c = 10.0 ** draw.integers(5, 8), draw.choice([0.0, 1e2, 1e3, 1e4])
    zz = 1.0 if round_bearings else draw.choice([0.8, 1.0])
    cross = draw.choice([0.0, 0.0, 0.05, 0.3])
    ends = (1, elements + 1) if draw.random() < 0.7 else (1, int(draw.integers(2, elements + 1)))
    disks = tuple(
        (int(draw.integers(1, elements + 2)), *map(draw.choice, ([1.0, 5.0, 30.0], [0.02, 0.3], [0.012, 0.17])))
        for _ in range(draw.integers(1, 3))
    )  # fmt: skip
    return Shaft(
        name, draw.choice([0.5, 1.0, 1.5]), draw.choice([0.03, 0.05]), elements,
        damping=draw.choice([0.0, 0.0, 0.001, 0.005]), held=bool(draw.random() < 0.2), disks=disks,
        bearings=tuple((node, k, zz * k, cross * k, c) for node in ends),
    )  # fmt: skip


def rotor_of(seed):
    draw = np.random.default_rng(seed)
    if seed % 3 < 2:
        return Rotor((shaft_of(draw, "s"),), draw.choice([3000.0, 12000.0]))
    first, second = (shaft_of(draw, name, round_bearings=True) for name in "st")
    radius = 0.05, draw.choice([0.05, 0.1])
    second = replace(second, ratio=-radius[0] / radius[1], held=False)
    mesh = ("s", first.elements + 1, radius[0], "t", 1, radius[1], draw.choice([1e7, 1e8]), draw.choice([0.0, 1e3]))
    return Rotor((replace(first, held=False), second), 6000.0, (mesh,))


def groups(rotor, points):
    lines = []
    for s in rotor.shafts:
        inner = f", damping_ratio={s.damping}" if s.damping > 0 else ""
        lines += [
            f"&shaft name='{s.name}', young_modulus={YOUNG}, shear_modulus={SHEAR}, density={DENSITY}{inner},",
            f" element='rayleigh', speed_ratio={s.ratio} /",
            f"&section shaft='{s.name}', length={s.length}, outer_diameter={s.diameter}, elements={s.elements} /",
        ]
        for n, m, p, d in s.disks:
            lines.append(f"&disk shaft='{s.name}', node={n}, mass={m}, polar_inertia={p}, diametral_inertia={d} /")
        for n, y, z, q, c in s.bearings:
            lines.append(f"&bearing shaft='{s.name}', node={n}, kind='matrix', stiffness={y},{q},{-q},{z},")
            lines.append(f" damping_matrix={c},0.0,0.0,{c} /")
        if s.held:
            lines.append(f"&support shaft='{s.name}', node=1, held='u','phi' /")
    for i, (a, m, r, b, n, s, k, c) in enumerate(rotor.meshes):
        lines.append(f"&gear_mesh name='m{i}', between='{a}','{b}', node={m},{n}, radius={r},{s},")
        lines.append(f" pressure_angle={PRESSURE}, teeth=20,{round(20 * s / r)}, stiffness={k}, damping={c} /")
    lines = "\n".join(lines).replace(",\n", ",").splitlines()
    return [
        "&scene kind='rotor' /", *lines,
        f"&rotation of='s', speed_rpm=1000.0, circulatory={'.true.' if rotor.circulatory else '.false.'} /",
        f"&campbell last_rpm={rotor.last}, points={points}, damped=.true. /", "&modes count=10 /",
    ]  # fmt: skip


def beam(s):
    """M, rotary inertia, K of one element in (v1, v1', v2, v2'), and of a bar."""
    h = s.length / s.elements
    area, second = np.pi * s.diameter**2 / 4, np.pi * s.diameter**4 / 64
    move = DENSITY * area * h / 420 * np.array([
        [156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
        [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])  # fmt: skip
    tilt = DENSITY * second / (30 * h) * np.array([
        [36, 3 * h, -36, 3 * h], [3 * h, 4 * h * h, -3 * h, -h * h],
        [-36, -3 * h, 36, -3 * h], [3 * h, -h * h, -3 * h, 4 * h * h]])  # fmt: skip
    bend = YOUNG * second / h**3 * np.array([
        [12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
        [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])  # fmt: skip
    turn = DENSITY * 2 * second * h / 6 * np.array([[2, 1], [1, 2]])
    twist = SHEAR * 2 * second / h * np.array([[1, -1], [-1, 1]])
    return move + tilt, tilt, bend, turn, twist


def matrices(rotor):
    """M, B, G, K (with all that is skew in it), C; B and K of the shaft's material turn with it."""
    count = [5 * (s.elements + 1) for s in rotor.shafts]
    first = dict(zip((s.name for s in rotor.shafts), np.cumsum([0, *count]), strict=False))
    n = sum(count)
    m, b, g, k, c = (np.zeros((n, n)) for _ in range(5))
    held = []
    for s in rotor.shafts:
        at = first[s.name]
        own = slice(at, at + 5 * (s.elements + 1))
        mass, tilt, bend, turn, twist = beam(s)
        inner = np.zeros((n, n))
        for e in range(s.elements):
            y, z, phi = (at + 5 * e + np.array(part) for part in ([0, 1, 5, 6], [2, 3, 7, 8], [4, 9]))
            for plane in (y, z):
                m[np.ix_(plane, plane)] += mass
                inner[np.ix_(plane, plane)] += bend
            g[np.ix_(y, z)] += 2 * s.ratio * tilt
            g[np.ix_(z, y)] -= 2 * s.ratio * tilt
            m[np.ix_(phi, phi)] += turn
            inner[np.ix_(phi, phi)] += twist
        for node, mass, polar, diametral in s.disks:
            i = at + 5 * (node - 1)
            m[range(i, i + 5), range(i, i + 5)] += [mass, diametral, mass, diametral, polar]
            g[i + 1, i + 3] += s.ratio * polar
            g[i + 3, i + 1] -= s.ratio * polar
        k += inner
        for node, yy, zz, cross, damping in s.bearings:
            i = at + 5 * (node - 1)
            k[i, i] += yy
            k[i + 2, i + 2] += zz
            k[i, i + 2] += cross
            k[i + 2, i] -= cross
            b[[i, i + 2], [i, i + 2]] += damping
        if s.damping > 0:
            bending = np.array([i for i in range(own.start, own.stop) if (i - at) % 5 < 4])
            still = k[np.ix_(bending, bending)]
            squared = np.linalg.eigvals(np.linalg.solve(m[np.ix_(bending, bending)], (still + still.T) / 2)).real
            inner *= 2 * s.damping / np.sqrt(squared.min())
            b += inner
            for i in range(own.start, own.stop, 5):
                for j in range(own.start, own.stop, 5):
                    c[i : i + 2, j + 2 : j + 4] += s.ratio * inner[i : i + 2, j : j + 2]
                    c[i + 2 : i + 4, j : j + 2] -= s.ratio * inner[i + 2 : i + 4, j + 2 : j + 4]
        if s.held:
            held.append(at + 4)
    for one, i, r, two, j, q, stiffness, damping in rotor.meshes:
        row = np.zeros(n)
        i, j = first[one] + 5 * (i - 1), first[two] + 5 * (j - 1)
        arm = np.cos(np.radians(PRESSURE))
        row[[i, i + 4, j, j + 4]] = 1.0, r * arm, -1.0, q * arm
        k += stiffness * np.outer(row, row)
        b += damping * np.outer(row, row)
    kept = np.delete(np.arange(n), held)
    return tuple(matrix[np.ix_(kept, kept)] for matrix in (m, b, g, k, c))


def eigenvalues(parts, speed):
    m, b, g, k, c = parts
    n = len(m)
    state = np.zeros((2 * n, 2 * n))
    state[:n, n:] = np.eye(n)
    state[n:] = -np.linalg.solve(m, np.hstack([k + speed * c, b + speed * g]))
    value = np.linalg.eigvals(state)
    return value[value.imag >= 0]
