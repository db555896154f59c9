"""The machine of an effective input, rebuilt in exact rational numbers: M, B, K, loads and contacts.

Numbers of the input are the doubles next to their decimals, taken exactly.
Frequencies are a rational times pi^0 or pi^1.
"""

from dataclasses import dataclass, field
from fractions import Fraction
from math import gcd
from typing import Any

import f90nml
from flint import arb, arb_mat, fmpq, fmpq_mat

from razy.check.places import Places, direction

KNOWN = {
    "scene", "mass", "inertia", "body", "point", "spring", "damper", "damping", "stop", "friction", "gear_mesh",
    "rotation", "load", "exciter", "gravity", "initial", "motion", "record", "sweep", "follow", "starts", "start_range",
    "modes", "response", "tune", "duel",
}  # fmt: skip
"""Groups that are read or that say nothing of the machine."""


class NotCovered(Exception):  # noqa: N818 - it is no error but a limit
    """What the checker does not check."""


@dataclass
class Tone:
    """A harmonic excitation: cosine and sine vectors on some rows, frequency rational * pi^power."""

    frequency: tuple[Fraction, int]
    cosine: arb
    sine: arb


@dataclass
class Wave:
    """An excitation of unit amplitude that is no sine: what it is from each part of its period on, until the next.

    That is a value and by how much it rises in a period, or a half sine of this part of the period.
    """

    frequency: tuple[Fraction, int]
    pieces: list[tuple[Fraction, Fraction, Fraction]]
    half_sine: Fraction | None = None
    """It is the first piece; in others it is 0."""

    def repeated(self, times: int) -> list[tuple[Fraction, Fraction, Fraction]]:
        """Return the pieces in a period of so many of its own."""
        return [((start + k) / times, value, times * rise) for k in range(times) for start, value, rise in self.pieces]

    def at(self, part: Fraction, times: int) -> tuple[arb, arb]:
        """Return the value, and its derivative by the phase, from this part of a period of so many of its own on."""
        pieces = self.repeated(times)
        k = min(range(len(pieces)), key=lambda k: (part - pieces[k][0]) % 1)
        (_, value, rise), since = pieces[k], (part - pieces[k][0]) % 1
        if self.half_sine is None:
            return ball(value + rise * since), ball(rise / 2) / arb.pi()
        if k % len(self.pieces):
            return arb(0), arb(0)
        turn = since * times / self.half_sine
        sine, cosine = arb.sin_cos_pi_fmpq(fmpq(turn.numerator, turn.denominator))
        return sine, cosine * ball(times / self.half_sine / 2)


@dataclass
class Line:
    """A line of a law: force k s + b s' + constant between two edges; outer ones are none where it goes on."""

    low: Fraction | None
    high: Fraction | None
    stiffness: Fraction = Fraction(0)
    damping: Fraction = Fraction(0)
    constant: Fraction = Fraction(0)
    parts: int = 0
    """The sign of the force of one that does not pull: it parts where the force is zero."""


@dataclass
class Contact:
    """A contact on s = w q + tones: lines, or rigid edges of the one line between them, or friction.

    Friction slides with v = s' - belt and the force kinetic + viscous v, and sticks up to static.
    """

    name: str
    w: list[Fraction]
    lines: list[Line] = field(default_factory=list)
    restitution: Fraction | None = None
    tones: list[Tone] = field(default_factory=list)
    static: Fraction | None = None
    kinetic: Fraction = Fraction(0)
    viscous: Fraction = Fraction(0)
    belt: Fraction = Fraction(0)


@dataclass
class Machine:
    """M q'' + B q' + K q = f + contacts, over the coordinates in the order of the results."""

    names: list[str]
    mass: list[Fraction]
    damping: list[list[Fraction]]
    stiffness: list[list[Fraction]]
    constant: list[Fraction]
    loads: list[tuple[list[Fraction], Tone]]
    waves: list[tuple[list[Fraction], arb, Wave]]
    """Row of the coordinates on which it acts, amplitude, shape."""
    contacts: list[Contact]
    observed: list[list[Fraction]]

    def frequencies(self) -> list[tuple[Fraction, int]]:
        """Return the frequencies of all tones."""
        return [*self.sines(), *(wave.frequency for *_, wave in self.waves)]

    def sines(self) -> list[tuple[Fraction, int]]:
        """Return the frequencies of sines."""
        tones = [tone for _, tone in self.loads] + [tone for c in self.contacts for tone in c.tones]
        return [tone.frequency for tone in tones]


def read_groups(text: str) -> dict[str, list[dict[str, Any]]]:
    """Return the groups of a namelist by name."""
    parsed = f90nml.reads(text)
    groups: dict[str, list[dict[str, Any]]] = {}
    for name, value in parsed.items():
        groups.setdefault(name, []).extend(value if isinstance(value, list) else [value])
    kind = groups["scene"][0]["kind"]
    if kind == "rotor":
        raise NotCovered(f"a scene of kind '{kind}'")
    for name in groups:
        if name not in KNOWN:
            raise NotCovered(f"the group &{name}")
    if any("pin" in body for body in groups.get("body", [])):
        raise NotCovered("a body on a pin")
    return groups


def put(groups: dict[str, list[dict[str, Any]]], parameter: str, value: float) -> None:
    """Set group(number)%key, as --set does."""
    place, key = parameter.lower().replace(" ", "").split("%")
    name, _, number = place.partition("(")
    key, _, element = key.partition("(")
    group = groups[name][int(number.rstrip(")") or 1) - 1 if number else 0]
    if element:
        group[key][int(element.rstrip(")")) - 1] = value
    else:
        group[key] = value


def build(groups: dict[str, list[dict[str, Any]]]) -> Machine:
    """Assemble the machine."""
    places = Places(groups)
    n = len(places.names)
    machine = Machine(places.names, places.mass, _zeros(n), _zeros(n), [Fraction(0)] * n, [], [], [], [])
    tables = _add_springs(machine, groups, places)
    speeds = _speeds(groups, places)
    for load in groups.get("load", []):
        _add_load(machine, load, places.coordinate(load["on"]), speeds)
    for exciter in groups.get("exciter", []):
        _add_exciter(machine, exciter, places)
    for weight in groups.get("gravity", []):
        down = [Fraction(weight["acceleration"]) * x for x in direction(weight.get("direction", [0.0, -1.0]))]
        for i in range(n):
            along = places.moves[i][1] or (Fraction(0), Fraction(0))
            machine.constant[i] += (down[0] * along[0] + down[1] * along[1]) * machine.mass[i]
    # In the order of the results.
    machine.contacts = [_mesh(mesh, places, speeds) for mesh in groups.get("gear_mesh", [])]
    machine.contacts += [_stop(stop, places, speeds) for stop in groups.get("stop", [])]
    machine.contacts += [
        Contact(table.get("name", "a spring"), places.pairs(table)[0], _table(table)) for table in tables
    ]
    machine.contacts += [_friction(friction, places) for friction in groups.get("friction", [])]
    for record in groups.get("record", []):
        if record["observable"] in ("displacement", "velocity") and ("of" in record or n == 1):
            machine.observed.append(places.coordinate(record.get("of") or places.names[0]))
    return machine


def _add_springs(machine: Machine, groups: dict[str, list[dict[str, Any]]], places: Places) -> list[dict]:
    """Add springs and dampers to K and B; return the springs with tables."""
    springs, factor, of = groups.get("spring", []), Fraction(0), "springs"
    for damping in groups.get("damping", []):
        factor, of = Fraction(damping["factor"]), damping.get("matrix", "springs")

    def add(matrix: list[list[Fraction]], value: Fraction, w: list[Fraction]) -> None:
        felt_by = [i for i, x in enumerate(w) if x]
        for i in felt_by:
            for j in felt_by:
                matrix[i][j] += value * w[i] * w[j]

    for spring in springs:
        if spring.get("law", "linear") not in ("linear", "table"):
            raise NotCovered(f"the law '{spring['law']}' of a spring")
    if any("velocity" in damper for damper in groups.get("damper", [])):
        raise NotCovered("a damper whose force is a table")
    tables = [spring for spring in springs if spring.get("law") == "table"]
    for spring in [each for each in springs if each not in tables] + groups.get("damper", []):
        rows, k = places.pairs(spring), Fraction(spring.get("stiffness", 0.0))
        b = Fraction(spring.get("damping", 0.0)) + Fraction(spring.get("damping_factor", 0.0)) * k
        b += factor * (Fraction(spring.get("untuned_stiffness", k)) if of == "untuned" else k)
        for w in rows:
            add(machine.stiffness, k / len(rows), w)
            add(machine.damping, b / len(rows), w)
    for stop in groups.get("stop", []) if of == "all" else []:
        add(machine.damping, factor * Fraction(stop["stiffness"]), places.pairs(stop)[0])
    return tables


def _add_load(machine: Machine, load: dict[str, Any], w: list[Fraction], speeds: dict[str, Fraction]) -> None:
    for i, x in enumerate(w):
        machine.constant[i] += x * Fraction(load.get("value", 0.0))
    if load.get("file"):
        raise NotCovered("a load from a file, whose text is not in the results")
    if load.get("amplitude", 0.0) or load.get("unbalance", 0.0):
        frequency = _frequency(load, "", speeds)
        amplitude = _exact(load.get("amplitude", 0.0)) + _exact(load.get("unbalance", 0.0)) * value_of(frequency) ** 2
        if load.get("shape", "sine") != "sine":
            machine.waves.append((w, amplitude, _wave(load, frequency)))
        else:
            machine.loads.append((w, _sine(frequency, amplitude, load.get("phase", 0.0))))


def _add_exciter(machine: Machine, exciter: dict[str, Any], places: Places) -> None:
    """Add the forces U w^2 (sin along + cos across) of both rotors."""
    frequency, phase = _frequency(exciter, "", {}), exciter.get("phase", 0.0)
    if "force" in exciter:
        force = _exact(exciter["force"]) / 2 * (_exact(exciter["frequency"]) / _exact(exciter["force_frequency"])) ** 2
    else:
        force = _exact(exciter["unbalance"]) * value_of(frequency) ** 2
    for (along, across), ahead in zip(places.axes_of(exciter), (0.0, exciter.get("phase_error", 0.0)), strict=True):
        machine.loads.append((along, _sine(frequency, force, Fraction(phase) + Fraction(ahead))))
        machine.loads.append((across, _sine(frequency, force, Fraction(phase) + Fraction(ahead) + 90)))


def value_of(frequency: tuple[Fraction, int]) -> arb:
    """Return a frequency in rad/s."""
    return ball(frequency[0]) * arb.pi() ** frequency[1]


def common(frequencies: list[tuple[Fraction, int]]) -> tuple[Fraction, int]:
    """Return the largest frequency of which all are multiples; without excitation 1 rad/s, a scale of the time."""
    if not frequencies:
        return Fraction(1), 0
    if len({power for _, power in frequencies}) > 1:
        raise NotCovered("frequencies without a common period")
    largest = Fraction(0)
    for value, _ in frequencies:
        one, two = largest.numerator * value.denominator, value.numerator * largest.denominator
        largest = Fraction(gcd(one, two), largest.denominator * value.denominator)
    return largest, frequencies[0][1]


def matrix(rows: list[list[Fraction]]) -> fmpq_mat:
    """Return a matrix of FLINT's rationals."""
    return fmpq_mat(len(rows), len(rows[0]), [fmpq(x.numerator, x.denominator) for line in rows for x in line])


def balls(rows: fmpq_mat) -> arb_mat:
    """Return balls round rational numbers."""
    return arb_mat(rows.nrows(), rows.ncols(), [arb(x) for x in rows.entries()])


def felt(machines: list[Machine]) -> tuple[fmpq_mat, fmpq_mat]:
    """Return rows spanning the smallest space that holds what contacts and observables feel, closed under K/M and B/M.

    machines differ in one number that K, B or 1/M is linear in, so a space closed for all of them is so in between.
    The second are those of contacts and observables and what follows from them, one after the other: what is felt by
    rounding alone hardly changes them.
    Common motions that nothing resists are left out: of an observable only what springs and dampers feel is kept then.
    """
    machine, maps = machines[0], []
    n = len(machine.mass)
    for each in machines[:2]:
        inverse = matrix([[1 / m if i == j else Fraction(0) for j in range(n)] for i, m in enumerate(each.mass)])
        for part in (inverse * matrix(each.stiffness), inverse * matrix(each.damping)):
            if part not in maps:
                maps.append(part)
    seeds = [matrix([c.w]) for c in machine.contacts]
    stretched = machine.stiffness + machine.damping + [c.w for c in machine.contacts]
    whole = matrix(stretched).rank()
    for w in machine.observed:
        row = matrix([w])
        inside = matrix([*stretched, w]).rank() == whole
        seeds += [row] if inside else [row * each for each in maps]
    rows: list[list[fmpq]] = []
    while seeds:
        row = seeds.pop(0).entries()
        largest = max(max(x, -x) for x in row)
        row = [x / largest for x in row] if largest > 0 else row
        trial = fmpq_mat(len(rows) + 1, n, [x for line in [*rows, row] for x in line])
        if trial.rank() == len(rows) + 1:
            rows.append(row)
            seeds += [fmpq_mat(1, n, row) * each for each in maps]
    if not rows:
        raise NotCovered("a machine whose contacts feel nothing")
    # In echelon form rows are far from dependent; if all is felt they are the bodies themselves.
    found = fmpq_mat(len(rows), n, [x for line in rows for x in line])
    return found.rref()[0], found


def _zeros(n: int) -> list[list[Fraction]]:
    return [[Fraction(0)] * n for _ in range(n)]


def ball(x: Fraction) -> arb:
    """Return a rational number as a ball."""
    return arb(fmpq(x.numerator, x.denominator))


def _exact(x: float) -> arb:
    return ball(Fraction(x))


def _sine(frequency: tuple[Fraction, int], amplitude: arb, degrees: float | Fraction) -> Tone:
    """Return amplitude sin(w t + phase)."""
    turn = Fraction(degrees) / 180
    sine, cosine = arb.sin_cos_pi_fmpq(fmpq(turn.numerator, turn.denominator))
    return Tone(frequency, amplitude * sine, amplitude * cosine)


def _wave(load: dict[str, Any], frequency: tuple[Fraction, int]) -> Wave:
    """Return the shape of a load: square, half sine, ramp or pulse."""
    shape, zero, one = load["shape"], Fraction(0), Fraction(1)
    if shape == "square":
        duty = Fraction(load.get("duty", 0.5))
        pieces = [(zero, one, zero), (duty, -one, zero)]
    if frequency[1] == 0 and (shape != "square" or load.get("delay", 0.0)):
        raise NotCovered("times of a shape beside an angular_frequency")
    # Parts of the period.
    duration, rise, delay = (Fraction(load.get(key, 0.0)) * frequency[0] / 2 for key in ("duration", "rise", "delay"))
    if shape == "half_sine":
        pieces = [(zero, zero, zero), (duration, zero, zero)]
    elif shape == "ramp":
        pieces = [(zero, zero, 1 / duration), (duration, one, zero)]
    elif shape == "pulse":
        pieces = [(rise, one, zero), (duration, zero, zero)]
        if rise:
            pieces = [(zero, zero, 1 / rise), pieces[0], (duration - rise, one, -1 / rise), pieces[1]]
    ends = [*(start for start, *_ in pieces[1:]), one]
    kept = [
        ((piece[0] + delay) % 1, *piece[1:])
        for piece, end in zip(pieces, ends, strict=True)
        if piece[0] < min(end, one)
    ]
    return Wave(frequency, kept, duration if shape == "half_sine" else None)


def _speeds(groups: dict[str, list[dict[str, Any]]], places: Places) -> dict[str, Fraction]:
    """Return the turns a minute of what turns: equal along what acts on angles, as the teeth in meshes."""
    if "rotation" not in groups:
        return {}
    rotation = groups["rotation"][0]
    if rotation.get("acceleration_rpm_per_s", 0.0):
        raise NotCovered("a run-up")
    speeds = {rotation["of"].lower(): Fraction(rotation["speed_rpm"])}
    joining = [item for name in ("spring", "damper", "stop") for item in groups.get(name, []) if places.turns(item)]
    links = [(*item["between"][i : i + 2], Fraction(1)) for item in joining for i in range(0, len(item["between"]), 2)]
    links += [(*m["between"], Fraction(m["teeth"][0], m["teeth"][1])) for m in groups.get("gear_mesh", [])]
    for _ in links:
        for first, second, ratio in links:
            one, two = first.lower(), second.lower()
            if "frame" in (one, two):
                continue
            if one in speeds:
                speeds.setdefault(two, speeds[one] * ratio)
            elif two in speeds:
                speeds[one] = speeds[two] / ratio
    return speeds | {"": Fraction(rotation["speed_rpm"])}


def _frequency(group: dict[str, Any], prefix: str, speeds: dict[str, Fraction]) -> tuple[Fraction, int]:
    if f"{prefix}angular_frequency" in group:
        return Fraction(group[f"{prefix}angular_frequency"]), 0
    if f"{prefix}frequency" in group:
        return 2 * Fraction(group[f"{prefix}frequency"]), 1
    if f"{prefix}order" not in group:
        raise NotCovered("a load that comes once")
    return Fraction(group[f"{prefix}order"]) * speeds[""] / 30, 1


def _stop(stop: dict[str, Any], places: Places, speeds: dict[str, Fraction]) -> Contact:
    law, side, clearance = stop["law"], places.side(stop), Fraction(stop["clearance"])
    if law not in ("kelvin_voigt", "switched_spring", "rigid", "table"):
        raise NotCovered(f"the law '{law}' of {stop['name']}")
    gap = Line(-clearance if side in ("lower", "both") else None, clearance if side in ("upper", "both") else None)
    contact = Contact(stop["name"], places.pairs(stop)[0], [gap])
    if law == "rigid":
        contact.restitution = Fraction(stop["restitution"])
    elif law == "table":
        contact.lines = _beside(gap, _table(stop))
    else:
        switched = law == "switched_spring"
        clearance = clearance if switched else Fraction(0)
        contact.lines = _pressed(stop, gap, clearance, "zero_deformation" if switched else "zero_force")
    _move(contact, stop, -1, speeds)
    return contact


def _move(contact: Contact, group: dict[str, Any], sign: int, speeds: dict[str, Fraction]) -> None:
    """Add the given motion of a stop's second end, or of flanks, to s."""
    if group.get("motion_shape", "sine") != "sine" or group.get("motion_file"):
        raise NotCovered(f"the motion of {group['name']}, which is no sine")
    if group.get("motion_amplitude", 0.0):
        frequency = _frequency(group, "motion_", speeds)
        contact.tones.append(_sine(frequency, sign * _exact(group["motion_amplitude"]), group.get("motion_phase", 0.0)))


def _friction(friction: dict[str, Any], places: Places) -> Contact:
    for key in ("normal_contact", "only_with"):
        if key in friction:
            raise NotCovered(f"{key} of {friction['name']}")
    load, static = Fraction(friction["normal_load"]), Fraction(friction["static_coefficient"])
    kinetic = Fraction(friction.get("kinetic_coefficient", static))
    if friction.get("decay", 0.0) and static != kinetic:
        raise NotCovered(f"friction that falls with the speed, {friction['name']}")
    contact = Contact(friction["name"], places.sliding(friction), belt=Fraction(friction.get("belt_speed", 0.0)))
    contact.static, contact.kinetic = static * load, kinetic * load
    contact.viscous = Fraction(friction.get("viscous_coefficient", 0.0)) * load
    return contact


def _table(group: dict[str, Any]) -> list[Line]:
    """Return the lines between the points of a table; the outer ones go on, unless it is not to be left."""
    places, forces = ([Fraction(x) for x in group[key]] for key in ("displacement", "force"))
    given = group.get("line_damping", 0.0)
    damping = given if isinstance(given, list) else [given] * (len(places) - 1)
    damping = damping * (len(places) - 1) if len(damping) == 1 else damping
    lines = []
    for i, b in enumerate(damping):
        k = (forces[i + 1] - forces[i]) / (places[i + 1] - places[i])
        lines.append(Line(places[i], places[i + 1], k, Fraction(b), forces[i] - k * places[i]))
    if group.get("beyond", "continue") == "continue":
        lines[-1].high = None
        lines[0].low = None if "clearance" not in group else lines[0].low
    return lines


def _pressed(group: dict[str, Any], gap: Line, length: Fraction, separation: str) -> list[Line]:
    """Return the lines of a spring and damper beside a gap, or of one that is as long as that when it touches."""
    stiffness, damping = Fraction(group["stiffness"]), Fraction(group.get("damping", 0.0))
    damping += Fraction(group.get("damping_factor", 0.0)) * stiffness
    parts = group.get("separation", separation) == "zero_force" and damping > 0
    return _beside(gap, [Line(Fraction(0), None, stiffness, damping, stiffness * length, int(parts))])


def _beside(gap: Line, lines: list[Line]) -> list[Line]:
    """Return the lines over s beside a gap, from those over the deformation of each of its sides."""
    result = [gap] if gap.low is None or gap.low != gap.high else []
    for p in lines if gap.high is not None else []:
        edge, end = gap.high, None if p.high is None else gap.high + p.high
        result.append(Line(edge + p.low, end, p.stiffness, p.damping, p.constant - p.stiffness * edge, p.parts))
    for p in lines if gap.low is not None else []:
        edge, end = gap.low, None if p.high is None else gap.low - p.high
        result.insert(0, Line(end, edge - p.low, p.stiffness, p.damping, -p.constant - p.stiffness * edge, -p.parts))
    return result


def _mesh(mesh: dict[str, Any], places: Places, speeds: dict[str, Fraction]) -> Contact:
    for key in ("error_file", "stiffness_file", "stiffness_sine", "stiffness_cosine", "contact_ratio"):
        if key in mesh:
            raise NotCovered(f"{key} of {mesh['name']}")
    if mesh.get("damping_acts", "in_contact") != "in_contact":
        raise NotCovered(f"damping_acts of {mesh['name']}")
    if not places.turns(mesh):
        raise NotCovered(f"a mesh of bodies in the plane, {mesh['name']}")
    w = places.wheels(mesh["between"], (Fraction(mesh["radius"][0]), Fraction(mesh["radius"][1])))
    gap = Line(-Fraction(mesh["backlash"]), Fraction(0))
    contact = Contact(mesh["name"], w, _pressed(mesh, gap, Fraction(0), "zero_force"))
    for key in ("error_sine", "error_cosine"):
        values = mesh.get(key, [])
        for k, amplitude in enumerate(values if isinstance(values, list) else [values], start=1):
            if amplitude:
                speed = speeds[mesh["between"][0].lower()]
                phase = 0.0 if key == "error_sine" else 90.0
                contact.tones.append(_sine((k * mesh["teeth"][0] * speed / 30, 1), _exact(amplitude), phase))
    _move(contact, mesh, 1, speeds)
    return contact
