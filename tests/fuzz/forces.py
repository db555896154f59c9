"""Which mode holds after an event: what stays closed, sticks or goes on by the forces in it."""

import itertools

import numpy as np
from hybrid_machine import OPEN, STICK, is_closed
from own_motion import GaveUpError, Motion


class Forces(Motion):
    """The choice of the next mode."""

    def weakens(self, j):
        """Whether a contact is friction that slides with less than it sticks with."""
        contact = self.machine.contacts[j]
        return contact.friction and contact.sliding < contact.most

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
