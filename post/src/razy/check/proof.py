"""The proof of one periodic motion: Krawczyk's operator on (state, times of events), admissibility, multipliers."""

import math
from dataclasses import dataclass, field

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, ctx

from razy.check.dual import Dual
from razy.check.exponential import ORDER
from razy.check.machine import NotCovered
from razy.check.motion import SLIDING, Guard, System, with_branch

MOST_EVENTS = 400
FLIGHT = 1e-6
"""A phase between two impacts of a contact so short that more and more will follow."""
TOGETHER = 1e-9
"""A phase between two events so short that a state that is stored does not say which comes first."""
NOTHING = 1e-20
"""A derivative of the state after a period that is smaller than this, in its norm, has no eigenvalues that matter."""
STIFF = 1000.0
"""Steps in a radian of the excitation, beyond which a proof would take minutes."""


POWERS = np.arange(ORDER)
BERNSTEIN = np.array([[math.comb(i, k) / math.comb(ORDER - 1, k) for k in POWERS] for i in POWERS])
"""A polynomial of this order lies between the least and the largest of these sums of its coefficients."""


def part(bits: float) -> arb:
    """Return 2 to the power of minus this part of the bits that are computed with."""
    return arb(2) ** (-int(bits * ctx.prec))


class Undecided(Exception):  # noqa: N818 - it is a verdict
    """What could be neither proved nor disproved."""


class Disproved(Exception):  # noqa: N818 - it is a verdict
    """A claim that is false."""


@dataclass
class Piece:
    """A smooth piece: its mode, the guard that ends it (none: a break of the excitation), its duration."""

    mode: tuple[str, ...]
    guard: Guard | None
    duration: float
    started: tuple[int, str] | None
    """Contact and bound whose event it begins with."""
    touched: bool = False
    """That event was a touch."""
    origin: str = ""
    """The branch of that contact before, if it is friction or rested; or that it was hit without restitution."""
    freed: tuple[int, ...] = ()
    """Frictions that begin to slide as a force has jumped."""
    after: int = 0
    """The break of the excitation that it lies after; 0: the beginning of the period."""

    def begins_with(self, guard: Guard) -> bool:
        """Return whether a guard is zero at the beginning."""
        slides = guard.contact in self.freed and guard.bound == "slip"
        return slides or self.started == (guard.contact, guard.bound)


@dataclass
class Proof:
    """What is proved of a motion."""

    state: list[arb]
    multipliers: list = field(default_factory=list)
    stable: bool | None = None
    events: int = 0
    radius: float = 0.0


@dataclass
class Look:
    """F and its derivative, the states at the beginnings of pieces, durations, the states each period later."""

    f: arb_mat
    df: arb_mat
    starts: list[arb_mat]
    durations: list[arb]
    strobes: list[list[arb]]


class Pieces:
    """Motions piece by piece: candidates by Taylor polynomials, and what keeps off its bounds for certain."""

    def __init__(self, system: System, scales: list[float]):
        """Take the scales of the displacements and velocities y."""
        self.system, self.scales = system, scales
        self.sizes = np.array(scales + [1.0] * (system.size - 2 * system.m))

    def after(self, piece: Piece, x: arb_mat) -> arb_mat:
        """Return the state after the event that ends a piece; at a break the excitation begins anew."""
        if piece.guard is None:
            return self.system.state([x[i, 0] for i in range(2 * self.system.m)], self.next_break(piece))
        if piece.guard.target != "impact":
            return x
        return self.system.impact(piece.guard.contact) * x

    def step(self, mode: tuple[str, ...]) -> float:
        """Return the length of a step over which Taylor polynomials are short."""
        flow = self.system.exponential(mode, self.sizes)
        if flow.norm > STIFF:
            raise NotCovered(f"a machine that is {flow.norm:.0e} times faster than its excitation")
        return flow.step

    def next_break(self, piece: Piece) -> int:
        """Return the break of the excitation that ends a piece."""
        return (piece.after + 1) % len(self.system.breaks)

    def next(self, piece: Piece, x: arb_mat) -> tuple[Piece, int]:
        """Return the beginning of the piece after another, x the state there, and how many more events there are.

        In files each friction that an impact turns round, or that a jump of a force sets free, is one.
        """
        if piece.guard is None:
            mode, freed = self.system.released(piece.mode, self.after(piece, x))
            return Piece(mode, None, 0.0, None, freed=freed, after=self.next_break(piece)), len(freed)
        guard, contact = piece.guard, self.system.machine.contacts[piece.guard.contact]
        if guard.target in ("line -1", f"line {len(contact.lines)}"):
            raise Disproved(f"it leaves the table of {contact.name}")
        mode = self.system.mode_after(piece.mode, guard, x)
        others = [a != b for i, (a, b) in enumerate(zip(piece.mode, mode, strict=True)) if i != guard.contact]
        turned = sum(others) if guard.target == "impact" else 0
        mode, freed = self.system.released(mode, self.after(piece, x))
        before = piece.mode[guard.contact]
        origin = before if contact.static is not None or before.endswith("closed") else ""
        if guard.target == "impact" and contact.restitution == 0:
            origin = "hit"
        started = guard.contact, guard.next_bound
        return Piece(mode, None, 0.0, started, origin=origin, freed=freed, after=piece.after), turned + len(freed)

    def order(self, piece: Piece, guard: Guard) -> int:
        """Return how many derivatives of a guard that is zero at the beginning are so, with itself.

        It has no rate at a touch, where friction breaks loose and after an impact without restitution, and no second
        one either where what rests is left.
        """
        if guard.contact in piece.freed:
            return 1
        contact = self.system.machine.contacts[guard.contact]
        if piece.origin.endswith("closed"):
            return 3
        flat = piece.touched or piece.origin == "hit"
        return 2 if flat or (piece.origin == "sticking" and contact.static == contact.kinetic) else 1

    def follow(self, piece: Piece, x: arb_mat, left: float) -> tuple[Guard | None, float, arb_mat]:
        """Return the guard that ends a piece which begins at x, if within `left`, its time and the state there.

        They are candidates, in double precision.
        """
        step, gone, x = self.step(piece.mode), 0.0, np.array([float(value) for value in x.entries()])
        flow, guards = self.system.exponential(piece.mode, self.sizes), self.system.guards(piece.mode)
        while True:
            states, forms = flow.candidates(x)
            most, first, time = min(1.0, (left - gone) / step), None, 2.0
            for guard, a in zip(guards, (forms.T * most**POWERS), strict=True):
                zero = self.order(piece, guard) if gone == 0 and piece.begins_with(guard) else 0
                root = _first_root(a[zero:])
                if root is not None and root < time:
                    first, time = guard, root
            x = (min(time, 1.0) * most) ** POWERS @ states
            if first is not None or gone + step >= left:
                time = gone + time * most * step if first is not None else left
                return first, time, arb_mat(x.size, 1, x.tolist())
            gone += step

    def keep_off(self, piece: Piece, x: arb_mat, duration: arb) -> None:
        """Show that every guard of a piece is positive inside it, zero only where its events are."""
        if not duration > 0:
            raise Undecided("two events are not told apart")
        if piece.origin in SLIDING and piece.mode[piece.started[0]] in SLIDING:
            stuck = with_branch(piece.mode, piece.started[0], "sticking")
            if self.system.passed(stuck, piece.started[0], x) != piece.mode[piece.started[0]]:
                raise Undecided("whether friction sticks where its speed changes sign")
        for i in piece.freed:
            if self.system.passed(with_branch(piece.mode, i, "sticking"), i, x) != piece.mode[i]:
                raise Undecided("whether friction sticks where a force jumps")
        stride, flow = self.step(piece.mode), self.system.exponential(piece.mode, self.sizes)
        steps = max(1, math.ceil(float(duration.upper()) / stride))
        for step in range(steps):
            h = arb(stride) if step < steps - 1 else duration - (steps - 1) * arb(stride)
            for guard, (a, rest) in zip(self.system.guards(piece.mode), flow.polynomials(x, h), strict=True):
                begins = step == 0 and piece.begins_with(guard)
                ends = step == steps - 1 and piece.guard is not None and same(piece.guard, guard)
                first = self.order(piece, guard) if begins else 0
                final = (2 if piece.guard.target == "touch" else 1) if ends else 0
                name = self.system.machine.contacts[guard.contact].name
                _positive(Watched(a, rest, h, name), arb(0), h, first, final)
            if step < steps - 1:
                x = flow.stride * x


class Course(Pieces):
    """A sequence of pieces over `periods` periods of the excitation, found from a state and then proved."""

    def __init__(self, system: System, y: list[arb], periods: int):
        """Compute the motion from y by Taylor polynomials, to find the sequence: a candidate, no proof."""
        m, self.periods = system.m, periods
        scale = max(abs(float(v.mid())) for v in y[:m]) or 1.0
        super().__init__(system, [scale] * m + [max(*(abs(float(v.mid())) for v in y[m:]), scale)] * m)
        self.pieces: list[Piece] = []
        self.start = x = system.state(y)
        piece, turned = Piece(system.mode_at(x, stored=True), None, 0.0, None), 0
        for after in [*range(len(system.breaks))] * periods:
            left = float(system.span(after))
            while True:
                guard, duration, x = self.follow(piece, x, left)
                piece.guard, piece.duration = guard, duration
                self.pieces.append(piece)
                if len(self.pieces) > MOST_EVENTS:
                    raise NotCovered(f"more than {MOST_EVENTS} events")
                if guard is not None and guard.target == "impact" and piece.begins_with(guard) and duration < FLIGHT:
                    raise NotCovered(f"impacts on {system.machine.contacts[guard.contact].name} that accumulate")
                left, before = left - duration, piece
                piece, more = self.next(before, x)
                x, turned = self.after(before, x), turned + more
                if guard is None:
                    break
        self.end = x.entries()
        self.events = sum(piece.guard is not None for piece in self.pieces)
        self.changes = self.events + turned

    @property
    def shortest(self) -> float:
        """The duration of the shortest piece that ends with an event."""
        return min((piece.duration for piece in self.pieces if piece.guard is not None), default=math.inf)

    def distance(self, one: list[arb], two: list[arb]) -> float:
        """Return the largest difference of displacements and velocities y, over the scales."""
        return max(float(abs(a - b).upper()) / scale for a, b, scale in zip(one, two, self.scales, strict=False))

    def unknowns(self, y: list[arb]) -> arb_mat:
        """Return (y, times of events), each counted from the last break of the excitation."""
        times, time = [], 0.0
        for piece in self.pieces:
            time += piece.duration
            if piece.guard is None:
                time = 0.0
            else:
                times.append(arb(time))
        return arb_mat(len(y) + len(times), 1, [*y, *times])

    def equations(self, u: arb_mat, system: System | None = None) -> Look:
        """Return F(u) and what belongs to it; dF has a last column by the parameter if the system is one of duals."""
        system, n = system or self.system, 2 * self.system.m
        total, dual = u.nrows(), isinstance(system.free, Dual)
        x = system.state([u[i, 0] for i in range(n)])
        d = arb_mat(system.size, total + dual)
        for i in range(n):
            d[i, i] = arb(1)
        f, df = arb_mat(total, 1), arb_mat(total, total + dual)
        event, begun, before = n, arb(0), None
        starts, durations, strobes = [], [], []
        for piece in self.pieces:
            end = system.span(piece.after) if piece.guard is None else u[event, 0]
            tau = end - begun
            starts.append(x)
            durations.append(tau)
            x, d = _apply(system.exponential(piece.mode, self.sizes).at(tau), x, d)
            g = system.generator(piece.mode)
            speed = (g.value if dual else g) * x
            for column, sign in ((before, -1), (None if piece.guard is None else event, 1)):
                for i in range(system.size) if column is not None else ():
                    d[i, column] += sign * speed[i, 0]
            if piece.guard is None:
                begun, before, following = arb(0), None, self.next_break(piece)
                y = [x[i, 0] for i in range(n)]
                strobes += [y] * (following == 0)
                x = system.state(y, following)
                for i in range(n, system.size):
                    for j in range(total + dual):
                        d[i, j] = arb(0)
                continue
            value, gradient = _apply(system.form(piece.mode, piece.guard), x, d)
            f[event, 0] = value[0, 0]
            for j in range(total + dual):
                df[event, j] = gradient[0, j]
            if piece.guard.target == "impact":
                x, d = _apply(system.impact(piece.guard.contact), x, d)
            begun, before, event = end, event, event + 1
        for i in range(n):
            f[i, 0] = x[i, 0] - u[i, 0]
            for j in range(total + dual):
                df[i, j] = d[i, j] - (1 if i == j else 0)
        return Look(f, df, starts, durations, strobes)

    def prove(self, y: list[arb]) -> Proof:
        """Prove that one motion with this sequence exists near y, and what follows."""
        scales = self.scales + [1.0] * self.events
        u = newton(self._zero, self.unknowns(y), scales)
        box = arb_mat(u.nrows(), 1, [arb(u[i, 0], part(0.63) * s) for i, s in enumerate(scales)])
        look = self.equations(box)
        image = krawczyk(self.equations(u).f, look.df, u, box)
        self.admit(look, box)
        return proof_of(look, image, self)

    def sway(self, y: list[arb]) -> float:
        """Return by how much what is left of the equations at y moves the motion, both over the scales; no proof."""
        df = self.equations(self.unknowns(y)).df
        inverse = np.linalg.inv(np.array([float(x) for x in df.entries()]).reshape(df.nrows(), -1))
        sizes = np.array(self.scales + [max(self.scales)] * self.events)
        return float(np.max((abs(inverse) @ sizes)[: len(y)] / sizes[: len(y)]))

    def _zero(self, u: arb_mat) -> tuple[arb_mat, arb_mat]:
        look = self.equations(u)
        return look.f, look.df

    def admit(self, look: Look, box: arb_mat) -> None:
        """Show that every guard is positive over each piece and that the period is the least."""
        try:
            for piece, start, duration in zip(self.pieces, look.starts, look.durations, strict=True):
                self.keep_off(piece, start, duration)
        except Disproved:
            if self.shortest < TOGETHER:
                raise Undecided("which of two events comes first") from None
            raise
        for j in range(1, self.periods):
            if self.periods % j == 0 and all(x.overlaps(box[i, 0]) for i, x in enumerate(look.strobes[j - 1])):
                raise Disproved(f"its period is not the least: it repeats after {j} of {self.periods} periods")


def same(one: Guard, two: Guard) -> bool:
    """Return whether two guards are of the same bound."""
    return one.contact == two.contact and one.bound == two.bound


def _first_root(a: np.ndarray) -> float | None:
    """Return the first root in (0, 1] of a polynomial that falls through zero there."""
    if min(BERNSTEIN[:, : a.size] @ a) > 0:
        return None
    if a[0] <= 0:
        return 1e-300
    found = real_roots(a, 1e-12)
    return float(found[0]) if found.size else None


def real_roots(a: np.ndarray, allowed: float) -> np.ndarray:
    """Return the roots in (0, 1] of a polynomial, with imaginary parts as far as they are allowed."""
    kept = np.nonzero(abs(a) >= 1e-19 * np.max(abs(a)))[0]
    roots = np.roots(a[: kept[-1] + 1][::-1]) if kept.size else np.zeros(0)
    return np.sort(roots[(abs(roots.imag) < allowed) & (roots.real > 0) & (roots.real <= 1)].real)


def _horner(a: list[arb], s: arb) -> arb:
    value = a[-1]
    for coefficient in reversed(a[:-1]):
        value = value * s + coefficient
    return value


class Watched:
    """A guard over a step of length h: a polynomial, its derivatives and bounds of what is left of each."""

    def __init__(self, a: list[arb], rest: arb, h: arb, name: str):
        self.name, self.forms, self.rest, self.h = name, [a], rest, h

    def __call__(self, order: int, s: arb) -> arb:
        """Return a derivative at s."""
        while len(self.forms) <= order:
            self.forms.append([k * c for k, c in enumerate(self.forms[-1])][1:])
        # Terms of order ORDER and beyond, each at most 1/16 of the one before.
        rest = self.rest * 2 * (ORDER + 2) ** order / self.h**order
        return _horner(self.forms[order], s) + arb(0, rest.upper())


def _positive(guard: Watched, low, high, first: int, final: int, depth: int = 0) -> None:
    """Show that a guard is positive over (low, high), but zero at an end with so many derivatives, itself counted."""
    middle, over = ((low + high) / 2).mid(), low.union(high)
    rate, there = guard(1, over), guard(0, middle)
    value = there + rate * (over - middle)
    if value > 0 or (first == 1 and rate > 0) or (final == 1 and rate < 0):
        return
    if max(first, final) > 1 and guard(max(first, final), over) > 0:
        return
    if value < 0 or (not first and not final and there < 0):
        raise Disproved(f"the motion passes through {guard.name}")
    if depth > 45:
        raise Undecided(f"within rounding of a grazing of {guard.name}")
    split = arb(middle)
    _positive(guard, low, split, first, 0, depth + 1)
    _positive(guard, split, high, 0, final, depth + 1)


def newton(equations, u: arb_mat, scales: list[float]) -> arb_mat:
    """Return a zero of equations(u) = (f, df), near u, to far beyond double precision."""
    for _ in range(12 + ctx.prec // 200):
        f, df = equations(u)
        try:
            change = df.mid().solve(f.mid())
        except ZeroDivisionError:
            raise Undecided("the derivative is singular") from None
        u = (u - change).mid()
        # The next change would be about the square of it.
        if all(abs(change[i, 0]) < part(0.38) * s for i, s in enumerate(scales)):
            return u
    raise Undecided("Newton's method does not converge: a fold or a grazing is near")


def krawczyk(f: arb_mat, df: arb_mat, u: arb_mat, box: arb_mat) -> arb_mat:
    """Return the image of a box by Krawczyk's operator, which is in its interior: it holds one zero, and only one.

    f: at u, the middle of the box, so wide that it holds those of a family of equations; df: over the box.
    """
    try:
        inverse = df.mid().inv().mid()
    except ZeroDivisionError:
        raise Undecided("the derivative is singular") from None
    identity = arb_mat(u.nrows(), u.nrows())
    for i in range(u.nrows()):
        identity[i, i] = arb(1)
    image = u - inverse * f + (identity - inverse * df) * (box - u)
    if not all(box[i, 0].contains_interior(image[i, 0]) for i in range(u.nrows())):
        raise Undecided("Krawczyk's operator does not map the box into itself: a fold or a grazing is near")
    return image


def _apply(form, x: arb_mat, d: arb_mat) -> tuple[arb_mat, arb_mat]:
    """Return a linear map of x and the derivatives of that."""
    if not isinstance(form, Dual):
        return form * x, form * d
    moved, by = form.value * d, form.slope * x
    for i in range(by.nrows()):
        moved[i, d.ncols() - 1] += by[i, 0]
    return form.value * x, moved


def monodromy(df: arb_mat, n: int) -> arb_mat:
    """Return the derivative of the state after a period by the state before it."""
    total = df.nrows()
    p = arb_mat(n, n, [df[i, j] + (1 if i == j else 0) for i in range(n) for j in range(n)])
    if total > n:
        by_time = arb_mat(n, total - n, [df[i, j] for i in range(n) for j in range(n, total)])
        events = arb_mat(total - n, total - n, [df[i, j] for i in range(n, total) for j in range(n, total)])
        by_state = arb_mat(total - n, n, [df[i, j] for i in range(n, total) for j in range(n)])
        p = p - by_time * events.solve(by_state)
    return p


def _eigenvalues(matrix: arb_mat) -> list[acb]:
    """Return balls that hold the eigenvalues."""
    try:
        with ctx.workprec(ctx.prec // 2):
            # The matrix has no more digits.
            return acb_mat(matrix).eig(multiple=True)
    except ValueError:
        # What rests forgets its state: none is apart from zero.
        size = sum((x * x for x in matrix.entries()), arb(0)).upper().sqrt().upper()
        if not size < NOTHING:
            raise
        return [acb(arb(0, size), arb(0, size))] * matrix.nrows()


def proof_of(look: Look, image: arb_mat, course: Course) -> Proof:
    """Return what follows from an enclosed motion: its multipliers, and whether all are within the unit circle."""
    n = len(course.scales)
    values = _eigenvalues(monodromy(look.df, n))
    sizes = [abs(value) for value in values]
    stable = True if all(s < 1 for s in sizes) else False if any(s > 1 for s in sizes) else None
    radius = max(float(image[i, 0].rad()) / s for i, s in enumerate(course.scales))
    return Proof([image[i, 0] for i in range(n)], values, stable, course.events, radius)
