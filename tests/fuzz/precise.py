"""The motion of a lumped machine with compliant stops in 140 bits, with the norm of its tangent map.

Nothing here is taken from the library. The state is x = (q, q', 1, sines and cosines); in a mode x' = A x, and a step
is a product with exp(A h). What ends a mode are linear forms of x: their series over a step, and all its roots.
"""

import f90nml
import flint
import numpy as np
from flint import arb, arb_mat
from scipy.linalg import expm

flint.ctx.prec = 140
# Terms of a series that are looked at for roots, where it ends, and what is rounding of a root.
LOOKED_AT, TAIL, ROOT = 15, 1e-42, arb("1e-38")


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
            yield w, middle(depth), middle(force), parts, jumps

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
        self.plain = np.array([[float(entry) for entry in row] for row in rates.table()])
        fastest = max(abs(np.linalg.eigvals(self.plain)))
        self.step = number(2.0 ** np.floor(np.log2(0.25 / fastest)))
        self.map = middle((rates * self.step).exp())
        self.plain_map = np.array([[float(entry) for entry in row] for row in self.map.table()])
        self.forms = arb_mat([list(guard[0].table()[0]) for guard in self.guards])
        self.scaled = middle(rates * self.step)
        rows = [np.array([[float(entry) for entry in row] for row in self.forms.table()])]
        for k in range(1, LOOKED_AT):
            rows.append(rows[-1] @ self.plain * (float(self.step) / k))
        self.rows = np.array(rows)

    def terms(self, x):
        """The Taylor series of the state over the step."""
        terms = [x]
        size = max(abs(float(entry)) for row in x.table() for entry in row)
        while len(terms) < 8 or max(abs(float(entry)) for row in terms[-1].table() for entry in row) > TAIL * size:
            terms.append(middle(self.scaled * terms[-1] * (1 / arb(len(terms)))))
        return terms


def place(terms, s):
    """The state at a part of the step."""
    total = terms[-1]
    for term in terms[-2::-1]:
        total = total * s + term
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
    mode, left = mode_of(tuple(branches)), None
    tangent = np.eye(machine.size)
    states, tangents, events = [], [], []
    k = 0
    while k < len(times):
        terms, who, root = first_exit(mode, x, left)
        h = mode.step if who is None else mode.step * root
        end = t + h
        while k < len(times) and number(times[k]) < end:
            since = number(times[k]) - t
            states.append(place(terms or mode.terms(x), since / mode.step))
            tangents.append((tangent, mode, float(since)))
            k += 1
        t = end.mid()
        if k == len(times):
            break
        if who is None:
            x, tangent, left = middle(mode.map * x), mode.plain_map @ tangent, None
            continue
        x, tangent = place(terms, root), expm(mode.plain * float(h)) @ tangent
        form, side, after = mode.guards[who]
        branches = list(mode.branches)
        branches[side] = after
        new = mode_of(tuple(branches))
        speed = float((form * (mode.rates * x))[0, 0])
        jump = plain(new.rates * x - mode.rates * x)
        tangent = tangent + np.outer(jump, plain(form.transpose()) @ tangent) / speed
        events.append((float(t), side, after))
        mode, left = new, form
        if len(events) > 20000:
            raise RuntimeError("events without end")
    found = np.array([plain(state)[: 2 * n] for state in states])
    size = np.abs(found).max(axis=0)
    scale = np.concatenate([np.full(n, size[:n].max()), np.full(n, size[n:].max())])
    norms = []
    for tangent, its, h in tangents[:: max(1, len(tangents) // 60)]:
        m = (expm(its.plain * h) @ tangent)[: 2 * n, : 2 * n]
        norms.append(np.linalg.norm(m * scale[None, :] / scale[:, None], 2))
    return found, scale, max(1.0, max(norms)), events


def plain(column):
    return np.array([float(entry) for row in column.table() for entry in row])


def first_exit(mode, x, left):
    """Terms of the state if they were needed, the guard that is left first and at which part of the step."""
    rough = mode.rows @ plain(x)
    near = np.flatnonzero(rough[0] < 1.001 * np.abs(rough[1:]).sum(axis=0))
    if near.size == 0:
        return None, None, None
    terms, who, first = mode.terms(x), None, None
    for j in near:
        form = mode.guards[j][0]
        series = [(form * term)[0, 0].mid() for term in terms]
        # What was left last is a bound of the next branch from its other side.
        if left is not None and (form == left or form == -1 * left):
            series[0] = arb(0)
        root = exit_of(series)
        if root is not None and (first is None or root < first):
            who, first = int(j), root
    return terms, who, first


def exit_of(series):
    """The first place in (0, 1] after which a series is negative, or nothing, by all places where it turns."""
    start = 0
    while series[start] == 0:
        start += 1
    if start > 0 and series[start] < 0:
        return arb(0)
    series = flint.arb_poly(series[start:])
    numbers = np.array([float(series[k]) for k in range(min(series.length(), LOOKED_AT))])
    # The roots of the series turned round: the small ones keep their digits.
    turned = np.roots(numbers)
    turned = turned[turned != 0]
    roots = 1 / turned
    real = np.sort(roots.real[(np.abs(roots.imag) < 0.1 * np.abs(roots.real)) & (roots.real > 0) & (roots.real < 1)])
    places = np.concatenate([[0.0], real, [1.0]])
    looked = np.sort(np.concatenate([real, (places[1:] + places[:-1]) / 2, [1.0]]))
    before = arb(0)
    for here in looked:
        if series(arb(here)) < 0:
            return find(series, before, arb(here))
        before = arb(here)
    return None


def find(series, a, b):
    """The root of a series between two places, at the right of which it is negative."""
    slope, s = series.derivative(), (a + b) / 2
    for _ in range(400):
        g, rate = series(s).mid(), slope(s).mid()
        if g < 0:
            b = s
        else:
            a = s
        new = (s - g / rate).mid() if rate != 0 else a
        if not (a < new < b):
            new = ((a + b) / 2).mid()
        if abs(new - s) < ROOT * new:
            return new
        s = new
    return s
