"""Motions of gear trains by SciPy's DOP853 with events, as data for test_reference.pf.

Run by hand: python make_reference.py FOLDER. Every contact state is integrated as the smooth system it is until one of
its guards is left in the outward direction; that is an independent way to the motion which razy has in closed form. The
parameters are repeated in test_reference.pf. Lines of the files: "s time d..." is a sample, "e time contact branch" an
event, with razy's numbers of contacts and branches.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

OPEN, UPPER, LOWER, UPPER_PARTING, LOWER_PARTING = 1, 2, 3, 4, 5
PAIRS_OF_BRANCHES = {UPPER: UPPER_PARTING, LOWER: LOWER_PARTING}


@dataclass
class Mesh:
    """Bodies (from 0), radii, stiffness, damping, backlash, tooth frequency in Hz, error amplitudes, separation."""

    bodies: tuple
    radii: tuple
    stiffness: float
    damping: float
    backlash: float
    hertz: float
    sine: tuple
    cosine: tuple
    zero_force: bool = False

    def deformation(self, t, q, v):
        """Deformation and its rate."""
        i, j = self.bodies
        d = self.radii[0] * q[i] - self.radii[1] * q[j]
        rate = self.radii[0] * v[i] - self.radii[1] * v[j]
        for amplitudes, phase in ((self.sine, 0.0), (self.cosine, 0.5 * np.pi)):
            for k, amplitude in enumerate(amplitudes, start=1):
                omega = 2 * np.pi * k * self.hertz
                d += amplitude * np.sin(omega * t + phase)
                rate += amplitude * omega * np.cos(omega * t + phase)
        return d, rate

    def force(self, branch, d, rate):
        """Force of a branch, continued beyond its guards."""
        if branch == UPPER:
            return self.stiffness * d + self.damping * rate
        if branch == LOWER:
            return self.stiffness * (d + self.backlash) + self.damping * rate
        return 0.0

    def guards(self, branch):
        """Functions of (d, rate) that are negative inside the branch, and the branch beyond each."""
        mu = self.backlash
        if branch == OPEN:
            return [(lambda d, rate: d, UPPER), (lambda d, rate: -mu - d, LOWER)]
        if branch in (UPPER_PARTING, LOWER_PARTING):
            side, edge, closed = (1, 0.0, UPPER) if branch == UPPER_PARTING else (-1, -mu, LOWER)
            return [
                (lambda d, rate: side * self.force(closed, d, rate), closed),
                (lambda d, rate: side * (edge - d), OPEN),
            ]
        side, edge = (1, 0.0) if branch == UPPER else (-1, -mu)
        if self.zero_force:
            return [(lambda d, rate: -side * self.force(branch, d, rate), PAIRS_OF_BRANCHES[branch])]
        return [(lambda d, rate: side * (edge - d), OPEN)]


@dataclass
class Train:
    """Inertias, springs (body, body, stiffness), damping factor, loads, meshes."""

    inertia: tuple
    springs: tuple
    alpha: float
    load: tuple
    meshes: tuple

    def matrices(self):
        """Stiffness matrix over inertia, and load over inertia."""
        n = len(self.inertia)
        stiffness = np.zeros((n, n))
        for i, j, k in self.springs:
            stiffness[[i, j], [i, j]] += k
            stiffness[[i, j], [j, i]] -= k
        inertia = np.array(self.inertia)
        return stiffness / inertia[:, None], np.array(self.load) / inertia


def follow(train, t_end, samples, rtol, atol, max_step):
    """Samples of all deformations and the list of events."""
    stiffness, load = train.matrices()
    n = len(train.inertia)
    inertia = np.array(train.inertia)

    def deformations(t, z):
        return [mesh.deformation(t, z[:n], z[n:]) for mesh in train.meshes]

    def rate_of(t, z, branches):
        q, v = z[:n], z[n:]
        a = load - stiffness @ (q + train.alpha * v)
        for mesh, branch in zip(train.meshes, branches, strict=True):
            i, j = mesh.bodies
            force = mesh.force(branch, *mesh.deformation(t, q, v))
            a[i] -= mesh.radii[0] * force / inertia[i]
            a[j] += mesh.radii[1] * force / inertia[j]
        return np.concatenate((v, a))

    t, z, events, rows = 0.0, np.zeros(2 * n), [], []
    branches = [
        UPPER if d > 0 else LOWER if d < -mesh.backlash else OPEN
        for mesh, (d, _) in zip(train.meshes, deformations(t, z), strict=True)
    ]
    grid = np.linspace(0.0, t_end, samples + 1)
    visited = {tuple(branches)}
    while t < t_end:
        guards = [
            (j, beyond, function)
            for j, mesh in enumerate(train.meshes)
            for function, beyond in mesh.guards(branches[j])
        ]
        functions = []
        for j, _, function in guards:

            def event(time, state, j=j, function=function):
                mesh = train.meshes[j]
                return function(*mesh.deformation(time, state[:n], state[n:])) * mesh.stiffness

            event.terminal = True
            event.direction = 1.0
            functions.append(event)
        now = tuple(branches)
        due = grid[(grid >= t) & (grid < t_end)] if t > 0 else grid[grid < t_end]
        part = solve_ivp(
            lambda time, state, now=now: rate_of(time, state, now),
            (t, t_end),
            z,
            method="DOP853",
            rtol=rtol,
            atol=atol,
            max_step=max_step,
            events=functions,
            dense_output=True,
        )
        t, z = part.t[-1], part.y[:, -1]
        for time in due[due < t]:
            rows.append((time, [d for d, _ in deformations(time, part.sol(time))]))
        hit = [k for k, times in enumerate(part.t_events) if len(times)]
        if hit:
            first = min(hit, key=lambda k: part.t_events[k][0])
            branches[guards[first][0]] = guards[first][1]
            events.append((t, guards[first][0] + 1, guards[first][1]))
            visited.add(tuple(branches))
    rows.append((t, [d for d, _ in deformations(t, z)]))
    return rows, events, visited


def asymmetric_pair(damping, zero_force):
    """Two wheels of different inertia, radius and teeth."""
    mesh = Mesh((1, 2), (0.08, 0.10), 8e8, damping, 1e-4, 40 * 3000 / 60, (5e-5,), (0.0, 1e-5), zero_force)
    return Train(
        inertia=(0.1, 0.00794, 0.012, 0.15),
        springs=((0, 1, 6.2905e4), (2, 3, 9e4)),
        alpha=5e-4,
        load=(100.0, 0.0, 0.0, -125.0),
        meshes=(mesh,),
    )


def chain():
    """Three meshes between four shafts."""
    rpm = 2100.0
    first, second = 40 / 50, 35 / 45
    torque = 20.0
    return Train(
        inertia=(0.1, 0.008, 0.012, 0.006, 0.009, 0.007, 0.01, 0.12),
        springs=((0, 1, 6e4), (2, 3, 5e4), (4, 5, 7e4), (6, 7, 6e4)),
        alpha=5e-4,
        load=(torque, 0, 0, 0, 0, 0, 0, -torque * (0.10 / 0.08) * (0.09 / 0.07) * (0.064 / 0.08)),
        meshes=(
            Mesh((1, 2), (0.08, 0.10), 3e8, 0.0, 1e-4, 40 * rpm / 60, (1.5e-4, 2e-5), (1e-5,)),
            Mesh((3, 4), (0.07, 0.09), 2e8, 0.0, 8e-5, 35 * first * rpm / 60, (1.2e-4,), (2e-5,)),
            Mesh((5, 6), (0.08, 0.064), 2.5e8, 0.0, 9e-5, 40 * first * second * rpm / 60, (1.4e-4,), (1e-5, 1e-5)),
        ),
    )


def write(path, rows, events):
    """Samples and events as text."""
    with path.open("w") as file:
        file.write(f"{len(rows)} {len(rows[0][1])} {len(events)}\n")
        for time, d in rows:
            file.write(f"s {time:.16e} " + " ".join(f"{value:.13e}" for value in d) + "\n")
        for time, contact, branch in events:
            file.write(f"e {time:.16e} {contact} {branch}\n")


def main():
    """Write the three files, and print how far a run with another tolerance is away."""
    folder = Path(sys.argv[1])
    cases = {
        "asymmetric_pair": (asymmetric_pair(0.0, False), 20 / 2000),
        "damped_pair": (asymmetric_pair(2000.0, True), 20 / 2000),
        "chain": (chain(), 20 / (40 * 2100 / 60)),
    }
    for name, (train, t_end) in cases.items():
        rows, events, visited = follow(train, t_end, 400, 1e-12, 1e-17, 2e-6)
        other, other_events, _ = follow(train, t_end, 400, 1e-11, 1e-16, 3e-6)
        difference = max(np.max(np.abs(np.subtract(a[1], b[1]))) for a, b in zip(rows, other, strict=True))
        print(name, len(events), "events", len(other_events), len(visited), "states, difference", difference)
        write(folder / f"{name}.txt", rows, events)


if __name__ == "__main__":
    main()
