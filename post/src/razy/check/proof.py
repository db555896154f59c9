"""The proof of one periodic motion: Krawczyk's operator on (state, times of events), admissibility, multipliers."""

from dataclasses import dataclass, field

import numpy as np
from flint import acb_mat, arb, arb_mat

from razy.check.machine import NotCovered
from razy.check.motion import ORDER, Guard, System

RADIUS = arb(10) ** -40
"""Half the side of the box of the proof, over the scales of the unknowns."""
MOST_EVENTS = 400


class Undecided(Exception):  # noqa: N818 - it is a verdict
    """What could be neither proved nor disproved."""


class Disproved(Exception):  # noqa: N818 - it is a verdict
    """A claim that is false."""


@dataclass
class Piece:
    """A smooth piece: its mode, the guard that ends it (none: a period of the excitation is over), its duration."""

    mode: tuple[str, ...]
    guard: Guard | None
    duration: float
    started: tuple[int, str] | None
    """Contact and bound whose event it begins with."""


@dataclass
class Proof:
    """What is proved of a motion."""

    state: list[arb]
    multipliers: list = field(default_factory=list)
    stable: bool | None = None
    events: int = 0
    radius: float = 0.0


class Course:
    """A sequence of pieces over `periods` periods of the excitation, found from a state and then proved."""

    def __init__(self, system: System, y: list[arb], periods: int):
        """Compute the motion from y by Taylor polynomials, to find the sequence: a candidate, no proof."""
        self.system, self.periods = system, periods
        m = system.m
        self.scales = [max(abs(float(v.mid())) for v in y[:m]) or 1.0] * m
        self.scales += [max(max(abs(float(v.mid())) for v in y[m:]), self.scales[0])] * m
        weights = np.array(self.scales + [1.0] * (system.size - 2 * m))
        self.weights = weights
        self.norms: dict[tuple[str, ...], float] = {}
        self.pieces: list[Piece] = []
        x, started = system.state(y), None
        mode = system.mode_at(x)
        period = 2 * arb.pi()
        for _ in range(periods):
            left = period
            while True:
                guard, duration, x = self._follow(mode, x.mid(), left, started)
                self.pieces.append(Piece(mode, guard, float(duration.mid()), started))
                if guard is None:
                    started = None
                    break
                if len(self.pieces) > MOST_EVENTS:
                    raise NotCovered(f"more than {MOST_EVENTS} events")
                left = left - duration
                started = (guard.contact, guard.bound)
                if guard.target == "impact":
                    x = system.impact(guard.contact) * x
                    if system.machine.contacts[guard.contact].restitution == 0:
                        raise NotCovered("an impact without restitution, after which the contact may rest")
                else:
                    mode = (*mode[: guard.contact], guard.target, *mode[guard.contact + 1 :])
        self.events = sum(piece.guard is not None for piece in self.pieces)

    def step(self, mode: tuple[str, ...]) -> float:
        """Return the length of a step over which Taylor polynomials are short."""
        return 1.0 / self._norm(mode)

    def _norm(self, mode: tuple[str, ...]) -> float:
        if mode not in self.norms:
            g = self.system.generator(mode)
            n = g.nrows()
            w = self.weights
            sizes = [[float(abs(g[i, j]).upper()) * w[j] / w[i] for j in range(n)] for i in range(n)]
            self.norms[mode] = max(map(sum, sizes)) * (1 + 1e-9)
        return self.norms[mode]

    def _follow(self, mode, x, left, started):
        """Return the guard that ends the piece from x, if within `left`, its time and the state there."""
        guards, gone = self.system.guards(mode), arb(0)
        while True:
            terms = self.system.taylor(mode, x)
            h = min(self.step(mode), float((left - gone).mid()))
            first, time = None, 2.0
            for guard in guards:
                a = [float((guard.row * term)[0, 0].mid()) * h**k for k, term in enumerate(terms)]
                zero = started == (guard.contact, guard.bound) and gone == 0
                root = _first_root(a[1:] if zero else a)
                if root is not None and root < time:
                    first, time = guard, root
            if first is not None:
                s = arb(time * h)
                return first, gone + s, _value(terms, s)
            rest = (left - gone).mid()
            if h >= float(rest):
                return None, left, _value(terms, rest)
            x, gone = _value(terms, arb(h)).mid(), gone + h

    def unknowns(self, y: list[arb]) -> arb_mat:
        """Return (y, times of events), each counted from the last period of the excitation."""
        times, time = [], 0.0
        for piece in self.pieces:
            time += piece.duration
            if piece.guard is None:
                time = 0.0
            else:
                times.append(arb(time))
        return arb_mat(len(y) + len(times), 1, [*y, *times])

    def equations(self, u: arb_mat):
        """Return F(u), dF/du, the states at the beginnings of pieces, durations and the states each period later."""
        system, n = self.system, 2 * self.system.m
        total = u.nrows()
        x = system.state([u[i, 0] for i in range(n)])
        d = arb_mat(system.size, total)
        for i in range(n):
            d[i, i] = arb(1)
        f, df = arb_mat(total, 1), arb_mat(total, total)
        event, begun, before = n, arb(0), None
        starts, durations, strobes = [], [], []
        for piece in self.pieces:
            g = system.generator(piece.mode)
            end = 2 * arb.pi() if piece.guard is None else u[event, 0]
            tau = end - begun
            starts.append(x)
            durations.append(tau)
            phi = (g * tau).exp()
            speed = g * (phi * x)
            x, d = phi * x, phi * d
            for i in range(system.size):
                if before is not None:
                    d[i, before] -= speed[i, 0]
                if piece.guard is not None:
                    d[i, event] += speed[i, 0]
            if piece.guard is None:
                begun, before = arb(0), None
                strobes.append([x[i, 0] for i in range(n)])
                x = system.state(strobes[-1])
                for i in range(n, system.size):
                    for j in range(total):
                        d[i, j] = arb(0)
                continue
            f[event, 0] = (piece.guard.row * x)[0, 0]
            gradient = piece.guard.row * d
            for j in range(total):
                df[event, j] = gradient[0, j]
            if piece.guard.target == "impact":
                jump = system.impact(piece.guard.contact)
                x, d = jump * x, jump * d
            begun, before, event = end, event, event + 1
        for i in range(n):
            f[i, 0] = x[i, 0] - u[i, 0]
            for j in range(total):
                df[i, j] = d[i, j] - (1 if i == j else 0)
        return f, df, starts, durations, strobes

    def prove(self, y: list[arb]) -> Proof:
        """Prove that one motion with this sequence exists near y, and what follows."""
        n = 2 * self.system.m
        u = self.unknowns(y)
        scales = self.scales + [1.0] * self.events
        for _ in range(12):
            f, df, *_ = self.equations(u)
            try:
                change = df.mid().solve(f.mid())
            except ZeroDivisionError:
                raise Undecided("the derivative is singular") from None
            u = (u - change).mid()
            if all(abs(change[i, 0]) < 1e-45 * s for i, s in enumerate(scales)):
                break
        else:
            raise Undecided("Newton's method does not converge: a fold or a grazing is near")
        box = arb_mat(u.nrows(), 1, [arb(u[i, 0], RADIUS * s) for i, s in enumerate(scales)])
        f, *_ = self.equations(u)
        _, df, starts, durations, strobes = self.equations(box)
        inverse = df.mid().inv().mid()
        identity = arb_mat(u.nrows(), u.nrows())
        for i in range(u.nrows()):
            identity[i, i] = arb(1)
        image = u - inverse * f + (identity - inverse * df) * (box - u)
        if not all(box[i, 0].contains_interior(image[i, 0]) for i in range(u.nrows())):
            raise Undecided("Krawczyk's operator does not map the box into itself: a fold or a grazing is near")
        proof = Proof([image[i, 0] for i in range(n)], events=self.events)
        proof.radius = max(float(image[i, 0].rad()) / s for i, s in enumerate(self.scales))
        for piece, start, duration in zip(self.pieces, starts, durations, strict=True):
            self._admit(piece, start, duration)
        for j in range(1, self.periods):
            if self.periods % j == 0 and all(strobes[j - 1][i].overlaps(box[i, 0]) for i in range(n)):
                raise Disproved(f"its period is not the least: it repeats after {j} of {self.periods} periods")
        proof.multipliers, proof.stable = _multipliers(df, n)
        return proof

    def _admit(self, piece: Piece, x: arb_mat, duration: arb) -> None:
        """Show that every guard of a piece is positive inside it, zero only where its events are."""
        if not duration > 0:
            raise Undecided("two events are not told apart")
        guards = self.system.guards(piece.mode)
        steps = max(1, int(np.ceil(float(duration.upper()) / self.step(piece.mode))))
        h = duration / steps
        for step in range(steps):
            terms = self.system.taylor(piece.mode, x)
            rest = self._remainder(piece.mode, terms[-1], h)
            for guard in guards:
                a = [(guard.row * term)[0, 0] for term in terms[:-1]]
                last = sum((abs(guard.row[0, i]) * w for i, w in enumerate(self.weights)), arb(0)) * rest
                begins = step == 0 and piece.started == (guard.contact, guard.bound)
                ends = step == steps - 1 and piece.guard is not None and _same(piece.guard, guard)
                name = self.system.machine.contacts[guard.contact].name
                _positive(a, arb(0, last), arb(0), h, begins, ends, name, self._slope(last, piece.mode))
            x = _value(terms[:-1], h)
            for i in range(self.system.size):
                x[i, 0] += arb(0, arb(float(self.weights[i])) * rest)

    def _remainder(self, mode, term: arb_mat, h: arb) -> arb:
        """Return a bound, over the weights, of the sum of all terms from the last one on, at times up to h."""
        size = max((abs(term[i, 0]) / float(w)).upper() for i, w in enumerate(self.weights))
        ratio = arb(self._norm(mode)) * h / (ORDER + 1)
        return (size * abs(h) ** ORDER / (1 - ratio)).upper()

    def _slope(self, last: arb, mode) -> arb:
        """Return a bound of the derivative of the remainder by the time."""
        return arb(0, last * self._norm(mode) * (ORDER + 1) * 2)


def _same(one: Guard, two: Guard) -> bool:
    return one.contact == two.contact and one.bound == two.bound


def _value(terms: list[arb_mat], s: arb) -> arb_mat:
    """Return the Taylor polynomial at s."""
    x = terms[-1]
    for term in reversed(terms[:-1]):
        x = x * s + term
    return x


def _first_root(a: list[float]) -> float | None:
    """Return the first root in (0, 1] of a polynomial that falls through zero there."""
    if a[0] > sum(map(abs, a[1:])):
        return None
    largest = max(map(abs, a)) or 1.0
    while len(a) > 1 and abs(a[-1]) < 1e-19 * largest:
        a = a[:-1]
    if a[0] <= 0:
        return 1e-300
    roots = np.roots(a[::-1])
    real = np.sort(roots[(abs(roots.imag) < 1e-12) & (roots.real > 0) & (roots.real <= 1)].real)
    return float(real[0]) if real.size else None


def _horner(a: list[arb], s: arb) -> arb:
    value = a[-1]
    for coefficient in reversed(a[:-1]):
        value = value * s + coefficient
    return value


def _positive(a, rest, low, high, begins, ends, name, slope, depth=0) -> None:
    """Show that a polynomial plus its rest is positive over (low, high); zero at an end where an event is."""
    middle = ((low + high) / 2).mid()
    over = low.union(high)
    rate = _horner([k * c for k, c in enumerate(a)][1:], over) + slope
    value = _horner(a, middle) + rest + rate * (over - middle)
    if value > 0 or (begins and rate > 0) or (ends and rate < 0):
        return
    if value < 0 or (not begins and not ends and _horner(a, middle) + rest < 0):
        raise Disproved(f"the motion passes through {name}")
    if depth > 45:
        raise Undecided(f"within rounding of a grazing of {name}")
    split = arb(middle)
    _positive(a, rest, low, split, begins, False, name, slope, depth + 1)
    _positive(a, rest, split, high, False, ends, name, slope, depth + 1)


def _multipliers(df: arb_mat, n: int):
    """Return the enclosed Floquet multipliers and whether all are within the unit circle (None: undecided)."""
    total = df.nrows()
    p = arb_mat(n, n, [df[i, j] + (1 if i == j else 0) for i in range(n) for j in range(n)])
    if total > n:
        by_time = arb_mat(n, total - n, [df[i, j] for i in range(n) for j in range(n, total)])
        events = arb_mat(total - n, total - n, [df[i, j] for i in range(n, total) for j in range(n, total)])
        by_state = arb_mat(total - n, n, [df[i, j] for i in range(n, total) for j in range(n)])
        p = p - by_time * events.solve(by_state)
    values = acb_mat(p).eig(multiple=True)
    sizes = [abs(value) for value in values]
    stable = True if all(s < 1 for s in sizes) else False if any(s > 1 for s in sizes) else None
    return values, stable
