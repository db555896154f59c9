"""The torsional gear pair in plain floats, and the output format and command line that the Python peers share."""

import math
import sys
import time
from dataclasses import dataclass, field

INERTIA = (0.1, 0.00794, 0.00794, 0.1)
SHAFT = 6.2905e4
DAMPING_FACTOR = 5e-4
RADIUS = 0.08
MESH = 8e8
BACKLASH = 1e-4
ERROR_SINE = 5e-5
TEETH = 40
TORQUE = 100.0

P2_END, P2_POINTS = 0.2, 2001
P3_FROM, P3_END = 0.25, 0.3


def mesh_frequency(rpm):
    """Circular tooth frequency, rad/s."""
    return TEETH * math.pi * rpm / 30.0


def static_equilibrium():
    """Angles under the constant torque, rad: it passes through both shafts and the closed mesh."""
    twist = TORQUE / SHAFT
    closing = TORQUE / (MESH * RADIUS**2)
    return [closing / 2 + twist, closing / 2, -closing / 2, -closing / 2 - twist]


@dataclass
class Result:
    """What a peer hands back: extrema (speed, time, value, kind), events (time), samples (time, d), cost."""

    extrema: list = field(default_factory=list)
    events: list = field(default_factory=list)
    samples: list = field(default_factory=list)
    event_count: int | None = None
    cpu: float = 0.0
    process: float | None = None

    def write(self, path):
        with open(path, "w", encoding="ascii") as out:
            out.writelines(f"x {float(n)!r} {float(t)!r} {float(d)!r} {int(kind)}\n" for n, t, d, kind in self.extrema)
            out.writelines(f"e {float(t)!r}\n" for t in self.events)
            out.writelines(f"d {float(t)!r} {float(d)!r}\n" for t, d in self.samples)
            out.write(f"# cpu {self.cpu:.6f}\n")
            if self.process is not None:
                out.write(f"# process {self.process:.6f}\n")
            if self.event_count is not None:
                out.write(f"# events {self.event_count}\n")


def main(prepare):
    """Run `case setting first last step output`; `prepare(case, setting)` returns the function that is timed."""
    if len(sys.argv) != 7 or sys.argv[1] not in ("p2", "p3"):
        sys.exit(f"usage: {sys.argv[0]} p2|p3 SETTING FIRST LAST STEP OUTPUT")
    case, setting = sys.argv[1:3]
    first, last, step = (float(x) for x in sys.argv[3:6])
    speeds = [first + i * step for i in range(round((last - first) / step) + 1)]
    compute = prepare(case, setting)
    start = time.process_time()
    result = compute(speeds)
    result.cpu = time.process_time() - start
    result.write(sys.argv[6])
