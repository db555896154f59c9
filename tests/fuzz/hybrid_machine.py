"""A lumped machine as the second opinion of follow.py sees it: matrices, contacts, and its motion within a mode.

Nothing here is taken from the library. In one mode of the contacts x' = A x with x = (q, q', 1, cos w t, sin w t, ...),
so that a step is a product with exp(A h), h a power of two times the longest step. What ends a mode are linear forms
g x, which must not become negative.
"""

import f90nml
import numpy as np
from scipy.linalg import expm

OPEN, STICK = 0, 0


def listed(value):
    return value if isinstance(value, list) else [value]


class Machine:
    """Matrices of an input of kind 'lumped', with masses, springs, dampers, loads, stops and friction."""

    def __init__(self, text):
        nml = f90nml.Parser().reads(text)

        def groups(name):
            return [dict(group) for group in listed(nml.get(name, []))]

        masses = groups("mass")
        self.names = [mass["name"] for mass in masses]
        n = self.n = len(masses)
        self.mass = np.array([mass["value"] for mass in masses])
        stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
        for spring in groups("spring") + groups("damper"):
            w = self.direction(spring["between"])
            k = spring.get("stiffness", 0.0)
            stiffness += k * np.outer(w, w)
            damping += (spring.get("damping", 0.0) + spring.get("damping_factor", 0.0) * k) * np.outer(w, w)
        loads, stops, frictions = groups("load"), groups("stop"), groups("friction")
        tones = [load["angular_frequency"] for load in loads if load.get("amplitude", 0.0)]
        tones += [stop["motion_angular_frequency"] for stop in stops if stop.get("motion_amplitude", 0.0)]
        self.tones = sorted(set(tones))
        size = self.size = 2 * n + 1 + 2 * len(self.tones)
        self.one = 2 * n
        self.free = np.zeros((size, size))
        self.free[:n, n : 2 * n] = np.eye(n)
        self.free[n : 2 * n, :n] = -stiffness / self.mass[:, None]
        self.free[n : 2 * n, n : 2 * n] = -damping / self.mass[:, None]
        for i, omega in enumerate(self.tones):
            c = self.one + 1 + 2 * i
            self.free[c, c + 1], self.free[c + 1, c] = -omega, omega
        for load in loads:
            i = self.names.index(load["on"])
            force = self.constant(load.get("value", 0.0))
            if load.get("amplitude", 0.0):
                force += self.sine(load["amplitude"], load["angular_frequency"], load.get("phase", 0.0))
            self.free[n + i] += force / self.mass[i]
        self.start = np.zeros(size)
        for initial in groups("initial"):
            i = self.names.index(initial["on"])
            self.start[i] = initial.get("displacement", 0.0)
            self.start[n + i] = initial.get("velocity", 0.0)
        self.start[self.one] = 1.0
        self.start[self.one + 1 :: 2] = 1.0
        self.t_end = nml["motion"]["t_end"]
        self.interval = groups("record")[0]["interval"]
        self.contacts = [Stop(self, stop) for stop in stops] + [Friction(self, friction) for friction in frictions]
        names = [contact.name for contact in self.contacts]
        for contact in self.contacts[len(stops) :]:
            contact.with_stop = names.index(contact.only_with) if contact.only_with else None
        self.reach = max([abs(stop.get("clearance", 0.0)) for stop in stops] + [1e-6])

    def direction(self, between):
        w = np.zeros(self.n)
        for name, sign in zip(between, (1.0, -1.0), strict=True):
            if name != "frame":
                w[self.names.index(name)] += sign
        return w

    def constant(self, value):
        form = np.zeros(self.size)
        form[self.one] = value
        return form

    def sine(self, amplitude, omega, degrees):
        form = np.zeros(self.size)
        c = self.one + 1 + 2 * self.tones.index(omega)
        angle, quarter = np.radians(degrees % 90.0), int(degrees // 90.0)
        # Turned by quarters, so that sines of 0, 180 and 360 degrees are 0.
        sine, cosine = ((np.sin(angle), np.cos(angle)), (np.cos(angle), -np.sin(angle)))[quarter % 2]
        sign = 1.0 if quarter % 4 < 2 else -1.0
        form[c : c + 2] = sign * amplitude * sine, sign * amplitude * cosine
        return form

    def forms(self, w):
        """s and s' of a direction."""
        s, rate = np.zeros(self.size), np.zeros(self.size)
        s[: self.n] = w
        rate[self.n : 2 * self.n] = w
        return s, rate

    def push(self, x, w, amount):
        """Velocities after an impulse."""
        x[self.n : 2 * self.n] += w * amount / self.mass


class Stop:
    def __init__(self, machine, given):
        self.name, self.law = given["name"], given.get("law", "kelvin_voigt")
        self.w = machine.direction(given["between"])
        self.s, self.rate = machine.forms(self.w)
        if given.get("motion_amplitude", 0.0):
            motion = given["motion_amplitude"], given["motion_angular_frequency"], given.get("motion_phase", 0.0)
            self.s = self.s - machine.sine(*motion)
            self.rate = self.s @ machine.free
        self.rigid = self.law == "rigid"
        self.signs = {"upper": (1,), "lower": (-1,), "both": (1, -1)}[given.get("side", "upper")]
        self.one = machine.constant(1.0)
        self.clearance = given["clearance"]
        self.restitution = given.get("restitution", 0.0)
        # What is held between two edges in one place cannot bounce.
        if len(self.signs) == 2 and self.clearance == 0:
            self.restitution = 0.0
        self.stiffness, self.damping = given.get("stiffness", 0.0), given.get("damping", 0.0)
        self.jump = self.stiffness * self.clearance if self.law == "switched_spring" else 0.0
        default = "zero_deformation" if self.law == "switched_spring" else "zero_force"
        self.parts = given.get("separation", default) == "zero_force" and self.damping > 0
        self.friction = False

    def depth(self, sign):
        """The deformation of a side, a form."""
        return sign * self.s - self.clearance * self.one

    def pressed(self, sign):
        """The force of a side, positive in compression."""
        return self.stiffness * self.depth(sign) + self.damping * sign * self.rate + self.jump * self.one

    def bounds(self, branch):
        """What must not become negative in a compliant branch, and which follows: (form, next branch)."""
        if branch == OPEN:
            return [(-self.depth(sign), (sign, "closed")) for sign in self.signs]
        sign, kind = branch
        if kind == "parting":
            return [(-self.pressed(sign), (sign, "closed")), (self.depth(sign), OPEN)]
        ends = []
        if self.parts:
            ends.append((self.pressed(sign), (sign, "parting")))
        if not self.parts or self.jump > 0:
            ends.append((self.depth(sign), OPEN))
        return ends


class Friction:
    def __init__(self, machine, given):
        self.name = given["name"]
        self.w = machine.direction(given["between"])
        _, self.rate = machine.forms(self.w)
        self.rate = self.rate - machine.constant(given.get("belt_speed", 0.0))
        load, static = given["normal_load"], given["static_coefficient"]
        self.most, self.sliding = static * load, given.get("kinetic_coefficient", static) * load
        self.only_with = given.get("only_with")
        self.friction, self.rigid = True, False


class Mode:
    """The motion while no contact changes: a branch for each: of rigid stops 0 or the closed side."""

    def __init__(self, machine, branches):
        n, contacts = machine.n, machine.contacts
        self.branches, self.held = branches, []
        rates = machine.free.copy()
        for i, contact in enumerate(contacts):
            branch = branches[i]
            force = None
            if contact.friction:
                acts = contact.with_stop is None or is_closed(branches[contact.with_stop])
                if acts and branch == STICK:
                    self.held.append(i)
                elif acts:
                    force = machine.constant(branch * contact.sliding)
            elif contact.rigid:
                if branch != OPEN:
                    self.held.append(i)
            elif branch != OPEN and branch[1] == "closed":
                force = branch[0] * contact.pressed(branch[0])
            if force is not None:
                rates[n : 2 * n] -= np.outer(contact.w / machine.mass, force)
        self.unheld = rates.copy()
        self.force = {}
        if self.held:
            w = np.array([contacts[i].w for i in self.held])
            compliance = w / machine.mass @ w.T
            wanted = np.array([contacts[i].rate @ rates for i in self.held])
            forces = np.linalg.pinv(compliance, rcond=1e-10) @ wanted
            rates[n : 2 * n] -= (w / machine.mass).T @ forces
            self.force = dict(zip(self.held, forces, strict=True))
        self.rates = rates
        self.guards = []
        for i, contact in enumerate(contacts):
            branch = branches[i]
            if contact.friction:
                if i in self.force:
                    limit = machine.constant(contact.most)
                    self.guards += [(limit - self.force[i], i, 1), (limit + self.force[i], i, -1)]
                elif branch != STICK and (contact.with_stop is None or is_closed(branches[contact.with_stop])):
                    self.guards.append((branch * contact.rate, i, STICK))
            elif contact.rigid:
                if branch != OPEN:
                    self.guards.append((branch * self.force[i], i, OPEN))
                else:
                    self.guards += [(-contact.depth(sign), i, sign) for sign in contact.signs]
            else:
                self.guards += [(form, i, after) for form, after in contact.bounds(branch)]
        forms = np.array([guard[0] for guard in self.guards]).reshape(len(self.guards), machine.size)
        self.forms = np.stack([forms, forms @ rates, forms @ rates @ rates, forms @ rates @ rates @ rates])
        values = np.linalg.eigvals(rates)
        self.speeds = sorted(zip(np.abs(values), values.real, strict=True), reverse=True)
        fastest = max(self.speeds[0][0], 1e-3)
        self.longest = 2.0 ** np.floor(
            np.log2(0.25 / max(min((s for s, _ in self.speeds if s > 0), default=0.0), 1e-3))
        )
        self.longest = min(self.longest, 2.0 ** np.floor(np.log2(machine.t_end)))
        self.shortest = 0.25 / fastest
        self.maps = {}
        self.scale = np.ones(machine.size)
        self.scale[n : 2 * n] = fastest
        self.scale[machine.one :] = 1.0 / machine.reach

    def move(self, x, level):
        """The state 2^-level of the longest step later."""
        if level not in self.maps:
            h = self.longest * 2.0**-level
            balanced = expm(h * self.rates * self.scale / self.scale[:, None])
            self.maps[level] = balanced * self.scale[:, None] / self.scale
        return self.maps[level] @ x

    def level(self, since):
        """The longest step that no term outruns which is still felt."""
        rate = max((speed for speed, real in self.speeds if real * since > -45), default=1.0)
        return max(0, int(np.ceil(np.log2(max(rate, 1e-3) * self.longest / 0.25))))


def is_closed(branch):
    return branch != OPEN and (not isinstance(branch, tuple) or branch[1] == "closed")
