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
