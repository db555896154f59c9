"""What impacts do, by Newton's and Moreau's law, and when a sequence of them has come to its end."""

import itertools

import numpy as np
from hybrid_machine import OPEN
from own_motion import Motion


class Impacts(Motion):
    """Jumps of the state."""

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
