"""Gear meshes of planar bodies: their rows by what defines them, planetary gears by an assembly of their own."""

import re

import h5py
import numpy as np
import pytest
from programs import SOURCE, run, start, succeed
from scipy.linalg import eigh

SCENE = """&scene kind='planar' /
&body name='a', mass=1.0, inertia=0.01, centre=0.01,-0.02 /
&body name='b', mass=2.0, inertia=0.02, centre={place[0]!r},{place[1]!r} /
&gear_mesh name='m', between='a','b', kind='{kind}', drive='{drive}', radius={radius[0]},{radius[1]},
           teeth={teeth[0]},{teeth[1]}, stiffness=1e6{more} /
"""
MOTION = """&initial on='{on}', displacement=1e-3 /
&motion t_end=1e-9, start='given' /
&record observable='mesh_deformation', what='trajectory', interval=1e-9 /
"""


@pytest.mark.parametrize(
    ("kind", "drive", "radius"),
    [
        ("external", "positive", (0.03, 0.05)),
        ("external", "negative", (0.05, 0.03)),
        ("internal", "positive", (0.03, 0.09)),
        ("internal", "negative", (0.09, 0.03)),
    ],
)
def test_row_of_a_mesh(folder, kind, drive, radius):
    """Rigid motion of both bodies does not stretch it, both arms are base radii, and it drives the wheels apart."""
    sign, way = (1 if kind == "external" else -1), (1 if drive == "positive" else -1)
    pressure = np.radians(23.0)
    line = np.array([np.cos(0.7), np.sin(0.7)])
    centre = np.array([0.01, -0.02])
    place = centre + abs(radius[0] + sign * radius[1]) / np.cos(pressure) * line
    place = place.tolist()
    teeth = [round(1000 * r) for r in radius]
    text = SCENE.format(place=place, kind=kind, drive=drive, radius=radius, teeth=teeth, more="")
    w = {}
    for body in "ab":
        for component in ("x", "y", "phi"):
            (folder / "pair.nml").write_text(text + MOTION.format(on=f"{body}.{component}"))
            w[body, component] = np.ravel(run("pair.nml")["observable/mesh_deformation"])[0] / 1e-3
    n = np.array([w["a", "x"], w["a", "y"]])
    assert np.linalg.norm(n) == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose([w["b", "x"], w["b", "y"]], -n, rtol=1e-12)
    assert w["a", "phi"] == pytest.approx(way * radius[0], rel=1e-12)
    assert w["b", "phi"] == pytest.approx(sign * way * radius[1], rel=1e-12)
    # Both turn about the origin by the same angle: u = angle (-y, x).
    turned = np.dot(n, [-centre[1], centre[0]]) - np.dot(n, [-place[1], place[0]]) + w["a", "phi"] + w["b", "phi"]
    assert abs(turned) < 1e-15
    assert np.dot(n, line) == pytest.approx(sign * np.sin(pressure), rel=1e-9)


def test_axis_beside_the_centre_of_mass(folder):
    """The row of a point of the body: an arm more, by which its turning moves the axis."""
    text = SCENE.format(
        place=[0.09, 0.03], kind="external", drive="positive", radius=(0.03, 0.05), teeth=(30, 50), more=""
    )
    beside = text.replace(
        "centre=0.01,-0.02 /", "centre=0.0,0.0 /\n&point name='axis', body='a', position=0.01,-0.02 /"
    )
    rows = []
    for case in (text, beside.replace("between='a'", "between='axis'")):
        rows.append([])
        for on in ("a.x", "a.y", "a.phi", "b.x", "b.y", "b.phi"):
            (folder / "pair.nml").write_text(case + MOTION.format(on=on))
            rows[-1].append(np.ravel(run("pair.nml")["observable/mesh_deformation"])[0] / 1e-3)
    row = np.array(rows[0])
    row[2] += 0.01 * row[1] + 0.02 * row[0]
    np.testing.assert_allclose(rows[1], row, atol=1e-14)


# Lin and Parker, J. Vib. Acoust. 121 (1999): kg, kg m² over the squared radius, N/m, and the pressure angle.
MASS = {"carrier": 5.43, "ring": 2.35, "sun": 0.4, "planet": 0.66}
ROTARY = {"carrier": 6.29, "ring": 3.0, "sun": 0.39, "planet": 0.61}
BEARING, MESH, TURNING, PRESSURE = 1e8, 5e8, 1e9, np.radians(24.6)
RADIUS = {"sun": 0.03871, "planet": 0.050175}
ARM = float((RADIUS["sun"] + RADIUS["planet"]) / np.cos(PRESSURE))
RADIUS |= {"ring": RADIUS["sun"] + 2 * RADIUS["planet"], "carrier": ARM}


GROUP = """&planetary planets={planets}, teeth={teeth}, radius=0.03871,0.050175,0.13906, distance={arm!r},
  mass=5.43,2.35,0.4,0.66, inertia={inertia}, bearing={bearing}, ring_stiffness={turning!r}, stiffness=5e8,5e8{more} /
&modes count=100, contacts='closed' /
"""


def group(planets, teeth="27,35,97", more="", bearing="1e8,1e8,1e8,1e8"):
    inertia = ",".join(repr(float(ROTARY[k] * RADIUS[k] ** 2)) for k in ("carrier", "ring", "sun", "planet"))
    turning = float(TURNING * RADIUS["ring"] ** 2)
    values = {"arm": ARM, "inertia": inertia, "turning": turning, "bearing": bearing}
    return GROUP.format(planets=planets, teeth=teeth, more=more, **values)


def case(planets):
    lines = ["&scene kind='planar' /", "&modes count=100, contacts='closed' /"]
    held = [f"direction={d}, stiffness={BEARING!r} /" for d in ("1.0,0.0", "0.0,1.0")]

    def body(name, kind, x=0.0, y=0.0):
        inertia = ROTARY[kind] * RADIUS[kind] ** 2
        lines.append(f"&body name='{name}', mass={MASS[kind]}, inertia={inertia!r}, centre={x!r},{y!r} /")

    def point(name, of, x, y):
        lines.append(f"&point name='{name}', body='{of}', position={x!r},{y!r} /")

    for name in ("carrier", "ring", "sun"):
        body(name, name)
    lines.extend(f"&spring between='{name}','frame', {way}" for name in ("carrier", "sun") for way in held)
    # On a circle of √5 of the base radius the same springs hold the ring's angle with TURNING.
    out = float(RADIUS["ring"] * np.sqrt(TURNING / (2 * BEARING)))
    for name, x, y in (("east", out, 0.0), ("west", -out, 0.0), ("north", 0.0, out), ("south", 0.0, -out)):
        point(name, "ring", x, y)
    lines.append(f"&spring between='north','frame','south','frame', {held[0]}")
    lines.append(f"&spring between='east','frame','west','frame', {held[1]}")
    for p in range(planets):
        x, y = (float(ARM * f(2 * np.pi * p / planets)) for f in (np.cos, np.sin))
        body(f"p{p}", "planet", x, y)
        point(f"pin{p}", "carrier", x, y)
        lines.extend(f"&spring between='p{p}','pin{p}', {way}" for way in held)
        lines.append(
            f"&gear_mesh name='s{p}', between='sun','p{p}', teeth=27,35, stiffness={MESH!r}, "
            f"radius={RADIUS['sun']!r},{RADIUS['planet']!r} /"
        )
        lines.append(
            f"&gear_mesh name='r{p}', between='p{p}','ring', kind='internal', drive='negative', "
            f"radius={RADIUS['planet']!r},{RADIUS['ring']!r}, teeth=35,97, stiffness={MESH!r} /"
        )
    return "\n".join(lines) + "\n"


def frequencies(planets):
    """Equations (1) to (4) in polar coordinates of each planet, angles times radii: Hz."""
    n = 9 + 3 * planets
    stiffness = np.zeros((n, n))
    first = {"carrier": 0, "ring": 3, "sun": 6}
    mass = np.concatenate([[MASS[k], MASS[k], ROTARY[k]] for k in [*first, *planets * ["planet"]]])

    def add(k, **parts):
        row = np.zeros(n)
        for name, values in parts.items():
            at = first.get(name, q)
            row[at : at + 3] = values
        stiffness[:] += k * np.outer(row, row)

    q = 0
    for name in first:
        add(BEARING, **{name: [1, 0, 0]})
        add(BEARING, **{name: [0, 1, 0]})
    add(TURNING, ring=[0, 0, 1])
    sin, cos = np.sin(PRESSURE), np.cos(PRESSURE)
    for p in range(planets):
        psi, q = 2 * np.pi * p / planets, 9 + 3 * p
        s, r = psi - PRESSURE, psi + PRESSURE
        add(MESH, sun=[-np.sin(s), np.cos(s), 1], planet=[-sin, -cos, 1])
        add(MESH, ring=[-np.sin(r), np.cos(r), 1], planet=[sin, -cos, -1])
        add(BEARING, carrier=[np.cos(psi), np.sin(psi), 0], planet=[-1, 0, 0])
        add(BEARING, carrier=[-np.sin(psi), np.cos(psi), 1], planet=[0, -1, 0])
    return np.sqrt(np.abs(eigh(stiffness, np.diag(mass), eigvals_only=True))) / (2 * np.pi)


@pytest.mark.parametrize(
    ("planets", "text"), [(n, case(n)) for n in (3, 4, 5)] + [(4, group(4)), (5, group(5, teeth="81,105,289"))]
)
def test_planetary_gear(folder, planets, text):
    """All frequencies, and how often each comes: six once, six twice, three as often as planets beyond three."""
    (folder / "planetary.nml").write_text(text)
    succeed("razy-modes", "planetary.nml", "--output", "modes.h5")
    with h5py.File("modes.h5") as file:
        found = np.sort(np.ravel(file["frequency"][()]))
    expected = frequencies(planets)
    assert len(found) == 9 + 3 * planets
    np.testing.assert_allclose(found[1:], expected[1:], rtol=1e-9)
    assert found[0] == 0.0
    groups = np.split(found, 1 + np.flatnonzero(np.diff(found) > 1e-6 * found[-1]))
    times = sorted(len(group) for group in groups)
    assert times == sorted([1] * 6 + [2] * 6 + [planets - 3] * 3 * (planets > 3))
    if planets == 3:
        once = [0.0, 1475.7, 1930.3, 2658.3, 7462.8, 11775.3]
        np.testing.assert_allclose([group[0] for group in groups if len(group) == 1], once, atol=0.06)


def test_gallery(folder):
    """With as many teeth in mesh always the mesh forces carry the torque: each planet has its share, twice."""
    text = (SOURCE / "inputs" / "planetary.nml").read_text()
    for old, new in (
        ("what='extrema', from=0.08", "what='trajectory', interval=0.01"),
        ("=1.6,1.8,", "=1.0,1.0,"),
    ):
        assert old in text
        text = text.replace(old, new)
    (folder / "planetary.nml").write_text(text)
    found = run("planetary.nml")
    for name in ("s1", "r1"):
        force = np.ravel(found[f"observable/contact_force.{name}"])
        np.testing.assert_allclose(force, 500.0 / (4 * 0.03871), rtol=1e-9)


def test_group_becomes_bodies_and_meshes(folder):
    """The phases are those of the teeth at the planets' places; what is shown is itself an input."""
    text = group(3, "81,105,291", ", angles=0,120,210, contact_ratio=1.6,1.8, mesh_phase=10,180, name='a'")
    text += "&rotation speed_rpm=100.0, of='a_sun' /\n&motion t_end=0.1 /\n"
    (folder / "group.nml").write_text(text)
    shown = start("razy-run", "group.nml", "--check").stdout
    assert "&planetary" not in shown
    meshes = [mesh.split("/")[0] for mesh in shown.split("&gear_mesh")[1:]]
    phase = {re.search("name = '(.*)'", mesh)[1]: float(re.search("mesh_phase = (.*)", mesh)[1]) for mesh in meshes}
    for name, teeth, first in (("s", -81, 10.0), ("r", 291, 180.0)):
        for p, angle in enumerate((0, 120, 210), start=1):
            assert phase[f"a_{name}{p}"] == pytest.approx((first + teeth * angle) % 360, abs=1e-9)
    (folder / "shown.nml").write_text(shown)
    assert start("razy-run", "shown.nml", "--check").stdout == shown


WHEELS = ", radius=0.05,0.03, teeth=50,30, stiffness=1e8"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"planets": 5}, "such that the planets can be assembled"),
        ({"planets": 4, "more": ", angles=0,90,180,271"}, "they turn the sum of the teeth of sun and ring, 124, by"),
        ({"planets": 4, "more": ", angles=0,90,180"}, "4, one for each planet"),
        ({"planets": 31}, "so few that neighbours do not touch"),
        ({"planets": 4, "bearing": "1e8,0,1e8,1e8"}, "one of the ring too, where it has a ring_stiffness"),
        ({"planets": 4, "more": ", angle=0"}, "there is no such key; did you mean 'angles'?"),
        (
            {"planets": 4, "more": " /\n&sweep parameter='planetary%distance', first=0.1, last=0.2, points=2"},
            "it became",
        ),
        (
            {"planets": 4, "more": " /\n&motion t_end=1 /\n&gear_mesh name='x', between='p1','carrier'" + WHEELS},
            "a carrier is no wheel of the planets that it carries",
        ),
        ({"planets": 4, "teeth": "27,36,97"}, "&gear_mesh(1) radius = 0.03871, 0.050175: two radii in the ratio"),
    ],
)
def test_planets_refused(folder, change, said):
    (folder / "group.nml").write_text(group(**change))
    done = start("razy-sweep" if "sweep" in change.get("more", "") else "razy-run", "group.nml")
    assert done.returncode == 2 and said in done.stderr and done.stderr.startswith("group.nml:"), done.stderr


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"radius": (0.06, 0.09)}, "radius = 0.06, 0.09: base radii whose sum is less than the distance of"),
        ({"radius": (0.03, 0.06)}, "to a hundredth"),
        ({"more": ", error_sine=1e-6"}, "an error needs &rotation of a body that springs and meshes join to this one"),
        ({"kind": "internal", "radius": (0.05, 0.05), "teeth": (50, 50)}, "two different base radii where kind"),
        ({"more": " /\n&rotation speed_rpm=1.0, of='c'"}, "nothing that turns is named c"),
        ({"more": " /\n&gear_mesh name='n', between='a','c', radius=1,1, teeth=1,1, stiffness=1"}, "no body or point"),
        ({"more": " /\n&gear_mesh name='n', between='b','b', radius=1,1, teeth=1,1, stiffness=1"}, "two different bod"),
        (
            {
                "more": ", error_sine=1e-6 /\n&rotation speed_rpm=9.0, of='a' /\n"
                "&gear_mesh name='n', between='b','a', kind='internal', radius=0.05,0.03, teeth=50,30, stiffness=1e6"
            },
            "numbers with which the speeds of both agree",
        ),
    ],
)
def test_refused(folder, change, said):
    keys = {"kind": "external", "drive": "positive", "radius": (0.03, 0.05), "teeth": (30, 50), "more": ""} | change
    (folder / "pair.nml").write_text(SCENE.format(place=(0.1, 0.0), **keys) + MOTION.format(on="a.x"))
    done = start("razy-run", "pair.nml")
    assert done.returncode != 0 and said in done.stderr, done.stderr
