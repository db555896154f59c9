"""Machines of parts that do not touch each other: each moves as it does alone."""

from pathlib import Path

import h5py
import numpy as np
from programs import SOURCE, succeed

BUSH = (SOURCE / "inputs" / "bush.nml").read_text()
HOPPER = """
&body name='block', mass=2.0, inertia=1.0, held='x','phi', centre=1.0,0.0 /
&spring between='block','frame', direction=0.0,1.0, stiffness=2.0e4, damping=8.0 /
&stop name='bumper', between='block','frame', direction=0.0,1.0, clearance=1.0e-3, stiffness=1.0e6, damping=50.0 /
&load on='block.y', amplitude=30.0, frequency=14.0 /
"""
MOTION = "&motion t_end=0.6, start='zero' /\n"
LOOKS = "&record observable='displacement', of='block.y', what='trajectory', from=0.3, interval=2.0e-4 /\n"


def run(name, text):
    Path(f"{name}.nml").write_text(text)
    succeed("razy-run", f"{name}.nml", "--set", "motion%integrator='dop853'")
    with h5py.File(f"{name}.h5") as file:
        return {key: value[()] for key, value in file["observable"].items()}


def test_a_stop_beside_a_ring():
    both, pin, block = run("both", BUSH + HOPPER + LOOKS), run("pin", BUSH), run("block", HOPPER + MOTION + LOOKS)
    for key in ("displacement.pin.x", "displacement.pin.y", "contact_force.bush"):
        np.testing.assert_allclose(both[key], pin[key], rtol=1e-6, atol=1e-6 * np.abs(pin[key]).max())
    alone = block["displacement.block.y"]
    np.testing.assert_allclose(both["displacement.block.y"], alone, rtol=1e-6, atol=1e-6 * np.abs(alone).max())
    assert np.ptp(alone) > 1e-3 and pin["contact_force.bush"].max() > 0


WHIRLER = """
&shaft name='{0}', young_modulus=2.1e11, poisson_ratio=0.3, density=7800.0 /
&section shaft='{0}', length=1.0, outer_diameter=0.05, elements=2 /
&bearing shaft='{0}', node=1, kind='matrix', stiffness=1e6,{1},{2},1e6 /
&bearing shaft='{0}', node=3, kind='matrix', stiffness=1e6,{1},{2},1e6 /
"""


def test_what_grows_beside_contacts(folder):
    """A shaft that its bearings drive, and that no contact feels, whirls ever wider beside one that hits a stop."""
    growing = WHIRLER.format("a", "1e5", "-1e5")
    start = "&freedom axial=.false., torsion=.false. /\n&motion t_end=1.0, start='given', integrator='exact' /\n"
    looks = (
        "&initial on='a.2.v', displacement=1e-6 /\n"
        "&record observable='displacement', of='a.2.v', what='trajectory', from=0.5, interval=1e-3 /\n"
    )
    stop = "&stop name='s', between='b.2','frame', direction=0.0,-1.0,0.0, clearance=1e-5, stiffness=1e6 /\n"
    stop += "&initial on='b.2.v', displacement=2e-5 /\n"
    found = {}
    for name, text in (("alone", growing), ("beside", growing + WHIRLER.format("b", "0.0", "0.0") + stop)):
        Path(f"{name}.nml").write_text(text + start + looks)
        succeed("razy-run", f"{name}.nml")
        with h5py.File(f"{name}.h5") as file:
            found[name] = file["observable/displacement.a.2.v"][()]
    assert np.abs(found["alone"]).max() > 1e-4
    np.testing.assert_allclose(found["beside"], found["alone"], atol=1e-10 * np.abs(found["alone"]).max())


CRITICAL = """&scene kind='lumped' /
&mass name='a', value=1.0 /
&spring between='a','frame', stiffness=30.0, damping=0.3 /
&stop name='wall', between='a','frame', clearance=0.05, stiffness=1000.0, damping=1.0 /
&load on='a', amplitude=3.0, angular_frequency=4.0 /
&motion t_end=6.0, start='given', integrator='exact' /
"""


def test_critical_damping_beside_a_contact(folder):
    """Two bodies whose eigenvalues are double, which the contact does not feel, against the closed form."""
    bodies, text = {"b": (1.0, 2.0, 2.0, 1.5, 0.3, -1.0), "c": (2.0, 3.0, 1.0, 2.5, -0.2, 0.5)}, CRITICAL
    for name, (m, rate, force, omega, x, v) in bodies.items():
        text += f"""&mass name='{name}', value={m} /
&spring between='{name}','frame', stiffness={m * rate**2}, damping={2 * m * rate} /
&load on='{name}', amplitude={force}, angular_frequency={omega} /
&initial on='{name}', displacement={x}, velocity={v} /
&record observable='displacement', of='{name}', what='trajectory', interval=0.25 /
"""
    (folder / "critical.nml").write_text(text)
    succeed("razy-run", "critical.nml")
    with h5py.File("critical.h5") as file:
        t, found = file["time"][()], {name: file[f"observable/displacement.{name}"][()] for name in bodies}
        assert file["outcome/events"][0] > 10
    for name, (m, rate, force, omega, x, v) in bodies.items():
        phasor = force / (m * (rate + 1j * omega) ** 2)
        x, v = x - phasor.imag, v - (1j * omega * phasor).imag
        expected = np.exp(-rate * t) * (x + (v + rate * x) * t) + (phasor * np.exp(1j * omega * t)).imag
        np.testing.assert_allclose(found[name], expected, atol=1e-11)
