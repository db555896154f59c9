"""Peer: heyoka, adaptive Taylor series with terminal events at every change of contact.

Setting `FORM:WIDTH:TOL`: FORM is `full` (four inertias, as given) or `relative` (the two relative angles that remain
when the symmetry of this pair is used by hand), WIDTH is `single` or the batch size, TOL the tolerance (0: machine).
"""

import math

import heyoka as hy
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

COOLDOWN = 1e-9
OMEGA, STIFFNESS, SHIFT = 0, 1, 2  # runtime parameters: tooth frequency; mesh force = stiffness * (d + shift)
CONTACT = {1: (MESH, 0.0), 0: (0.0, 0.0), -1: (MESH, BACKLASH)}


def full_model():
    """Equations of the four inertias, mesh deformation, its rate, initial state."""
    names = [f"p{i}" for i in range(4)] + [f"v{i}" for i in range(4)]
    x = [hy.expression(name) for name in names]
    phi, v = x[:4], x[4:]
    omega = hy.par[OMEGA]
    d = RADIUS * (phi[1] - phi[2]) + ERROR_SINE * hy.sin(omega * hy.time)
    rate = RADIUS * (v[1] - v[2]) + ERROR_SINE * omega * hy.cos(omega * hy.time)
    force = RADIUS * hy.par[STIFFNESS] * (d + hy.par[SHIFT])
    shaft1 = SHAFT * (phi[0] - phi[1] + DAMPING_FACTOR * (v[0] - v[1]))
    shaft2 = SHAFT * (phi[2] - phi[3] + DAMPING_FACTOR * (v[2] - v[3]))
    acceleration = [
        (TORQUE - shaft1) / INERTIA[0],
        (shaft1 - force) / INERTIA[1],
        (force - shaft2) / INERTIA[2],
        (shaft2 - TORQUE) / INERTIA[3],
    ]
    system = list(zip(x, v + acceleration, strict=True))
    return system, d, rate, [*static_equilibrium(), 0.0, 0.0, 0.0, 0.0], lambda y: RADIUS * (y[1] - y[2])


def relative_model():
    """The same motion in a = phi_1 - phi_4 and b = phi_2 - phi_3, which equal inertias, shafts and radii allow."""
    a, b, va, vb = (hy.expression(name) for name in ("a", "b", "va", "vb"))
    omega = hy.par[OMEGA]
    d = RADIUS * b + ERROR_SINE * hy.sin(omega * hy.time)
    rate = RADIUS * vb + ERROR_SINE * omega * hy.cos(omega * hy.time)
    force = 2 * RADIUS * hy.par[STIFFNESS] * (d + hy.par[SHIFT])
    shaft = SHAFT * (a - b + DAMPING_FACTOR * (va - vb))
    system = [(a, va), (b, vb), (va, (2 * TORQUE - shaft) / INERTIA[0]), (vb, (shaft - force) / INERTIA[1])]
    phi = static_equilibrium()
    return system, d, rate, [phi[0] - phi[3], phi[1] - phi[2], 0.0, 0.0], lambda y: RADIUS * y[1]


class Solver:
    """Two compiled integrators: contact events alone, and contact events with extrema of d."""

    def __init__(self, form, width, tolerance, want_extrema):
        system, d, rate, self.start, self.closing = full_model() if form == "full" else relative_model()
        self.width = None if width == "single" else int(width)
        self.tolerance = tolerance
        self.speeds = []
        self.result = Result(event_count=0)
        boundaries = (d, d + BACKLASH)
        self.plain = self.build(system, boundaries, None)
        self.recording = self.build(system, boundaries, rate) if want_extrema else None

    def build(self, system, boundaries, rate):
        single = self.width is None
        t_event, nt_event = (hy.t_event, hy.nt_event) if single else (hy.t_event_batch, hy.nt_event_batch)
        view = []  # of the integrator's parameters, taken once: a callback runs a thousand times a motion
        exits = [
            t_event(boundary, callback=self.contact_callback(i, view), cooldown=COOLDOWN)
            for i, boundary in enumerate(boundaries)
        ]
        options = {"t_events": exits, "tol": self.tolerance, "pars": self.parameters([1000.0] * (self.width or 1))}
        if rate is not None:
            options["nt_events"] = [nt_event(rate, callback=self.extremum_callback())]
        build = hy.taylor_adaptive if single else hy.taylor_adaptive_batch
        integrator = build(system, self.initial_state(), **options)
        view.append(integrator.pars)
        return integrator

    def initial_state(self):
        start = np.array(self.start)
        return start if self.width is None else np.repeat(start[:, None], self.width, axis=1)

    def parameters(self, speeds):
        pars = np.array([[mesh_frequency(n) for n in speeds], [MESH] * len(speeds), [0.0] * len(speeds)])
        return pars[:, 0] if self.width is None else pars

    def contact_callback(self, boundary, view):
        up, down = CONTACT[1 if boundary == 0 else 0], CONTACT[0 if boundary == 0 else -1]
        result = self.result

        def single(ta, sign):
            pars = view[0]
            pars[STIFFNESS], pars[SHIFT] = up if sign > 0 else down
            result.events.append(ta.time)
            return True

        def batch(ta, sign, lane):
            pars = view[0]
            pars[STIFFNESS, lane], pars[SHIFT, lane] = up if sign > 0 else down
            if lane < len(self.speeds):
                result.event_count += 1
            return True

        return single if self.width is None else batch

    def extremum_callback(self):
        # heyoka copies a callback deeply, a bound method with its object: functions refer to this one
        def single(ta, t, sign):
            ta.update_d_output(t)
            value = self.closing(ta.d_output) + ERROR_SINE * math.sin(ta.pars[OMEGA] * t)
            self.result.extrema.append((self.speeds[0], t, value, -sign))

        def batch(ta, t, sign, lane):
            if lane >= len(self.speeds):
                return
            ta.update_d_output(np.full(self.width, t))
            value = self.closing(ta.d_output[:, lane]) + ERROR_SINE * math.sin(ta.pars[OMEGA, lane] * t)
            self.result.extrema.append((self.speeds[lane], t, value, -sign))

        return single if self.width is None else batch

    def reset(self, speeds):
        self.speeds = speeds
        lanes = speeds + [speeds[-1]] * ((self.width or 1) - len(speeds))
        self.plain.state[:] = self.initial_state()
        self.plain.pars[:] = self.parameters(lanes)
        self.plain.reset_cooldowns()
        self.set_time(self.plain, 0.0)

    def set_time(self, ta, t):
        if self.width is None:
            ta.time = t
        else:
            ta.set_time(t)

    def extrema(self, speeds):
        width = self.width or 1
        for i in range(0, len(speeds), width):
            self.reset(speeds[i : i + width])
            self.propagate(self.plain, P3_FROM)
            self.recording.state[:] = self.plain.state
            self.recording.pars[:] = self.plain.pars
            self.recording.reset_cooldowns()
            self.set_time(self.recording, P3_FROM)
            self.propagate(self.recording, P3_END)
        return self.finish()

    def trajectory(self, speeds):
        self.reset(speeds)
        grid = np.linspace(0.0, P2_END, P2_POINTS)
        outcome = self.plain.propagate_grid(grid)
        if outcome[0] != hy.taylor_outcome.time_limit:
            raise RuntimeError(f"heyoka stopped: {outcome[0]}")
        states = outcome[-1]
        d = self.closing(states.T) + ERROR_SINE * np.sin(mesh_frequency(speeds[0]) * grid)
        self.result.samples = list(zip(grid, d, strict=True))
        return self.finish()

    def finish(self):
        if self.width is None:
            self.result.event_count = len(self.result.events)
            if self.recording is not None:
                self.result.events = []
        return self.result

    def propagate(self, ta, t):
        ta.propagate_until(t)
        outcomes = [r[0] for r in ta.propagate_res] if self.width else []
        if any(outcome != hy.taylor_outcome.time_limit for outcome in outcomes):
            raise RuntimeError(f"heyoka stopped: {outcomes}")


def prepare(case, setting):
    form, width, tolerance = setting.split(":")
    if case == "p2" and width != "single":
        raise SystemExit("P2 is one motion: a batch does not apply")
    solver = Solver(form, width, float(tolerance), case == "p3")
    return solver.extrema if case == "p3" else solver.trajectory


if __name__ == "__main__":
    main(prepare)
