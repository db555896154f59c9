"""What a program says of a model that does not hold for what is asked of it."""

import math
import re

import pytest
from programs import SOURCE, plot, sets, succeed

BLOCK = """&scene kind='planar' /
&body name='b', mass=1.0, inertia=0.0867, centre=0.0,0.5 /
&point name='l', body='b', position=-{half},-0.5 /
&point name='r', body='b', position={half},-0.5 /
&gravity acceleration=9.81 /
&stop name='sl', between='l','frame', direction=0.0,1.0, law='rigid', restitution=0.0 /
&stop name='sr', between='r','frame', direction=0.0,1.0, law='rigid', restitution=0.0 /
&friction name='fl', between='l','frame', normal_contact='sl', static_coefficient=10.0 /
&friction name='fr', between='r','frame', normal_contact='sr', static_coefficient=10.0 /
{spring}&motion t_end=2.0, start='given' /
&initial on='b.phi', displacement={angle} /
&initial on='b.y', displacement={lift} /
&initial on='b.x', displacement={shift} /
&record observable='state', what='trajectory', interval=0.01 /
"""


def said_of_a_block(folder, angle, half, spring="", block=BLOCK):
    text = block.format(half=half, angle=angle, lift=half * angle, shift=-0.5 * angle, spring=spring)
    (folder / "block.nml").write_text(text)
    return succeed("razy-run", "block.nml", "--output", "block.h5", "--force").stderr


def test_a_body_that_turns_far(folder):
    """5 % of the angle b/h at which the block topples, and 0.05 rad at most."""
    assert "'b.phi' goes to 2.10E-02 rad, beyond 2.00E-02 rad" in said_of_a_block(folder, 0.021, half=0.2)
    assert "beyond" not in said_of_a_block(folder, 0.019, half=0.2)
    assert "beyond 5.00E-02 rad" in said_of_a_block(folder, 0.051, half=0.6)
    assert "beyond" not in said_of_a_block(folder, 0.049, half=0.6)
    spring = "&spring between='l','frame', direction=0.0,1.0, stiffness=1.0 /\n"
    assert "beyond" not in said_of_a_block(folder, 0.021, half=0.2, spring=spring)
    turned = re.sub(r"'([lr])','frame', direction=0.0,1.0", r"'frame','\1', direction=0.0,-1.0", BLOCK)
    assert turned != BLOCK
    assert "'b.phi' goes to 2.10E-02 rad, beyond 2.00E-02 rad" in said_of_a_block(folder, 0.021, half=0.2, block=turned)


@pytest.mark.parametrize("stops", [2, 3, 8])
@pytest.mark.parametrize("kind", ["planar", "rotor"])
def test_stops_around_a_place(folder, kind, stops):
    if kind == "planar":
        lines = ["&scene kind='planar' /", "&body name='r', mass=1.0, inertia=1.0 /"]
        lines += [f"&spring between='r','frame', direction={d}, stiffness=1e5, damping=10.0 /" for d in ("1,0", "0,1")]
        lines += ["&load on='r.x', amplitude=1.0, frequency=3.0 /"]
        place, record = "r", "of='r.x'"
    else:
        lines = [
            "&scene kind='rotor' /",
            "&freedom axial=.false., torsion=.false. /",
            "&shaft name='r', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0 /",
            "&section shaft='r', length=0.4, outer_diameter=0.02, elements=2 /",
            "&rotation speed_rpm=600.0 /",
            "&unbalance shaft='r', node=2, moment=1e-4 /",
        ]
        lines += [f"&bearing shaft='r', node={i}, kind='matrix', stiffness=1e7,0.0,0.0,1e7 /" for i in (1, 3)]
        place, record = "r.2", "of='r.2.v'"
    for i in range(stops):
        a = 2 * math.pi * i / stops
        direction = f"{'0.0,' if kind == 'rotor' else ''}{math.cos(a)},{math.sin(a)}"
        lines.append(
            f"&stop name='s{i}', between='{place}','frame', direction={direction}, clearance=1e-4, stiffness=1e6 /"
        )
    lines += ["&motion t_end=0.1, start='zero' /", f"&record observable='displacement', {record}, what='extrema' /"]
    (folder / "ring.nml").write_text("\n".join(lines) + "\n")
    said = succeed("razy-run", "ring.nml", "--output", "ring.h5").stderr
    assert (f"{stops} stops around {place} and frame" in said) == (stops > 2)


UNDAMPED = """&scene kind='lumped' /
&mass name='m', value=1.0 /
&spring between='m','frame', stiffness=1e4, damping={damping} /
&load on='m', amplitude=1.0, frequency=10.0 /
&record observable='displacement', of='m', what='extrema' /
&motion t_end=1.0 /
&modes /
&response parameter='load%frequency', first=5.0, last=30.0, points=101 /
"""


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_a_peak_that_nothing_damps(folder, damping):
    (folder / "peak.nml").write_text(UNDAMPED.format(damping=damping))
    said = succeed("razy-modes", "peak.nml", "--output", "peak.h5")
    assert ("nothing damps it" in said.stdout + said.stderr) == (damping == 0)
    assert ("amplification factor 99.99" in said.stdout + said.stderr) == (damping == 1)


@pytest.mark.parametrize("points", [10, 11])
def test_a_resonance_that_nothing_damps_at_one_of_the_points(folder, points):
    """It is one peak, whether the matrix is singular at a point, as here at 10 rad/s, or between points."""
    lines = [
        "&scene kind='lumped' /",
        "&mass name='m', value=1.0 /",
        "&mass name='apart', value=1.0 /",
        "&spring between='m','frame', stiffness=100.0 /",
        "&spring between='apart','frame', stiffness=400.0, damping=1.0 /",
        "&load on='m', amplitude=3.0, angular_frequency=1.0 /",
        "&load on='apart', amplitude=3.0, angular_frequency=1.0 /",
        *(f"&record observable='displacement', of='{of}', what='extrema' /" for of in ("m", "apart")),
        "&modes /",
        "&response parameter='load(1)%angular_frequency','load(2)%angular_frequency', factor=1.0,1.0, "
        f"first=5.0, last=15.0, points={points} /",
    ]
    (folder / "at_point.nml").write_text("\n".join(lines) + "\n")
    said = succeed("razy-modes", "at_point.nml", "--output", "at_point.h5").stdout
    assert said.count("peak of") == 1
    assert said.count("peak of displacement.m at 10.000 rad/s") == said.count("nothing damps it") == 1


@pytest.mark.parametrize(("damping", "points"), [(0.0, 11), (0.02, 3), (0.02, 11)])
def test_a_peak_where_the_frequencies_of_two_loads_meet(folder, damping, points):
    """There is one tone less right at this point; the peak there is one, not one on either side of it."""
    lines = [
        "&scene kind='lumped' /",
        "&mass name='m', value=1.0 /",
        f"&spring between='m','frame', stiffness=1.0, damping={damping} /",
        "&load on='m', amplitude=1.0, angular_frequency=0.7 /",
        "&load on='m', amplitude=1.0, angular_frequency=1.0 /",
        "&record observable='displacement', what='extrema' /",
        f"&response parameter='load(1)%angular_frequency', first=0.5, last=1.5, points={points} /",
    ]
    (folder / "meet.nml").write_text("\n".join(lines) + "\n")
    said = succeed("razy-modes", "meet.nml", "--output", "meet.h5").stdout
    assert said.count("peak of displacement at 1.000 rad/s") == said.count("peak") == 1
    assert ("nothing damps it" in said) == (damping == 0)
    assert ("5.000E+01 m, amplification factor 49.99" in said) == (damping > 0)


@pytest.mark.parametrize(("first", "last"), [(5.0, 10.0), (10.0, 15.0), (5.0, 10.1), (9.9, 15.0)])
@pytest.mark.parametrize("order", [1.0, 2.0])
def test_a_resonance_at_an_end_of_the_range(folder, first, last, order):
    """It is a peak right at the end, and between the last two points, of excitations that rotate, of any order, too."""
    lines = [
        "&scene kind='lumped' /",
        "&inertia name='wheel', value=1.0 /",
        "&spring between='wheel','frame', stiffness=100.0 /",
        f"&load on='wheel', amplitude=3.0, order={order} /",
        f"&rotation speed_rpm={10.0 / order * 30 / math.pi!r}, of='wheel' /",
        "&record observable='displacement', what='extrema' /",
        f"&response parameter='rotation%speed_rpm', first={first / order * 30 / math.pi!r}, "
        f"last={last / order * 30 / math.pi!r}, points=7 /",
    ]
    (folder / "end.nml").write_text("\n".join(lines) + "\n")
    said = succeed("razy-modes", "end.nml", "--output", "end.h5").stdout
    assert said.count(f"peak of displacement at {10.0 / order * 30 / math.pi:.3f} rpm") == said.count("peak") == 1
    assert said.count("nothing damps it") == 1
    # An amplitude that grows up to the end has none.
    apart = sets(response__last=9.9 / order * 30 / math.pi, response__first=1.0)
    assert "no peak" in succeed("razy-modes", "end.nml", *apart, "--output", "apart.h5").stdout


def test_a_trajectory_that_is_too_coarse_for_an_excitation(folder):
    """Two values in a period of the fastest tone: 40 teeth at 1500 rpm, and at the 2000 rpm that a run-up comes to."""
    case = SOURCE / "inputs" / "torsional_gear_pair.nml"
    record = sets(motion__t_end=0.1, record__from=0, record__what="'trajectory'")
    for period, coarse in ((1.01, True), (0.99, False)):
        interval = sets(record__interval=period / 2 / 1000)
        done = succeed("razy-run", case, *record, *interval, "--output", "run.h5", "--force")
        checked = succeed("razy-run", case, *record, *interval, "--check")
        for said in (done.stderr, checked.stderr):
            assert ("in a period of the fastest excitation, 1000.0 Hz" in said) == coarse, said
    up = sets(
        record__interval=1e-3, rotation__acceleration_rpm_per_s=500, motion__integrator="'dop853'", motion__t_end=1
    )
    assert "excitation, 1333.3 Hz" in succeed("razy-run", case, *record, *up, "--output", "up.h5").stderr
    done = plot("up.h5", "--kind", "ordermap", "--save", "up.png")
    assert done.returncode == 0
    assert re.search(
        "note: fewer than two stored times .* excitation, 1333.3 Hz, .* interval below 0.000375 s ", done.stderr
    )


@pytest.mark.parametrize(
    ("kept", "said"), [(1, "1 of 2 modes of 1652.6 Hz"), (2, ""), (3, "1 of 2 modes of 4478.0 Hz"), (4, "")]
)
def test_a_reduction_that_parts_modes_of_equal_gear_pairs(folder, kept, said):
    """Two pairs that differ in their names alone: the deformation of a mesh is that of the other but for rounding."""
    lines = ["&freedom axial=.false., bending=.false. /", f"&reduction modes=2, level='b', kept={kept} /"]
    lines += ["&motion t_end=0.01, start='zero' /", "&rotation speed_rpm=100.0, of='a' /"]
    for name, diameter, inertia in (("a", 0.025, 1.25e-3), ("b", 0.03, 5e-3), ("d", 0.03, 5e-3), ("c", 0.025, 1.25e-3)):
        lines += [
            f"&shaft name='{name}', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0 /",
            f"&section shaft='{name}', length=0.4, outer_diameter={diameter}, elements=2 /",
            f"&disk shaft='{name}', node=3, mass=1.0, polar_inertia={inertia}, diametral_inertia=1.0e-3 /",
            f"&support shaft='{name}', node=1, held='phi' /",
        ]
    for name, between in (("m", "'a','b'"), ("n", "'c','d'")):
        ends = f"name='{name}', between={between}, node=3,3, radius=0.05,0.1"
        lines.append(f"&gear_mesh {ends}, teeth=20,40, stiffness=3.0e7 /")
    (folder / "pairs.nml").write_text("\n".join(lines))
    caution = re.findall(r"1 of 2 modes of [\d.]+ Hz", succeed("razy-run", "pairs.nml").stderr)
    assert caution == [said] * bool(said)
