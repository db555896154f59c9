"""Peer: SciPy `solve_ivp` with events.

Setting `METHOD:TREATMENT:RTOL:LONGEST`: METHOD of `solve_ivp`; TREATMENT `events` stops at every change of contact and
starts again in the new contact state, `through` integrates over the kinks of the mesh force in one call; LONGEST step,
s (`inf`: no limit).
The right-hand side is plain float arithmetic, a small part of the cost of a step of `solve_ivp`.
"""

import math

import numpy as np
from gear_pair import (
    BACKLASH,
    DAMPING_FACTOR,
    ERROR_SINE,
    INERTIA,
    MESH,
    P2_END,
    P2_POINTS,
    P3_END,
    P3_FROM,
    RADIUS,
    SHAFT,
    TORQUE,
    Result,
    main,
    mesh_frequency,
    static_equilibrium,
)
from scipy.integrate import solve_ivp

SCALES = np.array([1e-3] * 4 + [1.0] * 4)  # rad, rad/s


def deformation(t, y, omega):
    return RADIUS * (y[1] - y[2]) + ERROR_SINE * np.sin(omega * t)


def right_hand_side(omega, side):
    """Equations of motion in contact state `side`, or with the contact following from d when `side` is None."""

    def rhs(t, y):
        p0, p1, p2, p3, v0, v1, v2, v3 = y.tolist()
        d = RADIUS * (p1 - p2) + ERROR_SINE * math.sin(omega * t)
        closed = side if side is not None else (1 if d > 0.0 else (-1 if d < -BACKLASH else 0))
        force = RADIUS * MESH * (d if closed > 0 else d + BACKLASH) if closed else 0.0
        shaft1 = SHAFT * (p0 - p1 + DAMPING_FACTOR * (v0 - v1))
        shaft2 = SHAFT * (p2 - p3 + DAMPING_FACTOR * (v2 - v3))
        return (
            v0,
            v1,
            v2,
            v3,
            (TORQUE - shaft1) / INERTIA[0],
            (shaft1 - force) / INERTIA[1],
            (force - shaft2) / INERTIA[2],
            (shaft2 - TORQUE) / INERTIA[3],
        )

    return rhs


def event(function, direction, terminal):
    function.direction, function.terminal = direction, terminal
    return function


def exits(omega, side, start):
    """Events that end contact state `side` entered at time `start`, with the states that follow.

    At `start` the motion stands on a boundary to rounding. There the event is given the sign of the inside, so that a
    boundary just crossed is not found again, and one crossed back within the first step is not missed.
    """

    def boundary(shift, outward):
        def distance(t, y):
            return -outward * 1e-300 if t == start else deformation(t, y, omega) + shift

        return event(distance, outward, True)

    if side > 0:
        return [boundary(0.0, -1)], [0]
    if side < 0:
        return [boundary(BACKLASH, 1)], [0]
    return [boundary(0.0, 1), boundary(BACKLASH, -1)], [1, -1]


def extremum_events(omega):
    def rate(t, y):
        return RADIUS * (y[5] - y[6]) + ERROR_SINE * omega * math.cos(omega * t)

    def minimum(t, y):
        return rate(t, y)

    def maximum(t, y):
        return rate(t, y)

    return [event(minimum, 1, False), event(maximum, -1, False)], [-1, 1]


class Motion:
    """One motion, integrated from stop to stop."""

    def __init__(self, speed, method, treatment, rtol, longest, result):
        self.speed, self.omega = speed, mesh_frequency(speed)
        self.options = {"method": method, "rtol": rtol, "atol": rtol * SCALES, "max_step": longest}
        self.side = None if treatment == "through" else 1
        self.t, self.y = 0.0, np.array([*static_equilibrium(), 0.0, 0.0, 0.0, 0.0])
        self.result = result

    def advance(self, t_end, extrema=False, grid=None):
        recorders, kinds = extremum_events(self.omega) if extrema else ([], [])
        while self.t < t_end:
            stops, sides = exits(self.omega, self.side, self.t) if self.side is not None else ([], [])
            inside = None if grid is None else grid[(grid >= self.t) & (grid <= t_end)]
            step = solve_ivp(
                right_hand_side(self.omega, self.side),
                (self.t, t_end),
                self.y,
                events=recorders + stops,
                t_eval=inside,
                dense_output=False,
                **self.options,
            )
            if not step.success:
                raise RuntimeError(f"solve_ivp stopped: {step.message}")
            for kind, times, states in zip(kinds, step.t_events or [], step.y_events or [], strict=False):
                for t, y in zip(times, states, strict=True):
                    self.result.extrema.append((self.speed, t, deformation(t, y, self.omega), kind))
            if inside is not None and len(step.t) > 0:
                self.result.samples += zip(step.t, deformation(step.t, step.y, self.omega), strict=True)
            if step.status == 1:
                fired = next(i for i in range(len(stops)) if len(step.t_events[len(recorders) + i]))
                self.t = step.t_events[len(recorders) + fired][-1]
                self.y = step.y_events[len(recorders) + fired][-1]
                self.side = sides[fired]
                self.result.event_count += 1
                self.result.events.append(self.t)
            else:
                self.t = t_end
                self.y = step.y[:, -1]


def prepare(case, setting):
    method, treatment, rtol, longest = setting.split(":")

    def compute(speeds):
        result = Result(event_count=0)
        for speed in speeds:
            motion = Motion(speed, method, treatment, float(rtol), float(longest), result)
            if case == "p2":
                motion.advance(P2_END, grid=np.linspace(0.0, P2_END, P2_POINTS))
            else:
                motion.advance(P3_FROM)
                motion.advance(P3_END, extrema=True)
                result.events.clear()
        if treatment == "through":
            result.event_count = None
        return result

    return compute


if __name__ == "__main__":
    main(prepare)
