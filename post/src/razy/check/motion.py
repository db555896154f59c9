"""A machine as linear pieces X' = G X over the phase of the excitation, X = (y, y', 1, cos t, sin t, cos 2t, ...).

y are the coordinates that are felt, ' the derivative by the phase t = Omega*time, so the period is 2 pi k exactly.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from flint import arb, arb_mat, fmpq

from razy.check.dual import Numbers, inverse
from razy.check.exponential import Exponential
from razy.check.machine import Contact, NotCovered, Tone, balls, common, felt, matrix, value_of

AT_REST = 1e-9
"""A speed of sliding smaller than this, over those of the bodies, is taken for none where a motion begins."""
SLIDING = ("forward", "backward")
"""Branches of friction that slides."""


@dataclass
class Guard:
    """A linear form on X that is positive as long as a branch lasts, and the branch after it."""

    contact: int
    row: Any
    target: str
    bound: str
    """What it is the bound of: a guard of the same bound is zero after the event."""

    @property
    def next_bound(self) -> str:
        """The bound of a guard that is zero after the event: of friction its speed, of what rests its gap."""
        return "slip" if self.bound in SLIDING else self.bound.removesuffix(" rest")


class System:
    """The pieces of a machine."""

    def __init__(self, numbers: Numbers, phase: float = 0.0):
        """Reduce the machine to what is felt, exactly, and lay out X; motions begin at this part of the period."""
        self.numbers, self.machine, self.phase = numbers, numbers.machines[0], Fraction(phase)
        machine = self.machine
        rows, seen = felt(numbers.machines)
        self.m, n = rows.nrows(), rows.ncols()
        self.base = common(machine.frequencies())
        self.omega = numbers(lambda m: value_of(common(m.frequencies())))
        self.harmonics = sorted({int(frequency / self.base[0]) for frequency, _ in machine.sines()})
        self.waves = [(wave, int(wave.frequency[0] / self.base[0])) for *_, wave in machine.waves]
        self.size = 2 * self.m + 1 + 2 * len(self.harmonics) + 2 * len(self.waves)
        starts = {(start - self.phase) % 1 for wave, times in self.waves for start, *_ in wave.repeated(times)}
        self.breaks = [*sorted(starts - {Fraction(0)}), Fraction(1)]
        self.rows, self.seen = rows, balls(seen * rows.transpose() * (rows * rows.transpose()).inv())
        right = balls(rows.transpose() * (rows * rows.transpose()).inv())

        def column(w: list[Fraction]) -> Any:
            return balls(matrix([w]).transpose())

        force = numbers.zeros(n, n)
        for i in range(n):
            force[i, i] = inverse(numbers(lambda m, i=i: m.mass[i]))
        force = balls(rows) * force
        stiffness = force * numbers.matrix(lambda m: m.stiffness) * right
        damping = force * numbers.matrix(lambda m: m.damping) * right
        constant = force * numbers.matrix(lambda m: [[x] for x in m.constant])
        m, per = self.m, inverse(self.omega)
        self.per_square = per * per
        on_loads = [force * column(w) for w, _ in machine.loads]
        g = numbers.zeros(self.size, self.size)
        for i in range(m):
            g[i, m + i] = 1
            for j in range(m):
                g[m + i, j] = -1 * (stiffness[i, j] * self.per_square)
                g[m + i, m + j] = -1 * (damping[i, j] * per)
            g[m + i, 2 * m] = constant[i, 0] * self.per_square
            for number, (_, tone) in enumerate(machine.loads):
                c, by_body = self.column(tone), on_loads[number][i, 0] * self.per_square
                g[m + i, c] = g[m + i, c] + by_body * numbers(lambda m, j=number: m.loads[j][1].cosine)
                g[m + i, c + 1] = g[m + i, c + 1] + by_body * numbers(lambda m, j=number: m.loads[j][1].sine)
        for i, k in enumerate(self.harmonics):
            c = 2 * m + 1 + 2 * i
            g[c, c + 1], g[c + 1, c] = -k, k
        for number, (w, _, wave) in enumerate(machine.waves):
            c, by_load = self.size - 2 * (len(self.waves) - number), force * column(w)
            for i in range(m):
                by_body = by_load[i, 0] * self.per_square
                g[m + i, c] = g[m + i, c] + by_body * numbers(lambda m, j=number: m.waves[j][1])
            g[c, c + 1] = 1
            if wave.half_sine is not None:
                bend = self.waves[number][1] / wave.half_sine / 2
                g[c + 1, c] = -(arb(fmpq(bend.numerator, bend.denominator)) ** 2)
        self.free = g
        self.gap, self.rate, self.push = [], [], []
        for number, contact in enumerate(machine.contacts):
            w = balls(matrix([contact.w]))
            gap, on_y = numbers.zeros(1, self.size), w * right
            for j in range(m):
                gap[0, j] = on_y[0, j]
            for k, tone in enumerate(contact.tones):
                c = self.column(tone)
                gap[0, c] = gap[0, c] + numbers(lambda m, i=number, k=k: m.contacts[i].tones[k].cosine)
                gap[0, c + 1] = gap[0, c + 1] + numbers(lambda m, i=number, k=k: m.contacts[i].tones[k].sine)
            push = numbers.zeros(self.size, 1)
            on_rows = force * column(contact.w)
            for i in range(m):
                push[m + i, 0] = on_rows[i, 0]
            self.gap.append(gap)
            self.rate.append(gap * g)
            self.push.append(push)
        self.unit = numbers.zeros(1, self.size)
        self.unit[0, 2 * m] = 1
        self.generators: dict[tuple[str, ...], Any] = {}
        self.exponentials: dict[tuple[str, ...], Exponential] = {}
        self.holding: dict[tuple[str, ...], dict[int, Any]] = {}
        self.known_guards: dict[tuple[str, ...], list[Guard]] = {}

    def column(self, tone: Tone) -> int:
        """Return where the cosine of a tone stands in X."""
        return 2 * self.m + 1 + 2 * self.harmonics.index(int(tone.frequency[0] / self.base[0]))

    def span(self, after: int) -> arb:
        """Return the phase from a break of the excitation to the next; break 0 is the beginning of the motion."""
        part = self.breaks[after] - (self.breaks[after - 1] if after else 0)
        return 2 * arb.pi() * arb(fmpq(part.numerator, part.denominator))

    def state(self, y: list[arb], after: int = 0) -> arb_mat:
        """Return X after a break of the excitation."""
        part = (self.phase + (self.breaks[after - 1] if after else 0)) % 1
        x = arb_mat(self.size, 1)
        for i, value in enumerate(y):
            x[i, 0] = value
        x[2 * self.m, 0] = arb(1)
        for i, k in enumerate(self.harmonics):
            turn = 2 * k * part
            c = 2 * self.m + 1 + 2 * i
            x[c + 1, 0], x[c, 0] = arb.sin_cos_pi_fmpq(fmpq(turn.numerator, turn.denominator))
        for i, (wave, times) in enumerate(reversed(self.waves), 1):
            x[self.size - 2 * i, 0], x[self.size - 2 * i + 1, 0] = wave.at(part, times)
        return x

    @cached_property
    def to_felt(self) -> arb_mat:
        """Return the matrix from displacements to y."""
        return balls(self.rows)

    def force(self, contact: int, branch: str) -> Any:
        """Return the form of the force k (s - edge) + b s' of a closed contact, positive upwards in s."""
        upper, take = branch.startswith("upper"), self._of(contact)
        if branch.startswith("line"):
            i = int(branch.split()[1])
            stiffness, number = take(lambda c: c.lines[i].stiffness), take(lambda c: c.lines[i].constant)
            damping = take(lambda c: c.lines[i].damping) * self.omega
            return self.gap[contact] * stiffness + self.rate[contact] * damping + self.unit * number
        if branch in SLIDING:
            number = take(lambda c: c.kinetic if branch == "forward" else -c.kinetic)
            return self.slip(contact) * take(lambda c: c.damping) + self.unit * number
        stiffness, damping = take(lambda c: c.stiffness), take(lambda c: c.damping)
        offset = take(lambda c: c.offset) if upper else -1 * take(lambda c: c.offset)
        number = offset - stiffness * take(lambda c: c.upper if upper else c.lower)
        return self.gap[contact] * stiffness + self.rate[contact] * (damping * self.omega) + self.unit * number

    def slip(self, contact: int) -> Any:
        """Return the form of the speed with which friction slides."""
        return self.rate[contact] * self.omega - self.unit * self._of(contact)(lambda c: c.belt)

    def generator(self, mode: tuple[str, ...]) -> Any:
        """Return G of a mode."""
        if mode not in self.generators:
            g = self.free
            for i, branch in enumerate(mode):
                if branch in ("upper", "lower", *SLIDING) or branch.startswith("line"):
                    g = g - self.push[i] * self.force(i, branch) * self.per_square
            self.holding[mode] = holding = self._holding(mode, g)
            for i, force in holding.items():
                g = g - self.push[i] * force * self.per_square
            self.generators[mode] = g
        return self.generators[mode]

    def _holding(self, mode: tuple[str, ...], g: Any) -> dict[int, Any]:
        """Return the forms of the forces of what sticks or rests on a rigid stop, by Gauss-Jordan: no s'' changes."""
        stuck = [i for i, branch in enumerate(mode) if branch == "sticking" or branch.endswith("closed")]
        rows = [self.rate[i] * g for i in stuck]
        a = [[(self.rate[i] * self.push[j])[0, 0] * self.per_square for j in stuck] for i in stuck]
        for k in range(len(stuck)):
            pivot = inverse(a[k][k])
            a[k], rows[k] = [x * pivot for x in a[k]], rows[k] * pivot
            for j in range(len(stuck)):
                if j != k:
                    factor = a[j][k]
                    a[j] = [x - factor * y for x, y in zip(a[j], a[k], strict=True)]
                    rows[j] = rows[j] - rows[k] * factor
        return dict(zip(stuck, rows, strict=True))

    def over(self, contact: int, side: str) -> Any:
        """Return the form of the deformation of a side, positive when it is pressed."""
        edge = self._of(contact)(lambda c: c.upper if side == "upper" else c.lower)
        form = self.gap[contact] - self.unit * edge
        return form if side == "upper" else -1 * form

    def _of(self, contact: int) -> Any:
        return lambda get: self.numbers(lambda machine: get(machine.contacts[contact]))

    def guards(self, mode: tuple[str, ...]) -> list[Guard]:
        """Return the guards of a mode."""
        if mode not in self.known_guards:
            self.known_guards[mode] = self._guards(mode)
        return self.known_guards[mode]

    def form(self, mode: tuple[str, ...], guard: Guard) -> Any:
        """Return what is zero at the event of a guard, of this or another system: at a touch, the guard's rate."""
        row = next(one.row for one in self.guards(mode) if (one.contact, one.bound) == (guard.contact, guard.bound))
        return row * self.generator(mode) if guard.target == "touch" else row

    def _guards(self, mode: tuple[str, ...]) -> list[Guard]:
        result = []
        for i, branch in enumerate(mode):
            c = self.machine.contacts[i]
            if branch.startswith("line"):
                number = int(branch.split()[1])
                low, high = c.lines[number].low, c.lines[number].high
                if low is not None:
                    edge = self._of(i)(lambda c, k=number: c.lines[k].low)
                    form = self.gap[i] - self.unit * edge
                    result.append(Guard(i, form, f"line {number - 1}", f"edge {number}"))
                if high is not None:
                    edge = self._of(i)(lambda c, k=number: c.lines[k].high)
                    form = self.unit * edge - self.gap[i]
                    result.append(Guard(i, form, f"line {number + 1}", f"edge {number + 1}"))
                continue
            if branch in SLIDING:
                form = self.slip(i)
                result.append(Guard(i, form if branch == "forward" else -1 * form, "sticking", "slip"))
                continue
            if branch == "sticking":
                self.generator(mode)
                force, limit = self.holding[mode][i], self.unit * self._of(i)(lambda c: c.static)
                result += [
                    Guard(i, limit - force, "forward", "forward"),
                    Guard(i, limit + force, "backward", "backward"),
                ]
                continue
            if branch == "open":
                target = "impact" if c.restitution is not None else ""
                sides = [side for side, edge in (("upper", c.upper), ("lower", c.lower)) if edge is not None]
                result += [Guard(i, -1 * self.over(i, side), target or side, side) for side in sides]
                continue
            side = branch.split()[0]
            if branch.endswith("closed"):
                self.generator(mode)
                force = self.holding[mode][i]
                result.append(Guard(i, force if side == "upper" else -1 * force, "open", f"{side} rest"))
                continue
            outward = self.force(i, side) if side == "upper" else -1 * self.force(i, side)
            if branch.endswith("parting"):
                result += [Guard(i, -1 * outward, side, "force"), Guard(i, self.over(i, side), "open", side)]
            elif c.zero_force:
                result.append(Guard(i, outward, f"{side} parting", "force"))
                if c.offset:
                    result.append(Guard(i, self.over(i, side), "open", side))
            else:
                result.append(Guard(i, self.over(i, side), self.beyond(c, side), side))
        return result

    def mode_after(self, mode: tuple[str, ...], guard: Guard, x: arb_mat) -> tuple[str, ...]:
        """Return the mode after an event; friction that comes to rest at x slides on if its limit is passed."""
        if guard.target == "impact":
            after = self._mode_after_impact(mode, self.impact(guard.contact), x)
            return after if self.machine.contacts[guard.contact].restitution else self._resting(after, guard, x)
        before, after = mode[guard.contact], with_branch(mode, guard.contact, guard.target)
        if guard.target == "sticking":
            passed = self.passed(after, guard.contact, x)
            if passed == before:
                raise ValueError(f"{self.machine.contacts[guard.contact].name} comes to rest against its friction")
            after = with_branch(mode, guard.contact, passed or "sticking")
        return after

    def released(self, mode: tuple[str, ...], x: arb_mat) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Return the mode without frictions that cannot stick at the state x, as a force has jumped, and these."""
        freed: tuple[int, ...] = ()
        while True:
            passed = [(i, self.passed(mode, i, x)) for i, branch in enumerate(mode) if branch == "sticking"]
            first = next(((i, branch) for i, branch in passed if branch), None)
            if first is None:
                return mode, freed
            mode, freed = with_branch(mode, *first), (*freed, first[0])

    def _mode_after_impact(self, mode: tuple[str, ...], jump: arb_mat, x: arb_mat) -> tuple[str, ...]:
        """Return the mode after an impact, which changes speeds of sliding; that these go that way is proved later."""
        after = jump * x
        for i, contact in enumerate(self.machine.contacts):
            if contact.static is not None:
                slip = self.slip(i)
                if not all(change.contains(0) for change in (slip * jump - slip).entries()):
                    mode = with_branch(mode, i, "forward" if (slip * after)[0, 0] > 0 else "backward")
            moved = (self.rate[i] * jump - self.rate[i]).entries() if mode[i].endswith("closed") else []
            if not all(change.contains(0) for change in moved):
                raise NotCovered(f"an impact that {contact.name} has a part in, which rests")
        return mode

    def _resting(self, mode: tuple[str, ...], guard: Guard, x: arb_mat) -> tuple[str, ...]:
        """Return the mode after an impact without restitution: closed, if pressed, which is proved later, or open."""
        closed = with_branch(mode, guard.contact, f"{guard.bound} closed")
        return mode if self.passed(closed, guard.contact, self.impact(guard.contact) * x) else closed

    def passed(self, mode: tuple[str, ...], contact: int, x: arb_mat) -> str:
        """Return where friction that sticks in a mode slides as its limit is passed, if that is certain."""
        guards = [guard for guard in self.guards(mode) if guard.contact == contact]
        return next((guard.target for guard in guards if (guard.row * x)[0, 0] < 0), "")

    @staticmethod
    def beyond(contact: Contact, side: str) -> str:
        """Return the branch after a side is left at zero deformation."""
        if contact.upper is not None and contact.upper == contact.lower:
            return "lower" if side == "upper" else "upper"
        return "open"

    def mode_at(self, x: arb_mat, stored: bool = False) -> tuple[str, ...]:
        """Return the mode at the beginning of the motion, where it is beyond doubt.

        A periodic motion is `stored` to rounding, and so sticks; the proof of one that slides in between says that it
        does so exactly, and one that never slides has no motion alone in its neighbourhood.
        """
        mode = []
        for i, c in enumerate(self.machine.contacts):
            branch = "open"
            if c.static is not None:
                slip = (self.slip(i) * x)[0, 0]
                y = [abs(x[j, 0]) + abs(x[self.m + j, 0]) for j in range(self.m)]
                size = sum(abs(self.gap[i][0, j]) * y[j] for j in range(self.m)) * self.omega
                at_rest = slip.contains(0) or (stored and abs(slip) <= AT_REST * (size + float(abs(c.belt))))
                branch = "sticking" if at_rest else "forward" if slip > 0 else "backward"
            if c.lines:
                s = (self.gap[i] * x)[0, 0]
                edges = [arb(fmpq(line.low.numerator, line.low.denominator)) for line in c.lines[1:]]
                if not all(s < edge or s > edge for edge in edges):
                    raise NotCovered(f"the bound of {c.name} is touched where the motion begins")
                branch = f"line {sum(bool(s > edge) for edge in edges)}"
            for side, edge in (("upper", c.upper), ("lower", c.lower)):
                if edge is None:
                    continue
                over = (self.over(i, side) * x)[0, 0]
                if stored and c.restitution == 0 and self._rests(i, over, x):
                    branch = f"{side} closed"
                elif over > 0:
                    if c.restitution is not None:
                        raise ValueError(f"the motion lies beyond the rigid stop {c.name} where it begins")
                    branch = side
                    outward = (self.force(i, side) * x)[0, 0] * (1 if side == "upper" else -1)
                    if c.zero_force and not outward > 0:
                        branch = f"{side} parting"
                elif not over < 0:
                    raise NotCovered(f"the bound of {c.name} is touched where the motion begins")
            mode.append(branch)
        return tuple(mode)

    def _rests(self, contact: int, over: arb, x: arb_mat) -> bool:
        """Return whether gap and speed of a contact are none but for rounding."""
        y = [abs(x[j, 0]) for j in range(2 * self.m)]
        gap, speed = (sum(abs(self.gap[contact][0, j]) * y[k + j] for j in range(self.m)) for k in (0, self.m))
        at_rest = abs((self.rate[contact] * x)[0, 0]) <= AT_REST * (speed + gap)
        return bool(at_rest) and bool(abs(over) <= AT_REST * (speed + gap))

    def impact(self, contact: int) -> Any:
        """Return X+ = J X-: the velocity over the gap is reversed by the restitution."""
        e = self.machine.contacts[contact].restitution
        moved = self.numbers.zeros(self.size, 1)
        for i in range(self.m):
            moved[i, 0] = self.push[contact][self.m + i, 0]
        share = (self.gap[contact] * moved)[0, 0]
        back = -1 - arb(fmpq(e.numerator, e.denominator))
        jump = self.push[contact] * self.rate[contact] * (back * inverse(share))
        for i in range(self.size):
            jump[i, i] = jump[i, i] + 1
        return jump

    def exponential(self, mode: tuple[str, ...], sizes: np.ndarray) -> Exponential:
        """Return exp(G s) of a mode; sizes: those of X, by which its powers are bounded."""
        if mode not in self.exponentials:
            rows = [] if self.numbers.slopes else [guard.row for guard in self.guards(mode)]
            self.exponentials[mode] = Exponential(self.generator(mode), sizes, rows)
        return self.exponentials[mode]


def with_branch(mode: tuple[str, ...], contact: int, branch: str) -> tuple[str, ...]:
    """Return a mode with another branch of a contact."""
    return (*mode[:contact], branch, *mode[contact + 1 :])
