"""What razy-modes finds, says and writes."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from programs import SOURCE, modes, sets, start, succeed

GEARBOX = SOURCE / "inputs" / "test_gearbox.nml"
UNREDUCED = ("--set", "reduction%method='none'")
OPEN = ("--set", "modes%contacts='open'")


def test_natural_modes_of_the_gearbox():
    """Numbers computed independently of this project."""
    case, few = SOURCE / "inputs" / "thesis" / "table_4_2.nml", sets(modes__count=30)
    said, data = modes(case, *UNREDUCED, *few, *sets(modes__contacts="closed"))
    frequency = data["frequency"][0]
    np.testing.assert_allclose(frequency[[3, 7, 11, 15]], [598.42, 1953.99, 2464.35, 3519.48], atol=0.006)
    main = np.argmax(np.abs(data["mesh_deformation"][:, 0]))
    assert frequency[main] == pytest.approx(4218.8, abs=0.06)
    assert abs(data["mesh_deformation"][main, 0]) == pytest.approx(1.13, abs=0.006)
    np.testing.assert_allclose(data["energy_share"].sum(axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(data["strain_share"].sum(axis=1), 1.0, rtol=1e-9)
    assert data["shape"].shape == (30, 178) and data["coordinate"][44] == b"input.8.phi"
    assert "mode 3: 432.553 Hz, torsion 100 %; input 50 %; output 50 %" in said.splitlines()
    _, data = modes(case, *UNREDUCED, *few, *OPEN)
    twins = [366.48, 366.48, 432.55, 432.55, *4 * [653.35], *4 * [1999.17], *4 * [2524.98]]
    np.testing.assert_allclose(data["frequency"][0, :16], twins, atol=0.009)


def test_critical_speeds_and_stability_without_mesh():
    said, data = modes(
        GEARBOX,
        *UNREDUCED,
        *OPEN,
        *sets(modes__count=8, campbell__points=4, campbell__orders=1.0, rotation__circulatory=".true."),
    )
    forward = data["critical_speed"][data["critical_direction"] > 0.99]
    np.testing.assert_allclose(forward, 4126.7, atol=0.06)
    np.testing.assert_allclose(data["critical_speed"], 2 * np.pi * data["critical_frequency"], rtol=1e-9)
    assert data["stability_limit"] == pytest.approx(forward[0], rel=1e-6)
    assert "stability limit: 4126.667 rad/s = 39406.77 rpm, 656.779 Hz" in said
    # Gyroscopic moments raise the forward frequency.
    backward = data["critical_speed"][data["critical_direction"] < -0.99]
    assert backward.max() < forward.min()


JEFFCOTT = """&scene kind='rotor' /
&shaft name='r', young_modulus=2.11e11, shear_modulus=8.12e10, density=1e-3 /
&section shaft='r', length=1.0, outer_diameter=0.03, elements={} /
&disk shaft='r', node={}, mass=20.0, polar_inertia=0.6, diametral_inertia=0.3 /
&bearing shaft='r', node=1, kind='matrix', stiffness=1e6,0.0,0.0,{} /
&bearing shaft='r', node={}, kind='matrix', stiffness=1e6,0.0,0.0,{} /
&freedom axial=.false., torsion=.false. /
&rotation speed_rpm=1000.0, gyroscopic=.false. /
&modes count=4 /
&campbell last_rpm=6000.0, points=7 /
"""


@pytest.mark.parametrize("elements", [4, 40])
def test_equal_frequencies_turn_backward_and_forward(elements):
    """Of planes that are alike any combination is a shape: those on circles are told, dense (4) and banded (40)."""
    path = Path("jeffcott.nml")
    path.write_text(JEFFCOTT.format(elements, elements // 2 + 1, 1e6, elements + 1, 1e6))
    said, data = modes(path)
    # Which of two equal frequencies comes first is rounding.
    for directions in (data["critical_direction"], *data["direction"]):
        np.testing.assert_allclose(np.sort(directions.reshape(2, 2)), [[-1, 1], [-1, 1]], atol=1e-9)
    assert said.count("Hz, forward") == said.count("Hz, backward") == 2
    # Planes that differ have shapes of their own, on straight lines.
    path.write_text(JEFFCOTT.format(elements, elements // 2 + 1, 1.1e6, elements + 1, 1.1e6))
    said, data = modes(path)
    np.testing.assert_allclose(data["critical_direction"], 0, atol=1e-9)
    assert said.count("Hz, no whirl") == 4


LIGHT = """&shaft name='s', young_modulus=2.1e11, shear_modulus=8.0e10, density={density}, {damping} /
&section shaft='s', length=1.0, elements={elements}, outer_diameter=0.02 /
&disk shaft='s', node={quarter}, mass=5.0, polar_inertia=0.02, diametral_inertia=0.01 /
&disk shaft='s', node={middle}, mass=10.0, polar_inertia=0.1, diametral_inertia=0.05 /
&freedom axial=.false., torsion=.false. /
&bearing shaft='s', node=1, kind='matrix', stiffness=1.0e6,0.0,0.0,1.5e6 /
&bearing shaft='s', node={last}, kind='matrix', stiffness=1.0e6,0.0,0.0,1.5e6 /
&rotation speed_rpm=1500.0 /
&campbell first_rpm=0.0, last_rpm=12000.0, points=5 /
&modes count=4 /
"""


@pytest.mark.parametrize("damping", ["damping_ratio=0.0", "damping_ratio=0.01, damping='proportional'"])
@pytest.mark.parametrize("elements", [4, 20, 28, 40])
def test_a_shaft_of_hardly_any_mass(elements, damping):
    """Its own modes are up to 1e10 times as fast as those of the disks, which are those of a shaft without mass."""
    path = Path("light.nml")
    undamped = damping == "damping_ratio=0.0"
    found = {}
    for density, n in ((1e-6, elements), (1e-9, elements), (0.0 if undamped else 1e-7, 12)):
        nodes = {"elements": n, "quarter": n // 4 + 1, "middle": n // 2 + 1, "last": n + 1}
        path.write_text(LIGHT.format(density=density, damping=damping, **nodes))
        said, data = modes(path)
        assert "undecided" not in said
        data["eigenvalue"] = data["eigenvalue"] @ [1, 1j]
        found[density] = data
    right = data
    for density in (1e-6, 1e-9):
        for name in ("natural_frequency", "critical_speed", "eigenvalue"):
            np.testing.assert_allclose(found[density][name], right[name], rtol=1e-7, atol=0)


def test_stability_limit_between_any_speeds():
    """Between speeds so far apart that the shapes of one are not those of another it is there all the same."""
    text = ["&scene kind='rotor' /"]
    text += [
        "&shaft name='r', young_modulus=2.1e11, shear_modulus=8e10, density=7850, damping_ratio=.035, damping='nodal' /"
    ]
    for length, diameter in ((0.185, 0.0343), (0.0621, 0.0401), (0.201, 0.0567), (0.171, 0.0513)):
        text += [f"&section shaft='r', length={length}, outer_diameter={diameter}, elements=1 /"]
    text += ["&disk shaft='r', node=1, mass=14.6, polar_inertia=0.134, diametral_inertia=0.0715 /"]
    text += ["&disk shaft='r', node=5, mass=7.23, polar_inertia=0.0887, diametral_inertia=0.0759 /"]
    for node, stiffness, damping in ((2, "1.883e7,0,0,1.883e7", 182), (3, "1.666e6,1.107e5,-1.107e5,2.89e6", 5080)):
        bearing = f"&bearing shaft='r', node={node}, kind='matrix', stiffness={stiffness}"
        text += [f"{bearing}, damping_matrix={damping},0,0,{damping} /"]
    text += ["&support shaft='r', node=1, held='u','phi' /", "&rotation speed_rpm=1000, circulatory=.true. /"]
    text += ["&modes count=8 /", "&campbell last_rpm=40000, points=201, orders=1.0, damped=.true. /"]
    Path("whirls.nml").write_text("\n".join(text) + "\n")
    limits = [
        modes(Path("whirls.nml"), *sets(campbell__points=points))[1]["stability_limit"] for points in (3, 5, 6, 201)
    ]
    np.testing.assert_allclose(limits, 59.755005308, rtol=1e-9)


def test_stability_with_mesh():
    case = SOURCE / "inputs" / "thesis" / "fig_4_13.nml"
    options = sets(reduction__modes=60, campbell__points=6, campbell__orders=1.0)
    _, data = modes(case, *options)
    assert data["stability_limit"] == pytest.approx(4009.0, abs=0.6)
    _, data = modes(case, *options, *sets(rotation__circulatory=".false.", campbell__last_rpm=286479.0))
    assert np.isnan(data["stability_limit"])
    with h5py.File("modes.h5") as file:
        assert file["stability_limit"].attrs["meaning"] == "none up to the last speed"


def test_campbell_diagram():
    """Branches are smooth curves through all crossings, although their places in the order change."""
    _, data = modes(GEARBOX, *sets(campbell__points=91, campbell__last_rpm=150000, campbell__orders=1.0))
    speed, frequency, branch = data["speed"], data["frequency"], data["branch"]
    assert speed[-1] == pytest.approx(5000 * np.pi)
    assert np.all(np.diff(frequency, axis=1) >= 0)
    np.testing.assert_allclose(frequency[0], data["natural_frequency"], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(data["eigenvalue"][:, :, 1], 2 * np.pi * frequency, rtol=1e-15)
    crossed = 0
    for number in range(1, 16):
        rows, places = np.nonzero(branch == number)
        curve = frequency[rows, places]
        assert np.abs(np.diff(curve, n=2)).max() < 0.004 * curve.mean()
        crossed += len(set(places)) > 1
    assert crossed > 0


def test_half_the_critical_speed_at_twice_the_order():
    """Twist does not feel rotation: critical speeds are its frequency over the order."""
    _, data = modes(GEARBOX, *OPEN, *sets(campbell__points=3, campbell__orders="2.0,40.0"))
    excitation = data["critical_order"] * data["critical_speed"]
    np.testing.assert_allclose(excitation, 2 * np.pi * data["critical_frequency"], rtol=1e-9)
    for order in (2.0, 40.0):
        found = data["critical_speed"][data["critical_order"] == order]
        assert np.isclose(found, 2 * np.pi * data["natural_frequency"][2] / order, rtol=1e-9).sum() == 2


@pytest.mark.parametrize("k1, table", [
    (None, [39.22, 53.25, 80.61, 107.57, 126.70, 153.59, 206.92, 225.08, 272.50]),
    (8.95577e7, [50.00, 59.18, 80.66, 107.57, 126.75, 156.01, 225.08, 240.61, 272.52]),
])  # fmt: skip
def test_the_vibropress(k1, table):
    options = [] if k1 is None else sets(**{"spring(1)__stiffness": k1})
    _, data = modes(SOURCE / "inputs" / "thesis" / "table_4_3.nml", *options)
    np.testing.assert_allclose(data["frequency"], [table], atol=0.006)
    assert data["eigenvalue"].shape[0] == 1 and np.all(data["eigenvalue"][0, :, 0] <= 0)


def test_the_gear_pair():
    _, data = modes(SOURCE / "inputs" / "torsional_gear_pair.nml")
    np.testing.assert_allclose(data["frequency"][0], [0.0, 125.84, 465.42, 5733.11], atol=0.01)
    with xarray.open_dataset("modes.h5") as file:
        assert file["frequency"].dims == ("speed", "mode") and file["frequency"].units == "Hz"


@pytest.mark.parametrize("option, words", [
    ("modes%contacts='equilibrium'", "'open' or 'closed' in a rotor scene"),
    ("campbell%last_rpm=0.0", "must be a positive"),
    ("campbell%first_rpm=70000.0", "more than the first speed"),
    ("gear_mesh%node=8,16", "1 to 15 on output"),
])  # fmt: skip
def test_bad_input(option, words):
    done = start("razy-modes", GEARBOX, "--set", option)
    assert done.returncode == 2 and words in done.stderr and done.stderr.count("\n") == 1


OVERHUNG = """
&scene     kind='rotor', title='Overhung rotor' /
&shaft     name='rotor', young_modulus=2.1e11, shear_modulus=8.0e10, density=7850.0 /
&section   shaft='rotor', length=0.6, outer_diameter=0.03, elements=8 /
&disk      shaft='rotor', node=9, mass=4.0, polar_inertia=2.0e-2, diametral_inertia=1.0e-2 /
&bearing   shaft='rotor', node=1, kind='matrix', stiffness={0},{0},{0},0.0,0.0,0.0 /
&bearing   shaft='rotor', node=6, kind='matrix', stiffness=0.0,{0},{0},0.0,0.0,0.0 /
&support   shaft='rotor', node=1, held='phi' /
"""


def test_a_stiff_bearing_holds_or_is_refused(folder):
    (folder / "stiff.nml").write_text(OVERHUNG.format(1e14))
    held = OVERHUNG.format(0.0).replace(
        "held='phi' /", "held='phi','u','v','w' /\n&support shaft='rotor', node=6, held='v','w' /"
    )
    (folder / "held.nml").write_text(held)
    for name in ("stiff", "held"):
        succeed("razy-modes", f"{name}.nml")
    with h5py.File("stiff.h5") as stiff, h5py.File("held.h5") as held:
        assert np.allclose(stiff["natural_frequency"][:6], held["natural_frequency"][:6], rtol=3e-6)
    for stiffness in (1e18, 1e20, 1e22):
        (folder / "stiff.nml").write_text(OVERHUNG.format(stiffness))
        done = start("razy-modes", "stiff.nml", "--force")
        assert done.returncode == 2
        assert " stiffness = " in done.stderr and "hold the node by &support" in done.stderr


def test_damping_of_machines_and_rotors(folder):
    path = folder / "chain.nml"
    path.write_text("""
&scene   kind='lumped' /
&mass    name='block', value=2.0 /
&mass    name='slow', value=1.0 /
&spring  between='block','frame', stiffness=2.0e4, damping=8.0 /
&damper  between='slow','frame', damping=5.0 /
&modes   contacts='open' /
""")
    said, data = modes(path)
    ratio = 8.0 / (2 * np.sqrt(2.0 * 2.0e4))
    decrement = 2 * np.pi * ratio / np.sqrt(1 - ratio**2)
    vibrates = np.isfinite(data["logarithmic_decrement"])
    assert vibrates.sum() == 1
    assert data["logarithmic_decrement"][vibrates] == pytest.approx(decrement, rel=1e-9)
    assert data["damping_ratio"][vibrates] == pytest.approx(ratio, rel=1e-9)
    hertz = 100.0 / (2 * np.pi) * np.sqrt(1 - ratio**2)
    line = f"damped: {hertz:.3f} Hz, damping ratio {ratio:.6f}, logarithmic decrement {decrement:.6f}"
    assert [text for text in said.splitlines() if "damped" in text] == [line]
    said, _ = modes(path, *sets(spring__damping=0.0, damper__damping=0.0))
    assert "damped" not in said
    _, data = modes(GEARBOX, *UNREDUCED, *OPEN, *sets(modes__count=4, campbell__points=2, campbell__orders=1.0))
    real, imaginary = np.moveaxis(data["eigenvalue"], -1, 0)
    np.testing.assert_allclose(data["damping_ratio"], -real / np.hypot(real, imaginary), rtol=1e-12)
