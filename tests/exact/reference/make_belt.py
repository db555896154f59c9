"""Limit cycle of the mass on a belt (source thesis) with 40 digits: period, time of sticking, largest displacement.

m = k = 1, belt speed 0.2, F_s = 1, mu(v)/mu_s = 1/(1 + 3|v|). Sliding starts at x = 1, v = 0.2, and ends when v = 0.2
again at x = x1; the belt carries the mass from there to x = 1 in (1 - x1)/0.2. While sliding v < 0.2:
v' = -x + 1/(1 + 3(0.2 - v)).
The motion of sliding is summed from its Taylor series of order 30.
"""

from decimal import Decimal, getcontext

getcontext().prec = 50
BELT, DELTA, ORDER = Decimal("0.2"), Decimal(3), 30


def series(x0, v0):
    """Taylor coefficients of x and v at a state, with r = 1/d, d = 1 + DELTA (BELT - v), from r d = 1."""
    x, v, r = [x0], [v0], []
    for n in range(ORDER):
        d = [1 + DELTA * (BELT - v[0])] + [-DELTA * c for c in v[1:]]
        rest = sum(d[k] * r[n - k] for k in range(1, n + 1))
        r.append(((1 if n == 0 else 0) - rest) / d[0])
        x.append(v[n] / (n + 1))
        v.append((-x[n] + r[n]) / (n + 1))
    return x, v


def value(coefficients, h):
    total = Decimal(0)
    for c in reversed(coefficients):
        total = total * h + c
    return total


def root(coefficients, level, high):
    """Where in [0, high] the series passes `level`, by bisection."""
    low, rising = Decimal(0), value(coefficients, high) > level
    for _ in range(150):
        middle = (low + high) / 2
        if (value(coefficients, middle) > level) == rising:
            high = middle
        else:
            low = middle
    return high


def main():
    h = Decimal(1) / 64
    t, x, v, top = Decimal(0), Decimal(1), BELT, None
    while True:
        cx, cv = series(x, v)
        next_v = value(cv, h)
        if top is None and v > 0 > next_v:
            top = value(cx, root(cv, Decimal(0), h))
        if t > 1 and next_v >= BELT:
            step = root(cv, BELT, h)
            t, x = t + step, value(cx, step)
            break
        t, x, v = t + h, value(cx, h), next_v
    sticking = (1 - x) / BELT
    for name, number in (("period", t + sticking), ("sticking", sticking), ("amplitude", top)):
        print(name, round(number, 25))


if __name__ == "__main__":
    main()
