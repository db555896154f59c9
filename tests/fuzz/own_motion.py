"""What a motion of the second opinion is known to: its machine, sizes and rounding of its terms."""

import numpy as np
from hybrid_machine import Machine, Mode

EPS = np.finfo(float).eps


class GaveUpError(Exception):
    """The motion has too many events, or no mode was found that obeys the laws."""


class Motion:
    """One motion. `disturbed`: velocities are known to 1e-12 at events, gaps to 1e-14, and sequences end earlier.

    Gaps of less than `joins` roundings are closed together.
    """

    def __init__(self, text, most_events=20000, most_steps=400000, disturbed=False, joins=64):
        self.machine = Machine(text)
        self.most_events, self.most_steps = most_events, most_steps
        self.coarse = 20.0 if disturbed else 1.0
        self.joins = joins
        self.random = np.random.default_rng(1) if disturbed else None
        self.modes = {}
        self.events, self.struck = [], []
        self.size = np.zeros(self.machine.size)
        self.pulls = np.abs(self.machine.free)
        self.shortest = 0.25 / max(np.max(np.abs(np.linalg.eigvals(self.machine.free))), 1e-3)

    def mode(self, branches):
        key = tuple(branches)
        if key not in self.modes:
            self.modes[key] = Mode(self.machine, key)
        return self.modes[key]

    def noise(self, form, x):
        """What a form is known to."""
        return self.joins * EPS * (np.abs(form) @ self.sizes(x))

    def sizes(self, *states):
        """Sizes of the terms of a form; a speed has the rounding of all, and of forces also where others take them."""
        sizes = np.maximum(np.max(np.abs(states), axis=0), self.size)
        speeds = slice(self.machine.n, 2 * self.machine.n)
        sizes[speeds] = max(np.max(sizes[speeds]), self.shortest * np.max(self.pulls[speeds] @ sizes))
        return sizes

    def disturb(self, x):
        """Change velocities by 1e-12 of themselves."""
        if self.random is not None:
            n = self.machine.n
            x[n : 2 * n] *= 1.0 + 1e-12 * self.random.uniform(-1.0, 1.0, n)
