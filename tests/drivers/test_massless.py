"""Shafts without mass: the rotors of Laval, Jeffcott and Stodola against closed forms and assemblies."""

import numpy as np
import pytest
from programs import start, succeed, values_of
from scipy.linalg import eigvals
from test_housing import rayleigh_beam

E, LENGTH, DIAMETER, MASS = 2.1e11, 0.8, 0.02, 5.0
SECOND = np.pi * DIAMETER**4 / 64
STIFFNESS = 48 * E * SECOND / LENGTH**3
PINNED = """&support shaft='r', node=1, held='v','w' /
&support shaft='r', node=5, held='v','w' /
"""
BENDING = "&freedom axial=.false., torsion=.false. /\n"


def rotor(more, elements=4, disk=3, inertia=(0.0, 0.0), freedom=BENDING):
    return f"""&scene kind='rotor' /
&shaft name='r', young_modulus={E}, shear_modulus=8e10, density=0.0 /
&section shaft='r', length={LENGTH}, outer_diameter={DIAMETER}, elements={elements} /
&disk shaft='r', node={disk}, mass={MASS}, polar_inertia={inertia[0]}, diametral_inertia={inertia[1]} /
{freedom}{more}"""


def result(program, text, name="case"):
    with open(f"{name}.nml", "w") as file:
        file.write(text)
    succeed(program, f"{name}.nml", "--force")
    return values_of(f"{name}.h5")


@pytest.mark.parametrize("kind", ["rayleigh", "timoshenko"])
def test_laval(folder, kind):
    """omega² = 48 E J/(m L³); with shear 1/(m (L³/(48 E J) + L/(4 kappa G A)))."""
    text = rotor(PINNED + "&modes count=6 /\n").replace("density=0.0", f"density=0.0, element='{kind}'")
    found = result("razy-modes", text)
    nu = E / 16e10 - 1
    shear = LENGTH / (4 * 6 * (1 + nu) / (7 + 6 * nu) * 8e10 * np.pi * DIAMETER**2 / 4)
    right = 1 / np.sqrt(MASS * (1 / STIFFNESS + (shear if kind == "timoshenko" else 0.0))) / (2 * np.pi)
    assert found["natural_frequency"] == pytest.approx([right, right], rel=1e-12)


def test_two_bearings_of_springs(folder):
    bearings = "".join(
        f"&bearing name='b{n}', shaft='r', node={n}, kind='matrix', stiffness=3.0e5,0.0,0.0,7.0e5 /\n" for n in (1, 5)
    )
    text = rotor(bearings + "&modes count=2 /\n")
    right = [1 / np.sqrt(MASS * (1 / STIFFNESS + 1 / (2 * k))) / (2 * np.pi) for k in (3e5, 7e5)]
    assert result("razy-modes", text)["natural_frequency"] == pytest.approx(right, rel=1e-12)
    # Weight, and half of it in each bearing; the place beside the disk hangs by springs and half of the beam's 11/16.
    motion = "&gravity direction=0.0,-1.0,0.0 /\n&motion t_end=0.01, start='static' /\n"
    for kind, of in (("displacement", "r.3.v"), ("displacement", "r.2.v"), ("connection_force", "b1.v")):
        motion += f"&record observable='{kind}', of='{of}', what='extrema' /\n"
    found = result("razy-run", rotor(bearings + motion), "run")
    weight = MASS * 9.80665
    spring = weight / 6e5
    right = {
        "displacement.r.3.v": -spring - weight / STIFFNESS,
        "displacement.r.2.v": -spring - 11 / 16 * weight / STIFFNESS,
        "connection_force.b1.v": -weight / 2,
    }
    for name, value in right.items():
        assert found[f"extrema/{name}/value"] == pytest.approx(value, rel=1e-11), name


@pytest.mark.parametrize("speed", [0.0, 150.0, 2000.0])
def test_overhung_disk(folder, speed):
    """Stodola: compliance (L³/3, L²/2; L²/2, L)/(E J), gyroscopic moment of the disk; forward and backward whirl."""
    inertia = (0.08, 0.05)
    held = "&support shaft='r', node=1, held='v','w','theta','psi' /\n"
    rpm = speed * 30 / np.pi
    more = f"&modes count=8 /\n&rotation speed_rpm={rpm!r} /\n"
    more += f"&campbell first_rpm={rpm!r}, last_rpm={rpm + 1!r}, points=2 /\n"
    found = result("razy-modes", rotor(held + more, disk=5, inertia=inertia))["eigenvalue"][0]
    stiffness = np.linalg.inv(np.array([[LENGTH**3 / 3, LENGTH**2 / 2], [LENGTH**2 / 2, LENGTH]]) / (E * SECOND))
    right = whirl(np.diag([MASS, inertia[1]]), np.diag([0.0, inertia[0]]), stiffness, speed)
    assert compare(found, right) == 4


def test_shaft_of_which_a_part_has_no_mass(folder):
    """Disks, springs, a heavy section beside a massless one: eigenvalues with all coordinates kept."""
    text = f"""&scene kind='rotor' /
&shaft name='r', young_modulus={E}, shear_modulus=8e10, density=7850.0 /
&section shaft='r', length={LENGTH / 2}, outer_diameter={DIAMETER}, elements=3 /
&section shaft='r', length={LENGTH / 2}, outer_diameter={DIAMETER}, elements=3, density=0.0 /
&disk shaft='r', node=6, mass={MASS}, polar_inertia=0.05, diametral_inertia=0.03 /
&disk shaft='r', node=7, mass=0.4, polar_inertia=0.0, diametral_inertia=0.0 /
&bearing shaft='r', node=1, kind='matrix', stiffness=2e6,0.0,0.0,2e6, damping_matrix=300.0,0.0,0.0,300.0 /
&bearing shaft='r', node=5, kind='matrix', stiffness=1e6,0.0,0.0,1e6 /
{BENDING}&modes count=30 /
&rotation speed_rpm=3000.0 /
&campbell first_rpm=3000.0, last_rpm=3001.0, points=2, damped=.true. /
"""
    found = result("razy-modes", text)["eigenvalue"][0]
    beam = rayleigh_beam(LENGTH, DIAMETER, 6, E, 7850.0)
    half = rayleigh_beam(LENGTH / 2, DIAMETER, 3, E, 7850.0)
    mass, spin, stiffness, damping = np.zeros((14, 14)), np.zeros((14, 14)), beam[1], np.zeros((14, 14))
    mass[:8, :8], spin[:8, :8] = half[0], half[2]
    mass[10, 10], mass[11, 11], spin[11, 11], mass[12, 12] = MASS, 0.03, 0.05, 0.4
    stiffness[0, 0] += 2e6
    stiffness[8, 8] += 1e6
    damping[0, 0] = 300.0
    right = whirl(mass, spin, stiffness, 100 * np.pi, damping)
    assert compare(found, right) >= 20


def whirl(mass, spin, stiffness, speed, damping=0.0):
    """Return the finite eigenvalues of both directions; time is in ms, so that entries are of one size."""
    n, ms = len(mass), 1e-3
    zero, one = np.zeros((n, n)), np.eye(n)
    above, below = np.concatenate([
        eigvals(np.block([[zero, one], [-stiffness * ms**2, -(damping - 1j * turn * speed * spin) * ms]]),
                np.block([[one, zero], [zero, mass]]), homogeneous_eigvals=True)
        for turn in (1, -1)
    ], axis=1)  # fmt: skip
    finite = abs(below) > 0
    return above[finite] / below[finite] / ms


def compare(found, right):
    """How many eigenvalues were found; each is one of the right ones."""
    found = found[:, 0] + 1j * found[:, 1]
    found = found[np.isfinite(found)]
    for value in found:
        assert np.abs(right - value).min() < 1e-10 * abs(value)
    return len(found)


def test_motion_of_a_jeffcott_rotor_with_a_stop_is_that_of_one_mass(folder):
    stop = "clearance=0.5e-3, stiffness=1.0e6"
    load = "&load on='{0}', amplitude=60.0, frequency=12.0 /\n&initial on='{0}', displacement=1.0e-3, velocity=0.1 /\n"
    more = "&motion t_end=0.3, start='given' /\n&record observable='displacement', of='{0}', what='extrema' /\n"
    shaft = result("razy-run", rotor(
        PINNED + load.format("r.3.v") + more.format("r.3.v")
        + f"&stop name='s', between='r.3','frame', direction=0.0,-1.0,0.0, {stop} /\n"
    ), "shaft")  # fmt: skip
    lumped = f"""&scene kind='lumped' /
&mass name='m', value={MASS} /
&spring between='m','frame', stiffness={STIFFNESS!r} /
&stop name='s', between='m','frame', {stop} /
{load.format("m")}{more.format("m")}"""
    lumped = result("razy-run", lumped, "lumped")
    assert shaft["outcome/events"] == lumped["outcome/events"] > 10
    right = lumped["extrema/displacement.m/value"]
    assert shaft["extrema/displacement.r.3.v/value"] == pytest.approx(right, rel=1e-9)


REFUSED = {
    "damper": ("&bearing shaft='r', node=2, kind='matrix', stiffness=1e5,0.0,0.0,1e5, damping_matrix=9.0,0.0,0.0,9.0 /",
               "'r.2.v' has no mass or inertia, so that only springs may act on it"),
    "stop": ("&stop name='s', between='r.2','frame', direction=0.0,1.0,0.0, clearance=1e-3, stiffness=1e6 /",
             "nodes with mass and polar inertia, such as a &disk gives them"),
    "twist": ("&stop name='s', between='r.3','frame', twist=.true., direction=0.0,1.0,0.0, clearance=1e-3 /",
              "&stop direction = 0.0, 1.0, 0.0: left out where twist is .true."),
    "no twist": ("&stop name='s', between='r.3','frame', twist=.true., clearance=1e-3, stiffness=1e6 /",
                 "&stop between = 'r.3', 'frame': with an end that can move there"),
    "load": ("&load on='r.2.v', value=1.0 /", "a coordinate with mass or inertia, such as a &disk gives the node"),
    "unbalance": ("&unbalance shaft='r', node=2, moment=1e-3 /\n&rotation speed_rpm=9.0 /",
                  "unbalance; give the node a &disk"),
    "reduction": ("&reduction modes=2 /", "coordinates without mass are condensed"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_refused(folder, what):
    more, message = REFUSED[what]
    (folder / "case.nml").write_text(rotor(PINNED + more + "\n&motion t_end=0.1 /\n"))
    done = start("razy-run", "case.nml")
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_no_mass_at_all_is_refused(folder):
    text = rotor(PINNED + "&motion t_end=0.1 /\n")
    (folder / "case.nml").write_text("".join(line for line in text.splitlines(True) if not line.startswith("&disk")))
    for program in ("razy-run", "razy-modes"):
        done = start(program, "case.nml")
        assert done.returncode == 2
        assert "case.nml:2: &shaft: nothing has mass or inertia: give a node a &disk with it" in done.stderr


def test_what_nothing_holds_and_no_mass_moves_is_refused(folder):
    (folder / "case.nml").write_text(rotor(PINNED + "&motion t_end=0.1 /\n", freedom=""))
    done = start("razy-run", "case.nml")
    assert done.returncode == 2
    assert "phi' is free to move without mass or inertia" in done.stderr


LAWS = {
    "elastic": "clearance=0.01, stiffness=4.0e4, damping=8.0",
    "rigid": "clearance=0.01, law='rigid', restitution=0.6",
    "table": "clearance=0.005, law='table', displacement=0.0,0.02,0.04, force=0.0,50.0,900.0",
}


@pytest.mark.parametrize("law", LAWS)
def test_coupling_with_play(folder, law):
    """Shafts that twist, joined by a coupling with play, beside the inertias and springs that they are."""
    stiffness = 8e10 * np.pi * DIAMETER**4 / 32 / np.array([0.5, 0.7])
    inertia = {"motor": 0.08, "hub": 0.01, "other hub": 0.013, "load": 0.2}
    places = dict(zip(inertia, ("a.1", "a.2", "b.1", "b.2"), strict=True))
    shafts = "&scene kind='rotor' /\n&freedom axial=.false., bending=.false. /\n"
    lumped = ""
    for name, length in (("a", 0.5), ("b", 0.7)):
        shafts += f"&shaft name='{name}', young_modulus={E}, shear_modulus=8e10, density=0.0 /\n"
        shafts += f"&section shaft='{name}', length={length}, outer_diameter={DIAMETER}, elements=1 /\n"
    for name, value in inertia.items():
        shaft, node = places[name].split(".")
        shafts += f"&disk shaft='{shaft}', node={node}, mass=1.0, polar_inertia={value}, diametral_inertia=1.0 /\n"
        lumped += f"&inertia name='{name}', value={value} /\n"
    for ends, k in zip(("'motor','hub'", "'other hub','load'"), stiffness, strict=True):
        lumped += f"&spring between={ends}, stiffness={float(k)!r} /\n"
    stop = "&stop name='play', between={}, {}, {} /\n"
    shafts += stop.format("'a.2','b.1'", "twist=.true.", LAWS[law])
    lumped += stop.format("'hub','other hub'", "side='both'", LAWS[law])
    found = []
    for text, names in (
        (shafts, {key: f"{place}.phi" for key, place in places.items()}),
        (lumped, dict.fromkeys(places)),
    ):
        names = {key: name or key for key, name in names.items()}
        text += f"&load on='{names['motor']}', value=2.0, amplitude=60.0, frequency=7.0 /\n"
        text += f"&load on='{names['load']}', value=-3.0 /\n"
        text += f"&initial on='{names['motor']}', velocity=3.0 /\n&motion t_end=0.15, start='given' /\n"
        text += "&record observable='relative_displacement', of='play', what='extrema' /\n"
        text += f"&record observable='displacement', of='{names['load']}', what='trajectory', interval=0.01 /\n"
        found.append(result("razy-run", text, f"case{len(found)}"))
    shaft, twin = found
    # As far as the motion is not chaotic; where the force is 0 for a while its extremum may be anywhere.
    assert min(shaft["outcome/events"], twin["outcome/events"]) >= 8
    for name, count in (("event/time", 8), ("extrema/relative_displacement.play/value", 8)):
        assert shaft[name][:count] == pytest.approx(twin[name][:count], rel=1e-9)
    right = twin["observable/displacement.load"]
    assert shaft["observable/displacement.b.2.phi"][:8] == pytest.approx(right[:8], rel=1e-9, abs=1e-15)
