"""Check the reference by another way: matrix exponentials of the whole system in 50 digits, first events of P2.

usage: check.py REFERENCE_P2 [EVENTS]    (the file reference_p2_quad_*.txt in the build folder)
"""

import sys

import mpmath as mp

mp.mp.dps = 50
INERTIA = [mp.mpf(x) for x in ("0.1", "0.00794", "0.00794", "0.1")]
SHAFT, FACTOR, RADIUS = mp.mpf(62905), mp.mpf("5e-4"), mp.mpf("0.08")
MESH, BACKLASH, ERROR = mp.mpf("8e8"), mp.mpf("1e-4"), mp.mpf("5e-5")
TORQUE, OMEGA = mp.mpf(100), 40 * mp.pi * 3000 / 30
TOLERANCE = mp.mpf("1e-30")
SCAN = mp.mpf("2e-6")
"""Step, s, in which the first change of contact is looked for: a hundredth of the shortest stay in these events."""


def system(side):
    """Matrix of the autonomous system of angles, velocities, sine, cosine and one, in contact state `side`."""
    a = mp.zeros(11)
    for i in range(4):
        a[i, 4 + i] = 1
    for i, j in ((0, 1), (2, 3)):
        for row, column, sign in ((i, i, -1), (i, j, 1), (j, i, 1), (j, j, -1)):
            a[4 + row, column] += sign * SHAFT / INERTIA[row]
            a[4 + row, 4 + column] += sign * SHAFT * FACTOR / INERTIA[row]
    a[4, 10], a[7, 10] = TORQUE / INERTIA[0], -TORQUE / INERTIA[3]
    a[8, 9], a[9, 8] = OMEGA, -OMEGA
    if side != 0:
        for row, sign in ((5, -1), (6, 1)):
            pull = sign * RADIUS * MESH / INERTIA[row - 4]
            a[row, 1] += pull * RADIUS
            a[row, 2] -= pull * RADIUS
            a[row, 8] += pull * ERROR
            a[row, 10] += pull * BACKLASH if side < 0 else 0
    return a


def deformation(y):
    return RADIUS * (y[1] - y[2]) + ERROR * y[8]


def side_of(d):
    return 1 if d > 0 else (-1 if d < -BACKLASH else 0)


def next_event(y, side):
    """Time, state and new contact state of the first change of contact."""
    a = system(side)
    step = mp.expm(a * SCAN)
    t, z = mp.mpf(0), step * y  # one step off the boundary on which the motion starts
    while True:
        t += SCAN
        ahead = step * z
        if side_of(deformation(ahead)) != side:
            break
        z = ahead
    new_side = side_of(deformation(ahead))
    level = mp.mpf(0) if max(side, new_side) == 1 else -BACKLASH
    low, high, x = mp.mpf(0), SCAN, SCAN / 2
    for _ in range(100):
        at = mp.expm(a * x) * z
        value, slope = deformation(at) - level, deformation(a * at)
        if side_of(deformation(at)) == side:
            low = x
        else:
            high = x
        ahead = x - value / slope
        ahead = ahead if low < ahead < high else (low + high) / 2
        if abs(ahead - x) < mp.mpf("1e-45"):
            break
        x = ahead
    return t + ahead, mp.expm(a * ahead) * z, new_side


def main():
    with open(sys.argv[1], encoding="ascii") as lines:
        expected = [line.split()[1:] for line in lines if line.startswith("e ")]
    expected = expected[: int(sys.argv[2]) if len(sys.argv) > 2 else 24]
    twist, closing = TORQUE / SHAFT, TORQUE / (MESH * RADIUS**2)
    phi = [closing / 2 + twist, closing / 2, -closing / 2, -closing / 2 - twist]
    y, t, side = mp.matrix([*phi, 0, 0, 0, 0, 0, 1, 1]), mp.mpf(0), 1
    worst = mp.mpf(0)
    for time, before, after in expected:
        if side != int(before):
            sys.exit(f"contact state {side} at {mp.nstr(t, 10)} s, expected {before}")
        elapsed, y, side = next_event(y, side)
        t += elapsed
        if side != int(after):
            sys.exit(f"contact state {side} after {mp.nstr(t, 10)} s, expected {after}")
        worst = max(worst, abs(t - mp.mpf(time)))
    print(f"{len(expected)} events, largest difference {mp.nstr(worst, 3)} s")
    sys.exit(0 if worst < TOLERANCE else 1)


if __name__ == "__main__":
    main()
