"""A second opinion on the woodpecker toy: its states are tried one after the other until one obeys the laws."""

from itertools import product

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

MU, KEPT, GAP = 0.3, np.array([0.5, 0.0, 0.0]), np.array([0.0024, 0.0006, 0.0006])
ROWS = np.array([[1.0, 0.0, 0.0], [1.0, 0.010, 0.015]])
MASS = np.diag([0.0, 5e-9, 7e-7]) + sum(m * np.outer(row, row) for m, row in zip((3e-4, 4.5e-3), ROWS, strict=True))
INVERSE, LOAD = np.linalg.inv(MASS), -9.81 * np.dot((3e-4, 4.5e-3), ROWS)
STIFFNESS = 0.0056 * np.outer([0.0, 1.0, -1.0], [0.0, 1.0, -1.0])
NORMAL = np.array([[0.0, 0.0, -0.02], [0.0, 0.0058, 0.0], [0.0, -0.0058, 0.0]])
TANGENT = np.array([[1.0, 0.010, -0.0051], [1.0, 0.0031, 0.0], [1.0, 0.0031, 0.0]])
# What a contact may do: stay open, stick, slide up, slide down.
OPEN, STICK, UP, DOWN = None, 0, 1, -1


def solve(drift, states, target):
    """Return the rates that follow from `drift`, and what acts along N and T of the contacts that are not open."""
    a, b = np.eye(9), np.concatenate([drift, np.zeros(6)])
    a[:3, 3:] = -INVERSE @ np.vstack([NORMAL, TANGENT]).T
    for i, state in enumerate(states):
        if state is OPEN:
            continue
        a[3 + i] = a[6 + i] = 0.0
        a[3 + i, :3], b[3 + i] = NORMAL[i], target[i]
        if state == STICK:
            a[6 + i, :3] = TANGENT[i]
        else:
            a[6 + i, 3 + i], a[6 + i, 6 + i] = MU * state, 1.0
    found = np.linalg.solve(a, b)
    return found[:3], found[3:6], found[6:]


def choose(drift, target, ways, slip):
    """Return rates and states, out of `ways` of each contact, that obey the laws; `slip` is what slides already."""
    for states in product(*ways):
        if states[1] == states[2] == STICK:
            continue
        rates, push, rub = solve(drift, states, target)
        force, rate, slow = (1e-9 * np.abs(each).max() for each in (push, NORMAL @ rates, TANGENT @ drift))
        good = True
        for i, state in enumerate(states):
            if len(ways[i]) == 1:
                continue
            good &= NORMAL[i] @ rates >= target[i] - rate and push[i] >= -force and abs(rub[i]) <= MU * push[i] + force
            good &= not state or slip[i] != 0 or state * (TANGENT[i] @ rates) >= -slow
        if good:
            return rates, states
    raise AssertionError("no states obey the laws")


def settle(z, left):
    """Return the state after impacts and the states that follow; `left` are the guards that say which do not go on."""
    touch, rate = GAP + NORMAL @ z[:3] < 1e-12, NORMAL @ z[3:]
    if np.any(rate[touch] < -1e-12):
        ways = [[OPEN, STICK, UP, DOWN] if on else [OPEN] for on in touch]
        z = np.append(z[:3], choose(z[3:], -KEPT * rate, ways, np.zeros(3))[0])
        left = []
    slip = [int(np.sign(speed)) if abs(speed) > 1e-10 else 0 for speed in TANGENT @ z[3:]]
    ways = []
    for i in range(3):
        closed = touch[i] and abs(NORMAL[i] @ z[3:]) < 1e-10 and (i, "push") not in left
        way = [OPEN, slip[i]] if slip[i] else [OPEN, STICK, UP, DOWN]
        ways.append([state for state in way if (i, "stick") not in left or state != STICK] if closed else [OPEN])
    return z, choose(INVERSE @ (LOAD - STIFFNESS @ z[:3]), np.zeros(3), ways, slip)[1]


def guards(x, states):
    _, push, rub = solve(INVERSE @ (LOAD - STIFFNESS @ x[:3]), states, np.zeros(3))
    found = {}
    for i, state in enumerate(states):
        if state is OPEN:
            found[i, "gap"] = GAP[i] + NORMAL[i] @ x[:3]
            continue
        found[i, "push"] = push[i]
        found[i, "stick" if state == STICK else "slide"] = (
            MU * push[i] - abs(rub[i]) if state == STICK else state * (TANGENT[i] @ x[3:6])
        )
    return found


def follow(z, times, step=1e-4):
    """Return z at the times, and the times of the events."""
    a, seen, events, t = np.zeros((7, 7)), [], [], 0.0
    a[:3, 3:6] = np.eye(3)
    z, states = settle(np.array(z, float), [])
    while t < times[-1]:
        for j, unit in enumerate(np.eye(7)):
            a[3:6, j] = solve(INVERSE @ (LOAD * unit[6] - STIFFNESS @ unit[:3]), states, np.zeros(3))[0]
        x, left, flow = np.append(z, 1.0), [], expm(a * step)
        while not left and t < times[-1]:
            exits = {}
            for name, value in guards(flow @ x, states).items():
                margin = lambda d, name=name, x=x, states=states: guards(expm(a * d) @ x, states)[name]  # noqa: E731
                if value < 0.0 and margin(0.01 * step) > 0.0:
                    exits[name] = brentq(margin, 0.01 * step, step, xtol=1e-17, rtol=1e-15)
            end = min(exits.values(), default=step)
            left = [name for name, root in exits.items() if root == end]
            while len(seen) < len(times) and times[len(seen)] <= t + end:
                seen.append((expm(a * (times[len(seen)] - t)) @ x)[:6])
            x, t = expm(a * end) @ x, t + end
        events.append(t)
        z, states = settle(x[:6], left)
    return np.array(seen), events
