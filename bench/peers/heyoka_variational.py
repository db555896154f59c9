"""Peer: heyoka, one period of the gear pair's motion after the other, with the derivative of each by its start.

    heyoka_variational.py SPEED PERIODS

The variational equations of first order (hy.var_ode_sys) in the two relative angles; terminal events at every change of
contact. The force is continuous there, so the derivative goes on as it is. It begins anew with each period. Prints the
processor time of the motion alone and with its derivative, compilation left out, and the moduli of the eigenvalues of
the last derivative.
"""

import sys
import time

import heyoka as hy
import heyoka_taylor
import numpy as np
from gear_pair import BACKLASH, MESH, mesh_frequency


class Follower:
    """The gear pair, with or without its variational equations."""

    def __init__(self, derivative):
        system, d, _, self.start, _ = heyoka_taylor.relative_model()
        self.derivative = derivative
        if derivative:
            system = hy.var_ode_sys(system, hy.var_args.vars, order=1)
        view = []
        watched = [
            hy.t_event(gap, callback=self.change(bound, view), cooldown=heyoka_taylor.COOLDOWN)
            for bound, gap in enumerate((d, d + BACKLASH))
        ]
        self.integrator = hy.taylor_adaptive(system, self.start, pars=[0.0, MESH, 0.0], t_events=watched)
        view.append(self.integrator.pars)

    @staticmethod
    def change(bound, view):
        up, down = heyoka_taylor.CONTACT[1 - bound], heyoka_taylor.CONTACT[-bound]

        def callback(_, sign):
            view[0][1], view[0][2] = up if sign > 0 else down
            return True

        return callback

    def run(self, speed, periods):
        """Processor time, s, and the derivative of the last period."""
        omega = mesh_frequency(speed)
        one, state = self.integrator, self.integrator.state
        one.reset_cooldowns()
        state[:4] = self.start
        one.pars[:] = [omega, MESH, 0.0]
        begun = time.process_time()
        for _ in range(periods):
            if self.derivative:
                state[4:] = np.eye(4).ravel()
            one.time = 0.0
            one.propagate_until(2 * np.pi / omega)
        return time.process_time() - begun, state[4:].copy()


def main():
    speed, periods = float(sys.argv[1]), int(sys.argv[2])
    print("motion", Follower(False).run(speed, periods)[0])
    seconds, derivative = Follower(True).run(speed, periods)
    print("derivative", seconds)
    print("moduli", *sorted(np.abs(np.linalg.eigvals(derivative.reshape(4, 4)))))


if __name__ == "__main__":
    main()
