"""A machine as linear pieces X' = G X over the phase of the excitation, X = (y, y', 1, cos t, sin t, cos 2t, ...).

y are the coordinates that are felt, ' the derivative by the phase t = Omega*time, so the period is 2 pi k exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, arb_mat, fmpq

from razy.check.dual import Dual, between, inverse
from razy.check.exponential import Exponential
from razy.check.machine import Machine, NotCovered, Tone, ball, balls, common, felt, matrix, value_of

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
    """The pieces of a machine, which may be a function of a parameter: then its matrices are duals."""

    def __init__(self, machines: list[Machine], phase: float = 0.0, beyond: arb | None = None, slopes: bool = False):
        """Reduce the machine to what is felt, exactly, and lay out X; motions begin at this part of the period.

        machines: one, or those of a `family`, of which that at `beyond` is meant.
        """
        self.machine, self.phase, self.dual = machines[0], Fraction(phase), slopes
        self.numbers = numbers = between(machines, beyond, slopes)
        machine = self.machine
        rows, seen = felt(machines)
        self.m, n = rows.nrows(), rows.ncols()
        self.base = common(machine.frequencies())
        self.omega = between([value_of(common(each.frequencies())) for each in machines], beyond, slopes)
        self.harmonics = sorted({int(frequency / self.base[0]) for frequency, _ in machine.sines()})
        self.waves = [(wave, int(wave.frequency[0] / self.base[0])) for *_, wave in machine.waves]
        self.size = 2 * self.m + 1 + 2 * len(self.harmonics) + 2 * len(self.waves)
        starts = {(start - self.phase) % 1 for wave, times in self.waves for start, *_ in wave.repeated(times)}
        self.breaks = [*sorted(starts - {Fraction(0)}), Fraction(1)]
        right = rows.transpose() * (rows * rows.transpose()).inv()
        self.rows, self.seen = rows, balls(seen * right)

        per_mass = self._zeros(n, n)
        for i, mass in enumerate(numbers.mass):
            per_mass[i, i] = inverse(mass * self.omega * self.omega)
        # y'' by forces on the bodies.
        per_force = balls(rows) * per_mass
        m, g = self.m, self._zeros(self.size, self.size)

        def add(to: Any, column: int, force: Any, factor: Any) -> None:
            for i in range(m):
                to[m + i, column] = to[m + i, column] + force[i, 0] * factor

        def by(w: list[Fraction]) -> Any:
            return per_force * balls(matrix([w]).transpose())

        stiffness = per_force * self._matrix(numbers.stiffness) * balls(right)
        damping = per_force * self._matrix(numbers.damping) * balls(right) * self.omega
        for i in range(m):
            g[i, m + i] = 1
            for j in range(m):
                g[m + i, j], g[m + i, m + j] = -1 * stiffness[i, j], -1 * damping[i, j]
        add(g, 2 * m, per_force * self._matrix([[x] for x in numbers.constant]), 1)
        for (w, tone), (_, number) in zip(machine.loads, numbers.loads, strict=True):
            add(g, self.column(tone), by(w), number.cosine)
            add(g, self.column(tone) + 1, by(w), number.sine)
        for i, k in enumerate(self.harmonics):
            c = 2 * m + 1 + 2 * i
            g[c, c + 1], g[c + 1, c] = -k, k
        for i, (w, _, wave) in enumerate(machine.waves):
            c = self.size - 2 * (len(self.waves) - i)
            add(g, c, by(w), numbers.waves[i][1])
            g[c, c + 1] = 1
            if wave.half_sine is not None:
                g[c + 1, c] = -(ball(self.waves[i][1] / wave.half_sine / 2) ** 2)
        self.free, self.gap, self.push = g, [], []
        for contact, number in zip(machine.contacts, numbers.contacts, strict=True):
            gap, on_y = self._zeros(1, self.size), balls(matrix([contact.w]) * right)
            for j in range(m):
                gap[0, j] = on_y[0, j]
            for tone, value in zip(contact.tones, number.tones, strict=True):
                c = self.column(tone)
                gap[0, c], gap[0, c + 1] = gap[0, c] + value.cosine, gap[0, c + 1] + value.sine
            push = self._zeros(self.size, 1)
            add(push, 0, by(contact.w), 1)
            self.gap.append(gap)
            self.push.append(push)
        self.rate = [gap * g for gap in self.gap]
        self.unit = self._zeros(1, self.size)
        self.unit[0, 2 * m] = 1
        self.generators: dict[tuple[str, ...], Any] = {}
        self.exponentials: dict[tuple[str, ...], Exponential] = {}
        self.holding: dict[tuple[str, ...], dict[int, Any]] = {}
        self.known_guards: dict[tuple[str, ...], list[Guard]] = {}

    def _zeros(self, rows: int, columns: int) -> Any:
        return Dual(arb_mat(rows, columns), arb_mat(rows, columns)) if self.dual else arb_mat(rows, columns)

    def _matrix(self, numbers: list[list[Any]]) -> Any:
        result = self._zeros(len(numbers), len(numbers[0]))
        for i, line in enumerate(numbers):
            for j, number in enumerate(line):
                result[i, j] = number
        return result

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

    def felt(self, state: Sequence[float]) -> list[arb]:
        """Return y of displacements and velocities of all bodies."""
        n = len(state) // 2
        q, rate = (balls(self.rows) * arb_mat(n, 1, [arb(float(x)) for x in part]) for part in (state[:n], state[n:]))
        return [*q.entries(), *(x / self.omega for x in rate.entries())]

    def force(self, contact: int, branch: str) -> Any:
        """Return the form of the force k s + b s' + constant of a line, or of friction that slides."""
        c = self.numbers.contacts[contact]
        if branch in SLIDING:
            return self.slip(contact) * c.viscous + self.unit * (c.kinetic * (1 if branch == "forward" else -1))
        line = c.lines[number_of(branch)]
        return (
            self.gap[contact] * line.stiffness
            + self.rate[contact] * (line.damping * self.omega)
            + (self.unit * line.constant)
        )

    def slip(self, contact: int) -> Any:
        """Return the form of the speed with which friction slides."""
        return self.rate[contact] * self.omega - self.unit * self.numbers.contacts[contact].belt

    def generator(self, mode: tuple[str, ...]) -> Any:
        """Return G of a mode."""
        if mode not in self.generators:
            g = self.free
            for i, branch in enumerate(mode):
                if branch in SLIDING or (branch.startswith("line") and not branch.endswith("parting")):
                    g = g - self.push[i] * self.force(i, branch)
            self.holding[mode] = holding = self._holding(mode, g)
            for i, force in holding.items():
                g = g - self.push[i] * force
            self.generators[mode] = g
        return self.generators[mode]

    def _holding(self, mode: tuple[str, ...], g: Any) -> dict[int, Any]:
        """Return the forms of the forces of what sticks or rests on a rigid stop, by Gauss-Jordan: no s'' changes."""
        stuck = [i for i, branch in enumerate(mode) if branch == "sticking" or branch.endswith("closed")]
        rows = [self.rate[i] * g for i in stuck]
        a = [[(self.rate[i] * self.push[j])[0, 0] for j in stuck] for i in stuck]
        for k in range(len(stuck)):
            pivot = inverse(a[k][k])
            a[k], rows[k] = [x * pivot for x in a[k]], rows[k] * pivot
            for j in range(len(stuck)):
                if j != k:
                    factor = a[j][k]
                    a[j] = [x - factor * y for x, y in zip(a[j], a[k], strict=True)]
                    rows[j] = rows[j] - rows[k] * factor
        return dict(zip(stuck, rows, strict=True))

    def inside(self, contact: int, line: int) -> list[tuple[str, Any]]:
        """Return the edges of a line with forms that are positive inside it."""
        low, high = self.numbers.contacts[contact].lines[line].low, self.numbers.contacts[contact].lines[line].high
        below = [] if low is None else [(f"edge {line}", self.gap[contact] - self.unit * low)]
        return below if high is None else [*below, (f"edge {line + 1}", self.unit * high - self.gap[contact])]

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
            contact = self.machine.contacts[i]
            if branch in SLIDING:
                result.append(Guard(i, self.slip(i) * (1 if branch == "forward" else -1), "sticking", "slip"))
            elif branch == "sticking":
                self.generator(mode)
                force, limit = self.holding[mode][i], self.unit * self.numbers.contacts[i].static
                result += [
                    Guard(i, limit - force, "forward", "forward"),
                    Guard(i, limit + force, "backward", "backward"),
                ]
            elif branch.endswith("closed"):
                self.generator(mode)
                edge, force = branch.removesuffix(" closed"), self.holding[mode][i]
                result.append(Guard(i, force if edge == "edge 1" else -1 * force, "line 0", f"{edge} rest"))
            else:
                line = number_of(branch)
                for edge, form in self.inside(i, line):
                    target = "impact" if contact.restitution is not None else f"line {2 * number_of(edge) - line - 1}"
                    result.append(Guard(i, form, target, edge))
                if sign := contact.lines[line].parts:
                    force, parting = self.force(i, f"line {line}"), branch.endswith("parting")
                    target = f"line {line}" + " parting" * (not parting)
                    result.append(Guard(i, force * (-sign if parting else sign), target, "force"))
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

    def mode_at(self, x: arb_mat, stored: bool = False) -> tuple[str, ...]:
        """Return the mode at the beginning of the motion, where it is beyond doubt.

        A periodic motion is `stored` to rounding, and so sticks; the proof of one that slides in between says that it
        does so exactly, and one that never slides has no motion alone in its neighbourhood.
        """
        mode = []
        for i, c in enumerate(self.machine.contacts):
            size = sum(abs(self.gap[i][0, j]) * (abs(x[j, 0]) + abs(x[self.m + j, 0])) for j in range(self.m))
            if c.static is not None:
                slip = (self.slip(i) * x)[0, 0]
                at_rest = stored and abs(slip) <= AT_REST * (size * self.omega + float(abs(c.belt)))
                mode.append("sticking" if at_rest or slip.contains(0) else SLIDING[not slip > 0])
                continue
            inside = [[(edge, (form * x)[0, 0]) for edge, form in self.inside(i, k)] for k in range(len(c.lines))]
            rests = [edge for edge, value in inside[0] if abs(value) <= AT_REST * size]
            if stored and c.restitution == 0 and rests and abs((self.rate[i] * x)[0, 0]) <= AT_REST * size:
                mode.append(f"{rests[0]} closed")
                continue
            if not all(value < 0 or value > 0 for edges in inside for _, value in edges):
                raise NotCovered(f"the bound of {c.name} is touched where the motion begins")
            if c.restitution is not None and not all(value > 0 for _, value in inside[0]):
                raise ValueError(f"the motion lies beyond the rigid stop {c.name} where it begins")
            # Whoever lies beyond a table leaves it at once.
            line = sum(bool(edges[0][1] > 0) for edges in inside[1:])
            branch = f"line {line}"
            parts = c.lines[line].parts
            mode.append(branch + " parting" * bool(parts and not (self.force(i, branch) * x)[0, 0] * parts > 0))
        return tuple(mode)

    def impact(self, contact: int) -> Any:
        """Return X+ = J X-: the velocity over the gap is reversed by the restitution."""
        push, rate = self.push[contact], self.rate[contact]
        jump = push * rate * (inverse((rate * push)[0, 0]) * -(1 + ball(self.machine.contacts[contact].restitution)))
        for i in range(self.size):
            jump[i, i] = jump[i, i] + 1
        return jump

    def exponential(self, mode: tuple[str, ...], sizes: np.ndarray) -> Exponential:
        """Return exp(G s) of a mode; sizes: those of X, by which its powers are bounded."""
        if mode not in self.exponentials:
            rows = [] if self.dual else [guard.row for guard in self.guards(mode)]
            self.exponentials[mode] = Exponential(self.generator(mode), sizes, rows)
        return self.exponentials[mode]


def with_branch(mode: tuple[str, ...], contact: int, branch: str) -> tuple[str, ...]:
    """Return a mode with another branch of a contact."""
    return (*mode[:contact], branch, *mode[contact + 1 :])


def number_of(branch: str) -> int:
    """Return the number of a line or edge."""
    return int(branch.split()[1])
