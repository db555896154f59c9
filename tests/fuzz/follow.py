"""A second opinion on a lumped machine: matrix exponentials, events to rounding, own laws of impact and friction.

Nothing here is taken from the library; hybrid_machine.py has the machine and its motion within a mode, exits.py where
it ends, impacts.py what jumps there and forces.py what follows.
"""

import numpy as np
from exits import Exits
from forces import Forces
from hybrid_machine import OPEN, STICK, is_closed
from impacts import Impacts
from own_motion import GaveUpError


class Follower(Exits, Impacts, Forces):
    """One motion, from event to event."""

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


def mode_guard(mode, i):
    return mode.guards[i][1], mode.guards[i][2]
