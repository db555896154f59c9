"""The exponential of a mode, X(t + s) = exp(G s) X(t), and the Taylor polynomials of its guards."""

import math
from functools import cached_property
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx

from razy.check.dual import Dual

ORDER = 32
"""Terms of a Taylor polynomial of a guard."""
SHORT = 2.0**-2
"""The series is summed where G s is smaller than this; what is longer is squared."""
NEAR = 2.0**-9
"""Times whose difference times G is smaller than this are one after the other."""


class Exponential:
    """exp(G s), with a norm of G over weights w: |G^k| <= norm^k w_i/w_j."""

    def __init__(self, g: Any, sizes: np.ndarray, rows: list[arb_mat] | None = None):
        """Take G, as a matrix or a dual, the sizes of X, and the rows of the guards."""
        self.g, self.rows = g, rows or []
        value = g.value if isinstance(g, Dual) else g
        self.n = value.nrows()
        size = _sizes(value)
        # Perron's vector makes the norm least; all is positive, so that small components are as accurate as large ones.
        power = size * sizes / sizes[:, None] + 1e-3
        power = power / power.max() + np.eye(self.n)
        for _ in range(8):
            power = power @ power
            power /= power.max()
        self.weights = power.sum(axis=1) * sizes
        self.norm = _norm(value, self.weights)
        self.step = 2.0 / self.norm
        """Over this time Taylor polynomials are short."""
        self.one = arb_mat([[int(i == j) for j in range(self.n)] for i in range(self.n)])
        self._powers = [Dual(self.one, 0 * self.one) if isinstance(g, Dual) else self.one]
        self.known: list[tuple[arb, Any]] = []

    @cached_property
    def _rests(self) -> Any:
        """Return balls of w_i/w_j round zero, and of these times the norm of the slope of G."""
        w = self.weights
        balls = arb_mat(self.n, self.n, [arb(0, a / b * (1 + 1e-9)) for a in w for b in w])
        return Dual(balls, balls * arb(_norm(self.g.slope, w))) if isinstance(self.g, Dual) else balls

    def at(self, s: arb) -> Any:
        """Return exp(G s): that of a time near s that is known, times that of the difference."""
        for time, flow in self.known:
            if abs(s - time) * self.norm < NEAR:
                return flow if s.is_exact() and s == time else flow * self._squared(s - time)
        middle = s.mid()
        flow = self._squared(middle)
        self.known.append((middle, flow))
        return flow if s.is_exact() else flow * self._squared(s - middle)

    def _squared(self, s: arb) -> Any:
        """Return exp(G s), which without bound, as where Newton's method diverges, is no number."""
        size = self.norm * float(abs(s).upper())
        if not size < math.inf:
            return self.one * arb("nan")
        times = max(0, math.ceil(math.log2(size / SHORT))) if size > 0 else 0
        flow = self._sum(s / 2**times)
        for _ in range(times):
            flow = flow * flow
        return flow

    def _power(self, k: int) -> Any:
        """Return G^k/k!."""
        while len(self._powers) <= k:
            self._powers.append(self._powers[-1] * self.g * (arb(1) / len(self._powers)))
        return self._powers[k]

    def _sum(self, s: arb) -> Any:
        """Return the series for a short s, with what is left of it: at most that of the norm."""
        size = (arb(self.norm) * abs(s)).upper()
        count = 2 + int(ctx.prec / -math.log2(max(float(size), 1e-300)))
        tails = [(size**k / arb(k).fac() / (1 - size / (k + 1))).upper() for k in (count, count - 1)]
        if isinstance(self.g, Dual):
            flow = Dual(self._rests.value * tails[0], self._rests.slope * (tails[1] * abs(s)).upper()) + self.one
        else:
            flow = self._rests * tails[0] + self.one
        power = arb(1)
        for k in range(1, count):
            power = power * s
            flow = flow + self._power(k) * power
        return flow

    @cached_property
    def stride(self) -> Any:
        """Return exp(G s) over a step."""
        return self._squared(arb(self.step))

    @cached_property
    def _forms(self) -> arb_mat:
        """Return the matrix from X to the Taylor coefficients of all guards, one order after the other."""
        rows = arb_mat(len(self.rows), self.n, [x for row in self.rows for x in row.entries()])
        entries = [x for k in range(ORDER) for x in (rows * self._power(k)).entries()]
        return arb_mat(ORDER * len(self.rows), self.n, entries)

    @cached_property
    def _row_sizes(self) -> list[float]:
        """Return the sizes of the guards over the weights."""
        return [float(x) * (1 + 1e-9) for row in self.rows for x in _sizes(row) @ self.weights]

    def polynomials(self, x: arb_mat, h: arb) -> list[tuple[list[arb], arb]]:
        """Return of each guard the Taylor coefficients, x = X(t), and a bound of all terms from s^ORDER on, s <= h."""
        a, count = (self._forms * x).entries(), len(self.rows)
        size = max(float(abs(value).upper()) / w for value, w in zip(x.entries(), self.weights.tolist(), strict=True))
        most = (arb(self.norm) * abs(h)).upper()
        rest = arb(size) * most**ORDER / arb(ORDER).fac() / (1 - most / (ORDER + 1)) * (1 + 1e-9)
        return [(a[i::count], (rest * size).upper()) for i, size in enumerate(self._row_sizes)]

    @cached_property
    def _doubles(self) -> np.ndarray:
        """Return (G step)^k/k! in double precision."""
        g, powers = _doubles(self.g) * self.step, [np.eye(self.n)]
        for k in range(1, ORDER):
            powers.append(g @ powers[-1] / k)
        return np.array(powers)

    @cached_property
    def _double_rows(self) -> np.ndarray:
        return np.array([_doubles(row)[0] for row in self.rows]).reshape(-1, self.n)

    def candidates(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the Taylor coefficients of X and of the guards over parts of a step, without proof."""
        terms = self._doubles @ x
        return terms, terms @ self._double_rows.T


def _doubles(g: arb_mat) -> np.ndarray:
    return np.array([float(x) for x in g.entries()]).reshape(g.nrows(), g.ncols())


def _sizes(g: arb_mat) -> np.ndarray:
    return np.array([float(abs(x).upper()) for x in g.entries()]).reshape(g.nrows(), g.ncols())


def _norm(g: arb_mat, weights: np.ndarray) -> float:
    return float(np.max(_sizes(g) @ weights / weights)) * (1 + 1e-9)
