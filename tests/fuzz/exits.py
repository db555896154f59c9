"""Where a motion leaves its mode: the first guard that becomes negative, by dyadic steps and bisection."""

import numpy as np
from own_motion import EPS, Motion

LEVELS = 60
# Roundings of a function that turns back at its bound, after many steps.
GRAZE = 256


class Exits(Motion):
    """The search for the first exit."""

    def at(self, mode, x, h):
        """The state h later, by dyadic steps."""
        level = 0
        while h > 0 and level < LEVELS:
            if h >= mode.longest * 2.0**-level:
                x = mode.move(x, level)
                h -= mode.longest * 2.0**-level
            else:
                level += 1
        return x

    def first_level(self, mode, x, armed, level):
        """Short first steps where a guard is about to come back."""
        for i in np.flatnonzero(~armed):
            g, rate, second, _ = mode.forms[:, i] @ x
            if rate > 0 and second < 0 and g <= -(rate**2) / second:
                flight = (rate + np.sqrt(max(rate**2 - 2 * g * second, 0.0))) / -second
                level = max(level, min(LEVELS - 12, int(np.ceil(np.log2(4 * mode.longest / flight)))))
        return level

    def first_exit(self, mode, x, after, level, armed):
        """(time, state, guards) where the first guard is left in a step; `armed` are those that have been inside."""
        forms, rates = mode.forms[0], mode.forms[1]
        start, end = forms @ x, forms @ after
        slope, last = rates @ x, rates @ after
        noise = 64 * EPS * (np.abs(forms) @ self.sizes(x, after))
        armed |= start > noise
        suspects = (end < -noise) | ((slope < 0) & (last > 0))
        # It may rise, fall and rise again, or fall, rise and fall.
        near = np.minimum(start, end) < mode.longest * 2.0**-level * np.maximum(np.abs(slope), np.abs(last))
        suspects |= near & ((slope < 0) | ((mode.forms[2] @ x < 0) & (mode.forms[2] @ after > 0)))
        for i in np.flatnonzero(~armed & ((start < -noise) | ((slope < 0) & (np.abs(start) <= noise)))):
            suspects[i] = True
        best = None
        for i in np.flatnonzero(suspects):
            found = self.leaves(mode, i, x, level, armed[i], noise[i], slope[i])
            if found is None:
                continue
            offset, state = found
            h = mode.longest * 2.0**-level
            if best is None or offset < best[0] - 4 * EPS * h:
                best = (offset, state, [i])
            elif abs(offset - best[0]) <= 4 * EPS * h:
                best[2].append(i)
        armed |= end > noise
        if best is None:
            return None
        # What is on its bound there as well is left with it.
        for i in range(len(mode.guards)):
            if i in best[2]:
                continue
            value, rate = forms[i] @ best[1], rates[i] @ best[1]
            if abs(value) <= self.noise(forms[i], best[1]) and rate < 0 and armed[i]:
                best[2].append(i)
        return best

    def leaves(self, mode, i, x, level, armed, noise, slope):
        """(time, state) where guard i becomes negative within a step, or None."""
        form, rate = mode.forms[0, i], mode.forms[1, i]
        parts = 3
        states, times = [x], [0.0]
        for _ in range(2**parts):
            states.append(mode.move(states[-1], level + parts))
            times.append(times[-1] + mode.longest * 2.0 ** -(level + parts))
        values = [form @ state for state in states]
        slopes = [rate @ state for state in states]
        inside = armed or values[0] > noise
        for j in range(1, len(states)):
            if inside and values[j] < -noise:
                return self.bisect(mode, form, states[j - 1], times[j - 1], level + parts)
            if not inside and values[j] < -noise:
                # From its bound the guard goes outside: at once, or after a rise within this part.
                if j > 1 or slopes[0] > 0:
                    found = self.rise(mode, i, states[j - 1], times[j - 1], level + parts)
                    if found is not None:
                        return found
                return times[j - 1], states[j - 1].copy()
            if slopes[j - 1] < 0 < slopes[j] and inside:
                low, state = self.bisect(mode, rate, states[j - 1], times[j - 1], level + parts, upwards=True)
                # One that turns back at its bound, by what steps so far may have made of rounding, stays inside.
                if form @ state < -GRAZE * noise:
                    return self.bisect(mode, form, states[j - 1], times[j - 1], level + parts, until=low)
            inside = inside or values[j] > noise
        return None

    def rise(self, mode, i, x, t, level):
        """Where a guard that rises from its bound comes back to it, within a step."""
        form, rate = mode.forms[0, i], mode.forms[1, i]
        if not rate @ x > 0:
            return None
        top, state = self.bisect(mode, rate, x, t, level)
        if form @ state <= 0:
            return None
        offset, step = top - t, level
        while step < level + LEVELS - 8:
            step += 1
            if mode.longest * 2.0**-step > mode.longest * 2.0**-level - offset:
                continue
            after = mode.move(state, step)
            if form @ after >= 0:
                state = after
                offset += mode.longest * 2.0**-step
        return t + offset, state

    def bisect(self, mode, form, x, t, level, upwards=False, until=None):
        """The last time, and the state, before the form changes sign (downwards) in a step from t."""
        state, now = x, t
        for step in range(level + 1, level + 56):
            h = mode.longest * 2.0**-step
            if until is not None and now + h > until:
                continue
            after = mode.move(state, step)
            value = form @ after
            if (value <= 0) if upwards else (value >= 0):
                state, now = after, now + h
        return now, state.copy()
