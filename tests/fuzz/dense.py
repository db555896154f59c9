"""All motions of few periods of an oscillator at one frequency: Newton's method from a dense grid of states.

Written apart from razy. All states go on together, those of a piecewise linear oscillator in closed form.
"""

import numpy as np

FAR = 1e3
SETTLED, SAME = 1e-9, 1e-6


class Lines:
    """x'' + c x' + k x = f + a sin(wt) with (k, c, f) for each interval between bounds, or up to a rigid stop."""

    steps = 60

    def __init__(self, lines, bounds, load, restitution=None):
        self.k, self.c, self.f = (np.array(column, float) for column in zip(*lines, strict=True))
        self.bounds, self.load, self.restitution = (
            np.array(bounds, float),
            load,
            restitution,
        )

    def starts(self, x):
        return np.full(x.shape, True) if self.restitution is None else x < self.bounds[0]

    def solve(self, line, w, t, x, v, dt):
        k, c, f = self.k[line], self.c[line], self.f[line]
        z = self.load / (k - w * w + 1j * w * c) * np.exp(1j * w * t)
        z1 = z * np.exp(1j * w * dt)
        rest = np.divide(f, k, out=np.zeros_like(f), where=k > 0)
        y, u = x - z.imag - rest, v - (1j * w * z).imag
        d = c / 2
        s = np.sqrt(np.maximum(k - d * d, 1e-300))
        decay, cos, sin = np.exp(-d * dt), np.cos(s * dt), np.sin(s * dt) / s
        held = (
            decay * (y * cos + (u + d * y) * sin),
            decay * (u * cos - (k * y + d * u) * sin),
        )
        # Without stiffness there is a mean speed in the place of a mean position.
        speed = np.divide(f, c, out=np.zeros_like(f), where=c > 0)
        path = np.divide(-np.expm1(-c * dt), c, out=dt + 0 * c, where=c > 0)
        free = (
            y + (u - speed) * path + speed * dt,
            (u - speed) * np.exp(-c * dt) + speed,
        )
        y, u = np.where(k > 0, held, free)
        return y + z1.imag + rest, u + (1j * w * z1).imag

    def room(self, line, x, v):
        """How far within the interval, and how fast that grows."""
        low = np.concatenate([[-np.inf], self.bounds])[line]
        high = np.concatenate([self.bounds, [np.inf]])[line]
        return np.minimum(x - low, high - x), np.where(x - low < high - x, v, -v)

    def time_of_bound(self, line, w, t, x, v, most):
        low, high, at = 0 * most, most, 0.5 * most
        for _ in range(60):
            room, slope = self.room(line, *self.solve(line, w, t, x, v, at))
            low, high = np.where(room < 0, low, at), np.where(room < 0, at, high)
            with np.errstate(divide="ignore", invalid="ignore"):
                new = at - room / slope
            new = np.where((new > low) & (new < high), new, 0.5 * (low + high))
            if np.all(np.abs(new - at) < 1e-15 / w):
                break
            at = new
        return at

    def flow(self, w, x, v, end, phase=0.0):
        """State after `end` periods, begun at `phase`, in periods; NaN where it is lost."""
        count = max(1, int(np.ceil(self.steps * (end - phase))))
        h = 2 * np.pi / w * (end - phase) / count
        x, v = x.copy(), v.copy()
        line = np.searchsorted(self.bounds, x) if self.restitution is None else np.zeros(x.shape, int)
        for i in range(count):
            t, left = (
                np.full(x.shape, 2 * np.pi / w * phase + i * h),
                np.full(x.shape, h),
            )
            going = np.flatnonzero(np.isfinite(x))
            for _ in range(60):
                x1, v1 = self.solve(line[going], w, t[going], x[going], v[going], left[going])
                out = self.room(line[going], x1, v1)[0] < 0
                x[going[~out]], v[going[~out]] = x1[~out], v1[~out]
                going = going[out]
                if not going.size:
                    break
                at = self.time_of_bound(line[going], w, t[going], x[going], v[going], left[going])
                x1, v1 = self.solve(line[going], w, t[going], x[going], v[going], at)
                if self.restitution is None:
                    x[going], v[going] = x1, v1
                    line[going] += np.where(v1 > 0, 1, -1)
                else:
                    x[going], v[going] = self.bounds[0], -self.restitution * np.abs(v1)
                t[going] += at
                left[going] -= at
            x[going] = np.nan
            x[np.abs(x) + np.abs(v) > FAR] = np.nan
        return x, v


class Cubic:
    """x'' + c x' + k x + b x**3 = a sin(wt), by the Runge-Kutta method of order 4."""

    steps = 400

    def __init__(self, k, b, c, load):
        self.k, self.b, self.c, self.load = k, b, c, load

    def starts(self, x):
        return np.full(x.shape, True)

    def flow(self, w, x, v, end, phase=0.0):
        def rate(x, v, t):
            return v, self.load * np.sin(w * t) - self.c * v - self.k * x - self.b * x**3

        count = max(1, int(np.ceil(self.steps * (end - phase))))
        h = 2 * np.pi / w * (end - phase) / count
        for i in range(count):
            t = 2 * np.pi / w * phase + i * h
            x1, v1 = rate(x, v, t)
            x2, v2 = rate(x + h / 2 * x1, v + h / 2 * v1, t + h / 2)
            x3, v3 = rate(x + h / 2 * x2, v + h / 2 * v2, t + h / 2)
            x4, v4 = rate(x + h * x3, v + h * v3, t + h)
            x, v = (
                x + h / 6 * (x1 + 2 * x2 + 2 * x3 + x4),
                v + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4),
            )
            lost = np.abs(x) + np.abs(v) > FAR
            x, v = np.where(lost, np.nan, x), np.where(lost, np.nan, v)
        return x, v


def newton(oscillator, w, x, v, k, box):
    """Where Newton's method from these states for motions of k periods ends, (2, ...)."""
    ends = [np.zeros((2, 0))]
    step = 1e-6
    u = np.stack([x, v])
    for _ in range(25):
        u = u[:, oscillator.starts(u[0]) & (np.abs(u).max(axis=0) < 20 * max(box))]
        if not u.size:
            break
        moved = u[:, None, :] + step * np.array([[0, 1, 0], [0, 0, 1]])[:, :, None]
        after = np.stack(oscillator.flow(w, *moved.reshape(2, -1), k)).reshape(2, 3, -1)
        residual = after[:, 0] - u
        matrix = np.moveaxis((after[:, 1:] - after[:, :1]) / step, 2, 0) - np.eye(2)
        good = np.isfinite(residual).all(axis=0) & np.isfinite(matrix).all(axis=(1, 2))
        good[good] &= np.abs(np.linalg.det(matrix[good])) > 1e-12
        u, residual = u[:, good], residual[:, good]
        change = -np.linalg.solve(matrix[good], residual.T[:, :, None])[:, :, 0].T
        length = np.hypot(*change)
        u = u + change * np.minimum(1, max(box) / np.maximum(length, 1e-300))
        done = (length < SETTLED) & (np.hypot(*residual) < 10 * SETTLED)
        ends.append(u[:, done])
        u = u[:, ~done]
    return np.concatenate(ends, axis=1)


def states_after(oscillator, w, state, k):
    """The states after 0 to k periods (k + 1, 2)."""
    states = [np.asarray(state)]
    for _ in range(k):
        states.append(np.concatenate(oscillator.flow(w, *states[-1][:, None], 1)))
    return np.array(states)


def motions(oscillator, w, box, most=4, grid=25):
    """The motions of up to `most` periods: the states after each of them (k, 2)."""
    x, v = (a.ravel() for a in np.meshgrid(*(np.linspace(-b, b, grid) for b in box)))
    found = []
    for k in range(1, most + 1):
        for end in newton(oscillator, w, x, v, k, box).T:
            states = states_after(oscillator, w, end, k - 1)
            if any(k % part == 0 and np.abs(states[part] - end).max() < SAME for part in range(1, k)):
                continue
            if not any(is_same(states, other) for other in found):
                found.append(states)
    return found


def is_same(one, other, near=SAME):
    """Whether two motions are one, perhaps begun some periods later."""
    return len(one) == len(other) and np.abs(one - other[0]).max(axis=1).min() < near
