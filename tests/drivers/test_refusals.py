"""What a schema cannot refuse is refused in one line where the input is read, each of these messages once."""

from pathlib import Path

import pytest
from programs import start

LINE = "&mass name='m', value=1.0 /\n&spring between='m','frame', stiffness=100.0 /\n"
MOTION = "&motion t_end=1.0, start='zero' /\n"
SHAFT = (
    "&shaft name='r', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0 /\n"
    "&section shaft='r', length=1.0, outer_diameter=0.05, elements=4 /\n"
)
HELD = (
    "&bearing shaft='r', node=5, kind='matrix', stiffness=1e7,0.0,0.0,1e7 /\n"
    "&support shaft='r', node=1, held='u','v','w','phi' /\n"
)
SECOND = SHAFT.replace("'r'", "'q'")
BALL = "kind='ball', elements=8, element_load=10.0, young_modulus=2.1e11, poisson_ratio=0.3, outer_groove=5.2e-3"
GEARS = "&inertia name='a', value=1.0 /\n&inertia name='b', value=1.0 /\n&spring between='a','frame', stiffness=1.0 /\n"
MESH = "&gear_mesh name='g', between='a','b', radius=0.1,0.1, teeth=20,20"
PUSH = "&load on='m', amplitude=1.0, frequency=1.0 /\n"
STOP = "&stop name='s', between='m','frame', clearance=0.1"
FIXED = "held='u','v','w','phi','theta','psi'"
ROW = ", {0}, 0, 0, {0}, 1, 0, 0, 1\n"
TABLE = "speed_rpm, kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy\n0" + ROW + "2000" + ROW

# the program, what the input says, words of the message
REFUSED = [
    ("razy-run", LINE + MOTION +
      "&spring between='m','frame', law='table', displacement=0.0,1.0, force=0.0,1.0, damping=2.0 /",
      "0 with law = 'table', which has line_damping"),
    ("razy-run", LINE + MOTION + STOP + ", law='rigid', restitution=0.5, damping_factor=1e-3 /",
      "only with law = 'kelvin_voigt'"),
    ("razy-run", LINE + MOTION + STOP + ", law='rigid', restitution=0.5 /\n" + "&damping factor=1e-3, matrix='all' /",
      "a law that is no spring"),
    ("razy-run", LINE + MOTION + "&record observable='contact_force', of='all', what='statistics' /",
      "this needs a contact"),
    ("razy-run", LINE + "&motion t_end=1.0, integrator='moreau_jean', step=1e-3, lyapunov=1 /", "0 with this method"),
    ("razy-run", MOTION + "&body name='b', mass=1.0, inertia=1.0, held='x','y','phi' /",
      "not all coordinates there are"),
    ("razy-run", LINE + MOTION +
      "&friction name='f', between='m','frame', static_coefficient=0.1, normal_load=1.0, radius=0.1 /",
      "left out without shafts"),
    ("razy-run", MOTION + "&body name='b', mass=1.0, inertia=1.0 /\n" +
      "&ring name='h', between='b','frame', clearance=0.1, stiffness=1.0 /\n" +
      "&friction name='f', between='b','frame', static_coefficient=0.1, normal_contact='h', " + "direction=1.0,0.0 /",
      "where the element rubs on a ring"),
    ("razy-run", LINE + MOTION + "&load on='m', shape='half_sine', duration=0.1 /", "required with a shape or file"),
    ("razy-run", MOTION + "&inertia name='i', value=1.0 /\n" +
      "&rotation speed_rpm=100.0, acceleration_rpm_per_s=10.0, of='i' /\n" +
      "&load on='i', shape='square', amplitude=1.0, order=1.0 /", "a sine where &rotation has an acceleration"),
    ("razy-run", GEARS + MOTION + MESH + ", stiffness=1e6, damping_acts='always', back_damping=1.0 /",
      "left out with damping_acts = 'always'"),
    ("razy-run", GEARS + MOTION + MESH + ", stiffness=1e6, damping_acts='limited', slope_in_backlash=0.1 /",
      "'in_contact' or 'always' with a slope"),
    ("razy-run", GEARS + MOTION + MESH + ", stiffness=1e6, pair_ratio=1.5 /", "left out without contact_ratio"),
    ("razy-run", GEARS + MOTION + MESH + ", stiffness=1e6, mesh_phase=90.0 /", "where the stiffness does not vary"),
    ("razy-run", GEARS + MOTION + MESH + ", stiffness=1e6, error_harmonics=3 /", "left out without error_file"),
    ("razy-run", LINE + MOTION +
      "&friction name='f', between='m','frame', static_coefficient=0.2, normal_load=1.0, decay_law='exponential' /",
      "left out without decay"),
    ("razy-run", SHAFT + HELD + MOTION + "&reduction modes=3, kept=2 /", "&reduction kept = 2: left out without level"),
    ("razy-modes", SHAFT + HELD + "&reduction modes=3, sorting='signed' /",
      "&reduction sorting = 'signed': left out without level"),
    ("razy-run", GEARS + MOTION + MESH + ", stiffness=1e6, drive='negative' /",
      "and drive = 'positive', between inertias"),
    ("razy-run", GEARS + MOTION +
      "&gear_mesh name='g', between='a','b', radius=0.1,0.1, teeth=3,3, width=0.01, helix_angle=45.0 /",
      "teeth of which the next come into mesh"),
    ("razy-duel", LINE + MOTION, "required: a method that is set beside others"),
    ("razy-duel", LINE + MOTION + "&duel integrator='dormand_prince', treatment='smoothing', tolerance=1e-3,1e-4, " +
      "sharpness=1e5,1e6,1e7 /", "one value, or as many"),
    ("razy-tune", LINE + "&tune parameter='mass%value', first=1.0, last=2.0, mode=2, frequency=1.0 /",
      "mode = 2: 1 to 1"),
    ("razy-tune", GEARS + MESH + ", stiffness=1e6 /\n" +
      "&tune parameter='gear_mesh%teeth(1)', first=20, last=30, mode=1, frequency=1.0 /",
      "a real number: frequencies change"),
    ("razy-modes", GEARS + MESH + ", stiffness=1e6 /\n" + "&load on='a', amplitude=1.0, frequency=1.0 /\n" +
      "&response parameter='gear_mesh%teeth(1)', first=20, last=30, points=3 /\n" +
      "&record observable='displacement', of='a', what='extrema' /", "a real number"),
    ("razy-modes", "&inertia name='i', value=1.0 /\n" +
      "&rotation speed_rpm=100.0, acceleration_rpm_per_s=10.0, of='i' /\n" +
      "&load on='i', amplitude=1.0, frequency=1.0 /\n" +
      "&response parameter='load%frequency', first=1.0, last=2.0, points=3 /\n" +
      "&record observable='displacement', what='extrema' /", "0 for &response"),
    ("razy-sweep", LINE + PUSH + MOTION +
      "&sweep parameter='load%frequency', first=1.0, last=2.0, points=1000000000 /\n" +
      "&sweep parameter='load%amplitude', first=1.0, last=2.0, points=1000000000 /\n" +
      "&record observable='displacement', what='extrema' /", "fewer points"),
    ("razy-sweep", LINE + PUSH + MOTION + "&sweep parameter='load%frequency', first=1.0, last=2.0, points=2 /\n" +
      "&record observable='displacement', what='extrema' /\n" +
      "&starts method='grid', period=1.0, longest_period=1 /\n" +
      "&start_range coordinate='m', first=0.0, last=1.0, points=1000000000 /\n" +
      "&start_range coordinate='m', quantity='velocity', first=0.0, last=1.0, points=1000000000 /",
      "fewer: the grid of starts"),
    ("razy-sweep", LINE + PUSH + MOTION + "&sweep parameter='load%frequency', first=1.0, last=2.0, points=2 /\n" +
      "&record observable='displacement', what='extrema' /\n" +
      "&starts method='grid', period=1.0, longest_period=1 /\n" +
      "&start_range coordinate='m', first=0.0, last=0.0, points=3 /", "the values from first to last would coincide"),
    ("razy-run", SHAFT + HELD + MOTION + "&housing name='h', mass=1.0 /\n" +
      "&bearing shaft='r', node=3, to='h', kind='table', file='soft.csv' /", "left out with kind = 'table'"),
    ("razy-run", SHAFT + HELD + MOTION + "&bearing shaft='r', node=3, kind='table', file='soft.csv' /",
      "required by the table of bearing 2"),
    ("razy-run", SHAFT + HELD + MOTION +
      "&bearing shaft='r', node=3, ball_diameter=0.1, pitch_diameter=0.05, inner_groove=5.2e-3, " + BALL + " /",
      "more than the diameter of the balls"),
    ("razy-run", SHAFT + HELD + MOTION +
      "&bearing shaft='r', node=3, ball_diameter=0.01, pitch_diameter=0.05, inner_groove=4.0e-3, " + BALL + " /",
      "grooves of a radius more than"),
    ("razy-run",
      "&shaft name='rrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrr', young_modulus=2.1e11, poisson_ratio=0.3, " +
      "density=7800.0 /\n" +
      "&section shaft='rrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrrr', length=1.0, outer_diameter=0.05, " +
      "elements=4 /\n" + MOTION, "a name of at most 40 characters"),
    ("razy-run", SHAFT + HELD + MOTION + "&housing name='hhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhhh', mass=1.0 /",
      "a name of at most 40 characters"),
    ("razy-run", "&shaft name='r', young_modulus=2.1e11, poisson_ratio=0.3, damping_ratio=0.01, damping='modal', " +
      "density=7800.0 /\n" + "&section shaft='r', length=1.0, outer_diameter=0.05, elements=4 /\n" +
      "&shaft name='q', young_modulus=2.1e11, poisson_ratio=0.3, damping_ratio=0.01, damping='nodal', " +
      "density=7800.0 /\n" + "&section shaft='q', length=1.0, outer_diameter=0.05, elements=4 /\n" + HELD + MOTION,
      "the same for all shafts with damping"),
    ("razy-run", "&shaft name='r', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0 /\n" +
      "&section shaft='r', length=1.0, outer_diameter=0.05, elements=1 /\n" + "&support shaft='r', node=1, " + FIXED +
      " /\n" + "&support shaft='r', node=2, " + FIXED + " /\n" + MOTION, "not all coordinates there are"),
    ("razy-run", SHAFT + HELD + MOTION + "&spring between='r.3','frame', direction=0.0,1.0,0.0, stiffness=1e20 /",
      "&spring stiffness = "),
    ("razy-run", SHAFT + HELD + MOTION + "&rotation speed_rpm=1000.0 /\n" +
      "&bearing shaft='r', node=3, kind='table', file='hard.csv' /", "file = 'hard.csv': at most 1e6"),
    ("razy-run", SHAFT + HELD + "&reduction modes=4 /\n" + "&motion t_end=1.0, start='given' /\n" +
      "&initial on='r.3.v' /", "leave one of the two out"),
    ("razy-run", SHAFT + HELD + MOTION + "&record observable='displacement', what='extrema' /",
      "required: a coordinate such as 'r.1.theta'"),
    ("razy-run", SHAFT + HELD + MOTION +
      "&bearing shaft='r', node=1, kind='rolling', elements=8, radial_stiffness=1e6, clearance=1e-5, " +
      "cage_ratio=0.4 /", "one that can move across the axis"),
    ("razy-run", SHAFT + HELD + SECOND + "&support shaft='q', node=1, " + FIXED + " /\n" +
      "&rotation speed_rpm=1000.0, of='r' /\n" + MOTION +
      "&friction name='f', between='q.5','frame', direction=0.0,1.0,0.0, radius=0.1, " +
      "static_coefficient=0.1, normal_load=1.0 /", "speed is not known"),
    ("razy-run", SHAFT + HELD + MOTION + "&reduction method='craig_bampton', modes=100 /",
      "0 to its 20 coordinates between bearings and gears"),
    ("razy-modes", "&shaft name='r', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0 /\n" +
      "&section shaft='r', length=1.0, outer_diameter=0.05, elements=4, torque=1e9 /\n" + HELD,
      "the shaft is near to buckling"),
    ("razy-run", SHAFT.replace("7800.0", "0.0") + HELD + MOTION + "&rotation speed_rpm=1000.0 /\n" +
      "&disk shaft='r', node=3, mass=1.0, polar_inertia=0.1, diametral_inertia=0.1 /\n" +
      "&bearing shaft='r', node=2, kind='table', file='soft.csv' /", "only springs may act on it"),
]  # fmt: skip


@pytest.mark.parametrize(("program", "text", "says"), REFUSED)
def test_refused(program, text, says):
    Path("bad.nml").write_text(text + "\n")
    Path("soft.csv").write_text(TABLE.format(1e6))
    Path("hard.csv").write_text(TABLE.format(1e20))
    done = start(program, "bad.nml")
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("bad.nml") and says in done.stderr, done.stderr
