"""Makes data/vibropress.txt: the vibropress with a phase error of 40 degrees, by DOP853 with located contact events.

The matrices are written down from the lists of the source thesis, not assembled from points; every contact state is one
smooth integration that ends where SciPy finds a gap to change its sign. The tolerances are as tight as DOP853 takes
them; the last line of the output is the difference of two runs with tolerances apart by ten.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

A1, A2, A3, A4, H1, H2, K1, KX, KC = 0.71, 0.4434, 0.8868, 0.33, 0.3, 0.1, 5e7, 2e8, 1e7
ALPHA, PHASE_ERROR, FREQUENCY, FORCE, ARM, HEIGHT = 1e-4, np.radians(40.0), 50.0, 2e4, 0.3, -0.1
MASS = np.array([1020.0, 1020.0, 30.60, 100.0, 100.0, 9.795, 425.0, 425.0, 29.269])
CLEARANCE = np.array([5e-5, 5e-5, 1e-5, 1e-5, 0.0, 0.0])
T_END, TIMES = 0.3, 300
# Nothing moves the pallet sideways.
MOVING = [i for i in range(18) if i not in (3, 12)]


def linear():
    k = np.zeros((9, 9))
    k[0, 0] = k[3, 3] = k[6, 6] = KX
    k[1, 1], k[7, 7] = K1, 1e8
    k[2, 2], k[8, 8] = K1 * A1**2 + KX * H1**2, 1e8 * A3**2 + KX * H2**2
    k[0, 2] = k[2, 0] = KX * H1
    k[6, 8] = k[8, 6] = -KX * H2
    return k


def gaps():
    """Rows of the gaps: table-pallet, pallet-mould, pallet-bars, left and right."""
    w = np.zeros((6, 9))
    for side, sign in enumerate((-1.0, 1.0)):
        w[side, [4, 5, 1, 2]] = 1.0, sign * A2, -1.0, -sign * A2
        w[2 + side, [7, 8, 4, 5]] = 1.0, sign * A2, -1.0, -sign * A2
        w[4 + side, [4, 5]] = 1.0, sign * A4
    return w


K, W = linear(), gaps()
B = ALPHA * (K + KC * W.T @ W)


def excitation(t):
    first, second = 2 * np.pi * FREQUENCY * t, 2 * np.pi * FREQUENCY * t + PHASE_ERROR
    x = FORCE / 2 * (np.cos(first) - np.cos(second))
    left, right = FORCE / 2 * np.sin(first), FORCE / 2 * np.sin(second)
    f = np.zeros(9)
    f[:3] = x, left + right, ARM * (right - left) - HEIGHT * x
    return f


def follow(tolerance):
    """Return the states at the times (times, 18) and the number of events."""
    times = T_END * np.arange(1, TIMES + 1) / TIMES
    states, events, t, z = [], 0, 0.0, np.zeros(18)
    closed = W @ z[:9] + CLEARANCE < 0.0
    while t < T_END:
        k = K + KC * W[closed].T @ W[closed]
        constant = -KC * W[closed].T @ CLEARANCE[closed]

        def slope(s, y, k=k, constant=constant):
            return np.concatenate((y[9:], (excitation(s) + constant - k @ y[:9] - B @ y[9:]) / MASS))

        watched = []
        for j in range(6):

            def gap(s, y, j=j):
                return W[j] @ y[:9] + CLEARANCE[j]

            gap.terminal, gap.direction = True, 1.0 if closed[j] else -1.0
            watched.append(gap)
        options = {"events": watched, "rtol": tolerance, "atol": tolerance * 1e-4, "max_step": 1e-4}
        part = solve_ivp(slope, (t, T_END), z, "DOP853", dense_output=True, **options)
        stop = part.t[-1]
        inside = times[(times > t) & (times <= stop)]
        if inside.size:
            states.extend(part.sol(inside).T)
        crossed = [j for j in range(6) if len(part.t_events[j])]
        t, z = stop, part.y[:, -1]
        for j in crossed:
            closed[j] = not closed[j]
            events += 1
    return times, np.array(states), events


def main():
    times, states, events = follow(3e-14)
    _, rough, also = follow(3e-13)
    assert events == also, (events, also)
    force = np.maximum(0.0, -KC * (states[:, :9] @ W.T + CLEARANCE))
    # Records: mould.y, pallet.phi, forces of the left contacts table-pallet, pallet-mould, pallet-bar.
    columns = np.column_stack((times, states[:, 7], states[:, 5], force[:, [0, 2, 4]]))
    lines = [f"{TIMES} {events}"] + [" ".join(f"{value:.17e}" for value in row) for row in columns]
    (Path(__file__).parent.parent / "data" / "vibropress.txt").write_text("\n".join(lines) + "\n")
    difference = (np.abs(states - rough).max(axis=0) / np.abs(states).max(axis=0).clip(1e-300))[MOVING].max()
    print(events, "events; two tolerances differ by", difference)


if __name__ == "__main__":
    sys.exit(main())
