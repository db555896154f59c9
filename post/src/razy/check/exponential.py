"""The exponential of a mode, X(t + s) = exp(G s) X(t), from powers of G that are computed once."""

import math
from functools import cached_property
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx

from razy.check.dual import Dual

ORDER = 32
"""Terms of a Taylor polynomial of a guard."""
SHORT = 0.25
"""The sum of powers is taken where G s is smaller than this; what is longer is squared."""


class Exponential:
    """Powers G^k/k!, and a norm of G, over weights w: |G^k| <= norm^k w_i/w_j."""

    def __init__(self, g: Any, sizes: np.ndarray):
        """Take G, as a matrix or a dual, and the sizes of X."""
        self.g, self.dual = (g.value, True) if isinstance(g, Dual) else (g, False)
        self.slope = g.slope if self.dual else None
        self.n = self.g.nrows()
        self.known: dict[tuple, Any] = {}
        self._zero = arb_mat(self.n, self.n)
        size = _sizes(self.g)
        # Perron's vector makes the norm least; all is positive, so that small components are as accurate as large ones.
        power = size * sizes / sizes[:, None] + 1e-3
        power = power / power.max() + np.eye(self.n)
        for _ in range(8):
            power = power @ power
            power /= power.max()
        self.weights = power.sum(axis=1) * sizes
        self.norm = float(np.max(size @ self.weights / self.weights)) * (1 + 1e-9)
        self.step = 2.0 / self.norm

    @cached_property
    def powers(self) -> list[arb_mat]:
        """Return G^k/k! for k = 0 to ORDER, or as many as `at` needs."""
        return self._powers[0]

    @cached_property
    def _powers(self) -> tuple[list[arb_mat], list[arb_mat]]:
        one = arb_mat(self.n, self.n)
        for i in range(self.n):
            one[i, i] = arb(1)
        powers, slopes = [one], [self._zero]
        for k in range(1, max(ORDER, ctx.prec // 6) + 1):
            if self.dual:
                slopes.append((slopes[-1] * self.g + powers[-1] * self.slope) * (arb(1) / k))
            powers.append(powers[-1] * self.g * (arb(1) / k))
        return powers, slopes

    @cached_property
    def _columns(self) -> list[arb_mat]:
        """Return the powers, and their slopes, as columns of a matrix."""
        count = len(self.powers)
        return [
            arb_mat(count, self.n**2, [x for term in terms for x in term.entries()]).transpose()
            for terms in self._powers[: 1 + self.dual]
        ]

    @cached_property
    def _rests(self) -> list[arb_mat]:
        """Return balls of w_i/w_j round zero, and of these times the norm of the slope of G."""
        w = self.weights
        balls = arb_mat(self.n, self.n, [arb(0, a / b * (1 + 1e-9)) for a in w for b in w])
        return [balls, balls * arb(float(np.max(_sizes(self.slope) @ w / w)) * (1 + 1e-9))] if self.dual else [balls]

    @cached_property
    def stride(self) -> Any:
        """Return exp(G s) over a step, over which Taylor polynomials are short."""
        return self.at(arb(self.step))

    def form(self, row: arb_mat, order: int = ORDER) -> arb_mat:
        """Return the matrix from X to the Taylor coefficients of a linear form on it."""
        return arb_mat(order + 1, self.n, [x for power in self.powers[: order + 1] for x in (row * power).entries()])

    def size(self, row: arb_mat) -> arb:
        """Return the size of a linear form over the weights."""
        return sum((abs(x) * float(w) for x, w in zip(row.entries(), self.weights, strict=True)), arb(0))

    def rest(self, x: arb_mat, h: arb) -> arb:
        """Return a bound over the weights of all terms of X(t + s) from that of s^ORDER on, |s| <= h, x = X(t)."""
        term = self.powers[ORDER] * x
        size = max((abs(x) / w).upper() for x, w in zip(term.entries(), self.weights.tolist(), strict=True))
        ratio = arb(self.norm) * h / (ORDER + 1)
        return (size * abs(h) ** ORDER / (1 - ratio)).upper()

    def at(self, s: arb) -> Any:
        """Return exp(G s)."""
        middle = s.mid()
        key = middle.man_exp() if middle.is_finite() else None
        if key not in self.known:
            self.known[key] = self._squared(middle, len(self.powers))
        # The exponential of the middle has no width that could grow with the norm of G.
        return self.known[key] if s.is_exact() else self.known[key] * self._squared(s - middle, 3)

    def _squared(self, s: arb, count: int) -> Any:
        """Return exp(G s) from so many powers."""
        size = self.norm * float(abs(s).upper())
        times = max(0, math.ceil(math.log2(size / SHORT))) if 0 < size < math.inf else 0
        flow = self._sum(s / 2**times, count)
        for _ in range(times):
            flow = flow * flow
        return flow

    def _sum(self, s: arb, count: int) -> Any:
        """Return the sum of so many powers for a short s, with what is left: at most that of the norm."""
        over_s, size = [arb(1)], (arb(self.norm) * abs(s)).upper()
        # Without bound, as where Newton's method diverges, it is no number.
        size = size if size < 1 else arb("nan")
        for _ in range(1, count):
            over_s.append(over_s[-1] * s)
        tails = [size**k / arb(k).fac() / (1 - size / (k + 1)) for k in (count, count - 1)]
        tails[1] *= abs(s)
        sums = [rest * tail.upper() for rest, tail in zip(self._rests, tails, strict=False)]
        for i, terms in enumerate(self._powers[: len(sums)]):
            if count == len(terms):
                sums[i] += arb_mat(self.n, self.n, (self._columns[i] * arb_mat(count, 1, over_s)).entries())
            else:
                sums[i] += sum((term * x for term, x in zip(terms, over_s, strict=False)), self._zero)
        return Dual(*sums) if self.dual else sums[0]


def _sizes(g: arb_mat) -> np.ndarray:
    n = g.nrows()
    return np.array([float(abs(x).upper()) for x in g.entries()]).reshape(n, n)
