"""Makes data/press_events.txt: contact events of the press without weight, whose pallet starts at rest on its bars.

Without phase error both sides of the press move alike: three bodies on a line, left and right contacts taken together,
in numbers of 30 digits by mpmath (which nothing else here needs). The motion between two events is a sum of modes; a
gap is looked at in steps of 50 microseconds, at their ends and where its rate changes its sign, and its zero is found
by bisection.
"""

from pathlib import Path

import mpmath as mp

mp.mp.dps = 30
FREQUENCY, FORCE, K1, K3, KC, ALPHA, T_END = (
    mp.mpf(x) for x in ("47.5", "2e4", "8.956e7", "1e8", "2e7", "3e-4", "0.1")
)
MASS, STIFFNESS = (1020, 100, 425), (K1, mp.mpf(0), K3)
W, CLEARANCE = ((-1, 1, 0), (0, -1, 1), (0, 1, 0)), (mp.mpf("5e-5"), mp.mpf("1e-5"), mp.mpf(0))
OMEGA, STEP, ROUNDING = 2 * mp.pi * FREQUENCY, mp.mpf(1) / 20000, mp.mpf(10) ** -25


def gap(z, c):
    return CLEARANCE[c] + sum(W[c][i] * z[i] for i in range(3))


def rate(z, c):
    return sum(W[c][i] * z[3 + i] for i in range(3))


class Piece:
    """The motion from the state z at t with these contacts closed. A pallet without any contact flies on its own."""

    def __init__(self, closed, t, z):
        self.start, self.z, self.free = t, z, not any(closed)
        self.kept = [0, 2, 3, 5] if self.free else list(range(6))
        a, load = mp.matrix(6, 6), mp.matrix(6, 1)
        for i in range(3):
            a[i, 3 + i] = 1
            a[3 + i, i] = -STIFFNESS[i] / MASS[i]
            a[3 + i, 3 + i] = -ALPHA * STIFFNESS[i] / MASS[i]
            for c in range(3):
                if closed[c]:
                    load[3 + i] -= KC * CLEARANCE[c] * W[c][i] / MASS[i]
                    for j in range(3):
                        a[3 + i, j] -= KC * W[c][i] * W[c][j] / MASS[i]
        n = len(self.kept)
        a = mp.matrix([[a[i, j] for j in self.kept] for i in self.kept])
        load = mp.matrix([load[i] for i in self.kept])
        force = mp.matrix([mp.mpc(0)] * n)
        force[self.kept.index(3)] = FORCE * (FREQUENCY / 50) ** 2 / MASS[0]
        self.constant = mp.lu_solve(-a, load)
        self.phasor = mp.lu_solve(mp.mpc(0, OMEGA) * mp.eye(n) - a, force)
        self.exponent, self.mode = mp.eig(a)
        rest = [z[k] - self.constant[i] - mp.im(self.phasor[i] * mp.expj(OMEGA * t)) for i, k in enumerate(self.kept)]
        self.amplitude = mp.lu_solve(self.mode, mp.matrix(rest))

    def at(self, t):
        tau = t - self.start
        grown = [a * mp.exp(e * tau) for a, e in zip(self.amplitude, self.exponent, strict=True)]
        z = [self.z[0], self.z[1] + tau * self.z[4], self.z[2], self.z[3], self.z[4], self.z[5]]
        for i, k in enumerate(self.kept):
            modes = mp.re(sum(self.mode[i, j] * grown[j] for j in range(len(grown))))
            z[k] = self.constant[i] + mp.im(self.phasor[i] * mp.expj(OMEGA * t)) + modes
        return z


def bisect(inside, left, right):
    for _ in range(100):
        middle = (left + right) / 2
        if inside(middle):
            left = middle
        else:
            right = middle
    return right


def leaves(piece, closed, c, left, right, fresh):
    """Return the time in (left, right) at which contact c changes, or None; `fresh`: it has changed at `left`."""
    sign = -1 if closed[c] else 1
    z, end = piece.at(left), piece.at(right)
    if c == 2 and abs(end[1]) < ROUNDING:
        return None
    if sign * gap(end, c) >= 0:
        if not (sign * rate(z, c) < 0 < sign * rate(end, c)):
            return None
        right = bisect(lambda t: sign * rate(piece.at(t), c) < 0, left, right)
        if sign * gap(piece.at(right), c) >= 0:
            return None
    while fresh and sign * gap(piece.at(left), c) <= ROUNDING:
        left += (right - left) / 1000
    return bisect(lambda t: sign * gap(piece.at(t), c) >= 0, left, right)


def main():
    t, z, closed, last, lines = mp.mpf(0), [mp.mpf(0)] * 6, [False] * 3, None, []
    while t < T_END:
        piece, now, found = Piece(closed, t, z), t, []
        while now < T_END and not found:
            then = min(now + STEP, T_END)
            times = [(leaves(piece, closed, c, now, then, c == last and now == t), c) for c in range(3)]
            found = sorted(pair for pair in times if pair[0] is not None)
            now = then
        if not found:
            break
        t, last = found[0]
        z = piece.at(t)
        closed[last] = not closed[last]
        lines.append(f"{mp.nstr(t, 20)} {last + 1} {int(closed[last])}")
    (Path(__file__).parent.parent / "data" / "press_events.txt").write_text("\n".join([str(len(lines)), *lines]) + "\n")


if __name__ == "__main__":
    main()
