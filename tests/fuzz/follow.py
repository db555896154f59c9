"""A second opinion on a lumped machine: matrix exponentials, events to rounding, own laws of impact and friction.

Nothing here is taken from the library; hybrid_machine.py has the machine and its motion within a mode.
"""

import itertools

import numpy as np
from hybrid_machine import OPEN, STICK, Machine, Mode, is_closed

EPS = np.finfo(float).eps
LEVELS = 60
# Roundings of a function that turns back at its bound, after many steps.
GRAZE = 256


class GaveUpError(Exception):
    """The motion has too many events, or no mode was found that obeys the laws."""


class Follower:
    """One motion. `disturbed`: velocities are known to 1e-12 at events, gaps to 1e-14, and sequences end earlier.

    Gaps of less than `joins` roundings are closed together.
    """

    def __init__(self, text, most_events=20000, most_steps=400000, disturbed=False, joins=64):
        self.machine = Machine(text)
        self.most_events, self.most_steps = most_events, most_steps
        self.coarse = 20.0 if disturbed else 1.0
        self.joins = joins
        self.random = np.random.default_rng(1) if disturbed else None
        self.modes = {}
        self.events, self.struck = [], []
        self.size = np.zeros(self.machine.size)
        self.pulls = np.abs(self.machine.free)
        self.shortest = 0.25 / max(np.max(np.abs(np.linalg.eigvals(self.machine.free))), 1e-3)

    def mode(self, branches):
        key = tuple(branches)
        if key not in self.modes:
            self.modes[key] = Mode(self.machine, key)
        return self.modes[key]

    def noise(self, form, x):
        """What a form is known to."""
        return self.joins * EPS * (np.abs(form) @ self.sizes(x))

    def sizes(self, *states):
        """Sizes of the terms of a form; a speed has the rounding of all, and of forces also where others take them."""
        sizes = np.maximum(np.max(np.abs(states), axis=0), self.size)
        speeds = slice(self.machine.n, 2 * self.machine.n)
        sizes[speeds] = max(np.max(sizes[speeds]), self.shortest * np.max(self.pulls[speeds] @ sizes))
        return sizes

    def run(self, times):
        """States at the times."""
        machine = self.machine
        x = machine.start.copy()
        self.disturb(x)
        self.size = 1e-3 * np.abs(x)
        t, out, k, steps = 0.0, [], 0, 0
        mode = self.begin(x)
        while k < len(times):
            since, armed = 0.0, np.zeros(len(mode.guards), dtype=bool)
            while k < len(times):
                steps += 1
                if steps > self.most_steps:
                    raise GaveUpError(f"steps, at {t}")
                level = mode.level(since)
                level = max(level, self.first_level(mode, x, armed, level))
                h = mode.longest * 2.0**-level
                after = mode.move(x, level)
                found = self.first_exit(mode, x, after, level, armed)
                upto = h if found is None else found[0]
                while k < len(times) and times[k] <= t + upto:
                    out.append(self.at(mode, x, times[k] - t)[: 2 * machine.n])
                    k += 1
                t += upto
                since += upto
                if found is not None:
                    x = found[1]
                    break
                x = after
                self.size = np.maximum(self.size, 1e-3 * np.abs(x))
                self.size[: 2 * machine.n] = np.maximum(self.size[: 2 * machine.n] * 0.999, np.abs(x[: 2 * machine.n]))
            if k == len(times):
                break
            hit = found[2]
            before = mode
            self.disturb(x)
            mode = self.settle(mode, x, hit)
            self.events.append((t, [mode_guard(before, i) for i in hit]))
            if len(self.events) > self.most_events:
                raise GaveUpError(f"events, at {t}")
        return np.array(out)

    def disturb(self, x):
        """Change velocities by 1e-12 of themselves."""
        if self.random is not None:
            n = self.machine.n
            x[n : 2 * n] *= 1.0 + 1e-12 * self.random.uniform(-1.0, 1.0, n)

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

    def begin(self, x):
        branches = []
        for contact in self.machine.contacts:
            branch = OPEN
            if contact.friction:
                branch = int(np.sign(contact.rate @ x))
            else:
                for sign in contact.signs:
                    depth, rate = contact.depth(sign) @ x, sign * contact.rate @ x
                    if depth > 0 or (depth == 0 and rate > 0):
                        branch = sign if contact.rigid else (sign, "closed")
                if not contact.rigid and branch != OPEN and contact.parts and contact.pressed(branch[0]) @ x < 0:
                    branch = (branch[0], "parting")
            branches.append(branch)
        return self.settle(self.mode(branches), x, [])

    def settle(self, mode, x, hit):
        """The mode after guards were hit; x gets the jumps."""
        contacts = self.machine.contacts
        branches = list(mode.branches)
        let_go, touched, rest, yielding = set(), set(), set(), []
        for i in hit:
            form, j, after = mode.guards[i]
            contact = contacts[j]
            if j in mode.held:
                if self.weakens(j):
                    yielding.append((j, after))
                    continue
                branches[j] = after
                let_go.add(j)
            else:
                within = 0.0
                if contact.rigid and self.random is not None:
                    within = self.noise(form, x) * self.random.uniform(0.0, 1.0)
                self.put(x, form, within)
                if contact.rigid:
                    touched.add((j, after))
                elif contact.friction:
                    rest.add(j)
                else:
                    branches[j] = after
        sides = []
        for j, contact in enumerate(contacts):
            if not contact.rigid:
                continue
            for sign in contact.signs:
                gap = -contact.depth(sign)
                touches = (j, sign) in touched or branches[j] == sign or gap @ x <= self.noise(gap, x)
                if touches and not (j in let_go and mode.branches[j] == sign):
                    sides.append((j, sign))
        squeezing = self.squeezing(branches, sides, x)
        self.hold(x, squeezing)
        struck = hits = set(squeezing) | self.impact(x, sides)
        for _ in range(20):
            # An impact may drive together others that touch.
            hits = hits and self.impact(x, sides)
            struck = struck | hits
        self.struck += [sorted(struck)] if struck else []
        closed = []
        for j, sign in sides:
            rate = -sign * contacts[j].rate
            speed = rate @ x
            if speed <= self.noise(rate, x) or (struck and self.flight_is_noise(branches, x, j, sign, speed)):
                closed.append((j, sign))
        if struck:
            # A sequence that ends takes with it what friction that sticks until each impact slides after it.
            ends = any(-sign * contacts[j].rate @ x > self.noise(contacts[j].rate, x) for j, sign in closed)
            stuck = [(j, 0) for j in mode.held if ends and contacts[j].friction and contacts[j].with_stop is None]
            self.hold(x, closed + stuck)
        for j, contact in enumerate(contacts):
            if contact.rigid:
                branches[j] = next((sign for i, sign in closed if i == j), OPEN)
        # Friction that an impact has set moving, or that acts again.
        for j, contact in enumerate(contacts):
            if not contact.friction or (j in let_go and not struck):
                continue
            rate = contact.rate @ x
            # What sticks has drifted by rounding only, where nothing was struck.
            sticks = branches[j] == STICK and j in mode.held and not struck
            if sticks or abs(rate) <= self.noise(contact.rate, x) or j in rest:
                rest.add(j)
                branches[j] = STICK
            else:
                branches[j] = int(np.sign(rate))
        if yielding and not struck:
            # Of frictions that weaken the first slides; what is below its limit then sticks on.
            yielding += [other for other in self.leaving(mode, x, let_go) if self.weakens(other[0])]
            j, after = min(yielding)
            let_go.add(j)
            branches[j] = after
        rest -= let_go if not struck else set()
        rest = {j for j in rest if contacts[j].with_stop is None or is_closed(branches[contacts[j].with_stop])}
        if self.machine.contacts and not any(c.rigid or c.friction for c in contacts):
            return self.mode(self.pass_on(branches, x))
        branches = self.pass_on(branches, x)
        for _ in range(20):
            branches = list(self.forces(branches, closed, rest, x))
            mode = self.mode(branches)
            leaving = self.leaving(mode, x, let_go)
            if not leaving:
                return mode
            # What weakens as it begins to slide does so alone, the first of them; all else is decided again.
            weak = [other for other in leaving if self.weakens(other[0])]
            for j, after in weak[:1] or leaving:
                let_go.add(j)
                rest.discard(j)
                closed = [side for side in closed if side[0] != j]
                branches[j] = after
        raise GaveUpError("no mode")

    def squeezing(self, branches, sides, x):
        """Two open sides whose impacts alternated, that touch now, and that impacts in turn bring to rest."""
        last = self.struck[-4:]
        if len(last) < 4 or last[0] != last[2] or last[1] != last[3] or last[0] == last[1]:
            return []
        pair = [*last[0], *last[1]]
        if not all(side in sides and branches[side[0]] == OPEN for side in pair):
            return []
        contacts = self.machine.contacts
        d = np.array([-sign * contacts[j].w for j, sign in pair])
        effect = d / self.machine.mass @ d.T
        u = np.array([-sign * contacts[j].rate @ x for j, sign in pair])
        if np.sum(u < 0) != 1:
            return []
        least = 1e-3 * np.min(u)
        for _ in range(1000):
            k = np.argmin(u)
            if u[k] >= least:
                break
            u = u - effect[:, k] * (1 + contacts[pair[k][0]].restitution) * u[k] / effect[k, k]
        return pair if np.min(u) < 0 else []

    def weakens(self, j):
        """Whether a contact is friction that slides with less than it sticks with."""
        contact = self.machine.contacts[j]
        return contact.friction and contact.sliding < contact.most

    def put(self, x, form, within=0.0):
        """Put the state on a bound that its rounding has missed, or so far within."""
        n, machine = self.machine.n, self.machine
        value = form @ x - within
        part = slice(0, n) if np.any(form[:n]) else slice(n, 2 * n)
        effect = form[part] @ (form[part] / machine.mass)
        x[part] -= form[part] / machine.mass * value / effect

    def impact(self, x, sides):
        """Newton's and Moreau's law for all sides that touch; which of them were hit."""
        contacts, machine = self.machine.contacts, self.machine
        d = np.array([-sign * contacts[j].w for j, sign in sides]).reshape(len(sides), machine.n)
        u = np.array([-sign * contacts[j].rate @ x for j, sign in sides])
        noise = np.array([self.noise(contacts[j].rate, x) for j, _ in sides])
        struck = {side for side, speed, least in zip(sides, u, noise, strict=True) if speed < -least}
        if not struck:
            return struck
        u = np.where(np.abs(u) <= noise, 0.0, u)
        e = np.array([contacts[j].restitution for j, _ in sides])
        effect = d / machine.mass @ d.T
        best = None
        for active in itertools.product((False, True), repeat=len(sides)):
            a = np.flatnonzero(active)
            impulse = np.zeros(len(sides))
            if len(a):
                impulse[a] = np.linalg.lstsq(effect[np.ix_(a, a)], -(1 + e[a]) * u[a], rcond=1e-10)[0]
            after = u + effect @ impulse
            wrong = max(
                np.max(-(after + e * u)),
                np.max(-(impulse * np.diag(effect))),
                np.max(np.abs((after + e * u)[a]), initial=0.0),
            )
            if best is None or wrong < best[0]:
                best = (wrong, impulse, after)
        x[machine.n : 2 * machine.n] += d.T @ best[1] / machine.mass
        for (j, _), speed, least in zip(sides, best[2], noise, strict=True):
            if abs(speed) <= least:
                self.put(x, contacts[j].rate)
        return struck

    def hold(self, x, closed):
        """Take the speeds of closed gaps out of the state."""
        contacts, machine = self.machine.contacts, self.machine
        if not closed:
            return
        d = np.array([contacts[j].w for j, _ in closed])
        u = np.array([contacts[j].rate @ x for j, _ in closed])
        effect = d / machine.mass @ d.T
        x[machine.n : 2 * machine.n] -= (d / machine.mass).T @ np.linalg.lstsq(effect, u, rcond=1e-10)[0]

    def flight_is_noise(self, branches, x, j, sign, speed):
        """Whether what is left of a sequence of impacts is below the rounding of the gap."""
        contacts = self.machine.contacts
        contact = contacts[j]
        flying = list(branches)
        for i, other in enumerate(contacts):
            if other.rigid:
                flying[i] = OPEN
            elif other.friction and abs(other.rate @ x) > self.noise(other.rate, x):
                flying[i] = int(np.sign(other.rate @ x))
        pull = sign * (contact.rate @ self.mode(flying).rates) @ x
        return pull > 0 and speed**2 <= 2 * pull * 4 * self.coarse * self.noise(contact.depth(sign), x)

    def pass_on(self, branches, x):
        """Compliant contacts whose new branch ends at once go on."""
        branches = list(branches)
        for j, contact in enumerate(self.machine.contacts):
            if contact.rigid or contact.friction:
                continue
            for _ in range(4):
                for form, after in contact.bounds(branches[j]):
                    if form @ x < -self.noise(form, x):
                        branches[j] = after
                        break
                else:
                    break
        return branches

    def forces(self, branches, closed, rest, x):
        """Which closed sides stay, which friction that rests sticks; the fastest that begins to slide goes first."""
        contacts, machine, n = self.machine.contacts, self.machine, self.machine.n
        branches, rest = list(branches), set(rest)
        while True:
            rates = machine.free.copy()
            for i, contact in enumerate(contacts):
                if contact.friction:
                    acts = contact.with_stop is None or is_closed(branches[contact.with_stop])
                    if acts and i not in rest and branches[i] != STICK:
                        rates[n : 2 * n] -= np.outer(
                            contact.w / machine.mass, machine.constant(branches[i] * contact.sliding)
                        )
                elif not contact.rigid and branches[i] != OPEN and branches[i][1] == "closed":
                    force = branches[i][0] * contact.pressed(branches[i][0])
                    rates[n : 2 * n] -= np.outer(contact.w / machine.mass, force)
            sticking = sorted(rest)
            d = np.array([-sign * contacts[j].w for j, sign in closed] + [contacts[j].w for j in sticking]).reshape(
                -1, n
            )
            forms = [-sign * contacts[j].rate for j, sign in closed] + [contacts[j].rate for j in sticking]
            if not forms:
                return tuple(branches)
            u = np.array([form @ rates @ x for form in forms])
            size = np.array([np.abs(form) @ np.abs(rates) @ np.abs(x) for form in forms])
            effect = d / machine.mass @ d.T
            limits = np.array([contacts[j].most for j in sticking])
            m = len(closed)
            best = None
            for choice in itertools.product(*[(0, 1)] * m, *[(0, 1, -1)] * len(sticking)):
                force = np.zeros(len(forms))
                fixed = [
                    i
                    for i, c in enumerate(choice)
                    if (c == 1) == (i < m) and (c == 1 or c == 0) and not (i >= m and c != 0)
                ]
                for i in range(m, len(forms)):
                    force[i] = -choice[i] * limits[i - m]
                a = np.array(fixed, dtype=int)
                if len(a):
                    force[a] = np.linalg.lstsq(effect[np.ix_(a, a)], -(u + effect @ force)[a], rcond=1e-10)[0]
                after = u + effect @ force
                scale = np.max(size) + 1e-300
                wrong = np.max(np.abs(after[a]), initial=0.0) / scale
                for i, c in enumerate(choice):
                    unit = effect[i, i] / scale
                    if i < m:
                        wrong = max(wrong, -force[i] * unit, -after[i] / scale)
                    elif c == 0:
                        wrong = max(wrong, (abs(force[i]) - limits[i - m]) * unit)
                    else:
                        wrong = max(wrong, -c * after[i] / scale)
                if best is None or wrong < best[0] - 1e-13:
                    best = (wrong, choice, after)
            if best[0] > 1e-9:
                raise GaveUpError("no forces")
            for (j, sign), c in zip(closed, best[1][:m], strict=True):
                branches[j] = sign if c else OPEN
            weak = []
            for j, c, a in zip(sticking, best[1][m:], best[2][m:], strict=True):
                branches[j] = c
                if c and contacts[j].sliding < contacts[j].most:
                    weak.append((abs(a) / np.sqrt(contacts[j].w @ (contacts[j].w / machine.mass)), j))
            if not weak:
                return tuple(branches)
            rest.discard(max(weak)[1])
            branches = [dict(closed).get(j, branch) for j, branch in enumerate(branches)]

    def leaving(self, mode, x, let_go):
        """Constraints whose force is on its bound and about to leave it."""
        out = []
        for i, (form, j, after) in enumerate(mode.guards):
            if j not in mode.held or j in let_go:
                continue
            value, rate = form @ x, mode.forms[1, i] @ x
            noise = self.noise(form, x)
            if abs(value) <= noise and rate * 1e-3 * mode.shortest < -1e-3 * noise and rate < 0:
                out.append((j, after))
        return out


def mode_guard(mode, i):
    return mode.guards[i][1], mode.guards[i][2]
