"""The motion of a lumped machine with compliant stops in 260 bits, with the norm of its tangent map.

Nothing here is taken from the library. The state is x = (q, q', 1, sines and cosines); in a mode x' = A x, and a step
is a product with exp(A h). What ends a mode are linear forms of x, which are looked at in eight places of each step.
"""

import f90nml
import flint
import numpy as np
from flint import arb, arb_mat

flint.ctx.prec = 260
PLACES = 8


def listed(value):
    return value if isinstance(value, list) else [value]


def number(value):
    return arb(float(value))


def middle(matrix):
    """Without its radii: what is computed is one of the exact solutions of machines within rounding."""
    return arb_mat([[entry.mid() for entry in row] for row in matrix.table()])


class Machine:
    def __init__(self, text):
        nml = f90nml.Parser().reads(text)

        def groups(name):
            return [dict(group) for group in listed(nml.get(name, []))]

        masses, loads, stops = groups("mass"), groups("load"), groups("stop")
        self.names = [mass["name"] for mass in masses]
        n = self.n = len(masses)
        tones = [load["angular_frequency"] for load in loads if load.get("amplitude", 0.0)]
        tones += [stop["motion_angular_frequency"] for stop in stops if stop.get("motion_amplitude", 0.0)]
        self.tones = sorted(set(tones))
        self.one, self.size = 2 * n, 2 * n + 1 + 2 * len(self.tones)
        self.mass = [number(mass["value"]) for mass in masses]
        self.rates = arb_mat(self.size, self.size)
        for i in range(n):
            self.rates[i, n + i] = 1
        for j, omega in enumerate(self.tones):
            c = self.one + 1 + 2 * j
            self.rates[c, c + 1], self.rates[c + 1, c] = -number(omega), number(omega)
        for spring in groups("spring") + groups("damper"):
            w = self.direction(spring["between"])
            form = self.form(w, number(spring.get("stiffness", 0.0)), number(spring.get("damping", 0.0)))
            self.act(self.rates, w, form)
        for load in loads:
            w = self.direction((load["on"], "frame"))
            form = arb_mat(1, self.size)
            form[0, self.one] = -number(load.get("value", 0.0))
            if load.get("amplitude", 0.0):
                form = form - self.sine(load["amplitude"], load["angular_frequency"], load.get("phase", 0.0))
            self.act(self.rates, w, form)
        self.start = arb_mat(self.size, 1)
        for initial in groups("initial"):
            i = self.names.index(initial["on"])
            self.start[i, 0] = number(initial.get("displacement", 0.0))
            self.start[n + i, 0] = number(initial.get("velocity", 0.0))
        for c in range(self.one, self.size, 2):
            self.start[c if c == self.one else c - 1, 0] = 1
        for j in range(len(self.tones)):
            self.start[self.one + 1 + 2 * j, 0] = 1
            self.start[self.one + 2 + 2 * j, 0] = 0
        self.sides = [side for stop in stops for side in self.sides_of(stop)]

    def direction(self, between):
        w = [0] * self.n
        for name, sign in zip(between, (1, -1), strict=True):
            if name != "frame":
                w[self.names.index(name)] += sign
        return w

    def form(self, w, a, b):
        """The form a w.q + b w.q'."""
        found = arb_mat(1, self.size)
        for i in range(self.n):
            found[0, i], found[0, self.n + i] = a * w[i], b * w[i]
        return found

    def sine(self, amplitude, omega, degrees):
        found = arb_mat(1, self.size)
        c, angle = self.one + 1 + 2 * self.tones.index(omega), number(degrees) / 180
        found[0, c] = number(amplitude) * angle.sin_pi()
        found[0, c + 1] = number(amplitude) * angle.cos_pi()
        return found

    def act(self, rates, w, force):
        """Adds a force that is positive in tension."""
        for i in range(self.n):
            if w[i]:
                for j in range(self.size):
                    rates[self.n + i, j] -= w[i] * force[0, j] / self.mass[i]

    def sides_of(self, stop):
        w0 = self.direction(stop["between"])
        for sign in {"upper": (1,), "lower": (-1,), "both": (1, -1)}[stop.get("side", "upper")]:
            w = [sign * entry for entry in w0]
            depth = self.form(w, arb(1), arb(0))
            if stop.get("motion_amplitude", 0.0):
                motion = stop["motion_amplitude"], stop["motion_angular_frequency"], stop.get("motion_phase", 0.0)
                depth = depth - sign * self.sine(*motion)
            rate = self.form(w, arb(0), arb(1))
            if stop.get("motion_amplitude", 0.0):
                tones = arb_mat([[0] * (self.one + 1) + list(depth.table()[0][self.one + 1 :])])
                rate = rate + tones * self.tone_rates()
            depth[0, self.one] -= number(stop["clearance"])
            k, b = number(stop.get("stiffness", 0.0)), number(stop.get("damping", 0.0))
            force = k * depth + b * rate
            law = stop.get("law", "kelvin_voigt")
            if law == "switched_spring":
                force[0, self.one] += k * number(stop["clearance"])
            default = "zero_deformation" if law == "switched_spring" else "zero_force"
            parts = stop.get("separation", default) == "zero_force" and b > 0
            jumps = law == "switched_spring" and number(stop["clearance"]) > 0
            yield w, depth, force, parts, jumps

    def tone_rates(self):
        found = arb_mat(self.size, self.size)
        for j, omega in enumerate(self.tones):
            c = self.one + 1 + 2 * j
            found[c, c + 1], found[c + 1, c] = -number(omega), number(omega)
        return found


class Mode:
    """Branches: 0 open, 1 closed, 2 parting (in the wall without force)."""

    def __init__(self, machine, branches):
        self.branches, rates = branches, arb_mat(machine.rates)
        self.guards = []
        for i, (w, depth, force, parts, jumps) in enumerate(machine.sides):
            if branches[i] == 0:
                self.guards.append((-1 * depth, i, 1))
            elif branches[i] == 2:
                self.guards += [(-1 * force, i, 1), (depth, i, 0)]
            else:
                machine.act(rates, w, force)
                if parts:
                    self.guards.append((force, i, 2))
                if not parts or jumps:
                    self.guards.append((depth, i, 0))
        self.rates = rates
        plain = np.array([[float(entry) for entry in row] for row in rates.table()])
        fastest = max(abs(np.linalg.eigvals(plain)))
        self.step = number(2.0 ** np.floor(np.log2(0.25 / fastest)))
        self.map = middle((rates * self.step).exp())
        part = middle((rates * (self.step / PLACES)).exp())
        forms = arb_mat([list(guard[0].table()[0]) for guard in self.guards])
        self.forms = forms
        rows = []
        for _ in range(PLACES):
            forms = forms * part
            rows.append([[float(entry) for entry in row] for row in forms.table()])
        self.rows = np.array(rows)
        self.slopes = self.rows @ plain

    def moved(self, x, h):
        """The state h later, h within a step: a Taylor series."""
        total, term, k = arb_mat(x), arb_mat(x), 0
        size = max(abs(float(entry)) for row in x.table() for entry in row)
        while True:
            k += 1
            term = middle(self.rates * term * (h / k))
            total = total + term
            if k > 8 and max(abs(float(entry)) for row in term.table() for entry in row) < 1e-70 * size:
                return middle(total)


def follow(text, times):
    """States (times, 2 n), the sizes of displacements and velocities, the norm of the tangent map in these, events."""
    machine = Machine(text)
    n = machine.n
    modes = {}

    def mode_of(branches):
        if branches not in modes:
            modes[branches] = Mode(machine, branches)
        return modes[branches]

    x, t = machine.start, arb(0)
    branches = []
    for _, depth, force, parts, _ in machine.sides:
        inside = (depth * x)[0, 0] > 0
        branches.append(0 if not inside else 1 if not parts or (force * x)[0, 0] > 0 else 2)
    mode = mode_of(tuple(branches))
    tangent = arb_mat(machine.size, machine.size)
    for i in range(machine.size):
        tangent[i, i] = 1
    states, tangents, events = [], [], []
    k = 0
    while k < len(times):
        plain = np.array([float(entry) for row in x.table() for entry in row])
        values, slopes = mode.rows @ plain, mode.slopes @ plain
        h, who, found = mode.step, None, None
        for j in range(len(mode.guards)):
            below = np.flatnonzero(values[:, j] < 0)
            if below.size:
                place = below[0]
                left = arb(0) if place == 0 else mode.step * int(place) / PLACES
                right = mode.step * int(place + 1) / PLACES
                root = find(mode, j, x, left, right)
                if root is not None and (found is None or root < found):
                    who, found = j, root
            else:
                turn = np.flatnonzero((slopes[:-1, j] < 0) & (slopes[1:, j] > 0))
                for place in turn:
                    scale = abs(slopes[place, j]) * float(mode.step) / PLACES
                    if values[place, j] < scale or values[place + 1, j] < scale:
                        root = dip(mode, j, x, mode.step * int(place + 1) / PLACES, mode.step * int(place + 2) / PLACES)
                        if root is not None and (found is None or root < found):
                            who, found = j, root
        if found is not None:
            h = found
        end = t + h
        while k < len(times) and number(times[k]) < end:
            states.append(mode.moved(x, number(times[k]) - t))
            tangents.append((tangent, mode, number(times[k]) - t))
            k += 1
        if k == len(times):
            break
        if who is None:
            x, tangent = middle(mode.map * x), middle(mode.map * tangent)
            t = end.mid()
            continue
        step = middle((mode.rates * h).exp())
        x, tangent, t = mode.moved(x, h), middle(step * tangent), end.mid()
        form, side, after = mode.guards[who]
        branches = list(mode.branches)
        branches[side] = after
        new = mode_of(tuple(branches))
        jump = new.rates * x - mode.rates * x
        speed = (form * (mode.rates * x))[0, 0]
        tangent = middle(tangent + jump * (form * tangent) / speed)
        events.append((float(t), side, after))
        mode = new
        if len(events) > 20000:
            raise RuntimeError("events without end")
    plain = np.array([[float(s[i, 0]) for i in range(2 * n)] for s in states])
    size = np.abs(plain).max(axis=0)
    scale = np.concatenate([np.full(n, size[:n].max()), np.full(n, size[n:].max())])
    norms = []
    for tangent, its, h in tangents[:: max(1, len(tangents) // 60)]:
        full = its.rates * h
        full = full.exp() * tangent
        m = np.array([[float(full[i, j]) for j in range(2 * n)] for i in range(2 * n)])
        norms.append(np.linalg.norm(m * scale[None, :] / scale[:, None], 2))
    return plain, scale, max(1.0, max(norms)), events


def value(mode, form, x, h):
    return (form * mode.moved(x, h))[0, 0].mid()


def find(mode, j, x, left, right):
    """The root of a guard between two places, at the right of which it is negative."""
    form = mode.forms
    form = arb_mat([list(form.table()[j])])
    slope = form * mode.rates
    a, b = left, right
    if left == 0 and abs(value(mode, form, x, a)) < arb("1e-60"):
        # It starts on its bound: left at once if it falls, else after it has risen.
        if value(mode, slope, x, a) < 0:
            return arb(0)
        a = right / 2
        while value(mode, form, x, a) < 0:
            a, b = (a / 2).mid(), a
    elif value(mode, form, x, a) < 0:
        raise RuntimeError("left before")
    h = (a + b) / 2
    for _ in range(300):
        y = mode.moved(x, h)
        g, s = (form * y)[0, 0].mid(), (slope * y)[0, 0].mid()
        if g < 0:
            b = h
        else:
            a = h
        new = (h - g / s).mid() if s != 0 else (a + b) / 2
        if not (a < new < b):
            new = ((a + b) / 2).mid()
        if abs(new - h) < arb("1e-68") * (abs(h) + mode.step):
            return new
        h = new
    return h


def dip(mode, j, x, left, right):
    """The first root where a guard dips below 0 between two places, or nothing."""
    form = arb_mat([list(mode.forms.table()[j])])
    slope = form * mode.rates
    a, b = left, right
    for _ in range(200):
        h = ((a + b) / 2).mid()
        y = mode.moved(x, h)
        if (form * y)[0, 0] < 0:
            return find(mode, j, x, left, h)
        if (slope * y)[0, 0] < 0:
            a = h
        else:
            b = h
        if b - a < arb("1e-40") * mode.step:
            return None
    return None
